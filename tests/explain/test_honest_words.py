"""Sentences that would be false if one looked less closely."""

from __future__ import annotations

import numpy as np
from random_models import OBJECTIVES, Table, problem_of

from ratherthan.explain import explain
from ratherthan.explain.record import to_document
from ratherthan.factors import Search
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, evaluate, solve
from ratherthan.verify import Verdict, verify

COST = OBJECTIVES["least cost"]
END: dict[str, tuple[list[tuple[float, int]], float]] = {"end": ([(1.0, 2)], 0)}


def given(table: Table, choices: list[int], *, goals: list[int]) -> Solution:
    return evaluate(problem_of(table, COST, goals=goals), Policy(choice=np.array(choices)))


def confirmed(solution: Solution, **asked: object) -> str:
    """Return the text of an explanation that the re-checker confirms."""
    explanation = explain(solution, **asked)  # type: ignore[arg-type]
    text = narrate(explanation)
    verdicts = verify(to_document(explanation, text), solution.problem)
    assert [(c.what, c.where, c.reason) for c in verdicts.checks if c.verdict is Verdict.FAILS] == []
    assert not verdicts.undecided
    return text


def test_to_stay_for_ever_is_a_decision_like_any_other() -> None:
    table: Table = {0: {"g": ([(1.0, 1)], 1)}, 1: {"s": ([(1.0, 1)], 1), "g": ([(1.0, 2)], 1)}, 2: END}
    text = confirmed(given(table, [0, 1, 3], goals=[2]), kind="contrastive")
    assert text.startswith("We take s at critical state 1")
    assert "although taking g would lead to a route with less cost (1 instead of 2)" in text
    assert text.endswith("We never arrive: we stay at state 1 for ever.")


def test_to_stay_out_of_danger_for_ever_is_explained() -> None:
    table: Table = {
        0: {"a": ([(0.5, 0), (0.5, 1)], 1), "b": ([(1.0, 0)], 1)},
        1: {"end": ([(1.0, 1)], 0)},
    }
    solution = solve(problem_of(table, OBJECTIVES["least risk"], goals=[], hazards=[1]))
    assert confirmed(solution, kind="contrastive") == (
        "We take b at critical state 0 because it leads to the safest route. We stay at state 0 for ever."
    )


def test_claims_compare_action_values_whatever_decides_what_is_critical() -> None:
    table: Table = {
        0: {"cheap": ([(1.0, 1)], 1), "dear": ([(1.0, 3)], 10)},
        1: {"on": ([(1.0, 2)], 5)},
        2: END,
        3: {"on": ([(1.0, 2)], 1)},
    }
    solution = solve(problem_of(table, COST, goals=[2]))
    assert confirmed(solution, kind="responsibility", omega=True) == (
        "We take cheap at state 0 because it leads to the route with the least cost."
    )
    assert "(6 instead of 11)" in confirmed(solution, rather_than="dear", omega=True)


def test_a_close_alternative_does_not_hide_a_far_one() -> None:
    table: Table = {
        0: {"x": ([(1.0, 2)], 3), "y": ([(1.0, 2)], 2.999), "z": ([(1.0, 2)], 1)},
        1: {"end": ([(1.0, 2)], 0)},
        2: END,
    }
    text = confirmed(given(table, [0, 3, 4], goals=[2]), kind="responsibility")
    assert text == (
        "We take x at state 0 although taking y or taking z would lead to a route with less cost (1 at best instead of 3)."
    )


def test_a_threshold_is_not_rounded_down_in_words() -> None:
    table: Table = {
        0: {"x": ([(1.0, 2)], 1), "y": ([(1.0, 2)], 1.33333333)},
        1: {"end": ([(1.0, 2)], 0)},
        2: END,
    }
    text = confirmed(solve(problem_of(table, COST, goals=[2])), kind="selective", alpha=0.33333334)
    assert text == "No decision on this route changes the cost by more than 0.34."


def test_rounding_does_not_open_a_way_toward_the_goal() -> None:
    """0.1 + 0.2 and 0.3 are equal values: none is on the way to the other."""
    table: Table = {
        0: {"a": ([(1.0, 1)], 1), "b": ([(1.0, 3)], 2)},
        1: {"on": ([(1.0, 4)], 0), "off": ([(1.0, 2)], 5)},
        2: END,
        3: {"on": ([(1.0, 2)], 0.3)},
        4: {"on": ([(1.0, 3)], 0), "off": ([(1.0, 2)], 0.1 + 0.2)},
    }
    solution = solve(problem_of(table, COST, goals=[2]))
    confirmed(solution, rather_than="b", search=Search(toward_goal=True))


def test_a_branch_that_rounds_to_certainty_is_followed() -> None:
    table: Table = {0: {"go": ([(1.0, 1), (1e-17, 2)], 1)}, 1: {"go": ([(1.0, 2)], 1)}, 2: END}
    assert confirmed(solve(problem_of(table, COST, goals=[2])), kind="naive-path") == (
        "First, we take go at state 0. Finally, we take go at state 1."
    )


def test_other_words_than_the_models_are_noticed() -> None:
    table: Table = {0: {"east": ([(1.0, 2)], 1)}, 1: {"end": ([(1.0, 2)], 0)}, 2: END}
    plain = problem_of(table, COST, goals=[2])
    lying = Problem(mdp=plain.mdp, objective=COST, source="test", lexicon=Lexicon(actions={"east": "move west"}))
    explanation = explain(solve(lying), "naive-path")
    document = to_document(explanation, narrate(explanation))
    assert [c.what for c in verify(document, plain).checks if c.verdict is Verdict.UNDECIDED] == ["words"]
    assert not verify(document, lying).undecided

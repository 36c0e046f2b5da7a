"""Sentences that must not say of one objective, of one end, or of one number what is true of another."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from random_models import OBJECTIVES, Table, problem_of

from ratherthan.errors import QuestionError
from ratherthan.explain import explain
from ratherthan.explain.explanation import Explanation
from ratherthan.explain.record import to_document
from ratherthan.model.objective import Discounted, ExpectedCost, Lexicographic, Mission, Objective, ReachAvoid
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.model.product import lifted, unfolded
from ratherthan.narrate import narrate
from ratherthan.narrate.naming import goal_of
from ratherthan.narrate.numbers import at_most
from ratherthan.solve import Outcome, Solution, evaluate, solve
from ratherthan.verify import Verdict, verify

COST = OBJECTIVES["least cost"]
SAFE = 'Pmax=? [!"hazard" U "goal"]'
# 0 start, 1 home, 2 goal, 3 hazard. From home and from the goal nothing leads back.
MAP: Table = {
    0: {"left": ([(1.0, 1)], 1), "right": ([(1.0, 2)], 2), "risky": ([(0.5, 2), (0.5, 3)], 1)},
    1: {"stay": ([(1.0, 1)], 1), "on": ([(1.0, 2)], 3)},
    2: {"end": ([(1.0, 2)], 0)},
    3: {"on": ([(1.0, 2)], 1)},
}


def model(table: Table = MAP, objective: Objective = COST, **labels: list[int]) -> Problem:
    made: Problem = problem_of(table, objective, goals=labels.get("goals", [2]), hazards=labels.get("hazards", [3]))
    home = np.isin(np.arange(made.mdp.states), labels.get("home", [1]))
    rewards = {**made.mdp.rewards, "collisions": made.mdp.rewards["cost"]}
    return replace(made, mdp=replace(made.mdp, labels={**made.mdp.labels, "home": home}, rewards=rewards))


def confirmed(solution: Solution, **asked: object) -> str:
    """Return the text of an explanation that the re-checker does not refute."""
    explanation = explain(solution, **asked)  # type: ignore[arg-type]
    text = narrate(explanation)
    origin = solution.problem.unfolding.origin if solution.problem.unfolding else solution.problem
    verdicts = verify(to_document(explanation, text), origin)
    assert [(c.what, c.where, c.reason) for c in verdicts.checks if c.verdict is Verdict.FAILS] == []
    return text


def policy(problem: Problem, *actions: str) -> Policy:
    mdp = problem.mdp
    named = [{mdp.action_name(c): c for c in mdp.choices_of(s)} for s in range(mdp.states)]
    return Policy(choice=np.array([own[action] for own, action in zip(named, actions, strict=True)]))


@pytest.mark.parametrize("asked", [{"kind": "contrastive"}, {"kind": "responsibility"}])
def test_what_no_other_action_is_better_at_is_named_where_two_objectives_share_their_words(
    asked: dict[str, str],
) -> None:
    """Which is safer by the risk need not be by the chance to arrive safely: "safer" alone would deny what was just said."""
    table: Table = {
        0: {"go": ([(0.6, 2), (0.2, 3), (0.2, 1)], 1), "no": ([(1.0, 1)], 1)},
        1: {"stay": ([(1.0, 1)], 1)},
        2: {"end": ([(1.0, 2)], 0)},
        3: {"end": ([(1.0, 3)], 0)},
    }
    problem = model(table, ReachAvoid(goal='"hazard"', maximise=False))
    text = confirmed(evaluate(problem, policy(problem, "go", "stay", "end", "end")), also=[SAFE], **asked)
    assert "although taking no would lead to a safer route (0 instead of 0.2, the risk)" in text
    denied = re.search(r"no other action [^.]* leads to (.*?), as we go on", text, re.IGNORECASE)
    assert denied is not None
    assert denied[1] in {
        "a safer route (the chance to reach goal safely)",
        "a safer one (the chance to reach goal safely)",
    }


def test_two_routes_that_arrive_are_not_said_to_arrive_never() -> None:
    table: Table = {
        0: {"short": ([(1.0, 3)], 1), "long": ([(1.0, 1)], 1)},
        1: {"on": ([(1.0, 3)], 1)},
        2: {"end": ([(1.0, 2)], 0)},
        3: {"on": ([(1.0, 2)], 1)},
    }
    text = confirmed(solve(model(table)), state=0, rather_than="long", also=[SAFE])
    assert "neither can arrive safely" in text


def test_a_chance_of_another_goal_is_called_by_its_goal() -> None:
    text = confirmed(solve(model()), also=['Pmax=? [F "home"]'], kind="contrastive")
    assert "a chance of 0 to reach home" in text
    text = confirmed(solve(model()), also=['Pmax=? [F "goal"]'], kind="contrastive")
    assert "a chance of 1 to arrive" in text


def test_a_total_until_a_goal_that_is_not_reached_is_no_number() -> None:
    solution, wish = solve(model()), 'R{"cost"}min=? [F "home"]'
    foil = confirmed(solution, state=0, rather_than="left", also=[wish])
    assert "though it may not reach home and taking left would be sure to" in foil
    aside = confirmed(solution, state=0, kind="responsibility", also=[wish])
    assert ", though it may not reach home and taking left would be sure to" in aside
    whole = confirmed(solution, kind="contrastive", also=[wish])
    assert whole.count("it counts until home is reached, and this plan may not get there.") == 1
    largest = confirmed(solution, kind="contrastive", also=['R{"cost"}max=? [F "home"]'])
    for text in (foil, aside, whole, largest):
        assert not re.search(r"no end|infinity", text)


def test_that_two_plans_have_no_total_is_said_of_each_goal_once() -> None:
    problem = model()
    solution = evaluate(problem, policy(problem, "left", "stay", "end", "on"))
    text = confirmed(solution, kind="contrastive", also=['R{"cost"}min=? [F "hazard"]'])
    assert "it counts until goal is reached, and this plan may not get there." in text
    assert "it counts until hazard is reached, and this plan may not get there." in text
    sentences = re.split(r"(?<=\.) ", text)
    assert len(set(sentences)) == len(sentences)


def test_a_run_that_has_ended_badly_is_not_said_to_stay() -> None:
    """At the hazard the objective has ended; the policy goes on from there."""
    table: Table = {
        0: {"far": ([(1.0, 3)], 1), "near": ([(1.0, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 1)},
        2: {"end": ([(1.0, 2)], 0)},
        3: {"on": ([(1.0, 2)], 1)},
    }
    problem = model(table, ReachAvoid(goal='"goal"', through='!"hazard"', maximise=True))
    bad = policy(problem, "far", "stay", "end", "on")
    assert confirmed(evaluate(problem, bad), kind="contrastive").endswith("We never arrive safely: we end at state 3.")
    mission = unfolded(problem, Mission(formula='G<=3 !"hazard"'))
    text = confirmed(evaluate(mission, lifted(bad, mission)), kind="contrastive")
    assert text.endswith("We never succeed: we end at state 3, failed.")


def test_where_it_may_end_up_is_not_said_to_be_likely() -> None:
    """The likeliest single way leads to state 1 with 0.4, but two others meet in state 4 with 0.6 together."""
    table: Table = {
        0: {"go": ([(0.4, 1), (0.3, 5), (0.3, 6)], 1), "right": ([(1.0, 2)], 2)},
        1: {"stay": ([(1.0, 1)], 1)},
        2: {"end": ([(1.0, 2)], 0)},
        3: {"end": ([(1.0, 3)], 0)},
        4: {"stay": ([(1.0, 4)], 1)},
        5: {"on": ([(1.0, 4)], 1)},
        6: {"on": ([(1.0, 4)], 1)},
    }
    problem = model(table)
    lost = evaluate(problem, policy(problem, "go", "stay", "end", "end", "stay", "on", "on"))
    assert "We never arrive: we may end up at state 1 for ever." in confirmed(lost, kind="contrastive")


def test_a_run_that_stays_is_said_to_stay() -> None:
    problem = model()
    staying = evaluate(problem, policy(problem, "left", "stay", "end", "on"))
    assert "We never arrive: we stay at state 1 for ever." in confirmed(staying, kind="contrastive")


@pytest.mark.parametrize("value", [4e-7, 1e-12, 1e-300, 0.004, 0.0100001, 2.341, 123.456789])
def test_at_most_is_no_less(value: float) -> None:
    assert float(at_most(value)) >= value * (1 - 1e-6)


def test_a_difference_that_is_there_is_not_told_as_nothing() -> None:
    table: Table = {
        0: {"a": ([(1e-7, 3), (1 - 1e-7, 2)], 1), "b": ([(5e-7, 3), (1 - 5e-7, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 1)},
        2: {"end": ([(1.0, 2)], 0)},
        3: {"end": ([(1.0, 3)], 0)},
    }
    problem = model(table, ReachAvoid(goal='"hazard"', maximise=False))
    text = confirmed(solve(problem), kind="contrastive", alpha=0.1)
    assert text.startswith("No decision on this route changes the risk by more than 0.01.")


def test_a_deterministic_round_is_certain() -> None:
    table: Table = {
        0: {"a": ([(1.0, 1)], 1)},
        1: {"a": ([(1.0, 0)], 1), "b": ([(0.5, 0), (0.5, 1)], 1)},
        2: {"end": ([(1.0, 2)], 0)},
        3: {"end": ([(1.0, 3)], 0)},
    }
    problem = model(table, Discounted(reward="cost", discount=0.5))
    surely = narrate(explain(evaluate(problem, policy(problem, "a", "a", "end", "end")), "naive-path"))
    assert surely.endswith("at state 1. This route then comes back to state 0.")
    table[1] = {"a": ([(0.6, 0), (0.4, 2)], 1)}
    problem = model(table, Discounted(reward="cost", discount=0.5))
    perhaps = narrate(explain(evaluate(problem, policy(problem, "a", "a", "end", "end")), "naive-path"))
    assert perhaps.endswith("This route may then come back to state 0.")


def test_states_of_a_product_are_not_counted_as_places() -> None:
    mission = unfolded(model(), Mission(formula='X (X ("home" & (X "home")))'))
    start = next(s for s in range(mission.mdp.states) if mission.mdp.names[s].startswith("state 2,"))
    text = narrate(explain(solve(mission), "contrastive", state=start))
    assert not re.search(r"failed|states that can be reached", text)
    assert re.match(r"There is no way to succeed from|We can no longer succeed", text)


def test_one_noun_is_said_once() -> None:
    levels = (COST, ExpectedCost(goal='"goal" | "hazard"', reward="cost"))
    table: Table = {0: {"a": ([(1.0, 2)], 1)}, 1: MAP[1], 2: MAP[2], 3: MAP[3]}
    text = confirmed(solve(model(table, Lexicographic(levels=levels))), kind="contrastive")
    assert text == "No decision on this route changes the cost."


def test_one_collision_is_said_in_the_singular() -> None:
    problem = model()
    wanted = ExpectedCost(goal='"goal"', reward="collisions")
    bad = evaluate(replace(problem, objective=wanted), policy(problem, "left", "on", "end", "on"), wanted)
    assert "instead of 4 collisions)" in narrate(explain(bad, "responsibility"))
    one = {**MAP, 0: {"right": ([(1.0, 2)], 0.25), "left": ([(1.0, 2)], 1)}}
    problem = model(one)
    bad = evaluate(replace(problem, objective=wanted), policy(problem, "left", "on", "end", "on"), wanted)
    assert "instead of 1 collision)" in narrate(explain(bad, "responsibility"))


def test_a_share_is_said_of_the_action_that_it_belongs_to() -> None:
    problem = model()
    chance = np.zeros(problem.mdp.choices)
    chance[list(problem.mdp.choices_of(0))] = (0.25, 0.75, 0.0)
    for state in (1, 2, 3):
        chance[problem.mdp.choices_of(state)[-1]] = 1.0
    shared = Policy(choice=np.full(problem.mdp.states, -1), chance=chance)
    text = narrate(explain(evaluate(problem, shared), state=0, rather_than="left"))
    assert text.startswith("We take right 75 % of the time rather than left at state 0")


def test_what_one_action_would_better_is_said_in_one_breath() -> None:
    problem = model()
    solution = evaluate(problem, policy(problem, "left", "on", "end", "on"))
    same = confirmed(solution, kind="responsibility", also=['R{"collisions"}min=? [F "goal"]'])
    assert same == (
        "We take left at state 0 although taking right or taking risky would lead to a route with less cost (2 or 1.5 instead "
        "of 4) and, as we go on, to a less risky one (2 or 1.5 instead of 4 collisions)."
    )
    other = confirmed(solution, kind="responsibility", also=['Pmax=? [F "hazard"]'])
    assert other == (
        "We take left at state 0 although taking right or taking risky would lead to a route with less cost (2 or 1.5 instead "
        "of 4), and taking risky would lead to one more likely to reach hazard (0.5 instead of 0), as we go on."
    )


@pytest.mark.parametrize("also", [5, None, 1.5])
def test_further_objectives_that_are_no_list_are_refused(also: object) -> None:
    with pytest.raises(QuestionError, match="must be a list of objectives or properties"):
        explain(solve(model()), also=also)  # type: ignore[arg-type]


def test_one_further_objective_may_stand_alone() -> None:
    solution, wish = solve(model()), ReachAvoid(goal='"hazard"', maximise=False)
    alone: Explanation = explain(solution, also=wish)
    assert alone == explain(solution, also=[wish])


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        ('R{"a [F b]"}min=? [F "at home"]', '"at home"'),
        ('R{"r"}max=? [Fsure "g" | (x = 1)]', '"g" | (x = 1)'),
        ('Pmax=? [!"wet U dry" U "home"]', '"home"'),
        ('R{"r"}max=? [Cdiscount=0.9]', None),
        ("", None),
    ],
)
def test_the_goal_of_a_property_is_found_outside_its_names(text: str, goal: str | None) -> None:
    assert goal_of(text) == goal


def test_a_chance_and_its_opposite_are_not_told_as_different_and_equal() -> None:
    table: Table = {
        0: {"a": ([(1e-9, 3), (1 - 1e-9, 2)], 1), "b": ([(3e-9, 3), (1 - 3e-9, 2)], 1)},
        1: {"stay": ([(1.0, 1)], 1)},
        2: {"end": ([(1.0, 2)], 0)},
        3: {"end": ([(1.0, 3)], 0)},
    }
    problem = model(table, ReachAvoid(goal='"hazard"', maximise=False))
    text = confirmed(solve(problem), state=0, rather_than="b", also=['Pmax=? [F "goal"]'])
    assert "because it leads to a safer route (a difference below 0.01)" in text
    assert "equally" not in text


@pytest.mark.parametrize(
    ("outcome", "said"),
    [
        (Outcome.CERTIFIED, ""),
        (Outcome.UNCERTIFIED, " The numbers behind this plan are not proved."),
        (Outcome.STOPPED, " Not all numbers behind this plan are proved closely."),
        (Outcome.LOWER_ONLY, " Not all numbers behind this plan are proved closely."),
        (Outcome.UPPER_ONLY, " Not all numbers behind this plan are proved closely."),
    ],
)
def test_numbers_with_bounds_are_not_said_to_be_unproved(outcome: Outcome, said: str) -> None:
    explanation = explain(solve(model()), "contrastive")
    assert narrate(replace(explanation, outcome=outcome.value)) == narrate(explanation) + said

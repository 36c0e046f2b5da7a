"""What is said of levels, missions, signed rewards and trade-offs: confirmed as it is, refused as a forger would have it."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from mutations import Mutant, retold, sealed
from random_models import LEVELS, SIGNED, Table, problem_of

from ratherthan.errors import ExplanationError
from ratherthan.explain import explain, question
from ratherthan.explain.record import to_document
from ratherthan.model.mdp import Reward
from ratherthan.model.names import StateNames
from ratherthan.model.objective import Discounted, ExpectedCost, Mission, Objective
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.model.product import unfolded
from ratherthan.narrate import narrate
from ratherthan.solve import evaluate, solve
from ratherthan.verify import Budget, Verdict, verify
from ratherthan.verify.missions import TooLargeError
from ratherthan.verify.product import misnamed

Document = dict[str, Any]

STREETS: Table = {
    0: {"short": ([(1.0, 1)], 1.0), "long": ([(1.0, 2)], 3.0)},
    1: {"on": ([(0.5, 3), (0.5, 1)], 1.0), "wait": ([(1.0, 1)], 1.0)},
    2: {"on": ([(1.0, 3)], 1.0)},
    3: {"stay": ([(1.0, 3)], 0.0)},
}
"""The short way costs 3 and a toll of 5, the long one 4 and no toll."""
TOLL = np.array([1.0, 0.0, 2.0, 0.0, 0.0, 0.0])
GAIN = np.array([-1.0, -3.0, -1.0, 2.0, -1.0, 0.0])


def streets(objective: Objective) -> Problem:
    return problem_of(
        STREETS, objective, goals=[3], hazards=[2], rewards={"toll": Reward(choice=TOLL), "gain": Reward(choice=GAIN)}
    )


SHORTEST = streets(ExpectedCost(goal='"goal"', reward="cost"))


def told(problem: Problem, policy: Policy | None = None, also: tuple[str, ...] = (), **asked: Any) -> Document:
    solution = solve(problem) if policy is None else evaluate(problem, policy)
    explanation = explain(solution, also=also, asked=question(**asked))
    return json.loads(json.dumps(to_document(explanation, narrate(explanation))))


def refused(document: Document, problem: Problem, change: Callable[[Document], object]) -> bool:
    """Return whether a change is refused or contradicted, under a new seal and also told anew."""
    forged = copy.deepcopy(document)
    change(forged)
    assert forged != document
    mutant = Mutant((), "", forged)
    outcomes = []
    for made in (sealed(mutant), retold(mutant)):
        try:
            outcomes.append(made is None or verify(made.document, problem).fails)
        except ExplanationError:
            outcomes.append(True)
    return all(outcomes)


def test_a_trade_is_confirmed_with_its_numbers() -> None:
    document = told(SHORTEST, also=("toll",), rather_than="long", state=0)
    (trade,) = document["steps"][0]["trades"]
    assert trade["claim"] == "trade"
    own, toll = trade["judged"]
    assert (own["taken"]["value"], own["other"]["value"]) == (3.0, 4.0)
    assert (toll["taken"]["value"], toll["other"]["value"]) == (5.0, 0.0)
    verdicts = verify(document, SHORTEST)
    assert verdicts.holds
    assert {"trade", "trades"} <= {check.what for check in verdicts.checks}


TRADES: dict[str, Callable[[Document], object]] = {
    "another claim": lambda d: d["steps"][0]["trades"][0].update(claim="better on all"),
    "a kinder toll": lambda d: d["steps"][0]["trades"][0]["judged"][1]["taken"].update(value=1.0, lower=1.0, upper=1.0),
    "another relation": lambda d: d["steps"][0]["trades"][0]["judged"][1].update(relation="better"),
    "an open relation": lambda d: d["steps"][0]["trades"][0]["judged"][1].update(relation="open"),
    "another objective": lambda d: d["steps"][0]["trades"][0]["judged"][1].update(objective=0),
    "one objective less": lambda d: d["steps"][0]["trades"][0]["judged"].pop(),
    "no comparison": lambda d: d["steps"][0]["trades"].clear(),
    "twice the comparison": lambda d: d["steps"][0]["trades"].append(d["steps"][0]["trades"][0]),
    "a fate": lambda d: d["steps"][0]["trades"][0]["judged"][1]["other"].update(fate="dead end"),
    "wide bounds": lambda d: d["steps"][0]["trades"][0]["judged"][1]["other"].update(upper=4.0),
    "another property": lambda d: d["also"][0].update(property='R{"gain"}max=? [Fsure "goal"]'),
    "the same property": lambda d: d["also"][0].update(property=d["property"]),
    "a mission beside it": lambda d: d["also"][0].update(property='Pmax=? [F<=3 "goal"]'),
    "levels beside it": lambda d: d["also"][0].update(property='Pmax=? [F "goal"] then Tmin=? [F "goal"]'),
    "another record": lambda d: d["also"][0]["objective"].update(reward="cost"),
    "nothing beside it": lambda d: d["also"].clear(),
}


@pytest.mark.parametrize("how", TRADES)
def test_a_forged_trade_is_refused(how: str) -> None:
    document = told(SHORTEST, also=("toll",), rather_than="long", state=0)
    assert refused(document, SHORTEST, TRADES[how])


def test_totals_are_those_of_the_whole_plan() -> None:
    document = told(SHORTEST, also=("toll",), kind="contrastive")
    assert [total["value"] for total in document["totals"]] == [3.0, 5.0]
    assert verify(document, SHORTEST).holds
    for change in (
        lambda d: d["totals"][1].update(value=4.0, lower=4.0, upper=4.0),
        lambda d: d["totals"].pop(),
        lambda d: d["totals"].reverse(),
    ):
        assert refused(document, SHORTEST, change)


def test_a_further_objective_stops_where_the_plan_has_ended() -> None:
    """The plan ends at the goal; what lies behind it is never reached, and costs nothing."""
    table: Table = {
        0: {"go": ([(1.0, 1)], 1.0), "dawdle": ([(0.5, 0), (0.5, 1)], 1.0)},
        1: {"on": ([(1.0, 2)], 7.0)},
        2: {"stay": ([(1.0, 2)], 0.0)},
    }
    toll = Reward(choice=np.array([1.0, 3.0, 100.0, 0.0]))
    problem = problem_of(table, SHORTEST.objective, goals=[1], hazards=[2], rewards={"toll": toll})
    also = ('R{"toll"}min=? [F "hazard"]', 'R{"toll"}max=? [Cdiscount=0.5]', 'Pmax=? [F "hazard"]')
    document = told(problem, also=also, kind="contrastive")
    assert [total["value"] for total in document["totals"]] == [1.0, "inf", 1.0, 0.0]
    assert verify(document, problem).holds


def test_a_bad_plan_is_judged_as_what_it_is() -> None:
    long = Policy(choice=np.array([1, 2, 4, 5]))
    document = told(SHORTEST, long, also=("toll",), rather_than="short", state=0)
    assert verify(document, SHORTEST).holds
    assert document["steps"][0]["trades"][0]["claim"] == "trade"


TIED: Table = {
    0: {"a": ([(1.0, 1)], 2.0), "b": ([(1.0, 2)], 2.0), "c": ([(1.0, 2)], 5.0)},
    1: {"on": ([(1.0, 3)], 1.0)},
    2: {"on": ([(1.0, 3)], 1.0)},
    3: {"stay": ([(1.0, 3)], 0.0)},
}


def tied() -> Problem:
    toll = Reward(choice=np.array([4.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    return problem_of(TIED, LEVELS["cheapest, then least toll"], goals=[3], rewards={"toll": toll})


LEVELLED: dict[str, Callable[[Document], object]] = {
    "a claim of the wrong level": lambda d: d["steps"][0]["claims"][1].update(level=0),
    "a level that is not there": lambda d: d["steps"][0]["claims"][1].update(level=2),
    "the dear one, too": lambda d: d["steps"][0]["claims"][1].update(
        against=["a", "c"], evidence=d["steps"][0]["claims"][0]["evidence"]
    ),
    "no further spread": lambda d: d["steps"][0].update(further_spreads=[]),
    "another further spread": lambda d: d["steps"][0]["further_spreads"][0]["max"].update(
        value=9.0, lower=9.0, upper=9.0
    ),
    "without the first level": lambda d: d["steps"][0]["claims"].pop(0),
    "not critical": lambda d: d["steps"][0].update(critical=False),
    "one level": lambda d: d["levels"].pop(),
    "levels in another order": lambda d: d["levels"].reverse(),
    "another second level": lambda d: d.update(property=d["property"].replace("toll", "cost")),
    "the levels as one": lambda d: d.update(property=d["property"].split(" then ")[0]),
}


@pytest.mark.parametrize("how", LEVELLED)
def test_a_forged_level_is_refused(how: str) -> None:
    document = told(tied(), kind="contrastive")
    assert [(c["claim"], c["level"]) for c in document["steps"][0]["claims"][:2]] == [
        ("among the best", 0),
        ("best", 1),
    ]
    assert verify(document, tied()).holds
    assert refused(document, tied(), LEVELLED[how])


def test_the_worse_of_two_tied_ways_is_not_best_at_the_second_level() -> None:
    document = told(tied(), Policy(choice=np.array([0, 3, 4, 5])), kind="contrastive")
    claims = [(c["claim"], c["level"]) for c in document["steps"][0]["claims"]]
    assert ("not best", 1) in claims
    assert verify(document, tied()).holds
    given = told(tied(), Policy(choice=np.array([0, 3, 4, 5])), kind="naive-path")
    assert refused(given, tied(), lambda d: d["policy"].update(given=False))


IN_TIME = streets(Mission(formula='F<=4 "goal"'))

MISSIONS: dict[str, Callable[[Document], object]] = {
    "another bound": lambda d: d.update(property='Pmax=? [F<=5 "goal"]'),
    "no bound": lambda d: d.update(property='Pmax=? [F "goal"]'),
    "as few states as the model": lambda d: d.update(model={"states": 4, "choices": 6, "branches": 7}),
    "not unfolded": lambda d: d.update(unfolded=None),
    "other memories": lambda d: d["unfolded"].update(memories=2),
    "another kind": lambda d: [d[key].update(kind="mission") for key in ("objective",)],
    "more time": lambda d: d["states"]["0"].update(name="state 0, 9 steps left"),
}


@pytest.mark.parametrize("how", MISSIONS)
def test_a_forged_mission_is_refused(how: str) -> None:
    document = told(IN_TIME, kind="contrastive")
    assert verify(document, IN_TIME).holds
    assert refused(document, IN_TIME, MISSIONS[how])


def test_a_mission_is_confirmed_on_its_product_as_well() -> None:
    product = unfolded(IN_TIME, Mission(formula='F<=4 "goal"'))
    assert verify(told(IN_TIME, kind="contrastive"), product).holds


def test_names_of_a_product_are_no_free_choice() -> None:
    """A product whose names tell another number of steps, or an end that is none, is found out."""
    product = unfolded(IN_TIME, Mission(formula='F<=4 "goal"'))
    names = list(product.mdp.names.strings or ())
    every = range(len(names))
    assert misnamed(product, every) is None
    for old, new in (
        (" steps left", "0 steps left"),
        ("done", "failed"),
        ("too late", "done"),
        (", 1 step left", ", done"),
    ):
        other = [name.replace(old, new) for name in names]
        assert other != names
        mdp = replace(product.mdp, names=StateNames(count=len(names), strings=other))
        assert misnamed(replace(product, mdp=mdp), every) is not None


def test_what_is_too_large_to_be_built_again_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    def gives_up(problem: Problem, objective: Objective) -> None:
        raise TooLargeError

    document = told(IN_TIME, kind="contrastive")
    monkeypatch.setattr(import_module("ratherthan.verify.recheck"), "unfolded_for", gives_up)
    verdicts = verify(document, IN_TIME)
    assert verdicts.undecided
    assert [check.what for check in verdicts.checks] == ["product"]
    with pytest.raises(ExplanationError, match="text"):
        verify(sealed(Mutant((), "", document | {"text": "All is well."})).document, IN_TIME)


@pytest.mark.parametrize(
    "objective",
    [SIGNED["most reward"], SIGNED["least reward"], Discounted(reward="gain", discount=0.9), *LEVELS.values()],
    ids=lambda objective: objective.text,
)
@pytest.mark.parametrize("exact", [0, 40])
def test_every_objective_is_confirmed_on_the_streets(objective: Objective, exact: int) -> None:
    problem = streets(objective)
    for kind in ("contrastive", "selective", "responsibility"):
        verdicts = verify(told(problem, kind=kind), problem, budget=Budget(exact=exact))
        assert not verdicts.fails, [str(check) for check in verdicts.of(Verdict.FAILS)]


def test_where_more_can_be_gathered_no_number_is_accepted() -> None:
    """Waiting at state 1 pays 2: the largest reward is infinite, and nothing else is true."""
    problem = streets(SIGNED["most reward"])
    document = told(problem, kind="responsibility")
    (step,) = document["steps"]
    numbers = [row["value"] for claim in step["claims"] for row in (claim["evidence"]["taken"],)]
    assert set(numbers) == {"inf"}
    for value in (7.0, 1e300):
        assert refused(
            document,
            problem,
            lambda d, value=value: d["steps"][0]["claims"][0]["evidence"]["taken"].update(
                value=value, lower=value, upper=value
            ),
        )


def test_a_discount_that_is_another_is_refused() -> None:
    problem = streets(Discounted(reward="gain", discount=0.9))
    document = told(problem, kind="contrastive")
    for change in (
        lambda d: d.update(property=d["property"].replace("0.9", "0.99")),
        lambda d: [d[key].update(discount=0.99) for key in ("objective",)],
        lambda d: d["levels"][0].update(discount=0.99),
    ):
        assert refused(document, problem, change)


def test_a_small_number_beside_large_ones_is_not_free() -> None:
    """A reward of a million elsewhere does not blur what is paid here."""
    table: Table = {
        0: {"a": ([(1.0, 1)], 0.0), "b": ([(1.0, 1)], 0.0), "c": ([(1.0, 2)], 0.0)},
        1: {"stay": ([(1.0, 1)], 0.0)},
        2: {"on": ([(1.0, 1)], 0.0)},
    }
    gain = Reward(choice=np.array([1.0, 0.5, 0.0, 0.0, -1e6]))
    problem = problem_of(table, SIGNED["most reward"], goals=[1], rewards={"gain": gain})
    document = told(problem, rather_than="b", state=0)
    assert verify(document, problem).holds

    def better(d: Document) -> None:
        for claim in d["steps"][0]["claims"]:
            for row in claim["evidence"]["others"]:
                if row["action"] == "b" and "value" in row:
                    row.update(value=0.9, lower=0.4, upper=0.9)

    forged = copy.deepcopy(document)
    better(forged)
    made = retold(Mutant((), "", forged))
    assert made is not None
    assert made.document["text"] != document["text"]
    assert not verify(made.document, problem).holds

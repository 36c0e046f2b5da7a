"""Safety first, then the least cost: the second objective speaks only among what is equal for the first.

    start --bridge 1--> goal (0.9), river (0.1)      start --ferry 8--> goal      start --road 3--> fork
    fork --left 2--> goal          fork --right 1--> far --on 5--> goal

The first level, to arrive without the river: q(bridge) = 0.9, q(ferry) = q(road) = 1 = ρ₁(start).
The second, the least cost among ferry and road: ρ₂(fork) = min(2, 1 + 5) = 2, q₂(ferry) = 8, q₂(road) = 3 + 2 = 5 = ρ₂(start).
q₂(bridge) would be 1, but the bridge is not compared. Start is critical for the first level already, fork for the second only.

TIE has ferry cost 5: then ferry and road are equal for both levels.
"""

from __future__ import annotations

import pytest

import ratherthan as rt
from ratherthan import ExpectedCost, Lexicographic, ReachAvoid
from ratherthan.explain import Factors, question

MODEL = {
    "start": {"bridge": ([(0.9, "goal"), (0.1, "river")], 1), "ferry": ([(1, "goal")], 8), "road": ([(1, "fork")], 3)},
    "fork": {"left": ([(1, "goal")], 2), "right": ([(1, "far")], 1)},
    "far": {"on": ([(1, "goal")], 5)},
    "river": {},
    "goal": {},
}
TIE = MODEL | {"start": MODEL["start"] | {"ferry": ([(1, "goal")], 5)}}
SAFE = ReachAvoid(goal='"goal"', through='!"hazard"')
CHEAP = ExpectedCost(goal='"goal"', reward="cost")
BOTH = Lexicographic(levels=(SAFE, CHEAP))
TEXTS = {
    "naive-path": "First, we take road at start. Finally, we take left at fork.",
    "selective": "First, we take road at critical start. Finally, we take left at critical fork.",
    "responsibility at start": (
        "We take road at start because it leads to one of the safest routes and, of these, to the one with the least cost."
    ),
    "responsibility at fork": (
        "We take left at fork because it leads to one of the safest routes and, of these, to the one with the least cost."
    ),
    "responsibility at far": "We take on at far.",
    "constrictive at start": "We take road at start because it leads to the most flexible future route.",
}


@pytest.fixture
def problem(small):
    return small(MODEL, hazard="river", objective=BOTH)


def test_numbers(problem):
    solution = rt.solve(problem)
    factors = Factors(solution=solution, asked=question())
    assert [level.text for level in solution.objectives] == [SAFE.text, CHEAP.text]
    assert solution.values[:, 0].tolist() == [1, 5]
    first, second = factors.levels
    assert first.action_value[:3].tolist() == pytest.approx([0.9, 1, 1])
    assert second.action_value[1:3].tolist() == pytest.approx([8, 5])
    assert factors.compared[1].certain[:3].tolist() == [False, True, True]
    assert [problem.mdp.names[s] for s in factors.critical.certain.nonzero()[0]] == ["start", "fork"]
    assert factors.further_spreads(0)[0][0].value == pytest.approx(8)
    assert factors.further_spreads(0)[0][1].value == pytest.approx(5)
    assert factors.further_spreads(2) == (None,)


@pytest.mark.parametrize("key", TEXTS)
def test_texts(problem, told, key):
    assert told(problem, key) == TEXTS[key]


def test_why_not_another(problem, explained):
    assert explained(problem, state=0, rather_than="ferry", factors=["responsibility"]) == (
        "We take road rather than ferry at start because both lead to equally safe routes and it leads to one with less cost "
        "(5 instead of 8)."
    )
    assert explained(problem, state=0, rather_than="bridge", factors=["responsibility"]) == (
        "We take road rather than bridge at start because it leads to a safer route (1 instead of 0.9)."
    )


def test_what_is_equal_for_both_levels(small, explained):
    problem = small(TIE, hazard="river", objective=BOTH)
    assert explained(problem, state=0, kind="responsibility") == (
        "We take ferry at start because it leads to one of the safest routes and, of these, to one of those with the least cost."
    )
    assert explained(problem, state=0, rather_than="road", factors=["responsibility"]) == (
        "We take ferry rather than road at start; both lead to equally safe routes and routes with the same cost."
    )


def test_a_safe_plan_that_is_dear(problem, explained, policy):
    ferry = policy(problem, {"start": "ferry", "fork": "left", "far": "on"})
    assert explained(problem, ferry, state=0, kind="responsibility") == (
        "We take ferry at start because it leads to one of the safest routes, although of these taking road would lead to one "
        "with less cost (5 instead of 8)."
    )
    assert explained(problem, ferry, state=0, rather_than="road", factors=["responsibility"]) == (
        "We take ferry rather than road at start although both lead to equally safe routes and taking road would lead to one "
        "with less cost (5 instead of 8)."
    )


def test_a_plan_that_is_not_safe_is_not_praised_for_its_cost(problem, explained, policy):
    bridge = policy(problem, {"start": "bridge", "fork": "left", "far": "on"})
    assert explained(problem, bridge, state=0, kind="responsibility") == (
        "We take bridge at start although taking ferry or taking road would lead to a safer route (1 instead of 0.9)."
    )


def test_all_other_decisions_are_equivalent_only_if_they_are_at_every_level(small, told):
    """With right at 1 and far at 1, fork is a tie: 2 either way."""
    table = MODEL | {"far": {"on": ([(1, "goal")], 1)}}
    assert told(small(table, hazard="river", objective=BOTH), "selective") == (
        "We take road at critical start. All other decisions result in equivalent routes."
    )
    assert told(small(MODEL, hazard="river", objective=SAFE), "selective").startswith(
        "We take ferry at critical start."
    )


def test_the_other_way_round_the_cheapest_comes_first(small, told):
    problem = small(MODEL, hazard="river", objective=Lexicographic(levels=(CHEAP, SAFE)))
    assert told(problem, "responsibility at start").startswith(
        "We take road at start because it leads to the route with the least cost."
    )

"""A reward until a goal that must be reached, with gains and losses.

    start --direct -2--> goal           start --detour -2--> shop --sell 5--> back --home -6--> goal
    start --gamble -1--> goal (1/2), pit (1/2)           shop --skip 1--> goal

The goal must be reached: from the pit it cannot, so ρ(pit) = -∞ and q(start, gamble) = -∞, for it may fail.
ρ(back) = -6. q(shop, sell) = 5 - 6 = -1, q(shop, skip) = 1 = ρ(shop). q(start, direct) = -2,
q(start, detour) = -2 + 1 = -1 = ρ(start): the route with the most reward is start, shop, goal.

GAIN has back --again 2--> shop besides: going round pays 5 + 2 = 7 each time, so ρ(shop) = ρ(back) = ∞ and ρ(start) = ∞; no
plan attains it, and the plan that arrives gets a finite reward.

EVEN has back --again -5--> shop instead: going round pays 5 - 5 = 0. ρ(back) = max(-6, -5 + 1) = -4, and to sell is now as
good as to skip: 5 - 4 = 1. But who goes on selling does not arrive, so the plan skips; all else is as without it.

NOTHING has shop --skip 0--> goal and start --detour -1--> shop: ρ(shop) = 0, which is neither a loss nor a gain.
"""

from __future__ import annotations

import math

import pytest

from ratherthan import ExpectedReward

MODEL = {
    "start": {
        "direct": ([(1, "goal")], -2),
        "detour": ([(1, "shop")], -2),
        "gamble": ([(0.5, "goal"), (0.5, "pit")], -1),
    },
    "shop": {"sell": ([(1, "back")], 5), "skip": ([(1, "goal")], 1)},
    "back": {"home": ([(1, "goal")], -6)},
    "pit": {},
    "goal": {},
}
GAIN = MODEL | {"back": {"home": ([(1, "goal")], -6), "again": ([(1, "shop")], 2)}}
EVEN = MODEL | {"back": {"home": ([(1, "goal")], -6), "again": ([(1, "shop")], -5)}}
NOTHING = MODEL | {
    "start": MODEL["start"] | {"detour": ([(1, "shop")], -1)},
    "shop": {"sell": ([(1, "back")], 5), "skip": ([(1, "goal")], 0)},
}
MOST = ExpectedReward(goal='"goal"', reward="cost")
TEXTS = {
    "contrastive": (
        "First, we take detour at critical start because it leads to the route with the most cost and the most flexible future "
        "route. Finally, we take skip at critical shop because it leads to the route with the most cost."
    ),
    "responsibility at start": "We take detour at start because it leads to the route with the most cost.",
    "responsibility at pit": "We stay at pit although no choice here is sure to arrive.",
    "selective at pit": "There is no way to arrive from pit: no other place can be reached from there.",
}


def test_numbers(small, facts):
    found = facts(small(MODEL, objective=MOST))
    assert found.rho == {"start": -1, "shop": 1, "back": -6, "pit": -math.inf, "goal": 0}
    assert found.q["start", "direct"] == -2
    assert found.q["start", "detour"] == -1
    assert found.q["start", "gamble"] == -math.inf
    assert (found.q["shop", "sell"], found.q["shop", "skip"]) == (-1, 1)
    assert found.critical == {"start", "shop"}
    assert found.policy["start"] == "detour"
    assert found.proves("start", -1)


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL, objective=MOST), key) == TEXTS[key]


def test_why_not_another(small, explained):
    problem = small(MODEL, objective=MOST)
    assert explained(problem, state=0, rather_than="direct", factors=["responsibility"]) == (
        "We take detour rather than direct at start because it leads to a route with more cost (-1 instead of -2)."
    )
    assert explained(problem, state=0, rather_than="gamble", factors=["responsibility"]) == (
        "We take detour rather than gamble at start because taking gamble may fail to arrive."
    )
    assert explained(problem, kind="responsibility", state=0, detail=True) == (
        "We take detour at start because it leads to the route with the most cost; "
        "taking gamble may fail to arrive; taking direct instead would take 1 off the cost."
    )


def test_where_more_and_more_can_be_gained_no_plan_has_the_most(small, facts, told):
    problem = small(GAIN, objective=MOST)
    found = facts(problem)
    assert (found.rho["start"], found.rho["shop"], found.rho["back"]) == (math.inf, math.inf, math.inf)
    assert found.rho["pit"] == -math.inf
    assert math.isfinite(found.following["start"])
    assert told(problem, "responsibility at shop") == (
        "We take skip at shop although taking sell would lead to a route with more cost (no end instead of 1)."
    )


def test_going_round_for_nothing_is_no_way_to_arrive(small, facts, told):
    problem = small(EVEN, objective=MOST)
    found = facts(problem)
    assert found.rho == {"start": -1, "shop": 1, "back": -4, "pit": -math.inf, "goal": 0}
    assert (found.q["shop", "sell"], found.q["shop", "skip"]) == (1, 1)
    assert (found.policy["shop"], found.policy["back"]) == ("skip", "again")
    assert found.following == found.rho
    assert told(problem, "responsibility at start") == TEXTS["responsibility at start"]
    assert told(problem, "responsibility at shop") == (
        "We take skip at shop because it leads to one of the routes with the most cost."
    )


def test_where_nothing_is_gained_or_lost_it_is_told_alike(small, facts, told):
    problem = small(NOTHING, objective=MOST)
    assert facts(problem).rho["shop"] == 0
    assert told(problem, "responsibility at start") == TEXTS["responsibility at start"]


def test_a_plan_that_fails_is_said_to(small, told, policy):
    problem = small(MODEL, objective=MOST)
    gambling = policy(problem, {"start": "gamble", "shop": "skip", "back": "home", "pit": "stay", "goal": "stay"})
    assert told(problem, "responsibility at start", gambling) == (
        "We take gamble at start although it may fail to arrive and taking direct or taking detour would be sure to (-2 or -1)."
    )


def test_a_negative_number_that_is_nearly_nothing_is_said_as_such(small, explained):
    table = MODEL | {"start": {"direct": ([(1, "goal")], -0.001), "detour": ([(1, "shop")], -0.999)}}
    assert explained(small(table, objective=MOST), state=0, rather_than="direct", factors=["responsibility"]) == (
        "We take detour rather than direct at start because it leads to a route with more cost "
        "(just above 0 instead of just below 0)."
    )

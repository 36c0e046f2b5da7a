"""A discounted sum without end, γ = 1/2: there is no goal, and a plan goes on for ever.

    field --rest 1--> field        field --walk 0--> mine        mine --dig 3--> mine (1/2), field (1/2)
                                                                 mine --leave -1--> field

From the mine, digging: v(mine) = 3 + ½ (½ v(mine) + ½ v(field)). From the field: v(field) = max(1 + ½ v(field), ½ v(mine)).
If the field walks: v(field) = ½ v(mine), v(mine) = 3 + ¼ v(mine) + ⅛ v(mine), so v(mine) = 3 / (5/8) = 4.8, v(field) = 2.4.
Resting for ever gives 1 / (1 - ½) = 2 < 2.4: walking is best. q(field, rest) = 1 + ½ · 2.4 = 2.2. q(mine, leave) = -1 + 1.2 = 0.2.
ω is the plain mean of what follows: ω(mine, dig) = (4.8 + 2.4) / 2 = 3.6, ω(mine, leave) = 2.4.
"""

from __future__ import annotations

import pytest

from ratherthan import Discounted

MODEL = {
    "field": {"rest": ([(1, "field")], 1), "walk": ([(1, "mine")], 0)},
    "mine": {"dig": ([(0.5, "mine"), (0.5, "field")], 3), "leave": ([(1, "field")], -1)},
}
MOST = Discounted(reward="cost", discount=0.5)
LEAST = Discounted(reward="cost", discount=0.5, maximise=False)
TEXTS = {
    "naive-path": "First, we take walk at field. Finally, we take dig at mine. This route then comes back to field.",
    "contrastive": (
        "First, we take walk at critical field because it leads to the plan with the largest discounted cost and the most "
        "flexible future route. Finally, we take dig at critical mine because it leads to the plan with the largest discounted cost. "
        "This route then comes back to field."
    ),
    "responsibility at mine": "We take dig at mine because it leads to the plan with the largest discounted cost.",
    "constrictive at mine": "We take dig at mine, which leaves the same choices open as every other action.",
}


def test_numbers(small, facts):
    found = facts(small(MODEL, goal=(), objective=MOST))
    assert found.proves("field", 2.4)
    assert found.proves("mine", 4.8)
    assert found.q["field", "rest"] == pytest.approx(2.2)
    assert found.q["mine", "leave"] == pytest.approx(0.2)
    assert found.omega["mine", "dig"] == pytest.approx(3.6)
    assert found.omega["mine", "leave"] == pytest.approx(2.4)
    assert found.critical == {"field", "mine"}
    assert found.policy == {"field": "walk", "mine": "dig"}


@pytest.mark.parametrize("key", TEXTS)
def test_texts(small, told, key):
    assert told(small(MODEL, goal=(), objective=MOST), key) == TEXTS[key]


def test_why_not_another(small, explained):
    problem = small(MODEL, goal=(), objective=MOST)
    assert explained(problem, state=0, rather_than="rest", factors=["responsibility"]) == (
        "We take walk rather than rest at field because it leads to a plan with a larger discounted cost (2.4 instead of 2.2)."
    )
    assert explained(problem, state=1, rather_than="leave", factors=["responsibility"]) == (
        "We take dig rather than leave at mine because it leads to a plan with a larger discounted cost (4.8 instead of 0.2)."
    )


def test_to_want_as_little_as_possible(small, facts, told):
    """v(mine) = -1 + ½ v(field), v(field) = ½ v(mine): v(mine) = -4/3 and v(field) = -2/3."""
    problem = small(MODEL, goal=(), objective=LEAST)
    found = facts(problem)
    assert found.proves("mine", -4 / 3)
    assert found.proves("field", -2 / 3)
    assert told(problem, "responsibility at field") == (
        "We take walk at field because it leads to the plan with the smallest discounted cost."
    )


def test_a_plan_that_rests_for_ever(small, told, policy):
    """ρ^π(field) = 2; walking first comes to 2.4 at best."""
    problem = small(MODEL, goal=(), objective=MOST)
    resting = policy(problem, {"field": "rest", "mine": "leave"})
    assert told(problem, "contrastive", resting) == (
        "We take rest at critical field although taking walk would lead to a plan with a larger discounted cost "
        "(2.4 instead of 2.2). We stay at field for ever."
    )

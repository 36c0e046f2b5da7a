"""What takes memory to tell: to arrive within some steps, and to fetch before bringing.

    start --walk--> half --walk--> goal          start --jump--> goal (1/2), start (1/2)
                    half --jump--> goal (1/2), start (1/2)

With one step left only a jump can arrive: from start with 1/2, from half walking arrives for sure. With two steps left:
walking from start arrives for sure (1), jumping with 1/2 + 1/2 · 1/2 = 3/4. With three steps: walking 1, jumping
1/2 + 1/2 · 1 = 1: no difference. So within two steps the first one matters: q(walk) = 1, q(jump) = 3/4.

SHOP: home --out--> shop --back--> home: `F ("shop" & (F "home"))` from home is done after two steps.
"""

from __future__ import annotations

import numpy as np
import pytest

import ratherthan as rt
from ratherthan import Mission

HALF = [(0.5, "goal"), (0.5, "start")]
MODEL = {
    "start": {"jump": (HALF, 0), "walk": ([(1, "half")], 0)},
    "half": {"jump": (HALF, 0), "walk": ([(1, "goal")], 0)},
    "goal": {},
}
SHOP = {
    "home": {"out": ([(1, "shop")], 0), "nap": ([(1, "home")], 0)},
    "shop": {"back": ([(1, "home")], 0), "stay": ([(1, "shop")], 0), "leave": ([(1, "away")], 0)},
    "away": {},
}


def within(steps: int) -> Mission:
    return Mission(formula=f'F<={steps} "goal"')


def test_numbers(small):
    solution = rt.solve(small(MODEL, objective=within(2)))
    unfolding = solution.problem.unfolding
    assert unfolding.origin.mdp.states == 3
    start = int(solution.problem.mdp.initial[0])
    assert solution.values[0, start] == 1
    factors = rt.Factors(solution=solution, asked=rt.explain(solution).question)
    assert factors.measures.action_value[solution.problem.mdp.choices_of(start)].tolist() == pytest.approx([0.75, 1])


TEXTS = {
    2: {
        "contrastive": (
            "First, we take walk at critical start, 2 steps left, because it leads to the route most likely to arrive in time. "
            "Finally, we take walk at critical half, 1 step left, because it leads to the route most likely to arrive in time."
        ),
        "naive-path": "First, we take walk at start, 2 steps left. Finally, we take walk at half, 1 step left.",
    },
    1: {
        "contrastive": (
            "We take jump at critical start, 1 step left, because it leads to the route most likely to arrive in time."
        ),
    },
    0: {
        "contrastive": "There is no way to arrive in time from start, too late: no other place can be reached from there."
    },
}


@pytest.mark.parametrize(("steps", "kind"), [(steps, kind) for steps, texts in TEXTS.items() for kind in texts])
def test_texts(small, told, steps, kind):
    if steps == 0:
        assert (
            told(small(MODEL, objective=within(0)), kind)
            == "We can no longer arrive in time: nothing is left to decide."
        )
    else:
        assert told(small(MODEL, objective=within(steps)), kind) == TEXTS[steps][kind]


def test_why_not_another(small, explained):
    problem = small(MODEL, objective=within(2))
    assert explained(problem, rather_than="jump", factors=["responsibility"]) == (
        "We take walk rather than jump at start, 2 steps left, because it leads to a route more likely to arrive in time "
        "(1 instead of 0.8)."
    )


def test_a_document_tells_how_large_the_model_was(small):
    explanation = rt.explain(rt.solve(small(MODEL, objective=within(2))))
    assert explanation.property == 'Pmax=? [F<=2 "goal"]'
    assert explanation.unfolded.states == 3
    assert explanation.size[0] > 3
    assert rt.from_json(rt.to_json(explanation)) == explanation


def test_what_is_done_is_remembered(small, told):
    labels = {"home": ["home"], "shop": ["shop"]}
    mission = Mission(formula='F ("shop" & (F "home"))')
    problem = small(SHOP, goal=(), labels=labels, objective=mission)
    solution = rt.solve(problem)
    assert solution.values[0, int(solution.problem.mdp.initial[0])] == 1
    assert told(problem, "naive-path").startswith("First, we take out at home. Finally, we take back at shop, ")
    text = told(problem, "contrastive")
    assert "because it leads to one of the plans most likely to succeed" in text


def test_a_policy_of_the_model_is_followed_whatever_is_remembered(small, policy):
    problem = small(MODEL, objective=within(2))
    jumping = policy(problem, {"start": "jump", "half": "jump"})
    solution = rt.evaluate(problem, jumping)
    start = int(solution.problem.mdp.initial[0])
    assert solution.policy_values[0, start] == pytest.approx(0.75)
    assert rt.narrate(rt.explain(solution, kind="responsibility")) == (
        "We take jump at start, 2 steps left, although taking walk would lead to a route more likely to arrive in time "
        "(1 instead of 0.8)."
    )
    assert np.all(solution.lower <= solution.upper)


def test_what_should_not_happen(small, told):
    """Walking first and jumping then arrives within two steps with 1/2; jumping first and walking then, too."""
    unwanted = Mission(formula='F<=2 "goal"', maximise=False)
    assert told(small(MODEL, objective=unwanted), "responsibility") == (
        "We take jump at start, 2 steps left, because it leads to one of the safest routes."
    )

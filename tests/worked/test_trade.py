"""One plan under two rewards: the shortest way, and what it risks.

    start --lane 1--> market        start --street 4--> bridge       start --alley 6--> bridge
    market --through 2 (risk 1/2)--> goal          market --around 5 (risk 1/10)--> goal
    bridge --over 3 (risk 1/5)--> goal (1/2), bridge (1/2)

Every attempt on the bridge costs 3 and risks 1/5, and succeeds with 1/2: from the bridge distance 6, risk 2/5.
The shortest plan goes start, lane, market, through: distance 3, risk 1/2.
Street once, and then the plan: 4 + 6 = 10, risk 2/5. Alley: 6 + 6 = 12, risk 2/5 besides its own 1/5: 3/5.
At the market: around comes to 5 and 1/10 instead of 2 and 1/2.

So at start street is a trade (3 rather than 10, but 1/2 rather than 2/5), and lane is better on all than alley.
"""

from __future__ import annotations

from fractions import Fraction

import pytest

import ratherthan as rt
from ratherthan import ExpectedCost, Lexicographic, NotExplainableError, PropertyError, QuestionError, ReachAvoid

HALF = [(0.5, "goal"), (0.5, "bridge")]
MODEL = {
    "start": {
        "lane": ([(1, "market")], {"distance": 1, "risk": 0}),
        "street": ([(1, "bridge")], {"distance": 4, "risk": 0}),
        "alley": ([(1, "bridge")], {"distance": 6, "risk": 0.2}),
    },
    "market": {
        "through": ([(1, "goal")], {"distance": 2, "risk": 0.5}),
        "around": ([(1, "goal")], {"distance": 5, "risk": 0.1}),
    },
    "bridge": {"over": (HALF, {"distance": 3, "risk": 0.2})},
    "goal": {},
}
SHORT = ExpectedCost(goal='"goal"', reward="distance")


@pytest.fixture
def problem(small):
    return small(MODEL, objective=SHORT)


@pytest.fixture
def plan(problem):
    return rt.solve(problem)


def judged(explanation, step, action):
    """Return (taken, other) under each objective, and the claim."""
    trade = next(trade for trade in explanation.steps[step].trades if trade.against == (action,))
    return trade.claim, [(one.taken.number.value, one.other.number.value, one.relation) for one in trade.judged]


def test_numbers(plan):
    explanation = rt.explain(plan, also=["risk"])
    claim, (distance, risk) = judged(explanation, 0, "street")
    assert claim == "trade"
    assert distance == (pytest.approx(3), pytest.approx(10), "better")
    assert risk == (pytest.approx(0.5), pytest.approx(0.4), "worse")
    claim, (distance, risk) = judged(explanation, 0, "alley")
    assert claim == "better on all"
    assert distance == (pytest.approx(3), pytest.approx(12), "better")
    assert risk == (pytest.approx(0.5), pytest.approx(0.6), "better")
    assert [total.value for total in explanation.totals] == pytest.approx([3, 0.5])
    assert explanation.also[0].property == 'R{"risk"}min=? [F "goal"]'


def test_numbers_are_those_of_the_unrolled_plan(problem):
    """The alternative once, then the plan: exact fractions along the chain, in place of any solver."""
    bridge = {"distance": Fraction(3) / Fraction(1, 2), "risk": Fraction(1, 5) / Fraction(1, 2)}
    street = {"distance": 4 + bridge["distance"], "risk": bridge["risk"]}
    explanation = rt.explain(rt.solve(problem), also=["risk"])
    _, (distance, risk) = judged(explanation, 0, "street")
    assert distance[1] == pytest.approx(float(street["distance"]))
    assert risk[1] == pytest.approx(float(street["risk"]))


def test_texts(plan):
    assert rt.narrate(rt.explain(plan, also=["risk"])) == (
        "First, we take lane at critical start because it leads to the shortest and most flexible future route, though taking "
        "street would lead to a less risky one (0.4 instead of 0.5). Finally, we take through at critical market because it "
        "leads to the shortest route, though taking around would lead to a less risky one (0.1 instead of 0.5). On this plan "
        "we expect a distance of 3 and a risk of 0.5."
    )
    assert rt.narrate(rt.explain(plan, kind="responsibility", state=1, also=["risk"])) == (
        "We take through at market because it leads to the shortest route, though taking around would lead to a less risky one "
        "(0.1 instead of 0.5)."
    )


@pytest.mark.parametrize(
    ("foil", "reason"),
    [
        ("street", "because it leads to a shorter route (3 instead of 10), though a riskier one (0.5 instead of 0.4)."),
        ("alley", "because it leads to a shorter route (3 instead of 12) and a less risky one (0.5 instead of 0.6)."),
    ],
)
def test_why_not_another(plan, foil, reason):
    text = rt.narrate(rt.explain(plan, rather_than=foil, factors=["responsibility"], also=["risk"]))
    assert text == f"We take lane rather than {foil} at start {reason}"


def test_a_plan_that_another_beats_is_not_defended(problem, explained, policy):
    """Alley first: 12 and 0.6 instead of 10 and 0.4."""
    alley = policy(problem, {"start": "alley", "market": "through", "bridge": "over"})
    assert explained(problem, alley, rather_than="street", factors=["responsibility"], also=["risk"]) == (
        "We take alley rather than street at start although taking street would lead to a shorter route (10 instead of 12) and "
        "a less risky one (0.4 instead of 0.6), as we go on."
    )


def test_what_is_equal_is_said_to_be(small, explained):
    table = MODEL | {"start": {**MODEL["start"], "street": ([(1, "bridge")], {"distance": 4, "risk": 0.1})}}
    assert explained(
        small(table, objective=SHORT), rather_than="street", factors=["responsibility"], also=["risk"]
    ) == (
        "We take lane rather than street at start because it leads to a shorter route (3 instead of 10), and both lead to "
        "equally risky routes."
    )
    same = {"lane": MODEL["start"]["lane"], "path": MODEL["start"]["lane"]}
    problem = small(MODEL | {"start": same}, objective=SHORT)
    assert explained(problem, rather_than="path", factors=["responsibility"], also=["risk"]) == (
        "We take lane rather than path at start; both lead to equally short routes and equally risky routes."
    )


def test_where_no_other_action_is_better_it_is_said_once(small, explained):
    table = MODEL | {"start": {a: MODEL["start"][a] for a in ("lane", "alley")}}
    table |= {"market": {"through": MODEL["market"]["through"]}}
    text = explained(small(table, objective=SHORT), also=["risk"])
    assert "No other action there leads to a less risky route, as we go on." in text
    assert explained(small(table, objective=SHORT), also=["risk"], kind="responsibility") == (
        "We take lane at start because it leads to the shortest route, and no other action here leads to a less risky one, "
        "as we go on."
    )


def test_the_run_ends_where_the_plan_ends(small):
    """After the goal the model goes on to the pit, but the plan does not: its chance to come there is that of the crossing."""
    table = {
        "start": {"cross": ([(0.9, "goal"), (0.1, "pit")], 1), "wait": ([(1, "start")], 1)},
        "goal": {"on": ([(1, "pit")], 1)},
        "pit": {},
    }
    objective = ReachAvoid(goal='"goal"', through='!"hazard"')
    plan = rt.solve(small(table, hazard="pit", objective=objective))
    explanation = rt.explain(plan, also=['Pmin=? [F "hazard"]'])
    assert explanation.totals[1].value == pytest.approx(0.1)
    assert "a risk of 0.1" in rt.narrate(explanation)


def test_a_foil_that_does_not_arrive_is_said_so(small, explained):
    table = MODEL | {"start": {**MODEL["start"], "drop": ([(1, "hole")], {"distance": 0, "risk": 0})}, "hole": {}}
    assert explained(small(table, objective=SHORT), rather_than="drop", factors=["responsibility"], also=["risk"]) == (
        "We take lane rather than drop at start because taking drop would lead to a dead end."
    )


def test_where_the_plan_never_comes_there_is_no_end(small, explained):
    table = {name: dict(rows) for name, rows in MODEL.items()} | {"home": {}}
    problem = small(table, objective=SHORT, labels={"home": ["home"]})
    text = explained(problem, also=['R{"risk"}min=? [F "home"]'])
    assert text.endswith(
        "On this plan we expect a distance of 3. No total can be given for the risk: it counts until home is reached, and this plan may not get there."
    )


@pytest.mark.parametrize("how", ['R{"risk"}min=? [F "goal"]', "risk", ExpectedCost(goal='"goal"', reward="risk")])
def test_a_further_objective_can_be_given_in_several_ways(plan, how):
    assert rt.explain(plan, also=[how]) == rt.explain(plan, also=["risk"])


def test_what_cannot_be_a_further_objective_is_refused(plan):
    with pytest.raises(PropertyError, match="differ from the plan's own"):
        rt.explain(plan, also=["distance"])
    with pytest.raises(PropertyError, match="differ from the plan's own"):
        rt.explain(plan, also=["risk", "risk"])
    with pytest.raises(PropertyError, match="one best value"):
        rt.explain(plan, also=['Pmax>=0.5 [F "goal"]'])
    with pytest.raises(PropertyError, match="one best value"):
        rt.explain(plan, also=[Lexicographic(levels=(SHORT, ExpectedCost(goal='"goal"', reward="risk")))])
    with pytest.raises(NotExplainableError, match="without memory"):
        rt.explain(plan, also=['Pmax=? [F<=3 "goal"]'])
    with pytest.raises(PropertyError):
        rt.explain(plan, also=["speed"])
    with pytest.raises(QuestionError, match="got 3"):
        rt.explain(plan, also=[3])


def test_a_reward_alone_needs_a_goal(small):
    plan = rt.solve(small(MODEL, hazard="market", objective=ReachAvoid(goal='"hazard"', maximise=False)))
    with pytest.raises(PropertyError, match="Say until when"):
        rt.explain(plan, also=["risk"])

"""Every combination of claims has its words: golden texts of the closed table, for every kind of objective."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable
from importlib import resources

import pytest

from ratherthan.explain.explanation import (
    Claim,
    Evidence,
    Explanation,
    Measured,
    ObjectiveRecord,
    StateRecord,
    Step,
    Tally,
)
from ratherthan.explain.question import question
from ratherthan.explain.schema import OBJECTIVES as RECORDED
from ratherthan.factors import Interval
from ratherthan.model.lexicon import Lexicon
from ratherthan.narrate import narrate

OBJECTIVES = {
    "distance": ObjectiveRecord(kind="cost", reward="distance"),
    "time": ObjectiveRecord(kind="cost", reward="time"),
    "steps": ObjectiveRecord(kind="cost"),
    "energy": ObjectiveRecord(kind="cost", reward="battery_use"),
    "most-distance": ObjectiveRecord(kind="cost", reward="distance", maximise=True),
    "most-energy": ObjectiveRecord(kind="cost", reward="battery_use", maximise=True),
    "probability": ObjectiveRecord(kind="probability", maximise=True),
    "safety": ObjectiveRecord(kind="safety", maximise=True),
    "risk": ObjectiveRecord(kind="risk"),
    "reward": ObjectiveRecord(kind="reward", reward="reward", maximise=True),
    "least-reward": ObjectiveRecord(kind="reward", reward="loss"),
    "least-risk": ObjectiveRecord(kind="cost", reward="risk"),
    "collisions": ObjectiveRecord(kind="cost", reward="collisions"),
    "meetings": ObjectiveRecord(kind="cost", reward="chance_meetings"),
    "weighted": ObjectiveRecord(kind="cost", reward="distance + 10 * risk"),
    "discounted": ObjectiveRecord(kind="discounted", reward="reward", maximise=True, discount=0.9),
    "least-discounted": ObjectiveRecord(kind="discounted", discount=0.9),
    "deadline": ObjectiveRecord(kind="deadline", maximise=True),
    "mission": ObjectiveRecord(kind="mission", maximise=True),
    "event": ObjectiveRecord(kind="event", formula='!"lost" U "home"'),
}
COSTS = {"distance": 10.6667, "better": 6.6667, "other": 7.25}
REWARDS = {"distance": -7.25, "better": -3.04, "other": 0.002}
CHANCES = {"distance": 0.5, "better": 0.8, "other": 0.75}
FATES = (None, "dead end", "may fail")


def numbers_of(record: ObjectiveRecord) -> dict[str, float]:
    return CHANCES if record.chance else COSTS if record.kind == "cost" else REWARDS if record.maximise else COSTS


def fated(record: ObjectiveRecord) -> bool:
    """Whether infinite numbers may mean that it does not arrive."""
    return record.kind in ("cost", "reward")


def measured(action: str, value: float, fate: str | None = None) -> Measured:
    value = math.inf if fate else value
    return Measured(choice=0, action=action, number=Interval(value=value, lower=value, upper=value), fate=fate)


def explained(objective: ObjectiveRecord, step: Step, **details: object) -> str:
    asked = question(scope="state", factors=["responsibility", "constrictiveness"], **details)  # type: ignore[arg-type]
    return narrate(
        Explanation(
            source="test",
            property="",
            objective=objective,
            question=asked,
            start=10,
            steps=(step,),
            states={10: StateRecord(name="10", named=False)},
            lexicon=Lexicon(state="grid {number}"),
        )
    )


def claim(name: str, taken: Measured | Tally, *others: Measured | Tally) -> Claim:
    return Claim(claim=name, against=tuple(o.action for o in others), evidence=Evidence(taken=taken, others=others))


def step(*claims: Claim, **more: object) -> Step:
    return Step(state=10, choice=0, choice_index=0, action="east", claims=claims, **more)  # type: ignore[arg-type]


def outcome_claims(numbers: dict[str, float], *, fates: bool) -> dict[str, list[Claim]]:
    own, better, other = numbers["distance"], numbers["better"], numbers["other"]
    south, north = measured("south", better), measured("north", other)
    claims = {
        "open": [],
        "best": [claim("best", measured("east", better), measured("south", own))],
        "among the best": [claim("among the best", measured("east", better), measured("south", better))],
        "right start only": [claim("right start only", measured("east", better), measured("south", own))],
        "hopeless": [claim("hopeless", measured("east", own, "may fail" if fates else None))],
        "better step": [claim("better step", measured("east", better), measured("south", own))],
        "equal step": [claim("equal step", measured("east", better), measured("south", better))],
    }
    for name, fate in itertools.product(("not best", "worse step"), FATES if fates else FATES[:1]):
        called = f"{name}, {fate or 'finite'}"
        claims[f"{called}, one alternative"] = [claim(name, measured("east", own, fate), south)]
        claims[f"{called}, several alternatives"] = [claim(name, measured("east", own, fate), south, north)]
    return claims


def flexibility_claims() -> dict[str, list[Claim]]:
    four, two = (Tally(choice=0, action=a, lower=n, upper=n) for a, n in (("east", 4), ("south", 2)))
    return {
        "not most flexible": [],
        "most flexible": [claim("most flexible", four, two)],
        "equally flexible": [claim("equally flexible", four, four)],
    }


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_every_combination_of_claims_has_its_words(objective: str, golden: Callable[[str, str], None]) -> None:
    record = OBJECTIVES[objective]
    lines = []
    for (outcome, first), (flexibility, second) in itertools.product(
        outcome_claims(numbers_of(record), fates=fated(record)).items(), flexibility_claims().items()
    ):
        if record.kind == "discounted" and outcome == "hopeless":
            continue  # never claimed: there is nowhere to arrive
        lines.append(f"{outcome}; {flexibility}: {explained(record, step(*first, *second))}")
    golden(f"sentences/{objective}.txt", "\n".join(lines) + "\n")


def contrasts(numbers: dict[str, float], *, fates: bool, lost: bool) -> dict[str, list[Claim]]:
    low, high = measured("east", numbers["better"]), measured("south", numbers["distance"])
    lowered, raised = measured("south", numbers["better"]), measured("east", numbers["distance"])
    claims = {
        "open": [],
        "better": [claim("better", low, high)],
        "worse": [claim("worse", raised, lowered)],
        "equal": [claim("equal", low, lowered)],
    }
    if lost:
        return claims | {"equal, lost": [claim("equal", measured("east", 0.0), measured("south", 0.0))]}
    if not fates:
        return claims
    for fate in FATES[1:]:
        claims[f"better, {fate}"] = [claim("better", low, measured("south", 0, fate))]
        claims[f"worse, {fate}"] = [claim("worse", measured("east", 0, fate), lowered)]
    claims["equal, infinite"] = [claim("equal", measured("east", 0, "may fail"), measured("south", 0, "dead end"))]
    return claims


def test_every_contrast_with_a_foil_has_its_words(golden: Callable[[str, str], None]) -> None:
    four, two = (
        (lambda a: Tally(choice=0, action=a, lower=4, upper=4)),
        (lambda a: Tally(choice=0, action=a, lower=2, upper=2)),
    )
    tallies = {
        "flexibility open": [],
        "more flexible": [claim("more flexible", four("east"), two("south"))],
        "less flexible": [claim("less flexible", two("east"), four("south"))],
        "as flexible": [claim("as flexible", two("east"), two("south"))],
    }
    lines = []
    for name in ("distance", "energy", "probability", "safety", "risk", "reward", "discounted", "mission", "event"):
        record = OBJECTIVES[name]
        lost = record.chance and record.kind != "event"
        for (outcome, first), (flexibility, second) in itertools.product(
            contrasts(numbers_of(record), fates=fated(record), lost=lost).items(), tallies.items()
        ):
            text = explained(record, step(*first, *second, foil="south"))
            lines.append(f"{name}; {outcome}; {flexibility}: {text}")
    golden("sentences/contrasts.txt", "\n".join(lines) + "\n")


def test_single_steps_judged_by_the_policy_are_said_as_such(golden: Callable[[str, str], None]) -> None:
    lines = []
    for name in ("distance", "probability"):
        record = OBJECTIVES[name]
        chance = record.chance
        for outcome, claims in contrasts(numbers_of(record), fates=fated(record), lost=chance).items():
            text = explained(record, step(*claims, foil="south"), policy_values=True)
            lines.append(f"{name}; {outcome}: {text}")
        if not chance:
            dead, slow = measured("south", 0, "dead end"), measured("north", 12.0)
            for others in ([dead], [dead, slow]):
                text = explained(record, step(claim("better step", measured("east", 6.7), *others)), policy_values=True)
                lines.append(f"{name}; better than {len(others)}, one infinite: {text}")
        hopeless = step(claim("hopeless", measured("east", 0.0, None if chance else "may fail")))
        lines.append(f"{name}; hopeless: {explained(record, hopeless, policy_values=True)}")
    golden("sentences/single-steps.txt", "\n".join(lines) + "\n")


def test_a_plan_that_does_not_stay_on_the_way_is_said_so() -> None:
    follows = ((11, Interval(value=5, lower=5, upper=5), Interval(value=9, lower=9, upper=9)),)
    evidence = Evidence(taken=measured("east", 6.0), others=(measured("south", 8.0),), follows=follows)
    text = explained(
        OBJECTIVES["distance"], step(Claim(claim="better", against=("south",), evidence=evidence), foil="south")
    )
    assert text == (
        "We move east rather than south at grid 10 because it opens the way to a shorter route (6 instead of 8)."
    )


def test_details_say_what_the_alternatives_lead_to(golden: Callable[[str, str], None]) -> None:
    own = measured("east", 6.7)
    dead, dead_too = measured("north", 0, "dead end"), measured("west", 0, "dead end")
    fail, fail_too = measured("south", 0, "may fail"), measured("northwest", 0, "may fail")
    cases = {
        "only way": [claim("only way on", own)],
        "one dead end": [claim("avoids", own, dead)],
        "two dead ends": [claim("avoids", own, dead, dead_too)],
        "one may fail": [claim("avoids", own, fail)],
        "two may fail": [claim("avoids", own, fail, fail_too)],
        "both": [claim("avoids", own, dead, fail)],
    }
    lines = []
    for name, claims in cases.items():
        best = [claim("best", own, dead)] if name != "only way" else []
        lines.append(f"{name}: {explained(OBJECTIVES['distance'], step(*best, *claims), detail=True)}")
    golden("sentences/details.txt", "\n".join(lines) + "\n")


def test_the_tables_are_complete() -> None:
    templates = tomllib.loads(resources.files("ratherthan.narrate").joinpath("templates/en.toml").read_text("utf-8"))
    reasons = {f"{fate}" for fate in ("finite", "dead", "fail")}
    rows = {
        "open",
        "best",
        "among",
        "start",
        "hopeless",
        "lost",
        "endless",
        "step_better",
        "step_equal",
        "step_hopeless",
        "step_lost",
    }
    rows |= {"step_better_mixed", "step_better_infinite"}
    rows |= {f"{row}_{fate}" for row in ("worse", "step") for fate in reasons}
    assert set(templates["reasons"]) == rows
    assert all({"plain", "flexible"} <= set(row) for row in templates["reasons"].values())
    assert set(templates["contrasts"]) == {"better", "avoids", "worse", "equal", "open"}
    assert all(set(row) == {"more", "fewer", "same", "unsaid"} for row in templates["contrasts"].values())
    words = {"best", "best_flexible", "among", "better", "worse", "equal", "noun"}
    words |= {"best_one", "among_one", "better_one", "worse_one", "endless", "unit", "amount"}
    for tables in (templates["objectives"], templates["rewards"]):
        assert all(set(table) == words for kinds in tables.values() for table in kinds.values())
    ways = {"arrive", "arrive_at_all", "there"}
    others = {name for name in templates["arriving"] if name.startswith("other_")}
    assert others == {"other_probability", "other_safety"}
    for name, table in templates["arriving"].items():
        assert set(table) == (ways - {"there"} if name in others else ways)
    assert set(templates["objectives"]) == set(RECORDED) - {"cost", "reward"}


@pytest.mark.parametrize(
    ("own", "other", "shown"),
    [
        (10.667, 6.667, "(6.7 instead of 10.7)"),
        (11.0, 7.0, "(7 instead of 11)"),
        (6.67, 6.66, "(6.66 instead of 6.67)"),
        (6.7001, 6.7, "(a difference below 0.01)"),
        (math.inf, 6.7, "(6.7)"),
        (0.3, 0.04, "(0.04 instead of 0.3)"),
        (0.3, 0.001, "(less than 0.01 instead of 0.3)"),
        (1000000.25, 999999.0, "(999999 instead of 1000000.2)"),
    ],
)
def test_numbers_have_as_many_decimals_as_make_them_differ(own: float, other: float, shown: str) -> None:
    fate = "dead end" if math.isinf(own) else None
    text = explained(
        OBJECTIVES["distance"], step(claim("not best", measured("east", own, fate), measured("south", other)))
    )
    assert shown in text


@pytest.mark.parametrize(
    ("own", "other", "shown"),
    [
        (0.5, 0.99, "(0.99 instead of 0.5)"),
        (0.5, 0.999, "(more than 0.99 instead of 0.5)"),
        (0.5, 1.0, "(1 instead of 0.5)"),
    ],
)
def test_a_chance_below_one_is_not_shown_as_one(own: float, other: float, shown: str) -> None:
    text = explained(
        OBJECTIVES["probability"], step(claim("not best", measured("east", own), measured("south", other)))
    )
    assert shown in text

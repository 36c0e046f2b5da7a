"""Every comparison under several objectives, in order or side by side, has its words: golden texts of the closed tables."""

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
    Further,
    Judged,
    Measured,
    ObjectiveRecord,
    PolicyRecord,
    StateRecord,
    Step,
    Tally,
    Trade,
)
from ratherthan.explain.question import question
from ratherthan.explain.schema import TRADES
from ratherthan.factors import Interval
from ratherthan.model.lexicon import Lexicon
from ratherthan.narrate import narrate

DISTANCE = ObjectiveRecord(kind="cost", reward="distance")
RISK = ObjectiveRecord(kind="cost", reward="risk")
COLLISIONS = ObjectiveRecord(kind="cost", reward="collisions")
ENERGY = ObjectiveRecord(kind="cost", reward="battery_use")
CHANCE = ObjectiveRecord(kind="probability", maximise=True)
SAFETY = ObjectiveRecord(kind="safety", maximise=True)
REWARD = ObjectiveRecord(kind="reward", reward="reward", maximise=True)
BETTER = {"distance": (6.6667, 10.6667), "risk": (0.1, 0.3), "collisions": (0.1, 0.3), "battery_use": (3.0, 5.5)}
CHANCES = (0.9, 0.75)
REWARDS = (-3.0, -7.0)


def interval(value: float) -> Interval:
    return Interval(value=value, lower=value, upper=value)


def measured(action: str, value: float, fate: str | None = None) -> Measured:
    return Measured(choice=0, action=action, number=interval(math.inf if fate else value), fate=fate)


def numbers(record: ObjectiveRecord) -> tuple[float, float]:
    """Return a better and a worse number."""
    if record.kind == "reward":
        return REWARDS
    return CHANCES if record.chance else BETTER[str(record.reward)]


def judged(number: int, record: ObjectiveRecord, relation: str, fate: str | None = None) -> Judged:
    good, bad = numbers(record)
    own, foil = {"better": (good, bad), "worse": (bad, good)}.get(relation, (good, good))
    return Judged(
        objective=number,
        taken=measured("east", own),
        other=measured("south", foil, fate if relation == "better" else None),
        relation=relation,
    )


def trade_of(relations: dict[int, str], records: list[ObjectiveRecord], fate: str | None = None) -> Trade:
    found = set(relations.values())
    if {"better", "worse"} <= found:
        claim = "trade"
    elif "open" in found:
        claim = "open"
    else:
        claim = "better on all" if "better" in found else "dominated" if "worse" in found else "indifferent"
    rows = tuple(judged(number, record, relations[number], fate) for number, record in enumerate(records))
    return Trade(claim=claim, against=("south",), judged=rows)


def explained(
    levels: list[ObjectiveRecord],
    also: list[ObjectiveRecord],
    step: Step,
    *,
    given: bool = False,
    totals: tuple[Interval, ...] = (),
    **details: object,
) -> str:
    route = bool(totals)
    asked = question(scope="route" if route else "state", factors=["responsibility", "constrictiveness"], **details)  # type: ignore[arg-type]
    return narrate(
        Explanation(
            source="test",
            property="",
            objective=levels[0],
            levels=tuple(levels),
            also=tuple(Further(property="", objective=record) for record in also),
            question=asked,
            start=10,
            route=(10, 11) if route else (),
            route_outcome="arrives" if route else "none",
            steps=(step,),
            states={state: StateRecord(name=str(state), named=False) for state in (10, 11)},
            lexicon=Lexicon(state="grid {number}"),
            totals=totals,
            policy=PolicyRecord(given=given),
        )
    )


def claim(name: str, taken: Measured | Tally, *others: Measured | Tally, level: int = 0) -> Claim:
    return Claim(
        claim=name, against=tuple(o.action for o in others), evidence=Evidence(taken=taken, others=others), level=level
    )


def step(*claims: Claim, **more: object) -> Step:
    return Step(state=10, choice=0, choice_index=0, action="east", claims=claims, **more)  # type: ignore[arg-type]


FOUR, TWO = Tally(choice=0, action="east", lower=4, upper=4), Tally(choice=0, action="south", lower=2, upper=2)


def test_every_comparison_of_two_objectives_with_a_foil_has_its_words(golden: Callable[[str, str], None]) -> None:
    lines = []
    for further in (RISK, COLLISIONS, ENERGY, CHANCE, REWARD):
        for relations in itertools.product(("better", "worse", "equal", "open"), repeat=2):
            trade = trade_of(dict(enumerate(relations)), [DISTANCE, further])
            text = explained([DISTANCE], [further], step(foil="south", trades=(trade,)))
            lines.append(f"{further.reward or further.kind}; {', '.join(relations)}; {trade.claim}: {text}")
    golden("sentences/trades.txt", "\n".join(lines) + "\n")


def test_every_comparison_of_three_objectives_with_a_foil_has_its_words(golden: Callable[[str, str], None]) -> None:
    lines = []
    records = [DISTANCE, COLLISIONS, ENERGY]
    for relations in itertools.product(("better", "worse", "equal"), repeat=3):
        trade = trade_of(dict(enumerate(relations)), records)
        text = explained([DISTANCE], records[1:], step(foil="south", trades=(trade,)))
        lines.append(f"{', '.join(relations)}; {trade.claim}: {text}")
    for fate, second in itertools.product(("dead end", "may fail"), ("better", "worse", "equal")):
        trade = trade_of({0: "better", 1: second, 2: "equal"}, [DISTANCE, CHANCE, ENERGY])
        fated = Trade(
            claim=trade.claim,
            against=trade.against,
            judged=(judged(0, DISTANCE, "better", fate), *trade.judged[1:]),
        )
        text = explained([DISTANCE], [CHANCE, ENERGY], step(foil="south", trades=(fated,)))
        lines.append(f"{fate}, {second}; {trade.claim}: {text}")
    golden("sentences/trades-of-three.txt", "\n".join(lines) + "\n")


def test_decisions_left_open_are_said_apart(golden: Callable[[str, str], None]) -> None:
    lines = []
    for name, claims in {
        "more": [claim("more flexible", FOUR, TWO)],
        "fewer": [claim("less flexible", TWO, FOUR)],
        "same": [claim("as flexible", TWO, TWO)],
    }.items():
        for given in (False, True):
            trade = trade_of({0: "better", 1: "worse"}, [DISTANCE, RISK])
            text = explained([DISTANCE], [RISK], step(*claims, foil="south", trades=(trade,)), given=given)
            lines.append(f"{name}, {'given' if given else 'best'}: {text}")
    golden("sentences/trades-and-decisions.txt", "\n".join(lines) + "\n")


def test_what_others_would_gain_is_said_beside_the_reason(golden: Callable[[str, str], None]) -> None:
    best = claim("best", measured("east", 6.7), measured("south", 10.7))
    lines = []
    for further, relation, reasons in itertools.product(
        ([RISK], [COLLISIONS], [ENERGY], [CHANCE], [RISK, ENERGY]), ("worse", "better", "equal"), ([best], [])
    ):
        records = [DISTANCE, *further]
        relations = {0: "better"} | dict.fromkeys(range(1, len(records)), relation)
        trade = trade_of(relations, records)
        text = explained([DISTANCE], further, step(*reasons, trades=(trade,)))
        names = ", ".join(str(record.reward or record.kind) for record in further)
        lines.append(f"{names}; {relation}; {'best' if reasons else 'open'}: {text}")
    golden("sentences/asides.txt", "\n".join(lines) + "\n")


def test_the_whole_plan_is_summed_up(golden: Callable[[str, str], None]) -> None:
    best = claim("best", measured("east", 6.7), measured("south", 10.7))
    lines = []
    for further, total in (
        ([RISK], 0.3),
        ([COLLISIONS], 0.004),
        ([ENERGY], 12.25),
        ([CHANCE], 0.9999),
        ([SAFETY], 0.75),
        ([REWARD], -3.0),
        ([RISK], math.inf),
        ([REWARD], -math.inf),
        ([REWARD], math.inf),
    ):
        trade = trade_of({0: "better", 1: "equal"}, [DISTANCE, *further])
        totals = interval(6.6667), interval(total)
        lines.append(explained([DISTANCE], further, step(best, trades=(trade,)), totals=totals))
    golden("sentences/totals.txt", "\n".join(lines) + "\n")


def test_a_total_that_is_not_proved_is_not_told() -> None:
    trade = trade_of({0: "better", 1: "equal"}, [DISTANCE, RISK])
    vague = Interval(value=0.3, lower=0.1, upper=0.5)
    text = explained([DISTANCE], [RISK], step(trades=(trade,)), totals=(interval(6.7), vague))
    assert "On this plan we expect a distance of 6.7." in text


def further_claims(record: ObjectiveRecord) -> dict[str, list[Claim]]:
    good, bad = numbers(record)
    east, south = measured("east", good), measured("south", bad)
    lost = measured("east", 0.0 if record.chance else bad, None if record.chance else "may fail")
    claims = {
        "open": [],
        "best": [claim("best", east, south, level=1)],
        "among the best": [claim("among the best", east, measured("south", good), level=1)],
        "right start only": [claim("right start only", east, south, level=1)],
        "hopeless": [claim("hopeless", lost, lost, level=1)],
        "not best": [claim("not best", measured("east", bad), measured("south", good), level=1)],
    }
    if not record.chance:
        claims["not best, may fail"] = [
            claim("not best", measured("east", 0, "may fail"), measured("south", good), level=1)
        ]
        claims["best, others may fail"] = [
            claim("best", east, measured("south", 0, "may fail"), level=1),
            claim("avoids", east, measured("south", 0, "may fail"), level=1),
        ]
    return claims


@pytest.mark.parametrize("stepwise", [False, True])
def test_every_claim_of_a_second_level_has_its_words(stepwise: bool, golden: Callable[[str, str], None]) -> None:
    names = {"best": "better step", "among the best": "equal step", "not best": "worse step"}
    lines = []
    for first, second in ((SAFETY, DISTANCE), (DISTANCE, SAFETY), (CHANCE, ENERGY)):
        top = "equal step" if stepwise else "among the best"
        own = claim(top, *(measured(action, numbers(first)[0]) for action in ("east", "south")))
        for (name, claims), flexible in itertools.product(further_claims(second).items(), (False, True)):
            if stepwise and name == "right start only":
                continue
            said = [
                Claim(claim=names.get(c.claim, c.claim), against=c.against, evidence=c.evidence, level=c.level)
                if stepwise
                else c
                for c in claims
            ]
            more = [claim("most flexible", FOUR, TWO)] if flexible else []
            text = explained([first, second], [], step(own, *said, *more), policy_values=stepwise, detail=True)
            lines.append(f"{name}; {'most flexible' if flexible else 'plain'}: {text}")
    golden(f"sentences/levels{'-single-steps' if stepwise else ''}.txt", "\n".join(lines) + "\n")


@pytest.mark.parametrize("stepwise", [False, True])
def test_every_contrast_at_a_second_level_has_its_words(stepwise: bool, golden: Callable[[str, str], None]) -> None:
    lines = []
    for first, second in ((SAFETY, DISTANCE), (DISTANCE, SAFETY), (CHANCE, ENERGY)):
        equal = claim("equal", *(measured(action, numbers(first)[0]) for action in ("east", "south")))
        good, bad = numbers(second)
        cases = {
            "better": [claim("better", measured("east", good), measured("south", bad), level=1)],
            "worse": [claim("worse", measured("east", bad), measured("south", good), level=1)],
            "equal": [claim("equal", measured("east", good), measured("south", good), level=1)],
            "open": [],
        }
        if not second.chance:
            fated = measured("south", 0, "may fail")
            cases["better, may fail"] = [claim("better", measured("east", good), fated, level=1)]
            cases["worse, may fail"] = [
                claim("worse", measured("east", 0, "may fail"), measured("south", good), level=1)
            ]
            cases["equal, infinite"] = [claim("equal", measured("east", 0, "may fail"), fated, level=1)]
        for name, claims in cases.items():
            for flexible in ([], [claim("more flexible", FOUR, TWO)]):
                text = explained(
                    [first, second], [], step(equal, *claims, *flexible, foil="south"), policy_values=stepwise
                )
                lines.append(f"{name}; {'more flexible' if flexible else 'open'}: {text}")
    golden(f"sentences/level-contrasts{'-single-steps' if stepwise else ''}.txt", "\n".join(lines) + "\n")


def test_the_tables_are_complete() -> None:
    templates = tomllib.loads(resources.files("ratherthan.narrate").joinpath("templates/en.toml").read_text("utf-8"))
    assert set(TRADES) <= set(templates["trades"])
    rows = {"best", "among", "start", "endless", "hopeless", "lost", "worse_finite", "worse_fail", "flexible"}
    rows |= {f"step_{row}" for row in ("better", "better_mixed", "better_infinite", "equal", "hopeless", "lost")}
    rows |= {"step_finite", "step_fail"}
    assert set(templates["further_levels"]) == rows

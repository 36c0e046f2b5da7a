"""Few sentences in words: how many of how many are told, runs, and what alternatives would cost, rounded and true."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import ratherthan as rt
from ratherthan.explain.explanation import Explanation, LeftOut, Measured, ObjectiveRecord, StateRecord, Step
from ratherthan.explain.question import question
from ratherthan.factors import Interval
from ratherthan.io.roadmap import parse_roadmap
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.property import choose_objective
from ratherthan.narrate import narrate, sentences
from ratherthan.narrate.details import rounded

Golden = Callable[[str, str], None]
OBJECTIVES = {
    "distance": ObjectiveRecord(kind="cost", reward="distance"),
    "steps": ObjectiveRecord(kind="cost"),
    "time": ObjectiveRecord(kind="cost", reward="time"),
    "probability": ObjectiveRecord(kind="probability", maximise=True),
    "risk": ObjectiveRecord(kind="risk"),
    "reward": ObjectiveRecord(kind="reward", reward="reward", maximise=True),
    "meetings": ObjectiveRecord(kind="cost", reward="chance_meetings"),
    "energy": ObjectiveRecord(kind="cost", reward="battery_use"),
}
PAPER = rt.solve(rt.read("example:paper-5x5"))


def left(told: Explanation, out: LeftOut) -> str:
    return narrate(replace(told, closing=replace(told.closing, left_out=out)))


def test_how_many_of_how_many_are_told(golden: Golden) -> None:
    told = rt.explain(PAPER, at_most=1)
    cases = {
        "all": narrate(rt.explain(PAPER, at_most=4)),
        "one": narrate(rt.explain(PAPER, at_most=3)),
        "several": left(told, LeftOut(steps=3, largest=(1.2345,))),
        "several, one is not sure": left(told, LeftOut(steps=3, unsure=1, largest=(1.2345,))),
        "several, some are not sure": left(told, LeftOut(steps=4, unsure=2, largest=(1.2345,))),
        "several, one is not like the rest": left(told, LeftOut(steps=3, unsure=2, largest=(1.2345,))),
        "one that is not sure": left(told, LeftOut(steps=1, unsure=1, largest=(0.0,))),
        "none is sure": left(told, LeftOut(steps=3, unsure=3, largest=(0.0,))),
        "open by how much": left(told, LeftOut(steps=3, largest=(None,))),
        "some may matter": narrate(
            replace(told, steps=tuple(replace(one, critical=None) if one.critical else one for one in told.steps))
        ),
        "steps": narrate(rt.explain(PAPER, "naive-path", at_most=2)),
        "runs of steps": narrate(rt.explain(PAPER, "naive-path", at_most=9)),
    }
    golden("sentences/few.txt", "".join(f"{name}: {text}\n" for name, text in cases.items()))


def test_sentences_are_numbered_as_their_marks_and_make_the_text() -> None:
    told = rt.explain(PAPER)
    found = sentences(told)
    assert [sentence.number for sentence in found] == [1, 2, 3, 4, None]
    assert [sentence.steps for sentence in found] == [(0,), (1,), (3,), (4,), ()]
    assert " ".join(sentence.text for sentence in found) == narrate(told)


def numbered(action: str, low: float, high: float, fate: str | None = None) -> Measured:
    value = math.inf if math.isinf(high) else (low + high) / 2
    return Measured(choice=0, action=action, number=Interval(value=value, lower=low, upper=high), fate=fate)


def costing(objective: str, own: float, *others: Measured) -> str:
    told = Step(
        state=10,
        choice=0,
        choice_index=0,
        action="east",
        numbers=((numbered("east", own, own), *others),),
        critical=True,
    )
    return narrate(
        Explanation(
            source="test",
            property="",
            objective=OBJECTIVES[objective],
            question=question(scope="state", factors=["responsibility"], detail=True),
            start=10,
            steps=(told,),
            states={10: StateRecord(name="10", named=False)},
            lexicon=Lexicon(state="grid {number}"),
        )
    )


def test_what_an_alternative_would_cost(golden: Golden) -> None:
    lines = []
    for objective in ("distance", "steps", "time", "probability", "risk", "reward", "meetings", "energy"):
        chance = objective in ("probability", "risk")
        own, more = (0.5, 0.12) if chance else (10.0, 4.0)
        cases = {
            "more": [numbered("south", own + more, own + more)],
            "less": [numbered("south", own - more, own - more)],
            "about": [numbered("south", own + more / 3, own + more / 3)],
            "one": [numbered("south", own + (0.01 if chance else 1.0), own + (0.01 if chance else 1.0))],
            "between": [numbered("south", own + more / 4, own + more / 2)],
            "open": [numbered("south", own - more, own + more)],
            "tiny": [numbered("south", own + 1e-5, own + 1e-5)],
            "none": [numbered("south", own, own)],
            "two alike and another": [
                numbered("south", own + more, own + more),
                numbered("north", own + more, own + more),
                numbered("west", own + 2 * more, own + 2 * more),
            ],
        }
        lines += [f"{objective}, {name}: {costing(objective, own, *others)}" for name, others in cases.items()]
    golden("sentences/differences.txt", "\n".join(lines) + "\n")


@given(low=st.floats(1e-4, 1e6), share=st.floats(0.0, 0.5))
def test_what_is_rounded_stays_true(low: float, share: float) -> None:
    high = low * (1 + share)
    text, about = rounded(low, high)
    if text == "":
        assert high < 0.01
    elif " " in text:
        first, second = map(float, text.split(" "))
        assert first <= low * (1 + 1e-9)
        assert high <= second * (1 + 1e-9)
    elif not about:
        assert float(text) * (1 - 2e-6) <= low <= high <= float(text) * (1 + 2e-6)
    else:
        figures = min(2, 1 - math.floor(math.log10((low + high) / 2)))
        half = 0.5 * 10.0**-figures
        assert float(text) - half <= low * (1 + 1e-12)
        assert high <= (float(text) + half) * (1 + 1e-12)


@pytest.mark.parametrize("kind", ["naive-path", "selective", "contrastive"])
def test_without_a_number_of_sentences_the_text_is_as_it_was(kind: str) -> None:
    assert narrate(rt.explain(PAPER, kind)) == narrate(rt.explain(PAPER, asked=question(kind)))
    assert "We tell" not in narrate(rt.explain(PAPER, kind))


def test_cells_are_counted_where_each_step_leads_to_the_next_one() -> None:
    told = rt.explain(PAPER, "naive-path", at_most=9)
    assert "We tell" not in narrate(told)
    assert "for 2 cells to" in narrate(told)
    places = {state: (2 * state, 0) for state in told.states}  # a map on which each step leaps over some cells
    leaping = replace(told, states={s: replace(one, place=places[s]) for s, one in told.states.items()})
    assert "cells" not in narrate(leaping)
    ends = {s: replace(one, named=True, name=f"cells ({s}, 0) to ({s + 1}, 1)") for s, one in told.states.items()}
    larger = narrate(replace(told, states=ends, lexicon=Lexicon()))
    assert "for 2 steps until we reach cells (" in larger


def test_a_chance_that_is_left_out_has_the_unit_of_the_details() -> None:
    told = rt.explain(PAPER, at_most=1)
    chance = ObjectiveRecord(kind="probability", maximise=True)
    likely = replace(told, objective=chance, levels=(chance,))
    said = left(likely, LeftOut(steps=3, largest=(0.3138,)))
    assert "each of the others changes the chance to arrive by at most 31.38 percentage points." in said
    assert "by at most 1 percentage point." in left(likely, LeftOut(steps=3, largest=(0.01,)))


@pytest.mark.parametrize("kind", ["selective", "naive-path"])
def test_a_detail_without_a_number_is_said_whatever_is_claimed(kind: str) -> None:
    said = narrate(rt.explain(PAPER, kind, detail=True)).split(". ")
    assert said[0].endswith("grid 5; moving north may fail to arrive")


def test_a_run_past_dead_ends_says_so() -> None:
    taken, aside = numbered("east", 4.0, 4.0), numbered("south", math.inf, math.inf, "dead end")
    told = rt.explain(PAPER, "naive-path", at_most=9, detail=True)
    run = next(sentence.steps for sentence in sentences(told) if len(sentence.steps) > 1)
    for fate, words in (("dead end", "would lead to a dead end"), ("may fail", "may fail to arrive")):
        other = replace(aside, fate=fate)
        steps = [replace(one, numbers=((taken, other),)) if at in run else one for at, one in enumerate(told.steps)]
        assert f"; any other action on the way {words}." in narrate(replace(told, steps=tuple(steps)))


@pytest.mark.parametrize(
    ("name", "said"), [("line\nbreak", "line break"), ("a\r\n\u2028b", "a  b"), (" \n", "state 10"), ("", "state 10")]
)
def test_a_text_is_one_line_and_every_place_has_a_name(name: str, said: str) -> None:
    told = rt.explain(PAPER, "naive-path")
    states = {s: replace(one, named=True, name=name if s == 10 else f"s{s}") for s, one in told.states.items()}
    text = narrate(replace(told, states=states, lexicon=Lexicon()))
    assert len(text.splitlines()) == 1
    assert f"we move east at {said}." in text


def test_what_is_remembered_stands_between_commas() -> None:
    town = parse_roadmap("map = '''\nS . . . .\n. . . . D\n'''\n", source="a town")
    hurried = replace(town, objective=choose_objective(town, 'Pmax=? [F<=6 "destination"]'))
    said = narrate(rt.explain(rt.solve(hurried), "naive-path", at_most=9))
    assert said.startswith("First, we move east from grid 0, 6 steps left, for 4 cells to grid 4, 2 steps left")


def test_of_a_run_an_exact_number_is_said_as_it_is() -> None:
    told = rt.explain(PAPER, "naive-path", at_most=9, detail=True)
    run = next(sentence.steps for sentence in sentences(told) if len(sentence.steps) > 1)
    numbers = ((numbered("east", 4.0, 4.0), numbered("south", 115.0, 115.0), numbered("north", 5.5, 5.5)),)
    steps = [replace(one, numbers=numbers) if at in run else one for at, one in enumerate(told.steps)]
    said = narrate(replace(told, steps=tuple(steps)))
    assert "; any other action on the way would add 1.5 to 111 to the distance." in said

"""The names of a product's states: what a person is told of what must be remembered, and that it is so."""

from __future__ import annotations

import os
import re
from random import Random
from typing import Any

import numpy as np
import pytest
from missions import LABELS, random_mission, random_model, unfolding_of

from ratherthan.errors import QuestionError
from ratherthan.model.automaton import automaton_of
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP
from ratherthan.model.names import StateNames
from ratherthan.model.objective import Mission
from ratherthan.model.path import positive
from ratherthan.model.problem import Problem
from ratherthan.model.product import unfolded
from ratherthan.model.states import state_number
from ratherthan.model.syntax import Term, joined, negated, text_of

TRIES = int(os.environ.get("RATHERTHAN_MODELS", "200"))


def ring(names: StateNames | None = None, lexicon: Lexicon | None = None) -> Problem:
    """Five states in a ring, either way round: the parcel at 1, the door at 3, a hole at 4."""
    around = np.arange(5)
    places = {"parcel_picked_up": 1, "door": 3, "hole": 4}
    mdp = MDP(
        state_to_choices=np.arange(0, 11, 2),
        choice_to_branches=np.arange(11),
        branch_to_target=np.stack([(around + 1) % 5, (around - 1) % 5], axis=1).reshape(-1),
        branch_to_probability=np.ones(10),
        initial=np.array([0]),
        labels={label: around == place for label, place in places.items()},
        names=names or StateNames(count=5, strings=[f"grid {s}" for s in around]),
    )
    return Problem(mdp=mdp, lexicon=lexicon or Lexicon())


def names_of(formula: str, problem: Problem | None = None, *, maximise: bool = True) -> list[str]:
    made = unfolded(problem or ring(), Mission(formula=formula, maximise=maximise))
    return [made.mdp.names[pair] for pair in range(made.mdp.states)]


@pytest.mark.parametrize(
    ("formula", "told"),
    [
        ('F<=3 "door"', {"grid 0, 3 steps left", "grid 1, 2 steps left", "grid 2, 1 step left", "grid 3, done", "grid 1, too late"}),
        ('F ("parcel_picked_up" & (F "door"))', {"grid 0", "grid 1, parcel picked up", "grid 2, parcel picked up", "grid 3, done"}),
        ('(F "parcel_picked_up") & (F "door")', {"grid 0", "grid 2, parcel picked up", "grid 2, door reached", "grid 3, done"}),
        ('!"hole" U<=4 "door"', {"grid 0, 4 steps left", "grid 4, failed"}),
        ('F<=4 ("parcel_picked_up" & (F<=3 "door"))', {"grid 1, left: (parcel picked up then door within 3 steps) within 4 steps or door within 3 steps"}),
        ('(!"hole" U "parcel_picked_up") & (F "door")', {"grid 0", "grid 4, failed", "grid 2, parcel picked up"}),
        ('(F<=2 "parcel_picked_up") & (F<=4 "door")', {"grid 0, left: parcel picked up within 2 steps and door within 4 steps", "grid 2, parcel picked up, 3 steps left"}),
        ('F ("parcel_picked_up" & (X "door"))', {"grid 0", "grid 1, left: door next or parcel picked up then door in 1 step"}),
        ('X (X "door")', {"grid 0, 2 steps left", "grid 1, 1 step left", "grid 3, done", "grid 0, failed"}),
        ('G<=3 !"hole"', {"grid 0, 3 steps left", "grid 4, failed", "grid 1, done"}),
        ('F[2,4] "door"', {"grid 0, 4 steps left", "grid 3, 4 steps left", "grid 3, done"}),
        ('(F "door") | (F ("hole" & (F "parcel_picked_up")))', {"grid 0", "grid 4, hole reached", "grid 3, done"}),
    ],
)  # fmt: skip
def test_a_state_is_called_with_what_is_done_and_what_is_left(formula: str, told: set[str]) -> None:
    assert told <= set(names_of(formula))


def test_a_mission_to_be_avoided_has_failed_where_it_has_come() -> None:
    told = set(names_of('F<=2 "hole"', maximise=False))
    assert {"grid 0, 2 steps left", "grid 4, failed", "grid 2, averted"} <= told
    assert not any("done" in name or "late" in name for name in told)


VARIABLES = {"x": np.arange(5), "parcel": np.arange(5) > 1}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"names": StateNames(count=5)}, "state 0, 3 steps left"),
        ({"names": StateNames(count=5, variables=VARIABLES)}, "state 0 (x=0, parcel=false), 3 steps left"),
        ({"names": StateNames(count=5, variables={k: np.arange(5) for k in "abcdefg"})}, "state 0, 3 steps left"),
        ({"names": StateNames(count=5, strings=["7", "8", "9", "10", "11"])}, "state 0 (7), 3 steps left"),
        ({"lexicon": Lexicon(state="square {number}")}, "square 0, 3 steps left"),
        ({"lexicon": Lexicon(state="the {name}")}, "the grid 0, 3 steps left"),
        ({"lexicon": Lexicon(states={"0": "the depot"})}, "the depot, 3 steps left"),
        ({"lexicon": Lexicon(states={"grid 0": "the depot"}, state="square {number}")}, "the depot, 3 steps left"),
    ],
)
def test_a_state_is_called_as_the_model_calls_it(changes: dict[str, Any], told: str) -> None:
    problem = ring(**changes)
    made = unfolded(problem, Mission(formula='F<=3 "door"'))
    assert made.mdp.names[0] == told
    assert made.mdp.names.named
    assert made.lexicon.state == "{name}"
    assert not made.lexicon.states
    assert [made.mdp.names.find(made.mdp.names[pair]) for pair in range(made.mdp.states)] == list(
        range(made.mdp.states)
    )


def test_a_state_is_found_under_the_names_of_the_model_too() -> None:
    made = unfolded(ring(StateNames(count=5, variables=VARIABLES)), Mission(formula='F<=3 "door"'))
    assert state_number(made.mdp, "x=2, 2 steps left") == made.mdp.names.find(
        "state 2 (x=2, parcel=true), 2 steps left"
    )
    assert state_number(made.mdp, "parcel=true, x=2") == 2  # the mission begun there
    assert state_number(made.mdp, "7") == 7
    with pytest.raises(QuestionError, match="fits 2 states"):
        state_number(made.mdp, "parcel=true, 2 steps left")
    with pytest.raises(QuestionError, match="Names look like 'state 0"):
        state_number(made.mdp, "x=2, 9 steps left")


def test_the_variables_of_a_product_are_those_of_its_states() -> None:
    made = unfolded(ring(StateNames(count=5, variables=VARIABLES)), Mission(formula="F (x = 1 & (F !parcel))"))
    assert list(made.mdp.names.variables) == ["x", "parcel"]
    assert (made.mdp.names.variables["x"] == unfolding_of(made).state).all()
    assert "x = 1" in unfolding_of(made).left[0]


@pytest.mark.parametrize("seed", range(TRIES))
def test_no_two_states_of_a_product_have_one_name(seed: int) -> None:
    random = Random(seed)
    problem = random_model(random)
    made = unfolded(problem, random_mission(random, problem)[0])
    names = [made.mdp.names[pair] for pair in range(made.mdp.states)]
    assert len(set(names)) == len(names)
    assert [made.mdp.names.find(name) for name in names] == list(range(made.mdp.states))


def _held(words: str, seen: list[set[str]]) -> bool:
    """Whether the labels of "goal and (hazard or spot)" have held together."""
    return any(eval(words, {label: label in labels for label in LABELS}) for labels in seen)


@pytest.mark.parametrize("seed", range(TRIES))
def test_what_is_said_to_be_reached_has_been_reached_on_every_way(seed: int) -> None:
    random = Random(seed)
    problem = random_model(random)
    mission, _ = random_mission(random, problem)
    made = unfolded(problem, mission)
    for _ in range(20):
        pair = random.randrange(problem.mdp.states)
        seen: list[set[str]] = []
        for _ in range(8):
            seen.append({label for label in LABELS if made.mdp.labels[label][pair]})
            for part in made.mdp.names[pair].split(", "):
                told = re.fullmatch(r"([\w ()]*) reached", part)
                assert not told or _held(told[1], seen), (mission.text, part)
            choice = random.choice(made.mdp.choices_of(pair))
            pair = int(random.choice(made.mdp.branch_to_target[made.mdp.branches_of(choice)].tolist()))


@pytest.mark.parametrize("seed", range(TRIES))
def test_where_steps_are_left_the_mission_is_decided_after_them(seed: int) -> None:
    random = Random(seed)
    problem = random_model(random)
    mission, _ = random_mission(random, problem)
    made = unfolded(problem, mission)
    found = unfolding_of(made)
    ended = found.satisfied | found.violated
    for _ in range(10):
        pair = random.randrange(problem.mdp.states)
        for _ in range(3):
            told = re.fullmatch(r"[^:]*?(\d+) steps? left", made.mdp.names[pair])
            after = pair
            for _ in range(int(told[1]) if told else 0):
                choice = random.choice(made.mdp.choices_of(after))
                after = int(random.choice(made.mdp.branch_to_target[made.mdp.branches_of(choice)].tolist()))
            assert ended[after] or not told, (mission.text, made.mdp.names[pair])
            pair = after


@pytest.mark.parametrize("seed", range(TRIES))
def test_it_is_too_late_only_where_the_mission_could_still_come_without_its_bounds(seed: int) -> None:
    random = Random(seed)
    problem = random_model(random)
    bounded = Term("F", (_awaited(random, 2),), "<=2")
    made = unfolded(problem, Mission(formula=text_of(bounded)))
    free = automaton_of(positive(_unbounded(bounded)), problem.mdp)
    for _ in range(10):
        pair = random.randrange(problem.mdp.states)
        memory = free.start
        for _ in range(12):
            memory = int(free.after[memory, free.letter_of_state[unfolding_of(made).state[pair]]])
            if made.mdp.names[pair].endswith("too late"):
                assert not free.violated[memory]
                break
            choice = random.choice(made.mdp.choices_of(pair))
            pair = int(random.choice(made.mdp.branch_to_target[made.mdp.branches_of(choice)].tolist()))


def _awaited(random: Random, depth: int) -> Term:
    """A random formula in which things come within some steps, one after another or side by side."""
    label = Term("label", value=random.choice(LABELS))
    if depth == 0:
        return label
    inner = _awaited(random, depth - 1)
    op = random.choice(["F", "F", "&", "|", "U", "X"])
    if op in ("&", "|"):
        return joined(op, [inner, _awaited(random, depth - 1)])
    bound = f"<={random.randrange(1, 4)}"
    return {"F": Term("F", (inner,), bound), "X": Term("X", (inner,))}.get(
        op, Term("U", (negated(label), inner), bound)
    )


def _unbounded(term: Term) -> Term:
    return Term(term.op, tuple(map(_unbounded, term.args)), None if term.op in ("F", "U") else term.value)


def test_a_part_is_not_said_to_be_done_because_it_no_longer_matters() -> None:
    """Where the hole comes first the door need not be reached any more, though it never was."""
    told = names_of('(!"hole" U "door") | (F "parcel_picked_up")')
    assert "grid 4, left: parcel picked up" in told
    assert not any("door reached" in name for name in told)


@pytest.mark.parametrize(
    ("label", "told"),
    [
        ("parcel_picked_up", "parcel picked up"),
        ("mail delivered", "mail delivered"),
        ("sent", "sent"),
        ("kitchen", "kitchen reached"),
        ("bed", "bed reached"),
        ("top speed", "top speed reached"),
        ("done", "done reached"),
        ("3 steps left", "3 steps left reached"),
        ("too late", "too late reached"),
    ],
)
def test_a_label_is_told_as_something_done(label: str, told: str) -> None:
    problem = ring()
    labels = {**problem.mdp.labels, label: problem.mdp.labels["parcel_picked_up"]}
    fields = {name: getattr(problem.mdp, name) for name in problem.mdp.__dataclass_fields__}
    names = names_of(f'F ("{label}" & (F "door"))', Problem(mdp=MDP(**(fields | {"labels": labels}))))
    assert f"grid 2, {told}" in names
    assert len(set(names)) == len(names)


def test_names_are_made_as_they_are_asked_for() -> None:
    made = unfolded(ring(), Mission(formula='F<=1000 "hole"'))
    strings = made.mdp.names.strings
    assert strings is not None
    assert len(strings) == made.mdp.states
    assert strings[1:3] == [made.mdp.names[1], made.mdp.names[2]]
    assert strings[0] == "grid 0, 1000 steps left"

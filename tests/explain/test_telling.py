"""Which steps one sentence tells, by what they are ranked, and what is known of those that are left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.errors import QuestionError
from ratherthan.explain.detour import detours_of
from ratherthan.explain.detour._kernels import Effort, Rows, Way, Wish, detours
from ratherthan.explain.measures import Factors
from ratherthan.explain.question import question
from ratherthan.explain.telling import told_groups
from ratherthan.solve import Solution

# A wall with a door in it and a long way round: the door is what matters.
ROOMS = ["........", "........", "........", "@@@@.@@@", "........", "........", "........"]
Read = Callable[..., Solution]


@pytest.fixture
def on(tmp_path: Path) -> Read:
    """``on(rows, start="0,0", goal="7,0")`` solves a map of letters."""

    def solved(rows: list[str], **asked: object) -> Solution:
        path = tmp_path / "map.map"
        path.write_text(f"type octile\nheight {len(rows)}\nwidth {len(rows[0])}\nmap\n" + "\n".join(rows) + "\n")
        return rt.solve(rt.read(str(path), **{"slip": 0.0, "directions": 4, **asked}))

    return solved


def test_a_turn_is_a_turn_and_what_lies_between_is_one_sentence(on: Read) -> None:
    found = rt.explain(on(["....", "@@@.", "@@@."], start="0,0", goal="3,2"), "naive-path", at_most=9)
    assert told_groups(found) == ((0, 1, 2), (3, 4))
    assert rt.narrate(found) == (
        "First, we drive east from cell (0, 0) for 3 cells to cell (3, 0). Finally, we drive south for 2 cells to cell (3, 2)."
    )


def test_without_a_number_every_step_has_a_sentence(on: Read) -> None:
    found = rt.explain(on(["....", "@@@.", "@@@."], start="0,0", goal="3,2"), "naive-path")
    assert told_groups(found) == ((0,), (1,), (2,), (3,), (4,))


def test_the_door_comes_first(on: Read) -> None:
    found = rt.explain(on(ROOMS, start="1,0", goal="6,6"), at_most=1)
    (group,) = told_groups(found)
    places = [found.states[found.steps[at].state].place for at in group]
    assert {(4, 2), (4, 3)} & set(places)
    assert found.closing.left_out is not None
    assert found.closing.left_out.steps == sum(step.critical is not False for step in found.steps) - len(group)


def test_a_way_round_is_as_long_as_it_is(on: Read) -> None:
    ring = ["...", ".@.", ".@.", "..."]
    solution = on(ring, start="1,0", goal="2,2")
    found = rt.explain(solution, at_most=1)
    first = found.steps[0]
    assert first.rank is not None
    assert (first.rank.level, first.rank.settled) == (0, True)
    assert first.rank.size == pytest.approx(7 - 3)  # west, three times south, twice east, once north
    assert told_groups(found) != ()


def test_who_cannot_turn_back_has_no_other_way_in_a_corridor(on: Read) -> None:
    solution = on(["......", "@@@@@."], start="1,0", goal="5,1")
    found = rt.explain(solution, "selective", at_most=1)
    assert told_groups(found) == ((0, 1, 2, 3),)
    assert [step.rank and step.rank.size for step in found.steps] == [np.inf] * 5


@pytest.mark.kernels
def test_going_round_for_ever_is_no_way_to_arrive(on: Read) -> None:
    rows = [".....@.", ".....@.", "@......", ".....@."]  # one door, and before it much room to go round in
    solution = on(rows, start="3,0", goal="5,2", objective='Pmax=? [F "goal"]')
    found = rt.explain(solution, "naive-path", at_most=1)
    door = found.steps[-1]
    assert found.states[door.state].place == (4, 2)
    assert door.rank is not None
    assert (door.rank.size, door.rank.settled) == (1.0, True)


def test_what_changes_nothing_ranks_below_what_changes_a_later_objective(on: Read) -> None:
    rows = [
        "......",
        "@@.@@.",
        "@@.@@.",
        "@@.@@.",
        "@@....",
    ]  # two ways that are equal, then a way with nothing to decide
    both = 'R{"time"}min=? [F "goal"] then R{"distance"}min=? [F "goal"]'
    found = rt.explain(on(rows, start="0,0", goal="5,4", objective=both), "naive-path", at_most=1)
    levels = {step.rank.level for step in found.steps if step.rank is not None and step.rank.size == 0.0}
    assert levels == {1}


@pytest.mark.parametrize("ranking", ["detour", "spread", "expected", "place"])
def test_every_ranking_tells_as_much_as_there_is_room_for(on: Read, ranking: str) -> None:
    solution = on(ROOMS, start="1,0", goal="6,6", slip=0.2, directions=8)
    groups = told_groups(rt.explain(solution, at_most=99, ranking=ranking))
    for at_most in range(1, len(groups) + 1):
        found = rt.explain(solution, at_most=at_most, ranking=ranking)
        assert len(told_groups(found)) == at_most
        assert set(told_groups(found)) <= set(groups)
        if ranking == "place":
            assert told_groups(found) == groups[:at_most]


def test_less_work_leaves_lower_bounds(on: Read) -> None:
    solution = on(ROOMS, start="1,0", goal="6,6", slip=0.2, directions=8)
    found = rt.explain(solution)
    route = found.route[:-1], tuple(step.choice for step in found.steps)
    numbers = Factors(solution=solution, asked=question()).levels[0]
    known = detours_of(solution, 0, numbers, route, range(len(found.steps)))
    assert all(detour.settled for detour in known.values())
    mdp = solution.problem.mdp
    stands = np.full(mdp.states, mdp.states)
    stands[list(route[0])] = range(len(route[0]))
    nothing = np.where(solution.ended, mdp.states, 0)  # as if the plan came by the start from everywhere
    way = Way(np.array(route[0]), np.array(route[1]), np.ones(len(route[0]), dtype=np.bool_), stands, nothing)
    rows = Rows(mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target, mdp.branch_to_probability)
    paid = mdp.rewards["distance"].branch
    assert paid is not None
    price = np.add.reduceat(paid * mdp.branch_to_probability, mdp.choice_to_branches[:-1])
    wish = Wish(price, solution.values[0], np.zeros(0, dtype=np.bool_), 1.0, np.inf, False, False)  # noqa: FBT003
    for effort in (Effort(0, 0, 0), Effort(100, 0, 10**6), Effort(10**6, 0, 10**8)):
        value, settled = detours(rows, wish, way, effort)
        for at, detour in known.items():
            loss = value[at] - float(numbers.action_value[route[1][at]])
            assert loss <= detour.loss + 1e-9
            if settled[at]:
                assert loss == pytest.approx(detour.loss, abs=1e-8)
    assert settled.all()


def test_what_is_left_out_differs_by_no_more_than_is_said(on: Read) -> None:
    solution = on(ROOMS, start="1,0", goal="6,6", slip=0.2, directions=8)
    every = rt.explain(solution)
    for at_most in (1, 2, 3):
        found = rt.explain(solution, at_most=at_most)
        left = found.closing.left_out
        assert left is not None
        assert left.largest[0] is not None
        spreads = [step.spread for step, told in zip(every.steps, found.steps, strict=True) if not told.told]
        assert left.largest[0] == pytest.approx(max(high.value - low.value for high, low in spreads if high != low))


@pytest.mark.parametrize(
    "asked",
    [
        {"at_most": 0},
        {"at_most": True},
        {"at_most": 2.0},
        {"at_most": 3, "ranking": "beauty"},
        {"ranking": "spread"},
        {"at_most": 3, "kind": "responsibility"},
        {"at_most": 3, "rather_than": "south"},
        {"at_most": 3, "kind": "none"},
    ],
)
def test_what_makes_no_sense_is_refused(asked: dict[str, object]) -> None:
    with pytest.raises(QuestionError):
        question(**asked)  # type: ignore[arg-type]


def test_numbers_are_there_where_details_are_asked_for(on: Read) -> None:
    solution = on(ROOMS, start="1,0", goal="6,6")
    assert all(step.numbers == () for step in rt.explain(solution).steps)
    found = rt.explain(solution, detail=True)
    for step in found.steps:
        if step.critical is not False:
            ((own, *others),) = step.numbers
            assert own.choice == step.choice
            assert [row.action for row in others] == [other.action for other in step.alternatives]
    assert replace(found, steps=()) != found

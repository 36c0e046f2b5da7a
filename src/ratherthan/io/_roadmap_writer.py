"""A Problem that came from a road map enters, the text of one leaves.

A Problem keeps no drawing: kinds, one-way streets, chances and costs are found again in the arrays of the MDP. What is
found is a proposal; `ratherthan.io.roadmap.format_roadmap` reads it back and compares before anybody gets it.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._roadmap_moves import drawn_moves, neighbours
from ratherthan.io._roadmap_tables import ACTIONS, DIRECTIONS, STANDARD_KINDS, STREET_CHARACTERS
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.problem import Problem
from ratherthan.model.world import World

__all__ = ["written"]

Moves = npt.NDArray[np.int8]


def _refuse(reason: str) -> None:
    raise SourceError(f"Only a problem that came from a road map can be written as one: {reason}.")


@dataclass(frozen=True, eq=False)
class _Map:
    """What the arrays of a problem say about its map, found again."""

    problem: Problem
    world: World

    @cached_property
    def state(self) -> npt.NDArray[np.int64]:
        """The state of each choice, ``[C]``."""
        rows = self.problem.mdp.state_to_choices
        return np.repeat(np.arange(len(rows) - 1), np.diff(rows))

    @cached_property
    def action(self) -> npt.NDArray[np.int64]:
        """The direction of each choice, 4 for stay, ``[C]``."""
        place = [ACTIONS.index(name) if name in ACTIONS else -1 for name in self.problem.mdp.actions]
        named = self.problem.mdp.choice_to_action
        found = np.where(named >= 0, np.array([*place, -1])[named], -1)
        if (found < 0).any():
            _refuse(f"its actions must be among {', '.join(ACTIONS)}, but choice {int(np.argmin(found))} has another")
        return found

    @cached_property
    def moves(self) -> Moves:
        """The directions of each cell in order of preference, ``[N, 4]``."""
        rows = self.problem.mdp.state_to_choices
        slot = np.arange(self.problem.mdp.choices) - rows[self.state]
        if slot.max() > 3:
            _refuse(f"a cell has at most four moves, but state {int(self.state[np.argmax(slot)])} has more choices")
        moves = np.full((self.problem.mdp.states, 4), -1, dtype=np.int8)
        going = self.action < 4
        moves[self.state[going], slot[going]] = self.action[going]
        return moves

    @cached_property
    def around(self) -> npt.NDArray[np.int64]:
        """The cell in each direction of each cell, ``[4, N]``."""
        return neighbours(self.world.width, self.problem.mdp.states)

    @cached_property
    def enter(self) -> tuple[bool, ...]:
        """Whether cells of each kind can be entered: the standard kinds' rule; else whether one ever is."""
        mdp = self.problem.mdp
        source = np.repeat(self.state, np.diff(mdp.choice_to_branches))
        kinds = self.world.kind_of_cell
        reached = np.unique(kinds[mdp.branch_to_target[mdp.branch_to_target != source]]).tolist()
        reached += kinds[mdp.initial].tolist()
        return tuple(kind.enter for kind in STANDARD_KINDS.values()) + tuple(
            i in reached for i in range(len(STANDARD_KINDS), len(self.world.kinds))
        )

    @cached_property
    def leave(self) -> tuple[bool, ...]:
        """Whether moves may leave cells of each kind, likewise."""
        left = np.unique(self.world.kind_of_cell[(self.moves >= 0).any(axis=1)]).tolist()
        return tuple(kind.leave for kind in STANDARD_KINDS.values()) + tuple(
            i in left for i in range(len(STANDARD_KINDS), len(self.world.kinds))
        )

    @cached_property
    def characters(self) -> list[str]:
        """A character per kind: the standard ones, then a letter of the name, else any that is free."""
        taken = list(STANDARD_KINDS)
        for name in self.world.kinds[len(taken) :]:
            candidates = [c for c in name.lower() + name.upper() if c.isalnum()] + [chr(c) for c in range(0xC0, 0x250)]
            taken.append(next(c for c in candidates if c not in taken and c not in STREET_CHARACTERS))
        return taken

    def chances(self) -> tuple[Floats, Floats]:
        """Return success and drift per kind, from the branches ahead and aside; 1 and 0 where nothing leaves."""
        mdp = self.problem.mdp
        choice = np.repeat(np.arange(mdp.choices), np.diff(mdp.choice_to_branches))
        state, action = self.state[choice], self.action[choice]
        kind = self.world.kind_of_cell[state]
        found = [np.ones(len(self.world.kinds)), np.zeros(len(self.world.kinds))]
        for turn, values, factor in ((0, found[0], 1), (1, found[1], 2), (3, found[1], 2)):
            there = (action < 4) & (mdp.branch_to_target == self.around[(action + turn) % 4, state])
            values[kind[there]] = factor * mdp.branch_to_probability[there]
        return found[0], found[1]

    def cost(self, name: str) -> Floats:
        """Return the cost per kind, NaN for kinds that are not on the map."""
        reward = self.problem.mdp.rewards[name]
        if reward.state is not None or reward.branch is not None:
            _refuse(f"costs are paid per choice, but reward '{name}' has others, too")
        per_choice = np.zeros(len(self.state)) if reward.choice is None else reward.choice
        cost = np.full(len(self.world.kinds), np.nan)
        cost[self.world.kind_of_cell[self.state]] = per_choice
        return cost


def written(problem: Problem) -> str:
    """Return the text of a road map for `problem`; it is to be read back and compared.

    Raises
    ------
    SourceError
        If the problem is none that a road map can say.
    """
    world = problem.world
    if world is None:
        raise SourceError("Only a problem that came from a road map can be written as one: it has no map.")
    if world.kinds[: len(STANDARD_KINDS)] != tuple(kind.name for kind in STANDARD_KINDS.values()):
        _refuse("its kinds of ground must begin with those of the format")
    if not np.array_equal(world.cell_of_state, np.arange(world.width * world.height)):
        _refuse("its states must be its cells, in the same order")
    if len(problem.mdp.initial) != 1:
        _refuse(f"it must have one initial state, got {len(problem.mdp.initial)}")
    if world.zones or problem.definitions or problem.mdp.names.named:
        _refuse("a road map has no zones, definitions or state names")
    found = _Map(problem, world)
    parts = [*_header(found), *_drawings(found), *_kinds(found), *_costs(found), *_labels(found), *_properties(problem)]
    return "\n".join([*parts, *_words(problem)]).strip("\n") + "\n"


def _header(found: _Map) -> list[str]:
    problem, world = found.problem, found.world
    lines = [f"{key} = {_string(text)}" for key, text in (("title", world.title), ("note", world.note)) if text]
    success, drift = found.chances()
    on_map = np.isin(np.arange(len(world.kinds)), world.kind_of_cell[(found.moves >= 0).any(axis=1)])
    lines.append(f"success = {_per_kind(success, on_map, world.kinds)}")
    if drift.any():
        lines.append(f"drift = {_per_kind(drift, on_map, world.kinds)}")
    start = int(problem.mdp.initial[0])
    if world.kinds[world.kind_of_cell[start]] != "start":
        lines.append(f"start = {start}")
    if problem.objective is not None:
        lines.append(f"property = {_string(problem.objective.text)}")
    return lines


def _drawings(found: _Map) -> list[str]:
    """Return the drawing of kinds, that of streets where it differs, the order, and [moves] for what cannot be drawn."""
    world = found.world
    map_ = np.array([ord(c) for c in found.characters], dtype=np.uint32)[world.kind_of_cell]
    moves, leave = found.moves, np.array(found.leave)[world.kind_of_cell]
    if ((moves >= 0).any(axis=1) & ~leave).any():
        cell = int(np.argmax((moves >= 0).any(axis=1) & ~leave))
        _refuse(
            f"no move may leave a cell of the kind '{world.kinds[world.kind_of_cell[cell]]}', but state {cell} has one"
        )
    order = _likely_order(moves)
    arrow, missed = _arrows(found, leave, order)
    streets = np.where(arrow >= 0, np.array([ord(c) for c in "^>v<"], dtype=np.uint32)[arrow], map_)
    for character, directions in (("-", (1, 3)), ("|", (0, 2))):
        drawn = _drawn(found, leave, arrow, order, directions)
        same = missed & (drawn == moves).all(axis=1)
        streets = np.where(same, ord(character), streets)
        missed &= ~same
    lines = [f"order = {_string(' '.join(DIRECTIONS[d] for d in order))}"]
    lines += ["map = '''", *_picture(map_, world.width), "'''"]
    if (streets != map_).any():
        lines += ["streets = '''", *_picture(streets, world.width), "'''"]
    if missed.any():
        lines += ["", "[moves]"]
        for cell in np.flatnonzero(missed).tolist():
            names = [DIRECTIONS[d] for d in moves[cell] if d >= 0] or ["stay"]
            lines.append(f"{cell} = {_string(', '.join(names))}")
    return lines


def _likely_order(moves: Moves) -> tuple[int, ...]:
    """Return the order of preference that most cells keep: directions by how many others they mostly stand before."""
    before = np.zeros((4, 4), dtype=np.int64)
    for early in range(3):
        for late in range(early + 1, 4):
            both = (moves[:, early] >= 0) & (moves[:, late] >= 0)
            np.add.at(before, (moves[both, early], moves[both, late]), 1)
    wins = (before > before.T).sum(axis=1)
    return tuple(sorted(range(4), key=lambda direction: (-int(wins[direction]), direction)))


def _arrows(found: _Map, leave: Bools, order: tuple[int, ...]) -> tuple[Moves, Bools]:
    """Return the arrows ``[N]`` (-1: none) that make the drawing right, and the cells ``[N]`` where it still is not.

    An arrow keeps the neighbour ahead of it from driving against it, so it is drawn only where the drawing without it is
    wrong: arrows are added until no cell with one move is wrong. Should that take long, every such cell gets its arrow.
    """
    single = (found.moves >= 0).sum(axis=1) == 1
    arrow = np.full(len(single), -1, dtype=np.int8)
    for attempt in range(20):
        missed = leave & (_drawn(found, leave, arrow, order, (0, 1, 2, 3)) != found.moves).any(axis=1)
        wanted = missed & single if attempt < 18 else single & (arrow < 0)
        if not wanted.any():
            break
        arrow[wanted] = found.moves[wanted, 0]
    return arrow, missed


def _drawn(found: _Map, leave: Bools, arrow: Moves, order: tuple[int, ...], directions: tuple[int, ...]) -> Moves:
    """Return the moves ``[N, 4]`` of a drawing in which every cell without an arrow may go in `directions`."""
    towards = leave[:, None] & np.isin(np.arange(4), directions)[None, :]
    enter = np.array(found.enter)[found.world.kind_of_cell]
    moves = drawn_moves(towards, arrow, enter, found.around, order)
    filled = np.argsort(moves < 0, axis=1, kind="stable")
    return np.take_along_axis(moves, filled, axis=1)


def _picture(codes: npt.NDArray[Any], width: int) -> list[str]:
    text = codes.astype("<u4").tobytes().decode("utf-32-le")
    return [text[i : i + width] for i in range(0, len(text), width)]


def _kinds(found: _Map) -> list[str]:
    first = len(STANDARD_KINDS)
    lines = []
    for i, name in enumerate(found.world.kinds[first:], start=first):
        enter, leave = found.enter[i], found.leave[i]
        flags = f", enter = {_flag(enter)}, leave = {_flag(leave)}"
        entry = _string(name) if enter and leave else f"{{ name = {_string(name)}{flags} }}"
        lines.append(f"{_string(found.characters[i])} = {entry}")
    return ["", "[kinds]", *lines] if lines else []


def _costs(found: _Map) -> list[str]:
    lines = []
    destination = found.world.kinds.index("destination")
    for name in found.problem.mdp.rewards:
        cost = found.cost(name)
        on_map = np.isfinite(cost)
        on_map[destination] = False
        lines.append(f"{name} = {_per_kind(cost, on_map, found.world.kinds)}")
    if not lines:
        _refuse("it must have a cost")
    return ["", "[costs]", *lines]


def _per_kind(values: Floats, counted: Bools, kinds: tuple[str, ...]) -> str:
    """Return one number, or a table of kinds with the most common number as ``other``."""
    numbers, times = np.unique(values[counted], return_counts=True)
    if len(numbers) == 0:
        return "1"
    other = float(numbers[np.argmax(times)])
    if len(numbers) == 1:
        return _number(other)
    special = [i for i in np.flatnonzero(counted) if values[i] != other]
    entries = [f"other = {_number(other)}", *(f"{_key(kinds[i])} = {_number(float(values[i]))}" for i in special)]
    return "{ " + ", ".join(entries) + " }"


def _labels(found: _Map) -> list[str]:
    lines = []
    for name, mask in found.problem.mdp.labels.items():
        if name == "destination":
            continue
        whole = [i for i in range(len(found.world.kinds)) if (found.world.kind_of_cell == i).any()]
        whole = [i for i in whole if mask[found.world.kind_of_cell == i].all()]
        rest = np.flatnonzero(mask & ~np.isin(found.world.kind_of_cell, whole))
        parts = [*(_string(found.world.kinds[i]) for i in whole), *map(str, rest.tolist())]
        lines.append(f"{_key(name)} = [{', '.join(parts)}]")
    return ["", "[labels]", *lines] if lines else []


def _properties(problem: Problem) -> list[str]:
    lines = [f"{_key(name)} = {_string(one.text)}" for name, one in problem.properties.items()]
    return ["", "[properties]", *lines] if lines else []


def _words(problem: Problem) -> list[str]:
    lexicon = problem.lexicon
    lines = ["", "[words]", f"language = {_string(lexicon.language)}", f"state = {_string(lexicon.state)}"]
    for section, table in (("actions", lexicon.actions), ("gerunds", lexicon.gerunds), ("cells", lexicon.states)):
        if table:
            lines += ["", f"[words.{section}]", *(f"{_key(key)} = {_string(text)}" for key, text in table.items())]
    for name, table in lexicon.objectives.items():
        lines += [
            "",
            f"[words.objectives.{_key(name)}]",
            *(f"{_key(k)} = {_string(text)}" for k, text in table.items()),
        ]
    return lines


def _string(text: str) -> str:
    plain = "'" not in text and text.isprintable()
    return f"'{text}'" if plain and ('"' in text or "\\" in text) else json.dumps(text, ensure_ascii=False)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _string(name)


def _flag(value: bool) -> str:
    return "true" if value else "false"


def _number(value: float) -> str:
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)

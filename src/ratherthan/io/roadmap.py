"""A road map (a text file that a person draws) enters, a Problem leaves; and back.

Cells are numbered row by row from 0, row 0 at the top (north). Every cell is a state with the cell's number, buildings
too. The choices of a state are the moves of its cell in order of preference; a cell without moves has the one choice
``stay``. With *p* and *d* the ``success`` and ``drift`` of the ground that a move starts from, it ends

- in the cell ahead with probability *p*,
- in the cell to the left, and in the one to the right, with probability *d*/2 each, where that cell can be entered,
- in the same cell with the rest.

Every attempt costs what the kind of ground it starts from costs, ``stay`` too, except at a destination, where all is free.
The format is described in docs/roadmap-format.md.
"""

from __future__ import annotations

import os
from dataclasses import replace
from decimal import Decimal
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import InputError, PropertyError, SourceError
from ratherthan.io._files import open_source, write_atomically
from ratherthan.io._roadmap_layout import Layout, layout_of
from ratherthan.io._roadmap_tables import ACTIONS, spelled, table_of, text_of
from ratherthan.io._roadmap_text import Document
from ratherthan.io._roadmap_writer import written
from ratherthan.model.mdp import MDP, Floats, Reward
from ratherthan.model.objective import Objective, Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.world import World

__all__ = ["format_roadmap", "parse_roadmap", "read_roadmap", "write_roadmap"]


def read_roadmap(path: str | os.PathLike[str]) -> Problem:
    """Read a road map from a file.

    Parameters
    ----------
    path : path

    Returns
    -------
    Problem
        With a World; its states are the cells.

    Raises
    ------
    SourceError
        If the file cannot be read, is not UTF-8, or breaks a rule of the format (with line and column).
    PropertyError
        If a property in it cannot be parsed.
    """
    source = os.fspath(path)
    with open_source(path) as file:
        data = file.read()
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - data.rfind(b"\n", 0, error.start)
        raise SourceError(
            f"{source}, line {line}, column {column}: A road map must be UTF-8 text, got the byte 0x{data[error.start]:02x}. "
            "Save it as UTF-8.",
            source=source,
            line=line,
            column=column,
        ) from error
    return parse_roadmap(text, source=source)


def parse_roadmap(text: str, *, source: str = "a road map") -> Problem:
    """Read a road map from its text.

    Parameters
    ----------
    text : str
    source : str
        What to call it in messages.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        If it breaks a rule of the format (with line and column).
    PropertyError
        If a property in it cannot be parsed.

    Examples
    --------
    >>> problem = parse_roadmap("map = 'S.D'")
    >>> problem.mdp
    MDP(3 states, 4 choices, 4 branches; labels: destination; rewards: distance)
    >>> [problem.mdp.action_name(choice) for choice in problem.mdp.choices_of(1)]
    ['east', 'west']
    """
    document = Document.read(text, source)
    layout = layout_of(document)
    ground = layout.ground
    meta = {key: text_of(document, (key,), document.tables.get(key, "")) for key in ("title", "note", "property")}
    world = World(
        width=ground.width,
        height=len(ground.kind_of_cell) // ground.width,
        kinds=ground.legend.names,
        kind_of_cell=ground.kind_of_cell,
        cell_of_state=np.arange(len(ground.kind_of_cell), dtype=np.int32),
        note=meta["note"],
        title=meta["title"],
    )
    bare = Problem(mdp=_mdp_of(layout), world=world, lexicon=layout.lexicon, source=source)
    return _with_properties(bare, document, meta["property"])


def format_roadmap(problem: Problem) -> str:
    """Return the text of a road map that reads as `problem`.

    The text is read back and compared, so what is returned says exactly this problem: its model, map, words, objective
    and properties. Comments and drawings of the original are not kept.

    Parameters
    ----------
    problem : Problem

    Returns
    -------
    str

    Raises
    ------
    SourceError
        If the problem is none that a road map can say, with the reason.
    """
    text = written(problem)
    try:
        different = _differences(problem, parse_roadmap(text))
    except InputError as error:
        raise SourceError(f"This problem cannot be written as a road map: {error.message}") from error
    if different:
        raise SourceError(
            "Only a problem that came from a road map can be written as one: read back, its "
            f"{', '.join(different)} would be others."
        )
    return text


def write_roadmap(problem: Problem, path: str | os.PathLike[str]) -> None:
    """Write a problem that came from a road map to a file.

    Parameters
    ----------
    problem : Problem
    path : path

    Raises
    ------
    SourceError
        If the problem is none that a road map can say, with the reason; or the file cannot be written.
    """
    text = format_roadmap(problem)
    with write_atomically(path) as file:
        file.write(text.encode("utf-8"))


def _mdp_of(layout: Layout) -> MDP:
    """Return the MDP: one choice per move, `stay` where there is none."""
    kind, moves = layout.ground.kind_of_cell, layout.moves
    stays = np.where((moves < 0).all(axis=1), 4, -1).astype(np.int8)
    table = np.column_stack([moves, stays])  # [N, 5]
    taken = table >= 0
    state, slot = np.nonzero(taken)
    action = table[state, slot]
    target, probability = _branches(layout, state, action)
    kept = probability > 0
    at_destination = layout.labels["destination"][state]
    return MDP(
        state_to_choices=np.concatenate([[0], np.cumsum(taken.sum(axis=1))]),
        choice_to_branches=np.concatenate([[0], np.cumsum(kept.sum(axis=1))]),
        branch_to_target=target[kept],
        branch_to_probability=probability[kept],
        choice_to_action=action.astype(np.int32),
        actions=ACTIONS,
        labels=layout.labels,
        rewards={
            name: Reward(choice=np.where(at_destination, 0.0, cost[kind][state])) for name, cost in layout.costs.items()
        },
        initial=np.array([layout.start], dtype=np.int64),
    )


def _branches(
    layout: Layout, state: npt.NDArray[np.intp], action: npt.NDArray[np.int8]
) -> tuple[npt.NDArray[np.int64], Floats]:
    """Return target and probability of up to four branches per choice, ``[C, 4]``: ahead, left, right, same cell."""
    around, enter = layout.ground.around, layout.ground.enter
    kind = layout.ground.kind_of_cell[state]
    move = action < 4
    direction = np.where(move, action, 0)
    columns = [(around[direction, state], np.where(move, layout.success[kind], 0.0))]
    open_sides = np.zeros(len(state), dtype=np.intp)
    if layout.drift.any():
        for turn in (3, 1):  # left, right
            side = around[(direction + turn) % 4, state]
            open_ = move & (side >= 0) & enter[side]
            columns.append((side, np.where(open_, layout.drift[kind] / 2, 0.0)))
            open_sides += open_
    rest = np.array([[_rest(p, d, n) for n in range(3)] for p, d in zip(layout.success, layout.drift, strict=True)])
    columns.append((state, np.where(move, rest[kind, open_sides], 1.0)))
    return np.column_stack([target for target, _ in columns]), np.column_stack([chance for _, chance in columns])


def _rest(success: float, drift: float, sides: int) -> float:
    """Return 1 - p - n·d/2, as a person computes it: 1 - 0.9 is 0.1."""
    rest = 1 - Decimal(repr(float(success))) - sides * Decimal(repr(float(drift))) / 2
    return max(float(rest), 0.0)  # kinds that nothing leaves may have chances that do not fit; they are not used


def _with_properties(bare: Problem, document: Document, default: str) -> Problem:
    """Return the problem with its properties parsed."""
    from ratherthan.model.property import parse_property

    def parsed(keys: tuple[str, ...], text: str) -> Objective | Threshold:
        try:
            return parse_property(text, bare)
        except PropertyError as error:
            line = document.line_of(keys)
            place = f"{document.source}, line {line}: " if line else f"{document.source}: "
            raise PropertyError(
                f"{place}{error.message}", **{**error.place, "source": document.source, "line": line}
            ) from error

    properties = {
        name: parsed(("properties", name), text_of(document, ("properties", name), text))
        for name, text in table_of(document, ("properties",)).items()
    }
    objective = parsed(("property",), default) if default else None
    if isinstance(objective, Threshold):
        document.fail(f"'property' must ask for a best value (=?), got {spelled(default)}.", ("property",))
    return replace(bare, objective=objective, properties=properties)


def _differences(one: Problem, other: Problem) -> list[str]:
    """Return in what two problems with maps differ, in a few words each; nothing where they are equal."""
    a, b = one.mdp, other.mdp
    assert one.world is not None
    assert other.world is not None
    arrays = ("state_to_choices", "choice_to_branches", "branch_to_target", "branch_to_probability", "initial")
    same = {
        "choices": all(np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays[:2]),
        "moves": all(np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays[2:4]),
        "initial state": np.array_equal(a.initial, b.initial),
        "actions": a.actions == b.actions and np.array_equal(a.choice_to_action, b.choice_to_action),
        "labels": _equal_arrays(a.labels, b.labels),
        "costs": _equal_arrays(
            {name: r.choice for name, r in a.rewards.items()}, {n: r.choice for n, r in b.rewards.items()}
        ),
        "map": _equal_arrays(_fields(one.world), _fields(other.world)),
        "words": one.lexicon == other.lexicon,
        "objective": one.objective == other.objective,
        "properties": dict(one.properties) == dict(other.properties),
    }
    return [name for name, equal in same.items() if not equal]


def _fields(world: World) -> dict[str, Any]:
    return {name: getattr(world, name) for name in world.__dataclass_fields__}


def _equal_arrays(one: Any, other: Any) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(value, other[key]) for key, value in one.items())

"""A known environment's identity and its table enter; its documented names, words and map leave, and rules beside the table.

What is said of FrozenLake, CliffWalking, Taxi and MiniGrid is what their documentation says of actions, observations,
starting states and arguments.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._gym_entries import Numbers, Table
from ratherthan.io._gym_model import Ended
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.world import World

__all__ = ["MINIGRID_WORDS", "Kind", "fickle", "kind_of"]

Columns = Mapping[str, npt.NDArray[np.generic]]
MOVES = {name: f"move {name}" for name in ("left", "down", "right", "up")}
CELL = "cell ({name})"
TAXI_PLACES = ("Red", "Green", "Yellow", "Blue")
TAXI_CELLS = (0, 4, 20, 23)
TAXI_WIDTH = 5
IN_TAXI = 4
CLIFF = (4, 12)

MINIGRID_WORDS = Lexicon(
    actions={
        "left": "turn left",
        "right": "turn right",
        "forward": "move forward",
        "pickup": "pick up what is ahead",
        "drop": "drop what we carry",
        "toggle": "toggle what is ahead",
        "done": "signal that we are done",
    },
    gerunds={
        "pickup": "picking up what is ahead",
        "drop": "dropping what we carry",
        "done": "signalling that we are done",
    },
)


@dataclass(frozen=True, kw_only=True)
class Kind:
    """What the documentation of an environment says of its states and actions.

    Parameters
    ----------
    actions : tuple of str
    lexicon : Lexicon
    columns : callable
        State variables from an `Ended`, each ``[S']``.
    world : callable
        The map, likewise and with the initial states; None where it has none.
    """

    actions: tuple[str, ...]
    lexicon: Lexicon
    columns: Callable[[Ended], Columns]
    world: Callable[[Ended, Numbers], World] | None = field(default=None)


def kind_of(name: str, facts: Mapping[str, Any], table: Table) -> Kind | None:
    """Return what is known of an environment, None where it is none of those or its table has another size.

    Parameters
    ----------
    name : str
        Its registered name, such as ``FrozenLake-v1``.
    facts : mapping
        Its arguments or attributes: ``nrow`` and ``ncol``, ``desc`` or ``map_name``; ``fickle_passenger``.
    table : Table
        Already with the rules beside it (`fickle`).
    """
    if name.startswith("FrozenLake") and table.actions == 4:
        shape = _lake_shape(name, facts, table.states)
        return None if shape is None else _lake(shape)
    if name.startswith("CliffWalking") and (table.states, table.actions) == (48, 4):
        return _cliff()
    if name.startswith("Taxi") and (table.states, table.actions) in ((500, 6), (1000, 6)):
        return _taxi(two_moods=table.states == 1000)
    return None


def _lake_shape(name: str, facts: Mapping[str, Any], states: int) -> tuple[int, int] | None:
    """Return rows and columns of a lake, None where they do not make up its states."""
    described = facts.get("desc")
    named = re.fullmatch(r"(\d{1,6})x(\d{1,6})", str(facts.get("map_name") or ("8x8" if "8x8" in name else "4x4")))
    sides = facts.get("nrow"), facts.get("ncol")
    if isinstance(sides[0], int) and isinstance(sides[1], int):
        shape = sides[0], sides[1]
    elif isinstance(described, list | tuple) and described and all(isinstance(row, str) for row in described):
        shape = len(described), len(described[0])
    else:
        shape = (int(named[1]), int(named[2])) if named else (0, 0)
    return shape if shape[0] * shape[1] == states else None


def _grid(shape: tuple[int, int], ended: Ended) -> Columns:
    return {"row": ended.origin // shape[1], "col": ended.origin % shape[1]}


def _lake(shape: tuple[int, int]) -> Kind:
    def world(ended: Ended, initial: Numbers) -> World:
        kinds = np.zeros(shape[0] * shape[1], dtype=np.uint8)
        kinds[initial] = 1
        kinds[ended.origin[ended.terminal & ~ended.goal]] = 2
        kinds[ended.origin[ended.goal]] = 3
        return _world(shape, ("frozen", "start", "hole", "goal"), kinds, ended.origin, title="Frozen Lake")

    return Kind(
        actions=("left", "down", "right", "up"),
        lexicon=Lexicon(actions=MOVES, state=CELL),
        columns=lambda ended: _grid(shape, ended),
        world=world,
    )


def _cliff() -> Kind:
    def world(ended: Ended, initial: Numbers) -> World:
        kinds = np.zeros(CLIFF[0] * CLIFF[1], dtype=np.uint8)
        kinds[37:47] = 2
        kinds[initial] = 1
        kinds[ended.origin[ended.goal]] = 3
        return _world(CLIFF, ("ground", "start", "cliff", "goal"), kinds, ended.origin, title="Cliff Walking")

    return Kind(
        actions=("up", "right", "down", "left"),
        lexicon=Lexicon(actions=MOVES, state=CELL),
        columns=lambda ended: _grid(CLIFF, ended),
        world=world,
    )


def _taxi(*, two_moods: bool) -> Kind:
    def columns(ended: Ended) -> Columns:
        state = ended.origin % 500
        passenger = np.array([*TAXI_PLACES, "in taxi"])[state // 4 % 5].astype("<U9")
        passenger[ended.terminal] = "delivered"
        found: dict[str, npt.NDArray[np.generic]] = {
            "taxi_row": state // 100,
            "taxi_col": state // 20 % 5,
            "passenger": passenger,
            "destination": np.array(TAXI_PLACES)[state % 4],
        }
        return found | ({"settled": ended.origin >= 500} if two_moods else {})

    def world(ended: Ended, initial: Numbers) -> World:  # noqa: ARG001 - any cell may be the start
        cells = np.arange(TAXI_WIDTH**2)
        zones = {name: cells == cell for name, cell in zip(TAXI_PLACES, TAXI_CELLS, strict=True)}
        kinds, place = np.zeros(len(cells), dtype=np.uint8), ended.origin % 500 // 20
        return _world((TAXI_WIDTH, TAXI_WIDTH), ("road",), kinds, place, zones=zones, title="Taxi")

    return Kind(
        actions=("south", "north", "east", "west", "pickup", "dropoff"),
        lexicon=Lexicon(
            actions={"pickup": "pick up the passenger", "dropoff": "drop off the passenger"},
            gerunds={"pickup": "picking up the passenger", "dropoff": "dropping off the passenger"},
        ),
        columns=columns,
        world=world,
    )


def _world(
    shape: tuple[int, int],
    kinds: tuple[str, ...],
    kind_of_cell: npt.NDArray[np.uint8],
    cell_of_state: Numbers,
    **more: Any,
) -> World:
    return World(
        width=shape[1],
        height=shape[0],
        kinds=kinds,
        kind_of_cell=kind_of_cell,
        cell_of_state=cell_of_state.astype(np.int32),
        **more,
    )


def fickle(name: str, facts: Mapping[str, Any], table: Table) -> tuple[Table, tuple[str, ...]]:
    """Return Taxi's table with its rule of the fickle passenger, which the table itself leaves out; others as they are.

    The environment draws at the start, unseen, whether the passenger will change the destination when first driven a cell.
    Whether to draw then or at that move is the same in law, so the model draws at that move: with the stated probability
    the destination becomes one of the others, each as likely. States are doubled: s before, 500 + s after that move.

    Raises
    ------
    SourceError
        Where the version of Taxi is one whose rule is another.
    """
    if not name.startswith("Taxi") or not facts.get("fickle_passenger"):
        return table, ()
    chance = facts.get("fickle_probability", 0.3 if name == "Taxi-v4" else None)
    if chance is None or (table.states, table.actions) != (500, 6):
        raise SourceError(
            f"A fickle passenger can be modelled as Taxi-v4 has it (Gymnasium 1.3 and later), but '{name}' is another. "
            "Take Taxi-v4, or leave out fickle_passenger.",
            environment=name,
        )
    if isinstance(chance, bool) or not isinstance(chance, int | float) or not 0 <= chance <= 1:
        raise SourceError(f"fickle_probability must be a number in 0 … 1, got {chance!r}.", environment=name)
    drives = (table.state // 4 % 5 == IN_TAXI) & (table.state // 20 != table.target // 20)
    before, ride = table.taken(~drives), table.taken(drives)
    wanted = ride.state % 4
    parts = [before, _moved(ride, 1 - chance, ride.target + 500)]
    parts += [
        _moved(ride, chance / 3, ride.target - ride.target % 4 + (wanted + other) % 4 + 500) for other in (1, 2, 3)
    ]
    parts.append(_moved(table, 1.0, table.target + 500, table.state + 500))
    whole = Table(
        states=1000,
        actions=table.actions,
        state=np.concatenate([part.state for part in parts]),
        action=np.concatenate([part.action for part in parts]),
        target=np.concatenate([part.target for part in parts]),
        probability=np.concatenate([part.probability for part in parts]),
        reward=np.concatenate([part.reward for part in parts]),
        terminated=np.concatenate([part.terminated for part in parts]),
    )
    note = (
        f"The passenger is fickle: when first driven a cell, the destination changes with probability {chance:g}. "
        "States 500 … 999 are those after that move (settled)."
    )
    return whole.taken(whole.probability != 0), (note,)


def _moved(part: Table, share: float, target: Numbers, state: Numbers | None = None) -> Table:
    return Table(
        states=1000,
        actions=part.actions,
        state=part.state if state is None else state,
        action=part.action,
        target=target,
        probability=part.probability * share,
        reward=part.reward,
        terminated=part.terminated,
    )

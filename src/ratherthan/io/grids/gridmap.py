"""A map of cells, how a robot moves on it, a start and a goal enter; a Problem leaves.

Every cell where the robot can be is a state. The model has the label ``goal``, one for every named zone, and the rewards ``distance``,
``time`` and ``risk`` (see `moves`): the risk of a unit of length is 0.01 wherever one drives, plus that of the zones it lies in, plus
the chance that the cell is occupied after all, plus 1 - clearance / `safe` where the nearest obstacle is nearer than `safe`. Without
the first, a robot would drive through open ground for miles to save a little at a door.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ratherthan.errors import QuestionError, SourceError
from ratherthan.io.grids.drive import ROBOT, SAFE, SPEED, Drive, drive_of
from ratherthan.io.grids.ground import FORBIDDEN, Ground, clearance, closed_as, coarser, grown
from ratherthan.io.grids.moves import Moves, moves_on
from ratherthan.io.grids.movingai import is_movingai, read_map, read_way
from ratherthan.io.grids.names import CellNames, cell_of
from ratherthan.io.grids.rosmap import read_rosmap
from ratherthan.io.grids.zones import Zone, read_zones
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP, Bools, Floats, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.problem import Problem
from ratherthan.model.watch import look, room_for
from ratherthan.model.world import World

__all__ = ["Drive", "problem_on", "read_grid", "read_gridmap"]

BYTES = 700.0
"""About how many bytes a cell takes, with its choices and branches."""
ALWAYS = 0.01
"""The risk of a unit of length driven on open ground far from everything."""
ZONES = ".zones.toml"
WISHES = {"shortest": "distance", "fastest": "time", "least risk": "risk"}
"""What can be wanted of a way, and the reward that it is least of."""
SECONDS = {"unit": " s", "amount": "a time of {value} s"}
METRES = {"distance": {"unit": " m", "amount": "a distance of {value} m"}, "time": SECONDS}
CELLS = {"distance": {"unit": " cells", "amount": "a distance of {value} cells"}, "time": SECONDS}
"""Units of what is expected, after numbers in sentences."""
NO_GOAL = (
    "This map has no goal yet. Give one with --goal COLUMN,ROW or --goal 1.2m,3.4m, or with a row of a scenario file."
)


def read_grid(path: str | os.PathLike[str], **asked: Any) -> Problem:
    """Read a map with what is asked of the robot, as `ratherthan.read` takes it.

    Parameters
    ----------
    path : path
    **asked
        ``start``, and what `ratherthan.io.grids.drive.KEYS` lists.

    Raises
    ------
    SourceError
        If a file cannot be read.
    QuestionError
        If start, goal or robot do not fit the map.
    """
    return read_gridmap(path, drive_of(asked))


def read_gridmap(path: str | os.PathLike[str], drive: Drive | None = None) -> Problem:
    """Read a MovingAI map or a map of the ROS map server.

    Parameters
    ----------
    path : path
        ``.map``, or ``.yaml`` with an image beside it.
    drive : Drive, optional

    Returns
    -------
    Problem
        With a World.

    Raises
    ------
    SourceError
        If a file cannot be read.
    QuestionError
        If start, goal or robot do not fit the map.
    """
    source, drive = os.fspath(path), drive or Drive()
    if is_movingai(source):
        if drive.unknown != "closed":
            raise QuestionError(
                "Unknown ground must be free or closed on maps of the ROS map server alone: this is none."
            )
        ground = read_map(path)
    else:
        ground = read_rosmap(path, unknown_free=drive.unknown == "free")
    if drive.scenario is not None:
        drive = _from_scenario(drive, ground, source)
    beside = Path(source).with_suffix(ZONES)
    file = drive.zones or (str(beside) if beside.is_file() else None)
    zones = () if file is None else read_zones(file, ground)
    return problem_on(ground, drive, zones, source)


def problem_on(ground: Ground, drive: Drive, zones: Sequence[Zone] = (), source: str = "a map") -> Problem:
    """Return the problem of a robot on a ground.

    Parameters
    ----------
    ground : Ground
    drive : Drive
    zones : sequence of Zone
        On the cells of `ground`.
    source : str

    Raises
    ------
    QuestionError
        If start, goal or robot do not fit the map.
    """
    drawn = ground.open.shape
    for zone in zones:
        if zone.forbidden:
            ground = closed_as(ground, zone.inside, FORBIDDEN)
    metric = ground.frame is not None
    radius = drive.radius if drive.radius is not None else (ROBOT if metric else 0.0)
    side = ground.size if drive.cell is None else drive.cell
    room_for(
        BYTES * ground.open.size * (ground.size / side) ** 2,
        f"A map of {ground.open.shape[1]} × {ground.open.shape[0]} cells",
    )
    look("measuring how far obstacles are")
    safe = drive.safe if drive.safe is not None else (SAFE if metric else 1.0)
    clear = clearance(ground) if radius > 0.0 or safe > 0.0 else None
    near = np.zeros(ground.open.shape) if clear is None or safe <= 0.0 else np.clip(1.0 - clear / safe, 0.0, 1.0)
    fitting = grown(ground, radius, clear)
    cells = coarser(fitting, side)
    step = -(-ground.open.shape[0] // cells.open.shape[0])
    if not cells.open.any():
        raise QuestionError(
            f"A robot of radius {radius:g}{' m' if metric else ''} must fit somewhere on the map, but it fits nowhere. "
            "Give a smaller --radius or --cell.",
            radius=radius,
        )
    look("laying out the moves")
    moves = moves_on(cells.open, cells.water, drive.motion, cells.size)
    zones = tuple(replace(zone, inside=_coarse(zone.inside, step)) for zone in zones)
    near = _coarse_most(near, step)
    return _problem(cells, moves, zones, near, drive=drive, source=source, drawn=(drawn[1], drawn[0]))


def _problem(
    ground: Ground,
    moves: Moves,
    zones: Sequence[Zone],
    near: Floats,
    *,
    drive: Drive,
    source: str,
    drawn: tuple[int, int],
) -> Problem:
    """Return the problem of moves that are laid out."""
    height, width = ground.open.shape
    frame = ground.frame
    named = {zone.name: zone.inside.ravel() for zone in zones if not zone.forbidden}
    cell_of_state = moves.cell_of_state.astype(np.int32)
    names = CellNames(cell_of_state, width, height, frame, named, scale=ground.scale, drawn=drawn)
    states = len(moves.cell_of_state)
    goal = np.zeros(states, dtype=np.bool_)
    if drive.goal is not None:
        goal[_state(names, drive.goal, "goal")] = True
    start = [] if drive.start is None else [_state(names, drive.start, "start")]
    risk, speed = ALWAYS + near.ravel() + ground.doubt.ravel(), _speeds(ground, drive)
    for zone in zones:
        inside = zone.inside.ravel()
        risk, speed = risk + np.where(inside, zone.risk, 0.0), np.where(inside, speed * zone.speed, speed)
    mdp = MDP(
        state_to_choices=moves.state_to_choices,
        choice_to_branches=moves.choice_to_branches,
        branch_to_target=moves.branch_to_target,
        branch_to_probability=moves.branch_to_probability,
        choice_to_action=moves.choice_to_action,
        actions=(*drive.motion.actions,),
        initial=np.array(start or np.arange(states), dtype=np.int64),
        labels=({"goal": goal} if drive.goal is not None else {})
        | {name: inside[moves.cell_of_state] for name, inside in named.items()},
        rewards={
            "distance": Reward(branch=moves.branch_length),
            "time": Reward(
                choice=moves.choice_length / np.repeat(speed[moves.cell_of_state], np.diff(moves.state_to_choices))
            ),
            "risk": Reward(branch=moves.branch_length * risk[moves.cell_of_state][moves.branch_to_target]),
        },
        names=StateNames(count=states, strings=names),
    )
    world = World(
        width=width,
        height=height,
        kinds=ground.kinds,
        kind_of_cell=ground.kind.ravel(),
        cell_of_state=cell_of_state,
        zones={zone.name: zone.inside.ravel() for zone in zones},
        title=ground.title,
        frame=frame,
    )
    words = {name: f"drive {name}" for name in drive.motion.actions}
    wanted = {} if drive.goal is None else {w: ExpectedCost(goal='"goal"', reward=r) for w, r in WISHES.items()}
    metric = frame is not None
    return Problem(
        mdp=mdp,
        world=world,
        objective=wanted.get("shortest"),
        properties=wanted,
        lexicon=Lexicon(actions=words, state="{name}", objectives=METRES if metric else CELLS),
        source=source,
        lacks="" if drive.goal is not None else NO_GOAL,
    )


def _speeds(ground: Ground, drive: Drive) -> Floats:
    """Return the speed in each cell, ``[H*W]``."""
    usual = drive.speed if drive.speed is not None else SPEED if ground.frame is not None else 1.0
    speeds = np.full(len(ground.kinds), usual)
    for kind, speed in drive.speeds.items():
        if kind not in ground.kinds:
            raise QuestionError(
                f"A speed must be for a kind of ground of the map, {', '.join(ground.kinds)}; got '{kind}'.", speed=kind
            )
        speeds[ground.kinds.index(kind)] = speed
    found: Floats = speeds[ground.kind.ravel()]
    return found


def _state(names: CellNames, text: str, what: str) -> int:
    """Return the state that is meant by a start or goal; a number alone is a state's."""
    if text.strip().isascii() and text.strip().isdecimal() and int(text) < len(names):
        return int(text)
    try:
        found = names.called(text)
    except QuestionError as error:
        raise QuestionError(f"The {what}: {error.message}", **error.place) from error
    if len(found) == 0:
        raise QuestionError(
            f"The {what} must be a cell as column,row or a point as 1.2m,3.4m; got '{text}'.", state=text
        )
    return int(found[0])


def _from_scenario(drive: Drive, ground: Ground, source: str) -> Drive:
    """Return what to do with start and goal of a row of a scenario file."""
    assert drive.scenario is not None
    way = read_way(drive.scenario, drive.row)
    height, width = ground.open.shape
    if (way.width, way.height) != (width, height) or Path(way.map.replace("\\", "/")).name != Path(source).name:
        raise SourceError(
            f"{drive.scenario}: A scenario must be for the map it is used on: row {drive.row} is for '{way.map}' with "
            f"{way.width} × {way.height} cells, but '{Path(source).name}' has {width} × {height}.",
            source=drive.scenario,
        )
    start, goal = (f"{column},{row}" for column, row in (way.start, way.goal))
    for text in (start, goal):
        cell_of(text, width, height, None)
    return replace(drive, scenario=None, start=start, goal=goal)


def _coarse(inside: Bools, step: int) -> Bools:
    """Return which larger cells hold a marked cell."""
    return np.asarray(_coarse_most(inside.astype(np.float64), step) > 0.0)


def _coarse_most(values: Floats, step: int) -> Floats:
    """Return the largest value in each larger cell, which are counted from the lower left corner."""
    if step == 1:
        return values
    height, width = values.shape
    rows, columns = -(-height // step), -(-width // step)
    padded = np.pad(values, ((rows * step - height, 0), (0, columns * step - width)))
    most: Floats = padded.reshape(rows, step, columns, step).max(axis=(1, 3))
    return most

"""The rows of a table enter, checked Missions leave: which model, what is wanted of it, and what is asked of its plan.

A column has the long name of an option of ``ratherthan explain``, with ``_`` or ``-``; ``id`` and columns that begin with ``tag``
are carried along; any other is refused. An empty cell is an option that is not given. Where an option may be given more than
once, a cell that begins with ``[`` is a JSON list of texts.
"""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from ratherthan.errors import QuestionError, SourceError
from ratherthan.explain.question import RANKINGS
from ratherthan.io.grids.drive import KEYS

__all__ = ["COLUMNS", "Mission", "driven", "missions_of", "model_of", "questioned", "read_from"]

TRUE, FALSE = ("true", "yes", "1"), ("false", "no", "0")
CARRIED = "tag"
"""A column with this beginning means nothing here and is carried into the results."""


@dataclass(frozen=True, kw_only=True)
class Mission:
    """One row: a model, what is wanted of it, and the question; as the options of ``ratherthan explain``.

    Parameters
    ----------
    number : int
        Of the row, from 1.
    id : str
        How the row is called; its number where it has no name.
    tags : tuple of pairs of str
        Columns that are carried along, and what stands in them.
    source : str
    property, also : tuple of str
    others : optional
        As the options; None where not given.
    """

    number: int
    id: str
    tags: tuple[tuple[str, str], ...]
    source: str
    property: tuple[str, ...] = ()
    discount: float | None = None
    constants: str | None = None
    start: str | None = None
    policy: str | None = None
    minimise_q: bool = False
    kind: str | None = None
    scope: str | None = None
    factors: str | None = None
    state: str | None = None
    rather_than: str | None = None
    also: tuple[str, ...] = ()
    detail: bool = False
    alpha: float = 0.0
    impact: str = "action-value"
    values: str = "optimum"
    horizon: int | None = None
    toward: str | None = None
    at_most: int | None = None
    rank: str | None = None
    precision: float | None = None
    goal: str | None = None
    scen: str | None = None
    row: int | None = None
    slip: float | None = None
    stay: float | None = None
    directions: str | None = None
    radius: float | None = None
    cell: float | None = None
    speed: str | None = None
    safe: float | None = None
    zones: str | None = None
    unknown: str | None = None


def driven(mission: Mission) -> dict[str, Any]:
    """Return how a robot drives on a map of cells, as `ratherthan.read` takes it: what is given of it."""
    return {key: value for key in KEYS if (value := getattr(mission, key)) is not None}


def read_from(mission: Mission) -> str | None:
    """Return the start where a model must be read with it; elsewhere it is one state of the model like others.

    A policy is judged from where it starts: it need not say anything of what it does not reach. On a map a start is a place.
    """
    return mission.start if mission.policy is not None or driven(mission) else None


def model_of(mission: Mission) -> tuple[Any, ...]:
    """Return what missions must have in common to share one reading and one solving."""
    return (
        mission.source,
        mission.property,
        mission.discount,
        mission.constants,
        mission.policy,
        mission.minimise_q,
        read_from(mission),
        mission.precision,
        tuple(driven(mission).items()),
    )


COLUMNS = tuple(field.name for field in fields(Mission) if field.name not in ("number", "tags"))


def missions_of(rows: Iterable[Mapping[str, Any]], shown: str) -> list[Mission]:
    """Return the missions of a table.

    Parameters
    ----------
    rows : iterable of mappings
        From the name of a column to what stands there; None, NaN and empty texts are empty cells.
    shown : str
        How the table is called in errors.

    Raises
    ------
    SourceError
        For an unknown column, an empty table, a row without a source, a cell of the wrong kind, or an id that comes twice.
    """
    known: dict[str, str] = {}
    found: list[Mission] = []
    for number, row in enumerate(rows, 1):
        for column in row:
            if column not in known:
                known[column] = _column(str(column), shown)
        cells = {known[column]: cell for column, cell in row.items()}
        if len(cells) < len(row):
            twice = next(name for name in cells if sum(known[column] == name for column in row) > 1)
            raise SourceError(f"Every column may stand once, but '{shown}' has two for '{twice}'.", path=shown)
        found.append(_mission(number, cells, shown))
    if not found:
        raise SourceError(f"A table of missions must have rows, but '{shown}' has none.", path=shown)
    ids: dict[str, int] = {}
    for mission in found:
        if mission.id in ids:
            raise SourceError(
                f"Every row must have an id of its own, but '{mission.id}' stands in rows {ids[mission.id]} and "
                f"{mission.number} of '{shown}'.",
                path=shown,
            )
        ids[mission.id] = mission.number
    return found


def _column(name: str, shown: str) -> str:
    """Return the name of a column as a field has it."""
    plain = name.strip().lower().lstrip("-").replace("-", "_")
    if plain in COLUMNS or plain.startswith(CARRIED):
        return plain if plain in COLUMNS else name
    near = difflib.get_close_matches(plain, COLUMNS, 1)
    hint = f" Did you mean '{near[0]}'?" if near else f" Call it '{CARRIED}_{name}' to have it carried along."
    raise SourceError(
        f"A column of a table of missions must be one of {', '.join(COLUMNS)}, or begin with '{CARRIED}'; "
        f"'{shown}' has '{name}'.{hint}",
        path=shown,
        column=name,
    )


def _mission(number: int, cells: Mapping[str, Any], shown: str) -> Mission:
    given: dict[str, Any] = {}
    tags = []
    for column, cell in cells.items():
        if _empty(cell):
            if column not in COLUMNS:
                tags.append((column, ""))
            continue
        if column not in COLUMNS:
            tags.append((column, _text(cell)))
            continue
        try:
            given[column] = _KINDS.get(column, _text)(cell)
        except (ValueError, TypeError) as error:
            raise SourceError(
                f"Column '{column}' must hold {error}, got {cell!r} in row {number} of '{shown}'.",
                path=shown,
                row=number,
                column=column,
            ) from error
    if "source" not in given:
        raise SourceError(
            f"Every row must have a 'source', a model's file or example:NAME, but row {number} of '{shown}' has none.",
            path=shown,
            row=number,
        )
    return Mission(number=number, id=given.pop("id", str(number)), tags=tuple(tags), **given)


def _empty(cell: object) -> bool:
    return (
        cell is None or (isinstance(cell, float) and math.isnan(cell)) or (isinstance(cell, str) and not cell.strip())
    )


def _text(cell: object) -> str:
    if isinstance(cell, bool):
        return "true" if cell else "false"
    if isinstance(cell, float) and cell.is_integer():
        return str(int(cell))  # a column of numbers with an empty cell comes as floats out of many programs
    if isinstance(cell, str | int | float):
        return str(cell).strip()
    raise TypeError("a text")


def _texts(cell: object) -> tuple[str, ...]:
    """Return one text, or the texts of a list."""
    items: object = cell
    if isinstance(cell, str) and cell.strip().startswith("["):
        try:
            items = json.loads(cell)
        except (json.JSONDecodeError, RecursionError):
            raise ValueError('a text, or a JSON list of texts such as ["safest", "shortest"]') from None
    if isinstance(items, Sequence) and not isinstance(items, str):
        if not all(isinstance(item, str) for item in items):
            raise ValueError("a text, or a list of texts")
        return tuple(item.strip() for item in items)
    return (_text(cell),)


def _truth(cell: object) -> bool:
    if isinstance(cell, bool):
        return cell
    text = _text(cell).lower()
    if text not in TRUE + FALSE:
        raise ValueError("true or false")
    return text in TRUE


def _number(cell: object) -> float:
    try:
        return float(_text(cell))
    except ValueError:
        raise ValueError("a number") from None


def _whole(cell: object) -> int:
    try:
        number = int(_text(cell))
    except ValueError:
        number = -1
    if number < 0:
        raise ValueError("a whole number from 0 on")
    return number


def _one_of(*allowed: str) -> Callable[[object], str]:
    def checked(cell: object) -> str:
        text = _text(cell)
        if text not in allowed:
            raise ValueError(f"one of {', '.join(allowed)}")
        return text

    return checked


_KINDS: Mapping[str, Callable[[object], Any]] = {
    "property": _texts,
    "also": _texts,
    "discount": _number,
    "alpha": _number,
    "horizon": _whole,
    "at_most": _whole,
    "rank": _one_of(*RANKINGS),
    "precision": _number,
    "row": _whole,
    "slip": _number,
    "stay": _number,
    "directions": _one_of("4", "8"),
    "radius": _number,
    "cell": _number,
    "safe": _number,
    "unknown": _one_of("free", "closed"),
    "minimise_q": _truth,
    "detail": _truth,
    "impact": _one_of("action-value", "omega"),
    "values": _one_of("optimum", "policy"),
    "toward": _one_of("goal"),
    "scope": _one_of("state", "route"),
}


def questioned(mission: Mission, state: int | None) -> dict[str, Any]:
    """Return the parts of the question that a mission asks, as `ratherthan.explain.question` takes them.

    Raises
    ------
    QuestionError
        Where a Q table is to be read the other way round, and there is none.
    """
    from ratherthan.factors import Search

    if mission.minimise_q and mission.policy is None:
        raise QuestionError("'minimise_q' must come with a table of action values to read: give a policy, too.")
    factors = None
    if mission.factors is not None:
        factors = [name.strip() for name in mission.factors.split(",") if name.strip()]
    return {
        "kind": mission.kind,
        "scope": mission.scope,
        "factors": factors,
        "state": state,
        "rather_than": mission.rather_than,
        "alpha": mission.alpha,
        "omega": mission.impact == "omega",
        "policy_values": mission.values == "policy",
        "search": Search(horizon=mission.horizon, toward_goal=mission.toward == "goal"),
        "detail": mission.detail,
        "at_most": mission.at_most,
        "ranking": mission.rank,
    }

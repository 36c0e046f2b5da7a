"""A policy's file enters; an array, a mapping, rows of state, action and probability, or another tool's export leave."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ratherthan.errors import PolicyError
from ratherthan.io import _policy_prism as prism
from ratherthan.io import _policy_storm as storm
from ratherthan.io._files import open_source
from ratherthan.io._npy import array_from
from ratherthan.io._policy_rows import Row, Rows, probability
from ratherthan.model.mdp import MDP
from ratherthan.model.policy import Policy

__all__ = ["Foreign", "read_policy_file"]


class Foreign(NamedTuple):
    """What another tool exported, and the function that fits it to a model."""

    content: Any
    reader: Callable[[Any, MDP, str], Policy]

    def read(self, mdp: MDP, what: str) -> Policy:
        """Return the policy; `what` is how it is called in errors."""
        return self.reader(self.content, mdp, what)


def read_policy_file(path: str | os.PathLike[str], what: str) -> Any:
    """Return an array, a mapping or a table from a file: told by its suffix, else by its contents."""
    suffix = Path(path).suffix.lower()
    with open_source(path, "a policy") as file:
        if file.read(6) == b"\x93NUMPY":
            file.seek(0)
            try:
                return array_from(file, os.fstat(file.fileno()).st_size, os.fspath(path))
            except (ValueError, EOFError, OverflowError) as error:
                raise PolicyError(f"{what} must be a whole .npy file, but it is not: {error}. Save it anew.") from error
        file.seek(0)
        data = file.read()
    _refuse_binary(data, suffix, what)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PolicyError(f"{what} must be text in UTF-8 or a .npy file, but it is neither.") from error
    if "\x00" in text:
        raise PolicyError(f"{what} must be text in UTF-8 or a .npy file, but it is binary.")
    if suffix == ".json" or (suffix != ".csv" and text.lstrip().startswith(("{", "["))):
        content = _json(text, what)
        return Foreign(content, storm.read_storm_json) if content and storm.is_storm_json(content) else content
    return (None if suffix == ".csv" else _foreign_text(text, what)) or _csv_rows(text, what)


def _refuse_binary(data: bytes, suffix: str, what: str) -> None:
    """Refuse what is no text, with the reason."""
    if suffix in (".npy", ".npz"):
        raise PolicyError(f"{what} must be a NumPy file of one array (.npy), but it is none. Save it with numpy.save.")
    if data.startswith((b"PK\x03\x04", b"\x80")) or suffix in (".zip", ".pkl", ".pickle", ".pt", ".pth"):
        raise PolicyError(
            f"{what} must be text or a .npy file, but it is a saved agent or another pickle, which can run any program when "
            "it is opened. Where you trust it, open it yourself, as with agent = stable_baselines3.PPO.load(path), and give "
            "the agent: ratherthan.read_policy(agent, problem.mdp)."
        )


def _foreign_text(text: str, what: str) -> Foreign | None:
    """Return what another tool exported as text, None where it is of no form that is known."""
    if text.lstrip().startswith("digraph"):
        raise PolicyError(
            f"{what} must list states and actions, but it is a drawing (DOT). Export it with -exportstrat FILE:type=actions."
        )
    if storm.is_storm_text(text):
        return Foreign(text, storm.read_storm_text)
    if prism.is_induced(text):
        return Foreign(text, prism.read_induced)
    return Foreign(text, prism.read_strategy) if prism.is_strategy(text) else None


def _json(text: str, what: str) -> Any:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        table = dict(pairs)
        if len(table) < len(pairs):
            seen: set[str] = set()
            twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
            raise PolicyError(f"{what} must say each thing once, but '{twice}' is there twice. Remove one.")
        return table

    try:
        return json.loads(text, object_pairs_hook=once)
    except (ValueError, RecursionError) as error:
        raise PolicyError(f'{what} must be JSON like {{"10": "east"}}, but it cannot be read: {error}.') from error


def _csv_rows(text: str, what: str) -> Rows:
    """Return state, action and probability out of a CSV file; NaN where no probability is given."""
    reader = csv.reader(io.StringIO(text), strict=True, skipinitialspace=True)
    rows = Rows()
    columns: dict[str, int] | None = None
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            where = f"{what}, line {reader.line_num}:"
            if columns is None:
                columns = _columns(cells, where)
                if columns["header"]:
                    continue
            rows.append(_csv_row(cells, columns, where))
    except csv.Error as error:
        raise PolicyError(f"{what}, line {reader.line_num}: a CSV row cannot be read: {error}.") from error
    if not rows:
        raise PolicyError(f"{what} must list states and their actions, but it lists none.")
    return rows


def _columns(cells: list[str], where: str) -> dict[str, int]:
    """Return which column is which, from the first row: a header, or two or three cells in the usual order."""
    known = ["state", "action", "probability"]
    lower = [cell.lower() for cell in cells]
    header = {"state", "action"} <= set(lower)
    if header and (len(set(lower)) < len(lower) or not set(lower) <= set(known)):
        raise PolicyError(
            f"{where} the columns must be {', '.join(known)} (the last may be missing), got {', '.join(cells)}."
        )
    order = lower if header else known[: len(cells)]
    if not header and not 2 <= len(cells) <= 3:
        raise PolicyError(
            f"{where} a row must have a state and an action, and may have a probability; got {len(cells)} cells."
        )
    return {name: order.index(name) for name in order} | {"header": int(header), "count": len(cells)}


def _csv_row(cells: list[str], columns: dict[str, int], where: str) -> Row:
    if len(cells) != columns["count"]:
        raise PolicyError(
            f"{where} a row must have {columns['count']} cells like the first, got {len(cells)}. "
            "Put names with commas in double quotes."
        )
    state, action = cells[columns["state"]], cells[columns["action"]]
    if "probability" not in columns:
        return state, action, np.nan
    try:
        chance = float(cells[columns["probability"]])
    except ValueError:
        raise PolicyError(f"{where} a probability must be a number, got '{cells[columns['probability']]}'.") from None
    return state, action, probability(chance, state, where)

"""What a Problem holds beside its MDP enters and leaves as small files of our own, which lie in a folder ``ratherthan/``.

Formats that exchange models have no place for a map, an objective or words. They are kept beside the model, where other
tools pass over them:

========================== ============================================================================================
``problem.json``           ``version`` (1), ``names`` (true where states have names), ``texts`` (of those below),
                           ``labels`` (of those below), ``world`` (``width``, ``height``, ``kinds``, ``zones``, ``note``,
                           ``title``, ``frame``), ``cells`` (where states are called by the cells of ``world``: ``scale``,
                           ``drawn``, ``zones``), ``objective``, ``properties``, ``others``, ``definitions``, ``lexicon``,
                           ``notes``, ``lacks``; each absent where there is none
``names-offsets.bin``      where each state's name begins in ``names.bin`` and the last ends, uint64
``names.bin``              the names of the states in UTF-8
``text-0-offsets.bin`` …,  likewise what the numbers 0, 1, 2 … of each state variable in ``texts`` stand for
``text-0.bin`` …
``cell-of-state.bin``      the cell of each state, int32, -1 where it has none
``kind-of-cell.bin``       the kind of ground of each cell, uint8, an index into ``kinds``
``zone-0.bin`` …           the cells of each zone, a bit each, in the order of ``zones``
``label-0.bin`` …          the states of each label in ``labels``, a bit each
========================== ============================================================================================

How an objective is written is told in `_objectives`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._objectives import read_objective, read_property, spelled
from ratherthan.io._strings import PackedStrings, pack_strings
from ratherthan.io.grids.names import CellNames
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.objective import Objective, Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.world import Frame, World

__all__ = ["Extras", "packed_extras", "problem_of"]

Bytes = npt.NDArray[np.uint8]
VERSION = 1
MAIN = "problem.json"


def packed_extras(
    problem: Problem,
    *,
    names: Sequence[str] | None = None,
    texts: Mapping[str, Sequence[str]] | None = None,
    labels: Mapping[str, Bools] | None = None,
) -> dict[str, bytes]:
    """Return what `problem` holds beside its MDP as files by name, none where there is nothing.

    Parameters
    ----------
    problem : Problem
    names : sequence of str, ``[S]``, optional
        The names of the states, where the format itself cannot hold them.
    texts : mapping of str to sequence of str, optional
        What the numbers of a state variable stand for, where the format itself cannot hold text.
    labels : mapping of str to array of bool, ``[S]``, optional
        Labels that the format itself cannot hold.
    """
    table: dict[str, Any] = {}
    files: dict[str, bytes] = {}
    if isinstance(names, CellNames) and problem.world is not None:
        table["cells"] = {"scale": names.scale, "drawn": list(names.drawn), "zones": list(names.zones)}
    elif names is not None:
        table["names"] = True
        files |= _string_files("names", names)
    if texts:
        table["texts"] = list(texts)
        files |= {
            name: data
            for i, text in enumerate(texts.values())
            for name, data in _string_files(f"text-{i}", text).items()
        }
    if labels:
        table["labels"] = list(labels)
        files |= {f"label-{i}.bin": _bits(mask) for i, mask in enumerate(labels.values())}
    if problem.world is not None:
        table["world"], more = _world_files(problem.world)
        files |= more
    if problem.objective is not None:
        table["objective"] = spelled(problem.objective)
    if problem.properties:
        table["properties"] = {name: spelled(item) for name, item in problem.properties.items()}
    if problem.lexicon != Lexicon():
        table["lexicon"] = asdict(problem.lexicon)
    plain = {
        "others": dict(problem.others),
        "definitions": dict(problem.definitions),
        "lacks": problem.lacks,
        "notes": list(problem.notes),
    }
    table |= {name: value for name, value in plain.items() if value}
    if not table:
        return {}
    text = json.dumps({"version": VERSION} | table, indent=1)
    return {MAIN: text.encode("ascii")} | files


def _bits(mask: Bools) -> bytes:
    return np.packbits(mask, bitorder="little").tobytes()


def _string_files(stem: str, strings: Sequence[str]) -> dict[str, bytes]:
    offsets, block = pack_strings(strings)
    return {f"{stem}-offsets.bin": offsets.tobytes(), f"{stem}.bin": block.tobytes()}


def _world_files(world: World) -> tuple[dict[str, Any], dict[str, bytes]]:
    table = {
        "width": world.width,
        "height": world.height,
        "kinds": list(world.kinds),
        "zones": list(world.zones),
        "note": world.note,
        "title": world.title,
    }
    if world.frame is not None:
        table["frame"] = asdict(world.frame)
    files = {
        "cell-of-state.bin": world.cell_of_state.astype("<i4").tobytes(),
        "kind-of-cell.bin": world.kind_of_cell.astype(np.uint8).tobytes(),
    }
    return table, files | {f"zone-{i}.bin": _bits(mask) for i, mask in enumerate(world.zones.values())}


@dataclass(frozen=True, kw_only=True)
class Extras:
    """What lay beside a model in a file of ours: the contents of ``problem.json``, and the other files by name."""

    table: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, Bytes] = field(default_factory=dict)
    shown: str = ""
    notes: tuple[str, ...] = ()

    @staticmethod
    def unpacked(files: Mapping[str, Bytes], shown: str) -> Extras:
        """Return what the files hold; nothing of another version is read, which a note says.

        Parameters
        ----------
        files : mapping of str to array of uint8
            The files of the folder by name.
        shown : str
            How the source is called in errors.

        Raises
        ------
        SourceError
            Where ``problem.json`` is no JSON object.
        """
        if MAIN not in files:
            return Extras(shown=shown)
        try:
            table = json.loads(files[MAIN].tobytes().decode("utf-8"))
        except (ValueError, RecursionError) as error:
            raise SourceError(
                f"problem.json of '{shown}' must be JSON, but is not: {error}. Write the file anew.", path=shown
            ) from error
        extras = Extras(table=table, files=files, shown=shown)
        if not isinstance(table, dict):
            extras.fail("an object", table)
        if table.get("version") != VERSION:
            note = f"Its map, objective and words are of version {table.get('version')!r} and were not read."
            return Extras(shown=shown, notes=(note,))
        return extras

    def fail(self, must: str, came: object) -> NoReturn:
        """Raise SourceError: ``problem.json`` must have `must`."""
        shown = repr(came)
        shown = shown if len(shown) <= 80 else shown[:77] + "…"
        raise SourceError(
            f"problem.json of '{self.shown}' must have {must}, got {shown}. Write the file anew.", path=self.shown
        )

    def names(self, states: int) -> Sequence[str] | None:
        """Return the names of the states, None where there are none."""
        if "cells" in self.table:
            return self._cell_names(states)
        if not self.table.get("names"):
            return None
        names = self._strings("names")
        if len(names) != states:
            self.fail(f"{states} names of states beside it", len(names))
        return names

    def _cell_names(self, states: int) -> CellNames:
        """Return the names of states that are called by the cells of the map."""
        table, world = self._object(self.table["cells"], "cells"), self.world(states)
        if world is None:
            self.fail("a map where states are called by its cells", "none")
        scale, drawn = self._whole(table.get("scale"), "scale"), table.get("drawn")
        if not isinstance(drawn, list) or len(drawn) != 2:
            self.fail("two whole numbers at 'drawn'", drawn)
        wide, high = (self._whole(side, "drawn") for side in drawn)
        if scale < 1 or -(-wide // scale) != world.width or -(-high // scale) != world.height:
            self.fail(f"cells of the map's {world.width} × {world.height}", [scale, *drawn])
        if (np.diff(world.cell_of_state) <= 0).any() or (world.cell_of_state < 0).any():
            self.fail("each state in a cell of its own, in their order", "others")
        zones = self._texts(table.get("zones"), "a list of strings at 'zones'")
        strange = [zone for zone in zones if zone not in world.zones]
        if strange:
            self.fail("zones of the map", strange[0])
        named = {zone: world.zones[zone] for zone in zones}
        return CellNames(
            world.cell_of_state, world.width, world.height, world.frame, named, scale=scale, drawn=(wide, high)
        )

    def _frame(self, value: Any) -> Frame | None:
        """Return where the map lies in the world."""
        if value is None:
            return None
        table = self._object(value, "frame")
        numbers = [table.get(key) for key in ("resolution", "x", "y", "yaw")]
        if not all(isinstance(n, int | float) and not isinstance(n, bool) and math.isfinite(n) for n in numbers):
            self.fail("numbers at 'resolution', 'x', 'y' and 'yaw' of 'frame'", table)
        if not table["resolution"] > 0:
            self.fail("a 'resolution' above 0", table["resolution"])
        resolution, x, y, yaw = (float(table[key]) for key in ("resolution", "x", "y", "yaw"))
        return Frame(resolution=resolution, x=x, y=y, yaw=yaw)

    def texts(self) -> dict[str, PackedStrings]:
        """Return what the numbers of state variables stand for, by the variable."""
        variables = self._texts(self.table.get("texts", []), "a list of strings at 'texts'")
        return {name: self._strings(f"text-{i}") for i, name in enumerate(variables)}

    def all_labels(self, labels: Mapping[str, Bools], states: int) -> dict[str, Bools]:
        """Return `labels` and those that lie beside the model."""
        own = self._texts(self.table.get("labels", []), "a list of strings at 'labels'")
        return dict(labels) | {name: self._mask(f"label-{i}.bin", states) for i, name in enumerate(own)}

    def world(self, states: int) -> World | None:
        """Return the map, None where there is none."""
        table = self.table.get("world")
        if table is None:
            return None
        table = self._object(table, "world")
        width, height = (self._whole(table.get(key), key) for key in ("width", "height"))
        kinds = tuple(self._texts(table.get("kinds"), "a list of strings at 'kinds'"))
        kind_of_cell = self._file("kind-of-cell.bin", width * height).copy()
        if len(kind_of_cell) and kind_of_cell.max() >= len(kinds):
            self.fail(f"kinds of cells below {len(kinds)}", int(kind_of_cell.max()))
        cell_of_state = self._file("cell-of-state.bin", 4 * states).view("<i4").astype(np.int32)
        if ((cell_of_state < -1) | (cell_of_state >= width * height)).any():
            self.fail(f"cells of states in -1 … {width * height - 1}", "others")
        zones = self._texts(table.get("zones", []), "a list of strings at 'zones'")
        return World(
            width=width,
            height=height,
            kinds=kinds,
            kind_of_cell=kind_of_cell,
            cell_of_state=cell_of_state,
            zones={name: self._mask(f"zone-{i}.bin", width * height) for i, name in enumerate(zones)},
            note=self._text(table.get("note", ""), "note"),
            title=self._text(table.get("title", ""), "title"),
            frame=self._frame(table.get("frame")),
        )

    def lexicon(self) -> Lexicon:
        """Return the words, the default where there are none."""
        if "lexicon" not in self.table:
            return Lexicon()
        table = self._object(self.table["lexicon"], "lexicon")
        words: Callable[[Any, str], dict[str, str]] = self._words
        return Lexicon(
            language=self._text(table.get("language", "en"), "language"),
            actions=words(table.get("actions", {}), "actions"),
            gerunds=words(table.get("gerunds", {}), "gerunds"),
            state=self._text(table.get("state", ""), "state"),
            states=words(table.get("states", {}), "states"),
            objectives={k: words(v, k) for k, v in self._object(table.get("objectives", {}), "objectives").items()},
        )

    def lacks(self) -> str:
        """Return what must still be given, empty where nothing is missing."""
        return self._text(self.table.get("lacks", ""), "lacks")

    def stored_notes(self) -> tuple[str, ...]:
        """Return the notes that were written with the model, and those made here."""
        return (*self._texts(self.table.get("notes", []), "a list of strings at 'notes'"), *self.notes)

    def words(self, key: str) -> dict[str, str]:
        """Return a table of strings, empty where it is absent."""
        return self._words(self.table.get(key, {}), key)

    def properties(self) -> dict[str, Objective | Threshold]:
        """Return the properties by name."""
        table = self._object(self.table.get("properties", {}), "properties")
        return {name: read_property(value, self.fail) for name, value in table.items()}

    def _object(self, value: Any, key: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            self.fail(f"an object at '{key}'", value)
        return value

    def _text(self, value: Any, key: str) -> str:
        if not isinstance(value, str):
            self.fail(f"a string at '{key}'", value)
        return value

    def _whole(self, value: Any, key: str) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**31:
            self.fail(f"a whole number at '{key}'", value)
        return value

    def _texts(self, value: Any, must: str) -> list[str]:
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            self.fail(must, value)
        return value

    def _words(self, value: Any, key: str) -> dict[str, str]:
        table = self._object(value, key)
        return {name: self._text(item, f"{key}.{name}") for name, item in table.items()}

    def _file(self, name: str, size: int) -> Bytes:
        data = self.files.get(name)
        if data is None or len(data) != size:
            self.fail(f"a file '{name}' of {size} bytes beside it", "none" if data is None else f"{len(data)} bytes")
        return data

    def _strings(self, stem: str) -> PackedStrings:
        offsets, block = self.files.get(f"{stem}-offsets.bin"), self.files.get(f"{stem}.bin")
        if offsets is None or block is None or len(offsets) % 8:
            self.fail(f"the files '{stem}-offsets.bin', in words of 8 bytes, and '{stem}.bin' beside it", "none")
        return PackedStrings(offsets.view("<u8"), block, f"{stem}.bin in '{self.shown}'")

    def _mask(self, name: str, count: int) -> Bools:
        return np.unpackbits(self._file(name, -(-count // 8)), count=count, bitorder="little").astype(bool)


def problem_of(mdp: MDP, extras: Extras, *, source: str, notes: tuple[str, ...]) -> Problem:
    """Return a model with all that lay beside it."""
    return Problem(
        mdp=mdp,
        world=extras.world(mdp.states),
        objective=None
        if extras.table.get("objective") is None
        else read_objective(extras.table["objective"], extras.fail),
        properties=extras.properties(),
        others=extras.words("others"),
        definitions=extras.words("definitions"),
        lexicon=extras.lexicon(),
        source=source,
        notes=extras.stored_notes() + notes,
        lacks=extras.lacks(),
    )

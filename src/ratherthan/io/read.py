"""A file, a name or an object enters, a Problem leaves; and a Problem enters, a file leaves.

One table says which adapter reads what. A file is told by its suffix; with another suffix, or none, by its first bytes.
Adapters are loaded when they are needed.

============== ==================================================== ===========================
source         told by                                              read by
============== ==================================================== ===========================
example        ``example:NAME``                                     `ratherthan.io.examples`
road map       ``.roadmap``; ``map = '''`` at the start of a line   `ratherthan.io.roadmap`
UMB            ``.umb``; a tar archive, gzip or xz                  `ratherthan.io.umb`
NumPy archive  ``.npz``; a zip archive                              `ratherthan.io.arrays`
PRISM          ``.prism .nm .pm .sm``; ``mdp`` or ``dtmc``          `ratherthan.io.prism`
JANI           ``.jani``; ``"jani-version"`` in a JSON object       `ratherthan.io.jani`
DRN            ``.drn .drn.gz .drn.xz``; a line ``@type:``          `ratherthan.io.drn`
MovingAI map   ``.map``; ``type octile`` … ``map``                   `ratherthan.io.grids`
ROS map        ``.yaml .yml``; ``image:`` and ``resolution:``       `ratherthan.io.grids`
Gymnasium      ``gym:NAME``, ``gym:NAME,key=value``; an environment `ratherthan.io.gymnasium`
its table      ``.json.gz``; ``"nS"`` or ``"P"`` in a JSON object   `ratherthan.io.gymnasium`
object         a Problem or MDP as it is; arrays                    `ratherthan.io.arrays`
============== ==================================================== ===========================
"""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ratherthan.errors import PropertyError, QuestionError, SourceError
from ratherthan.io._files import open_source
from ratherthan.io._tar import is_tar
from ratherthan.io._unpacking import packing_of
from ratherthan.model.mdp import MDP
from ratherthan.model.objective import Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.states import start_of, state_number
from ratherthan.model.watch import phase

__all__ = ["read", "start_of", "state_number", "write"]

HEAD = 1 << 16
"""How many bytes are looked at to tell what a file is."""

COMMENTS = re.compile(rb"//[^\n]*|/\*.*?\*/", re.DOTALL)
PRISM_WORD = re.compile(
    rb"^\s*(mdp|dtmc|nondeterministic|probabilistic|ctmc|stochastic|pta|pomdp|smg|module)\s", re.MULTILINE
)
DRN_LINE = re.compile(rb"^@type:", re.MULTILINE)
ROS_LINES = tuple(re.compile(rb"^%s[ \t]*:" % key, re.MULTILINE) for key in (b"image", b"resolution", b"origin"))
ROADMAP_LINE = re.compile(rb"^map\s*=\s*('''|\"\"\"|'|\")", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Adapter:
    """What reads one kind of file: its function, its suffixes, whether it is text, has constants to be set, or cells to drive on."""

    kind: str
    module: str
    function: str
    suffixes: tuple[str, ...]
    constants: bool = False
    text: bool = False
    grid: bool = False

    def load(self) -> Callable[..., Problem]:
        """Return the function."""
        loaded: Callable[..., Problem] = getattr(importlib.import_module(f"ratherthan.io.{self.module}"), self.function)
        return loaded


EXAMPLE = Adapter(kind="an example", module="examples", function="read_example", suffixes=())
ROADMAP = Adapter(kind="a road map", module="roadmap", function="read_roadmap", suffixes=(".roadmap",), text=True)
UMB = Adapter(kind="a UMB archive", module="umb", function="read_umb", suffixes=(".umb",))
NPZ = Adapter(kind="a NumPy archive", module="npz", function="read_npz", suffixes=(".npz",))
PRISM = Adapter(
    kind="a PRISM model",
    module="prism",
    function="read_prism",
    suffixes=(".prism", ".nm", ".pm", ".sm"),
    constants=True,
    text=True,
)
JANI = Adapter(kind="a JANI model", module="jani", function="read_jani", suffixes=(".jani",), constants=True, text=True)
DRN = Adapter(
    kind="a model in Storm's explicit text format",
    module="drn",
    function="read_drn",
    suffixes=(".drn", ".drn.gz", ".drn.xz"),
)
TABLE = Adapter(kind="a table of an environment", module="gymnasium", function="read_table", suffixes=(".json.gz",))
MOVINGAI = Adapter(
    kind="a MovingAI map", module="grids.gridmap", function="read_grid", suffixes=(".map",), text=True, grid=True
)
ROSMAP = Adapter(
    kind="a map of the ROS map server",
    module="grids.gridmap",
    function="read_grid",
    suffixes=(".yaml", ".yml"),
    text=True,
    grid=True,
)
ADAPTERS = (ROADMAP, MOVINGAI, ROSMAP, UMB, NPZ, PRISM, JANI, DRN, TABLE)
PREFIX = "example:"
GYM = Adapter(kind="a Gymnasium environment", module="gymnasium", function="read_gymnasium", suffixes=())
GYM_PREFIX = "gym:"
ENVIRONMENT = ("reset", "step", "action_space", "observation_space")

WRITERS = {
    ".umb": ("umb", "write_umb"),
    ".npz": ("npz", "write_npz"),
    ".drn": ("drn", "write_drn"),
    ".roadmap": ("roadmap", "write_roadmap"),
}


def read(
    source: Any,
    *,
    constants: str | Mapping[str, Any] | None = None,
    objective: str | None = None,
    start: str | int | tuple[int, int] | None = None,
    properties: Sequence[str] = (),
    **options: Any,
) -> Problem:
    """Read a model.

    Parameters
    ----------
    source : str, path, Problem, MDP, environment or arrays
        ``example:NAME``, ``gym:NAME``, a file, a model as it is, an environment of Gymnasium, or transitions as
        `from_arrays` takes them.
    constants : str or mapping, optional
        Values for the constants of a PRISM or JANI model, ``"N=5,K=2"`` or ``{"N": 5, "K": 2}``.
    objective : str, optional
        What is wanted: a property in PRISM's syntax, the name of one that comes with the source, or one of a file of
        properties: ``FILE.props`` if it has one, else ``FILE.props:NAME``.
    start : int, str or pair of int, optional
        The state to start from, a number or an exact name, in place of the model's initial states; on a map of cells a place:
        column and row, or a point in metres as ``"1.2m,3.4m"``.
    properties : sequence of str
        More texts like `objective`, of which those from files come along in the problem's properties.
    **options
        Handed to the adapter: `limits` of archives, `rewards`, `labels` … of arrays, arguments of an environment. Of a map of
        cells: `goal` (``(3, 14)``, ``"3,14"`` or in metres ``"1.2m,3.4m"``; so may `start` be) or `scen` and `row` of a
        scenario file; `slip`, `stay`, `directions`, `speed`; `radius`, `cell`, `safe`; `zones`, `unknown`. None of them is
        needed: None stands for the default.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        Where the source is missing, empty, damaged or of a kind that cannot be read, or has no constants to set.
    ModelError
        Where the model in it breaks a law.
    PropertyError
        Where the objective cannot be read.
    QuestionError
        Where there is no such state to start from.
    """
    if start is not None and _has_cells(source):
        options, start = options | {"start": start}, None
    called = f" '{source}'" if isinstance(source, str | os.PathLike) else " a model"
    with phase(f"reading{called}"):
        problem = _read_with(
            source, constants or None, options, (*properties, *([] if objective is None else [objective]))
        )
    if objective is not None:
        from ratherthan.model.property import choose_objective

        chosen = choose_objective(problem, objective)
        if isinstance(chosen, Threshold):
            raise PropertyError(
                f"An objective must ask for a best value (=?), got the yes-or-no question '{chosen.text}'. "
                f"Ask for '{chosen.objective.text}'.",
                text=objective,
            )
        problem = replace(problem, objective=chosen)
    if start is not None:
        import numpy as np

        if isinstance(start, tuple):
            raise QuestionError(f"A pair of column and row must be a cell of a map of cells, but '{source}' is none.")
        mdp = replace(problem.mdp, initial=np.array([state_number(problem.mdp, start)]))
        problem = replace(problem, mdp=mdp)
    return problem


def _read_with(
    source: Any, constants: str | Mapping[str, Any] | None, options: dict[str, Any], texts: Sequence[str]
) -> Problem:
    """Read a source of any kind, with the properties of files that are named."""
    if not any("." in text and "[" not in text for text in texts):
        return _read(source, constants, options)
    from ratherthan.io.props import files_of, read_with_files

    asked = files_of(texts)
    return read_with_files(lambda given: _read(source, given, options), constants, asked)


def _has_cells(source: Any) -> bool:
    """Return whether a source is a map of cells, whose places are told by where they lie."""
    if not isinstance(source, str | os.PathLike) or str(source).startswith((PREFIX, GYM_PREFIX)):
        return False
    return _adapter_of(source).grid


def _read(source: Any, constants: str | Mapping[str, Any] | None, options: dict[str, Any]) -> Problem:
    """Read a source of any kind, without what was asked of it."""
    if not _has_cells(source):
        options = _without_driving(source, options)
    if isinstance(source, str) and source.startswith(PREFIX):
        _refuse_constants(constants, EXAMPLE, source)
        return EXAMPLE.load()(source.removeprefix(PREFIX), **options)
    if isinstance(source, str) and source.startswith(GYM_PREFIX):
        _refuse_constants(constants, GYM, source)
        return GYM.load()(source.removeprefix(GYM_PREFIX), **options)
    if isinstance(source, str | os.PathLike):
        adapter = _adapter_of(source)
        if adapter.constants:
            return adapter.load()(source, constants=constants, **options)
        _refuse_constants(constants, adapter, os.fspath(source))
        return adapter.load()(source, **options)
    if constants is not None:
        raise SourceError("Only PRISM and JANI models have constants to set, got an object. Leave the constants out.")
    if isinstance(source, Problem | MDP):
        if options:
            raise SourceError(
                f"A model that is read already takes no options, got {', '.join(options)}. Leave them out."
            )
        return source if isinstance(source, Problem) else Problem(mdp=source, source="an MDP")
    if all(hasattr(source, name) for name in ENVIRONMENT):
        from ratherthan.io.gymnasium import read_environment

        return read_environment(source, **options)
    from ratherthan.io.arrays import from_arrays

    return from_arrays(**source, **options) if isinstance(source, Mapping) else from_arrays(source, **options)


def _without_driving(source: Any, options: dict[str, Any]) -> dict[str, Any]:
    """Return the options without those for maps of cells, which are refused where one is given."""
    if not isinstance(source, str | os.PathLike):
        return options
    from ratherthan.io.grids.drive import KEYS

    given = [key for key in KEYS if options.get(key) is not None]
    if given and not str(source).startswith(GYM_PREFIX):
        raise SourceError(
            f"Only a map of cells (.map, .yaml) can be asked for {', '.join(given)}, but '{source}' is none. Leave "
            f"{'it' if len(given) == 1 else 'them'} out.",
            path=str(source),
        )
    return {key: value for key, value in options.items() if key not in KEYS or value is not None}


def _refuse_constants(constants: object, adapter: Adapter, shown: str) -> None:
    if constants is not None:
        raise SourceError(
            f"Only PRISM and JANI models have constants to set, but '{shown}' is {adapter.kind}. Leave the constants out.",
            path=shown,
        )


def _adapter_of(path: str | os.PathLike[str]) -> Adapter:
    """Return what reads a file: by its suffix, else by its first bytes."""
    shown = os.fspath(path)
    name = Path(path).name.lower()
    with open_source(path) as file:
        head = file.read(HEAD)
    for adapter in ADAPTERS:
        if name.endswith(adapter.suffixes):
            break
    else:
        adapter = _by_content(head, shown)
    if adapter.text and b"\x00" in head:
        raise SourceError(
            f"{adapter.kind.capitalize()} must be text, but '{shown}' is binary. Check what it is.", path=shown
        )
    return adapter


def _by_content(head: bytes, shown: str) -> Adapter:
    from ratherthan.io._gym_json import is_table
    from ratherthan.io.grids.movingai import MAP_LINES

    if is_table(head):
        return TABLE
    if is_tar(head) or packing_of(head):
        return UMB
    if head.startswith(b"PK\x03\x04"):
        return NPZ
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{") and b'"jani-version"' in head:
        return JANI
    if b"\x00" not in head:
        if ROADMAP_LINE.search(head):
            return ROADMAP
        if MAP_LINES.match(head):
            return MOVINGAI
        if all(line.search(head) for line in ROS_LINES):
            return ROSMAP
        if DRN_LINE.search(head):
            return DRN
        if PRISM_WORD.search(COMMENTS.sub(b" ", head)):
            return PRISM
    known = "; ".join(f"{adapter.kind} ({' '.join(adapter.suffixes)})" for adapter in ADAPTERS)
    raise SourceError(
        f"A source must be {PREFIX}NAME, {GYM_PREFIX}NAME or one of: {known}; but '{shown}' is none of them, by its name nor "
        "by its contents. Convert it, or give it the suffix of what it is.",
        path=shown,
    )


def write(problem: Problem, path: str | os.PathLike[str], **options: Any) -> None:
    """Write a model to a file, whole or not at all.

    Parameters
    ----------
    problem : Problem
    path : path
        ``.umb`` for the Unified Markov Binary format, ``.npz`` for a NumPy archive, ``.drn`` for Storm's explicit text
        format (which has no place for names of states, map, objective and words), ``.roadmap`` for a problem that came from
        a road map.
    **options
        Handed to the writer.

    Raises
    ------
    SourceError
        Where the suffix is another, or the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise SourceError(
            f"A model is written as {' or '.join(WRITERS)}, got '{os.fspath(path)}'. Give the file one of these suffixes.",
            path=os.fspath(path),
        )
    module, function = WRITERS[suffix]
    with phase(f"writing '{os.fspath(path)}'"):
        getattr(importlib.import_module(f"ratherthan.io.{module}"), function)(problem, path, **options)

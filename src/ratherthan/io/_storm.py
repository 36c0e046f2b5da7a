"""A PRISM or JANI model enters as text, its full state space leaves as a Problem: Storm builds it, a file of arrays brings it over.

This is the only module that speaks to Storm (its Python bindings, stormpy). Storm writes the whole model as arrays in the
Unified Markov Binary format, which our own reader takes in: no state is touched one by one. Storm's own log is silent
meanwhile. What is built is everything: all labels, reward structures, state variables and action names, and no state space
cut off at the goals of a property.

A value that leaves a variable's range is cut down to the bits at hand unless one asks; so here a further bit is built that
tells of it, and such a model is refused.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import MissingExtraError, ModelError, RatherthanError, SourceError
from ratherthan.io._constants import Constant, Value
from ratherthan.io.umb import read_umb
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem

__all__ = ["Symbolic", "build", "parse_jani", "parse_prism"]

_RANGE_BIT = "_OutOfBoundsBit"
_LOCATION = "_loc_"
_UNNAMED_REWARD, _ITS_NAME = "default", "reward"
_LONGEST = 400
_KINDS = {"int": "int", "bool": "bool"}


@dataclass(frozen=True, kw_only=True)
class Symbolic:
    """A model that Storm has read but not built.

    Parameters
    ----------
    program : stormpy program or model
    shown : str
        How the source is called in errors.
    constants : sequence of Constant
    locations : mapping of str to sequence of str
        The names of the locations of each automaton.
    unnamed_reward : bool
        Whether a reward structure has no name.
    """

    program: Any
    shown: str
    constants: Sequence[Constant]
    locations: Mapping[str, Sequence[str]]
    unnamed_reward: bool = False


def _stormpy() -> Any:
    """Return the module stormpy, or say how to get it."""
    try:
        import stormpy
    except ImportError as error:
        raise MissingExtraError(
            'Storm must be installed to read PRISM and JANI models: pip install "ratherthan[storm]".'
        ) from error
    return stormpy


@contextmanager
def _storm(shown: str, doing: str) -> Iterator[Any]:
    """Yield stormpy, silent; what it raises becomes one sentence."""
    stormpy = _stormpy()
    developer = stormpy.developer
    before = developer.get_log_level()
    developer.set_log_level(developer.LogLevel.OFF)
    try:
        yield stormpy
    except MemoryError as error:
        raise SourceError(
            f"'{shown}' must fit into memory, but it does not. Choose smaller constants.", path=shown
        ) from error
    except (RuntimeError, ValueError, LookupError, ArithmeticError, stormpy.exceptions.StormError) as error:
        raise SourceError(
            f"'{shown}' must be a model that Storm can {doing}, but it cannot: {_sentence(error)}", path=shown
        ) from error
    finally:
        developer.set_log_level(before)


def _sentence(error: BaseException) -> str:
    """Return Storm's message without the names of its classes, its line drawing, and with an end."""
    text = str(error) or str(getattr(error, "message", "")) or type(error).__name__
    text = re.sub(r"^(\w+Exception|Storm):\s*", "", text.strip())
    text = re.sub(r"^Parsing error at (\d+):(\d+):\s*", r"at line \1, column \2: ", text)
    lines = [line.strip() for line in text.splitlines() if line.strip(" \t^")]
    text = re.sub(r",?\s*here:\s*", " in: ", re.sub(r"\s+", " ", " ".join(lines)))
    text = text if len(text) <= _LONGEST else text[:_LONGEST] + " …"
    return text.rstrip(" .") + "."


def parse_prism(path: Path, shown: str) -> Symbolic:
    """Let Storm read a PRISM program.

    Parameters
    ----------
    path : Path
    shown : str
        How the source is called in errors.

    Raises
    ------
    SourceError
        With what Storm says against it.
    MissingExtraError
        If Storm is not installed.
    """
    with _storm(shown, "read") as stormpy:
        program = stormpy.parse_prism_program(str(path), simplify=False)  # keeps variables that never change
        return Symbolic(
            program=program,
            shown=shown,
            constants=_constants(program),
            locations={},
            unnamed_reward=any(not reward.name for reward in program.reward_models),
        )


def parse_jani(text: str, shown: str) -> Symbolic:
    """Let Storm read a JANI model, without its properties; as `parse_prism`."""
    with _storm(shown, "read") as stormpy:
        model, _ = stormpy.parse_jani_model_from_string(text, property_filter=[])
        locations = {automaton.name: [place.name for place in automaton.locations] for automaton in model.automata}
        return Symbolic(program=model, shown=shown, constants=_constants(model), locations=locations)


def _constants(program: Any) -> tuple[Constant, ...]:
    return tuple(
        Constant(name=item.name, kind=_KINDS.get(str(item.type), "double"), defined=bool(item.defined))
        for item in program.constants
    )


def build(symbolic: Symbolic, values: Mapping[str, Value], *, hidden: Collection[str] = ()) -> Problem:
    """Build the whole model.

    Parameters
    ----------
    symbolic : Symbolic
    values : mapping of str to bool, int or float
        The values of its undefined constants.
    hidden : collection of str
        State variables to leave out of the names of states.

    Returns
    -------
    Problem
        The model alone, with notes on what was repaired.

    Raises
    ------
    SourceError
        With what Storm says against it, or if a variable leaves its range.
    ModelError
        If the model breaks a law, such as probabilities that do not sum to 1.
    """
    shown = symbolic.shown
    filled = {item.name: _unused(item) for item in symbolic.constants if not item.defined} | dict(values)
    with tempfile.TemporaryDirectory(prefix="ratherthan-") as folder:
        path = Path(folder) / "model.umb"
        with _storm(shown, "build") as stormpy:
            program, _ = stormpy.instantiate_constants(symbolic.program, filled)
            model = stormpy.build_model(program, options=_options(stormpy, checked=False))
            options = stormpy.io.UmbExportOptions()
            options.compression = stormpy.io.CompressionMode.NO_COMPRESSION
            stormpy.io.export_to_umb(model, path, options=options)
        try:
            problem = read_umb(path)
        except RatherthanError as error:  # the file is ours and gone soon: name the source instead
            raise _of_source(error, str(path), shown) from error
    _check_ranges(problem, program, shown)
    return _finished(problem, symbolic, hidden)


def _of_source(error: RatherthanError, path: str, shown: str) -> RatherthanError:
    """Return the same error about the source, without what was only made for the way here."""

    def cleaned(text: str) -> str:
        text = text.replace(path, shown)
        return text.replace(f"{_RANGE_BIT}=false, ", "").replace(f" ('{_RANGE_BIT}=false')", "")

    place = error.place | {"path": shown}
    if isinstance(error, ModelError):
        return ModelError(cleaned(error.message), faults=tuple(map(cleaned, error.faults)), **place)
    return type(error)(cleaned(error.message), **place)


def _unused(item: Constant) -> Value:
    """Return any value for a constant on which the model does not depend."""
    return {"int": 1, "bool": False, "double": 1.0}[item.kind]


def _options(stormpy: Any, *, checked: bool) -> Any:
    """Return options to build everything; `checked`: stop at the first value out of range, and say which."""
    options = stormpy.BuilderOptions()
    options.set_build_all_labels()
    options.set_build_all_reward_models()
    options.set_build_state_valuations()
    options.set_build_choice_labels()
    if checked:
        options.set_exploration_checks()
    else:
        options.set_add_out_of_bounds_state()
    return options


def _check_ranges(problem: Problem, program: Any, shown: str) -> None:
    """Refuse a model in which a variable leaves its range; a second build tells which."""
    bit = problem.mdp.names.variables.get(_RANGE_BIT)
    if bit is None or not np.any(bit):
        return
    with _storm(shown, "build") as stormpy:
        stormpy.build_model(program, options=_options(stormpy, checked=True))
    raise SourceError(
        f"Every variable of '{shown}' must stay in its range, but one leaves it. Widen the range or the guard.",
        path=shown,
    )


def _finished(problem: Problem, symbolic: Symbolic, hidden: Collection[str]) -> Problem:
    """Name locations by their names and the nameless reward by ours, and note what Storm repaired."""
    mdp = problem.mdp
    columns = _Columns(mdp.names.variables, symbolic.locations, {_RANGE_BIT, *hidden})
    rewards = dict(mdp.rewards)
    if symbolic.unnamed_reward and _UNNAMED_REWARD in rewards and _ITS_NAME not in rewards:
        rewards = {_ITS_NAME if name == _UNNAMED_REWARD else name: reward for name, reward in rewards.items()}
    notes = problem.notes
    stuck = int(np.count_nonzero(mdp.labels["deadlock"])) if "deadlock" in mdp.labels else 0
    if stuck:
        states = "1 state had" if stuck == 1 else f"{stuck} states had"
        notes += (f'{states} no choice in the source and got a loop in place (label "deadlock").',)
    mdp = replace(mdp, names=StateNames(count=mdp.states, variables=columns), rewards=rewards)
    return replace(problem, mdp=mdp, source=symbolic.shown, notes=notes)


class _Columns(Mapping[str, npt.NDArray[np.generic]]):
    """State variables without those that tell nothing, decoded on demand; locations as their names."""

    def __init__(
        self,
        inner: Mapping[str, npt.NDArray[np.generic]],
        locations: Mapping[str, Sequence[str]],
        hidden: Collection[str],
    ) -> None:
        self.inner = inner
        self.words = {_LOCATION + name: np.array(names, dtype=object) for name, names in locations.items()}
        self.decoded: dict[str, npt.NDArray[np.generic]] = {}
        self.names = tuple(
            name for name in inner if name not in hidden and not (name in self.words and self._stays(name))
        )

    def _stays(self, name: str) -> bool:
        return bool((self.inner[name] == self.inner[name][0]).all())

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __getitem__(self, name: str) -> npt.NDArray[np.generic]:
        if name not in self.names:
            raise KeyError(name)
        if name not in self.words:
            return self.inner[name]
        if name not in self.decoded:
            self.decoded[name] = np.asarray(self.words[name][self.inner[name].astype(np.int64)])
        return self.decoded[name]

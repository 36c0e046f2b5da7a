"""A PRISM or JANI model enters as text, its full state space leaves as a Problem: Storm builds it, a file of arrays brings it over.

This is the only module that loads Storm (its Python bindings, stormpy). Storm writes the whole model as arrays in the
Unified Markov Binary format, which our own reader takes in: no state is touched one by one. It works in a process of its own,
so that it can be interrupted, and its own log is silent meanwhile. What is built is everything: all labels, reward
structures, state variables and action names, and no state space cut off at the goals of a property.

A value that leaves a variable's range is cut down to the bits at hand unless one asks; so here a further bit is built that
tells of it, and such a model is refused.
"""

from __future__ import annotations

import re
import signal
import threading
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ratherthan.errors import MissingExtraError, ModelError, RatherthanError, SourceError
from ratherthan.io._apart import apart
from ratherthan.io._constants import Constant, Value
from ratherthan.io._leftovers import temporary_folder
from ratherthan.io._storm_names import RANGE_BIT, Symbolic, finished
from ratherthan.io.umb import read_umb
from ratherthan.model.problem import Problem

__all__ = ["at_work", "build", "parse_jani", "parse_prism", "sentence_of"]

_LONGEST = 400
_KINDS = {"int": "int", "bool": "bool"}


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
def at_work(shown: str, doing: str) -> Iterator[Any]:
    """Yield stormpy, silent; what it raises becomes one sentence, and who interrupts is heard as before."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
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
            f"'{shown}' must be a model that Storm can {doing}, but it cannot: {sentence_of(error)}", path=shown
        ) from error
    finally:
        developer.set_log_level(before)
        if threading.current_thread() is threading.main_thread():  # Storm puts them back so that system calls go on
            for number, handler in handlers.items():
                if handler is not None:
                    signal.signal(number, handler)


def sentence_of(error: BaseException) -> str:
    """Return Storm's message without the names of its classes, its line drawing, and with an end."""
    text = str(error) or str(getattr(error, "message", "")) or type(error).__name__
    text = re.sub(r"^((\w+Exception|Storm):\s*)+", "", text.strip())
    text = re.sub(r"\.?\s*Note that the used API function.*", "", text, flags=re.DOTALL)
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
    with at_work(shown, "read") as stormpy:
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
    with at_work(shown, "read") as stormpy:
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
    with temporary_folder() as folder:
        path = folder / "model.umb"
        with at_work(shown, "build") as stormpy:
            program, _ = stormpy.instantiate_constants(symbolic.program, filled)
            apart(lambda: _export(stormpy, program, path))
        try:
            problem = read_umb(path)
        except RatherthanError as error:  # the file is ours and gone soon: name the source instead
            raise _of_source(error, str(path), shown) from error
    _check_ranges(problem, program, shown)
    return finished(problem, symbolic, hidden)


def _export(stormpy: Any, program: Any, path: Path) -> None:
    """Build a model and write it as arrays."""
    model = stormpy.build_model(program, options=_options(stormpy, checked=False))
    options = stormpy.io.UmbExportOptions()
    options.compression = stormpy.io.CompressionMode.NO_COMPRESSION
    stormpy.io.export_to_umb(model, path, options=options)


def _of_source(error: RatherthanError, path: str, shown: str) -> RatherthanError:
    """Return the same error about the source, without what was only made for the way here."""

    def cleaned(text: str) -> str:
        text = text.replace(path, shown)
        return text.replace(f"{RANGE_BIT}=false, ", "").replace(f" ('{RANGE_BIT}=false')", "")

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
    bit = problem.mdp.names.variables.get(RANGE_BIT)
    if bit is None or not np.any(bit):
        return
    with at_work(shown, "build") as stormpy:
        apart(lambda: stormpy.build_model(program, options=_options(stormpy, checked=True)))
    raise SourceError(
        f"Every variable of '{shown}' must stay in its range, but one leaves it. Widen the range or the guard.",
        path=shown,
    )

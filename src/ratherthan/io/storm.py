"""A problem and a property that this package cannot explain enter, Storm's answer leaves: any property that Storm takes.

Storm works in a process of its own: it can be interrupted at any moment, and neither what it prints nor a crash of it
reaches the caller. It is handed the model as a file of arrays and the property in bare words (`ratherthan.io._storm_text`).
The mean in the long run of a reward that may be negative it can refine for ever; so it is asked for that of the reward plus a
constant, which is larger by the constant. Where that cannot be done, there is an end to our patience.
Its number comes without a certificate of ours: no bounds are told, and no claim may rest on it.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ratherthan.errors import MissingExtraError, PropertyError, SourceError
from ratherthan.io._leftovers import started, temporary_folder
from ratherthan.io._storm_text import Translated, translated
from ratherthan.io._storm_words import outer_filter
from ratherthan.io.umb_write import write_umb
from ratherthan.model.formula import states_where
from ratherthan.model.mdp import MDP, Bools, Floats, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem
from ratherthan.model.states import start_of
from ratherthan.model.watch import look

__all__ = ["StormAnswer", "ask_storm", "storm_is_there"]

_LOOK = 0.2
_PATIENCE = 3600.0
"""For how many seconds Storm may work on a property."""
_PATIENCE_FOR_MEANS = 30.0
"""The same for the mean of a reward that may be negative, which it finds at once or never."""
_MEAN = re.compile(r'R\{"(\w+)"\}(?:min|max)?=\? \[ (?:LRA|S) \]')


@dataclass(frozen=True, kw_only=True)
class StormAnswer:
    """What Storm says of a property.

    Parameters
    ----------
    text : str
        The property.
    value : bool or float
        At the start, or of the filter around the property.
    engine : str
        ``Storm`` with its version.
    lower, upper : float, optional
        Where Storm's own sound methods put the number, None where it tells no such bounds.
    """

    text: str
    value: bool | float
    engine: str
    lower: float | None = None
    upper: float | None = None

    @property
    def message(self) -> str:
        """How far the answer can be trusted, as a sentence."""
        how = ""
        if self.lower is not None and self.upper is not None:
            how = f" Its own methods put it between {self.lower:.9g} and {self.upper:.9g}."
        return f"This is Storm's answer: nothing of it is proved here.{how}"


def storm_is_there() -> bool:
    """Whether Storm is installed."""
    return importlib.util.find_spec("stormpy") is not None


def ask_storm(problem: Problem, text: str) -> StormAnswer:
    """Let Storm answer a property at the start of a model.

    Parameters
    ----------
    problem : Problem
        From any source.
    text : str
        In PRISM's syntax with Storm's additions. ``filter(op, property, states)`` may stand around it, with min, max, sum,
        avg, count, forall, exists, first or state.

    Returns
    -------
    StormAnswer

    Raises
    ------
    PropertyError
        Where Storm, or we before it, cannot read the property, or there is no one value.
    SourceError
        Where Storm broke off, or did not come to an end.
    MissingExtraError
        Where Storm is not installed.
    """
    if not storm_is_there():
        raise MissingExtraError(
            'Storm must be installed to answer any other property: pip install "ratherthan[storm]".', text=text
        )
    filtered = outer_filter(text)
    if filtered is None:
        start_of(problem.mdp)
        return replace(_asked(problem, translated(text, problem), every=False)[0], text=text)
    operator, inner, where = filtered
    if operator not in _FILTERS:
        raise PropertyError(
            f"A filter must have one value: {', '.join(_FILTERS)}; got '{operator}'. Ask for one of them.", text=text
        )
    states = states_where(problem.mdp, where, problem.definitions)
    if not states.any():
        raise PropertyError(f"The states of a filter must be some, but '{where}' holds in none.", text=text)
    made, values = _asked(problem, translated(inner, problem), every=True)
    return replace(made, text=text, value=_FILTERS[operator](values[states], text))


def _asked(problem: Problem, wanted: Translated, *, every: bool) -> tuple[StormAnswer, Floats | Bools]:
    """Ask Storm in a process of its own; return its answer at the start, and in every state if that is asked for."""
    _check_signs(wanted)
    wanted, raised = _raised(wanted)
    with temporary_folder() as folder:
        chain = problem.mdp.choices == problem.mdp.states and not wanted.chosen
        write_umb(_bare(problem.mdp, wanted), folder / "model.umb", packing="none", players=0 if chain else 1)
        question = {"text": wanted.text, "every": every}
        (folder / "question.json").write_text(json.dumps(question), encoding="utf-8")
        said = _said(folder, _run(folder, _patience(wanted)), wanted)
        values = np.load(folder / "values.npy", allow_pickle=False) if every else np.zeros(0)
    value = said["value"] if isinstance(said["value"], bool) else float(said["value"]) - raised
    if math.isnan(value):
        raise PropertyError("Storm must come to a number, but it says that the value is not defined here.")
    bounds = {key: float(said[key]) - raised for key in ("lower", "upper") if said[key] is not None and not every}
    values = values - raised if raised else values
    return StormAnswer(text="", value=value, engine=f"Storm {said['version']}", **bounds), values


def _raised(wanted: Translated) -> tuple[Translated, float]:
    """Return a property without negative rewards if it is the mean of one in the long run, and how much was added to it."""
    mean = _MEAN.fullmatch(wanted.text)
    if mean is None:
        return wanted, 0.0
    reward = wanted.rewards[mean[1]]
    least = {part: min(float(values.min()), 0.0) for part, values in reward.parts()}
    parts = {part: values - least[part] for part, values in reward.parts()}
    return replace(wanted, rewards={mean[1]: Reward(**parts)}), 0.0 - sum(least.values())


def _check_signs(wanted: Translated) -> None:
    """Refuse endless sums of rewards that may be negative, and bounds on them: Storm does not say what it does with them."""
    if not wanted.from_zero:
        return
    for reward in wanted.rewards.values():
        for part, values in reward.parts():
            if (values < 0).any():
                raise PropertyError(
                    "A reward that Storm adds up without a bound on steps, or that bounds a path, must not be negative, got "
                    f'{values.min():g} on a {part}. Bound the number of steps, R{{"reward"}}max=? [C<=100], or demand to '
                    'arrive, R{"reward"}max=? [Fsure "goal"].'
                )


def _patience(wanted: Translated) -> float:
    """Return for how many seconds Storm may work."""
    return _PATIENCE_FOR_MEANS if wanted.averaged and any(map(_may_be_negative, wanted.rewards.values())) else _PATIENCE


def _may_be_negative(reward: Reward) -> bool:
    return any((values < 0).any() for _, values in reward.parts())


def _bare(mdp: MDP, wanted: Translated) -> Problem:
    """Return the model with nothing but what the property needs."""
    return Problem(
        mdp=replace(
            mdp,
            choice_to_action=np.full(mdp.choices, -1, dtype=np.int32),
            actions=(),
            labels=wanted.labels,
            rewards=wanted.rewards,
            names=StateNames(count=mdp.states),
        )
    )


def _run(folder: Path, patience: float) -> int:
    """Run Storm on a folder for so many seconds at most; return its exit code."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = [sys.executable, "-m", "ratherthan.io._storm_answer", str(folder)]
    process = subprocess.Popen(
        command,
        env=environment,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        with started(process.pid):
            code = _waited(process, patience)
        if code is not None:
            return code
        process.kill()
        process.wait()
        raise SourceError(
            f"Storm must come to an answer in time, but after {patience:g} seconds it has none{_why(patience)}. "
            "Ask for something smaller, or bound the number of steps."
        )
    except BaseException:
        process.kill()
        process.wait()
        raise


def _waited(process: subprocess.Popen[bytes], patience: float) -> int | None:
    """Return the exit code of a process, None where it has not ended in time; meanwhile limits hold."""
    until = time.monotonic() + patience
    while time.monotonic() < until:
        try:
            return process.wait(timeout=_LOOK)
        except subprocess.TimeoutExpired:
            look()
    return None


def _why(patience: float) -> str:
    """Return why there may be no end, where that is known."""
    return (
        ": the mean in the long run of a reward that may be negative it can refine for ever"
        if patience < _PATIENCE
        else ""
    )


def _said(folder: Path, code: int, wanted: Translated) -> dict[str, Any]:
    """Return what Storm left in a folder; raise what it says against the property."""
    path = folder / "answer.json"
    if not path.is_file():
        why = f"signal {-code}" if code < 0 else f"exit code {code}"
        hint = " Most likely the memory of this machine does not suffice." if code == -9 else ""
        raise SourceError(f"Storm must come to an answer, but it broke off ({why}).{hint} Ask for something smaller.")
    said: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    if "error" in said:
        raise PropertyError(f"Storm cannot answer this: {_in_own_words(said['error'], wanted)}")
    return said


def _in_own_words(sentence: str, wanted: Translated) -> str:
    """Return Storm's sentence with the text of the property that it saw, where it speaks of it."""
    return f"{sentence} It was asked: {wanted.text}." if '"s' in sentence or " at " in sentence else sentence


def _number(values: Floats | Bools, text: str) -> Floats:
    if values.dtype == np.bool_:
        raise PropertyError(
            "A filter with min, max, sum or avg must stand around a number, got a yes-or-no question.", text=text
        )
    if np.isnan(values).any():
        raise PropertyError("The property of a filter must have a value in all of its states, but in some it has none.")
    return np.asarray(values, dtype=np.float64)


def _truth(values: Floats | Bools, text: str) -> Bools:
    if values.dtype != np.bool_:
        raise PropertyError("A filter with count, forall or exists must stand around a yes-or-no question.", text=text)
    return np.asarray(values, dtype=np.bool_)


def _one(values: Floats | Bools, text: str, *, only: bool) -> bool | float:
    if only and len(values) != 1:
        raise PropertyError(f"A filter with 'state' must single out one state, got {len(values)}.", text=text)
    first = values[0]
    return bool(first) if values.dtype == np.bool_ else float(_number(values[:1], text)[0])


_FILTERS: Mapping[str, Callable[[Floats | Bools, str], bool | float]] = {
    "min": lambda values, text: float(_number(values, text).min()),
    "max": lambda values, text: float(_number(values, text).max()),
    "sum": lambda values, text: float(_number(values, text).sum()),
    "avg": lambda values, text: float(_number(values, text).mean()),
    "count": lambda values, text: float(_truth(values, text).sum()),
    "forall": lambda values, text: bool(_truth(values, text).all()),
    "exists": lambda values, text: bool(_truth(values, text).any()),
    "first": lambda values, text: _one(values, text, only=False),
    "state": lambda values, text: _one(values, text, only=True),
}

"""An environment's own code is run, and what it prints, warns of or raises enters; silence, notes and one sentence leave."""

from __future__ import annotations

import copy
import inspect
import io
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from typing import Any

import numpy as np

from ratherthan.errors import RatherthanError, SourceError
from ratherthan.io._gym_entries import Table
from ratherthan.io._roadmap_text import closest

__all__ = ["Foreign", "check_steps", "plain_of"]

HARMLESS = (
    *("OrderEnforcing", "PassiveEnvChecker", "RecordEpisodeStatistics", "RecordVideo", "HumanRendering"),
    *("RenderCollection", "AddRenderObservation", "TimeLimit"),
)
COLOURS = re.compile(r"\x1b\[[0-9;]*m")
MOST_WRAPPERS = 100
CHECKED_STEPS = 200


class Foreign:
    """Runs the code of one environment.

    Parameters
    ----------
    shown : str
        How the environment is called in errors.
    """

    def __init__(self, shown: str) -> None:
        self.shown = shown
        self.warned: list[str] = []

    @contextmanager
    def running(self, what: str) -> Iterator[None]:
        """Run foreign code in silence; `what` it must be able to do is said where it fails.

        Raises
        ------
        SourceError
            With what the code raised.
        """
        with warnings.catch_warnings(record=True) as caught, redirect_stdout(io.StringIO()):
            warnings.simplefilter("always")
            try:
                yield
            except RatherthanError:
                raise
            except Exception as error:  # anything may come out of code that is not ours
                raise SourceError(
                    f"An environment must {what}, but '{self.shown}' fails: {_said(error)}.", environment=self.shown
                ) from error
        for warning in caught:
            text = COLOURS.sub("", str(warning.message))
            if text.startswith("WARN: ") and text not in self.warned:  # Gymnasium's own way to warn
                self.warned.append(text)

    @contextmanager
    def making(self, name: str, arguments: Mapping[str, Any], creator: Callable[[], Any]) -> Iterator[None]:
        """Make an environment; an argument that it does not take is named, with those it takes."""
        try:
            with self.running("be one that can be made"):
                yield
        except SourceError as error:
            if isinstance(error.__cause__, TypeError):
                self._check_arguments(name, arguments, creator)
            raise
        self._check_arguments(name, {key: value for key, value in arguments.items() if isinstance(value, str)}, creator)

    def _check_arguments(self, name: str, arguments: Mapping[str, Any], creator: Callable[[], Any]) -> None:
        """Refuse an argument that is not taken, and a word where true or false is wanted."""
        if not arguments:
            return
        with self.running("be one that can be made"):
            taken = inspect.signature(creator()).parameters
            known = {*taken, "max_episode_steps"} - {"self", "render_mode"}
            open_ = any(parameter.kind is parameter.VAR_KEYWORD for parameter in taken.values())
        for key, value in arguments.items():
            if key not in known and not open_:
                raise SourceError(
                    f"'{name}' takes the arguments {', '.join(sorted(known))}; got '{key}'.{closest(key, known)}",
                    environment=self.shown,
                )
            if key in taken and isinstance(taken[key].default, bool) and isinstance(value, str):
                raise SourceError(f"'{key}' of '{name}' must be true or false, got '{value}'.", environment=self.shown)


def _said(error: Exception) -> str:
    text = COLOURS.sub("", str(error)).strip().rstrip(".")
    return f"{text} ({type(error).__name__})" if text else type(error).__name__


def plain_of(environment: Any, shown: str) -> tuple[Any, tuple[str, ...]]:
    """Return an environment without its wrappers, and a note on its time limit.

    Raises
    ------
    SourceError
        Where a wrapper may change what actions do or earn; or where there are several environments in one.
    """
    if hasattr(environment, "num_envs"):
        raise SourceError(
            f"One environment can be read at a time, but '{shown}' is {environment.num_envs} in one. Give one of them."
        )
    notes: tuple[str, ...] = ()
    plain = getattr(environment, "unwrapped", environment)
    for _ in range(MOST_WRAPPERS):
        if environment is plain:
            break
        kinds = {kind.__name__ for kind in type(environment).__mro__}
        own = type(environment).__name__
        if own not in HARMLESS and "ObservationWrapper" not in kinds:
            raise SourceError(
                f"A wrapper must leave the task as it is, but '{shown}' wears {own}, which may change what actions do or "
                "earn. Give env.unwrapped to read the environment without it.",
                environment=shown,
            )
        limit = getattr(environment, "_max_episode_steps", None)
        if own == "TimeLimit" and limit is not None:
            notes = (f"The time limit of {limit} steps is no part of the model: plans may take longer.",)
        environment = environment.env
    return plain, notes


def check_steps(plain: Any, table: Table, foreign: Foreign) -> tuple[str, ...]:
    """Take some steps and look each of them up in the table; return a note where that cannot be done.

    Raises
    ------
    SourceError
        Where a step does what the table does not know: a rule of the environment is not in it.
    """
    try:
        with foreign.running("be copied and stepped"):
            walker = copy.deepcopy(plain)
            steps = list(_walk(walker, table))
    except SourceError as error:
        return (f"The transition table could not be compared with the environment's steps. {error.message}",)
    if not steps:
        return ("The transition table could not be compared with steps, as observations are not its states.",)
    key = table.state * table.actions + table.action
    for state, action, target, reward, terminated in steps:
        at = slice(*np.searchsorted(key, [state * table.actions + action, state * table.actions + action + 1]))
        known = (table.target[at] == target) & (table.reward[at] == reward) & (table.terminated[at] == terminated)
        if not known.any():
            raise SourceError(
                f"A transition table must say all that steps do, but action {action} at state {state} of '{foreign.shown}' "
                f"came to state {target} with reward {reward:g}{' and ended' if terminated else ''}, which its table does "
                "not know. The environment has a rule beside its table.",
                environment=foreign.shown,
                state=state,
                action=action,
            )
    return ()


def _walk(walker: Any, table: Table) -> Iterator[tuple[int, int, int, float, bool]]:
    """Yield random steps: state, action, next state, reward, whether the episode ended. Nothing where states are unseen."""
    draw = np.random.default_rng(0)
    state, _ = walker.reset(seed=0)
    first = int(getattr(walker.action_space, "start", 0))
    for _ in range(CHECKED_STEPS):
        if not isinstance(state, int | np.integer) or not 0 <= state < table.states:
            return
        own = np.unique(table.action[table.state == state])
        action = int(draw.choice(own)) if len(own) else 0
        target, reward, terminated, truncated, *_ = walker.step(action + first)
        if not isinstance(target, int | np.integer):
            return
        yield int(state), action, int(target), float(reward), bool(terminated)
        state = walker.reset()[0] if terminated or truncated else target

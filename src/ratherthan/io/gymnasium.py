"""The name of a Gymnasium environment, or the environment itself, enters; a Problem leaves. Tables in JSON likewise.

======================================= ==========================================================================
source                                  what it means
======================================= ==========================================================================
``gym:FrozenLake-v1``                   the environment that is registered under this name
``gym:FrozenLake-v1,map_name=8x8``      with arguments, by commas: numbers, fractions (1/3), true, false, none, JSON;
                                        anything else is text
``gym:package:Name-v0``                 of a package that registers it when it is imported
an environment                          with the wrappers that it has, if they leave the task as it is
``.json.gz``, ``.json`` with a table    see `ratherthan.io._gym_json`; Gymnasium is not needed
======================================= ==========================================================================

An environment with a transition table (``P``) is read from it (`ratherthan.io._gym_model` says how its ends become
terminal states). One without is explored, where nothing is left to chance (`ratherthan.io._gym_explore`); then `seed` picks
the start that is drawn, `max_states` limits how far it goes, and `ignore` names attributes that are no part of a state.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import MissingExtraError, SourceError
from ratherthan.io import _gym_minigrid as minigrid
from ratherthan.io._files import Limits
from ratherthan.io._gym_calls import Foreign, check_steps, plain_of
from ratherthan.io._gym_entries import Numbers, Table, table_from
from ratherthan.io._gym_explore import Explorer, explore
from ratherthan.io._gym_facts import action_names, columns_of, plain_facts
from ratherthan.io._gym_json import read_stored
from ratherthan.io._gym_known import MINIGRID_WORDS, fickle, kind_of
from ratherthan.io._gym_model import Ended, mdp_of, objective_of
from ratherthan.io._gym_text import split_source
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.names import StateNames
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.problem import Problem
from ratherthan.model.world import World

__all__ = ["read_environment", "read_gymnasium", "read_table"]

MOST_STATES = 100_000
OWN_OPTIONS = ("seed", "max_states", "ignore")
MINIGRID_NAMES = ("MiniGrid-", "BabyAI-")


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How an environment without a table is explored; see the options of `read_environment`."""

    seed: int = 0
    max_states: int = MOST_STATES
    ignore: tuple[str, ...] = ()

    @staticmethod
    def of(options: Mapping[str, Any], shown: str) -> Reading:
        """Check the options."""
        unknown = sorted(set(options) - set(OWN_OPTIONS))
        if unknown:
            raise SourceError(
                f"An environment is read with the options {', '.join(OWN_OPTIONS)}, got {', '.join(unknown)} for '{shown}'. "
                "Give other arguments where the environment is made.",
                environment=shown,
            )
        for name, least in (("seed", 0), ("max_states", 1)):
            value = options.get(name, 1)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise SourceError(f"{name} must be a whole number from {least} on, got {value!r}.", environment=shown)
        ignore = options.get("ignore", ())
        ignore = (ignore,) if isinstance(ignore, str) else ignore
        if not isinstance(ignore, list | tuple) or not all(isinstance(name, str) for name in ignore):
            raise SourceError(f"ignore must list attributes by name, got {ignore!r}.", environment=shown)
        return Reading(**{**options, "ignore": tuple(ignore)})


def read_gymnasium(text: str, **options: Any) -> Problem:
    """Make a registered environment and read it.

    Parameters
    ----------
    text : str
        Its name, and arguments after commas; without ``gym:``.
    **options
        More arguments, and those of `read_environment`.

    Returns
    -------
    Problem

    Raises
    ------
    MissingExtraError
        Where Gymnasium is not installed.
    SourceError
        Where there is no such environment, it does not take these arguments, or it cannot be read.
    """
    shown = f"gym:{text}"
    name, arguments = split_source(text)
    twice = sorted(set(arguments) & set(options))
    if twice:
        raise SourceError(f"An argument must be given once, got {', '.join(twice)} twice.", environment=shown)
    arguments |= options
    own = {key: arguments.pop(key) for key in OWN_OPTIONS if key in arguments}
    reading = Reading.of(own, shown)
    foreign = Foreign(shown)
    environment = _made(name, arguments, foreign)
    try:
        problem = _read(environment, shown, reading, foreign)
    finally:
        with foreign.running("be closed"):
            environment.close()
    return replace(problem, notes=problem.notes + tuple(foreign.warned))


def _made(name: str, arguments: Mapping[str, Any], foreign: Foreign) -> Any:
    """Return an environment by its registered name."""
    try:
        import gymnasium
    except ImportError as error:
        raise MissingExtraError(
            "Gymnasium must be installed to make its environments: pip install 'ratherthan[gym]'.", library="gymnasium"
        ) from error
    if name.startswith(MINIGRID_NAMES) and name not in gymnasium.registry:
        name = f"minigrid:{name}"
    if "render_mode" in arguments:
        raise SourceError(f"'{foreign.shown}' is read, not watched: leave render_mode out.", environment=foreign.shown)
    with foreign.making(name, arguments, lambda: gymnasium.envs.registration.load_env_creator(_entry(gymnasium, name))):
        return gymnasium.make(name, disable_env_checker=True, **arguments)


def _entry(gymnasium: Any, name: str) -> Any:
    return gymnasium.spec(name.rpartition(":")[2]).entry_point


def read_environment(environment: Any, **options: Any) -> Problem:
    """Read an environment that is made already; it stays as it is.

    Parameters
    ----------
    environment : gymnasium.Env
    **options
        For one without a transition table: `seed`, which start is drawn (0); `max_states`, how many are explored at most
        (100,000); `ignore`, attributes that are no part of a state, such as a counter of steps.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        Where it has neither a table nor states that can be explored, or a wrapper that changes the task.
    """
    spec = getattr(environment, "spec", None)
    shown = str(getattr(spec, "id", None) or type(getattr(environment, "unwrapped", environment)).__name__)
    foreign = Foreign(shown)
    problem = _read(environment, shown, Reading.of(options, shown), foreign)
    return replace(problem, notes=problem.notes + tuple(foreign.warned))


def _read(environment: Any, shown: str, reading: Reading, foreign: Foreign) -> Problem:
    """Read an environment from its table, or explore it."""
    plain, notes = plain_of(environment, shown)
    if getattr(plain, "P", None) is not None:
        if reading != Reading():
            raise SourceError(
                f"{', '.join(OWN_OPTIONS)} are for environments that are explored, but '{shown}' has a transition table. "
                "Leave them out.",
                environment=shown,
            )
        return _from_attributes(plain, shown, foreign, notes)
    return _from_steps(plain, shown, reading, foreign, notes)


def _from_attributes(plain: Any, shown: str, foreign: Foreign, notes: tuple[str, ...]) -> Problem:
    """Read an environment from its table."""
    table = table_from(plain.P, shown)
    keys = ("nrow", "ncol", "fickle_passenger", "fickle_probability")
    facts = {key: getattr(plain, key) for key in keys if hasattr(plain, key)}
    if not facts.get("fickle_passenger"):
        notes += check_steps(plain, table, foreign)
    initial = None
    for attribute in ("initial_state_distrib", "isd"):
        chances = getattr(plain, attribute, None)
        if chances is not None and np.shape(chances) == (table.states,):
            initial = np.flatnonzero(np.asarray(chances) > 0)
            break
    parts = _Parts(table=table, initial=initial, name=_documented(plain), facts=facts)
    return _problem(parts, shown, notes)


def _documented(plain: Any) -> str:
    """Return the name of a documented environment that an object is one of, empty where it is none."""
    names = {"FrozenLakeEnv": "FrozenLake", "CliffWalkingEnv": "CliffWalking", "TaxiEnv": "Taxi"}
    kinds = (kind for kind in type(plain).__mro__ if kind.__module__.startswith("gymnasium.envs.toy_text."))
    return next((names[kind.__name__] for kind in kinds if kind.__name__ in names), "")


@dataclass(frozen=True, kw_only=True)
class _Parts:
    """A table with what is known beside it."""

    table: Table
    initial: Numbers | None
    name: str
    facts: Mapping[str, Any]
    actions: tuple[str, ...] = ()
    told: Sequence[Mapping[str, Any]] = ()


def read_table(path: str | os.PathLike[str], *, limits: Limits | None = None) -> Problem:
    """Read an environment's table from a file in JSON.

    Parameters
    ----------
    path : path
        Packed by gzip or not.
    limits : Limits, optional
        What it may unpack to.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        Where the file is missing or damaged, is no JSON, or is not of the form.
    ModelError
        Where the table breaks a law, such as probabilities that do not sum to 1.
    """
    stored = read_stored(path, limits)
    parts = _Parts(
        table=stored.table,
        initial=stored.initial,
        name=stored.name,
        facts=stored.facts,
        actions=stored.actions,
        told=stored.states,
    )
    return _problem(parts, os.fspath(path), ())


def _problem(parts: _Parts, shown: str, notes: tuple[str, ...]) -> Problem:
    """Return the problem of a table."""
    table, more = fickle(parts.name, parts.facts, parts.table)
    notes += more
    kind = kind_of(parts.name, parts.facts, table)
    if parts.initial is None:
        initial = np.arange(parts.table.states)
        notes += ("The table names no initial state: any state may be the start.",)
    else:
        initial = parts.initial
        if len(initial) > 1:
            notes += (f"The environment draws its start among {len(initial)} states: choose one as the start.",)
    listed = initial[: 0 if parts.initial is None else None]
    ended = Ended.of(table, listed)
    if kind is not None:
        world = None if kind.world is None else kind.world(ended, listed)
        words = _Words(columns=kind.columns(ended), world=world, lexicon=kind.lexicon, actions=kind.actions)
    else:
        words = _Words(
            columns=columns_of(parts.told, ended.origin, ended.terminal),
            lexicon=MINIGRID_WORDS if parts.name.startswith(MINIGRID_NAMES) else Lexicon(),
            actions=parts.actions or tuple(f"a{number}" for number in range(table.actions)),
        )
    return _finished(ended, initial, words, (shown, notes))


@dataclass(frozen=True, kw_only=True)
class _Words:
    """How states and actions are called, and where they lie."""

    columns: Mapping[str, npt.NDArray[np.generic]]
    lexicon: Lexicon
    actions: tuple[str, ...]
    world: World | None = None


def _finished(ended: Ended, initial: Numbers, words: _Words, source: tuple[str, tuple[str, ...]]) -> Problem:
    """Return the problem with its MDP; `source` is what it came from, and notes."""
    names = StateNames(count=ended.table.states, variables=words.columns)
    mdp, more = mdp_of(ended, initial, words.actions, names)
    objective = objective_of(ended)
    if words.lexicon is MINIGRID_WORDS and ended.only_arrival_pays:  # it pays more the sooner the goal is reached
        objective = ExpectedCost(goal='"goal"', reward=None)
    return Problem(
        mdp=mdp,
        world=words.world,
        objective=objective,
        lexicon=words.lexicon,
        source=source[0],
        notes=source[1] + more,
    )


def _from_steps(plain: Any, shown: str, reading: Reading, foreign: Foreign, notes: tuple[str, ...]) -> Problem:
    """Explore an environment that has no table."""
    grid = minigrid.is_minigrid(plain)
    if grid:
        with foreign.running("be copied"):
            plain = copy.deepcopy(plain)
        notes += minigrid.without_clock(plain)
    how = Explorer(
        shown=shown,
        ignore=reading.ignore + (minigrid.COUNTERS if grid else ()),
        most_states=reading.max_states,
        facts=minigrid.facts if grid else lambda at: plain_facts(at, reading.ignore),
        constant=minigrid.constants if grid else lambda _: (),
        prepare=minigrid.copy_grid if grid else lambda *_: None,
        quiet=foreign.running,
    )
    found = explore(plain, reading.seed, how)
    if found.drawn:
        notes += (f"The start is drawn: this is the one of seed {reading.seed} (another: seed=…).",)
    if found.truncated:
        notes += ("Some steps cut an episode short (truncated); the model goes on there.",)
    start = np.zeros(1, dtype=np.int64)
    ended = Ended.of(found.table, start)
    words = _Words(
        columns=columns_of(found.facts, ended.origin, found.ended[ended.origin]),
        lexicon=MINIGRID_WORDS if grid else Lexicon(),
        actions=action_names(plain, found.table.actions),
        world=minigrid.world_of(found.start, [found.facts[state] for state in ended.origin]) if grid else None,
    )
    return _finished(ended, start, words, (shown, notes))

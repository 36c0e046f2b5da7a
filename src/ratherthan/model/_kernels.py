"""Arrays of a graph enter, marks and numbers of states leave: the loops that numpy cannot do in one stroke.

Every kernel is a plain function over arrays. `compiled` hands it out as it stands for little work (numba is then never
imported) and compiled for much. ``RATHERTHAN_COMPILE`` is ``auto`` (default), ``always`` or ``never``;
``NUMBA_DISABLE_JIT=1`` means never, too. Compiled code is kept in ``NUMBA_CACHE_DIR``, by default in the user's cache.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from ratherthan.model.mdp import Bools, Ints

__all__ = ["LEAST_WORK", "compiled", "is_compiled", "spread_all", "spread_any", "strong_components"]

P = ParamSpec("P")
R = TypeVar("R")

LEAST_WORK = 15_000
"""From how many branches on a kernel is compiled; below, the plain loop is faster than loading the compiler."""


def compiled(kernel: Callable[P, R], work: int) -> Callable[P, R]:
    """Return `kernel`, compiled if `work` (about the number of branches) is worth it."""
    return _jitted(kernel) if is_compiled(work) else kernel


def is_compiled(work: int) -> bool:
    """Return whether kernels are compiled for that much work."""
    wish = os.environ.get("RATHERTHAN_COMPILE", "auto")
    if wish == "never" or os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return False
    return wish == "always" or work >= LEAST_WORK


@cache
def _jitted(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Return the compiled kernel; what was compiled is kept on disk where the user may write."""
    keep = _cache_folder()
    import numba

    if keep is not None and not numba.config.CACHE_DIR:
        numba.config.CACHE_DIR = keep
    compiled_kernel: Callable[..., Any] = numba.njit(cache=keep is not None, nogil=True)(kernel)
    return compiled_kernel


@cache
def _cache_folder() -> str | None:
    """Return the folder for compiled code, None where none can be written."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return given
    from platformdirs import user_cache_path

    folder = user_cache_path("ratherthan") / "compiled"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = Path(folder, f".probe-{os.getpid()}")
        probe.touch()
        probe.unlink()
    except OSError:
        return None
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    return str(folder)


def spread_any(
    entering_from: Ints, entering: Ints, choice_state: Ints, allowed: Bools, level: Ints, queue: Ints, filled: int
) -> int:
    """Breadth-first search backwards: a state is reached by *one* allowed choice with a branch to a reached state.

    `level` holds the levels of the first `filled` states of `queue`, -1 where a state may be reached and -2 where it may
    not. It leaves with the distance of every reached state. Returns how many states are in `queue`, in breadth-first order.
    """
    head = 0
    while head < filled:
        state = queue[head]
        head += 1
        for i in range(entering_from[state], entering_from[state + 1]):
            choice = entering[i]
            if allowed[choice]:
                before = choice_state[choice]
                if level[before] == -1:
                    level[before] = level[state] + 1
                    queue[filled] = before
                    filled += 1
    return filled


def spread_all(
    entering_from: Ints, entering: Ints, choice_state: Ints, allowed: Bools, remaining: Ints, queue: Ints, filled: int
) -> int:
    """Spread backwards: a state is reached when *all* its allowed choices have a branch to a reached state.

    `remaining` counts the allowed choices of each state (0 or less: it is never reached). Choices with a branch to a
    reached state leave with ``allowed`` False and are counted off. Returns how many states are in `queue`.
    """
    head = 0
    while head < filled:
        state = queue[head]
        head += 1
        for i in range(entering_from[state], entering_from[state + 1]):
            choice = entering[i]
            if allowed[choice]:
                allowed[choice] = False
                before = choice_state[choice]
                remaining[before] -= 1
                if remaining[before] == 0:
                    queue[filled] = before
                    filled += 1
    return filled


def strong_components(
    state_to_choices: Ints,
    choice_to_branches: Ints,
    branch_to_target: Ints,
    allowed: Bools,
    roots: Ints,
    inside: Bools,
    component: Ints,
    first: int,
) -> int:
    """Number the strong components of the graph of allowed choices among the states `inside`, from `first` on.

    Tarjan's algorithm without recursion, started from `roots` in turn; a component is numbered after all those it leads
    to. A state's `component` must be below 0 where it is still to be numbered. Returns the next free number.
    """
    states = len(inside)
    order = np.zeros(states, np.int64)  # when a state was first seen, from 1
    low = np.zeros(states, np.int64)
    waiting = np.zeros(states, np.int64)  # Tarjan's stack
    path = np.zeros(states, np.int64)  # the states of the search's path, and where each goes on
    next_choice = np.zeros(states, np.int64)
    next_branch = np.zeros(states, np.int64)
    seen = 0
    waits = 0
    for root in roots:
        if not inside[root] or order[root] != 0 or component[root] >= 0:
            continue
        depth = 0
        path[0] = root
        seen += 1
        order[root] = low[root] = seen
        waiting[waits] = root
        waits += 1
        next_choice[root] = state_to_choices[root]
        next_branch[root] = -1
        while depth >= 0:
            state = path[depth]
            choice = next_choice[state]
            if choice < state_to_choices[state + 1]:
                branch = next_branch[state]
                if branch == -1:
                    branch = choice_to_branches[choice]
                if not allowed[choice] or branch >= choice_to_branches[choice + 1]:
                    next_choice[state] = choice + 1
                    next_branch[state] = -1
                    continue
                next_branch[state] = branch + 1
                after = branch_to_target[branch]
                if not inside[after] or component[after] >= 0:
                    continue
                if order[after] == 0:
                    seen += 1
                    order[after] = low[after] = seen
                    waiting[waits] = after
                    waits += 1
                    next_choice[after] = state_to_choices[after]
                    next_branch[after] = -1
                    depth += 1
                    path[depth] = after
                elif order[after] < low[state]:
                    low[state] = order[after]
                continue
            if low[state] == order[state]:
                while True:
                    waits -= 1
                    member = waiting[waits]
                    component[member] = first
                    if member == state:
                        break
                first += 1
            depth -= 1
            if depth >= 0 and low[state] < low[path[depth]]:
                low[path[depth]] = low[state]
    return first

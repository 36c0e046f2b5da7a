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
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Ints

__all__ = [
    "LEAST_WORK",
    "compiled",
    "dominator_order",
    "is_compiled",
    "reversed_rows",
    "sorted_by",
    "spread_all",
    "spread_any",
    "strong_components",
    "unfold",
]

Numbers = npt.NDArray[np.int32]
Offsets = npt.NDArray[np.int64]
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


def sorted_by(target: Ints, value: Ints, count: int) -> tuple[Offsets, Ints]:
    """Return `value` sorted by `target`, 0 … count-1, and where each target's begin: by counting, equal ones in order."""
    begin = np.zeros(count + 1, np.int64)
    for i in range(len(target)):
        begin[target[i] + 1] += 1
    for s in range(count):
        begin[s + 1] += begin[s]
    free = begin[:-1].copy()
    values = np.empty_like(value)
    for i in range(len(target)):
        t = target[i]
        values[free[t]] = value[i]
        free[t] += 1
    return begin, values


def reversed_rows(leaving_from: Offsets, leaving: Numbers) -> tuple[Offsets, Numbers]:
    """Return the edges of a graph in compressed rows turned round, by counting."""
    states = len(leaving_from) - 1
    entering_from = np.zeros(states + 1, np.int64)
    for i in range(len(leaving)):
        entering_from[leaving[i] + 1] += 1
    for s in range(states):
        entering_from[s + 1] += entering_from[s]
    entering = np.zeros(len(leaving), np.int32)
    free = entering_from[:-1].copy()
    for s in range(states):
        for i in range(leaving_from[s], leaving_from[s + 1]):
            t = leaving[i]
            entering[free[t]] = s
            free[t] += 1
    return entering_from, entering


def dominator_order(
    leaving_from: Offsets, leaving: Numbers, entering_from: Offsets, entering: Numbers, root: int
) -> tuple[Numbers, Numbers, Numbers]:
    """Number the states that `root` leads to in preorder of their dominator tree (Semi-NCA).

    Returns the position of every state (-1 where `root` does not lead), the size of its subtree, and the states in order.
    All work arrays are in the numbers of a depth-first search, in which dominators come before what they dominate.
    """
    states = len(leaving_from) - 1
    number = np.full(states, -1, np.int32)
    vertex = np.zeros(states, np.int32)
    parent = np.zeros(states, np.int32)
    path = np.zeros(states, np.int32)
    onward = leaving_from[:-1].copy()
    number[root] = 0
    vertex[0] = root
    path[0] = root
    found, depth = 1, 0
    while depth >= 0:
        s = path[depth]
        i = onward[s]
        if i == leaving_from[s + 1]:
            depth -= 1
            continue
        onward[s] = i + 1
        t = leaving[i]
        if number[t] < 0:
            number[t] = found
            vertex[found] = t
            parent[found] = number[s]
            found += 1
            depth += 1
            path[depth] = t
    semi = np.arange(found).astype(np.int32)
    label = np.arange(found).astype(np.int32)
    above = parent[:found].copy()
    for k in range(1, found):
        w = found - k
        least = parent[w]
        v = vertex[w]
        for i in range(entering_from[v], entering_from[v + 1]):
            u = number[entering[i]]
            if u < 0:
                continue
            if u > w:  # linked already: the least semidominator on the way up, with compression
                depth = 0
                x = u
                while above[x] > w:
                    path[depth] = x
                    depth += 1
                    x = above[x]
                while depth > 0:
                    depth -= 1
                    x = path[depth]
                    y = above[x]
                    if semi[label[y]] < semi[label[x]]:
                        label[x] = label[y]
                    above[x] = above[y]
                u = semi[label[u]]
            least = min(least, u)
        semi[w] = least
    idom = parent[:found].copy()
    size = np.ones(found, np.int32)
    for w in range(1, found):
        x = idom[w]
        while x > semi[w]:
            x = idom[x]
        idom[w] = x
    for k in range(1, found):
        w = found - k
        size[idom[w]] += size[w]
    free = np.ones(found, np.int32)  # the next free position in each subtree
    place = np.zeros(found, np.int32)
    position = np.full(states, -1, np.int32)
    extent = np.zeros(states, np.int32)
    order = np.zeros(found, np.int32)
    for w in range(found):
        if w > 0:
            place[w] = free[idom[w]]
            free[idom[w]] += size[w]
            free[w] = place[w] + 1
        s = vertex[w]
        position[s] = place[w]
        extent[s] = size[w]
        order[place[w]] = s
    return position, extent, order


def unfold(
    state_to_choices: Ints,
    choice_to_branches: Ints,
    branch_to_target: Ints,
    letter: Offsets,
    after: Offsets,
    memory: Offsets,
    ended: Bools,
    most: int,
) -> tuple[Offsets, Offsets, Offsets]:
    """Number the pairs of a state and a memory that can be reached, in the order in which they are met.

    The first S pairs are the states with `memory` ``[S]``. Pairs are gone through by number, their choices and branches in
    order; a branch to a state leads to the memory ``after[memory, letter[state]]``. Where the memory has ended, each choice
    has one branch, to the pair itself. Returns the state and the memory of each pair, and the target of each branch, pair by
    pair; with more than `most` branches it stops and returns no pairs.
    """
    count = len(letter)
    size = 16
    while size < 4 * count:
        size *= 2
    place = np.full(size, -1, np.int64)  # a hash table of pairs, linear probing
    states = np.zeros(size // 2, np.int64)
    memories = np.zeros(size // 2, np.int64)
    targets = np.zeros(size, np.int64)
    for s in range(count):
        states[s] = s
        memories[s] = memory[s]
        i = (s * 31 + memory[s] * 2654435761) & (size - 1)
        while place[i] >= 0:
            i = (i + 1) & (size - 1)
        place[i] = s
    filled = 0
    pair = 0
    while pair < count:
        s = states[pair]
        m = memories[pair]
        for c in range(state_to_choices[s], state_to_choices[s + 1]):
            first = choice_to_branches[c]
            last = first + 1 if ended[m] else choice_to_branches[c + 1]
            if filled + last - first > most:
                return states[:0], memories[:0], targets[:0]
            while filled + last - first > len(targets):
                longer = np.zeros(2 * len(targets), np.int64)
                longer[:filled] = targets[:filled]
                targets = longer
            for b in range(first, last):
                if ended[m]:
                    targets[filled] = pair
                    filled += 1
                    continue
                t = branch_to_target[b]
                n = after[m, letter[t]]
                i = (t * 31 + n * 2654435761) & (size - 1)
                while place[i] >= 0 and (states[place[i]] != t or memories[place[i]] != n):
                    i = (i + 1) & (size - 1)
                if place[i] < 0:
                    place[i] = count
                    states[count] = t
                    memories[count] = n
                    count += 1
                targets[filled] = place[i]
                filled += 1
                if 2 * count >= size:  # twice the room for everything, and all pairs placed anew
                    size *= 2
                    more_states = np.zeros(size // 2, np.int64)
                    more_states[:count] = states[:count]
                    states = more_states
                    more_memories = np.zeros(size // 2, np.int64)
                    more_memories[:count] = memories[:count]
                    memories = more_memories
                    place = np.full(size, -1, np.int64)
                    for p in range(count):
                        i = (states[p] * 31 + memories[p] * 2654435761) & (size - 1)
                        while place[i] >= 0:
                            i = (i + 1) & (size - 1)
                        place[i] = p
        pair += 1
    return states[:count].copy(), memories[:count].copy(), targets[:filled].copy()

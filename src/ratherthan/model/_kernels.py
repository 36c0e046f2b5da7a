"""Arrays of a graph enter, marks and numbers of states leave: the loops that numpy cannot do in one stroke.

Every kernel is a plain function over arrays. `compiled` hands it out as it stands for little work and as machine code for much,
see `ratherthan.model.compiling`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model.compiling import LEAST_WORK, compiled, is_compiled
from ratherthan.model.mdp import Bools, Ints

__all__ = [
    "LEAST_WORK",
    "compiled",
    "end_components_of",
    "entering_choices",
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


def end_components_of(
    rows: tuple[Ints, Ints, Ints],
    back: tuple[Ints, Ints, Ints],
    usable: Bools,
    remaining: Ints,
    members: Ints,
    component: Ints,
) -> int:
    """Number the maximal end components of the `usable` choices from 0 on; returns how many there are.

    `rows` are state_to_choices, choice_to_branches and branch_to_target, `back` are choice_to_state, entering_from and entering;
    `remaining` counts the usable choices of each state, `members` lists the states that have one, and usable choices lead to such
    states only. `component` is -1 everywhere. Usable leave those with which a run stays.

    A part of the members that no usable choice leaves is split into its strong components (Tarjan, without recursion). Choices
    between these are struck, and states that have no other. A component that lost nothing is an end component; of one that did,
    what is left is a part to be split. So what was struck from a component is no matter to the others.
    """
    state_to_choices, choice_to_branches, branch_to_target = rows
    choice_to_state, entering_from, entering = back
    states, kind = len(component), entering.dtype
    part = np.full(states, -1, kind)  # where the part of each state begins in `members`
    found = np.zeros(states, kind)  # where its strong component will begin
    order = np.zeros(states, kind)  # when it was first seen, from 1; 0: not yet; -1: its component is known
    low = np.zeros(states, kind)
    next_choice = np.zeros(states, kind)
    next_branch = np.zeros(states, kind)
    count = len(members)
    waiting = np.zeros(count, kind)  # Tarjan's stack
    path = np.zeros(count, kind)
    split = np.zeros(count, kind)  # the members by component
    struck = np.zeros(count + 1, np.bool_)  # by where a component begins: whether it lost something
    ends = np.zeros(count + 1, kind)  # by where a part begins: where it ends
    parts = np.zeros(count + 1, kind)  # the parts to be split
    for i in range(count):
        part[members[i]] = 0
    ends[0] = count
    todo = 1 if count > 0 else 0
    number = 0
    while todo > 0:
        todo -= 1
        begin = parts[todo]
        end = ends[begin]
        for i in range(begin, end):
            order[members[i]] = 0
        filled, seen, waits = begin, 0, 0
        for i in range(begin, end):
            root = members[i]
            if order[root] != 0:
                continue
            seen += 1
            order[root] = low[root] = seen
            waiting[waits] = root
            waits += 1
            next_choice[root] = state_to_choices[root]
            next_branch[root] = -1
            path[0] = root
            depth = 0
            while depth >= 0:
                state = path[depth]
                choice = next_choice[state]
                if choice < state_to_choices[state + 1]:
                    branch = next_branch[state]
                    if branch == -1:
                        branch = choice_to_branches[choice]
                    if not usable[choice] or branch >= choice_to_branches[choice + 1]:
                        next_choice[state] = choice + 1
                        next_branch[state] = -1
                        continue
                    next_branch[state] = branch + 1
                    after = branch_to_target[branch]
                    if order[after] == 0:
                        seen += 1
                        order[after] = low[after] = seen
                        waiting[waits] = after
                        waits += 1
                        next_choice[after] = state_to_choices[after]
                        next_branch[after] = -1
                        depth += 1
                        path[depth] = after
                    elif 0 < order[after] < low[state]:
                        low[state] = order[after]
                    continue
                if low[state] == order[state]:
                    first = filled
                    while True:
                        waits -= 1
                        member = waiting[waits]
                        order[member] = -1
                        found[member] = first
                        split[filled] = member
                        filled += 1
                        if member == state:
                            break
                    ends[first] = filled
                    struck[first] = False
                depth -= 1
                if depth >= 0 and low[state] < low[path[depth]]:
                    low[path[depth]] = low[state]
        dead = 0  # `waiting` is empty again and serves as a queue of the states that are left without a choice
        for i in range(begin, end):
            member = split[i]
            members[i] = member
            part[member] = found[member]
        for i in range(begin, end):
            member = members[i]
            for choice in range(state_to_choices[member], state_to_choices[member + 1]):
                if not usable[choice]:
                    continue
                for branch in range(choice_to_branches[choice], choice_to_branches[choice + 1]):
                    if part[branch_to_target[branch]] != part[member]:
                        usable[choice] = False
                        struck[part[member]] = True
                        remaining[member] -= 1
                        if remaining[member] == 0:
                            waiting[dead] = member
                            dead += 1
                        break
        head = 0
        while head < dead:
            state = waiting[head]
            head += 1
            for i in range(entering_from[state], entering_from[state + 1]):
                choice = entering[i]
                if usable[choice]:
                    usable[choice] = False
                    before = choice_to_state[choice]
                    struck[part[before]] = True
                    remaining[before] -= 1
                    if remaining[before] == 0:
                        waiting[dead] = before
                        dead += 1
        first = begin
        while first < end:
            last, kept = ends[first], first
            if not struck[first]:
                for i in range(first, last):
                    component[members[i]] = number
                number += 1
            else:
                for i in range(first, last):
                    if remaining[members[i]] > 0:
                        members[kept] = members[i]
                        kept += 1
                if kept > first:
                    ends[first] = kept
                    parts[todo] = first
                    todo += 1
            first = last
    return number


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


def entering_choices(choice_to_branches: Ints, branch_to_target: Ints, states: int) -> tuple[Ints, Ints]:
    """Return the choices by where they lead, ascending for each state, and where each state's begin: by counting."""
    begin = np.zeros(
        states + 2, choice_to_branches.dtype
    )  # one place further on, so that counting up leaves it as it is wanted
    for b in range(len(branch_to_target)):
        begin[branch_to_target[b] + 2] += 1
    for s in range(2, states + 2):
        begin[s] += begin[s - 1]
    choices = np.empty(len(branch_to_target), choice_to_branches.dtype)
    for c in range(len(choice_to_branches) - 1):
        for b in range(choice_to_branches[c], choice_to_branches[c + 1]):
            t = branch_to_target[b] + 1
            choices[begin[t]] = c
            begin[t] += 1
    return begin[: states + 1], choices


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

"""Rows of a graph enter, what search trees hold leaves: the loops that numpy cannot do in one stroke."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats, Ints

__all__ = [
    "close_block",
    "condensed_rows",
    "depth_first_pieces",
    "followed_edges",
    "gather_block",
    "merge_sketches",
    "near_weights",
    "outside_roots",
    "piece_weights",
    "search_together",
    "strong_numbers",
]

Counts = npt.NDArray[np.int64]
Numbers = npt.NDArray[np.int32]
Words = npt.NDArray[np.uint64]

WORDS = 8
"""Words of 64 bits in a block of columns."""


def followed_edges(
    rows: tuple[Ints, Ints, Ints], leaf: Bools, nearer_target: Floats, nearer_origin: Floats
) -> tuple[Counts, Numbers]:
    """Return the edges that a search follows, each once: none from a leaf, none from a state to itself.

    `rows` are state_to_choices, choice_to_branches and branch_to_target. Where `nearer_target` is not empty, only branches
    from s to t with nearer_target[t] < nearer_origin[s] are followed.
    """
    state_to_choices, choice_to_branches, branch_to_target = rows
    states = len(state_to_choices) - 1
    toward = len(nearer_target) > 0
    leaving_from = np.zeros(states + 1, np.int64)
    leaving = np.empty(len(branch_to_target), np.int32)
    met = np.full(states, -1, np.int32)
    filled = 0
    for s in range(states):
        if not leaf[s]:
            for b in range(choice_to_branches[state_to_choices[s]], choice_to_branches[state_to_choices[s + 1]]):
                t = branch_to_target[b]
                if t != s and met[t] != s and not (toward and nearer_target[t] >= nearer_origin[s]):
                    met[t] = s
                    leaving[filled] = t
                    filled += 1
        leaving_from[s + 1] = filled
    return leaving_from, leaving[:filled].copy()


def depth_first_pieces(
    leaving_from: Counts, leaving: Numbers
) -> tuple[Numbers, Numbers, Numbers, Bools, Numbers, Counts, Numbers]:
    """Number the states of a graph whose edges all run both ways, depth first.

    Returns the number of each state, the states by number, and by number: the size of the subtree, whether nothing in the
    subtree leads past the parent, the number of the tree's root, and the children in rows.
    """
    states = len(leaving_from) - 1
    number = np.full(states, -1, np.int32)
    order = np.empty(states, np.int32)
    above = np.empty(states, np.int32)
    low = np.empty(states, np.int32)
    onward = leaving_from[:-1].copy()
    found = 0
    for root in range(states):
        if number[root] >= 0:
            continue
        number[root] = found
        order[found] = root
        above[found] = -1
        low[found] = found
        n = found
        found += 1
        while n >= 0:
            s = order[n]
            i = onward[s]
            if i < leaving_from[s + 1]:
                onward[s] = i + 1
                t = leaving[i]
                m = number[t]
                if m < 0:
                    number[t] = found
                    order[found] = t
                    above[found] = n
                    low[found] = found
                    n = found
                    found += 1
                elif m < low[n]:
                    low[n] = m
            else:
                p = above[n]
                if p >= 0 and low[n] < low[p]:
                    low[p] = low[n]
                n = p
    size, top = np.ones(states, np.int32), np.empty(states, np.int32)
    apart = np.zeros(states, np.bool_)
    children_from = np.zeros(states + 1, np.int64)
    for k in range(states):
        n = states - 1 - k
        p = above[n]
        if p >= 0:
            size[p] += size[n]
            apart[n] = low[n] >= p
            children_from[p + 1] += 1
    for n in range(states):
        children_from[n + 1] += children_from[n]
        top[n] = n if above[n] < 0 else top[above[n]]
    children = np.empty(children_from[states], np.int32)
    free = children_from[:-1].copy()
    for n in range(states):
        p = above[n]
        if p >= 0:
            children[free[p]] = n
            free[p] += 1
    return number, order, size, apart, top, children_from, children


def piece_weights(
    choices: Counts,
    states: Counts,
    rows: tuple[Ints, Ints],
    tree: tuple[Numbers, Numbers, Bools, Numbers, Counts, Numbers],
    certain: Counts,
    possible: Counts,
) -> tuple[Counts, Counts]:
    """Weigh what each of `choices`, of the `states`, leads to without its state, in a graph whose edges run both ways.

    `rows` are choice_to_branches and branch_to_target; `tree` is the number of each state and, by number: size, apart, the
    number of the tree's root, and the children in rows; `certain` and `possible` are prefix sums by number. What is left of a
    connected graph without a state are the subtrees that hang on it alone, and the rest.
    """
    choice_to_branches, branch_to_target = rows
    number, size, apart, top, children_from, children = tree
    lower, upper = np.zeros(len(choices), np.int64), np.zeros(len(choices), np.int64)
    mark = np.zeros(len(size), np.int64)
    at = -1
    rest_certain, rest_possible = 0, 0
    for i in range(len(choices)):
        s = states[i]
        n = number[s]
        if n != at:
            at = n
            first, last = top[n], top[n] + size[top[n]]
            rest_certain = certain[last] - certain[first] - certain[n + 1] + certain[n]
            rest_possible = possible[last] - possible[first] - possible[n + 1] + possible[n]
            for j in range(children_from[n], children_from[n + 1]):
                c = children[j]
                if apart[c]:
                    rest_certain -= certain[c + size[c]] - certain[c]
                    rest_possible -= possible[c + size[c]] - possible[c]
        for b in range(choice_to_branches[choices[i]], choice_to_branches[choices[i] + 1]):
            m = number[branch_to_target[b]]
            if m == n:
                continue
            piece, rest = top[m], False
            if top[n] == piece:
                rest = True
                if n < m < n + size[n]:
                    low, high = children_from[n], children_from[n + 1]
                    while high - low > 1:  # the last child that is not numbered after m
                        middle = (low + high) // 2
                        if children[middle] <= m:
                            low = middle
                        else:
                            high = middle
                    if apart[children[low]]:
                        piece, rest = children[low], False
            if mark[piece] == i + 1:
                continue
            mark[piece] = i + 1
            if rest:
                lower[i] += rest_certain
                upper[i] += rest_possible
            else:
                lower[i] += certain[piece + size[piece]] - certain[piece]
                upper[i] += possible[piece + size[piece]] - possible[piece]
    return lower, upper


def strong_numbers(leaving_from: Counts, leaving: Numbers) -> tuple[Numbers, int]:
    """Number the strong components of a graph, each after all those it leads to (Tarjan); return how many there are."""
    states = len(leaving_from) - 1
    component = np.full(states, -1, np.int32)
    low = np.zeros(states, np.int32)  # 0: not met
    path = np.empty(states, np.int32)
    waiting = np.empty(states, np.int32)
    onward = leaving_from[:-1].copy()
    met, waits, count = 0, 0, 0
    entered = np.zeros(states, np.int32)
    for root in range(states):
        if low[root] != 0:
            continue
        depth = 0
        path[0] = root
        met += 1
        low[root] = entered[root] = met
        waiting[waits] = root
        waits += 1
        while depth >= 0:
            s = path[depth]
            i = onward[s]
            if i < leaving_from[s + 1]:
                onward[s] = i + 1
                t = leaving[i]
                if low[t] == 0:
                    met += 1
                    low[t] = entered[t] = met
                    waiting[waits] = t
                    waits += 1
                    depth += 1
                    path[depth] = t
                elif component[t] < 0 and entered[t] < low[s]:
                    low[s] = entered[t]
                continue
            if low[s] == entered[s]:
                while True:
                    waits -= 1
                    member = waiting[waits]
                    component[member] = count
                    if member == s:
                        break
                count += 1
            depth -= 1
            if depth >= 0 and low[s] < low[path[depth]]:
                low[path[depth]] = low[s]
    return component, count


def condensed_rows(
    leaving_from: Counts, leaving: Numbers, component: Numbers, members_from: Counts, members: Numbers
) -> tuple[Counts, Numbers]:
    """Return the edges between strong components, each once."""
    count = len(members_from) - 1
    onward_from = np.zeros(count + 1, np.int64)
    onward = np.empty(len(leaving), np.int32)
    met = np.full(count, -1, np.int32)
    filled = 0
    for c in range(count):
        for j in range(members_from[c], members_from[c + 1]):
            s = members[j]
            for i in range(leaving_from[s], leaving_from[s + 1]):
                d = component[leaving[i]]
                if d != c and met[d] != c:
                    met[d] = c
                    onward[filled] = d
                    filled += 1
        onward_from[c + 1] = filled
    return onward_from, onward[:filled].copy()


def outside_roots(
    choices: Counts,
    states: Counts,
    rows: tuple[Ints, Ints, Counts, Numbers],
    component: Numbers,
    certain: Counts,
    possible: Counts,
    most: tuple[int, int],
    roots: Numbers,
) -> tuple[Bools, Counts, Counts, Counts]:
    """Split what each of `choices` leads to: what cannot come back to its state, as components, and the rest, searched.

    A component with a smaller number than that of the state never leads to it. Returns which choices could be split with at
    most so many visits and so many components, for all of which there is room in `roots`, the rows of the components there, and
    the weight of what was searched.
    """
    choice_to_branches, branch_to_target, leaving_from, leaving = rows
    split = np.zeros(len(choices), np.bool_)
    roots_from = np.zeros(len(choices) + 1, np.int64)
    lower, upper = np.zeros(len(choices), np.int64), np.zeros(len(choices), np.int64)
    mark = np.full(len(component), -1, np.int64)
    taken = np.full(len(component), -1, np.int64)
    most_visits, most_roots = most
    queue = np.empty(most_visits, np.int32)
    filled = 0
    for i in range(len(choices)):
        s = states[i]
        ending = leaving_from[s] == leaving_from[s + 1] and possible[s] == 0  # taking it out changes nothing
        begin, full, head, tail = filled, False, 0, 0
        mark[s] = i
        b, e, stop = choice_to_branches[choices[i]], 0, 0
        last = choice_to_branches[choices[i] + 1]
        while not full:
            if b < last:
                t = branch_to_target[b]
                b += 1
            elif e < stop:
                t = leaving[e]
                e += 1
            elif head < tail:
                u = queue[head]
                head += 1
                e, stop = leaving_from[u], leaving_from[u + 1]
                lower[i] += certain[u]
                upper[i] += possible[u]
                continue
            else:
                break
            if mark[t] == i:
                continue
            mark[t] = i
            c = component[t]
            if ending or c < component[s]:
                if taken[c] == i:
                    continue
                taken[c] = i
                full = filled - begin == most_roots
                if not full:
                    roots[filled] = c
                    filled += 1
            else:
                full = tail == most_visits
                if not full:
                    queue[tail] = t
                    tail += 1
        if full:
            filled = begin
        split[i] = not full
        roots_from[i + 1] = filled
    return split, roots_from, lower, upper


def close_block(onward_from: Counts, onward: Numbers, column: Numbers, first: int, bits: Words, reaches: Bools) -> None:
    """Find which columns of a block each component leads to: by one pass over the components from `first` on.

    `column` is the column of each component in this block, -1 where it has none; `bits` and `reaches` leave with the columns
    as bits, and whether there are any; both hold for components from `first` on.
    """
    one = np.uint64(1)
    for c in range(first, len(column)):
        some = False
        for i in range(onward_from[c], onward_from[c + 1]):
            d = onward[i]
            if d >= first and reaches[d]:
                if some:
                    for w in range(WORDS):
                        bits[c, w] |= bits[d, w]
                else:
                    some = True
                    for w in range(WORDS):
                        bits[c, w] = bits[d, w]
        k = column[c]
        if k >= 0:
            if not some:
                some = True
                for w in range(WORDS):
                    bits[c, w] = np.uint64(0)
            bits[c, k >> 6] |= one << np.uint64(k & 63)
        reaches[c] = some


def gather_block(
    roots_from: Counts,
    roots: Numbers,
    first: int,
    bits: Words,
    reaches: Bools,
    classes: tuple[Words, Counts, Counts],
    found: tuple[Counts, Counts],
) -> None:
    """Add the weight of the columns of a block that the roots of each choice lead to.

    `classes` are sets of columns with what each of their columns adds to the certain and the possible weight.
    """
    masks, certain, possible = classes
    lower, upper = found
    ones, twos = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
    fours, byte = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0x00FF00FF00FF00FF)
    one, two, four, eight = np.uint64(1), np.uint64(2), np.uint64(4), np.uint64(8)
    sixteen, half, low = np.uint64(16), np.uint64(32), np.uint64(0xFFFF)
    all_of = np.zeros(WORDS, np.uint64)
    for i in range(len(roots_from) - 1):
        some = False
        for j in range(roots_from[i], roots_from[i + 1]):
            c = roots[j]
            if c >= first and reaches[c]:
                if some:
                    for w in range(WORDS):
                        all_of[w] |= bits[c, w]
                else:
                    some = True
                    for w in range(WORDS):
                        all_of[w] = bits[c, w]
        if not some:
            continue
        for k in range(len(certain)):
            sums = np.uint64(0)
            for w in range(WORDS):  # the ones of each byte, at most 8, of all words: at most 64
                x = all_of[w] & masks[k, w]
                x -= (x >> one) & ones
                x = (x & twos) + ((x >> two) & twos)
                sums += (x + (x >> four)) & fours
            sums = (sums & byte) + ((sums >> eight) & byte)
            sums += sums >> sixteen
            count = np.int64((sums + (sums >> half)) & low)
            lower[i] += count * certain[k]
            upper[i] += count * possible[k]


def search_together(
    choices: Counts,
    states: Counts,
    rows: tuple[Ints, Ints, Counts, Numbers],
    parts: tuple[Numbers, Counts, Numbers],
    weights: tuple[Counts, Counts, bool],
    room: tuple[Words, Numbers, Numbers, Numbers, Bools],
    found: tuple[Counts, Counts],
) -> int:
    """Search from up to 512 choices at once, a bit for each: what they share is visited once for all of them.

    `parts` are the component of each state and the members of each component, in rows; `weights` end with whether both are the
    same. `room` is clear before and after: the bits of each state, a list of states, a queue, a number per state (-1), and two
    marks per state and component. Adds the weights to `found`; returns how often a state was looked at.
    """
    choice_to_branches, branch_to_target, leaving_from, leaving = rows
    component, members_from, members = parts
    certain, possible, same = weights
    bits, visited, queue, slot, marks = room
    lower, upper = found
    count = len(component)
    zero, one = np.uint64(0), np.uint64(1)
    kept_out = np.zeros((len(choices), WORDS), np.uint64)  # by slot: the choices of a state, which never return to it
    fresh = np.zeros(WORDS, np.uint64)
    slots, filled, highest, looked = 0, 0, -1, 0
    for i in range(len(choices)):
        s = states[i]
        if slot[s] < 0:
            slot[s] = slots
            slots += 1
        kept_out[slot[s], i >> 6] |= one << np.uint64(i & 63)
        for b in range(choice_to_branches[choices[i]], choice_to_branches[choices[i] + 1]):
            t = branch_to_target[b]
            if t == s:
                continue
            if not marks[t]:
                marks[t] = True
                visited[filled] = t
                filled += 1
            marks[count + t] = True
            bits[t, i >> 6] |= one << np.uint64(i & 63)
            c = component[t]
            marks[2 * count + c] = True
            highest = max(highest, c)
    for c in range(highest, -1, -1):
        if not marks[2 * count + c]:
            continue
        marks[2 * count + c] = False
        begin, size = members_from[c], members_from[c + 1] - members_from[c]
        head, waits = 0, 0
        for j in range(begin, begin + size):
            if marks[count + members[j]]:
                queue[waits] = members[j]
                waits += 1
        while waits > 0:
            v = queue[head]
            head = head + 1 if head + 1 < size else 0
            waits -= 1
            marks[count + v] = False
            looked += 1
            for e in range(leaving_from[v], leaving_from[v + 1]):
                t = leaving[e]
                some = zero
                if slot[t] < 0:
                    for w in range(WORDS):
                        fresh[w] = bits[v, w] & ~bits[t, w]
                        some |= fresh[w]
                else:
                    for w in range(WORDS):
                        fresh[w] = bits[v, w] & ~bits[t, w] & ~kept_out[slot[t], w]
                        some |= fresh[w]
                if some == zero:
                    continue
                for w in range(WORDS):
                    bits[t, w] |= fresh[w]
                if not marks[t]:
                    marks[t] = True
                    visited[filled] = t
                    filled += 1
                d = component[t]
                if not marks[count + t]:
                    marks[count + t] = True
                    if d == c:
                        place = head + waits
                        queue[place if place < size else place - size] = t
                        waits += 1
                marks[2 * count + d] = d != c
    sums = np.zeros((2, 64, WORDS), np.uint64)  # by binary digit: a sum for every bit
    for j in range(filled):
        v = visited[j]
        for k in range(1 if same else 2):
            weight, digit = certain[v] if k == 0 else possible[v], 0
            while weight > 0:
                if weight & 1:
                    for w in range(WORDS):
                        carry, p = bits[v, w], digit
                        while carry != zero:
                            over = sums[k, p, w] & carry
                            sums[k, p, w] ^= carry
                            carry = over
                            p += 1
                weight >>= 1
                digit += 1
        marks[v] = False
        for w in range(WORDS):
            bits[v, w] = zero
    for i in range(len(choices)):
        slot[states[i]] = -1
        w, bit = i >> 6, np.uint64(i & 63)
        for p in range(63):
            lower[i] += np.int64((sums[0, p, w] >> bit) & one) << p
            upper[i] += np.int64((sums[0 if same else 1, p, w] >> bit) & one) << p
    return looked


def near_weights(
    choices: Counts,
    states: Counts,
    rows: tuple[Ints, Ints, Counts, Numbers],
    certain: Counts,
    possible: Counts,
    room: tuple[Counts, Numbers, int],
    horizon: int,
    budget: int,
) -> tuple[Counts, Counts, int, int]:
    """Weigh what each of `choices` leads to within `horizon` further steps, never entering its state.

    `room` is a mark per state, a queue for all states and the stamp of the first choice. Returns the weights, how many choices were weighed before `budget` visits were spent, and how many were.
    """
    choice_to_branches, branch_to_target, leaving_from, leaving = rows
    mark, queue, stamp = room
    lower, upper = np.zeros(len(choices), np.int64), np.zeros(len(choices), np.int64)
    spent = 0
    for i in range(len(choices)):
        if spent > budget:
            return lower, upper, i, spent
        now = stamp + i
        mark[states[i]] = now
        filled, head, steps = 0, 0, 0
        for b in range(choice_to_branches[choices[i]], choice_to_branches[choices[i] + 1]):
            t = branch_to_target[b]
            if mark[t] != now:
                mark[t] = now
                queue[filled] = t
                filled += 1
        layer = filled
        while head < filled and steps < horizon:
            u = queue[head]
            head += 1
            for e in range(leaving_from[u], leaving_from[u + 1]):
                t = leaving[e]
                if mark[t] != now:
                    mark[t] = now
                    queue[filled] = t
                    filled += 1
            if head == layer:
                layer = filled
                steps += 1
        for j in range(filled):
            lower[i] += certain[queue[j]]
            upper[i] += possible[queue[j]]
        spent += filled + 1
    return lower, upper, len(choices), spent


def merge_sketches(
    rows: tuple[Counts, Numbers],
    own: tuple[Counts, Numbers],
    known: tuple[Numbers, Numbers],
    made: tuple[Numbers, Numbers],
) -> None:
    """Keep the smallest ranks of all units that each row leads to, its own included, in ascending order.

    `rows` are the sketches that each row joins, `own` the ranks of its own units, ascending, in rows; `known` and `made` are
    sketches with the number of ranks they hold. Where both are the same, a row joins smaller rows only.
    """
    joined_from, joined = rows
    units_from, units = own
    sketch, held = known
    made_sketch, made_held = made
    most = sketch.shape[1]
    room = np.empty(most, np.int32)
    for r in range(len(joined_from) - 1):
        filled = min(most, units_from[r + 1] - units_from[r])
        for j in range(filled):
            made_sketch[r, j] = units[units_from[r] + j]
        for i in range(joined_from[r], joined_from[r + 1]):
            d = joined[i]
            a, b, n = 0, 0, 0
            while n < most and (a < filled or b < held[d]):
                if b == held[d] or (a < filled and made_sketch[r, a] < sketch[d, b]):
                    room[n] = made_sketch[r, a]
                    a += 1
                else:
                    if a < filled and made_sketch[r, a] == sketch[d, b]:
                        a += 1
                    room[n] = sketch[d, b]
                    b += 1
                n += 1
            filled = n
            for j in range(n):
                made_sketch[r, j] = room[j]
        made_held[r] = filled

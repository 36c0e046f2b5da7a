"""A model and a route enter, how much worse the best alternative of each step is without turning back leaves: a search for each.

`ratherthan.explain.detour` says what is computed. All numbers are costs here: what is wanted large comes with its sign turned.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats, Ints

__all__ = ["Effort", "Rows", "Way", "Wish", "detours", "first_touched"]

Numbers = npt.NDArray[np.int64]


class Rows(NamedTuple):
    """The model."""

    state_to_choices: Ints  # [S+1]
    choice_to_branches: Ints  # [C+1]
    target: Ints  # [B]
    probability: Floats  # [B]


class Wish(NamedTuple):
    """A level of the objective, as a cost to be kept small.

    `never` is what it comes to never to arrive; where `waits`, it is no loss to stay where one is. `open` are the choices that
    may be taken, none where all may.
    """

    paid: Floats  # [C], or none where nothing is paid
    best: Floats  # [S]
    open: Bools  # [C]
    discount: float
    never: float
    waits: bool
    counts_up: bool  # whether values are found from `never` on, else from `best`


class Way(NamedTuple):
    """A route: the states and choices, where each state stands first on it (S where nowhere), and what the plan still touches of it."""

    states: Numbers  # [L]
    choices: Numbers  # [L]
    wanted: Bools  # [L]
    stands: Numbers  # [S]
    touches: Numbers  # [S]: the first place of the route that the plan may come to from a state, S where to none


class Effort(NamedTuple):
    """How many branches may be looked at for each step at first, for each that is looked at again, and in all."""

    first: int
    again: int
    total: int


def first_touched(first: Numbers, origin: Numbers, route: Numbers) -> Numbers:
    """Return for each state the first place of the route that can be reached from it; S where none can.

    The edges that lead to state s begin in ``origin[first[s]:first[s + 1]]``.
    """
    states = len(first) - 1
    found = np.full(states, states, np.int64)
    waiting = np.empty(states, np.int64)
    for place in range(len(route)):
        if found[route[place]] <= place:
            continue
        found[route[place]] = place
        waiting[0] = route[place]
        count = 1
        while count > 0:
            count -= 1
            state = waiting[count]
            for edge in range(first[state], first[state + 1]):
                before = origin[edge]
                if found[before] == states:
                    found[before] = place
                    waiting[count] = before
                    count += 1
    return found


def detours(rows: Rows, wish: Wish, way: Way, effort: Effort) -> tuple[Floats, Bools]:
    """Return for each wanted step what the best alternative comes to at least, and whether it comes to just that."""
    steps, states = len(way.states), len(way.stands)
    value, settled = np.full(steps, np.inf), np.zeros(steps, np.bool_)
    number, members = np.full(states, -1, np.int64), np.empty(states + 1, np.int64)
    worth, taken, waiting = np.empty(states + 1), np.empty(states + 1, np.int64), np.empty(states + 1, np.int64)
    alive, reached = np.zeros(states + 1, np.bool_), np.zeros(states + 1, np.bool_)
    left, hard = effort.total, wish.never == np.inf and wish.discount == 1.0
    for turn in range(2):
        for at in range(steps):
            if not way.wanted[at] or settled[at]:
                continue
            most = min(effort.first if turn == 0 else effort.again, left)
            if turn == 1 and most <= effort.first:
                break
            spent, count = 0, 1
            members[0] = way.states[at]
            if turn == 1 and not wish.waits and wish.discount == 1.0:
                # A large part of the model is closed in: does anything at all lead out of it?
                done, leads_on = 0, False
                while done < count and not leads_on and spent < most:
                    x = members[done]
                    for choice in range(rows.state_to_choices[x], rows.state_to_choices[x + 1]):
                        if (done == 0 and choice == way.choices[at]) or (len(wish.open) > 0 and not wish.open[choice]):
                            continue
                        for b in range(rows.choice_to_branches[choice], rows.choice_to_branches[choice + 1]):
                            t = rows.target[b]
                            spent += 1
                            if way.stands[t] <= at:
                                continue
                            if way.touches[t] > at:
                                leads_on = leads_on or wish.best[t] < np.inf
                            elif number[t] < 0:
                                number[t] = count
                                members[count] = t
                                count += 1
                    done += 1
                closed_in = done == count and not leads_on
                for k in range(1, count):
                    number[members[k]] = -1
                count = 1
                if closed_in:
                    value[at], settled[at] = wish.never, True
                    left -= spent
                    continue
            worth[0] = wish.never if wish.counts_up else wish.best[members[0]]
            while True:
                # Where nothing leads out any more: what is not looked at counts as a way out.
                for k in range(count):
                    alive[k] = True
                changed = hard
                while changed and spent < most:
                    for k in range(count):
                        reached[k] = False
                    found = True
                    while found:
                        found = False
                        for j in range(count):
                            k = count - 1 - j
                            if reached[k] or not alive[k]:
                                continue
                            x = members[k]
                            for choice in range(rows.state_to_choices[x], rows.state_to_choices[x + 1]):
                                if (k == 0 and choice == way.choices[at]) or (
                                    len(wish.open) > 0 and not wish.open[choice]
                                ):
                                    continue
                                first, last = rows.choice_to_branches[choice], rows.choice_to_branches[choice + 1]
                                spent += last - first
                                good, out = True, False
                                for b in range(first, last):
                                    t = rows.target[b]
                                    if t == x:
                                        continue
                                    if way.stands[t] <= at:
                                        if wish.best[t] == np.inf:
                                            good = False
                                    elif way.touches[t] > at or number[t] < 0:
                                        if wish.best[t] == np.inf:
                                            good = False
                                        out = True
                                    else:
                                        if not alive[number[t]]:
                                            good = False
                                        if reached[number[t]]:
                                            out = True
                                if good and out:
                                    reached[k] = True
                                    found = True
                                    break
                    changed = False
                    for k in range(count):
                        if alive[k] and not reached[k]:
                            alive[k] = False
                            changed = True
                # Sweeps, from far to near and back, until nothing changes.
                if wish.counts_up:
                    for k in range(count):
                        worth[k], taken[k] = wish.never, -1
                resting, sweep = False, 0
                while not resting and (spent < most or sweep < 2):
                    resting = True
                    for j in range(count):
                        k = count - 1 - j if sweep % 2 == 0 else j
                        x, before = members[k], worth[k]
                        low, best = np.inf, -1
                        if alive[k]:
                            for choice in range(rows.state_to_choices[x], rows.state_to_choices[x + 1]):
                                if (k == 0 and choice == way.choices[at]) or (
                                    len(wish.open) > 0 and not wish.open[choice]
                                ):
                                    continue
                                first, last = rows.choice_to_branches[choice], rows.choice_to_branches[choice + 1]
                                spent += last - first
                                total, stay = 0.0, 0.0
                                for b in range(first, last):
                                    t, p = rows.target[b], rows.probability[b]
                                    if t == x:
                                        stay += p
                                        continue
                                    if way.stands[t] <= at:
                                        near = wish.best[t]
                                        if near <= before:
                                            stay += p
                                            continue
                                    elif way.touches[t] > at or number[t] < 0:
                                        near = wish.best[t]
                                    else:
                                        near = worth[number[t]]
                                    if near == np.inf:
                                        total = np.inf
                                    elif total < np.inf:
                                        total += p * near
                                paid = wish.paid[choice] if len(wish.paid) > 0 else 0.0
                                if stay >= 1.0 - 1e-12 and wish.discount == 1.0:
                                    own = before if wish.waits else wish.never
                                else:
                                    own = (paid + wish.discount * total) / (1.0 - wish.discount * stay)
                                if own < low or best < 0:
                                    low, best = own, choice
                        if not wish.counts_up or taken[k] < 0 or low < before - 1e-13 * abs(low):
                            taken[k] = best  # of equal choices that which came to it first: others may go round
                        worth[k] = low
                        if low != before and not abs(low - before) <= 1e-13 * abs(low):
                            resting = False
                    sweep += 1
                value[at] = worth[0]
                # What the best choices lead to, and was not looked at yet.
                for k in range(count):
                    reached[k] = False
                reached[0] = True
                waiting[0] = 0
                done, filled, fringe = 0, 1, count
                while done < filled:
                    choice = taken[waiting[done]]
                    done += 1
                    if choice < 0:
                        continue
                    for b in range(rows.choice_to_branches[choice], rows.choice_to_branches[choice + 1]):
                        t = rows.target[b]
                        if way.stands[t] <= at or way.touches[t] > at:
                            continue
                        if number[t] < 0:
                            number[t] = fringe
                            members[fringe] = t
                            fringe += 1
                        elif number[t] < count and not reached[number[t]]:
                            reached[number[t]] = True
                            waiting[filled] = number[t]
                            filled += 1
                if fringe == count or worth[0] == np.inf:
                    # It is that, unless the best choices go round for nothing.
                    sure = resting
                    if sure and hard and worth[0] < np.inf:
                        for k in range(filled):
                            alive[waiting[k]] = False
                        found = True
                        while found:
                            found = False
                            for j in range(filled):
                                k = waiting[filled - 1 - j]
                                if alive[k]:
                                    continue
                                x = members[k]
                                for b in range(
                                    rows.choice_to_branches[taken[k]], rows.choice_to_branches[taken[k] + 1]
                                ):
                                    t = rows.target[b]
                                    if t != x and way.stands[t] > at and (way.touches[t] > at or alive[number[t]]):
                                        alive[k] = True
                                        found = True
                                        break
                        for k in range(filled):
                            if not alive[waiting[k]]:
                                sure = False
                    settled[at] = sure
                    for k in range(count, fringe):
                        number[members[k]] = -1
                    break
                if spent >= most:
                    for k in range(count, fringe):
                        number[members[k]] = -1
                    break
                # These are looked at next, and what lies around them: half as much again as before.
                goal, done = count + max(fringe - count, count // 2 + 8), count
                while done < fringe < goal:
                    x = members[done]
                    done += 1
                    for b in range(
                        rows.choice_to_branches[rows.state_to_choices[x]],
                        rows.choice_to_branches[rows.state_to_choices[x + 1]],
                    ):
                        t = rows.target[b]
                        spent += 1
                        if way.stands[t] > at and way.touches[t] <= at and number[t] < 0:
                            number[t] = fringe
                            members[fringe] = t
                            fringe += 1
                for k in range(count, fringe):
                    worth[k] = wish.best[members[k]]
                count = fringe
            left -= spent
            for k in range(1, count):
                number[members[k]] = -1
    return value, settled

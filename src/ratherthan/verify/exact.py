"""A small frame enters, its optimum or the value of a policy leaves as exact fractions: nothing is rounded, all is decided.

Method
------
Policy iteration (Howard 1960) in rational arithmetic. A policy that is absorbed with probability 1 is evaluated by eliminating
one state after the other from x = c + P x; then every state takes a choice that is strictly better for these values, until
there is none. Each round is strictly better and there are finitely many policies, so it ends, with x = T x.

That this is the optimum: a strict improvement stays absorbed with probability 1. For in a set of states R that the improved
policy never leaves, x ≥ r + P x when minimising (≤ when maximising), strictly where it changed; the mean over the stationary
distribution of R gives 0 ≥ mean r, strictly where it changed, against r ≥ 0 (r = 0 when maximising a probability); and where
nothing changed, the policy before would have had R. At the end, x = T x is the value of a policy; x ≤ T x bounds the cost of
every policy that arrives from below, x ≥ T x with x ≥ 0 bounds every probability and cost from above.

Where rewards have both signs and arrival is demanded, the same R proves that more and more can be gathered: going round in R
pays mean r > 0 per step (< 0 when minimising), and from R the target can still be reached for sure. So the value is ∞ (-∞)
wherever R can be reached; these states are set aside, and the rest, which cannot get there, goes on. At the end x = T x bounds
every policy that arrives. With a discount every policy is absorbed.

The probabilities of a choice are its doubles, taken as fractions and divided by their sum.

References
----------
D. P. Bertsekas, J. N. Tsitsiklis, An Analysis of Stochastic Shortest Path Problems, Math. Oper. Res. 16(3), 1991.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction

from ratherthan.model.mdp import Bools, Floats
from ratherthan.verify.frame import Array, Frame

__all__ = ["Row", "best_exactly", "eliminate", "followed_exactly", "row_of"]

Row = tuple[Fraction, dict[int, Fraction]]
"""What a choice costs, and its successors with their probabilities."""


def row_of(frame: Frame, choice: int) -> Row:
    """Return a choice as exact fractions."""
    mdp, branches = frame.mdp, frame.mdp.branches_of(choice)
    chances = [Fraction(float(p)) for p in mdp.branch_to_probability[branches]]
    total = sum(chances)
    spread: dict[int, Fraction] = {}
    for target, chance in zip(mdp.branch_to_target[branches], chances, strict=True):
        spread[int(target)] = spread.get(int(target), Fraction(0)) + chance / total
    if frame.endless:
        spread = {target: Fraction(frame.discount) * onward for target, onward in spread.items()}
    return Fraction(0) if frame.prices is None else frame.prices.exactly(choice), spread


def eliminate(rows: Mapping[int, Row]) -> dict[int, Fraction]:
    """Return the solution of x = c + P x, one row per unknown; every run must leave the unknowns with probability 1."""
    left = {state: (cost, dict(spread)) for state, (cost, spread) in rows.items()}
    users: dict[int, set[int]] = {state: set() for state in left}
    for state, (_, spread) in left.items():
        for target in spread:
            users[target].add(state)
    solved: list[tuple[int, Row]] = []
    while left:
        state = min(left, key=lambda s: (len(left[s][1]) * len(users[s]), s))
        cost, spread = left.pop(state)
        away = 1 - spread.pop(state, Fraction(0))
        cost, spread = cost / away, {target: chance / away for target, chance in spread.items()}
        for target in spread:
            users[target].discard(state)
        for user in users.pop(state) - {state}:
            user_cost, user_spread = left[user]
            chance = user_spread.pop(state)
            for target, onward in spread.items():
                user_spread[target] = user_spread.get(target, Fraction(0)) + chance * onward
                users[target].add(user)
            left[user] = (user_cost + chance * cost, user_spread)
        solved.append((state, (cost, spread)))
    values: dict[int, Fraction] = {}
    for state, (cost, spread) in reversed(solved):
        values[state] = cost + sum((chance * values[target] for target, chance in spread.items()), Fraction(0))
    return values


def _settled(row: Row, known: Floats, unknown: Collection[int]) -> Row:
    """Return a row in which everything but the unknowns has its value."""
    cost = row[0] + sum((p * int(known[t]) for t, p in row[1].items() if t not in unknown), Fraction(0))
    return cost, {target: chance for target, chance in row[1].items() if target in unknown}


def best_exactly(frame: Frame, unknown: Array, rows: Bools, known: Floats, first: Array) -> dict[int, Fraction | None]:
    """Return the optimum in the unknown states, None where more and more can be gathered.

    Parameters
    ----------
    frame : Frame
    unknown : array of int
        The states whose value is wanted.
    rows : array of bool, ``[C]``
        The choices among which the optimum is.
    known : array of float, ``[S]``
        The values of the other states that these choices lead to: 0 or 1.
    first : array of int, ``[S]``
        A choice for each unknown state: a policy that is absorbed with probability 1.
    """
    states = set(map(int, unknown))
    offers = {s: {c: row_of(frame, c) for c in frame.mdp.choices_of(s) if rows[c]} for s in states}
    settled = {s: {c: _settled(row, known, states) for c, row in offer.items()} for s, offer in offers.items()}
    endless: dict[int, Fraction | None] = {}
    taken = {s: int(first[s]) for s in states}
    while True:
        found = eliminate({s: settled[s][taken[s]] for s in states})
        better = {s: _better(settled[s], taken[s], found, maximise=frame.maximise) for s in states}
        if better == taken:
            return endless | found
        taken = better
        if frame.demanding:
            growing = _never_leaving({s: settled[s][taken[s]] for s in states})
            gathering = _leading(growing, {s: {t for _, row in settled[s].values() for t in row} for s in states})
            endless |= dict.fromkeys(gathering)
            states -= gathering


def _never_leaving(rows: Mapping[int, Row]) -> set[int]:
    """Return the states from which a policy, one row per state, never leaves the states at all."""
    leaving = {s for s, (_, spread) in rows.items() if sum(spread.values(), Fraction(0)) < 1}
    return set(rows) - _leading(leaving, {s: set(spread) for s, (_, spread) in rows.items()})


def _leading(to: set[int], onward: Mapping[int, set[int]]) -> set[int]:
    """Return the states from which some state of `to` can be reached."""
    found = set(to)
    while True:
        more = {s for s, targets in onward.items() if s not in found and targets & found}
        if not more:
            return found
        found |= more


def _better(offer: Mapping[int, Row], own: int, values: Mapping[int, Fraction], *, maximise: bool) -> int:
    """Return the best choice, the own one unless another is strictly better."""
    worth = {
        c: cost + sum((p * values[t] for t, p in spread.items()), Fraction(0)) for c, (cost, spread) in offer.items()
    }
    best = max(worth.values()) if maximise else min(worth.values())
    return own if worth[own] == best else next(c for c, value in worth.items() if value == best)


def followed_exactly(frame: Frame, unknown: Array, weight: Floats, known: Floats) -> dict[int, Fraction]:
    """Return the value of a policy in the unknown states, from which every run under it leaves them with probability 1.

    Parameters
    ----------
    frame, unknown, known
        As in `best_exactly`.
    weight : array of float, ``[C]``
        How often the policy takes each choice of its state.
    """
    states = set(map(int, unknown))
    return eliminate({s: _settled(_mixed(frame, s, weight), known, states) for s in states})


def _mixed(frame: Frame, state: int, weight: Floats) -> Row:
    """Return what a policy does in a state, as one row."""
    taken = {c: Fraction(float(weight[c])) for c in frame.mdp.choices_of(state) if weight[c] > 0}
    total, cost = sum(taken.values()), Fraction(0)
    spread: dict[int, Fraction] = {}
    for choice, share in taken.items():
        price, onward = row_of(frame, choice)
        cost += share / total * price
        for target, chance in onward.items():
            spread[target] = spread.get(target, Fraction(0)) + share / total * chance
    return cost, spread

"""A problem and a mission enter; the problem on the product leaves, compared array by array with one that is built here.

The pairs of a state and a memory are numbered as `ratherthan.model.product` says: first the model's states with the mission begun
there, then the pairs in the order in which they are met, going through all pairs by number and their branches in order. Where the
mission is done or has failed, every choice stays. Names and places are taken as they are; branches, probabilities, rewards, labels
and what is done are built anew from the text of the mission, and compared.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ratherthan.model.formula import states_where
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.objective import Mission, Objective, levels_of
from ratherthan.model.problem import Problem
from ratherthan.verify.formulas import only_a_deadline
from ratherthan.verify.frame import Array, slices
from ratherthan.verify.missions import Memory, TooLargeError, memory_of

__all__ = ["Pairs", "deviation", "misnamed", "pairs_of", "unfolded_for"]

MOST_PAIRS = 20_000_000
"""The most pairs of a state and a memory that are gone through."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Pairs:
    """The pairs of a product by number: P pairs, B' branches.

    Parameters
    ----------
    state, memory : array of int, ``[P]``
    done, failed : array of bool, ``[P]``
    left : array of int, ``[P]``
        After how many letters at the soonest the mission may have failed.
    target : array of int, ``[B']``
        Where each branch leads; a pair that has ended has one branch per choice, to itself.
    """

    state: Array  # [P]
    memory: Array  # [P]
    done: Bools  # [P]
    failed: Bools  # [P]
    left: Array  # [P]
    target: Array  # [B']


def unfolded_for(problem: Problem, objective: Objective) -> tuple[Problem, str | None]:
    """Return the problem on which an objective is judged, and how it deviates from the product that is built here.

    Parameters
    ----------
    problem : Problem
    objective : Objective
        Its missions are unfolded one after the other; without one the problem is returned as it is.

    Raises
    ------
    TooLargeError
        If there is too much to go through.
    """
    from ratherthan.model.product import unfolded

    flaw = _given(problem)
    for level in levels_of(objective):
        if flaw is None and isinstance(level, Mission) and not _known(problem, level):
            product = unfolded(problem, level)
            flaw = deviation(problem, product, pairs_of(problem, level))
            problem = product
    return problem, flaw


def _given(problem: Problem) -> str | None:
    """Return how a problem that is a product already deviates from what it should be."""
    unfolding = problem.unfolding
    if unfolding is None:
        return None
    flaw = _given(unfolding.origin)
    return flaw or deviation(unfolding.origin, problem, pairs_of(unfolding.origin, unfolding.mission))


def _known(problem: Problem, mission: Mission) -> bool:
    """Return whether a problem has been unfolded for a mission."""
    unfolding = problem.unfolding
    return unfolding is not None and (unfolding.mission.formula == mission.formula or _known(unfolding.origin, mission))


def pairs_of(problem: Problem, mission: Mission) -> Pairs:
    """Return the pairs of a model's states and what a mission remembers.

    Raises
    ------
    TooLargeError
        If there may be too many.
    """
    mdp = problem.mdp
    memory = memory_of(mission.formula, mdp)
    count = len(memory.done)
    if mdp.states * count > MOST_PAIRS:
        raise TooLargeError
    ended = memory.done | memory.failed
    number = np.full(mdp.states * count, -1, dtype=np.int64)
    layer = np.arange(mdp.states) * count + memory.after[memory.start, memory.letter]
    number[layer] = np.arange(mdp.states)
    layers, met = [layer], mdp.states
    while len(layer):
        going = layer[~ended[layer % count]]
        _, keys = _branches(mdp, memory, going)
        fresh, first = np.unique(keys[number[keys] < 0], return_index=True)
        layer = fresh[np.argsort(first, kind="stable")]
        number[layer] = met + np.arange(len(layer))
        met += len(layer)
        layers.append(layer)
    keys = np.concatenate(layers)
    state, kept = keys // count, keys % count
    return Pairs(
        state=state,
        memory=kept,
        done=memory.done[kept],
        failed=memory.failed[kept],
        left=memory.left[kept],
        target=_targets(mdp, memory, keys, number),
    )


def _branches(mdp: MDP, memory: Memory, keys: Array) -> tuple[Array, Array]:
    """Return the origin (a place in `keys`) and the target (a key) of every branch of some pairs, in order."""
    count = len(memory.done)
    state, kept = keys // count, keys % count
    first = mdp.choice_to_branches[mdp.state_to_choices[state]].astype(np.int64)
    last = mdp.choice_to_branches[mdp.state_to_choices[state + 1]].astype(np.int64)
    origin = np.repeat(np.arange(len(keys)), last - first)
    target = mdp.branch_to_target[slices(first, last)].astype(np.int64)
    return origin, target * count + memory.after[kept[origin], memory.letter[target]]


def _targets(mdp: MDP, memory: Memory, keys: Array, number: Array) -> Array:
    """Return the number of the pair that each branch of the product leads to."""
    count = len(memory.done)
    over = (memory.done | memory.failed)[keys % count]
    degree = _degree(mdp, keys // count, over)
    origin, onward = _branches(mdp, memory, keys[~over])
    target = np.repeat(np.arange(len(keys)), degree)
    going = np.repeat(~over, degree)
    target[going] = number[onward]
    assert len(origin) == int(going.sum())
    return target


def _degree(mdp: MDP, state: Array, over: Bools) -> Array:
    """Return how many branches each pair has."""
    choices = np.diff(mdp.state_to_choices)[state].astype(np.int64)
    per_state = np.diff(mdp.choice_to_branches[mdp.state_to_choices]).astype(np.int64)
    return np.where(over, choices, per_state[state])


def deviation(origin: Problem, product: Problem, own: Pairs) -> str | None:
    """Return in what a product deviates from the pairs that were built here; None where it does not.

    Parameters
    ----------
    origin, product : Problem
    own : Pairs
    """
    mdp, made, unfolding = origin.mdp, product.mdp, product.unfolding
    if unfolding is None or unfolding.origin is not origin:
        return "it is no product of this model"
    over = own.done | own.failed
    first, last = mdp.state_to_choices[own.state].astype(np.int64), mdp.state_to_choices[own.state + 1].astype(np.int64)
    choice = slices(first, last)
    still = np.repeat(over, last - first)
    degree = np.where(still, 1, np.diff(mdp.choice_to_branches)[choice])
    branch = np.zeros(int(degree.sum()), dtype=np.int64)
    going = np.repeat(~still, degree)
    begin = mdp.choice_to_branches[choice[~still]].astype(np.int64)
    branch[going] = slices(begin, begin + degree[~still])
    wanted = {
        "states": (unfolding.state, own.state),
        "done": (unfolding.satisfied, own.done),
        "failed": (unfolding.violated, own.failed),
        "choices of states": (made.state_to_choices, np.concatenate([[0], np.cumsum(last - first)])),
        "branches of choices": (made.choice_to_branches, np.concatenate([[0], np.cumsum(degree)])),
        "targets": (made.branch_to_target, own.target),
        "probabilities": (made.branch_to_probability, np.where(going, mdp.branch_to_probability[branch], 1.0)),
        "actions": (made.choice_to_action, mdp.choice_to_action[choice]),
        "initial states": (made.initial, mdp.initial),
    }
    if origin.world is not None and product.world is not None:
        wanted["places"] = product.world.cell_of_state, origin.world.cell_of_state[own.state]
    for name in made.labels:
        mask = mdp.labels[name] if name in mdp.labels else states_where(mdp, f'"{name}"')
        wanted[f"label '{name}'"] = made.labels[name], mask[own.state]
    for name, reward in mdp.rewards.items():
        for part, values in reward.parts():
            rows, paid = {
                "state": (own.state, ~over),
                "choice": (choice, ~still),
                "branch": (branch, going),
            }[part]
            wanted[f"reward '{name}'"] = getattr(made.rewards[name], part), _paid(values, rows, paid)
    for what, (theirs, ours) in wanted.items():
        if not np.array_equal(theirs, ours):
            return f"its {what} are not those of the model with what must be remembered"
    same = np.unique(np.column_stack([unfolding.memory, own.memory]), axis=0)
    if len(same) != len(np.unique(unfolding.memory)) or len(same) != len(np.unique(own.memory)):
        return "its memories are not those that the mission needs"
    return None


def _paid(values: Floats, rows: Array, paid: Bools) -> Floats:
    return np.where(paid, values[rows], 0.0)


def misnamed(problem: Problem, states: Iterable[int]) -> str | None:
    """Return which of some states of a product is called what it is not: over, or with another number of steps left."""
    unfolding = problem.unfolding
    if unfolding is None:
        return None
    wanted = unfolding.mission.maximise
    over = {True: ("done",), False: ("failed", "too late")} if wanted else {True: ("failed",), False: ("averted",)}
    ends = tuple(f", {word}" for words in over.values() for word in words)
    timed = only_a_deadline(unfolding.mission.formula)
    left = pairs_of(unfolding.origin, unfolding.mission).left if timed else None
    for state in states:
        name = problem.mdp.names[state]
        done, failed = bool(unfolding.satisfied[state]), bool(unfolding.violated[state])
        if done or failed:
            allowed = tuple(f", {word}" for word in over[done])
            if not name.endswith(allowed):
                return f"state {state} is an end{allowed[0]}, but it is called '{name}'"
        elif name.endswith(ends):
            return f"state {state} is no end, but it is called '{name}'"
        elif left is not None:
            count = int(left[state])
            if not name.endswith(f", {count} step{'s' if count != 1 else ''} left"):
                return f"at state {state} {count} steps are left, but it is called '{name}'"
    return None

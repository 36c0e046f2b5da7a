"""A problem and a mission enter; the problem on the product of its model with what must be remembered leaves.

Whether a mission such as ``F<=10 "goal"`` or ``F ("a" & (F "b"))`` is accomplished depends on the way, not on the state alone.
With what must be remembered of the way (see automaton.py) each state has a probability to accomplish it, and the mission
is a reach-avoid task on the *product*: pairs of a state s and a memory m. A branch of s to t leads from (s, m) to (t, m'),
where m' is the memory after m and the letter of t: the letter of the first state is read before the first step.

**Numbering.** The first S pairs are the model's states in their order, with the mission begun there: (s, m₀(s)), where m₀(s)
is the memory after the letter of s alone. The others follow in the order in which they are met when all pairs are gone
through by number, the choices of each in the model's order, and their branches in the model's order (breadth-first search
from the first S pairs). Memories are numbered in the order in which they appear among the pairs.

**Choices and branches.** A pair (s, m) has the choices of s in their order, each with its branches in their order. Two
branches to one state stay two. Where the mission is accomplished or has failed for good, the pair is an *end*: each choice
keeps its action and has one branch, back to the pair itself with probability 1. It gives no rewards: in an end all rewards
are 0. Elsewhere labels, rewards, places and variables are those of s; ``"init"`` and ``"deadlock"`` too. The initial states are
the initial states of the model, with the mission begun there.

References
----------
.. [1] Baier, C. and Katoen, J.-P. (2008). Principles of Model Checking. MIT Press. Section 10.6.4.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model._kernels import compiled, unfold
from ratherthan.model.automaton import Automaton, automaton_of
from ratherthan.model.index import branches_of
from ratherthan.model.mdp import MDP, Bools, Floats, Ints, Reward
from ratherthan.model.memories import endings, pair_names
from ratherthan.model.names import StateNames
from ratherthan.model.objective import Mission
from ratherthan.model.path import positive
from ratherthan.model.policy import Policy, check_policy
from ratherthan.model.problem import Problem, Unfolding
from ratherthan.model.syntax import Term, text_of
from ratherthan.model.valuation import deadlocks
from ratherthan.model.watch import room_for

__all__ = ["choices_of_origin", "lifted", "path_of", "unfolded"]

MOST_BRANCHES = 30_000_000
"""The most branches of a product."""

BYTES = 64
"""What a product takes per branch while it is put together."""

_Numbers = npt.NDArray[np.int64]


def unfolded(problem: Problem, mission: Mission) -> Problem:
    """Return a problem on the product of its model with what a mission must remember.

    Parameters
    ----------
    problem : Problem
        If its model is the product for this mission already, it is returned with `mission` as its objective. If it is the
        product for another mission, it is unfolded once more; a run then ends where either mission has ended.
    mission : Mission

    Returns
    -------
    Problem
        With `unfolding`, the objective `mission`, and the same definitions, words and notes.

    Raises
    ------
    PropertyError
        If the mission does not fit the model, or is no co-safe formula.
    NotExplainableError
        If there is too much to be remembered.
    """
    known = problem.unfolding
    if known is not None and known.mission == mission:
        return problem if problem.objective == mission else replace(problem, objective=mission)
    if known is not None and known.mission.formula == mission.formula:  # its ends are called otherwise
        return unfolded(known.origin, mission)
    try:
        automaton = automaton_of(positive(path_of(mission, problem)), problem.mdp)
    except RecursionError:
        raise PropertyError(f"The mission '{mission.formula[:60]} …' is nested too deeply to be followed.") from None
    return _product(problem, mission, automaton)


def path_of(mission: Mission, problem: Problem) -> Term:
    """Return the formula of a mission as a tree, with definitions put in and bounds as numbers.

    Raises
    ------
    PropertyError
        If it is no co-safe path formula.
    """
    from ratherthan.model.temporal import chance_of

    return chance_of(_read(mission.formula), problem, maximise=mission.maximise)


@lru_cache(maxsize=64)
def _read(formula: str) -> Term:
    from ratherthan.model.reading import read

    path: Term = read("property", f"Pmax=? [{formula}]", "mission").path
    return path


def _product(problem: Problem, mission: Mission, automaton: Automaton) -> Problem:
    """Return the problem on the product with an automaton."""
    mdp = problem.mdp
    begun = automaton.after[automaton.start, automaton.letter_of_state]
    ends = automaton.satisfied | automaton.violated
    number = compiled(
        unfold, mdp.branches * len(automaton.left) // 4
    )  # some branches of a product are soon gone through
    state, class_of, target = number(
        mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target, automaton.letter_of_state, automaton.after,
        begun, ends, MOST_BRANCHES,
    )  # fmt: skip
    if not len(state):
        raise NotExplainableError(
            f"The model with what '{mission.formula}' must remember must have at most {MOST_BRANCHES} branches, but has "
            f"more: {mdp.branches} branches and {len(automaton.left)} things to remember. Take a smaller model or bound."
        )
    room_for(BYTES * len(target), f"The model with what '{mission.formula}' must remember, of {len(target)} branches,")
    first = np.unique(class_of, return_index=True)[1]
    classes = class_of[np.sort(first)]  # in the order of their first appearance
    memory = np.empty(len(automaton.left), dtype=np.int64)
    memory[classes] = np.arange(len(classes))
    unfolding = Unfolding(
        mission=mission,
        origin=problem,
        state=_locked(state),
        memory=_locked(memory[class_of]),
        left=tuple(text_of(automaton.formulas.term(int(automaton.left[m]))) for m in classes),
        satisfied=_locked(automaton.satisfied[class_of]),
        violated=_locked(automaton.violated[class_of]),
    )
    said = endings(automaton, classes.tolist(), maximise=mission.maximise)
    names = pair_names(mdp.names, problem.lexicon, state, unfolding.memory, said)
    return replace(
        problem,
        mdp=_lifted_model(mdp, unfolding, target, names),
        lexicon=replace(problem.lexicon, state="{name}", states={}),
        world=problem.world and replace(problem.world, cell_of_state=problem.world.cell_of_state[state]),
        objective=mission,
        unfolding=unfolding,
    )


def _lifted_model(mdp: MDP, unfolding: Unfolding, target: _Numbers, names: StateNames) -> MDP:
    """Return the model on the pairs of an unfolding; `target` holds the target of each of their branches."""
    state, ended = unfolding.state, unfolding.satisfied | unfolding.violated
    choice, rows = branches_of(mdp.state_to_choices, state)
    over = np.repeat(ended, np.diff(rows))  # [choices]: of an end
    counts = np.where(over, 1, np.diff(mdp.choice_to_branches)[choice])
    choice_to_branches = np.concatenate([[0], np.cumsum(counts)])
    origin = np.zeros(len(target), dtype=np.int64)  # [branches]: the branch that each one was
    going = np.repeat(~over, counts)
    origin[going] = branches_of(mdp.choice_to_branches, choice[~over])[0]
    labels = dict(mdp.labels)
    labels.setdefault("init", np.isin(np.arange(mdp.states), mdp.initial))
    labels.setdefault("deadlock", deadlocks(mdp))

    def reward(part: Floats | None, rows: Ints, still: Bools) -> Floats | None:
        return None if part is None else np.where(still, part[rows], 0.0)

    return MDP(
        state_to_choices=rows,
        choice_to_branches=choice_to_branches,
        branch_to_target=target,
        branch_to_probability=np.where(going, mdp.branch_to_probability[origin], 1.0),
        choice_to_action=mdp.choice_to_action[choice],
        actions=mdp.actions,
        labels={name: mask[state] for name, mask in labels.items()},
        rewards={
            name: Reward(
                state=reward(r.state, state, ~ended),
                choice=reward(r.choice, choice, ~over),
                branch=reward(r.branch, origin, going),
            )
            for name, r in mdp.rewards.items()
        },
        initial=mdp.initial,
        names=names,
    )


_Array = TypeVar("_Array", bound=npt.NDArray[Any])


def _locked(array: _Array) -> _Array:
    array.flags.writeable = False
    return array


def choices_of_origin(unfolded: Problem) -> _Numbers:
    """Return the choice of the model that each choice of its product is, ``[C]`` of the product."""
    unfolding = unfolded.unfolding
    if unfolding is None:
        return np.arange(unfolded.mdp.choices)
    return branches_of(unfolding.origin.mdp.state_to_choices, unfolding.state)[0]


def lifted(policy: Policy, unfolded: Problem) -> Policy:
    """Return a policy for a model as one for its product: the same choice in a state, whatever is remembered.

    Parameters
    ----------
    policy : Policy
        For the model that was unfolded.
    unfolded : Problem
        As `unfolded` gives it. A problem that is not unfolded leaves the policy as it is.

    Returns
    -------
    Policy

    Raises
    ------
    PolicyError
        If the policy does not fit the model that was unfolded.
    """
    unfolding = unfolded.unfolding
    if unfolding is None:
        return policy
    origin, product = unfolding.origin.mdp, unfolded.mdp
    check_policy(origin, policy)
    chosen = policy.choice[unfolding.state]
    choice = product.state_to_choices[:-1] + (chosen - origin.state_to_choices[unfolding.state])
    choice = np.where(chosen < 0, -1, choice)
    chance = None if policy.chance is None else policy.chance[choices_of_origin(unfolded)]
    return Policy(choice=choice, chance=chance)

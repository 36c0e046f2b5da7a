"""A problem and perhaps an objective enter; the objective that is meant leaves, in the one spelling that a property has."""

from __future__ import annotations

from dataclasses import replace

from ratherthan.errors import PropertyError
from ratherthan.model.formula import canonical
from ratherthan.model.objective import (
    Discounted,
    Level,
    Lexicographic,
    Mission,
    Objective,
    ReachAvoid,
    levels_of,
)
from ratherthan.model.problem import Problem
from ratherthan.model.property import choose_objective, parse_property
from ratherthan.model.weights import canonical_reward

__all__ = ["objective_of"]


def objective_of(problem: Problem, objective: Objective | None) -> Objective:
    """Return `objective` in its canonical form, or the one that the problem makes plain.

    Raises
    ------
    PropertyError
        If there is neither, or it asks for nothing.
    """
    wanted = choose_objective(problem) if objective is None else objective
    if not isinstance(wanted, Level | Lexicographic):
        raise PropertyError(f"The objective must ask for a value, such as Pmax=? or Rmin=?, got '{wanted.text}'.")
    levels = levels_of(wanted)
    if not levels:
        raise PropertyError(
            "Several objectives in order must be at least one, got none: Lexicographic(levels=(first, second))."
        )
    plain = tuple(_canonical(level, problem) for level in levels)
    if plain == levels:
        return wanted
    return Lexicographic(levels=plain) if isinstance(wanted, Lexicographic) else plain[0]


def _canonical(level: Level, problem: Problem) -> Level:
    """Return a level with its formulas and its reward in the one spelling that a property's text has.

    What cannot be read is left as it is, for those who resolve it to refuse.
    """
    rewards = problem.mdp.rewards
    if not isinstance(level, ReachAvoid | Mission) and level.reward is not None:
        level = replace(level, reward=canonical_reward(level.reward, rewards) or level.reward)
    if isinstance(level, Discounted) or (isinstance(level, Mission) and problem.unfolding is not None):
        return level
    try:
        if isinstance(level, Mission):
            found = parse_property(level.text, problem)
            return found if isinstance(found, Mission | ReachAvoid) else level
        goal = _plain(level.goal, problem)
        if isinstance(level, ReachAvoid):
            through = None if level.through is None else _plain(level.through, problem)
            return replace(level, goal=goal, through=through)
        return replace(level, goal=goal)
    except PropertyError:
        return level


def _plain(formula: str, problem: Problem) -> str:
    """Return a state formula in its canonical form."""
    return canonical(formula, problem.definitions, problem.mdp.names.variables)

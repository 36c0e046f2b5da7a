"""Nothing enters; small models of every kind are solved and explained, and sentences on what was compiled meanwhile leave.

There is no list of kernels and types: what any command needs is found by doing what commands do, on models that are made here and
compiled whatever their size. Each is of another kind, so that each method of the solver has its turn.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ratherthan.apps.waiting import waiting
from ratherthan.model.memory import size_text

if TYPE_CHECKING:
    from ratherthan.model.objective import Objective, Threshold
    from ratherthan.model.problem import Problem
    from ratherthan.solve import Solution

__all__ = ["TASKS", "always_compiled", "cleared", "made", "standing", "warmed"]

SIDE = 72
STATES = 6000
Work = Callable[[], object]


def made() -> list[str]:
    """Compile all that is needed, and return sentences on what was done.

    Raises
    ------
    QuestionError
        If compiling is switched off.
    SourceError
        If nothing can be kept.
    """
    from ratherthan.errors import QuestionError
    from ratherthan.model.compiling import is_compiled, tally

    _kept_in()
    began = time.perf_counter()
    with always_compiled():
        if not is_compiled(1):
            raise QuestionError("Compiling must not be switched off, but NUMBA_DISABLE_JIT is set. Unset it.")
    tally.announce = None
    with waiting("Compiling") as tell:
        warmed(tell)
    new = len(tally.shipped) + len(tally.compiled)
    done = f"Made {_counted(new)} in {time.perf_counter() - began:.1f} s." if new else "Nothing was left to compile."
    alone = [f"numba alone runs {name}: {reason}." for name, reason in tally.plain.items()]
    return [done, *alone, standing()]


def standing() -> str:
    """Return a sentence on what is kept, and where."""
    from ratherthan.model.compiling.store import held

    sizes = [path.stat().st_size for path in held()]
    return f"{_kept_in()} holds {_counted(len(sizes))}, {size_text(sum(sizes))}."


def cleared() -> str:
    """Remove what is kept, and return a sentence on it."""
    from ratherthan.model.compiling.store import clear

    place, size = _kept_in(), clear()
    return f"{place} is empty; {size_text(size)} were removed."


def _counted(number: int) -> str:
    """Return a number of compiled loops."""
    return f"{number} compiled loop{'s' * (number != 1)}"


def _kept_in() -> Path:
    """Return the folder of compiled code."""
    from ratherthan.errors import SourceError
    from ratherthan.model.compiling.store import folder

    place = folder()
    if place is None:
        raise SourceError(
            "Compiled code must be kept in a folder that can be written to, but neither the user's cache nor the place for "
            "temporary files can. Name one by NUMBA_CACHE_DIR."
        )
    return place


def warmed(tell: Callable[[str], None]) -> None:
    """Do all tasks; `tell` is told which.

    Parameters
    ----------
    tell : callable
        Takes what is being done.
    """
    with always_compiled():
        for name, work in TASKS.items():
            tell(name)
            work()


@contextmanager
def always_compiled() -> Iterator[None]:
    """Have all kernels compiled in the block, also for little work."""
    before = os.environ.get("RATHERTHAN_COMPILE")
    os.environ["RATHERTHAN_COMPILE"] = "always"
    try:
        yield
    finally:
        if before is None:
            del os.environ["RATHERTHAN_COMPILE"]
        else:
            os.environ["RATHERTHAN_COMPILE"] = before


def _explained(problem: Problem, objective: Objective | Threshold | None = None) -> Solution:
    """Solve a problem, explain the route and one state, and count everything."""
    from dataclasses import replace

    from ratherthan.apps.columns import factor_columns
    from ratherthan.errors import RatherthanError
    from ratherthan.explain import Factors, explain, question
    from ratherthan.model.objective import Threshold
    from ratherthan.narrate import narrate, to_json
    from ratherthan.solve import solve

    if objective is not None:
        wanted = objective.objective if isinstance(objective, Threshold) else objective
        problem = replace(problem, objective=wanted)
    solution = solve(problem)
    with suppress(RatherthanError):  # what cannot be explained is still solved
        explanation = explain(solution)
        narrate(explanation)
        to_json(explanation)
        explain(solution, kind="constrictive")
        explain(solution, kind="naive-path", at_most=1)
        factors = Factors(solution=solution, asked=question("contrastive"))
        for _ in factor_columns(factors, None).values():
            pass
    return solution


def _map(walls: float = 0.2, traps: float = 0.0, slip: float = 0.1, *, back: bool = True) -> Problem:
    """Return a map of one cell after another, with walls, traps and a robot that slips; or on which no step leads back."""
    from ratherthan.model.objective import ExpectedCost

    rng = np.random.default_rng(3)
    row, column = np.divmod(np.arange(SIDE * SIDE), SIDE)
    free = rng.random(SIDE * SIDE) >= walls
    free[:2] = free[-2:] = free[SIDE] = free[-SIDE - 1] = True
    steps = ((-1, 0), (0, 1), (1, 0), (0, -1)) if back else ((1, 0), (0, 1), (1, 1), (0, 0))
    there = []
    for down, right in steps:
        cell = np.clip(row + down, 0, SIDE - 1) * SIDE + np.clip(column + right, 0, SIDE - 1)
        there.append(np.where(free[cell] & free, cell, np.arange(SIDE * SIDE)))
    beside = np.stack(there, 1)
    targets = np.stack([beside, np.roll(beside, 1, 1), np.roll(beside, -1, 1)], 2) if slip > 0.0 else beside[:, :, None]
    chances = np.array([1 - 2 * slip, slip, slip]) if slip > 0.0 else np.ones(1)
    goal = np.arange(SIDE * SIDE) == SIDE * SIDE - 1
    trap = (rng.random(SIDE * SIDE) < traps) & free & ~goal & (row + column > 3)
    return _problem(targets, chances, {"goal": goal, "trap": trap}, ExpectedCost(goal='"goal"', reward="steps"))


def _ring(reach: int | None, goals: int = 1) -> Problem:
    """Return states in a ring whose choices lead not far, or anywhere."""
    from ratherthan.model.objective import ExpectedCost

    rng = np.random.default_rng(5)
    own = np.arange(STATES)[:, None, None]
    far = STATES // 2 if reach is None else reach
    targets = (own + rng.integers(-far, far + 1, (STATES, 3, 4))) % STATES
    goal = np.arange(STATES) >= STATES - goals
    return _problem(targets, np.full(4, 0.25), {"goal": goal}, ExpectedCost(goal='"goal"', reward="steps"))


def _groups() -> Problem:
    """Return groups of states in which one can go round for ever, left for another group or for nowhere."""
    from ratherthan.model.objective import ReachAvoid

    rng = np.random.default_rng(7)
    own, size = np.arange(STATES), 20
    first = own - own % size
    targets = np.minimum(first[:, None, None] + rng.integers(0, size, (STATES, 2, 4)), STATES - 1)
    ahead = np.minimum(first[:, None] + rng.integers(size, 9 * size, (STATES, 4)), STATES - 1)
    ahead[:, 0] = np.where(rng.random(STATES) < 0.01, STATES - 2, ahead[:, 0])
    leaves = own % size == 0
    targets[leaves, 1] = ahead[leaves]
    targets[STATES - 2 :] = own[STATES - 2 :, None, None]
    goal = own == STATES - 1
    return _problem(targets, np.full(4, 0.25), {"goal": goal}, ReachAvoid(goal='"goal"'))


def _walk() -> Problem:
    """Return three coins that move a counter until it reaches an end."""
    from ratherthan.model.objective import ExpectedCost

    phases, most = 27, 60
    states = (2 * most + 1) * phases
    place, phase = np.divmod(np.arange(states), phases)
    done = (place == 0) | (place == 2 * most)
    targets = np.empty((states, 3, 2), dtype=np.int64)
    for coin in range(3):
        weight = 3**coin
        toss = phase // weight % 3
        moved = np.arange(states) + np.where(toss == 1, phases, -phases) - toss * weight
        for side in range(2):
            tossed = np.arange(states) + (side + 1) * weight
            targets[:, coin, side] = np.where(done, np.arange(states), np.where(toss == 0, tossed, moved))
    start = most * phases
    objective = ExpectedCost(goal='"goal"', reward="steps")
    return _problem(targets, np.full(2, 0.5), {"goal": done}, objective, start=start)


def _problem(targets: Any, chances: Any, labels: dict[str, Any], objective: Objective, start: int = 0) -> Problem:
    """Return the problem of `targets` ``[S, A, n]``, whose choices all have the same chances."""
    from ratherthan.model.mdp import MDP, Reward
    from ratherthan.model.problem import Problem

    states, actions, branches = targets.shape
    gains = np.random.default_rng(9).normal(0.0, 1.0, states * actions)
    mdp = MDP(
        state_to_choices=np.arange(0, states * actions + 1, actions),
        choice_to_branches=np.arange(0, states * actions * branches + 1, branches),
        branch_to_target=targets.reshape(-1),
        branch_to_probability=np.tile(chances, states * actions),
        choice_to_action=np.tile(np.arange(actions), states),
        actions=tuple(f"action {k + 1}" for k in range(actions)),
        initial=np.array([start]),
        labels=labels,
        rewards={
            "steps": Reward(choice=np.ones(states * actions)),
            "tolls": Reward(choice=np.maximum(np.round(gains), 0.0)),
            "gains": Reward(choice=gains),
        },
    )
    return Problem(mdp=mdp, objective=objective)


def _cost(reward: str = "steps") -> None:
    """A map: the least cost, by the best plan and by another one."""
    from ratherthan.model.objective import ExpectedCost
    from ratherthan.model.policy import Policy
    from ratherthan.solve import evaluate

    solution = _explained(_map(), ExpectedCost(goal='"goal"', reward=reward))
    mdp = solution.problem.mdp
    count = np.diff(mdp.state_to_choices)
    uniform = Policy(choice=np.full(mdp.states, -1), chance=np.repeat(1.0 / count, count))
    evaluate(solution.problem, uniform)


def _traps() -> None:
    """A map with traps: the largest and the least probability to arrive, and the least cost among the safest plans."""
    from ratherthan.model.objective import ExpectedCost, Lexicographic, ReachAvoid

    problem = _map(walls=0.1, traps=0.05)
    safest = ReachAvoid(goal='"goal"', through='!"trap"')
    for objective in (
        safest,
        ReachAvoid(goal='"trap"', maximise=False),
        Lexicographic(levels=(safest, ExpectedCost(goal='"goal"', reward="steps"))),
    ):
        _explained(problem, objective)


def _discounted() -> None:
    """Gains and losses, discounted."""
    from ratherthan.model.objective import Discounted

    for discount in (0.9, 0.999):
        _explained(_ring(50), Discounted(reward="gains", discount=discount))
    _explained(_map(), Discounted(reward="steps", discount=0.95, maximise=False))


def _checked() -> None:
    """Explanations that are checked again: a map's, and those of discounted sums and of probabilities."""
    from dataclasses import replace

    from ratherthan.explain import explain
    from ratherthan.model.objective import Discounted, ReachAvoid
    from ratherthan.narrate import to_json
    from ratherthan.solve import solve
    from ratherthan.verify import verify

    gains = replace(_ring(50), objective=Discounted(reward="gains", discount=0.9))
    traps = replace(_map(walls=0.1, traps=0.05), objective=ReachAvoid(goal='"goal"', through='!"trap"'))
    for problem in (_map(), gains, traps):
        verify(json.loads(to_json(explain(solve(problem)))), problem)


def _ahead() -> None:
    """Decisions left open within some steps, and on a model that leads one way."""
    from ratherthan.explain import Factors, question
    from ratherthan.factors import Effort, Search
    from ratherthan.solve import solve

    for problem, asked in (
        (_map(), question("contrastive", search=Search(horizon=5))),
        (_map(), question("contrastive", search=Search(toward_goal=True))),
        (_map(back=False), question("contrastive")),
    ):
        factors = Factors(solution=solve(problem), asked=asked)
        choices = np.arange(0, problem.mdp.choices, 3)
        factors.counted(choices, Effort())
        factors.counted(choices, Effort(visits=1, estimate=True))


def _mission() -> None:
    """A mission, on a model that remembers how far it is."""
    from ratherthan.model.property import parse_property

    problem = _map(slip=0.0)
    _explained(problem, parse_property('Pmax=? [F<=30 "goal"]', problem))


def _laid_out() -> None:
    """A map of cells, read and laid out for a robot that slips, and one that does not."""
    from ratherthan.io.grids.moves import Motion, moves_on

    opened = np.random.default_rng(3).random((SIDE, SIDE)) >= 0.2
    for slip in (0.1, 0.0):
        moves_on(opened, np.zeros_like(opened), Motion(slip=slip), 1.0)


TASKS: dict[str, Work] = {
    "maps of cells": _laid_out,
    "maps": _cost,
    "maps with free moves": lambda: _cost("tolls"),
    "maps with traps": _traps,
    "maps without a way back": lambda: _explained(_map(back=False)),
    "discounted rewards": _discounted,
    "missions": _mission,
    "rings": lambda: _explained(_ring(50)),
    "expanders": lambda: _explained(_ring(None)),
    "walks": lambda: _explained(_walk()),
    "end components": lambda: _explained(_groups()),
    "decisions ahead": _ahead,
    "checks": _checked,
}

"""A small exact world: models of a few states over fractions, solved by trying every deterministic policy.

Nothing here is shared with the package: so that a misreading is not repeated in its own test.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import inf

from ratherthan.model.objective import ExpectedCost
from ratherthan.model.problem import Problem

Row = tuple[dict[int, Fraction], Fraction]
"""Target → probability, and what the choice costs."""


def rows_of(problem: Problem) -> list[list[Row]]:
    """Return the rows of a problem, state by state, probabilities normalised exactly."""
    mdp, wanted = problem.mdp, problem.objective
    rows: list[list[Row]] = []
    for state in range(mdp.states):
        own = []
        for choice in mdp.choices_of(state):
            chances: dict[int, Fraction] = {}
            for branch in range(mdp.branches_of(choice).start, mdp.branches_of(choice).stop):
                target = int(mdp.branch_to_target[branch])
                chances[target] = chances.get(target, Fraction(0)) + Fraction(float(mdp.branch_to_probability[branch]))
            total = sum(chances.values())
            cost = Fraction(1)
            if isinstance(wanted, ExpectedCost) and wanted.reward is not None:
                cost = Fraction(float(mdp.rewards[wanted.reward].choice[choice]))
            own.append(({t: p / total for t, p in chances.items()}, cost))
        rows.append(own)
    return rows


def chain_values(chain: Sequence[Row | None], goals: Iterable[int], *, cost: bool) -> list[Fraction | float]:
    """Return, for a chain (None where it has ended), the expected cost until a goal, or the chance to reach one."""
    states, goals = range(len(chain)), set(goals)
    chance = _chances(chain, goals)
    if not cost:
        return list(chance)
    open_ = [s for s in states if chain[s] is not None and chance[s] == 1 and s not in goals]
    position = {s: i for i, s in enumerate(open_)}
    matrix = []
    for s in open_:
        row = chain[s]
        assert row is not None
        line = [Fraction(0)] * len(open_)
        line[position[s]] += 1
        for t, p in row[0].items():
            if t in position:
                line[position[t]] -= p
        matrix.append((line, row[1]))
    solved = dict(zip(open_, _solve(matrix), strict=True))
    return [Fraction(0) if s in goals else solved.get(s, inf) for s in states]


def _chances(chain: Sequence[Row | None], goals: set[int]) -> list[Fraction]:
    reaching = set(goals)
    while True:
        more = {s for s, row in enumerate(chain) if row and s not in reaching and set(row[0]) & reaching}
        if not more:
            break
        reaching |= more
    open_ = [s for s in range(len(chain)) if s in reaching and s not in goals and chain[s] is not None]
    position = {s: i for i, s in enumerate(open_)}
    matrix = []
    for s in open_:
        row = chain[s]
        assert row is not None
        line, right = [Fraction(0)] * len(open_), Fraction(0)
        line[position[s]] += 1
        for t, p in row[0].items():
            if t in position:
                line[position[t]] -= p
            elif t in goals:
                right += p
        matrix.append((line, right))
    solved = dict(zip(open_, _solve(matrix), strict=True))
    return [Fraction(1) if s in goals else solved.get(s, Fraction(0)) for s in range(len(chain))]


def _solve(matrix: list[tuple[list[Fraction], Fraction]]) -> list[Fraction]:
    rows = [[*line, right] for line, right in matrix]
    for i in range(len(rows)):
        pivot = next(j for j in range(i, len(rows)) if rows[j][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(len(rows)):
            if j != i and rows[j][i]:
                factor = rows[j][i]
                rows[j] = [x - factor * y for x, y in zip(rows[j], rows[i], strict=True)]
    return [row[-1] for row in rows]


def optimum_by_enumeration(problem: Problem) -> list[Fraction | float]:
    """Return the optimum of every state over all deterministic memoryless policies."""
    wanted, mdp = problem.objective, problem.mdp
    assert wanted is not None
    rows, states = rows_of(problem), range(mdp.states)
    goal = {s for s in states if mdp.labels["goal"][s]}
    hazard = {s for s in states if mdp.labels["hazard"][s]}
    cost = isinstance(wanted, ExpectedCost)
    if not cost and not wanted.maximise:  # F hazard
        ended, targets = hazard, hazard
    elif not cost and wanted.through is not None:  # !hazard U goal
        ended, targets = goal | hazard, goal
    else:
        ended, targets = goal, goal
    best: list[Fraction | float] | None = None
    better = max if wanted.maximise else min
    for choices in itertools.product(*(range(1 if s in ended else len(rows[s])) for s in states)):
        chain = [None if s in ended else rows[s][c] for s, c in zip(states, choices, strict=True)]
        values = chain_values(chain, targets, cost=cost)
        best = values if best is None else [better(x, y) for x, y in zip(best, values, strict=True)]
    assert best is not None
    return best

"""A small exact world: models of a few states over fractions, solved by trying every deterministic policy.

Nothing here is shared with the package: so that a misreading is not repeated in its own test.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from math import inf

from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Level, ReachAvoid
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


def sets_of(problem: Problem, formula: str) -> set[int]:
    """Return the states of a label, negated or not."""
    label = problem.mdp.labels[formula.lstrip("!").strip('"')]
    return {s for s in range(problem.mdp.states) if bool(label[s]) is not formula.startswith("!")}


def paid_rows(problem: Problem, level: Level) -> list[list[Row]]:
    """Return the rows of a problem with what a level counts."""
    reward = None if isinstance(level, ReachAvoid) else level.reward
    wanted = ExpectedCost(goal='"goal"', reward=reward)
    return rows_of(replace(problem, objective=wanted))


def ends_of(problem: Problem, level: Level, over: set[int]) -> tuple[set[int], set[int]]:
    """Return the targets of a level, and where it has ended otherwise."""
    if isinstance(level, Discounted):
        return set(), over
    target = sets_of(problem, level.goal)
    if isinstance(level, ReachAvoid):
        blocked = set() if level.through is None else set(range(problem.mdp.states)) - sets_of(problem, level.through)
        return target, (blocked | over) - target
    return target | over, set()


def level_values(
    problem: Problem, level: Level, permitted: Sequence[Sequence[int]], over: set[int]
) -> list[Fraction | float]:
    """Return the optimum of a level over all deterministic policies that take permitted choices."""
    rows, states = paid_rows(problem, level), range(problem.mdp.states)
    target, blocked = ends_of(problem, level, over)
    ended = target | blocked
    better = max if level.maximise else min
    missed = -inf if isinstance(level, ExpectedReward) and level.maximise else inf
    best: list[Fraction | float] | None = None
    sure: set[int] = set()
    chains = []
    for choices in itertools.product(*([0] if s in ended else permitted[s] for s in states)):
        chain = [None if s in ended else rows[s][c] for s, c in zip(states, choices, strict=True)]
        chains.append(chain)
        if isinstance(level, Discounted):
            values: list[Fraction | float] = _discounted(chain, Fraction(level.discount))
        else:
            values = chain_values(chain, target, cost=not isinstance(level, ReachAvoid))
            values = [missed if v == inf else v for v in values]
            sure |= {s for s, chance in enumerate(_chances(chain, target)) if chance == 1}
        best = values if best is None else [better(x, y) for x, y in zip(best, values, strict=True)]
    assert best is not None
    if isinstance(level, ExpectedReward):
        sign = 1 if level.maximise else -1
        allowed = [
            [] if s in ended else [c for c in permitted[s] if s in sure and set(rows[s][c][0]) <= sure] for s in states
        ]
        rising = {s for chain in chains for s in _rising(chain, rows, allowed, sign)}
        while more := {s for s in states if s not in rising and any(set(rows[s][c][0]) & rising for c in allowed[s])}:
            rising |= more
        best = [sign * inf if s in rising else value for s, value in enumerate(best)]
    return best


def _discounted(chain: Sequence[Row | None], discount: Fraction) -> list[Fraction | float]:
    """Return the discounted sums of a chain."""
    matrix = []
    for s, row in enumerate(chain):
        line = [Fraction(0)] * len(chain)
        line[s] += 1
        for t, p in (row[0] if row else {}).items():
            line[t] -= discount * p
        matrix.append((line, row[1] if row else Fraction(0)))
    return list(_solve(matrix))


def _rising(
    chain: Sequence[Row | None], rows: Sequence[Sequence[Row]], allowed: Sequence[Sequence[int]], sign: int
) -> set[int]:
    """Return the states of the recurrent classes of a chain, by allowed choices, whose mean reward has the sign."""
    after: dict[int, set[int]] = {}
    for s, row in enumerate(chain):
        usable = row is not None and any(rows[s][c] is row for c in allowed[s])
        after[s] = {t for t, p in row[0].items() if p} if usable and row is not None else set()
    reach = {s: {s} for s in after}
    for _ in after:
        for s in after:
            reach[s] = reach[s] | {t for u in reach[s] for t in after[u]}
    found: set[int] = set()
    for s in after:
        closed = reach[s]
        if all(after[u] and s in reach[u] for u in closed):
            members = sorted(closed)
            # the stationary distribution: π (I - P) = 0 but for one equation, and Σ π = 1
            own = [row for row in (chain[u] for u in members) if row is not None]
            matrix = [
                (
                    [Fraction(int(u == v)) - row[0].get(u, Fraction(0)) for v, row in zip(members, own, strict=True)],
                    Fraction(0),
                )
                for u in members
            ]
            matrix[0] = ([Fraction(1)] * len(members), Fraction(1))
            mean = sum(share * row[1] for share, row in zip(_solve(matrix), own, strict=True))
            if sign * mean > 0:
                found |= closed
    return found


def tied(
    problem: Problem,
    level: Level,
    values: Sequence[Fraction | float],
    permitted: Sequence[Sequence[int]],
    over: set[int],
) -> list[list[int]]:
    """Return the permitted choices that attain the value of their state."""
    rows = paid_rows(problem, level)
    target, blocked = ends_of(problem, level, over)
    discount = Fraction(level.discount) if isinstance(level, Discounted) else Fraction(1)
    worst = -inf if level.maximise else inf
    kept = []
    for s, own in enumerate(permitted):
        if s in target | blocked:
            kept.append(list(own))
            continue
        equal = []
        for c in own:
            chances, paid = rows[s][c]
            after = [values[t] for t in chances]
            infinite = [v for v in after if isinstance(v, float)]
            if infinite:
                q: Fraction | float = worst if worst in infinite else infinite[0]
            else:
                mean = sum((p * values[t] for t, p in chances.items()), Fraction(0))
                q = (Fraction(0) if isinstance(level, ReachAvoid) else paid) + discount * Fraction(mean)
            here = values[s]
            if q == here or (
                not isinstance(q, float) and not isinstance(here, float) and abs(q - here) <= 1e-12 * max(1, abs(here))
            ):
                equal.append(c)
        kept.append(equal)
    return kept


def lexicographic_values(
    problem: Problem, levels: Sequence[Level]
) -> tuple[list[list[Fraction | float]], list[list[int]]]:
    """Return the optimum of every level among the choices that the levels before leave, and the choices tied at all."""
    permitted = [list(range(len(problem.mdp.choices_of(s)))) for s in range(problem.mdp.states)]
    over: set[int] = set()
    found = []
    for level in levels:
        values = level_values(problem, level, permitted, over)
        permitted = tied(problem, level, values, permitted, over)
        if not found:
            target, blocked = ends_of(problem, level, over)
            over = target | blocked
            if isinstance(level, ReachAvoid) and level.maximise:
                over |= {s for s, v in enumerate(values) if v == 0}
        found.append(values)
    return found, permitted


def policy_level_values(
    problem: Problem, level: Level, choices: Sequence[int], over: set[int]
) -> list[Fraction | float]:
    """Return what a deterministic policy, choices counted within their states, attains of a level."""
    rows = paid_rows(problem, level)
    target, blocked = ends_of(problem, level, over)
    chain = [None if s in target | blocked else rows[s][c] for s, c in enumerate(choices)]
    if isinstance(level, Discounted):
        return _discounted(chain, Fraction(level.discount))
    missed = -inf if isinstance(level, ExpectedReward) and level.maximise else inf
    values = chain_values(chain, target, cost=not isinstance(level, ReachAvoid))
    return [missed if v == inf else v for v in values]

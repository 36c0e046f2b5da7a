"""Chains of small models in fractions, from the arrays of the model: nothing here is shared with what it tests."""

from __future__ import annotations

from fractions import Fraction

from ratherthan.model.mdp import MDP

Chain = list[tuple[Fraction, dict[int, Fraction]]]
"""What is paid in each state, and where it leads."""

WEIGHTS = {
    "cost": {"cost": 1},
    "toll": {"toll": 1},
    "gain": {"gain": 1},
    "cost + 2.5 * toll": {"cost": 1, "toll": Fraction(5, 2)},
    "3 * gain + 0.5 * toll": {"gain": 3, "toll": Fraction(1, 2)},
}


def paid(mdp: MDP, choice: int, name: str | None) -> Fraction:
    """Return what a choice pays, from the arrays of the model."""
    if name is None:
        return Fraction(1)
    branches, total = mdp.branches_of(choice), Fraction(0)
    chances = [Fraction(float(p)) for p in mdp.branch_to_probability[branches]]
    for reward, weight in WEIGHTS[name].items():
        parts = mdp.rewards[reward]
        if parts.state is not None:
            total += weight * Fraction(float(parts.state[mdp.state_of(choice)]))
        if parts.choice is not None:
            total += weight * Fraction(float(parts.choice[choice]))
        if parts.branch is not None:
            amounts = [Fraction(float(b)) for b in parts.branch[branches]]
            total += weight * sum(p * b for p, b in zip(chances, amounts, strict=True)) / sum(chances)
    return total


def spread(mdp: MDP, choice: int) -> dict[int, Fraction]:
    branches, found = mdp.branches_of(choice), {}
    chances = [Fraction(float(p)) for p in mdp.branch_to_probability[branches]]
    for target, chance in zip(mdp.branch_to_target[branches].tolist(), chances, strict=True):
        found[target] = found.get(target, Fraction(0)) + chance / sum(chances)
    return found


def solved(matrix: list[list[Fraction]]) -> list[Fraction] | None:
    """Solve by Gauss's elimination; the last column is the right side."""
    rows = [list(row) for row in matrix]
    for i in range(len(rows)):
        pivot = next((j for j in range(i, len(rows)) if rows[j][i]), None)
        if pivot is None:
            return None
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(len(rows)):
            if j != i and rows[j][i]:
                factor = rows[j][i]
                rows[j] = [x - factor * y for x, y in zip(rows[j], rows[i], strict=True)]
    return [row[-1] for row in rows]


def reaching(chain: Chain, to: set[int]) -> set[int]:
    found = set(to)
    while True:
        more = {s for s, (_, row) in enumerate(chain) if s not in found and set(row) & found}
        if not more:
            return found
        found |= more


def linear(chain: Chain, states: list[int], discount: Fraction) -> list[Fraction]:
    """Return the solution of x = r + γ P x in some states, 0 elsewhere."""
    place = {s: i for i, s in enumerate(states)}
    matrix = []
    for s in states:
        line = [Fraction(int(t == s)) for t in states]
        for t, p in chain[s][1].items():
            if t in place:
                line[place[t]] -= discount * p
        matrix.append([*line, chain[s][0]])
    found = solved(matrix)
    assert found is not None
    return found

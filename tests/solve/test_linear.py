"""Every way to solve a chain gives the exact solution, on slow chains too, and says when it cannot."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import numpy as np
import pytest
from exact import chain_values

from ratherthan.solve import linear, sparse
from ratherthan.solve.eliminating import ordering
from ratherthan.solve.linear import Method, methods_for, solve_chain
from ratherthan.solve.system import System

METHODS = {
    "dense": Method(linear._dense),
    "dense elimination": Method(linear._dense_elimination, entrywise=True),
    "sparse LU": Method(sparse.sparse_lu),
    "elimination": Method(sparse.elimination, entrywise=True),
    "Krylov": Method(sparse.krylov),
}


@pytest.fixture(params=["auto", pytest.param("always", marks=pytest.mark.kernels)], autouse=True)
def compiler(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RATHERTHAN_COMPILE", request.param)


def system_of(rows: list[tuple[dict[int, float], float]]) -> System:
    """Return a system from rows of target → probability, and cost; targets n and n + 1 are the sinks."""
    lengths = [len(chances) for chances, _ in rows]
    return System(
        node_to_rows=np.arange(len(rows) + 1),
        row_to_branches=np.concatenate([[0], np.cumsum(lengths)]),
        target=np.array([t for chances, _ in rows for t in chances]),
        probability=np.array([p for chances, _ in rows for p in chances.values()]),
        cost=np.array([cost for _, cost in rows]),
        source=np.arange(len(rows)),
    )


def exact_solution(rows: list[tuple[dict[int, float], float]]) -> list[Fraction]:
    """Return the solution over fractions: costs until a sink is reached, plus the chance of the second sink."""
    n = len(rows)
    chain = []
    for chances, cost in rows:
        total = sum(Fraction(p) for p in chances.values())
        chain.append(({t: Fraction(p) / total for t, p in chances.items()}, Fraction(cost)))
    ended = [*chain, None, None]
    costs, chances = chain_values(ended, [n, n + 1], cost=True), chain_values(ended, [n + 1], cost=False)
    return [Fraction(cost) + chance for cost, chance in zip(costs[:n], chances[:n], strict=True)]


def random_rows(seed: int, nodes: int) -> list[tuple[dict[int, float], float]]:
    """Return random rows; every node leads to one with a larger number or to a sink, too, often with a small probability."""
    random = Random(seed)
    rows = []
    for node in range(nodes):
        targets = {random.randrange(nodes) for _ in range(3)} | {random.choice([node + 1, nodes, nodes + 1])}
        weights = {t: random.choice([1e-6, 0.01, 1.0, 3.0]) for t in targets}
        total = sum(weights.values())
        rows.append(({t: w / total for t, w in weights.items()}, float(random.choice([0, 0, 1, 2]))))
    return rows


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("seed", range(15))
def test_every_method_solves_a_chain(name: str, seed: int) -> None:
    rows = random_rows(seed, 2 + seed % 7)
    solved = solve_chain(system_of(rows), (METHODS[name],))
    assert solved is not None
    for high, low, value in zip(solved.high, solved.low, exact_solution(rows), strict=True):
        assert abs(Fraction(float(high)) + Fraction(float(low)) - value) <= Fraction(1e-13) * value


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dense elimination", "elimination"])
@pytest.mark.parametrize("forward", [0.4, 0.2, 0.1])
def test_elimination_keeps_its_digits_where_a_walk_takes_1e18_steps(name: str, forward: float) -> None:
    nodes = {0.4: 100, 0.2: 28, 0.1: 18}[forward]
    rows = [({i + 1: forward, max(i - 1, 0): 1 - forward}, 1.0) for i in range(nodes)]
    solved = solve_chain(system_of(rows), (METHODS[name],))
    assert solved is not None
    expected = exact_solution(rows)
    assert expected[0] > 1e16
    for value, high in zip(expected, solved.high, strict=True):
        assert abs(Fraction(float(high)) - value) <= Fraction(1e-11) * value


def test_a_row_that_cannot_be_left_is_refused() -> None:
    rows = [({1: 1.0}, 1.0), ({0: 1.0}, 1.0)]
    for method in (METHODS["dense elimination"], METHODS["elimination"]):
        assert method.build(system_of(rows)) is None
    assert solve_chain(system_of(rows), (METHODS["dense"],)) is None


def test_factors_that_fill_are_noticed_and_krylov_takes_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ordering, "LEAST_FILL", 1000)
    monkeypatch.setattr(ordering, "MOST_FILL", 1)
    monkeypatch.setattr(ordering, "MOST_FIRST_FILL", 1)
    monkeypatch.setattr(linear, "MOST_DENSE", 0)
    random = np.random.default_rng(1)
    targets = random.integers(0, 200, (200, 3)).tolist()
    rows = [({**dict.fromkeys(own, 0.3), 200: 1 - 0.3 * len(set(own))}, 1.0) for own in targets]
    system = system_of(rows)
    assert sparse.elimination(system) is None
    monkeypatch.setenv("RATHERTHAN_COMPILE", "always")
    solved = solve_chain(system)
    assert solved is not None
    assert solved.method.build is sparse.krylov or not methods_for(system)[0].entrywise
    assert solved.exactness <= 1

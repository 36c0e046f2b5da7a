"""The drift of a vector along rows, and that its rounding error is no larger than is said."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_models import problem_of

from ratherthan.model.index import build_index
from ratherthan.model.objective import Discounted
from ratherthan.solve import solve
from ratherthan.solve.system import System, build_system, drift, exchanged, rows_of, two_sum

SIZES = st.sampled_from([0.0, 1e-300, 1e-17, 1e-9, 0.1, 1 / 3, 1.0, 1.0 + 2**-52, 7.0, 1e9, 1e17])


def line(probabilities: list[float], targets: list[int], cost: float, nodes: int) -> System:
    """Return a system in which every node has the same single row."""
    k = len(targets)
    return System(
        node_to_rows=np.arange(nodes + 1),
        row_to_branches=np.arange(0, k * nodes + 1, k),
        target=np.array(targets * nodes),
        probability=np.array(probabilities * nodes),
        cost=np.full(nodes, cost),
        source=np.arange(nodes),
    )


def exact_drift(system: System, row: int, parts: list[np.ndarray], one: float = 1.0) -> Fraction:
    """Return cost + Σ p (x(t) - x(s)) over fractions, probabilities normalised."""
    span = slice(int(system.row_to_branches[row]), int(system.row_to_branches[row + 1]))
    x = [sum(Fraction(float(part[s])) for part in parts) for s in range(system.nodes)] + [Fraction(0), Fraction(one)]
    chances = [Fraction(float(p)) for p in system.probability[span]]
    steps = [x[t] - x[int(system.row_node[row])] for t in system.target[span]]
    return Fraction(float(system.cost[row])) + sum(p * d for p, d in zip(chances, steps, strict=True)) / sum(chances)


@given(
    weights=st.lists(st.integers(1, 1000), min_size=1, max_size=6),
    values=st.lists(SIZES, min_size=3, max_size=3),
    low=st.lists(st.sampled_from([0.0, 1e-18, -1e-25, 3e-33]), min_size=3, max_size=3),
    cost=SIZES,
    data=st.data(),
)
def test_the_exact_drift_lies_within_its_error(weights, values, low, cost, data) -> None:
    targets = data.draw(st.lists(st.integers(0, 4), min_size=len(weights), max_size=len(weights)))
    system = line([w / sum(weights) for w in weights], targets, cost, 3)
    parts = [np.array(values), np.array(low)]
    total, error = drift(system, *parts)
    for row in range(3):
        exact = exact_drift(system, row, parts)
        assert abs(exact - Fraction(float(total[row]))) <= Fraction(float(error[row]))


def test_where_nothing_moves_the_drift_is_exactly_0() -> None:
    system = line([0.1, 0.2, 0.7], [0, 1, 1], 0.0, 2)
    total, error = drift(system, np.array([1 / 3, 1 / 3]), np.array([1e-20, 1e-20]))
    assert total.tolist() == [0, 0]
    assert error.tolist() == [0, 0]


def test_a_product_that_vanishes_is_still_counted_as_error() -> None:
    system = line([1e-200, 1.0], [1, 0], 0.0, 1)  # to the sink of value 0, else it stays
    total, error = drift(system, np.array([1e-200]))
    assert total[0] == 0
    assert error[0] > 0


@pytest.mark.parametrize("chance", [5e-324, 1.5e-323, 1e-310, 2.3e-308])
@pytest.mark.parametrize("discount", [0.1, 0.5, 0.95, 0.999])
@pytest.mark.parametrize("far", [1.0, 1e150, -1e300])
def test_the_exact_drift_lies_within_its_error_where_a_discount_is_lost(
    chance: float, discount: float, far: float
) -> None:
    index = build_index(np.array([0, 1, 2]), np.array([0, 2, 3]), np.array([0, 1, 1]))
    probability = np.array([1.0, chance, 1.0])
    system = build_system(index, probability, np.zeros(2), np.arange(2), np.arange(2), signed=True, discount=discount)
    near = discount * chance * far
    total, error = drift(system, np.array([near, far]))
    chances = Fraction(discount) / (1 + Fraction(chance))
    exact = chances * (Fraction(near) + Fraction(chance) * Fraction(far)) - Fraction(near)
    assert abs(Fraction(float(total[0])) - exact) <= Fraction(float(error[0]))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("round_", [False, True])
def test_discounted_bounds_hold_where_a_discount_is_lost(seed: int, round_: bool) -> None:
    chance, discount = [5e-324, 1e-323, 1.5e-323, 3e-323][seed], 0.95
    level = Discounted(reward="cost", discount=discount, maximise=False)
    start = ([(1.0, 0 if round_ else 2), (chance, 1)], 0.0)
    rows = {0: {"go": start}, 1: {"go": ([(1.0, 2)], 1e150)}, 2: {"stay": ([(1.0, 2)], 0.0)}}
    solution = solve(problem_of(rows, level, goals=[2]))
    own = Fraction(discount) * Fraction(chance) / (1 + Fraction(chance)) * Fraction(1e150)
    if round_:
        own /= 1 - Fraction(discount) / (1 + Fraction(chance))
    lower, upper = float(solution.lower[0, 0]), float(solution.upper[0, 0])
    assert lower == -np.inf or Fraction(lower) <= own
    assert upper == np.inf or own <= Fraction(upper)


def test_staying_in_place_costs_no_digits() -> None:
    escape = 1e-12
    system = line([1 - escape, escape], [0, 1], 1.0, 1)
    total, error = drift(system, np.array([1e12]))
    assert abs(total[0]) <= error[0] < 1e-13


def test_two_sum_loses_nothing() -> None:
    high, low = np.array([1e16, 1.0, -3.0]), np.array([1.0, 1e-20, 1e-5])
    total, rest = two_sum(high, low)
    for before, after in zip(zip(high, low, strict=True), zip(total, rest, strict=True), strict=True):
        assert sum(map(Fraction, map(float, before))) == sum(map(Fraction, map(float, after)))


def test_rows_that_cannot_leave_their_node_are_dropped_and_merged_states_share_a_node() -> None:
    index = build_index(np.array([0, 2, 3, 4]), np.arange(5), np.array([1, 2, 0, 2]))
    probability, cost = np.ones(4), np.array([1.0, 2.0, 0.0, 0.0])
    system = build_system(index, probability, cost, np.arange(3), np.array([0, 0, 1]))
    assert system.nodes == 1
    assert system.source.tolist() == [1], "the rows between the merged states are gone"
    assert system.target.tolist() == [1], "their goal is the sink of value 0"
    assert rows_of(system, np.array([0])).cost.tolist() == [2.0]


@pytest.mark.parametrize("stay", [0.0, 0.5])
def test_what_stays_is_not_exchanged(stay: float) -> None:
    system = line([stay, 1 - stay] if stay else [1.0], [0, 1] if stay else [1], 0.0, 1)
    assert exchanged(system, np.array([4.0])).tolist() == [4.0 * (1 - stay)]

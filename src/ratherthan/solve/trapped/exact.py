"""Values in two parts enter, the sign of their drift leaves, told to some thirty digits.

Which side a vector x lies on is told by D(a) = Σ p(a, t) (x(t) - x(s)) being at least or at most 0. Where nothing is paid, that
does not depend on what the probabilities of a row sum to: were they divided by their exact sum, D would be divided by it, too.
So D may be computed from the doubles of the model as they stand (of a system that is `given`), and as exactly as wanted.

Where a policy can wander about for a very long time and lose hardly anything with it (near an end component) this is needed. The
drift of one step there may be 1e-20, and an error of 1e-16 per step adds up to more than 1.

**Arithmetic.** A *double word* is an unevaluated sum of two doubles, high + low with high = RN(high + low). With u = 2⁻⁵³,
the sum and the difference of two of them miss the exact one by at most 3u² + 13u³, relatively, whatever cancels (algorithm 6
of Joldes, Muller and Popescu, AccurateDWPlusDW), the product with a double by at most 2u² (algorithm 7, DWTimesFP1: 1.5u² + 4u³).
A row of k branches takes k differences, k products and k sums, whose partial sums are at most W = Σ p |x(t) - x(s)| (1 + small):
the sum misses D by at most (3 + 2 + 3k + small) u² W. Twice this and more is allowed for, (k + 8) · 8u² · W, as W is computed with
rounding, and u |D| for taking the high part alone. Where products underflow the algorithms lose some units of 2⁻¹⁰⁷⁴ each, at most 10 per
branch: sums of doubles never underflow. For that k · 1e-322 is allowed, where anything moves at all.

References
----------
M. Joldes, J.-M. Muller, V. Popescu, Tight and Rigorous Error Bounds for Basic Building Blocks of Double-Word Arithmetic, ACM Trans.
Math. Softw. 44(2), 2017.  T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math. 18, 1971.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ratherthan.model._kernels import compiled, is_compiled
from ratherthan.model.mdp import Floats
from ratherthan.solve.system import UNDERFLOW, System, padded, two_sum
from ratherthan.solve.trapped._kernels import exact_rows

__all__ = ["GRAIN", "exact_drift", "exact_sum", "is_exact"]

UNIT = 8.0 * 2.0**-106
"""The relative error of a drift in two parts, per branch of a row and 8 more."""
GRAIN = 2.0**-103
"""How finely values in two parts are told, relative to their size, with some room."""
LARGEST = 1e290
"""Above this, numbers cannot be parted for an exact product."""

Pair = tuple[Floats, Floats]


def is_exact(system: System) -> bool:
    """Return whether drifts of a system can be computed in two parts: nothing is paid, and its probabilities are given."""
    return system.given and not system.cost.any()


def exact_drift(system: System, high: Floats, low: Floats, one: float = 1.0) -> tuple[Floats, Floats]:
    """Return the drift of x = high + low along every row, times what the row sums to, and a bound of its error.

    Parameters
    ----------
    system : System
        For which `is_exact` holds.
    high, low : array of float, ``[n]``
        At the sinks x is 0 and `one`.
    one : float
        The value of the second sink.

    Returns
    -------
    drift, error : array of float, ``[m]``
        The exact Σ p (x(t) - x(s)) is within ``drift ± error``; NaN where numbers exceed the range of doubles.
    """
    high, low = two_sum(high, low)
    high, low = padded(high, one), padded(low, 0.0)
    work = len(system.target)
    if not (np.abs(high) < LARGEST).all():
        return np.full(system.rows, np.nan), np.full(system.rows, np.nan)
    if is_compiled(work):
        kernel = compiled(exact_rows, work)
        total, weight, moved = kernel(
            system.row_node, system.row_to_branches, system.target, system.probability, high, low
        )
    else:
        total, weight, moved = _exact_rows(system, high, low)
    count = np.diff(system.row_to_branches)
    error = (count + 8) * UNIT * weight + 2.0**-53 * np.abs(total) + np.where(moved, count * UNDERFLOW, 0.0)
    return total, error


def exact_sum(one: Pair, other: Pair) -> Pair:
    """Return the sum of two vectors in two parts."""
    return _added(two_sum(*one), two_sum(*other))


def _exact_rows(system: System, high: Floats, low: Floats) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """Return the same as the kernel `exact_rows`, branch by branch of all rows at once."""
    own, begin, count = system.row_node, system.row_to_branches[:-1], np.diff(system.row_to_branches)
    total: Pair = np.zeros(system.rows), np.zeros(system.rows)
    weight, moved = np.zeros(system.rows), np.zeros(system.rows, dtype=np.bool_)
    for k in range(int(count.max(initial=0))):
        rows = np.flatnonzero(count > k)
        branch = begin[rows] + k
        target, node = system.target[branch], own[rows]
        step = _added((high[target], low[target]), (-high[node], -low[node]))
        part = _times(step, system.probability[branch])
        weight[rows] += np.abs(part[0])
        moved[rows] |= (step[0] != 0.0) | (step[1] != 0.0)
        total[0][rows], total[1][rows] = _added((total[0][rows], total[1][rows]), part)
    return total[0], weight, moved


def _added(one: Pair, other: Pair) -> Pair:
    """Return the sum of double words (AccurateDWPlusDW)."""
    first, first_lost = two_sum(one[0], other[0])
    second, second_lost = two_sum(one[1], other[1])
    step, rest = _fast_sum(first, first_lost + second)
    return _fast_sum(step, second_lost + rest)


def _times(one: Pair, factor: Floats) -> Pair:
    """Return a double word times a double (DWTimesFP1)."""
    product, lost = _product(one[0], factor)
    step, rest = _fast_sum(product, one[1] * factor)
    return _fast_sum(step, rest + lost)


def _fast_sum(large: Floats, small: Floats) -> Pair:
    """Return the sum and what it lost, exactly where |large| ≥ |small|."""
    total = large + small
    return total, small - (total - large)


def _product(one: Floats, other: Floats) -> Pair:
    """Return the product and what it lost (Dekker), exactly where nothing underflows."""
    product = one * other
    (head, tail), (other_head, other_tail) = _parted(one), _parted(other)
    lost = tail * other_tail - (((product - head * other_head) - tail * other_head) - head * other_tail)
    return product, lost


def _parted(number: Floats) -> Pair:
    """Return a number as the sum of two of 26 digits."""
    scaled = 134217729.0 * number
    head = scaled - (scaled - number)
    return head, number - head

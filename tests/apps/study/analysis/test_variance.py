"""The one-way analysis of variance against certified values, exact fractions and other libraries."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.apps.study.analysis.published import published_f
from ratherthan.apps.study.analysis.statistics import NotComputableError
from ratherthan.apps.study.analysis.statistics.variance import noncentral_share, one_way, tukey, welch

CERTIFIED = {  # between and within squares, F, R²
    "SiRstv": (5.11462616000000e-02, 2.16636560000000e-01, 1.18046237440255e00, 1.90999039051129e-01),
    "SmLs01": (1.68, 1.80, 21.0, 4.82758620689655e-01),
    "SmLs04": (1.68, 1.80, 21.0, 4.82758620689655e-01),
}


def nist(path):
    groups: dict[str, list[float]] = {}
    for line in path.read_text(encoding="ascii").splitlines()[60:]:
        if line.strip():
            name, value = line.split()
            groups.setdefault(name, []).append(float(value))
    return [np.array(group) for group in groups.values()]


def digits(found, certified):
    return math.inf if found == certified else -math.log10(abs(found - certified) / abs(certified))


def exact(groups):
    """F by fractions: nothing is rounded."""
    numbers = [[Fraction(float(x)) for x in group] for group in groups]
    total = sum(map(len, numbers))
    mean = sum(map(sum, numbers)) / total
    means = [sum(group) / len(group) for group in numbers]
    between = sum(len(g) * (m - mean) ** 2 for g, m in zip(numbers, means, strict=True))
    within = sum((x - m) ** 2 for g, m in zip(numbers, means, strict=True) for x in g)
    return between, within, (between / (len(groups) - 1)) / (within / (total - len(groups))) if within else None


def simon_lesage(leading, replicates):
    """The generated data sets of NIST, from their definition: nine treatments about leading + 0.2 + i/10, alternating by ±0.1."""
    groups = []
    for treatment in range(9):
        centre = leading + (0.4, 0.3, 0.2, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)[treatment]
        groups.append(np.array([centre] + [centre + (-0.1 if i % 2 else 0.1) for i in range(1, replicates)]))
    return groups


@pytest.mark.parametrize(("name", "least"), [("SiRstv", 12), ("SmLs01", 13), ("SmLs04", 9)])
def test_certified_values_hold(shared_data, name, least):
    found = one_way(nist(shared_data / "stats" / "nist-anova" / f"{name}.dat"))
    between, within, f, share = CERTIFIED[name]
    assert digits(found.f, f) > least
    assert digits(found.squares_between, between) > least
    assert digits(found.squares_within, within) > least
    assert digits(found.eta2, share) > least


@pytest.mark.parametrize("name", ["SiRstv", "SmLs01", "SmLs04"])
def test_of_the_numbers_as_stored_nearly_every_digit_is_right(shared_data, name):
    groups = nist(shared_data / "stats" / "nist-anova" / f"{name}.dat")
    found = one_way(groups)
    between, within, f = exact(groups)
    assert digits(found.f, float(f)) > 14
    assert digits(found.squares_between, float(between)) > 14
    assert digits(found.squares_within, float(within)) > 14


@pytest.mark.parametrize("replicates", [21, 201])
def test_thirteen_leading_digits_cost_no_more_than_storing_them_does(replicates):
    groups = simon_lesage(1e12, replicates)
    found = one_way(groups)
    between, within, f = exact(groups)
    assert digits(found.f, float(f)) > 12
    assert digits(found.squares_between, float(between)) > 12
    assert digits(found.squares_within, float(within)) > 12


samples = st.lists(
    st.lists(st.floats(-100, 100, allow_nan=False).map(lambda x: round(x, 3)), min_size=2, max_size=8),
    min_size=2,
    max_size=5,
)


@given(samples)
def test_f_is_that_of_exact_arithmetic_and_of_scipy(lists):
    from scipy.stats import f_oneway

    groups = [np.array(group) for group in lists]
    between, within, _ = exact(groups)
    if within <= Fraction(1, 10**6):
        return
    found = one_way(groups)
    assert found.squares_between == pytest.approx(float(between), rel=1e-9, abs=1e-9)
    assert found.squares_within == pytest.approx(float(within), rel=1e-9)
    twin = f_oneway(*groups)
    assert found.f == pytest.approx(twin.statistic, rel=1e-6, abs=1e-9)
    if twin.statistic < 0.0:  # by rounding, where the means are equal: the twin has no p then
        assert found.p == pytest.approx(1.0, abs=1e-9)
    else:
        assert found.p == pytest.approx(twin.pvalue, rel=1e-6, abs=1e-12)


@given(samples, st.floats(0.01, 100), st.floats(-1000, 1000))
def test_f_does_not_change_with_unit_and_origin(lists, unit, origin):
    groups = [np.array(group) for group in lists]
    if exact(groups)[1] <= Fraction(1, 10**3):
        return
    one, other = one_way(groups), one_way([unit * group + origin for group in groups])
    assert other.f == pytest.approx(one.f, rel=1e-5, abs=1e-6)


def test_the_interval_of_the_share_leaves_f_at_its_ends():
    from scipy.stats import ncf

    low, high = noncentral_share(3.5, 6, 293)
    for share, probability in ((low, 0.975), (high, 0.025)):
        assert ncf.cdf(3.5, 6, 293, share * 300 / (1 - share)) == pytest.approx(probability, abs=1e-6)
    assert noncentral_share(0.2, 6, 293)[0] == 0.0
    assert noncentral_share(math.inf, 6, 293) is None


def test_omega_is_smaller_than_eta_and_never_below_zero():
    random = np.random.default_rng(5)
    for effect in (0.0, 0.3, 2.0):
        found = one_way([random.normal(i * effect, 1, 12) for i in range(4)])
        assert 0.0 <= found.omega2 <= found.eta2 <= 1.0


def test_tukey_is_that_of_scipy_and_of_statsmodels():
    pytest.importorskip("statsmodels", reason="needs statsmodels, an oracle")
    from scipy.stats import tukey_hsd
    from statsmodels.stats.multicomp import pairwise_tukeyhsd

    random = np.random.default_rng(3)
    groups = [random.normal(i / 3, 1, n) for i, n in enumerate((9, 14, 11, 20))]
    twin = tukey_hsd(*groups)
    interval = twin.confidence_interval()
    third = pairwise_tukeyhsd(np.concatenate(groups), np.repeat(np.arange(4), [9, 14, 11, 20]))
    for place, pair in enumerate(tukey(groups)):
        at = pair.first, pair.second
        assert pair.difference == pytest.approx(twin.statistic[at], abs=1e-12)
        assert pair.p == pytest.approx(twin.pvalue[at], abs=1e-8)
        assert (pair.low, pair.high) == pytest.approx((interval.low[at], interval.high[at]), abs=1e-6)
        assert pair.difference == pytest.approx(-third.meandiffs[place], abs=1e-12)


def test_welch_is_that_of_statsmodels():
    pytest.importorskip("statsmodels", reason="needs statsmodels, an oracle")
    from statsmodels.stats.oneway import anova_oneway

    random = np.random.default_rng(4)
    groups = [random.normal(i / 2, 1 + i, n) for i, n in enumerate((9, 14, 11))]
    twin, found = anova_oneway(groups, use_var="unequal"), welch(groups)
    assert (found.f, found.p) == pytest.approx((twin.statistic, twin.pvalue), rel=1e-9)


@pytest.mark.parametrize(
    "groups",
    [
        [],
        [np.array([1.0, 2.0])],
        [np.array([1.0]), np.array([2.0])],
        [np.array([]), np.array([1.0, 2.0])],
        [np.full(5, 3.0)] * 2,
    ],
)
def test_what_has_no_answer_says_so(groups):
    with pytest.raises(NotComputableError, match=r"\."):
        one_way(groups)


def test_constant_groups_are_refused_whatever_their_size():
    for constant in (0.1, 1e12, 3.3e-5):
        with pytest.raises(NotComputableError, match="the same"):
            one_way([np.full(7, constant), np.full(9, constant + abs(constant))])


def test_the_published_p_follows_from_the_published_f():
    assert round(published_f()["time"].p, 4) == 0.0064
    assert published_f()["time"].p == pytest.approx(0.0064, abs=5e-5)
    assert published_f()["understanding"].p < 0.00001
    assert published_f()["trust"].p < 0.00001

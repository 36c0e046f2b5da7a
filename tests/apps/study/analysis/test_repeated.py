"""Repeated measures, contrasts, the mixed model and ranks against other libraries and against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ratherthan.apps.study.analysis.preferring import Lacking, attempted
from ratherthan.apps.study.analysis.statistics import NotComputableError
from ratherthan.apps.study.analysis.statistics.corrections import holm
from ratherthan.apps.study.analysis.statistics.mixed import mixed
from ratherthan.apps.study.analysis.statistics.ranks import friedman, kruskal, mann_whitney, wilcoxon
from ratherthan.apps.study.analysis.statistics.repeated import paired, repeated, unpaired


def a_table(persons=24, kinds=5, seed=1):
    random = np.random.default_rng(seed)
    spread = np.linspace(0.2, 2.0, kinds)
    return (
        3
        + random.normal(0, 1, (persons, 1))
        + random.normal(0, 1, (persons, kinds)) * spread
        + np.linspace(0, 0.8, kinds)
    )


def long(table):
    pd = pytest.importorskip("pandas", reason="needs pandas, an oracle")
    persons, kinds = table.shape
    return pd.DataFrame(
        {"person": np.repeat(np.arange(persons), kinds), "kind": np.tile(np.arange(kinds), persons), "y": table.ravel()}
    )


def test_f_is_that_of_statsmodels():
    pytest.importorskip("statsmodels", reason="needs statsmodels, an oracle")
    from statsmodels.stats.anova import AnovaRM

    table = a_table()
    twin = AnovaRM(long(table), "y", "person", within=["kind"]).fit().anova_table
    found = repeated(table)
    assert found.f == pytest.approx(float(twin["F Value"].iloc[0]), rel=1e-9)
    assert found.p_uncorrected == pytest.approx(float(twin["Pr > F"].iloc[0]), rel=1e-8)


@pytest.mark.filterwarnings("ignore")  # the oracle's own
@pytest.mark.parametrize("seed", range(4))
def test_everything_is_that_of_pingouin(seed):
    pingouin = pytest.importorskip("pingouin", reason="needs pingouin, an oracle that nothing else needs")
    table = a_table(seed=seed)
    frame = long(table)
    twin = pingouin.rm_anova(frame, dv="y", within="kind", subject="person", correction=True, effsize="ng2").iloc[0]
    found = repeated(table)
    names = {name.lower().replace("_", "-"): name for name in twin.index}
    assert found.f == pytest.approx(float(twin["F"]), rel=1e-9)
    assert found.epsilon == pytest.approx(float(twin["eps"]), rel=1e-6)
    assert found.p == pytest.approx(float(twin[names["p-gg-corr"]]), rel=1e-4)
    assert found.eta2 == pytest.approx(float(twin["ng2"]), rel=1e-6)


def test_epsilon_is_that_of_its_definition():
    table = a_table(kinds=6)
    basis = np.linalg.qr(np.column_stack([np.ones(6), np.eye(6)[:, 1:]]))[0][:, 1:]
    part = basis.T @ np.cov(table, rowvar=False) @ basis
    expected = np.trace(part) ** 2 / (5 * np.trace(part @ part))
    assert repeated(table).epsilon == pytest.approx(expected, rel=1e-12)


def test_generalised_eta_is_that_of_its_definition():
    table = a_table()
    grand = table.mean()
    kinds = len(table) * ((table.mean(axis=0) - grand) ** 2).sum()
    total = ((table - grand) ** 2).sum()
    found = repeated(table)
    assert found.eta2 == pytest.approx(kinds / total, rel=1e-12)
    assert found.eta2_interval[0] < found.eta2 < found.eta2_interval[1]


def test_of_two_kinds_f_is_t_squared():
    table = a_table(kinds=2)
    found, contrast = repeated(table), paired(table[:, 0], table[:, 1])
    assert found.f == pytest.approx(contrast.t**2, rel=1e-10)
    assert found.p == pytest.approx(contrast.p, rel=1e-8)
    assert found.epsilon == 1.0


tables = arrays(
    float, st.tuples(st.integers(3, 8), st.integers(2, 5)), elements=st.floats(-5, 5).map(lambda x: round(x, 2))
)


@given(tables, st.integers(0, 2**32 - 1))
def test_what_differs_between_persons_alone_changes_nothing(table, seed):
    moved = table + np.random.default_rng(seed).normal(0, 3, (len(table), 1))
    try:
        one = repeated(table)
    except NotComputableError:
        return
    if one.f > 1e8:
        return
    other = repeated(moved)
    assert other.f == pytest.approx(one.f, rel=1e-5, abs=1e-8)
    assert other.epsilon == pytest.approx(one.epsilon, rel=1e-5)
    assert 1 / (table.shape[1] - 1) - 1e-12 <= one.epsilon <= 1.0
    assert 0 <= one.p <= 1


@given(tables)
def test_whatever_comes_there_is_a_number_or_a_reason(table):
    for compute in (repeated, friedman):
        found = attempted(lambda: compute(table))  # noqa: B023 - called at once
        if isinstance(found, Lacking):
            assert found.why.endswith(".")
        else:
            assert np.isfinite([value for value in vars(found).values() if isinstance(value, float)]).all()


def test_contrasts_are_the_t_tests_of_scipy():
    from scipy.stats import ttest_ind, ttest_rel

    table = a_table()
    one, twin = paired(table[:, 0], table[:, 3]), ttest_rel(table[:, 0], table[:, 3])
    assert (one.t, one.p) == pytest.approx((twin.statistic, twin.pvalue), rel=1e-10)
    ends = twin.confidence_interval()
    assert (one.low, one.high) == pytest.approx((ends.low, ends.high), rel=1e-9)
    other, twin = unpaired(table[:, 0], table[:15, 3]), ttest_ind(table[:, 0], table[:15, 3], equal_var=False)
    assert (other.t, other.p, other.freedom) == pytest.approx((twin.statistic, twin.pvalue, twin.df), rel=1e-10)


@pytest.mark.parametrize("shift", [0.0, 0.4, 3.0, 40.0])
def test_the_interval_of_the_paired_size_leaves_t_at_its_ends(shift):
    from scipy.stats import nct

    random = np.random.default_rng(8)
    first, second = random.normal(shift, 1, 60), random.normal(0, 1, 60)
    found = paired(first, second)
    scale = found.paired_size / found.size
    for end, probability in ((found.size_low, 0.975), (found.size_high, 0.025)):
        noncentrality = end * scale * np.sqrt(60)
        assert nct.cdf(found.t, 59, noncentrality) == pytest.approx(probability, abs=1e-5)


def test_differences_that_are_all_alike_are_no_evidence():
    with pytest.raises(NotComputableError, match="same difference"):
        paired(np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 2.0]))
    with pytest.raises(NotComputableError, match="two or more persons"):
        paired(np.array([1.0]), np.array([2.0]))
    with pytest.raises(NotComputableError, match="the same"):
        unpaired(np.full(4, 2.0), np.full(5, 3.0))


def test_holm_is_that_of_statsmodels():
    pytest.importorskip("statsmodels", reason="needs statsmodels, an oracle")
    from statsmodels.stats.multitest import multipletests

    values = [0.011, 0.002, 0.2, 0.04, 0.9, 0.0301]
    assert holm(values) == pytest.approx(list(multipletests(values, method="holm")[1]))
    assert holm([None, 0.03, None]) == [None, 0.03, None]
    assert holm([]) == []


def test_ranks_are_those_of_scipy():
    from scipy import stats

    random = np.random.default_rng(2)
    table = random.integers(1, 6, (30, 4)).astype(float)
    found, twin = friedman(table), stats.friedmanchisquare(*table.T)
    assert (found.statistic, found.p) == pytest.approx((twin.statistic, twin.pvalue), rel=1e-9)
    assert 0 <= found.size <= 1
    groups = [table[:, 0], table[:20, 1] + 1, table[:25, 2]]
    found, twin = kruskal(groups), stats.kruskal(*groups)
    assert (found.statistic, found.p) == pytest.approx((twin.statistic, twin.pvalue), rel=1e-9)
    pair = wilcoxon(table[:, 0], table[:, 1])
    assert pair.p == pytest.approx(stats.wilcoxon(table[:, 0], table[:, 1], method="approx").pvalue, rel=1e-9)
    pair = mann_whitney(table[:, 0], table[:20, 1])
    assert pair.p == pytest.approx(stats.mannwhitneyu(table[:, 0], table[:20, 1]).pvalue, rel=1e-9)
    above = (table[:, 0][:, None] > table[:20, 1]).mean() - (table[:, 0][:, None] < table[:20, 1]).mean()
    assert pair.size == pytest.approx(above, abs=1e-12)


def test_full_agreement_is_one_and_none_is_refused():
    assert friedman(np.tile([1.0, 2.0, 3.0], (5, 1))).size == pytest.approx(1.0)
    with pytest.raises(NotComputableError, match="alike"):
        friedman(np.full((5, 3), 2.0))


def answers(persons=30, kinds=4, maps=3, seed=1):
    random = np.random.default_rng(seed)
    y = (
        random.normal(0, 0.7, (persons, 1, 1))
        + random.normal(0, 0.5, (persons, kinds, 1))
        + random.normal(0, 0.8, (persons, kinds, maps))
    )
    y += np.linspace(0, 0.6, kinds)[None, :, None]
    p, k, m = (x.ravel() for x in np.meshgrid(range(persons), range(kinds), range(maps), indexing="ij"))
    return p, k, m, y.ravel()


def test_with_complete_answers_the_mixed_model_is_the_analysis_of_variance():
    p, k, m, y = answers()
    model = mixed(p, k, m, y)
    table = y.reshape(30, 4, 3).mean(axis=2)
    twin = repeated(table)
    assert model.f == pytest.approx(twin.f, rel=1e-6)
    assert (model.kinds, model.errors) == (twin.kinds, twin.errors)
    assert model.p == pytest.approx(twin.p_uncorrected, rel=1e-5)
    assert model.contrast(3, 0).difference == pytest.approx(table[:, 3].mean() - table[:, 0].mean(), abs=1e-9)


def dense(p, k, m, y, model):
    """The restricted likelihood by one large covariance, at the variances that were found."""
    kinds = k.max() + 1
    same, cell = p[:, None] == p, (p[:, None] == p) & (k[:, None] == k)
    covariance = (
        model.person_variance * same + (model.kind_variance or 0.0) * cell + model.rest_variance * np.eye(len(y))
    )
    x = np.eye(kinds)[k]
    if model.with_maps:
        dummies = np.eye(m.max() + 1)[m]
        x = np.hstack([x, dummies[:, 1:] - dummies[:, :1]])
    inverse = np.linalg.inv(covariance)
    inner = x.T @ inverse @ x
    beta = np.linalg.solve(inner, x.T @ inverse @ y)
    left = y - x @ beta
    freedom = len(y) - x.shape[1]
    logs = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(inner)[1] + left @ inverse @ left
    return -0.5 * (logs + freedom * np.log(2 * np.pi)), beta[:kinds]


def test_the_mixed_model_is_that_of_its_definition_and_no_better_one_is_near():
    p, k, m, y = answers(persons=12)
    keep = np.random.default_rng(0).random(len(y)) < 0.7
    p, k, m, y = p[keep], k[keep], m[keep], y[keep]
    model = mixed(p, k, m, y)
    likelihood, means = dense(p, k, m, y, model)
    assert model.likelihood == pytest.approx(likelihood, rel=1e-9)
    assert model.means == pytest.approx(means, abs=1e-7)
    for name in ("person_variance", "kind_variance", "rest_variance"):
        for factor in (0.9, 1.1):

            class Other:
                pass

            other = Other()
            other.__dict__ |= {
                n: getattr(model, n) for n in ("person_variance", "kind_variance", "rest_variance", "with_maps")
            }
            setattr(other, name, factor * getattr(model, name) + (1e-3 if factor > 1 else 0))
            assert dense(p, k, m, y, other)[0] <= likelihood + 1e-7


@pytest.mark.filterwarnings("ignore")  # the library's own, on its way to the maximum
def test_the_mixed_model_is_that_of_statsmodels():
    pytest.importorskip("statsmodels", reason="needs statsmodels, an oracle")
    from statsmodels.regression.mixed_linear_model import MixedLM

    p, k, _, y = answers(persons=25, maps=1)
    keep = np.random.default_rng(1).random(len(y)) < 0.8
    p, k, y = p[keep], k[keep], y[keep]
    model = mixed(p, k, np.zeros_like(p), y)
    twin = MixedLM(y, np.eye(4)[k], groups=p, exog_re=np.ones((len(y), 1))).fit(reml=True, method=["powell"])
    assert model.likelihood == pytest.approx(float(twin.llf), abs=1e-5)
    assert model.means == pytest.approx(np.asarray(twin.fe_params), abs=1e-3)
    assert model.person_variance == pytest.approx(float(np.asarray(twin.cov_re)[0, 0]), rel=1e-2)
    assert model.kind_variance is None


def test_a_variance_may_be_nothing():
    random = np.random.default_rng(6)
    p, k, m, _ = answers(persons=20)
    y = random.normal(0, 1, len(p)) - np.bincount(p, weights=random.normal(0, 1, len(p)))[p] * 0
    y -= (np.bincount(p, weights=y) / np.bincount(p))[p]  # every person has the same mean: none differ
    model = mixed(p, k, m, y)
    assert model.person_variance == pytest.approx(0.0, abs=1e-6)
    assert np.isfinite([model.f, model.p]).all()


@pytest.mark.parametrize(
    ("p", "k", "y"),
    [
        ([0, 0, 1, 1], [0, 1, 0, 1], [1.0, 2.0, 3.0, 4.0]),  # two persons
        ([0, 1, 2, 3], [0, 1, 0, 1], [1.0, 2.0, 3.0, 4.0]),  # one answer each
        ([0, 0, 1, 1, 2, 2], [0, 1, 0, 1, 0, 1], [2.0] * 6),  # all alike
        ([0, 0, 1, 1, 2, 2], [0, 0, 0, 0, 0, 0], [1.0, 2.0, 3.0, 1.0, 2.0, 2.0]),  # one kind
        ([0, 0, 1, 1, 2, 2], [0, 1, 0, 1, 0, 1], [1.0, 2.0, 2.0, 3.0, 3.0, 4.0]),  # nothing left over
        ([], [], []),
    ],
)
def test_a_mixed_model_that_cannot_be_says_why(p, k, y):
    with pytest.raises(NotComputableError, match=r"\.$"):
        mixed(np.array(p, dtype=np.int64), np.array(k, dtype=np.int64), np.zeros(len(p), dtype=np.int64), np.array(y))

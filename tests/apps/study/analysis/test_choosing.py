"""Shares of choices, their tests, and the ranking, against other libraries and against definitions."""

from __future__ import annotations

import numpy as np
import pytest

from ratherthan.apps.study.analysis.published import published_share
from ratherthan.apps.study.analysis.statistics import NotComputableError
from ratherthan.apps.study.analysis.statistics.choosing import equal_shares, exact_interval, luce, shares, two_kinds


def counts(persons, weights, seed=0, votes=3):
    return np.random.default_rng(seed).multinomial(votes, weights, persons).astype(float)


def test_exact_intervals_are_those_of_scipy():
    from scipy.stats import binomtest

    for votes, of in ((0, 10), (3, 10), (10, 10), (148, 300)):
        twin = binomtest(votes, of).proportion_ci(method="exact")
        assert exact_interval(votes, of) == pytest.approx((twin.low, twin.high), abs=1e-12)


def test_shares_add_up_and_lie_within_their_intervals():
    found = shares(counts(60, [0.5, 0.3, 0.2]))
    assert sum(share.share for share in found) == pytest.approx(1.0)
    assert all(share.low <= share.share <= share.high for share in found)


def test_an_interval_is_wider_where_persons_repeat_themselves():
    once = np.eye(2)[np.random.default_rng(1).integers(0, 2, 60)]
    narrow = shares(counts(60, [0.5, 0.5], votes=3))[0]
    wide = shares(3 * once)[0]
    assert wide.high - wide.low > 1.3 * (narrow.high - narrow.low)


def test_a_share_of_everybody_is_not_certain():
    found = shares(np.tile([3.0, 0.0], (8, 1)))
    assert found[0].share == 1.0
    assert (found[0].low, found[0].high) == pytest.approx(exact_interval(8, 8))
    assert found[1].high > 0.3


def test_persons_count_once_in_the_sign_test():
    votes, persons = two_kinds(np.tile([3.0, 0.0], (4, 1)))
    assert (votes.count, persons.count) == (12, 4)
    assert votes.p < 0.001 < persons.p
    assert persons.p == pytest.approx(2 * 0.5**4)
    assert two_kinds(np.array([[1.0, 1.0], [2.0, 2.0]]))[1].p == 1.0


def test_equal_shares_are_those_of_scipy_and_of_hotelling():
    from scipy.stats import chisquare

    table = counts(50, [0.2, 0.3, 0.3, 0.2])
    votes, persons = equal_shares(table)
    twin = chisquare(table.sum(axis=0))
    assert (votes.statistic, votes.p) == pytest.approx((twin.statistic, twin.pvalue), rel=1e-9)
    assert persons.freedom == (3, 47)
    moved = table[:, [3, 1, 0, 2]]  # which share is left out of the test does not matter
    assert equal_shares(moved)[1].statistic == pytest.approx(persons.statistic, rel=1e-9)
    assert equal_shares(counts(3, [0.25] * 4))[1] is None


def test_hotelling_holds_its_level_where_every_vote_does_not():
    random = np.random.default_rng(3)
    hits = {"votes": 0, "persons": 0}
    for _ in range(400):
        table = 3 * np.eye(4)[random.integers(0, 4, 60)]  # each person chooses the same thrice
        votes, persons = equal_shares(table)
        hits["votes"] += votes.p < 0.05
        hits["persons"] += persons.p < 0.05
    assert hits["persons"] <= 0.09 * 400
    assert hits["votes"] >= 0.15 * 400


def test_worths_are_those_of_choix():
    choix = pytest.importorskip("choix", reason="needs choix, an oracle")
    sets = [(0, 1), (0, 2), (3, 4), (1, 2, 4, 5)]
    tables = [counts(40, np.full(len(items), 1 / len(items)), seed=i) for i, items in enumerate(sets)]
    found = luce(list(zip(sets, tables, strict=True)))
    data = [
        (items[j], tuple(i for i in items if i != items[j]))
        for items, table in zip(sets, tables, strict=True)
        for j, votes in enumerate(table.sum(axis=0))
        for _ in range(int(votes))
    ]
    theta = choix.opt_top1(6, data)
    assert found.worth == pytest.approx(np.exp(theta) / np.exp(theta).sum(), rel=1e-4)
    assert not found.added
    assert all(low < worth < high for low, worth, high in zip(found.low, found.worth, found.high, strict=True))


def test_of_one_pair_the_worths_are_the_shares():
    found = luce([((2, 7), np.array([[30.0, 10.0]]))])
    assert found.items == (2, 7)
    assert found.worth == pytest.approx((0.75, 0.25), abs=1e-9)
    assert found.low == (None, None)


def test_who_always_wins_has_no_worth_without_help():
    table = np.tile([3.0, 0.0], (10, 1))
    found = luce([((0, 1), table)])
    assert found.added
    assert found.worth[0] > found.worth[1] > 0


def test_kinds_that_never_met_are_not_ranked():
    table = counts(10, [0.5, 0.5])
    with pytest.raises(NotComputableError, match="never were"):
        luce([((0, 1), table), ((2, 3), table)])
    with pytest.raises(NotComputableError, match="Nobody"):
        luce([((0, 1), np.zeros((4, 2)))])
    with pytest.raises(NotComputableError, match="Nobody"):
        shares(np.zeros((4, 2)))


def test_published_shares_are_those_printed():
    assert published_share(("naive-state", "constrictive"), "constrictive") == 0.48
    assert published_share(("selective", "naive-path"), "naive-path") == 0.577
    assert published_share(("responsibility", "constrictive", "selective", "contrastive"), "contrastive") == 0.287
    assert published_share(("naive-state", "contrastive"), "contrastive") is None
    assert published_share(("naive-state", "responsibility"), "neither") is None

"""Every claim that is made of a model is confirmed by the re-checker, which shares nothing with the code that made it."""

from __future__ import annotations

from collections import Counter

import pytest
from random_explanations import MODELS, random_case

from ratherthan.verify import Budget, Verdict, verify

CHUNK = 50
EXACT, SWEPT = Budget(), Budget(exact=0)


@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["in fractions", "by sweeps"])
@pytest.mark.parametrize("first", range(0, MODELS, CHUNK))
def test_every_claim_is_confirmed(first: int, budget: Budget) -> None:
    seen: Counter[Verdict] = Counter()
    for seed in range(first, first + CHUNK):
        case = random_case(seed)
        verdicts = verify(case.document, case.problem, budget=budget)
        assert not verdicts.fails, (seed, [str(check) for check in verdicts.of(Verdict.FAILS)])
        seen.update(check.verdict for check in verdicts.checks)
    assert seen[Verdict.HOLDS] > CHUNK
    assert seen[Verdict.UNDECIDED] <= 0.01 * seen.total()


@pytest.mark.parametrize("rounds", [0, 2])
@pytest.mark.parametrize("first", range(0, MODELS, 3 * CHUNK))
def test_little_work_leaves_open_but_contradicts_nothing(first: int, rounds: int) -> None:
    for seed in range(first, first + CHUNK):
        case = random_case(seed)
        verdicts = verify(case.document, case.problem, budget=Budget(exact=0, rounds=rounds))
        assert not verdicts.fails, (seed, [str(check) for check in verdicts.of(Verdict.FAILS)])

"""Every claim that is made of a model is confirmed by the re-checker, which shares nothing with the code that made it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import pytest
from random_explanations import MODELS, Case, random_case, random_rich_case

from ratherthan.verify import Budget, Verdict, verify

CHUNK = 50
EXACT, SWEPT = Budget(), Budget(exact=0)


@pytest.mark.parametrize("case_of", [random_case, random_rich_case], ids=["plain", "rich"])
@pytest.mark.parametrize("budget", [EXACT, SWEPT], ids=["in fractions", "by sweeps"])
@pytest.mark.parametrize("first", range(0, MODELS, CHUNK))
def test_every_claim_is_confirmed(first: int, budget: Budget, case_of: Callable[[int], Case]) -> None:
    seen: Counter[Verdict] = Counter()
    for seed in range(first, first + CHUNK):
        case = case_of(seed)
        verdicts = verify(case.document, case.problem, budget=budget)
        assert not verdicts.fails, (seed, [str(check) for check in verdicts.of(Verdict.FAILS)])
        seen.update(check.verdict for check in verdicts.checks)
    assert seen[Verdict.HOLDS] > CHUNK
    assert seen[Verdict.UNDECIDED] <= (0.01 if case_of is random_case else 0.02) * seen.total()


@pytest.mark.parametrize("case_of", [random_case, random_rich_case], ids=["plain", "rich"])
@pytest.mark.parametrize("rounds", [0, 2])
@pytest.mark.parametrize("first", range(0, MODELS, 3 * CHUNK))
def test_little_work_leaves_open_but_contradicts_nothing(
    first: int, rounds: int, case_of: Callable[[int], Case]
) -> None:
    for seed in range(first, first + CHUNK):
        case = case_of(seed)
        verdicts = verify(case.document, case.problem, budget=Budget(exact=0, rounds=rounds))
        assert not verdicts.fails, (seed, [str(check) for check in verdicts.of(Verdict.FAILS)])

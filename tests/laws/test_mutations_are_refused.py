"""An explanation that was tampered with is refused or contradicted, at whatever place it was changed.

Three adversaries: one changes a place and nothing else; one makes the digest fit; one makes the text and the digest fit. What
the last two may change unnoticed is listed here, with the reason why nothing false is said then.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import pytest
from mutations import Mutant, mutants, retold, sealed
from random_explanations import MODELS, Case, random_case, random_rich_case

from ratherthan.errors import ExplanationError
from ratherthan.model.problem import Problem
from ratherthan.verify import verify

CASES = max(20, MODELS // 15)
PER_CASE = 25

HARMLESS = {
    "source": "where the model came from says nothing of it",
    "tolerance": "numbers that are clearly different or equal stay so when τ is a little other",
    "alpha": "the same states may be critical under another threshold, or it was not asked which",
    "search.horizon": "the same decisions may be found, or they were not asked for",
    "search.toward_goal": "likewise",
    "detail": "there may be no details to tell",
    "state": "no state asked about is the initial state",
    "impact": "ω and q may agree, or not matter",
    "values": "likewise ρ and ρ^π, where the policy is optimal",
    "factors": "another question, to which this is an answer too",
    "policy.given": "where no step is told no policy matters",
    "policy.choices": "it is another policy, of which the same is true",
    "policy.choices.*": "likewise",
    "policy.choices.*.*": "likewise",
    "steps.*.claims": "what is left unsaid is no lie",
    "closing.off_route_open": "fewer decisions may be known for sure than could be",
    "arrival_probability": "the listed policy says nothing of the start, so that nothing is known",
    "arrival_bounds.lower": "likewise",
    "arrival_bounds.upper": "likewise",
    "also": "nothing may be said under what is left out, or the same of both that are swapped",
    "lexicon.actions": "words are free",
    "lexicon.gerunds": "likewise",
    "lexicon.state": "likewise",
    "lexicon.states": "likewise",
    "lexicon.objectives": "likewise",
}
"""Places that may be changed without a lie."""
VAGUE = ("count.lower", "count.upper")
"""With several levels a count, or what is critical, may be known less well: a further level rests on what is equal before."""


def noticed(mutant: Mutant, problem: Problem) -> bool:
    """Return whether a mutant is refused or contradicted."""
    try:
        return verify(mutant.document, problem).fails
    except ExplanationError:
        return True


def harmless(mutant: Mutant, case: Case) -> bool:
    """Return whether a change at this place need not be a lie."""
    several = len(case.document["levels"]) > 1
    if mutant.how in ("without alternatives", "without world"):  # for pictures; older documents have neither
        return True
    open_ = mutant.place.endswith("critical") and mutant.how == "open"
    return mutant.place in HARMLESS or (several and (open_ or mutant.place.endswith(VAGUE)))


BOTH = pytest.mark.parametrize("case_of", [random_case, random_rich_case], ids=["plain", "rich"])


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("seed", range(CASES))
def test_every_change_breaks_the_seal(seed: int, case_of: Callable[[int], Case]) -> None:
    case = case_of(seed)
    for mutant in Random(seed).sample(list(mutants(case.document)), PER_CASE):
        if mutant.document == case.document:
            continue
        with pytest.raises(ExplanationError):
            verify(mutant.document, case.problem)


@BOTH
@pytest.mark.parametrize("seed", range(CASES))
def test_a_change_under_a_new_seal_is_noticed(seed: int, case_of: Callable[[int], Case]) -> None:
    case = case_of(seed)
    changed = [mutant for mutant in mutants(case.document) if not harmless(mutant, case)]
    for mutant in Random(seed).sample(changed, min(PER_CASE, len(changed))):
        if mutant.document != case.document:
            assert noticed(sealed(mutant), case.problem), (mutant.path, mutant.how)


@BOTH
@pytest.mark.parametrize("seed", range(CASES))
def test_a_change_that_is_told_anew_is_noticed(seed: int, case_of: Callable[[int], Case]) -> None:
    case = case_of(seed)
    changed = [mutant for mutant in mutants(case.document) if not harmless(mutant, case)]
    for mutant in Random(seed).sample(changed, min(PER_CASE, len(changed))):
        forged = retold(mutant)
        if forged is not None and mutant.document != case.document:
            assert noticed(forged, case.problem), (mutant.path, mutant.how)

"""A step enters, the reason for it leaves: the words of its claims, level by level, and of what is gained and lost elsewhere."""

from __future__ import annotations

from collections.abc import Mapping

from ratherthan.explain.explanation import Claim, Measured, Step
from ratherthan.narrate.evidence import alternatives, claims_at, measured
from ratherthan.narrate.words import Vocabulary, Wanted

__all__ = ["reason"]

_SIMPLE = {
    "best": "best",
    "among the best": "among",
    "right start only": "start",
    "better step": "step_better",
    "equal step": "step_equal",
}


def reason(words: Vocabulary, step: Step, *, figures: bool = True) -> str:
    """Return why: the words of the outcome claims and the flexibility claim together.

    Parameters
    ----------
    words : Vocabulary
    step : Step
    figures : bool
        Whether numbers are said; of a run they differ from step to step.
    """
    claims = claims_at(step, 0)
    key, outcome = _outcome(words, claims, words.objectives[0])
    flexible = "flexible" if "most flexible" in claims else "plain"
    if outcome is None and "equally flexible" in claims and words.explanation.question.factors == {"constrictiveness"}:
        flexible = "same"
    levels = range(1, len(words.explanation.levels))
    further = "".join(_further(words, step, level, figures=figures) for level in levels)
    if further and flexible == "flexible":
        flexible, further = "plain", further + words.table("further_levels")["flexible"]
    template: str = words.table("reasons")[key][flexible]
    return template.format(**_filled(words, words.objectives[0], key, outcome, figures=figures)) + further


def _further(words: Vocabulary, step: Step, level: int, *, figures: bool) -> str:
    """Return what a further level adds; nothing where it has no claim."""
    key, outcome = _outcome(words, claims_at(step, level), words.objectives[level])
    if outcome is None:
        return ""
    template: str = words.table("further_levels")[key]
    return template.format(**_filled(words, words.objectives[level], key, outcome, figures=figures))


def _filled(words: Vocabulary, wanted: Wanted, key: str, outcome: Claim | None, *, figures: bool) -> dict[str, str]:
    filled = dict(wanted.words)
    if outcome is not None and key.startswith(("worse", "step_finite", "step_dead", "step_fail")):
        filled |= alternatives(words, wanted, outcome)
    return filled if figures else filled | {"numbers": "", "values": ""}


def _outcome(words: Vocabulary, claims: Mapping[str, Claim], wanted: Wanted) -> tuple[str, Claim | None]:
    """Return the row of the reasons' table for the outcome claim, and the claim."""
    if "hopeless" in claims:
        key = "lost" if wanted.record.chance else "hopeless"
        return f"step_{key}" if words.explanation.question.policy_values else key, claims["hopeless"]
    for name, key in _SIMPLE.items():
        if name in claims:
            if name == "right start only" and _without_end(measured(claims[name].evidence.taken), wanted):
                return "endless", claims[name]
            return key + (_infinite_others(claims[name]) if name == "better step" else ""), claims[name]
    for name, key in {"not best": "worse", "worse step": "step"}.items():
        if name in claims:
            fate = measured(claims[name].evidence.taken).fate
            return key + {"dead end": "_dead", "may fail": "_fail", None: "_finite"}[fate], claims[name]
    return "open", None


def _without_end(row: Measured, wanted: Wanted) -> bool:
    """Return whether more and more can be had before arriving: no plan has the most."""
    return wanted.record.kind == "reward" and row.number.infinite and row.fate is None


def _infinite_others(claim: Claim) -> str:
    infinite = [measured(other).fate is not None for other in claim.evidence.others]
    return "_infinite" if all(infinite) else "_mixed" if any(infinite) else ""

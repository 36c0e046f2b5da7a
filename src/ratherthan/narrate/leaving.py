"""An Explanation that does not tell all that matters enters, the sentence about what it leaves out leaves."""

from __future__ import annotations

from ratherthan.explain.telling import matters
from ratherthan.narrate.numbers import at_most
from ratherthan.narrate.words import Vocabulary

__all__ = ["left_out"]


def left_out(words: Vocabulary) -> list[str]:
    """Return how many of how many decisions are told, and what the others change at most."""
    explanation, table = words.explanation, words.table("few")
    left, asked = explanation.closing.left_out, explanation.question
    if left is None:
        untold = sum(not step.told for step in explanation.steps)
        told = sum(step.told and matters(step, asked) for step in explanation.steps)
        return [str(table["steps"]).format(told=told, total=told + untold)] if untold else []
    mattering = [step for step in explanation.steps if matters(step, asked)]
    told = sum(step.told for step in mattering)
    key = "told_open" if any(step.critical is None for step in mattering) else "told"
    kind = "_one" if left.steps == 1 else "_many"
    said = str(table[key]).format(told=told, total=len(mattering))
    clauses = []
    if left.unsure:
        every = "unsure_every" if left.unsure == left.steps else "unsure"
        clauses.append(str(table[every + ("_one" if left.unsure == 1 else "_many")]).format(count=left.unsure))
    level = next((level for level, most in enumerate(left.largest) if most != 0.0), None)
    most = None if level is None else left.largest[level]
    if level is not None and most is not None and left.unsure < left.steps and (level == 0 or not left.unsure):
        rest = "rest" + ("_one" if left.steps - left.unsure == 1 else "_many") if left.unsure else "each" + kind
        wanted = words.objectives[level].words
        chance = words.objectives[level].record.chance  # said in hundredths, as the details are
        unit = words.table("differences")["points"] if chance else wanted["unit"]
        amount = words.language.counted(at_most(100.0 * most if chance else most) + unit)
        clauses.append(str(table[rest]).format(noun=wanted["noun"], largest=amount))
    return [said + "".join(clauses) + str(table["end"])]

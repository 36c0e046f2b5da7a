"""Steps in a row that one sentence tells enter, its words leave: how far, to where, and why; all of it true of each of them."""

from __future__ import annotations

from collections.abc import Sequence

from ratherthan.narrate.details import run_details
from ratherthan.narrate.numbers import percent
from ratherthan.narrate.reasons import reason
from ratherthan.narrate.words import Vocabulary

__all__ = ["run_sentence"]


def run_sentence(words: Vocabulary, place: str, group: Sequence[int], *, begun: bool) -> str:
    """Return the sentence about a run.

    Parameters
    ----------
    words : Vocabulary
    place : str
        Which template: "alone", "first", "then", …
    group : sequence of int
        The indices of its steps.
    begun : bool
        Whether the sentence before ended where this one begins.
    """
    explanation, table, sentences = words.explanation, words.table("runs"), words.table("sentences")
    steps = [explanation.steps[at] for at in group]
    end = explanation.route[group[-1] + 1]
    stretch = table[_counted(words, group[0], words.place(end))].format(count=len(group), end=words.place(end))
    why = reason(words, steps[0], figures=False) + run_details(words, steps)
    if explanation.unfolded is not None and "," in words.place(end) and why.startswith(" "):
        why = f",{why}"
    template: str = table[place]
    return template.format(
        act=words.act(steps[0].action),
        share="" if steps[0].share == 1.0 else sentences["share"].format(percent=percent(steps[0].share)),
        whence="" if begun else _whence(words, steps[0].state),
        stretch=stretch,
        reason=why,
    )


def _counted(words: Vocabulary, at: int, end: str) -> str:
    """Return what is counted along a run: cells where each step leads to the next one, else steps."""
    explanation = words.explanation
    here, there = (explanation.states[state].place for state in explanation.route[at : at + 2])
    if here is None or there is None or words.language.names_several_cells(end):
        return "steps"
    return "cells" if max(abs(there[0] - here[0]), abs(there[1] - here[1])) == 1 else "steps"


def _whence(words: Vocabulary, state: int) -> str:
    """Return from where: "from grid 33, 4 steps left," where what is remembered is told in apposition."""
    place = words.place(state)
    comma = "," if words.explanation.unfolded is not None and "," in place else ""
    return str(words.table("runs")["whence"]).format(place=place) + comma

"""An Explanation enters, what it rests on leaves: names and sentences about the model, what was wanted, the proof and the program."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ratherthan.explain.explanation import Explanation
from ratherthan.narrate.numbers import percent
from ratherthan.narrate.words import Vocabulary
from ratherthan.report.numbers import in_words
from ratherthan.solve.solution import Outcome

__all__ = ["facts_of"]


def facts_of(words: Vocabulary, tables: Mapping[str, Mapping[str, str]], version: str) -> list[tuple[str, str]]:
    """Return what stands under "How this was computed".

    Parameters
    ----------
    words : Vocabulary
    tables : mapping
        The words of the page.
    version : str
        Of the program.
    """
    said = tables["facts"]
    found = [
        *_model(words.explanation, said),
        *_asked(words.explanation, said),
        *_route(words, tables),
        ("version", said["version_text"].format(version=version)),
    ]
    return [(said[key], text) for key, text in found if text]


def _model(explanation: Explanation, said: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    states, choices, branches = (f"{count:,}" for count in explanation.size)
    yield "source", explanation.source
    yield "size", said["size_text"].format(states=states, choices=choices, branches=branches)
    if explanation.unfolded is not None:
        unfolded = explanation.unfolded
        yield (
            "unfolded",
            said["unfolded_text"].format(states=f"{unfolded.states:,}", memories=f"{unfolded.memories:,}"),
        )


def _asked(explanation: Explanation, said: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    asked = explanation.question
    yield "property", explanation.property
    for further in explanation.also:
        yield "also", further.property
    proved = explanation.outcome == Outcome.CERTIFIED.value
    if explanation.route_outcome != "no way":
        yield "plan", said["plan_given" if explanation.policy.given else "plan_best" if proved else "plan_found"]
    yield "outcome", explanation.outcome
    yield "kind", asked.kind
    if "selectiveness" in asked.factors:
        yield "alpha", said["alpha_text"].format(alpha=f"{asked.alpha:g}") if asked.alpha else said["alpha_none"]
    if asked.at_most is not None:
        yield "few", said["few_text"].format(count=asked.at_most, ranking=said[f"by_{asked.ranking}"])
    if asked.omega:
        yield "impact", said["impact_omega"]
    if asked.policy_values:
        yield "values_policy", said["values_policy_text"]


def _route(words: Vocabulary, tables: Mapping[str, Mapping[str, str]]) -> Iterator[tuple[str, str]]:
    explanation, said, spelled = words.explanation, tables["facts"], words.table("numbers")
    if explanation.question.scope != "route":
        return
    yield "route_outcome", said.get(explanation.route_outcome, "")
    steps = len(explanation.route) - 1
    if steps > 0:
        yield "steps", said["steps_one" if steps == 1 else "steps_text"].format(count=f"{steps:,}")
    if explanation.route_outcome == "arrives" and explanation.route_probability is not None:
        yield "route_probability", percent(explanation.route_probability)
    if explanation.arrival is not None:
        _, proof = in_words(explanation.arrival, tables["numbers"], spelled, chance=True)
        yield "arrival", f"{percent(explanation.arrival.value)} ({proof})"
    for total, wanted in zip(explanation.totals, words.objectives, strict=False):
        number, proof = in_words(total, tables["numbers"], spelled, chance=wanted.record.chance)
        yield "totals", f"{wanted.words['noun']}: {number} ({proof})"

"""An Explanation enters, its sentences leave: one line of text, the same every time. All words come from the templates.

A sentence is said only for a claim that the explanation carries; there is nothing to compute here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ratherthan.explain.explanation import Claim, Explanation, Measured, Step, Tally
from ratherthan.model.lexicon import Lexicon
from ratherthan.narrate.contrast import contrast_reason
from ratherthan.narrate.numbers import at_most, contrasted, percent, plain
from ratherthan.narrate.words import Vocabulary, vocabulary
from ratherthan.solve.solution import Outcome

__all__ = ["narrate"]


def narrate(explanation: Explanation, *, lexicon: Lexicon | None = None) -> str:
    """Return the text of an explanation.

    Parameters
    ----------
    explanation : Explanation
    lexicon : Lexicon, optional
        Other words than the explanation's own.

    Returns
    -------
    str
        One line, without a line end; empty for the kind "none".
    """
    words = vocabulary(explanation if lexicon is None else replace(explanation, lexicon=lexicon))
    if explanation.question.scope == "none":
        return ""
    if explanation.question.scope == "state":
        return _state_text(words)
    return _route_text(words)


def _state_text(words: Vocabulary) -> str:
    explanation = words.explanation
    if not explanation.steps:
        return _end(words)
    step = explanation.steps[0]
    if step.foil is not None:
        template: str = words.table("sentences")["rather_than"]
        return template.format(
            foil=words.language.verb_phrase_after(words.act(step.foil), words.act(step.action)),
            reason=contrast_reason(words, step),
            **_parts(words, step),
        )
    return " ".join([_sentence(words, "alone", step), *_unproved(words)])


def _unproved(words: Vocabulary) -> list[str]:
    """Return the warning that belongs to values without a proof."""
    proved = words.explanation.outcome in ("", Outcome.CERTIFIED.value)
    return [] if proved else [words.table("route")["unproved"]]


def _end(words: Vocabulary) -> str:
    explanation = words.explanation
    template: str = words.table("route")[explanation.route_outcome]
    return template.format(place=words.place(explanation.start))


def _route_text(words: Vocabulary) -> str:
    explanation = words.explanation
    if explanation.route_outcome in ("there", "ended"):
        return _end(words)
    if explanation.route_outcome == "no way":
        return _no_way(words)
    if not explanation.steps:  # a policy that says nothing where it starts
        return str(words.table("route")["remain"].format(place=words.place(explanation.start)))
    selective = "selectiveness" in explanation.question.factors
    told = [step for step in explanation.steps if not selective or step.critical is not False]
    sentences = _told(words, told, selective=selective)
    if selective:
        sentences += _closing(words, told)
    if explanation.route_outcome == "circles":
        sentences.append(_circle(words))
    if explanation.route_outcome == "open end" and explanation.route[-2:] == explanation.route[-1:] * 2:
        sentences.append(words.table("route")["remain"].format(place=words.place(explanation.route[-1])))
    return " ".join(sentences + _chances(words) + _unproved(words))


def _told(words: Vocabulary, steps: Sequence[Step], *, selective: bool) -> list[str]:
    """Return a sentence per step, with First, …, Finally around them."""
    between = words.table("order")["selective" if selective else "plain"]
    last = len(steps) - 1
    if last == 0:
        return [_sentence(words, "alone", steps[0])]
    places = ["first" if i == 0 else "finally" if i == last else between[(i - 1) % 2] for i in range(len(steps))]
    return [_sentence(words, place, step) for place, step in zip(places, steps, strict=True)]


def _sentence(words: Vocabulary, place: str, step: Step) -> str:
    template: str = words.table("sentences")[place]
    return template.format(reason=_reason(words, step) + _details(words, step), **_parts(words, step))


def _parts(words: Vocabulary, step: Step) -> dict[str, str]:
    sentences, where = words.table("sentences"), words.place(step.state)
    return {
        "act": words.act(step.action),
        "share": "" if step.share == 1.0 else sentences["share"].format(percent=percent(step.share)),
        "place": where if step.critical is False else words.language.qualified(where, sentences["critical"]),
    }


def _reason(words: Vocabulary, step: Step) -> str:
    """Return why: the words of the outcome claim and the flexibility claim together."""
    claims = {claim.claim: claim for claim in step.claims}
    key, outcome = _outcome(claims, chance=words.explanation.objective.kind != "cost")
    if key in ("hopeless", "lost") and words.explanation.question.policy_values:
        key = f"step_{key}"
    flexible = "flexible" if "most flexible" in claims else "plain"
    if outcome is None and "equally flexible" in claims and words.explanation.question.factors == {"constrictiveness"}:
        flexible = "same"
    template: str = words.table("reasons")[key][flexible]
    filled = dict(words.objective)
    if outcome is not None and key.startswith(("worse", "step_finite", "step_dead", "step_fail")):
        filled |= _alternatives(words, outcome)
    return template.format(**filled)


def _outcome(claims: Mapping[str, Claim], *, chance: bool) -> tuple[str, Claim | None]:
    """Return the row of the reasons' table for the outcome claim, and the claim."""
    simple = {
        "best": "best",
        "among the best": "among",
        "right start only": "start",
        "hopeless": "lost" if chance else "hopeless",
        "better step": "step_better",
        "equal step": "step_equal",
    }
    for name, key in simple.items():
        if name in claims:
            return key + (_infinite_others(claims[name]) if name == "better step" else ""), claims[name]
    for name, key in {"not best": "worse", "worse step": "step"}.items():
        if name in claims:
            fate = _measured(claims[name].evidence.taken).fate
            return key + {"dead end": "_dead", "may fail": "_fail", None: "_finite"}[fate], claims[name]
    return "open", None


def _infinite_others(claim: Claim) -> str:
    infinite = [_measured(other).fate is not None for other in claim.evidence.others]
    return "_infinite" if all(infinite) else "_mixed" if any(infinite) else ""


def _measured(row: Measured | Tally) -> Measured:
    if not isinstance(row, Measured):
        raise TypeError("A claim about outcomes must carry action values as evidence.")
    return row


def _alternatives(words: Vocabulary, claim: Claim) -> dict[str, str]:
    """Return the better alternatives and their numbers in words."""
    numbers, own = words.table("numbers"), _measured(claim.evidence.taken).number.value
    values = [_measured(other).number.value for other in claim.evidence.others]
    chance = words.explanation.objective.kind != "cost"
    return {
        "others": words.alternatives(claim.against),
        "numbers": _pair(words, own, values),
        "values": numbers["values"].format(
            better=words.language.joined([plain(value, numbers, chance=chance) for value in values], "or")
        ),
    }


def _pair(words: Vocabulary, own: float, values: Sequence[float]) -> str:
    """Return better numbers beside the own: all of them, the best where others look like the own, or that it is close."""
    numbers, objective = words.table("numbers"), words.explanation.objective
    chance = objective.kind != "cost"
    pair = contrasted(own, values, numbers, chance=chance)
    if pair:
        listed = words.language.joined(list(dict.fromkeys(pair[1])), "or")
        return str(numbers["pair"].format(better=listed, own=pair[0]))
    pair = contrasted(own, [max(values) if objective.maximise else min(values)], numbers, chance=chance)
    return str(numbers["best"].format(better=pair[1][0], own=pair[0]) if pair else numbers["close"])


def _details(words: Vocabulary, step: Step) -> str:
    """Return what the alternatives would lead to, if it was asked for."""
    if not words.explanation.question.detail:
        return ""
    details, parts = words.table("details"), []
    for claim in step.claims:
        if claim.claim == "only way on":
            parts.append(details["only_way"])
        if claim.claim == "avoids":
            step_only = "_step" if words.explanation.question.policy_values else ""
            for fate, key in (("dead end", "dead_end"), ("may fail", "may_fail" + step_only)):
                actions = [row.action for row in claim.evidence.others if _measured(row).fate == fate]
                if actions:
                    parts.append(details[key].format(others=words.alternatives(actions)))
    return "".join(parts)


def _closing(words: Vocabulary, told: Sequence[Step]) -> list[str]:
    """Return what can be said of the untold steps, and of decisions off the route."""
    route, closing, asked = words.table("route"), words.explanation.closing, words.explanation.question
    noun, sentences = words.objective["noun"], []
    if not told:
        most = _largest_untold(words)
        key = "no_decision_after" if asked.omega and most else "no_decision_by" if most else "no_decision"
        sentences.append(route[key].format(noun=noun, largest=at_most(most)))
    elif closing.printed:
        key = "equivalent" if closing.largest_difference == 0.0 else "at_most"
        largest = "" if closing.largest_difference is None else at_most(closing.largest_difference)
        sentences.append(route[key].format(noun=noun, largest=largest))
    unsure = _unsure(words)
    if unsure:
        sentences.append(
            route["no_choice_sure_step" if asked.policy_values else "no_choice_sure"].format(
                places=words.places(unsure)
            )
        )
    if closing.off_route_open:
        sentences.append(route["off_route_least"].format(count=closing.off_route)) if closing.off_route else None
    elif closing.off_route:
        key = "off_route_one" if closing.off_route == 1 else "off_route_many"
        sentences.append(route[key].format(count=closing.off_route))
    return sentences


def _largest_untold(words: Vocabulary) -> float:
    """Return the largest difference that an untold decision makes; 0 where they are equal, or all without end."""
    closing, asked = words.explanation.closing, words.explanation.question
    if closing.largest_difference is not None:
        return closing.largest_difference
    if asked.alpha == 0.0 and not asked.omega:
        return 0.0
    spreads = [step.spread for step in words.explanation.steps if step.critical is False and step.spread is not None]
    return max((high.value - low.value for high, low in spreads if high.finite and low.finite), default=0.0)


def _unsure(words: Vocabulary) -> list[int]:
    """Return the untold states of the route where every choice costs infinitely much: none is sure to arrive."""
    objective = words.explanation.objective
    if objective.kind != "cost" or objective.maximise:
        return []
    untold = [step for step in words.explanation.steps if step.critical is False and step.spread is not None]
    return list(dict.fromkeys(step.state for step in untold if step.spread is not None and step.spread[1].infinite))


def _no_way(words: Vocabulary) -> str:
    route, explanation = words.table("route"), words.explanation
    place = words.place(explanation.start)
    if explanation.in_the_way:
        return str(route["no_way_hazards"].format(place=place, places=words.places(explanation.in_the_way)))
    reached = [state for state in explanation.circle if state != explanation.start]
    if explanation.circle_size <= 1:
        return str(route["no_way_alone"].format(place=place))
    if explanation.circle_size <= 6:
        return str(route["no_way_few"].format(place=place, places=words.places(reached)))
    return str(route["no_way_many"].format(place=place, count=explanation.circle_size))


def _circle(words: Vocabulary) -> str:
    explanation = words.explanation
    key = "stay" if explanation.circle_size == 1 else "circle"
    if not explanation.circle_certain:
        key += "_perhaps"
    places = words.places(explanation.circle, explanation.circle_size)
    return str(words.table("route")[key].format(places=places))


def _chances(words: Vocabulary) -> list[str]:
    """Return the chance of the route, and of arriving at all, where it is below one half."""
    route, explanation = words.table("route"), words.explanation
    sentences = []
    if explanation.route_outcome != "arrives":
        return []
    if explanation.route_probability is not None and explanation.route_probability < 0.5:
        sentences.append(route["route_chance"].format(percent=percent(explanation.route_probability)))
    if explanation.arrival is not None and explanation.arrival.upper < 0.5:
        sentences.append(route["arrival_chance"].format(percent=percent(explanation.arrival.value)))
    return sentences

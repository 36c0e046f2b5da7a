"""An Explanation enters, its sentences leave: one line of text, the same every time. All words come from the templates.

A sentence is said only for a claim that the explanation carries; there is nothing to compute here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ratherthan.explain.explanation import Explanation, Step
from ratherthan.explain.telling import told_groups
from ratherthan.model.lexicon import Lexicon
from ratherthan.narrate.closed import no_way_through
from ratherthan.narrate.contrast import contrast_reason
from ratherthan.narrate.details import details
from ratherthan.narrate.leaving import left_out
from ratherthan.narrate.numbers import at_most, percent
from ratherthan.narrate.reasons import reason
from ratherthan.narrate.runs import run_sentence
from ratherthan.narrate.sentence import Sentence
from ratherthan.narrate.trades import asides, totals, traded, unbeaten
from ratherthan.narrate.words import Vocabulary, vocabulary
from ratherthan.solve.solution import Outcome

__all__ = ["narrate", "sentences"]


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
    return " ".join(sentence.text for sentence in sentences(explanation, lexicon=lexicon))


def sentences(explanation: Explanation, *, lexicon: Lexicon | None = None) -> tuple[Sentence, ...]:
    """Return the sentences of an explanation: first those about steps, numbered, then what is said of the whole.

    Parameters
    ----------
    explanation : Explanation
    lexicon : Lexicon, optional
        Other words than the explanation's own.
    """
    words = vocabulary(explanation if lexicon is None else replace(explanation, lexicon=lexicon))
    if explanation.question.scope == "none":
        return ()
    if explanation.question.scope == "state":
        return _of_state(words)
    return _of_route(words)


def _of_state(words: Vocabulary) -> tuple[Sentence, ...]:
    explanation = words.explanation
    if not explanation.steps:
        return (Sentence(text=_end(words)),)
    step = explanation.steps[0]
    if step.foil is not None:
        template: str = words.table("sentences")["rather_than"]
        why, more = traded(words, step) if step.trades else (contrast_reason(words, step), "")
        said = template.format(
            foil=words.language.verb_phrase_after(words.act(step.foil), words.act(step.action)),
            reason=_after(words, step, why),
            **_parts(words, step),
        )
        return (Sentence(text=said + more, steps=(0,), number=1),)
    told = Sentence(text=_sentence(words, "alone", step), steps=(0,), number=1)
    return (told, *_plain(_unproved(words)))


def _plain(texts: Sequence[str]) -> tuple[Sentence, ...]:
    return tuple(Sentence(text=text) for text in texts)


def _unproved(words: Vocabulary) -> list[str]:
    """Return the warning that belongs to values without a proof, or with one that is not close enough."""
    outcome = words.explanation.outcome
    if outcome in ("", Outcome.CERTIFIED.value):
        return []
    return [words.table("route")["unproved" if outcome == Outcome.UNCERTIFIED.value else "partly_proved"]]


def _end(words: Vocabulary) -> str:
    explanation = words.explanation
    if explanation.route_outcome == "there":
        return words.objective["there"]
    key = "ended_mission" if explanation.unfolded is not None and explanation.objective.maximise else "ended"
    template: str = words.table("route")[key]
    return template.format(place=words.place(explanation.start), arrive=words.objective["arrive"])


def _of_route(words: Vocabulary) -> tuple[Sentence, ...]:
    explanation = words.explanation
    if explanation.route_outcome in ("there", "ended"):
        return _plain([_end(words)])
    if explanation.route_outcome == "no way":
        return _plain([_no_way(words)])
    if not explanation.steps:  # a policy that says nothing where it starts
        return _plain([words.table("route")["remain"].format(place=words.place(explanation.start))])
    selective = "selectiveness" in explanation.question.factors
    groups = told_groups(explanation)
    told = [explanation.steps[place] for group in groups for place in group]
    whole = left_out(words)
    if selective:
        whole += _closing(words, told)
    if explanation.route_outcome == "circles":
        whole.append(_circle(words))
    whole += _open_end(words)
    whole += _chances(words) + unbeaten(words, told) + totals(words) + _unproved(words)
    return (*_told(words, groups, selective=selective), *_plain(whole))


def _open_end(words: Vocabulary) -> list[str]:
    """Return how a route without a goal goes on: it stays, or a sum without end begins anew."""
    explanation, table = words.explanation, words.table("route")
    last = explanation.route[-1]
    if explanation.route_outcome != "open end":
        return []
    if explanation.route[-2:] == (last, last):
        return [table["remain"].format(place=words.place(last))]
    if explanation.objective.kind != "discounted" or last not in explanation.route[:-1]:
        return []
    surely = explanation.route_probability == 1.0 and all(step.share == 1.0 for step in explanation.steps)
    return [table["again_surely" if surely else "again"].format(place=words.place(last))]


def _told(words: Vocabulary, groups: Sequence[tuple[int, ...]], *, selective: bool) -> list[Sentence]:
    """Return a sentence per group of steps, with First, …, Finally around them."""
    between, steps = words.table("order")["selective" if selective else "plain"], words.explanation.steps
    last, found, before = len(groups) - 1, [], -1
    for i, group in enumerate(groups):
        place = "first" if i == 0 else "finally" if i == last else between[(i - 1) % 2]
        place = place if last else "alone"
        if len(group) == 1:
            text = _sentence(words, place, steps[group[0]])
        else:
            text = run_sentence(words, place, group, begun=group[0] == before + 1 and i > 0)
        found.append(Sentence(text=text, steps=group, number=i + 1))
        before = group[-1]
    return found


def _sentence(words: Vocabulary, place: str, step: Step) -> str:
    template: str = words.table("sentences")[place]
    why = reason(words, step)
    why += asides(words, step, alone=not why) + details(words, step)
    return template.format(reason=_after(words, step, why), **_parts(words, step))


def _after(words: Vocabulary, step: Step, why: str) -> str:
    """Return a reason as it stands after the place: "at grid 5, 8 steps left, because …"."""
    apposed = words.explanation.unfolded is not None and "," in words.place(step.state)
    return f",{why}" if apposed and why.startswith(" ") else why


def _parts(words: Vocabulary, step: Step) -> dict[str, str]:
    sentences, where = words.table("sentences"), words.place(step.state)
    return {
        "act": words.act(step.action),
        "share": "" if step.share == 1.0 else sentences["share"].format(percent=percent(step.share)),
        "place": where if step.critical is False else words.language.qualified(where, sentences["critical"]),
    }


def _closing(words: Vocabulary, told: Sequence[Step]) -> list[str]:
    """Return what can be said of the untold steps, and of decisions off the route."""
    route, closing, asked = words.table("route"), words.explanation.closing, words.explanation.question
    noun, sentences = words.objective["noun"], []
    if not told:
        most = _largest_untold(words)
        if not most and not asked.alpha and not asked.omega:
            nouns = dict.fromkeys(words.objectives[k].words["noun"] for k in range(_levels(words)))
            noun = words.language.joined(list(nouns), "or")
        key = "no_decision_after" if asked.omega and most else "no_decision_by" if most else "no_decision"
        sentences.append(route[key].format(noun=noun, largest=at_most(most)))
    elif closing.printed:
        key = "equivalent" if closing.largest_difference == 0.0 else "at_most"
        key += "" if closing.left_out is None else "_besides"
        largest = "" if closing.largest_difference is None else at_most(closing.largest_difference)
        sentences.append(route[key].format(noun=noun, largest=largest))
    for level in range(_levels(words)):
        unsure = _unsure(words, level)
        if unsure:
            key = "no_choice_sure" + ("_further" if level else "") + ("_step" if asked.policy_values else "")
            sentences.append(route[key].format(places=words.places(unsure)))
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


def _levels(words: Vocabulary) -> int:
    return len(words.explanation.levels)


def _unsure(words: Vocabulary, level: int) -> list[int]:
    """Return the untold states of the route where every choice compared is infinitely bad: none is sure to arrive."""
    objective = words.objectives[level].record
    if objective.kind not in ("cost", "reward") or (objective.kind == "cost" and objective.maximise):
        return []
    found = []
    for step in words.explanation.steps:
        spread = step.spread if level == 0 else next(iter(step.further_spreads[level - 1 : level]), None)
        if step.critical is False and spread is not None:
            best = spread[0 if objective.maximise else 1]
            if best.infinite and (best.lower < 0) == objective.maximise:
                found.append(step.state)
    return list(dict.fromkeys(found))


def _no_way(words: Vocabulary) -> str:
    route, explanation = words.table("route"), words.explanation
    place = words.place(explanation.start)
    arrive = words.objective["arrive"]
    if explanation.unfolded is not None:  # states of a product: what is remembered makes many of one place
        return str(route["no_way_mission"].format(arrive=arrive, place=place))
    if explanation.in_the_way:
        places = words.places(explanation.in_the_way)
        return str(route["no_way_hazards"].format(arrive=arrive, place=place, places=places))
    if explanation.openings:
        return no_way_through(words)
    reached = [state for state in explanation.circle if state != explanation.start]
    if explanation.circle_size <= 1:
        return str(route["no_way_alone"].format(arrive=arrive, place=place))
    if explanation.circle_size <= 6:
        return str(route["no_way_few"].format(arrive=arrive, place=place, places=words.places(reached)))
    return str(route["no_way_many"].format(arrive=arrive, place=place, count=explanation.circle_size))


def _circle(words: Vocabulary) -> str:
    explanation = words.explanation
    key = "circle" if explanation.circle_size > 1 else "stay" if _goes_on(explanation) else "end"
    if not explanation.circle_certain:
        key += "_perhaps"
    places = words.places(explanation.circle, explanation.circle_size)
    return str(words.table("route")[key].format(arrive=words.objective["arrive"], places=places))


def _goes_on(explanation: Explanation) -> bool:
    """Return whether the plan has something to do where it circles; else the objective has ended there, badly."""
    listed = explanation.policy.rows.state
    return any(bool((listed == state).any()) for state in explanation.circle)


def _chances(words: Vocabulary) -> list[str]:
    """Return the chance of the route, and of arriving at all, where it is below one half."""
    route, explanation = words.table("route"), words.explanation
    sentences = []
    if explanation.route_outcome != "arrives":
        return []
    if explanation.route_probability is not None and explanation.route_probability < 0.5:
        sentences.append(route["route_chance"].format(percent=percent(explanation.route_probability)))
    if explanation.arrival is not None and explanation.arrival.upper < 0.5:
        said = route["arrival_chance"].format(percent=percent(explanation.arrival.value), **words.objective)
        sentences.append(said)
    return sentences

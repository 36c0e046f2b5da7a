"""What a step gains and loses under several objectives enters, the words for it leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ratherthan.explain.explanation import Judged, Measured, Step
from ratherthan.narrate.evidence import claims_at, flexibility_of, measured, pair
from ratherthan.narrate.numbers import plain
from ratherthan.narrate.words import Vocabulary

__all__ = ["asides", "totals", "traded", "unbeaten"]

NEARLY_ALIKE = 1e-6
"""A difference of chances that only bounds of small numbers can tell."""


def traded(words: Vocabulary, step: Step) -> tuple[str, str]:
    """Return why not the foil, under all objectives together, and the sentence about the decisions left open."""
    table = words.table("trades")
    trade = step.trades[0]
    key, counted = flexibility_of(claims_at(step, 0))
    flexible = "" if key == "unsaid" else table[key].format(**counted)
    if trade.claim == "open":
        return _decided(words, step), flexible
    return _said(words, step, trade.claim, trade.judged), flexible


def _decided(words: Vocabulary, step: Step) -> str:
    """Return what is decided where some comparisons are open: the gains alone, or the losses alone."""
    judged = [one for one in step.trades[0].judged if one.relation in ("better", "worse")]
    if not judged:
        return ""
    return _said(words, step, "better on all" if judged[0].relation == "better" else "dominated", judged)


def _said(words: Vocabulary, step: Step, claim: str, judged: Sequence[Judged]) -> str:
    table = words.table("trades")
    equal = _all_equal(words, _said_equal(words, judged))
    gained, named = _gained(words, step, [one for one in judged if one.relation == "better"])
    losses, key = _lost_by(words, step, claim, [one for one in judged if one.relation == "worse"], named=named)
    key = "indifferent_unsaid" if claim == "indifferent" and not equal else key
    template: str = table[key]
    return template.format(
        gained=gained,
        losses=losses,
        all_equal=equal,
        equal=table["equal"].format(all_equal=equal) if equal else "",
        on=_on(words),
    )


def _said_equal(words: Vocabulary, judged: Sequence[Judged]) -> list[Judged]:
    """Return under which objectives two choices are called equal: no chance where another differs by as little as that.

    Small chances are told apart where their complements, near 1, are not.
    """
    chances = [one for one in judged if words.objectives[one.objective].record.chance]
    differing = [one for one in chances if one.relation in ("better", "worse")]
    fine = any(abs(one.taken.number.value - one.other.number.value) <= NEARLY_ALIKE for one in differing)
    return [one for one in judged if one.relation == "equal" and not (fine and one in chances)]


def _lost_by(words: Vocabulary, step: Step, claim: str, worse: Sequence[Judged], *, named: bool) -> tuple[str, str]:
    """Return what speaks for the foil, and the template that it fits: a list of routes, or clauses."""
    table = words.table("trades")
    told = [one for one in worse if not _unreached(words, one)]
    missing = _missing(words, step, worse)
    side, begun = ("better", False) if claim == "dominated" else ("worse", named and not missing)
    phrases = [_phrase(words, one, side, first=not begun and i == 0) for i, one in enumerate(told)]
    routes = words.language.joined(phrases, "and")
    if claim == "trade" and not missing:
        return routes, "trade" if named else "trade_unnamed"
    clauses = missing
    if routes:
        form = table["foil_leads" if claim == "dominated" else "leads"]
        clauses = [form.format(foil_doing=words.doing(step.foil or ""), losses=routes, gains=routes), *missing]
    return words.language.joined(clauses, "and"), claim


def _missing(words: Vocabulary, step: Step, judged: Sequence[Judged]) -> list[str]:
    """Return clauses about who may not reach the goal of an objective, which has no total then."""
    table, found = words.table("trades"), []
    for one in judged:
        if _unreached(words, one):
            key = "miss" if _misses(words, one, one.taken) else "miss_foil"
            found.append(table[key].format(reach=_reach(words, one.objective), foil_doing=words.doing(step.foil or "")))
    return list(dict.fromkeys(found))


def _unreached(words: Vocabulary, one: Judged) -> bool:
    return _misses(words, one, one.taken) or _misses(words, one, one.other)


def _misses(words: Vocabulary, one: Judged, row: Measured) -> bool:
    """Return whether a total is infinite because the goal until which it counts may not be reached.

    Of an objective beside the plan's own this is so also where infinity is wanted: the plan may have ended before.
    """
    cost = words.objectives[one.objective].record.kind == "cost"
    return row.fate is not None or (row.number.infinite and cost and not _own(words, one))


def _reach(words: Vocabulary, number: int) -> str:
    """Return the verb for arriving where an objective counts to: "arrive", "reach home"."""
    wanted = words.objectives[number]
    if number < len(words.explanation.levels) or wanted.goal is None:
        return wanted.words["arrive"]
    return str(words.table("arriving")["other_probability"]["arrive"]).replace("{goal}", wanted.goal)


def _on(words: Vocabulary) -> str:
    """Return "as we go on" for a plan that was given: the best that could follow is another question."""
    given = words.explanation.policy.given or words.explanation.question.policy_values
    return str(words.table("trades")["on"]) if given else ""


def _gained(words: Vocabulary, step: Step, better: Sequence[Judged]) -> tuple[str, bool]:
    """Return the clauses about the objectives under which the choice taken is better, and whether a route is named there.

    That a foil does not arrive is said where it is the plan's own goal that it misses; the other totals then have no end, too.
    """
    table, clauses = words.table("trades"), []
    fates = [one.other.fate for one in better if one.other.fate is not None and _own(words, one)]
    if fates:
        key = "dead" if "dead end" in fates else "fail"
        clauses.append(table[key].format(foil_doing=words.doing(step.foil or "")))
    shown = [one for one in better if not _unreached(words, one)]
    if shown:
        gains = [_phrase(words, one, "better", first=i == 0) for i, one in enumerate(shown)]
        clauses.append(table["leads"].format(gains=words.language.joined(gains, "and")))
    if not fates:
        clauses += _missing(words, step, better)
    return words.language.joined(clauses, "and"), bool(shown)


def _own(words: Vocabulary, one: Judged) -> bool:
    """Return whether it is an objective that the plan was made for."""
    return one.objective < len(words.explanation.levels)


def _phrase(words: Vocabulary, one: Judged, side: str, *, first: bool) -> str:
    """Return "a shorter route (6.7 instead of 10.7)", or later in a sentence "a shorter one"."""
    wanted = words.objectives[one.objective]
    own, foil = one.taken.number.value, one.other.number.value
    if side == "better" and one.relation == "worse":  # said of the foil
        own, foil = foil, own
    return wanted.words[side if first else f"{side}_one"] + pair(words, wanted, foil, [own])


def _all_equal(words: Vocabulary, equal: Sequence[Judged]) -> str:
    """Return what two choices have in common: where both lead, or that neither leads anywhere."""
    table = words.table("trades")
    unsure = any(one.taken.fate is not None and _own(words, one) for one in equal)
    lost = [one for one in equal if _lost(words, one.objective, one.taken)]
    usual = [one for one in equal if not _unreached(words, one) and one not in lost]
    clauses = []
    if usual:
        phrases = [words.objectives[one.objective].words["equal"] for one in usual]
        clauses.append(table["both"].format(equal=words.language.joined(phrases, "and")))
    if unsure:
        clauses.append(table["unsure"])
    if lost:
        clauses.append(table["lost"].format(**words.objectives[lost[0].objective].words))
    return str(table["apart"]).join(clauses) if len(usual) > 1 else words.language.joined(clauses, "and")


def _lost(words: Vocabulary, objective: int, row: Measured) -> bool:
    record = words.objectives[objective].record
    return record.chance and record.maximise and row.number.lower == row.number.upper == 0.0


def asides(words: Vocabulary, step: Step, *, alone: bool) -> str:
    """Return which alternatives would be better under a further objective; asked about one state, also where none would.

    Parameters
    ----------
    words : Vocabulary
    step : Step
    alone : bool
        Whether nothing was said of a route before.
    """
    table = words.table("trades")
    gains: dict[tuple[str, ...], list[str]] = {}
    missing: list[str] = []
    unmatched: list[str] = []
    for number in _further(words):
        wanted, judged = words.objectives[number], _judged(step, number)
        beating = [one for one in judged if one.relation == "worse"]
        form = "better" if alone and not gains and not unmatched else "better_one"
        if any(_unreached(words, one) for one in beating):
            missing.append(_missed_aside(words, number, beating))
        elif beating:
            own, others = beating[0].taken.number.value, [one.other.number.value for one in beating]
            said = wanted.words[form] + pair(words, wanted, own, others)
            gains.setdefault(tuple(one.other.action for one in beating), []).append(said)
        elif words.explanation.question.scope == "state" and _unbeaten(words, judged):
            unmatched.append(wanted.words[form] + wanted.words["which"])
    text = _gains(words, step, gains) + "".join(dict.fromkeys(missing)) + (_on(words) if missing else "")
    if unmatched:
        text += table["unbeaten"].format(better=words.language.joined(unmatched, "or"))
    return text


def _gains(words: Vocabulary, step: Step, gains: Mapping[tuple[str, ...], Sequence[str]]) -> str:
    """Return what other actions would gain, in one breath with what was conceded of them before."""
    table, conceded = words.table("trades"), _conceded(step)
    text, on = "", ""
    for i, (actions, said) in enumerate(gains.items()):
        joined, others = words.language.joined(said, "and"), words.alternatives(actions)
        if i == 0 and conceded == set(actions):
            stepwise, given = words.explanation.question.policy_values, words.explanation.policy.given
            key = "besides_stepwise" if stepwise else "besides_given" if given else "besides"
        else:
            key, on = "though_more" if on or i else "besides_others" if conceded is not None else "though", _on(words)
        text += table[key].format(others=others, gains=joined)
    return text + on


def _conceded(step: Step) -> set[str] | None:
    """Return which actions were said to lead to a better route; none of them where that was said otherwise; None if nothing."""
    for claim in step.claims:
        if claim.claim in ("not best", "worse step"):
            usual = claim.level == 0 and measured(claim.evidence.taken).fate is None
            return set(claim.against) if usual else set()
    return None


def _missed_aside(words: Vocabulary, number: int, beating: Sequence[Judged]) -> str:
    """Return that the plan may not reach the goal of a further objective, and others would be sure to; or that others may not."""
    key = "though_miss" if any(_misses(words, one, one.taken) for one in beating) else "though_missed"
    actions = [one.other.action for one in beating if key == "though_miss" or _misses(words, one, one.other)]
    template: str = words.table("trades")[key]
    return template.format(reach=_reach(words, number), others=words.alternatives(actions))


def unbeaten(words: Vocabulary, told: Sequence[Step]) -> list[str]:
    """Return under which further objectives no other action of any told step would be better."""
    table, weighed = words.table("trades"), [step for step in told if step.trades]
    found = [
        words.objectives[number].words["better"] + words.objectives[number].words["which"]
        for number in _further(words)
        if weighed
        and not any(one.relation in ("worse", "open") for step in weighed for one in _judged(step, number))
        and any(one.relation == "better" for step in weighed for one in _judged(step, number))
        and not any(_misses(words, one, one.taken) for step in weighed for one in _judged(step, number))
    ]
    key = "unbeaten_here" if len(weighed) == 1 else "unbeaten_there"
    return [table[key].format(better=words.language.joined(found, "or"))] if found else []


def _further(words: Vocabulary) -> range:
    return range(len(words.explanation.levels), len(words.objectives))


def _judged(step: Step, number: int) -> list[Judged]:
    return [trade.judged[number] for trade in step.trades]


def _unbeaten(words: Vocabulary, judged: Sequence[Judged]) -> bool:
    """Return whether no other choice is better, which is decided, and some are worse; and the choice taken has a total."""
    return any(one.relation == "better" for one in judged) and all(
        one.relation in ("better", "equal") and not _misses(words, one, one.taken) for one in judged
    )


def totals(words: Vocabulary) -> list[str]:
    """Return what the whole plan comes to under each objective, as far as it is proved."""
    route, numbers = words.table("route"), words.table("numbers")
    amounts: list[str] = []
    infinite: list[str] = []
    for number, (wanted, total) in enumerate(zip(words.objectives, words.explanation.totals, strict=False)):
        if total.infinite:
            bad = wanted.record.kind == "cost" or (total.value > 0) != wanted.record.maximise
            goal = "" if 0 < number < len(words.explanation.levels) or wanted.goal is None else wanted.goal
            key = "no_end" if not bad else "no_total_until" if goal else "no_total"
            infinite.append(route[key].format(noun=wanted.words["endless"], goal=goal))
        elif total.finite and total.upper - total.lower <= 0.001 * max(1.0, abs(total.value)):
            said = plain(total.value, numbers, chance=wanted.record.chance)
            amounts.append(words.language.counted(wanted.words["amount"].replace("{value}", said)))
    sentences = [route["total"].format(amounts=words.language.joined(amounts, "and"))] if amounts else []
    return [*sentences, *dict.fromkeys(infinite)]

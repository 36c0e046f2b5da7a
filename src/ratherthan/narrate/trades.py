"""What a step gains and loses under several objectives enters, the words for it leave."""

from __future__ import annotations

from collections.abc import Sequence

from ratherthan.explain.explanation import Judged, Measured, Step
from ratherthan.narrate.evidence import claims_at, flexibility_of, pair
from ratherthan.narrate.numbers import plain
from ratherthan.narrate.words import Vocabulary

__all__ = ["asides", "totals", "traded", "unbeaten"]


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
    better = [one for one in judged if one.relation == "better"]
    worse = [one for one in judged if one.relation == "worse"]
    equal = _all_equal(words, [one for one in judged if one.relation == "equal"])
    gained, named = _gained(words, step, better)
    side = "better" if claim == "dominated" else "worse"
    losses = [_phrase(words, one, side, first=not named and i == 0) for i, one in enumerate(worse)]
    key = "indifferent_unsaid" if claim == "indifferent" and not equal else claim
    template: str = table["trade_unnamed" if claim == "trade" and not named else key]
    return template.format(
        gained=gained,
        losses=words.language.joined(losses, "and"),
        all_equal=equal,
        equal=table["equal"].format(all_equal=equal) if equal else "",
        foil_doing=words.doing(step.foil or ""),
        on=_on(words),
    )


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
    shown = [one for one in better if one.other.fate is None or not fates]
    if shown:
        gains = [_phrase(words, one, "better", first=i == 0) for i, one in enumerate(shown)]
        clauses.append(table["leads"].format(gains=words.language.joined(gains, "and")))
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
    usual = [one for one in equal if one.taken.fate is None and one not in lost]
    clauses = []
    if usual:
        phrases = [words.objectives[one.objective].words["equal"] for one in usual]
        clauses.append(table["both"].format(equal=words.language.joined(phrases, "and")))
    if unsure:
        clauses.append(table["unsure"])
    if lost:
        clauses.append(table["lost"].format(**words.objectives[lost[0].objective].words))
    return words.language.joined(clauses, "and")


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
    unmatched: list[str] = []
    for number in _further(words):
        wanted, judged = words.objectives[number], _judged(step, number)
        beating = [one for one in judged if one.relation == "worse"]
        form = "better" if alone and not gains and not unmatched else "better_one"
        if beating:
            own, others = beating[0].taken.number.value, [one.other.number.value for one in beating]
            said = wanted.words[form] + pair(words, wanted, own, others)
            gains.setdefault(tuple(one.other.action for one in beating), []).append(said)
        elif words.explanation.question.scope == "state" and _unbeaten(judged):
            unmatched.append(wanted.words[form])
    parts = [
        table["though_more" if i else "though"].format(
            others=words.alternatives(actions), gains=words.language.joined(said, "and")
        )
        for i, (actions, said) in enumerate(gains.items())
    ]
    text = "".join(parts) + (_on(words) if parts else "")
    if unmatched:
        text += table["unbeaten"].format(better=words.language.joined(unmatched, "or"))
    return text


def unbeaten(words: Vocabulary, told: Sequence[Step]) -> list[str]:
    """Return under which further objectives no other action of any told step would be better."""
    table, weighed = words.table("trades"), [step for step in told if step.trades]
    found = [
        words.objectives[number].words["better"]
        for number in _further(words)
        if weighed
        and not any(one.relation in ("worse", "open") for step in weighed for one in _judged(step, number))
        and any(one.relation == "better" for step in weighed for one in _judged(step, number))
    ]
    key = "unbeaten_here" if len(weighed) == 1 else "unbeaten_there"
    return [table[key].format(better=words.language.joined(found, "or"))] if found else []


def _further(words: Vocabulary) -> range:
    return range(len(words.explanation.levels), len(words.objectives))


def _judged(step: Step, number: int) -> list[Judged]:
    return [trade.judged[number] for trade in step.trades]


def _unbeaten(judged: Sequence[Judged]) -> bool:
    """Return whether no other choice is better, which is decided, and some are worse."""
    return any(one.relation == "better" for one in judged) and all(
        one.relation in ("better", "equal") for one in judged
    )


def totals(words: Vocabulary) -> list[str]:
    """Return what the whole plan comes to under each objective, as far as it is proved."""
    route, numbers = words.table("route"), words.table("numbers")
    amounts: list[str] = []
    endless: list[str] = []
    missed: list[str] = []
    for wanted, total in zip(words.objectives, words.explanation.totals, strict=False):
        if total.infinite:
            bad = not wanted.record.chance and (total.value > 0) != wanted.record.maximise
            (missed if bad else endless).append(wanted.words["endless"])
        elif total.finite and total.upper - total.lower <= 0.001 * max(1.0, abs(total.value)):
            said = plain(total.value, numbers, chance=wanted.record.chance)
            amounts.append(words.language.counted(wanted.words["amount"].replace("{value}", said)))
    sentences = [route["total"].format(amounts=words.language.joined(amounts, "and"))] if amounts else []
    sentences += [
        route[key].format(noun=noun) for key, nouns in (("no_end", endless), ("no_total", missed)) for noun in nouns
    ]
    return sentences

"""Preferences enter, the paragraph on H3 leaves: each sentence is chosen by what the numbers decide."""

from __future__ import annotations

from ratherthan.apps.study.analysis.data import Data
from ratherthan.apps.study.analysis.preferring import NEITHER, GroupResult, Lacking, Preferences
from ratherthan.apps.study.analysis.statistics.corrections import holm
from ratherthan.apps.study.analysis.verdicts import LEVEL, Verdict, verdict_clauses
from ratherthan.apps.study.analysis.words import listed, number, p_text, percent, say

__all__ = ["corrected_tests", "option_label", "preference_verdict"]

NAIVE = ("naive-state", "naive-path", "none")
FACTORS = ("responsibility", "constrictive", "selective", "contrastive")


def option_label(data: Data, option: str) -> str:
    """Return what an option of a choice is called."""
    if option == NEITHER:
        return say("kinds.neither")
    known = data.labels.get(option)
    return known or (say(f"kinds.{option}") if option in (*NAIVE, *FACTORS) else option)


def corrected_tests(found: Preferences) -> list[float | None]:
    """Return the p of the tests over persons, corrected by Holm's method for the number of groupings."""
    return holm([None if isinstance(group.of_persons, Lacking) else group.of_persons.p for group in found.groups])


def preference_verdict(data: Data, found: Preferences) -> Verdict:
    """Return the paragraph on the choices, that of H3 where naive kinds stand against others."""
    said: list[str] = []
    outcomes: dict[str, list[str]] = {}
    for group, p in zip(found.groups, corrected_tests(found), strict=True):
        sentences, how = _of_pair(data, group, p) if len(group.kinds) == 2 else (_of_several(data, group, p), "")
        said += [_shares(data, group), *sentences]
        factor = _factor(data, group)
        if factor is not None and how:
            core, sign = factor
            turned = {"higher": "lower", "lower": "higher"}.get(how, how) if sign < 0 else how
            outcomes.setdefault(turned, []).append(say(f"factors.{core}"))
    said += _ranking(data, found)
    if not outcomes:
        return Verdict(name=say("sections.preferences"), text=" ".join(said))
    name = say("h3.name")
    clauses = verdict_clauses(outcomes)
    said.insert(0, say("h3.statement"))
    said.append(say("verdict.whole", name=name.split(",")[0], clauses=clauses))
    if "open" in outcomes:
        said.append(say("verdict.open_meaning"))
    return Verdict(name=name, text=" ".join(said), short=say("short.supported", name=name, clauses=clauses))


def _names(data: Data, group: GroupResult) -> str:
    return listed([option_label(data, kind) for kind in group.kinds])


def _shares(data: Data, group: GroupResult) -> str:
    if isinstance(group.shares, Lacking):
        return say("prefer.lacking", kinds=_names(data, group), why=group.shares.why)
    parts = [
        say("prefer.part", kind=option_label(data, option), share=percent(share.share, 1))
        for option, share in zip(group.options, group.shares, strict=True)
    ]
    votes = sum(share.votes for share in group.shares)
    return say("prefer.shares", kinds=_names(data, group), parts=listed(parts), votes=votes, persons=group.persons)


def _of_pair(data: Data, group: GroupResult, p: float | None) -> tuple[list[str], str]:
    """Return what the sign test says of a pair, and "higher" where the first is preferred, "lower" or "open"."""
    test = group.of_persons
    if isinstance(test, Lacking):
        return [say("prefer.lacking", kinds=_names(data, group), why=test.why)], "lacking"
    more, less = int(test.statistic), test.count - int(test.statistic)
    first, second = (option_label(data, kind) for kind in group.kinds)
    if p is None or p >= LEVEL:
        return [say("prefer.open", more=more, less=less, first=first, second=second, p=p_text(p))], "open"
    if more > less:
        return [say("prefer.first", more=more, less=less, first=first, second=second, p=p_text(p))], "higher"
    return [say("prefer.first", more=less, less=more, first=second, second=first, p=p_text(p))], "lower"


def _of_several(data: Data, group: GroupResult, p: float | None) -> list[str]:
    """Return what is known of a choice among several kinds."""
    if isinstance(group.of_persons, Lacking):
        return [say("prefer.lacking", kinds=_names(data, group), why=group.of_persons.why)]
    said = [
        say("prefer.unequal" if p is not None and p < LEVEL else "prefer.equal", count=len(group.kinds), p=p_text(p))
    ]
    contrastive = next((k for k in group.kinds if data.cores.get(k, k) == "contrastive"), None)
    if contrastive is None or isinstance(group.shares, Lacking) or NEITHER in group.options:
        return said
    share = group.shares[group.options.index(contrastive)]
    equal = 1 / len(group.kinds)
    beyond = share.low > equal or share.high < equal
    how = ("above" if share.low > equal else "below") if beyond and p is not None and p < LEVEL else "within"
    words = {"kind": option_label(data, contrastive), "equal": percent(equal), "p": p_text(p)}
    return [*said, say(f"prefer.{how}", low=percent(share.low, 1), high=percent(share.high, 1), **words)]


def _factor(data: Data, group: GroupResult) -> tuple[str, int] | None:
    """Return the factor that a pair tests against a naive kind, and 1 where it stands first, else -1."""
    if len(group.kinds) != 2:
        return None
    one, other = (data.cores.get(kind, kind) for kind in group.kinds)
    if one in FACTORS and other in NAIVE:
        return one, 1
    return (other, -1) if other in FACTORS and one in NAIVE else None


def _ranking(data: Data, found: Preferences) -> list[str]:
    """Return which kinds stand first and last."""
    ranking = found.ranking
    if isinstance(ranking, Lacking):
        return [say("prefer.no_ranking", why=ranking.why)]
    if max(ranking.worth) - min(ranking.worth) < 1e-9:
        return []
    order = sorted(range(len(ranking.items)), key=lambda i: -ranking.worth[i])
    names = [option_label(data, found.kinds[ranking.items[i]]) for i in order]
    said = say(
        "prefer.ranking",
        best=names[0],
        worst=names[-1],
        worth=number(ranking.worth[order[0]]),
        least=number(ranking.worth[order[-1]]),
    )
    return [said, *([say("prefer.added")] if ranking.added else [])]

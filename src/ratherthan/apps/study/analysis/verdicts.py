"""Statistics enter, one paragraph a hypothesis leaves: each sentence is chosen by what the numbers decide.

A comparison is *higher* or *lower* where its p, corrected by Holm's method for all planned comparisons of the measure, is below
0.05, and *open* otherwise: neither a difference nor its absence was shown. Where a test is lacking nothing is concluded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ratherthan.apps.study.analysis.data import Data
from ratherthan.apps.study.analysis.measuring import Compared, Measured
from ratherthan.apps.study.analysis.preferring import Lacking
from ratherthan.apps.study.analysis.statistics.repeated import Repeated
from ratherthan.apps.study.analysis.words import listed, number, p_text, say

__all__ = [
    "FACTORS",
    "LEVEL",
    "Verdict",
    "amount",
    "conclusions",
    "differing",
    "measure_verdict",
    "outcome",
    "primary_value",
    "verdict_clauses",
]

LEVEL = 0.05
FACTORS = (
    ("responsibility", "naive-state"),
    ("constrictive", "naive-state"),
    ("selective", "naive-path"),
    ("contrastive", "naive-path"),
)
"""The comparisons that decide on H1 and H2."""
HYPOTHESES = {"understanding": "h1", "trust": "h2"}
MOST_SENTENCES = 10


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """A paragraph on a hypothesis or a measure, and what it comes to in short ("" where nothing)."""

    name: str
    text: str
    short: str = ""


def outcome(difference: float, p: float | None) -> str:
    """Return "higher", "lower" or "open".

    Examples
    --------
    >>> outcome(0.3, 0.04), outcome(-0.3, 0.04), outcome(0.3, 0.0501)
    ('higher', 'lower', 'open')
    """
    if p is None or p >= LEVEL or difference == 0.0:
        return "open"
    return "higher" if difference > 0 else "lower"


def conclusions(compared: Compared) -> dict[str, str]:
    """Return the outcome of a comparison in each layer: "primary", "mixed" and "ordinal"."""
    one, two, three = compared.contrast, compared.mixed, compared.ranked
    return {
        "primary": "lacking" if isinstance(one, Lacking) else outcome(one.difference, compared.corrected),
        "mixed": "lacking" if isinstance(two, Lacking) else outcome(two.difference, compared.mixed_corrected),
        "ordinal": "lacking" if isinstance(three, Lacking) else outcome(three.size, compared.ranked_corrected),
    }


def amount(value: float, measured: Measured, digits: int = 2) -> str:
    """Return a difference with its unit; of a time, the ratio of which it is the logarithm."""
    if measured.measure.time:
        return number(math.exp(min(value, 200.0)), digits)
    if measured.measure.unit and measured.measure.unit != "points":
        return say("forms.in_unit", number=number(value, digits), unit=measured.measure.unit)
    return say("forms.points", number=number(value, digits)) if measured.measure.scale else number(value, digits)


def _bare(value: float, measured: Measured) -> str:
    return number(math.exp(min(value, 200.0)) if measured.measure.time else value)


def _sentence(data: Data, measured: Measured, compared: Compared) -> str:
    """Return what the primary analysis says of a comparison."""
    names = {"first": data.label(data.kinds[compared.first]), "second": data.label(data.kinds[compared.second])}
    names |= {"item": measured.measure.label, "inner": measured.measure.inner}
    suffix = "_time" if measured.measure.time else ""
    contrast = compared.contrast
    if isinstance(contrast, Lacking):
        return say(f"contrast.lacking{suffix}", why=contrast.why, **names)
    found = outcome(contrast.difference, compared.corrected)
    shown = (
        abs(contrast.difference) if found in ("higher", "lower") and not measured.measure.time else contrast.difference
    )
    if found == "open" and (contrast.low > 0 or contrast.high < 0):
        found = "alone"
    return say(
        f"contrast.{found}{suffix}",
        difference=amount(shown, measured),
        low=_bare(contrast.low, measured),
        high=_bare(contrast.high, measured),
        p=p_text(compared.corrected),
        count=sum(not isinstance(other.contrast, Lacking) for other in measured.compared),
        **names,
    )


def primary_value(measured: Measured) -> str:
    """Return the test of the primary analysis in figures."""
    test = measured.primary
    if isinstance(test, Lacking):
        return say("tests.lacking")
    if isinstance(test, Repeated):
        return say(
            "tests.repeated_value",
            kinds=number(test.epsilon * test.kinds, 2),
            errors=number(test.epsilon * test.errors, 1),
            f=number(test.f),
            epsilon=number(test.epsilon),
            persons=test.persons,
        )
    return say("tests.welch_value", kinds=f"{test.between:g}", errors=number(test.within, 1), f=number(test.f))


def _omnibus(measured: Measured) -> str:
    names, test = {"item": measured.measure.label, "inner": measured.measure.inner}, measured.primary
    if isinstance(test, Lacking):
        return say("omnibus.lacking", why=test.why, **names)
    return say(
        "omnibus.differ" if test.p < LEVEL else "omnibus.open", **names, value=primary_value(measured), p=p_text(test.p)
    )


def _pair(data: Data, compared: Compared) -> str:
    return say(
        "checks.pair", first=data.label(data.kinds[compared.first]), second=data.label(data.kinds[compared.second])
    )


def differing(data: Data, one: Measured, other: Measured | None) -> list[str]:
    """Return the comparisons on which the primary analyses of two sets of persons come to other conclusions."""
    if other is None:
        return []
    there = {(c.first, c.second): conclusions(c)["primary"] for c in other.compared}
    return [
        _pair(data, c) for c in one.compared if there.get((c.first, c.second), "lacking") != conclusions(c)["primary"]
    ]


def _checks(data: Data, measured: Measured, everyone: Measured | None) -> list[str]:
    """Return how far other ways to compute agree."""
    said = []
    found = [(compared, conclusions(compared)) for compared in measured.compared]
    known = [(compared, outcomes) for compared, outcomes in found if outcomes["primary"] != "lacking"]
    layers: dict[str, list[str]] = {
        layer: [_pair(data, c) for c, outcomes in known if outcomes[layer] not in ("lacking", outcomes["primary"])]
        for layer in ("mixed", "ordinal")
    }
    whole = {layer: bool(known) and all(o[layer] != "lacking" for _, o in known) for layer in layers}
    for layer, pairs in layers.items():
        if pairs:
            said.append(say(f"checks.{layer}", pairs=listed(pairs)))
    agreeing = [layer for layer, pairs in layers.items() if whole[layer] and not pairs]
    if len(agreeing) == 2:
        said.insert(0, say("checks.same"))
    elif agreeing:
        said.insert(0, say(f"checks.{agreeing[0]}_same"))
    if everyone is not None and known:
        apart = differing(data, measured, everyone)
        said.append(say("checks.everyone", pairs=listed(apart)) if apart else say("checks.everyone_same"))
    return said


def verdict_clauses(found: Mapping[str, Sequence[str]]) -> str:
    """Return what a hypothesis comes to, from the factors that speak for it, against it, and neither."""
    order = (("higher", "up"), ("lower", "down"), ("open", "open"), ("lacking", "lacking"))
    parts = [say(f"verdict.{key}", factors=listed(list(found[how]))) for how, key in order if found.get(how)]
    return "; ".join(parts)


def measure_verdict(data: Data, measured: Measured, everyone: Measured | None) -> Verdict:
    """Return the paragraph on a measure, that of H1 or H2 where it is understanding or trust by the paper's kinds.

    Parameters
    ----------
    data : Data
    measured : Measured
    everyone : Measured, optional
        The same without exclusions, where these leave anybody out.
    """
    cores = {core: kind for kind, core in data.cores.items()}
    pairs = {(data.kinds[c.first], data.kinds[c.second]): c for c in measured.compared}
    factors = {core: pairs[key] for core, base in FACTORS if (key := (cores.get(core), cores.get(base))) in pairs}
    hypothesis = HYPOTHESES.get(measured.measure.name) if factors else None
    if measured.measure.time:
        return Verdict(name=say("time.name"), text=" ".join(_time_text(data, measured, factors, everyone)))
    said = [_omnibus(measured)]
    if hypothesis is None:
        shown = measured.compared
        if len(shown) > MOST_SENTENCES:
            shown = tuple(c for c in shown if conclusions(c)["primary"] in ("higher", "lower"))
        said += [_sentence(data, measured, compared) for compared in shown]
        said += _checks(data, measured, everyone)
        return Verdict(name=measured.measure.label, text=" ".join(said))
    name = say(f"{hypothesis}.name")
    said.insert(0, say(f"{hypothesis}.statement"))
    said += [_sentence(data, measured, compared) for compared in factors.values()]
    said += _against_none(data, measured, cores)
    found: dict[str, list[str]] = {}
    for core, compared in factors.items():
        found.setdefault(conclusions(compared)["primary"], []).append(say(f"factors.{core}"))
    clauses = verdict_clauses(found)
    short = say("short.supported", name=name, clauses=clauses)
    said.append(say("verdict.whole", name=name.split(",")[0], clauses=clauses))
    if "open" in found:
        said.append(say("verdict.open_meaning"))
    said += _checks(data, measured, everyone)
    return Verdict(name=name, text=" ".join(said), short=short)


def _time_text(data: Data, measured: Measured, factors: Mapping[str, Compared], everyone: Measured | None) -> list[str]:
    shown = list(factors.values()) or list(measured.compared)[:MOST_SENTENCES]
    said = [say("time.statement")] if factors else []
    return [
        *said,
        _omnibus(measured),
        *(_sentence(data, measured, c) for c in shown),
        *_checks(data, measured, everyone),
    ]


def _against_none(data: Data, measured: Measured, cores: Mapping[str, str]) -> list[str]:
    """Return which kinds differ from no explanation."""
    groups: dict[str, list[str]] = {}
    for compared in measured.compared:
        if data.kinds[compared.second] == cores.get("none"):
            groups.setdefault(conclusions(compared)["primary"], []).append(data.label(data.kinds[compared.first]))
    return [
        say(f"none.{how}", item=measured.measure.label, kinds=listed(groups[how]))
        for how in ("higher", "lower", "open")
        if how in groups
    ]

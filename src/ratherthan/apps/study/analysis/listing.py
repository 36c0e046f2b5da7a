"""Statistics enter, the tables of the report leave; what is not computed says so, with the reason."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ratherthan.apps.study.analysis.data import Data
from ratherthan.apps.study.analysis.document import Table
from ratherthan.apps.study.analysis.measuring import Compared, Measured
from ratherthan.apps.study.analysis.preferring import Lacking
from ratherthan.apps.study.analysis.published import published_f
from ratherthan.apps.study.analysis.statistics.repeated import Repeated
from ratherthan.apps.study.analysis.statistics.variance import Pair
from ratherthan.apps.study.analysis.verdicts import differing, primary_value
from ratherthan.apps.study.analysis.words import listed, number, p_text, say

__all__ = [
    "DASH",
    "Cells",
    "cell_p",
    "contrasts_table",
    "head_of",
    "published_table",
    "robust_table",
    "span",
    "summary_table",
    "tests_table",
    "tukey_table",
]

Cells = tuple[str, ...]
DASH = "–"


def cell_p(p: float | None) -> str:
    """Return a p value for a table, without the sign of equality."""
    return p_text(p).removeprefix("= ")


def span(low: float | None, high: float | None, digits: int = 2) -> str:
    """Return an interval for a table, a dash where there is none."""
    return (
        DASH if low is None or high is None else say("forms.span", low=number(low, digits), high=number(high, digits))
    )


def head_of(*keys: str) -> Cells:
    """Return the head of a table from the names of its columns."""
    return tuple(say(f"tables.{key}") for key in keys)


def summary_table(data: Data, measured: Measured) -> Table:
    """Return means, intervals and counts by kind."""
    time = measured.measure.time
    digits = 1 if time else 2
    rows = tuple(
        (
            data.label(data.kinds[s.kind]),
            str(s.persons),
            str(s.answers),
            number(s.mean, digits),
            span(s.low, s.high, digits),
            number(s.median, digits),
            number(s.spread, digits),
        )
        for s in measured.summaries
    )
    head = head_of("kind", "persons", "answers", "geometric" if time else "mean", "interval", "median", "spread")
    caption = say("captions.summary_time" if time else "captions.summary", item=measured.measure.label)
    return Table(caption=caption, head=head, rows=rows)


def tests_table(measured: Measured, *, paper: bool) -> Table:
    """Return the tests of all layers."""
    rows = [_primary_row(measured), _ordinal_row(measured), _one_way_row(measured, paper=paper)]
    if measured.within:
        rows.insert(1, _mixed_row(measured))
    return Table(
        caption=say("captions.tests", inner=measured.measure.inner),
        head=head_of("test", "statistic", "p", "size"),
        rows=tuple(rows),
        words=4,
    )


def _lacking_row(name: str, lacking: Lacking) -> Cells:
    return name, say("forms.not_computed", why=lacking.why), DASH, DASH


def _primary_row(measured: Measured) -> Cells:
    test = measured.primary
    name = say("tests.repeated" if measured.within else "tests.welch")
    if isinstance(test, Lacking):
        return _lacking_row(name, test)
    if not isinstance(test, Repeated):
        return name, primary_value(measured), cell_p(test.p), DASH
    interval = test.eta2_interval
    size = (
        say("tests.repeated_size_plain", eta=number(test.eta2, 3))
        if interval is None
        else say(
            "tests.repeated_size", eta=number(test.eta2, 3), low=number(interval[0], 3), high=number(interval[1], 3)
        )
    )
    return name, primary_value(measured), cell_p(test.p), size


def _mixed_row(measured: Measured) -> Cells:
    model = measured.mixed
    if isinstance(model, Lacking):
        return _lacking_row(say("tests.mixed"), model)
    value = say(
        "tests.mixed_value",
        kinds=model.kinds,
        errors=model.errors,
        f=number(model.f),
        persons=model.persons,
        answers=model.answers,
    )
    parts = {"person": number(model.person_variance, 3), "rest": number(model.rest_variance, 3)}
    size = (
        say("tests.mixed_size_plain", **parts)
        if model.kind_variance is None
        else say("tests.mixed_size", kind=number(model.kind_variance, 3), **parts)
    )
    return say("tests.mixed"), value, cell_p(model.p), size


def _ordinal_row(measured: Measured) -> Cells:
    test = measured.ordinal
    which = "friedman" if measured.within else "kruskal"
    if isinstance(test, Lacking):
        return _lacking_row(say(f"tests.{which}"), test)
    value = say(f"tests.{which}_value", freedom=test.freedom, statistic=number(test.statistic), persons=test.persons)
    return say(f"tests.{which}"), value, cell_p(test.p), say(f"tests.{which}_size", size=number(test.size, 3))


def _one_way_row(measured: Measured, *, paper: bool) -> Cells:
    test, name = measured.one_way, say("tests.one_way" if paper else "tests.one_way_plain")
    if isinstance(test, Lacking):
        return _lacking_row(name, test)
    value = say("tests.one_way_value", between=test.between, within=test.within, f=number(test.f))
    sizes = {"eta": number(test.eta2, 3), "omega": number(test.omega2, 3)}
    size = (
        say("tests.one_way_size_plain", **sizes)
        if test.share is None
        else say("tests.one_way_size", low=number(test.share[0], 3), high=number(test.share[1], 3), **sizes)
    )
    return name, value, cell_p(test.p), size


def _pair(data: Data, first: int, second: int, *, time: bool = False) -> str:
    return say(
        "figures.pair_time" if time else "figures.pair",
        first=data.label(data.kinds[first]),
        second=data.label(data.kinds[second]),
    )


def contrasts_table(data: Data, measured: Measured) -> Table:
    """Return the planned comparisons in all layers."""
    time = measured.measure.time
    rows = tuple(_contrast_row(data, measured, compared) for compared in measured.compared)
    head = head_of(
        "comparison",
        "ratio" if time else "difference",
        "interval",
        "p",
        "holm",
        "sizes" if measured.within else "sizes_unpaired",
        "mixed",
        "ordinal",
    )
    if not measured.within:  # then there is no mixed model
        head, rows = _without(head, 6), tuple(_without(row, 6) for row in rows)
    count = sum(not isinstance(compared.contrast, Lacking) for compared in measured.compared)
    caption = say(
        "captions.contrasts_time" if time else "captions.contrasts", inner=measured.measure.inner, count=count
    )
    return Table(caption=caption, head=head, rows=rows)


def _without(cells: Cells, column: int) -> Cells:
    return (*cells[:column], *cells[column + 1 :])


def _contrast_row(data: Data, measured: Measured, compared: Compared) -> Cells:
    def shown(value: float) -> float:
        return math.exp(min(value, 200.0)) if measured.measure.time else value

    mixed = compared.mixed
    ranked = compared.ranked
    mixed_text = (
        DASH
        if isinstance(mixed, Lacking)
        else say("forms.effect", value=number(shown(mixed.difference)), p=cell_p(compared.mixed_corrected))
    )
    ranked_text = (
        DASH
        if isinstance(ranked, Lacking)
        else say("forms.effect", value=number(ranked.size), p=cell_p(compared.ranked_corrected))
    )
    name = _pair(data, compared.first, compared.second, time=measured.measure.time)
    contrast = compared.contrast
    if isinstance(contrast, Lacking):
        return name, say("forms.not_computed", why=contrast.why), DASH, DASH, DASH, DASH, mixed_text, ranked_text
    size, ends = (
        (contrast.paired_size, _ends_of_paired(compared))
        if contrast.paired
        else (contrast.size, (contrast.size_low, contrast.size_high))
    )
    size_text = (
        number(size)
        if ends[0] is None
        else say("forms.sized", value=number(size), low=number(ends[0]), high=number(ends[1]))
    )
    return (
        name,
        number(shown(contrast.difference)),
        span(shown(contrast.low), shown(contrast.high)),
        cell_p(contrast.p),
        cell_p(compared.corrected),
        size_text,
        mixed_text,
        ranked_text,
    )


def _ends_of_paired(compared: Compared) -> tuple[float | None, float | None]:
    """Return the interval of d_z, which is that of d_av in another unit."""
    contrast = compared.contrast
    if (
        isinstance(contrast, Lacking)
        or contrast.size_low is None
        or contrast.size_high is None
        or contrast.paired_size is None
    ):
        return None, None
    scale = contrast.paired_size / contrast.size if contrast.size else None
    return (None, None) if scale is None else (contrast.size_low * scale, contrast.size_high * scale)


def tukey_table(data: Data, measured: Measured, pairs: Sequence[Pair]) -> Table:
    """Return Tukey's comparisons of all pairs."""
    rows = tuple(
        (
            _pair(data, measured.kinds[pair.first], measured.kinds[pair.second]),
            number(pair.difference),
            span(pair.low, pair.high),
            cell_p(pair.p),
        )
        for pair in pairs
    )
    head = head_of("comparison", "difference", "interval", "p")
    return Table(
        caption=say("captions.tukey" if data.cores else "captions.tukey_plain", item=measured.measure.label),
        head=head,
        rows=rows,
        folded=True,
    )


def published_table(measured: Sequence[Measured]) -> Table:
    """Return the one-way tests of this study beside the published ones."""
    rows = []
    for name, old in published_f().items():
        new = next((m for m in measured if m.measure.name == name), None)
        test = None if new is None or isinstance(new.one_way, Lacking) else new.one_way
        own = DASH
        if test is not None:
            own = say("published.row", between=test.between, within=test.within, f=number(test.f), p=p_text(test.p))
        old_text = say("published.row", between=old.between, within=old.within, f=old.shown, p=p_text(old.p))
        rows.append((say(f"measures.{name}"), own, say("published.printed", row=old_text, printed=old.printed)))
    return Table(caption=say("captions.published_f"), head=head_of("what", "new", "old"), rows=tuple(rows))


def robust_table(data: Data, kept: Sequence[Measured], everyone: Sequence[Measured]) -> Table:
    """Return the primary tests with and without exclusions."""
    rows = []
    for one in kept:
        other = next((m for m in everyone if m.measure.name == one.measure.name), None)
        cells = [
            DASH
            if m is None or isinstance(m.primary, Lacking)
            else say("forms.test", value=primary_value(m), p=p_text(m.primary.p))
            for m in (one, other)
        ]
        apart = differing(data, one, other)
        rows.append((one.measure.label, *cells, listed(apart) if apart else say("tables.no_difference")))
    return Table(
        caption=say("captions.robust"), head=head_of("what", "kept", "everyone", "agreement"), rows=tuple(rows)
    )

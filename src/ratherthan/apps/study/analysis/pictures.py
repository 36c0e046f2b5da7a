"""Statistics enter, the figures of the report leave, with captions and words for those who cannot see them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ratherthan.apps.study.analysis.charts import Row, axis_of, likert_chart, points_chart
from ratherthan.apps.study.analysis.data import Data
from ratherthan.apps.study.analysis.document import Figure
from ratherthan.apps.study.analysis.measuring import Measured
from ratherthan.apps.study.analysis.preferred import option_label
from ratherthan.apps.study.analysis.preferring import GroupResult, Lacking, Preferences
from ratherthan.apps.study.analysis.published import published_share
from ratherthan.apps.study.analysis.words import number, percent, say

__all__ = ["contrasts_figure", "likert_figure", "means_figure", "ranking_figure", "shares_figures"]


def _mark(data: Data) -> str:
    return say("forms.simulated_figure") if data.simulated else ""


def _rows_text(rows: list[Row]) -> str:
    """Return what rows show, in words."""
    said = []
    for row in rows:
        if row.low is None or row.high is None:
            said.append(say("figures.row_plain", label=row.label, value=row.text))
        else:
            ends = (number(row.low), number(row.high))
            said.append(say("figures.row", label=row.label, value=row.text, low=ends[0], high=ends[1]))
    return " ".join(said)


def _values(rows: list[Row]) -> list[float]:
    return [value for row in rows for value in (row.value, row.low, row.high, row.published) if value is not None]


def means_figure(data: Data, measured: Measured, name: str) -> Figure:
    """Return the means of a measure by kind."""
    measure = measured.measure
    rows = [
        Row(
            label=data.label(data.kinds[s.kind]),
            value=s.mean,
            low=s.low,
            high=s.high,
            text=number(s.mean, 1 if measure.time else 2),
        )
        for s in measured.summaries
    ]
    caption = say("figures.means_time" if measure.time else "figures.means", item=measure.label)
    title = say("figures.axis_time") if measure.time else measure.label
    ends = (measure.scale[0], measure.scale[-1]) if measure.scale else None
    if measure.scale and measure.ends:
        low, high = (f"{value:g}" for value in (measure.scale[0], measure.scale[-1]))
        title = say(
            "figures.axis_scale", item=measure.label, low=low, high=high, first=measure.ends[0], last=measure.ends[1]
        )
    axis = axis_of(_values(rows), title, log=measure.time, ends=ends)
    text = _rows_text(rows)
    picture = points_chart(rows, axis, title=caption.split(".")[0], description=text, mark=_mark(data))
    return Figure(name=f"{name}-means", picture=picture, caption=caption, text=text)


def contrasts_figure(data: Data, measured: Measured, name: str) -> Figure | None:
    """Return the planned comparisons of a measure; None where none can be computed."""
    time = measured.measure.time
    rows = []
    for compared in measured.compared:
        contrast = compared.contrast
        if isinstance(contrast, Lacking):
            continue
        ends = [math.exp(x) if time else x for x in (contrast.difference, contrast.low, contrast.high)]
        label = say(
            "figures.pair_time" if time else "figures.pair",
            first=data.label(data.kinds[compared.first]),
            second=data.label(data.kinds[compared.second]),
        )
        rows.append(Row(label=label, value=ends[0], low=ends[1], high=ends[2], text=number(ends[0])))
    if not rows or not all(math.isfinite(value) and (value > 0 or not time) for value in _values(rows)):
        return None
    caption = say("figures.contrasts_time" if time else "figures.contrasts", inner=measured.measure.inner)
    title = say("figures.axis_ratio" if time else "figures.axis_difference", inner=measured.measure.inner)
    axis = axis_of(_values(rows), title, log=time, line=1.0 if time else 0.0)
    text = _rows_text(rows)
    picture = points_chart(rows, axis, title=caption.split(".")[0], description=text, mark=_mark(data))
    return Figure(name=f"{name}-comparisons", picture=picture, caption=caption, text=text)


def likert_figure(data: Data, measured: Measured, name: str) -> Figure | None:
    """Return the answers of a rating, as parts of a bar for each kind; None where there is no scale of a few values."""
    measure = measured.measure
    if measure.scale is None or len(measure.scale) > 11:
        return None
    rows = [(data.label(data.kinds[s.kind]), s.counts) for s in measured.summaries]
    names = [f"{value:g}" for value in measure.scale]
    said = []
    for label, counts in rows:
        total = sum(counts)
        parts = ", ".join(
            f"{value:g}: {percent(c / total if total else None)}"
            for value, c in zip(measure.scale, counts, strict=True)
        )
        said.append(say("figures.likert_row", label=label, parts=parts))
    caption = say("figures.likert", inner=measure.inner)
    if measure.ends:
        ends = {"low": names[0], "first": measure.ends[0], "high": names[-1], "last": measure.ends[1]}
        caption = say("figures.likert_ends", inner=measure.inner, **ends)
    text = " ".join(said)
    picture = likert_chart(rows, names, title=caption.split(".")[0], description=text, mark=_mark(data))
    return Figure(name=f"{name}-answers", picture=picture, caption=caption, text=text)


def published_of(data: Data, group: GroupResult, option: str) -> float | None:
    """Return the share of an option that the paper published for the same grouping."""
    cores = tuple(data.cores.get(kind, kind) for kind in group.kinds)
    return published_share(cores, data.cores.get(option, option))


def shares_figures(data: Data, found: Preferences) -> Iterator[Figure]:
    """Yield the shares of each grouping."""
    for i, group in enumerate(found.groups):
        if isinstance(group.shares, Lacking):
            continue
        rows = [
            Row(
                label=option_label(data, option),
                value=share.share,
                low=share.low,
                high=share.high,
                text=percent(share.share, 1),
                published=published_of(data, group, option),
            )
            for option, share in zip(group.options, group.shares, strict=True)
        ]
        known = any(row.published is not None for row in rows)
        caption = say("figures.shares" if known else "figures.shares_new", count=i + 1)
        axis = axis_of([0.0], say("figures.axis_share"), ends=(0.0, 1.0), percent=True)
        text = " ".join(
            say("figures.row", label=row.label, value=row.text, low=percent(row.low, 1), high=percent(row.high, 1))
            + (" " + say("figures.row_published", value=percent(row.published, 1)) if row.published is not None else "")
            for row in rows
        )
        picture = points_chart(rows, axis, title=caption.split(".")[0], description=text, mark=_mark(data))
        yield Figure(name=f"choices-{i + 1}", picture=picture, caption=caption, text=text)


def ranking_figure(data: Data, found: Preferences) -> Figure | None:
    """Return the worths of kinds; None where there is no ranking."""
    ranking = found.ranking
    if isinstance(ranking, Lacking):
        return None
    order = sorted(range(len(ranking.items)), key=lambda i: -ranking.worth[i])
    rows = [
        Row(
            label=option_label(data, found.kinds[ranking.items[i]]),
            value=ranking.worth[i],
            low=ranking.low[i],
            high=ranking.high[i],
            text=number(ranking.worth[i]),
        )
        for i in order
    ]
    caption = say("figures.ranking")
    axis = axis_of([0.0, *_values(rows)], say("figures.axis_worth"))
    text = _rows_text(rows)
    picture = points_chart(rows, axis, title=caption.split(".")[0], description=text, mark=_mark(data))
    return Figure(name="ranking", picture=picture, caption=caption, text=text)

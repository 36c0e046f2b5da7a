"""One measure of a study enters, the three layers of statistics leave; what cannot be computed says why.

*As published*: every answer counts as if it came from another person. *Primary*: persons are compared with themselves where they
answered for several kinds, by the means of their answers over the maps on which they answered for all kinds. *Ordinal*: only order
counts. Times are compared on the log scale in the latter two, so that differences are ratios.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.data import Data, Measure
from ratherthan.apps.study.analysis.preferring import Lacking, attempted
from ratherthan.apps.study.analysis.statistics import NotComputableError
from ratherthan.apps.study.analysis.statistics.corrections import holm
from ratherthan.apps.study.analysis.statistics.mixed import Mixed, MixedContrast, mixed
from ratherthan.apps.study.analysis.statistics.ranks import (
    RankedPair,
    RankTest,
    friedman,
    kruskal,
    mann_whitney,
    wilcoxon,
)
from ratherthan.apps.study.analysis.statistics.repeated import Contrast, Repeated, paired, repeated, unpaired
from ratherthan.apps.study.analysis.statistics.variance import OneWay, Pair, Welch, one_way, tukey, welch

__all__ = ["PLANNED", "Compared", "KindSummary", "Measured", "measured", "planned", "table_of"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
PLANNED = (
    ("responsibility", "naive-state"),
    ("constrictive", "naive-state"),
    ("selective", "naive-path"),
    ("contrastive", "naive-path"),
    ("naive-state", "none"),
    ("responsibility", "none"),
    ("constrictive", "none"),
    ("naive-path", "none"),
    ("selective", "none"),
    ("contrastive", "none"),
)
MOST_PAIRS = 45


@dataclass(frozen=True, kw_only=True)
class KindSummary:
    """The answers for one kind. For times `mean` is the geometric mean over persons, with its interval."""

    kind: int
    answers: int
    persons: int
    mean: float  # over persons
    low: float | None
    high: float | None
    spread: float | None  # standard deviation of the answers
    median: float
    counts: tuple[int, ...]  # of each value of the scale


@dataclass(frozen=True, kw_only=True)
class Compared:
    """A contrast of two kinds in all layers; `corrected` is Holm's p among the contrasts of this measure."""

    first: int
    second: int
    contrast: Contrast | Lacking
    corrected: float | None
    mixed: MixedContrast | Lacking
    mixed_corrected: float | None
    ranked: RankedPair | Lacking
    ranked_corrected: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """All statistics of one measure. `within`: whether at least half of the persons answered for several kinds."""

    measure: Measure
    kinds: tuple[int, ...]  # those with answers
    persons: int
    complete: int  # persons in the table of the primary analysis
    within: bool
    several: int  # persons who answered for several kinds
    by_map: bool  # whether that table holds only maps on which a person answered for all kinds
    summaries: tuple[KindSummary, ...]
    one_way: OneWay | Lacking
    tukey: list[Pair] | Lacking  # indices into `kinds`
    primary: Repeated | Welch | Lacking
    compared: tuple[Compared, ...]
    mixed: Mixed | Lacking
    ordinal: RankTest | Lacking


def planned(data: Data, wanted: Sequence[tuple[str, str]] | None = None) -> list[tuple[str, str]]:
    """Return the contrasts to look at: those wanted, else the paper's, else all pairs of kinds."""
    if wanted is not None:
        return list(wanted)
    cores = {core: kind for kind, core in data.cores.items()}
    known = [(cores[a], cores[b]) for a, b in PLANNED if a in cores and b in cores]
    if known:
        return known
    kinds = data.kinds
    return [(b, a) for i, a in enumerate(kinds) for b in kinds[i + 1 :]][:MOST_PAIRS]


def table_of(measure: Measure, kinds: Sequence[int]) -> tuple[Floats, Ints, bool]:
    """Return the means of each person by kind, ``[persons, kinds]``, of whom, and whether only over maps with all kinds.

    A person counts who answered for every kind. Where on some map they did for all, only such maps are taken, so that a kind is not
    better because its map was easier.
    """
    persons = int(measure.person.max(initial=-1)) + 1
    places = int(measure.place.max(initial=-1)) + 1
    column = np.full(int(measure.kind.max(initial=-1)) + 1, -1)
    column[list(kinds)] = np.arange(len(kinds))
    sums, counts = np.zeros((persons, places, len(kinds))), np.zeros((persons, places, len(kinds)))
    mine = column[measure.kind] >= 0
    at = measure.person[mine], measure.place[mine], column[measure.kind[mine]]
    np.add.at(sums, at, measure.value[mine])
    np.add.at(counts, at, 1.0)
    full = np.all(counts > 0, axis=2)
    full = np.atleast_2d(full)
    by_map = bool(full.any())
    if by_map:
        chosen = full[:, :, None]
        who = np.flatnonzero(full.any(axis=1))
        with np.errstate(invalid="ignore", divide="ignore"):
            cells = np.where(chosen, sums / counts, 0.0).sum(axis=1) / full.sum(axis=1)[:, None]
    else:
        who = np.flatnonzero((counts.sum(axis=1) > 0).all(axis=1))
        with np.errstate(invalid="ignore", divide="ignore"):
            cells = sums.sum(axis=1) / counts.sum(axis=1)
    return cells[who], who, by_map


def measured(data: Data, measure: Measure, contrasts: Sequence[tuple[str, str]]) -> Measured:
    """Return all statistics of a measure.

    Parameters
    ----------
    data : Data
    measure : Measure
        With at least one answer.
    contrasts : sequence of (kind, kind)
        The first less the second.
    """
    kinds = tuple(int(k) for k in np.unique(measure.kind))
    raw = [measure.value[measure.kind == k] for k in kinds]
    scaled = replace(measure, value=np.log(measure.value)) if measure.time else measure
    several = _several(measure, len(data.kinds))
    within = several * 2 >= np.unique(measure.person).size
    table, _, by_map = table_of(scaled, kinds)
    of_persons = [_means(scaled, k) for k in kinds]
    order = {k: i for i, k in enumerate(kinds)}
    renumbered = np.array([order.get(k, -1) for k in range(len(data.kinds))], dtype=np.int64)[scaled.kind]
    model = attempted(lambda: mixed(scaled.person, renumbered, scaled.place, scaled.value))
    pairs = [(data.kinds.index(a), data.kinds.index(b)) for a, b in contrasts if a in data.kinds and b in data.kinds]
    pairs = [pair for pair in pairs if pair[0] in order and pair[1] in order]
    return Measured(
        measure=measure,
        kinds=kinds,
        persons=int(np.unique(measure.person).size),
        complete=len(table) if within else int(np.unique(measure.person).size),
        within=within,
        several=several,
        by_map=by_map and len(np.unique(measure.place)) > 1,
        summaries=tuple(_summary(scaled, k, values) for k, values in zip(kinds, raw, strict=True)),
        one_way=attempted(lambda: one_way(raw)),
        tukey=attempted(lambda: tukey(raw)),
        primary=attempted(lambda: repeated(table) if within else welch(of_persons)),
        compared=_compared(scaled, pairs, within, model, order),
        mixed=model,
        ordinal=attempted(lambda: friedman(table) if within else kruskal(of_persons)),
    )


def _several(measure: Measure, kinds: int) -> int:
    """Return how many persons answered for several kinds."""
    persons = np.unique(measure.person * kinds + measure.kind) // kinds
    return int((np.unique(persons, return_counts=True)[1] > 1).sum())


def _means(measure: Measure, kind: int) -> Floats:
    """Return the mean of each person who answered for a kind."""
    mine = measure.kind == kind
    _, code, counts = np.unique(measure.person[mine], return_inverse=True, return_counts=True)
    means: Floats = np.bincount(code, weights=measure.value[mine]) / counts
    return means


def _summary(measure: Measure, kind: int, values: Floats) -> KindSummary:
    """Return the summary of a kind; `measure` has logarithms of times, `values` the times themselves."""
    from scipy.stats import t

    means = _means(measure, kind)
    centre = float(means.mean())
    low = high = None
    if len(means) > 1 and np.ptp(means) > 1e-12 * abs(centre):  # persons who are all alike tell nothing of chance
        reach = float(t.ppf(0.975, len(means) - 1) * means.std(ddof=1) / np.sqrt(len(means)))
        low, high = centre - reach, centre + reach
    if measure.time:
        centre, low, high = (None if x is None else float(np.exp(x)) for x in (centre, low, high))  # type: ignore[assignment]
    return KindSummary(
        kind=kind,
        answers=len(values),
        persons=len(means),
        mean=centre,
        low=low,
        high=high,
        spread=float(values.std(ddof=1)) if len(values) > 1 else None,
        median=float(np.median(values)),
        counts=tuple(int((values == point).sum()) for point in measure.scale or ()),
    )


def _compared(
    measure: Measure, pairs: list[tuple[int, int]], within: bool, model: Mixed | Lacking, order: dict[int, int]
) -> tuple[Compared, ...]:
    """Return the contrasts, their p values corrected together."""
    rows = []
    for a, b in pairs:
        if within:
            table = table_of(measure, (a, b))[0]
            first, second = table[:, 0], table[:, 1]
        else:
            first, second = _means(measure, a), _means(measure, b)
        contrast = attempted(lambda: (paired if within else unpaired)(first, second))  # noqa: B023 - called at once
        ranked = attempted(lambda: (wilcoxon if within else mann_whitney)(first, second))  # noqa: B023 - called at once
        rows.append((a, b, contrast, ranked))
    corrected = holm([None if isinstance(row[2], Lacking) else row[2].p for row in rows])
    ordered = holm([None if isinstance(row[3], Lacking) else row[3].p for row in rows])
    modelled = [model if isinstance(model, Lacking) else _checked(model, order[a], order[b]) for a, b, _, _ in rows]
    of_model = holm([None if isinstance(row, Lacking) else row.p for row in modelled])
    return tuple(
        Compared(
            first=row[0],
            second=row[1],
            contrast=row[2],
            corrected=corrected[i],
            mixed=modelled[i],
            mixed_corrected=of_model[i],
            ranked=row[3],
            ranked_corrected=ordered[i],
        )
        for i, row in enumerate(rows)
    )


def _checked(model: Mixed, first: int, second: int) -> MixedContrast | Lacking:
    """Return a contrast of the mixed model, or why it has none."""

    def found() -> MixedContrast:
        contrast = model.contrast(first, second)
        if not np.isfinite([contrast.low, contrast.p]).all():
            raise NotComputableError("The mixed model gives this contrast no spread.")
        return contrast

    return attempted(found)

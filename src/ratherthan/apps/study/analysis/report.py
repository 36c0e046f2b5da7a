"""All statistics of a study enter, the report leaves as a document."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ratherthan.apps.study.analysis.data import FINISHED, Data
from ratherthan.apps.study.analysis.document import Block, Document, Heading, Paragraph, Table
from ratherthan.apps.study.analysis.excluding import Exclusion, Rules
from ratherthan.apps.study.analysis.listing import (
    contrasts_table,
    published_table,
    robust_table,
    summary_table,
    tests_table,
    tukey_table,
)
from ratherthan.apps.study.analysis.measuring import Measured
from ratherthan.apps.study.analysis.pictures import (
    contrasts_figure,
    likert_figure,
    means_figure,
    ranking_figure,
    shares_figures,
)
from ratherthan.apps.study.analysis.preferred import preference_verdict
from ratherthan.apps.study.analysis.preferring import Lacking, Preferences
from ratherthan.apps.study.analysis.statistics.corrections import SAMPLES
from ratherthan.apps.study.analysis.statistics.repeated import Repeated
from ratherthan.apps.study.analysis.verdicts import Verdict, measure_verdict
from ratherthan.apps.study.analysis.votes import choice_tables
from ratherthan.apps.study.analysis.words import listed, number, percent, say

__all__ = ["Findings", "report_of", "verdicts_of"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """All that was computed of a study.

    Parameters
    ----------
    data : Data
        Before exclusions.
    rules : Rules
    exclusion : Exclusion
    measured : tuple of Measured
        Of those whose answers count; of everybody where nobody is left.
    everyone : tuple of Measured
        Without exclusions; empty where these leave nobody out.
    preferences : Preferences, optional
    lacking : dict of str to str
        Measures that nothing can be computed of, and why.
    """

    data: Data
    rules: Rules
    exclusion: Exclusion
    measured: tuple[Measured, ...]
    everyone: tuple[Measured, ...]
    preferences: Preferences | None
    lacking: dict[str, str]

    def without_exclusions(self, name: str) -> Measured | None:
        """Return a measure without exclusions, None where there are none."""
        return next((other for other in self.everyone if other.measure.name == name), None)


def verdicts_of(found: Findings) -> list[Verdict]:
    """Return one paragraph for each hypothesis, measure or choice."""
    data = found.data
    verdicts = [measure_verdict(data, m, found.without_exclusions(m.measure.name)) for m in found.measured]
    if found.preferences is not None:
        verdicts.append(preference_verdict(data, found.preferences))
    return verdicts


def report_of(found: Findings) -> Document:
    """Return the report."""
    data = found.data
    banner = say("forms.simulated") if data.simulated else ""
    verdicts = verdicts_of(found)
    blocks: list[Block] = []
    if any(verdict.short for verdict in verdicts):
        blocks.append(Heading(level=2, text=say("sections.short")))
        blocks += [Paragraph(text=verdict.short) for verdict in verdicts if verdict.short]
    blocks += _who(found)
    hypotheses = any(verdict.short for verdict in verdicts)
    if verdicts:
        blocks.append(Heading(level=2, text=say("sections.hypotheses" if hypotheses else "sections.comparisons")))
        for verdict in verdicts:
            blocks += [Heading(level=3, text=verdict.name), Paragraph(text=verdict.text)]
    for i, measured in enumerate(found.measured):
        blocks += _measure(data, measured, f"{i + 1}-{'time' if measured.measure.time else 'rating'}")
    for name, why in found.lacking.items():
        blocks += [Heading(level=2, text=name), Paragraph(text=why, warning=True)]
    if found.preferences is not None:
        blocks += _preferences(data, found.preferences)
    if data.cores:
        blocks += _published(found)
    if found.everyone:
        blocks += [
            Heading(level=2, text=say("sections.robust")),
            Paragraph(text=say("robust.intro")),
            robust_table(data, found.measured, found.everyone),
        ]
    blocks += _methods(found)
    return Document(title=say("forms.title", title=data.title), banner=banner, blocks=tuple(blocks))


def _who(found: Findings) -> Iterator[Block]:
    """Yield who answered and who was left out."""
    data, exclusion = found.data, found.exclusion
    yield Heading(level=2, text=say("sections.who"))
    kept = int(exclusion.keep.sum())
    finished = exclusion.states.get(FINISHED, 0)
    key = "who.sentence" if kept else "who.none_kept"
    yield Paragraph(text=say(key, all=len(data.persons), finished=finished, kept=kept), warning=not kept)
    states = tuple((state, str(count)) for state, count in exclusion.states.items())
    yield Table(caption=say("captions.states"), head=(say("tables.state"), say("tables.persons")), rows=states)
    if any(exclusion.counts.values()):
        rules = {"most": found.rules.failed_checks, "seconds": f"{found.rules.fastest:g}"}
        rows = tuple(
            (say(f"reasons.{reason}", **rules), str(count)) for reason, count in exclusion.counts.items() if count
        )
        yield Table(caption=say("captions.excluded"), head=(say("tables.reason"), say("tables.persons")), rows=rows)
    if found.rules.unfinished:
        yield Paragraph(text=say("notes.unfinished_counted"))
    for note in data.notes:
        yield Paragraph(text=note, warning=True)
    if data.about:
        about = tuple((item, value, str(count)) for item, told in data.about.items() for value, count in told.items())
        head = (say("tables.what"), say("tables.value"), say("tables.persons"))
        yield Table(caption=say("captions.about"), head=head, rows=about, words=2)


def _measure(data: Data, measured: Measured, name: str) -> Iterator[Block]:
    """Yield all on one measure."""
    item = measured.measure.label
    yield Heading(level=2, text=say("sections.measure", item=item))
    if len(measured.kinds) < 2:
        yield Paragraph(text=say("measure.two_only", count=len(measured.kinds)), warning=True)
    yield means_figure(data, measured, name)
    likert = likert_figure(data, measured, name)
    if likert is not None:
        yield likert
    yield summary_table(data, measured)
    answers = sum(s.answers for s in measured.summaries)
    if measured.within:
        yield Paragraph(text=say("measure.primary_within", complete=measured.complete, persons=measured.persons))
        if measured.by_map:
            yield Paragraph(text=say("measure.by_map"))
    elif len(measured.kinds) > 1:
        some = say("measure.between_some", count=measured.several) if measured.several else ""
        yield Paragraph(text=some or say("measure.between"), warning=bool(some))
    yield tests_table(measured, paper=bool(data.cores))
    if isinstance(measured.primary, Repeated) and measured.primary.epsilon < 0.75:
        yield Paragraph(text=say("measure.epsilon_low", epsilon=number(measured.primary.epsilon)))
    if answers > measured.persons:
        key = "measure.as_published" if data.cores else "measure.by_itself"
        yield Paragraph(text=say(key, answers=answers, persons=measured.persons))
    if measured.compared:
        yield contrasts_table(data, measured)
        figure = contrasts_figure(data, measured, name)
        if figure is not None:
            yield figure
    if not isinstance(measured.tukey, Lacking):
        yield tukey_table(data, measured, measured.tukey)


def _preferences(data: Data, found: Preferences) -> Iterator[Block]:
    """Yield all on the choices."""
    yield Heading(level=2, text=say("sections.preferences"))
    figures = list(shares_figures(data, found))
    tables = choice_tables(data, found)
    yield from figures
    yield from tables
    ranking = ranking_figure(data, found)
    if ranking is not None:
        yield ranking
    elif isinstance(found.ranking, Lacking):
        yield Paragraph(text=say("prefer.no_ranking", why=found.ranking.why), warning=True)


def _published(found: Findings) -> Iterator[Block]:
    """Yield what the paper published, beside what was found."""
    yield Heading(level=2, text=say("sections.published"))
    yield Paragraph(text=say("published.intro"))
    yield published_table(found.measured)
    left = listed([percent(1 - a - b) for a, b in ((0.38, 0.46), (0.32, 0.48), (0.577, 0.263))])
    for key in ("recomputed", "degrees", "contradiction", "nothing"):
        yield Paragraph(text=say(f"published.{key}"))
    yield Paragraph(text=say("published.neither", parts=left))


def _methods(found: Findings) -> Iterator[Block]:
    """Yield how all was computed."""
    yield Heading(level=2, text=say("sections.methods"))
    keys = ["paragraphs" if found.data.cores else "paragraphs_plain"]
    if any(not measured.within for measured in found.measured):
        keys.append("between")
    if _rated(found.measured):
        keys.append("clmm")
    if found.data.cores:
        keys.append("complete")
    for key in keys:
        yield Paragraph(text=say(f"methods.{key}"))
    if found.data.words:
        parts = [
            say("methods.words_of", kind=found.data.label(kind), words=f"{count:.0f}")
            for kind, count in found.data.words.items()
        ]
        yield Paragraph(text=say("methods.words", parts=listed(parts)))
    if found.preferences is not None:
        yield Paragraph(text=say("methods.choices", samples=SAMPLES))


def _rated(measured: Sequence[Measured]) -> bool:
    return any(m.measure.scale is not None and m.within for m in measured)

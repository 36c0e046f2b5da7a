"""The place of a study's answers enters, a folder with its report leaves.

============================  ==============================================================================
file                          holds
============================  ==============================================================================
``report.html``               the report as one page, figures within
``report.md``, ``figures/``   the same as Markdown and SVG
``results.json``              every number
``ratings.csv``, ``clmm.R``   the ratings, and a script that fits a cumulative-link mixed model in R
============================  ==============================================================================
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

from ratherthan.apps.study.analysis.data import Data, restricted
from ratherthan.apps.study.analysis.document import Figure
from ratherthan.apps.study.analysis.excluding import Rules, excluded
from ratherthan.apps.study.analysis.foreign import read_foreign
from ratherthan.apps.study.analysis.meaning import Meaning
from ratherthan.apps.study.analysis.measuring import Measured, measured, planned
from ratherthan.apps.study.analysis.preferring import preferences
from ratherthan.apps.study.analysis.rendering import as_html, as_markdown
from ratherthan.apps.study.analysis.report import Findings, report_of
from ratherthan.apps.study.analysis.results import R_SCRIPT, as_document, ratings_csv
from ratherthan.apps.study.analysis.tables import read_table
from ratherthan.apps.study.analysis.tidy import is_tidy, read_tidy, tidy_file
from ratherthan.apps.study.analysis.words import listed
from ratherthan.errors import QuestionError, SourceError
from ratherthan.io._files import write_atomically

__all__ = ["analysed", "folder_for", "read_answers", "written"]


def read_answers(path: Path, meaning: Meaning | None = None) -> Data:
    """Return the answers at `path`: an export of ours, or a table of somebody else's study.

    Parameters
    ----------
    path : Path
        The folder of an export, its table, or another table.
    meaning : Meaning, optional
        What the columns of another table mean.

    Raises
    ------
    SourceError
        If there are no answers to read.
    QuestionError
        If `meaning` does not fit the table.
    """
    if not path.exists():
        raise SourceError(f"The answers must be there to be read, and '{path}' does not exist.", path=path)
    file = tidy_file(path)
    table = read_table(file)
    if meaning:
        return read_foreign(file, meaning, table)
    if not is_tidy(table):
        raise QuestionError(
            f"'{file.name}' is no export of 'ratherthan study export'. For a table of another study say what its columns mean, e.g. "
            f"--columns participant=ID,kind=CONDITION --ratings trust=TRUST. Its columns are "
            + listed([f"'{name}'" for name in list(table)[:30]])
            + "."
        )
    data = read_tidy(path, table)
    if not data.measures and not data.choices:
        raise SourceError(f"An export must hold answers to explanations, and '{path}' holds none yet.", path=path)
    return data


def analysed(
    data: Data,
    *,
    rules: Rules | None = None,
    contrasts: Sequence[tuple[str, str]] | None = None,
    tell: Callable[[str], None] | None = None,
) -> Findings:
    """Return all statistics of a study.

    Parameters
    ----------
    data : Data
    rules : Rules, optional
        Who is left out.
    contrasts : sequence of (kind, kind), optional
        The comparisons to look at in place of the planned ones.
    tell : callable, optional
        Is told what is being computed.

    Raises
    ------
    QuestionError
        If a contrast names a kind that the data do not have, or one kind twice.
    """
    rules = Rules() if rules is None else rules
    for pair in contrasts or ():
        for kind in pair:
            if kind not in data.kinds:
                raise QuestionError(
                    f"A comparison must name kinds that have answers, {listed(list(data.kinds))}; got '{kind}'."
                )
        if pair[0] == pair[1]:
            raise QuestionError(f"A comparison is of two different kinds, got '{pair[0]}' twice.")
    exclusion = excluded(data, rules)
    anybody = bool(exclusion.keep.any())
    kept = restricted(data, exclusion.keep) if anybody else data
    wanted = planned(data, contrasts)
    lacking: dict[str, str] = {}

    def all_of(part: Data, label: str) -> tuple[Measured, ...]:
        results = []
        for measure in part.measures:
            if tell is not None:
                tell(f"{measure.label}, {label}")
            if len(measure.value) == 0:
                lacking[measure.label] = "Nobody whose answers count has answered this item."
                continue
            results.append(measured(part, measure, wanted))
        return tuple(results)

    of_kept = all_of(kept, "after exclusions")
    others = all_of(data, "all answers") if anybody and not exclusion.keep.all() else ()
    return Findings(
        data=data,
        rules=rules,
        exclusion=exclusion,
        measured=of_kept,
        everyone=others,
        preferences=preferences(_voting(kept)),
        lacking=lacking,
    )


def _voting(data: Data) -> Data:
    """Return data without groupings in which nobody whose answers count has chosen."""
    from dataclasses import replace

    return replace(data, choices=tuple(votes for votes in data.choices if len(votes.person)))


def folder_for(folder: Path) -> None:
    """Make the folder of a report.

    Raises
    ------
    SourceError
        If it cannot be made.
    """
    try:
        (folder / "figures").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SourceError(
            f"The report needs a folder to lie in, and '{folder}' cannot be made: {error.strerror or error}.",
            path=folder,
        ) from error


def written(found: Findings, folder: Path) -> list[Path]:
    """Write the report and what belongs to it into a folder, and return the files.

    Raises
    ------
    SourceError
        If they cannot be written.
    """
    document = report_of(found)
    files = {
        "report.html": as_html(document),
        "report.md": as_markdown(document),
        "results.json": json.dumps(as_document(found), indent=1, ensure_ascii=False, allow_nan=False) + "\n",
    }
    for block in document.blocks:
        if isinstance(block, Figure):
            files[f"figures/{block.name}.svg"] = block.picture.svg
    ratings = ratings_csv(found)
    if ratings:
        files |= {"ratings.csv": ratings, "clmm.R": R_SCRIPT}
    paths = []
    folder_for(folder)
    for name, text in files.items():
        with write_atomically(folder / name) as file:
            file.write(text.encode("utf-8", "backslashreplace"))
        paths.append(folder / name)
    return paths

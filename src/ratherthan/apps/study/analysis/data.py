"""What a study's answers are, whatever table they came from: persons, measures by kind and map, and choices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

__all__ = ["FINISHED", "Choices", "Data", "Measure", "Person", "restricted"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
FINISHED = "finished"


@dataclass(frozen=True, kw_only=True)
class Person:
    """One participant.

    Parameters
    ----------
    name : str
        As in the table.
    state : str
        "finished", or how else it ended; `FINISHED` where a table does not say.
    failed_checks : int, optional
        Attention checks that were answered wrongly; None where there were none.
    seconds : float, optional
        The median time of a trial; None where no times are known.
    trials : int
        How many trials have an answer.
    """

    name: str
    state: str = FINISHED
    failed_checks: int | None = None
    seconds: float | None = None
    trials: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Measure:
    """One thing that was measured after explanations, an entry an answer.

    Parameters
    ----------
    name, label : str
    unit : str, optional
    time : bool
        Whether it is a time, to be analysed on the log scale.
    person, kind, place : array of int, ``[answers]``
        Indices into the persons, kinds and maps of the data.
    value : array, ``[answers]``
    scale : tuple of float, optional
        The allowed values of a rating, in order.
    ends : tuple of str, optional
        What the least and the most of them mean.
    """

    name: str
    label: str
    unit: str | None = None
    time: bool = False
    person: Ints
    kind: Ints
    place: Ints
    value: Floats
    scale: tuple[float, ...] | None = None
    ends: tuple[str, str] | None = None

    @property
    def inner(self) -> str:
        """The label as it stands within a sentence."""
        return self.label[:1].lower() + self.label[1:] if self.label[1:2].islower() else self.label


@dataclass(frozen=True, kw_only=True, eq=False)
class Choices:
    """What persons preferred of one grouping.

    Parameters
    ----------
    name : str
    options : tuple of str
        Ids of kinds, and "neither" at the end where it could be chosen.
    person, choice, place : array of int, ``[votes]``
        `choice` is an index into `options`.
    """

    name: str
    options: tuple[str, ...]
    person: Ints
    choice: Ints
    place: Ints


@dataclass(frozen=True, kw_only=True, eq=False)
class Data:
    """All answers of a study.

    Parameters
    ----------
    source, title : str
    design : str
        The fingerprint of the design, "" where none is known.
    simulated : bool
        Whether robots answered.
    kinds, maps : tuple of str
    labels : mapping of str to str
        What kinds are called.
    cores : mapping of str to str
        Which of the seven kinds of explanations a kind is, where that is known.
    persons : tuple of Person
    measures : tuple of Measure
    choices : tuple of Choices
    about : mapping of str to mapping of str to int
        How many persons told what of themselves.
    words : mapping of str to float
        How many words an explanation of a kind had, in the mean over what was shown.
    notes : tuple of str
        Sentences on what was found wrong in the table and what was done about it.
    """

    source: str
    title: str
    design: str = ""
    simulated: bool = False
    kinds: tuple[str, ...]
    maps: tuple[str, ...]
    labels: Mapping[str, str] = field(default_factory=dict)
    cores: Mapping[str, str] = field(default_factory=dict)
    persons: tuple[Person, ...]
    measures: tuple[Measure, ...]
    choices: tuple[Choices, ...] = ()
    about: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    words: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def label(self, kind: str) -> str:
        """Return what a kind is called."""
        return self.labels.get(kind, kind)


def restricted(data: Data, keep: Bools) -> Data:
    """Return the answers of some persons; the others stay in `persons`, so that indices hold.

    Parameters
    ----------
    data : Data
    keep : array of bool, ``[persons]``
    """
    measures = []
    for measure in data.measures:
        kept = keep[measure.person]
        measures.append(
            replace(
                measure,
                person=measure.person[kept],
                kind=measure.kind[kept],
                place=measure.place[kept],
                value=measure.value[kept],
            )
        )
    choices = []
    for votes in data.choices:
        kept = keep[votes.person]
        choices.append(replace(votes, person=votes.person[kept], choice=votes.choice[kept], place=votes.place[kept]))
    return replace(data, measures=tuple(measures), choices=tuple(choices))

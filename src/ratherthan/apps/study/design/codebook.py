"""A design enters, its codebook leaves: what is recorded, on which pages, of which type, in which unit, with which values.

The codebook is made from the screens themselves, so it cannot disagree with what participants see. The program adds the times to what
the design records: they are measured on every page.
"""

from __future__ import annotations

from dataclasses import dataclass

from ratherthan.apps.study.design.nouns import Design, Option, Record, Screen
from ratherthan.apps.study.design.screens import PREFERRED, screens

__all__ = ["MEASURED", "Entry", "codebook"]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One thing that is recorded.

    Parameters
    ----------
    item : str
        Its name in the table of observations.
    phases : tuple of str
        On which kinds of page it is recorded.
    type : str
        "choice", "number", "text" or "flag".
    unit : str
        Empty where there is none.
    label : str
        What the person was asked.
    options : tuple of Option
        The allowed values with their labels.
    least, most : float, optional
    longest : int, optional
    required : bool
    times : int
        How often it is recorded of one participant who finishes.
    correct : str
        The right answer, empty where there is none.
    """

    item: str
    phases: tuple[str, ...]
    type: str
    unit: str
    label: str
    options: tuple[Option, ...] = ()
    least: float | None = None
    most: float | None = None
    longest: int | None = None
    required: bool = True
    times: int = 1
    correct: str = ""

    @property
    def allowed(self) -> str:
        """The allowed values in words: "1 = Strongly disagree | …", "from 18 to 120", "at most 2000 characters"."""
        if self.options:
            return " | ".join(
                str(option.value)
                if str(option.value) == option.label or not option.label
                else f"{option.value} = {option.label}"
                for option in self.options
            )
        if self.type == "number":
            bounds = [
                f"{word} {bound:g}" for word, bound in (("from", self.least), ("to", self.most)) if bound is not None
            ]
            return " ".join(bounds)
        if self.type == "flag":
            return "true | false"
        return "" if self.longest is None else f"at most {self.longest} characters"


MEASURED = {
    "time": "Seconds for which the page was visible, over all attempts",
    "hidden_time": "Seconds for which the page was open but hidden, over all attempts",
}
"""What is measured on every page, and what it is."""


def codebook(design: Design) -> tuple[Entry, ...]:
    """Return what is recorded of a participant, in the order in which it is met.

    Parameters
    ----------
    design : Design
        With its stimuli.
    """
    found: dict[str, list[tuple[Screen, Record]]] = {}
    shown = screens(design, 0)
    for screen in shown:
        for record in screen.records:
            found.setdefault(record.name, []).append((screen, record))
    entries = [_preferred(design, met) if name == PREFERRED else _entry(met) for name, met in found.items()]
    phases = tuple(dict.fromkeys(screen.phase for screen in shown))
    for name, label in MEASURED.items():
        entry = Entry(item=name, phases=phases, type="number", unit="s", label=label, least=0.0, times=len(shown))
        entries.append(entry)
    return tuple(entries)


def _entry(met: list[tuple[Screen, Record]]) -> Entry:
    first = met[0][1]
    return Entry(
        item=first.name,
        phases=tuple(dict.fromkeys(screen.phase for screen, _ in met)),
        type=first.type,
        unit=first.unit or "",
        label=first.label,
        options=first.options,
        least=first.least,
        most=first.most,
        longest=first.longest,
        required=first.required,
        times=len(met),
        correct="" if first.correct is None else str(first.correct),
    )


def _preferred(design: Design, met: list[tuple[Screen, Record]]) -> Entry:
    """Return the entry of what is preferred: of each grouping other values are allowed."""
    names = {kind.id: kind.label for kind in design.kinds}
    values = dict.fromkeys(option.value for _, record in met for option in record.options)
    options = tuple(Option(value=value, label=names.get(str(value), "none of them")) for value in values)
    plain = _entry(met)
    return Entry(
        item=plain.item,
        phases=plain.phases,
        type=plain.type,
        unit="",
        label=plain.label,
        options=options,
        times=len(met),
    )

"""What was found on power enters, it leaves as lines, as a table or as a document."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any

from ratherthan.apps.study.analysis.tidy import KINDS
from ratherthan.apps.study.analysis.words import listed, number, percent, say
from ratherthan.apps.study.robots.model import ResponseModel
from ratherthan.apps.study.robots.power import TIME, Plan, Power, recruited
from ratherthan.errors import QuestionError

__all__ = ["document", "items_in", "kinds_in", "lines", "table"]

HEAD = (
    *("simulated", "item", "first", "second", "difference", "size", "enough", "enough_low", "enough_high", "recruit"),
    *("power_at_most", "most"),
)


def kinds_in(text: str | None) -> tuple[str, ...]:
    """Return kinds named in a text, all seven by default.

    Raises
    ------
    QuestionError
        If one is unknown.
    """
    if text is None:
        return KINDS
    named = [part.strip() for part in text.split(",")]
    for name in named:
        if name not in KINDS:
            raise QuestionError(f"A kind is one of {listed(KINDS)}, got '{name}'.")
    return tuple(kind for kind in KINDS if kind in named)


def items_in(names: Sequence[str], model: ResponseModel) -> tuple[str, ...]:
    """Return the items that are asked for, by default understanding, trust and time.

    Raises
    ------
    QuestionError
        If the model does not know one.
    """
    known = [*model.ratings, TIME]
    for name in names:
        if name not in known:
            raise QuestionError(f"The model knows the items {listed(known)}, got '{name}'.")
    return tuple(dict.fromkeys(names)) or tuple(name for name in ("understanding", "trust", TIME) if name in known)


def _round(found: Power) -> int:
    """Return how many persons are a full round of the balanced plan."""
    from math import lcm

    def rows(count: int) -> int:
        return count if count % 2 == 0 else 2 * count

    return lcm(rows(len(found.setting.kinds)), rows(found.setting.maps))


def lines(found: Sequence[Power], model: ResponseModel, lost: float) -> list[str]:
    """Return what was found, as lines for a person."""
    told = [
        say("power.intro", model=model.name, factor=f"{found[0].setting.factor:g}", samples=found[0].setting.samples)
    ]
    for power in found:
        told += ["", say("power.item", item=power.item)]
        head = (
            say("tables.comparison"),
            say("power.size"),
            say("power.enough"),
            say("power.recruit"),
            say("power.at", people=power.setting.most),
        )
        rows = [head, *(_row(power, plan, c, lost) for c, plan in enumerate(power.plans))]
        widths = [max(len(row[i]) for row in rows) for i in range(len(head))]
        told += ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        worst = [plan.enough for plan in power.plans if plan.differs]
        wanted = percent(power.setting.wanted)
        if not worst:
            told.append(say("power.nothing", share=percent(float(power.any_found[-1]), 1)))
        elif None in worst:
            told.append(say("power.not_all", most=power.setting.most, wanted=wanted))
        else:
            persons = max(n for n in worst if n is not None)
            told.append(
                say("power.all", persons=persons, wanted=wanted, recruit=recruited(persons, lost, _round(power)))
            )
    told += ["", say("power.lost", lost=percent(lost), round=_round(found[0])), say("power.made_up")]
    return told


def _row(power: Power, plan: Plan, place: int, lost: float) -> tuple[str, ...]:
    if not plan.differs:
        enough, recruit = say("power.alike"), "–"
    elif plan.enough is None:
        enough, recruit = say("power.more", most=power.setting.most), "–"
    else:
        high = say("power.beyond", most=power.setting.most) if plan.high is None else str(plan.high)
        enough = say("power.span", enough=plan.enough, low=plan.low, high=high)
        recruit = str(recruited(plan.enough, lost, _round(power)))
    return (
        f"{plan.first} − {plan.second}",
        number(plan.size),
        enough,
        recruit,
        percent(float(power.curve[-1, place]), 1),
    )


def table(found: Sequence[Power], lost: float) -> str:
    """Return what was found as CSV."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(HEAD)
    for power in found:
        for c, plan in enumerate(power.plans):
            numbers = (
                plan.enough,
                plan.low,
                plan.high,
                None if plan.enough is None else recruited(plan.enough, lost, _round(power)),
            )
            cells = ("" if n is None else n for n in numbers)
            shown = f"{plan.difference:.6g}", f"{plan.size:.6g}"
            at_most = f"{power.curve[-1, c]:.6g}", power.setting.most
            writer.writerow(["true", power.item, plan.first, plan.second, *shown, *cells, *at_most])
    return file.getvalue()


def document(found: Sequence[Power], model: ResponseModel, lost: float) -> dict[str, Any]:
    """Return what was found as plain JSON."""
    return {
        "version": 1,
        "simulated": True,
        "notice": say("power.made_up"),
        "model": model.name,
        "lost": lost,
        "items": [
            {
                "item": power.item,
                "kinds": list(power.setting.kinds),
                "maps": power.setting.maps,
                "factor": power.setting.factor,
                "samples": power.setting.samples,
                "seed": power.setting.seed,
                "wanted": power.setting.wanted,
                "round": _round(power),
                "any_found": [round(float(x), 6) for x in power.any_found],
                "comparisons": [
                    {
                        "first": plan.first,
                        "second": plan.second,
                        "difference": plan.difference,
                        "size": plan.size,
                        "differs": plan.differs,
                        "enough": plan.enough,
                        "between": [plan.low, plan.high],
                        "recruit": None if plan.enough is None else recruited(plan.enough, lost, _round(power)),
                        "power": [round(float(x), 6) for x in power.curve[:, c]],
                    }
                    for c, plan in enumerate(power.plans)
                ],
            }
            for power in found
        ],
    }

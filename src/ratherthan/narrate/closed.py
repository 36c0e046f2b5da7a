"""An Explanation without a way enters, whose map has closed cells in between; the sentences about what would have to open leave."""

from __future__ import annotations

from collections.abc import Sequence

from ratherthan.explain.explanation import Opening
from ratherthan.narrate.words import Vocabulary

__all__ = ["no_way_through"]

NARROW = "too narrow"
MOST_STRETCHES = 3


def no_way_through(words: Vocabulary) -> str:
    """Return what is in the way, and a smallest set of cells that would have to open."""
    cells, route = words.explanation.openings, words.table("route")
    key = "no_way_closed_one" if len(cells) == 1 else "no_way_closed_many"
    return str(route[key]).format(
        arrive=words.objective["arrive"],
        place=words.place(words.explanation.start),
        what=_obstacles(words, list(dict.fromkeys(cell.kind for cell in cells))),
        count=len(cells),
        places=_stretches(words, cells),
    )


def _obstacles(words: Vocabulary, kinds: list[str]) -> str:
    """Return the kinds of ground in words: what anybody could not pass first, what is too narrow for the robot last."""
    table = words.table("obstacles")
    if kinds == [NARROW]:
        return str(table["alone"])
    kinds.sort(key=lambda kind: kind == NARROW)
    known = {kind for kind in kinds if kind in table and kind not in ("alone", "other", "stretch", "more")}
    said = [str(table[kind]) if kind in known else str(table["other"]).replace("{kind}", kind) for kind in kinds]
    return words.language.joined(said, "and")


def _stretches(words: Vocabulary, cells: Sequence[Opening]) -> str:
    """Return the cells as stretches of neighbours: "(1 m, 2 m) to (1 m, 3 m) and (4 m, 3 m)"."""
    table = words.table("obstacles")
    stretches: list[list[Opening]] = []
    for cell in cells:
        before = stretches[-1][-1].place if stretches else None
        if before is not None and abs(before[0] - cell.place[0]) + abs(before[1] - cell.place[1]) == 1:
            stretches[-1].append(cell)
        else:
            stretches.append([cell])
    kept = stretches if len(stretches) <= MOST_STRETCHES else stretches[: MOST_STRETCHES - 1]
    said = [
        part[0].name
        if len(part) == 1
        else str(table["stretch"]).replace("{first}", part[0].name).replace("{last}", part[-1].name)
        for part in kept
    ]
    rest = len(cells) - sum(map(len, kept))
    return words.language.joined([*said, *([str(table["more"]).format(count=rest)] if rest else [])], "and")

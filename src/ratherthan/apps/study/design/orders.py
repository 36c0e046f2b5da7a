"""Ids and a way to order them enter, rows leave: who sees what first.

A *Williams square* for n things is a set of rows, each all things once, in which every thing stands in every place equally often, and
every thing follows every other equally often. For even n it has n rows, for odd n it takes 2n. Row i of n is
(i, i+1, i-1, i+2, i-2, …) modulo n; for odd n each row is followed by the same row read backwards. So row 2i+1 is the mirror of row 2i,
and both halves of the square, the even and the odd rows, are Latin squares by themselves: that makes the joint plan of `plan` exact.

Reference: E. J. Williams, Experimental designs balanced for the estimation of residual effects of treatments. Australian Journal
of Scientific Research A 2 (1949), 149-168.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Sequence

from ratherthan.apps.study.design.nouns import Design, Order

__all__ = ["ORDERS", "latin", "plan", "rounds", "rows_of", "unbalanced", "williams"]

ORDERS = ("williams", "latin", "fixed", "rows")


def williams(count: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a Williams square of the numbers from 0.

    Parameters
    ----------
    count : int
        At least 1.

    Examples
    --------
    >>> williams(3)
    ((0, 1, 2), (2, 1, 0), (1, 2, 0), (0, 2, 1), (2, 0, 1), (1, 0, 2))
    >>> len(williams(7)), len(williams(4))
    (14, 4)
    """
    if count < 3:
        return tuple(tuple((row + place) % count for place in range(count)) for row in range(count))
    first = [(place + 1) // 2 if place % 2 else -(place // 2) for place in range(count)]
    rows = [tuple((row + step) % count for step in first) for row in range(count)]
    return tuple(rows) if count % 2 == 0 else tuple(order for row in rows for order in (row, row[::-1]))


def latin(count: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a cyclic Latin square of the numbers from 0.

    Examples
    --------
    >>> latin(3)
    ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    """
    return tuple(tuple((row + place) % count for place in range(count)) for row in range(count))


def rows_of(order: Order, ids: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Return the rows in which some ids are shown, in turn.

    Parameters
    ----------
    order : Order
    ids : sequence of str
        In the order of the design.
    """
    if order.how == "rows":
        return order.rows
    if order.how == "fixed":
        return (tuple(ids),)
    square = williams(len(ids)) if order.how == "williams" else latin(len(ids))
    return tuple(tuple(ids[number] for number in row) for row in square)


def rounds(design: Design) -> int:
    """Return after how many participants the plan begins anew: everything that it balances is exact then.

    Parameters
    ----------
    design : Design

    Returns
    -------
    int
        42 for seven kinds and three maps in Williams squares.
    """
    kinds = rows_of(design.kind_order, [kind.id for kind in design.kinds])
    maps = rows_of(design.map_order, [one.id for one in design.maps])
    return math.lcm(len(kinds), len(maps))


def plan(design: Design, slot: int) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return what one participant sees: the maps in order, each with its kinds in order.

    The order of the kinds is another one for each map, so that nobody sees the same order on all maps: row ``slot + shift``, with a
    shift per map that goes round the rows in equal steps.

    Parameters
    ----------
    design : Design
    slot : int
        From 0; a row of the plan, which begins anew after `rounds`.
    """
    kinds = rows_of(design.kind_order, [kind.id for kind in design.kinds])
    ids = [one.id for one in design.maps]
    maps = rows_of(design.map_order, ids)
    shift = {one: number * len(kinds) // len(ids) for number, one in enumerate(ids)}
    return tuple((one, kinds[(slot + shift[one]) % len(kinds)]) for one in maps[slot % len(maps)])


def unbalanced(rows: Sequence[Sequence[str]]) -> tuple[str | None, str | None]:
    """Return what is not equally often where, in rows of the same ids: (a place, a neighbour); None where all is equal.

    Parameters
    ----------
    rows : sequence of sequence of str

    Returns
    -------
    tuple
        An id that does not stand in every place equally often; an id that does not follow every other equally often.
    """
    ids = sorted(rows[0])
    places = Counter((one, place) for row in rows for place, one in enumerate(row))
    pairs = Counter(pair for row in rows for pair in itertools.pairwise(row))
    placed = next((one for one in ids if len({places[one, place] for place in range(len(ids))}) > 1), None)
    usual = len(rows) * (len(ids) - 1) / max(len(ids) * (len(ids) - 1), 1)
    beside = next(
        (other for one in ids for other in ids if one != other and pairs[one, other] != usual),
        None,
    )
    return placed, beside

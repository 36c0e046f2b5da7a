from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise

import pytest
from apps.study.designs import small_design

from ratherthan.apps.study.design.nouns import Order
from ratherthan.apps.study.design.orders import latin, plan, rounds, rows_of, unbalanced, williams


@pytest.mark.parametrize("count", range(2, 10))
def test_in_a_williams_square_places_and_neighbours_are_balanced(count):
    rows = williams(count)
    assert len(rows) == (count if count % 2 == 0 else 2 * count)
    assert all(sorted(row) == list(range(count)) for row in rows)
    places = Counter((one, place) for row in rows for place, one in enumerate(row))
    assert set(places.values()) == {len(rows) // count}
    assert len(places) == count**2
    pairs = Counter(pair for row in rows for pair in pairwise(row))
    assert len(pairs) == count * (count - 1)
    assert set(pairs.values()) == {len(rows) // count}


def test_a_williams_square_of_seven_has_fourteen_rows_and_of_three_six():
    assert (len(williams(7)), len(williams(3)), len(williams(1))) == (14, 6, 1)


@pytest.mark.parametrize("count", range(3, 10, 2))
def test_each_half_of_an_odd_williams_square_is_a_latin_square(count):
    rows = williams(count)
    for half in (rows[::2], rows[1::2]):
        assert all({row[place] for row in half} == set(range(count)) for place in range(count))
    assert all(mirror == row[::-1] for row, mirror in zip(rows[::2], rows[1::2], strict=True))


def test_a_latin_square_is_balanced_over_places_but_not_over_neighbours():
    rows = [[str(one) for one in row] for row in latin(5)]
    placed, beside = unbalanced(rows)
    assert placed is None
    assert beside is not None


@pytest.mark.parametrize(("rows", "placed"), [([("a", "b")], "a"), ([("a", "b"), ("b", "a")], None)])
def test_an_order_is_called_unbalanced_where_an_id_is_not_equally_often_in_each_place(rows, placed):
    assert unbalanced(rows)[0] == placed


def test_williams_squares_are_balanced():
    for count in range(1, 9):
        rows = [[str(one) for one in row] for row in williams(count)]
        assert unbalanced(rows) == (None, None), count


def test_seven_kinds_and_three_maps_make_rounds_of_forty_two(tmp_path):
    assert rounds(small_design(tmp_path)) == 42


@pytest.mark.parametrize(("maps", "kinds"), [(3, 7), (2, 5), (1, 4), (4, 3), (2, 2), (5, 6)])
def test_over_a_round_all_margins_are_exact(tmp_path, maps, kinds):
    names = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")[:kinds]
    design = small_design(tmp_path, maps=maps, kinds=names)
    size = rounds(design)
    assert size == math.lcm(len(williams(maps)), len(williams(kinds)))
    at_map, at_kind = Counter(), Counter()
    for slot in range(size):
        for map_place, (one, row) in enumerate(plan(design, slot)):
            at_map[one, map_place] += 1
            at_kind.update((one, kind, place) for place, kind in enumerate(row))
    assert set(at_map.values()) == {size // maps}
    assert set(at_kind.values()) == {size // kinds}
    assert (len(at_map), len(at_kind)) == (maps**2, maps * kinds**2)


def test_in_the_papers_design_kind_map_and_both_places_are_jointly_balanced(tmp_path):
    design = small_design(tmp_path)
    joint = Counter(
        (kind, one, map_place, place)
        for slot in range(42)
        for map_place, (one, row) in enumerate(plan(design, slot))
        for place, kind in enumerate(row)
    )
    assert len(joint) == 7 * 3 * 3 * 7
    assert set(joint.values()) == {2}


def test_nobody_sees_the_same_order_of_kinds_on_all_maps(tmp_path):
    design = small_design(tmp_path)
    for slot in range(42):
        assert len({row for _, row in plan(design, slot)}) == 3


def test_rows_of_ones_own_are_taken_in_turn():
    order = Order(how="rows", rows=(("b", "a"), ("a", "b")))
    assert rows_of(order, ("a", "b")) == (("b", "a"), ("a", "b"))
    assert rows_of(Order(how="fixed"), ("a", "b")) == (("a", "b"),)
    assert len(rows_of(Order(how="latin"), ("a", "b", "c"))) == 3

"""Numbers in tables look different where they are, and bounds are rounded outwards."""

from __future__ import annotations

import math
import re

from hypothesis import assume, given
from hypothesis import strategies as st

from ratherthan.explain.explanation import Measured, Tally
from ratherthan.factors import Interval
from ratherthan.report.numbers import bounds_in_words, counted, lost, measured

SAID = {
    "dead": "dead",
    "fail": "fail",
    "infinite": "no end",
    "minus_infinite": "minus infinity",
    "zero": "0",
    "unproved": "not proved",
    "below": "≤ {upper}",
    "above": "≥ {lower}",
    "exact": "proved",
    "between": "{lower} to {upper}",
    "count_between": "{lower} to {upper}",
}
FINITE = st.floats(-1e9, 1e9, allow_nan=False)


def number(text: str) -> float:
    return float(text.replace("−", "-").replace(",", ""))


@given(FINITE, st.floats(0, 1e3), st.floats(0, 1e3))
def test_bounds_in_words_hold_the_bounds(value, below, above):
    interval = Interval(value=value, lower=value - below, upper=value + above)
    said = bounds_in_words(interval, SAID)
    if said == "proved":
        assert interval.lower == interval.upper
    else:
        low, high = map(number, said.split(" to "))
        assert low <= interval.lower
        assert interval.upper <= high
        room = max(interval.upper - interval.lower, 1e-5 * max(abs(interval.lower), abs(interval.upper)), 1e-11)
        assert high - low <= 21 * room


def test_a_bound_on_one_side_is_said_alone():
    assert bounds_in_words(Interval(value=3.0, lower=-math.inf, upper=3.25), SAID) == "≤ 3.25"
    assert bounds_in_words(Interval(value=3.0, lower=2.75, upper=math.inf), SAID) == "≥ 2.75"


@given(st.lists(FINITE, min_size=2, max_size=6))
def test_numbers_that_differ_look_different_as_far_as_six_decimals_tell(values):
    rows = [
        Measured(choice=k, action=f"a{k}", number=Interval(value=v, lower=v, upper=v)) for k, v in enumerate(values)
    ]
    shown = measured(rows, SAID)
    assume(all(abs(a - b) > 1e-5 * max(1.0, abs(a), abs(b)) for i, a in enumerate(values) for b in values[:i]))
    texts = [shown[row.action][0] for row in rows]
    assert len(set(texts)) == len(texts)
    for text, value in zip(texts, values, strict=True):
        assert abs(number(text) - value) <= 0.5 * 10.0 ** -len(text.partition(".")[2]) + 1e-6 * abs(value)


def test_what_does_not_arrive_is_said_in_words():
    endless = Interval(value=math.inf, lower=math.inf, upper=math.inf)
    rows = [
        Measured(choice=0, action="a", number=endless, fate="dead end"),
        Measured(choice=1, action="b", number=endless, fate="may fail"),
        Measured(choice=2, action="c", number=endless),
        Measured(choice=3, action="d", number=Interval(value=2.5, lower=-math.inf, upper=math.inf)),
    ]
    assert measured(rows, SAID) == {
        "a": ("dead", ""),
        "b": ("fail", ""),
        "c": ("no end", "proved"),
        "d": ("2.50", "not proved"),
    }


def test_shares_are_differences_from_the_smallest_number():
    least = Interval(value=6.5, lower=6.5, upper=6.5)
    endless = Interval(value=math.inf, lower=math.inf, upper=math.inf)
    rows = {"best": least, "worse": Interval(value=10.75, lower=10.75, upper=10.75), "lost": endless}
    assert lost(rows, least, SAID) == {"best": "0", "worse": "4.25", "lost": "no end"}
    assert lost({"lost": endless}, endless, SAID) == {"lost": "0"}


@given(st.integers(0, 10**12), st.integers(0, 10**12))
def test_counts_are_said_with_both_bounds_where_they_differ(one, more):
    said = counted(Tally(choice=0, action="a", lower=one, upper=one + more), SAID)
    assert [int(part.replace(",", "")) for part in re.split(" to ", said)] == ([one, one + more] if more else [one])

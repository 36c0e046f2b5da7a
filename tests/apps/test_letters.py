"""Numbers spelled for all rows at once are, letter by letter, what `repr` makes of each."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.apps.letters import FEWEST_DIGITS, MOST_DIGITS, joined, of_floats, of_texts, of_wholes, shortest


def spelled(values: np.ndarray) -> list[str]:
    """The lines that come out."""
    letters = of_floats(values, lambda number: repr(number).encode())
    return joined([letters, b"\n"], len(values)).decode().splitlines()


def assert_like_repr(values: np.ndarray) -> None:
    assert spelled(values) == list(map(repr, values.tolist()))


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=30))
def test_any_doubles_are_spelled_as_repr_does(values):
    assert_like_repr(np.array(values))


@given(st.integers(0, 2**32 - 1))
def test_doubles_of_every_size_are_spelled_as_repr_does(seed):
    random = np.random.default_rng(seed)
    exponent = random.integers(1009, 1077, 200).astype(np.uint64) << np.uint64(52)
    assert_like_repr((exponent | random.integers(0, 1 << 52, 200).astype(np.uint64)).view(np.float64))


@given(st.integers(0, 2**32 - 1))
def test_neighbours_of_short_numbers_are_spelled_as_repr_does(seed):
    random = np.random.default_rng(seed)
    short = random.integers(1, 10**6, 100) / 10.0 ** random.integers(0, 9, 100)
    powers = np.concatenate([2.0 ** np.arange(-14, 54), 10.0 ** np.arange(-5, 17)])
    near = np.concatenate([short, powers])
    steps = random.integers(-3, 4, len(near))
    assert_like_repr(np.concatenate([near, near + steps * np.spacing(near), -near]))


def test_the_ends_of_what_is_written_without_an_exponent():
    ends = np.array([FEWEST_DIGITS, MOST_DIGITS, 2.0**53, 2.0**-13, 0.5, 0.3, 1.0])
    assert_like_repr(np.concatenate([ends, np.nextafter(ends, 0), np.nextafter(ends, np.inf)]))
    assert spelled(np.array([0.0, -0.0, 5e-324, np.inf, -np.inf, 1e300])) == [
        "0.0",
        "-0.0",
        "5e-324",
        "inf",
        "-inf",
        "1e+300",
    ]


def test_digits_are_read_back_as_the_number_and_none_of_them_can_be_spared():
    values = np.abs(np.random.default_rng(5).normal(size=500)) + 1e-3
    for value, digits, places in zip(values.tolist(), *map(np.ndarray.tolist, shortest(values)), strict=True):
        assert float(Fraction(digits, 10**places)) == value
        for shorter in (digits // 10, digits // 10 + 1):
            assert float(Fraction(shorter, 10 ** (places - 1))) != value


@given(st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1, max_size=30))
def test_whole_numbers_are_spelled_as_str_does(values):
    lines = joined([of_wholes(np.array(values)), b"\n"], len(values)).decode().split()
    assert lines == list(map(str, values))


@given(st.lists(st.text().filter(lambda text: "\n" not in text and "\r" not in text), min_size=1, max_size=10))
def test_texts_stay_what_they_are(texts):
    encoded = [text.encode("utf-8", "backslashreplace") for text in texts]
    assert joined([of_texts(encoded), b"\n"], len(texts)) == b"".join(text + b"\n" for text in encoded)


@pytest.mark.parametrize("count", [1, 3])
def test_parts_stand_beside_each_other(count):
    cells = of_wholes(np.arange(count) * 500)
    assert joined([b"<", cells, b"|", cells, b">"], count).decode() == "".join(
        f"<{k}|{k}>" for k in range(0, 500 * count, 500)
    )

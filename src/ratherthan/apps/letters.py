"""Numbers and texts enter; their letters leave, a row each, spelled for all rows at once as Python's `repr` spells one.

A cell of a long table is a row of bytes of a fixed width, with `GAP` wherever there is no letter: UTF-8 has no such byte. So cells
of different lengths stand beside each other in one array, and leaving out the gaps makes the text of all rows (`joined`).

Shortest digits
---------------
The shortest decimal number that is read back as a double x = c · 2^q is found by exact integers. With 10^-m the largest power of ten
that is at most 2^q, the number 4x · 10^m and the ends of the interval that is rounded to x, 4x · 10^m ± 2 · 2^q 10^m, are
integers times 2^(q+m): a product of 4c, of 55 bits, and 5^m. Their whole parts, with a last bit that says whether anything was
cut off, decide: at most one multiple of 10^(1-m) lies in the interval, and if one does, it is the answer, without zeros at its
end; else that multiple of 10^-m which lies alone in it, or the nearer of two. Exact for 1e-4 ≤ x < 1e16, where `repr` writes no
exponent and 5^m fits into 47 bits; the others are few, and `repr` spells them.

References
----------
R. Giulietti. The Schubfach way to render doubles. 2021.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

__all__ = ["GAP", "Letters", "joined", "of_floats", "of_texts", "of_wholes", "shortest"]

GAP = 0xFF
Letters = npt.NDArray[np.uint8]  # [rows, width]
Wholes = npt.NDArray[np.uint64]
Doubles = npt.NDArray[np.float64]

FEWEST_DIGITS, MOST_DIGITS = 1e-4, 1e16
"""Between these, `repr` writes no exponent."""
LOW = np.uint64(0xFFFFFFFF)
FRACTION = np.uint64((1 << 52) - 1)
DEEPEST = 66
"""c · 2^-q with q up to this: the least double from 1e-4 on is of 2^-14."""

FIVE = np.array([5**m for m in range(21)], dtype=np.uint64)
TEN = np.array([10**m % 2**64 for m in range(21)], dtype=np.uint64)
PLACES = np.array([len(str(2**deep)) for deep in range(DEEPEST + 1)], dtype=np.int64)
"""For -q, from 1 on, the least m with 10^-m ≤ 2^q."""
QUAD = np.frombuffer("".join(f"{k:04}" for k in range(10000)).encode(), dtype=np.uint8).view(np.uint32)
"""Four digits as one number of four bytes."""
WIDEST = 20
BEHIND = np.array([[0 if WIDEST - i <= n else GAP for i in range(WIDEST)] for n in range(WIDEST + 1)], dtype=np.uint8)
"""What to lay over `WIDEST` digits so that the last n of them stay."""


def joined(parts: Sequence[Letters | bytes], rows: int) -> bytes | bytearray:
    """Return the text of rows, each the letters of its parts beside each other; bytes are the same in every row."""
    line, cells, places = bytearray(), [], []
    for part in parts:
        if isinstance(part, bytes):
            line += part
        else:
            cells.append(np.ascontiguousarray(part).view(f"V{part.shape[1]}")[:, 0])  # a cell is copied at one stroke
            places.append(len(line))
            line += bytes(part.shape[1])
    text = bytearray(rows * len(line))
    np.frombuffer(text, dtype=np.uint8).reshape(rows, len(line))[:] = np.frombuffer(line, dtype=np.uint8)
    names = [f"{k}" for k in range(len(cells))]
    formats = [cell.dtype for cell in cells]
    page = np.frombuffer(text, np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": len(line)}))
    for name, cell in zip(names, cells, strict=True):
        page[name] = cell
    return text.translate(None, bytes([GAP]))


def of_texts(texts: Sequence[bytes]) -> Letters:
    """Return the letters of texts in UTF-8."""
    length = np.fromiter(map(len, texts), dtype=np.int64, count=len(texts))
    width = max(int(length.max(initial=0)), 1)
    letters = np.array(texts, dtype=f"S{width}").view(np.uint8).reshape(len(texts), width)
    letters[np.arange(width) >= length[:, None]] = GAP
    return letters


def of_wholes(values: npt.NDArray[np.integer]) -> Letters:
    """Return the letters of whole numbers of at most 64 bits."""
    negative = values < 0
    size = values.astype(np.uint64)  # of a negative number 2^64 more than it
    if negative.any():
        size = np.where(negative, np.uint64(0) - size, size)
    return _signed(negative, _digits(size, _count(size)))


def _signed(negative: npt.NDArray[np.bool_], letters: Letters) -> Letters:
    """Return letters with a sign before them where any is negative."""
    if not negative.any():
        return letters
    sign = np.where(negative, np.uint8(ord("-")), np.uint8(GAP))
    return np.concatenate([sign[:, None], letters], axis=1)


def _count(size: Wholes) -> npt.NDArray[np.int64]:
    """Return how many digits numbers have, at least 1."""
    digits = np.ones(len(size), dtype=np.int64)
    most = int(size.max(initial=0))
    power = 10
    while power <= most:
        digits += size >= np.uint64(power)
        power *= 10
    return digits


def _digits(size: Wholes, kept: npt.NDArray[np.int64]) -> Letters:
    """Return the last `kept` digits of numbers, with zeros before where there are fewer."""
    quads = max(-(-int(kept.max(initial=1)) // 4), 1)
    letters = np.empty((len(size), quads), dtype=np.uint32)
    rest = size
    for place in range(quads - 1, -1, -1):
        more = rest // np.uint64(10000)
        letters[:, place] = QUAD[(rest - more * np.uint64(10000)).astype(np.int64)]
        rest = more
    spelled = letters.view(np.uint8).reshape(len(size), 4 * quads)
    least = int(kept.min(initial=4 * quads))
    if least < 4 * quads:
        spelled |= BEHIND[:, WIDEST - 4 * quads :][kept]
    return spelled[:, 4 * quads - int(kept.max(initial=1)) :]


def of_floats(values: Doubles, other: Callable[[float], bytes]) -> Letters:
    """Return the letters of doubles as `repr` spells them.

    Parameters
    ----------
    values : array of float, ``[n]``
    other : callable
        Spells a number that is not finite, or too large or too small to be written without an exponent.
    """
    size = np.abs(values)
    plain = ((size >= FEWEST_DIGITS) & (size < MOST_DIGITS)) | (size == 0.0)
    if plain.all():
        return _plain(values, size)
    odd, which = np.unique(values[~plain], return_inverse=True)
    others = of_texts(list(map(other, odd.tolist())))[which]
    spelled = _plain(values[plain], size[plain])
    width = max(others.shape[1], spelled.shape[1])
    letters = np.full((len(values), width), GAP, dtype=np.uint8)
    letters[plain, : spelled.shape[1]] = spelled
    letters[~plain, : others.shape[1]] = others
    return letters


def _plain(values: Doubles, size: Doubles) -> Letters:
    """Return the letters of doubles that are written without an exponent."""
    digits, places = shortest(size)
    whole = size.astype(np.uint64)
    part = digits - whole * TEN[places]
    before, after = _digits(whole, _count(whole)), _digits(part, places)
    point = np.full((len(values), 1), ord("."), dtype=np.uint8)
    return _signed(np.signbit(values), np.concatenate([before, point, after], axis=1))


def shortest(size: Doubles) -> tuple[Wholes, npt.NDArray[np.int64]]:
    """Return the shortest decimal digits · 10^-places that is read as each double, with at least one place.

    Parameters
    ----------
    size : array of float, ``[n]``
        0, or from 1e-4 up to, not including, 1e16.

    Returns
    -------
    digits : array of uint64, ``[n]``
    places : array of int, ``[n]``
    """
    whole = size == np.floor(size)
    bits = size.view(np.uint64)
    fraction = bits & FRACTION
    deep = np.where(whole, 1, 1075 - (bits >> np.uint64(52)).astype(np.int64))
    digits, places = _nearest(fraction | np.uint64(1 << 52), deep)
    if whole.any():
        digits = np.where(whole, size.astype(np.uint64) * np.uint64(10), digits)
        places = np.where(whole, 1, places)
    halves = (fraction == 0) & ~whole  # below a power of two numbers lie closer; those from 2^-13 to 1/2 end soon
    if halves.any():
        exponent = deep[halves] - 52
        digits[halves], places[halves] = FIVE[exponent], exponent
    return digits, places


def _nearest(c: Wholes, deep: npt.NDArray[np.int64]) -> tuple[Wholes, npt.NDArray[np.int64]]:
    """Return digits and places of c · 2^-deep, for c of 53 bits that is no power of two, and `deep` from 1 to `DEEPEST`."""
    places = PLACES[deep]
    five = FIVE[places]
    cut = (deep - places).astype(np.uint64)
    high, low = _product(c << np.uint64(2), five)
    half = five << np.uint64(1)
    below, above = low - half, low + half
    value = _whole_part(high, low, cut)
    odd = c & np.uint64(1)
    least = _whole_part(high - (low < half), below, cut) + odd
    most = _whole_part(high + (above < low), above, cut) - odd
    unit = value >> np.uint64(2)
    ten = unit // np.uint64(10)
    forty = ten * np.uint64(40)
    up = forty + np.uint64(40) <= most
    short = (least <= forty) != up
    four = unit << np.uint64(2)
    over = four + np.uint64(4) <= most
    tail = value - four
    nearer = (tail > 2) | ((tail == 2) & ((unit & np.uint64(1)) == 1))
    alone = (least <= four) != over
    digits = np.where(short, ten + up, unit + np.where(alone, over, nearer))
    places = places - short
    return _without_zeros(digits, places)


def _product(a: Wholes, b: Wholes) -> tuple[Wholes, Wholes]:
    """Return a · b as its upper and lower 64 bits, for a of at most 55 and b of at most 47 bits."""
    shift = np.uint64(32)
    a0, a1, b0, b1 = a & LOW, a >> shift, b & LOW, b >> shift
    first = a0 * b0
    middle = a0 * b1 + a1 * b0 + (first >> shift)
    return a1 * b1 + (middle >> shift), (middle << shift) | (first & LOW)


def _whole_part(high: Wholes, low: Wholes, cut: Wholes) -> Wholes:
    """Return a number of 128 bits without its last `cut` bits; its last bit is 1 if one of these was."""
    kept = (low >> cut) | ((high << np.uint64(1)) << (np.uint64(63) - cut))
    found: Wholes = kept | ((kept << cut) != low)
    return found


def _without_zeros(digits: Wholes, places: npt.NDArray[np.int64]) -> tuple[Wholes, npt.NDArray[np.int64]]:
    """Return digits without zeros at their end."""
    round_ = np.flatnonzero(digits == digits // np.uint64(10) * np.uint64(10))
    for step in (8, 4, 2, 1) if len(round_) else ():
        own = digits[round_]
        fewer = own // TEN[step]
        ends = fewer * TEN[step] == own
        digits[round_] = np.where(ends, fewer, own)
        places[round_] -= step * ends
    return digits, places

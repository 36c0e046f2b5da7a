"""Colours that must be told apart stay apart for people with any kind of colour blindness, and in grey."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from ratherthan.render import palette
from ratherthan.render.palette import BLUES, GROUNDS, NEVER, OTHERS, PAPER, WITHOUT, rgb, shade

KINDS = {  # Machado, Oliveira and Fernandes (2009), severity 1, on linear light
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
JUST = 2.3
"""A difference in L*a*b* that is just noticed."""


def lab(colour: str, kind: str = "normal") -> np.ndarray:
    """Return L*, a*, b* of a colour as people of one kind see it."""
    parts = np.array(rgb(colour)) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    seen = np.clip(KINDS[kind] @ linear, 0.0, 1.0)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    share = to_xyz @ seen / np.array([0.9505, 1.0, 1.089])
    f = np.where(share > 0.008856, np.cbrt(share), 7.787 * share + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def apart(one: str, other: str, kind: str) -> float:
    """Return how different two colours look."""
    return float(np.linalg.norm(lab(one, kind) - lab(other, kind)))


@pytest.mark.parametrize("kind", KINDS)
def test_what_was_done_and_what_was_not_look_different(kind: str) -> None:
    lines = {"route": palette.ROUTE, "foil": palette.FOIL, "road": palette.ROAD, "mark": palette.MARK}
    for one, other in itertools.combinations(lines.values(), 2):
        assert apart(one, other, kind) >= 8 * JUST, (one, other)
    assert apart(palette.START, palette.GOAL, kind) >= 8 * JUST


@pytest.mark.parametrize("kind", KINDS)
def test_lines_and_marks_stand_out_from_open_ground(kind: str) -> None:
    for colour in (palette.ROUTE, palette.FOIL, palette.START, palette.GOAL, palette.ROAD, palette.MARK, palette.ZONE):
        assert lab(PAPER, kind)[0] - lab(colour, kind)[0] >= 40.0, colour


@pytest.mark.parametrize("kind", KINDS)
def test_where_one_cannot_go_is_darker_than_where_one_can(kind: str) -> None:
    closed = {"building", "wall"}
    for name, look in GROUNDS.items():
        for wall in closed - {name}:
            if name not in closed:
                assert lab(look.fill, kind)[0] - lab(GROUNDS[wall].fill, kind)[0] >= 5.0, name


def test_grounds_that_look_alike_in_colour_differ_in_pattern() -> None:
    looks = [look for look in {*GROUNDS.values(), *OTHERS} if look.fill != PAPER]
    for one, other in itertools.combinations(looks, 2):
        for kind in KINDS:
            assert apart(one.fill, other.fill, kind) >= 2 * JUST or one.pattern != other.pattern, (one, other, kind)


@pytest.mark.parametrize("kind", KINDS)
def test_the_scale_of_values_grows_darker_in_even_steps(kind: str) -> None:
    lightness = [lab(colour, kind)[0] for colour in BLUES]
    steps = -np.diff(lightness)
    assert (steps > 5.0).all()
    assert steps.max() / steps.min() < 2.5


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_infinite_or_empty_is_not_on_the_scale(kind: str) -> None:
    scale = [shade(share) for share in np.linspace(0, 1, 33)]
    for colour in (NEVER.ink, WITHOUT.fill):
        assert min(apart(colour, level, kind) for level in scale) >= 4 * JUST, colour

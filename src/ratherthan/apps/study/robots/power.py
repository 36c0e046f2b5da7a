r"""A model of responses and a design enter, how many persons are needed for each planned comparison leaves, by simulation.

Whole studies are drawn from the model. In each, the first n persons are a study of n persons, so sums over persons give every t at every n
at once:

.. math:: t_n = \frac{\bar d_n \sqrt n}{s_n}, \quad \bar d_n = \frac1n \sum_{p \le n} d_p.

A comparison is found where Holm's procedure rejects it among all comparisons at 5 %. Its power at n is the share of studies in which it is
found, with Clopper and Pearson's 95 % interval for the number of studies drawn. Enough are the n from which on the share stays at or
above what is wanted; the interval says between which numbers that lies.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.measuring import PLANNED
from ratherthan.apps.study.robots.drawing import OTHER_WORDS, drawn_ratings, drawn_times
from ratherthan.apps.study.robots.model import ResponseModel
from ratherthan.errors import QuestionError

__all__ = ["LEAST", "Plan", "Power", "Setting", "needed", "powers"]

Floats = npt.NDArray[np.float64]
LEAST = 4
"""No study is looked at with fewer persons."""
MOST_NUMBERS = 4_000_000
TIME = "time"


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Which studies are drawn.

    Parameters
    ----------
    kinds : tuple of str
        By the core's names.
    maps : int
        How often each person answers for each kind.
    most : int
        The largest number of persons looked at.
    samples : int
        How many studies are drawn.
    factor : float
        By which the model's differences between kinds are multiplied.
    seed : int
    wanted : float
        The power that is wanted.
    level : float
        Of significance.
    """

    kinds: tuple[str, ...]
    maps: int = 3
    most: int = 252
    samples: int = 2000
    factor: float = 1.0
    seed: int = 1
    wanted: float = 0.8
    level: float = 0.05


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How many persons a comparison needs.

    Parameters
    ----------
    first, second : str
    difference : float
        What it is in the model: the mean over all persons drawn; of times, the difference of logarithms.
    size : float
        The same by the standard deviation of the differences of persons: d_z.
    differs : bool
        Whether the model has a difference at all.
    enough : int, optional
        Persons; None where the largest number looked at is not enough.
    low, high : int, optional
        Between which the number lies, for all that chance in drawing leaves open.
    """

    first: str
    second: str
    difference: float
    size: float
    differs: bool
    enough: int | None
    low: int | None
    high: int | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Power:
    """The power of all comparisons of one item.

    Parameters
    ----------
    item : str
    setting : Setting
    plans : tuple of Plan
    curve : array, ``[most + 1, comparisons]``
        The share of studies with so many persons in which each is found; 0 below `LEAST`.
    any_found : array, ``[most + 1]``
        The share in which at least one is.
    """

    item: str
    setting: Setting
    plans: tuple[Plan, ...]
    curve: Floats
    any_found: Floats


def powers(model: ResponseModel, item: str, setting: Setting, tell: Callable[[str], None] | None = None) -> Power:
    """Return the power of the planned comparisons of one item.

    Parameters
    ----------
    model : ResponseModel
    item : str
        An item that is rated, or "time".
    setting : Setting
    tell : callable, optional
        Is told how far it is.

    Raises
    ------
    QuestionError
        If none of the planned comparisons has both its kinds, or a number makes no sense.
    """
    pairs = [(a, b) for a, b in PLANNED if a in setting.kinds and b in setting.kinds]
    if not pairs:
        raise QuestionError(
            "Power is of comparisons that are planned: responsibility and constrictive against naive-state, selective and contrastive "
            f"against naive-path, all against none; the kinds {', '.join(setting.kinds)} make none of them."
        )
    if setting.most < LEAST or setting.samples < 100:
        raise QuestionError(
            f"Power needs {LEAST} persons and 100 simulated studies or more, got {setting.most} and {setting.samples}."
        )
    first = [setting.kinds.index(a) for a, _ in pairs]
    second = [setting.kinds.index(b) for _, b in pairs]
    centres = centres_of(model, item, setting)
    random = np.random.default_rng(setting.seed)
    found = np.zeros((setting.most + 1, len(pairs)))
    anything = np.zeros(setting.most + 1)
    sums = np.zeros((2, len(pairs)))
    critical = _critical(len(pairs), setting)
    at_once = max(1, MOST_NUMBERS // (setting.most * len(setting.kinds) * setting.maps))
    done = 0
    while done < setting.samples:
        count = min(at_once, setting.samples - done)
        shape = (count, setting.most, setting.maps)
        if item == TIME:
            answers = np.log(drawn_times(model, setting.kinds, shape, random, factor=setting.factor))
        else:
            answers = drawn_ratings(model.item(item), setting.kinds, shape, random, factor=setting.factor)
        means = answers.mean(axis=3)
        differences = means[:, :, first] - means[:, :, second]  # [studies, persons, comparisons]
        sums += np.stack([differences.sum(axis=(0, 1)), (differences**2).sum(axis=(0, 1))])
        rejected = _rejected(differences, critical)
        found[1:] += rejected.sum(axis=0)
        anything[1:] += rejected.any(axis=2).sum(axis=0)
        done += count
        if tell is not None:
            tell(f"{item}: {done} of {setting.samples} studies")
    curve, shares = found / setting.samples, anything / setting.samples
    persons = setting.samples * setting.most
    mean = sums[0] / persons
    spread = np.sqrt(np.maximum(sums[1] / persons - mean**2, 0.0))
    plans = tuple(
        Plan(
            first=a,
            second=b,
            difference=float(mean[c]),
            size=float(mean[c] / spread[c]) if spread[c] > 0 else 0.0,
            differs=bool(abs(centres[first[c]] - centres[second[c]]) > 1e-12),
            **needed(curve[:, c], setting),
        )
        for c, (a, b) in enumerate(pairs)
    )
    return Power(item=item, setting=setting, plans=plans, curve=curve, any_found=shares)


def centres_of(model: ResponseModel, item: str, setting: Setting) -> Floats:
    """Return what the model has in the middle for each kind; of times their logarithms."""
    if item != TIME:
        return model.item(item).centres(setting.kinds, setting.factor)
    logs = np.log([model.time.centre(model.time.words.get(kind, OTHER_WORDS)) for kind in setting.kinds])
    centres: Floats = logs.mean() + setting.factor * (logs - logs.mean())
    return centres


def _critical(comparisons: int, setting: Setting) -> Floats:
    """Return what |t| must reach at each step of Holm's procedure, ``[persons, comparisons]``, infinite for too few persons."""
    from scipy.stats import t

    persons = np.arange(1, setting.most + 1)
    levels = setting.level / (2 * np.arange(comparisons, 0, -1))
    with np.errstate(invalid="ignore"):
        reach = np.asarray(t.isf(levels[None, :], np.maximum(persons - 1, 1)[:, None]), dtype=np.float64)
    reach[persons < LEAST] = np.inf
    return reach


def _rejected(differences: Floats, critical: Floats) -> npt.NDArray[np.bool_]:
    """Return which comparisons Holm's procedure rejects with the first n persons, ``[studies, persons, comparisons]``."""
    persons = np.arange(1, differences.shape[1] + 1)[None, :, None]
    total = np.cumsum(differences, axis=1)
    squares = np.cumsum(differences**2, axis=1) - total**2 / persons
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.abs(total) / np.sqrt(persons * squares / (persons - 1))
    t = np.where(squares > 1e-9 * persons, t, 0.0)  # all differences alike: no test can be made
    order = np.argsort(-t, axis=2, kind="stable")
    passed = np.logical_and.accumulate(np.take_along_axis(t, order, axis=2) >= critical[None], axis=2)
    rejected = np.zeros_like(passed)
    np.put_along_axis(rejected, order, passed, axis=2)
    return rejected


def needed(curve: Floats, setting: Setting) -> dict[str, int | None]:
    """Return from how many persons on a power is reached, and between which numbers that lies.

    Parameters
    ----------
    curve : array, ``[most + 1]``
    setting : Setting

    Returns
    -------
    dict
        "enough", "low" and "high".
    """
    from scipy.stats import beta

    hits = np.rint(curve * setting.samples)
    with np.errstate(invalid="ignore"):
        low = np.where(hits > 0, beta.ppf(0.025, hits, setting.samples - hits + 1), 0.0)
        high = np.where(hits < setting.samples, beta.ppf(0.975, hits + 1, setting.samples - hits), 1.0)

    def from_there(values: Floats) -> int | None:
        below = np.flatnonzero(values < setting.wanted)
        start = int(below[-1]) + 1 if len(below) else 0
        return start if start < len(values) else None

    return {"enough": from_there(curve), "low": from_there(high), "high": from_there(low)}


def recruited(persons: int, lost: float, per_round: int) -> int:
    """Return how many to recruit so that so many are left, in full rounds of the balanced plan.

    Examples
    --------
    >>> recruited(70, 0.1, 42)
    84
    """
    return math.ceil(math.ceil(persons / (1.0 - lost)) / per_round) * per_round

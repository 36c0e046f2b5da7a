r"""Answers of persons who may lack some enter, a linear mixed model by restricted maximum likelihood leaves.

.. math:: y_{pkm} = \beta_k + \gamma_m + u_p + v_{pk} + e_{pkm}

with a mean for each kind k and map m, a level u of each person, what a kind does to each person beside its mean, v, and the rest e,
all three normal. Where answers are missing (at random, given those that are there) nobody's other answers are thrown away. The part
v is left out where nobody has several answers for one kind.

With a = var u / var e and b = var v / var e the covariance of all answers is var e · V, and V⁻¹ and det V follow from sums over cells
(person and kind) and persons by Woodbury's identity, as cells lie within persons. So the restricted likelihood (Patterson and
Thompson 1971), from which β, γ and var e are profiled out,

.. math:: -2 \ell(a, b) = (N - q) \log \frac{r' V^{-1} r}{N - q} + \log\det V + \log\det X' V^{-1} X,

costs a product of small matrices. It is minimised by Nelder and Mead's simplex in (log a, log b) from several starts, to a change of
1e-10, and on the borders a = 0 and b = 0, which are allowed: the least of all is taken.

Kinds are tested by F with the degrees of freedom of containment: cells − persons − (kinds − 1), or answers in place of cells where v is left
out. With complete tables this is the analysis of variance for repeated measures, without correction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.apps.study.analysis.statistics import NotComputableError

__all__ = ["Mixed", "MixedContrast", "mixed"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
LEAST, MOST = -18.0, 25.0
"""Where logarithms of a and b are sought."""


@dataclass(frozen=True, kw_only=True)
class MixedContrast:
    """The comparison of two kinds in a mixed model: the first less the second."""

    difference: float
    low: float
    high: float
    p: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Mixed:
    """A fitted mixed model."""

    f: float
    kinds: int  # degrees of freedom
    errors: int
    p: float
    persons: int
    answers: int
    means: Floats  # [kinds]; on the average map
    covariance: Floats  # [kinds, kinds]
    person_variance: float
    kind_variance: float | None  # of what a kind does to each person; None where it is not in the model
    rest_variance: float
    likelihood: float  # the restricted one, its logarithm
    with_maps: bool

    def contrast(self, first: int, second: int) -> MixedContrast:
        """Return the comparison of two kinds."""
        from scipy.stats import t as law

        difference = float(self.means[first] - self.means[second])
        part = self.covariance[np.ix_([first, second], [first, second])]
        error = float(np.sqrt(max(part[0, 0] + part[1, 1] - 2 * part[0, 1], 0.0)))
        reach = float(law.ppf(0.975, self.errors)) * error
        p = float(2 * law.sf(abs(difference) / error, self.errors))
        return MixedContrast(difference=difference, low=difference - reach, high=difference + reach, p=p)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Sums:
    """What the likelihood needs of the data, the answers as the last column."""

    whole: Floats  # [q+1, q+1]
    cells: Floats  # [cells, q+1]; sums over the answers of a cell
    sizes: Floats  # [cells]
    starts: Ints  # [persons]; where the cells of each begin
    answers: int

    def at(self, a: float, b: float) -> tuple[float, Floats]:
        """Return −2 log likelihood up to a constant, and the table of products under V⁻¹."""
        shrunk = 1.0 / (1.0 + b * self.sizes)
        table = self.whole - (self.cells * (b * shrunk)[:, None]).T @ self.cells
        held = np.add.reduceat(self.sizes * shrunk, self.starts)
        sums = np.add.reduceat(self.cells * shrunk[:, None], self.starts)
        table = table - (sums * (a / (1.0 + a * held))[:, None]).T @ sums
        q = len(table) - 1
        inner = table[:q, :q]
        left = float(table[q, q] - table[q, :q] @ np.linalg.solve(inner, table[:q, q]))
        if left <= 0.0:
            return np.inf, table
        freedom = self.answers - q
        logs = float(np.log1p(b * self.sizes).sum() + np.log1p(a * held).sum() + np.linalg.slogdet(inner)[1])
        return freedom * float(np.log(left / freedom)) + logs, table


def mixed(person: Ints, kind: Ints, place: Ints, value: Floats) -> Mixed:
    """Return the mixed model.

    Parameters
    ----------
    person, kind, place : array of int, ``[answers]``
        Kinds are numbered from 0 without gaps; `place` is the map.
    value : array, ``[answers]``

    Raises
    ------
    NotComputableError
        If the data do not determine the model.
    """
    from scipy.stats import f as law

    levels, person = np.unique(person, return_inverse=True)
    persons, kinds = len(levels), int(kind.max(initial=-1)) + 1
    cells, cell, sizes = np.unique(person * max(kinds, 1) + kind, return_inverse=True, return_counts=True)
    _check(kind, value, persons, kinds, len(cells))
    design, with_maps = _design(kind, place, kinds)
    offset = float(value.mean())
    scale = float(value.std())
    columns = np.column_stack([design, (value - offset) / scale])
    summed = np.zeros((len(cells), columns.shape[1]))
    np.add.at(summed, cell, columns)
    sums = _Sums(
        whole=columns.T @ columns,
        cells=summed,
        sizes=sizes.astype(float),
        starts=np.flatnonzero(np.diff(cells // kinds, prepend=-1)),
        answers=len(value),
    )
    nested = int(sizes.max()) > 1
    errors = (len(cells) if nested else len(value)) - persons - (design.shape[1] - 1 if not nested else kinds - 1)
    if errors < 1:
        raise NotComputableError("A mixed model needs more answers than there are persons and kinds to tell apart.")
    a, b, lowest = _least(sums, nested)
    table = sums.at(a, b)[1]
    inner = table[:-1, :-1]
    means = np.linalg.solve(inner, table[:-1, -1])
    freedom = len(value) - design.shape[1]
    rest = float(table[-1, -1] - table[-1, :-1] @ means) / freedom
    if rest <= 1e-9:  # of a variance of 1 in all
        raise NotComputableError(
            "Persons, kinds and maps explain every answer wholly, so nothing tells chance from effect."
        )
    covariance = np.linalg.inv(inner) * rest
    steps = np.eye(kinds, design.shape[1])[1:] - np.eye(kinds, design.shape[1])[0]
    apart = steps @ means
    f = float(apart @ np.linalg.solve(steps @ covariance @ steps.T, apart)) / (kinds - 1)
    return Mixed(
        f=f,
        kinds=kinds - 1,
        errors=errors,
        p=float(law.sf(f, kinds - 1, errors)),
        persons=persons,
        answers=len(value),
        means=np.asarray(means[:kinds] * scale + offset, dtype=np.float64),
        covariance=np.asarray(covariance[:kinds, :kinds] * scale**2, dtype=np.float64),
        person_variance=a * rest * scale**2,
        kind_variance=b * rest * scale**2 if nested else None,
        rest_variance=rest * scale**2,
        likelihood=-0.5 * (lowest + freedom * (1.0 + float(np.log(2 * np.pi)) + 2 * float(np.log(scale)))),
        with_maps=with_maps,
    )


def _check(kind: Ints, value: Floats, persons: int, kinds: int, cells: int) -> None:
    """Refuse data that do not determine the model."""
    if kinds < 2 or len(np.unique(kind)) < kinds:
        raise NotComputableError("A mixed model compares two or more kinds with answers.")
    if persons < 3:
        raise NotComputableError(f"A mixed model needs three or more persons; there are {persons}.")
    if cells == persons:
        raise NotComputableError(
            "A mixed model of this form needs persons who answered for several kinds; here each did for one."
        )
    if float(np.ptp(value)) == 0.0:
        raise NotComputableError("All answers are the same, so there is nothing to model.")


def _design(kind: Ints, place: Ints, kinds: int) -> tuple[Floats, bool]:
    """Return the columns of the kinds, and of the maps about their mean where these can be told apart from kinds."""
    columns = np.eye(kinds)[kind]
    levels, code = np.unique(place, return_inverse=True)
    if 1 < len(levels) <= 50:
        dummies = np.eye(len(levels))[code]
        both = np.hstack([columns, dummies[:, 1:] - dummies[:, :1]])
        if np.linalg.matrix_rank(both.T @ both) == both.shape[1]:
            return both, True
    return columns, False


def _least(sums: _Sums, nested: bool) -> tuple[float, float, float]:
    """Return a and b of the largest restricted likelihood, and −2 times its logarithm up to a constant."""
    from scipy.optimize import minimize, minimize_scalar

    def risen(x: float) -> float:
        return float(np.exp(np.clip(x, LEAST, MOST)))

    found = [(sums.at(0.0, 0.0)[0], 0.0, 0.0)]
    one = minimize_scalar(
        lambda x: sums.at(risen(x), 0.0)[0], bounds=(LEAST, MOST), method="bounded", options={"xatol": 1e-7}
    )
    found.append((float(one.fun), risen(float(one.x)), 0.0))
    if nested:
        other = minimize_scalar(
            lambda x: sums.at(0.0, risen(x))[0], bounds=(LEAST, MOST), method="bounded", options={"xatol": 1e-7}
        )
        found.append((float(other.fun), 0.0, risen(float(other.x))))
        for start in ((-1.0, -1.0), (float(one.x), -2.0), (-2.0, float(other.x))):
            both = minimize(  # type: ignore[call-overload]
                lambda x: sums.at(risen(x[0]), risen(x[1]))[0],
                np.array(start),
                method="Nelder-Mead",
                options={"xatol": 1e-7, "fatol": 1e-10, "maxiter": 2000},
            )
            found.append((float(both.fun), risen(float(both.x[0])), risen(float(both.x[1]))))
    lowest, a, b = min(found)
    if not np.isfinite(lowest):
        raise NotComputableError(
            "Persons, kinds and maps explain every answer wholly, so nothing tells chance from effect."
        )
    return a, b, lowest

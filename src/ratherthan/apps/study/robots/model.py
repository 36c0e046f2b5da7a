r"""A file of numbers enters, a model of how simulated participants answer leaves.

The rating of person p after kind k, the m-th time, is

.. math:: y_{pkm} = \mathrm{round}\,(\mu_k + u_p + v_{pk} + e_{pkm}), \quad u, v, e \sim N(0, \sigma_u^2), N(0, \sigma_v^2), N(0, \sigma_e^2),

cut to the scale, where differences between the means μ can be multiplied by a factor: 0 is a study in which kinds do not differ. Time is
:math:`(b + w \cdot \mathrm{words}) \exp(u_p + v_{pk} + e_{pkm})`. A choice follows Luce's model, with a person's own worths.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError

__all__ = ["Conduct", "Ratings", "ResponseModel", "Times", "read_model"]

Floats = npt.NDArray[np.float64]
DEFAULT = Path(__file__).parent / "response.toml"


@dataclass(frozen=True, kw_only=True)
class Ratings:
    """How one item is rated, on a scale from 1 to 5; `person`, `kind` and `rest` are standard deviations."""

    means: Mapping[str, float]
    other: float
    person: float
    kind: float
    rest: float

    def centres(self, kinds: Sequence[str], factor: float = 1.0) -> Floats:
        """Return the means of kinds, their differences multiplied by `factor`."""
        means = np.array([self.means.get(kind, self.other) for kind in kinds], dtype=np.float64)
        middle = float(means.mean()) if len(means) else 0.0
        centres: Floats = middle + factor * (means - middle)
        return centres


@dataclass(frozen=True, kw_only=True)
class Times:
    """How long a trial takes, in seconds; `person`, `kind` and `rest` are standard deviations of its logarithm."""

    base: float
    per_word: float
    person: float
    kind: float
    rest: float
    words: Mapping[str, float]

    def centre(self, words: float) -> float:
        """Return the median time for an explanation of so many words."""
        return self.base + self.per_word * words


@dataclass(frozen=True, kw_only=True)
class Conduct:
    """Probabilities of what participants do beside answering."""

    declines: float
    misunderstands: float
    leaves: float
    inattentive: float


@dataclass(frozen=True, kw_only=True)
class ResponseModel:
    """How simulated participants answer.

    Parameters
    ----------
    name : str
    ratings : mapping of str to Ratings
        By item; "any" for all others.
    time : Times
    worth : mapping of str to float
        Of kinds and of "neither", in choices.
    other_worth, worth_person : float
        Of kinds not named, and the standard deviation of the logarithm of a person's own worths.
    conduct : Conduct
    """

    name: str
    ratings: Mapping[str, Ratings]
    time: Times
    worth: Mapping[str, float]
    other_worth: float
    worth_person: float
    conduct: Conduct

    def item(self, name: str) -> Ratings:
        """Return how an item is rated."""
        return self.ratings.get(name) or self.ratings["any"]


def read_model(path: Path | None = None) -> ResponseModel:
    """Return the model in a file, by default the one that comes with the package.

    Raises
    ------
    SourceError
        If it cannot be read, lacks a number, or holds one that cannot be: the message says which.
    """
    path = DEFAULT if path is None else path
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SourceError(
            f"The response model must be readable, but '{path}' is not: {error.strerror or error}.", path=path
        ) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SourceError(f"The response model must be TOML, and '{path}' is not: {error}.", path=path) from error
    cursor = _Cursor(told=told, path=path)
    ratings = {name: _ratings(cursor.part("ratings", name)) for name in cursor.part("ratings").told}
    if "any" not in ratings:
        raise SourceError(
            f"The response model must have [ratings.any], for items of other names; '{path}' lacks it.", path=path
        )
    time, preference, conduct = cursor.part("time"), cursor.part("preference"), cursor.part("conduct")
    return ResponseModel(
        name=str(told.get("name", path.stem)),
        ratings=ratings,
        time=Times(
            base=time.number("base", least=1e-3),
            per_word=time.number("per_word", least=0.0),
            words=time.numbers("words", least=0.0),
            person=time.number("person", least=0.0),
            kind=time.number("kind", least=0.0),
            rest=time.number("rest", least=0.0),
        ),
        worth=preference.numbers("worth", least=1e-9),
        other_worth=preference.number("other", least=1e-9),
        worth_person=preference.number("person", least=0.0),
        conduct=Conduct(
            **{
                name: conduct.number(name, least=0.0, most=1.0)
                for name in ("declines", "misunderstands", "leaves", "inattentive")
            }
        ),
    )


def _ratings(cursor: _Cursor) -> Ratings:
    return Ratings(
        means=cursor.numbers("means", least=-100.0),
        other=cursor.number("other", least=-100.0),
        person=cursor.number("person", least=0.0),
        kind=cursor.number("kind", least=0.0),
        rest=cursor.number("rest", least=0.0),
    )


@dataclass(frozen=True, kw_only=True)
class _Cursor:
    """A table in the file, and where it lies."""

    told: Mapping[str, Any]
    path: Path
    place: str = ""

    def part(self, *names: str) -> _Cursor:
        """Return a table within."""
        found: Any = self.told
        place = self.place
        for name in names:
            place = f"{place}.{name}".strip(".")
            found = found.get(name)
            if not isinstance(found, dict):
                raise SourceError(
                    f"The response model must have a table [{place}]; '{self.path}' lacks it.", path=self.path
                )
        return _Cursor(told=found, path=self.path, place=place)

    def number(self, name: str, *, least: float, most: float = 1e6) -> float:
        """Return a number within bounds."""
        value = self.told.get(name)
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not math.isfinite(value)
            or not least <= value <= most
        ):
            raise SourceError(
                f"In the response model '{self.path}', {self.place}.{name} must be a number from {least:g} to {most:g}, "
                f"got {value!r}.",
                path=self.path,
            )
        return float(value)

    def numbers(self, name: str, *, least: float) -> dict[str, float]:
        """Return a table of numbers."""
        table = self.part(name)
        return {key: table.number(key, least=least) for key in table.told}

"""A wrong input enters, one sentence leaves: the tree of exceptions.

::

    RatherthanError                 anything this package raises on purpose
    ├── InputError                  what the user gave cannot be used (exit code 2)
    │   ├── SourceError             a file or object cannot be read as a model
    │   ├── ModelError              the model breaks a law (probabilities, targets, costs …)
    │   ├── PropertyError           a property cannot be parsed, or not on this model
    │   │   └── NotExplainableError it is known what it asks, but that cannot be explained
    │   ├── PolicyError             a policy does not fit the model
    │   ├── QuestionError           an unknown state, action, kind or setting
    │   ├── ExplanationError        a stored explanation is broken or was tampered with
    │   └── MissingExtraError       an optional dependency is not installed
    ├── UnsolvedError               a solver stopped before it converged
    │   └── StoppedError            … because a limit was reached; it is a LimitError, too
    └── LimitError                  a limit of time or memory was reached

Every message says what must hold, what came, where, and what to do. The place is also carried as attributes.
"""

from __future__ import annotations

from typing import Any


class RatherthanError(Exception):
    """Anything this package raises on purpose.

    Parameters
    ----------
    message : str
        One or two sentences: what must hold, what came, where, what to do.
    **place : Any
        Where it happened, by name (``state=3``, ``action="east"``, ``path=...``); kept in `place`.
    """

    def __init__(self, message: str, **place: Any) -> None:
        super().__init__(message)
        self.message = message
        self.place: dict[str, Any] = place

    def __getattr__(self, name: str) -> Any:
        place = self.__dict__.get("place", {})
        if name in place:
            return place[name]
        raise AttributeError(name)


class InputError(RatherthanError):
    """What the user gave cannot be used."""


class SourceError(InputError):
    """A file or object cannot be read as a model."""


class ModelError(InputError):
    """The model breaks a law: probabilities, targets, costs, shapes.

    `faults` lists every fault found, each one sentence; the message is the first of them and how many more there are.
    """

    def __init__(self, message: str, *, faults: tuple[str, ...] = (), **place: Any) -> None:
        super().__init__(message, **place)
        self.faults = faults or (message,)


class PropertyError(InputError):
    """A property cannot be parsed, or cannot be answered on this model."""


class NotExplainableError(PropertyError):
    """It is known what a property asks, but that cannot be explained; the message names the nearest that can."""


class PolicyError(InputError):
    """A policy does not fit the model."""


class QuestionError(InputError):
    """An unknown state, action, kind or setting."""


class ExplanationError(InputError):
    """A stored explanation is broken, of another version, or was tampered with."""


class MissingExtraError(InputError):
    """An optional dependency is not installed."""


class UnsolvedError(RatherthanError):
    """A solver stopped before it converged; `solution` holds what it has."""


class LimitError(RatherthanError):
    """A limit of time or memory was reached; `limit` is "time" or "memory", `phase` what was being done."""


class StoppedError(UnsolvedError, LimitError):
    """A limit of time or memory stopped a solver; `solution` holds the bounds that it had proved by then."""

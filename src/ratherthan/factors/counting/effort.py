"""How much work a person grants enters as an Effort; what was counted with it leaves as Counts, one number per choice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.model.mdp import Bools, Floats

__all__ = ["Counts", "Effort"]

Numbers = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much work counting may be.

    Parameters
    ----------
    visits : int, optional
        At most about so many visits of a state by a search, or what takes as long; None is as many as it takes. With the
        same model and question the same choices are counted on every machine.
    estimate : bool
        Estimate what is not counted by then, where that can be done with a known error.
    """

    visits: int | None = None
    estimate: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Counts:
    """The decisions that N choices leave open.

    Parameters
    ----------
    choices : array of int, ``[N]``
    lower, upper : array of int, ``[N]``
        Sound bounds of each count; equal where it is decided. Where nothing was counted they are 0 and the weight of all
        states.
    counted : array of bool, ``[N]``
        Where the search tree was weighed; elsewhere the work that was granted did not suffice.
    visits : int
        The work done.
    estimate, error : array of float, ``[N]``
        A guess at the count where it was not counted but estimated, and the standard error as a share of it. It supports no
        claim.
    estimated : array of bool, ``[N]``
        Where there is one.
    """

    choices: Numbers  # [N]
    lower: Numbers  # [N]
    upper: Numbers  # [N]
    counted: Bools  # [N]
    visits: int
    estimate: Floats  # [N]
    error: Floats  # [N]
    estimated: Bools  # [N]

"""Blocks on workers enter; what each must know of the others, the certificate, and the values of any state leave."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ratherthan.cluster import working
from ratherthan.cluster.archive import Described
from ratherthan.cluster.block import Extent, States
from ratherthan.cluster.engine import Engine, here
from ratherthan.cluster.mixing import Mixing
from ratherthan.cluster.spreading import Alive, Known
from ratherthan.errors import QuestionError, UnsolvedError
from ratherthan.model.mdp import Floats
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.watch import look

__all__ = ["RESIDUAL", "TRIES", "Blocks", "Blockwise", "Tell", "always", "start_in"]

RESIDUAL = 1e-8
"""What to come to, relative to the least cost; as `solve.windows`."""
WIDEST = 1e-7
ROOM = 1.0 + 1e-6
TRIES = 3
LOOSE = 1e-2
"""The tolerance to begin with, relative to the least cost."""
TIGHTER = 1e-3
"""The next tolerance, relative to how far the rims moved: what a block leaves unsolved adds up along its ways."""
MOST_ROUNDS = 300

Tell = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Blockwise:
    """What was found out of a model in blocks, for the state where it begins.

    Parameters
    ----------
    value, lower, upper : float
        Bounds are -∞ and ∞ where nothing is proved.
    certified : bool
    property : str
    start : int
    states, choices, branches : int
    blocks : int
    rounds : tuple of int
        How many of the graph, and of the values.
    """

    value: float
    lower: float
    upper: float
    certified: bool
    property: str
    start: int
    states: int
    choices: int
    branches: int
    blocks: int
    rounds: tuple[int, int]


@dataclass(eq=False)
class Blocks:
    """A model in blocks, on workers. Made by `blocks`."""

    pool: Engine
    about: Described
    objective: ExpectedCost
    extents: tuple[Extent, ...]
    tell: Tell
    at: list[str | None] = field(default_factory=list)
    shared: States = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    needs: list[States] = field(default_factory=list)  # places in `shared`
    exports: list[slice] = field(default_factory=list)  # likewise
    alive: list[npt.NDArray[np.uint8]] = field(default_factory=list)
    can: list[npt.NDArray[np.uint8]] = field(default_factory=list)
    shared_alive: Any = None
    levels: Any = None
    values: Any = None
    least: float = np.inf
    shares: tuple[float, float] | None = None
    digests: list[str] = field(default_factory=list)
    rounds: list[int] = field(default_factory=lambda: [0, 0])

    def every(
        self, function: Callable[..., Any], *given: Callable[[int], Any], which: Sequence[int] | None = None
    ) -> list[Any]:
        """Run a function on every block (or some); return the results."""
        numbers = list(range(len(self.extents))) if which is None else list(which)
        self._place()
        futures = [
            self.pool.submit(_placed, function, self.extents[k], *(part(k) for part in given), at=self.at[k])
            for k in numbers
        ]
        found = self.pool.all_of(futures, look)
        for k, (place, _) in zip(numbers, found, strict=True):
            self.at[k] = place
        return [result for _, result in found]

    def _place(self) -> None:
        """Give the blocks of workers that are gone to those that have the fewest; let none have two more than another."""
        there = self.pool.workers()
        if not there:
            return
        for k, place in enumerate(self.at):
            fewest = min(there, key=self.at.count)
            if place not in there or self.at.count(place) > self.at.count(fewest) + 1:
                self.at[k] = fewest

    def known(self, k: int, tolerance: float = np.inf) -> Known:
        """Return what a block must be told to answer."""
        needs, exports = self.needs[k], self.exports[k]
        return Known(
            alive=Alive(inside=self.alive[k], needed=self.shared_alive[needs]),
            exports=self.shared[exports],
            levels=self.levels[needs],
            outside=self.values[needs],
            exported=self.values[exports],
            least=self.least,
            tolerance=tolerance,
        )

    def final(self, k: int) -> Known:
        """Return what a block must be told once all are solved."""
        return self.known(k, RESIDUAL * self.least)

    def say(self, text: str) -> None:
        """Tell how far it is."""
        self.tell(text)
        look(text)

    def owner(self, state: int) -> int:
        """Return the number of the block that owns a state."""
        lasts = [extent.last for extent in self.extents]
        return int(np.searchsorted(lasts, state, side="right"))

    def start(self, given: str | int | None) -> int:
        """Return the state to begin in."""
        return start_in(self.about, given)

    def at_states(self, states: States) -> tuple[Floats, States]:
        """Return the values of states, and the choices taken there; proved again where a block was solved anew."""
        owners = np.array([self.owner(int(state)) for state in states], dtype=np.int64)
        values, choice = np.zeros(len(states)), np.zeros(len(states), dtype=np.int64)
        for _ in range(TRIES):
            which = sorted(set(owners.tolist()))
            parts = {k: states[owners == k] for k in which}
            found = self.every(working.values_of, self.final, parts.__getitem__, which=which)
            if self.shares is None or all(result[2] == self.digests[k] for k, result in zip(which, found, strict=True)):
                for k, result in zip(which, found, strict=True):
                    values[owners == k], choice[owners == k] = result[0], result[1]
                return values, choice
            self.settle()
        raise UnsolvedError(
            "Workers must live long enough to tell what they solved, but they were lost again and again."
        )

    def bounds(self, values: Floats) -> tuple[Floats, Floats]:
        """Return the bounds of values."""
        if self.shares is None:
            return np.where(np.isinf(values), values, -np.inf), np.full(len(values), np.inf)
        finite = np.isfinite(values)
        lower, upper = values.copy(), values.copy()
        lower[finite] = (1.0 - self.shares[0]) * values[finite]
        upper[finite] = (1.0 + self.shares[1]) * values[finite]
        return lower, upper

    def outcome(self, start: int) -> Blockwise:
        """Return the value of a state."""
        values, _ = self.at_states(np.array([start]))
        lower, upper = self.bounds(values)
        header = self.about.header
        return Blockwise(
            value=float(values[0]),
            lower=float(lower[0]),
            upper=float(upper[0]),
            certified=self.shares is not None,
            property=self.objective.text,
            start=start,
            states=header.states,
            choices=header.choices,
            branches=header.branches,
            blocks=len(self.extents),
            rounds=(self.rounds[0], self.rounds[1]),
        )

    def settle(self) -> None:
        """Solve all blocks until their rims come to rest, and prove the bounds; again where a worker was lost meanwhile."""
        for _ in range(TRIES):
            rested = self._rest()
            self.certify()
            if self.shares is not None or not rested:
                return

    def _rest(self) -> bool:
        """Solve all blocks until their rims come to rest; return whether they did."""
        wanted, tolerance = RESIDUAL * self.least, LOOSE * self.least
        mixing, alive = Mixing(0.1 * self.least), self.shared_alive
        for _ in range(MOST_ROUNDS):
            self.rounds[1] += 1
            found = self.every(working.sweep, partial(self.known, tolerance=tolerance))
            assumed, answered = self.values, np.concatenate([result[0] for result in found])
            moved = np.abs(answered - assumed)[alive]
            change = float(np.where(np.isnan(moved), np.inf, moved).max(initial=0.0))
            residual = max(result[1] for result in found)
            self.values = answered
            self.say(f"round {self.rounds[1]}: rims moved by {change:.1e}, residual {residual:.1e}")
            if change <= wanted and residual <= wanted:
                return True
            if not np.isfinite(residual):
                return False
            tolerance = max(0.3 * wanted, min(tolerance, TIGHTER * change))
            self.values = answered.copy()
            self.values[alive] = mixing.next(assumed[alive], answered[alive], change)
        self.values = answered
        return False

    def certify(self) -> None:
        """Prove bounds by one sweep over all blocks, `shares`; None where that fails."""
        self.say("proving the bounds")
        found = self.every(working.measure, self.final)
        shares = [max(0.0, *(result[side] for result in found)) * ROOM + 1e-15 for side in (0, 1)]
        self.shares = None
        for _ in range(TRIES):
            if not max(shares) <= WIDEST:
                return
            tried = (shares[0], shares[1])
            checked = self.every(working.check, self.final, always(tried))
            passed = [all(result.falls for result in checked), all(result.rises for result in checked)]
            if all(passed):
                self.shares, self.digests = tried, [result.digest for result in checked]
                return
            shares = [share if good else 2.0 * share for share, good in zip(shares, passed, strict=True)]


def _placed(function: Callable[..., Any], *given: Any) -> tuple[str, Any]:
    """Run a function on a worker; return which one that is, too."""
    return here(), function(*given)


def always(value: Any) -> Callable[[int], Any]:
    """Return a function that gives every block the same."""
    return lambda _: value


def start_in(about: Described, given: str | int | None) -> int:
    """Return the state of an archive to begin in.

    Parameters
    ----------
    about : Described
    given : int or str, optional
        Its number; by default the only initial state.

    Raises
    ------
    QuestionError
        Where there is no such state, or more than one to begin in.
    """
    states = about.header.states
    if given is None:
        initial = about.initial
        if len(initial) != 1:
            raise QuestionError(
                f"It must be clear where to start, but the model has {len(initial)} initial states. "
                "Choose one with --start STATE."
            )
        return int(initial[0])
    text = str(given).strip()
    if not (text.isascii() and text.isdigit() and len(text) < 20 and int(text) < states):
        raise QuestionError(f"In blocks a state must be a number in 0 … {states - 1}, got '{given}'.", state=given)
    return int(text)

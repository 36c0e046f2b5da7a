"""An archive that no worker need hold enters; the least expected cost leaves, solved in blocks and proved by one sweep over all.

The rows of the archive lie in blocks (`block`), each with the worker that solves it. Three things go in rounds, in each of which every
block does much and tells little, numbers about its rim:

1. *Which states reach the goal for sure.* Distances from the goal spread through the blocks until no new state has one; states
   without are lost, and with them those whose choices all may lead there; again, until nothing is lost (as in `model.graph`).
2. *Values.* Each block is solved with its rim held fast, by the windowed sweeps of `solve.windows`, to a tolerance that shrinks as
   the rims come to rest.
3. *The certificate.* All blocks speak of one vector v: at states that two of them see it is what was exchanged last. One pass
   finds the shares h and k, one more checks that (1 - h) v never falls along any row and (1 + k) v never rises along those that the
   policy takes (`solve.windowed`): each block its own rows. Whatever happened before, the bounds hold then.

All that a block is asked comes with what it needs to answer, so a worker that dies is replaced by any other. What was checked
has a digest; should a block have been solved anew since, it is checked again before it tells values.

Supported is one least expected cost with positive costs, until states that a formula over labels describes.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from ratherthan.cluster import spreading
from ratherthan.cluster.archive import Described, described
from ratherthan.cluster.block import Extent
from ratherthan.cluster.blocks import Blocks, Blockwise, Tell, always, start_in
from ratherthan.cluster.engine import engine
from ratherthan.cluster.storing import check_place
from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model.objective import ExpectedCost, Objective, Threshold

__all__ = ["solve_in_blocks", "solved_in_blocks"]

OVERLAP = 0.06
"""The share of a block that it reads besides, on either side."""


def solve_in_blocks(
    path: str | os.PathLike[str],
    objective: Objective | str | None = None,
    *,
    workers: int = 2,
    cluster: str | None = None,
    blocks: int | None = None,
    start: str | int | None = None,
    values: str | os.PathLike[str] | None = None,
    tell: Tell | None = None,
) -> Blockwise:
    """Return the least expected cost from the start of a model that is read and solved in blocks.

    Parameters
    ----------
    path : path
        A UMB archive, which every worker can read under this name.
    objective : objective or str, optional
        An `ExpectedCost` that is minimised, or a property; by default what the archive makes plain.
    workers : int
        How many local processes.
    cluster : str, optional
        The address of a scheduler whose workers do it instead.
    blocks : int, optional
        As many as there are workers by default.
    start : int or str, optional
        A state's number; by default the only initial state.
    values : path, optional
        An ``.npz`` file for the values and bounds of all states, and the choice taken.
    tell : callable, optional
        Takes a short text: how far it is.

    Raises
    ------
    PropertyError
        For another objective, and where a choice costs nothing.
    """

    def possible(about: Described) -> None:
        start_in(about, start)
        if values is not None:
            check_place(values)

    with _blocks(path, objective, cluster=cluster, workers=workers, count=blocks, tell=tell, before=possible) as solved:
        found = solved.outcome(solved.start(start))
        if values is not None:
            from ratherthan.cluster.storing import store

            store(solved, values)
        return found


@contextmanager
def solved_in_blocks(
    path: str | os.PathLike[str],
    objective: Objective | str | None = None,
    *,
    workers: int = 2,
    cluster: str | None = None,
    count: int | None = None,
    tell: Tell | None = None,
    before: Callable[[Described], None] | None = None,
) -> Iterator[Blocks]:
    """Hold a solved model in blocks on workers for the time of a block; parameters as `solve_in_blocks`.

    What the archive tells of the model is shown to `before` first: it may raise before anything long begins.
    """
    with _blocks(path, objective, cluster=cluster, workers=workers, count=count, tell=tell, before=before) as solved:
        yield solved


@contextmanager
def _blocks(
    path: str | os.PathLike[str],
    objective: Objective | str | None,
    *,
    cluster: str | None,
    workers: int,
    count: int | None,
    tell: Tell | None,
    before: Callable[[Described], None] | None = None,
) -> Iterator[Blocks]:
    about = described(os.path.abspath(path))  # noqa: PTH100 - of the text
    wanted = _supported(about, objective)
    if before is not None:
        before(about)
    with engine(cluster, workers=workers) as pool:
        there = pool.workers()
        extents = _extents(about, wanted, count or len(there))
        made = Blocks(pool=pool, about=about, objective=wanted, extents=extents, tell=tell or _nobody)
        made.at = [there[k % len(there)] for k in range(len(extents))]
        _survey(made)
        _arriving(made)
        made.settle()
        yield made


def _nobody(_: str) -> None:
    """Tell nobody."""


def _supported(about: Described, objective: Objective | str | None) -> ExpectedCost:
    """Return the objective that is wanted, if it can be solved in blocks."""
    from ratherthan.model.property import wish_of
    from ratherthan.solve.wanted import objective_of

    outline = about.outline()
    wish = wish_of(outline, objective) if objective is None or isinstance(objective, str) else objective
    if isinstance(wish, Threshold):
        raise PropertyError(
            f"In blocks a value is asked for (=?), got the yes-or-no question '{wish.text}'.", text=wish.text
        )
    wanted = objective_of(outline, wish)
    if not isinstance(wanted, ExpectedCost) or wanted.maximise:
        raise NotExplainableError(
            'In blocks the least expected cost of one reward until a goal can be solved, such as R{"steps"}min=? [F "goal"], '
            f"got '{wanted.text}'. On one machine: leave --cluster out.",
            text=wanted.text,
        )
    return wanted


def _extents(about: Described, objective: ExpectedCost, count: int) -> tuple[Extent, ...]:
    """Return blocks of about equally many states, each with an overlap on either side."""
    states, run = about.header.states, secrets.token_hex(8)
    count = max(1, min(count, states))
    cuts = [k * states // count for k in range(count + 1)]
    overlap = int(OVERLAP * states / count) if count > 1 else 0
    return tuple(
        Extent(
            run=run,
            path=about.path,
            number=k,
            first=cuts[k],
            last=cuts[k + 1],
            begin=max(cuts[k] - overlap, 0),
            end=min(cuts[k + 1] + overlap, states),
            objective=objective,
        )
        for k in range(count)
    )


def _survey(made: Blocks) -> None:
    """Find out who needs what of whom, and that all costs are positive."""
    made.say(f"reading {len(made.extents)} blocks")
    found = made.every(spreading.survey)
    for result in found:
        if result.costless >= 0:
            raise NotExplainableError(
                f"In blocks every choice must cost something, but one of state {result.costless} costs nothing under "
                f"'{made.objective.text}'. On one machine that is solved, too: leave --cluster out.",
                state=result.costless,
            )
    least = min(result.least for result in found)
    made.least = least if np.isfinite(least) else 1.0
    made.shared = np.unique(np.concatenate([result.needs for result in found]))
    made.needs = [np.searchsorted(made.shared, result.needs) for result in found]
    edges = np.searchsorted(made.shared, [extent.first for extent in made.extents] + [made.about.header.states])
    made.exports = [slice(int(edges[k]), int(edges[k + 1])) for k in range(len(made.extents))]
    made.alive = [result.alive for result in found]
    made.shared_alive = np.ones(len(made.shared), dtype=np.bool_)
    made.values = np.full(len(made.shared), np.nan)


def _arriving(made: Blocks) -> None:
    """Find the states that reach the goal for sure, and how far they are from it."""
    while True:
        made.levels = np.full(len(made.shared), -1, dtype=np.int64)
        while True:
            made.rounds[0] += 1
            found = made.every(spreading.reach, made.known)
            before = made.levels >= 0
            made.levels = np.concatenate([result[0] for result in found]) if found else made.levels
            made.say(f"round {made.rounds[0]}: {sum(result[1] for result in found)} states on their way")
            if ((made.levels >= 0) == before).all():
                break
        if not made.can:
            made.can = [result[2] for result in found]
        first, lost = True, 0
        while True:
            made.rounds[0] += 1
            found = made.every(spreading.lose, made.known, always(first))
            newly = sum(result[1] for result in found)
            before = made.shared_alive
            made.shared_alive = np.concatenate([result[0] for result in found])
            made.alive = [result[2] for result in found]
            first, lost = False, lost + newly
            if (made.shared_alive == before).all():
                break
        if not lost:
            return

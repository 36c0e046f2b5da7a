"""What a round asks of one block enters, what the others need of it leaves. Runs on the worker that has the block.

Every function gives the same answer, up to what `certify` allows for, on a worker that has just read the block and on one that has
had it all the time: what is needed besides comes along each time. So a worker that dies costs the reading of its blocks
and one round.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.cluster.block import Block, Extent, States
from ratherthan.cluster.spreading import Known, block_of, levels_of, usable_of
from ratherthan.model._kernels import compiled
from ratherthan.model.mdp import Bools, Floats
from ratherthan.model.watch import look
from ratherthan.solve._kernels import Ordered, ordered_rows, window_sweeps
from ratherthan.solve.contracting._kernels import gaps_of
from ratherthan.solve.system import System, build_system, drift

__all__ = ["Checked", "RowsAt", "check", "measure", "policy_rows", "rows_at", "sweep", "values_of"]

Bits = npt.NDArray[np.uint8]
STEP = 1.3
"""What a state is guessed to cost more than the next on its way, in units of the least cost."""
WIDTH = 80
MOST_PASSES = 12
MOST_VISITS = 100
TIE = 4.0


class Equations(NamedTuple):
    """The equations of a block's states that are alive: nodes are these and behind them the rim's."""

    system: System
    rows: Ordered
    order: States
    layers: States
    node: States
    open: Bools


def _equations(block: Block, known: Known) -> Equations:
    """Return the equations of a block, made now or in a round before."""
    key = (known.alive.inside.tobytes(), known.alive.needed.tobytes())
    kept = block.memory.get("equations")
    if isinstance(kept, tuple) and kept[0] == key:
        found: Equations = kept[1]
        return found
    goal, index = block.goal, block.goal.index
    mask, usable = usable_of(block, known.alive)
    running = mask & ~goal.target
    running[block.inside :] = False
    n, r = int(running.sum()), index.states - block.inside
    node = np.full(index.states, n + r)  # goals, and what is never led to
    node[running] = np.arange(n)
    node[block.inside :] = n + np.arange(r)
    if n == 0:
        return _nothing(block, running, node)
    system = build_system(index, goal.probability, goal.cost, np.flatnonzero(usable), node)
    bare = np.full(r, system.rows, dtype=system.node_to_rows.dtype)
    system = replace(system, node_to_rows=np.concatenate([system.node_to_rows, bare]))
    level = levels_of(block, known)[running]
    level = np.where(level < 0, level.max(), level)  # a guess, like all distances here
    order = np.argsort(level, kind="stable").astype(np.int64)
    rank = np.arange(n + r + 2)
    rank[order] = np.arange(n)
    sizes = np.bincount(level - level.min()) if n else np.zeros(0, dtype=np.int64)
    layers = np.concatenate([[0], np.cumsum(sizes[sizes > 0])]).astype(np.int64)
    kernel = compiled(ordered_rows, len(system.target))
    rows = kernel(
        (system.node_to_rows[: n + 1], system.row_to_branches, system.target),
        system.probability,
        system.cost,
        (order, rank),
        (np.zeros(n + 1, dtype=np.int32), np.zeros(len(system.row_to_branches), dtype=np.int32)),
    )
    made = Equations(system=system, rows=rows, order=order, layers=layers, node=node, open=running)
    block.memory = {"equations": (key, made)}
    # Where nothing was solved yet, farther states are guessed to cost more.
    block.memory["values"] = np.concatenate([level[order] * 1.0, np.zeros(r + 2)])
    block.memory["guessed"] = True
    return made


def _nothing(block: Block, running: Bools, node: States) -> Equations:
    """Return the equations of a block with nothing to solve."""
    none, numbers = np.zeros(1, dtype=np.int64), np.zeros(0)
    r = len(block.rim)
    system = System(
        node_to_rows=np.zeros(r + 1, dtype=np.int64),
        row_to_branches=none,
        target=none[:0],
        probability=numbers,
        cost=numbers,
        source=none[:0],
    )
    rows = Ordered(none.astype(np.int32), none.astype(np.int32), none[:0].astype(np.int32), numbers, numbers)
    block.memory = {"values": np.zeros(r + 2)}
    return Equations(system=system, rows=rows, order=none[:0], layers=none, node=node, open=running)


def sweep(extent: Extent, known: Known) -> tuple[Floats, float]:
    """Solve a block with its rim held fast; return the values of exported states, and the residual.

    What nobody knows yet of the rim is guessed from the distance.
    """
    block = block_of(extent)
    made = _equations(block, known)
    values: Any = block.memory["values"]
    n = len(made.order)
    anew = bool(block.memory.pop("guessed", False))
    if anew:
        values[:n] *= STEP * known.least
    guess = STEP * known.least * known.levels
    _set_rim(block, made, values, np.where(np.isnan(known.outside), guess, known.outside))
    taken = np.zeros(n, dtype=np.int32)
    most = 10 * MOST_VISITS if anew else MOST_VISITS
    work, left, width, residual = len(made.rows.target), most * max(n, 1), WIDTH, np.inf
    for _ in range(MOST_PASSES if n else 0):
        at, spans = np.zeros(2, dtype=np.int64), (width, max(width // 2, 1))
        left -= compiled(window_sweeps, work)(
            made.rows, made.layers, values, taken, at, spans, (known.tolerance, 0.0), left
        )[0]
        look()
        best, gaps = np.zeros(n, dtype=np.int64), np.zeros(n)
        before, residual = residual, float(compiled(gaps_of, work)(made.rows, values, best, gaps))
        if residual <= known.tolerance or left < 0 or not np.isfinite(residual):
            break
        if residual > 0.1 * before:
            width *= 2
    return _everywhere(made, values)[block.local(known.exports)], residual if n else 0.0


def _set_rim(block: Block, made: Equations, values: Floats, outside: Floats) -> None:
    rim = block.from_rim
    values[made.node[block.needed[rim]]] = np.where(np.isfinite(outside[rim]), outside[rim], 0.0)


def _everywhere(made: Equations, values: Floats) -> Floats:
    """Return the value of each local state, 0 at goals and where there is none."""
    nodes = values.copy()
    nodes[made.order] = values[: len(made.order)]
    return nodes[made.node]


class Checked(NamedTuple):
    """Whether the two checks were passed, and the digest of the vector and the rows that passed them."""

    falls: bool
    rises: bool
    digest: str


class _Final(NamedTuple):
    """The vector that is checked, ``[n+r]``, the rows of the states owned, and the row taken at each node."""

    made: Equations
    vector: Floats
    own: Bools
    taken: States
    drifts: tuple[Floats, Floats]


def _final(extent: Extent, known: Known) -> _Final | None:
    """Return what is checked; None where no state of the block is left to solve.

    All blocks must speak of one and the same vector. What others know of it is therefore taken from `known`, whatever a
    block that was read anew would come to; what no other block sees is its own.
    """
    block = block_of(extent)
    made = _equations(block, known)
    n, system = len(made.order), made.system
    if n == 0:
        return None
    if block.memory.get("guessed"):
        sweep(extent, known)
    solved: Any = block.memory["values"]
    local = _everywhere(made, solved)
    local[block.needed] = np.where(np.isfinite(known.outside), known.outside, 0.0)
    local[block.local(known.exports)] = np.where(np.isfinite(known.exported), known.exported, 0.0)
    local[: block.inside][block.goal.target[: block.inside]] = 0.0
    vector = np.zeros(system.nodes)
    here = made.node < system.nodes
    vector[made.node[here]] = local[here]
    owned = np.zeros(block.goal.index.states, dtype=np.bool_)
    owned[block.owned] = True
    own = np.zeros(system.nodes, dtype=np.bool_)
    own[made.node[owned & made.open]] = True
    total, error = drift(system, vector)
    begin = system.node_to_rows[:n]
    best = np.minimum.reduceat(total, begin)
    near = total - best[system.row_node] <= TIE * known.tolerance + 4.0 * error
    candidates = np.flatnonzero(near)
    taken = candidates[np.searchsorted(candidates, begin)]
    return _Final(made, vector, own[system.row_node], taken, (total, error))


def measure(extent: Extent, known: Known) -> tuple[float, float, float]:
    """Return by which share a block's values must be lowered and raised to be bounds, and the residual."""
    final = _final(extent, known)
    if final is None or not final.own.any():
        return 0.0, 0.0, 0.0
    total, error = final.drifts
    chosen = final.taken[final.own[final.taken]]
    low = ((error - total) / final.made.system.cost)[final.own].max()
    high = ((error + total) / final.made.system.cost)[chosen].max()
    return float(low), float(high), float(np.abs(total[chosen]).max())


def check(extent: Extent, known: Known, shares: tuple[float, float]) -> Checked:
    """Return whether (1 - h) v never falls along any row of the states owned, and (1 + k) v never rises along those taken."""
    final = _final(extent, known)
    if final is None or not final.own.any():
        return Checked(falls=True, rises=True, digest=_digest(final))
    vector, system = final.vector, final.made.system
    if not (np.isfinite(vector).all() and (vector >= 0.0).all()):
        return Checked(falls=False, rises=False, digest="")
    total, error = drift(system, (1.0 - shares[0]) * vector)
    falls = bool((total - error >= 0.0)[final.own].all())
    total, error = drift(system, (1.0 + shares[1]) * vector)
    chosen = final.taken[final.own[final.taken]]
    return Checked(falls=falls, rises=bool((total + error <= 0.0)[chosen].all()), digest=_digest(final))


def _digest(final: _Final | None) -> str:
    from hashlib import blake2b

    if final is None:
        return "nothing"
    return blake2b(final.vector.tobytes() + final.taken.tobytes(), digest_size=16).hexdigest()


def values_of(extent: Extent, known: Known, states: States | None) -> tuple[Floats, States, str]:
    """Return the values of states that a block owns (all without `states`), the choice taken at each, and the digest.

    Values are ∞ and choices -1 where the goal is not reached for sure; choices are -1 at goals, too.
    """
    block = block_of(extent)
    final = _final(extent, known)
    count = block.goal.index.states
    values, choice = np.full(count, np.inf), np.full(count, -1, dtype=np.int64)
    values[: block.inside][block.goal.target[: block.inside]] = 0.0
    if final is not None:
        values[final.made.open] = final.vector[final.made.node[final.made.open]]
        choice[final.made.open] = final.made.system.source[final.taken] + block.first_choice
    local = np.arange(block.owned.start, block.owned.stop) if states is None else block.local(states)
    return values[local], choice[local], _digest(final)


def policy_rows(extent: Extent, known: Known) -> tuple[States, States, Floats, States, Floats]:
    """Return, for the states that a block owns, the row taken: how many branches, where to, how likely; action and value.

    A state that takes none stays where it is.
    """
    from ratherthan.model.index import branches_of

    block = block_of(extent)
    index = block.goal.index
    values, choice, _ = values_of(extent, known, None)
    own = np.arange(block.owned.start, block.owned.stop)
    row = np.where(choice >= 0, choice - block.first_choice, index.state_to_choices[own])
    branches, offsets = branches_of(index.choice_to_branches, row)
    target = block.everywhere(index.branch_to_target[branches].astype(np.int64))
    probability = block.goal.probability[branches].copy()
    idle = np.repeat(choice < 0, np.diff(offsets))
    target[idle] = np.repeat(own + extent.begin, np.diff(offsets))[idle]
    return np.diff(offsets), target, probability, block.action[row], values


class RowsAt(NamedTuple):
    """The rows of some states: choices per state, branches per choice; targets are states of the archive."""

    choices: States
    first: States
    branches: States
    target: States
    probability: Floats
    cost: Floats
    action: States
    arrived: Bools


def rows_at(extent: Extent, states: States) -> RowsAt:
    """Return the rows of states that a block owns."""
    from ratherthan.model.index import branches_of

    block = block_of(extent)
    index, local = block.goal.index, block.local(states)
    choices, offsets = branches_of(index.state_to_choices, local)
    branches, own = branches_of(index.choice_to_branches, choices)
    return RowsAt(
        choices=np.diff(offsets),
        first=index.state_to_choices[local].astype(np.int64) + block.first_choice,
        branches=np.diff(own),
        target=block.everywhere(index.branch_to_target[branches].astype(np.int64)),
        probability=block.goal.probability[branches],
        cost=block.goal.cost[choices],
        action=block.action[choices],
        arrived=block.goal.target[local],
    )

"""How fast the decisions that actions leave open are counted: on a route and everywhere, against one search per action."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache, partial

import numpy as np
import numpy.typing as npt

from benchmarks.harness import Case, Seen, lazily
from benchmarks.models import expander, maze, one_way_city, slippery_map
from ratherthan.factors._kernels import tree_weight
from ratherthan.factors.constrictiveness import Search, count_decisions
from ratherthan.factors.counting.effort import Effort
from ratherthan.factors.counting.ground import restricted
from ratherthan.factors.counting.plan import count_all
from ratherthan.factors.selectiveness import Criticality
from ratherthan.model._kernels import compiled
from ratherthan.model.graph import first_downhill, levels_to
from ratherthan.model.index import index_of
from ratherthan.model.mdp import MDP

Numbers = npt.NDArray[np.int64]
Asked = Callable[[], tuple[MDP, Numbers, Criticality]]

SIDE = 300
SEARCHED = 10
"""One search per action is timed on so many actions of each; what all of them would take is told beside it."""
HORIZON = 10


@cache
def river(states: int, *, reach: int = 1000, seed: int = 0) -> MDP:
    """Return a model on which no way leads back: two choices a state, each to one of the next `reach` states, or it fails."""
    rng = np.random.default_rng(seed)
    own = np.repeat(np.arange(states), 2)
    ahead = np.minimum(own + rng.integers(1, reach + 1, 2 * states), states - 1)
    return MDP(
        state_to_choices=np.arange(0, 2 * states + 1, 2),
        choice_to_branches=np.arange(0, 4 * states + 1, 2),
        branch_to_target=np.stack([ahead, own], 1).reshape(-1),
        branch_to_probability=np.tile([0.9, 0.1], 2 * states),
        initial=np.array([0]),
        labels={"goal": np.arange(states) == states - 1},
    )


def families(side: int) -> dict[str, Callable[[], MDP]]:
    """Return the models, of about side × side states."""
    return {
        "slippery map": lambda: slippery_map(side).mdp,
        "one-way city": lambda: one_way_city(side).mdp,
        "maze, 2 % more links": lambda: maze(side).mdp,
        "perfect maze": lambda: maze(side, links=0.0).mdp,
        "expander": lambda: expander(side * side).mdp,
        "river": lambda: river(side * side),
    }


def cases(side: int = SIDE) -> list[Case]:
    return [case for name in families(side) for case in _cases_of(name, side)]


def _cases_of(name: str, side: int) -> list[Case]:
    route, everywhere = f"{name}, {side} × {side}, a route", f"{name}, {side} × {side}, everywhere"
    near = f"{name}, {side} × {side}, everywhere, {HORIZON} steps ahead"
    there, all_of_it = partial(_asked, name, side, on_route=True), partial(_asked, name, side, on_route=False)
    return [
        Case(name="one search per action", run=lazily(partial(_each, there)), group=route, peer=True),
        Case(name="with preparation", run=lazily(partial(_fresh, there)), group=route),
        Case(name="prepared", run=lazily(partial(_kept, there)), group=route),
        Case(name="one search per action", run=lazily(partial(_each, all_of_it)), group=everywhere, peer=True),
        Case(name="with preparation", run=lazily(partial(_fresh, all_of_it)), group=everywhere),
        Case(name=f"{HORIZON} steps ahead", run=lazily(partial(_near, all_of_it)), group=near, peer=True),
    ]


@cache
def _asked(name: str, side: int, *, on_route: bool) -> tuple[MDP, Numbers, Criticality]:
    """Return a model, the choices of critical states that are asked about, and half of the states as critical ones."""
    mdp = families(side)[name]()
    goal = mdp.labels["goal"]
    some = (np.random.default_rng(1).random(mdp.states) < 0.5) & ~goal & (np.diff(mdp.state_to_choices) > 1)
    states = np.flatnonzero(some)
    if on_route:
        states = np.intersect1d(states, _route(mdp))
    own = [np.arange(mdp.state_to_choices[s], mdp.state_to_choices[s + 1]) for s in states]
    return mdp, np.concatenate([np.zeros(0, dtype=np.int64), *own]), Criticality(certain=some, possible=some)


def _route(mdp: MDP) -> list[int]:
    """Return the states of a shortest way to the goal."""
    index, goal = index_of(mdp), mdp.labels["goal"]
    level = levels_to(index, goal, ~goal)
    down = first_downhill(index, level, np.ones(mdp.choices, dtype=np.bool_))
    state, found = int(mdp.initial[0]), []
    while down[state] >= 0 and not goal[state]:
        found.append(state)
        targets = mdp.branch_to_target[mdp.branches_of(int(down[state]))]
        reached = targets[level[targets] >= 0]
        state = int(reached[np.argmin(level[reached])])
    return found


def _fresh(asked: Asked) -> Callable[[], Seen]:
    """Count with nothing known of the model beforehand."""
    mdp, choices, critical = asked()
    weight = np.diff(mdp.state_to_choices).astype(np.int64) * critical.certain

    def run() -> Seen:
        ground = restricted(mdp, mdp.labels["goal"], np.zeros(0), np.zeros(0))
        found = count_all(ground, choices, (weight, weight), Effort())
        return Seen(note=f"{len(choices):,} actions, {int(found.counted.sum()):,} counted")

    return run


def _kept(asked: Asked) -> Callable[[], Seen]:
    """Count once more on a model that has been asked about before."""
    mdp, choices, critical = asked()

    def run() -> Seen:
        found = count_decisions(mdp, critical, mdp.labels["goal"], choices, effort=Effort(visits=10**15))
        return Seen(note=f"{len(choices):,} actions, {int(found.counted.sum()):,} counted")

    return run


def _near(asked: Asked) -> Callable[[], Seen]:
    """Count what is a few steps ahead."""
    mdp, choices, critical = asked()

    def run() -> Seen:
        found = count_decisions(mdp, critical, mdp.labels["goal"], choices, search=Search(horizon=HORIZON))
        return Seen(note=f"{len(choices):,} actions, {int(found.counted.sum()):,} counted")

    return run


def _each(asked: Asked) -> Callable[[], Seen]:
    """Search once per action, for a few of them."""
    mdp, choices, critical = asked()
    weight = np.diff(mdp.state_to_choices).astype(np.int64) * critical.certain
    some = choices[np.linspace(0, len(choices) - 1, min(SEARCHED, len(choices))).astype(np.int64)].tolist()
    rows = mdp.state_to_choices, mdp.choice_to_branches, mdp.branch_to_target
    mark, queue = np.zeros(mdp.states, dtype=np.int64), np.zeros(mdp.states, dtype=np.int64)
    stamp = iter(range(1, 1 << 60))
    kernel = compiled(tree_weight, mdp.branches)
    nothing = np.zeros(0)

    def run() -> Seen:
        start = time.perf_counter()
        for choice in some:
            own = mdp.branches_of(choice)
            room = mark, queue, next(stamp)
            kernel(
                mdp.state_of(choice), (own.start, own.stop), rows, mdp.labels["goal"],
                weight, weight, room, -1, nothing, nothing,
            )  # fmt: skip
        seconds = (time.perf_counter() - start) * len(choices) / len(some)
        return Seen(note=f"{len(some)} of {len(choices):,} actions; all: {seconds:,.1f} s")

    return run

"""A Solution and a start enter; what a person sees leaves: the most probable path to a goal under the policy, and its chance.

Definition
----------
Branches that stay in place are removed and the rest renormalised (a stuck robot is not a turn). Among all paths from the
start to a goal, the most probable one is taken; ties within 1e-12 in log-probability go to the lexicographically first
sequence of (choice, branch). Without a goal in the objective: the most probable branch until a state repeats, at most
1,000 steps. A policy that never arrives is an answer too: the route then ends where it goes round for ever, in a set of
states that the policy cannot leave.

Method: Dijkstra's algorithm backwards from the goals with lengths -log p, then one walk forwards. A branch that keeps the
length within the tie must come nearer to the goal, or be the only one, so that the walk ends.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ratherthan.explain._kernels import Rows, shortest_to, spread
from ratherthan.explain.objectives import endless
from ratherthan.model._kernels import compiled, is_compiled, sorted_by
from ratherthan.model.index import branches_of, index_of
from ratherthan.model.mdp import Bools, Floats
from ratherthan.solve.solution import Solution

__all__ = ["PolicyGraph", "Route", "policy_graph", "reachable_at_all", "route_from"]

TIE = 1e-12
MOST_STEPS = 1000
SMALL, MANY = 20_000, 20_000
"""Up to how many edges shortest ways are found in plain Python, and from how many on it is worth compiling the search."""

Array = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Route:
    """A path: its states, the choice taken at each but the last, its outcome and its probability.

    `outcome`, `circle` and `certain` are as in `ratherthan.explain.explanation.Explanation`.
    """

    states: tuple[int, ...]
    choices: tuple[int, ...]
    outcome: str
    probability: float
    circle: tuple[int, ...] = ()
    certain: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class PolicyGraph:
    """The branches that a policy follows, in rows by state and in the order of (choice, branch): E edges.

    `probability` is renormalised after staying in place has been removed; states where the objective has ended, and
    states that only stay in place, have no edges.
    """

    first: Array  # [S+1]
    target: Array  # [E]
    choice: Array  # [E]
    probability: Floats  # [E]

    @property
    def states(self) -> int:
        """The number of states, S."""
        return len(self.first) - 1

    def edges_of(self, state: int) -> range:
        """Return the edges of one state."""
        return range(int(self.first[state]), int(self.first[state + 1]))

    @cached_property
    def origin(self) -> Array:
        """The state of each edge, ``[E]``."""
        return np.repeat(np.arange(self.states), np.diff(self.first))

    @cached_property
    def length(self) -> Floats:
        """-log of the probability of each edge, ``[E]``."""
        return np.asarray(-np.log(np.minimum(self.probability, 1.0)))

    @cached_property
    def _known(self) -> list[tuple[Bools, Floats]]:
        """Sets of states, and the shortest ways to them."""
        return []

    def distances(self, goals: Bools) -> Floats:
        """Return the least total length from each state to one of `goals`, ``[S]``; kept for the next question.

        Parameters
        ----------
        goals : array of bool, ``[S]``
            Not to be changed afterwards.
        """
        for known, distance in self._known:
            if known is goals:
                return distance
        self._known[:] = [(goals, _distances(self, goals))]
        return self._known[0][1]

    def reachable(self, start: int, seen: Bools | None = None) -> Bools:
        """Return which states can be reached from `start`, itself included.

        Parameters
        ----------
        start : int
        seen : array of bool, ``[S]``, optional
            States that are known to be reached, with all that they lead to; they are marked in what is returned, too.
        """
        seen = np.zeros(self.states, dtype=bool) if seen is None else seen.copy()
        if seen[start]:
            return seen
        seen[start] = True
        if is_compiled(len(self.target)):
            queue = np.empty(self.states, dtype=np.int64)
            queue[0] = start
            compiled(spread, len(self.target))(self.first, self.target, seen, queue, 1)
            return seen
        frontier = np.array([start])
        while len(frontier):
            counts = self.first[frontier + 1] - self.first[frontier]
            skip = np.repeat(self.first[frontier] - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
            target = self.target[skip + np.arange(int(counts.sum()))]
            frontier = np.unique(target[~seen[target]])
            seen[frontier] = True
        return seen


def policy_graph(solution: Solution) -> PolicyGraph:
    """Return the graph that the solution's policy follows."""
    mdp, policy = solution.problem.mdp, solution.policy
    if policy.chance is None:
        own = np.flatnonzero((policy.choice >= 0) & ~solution.ended)
        chosen = policy.choice[own].astype(np.int64)
    else:
        state_of_choice = index_of(mdp).choice_to_state
        chosen = np.flatnonzero((policy.chance > 0) & ~solution.ended[state_of_choice])
        own = state_of_choice[chosen].astype(np.int64)
    branch, rows = branches_of(mdp.choice_to_branches, chosen)
    counts = np.diff(rows)
    origin, target = np.repeat(own, counts), mdp.branch_to_target[branch].astype(np.int64)
    weight = mdp.branch_to_probability[branch]
    if policy.chance is not None:
        weight = np.repeat(policy.chance[chosen], counts) * weight
    moves = np.flatnonzero(origin != target)
    origin, target, weight = origin[moves], target[moves], weight[moves]
    sums = np.bincount(origin, weights=weight, minlength=mdp.states)
    first = np.concatenate([[0], np.cumsum(np.bincount(origin, minlength=mdp.states))])
    choice = np.repeat(chosen, counts)[moves]
    return PolicyGraph(first=first, target=target, choice=choice, probability=weight / sums[origin])


def route_from(solution: Solution, graph: PolicyGraph, start: int) -> Route:
    """Find the route from `start`.

    Parameters
    ----------
    solution : Solution
    graph : PolicyGraph
        Of the solution's policy.
    start : int

    Returns
    -------
    Route
    """
    if solution.ended[start]:
        return Route(states=(start,), choices=(), outcome=_end_of(solution, start), probability=1.0)
    if endless(solution.objectives[0]):
        return _without_goal(solution, graph, start)
    if not solution.can_arrive[start]:
        reached = np.flatnonzero(reachable_at_all(solution, start))
        return Route(states=(start,), choices=(), outcome="no way", probability=1.0, circle=tuple(map(int, reached)))
    reachable = graph.reachable(start)
    if (reachable & solution.goal).any():
        states, choices, probability = _most_probable(graph, start, solution.goal)
        return Route(states=states, choices=choices, outcome="arrives", probability=probability)
    return _circling(solution, graph, start, reachable)


def _end_of(solution: Solution, state: int) -> str:
    return "there" if solution.goal[state] and not endless(solution.objectives[0]) else "ended"


def reachable_at_all(solution: Solution, start: int) -> Bools:
    """Return what any policy can reach from `start`; states where the objective has ended are leaves."""
    from ratherthan.factors import search_tree

    seen = np.zeros(solution.problem.mdp.states, dtype=bool)
    seen[start] = True
    for choice in () if solution.ended[start] else solution.problem.mdp.choices_of(start):
        seen[search_tree(solution.problem.mdp, solution.ended, choice)] = True
    return seen


def _without_goal(solution: Solution, graph: PolicyGraph, start: int) -> Route:
    """Follow the most probable branch until a state repeats or the objective has ended; to stay for ever is a step, too."""
    states, probability = [start], 1.0
    choices: list[int] = []
    seen = {start}
    while len(choices) < MOST_STEPS:
        edges = graph.edges_of(states[-1])
        if not edges:
            stay = _stay(solution, states[-1])
            return Route(
                states=(*states, *states[-1:] * len(stay)),
                choices=(*choices, *stay),
                outcome="open end",
                probability=probability,
            )
        best = max(float(graph.probability[e]) for e in edges)
        edge = next(e for e in edges if graph.probability[e] >= best * (1 - TIE))
        states.append(int(graph.target[edge]))
        choices.append(int(graph.choice[edge]))
        probability *= float(graph.probability[edge])
        if states[-1] in seen:
            break
        seen.add(states[-1])
    return Route(states=tuple(states), choices=tuple(choices), outcome="open end", probability=probability)


def _stay(solution: Solution, state: int) -> tuple[int, ...]:
    """Return the choice with which the policy stays in a state for ever; nothing where there is nothing to decide."""
    mdp = solution.problem.mdp
    if solution.ended[state] or len(mdp.choices_of(state)) == 1:
        return ()
    weights = solution.policy.weights(mdp)
    taken = [c for c in mdp.choices_of(state) if weights[c] > 0]
    return (max(taken, key=lambda c: (float(weights[c]), -c)),) if taken else ()


def _circling(solution: Solution, graph: PolicyGraph, start: int, reachable: Bools) -> Route:
    """Return the most probable way into a set of states that the policy cannot leave, once round it, and that set."""
    component, closed = _closed_components(graph, reachable)
    states, choices, probability = _most_probable(graph, start, closed)
    circle = np.flatnonzero(component == component[states[-1]])
    round_states, round_choices = _once_round(solution, graph, states[-1])
    return Route(
        states=states + round_states[1:],
        choices=choices + round_choices,
        outcome="circles",
        probability=probability,
        circle=tuple(map(int, circle)),
        certain=bool((component[closed] == component[states[-1]]).all()),
    )


def _closed_components(graph: PolicyGraph, reachable: Bools) -> tuple[Array, Bools]:
    """Return the strongly connected component of each reachable state (-1 elsewhere), and which lie in a closed one."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    inside = reachable[graph.origin]
    matrix = csr_array(
        (np.ones(int(inside.sum())), (graph.origin[inside], graph.target[inside])), shape=(graph.states, graph.states)
    )
    _, component = connected_components(matrix, directed=True, connection="strong")
    component[~reachable] = -1
    leaving = inside & (component[graph.origin] != component[graph.target])
    closed = reachable & ~np.isin(component, component[graph.origin[leaving]])
    return np.asarray(component, dtype=np.int64), closed


def _once_round(solution: Solution, graph: PolicyGraph, start: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Follow the most probable branch from `start` until a state repeats; to stay for ever is a round, too."""
    states = [start]
    choices: list[int] = []
    while states[-1] not in states[:-1] and len(choices) < MOST_STEPS:
        edges = graph.edges_of(states[-1])
        if not edges:
            stay = _stay(solution, states[-1])
            return (*states, *states[-1:] * len(stay)), (*choices, *stay)
        edge = max(edges, key=lambda e: (float(graph.probability[e]), -e))
        states.append(int(graph.target[edge]))
        choices.append(int(graph.choice[edge]))
    return tuple(states), tuple(choices)


def _most_probable(graph: PolicyGraph, start: int, goals: Bools) -> tuple[tuple[int, ...], tuple[int, ...], float]:
    """Return states, choices and probability of the most probable path from `start` to one of `goals`."""
    length, distance = graph.length, graph.distances(goals)
    states, choices, total = [start], [], 0.0
    while not goals[states[-1]]:
        edge = _next_edge(graph, length, distance, states)
        states.append(int(graph.target[edge]))
        choices.append(int(graph.choice[edge]))
        total += float(length[edge])
    return tuple(states), tuple(choices), math.exp(-total)


def _next_edge(graph: PolicyGraph, length: Floats, distance: Floats, states: list[int]) -> int:
    """Return the first edge that keeps to the shortest length and comes nearer.

    Where lengths vanish in rounding none may come nearer; then the first that keeps to it and was not visited is taken.
    """
    here = states[-1]
    edges = graph.edges_of(here)
    total = {e: float(length[e] + distance[graph.target[e]]) for e in edges}
    keeping = [e for e in edges if total[e] <= distance[here] + TIE]
    nearer = (e for e in keeping if distance[graph.target[e]] < distance[here] or len(edges) == 1)
    for edge in nearer:
        return edge
    visited = set(states)
    fresh = [e for e in edges if int(graph.target[e]) not in visited]
    return next((e for e in keeping if e in fresh), min(fresh or edges, key=total.__getitem__))


def _distances(graph: PolicyGraph, goals: Bools) -> Floats:
    """Return the least total length from each state to one of `goals`, ``[S]``."""
    if len(graph.target) > MANY and is_compiled(len(graph.target)):
        count = len(graph.target)
        first, edge = compiled(sorted_by, count)(graph.target, np.arange(count), graph.states)
        return compiled(shortest_to, count)(graph.origin, graph.length, Rows(first, edge.astype(np.int64)), goals)
    inside = np.flatnonzero(~goals[graph.origin])
    if len(inside) > SMALL:
        return _distances_by_library(graph, goals, inside)
    order = inside[np.argsort(graph.target[inside], kind="stable")]
    into_state = np.searchsorted(graph.target[order], np.arange(graph.states + 1))
    distance = np.full(graph.states, np.inf)
    sources = np.flatnonzero(goals)
    distance[sources] = 0.0
    queue = [(0.0, int(s)) for s in sources]
    done = np.zeros(graph.states, dtype=bool)
    while queue:
        so_far, state = heapq.heappop(queue)
        if done[state]:
            continue
        done[state] = True
        for edge in order[into_state[state] : into_state[state + 1]]:
            origin, candidate = int(graph.origin[edge]), so_far + float(graph.length[edge])
            if candidate < distance[origin]:
                distance[origin] = candidate
                heapq.heappush(queue, (candidate, origin))
    return distance


def _distances_by_library(graph: PolicyGraph, goals: Bools, inside: Array) -> Floats:
    """Do the same with the algorithm that scipy has compiled: where nothing of ours may be.

    A length of exactly 0 would vanish from a sparse matrix, and of parallel edges the matrix keeps the sum: so lengths are
    taken up by the smallest number that cannot matter, and only the shortest of parallel edges is kept.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    origin, target = graph.origin[inside], graph.target[inside]
    lengths = np.maximum(graph.length[inside], 1e-300)
    order = np.lexsort((lengths, origin, target))
    origin, target, lengths = origin[order], target[order], lengths[order]
    keep = np.ones(len(order), dtype=bool)
    keep[1:] = (origin[1:] != origin[:-1]) | (target[1:] != target[:-1])
    backwards = csr_array((lengths[keep], (target[keep], origin[keep])), shape=(graph.states, graph.states))
    distance: Floats = dijkstra(backwards, directed=True, indices=np.flatnonzero(goals), min_only=True)
    return distance

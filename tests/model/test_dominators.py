"""The dominator tree against its definition: what a root no longer reaches when a state is taken out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from ratherthan.model.dominators import Graph, dominator_tree, graph_of, opposite
from ratherthan.model.index import build_index

pytestmark = pytest.mark.kernels


def reached(graph: Graph, root: int, without: int = -1) -> set[int]:
    """Return what `root` reaches when `without` is taken out."""
    seen: set[int] = set()
    todo = [root] if root != without else []
    while todo:
        state = todo.pop()
        if state not in seen:
            seen.add(state)
            first, last = graph.leaving_from[state], graph.leaving_from[state + 1]
            todo += [int(t) for t in graph.leaving[first:last] if t != without]
    return seen


def random_graphs(count: int) -> Iterator[Graph]:
    """Yield small graphs: loops, edges that stand twice, states that lead nowhere and leaves."""
    rng = np.random.default_rng(7)
    for _ in range(count):
        states, edges = int(rng.integers(1, 12)), int(rng.integers(1, 30))
        origin = np.sort(rng.integers(0, states, edges))
        rows = np.concatenate([[0], np.cumsum(np.bincount(origin, minlength=states))])
        index = build_index(rows, np.arange(edges + 1), rng.integers(0, states, edges))
        yield graph_of(index, rng.random(states) < 0.15)


def test_a_subtree_is_what_the_root_loses_with_the_state() -> None:
    for graph in random_graphs(150):
        for root in range(len(graph.leaving_from) - 1):
            tree = dominator_tree(graph, root)
            everything = reached(graph, root)
            assert {int(s) for s in tree.order} == everything
            for state in everything:
                first = tree.position[state]
                subtree = {int(s) for s in tree.order[first : first + tree.size[state]]}
                assert subtree == everything - reached(graph, root, state)


def test_the_opposite_graph_has_the_edges_turned_round() -> None:
    for graph in random_graphs(30):
        states = range(len(graph.leaving_from) - 1)
        back = opposite(graph)
        there = sorted(
            (s, int(t)) for s in states for t in graph.leaving[graph.leaving_from[s] : graph.leaving_from[s + 1]]
        )
        back_again = sorted(
            (int(t), s) for s in states for t in back.leaving[back.leaving_from[s] : back.leaving_from[s + 1]]
        )
        assert there == back_again


def test_sums_over_a_subtree_are_differences_of_prefix_sums() -> None:
    for graph in random_graphs(30):
        weight = np.arange(1, len(graph.leaving_from)) ** 2
        tree = dominator_tree(graph, 0)
        sums = tree.prefix(weight)
        for state in map(int, tree.order):
            first, last = tree.position[state], tree.position[state] + tree.size[state]
            assert sums[last] - sums[first] == sum(int(weight[s]) for s in tree.order[first:last])


def test_a_long_path_needs_no_recursion() -> None:
    states = 20_000
    index = build_index(np.minimum(np.arange(states + 1), states - 1), np.arange(states), np.arange(1, states))
    tree = dominator_tree(graph_of(index, np.zeros(states, dtype=np.bool_)), 0)
    assert (tree.size == np.arange(states, 0, -1)).all()

"""The graph kernels against twins that anybody can check, compiled and not."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from random_models import random_problem

from ratherthan.model import graph
from ratherthan.model.index import Index, branches_of, build_index, index_of
from ratherthan.model.mdp import MDP

Sets = list[list[set[int]]]


@pytest.fixture(params=["auto", pytest.param("always", marks=pytest.mark.kernels)], autouse=True)
def compiler(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RATHERTHAN_COMPILE", request.param)


def drawn(seed: int) -> tuple[MDP, Index, Sets, set[int], set[int]]:
    """Return a random model, its successors by state and choice, a goal and the states a run may pass through."""
    random = Random(seed)
    mdp = random_problem(random, most_states=9).mdp
    after = [
        [{int(t) for t in mdp.branch_to_target[mdp.branches_of(c)]} for c in mdp.choices_of(s)]
        for s in range(mdp.states)
    ]
    goal = {s for s in range(mdp.states) if random.random() < 0.3}
    through = {s for s in range(mdp.states) if random.random() < 0.8}
    return mdp, index_of(mdp), after, goal, through


def mask(states: set[int], count: int) -> np.ndarray:
    marked = np.zeros(count, dtype=bool)
    marked[list(states)] = True
    return marked


def members(marked: np.ndarray) -> set[int]:
    return {int(s) for s in np.flatnonzero(marked)}


def grow(states: set[int], step) -> set[int]:
    while not step(states) <= states:
        states = states | step(states)
    return states


def can_reach(after: Sets, goal: set[int], inside: set[int]) -> set[int]:
    return grow(goal, lambda reached: {s for s in inside if any(row & reached for row in after[s])})


def surely_reach(after: Sets, goal: set[int], inside: set[int]) -> set[int]:
    kept = goal | inside
    while True:
        reached = grow(
            goal,
            lambda r, kept=kept: {
                s for s in (inside & kept) - goal if any(row <= kept and row & r for row in after[s])
            },
        )
        if reached == kept:
            return kept
        kept = reached


def can_avoid(after: Sets, goal: set[int], inside: set[int]) -> set[int]:
    caught = grow(goal, lambda c: {s for s in inside - goal if all(row & c for row in after[s])})
    return set(range(len(after))) - caught


@pytest.mark.parametrize("seed", range(150))
def test_reachability_is_that_of_the_twins(seed: int) -> None:
    mdp, index, after, goal, through = drawn(seed)
    g, i = mask(goal, mdp.states), mask(through, mdp.states)
    assert members(graph.can_reach(index, g, i)) == can_reach(after, goal, through)
    assert members(graph.surely_reach(index, g, i)) == surely_reach(after, goal, through)
    assert members(graph.can_avoid(index, g, i)) == can_avoid(after, goal, through)
    missed = can_reach(after, can_avoid(after, goal, through), through - goal)
    assert members(graph.cannot_miss(index, g, i)) == set(range(mdp.states)) - missed


@pytest.mark.parametrize("seed", range(100))
def test_forbidden_choices_are_not_used(seed: int) -> None:
    mdp, index, after, goal, through = drawn(seed)
    allowed = np.array([Random(seed + c).random() < 0.6 for c in range(mdp.choices)])
    fewer = [[row for c, row in zip(mdp.choices_of(s), after[s], strict=True) if allowed[c]] for s in range(mdp.states)]
    g, i = mask(goal, mdp.states), mask(through, mdp.states)
    assert members(graph.can_reach(index, g, i, allowed)) == can_reach(fewer, goal, through)
    assert members(graph.surely_reach(index, g, i, allowed)) == surely_reach(fewer, goal, through)
    assert allowed.sum() == sum(len(rows) for rows in fewer), "the caller's array is left alone"


@pytest.mark.parametrize("seed", range(100))
def test_levels_are_distances(seed: int) -> None:
    mdp, index, after, goal, through = drawn(seed)
    level = graph.levels_to(index, mask(goal, mdp.states), mask(through, mdp.states))
    near = set(goal)
    for distance in range(mdp.states + 1):
        assert members(level == distance) == near - members((level >= 0) & (level < distance))
        near = near | {s for s in through if any(row & near for row in after[s])}
    every = np.ones(mdp.choices, dtype=bool)
    down = graph.first_downhill(index, level, every)
    for s in range(mdp.states):
        lower = [
            c for c, row in zip(mdp.choices_of(s), after[s], strict=True) if any(0 <= level[t] < level[s] for t in row)
        ]
        assert down[s] == (lower[0] if lower else -1)


@pytest.mark.parametrize("seed", range(100))
def test_what_is_reached_is_found_forwards_too(seed: int) -> None:
    mdp, index, after, goal, _ = drawn(seed)
    found = graph.reached_from(index, mask({0}, mdp.states), mask(goal, mdp.states))
    expected = grow({0}, lambda seen: {t for s in seen - goal for row in after[s] for t in row} | {0})
    assert members(found) == expected


def reachable(edges: dict[int, set[int]], state: int) -> set[int]:
    return grow({state}, lambda seen: set().union(*(edges.get(s, set()) for s in seen)))


def end_components(after: list[list[tuple[int, set[int]]]], states: set[int]) -> list[tuple[frozenset[int], set[int]]]:
    """Return the maximal end components by refinement from the definition: (states, choices)."""
    rows = {s: [(c, row) for c, row in after[s] if row <= states] for s in states}
    while True:
        edges = {s: set().union(*[row for _, row in own]) if own else set() for s, own in rows.items()}
        within = {s: {t for t in reachable(edges, s) if s in reachable(edges, t)} for s in rows}
        kept = {s: [(c, row) for c, row in own if row <= within[s]] for s, own in rows.items()}
        kept = {s: own for s, own in kept.items() if own}
        kept = {s: [(c, row) for c, row in own if row <= set(kept)] for s, own in kept.items()}
        kept = {s: own for s, own in kept.items() if own}
        if kept == rows:
            break
        rows = kept
    groups = {frozenset(within[s]) for s in rows}
    return [(group, {c for s in group for c, _ in rows[s]}) for group in groups]


@pytest.mark.parametrize("seed", range(150))
def test_end_components_are_the_maximal_ones(seed: int) -> None:
    mdp, index, after, _, through = drawn(seed)
    allowed = np.array([Random(seed + c).random() < 0.8 for c in range(mdp.choices)])
    rows = [
        [(c, row) for c, row in zip(mdp.choices_of(s), after[s], strict=True) if allowed[c]] for s in range(mdp.states)
    ]
    component, internal = graph.end_components(index, mask(through, mdp.states), allowed)
    found = {
        (frozenset(members(component == k)), frozenset(members(internal & (component[index.choice_to_state] == k))))
        for k in set(component.tolist()) - {-1}
    }
    assert found == {(group, frozenset(choices)) for group, choices in end_components(rows, through)}


@pytest.mark.parametrize("seed", range(100))
def test_what_is_found_on_the_way_to_sure_states_is_right(seed: int) -> None:
    mdp, index, after, goal, through = drawn(seed)
    allowed = np.array([Random(seed + c).random() < 0.8 for c in range(mdp.choices)])
    fewer = [[row for c, row in zip(mdp.choices_of(s), after[s], strict=True) if allowed[c]] for s in range(mdp.states)]
    g, i = mask(goal, mdp.states), mask(through, mdp.states)
    found = graph.surely_reaching(index, g, i, allowed)
    sure = surely_reach(fewer, goal, through)
    assert members(found.states) == sure
    assert members(found.possible) == can_reach(fewer, goal, through)
    staying = {
        c for s in sure - goal for c, row in zip(mdp.choices_of(s), after[s], strict=True) if allowed[c] and row <= sure
    }
    assert members(found.usable) == staying
    assert {int(s) for s in found.order} == sure
    level = graph.levels_to(index, g, i & found.states, found.usable)
    assert (found.level[found.states] == level[found.states]).all()
    assert (np.diff(found.level[found.order]) >= 0).all()
    assert (found.level[~found.states] < 0).all()


@pytest.mark.parametrize("seed", range(100))
def test_the_way_back_is_the_first_choice_to_a_lower_level(seed: int) -> None:
    mdp, index, _, goal, through = drawn(seed)
    g, i = mask(goal, mdp.states), mask(through, mdp.states)
    level = graph.levels_to(index, g, i)
    down = graph.first_downhill(index, level, np.ones(mdp.choices, dtype=bool))
    found = graph.way_back(index, g, i)
    assert (found == np.where(i & ~g, down, -1)).all()


def test_many_small_components_that_fall_apart_one_after_the_other_are_looked_at_once_each() -> None:
    """Pairs of states of which each has a choice into the pair before; the first pair falls, and no other can stay by that choice."""
    pairs = 3000
    begin, rows, targets = [0], [0], []
    for k in range(pairs):
        one, other = 2 * k, 2 * k + 1
        for own in ([[other], [max(one - 2, 0), other]], [[one]] if k else [[one, 2 * pairs]]):
            for row in own:
                targets += row
                rows.append(len(targets))
            begin.append(len(rows) - 1)
    targets.append(2 * pairs)
    rows.append(len(targets))
    begin.append(len(rows) - 1)
    index = build_index(np.array(begin), np.array(rows), np.array(targets))
    inside = np.arange(index.states) < 2 * pairs
    component, internal = graph.end_components(index, inside, np.ones(index.choices, dtype=bool))
    assert (component[:2] == -1).all()
    assert len(set(component[2:-1].tolist())) == pairs - 1
    assert internal.sum() == 2 * (pairs - 1)


@pytest.mark.parametrize("seed", range(30))
def test_end_components_of_larger_models_are_closed_connected_and_maximal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    states = 60
    choices, branches = rng.integers(1, 4, states), rng.integers(1, 4, 300)
    begin = np.concatenate([[0], np.cumsum(choices)])
    rows = np.concatenate([[0], np.cumsum(branches[: begin[-1]])])
    near = np.repeat(np.repeat(np.arange(states), choices), branches[: begin[-1]])
    target = (near + rng.integers(-2, 3, len(near))) % states  # neighbours: components of many sizes
    index = build_index(begin, rows, target)
    allowed, inside = rng.random(index.choices) < 0.7, rng.random(states) < 0.9
    component, internal = graph.end_components(index, inside, allowed)
    pairs = [
        [(c, {int(t) for t in target[rows[c] : rows[c + 1]]}) for c in range(begin[s], begin[s + 1]) if allowed[c]]
        for s in range(states)
    ]
    found = {
        (frozenset(members(component == k)), frozenset(members(internal & (component[index.choice_to_state] == k))))
        for k in set(component.tolist()) - {-1}
    }
    assert found == {(own, frozenset(rows_)) for own, rows_ in end_components(pairs, members(inside))}


def test_a_long_chain_is_no_deep_recursion() -> None:
    states = 5000
    target = np.append(np.arange(1, states), 0)
    index = build_index(np.arange(states + 1), np.arange(states + 1), target)
    inside = np.ones(states, dtype=bool)
    component, internal = graph.end_components(index, inside, inside)
    assert len(set(component.tolist())) == 1
    assert internal.all()
    assert graph.levels_to(index, mask({0}, states), inside).max() == states - 1


def test_entering_choices_are_listed_by_state() -> None:
    mdp, index, *_ = drawn(3)
    for s in range(mdp.states):
        entering = index.entering[index.entering_from[s] : index.entering_from[s + 1]].tolist()
        assert entering == sorted(entering)
        assert set(entering) == {
            c for c in range(mdp.choices) if s in set(mdp.branch_to_target[mdp.branches_of(c)].tolist())
        }
    assert index_of(mdp) is index, "built once"
    before = index.entering.copy()
    index.forget()
    assert (index.entering == before).all(), "and made again where it was forgotten"


def test_branches_of_chosen_rows_keep_their_order() -> None:
    branches, offsets = branches_of(np.array([0, 2, 3, 6]), np.array([2, 0]))
    assert branches.tolist() == [3, 4, 5, 0, 1]
    assert offsets.tolist() == [0, 3, 5]

"""Every method that counts decisions, against a search over sets of states that anybody can read."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest

from benchmarks import flexibility, models
from ratherthan.errors import LimitError
from ratherthan.factors.constrictiveness import Search, constrictiveness, count_decisions, nearer_goal
from ratherthan.factors.counting import closure, plan
from ratherthan.factors.counting.closure import split, weigh_roots
from ratherthan.factors.counting.effort import Effort
from ratherthan.factors.counting.ground import Ground, ground_of, restricted
from ratherthan.factors.counting.pieces import sums_of, weigh_pieces
from ratherthan.factors.counting.plan import count_all, count_near
from ratherthan.factors.counting.sketches import estimated
from ratherthan.factors.counting.together import Together
from ratherthan.factors.landmarks import LANDMARKS, Weigher, landmark_at, next_root
from ratherthan.factors.selectiveness import Criticality
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.watch import Limits, watching

pytestmark = pytest.mark.kernels

MODELS = int(os.environ.get("RATHERTHAN_MODELS", "400"))
EVERYWHERE = np.zeros(0), np.zeros(0)
SHAPES = ("anything", "chain", "both ways", "tree", "downhill", "few ways")


class Case(NamedTuple):
    """A graph with weights: half of them may count, some of these for sure; a state where it ended may weigh something, too."""

    mdp: MDP
    ended: Bools
    certain: np.ndarray
    possible: np.ndarray
    rng: np.random.Generator

    @property
    def ground(self) -> Ground:
        return restricted(self.mdp, self.ended, *EVERYWHERE)

    @property
    def weights(self) -> tuple[np.ndarray, np.ndarray]:
        return self.certain, self.possible

    @property
    def choices(self) -> np.ndarray:
        return np.arange(self.mdp.choices)


def model_of(edges: list[list[list[int]]]) -> MDP:
    """Return a model from the targets of every choice of every state."""
    rows = [targets for choices in edges for targets in choices]
    widths = [len(targets) for targets in rows]
    return MDP(
        state_to_choices=np.concatenate([[0], np.cumsum([len(choices) for choices in edges])]),
        choice_to_branches=np.concatenate([[0], np.cumsum(widths)]),
        branch_to_target=np.array([t for targets in rows for t in targets]),
        branch_to_probability=np.repeat(1.0 / np.array(widths), widths),
        initial=np.array([0]),
    )


def edges_of(shape: str, states: int, rng: np.random.Generator) -> list[list[list[int]]]:
    """Return the targets of every choice of every state, of a graph of some shape."""
    if shape in ("both ways", "tree"):
        near: list[set[int]] = [set() for _ in range(states)]
        pairs = [(s, int(rng.integers(0, s))) for s in range(1, states) if rng.random() < 0.9]
        if shape == "both ways":
            pairs += [
                (int(rng.integers(states)), int(rng.integers(states))) for _ in range(int(rng.integers(0, states)))
            ]
        for s, t in pairs:
            near[s].add(t)
            near[t].add(s)
        return [
            [[t, *rng.choice([s, *near[s]], size=int(rng.integers(0, 3))).tolist()] for t in sorted(near[s])]
            or [[s], [s]]
            for s in range(states)
        ]
    edges = []
    for s in range(states):
        low, high = {"chain": (max(0, s - 1), min(states, s + 3)), "downhill": (0, s + 1)}.get(shape, (0, states))
        ways = 1 if shape == "few ways" and rng.random() < 0.6 else int(rng.integers(1, 4))
        edges.append([rng.integers(low, high, size=int(rng.integers(1, 4))).tolist() for _ in range(ways)])
    return edges


def cases(
    count: int = MODELS, *, shapes: tuple[str, ...] = SHAPES, most: int = 13, seed: int = 5, large: bool = True
) -> Iterator[Case]:
    rng = np.random.default_rng(seed)
    for number in range(count):
        states = int(rng.integers(1, most))
        mdp = model_of(edges_of(shapes[number % len(shapes)], states, rng))
        ended = rng.random(states) < rng.choice([0.0, 0.2])
        possible = np.where(rng.random(states) < 0.7, rng.integers(0, 5, states), 0)
        if rng.random() < 0.6:
            possible[ended] = 0
        if number % 10 == 9 and large:
            possible *= 10**12
        yield Case(mdp, ended, np.where(rng.random(states) < 0.7, possible, 0), possible, rng)


def tree_of(case: Case, choice: int, horizon: int | None = None, follow: np.ndarray | None = None) -> set[int]:
    """Return T(s,a) as the definition says it."""
    mdp, root = case.mdp, case.mdp.state_of(choice)
    layer = set(mdp.branch_to_target[mdp.branches_of(choice)].tolist()) - {root}
    found, steps = set(layer), 0
    while layer and (horizon is None or steps < horizon):
        layer = (
            {
                t
                for u in layer
                if not case.ended[u]
                for c in mdp.choices_of(u)
                for t in mdp.branch_to_target[mdp.branches_of(c)].tolist()
                if follow is None or follow[u, t]
            }
            - found
            - {root}
        )
        found |= layer
        steps += 1
    return found


def wanted(case: Case, choices: np.ndarray | None = None, horizon: int | None = None) -> tuple[list[int], list[int]]:
    trees = [sorted(tree_of(case, int(c), horizon)) for c in (case.choices if choices is None else choices)]
    return tuple([int(weight[tree].sum()) for tree in trees] for weight in case.weights)  # type: ignore[return-value]


def test_followed_edges_are_those_of_the_definition() -> None:
    for case in cases():
        ground = case.ground
        for s in range(case.mdp.states):
            targets = {
                t
                for c in case.mdp.choices_of(s)
                for t in case.mdp.branch_to_target[case.mdp.branches_of(c)].tolist()
                if t != s and not case.ended[s]
            }
            found = ground.leaving[ground.leaving_from[s] : ground.leaving_from[s + 1]].tolist()
            assert len(found) == len(set(found))
            assert set(found) == targets


def test_pieces_weigh_what_searches_weigh() -> None:
    tried = 0
    for case in cases(shapes=("both ways", "tree", "both ways", "anything", "few ways")):
        ground = case.ground
        dead = np.diff(ground.leaving_from) == 0
        edges = {(s, int(t)) for s in range(len(dead)) for t in ground.leaving[slice(*ground.leaving_from[s : s + 2])]}
        symmetric = all((t, s) in edges for s, t in edges if not dead[t])
        assert (ground.pieces is not None) == symmetric
        if ground.pieces is not None:
            case.certain[ground.pieces.ends] = case.possible[ground.pieces.ends] = 0
            asked = case.rng.permutation(case.choices)
            rows = ground.rows[1], ground.rows[2]
            found = weigh_pieces(
                ground.pieces, rows, (asked, ground.states_of(asked)), sums_of(ground.pieces, case.weights), 0
            )
            assert (found[0].tolist(), found[1].tolist()) == wanted(case, asked)
            tried += 1
    assert tried > MODELS // 3


@pytest.mark.parametrize("visits", [0, 5, None])
def test_landmarks_weigh_what_searches_weigh(visits: int | None) -> None:
    for case in cases():
        ground, rng = case.ground, case.rng
        roots = rng.integers(0, case.mdp.states, size=int(rng.integers(0, LANDMARKS + 1))).tolist()
        weigher = Weigher(ground, [landmark_at(ground, root) for root in roots], case.weights)
        asked = rng.permutation(case.choices)
        states, found, at = ground.states_of(asked), ([], []), 0
        while at < len(asked):
            lower, upper, spent = weigher.weigh(asked[at:], states[at:], visits)
            assert len(lower) >= 1
            assert spent >= len(lower)
            found[0].extend(lower.tolist())
            found[1].extend(upper.tolist())
            at += len(lower)
        assert found == wanted(case, asked)


def test_the_closure_weighs_what_searches_weigh() -> None:
    split_at_all = 0
    for case in cases():
        ground = case.ground
        parts = split(ground, case.choices, ground.states_of(case.choices), case.weights)
        lower, upper = weigh_roots(ground, parts, case.weights)
        expected = wanted(case)
        for choice in np.flatnonzero(parts.done).tolist():
            assert (lower[choice], upper[choice]) == (expected[0][choice], expected[1][choice])
        split_at_all += int(parts.done.sum())
        assert parts.done.all(), "small models are split at every choice"
    assert split_at_all


def test_the_closure_goes_on_from_block_to_block_and_counts_weights_of_many_sizes() -> None:
    rng = np.random.default_rng(8)
    for most in (3, 10**6):
        for shape in ("downhill", "few ways"):
            states = 700
            edges = (
                [[rng.integers(max(0, s - 40), s + 1, size=2).tolist() for _ in range(2)] for s in range(states)]
                if shape == "downhill"
                else edges_of(shape, states, rng)
            )
            possible = rng.integers(0, most, states)
            certain = np.where(rng.random(states) < 0.5, possible, possible // 2)
            case = Case(model_of(edges), rng.random(states) < 0.02, certain, possible, rng)
            ground = case.ground
            asked = rng.permutation(case.choices)[:60]
            parts = split(ground, asked, ground.states_of(asked), case.weights)
            lower, upper = weigh_roots(ground, parts, case.weights)
            expected = wanted(case, asked)
            assert parts.done.any()
            for i in np.flatnonzero(parts.done).tolist():
                assert (lower[i], upper[i]) == (expected[0][i], expected[1][i])


def test_searches_together_weigh_what_searches_weigh() -> None:
    for case in cases(MODELS // 4, most=25):
        ground = case.ground
        weights = case.weights if case.rng.random() < 0.5 else (case.possible, case.possible)
        searcher = Together(ground, weights)
        for _ in range(2):  # the room is clear afterwards
            asked = case.rng.permutation(case.choices)
            lower, upper, spent = searcher.weigh(asked, ground.states_of(asked))
            assert (lower.tolist(), upper.tolist()) == wanted(case._replace(certain=weights[0]), asked)
            assert spent >= len(asked)


FAMILIES = {
    "slippery map": lambda: models.slippery_map(18).mdp,
    "one-way city": lambda: models.one_way_city(18).mdp,
    "maze": lambda: models.maze(18).mdp,
    "perfect maze": lambda: models.maze(18, links=0.0).mdp,
    "expander": lambda: models.expander(150).mdp,
    "river": lambda: flexibility.river(300, reach=20),
}


@pytest.mark.parametrize("family", FAMILIES)
def test_all_methods_agree_on_maps_cities_mazes_and_rivers(family: str) -> None:
    mdp, rng = FAMILIES[family](), np.random.default_rng(6)
    ended = mdp.labels["goal"]
    possible = np.diff(mdp.state_to_choices) * (rng.random(mdp.states) < 0.5) * ~ended
    case = Case(mdp, ended, possible * (rng.random(mdp.states) < 0.8), possible, rng)
    ground, asked = case.ground, rng.permutation(case.choices)[:150]
    states, expected = ground.states_of(asked), wanted(case, asked)

    def agrees(lower: np.ndarray, upper: np.ndarray) -> bool:
        return (lower.tolist(), upper.tolist()) == expected

    symmetric = family in ("slippery map", "maze", "perfect maze")
    assert (ground.pieces is not None) == symmetric
    if ground.pieces is not None:
        reached = ground.pieces.ends
        assert not possible[reached].any()
        rows = ground.rows[1], ground.rows[2]
        assert agrees(*weigh_pieces(ground.pieces, rows, (asked, states), sums_of(ground.pieces, case.weights), 0))
    root = next_root(ground, [], states)
    assert (root is None) == (family == "river")
    for landmarks in [[]] if root is None else [[], [landmark_at(ground, root)]]:
        weigher, at, weighed = Weigher(ground, landmarks, case.weights), 0, ([], [])
        while at < len(asked):
            lower, upper, _ = weigher.weigh(asked[at:], states[at:])
            weighed[0].extend(lower.tolist())
            weighed[1].extend(upper.tolist())
            at += len(lower)
        assert weighed == expected
    assert agrees(*Together(ground, case.weights).weigh(asked, states)[:2])
    parts = split(ground, asked, states, case.weights)
    lower, upper = weigh_roots(ground, parts, case.weights)
    assert all((lower[i], upper[i]) == (expected[0][i], expected[1][i]) for i in np.flatnonzero(parts.done))
    assert parts.done.all() or family != "river"
    found = count_all(ground, asked, case.weights, Effort())
    assert agrees(found.lower, found.upper)


@pytest.mark.parametrize("horizon", [0, 1, 2, 5])
def test_near_weights_are_those_of_the_definition(horizon: int) -> None:
    for case in cases(MODELS // 2):
        found = count_near(case.ground, case.choices, case.weights, Effort(), horizon)
        assert found.counted.all()
        assert (found.lower.tolist(), found.upper.tolist()) == wanted(case, horizon=horizon)


def test_any_plan_counts_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "LONG", 0)
    monkeypatch.setattr(plan, "FEW", 2)
    for most in ((0, 0), (3, 2), (64, 64)):
        monkeypatch.setattr(closure, "MOST", most)
        for joins in (1, 10**9):
            monkeypatch.setattr(closure, "JOINS_PER_VISIT", joins)
            for case in cases(MODELS // 4, seed=joins % 97 + most[0]):
                found = count_all(case.ground, case.rng.permutation(case.choices), case.weights, Effort())
                assert found.counted.all()
                assert (found.lower.tolist(), found.upper.tolist()) == wanted(case, found.choices)


@pytest.mark.parametrize("horizon", [None, 2])
def test_with_little_work_some_are_counted_and_none_is_wrong(horizon: int | None) -> None:
    some = 0
    for case in cases(MODELS // 2, shapes=("anything", "chain", "downhill", "few ways"), most=30, large=False):
        expected = wanted(case, horizon=horizon)
        for visits in (0, 1, 10, 10**6):
            effort, ground = Effort(visits=visits, estimate=horizon is None and visits == 10), case.ground
            args = ground, case.choices, case.weights, effort
            found = count_all(*args) if horizon is None else count_near(*args, horizon)
            for i in range(len(case.choices)):
                assert found.lower[i] <= expected[0][i] <= expected[1][i] <= found.upper[i]
                if found.counted[i]:
                    assert (found.lower[i], found.upper[i]) == (expected[0][i], expected[1][i])
                assert not (found.counted[i] and found.estimated[i])
                if found.estimated[i]:
                    assert (found.estimate[i], found.error[i]) == (expected[0][i], 0.0), "small sets are in the sketch"
            assert visits > 0 or not found.counted.any()
            assert visits < 10**6 or found.counted.all()
            some += bool(found.counted.any() and not found.counted.all())
    assert some > 10


def test_estimates_miss_by_their_standard_error() -> None:
    rng = np.random.default_rng(4)
    states, kept = 200, 11
    edges = [[rng.integers(max(0, s - 30), s + 1, size=2).tolist()] for s in range(states)]
    weight = rng.integers(1, 4, states)
    case = Case(model_of(edges), np.zeros(states, dtype=np.bool_), weight, weight, rng)
    ground, asked = case.ground, np.array([40, 60, 80])
    parts = split(ground, asked, ground.states_of(asked), case.weights)
    truth = np.array(wanted(case, asked)[0])
    draws = np.array([estimated(ground, parts, weight, kept=kept, seed=seed) for seed in range(150)])
    theory = 1 / np.sqrt(kept - 2)
    assert np.allclose(draws[:, 1], theory)
    ratio = draws[:, 0] / truth
    assert np.abs(ratio.mean(axis=0) - 1).max() < 0.1, "no bias"
    assert ratio.std(axis=0).max() < 1.1 * theory
    assert ratio[:, 1:].std(axis=0).min() > 0.6 * theory, "sets of hardly more than are kept are known better"


def test_a_search_toward_the_goal_is_counted_alike_by_searches_and_by_the_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "LONG", 0)
    for case in cases(MODELS // 2, most=12):
        values = case.rng.integers(0, 6, case.mdp.states).astype(float)
        values[case.rng.random(case.mdp.states) < 0.1] = np.inf
        spread = np.where(case.rng.random(case.mdp.states) < 0.3, 1.0, 0.0)
        nearer = nearer_goal(values - spread, values + spread, maximise=False)
        critical = Criticality(certain=case.certain > 0, possible=case.possible > 0)
        size = np.diff(case.mdp.state_to_choices)
        horizon = [None, 0, 2][int(case.rng.integers(3))]
        search = Search(toward_goal=True, horizon=horizon)
        asked = case.choices, case.ended, critical
        few = count_decisions(case.mdp, critical, case.ended, case.choices, search=search, nearer=nearer)
        many = count_decisions(
            case.mdp, critical, case.ended, case.choices, search=search, nearer=nearer, effort=Effort(visits=10**9)
        )
        assert many.counted.all()
        hasty = count_decisions(
            case.mdp, critical, case.ended, case.choices, search=search, nearer=nearer,
            effort=Effort(visits=12, estimate=True),
        )  # fmt: skip
        assert (hasty.lower <= many.lower).all()
        assert (many.upper <= hasty.upper).all()
        assert (hasty.lower == many.lower)[hasty.counted].all()
        assert (hasty.upper == many.upper)[hasty.counted].all()
        assert (hasty.estimate == many.lower)[hasty.estimated].all(), "small sets are known exactly"
        for i, choice in enumerate(asked[0].tolist()):
            trees = [
                sorted(tree_of(case, choice, horizon, follow.target[None, :] < follow.origin[:, None]))
                for follow in nearer
            ]
            expected = (
                int(size[trees[0]][critical.certain[trees[0]]].sum()),
                int(size[trees[1]][critical.possible[trees[1]]].sum()),
            )
            assert (few.lower[i], few.upper[i]) == (many.lower[i], many.upper[i]) == expected


def test_what_was_found_of_a_model_is_kept_for_the_same_ends_only() -> None:
    for case in cases(20, shapes=("anything",)):
        first = ground_of(case.mdp, case.ended)
        assert ground_of(case.mdp, case.ended.copy()) is first
        other = ~case.ended
        assert ground_of(case.mdp, other) is not first
        critical = Criticality(certain=case.certain > 0, possible=case.possible > 0)
        for ended in (case.ended, other):
            kept = constrictiveness(case.mdp, critical, ended, case.choices)
            assert kept == constrictiveness(case.mdp, critical, ended, case.choices)


def test_the_counts_do_not_depend_on_how_they_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = sys.modules["ratherthan.factors.constrictiveness"]  # the function has the module's name
    for case in cases(MODELS // 4, large=False):
        critical = Criticality(certain=case.certain > 0, possible=case.possible > 0)
        asked = [int(choice) for choice in case.rng.permutation(case.choices)]
        searched = constrictiveness(case.mdp, critical, case.ended, asked)
        with monkeypatch.context() as forced:
            forced.setattr(counted, "FEW", 0)
            forced.setattr(counted, "LITTLE", 0)
            for _ in range(2):
                assert constrictiveness(case.mdp, critical, case.ended, asked) == searched
            fewer = Criticality(certain=critical.certain & (np.arange(case.mdp.states) > 2), possible=critical.possible)
            again = constrictiveness(case.mdp, fewer, case.ended, asked)
            assert {c: found.upper for c, found in again.items()} == {c: found.upper for c, found in searched.items()}
            assert constrictiveness(case.mdp, critical, case.ended, asked) == searched


def test_landmarks_lie_in_large_components_and_apart() -> None:
    rng = np.random.default_rng(2)
    ring = [[[(s + 1) % 60]] for s in range(60)] + [[[60 + (s + 1) % 40]] for s in range(40)]
    mdp = model_of([[*choices, [min(s + 60, 99)]] if s < 60 else choices for s, choices in enumerate(ring)])
    ground = restricted(mdp, np.zeros(100, dtype=np.bool_), *EVERYWHERE)
    states = rng.integers(0, 100, 30)
    first = next_root(ground, [], states)
    assert first is not None
    second = next_root(ground, [landmark_at(ground, first)], states)
    assert second is not None
    assert (first < 60) != (second < 60) or first < 60
    assert ground.components.component[first] != ground.components.component[second]
    line = restricted(model_of([[[max(s - 1, 0)]] for s in range(300)]), np.zeros(300, dtype=np.bool_), *EVERYWHERE)
    assert next_root(line, [], states) is None, "no component is large"


def test_a_limit_of_time_is_heeded_while_counting() -> None:
    case = next(iter(cases(1, shapes=("anything",), most=12)))
    with pytest.raises(LimitError), watching(Limits(seconds=1e-9)):
        count_all(case.ground, case.choices, case.weights, Effort())
    with pytest.raises(LimitError), watching(Limits(seconds=1e-9)):
        constrictiveness(case.mdp, Criticality(certain=case.certain > 0, possible=case.possible > 0), case.ended, [0])

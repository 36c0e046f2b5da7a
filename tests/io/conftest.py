"""Random models of every shape, and what it means that two of them are equal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.objective import ExpectedCost, ReachAvoid, Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.world import World

WORDS = ("go", "stay", "pick up", "Ost/West", "ü", "a b", "x" * 200, "")


def _names(rng: np.random.Generator, states: int) -> StateNames:
    kind = rng.integers(3)
    if kind == 0:
        return StateNames(count=states)
    if kind == 1:
        return StateNames(count=states, strings=[f"state {WORDS[rng.integers(len(WORDS))]} {i}" for i in range(states)])
    text = np.array([WORDS[i] for i in rng.integers(len(WORDS), size=states)], dtype=object)
    columns = {
        "flag": rng.random(states) < 0.5,
        "small": rng.integers(-3, 4, size=states),
        "wide": rng.integers(-(2**63), 2**63 - 1, size=states, endpoint=True),
        "same": np.full(states, 7),
        "unsigned": rng.integers(0, 2**64 - 1, size=states, dtype=np.uint64, endpoint=True),
        "real": rng.normal(size=states),
        "text": text,
    }
    chosen = [name for name in columns if rng.random() < 0.6] or ["small"]
    return StateNames(count=states, variables={name: columns[name] for name in rng.permutation(chosen)})


def _world(rng: np.random.Generator, states: int) -> World | None:
    if rng.random() < 0.5:
        return None
    width, height = rng.integers(1, 6, size=2).tolist()
    cells = width * height
    return World(
        width=width,
        height=height,
        kinds=("road", "highway", "park"),
        kind_of_cell=rng.integers(3, size=cells).astype(np.uint8),
        cell_of_state=rng.integers(-1, cells, size=states).astype(np.int32),
        zones={"north": rng.random(cells) < 0.5, "old town": rng.random(cells) < 0.5},
        note="made up",
        title="A town",
    )


def _mdp(rng: np.random.Generator) -> MDP:
    states = int(rng.integers(1, 40))
    choice_counts = rng.integers(1, 5, size=states)
    branch_counts = rng.integers(1, 6, size=choice_counts.sum())
    branches = int(branch_counts.sum())
    rows = np.concatenate([[0], np.cumsum(branch_counts)])
    probability = rng.random(branches) + 1e-3
    probability /= np.repeat(np.add.reduceat(probability, rows[:-1]), branch_counts)
    actions = ("go", "stay", "dreh dich", "go")[: rng.integers(0, 5)]
    rewards = {}
    for name in ("cost", "Cost", "cost/2"):
        if rng.random() < 0.6:
            rewards[name] = Reward(
                state=rng.normal(size=states) if rng.random() < 0.5 else None,
                choice=rng.normal(size=len(branch_counts)) if rng.random() < 0.5 else None,
                branch=rng.normal(size=branches) if rng.random() < 0.5 else None,
            )
    return MDP(
        state_to_choices=np.concatenate([[0], np.cumsum(choice_counts)]),
        choice_to_branches=rows,
        branch_to_target=rng.integers(states, size=branches),
        branch_to_probability=probability,
        choice_to_action=rng.integers(-1, len(actions), size=len(branch_counts)),
        actions=actions,
        labels={
            name: rng.random(states) < 0.4 for name in ("goal", "Goal", "init", "a/b", "日本") if rng.random() < 0.6
        },
        rewards=rewards,
        initial=rng.choice(states, size=rng.integers(1, states + 1), replace=False),
        names=_names(rng, states),
    )


@pytest.fixture(scope="session")
def random_problem() -> Callable[[int], Problem]:
    """``random_problem(seed)``: a Problem with anything that a Problem may have."""

    def make(seed: int) -> Problem:
        rng = np.random.default_rng(seed)
        mdp = _mdp(rng)
        cost = ExpectedCost(goal='"goal" & small > 0', reward="cost")
        reach = ReachAvoid(goal='"goal"', through='!"a/b"', maximise=False)
        full = rng.random() < 0.7
        return Problem(
            mdp=mdp,
            world=_world(rng, mdp.states),
            objective=(cost, reach, None)[rng.integers(3)],
            properties={"eta": cost, "ü": Threshold(objective=reach, relation="<=", bound=0.1)} if full else {},
            definitions={"N": "5", "busy": "x > 3 | !ok"} if full else {},
            lexicon=Lexicon(
                actions={"go": "move on"}, state="place {number}", objectives={"cost": {"best": "the cheapest"}}
            )
            if full
            else Lexicon(),
            notes=("Something was mended.",) if full else (),
        )

    return make


@pytest.fixture(scope="session")
def assert_equal() -> Callable[[Problem, Problem], None]:
    """``assert_equal(a, b)``: two problems are equal in all but the place they were read from."""

    def compare(left: Problem, right: Problem) -> None:
        a, b = left.mdp, right.mdp
        for name in (
            "state_to_choices",
            "choice_to_branches",
            "branch_to_target",
            "branch_to_probability",
            "choice_to_action",
            "initial",
        ):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
        assert a.actions == b.actions
        assert set(a.labels) == set(b.labels)
        for name, mask in a.labels.items():
            np.testing.assert_array_equal(mask, b.labels[name], err_msg=name)
        assert list(a.rewards) == list(b.rewards)
        for name, reward in a.rewards.items():
            parts, others = dict(reward.parts()), dict(b.rewards[name].parts())
            assert parts.keys() == others.keys()
            for part, values in parts.items():
                np.testing.assert_array_equal(values, others[part], err_msg=f"{name} {part}")
        assert [a.names[state] for state in range(a.states)] == [b.names[state] for state in range(b.states)]
        assert (a.names.strings is None) == (b.names.strings is None)
        assert list(a.names.variables) == list(b.names.variables)
        for name, column in a.names.variables.items():
            np.testing.assert_array_equal(column, b.names.variables[name], err_msg=name)
        assert (left.world is None) == (right.world is None)
        if left.world is not None and right.world is not None:
            for name in ("width", "height", "kinds", "note", "title"):
                assert getattr(left.world, name) == getattr(right.world, name)
            np.testing.assert_array_equal(left.world.kind_of_cell, right.world.kind_of_cell)
            np.testing.assert_array_equal(left.world.cell_of_state, right.world.cell_of_state)
            assert list(left.world.zones) == list(right.world.zones)
            for name, zone in left.world.zones.items():
                np.testing.assert_array_equal(zone, right.world.zones[name])
        for name in ("objective", "properties", "definitions", "lexicon", "notes"):
            assert getattr(left, name) == getattr(right, name), name

    return compare

"""Models that others published, read through Storm: sizes, names and properties, and PRISM programs against their JANI twins."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ratherthan.errors import NotExplainableError
from ratherthan.io.jani import read_jani
from ratherthan.io.prism import read_prism
from ratherthan.model.formula import states_where
from ratherthan.model.objective import ExpectedCost, Mission, Objective, ReachAvoid, Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.property import parse_property
from ratherthan.solve import solve

stormpy = pytest.importorskip("stormpy")

SMALL = [
    ("beb/beb.3-4", "N=3"),
    ("cdrive/cdrive.2", None),
    ("cdrive/cdrive.3", None),
    ("consensus/consensus.2", "K=2"),
    ("consensus/consensus.2", "K=16"),
    ("csma/csma.2-2", None),
    ("eajs/eajs.2", "energy_capacity=100,B=5"),
    ("elevators/elevators.a-3-3", None),
    ("firewire_abst/firewire_abst", "delay=3"),
    ("firewire_abst/firewire_abst", "delay=36"),
    ("ij/ij.3", None),
    ("ij/ij.10", None),
    ("pacman/pacman", "MAXSTEPS=5"),
    ("philosophers-mdp/philosophers-mdp.3", None),
    ("rabin/rabin.3", None),
    ("resource-gathering/resource-gathering", "B=1000000,GOLD_TO_COLLECT=0,GEM_TO_COLLECT=0"),
    ("triangle-tireworld/triangle-tireworld.9", None),
    ("wlan/wlan.0", "COL=0"),
    ("zeroconf/zeroconf", "N=20,K=2,reset=true"),
    ("zeroconf/zeroconf", "N=1000,K=8,reset=true"),
]
LARGE = [
    ("resource-gathering/resource-gathering", "B=200,GOLD_TO_COLLECT=15,GEM_TO_COLLECT=15"),
    ("zeroconf/zeroconf", "N=20,K=4,reset=false"),
]
TWINS = [
    ("consensus/consensus.2", "K=2"),
    ("csma/csma.2-2", None),
    ("firewire_abst/firewire_abst", "delay=3"),
    ("ij/ij.3", None),
    ("pacman/pacman", "MAXSTEPS=5"),
    ("philosophers-mdp/philosophers-mdp.3", None),
    ("wlan/wlan.0", "COL=0"),
    ("zeroconf/zeroconf", "N=20,K=2,reset=true"),
]


def folder(shared_data: Path) -> Path:
    return shared_data / "models" / "qvbs"


def published(shared_data: Path, name: str, constants: str | None) -> dict[str, Any]:
    """What is known of a model."""
    models = json.loads((shared_data / "expected.json").read_text(encoding="utf-8"))["models"]
    return next(m for m in models if m["file"].endswith(f"/{name}.jani") and m.get("constants") == constants)


def sizes(problem: Problem) -> dict[str, int]:
    mdp = problem.mdp
    return {"states": mdp.states, "choices": mdp.choices, "transitions": mdp.branches}


def same_sets(problem: Problem, one: Objective | Threshold, other: Objective | Threshold) -> bool:
    """Whether two properties ask the same of a model, in whatever words."""
    if isinstance(one, Threshold) and isinstance(other, Threshold):
        same = (one.relation, one.bound) == (other.relation, other.bound)
        return same and same_sets(problem, one.objective, other.objective)
    if isinstance(one, ExpectedCost) and isinstance(other, ExpectedCost):
        same = (one.reward, one.maximise) == (other.reward, other.maximise)
        return same and np.array_equal(states_where(problem.mdp, one.goal), states_where(problem.mdp, other.goal))
    if isinstance(one, ReachAvoid) and isinstance(other, ReachAvoid):
        return one.maximise == other.maximise and all(
            np.array_equal(states_where(problem.mdp, a or "true"), states_where(problem.mdp, b or "true"))
            for a, b in ((one.goal, other.goal), (one.through, other.through))
        )
    if isinstance(one, Mission):
        return one == other
    return False


@pytest.mark.parametrize(("name", "constants"), SMALL)
def test_sizes_and_properties_are_the_published_ones(shared_data: Path, name: str, constants: str | None) -> None:
    known = published(shared_data, name, constants)
    problem = read_jani(folder(shared_data) / f"{name}.jani", constants=constants)
    full = dict(known["counts_full"])
    stuck = full.pop("deadlock_states_given_self_loops")
    assert sizes(problem) == full
    if stuck is not None:
        assert int(problem.mdp.labels["deadlock"].sum()) == stuck
    assert set(problem.mdp.rewards) >= set(known.get("reward_models", []))
    for title, text in known["formulas"].items():
        if "rew{" in text or "Csteps<=" in text:
            assert title not in problem.properties
            with pytest.raises(NotExplainableError):
                parse_property(problem.others[title], problem)
        else:
            assert same_sets(problem, parse_property(text, problem), problem.properties[title])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "constants"), LARGE)
def test_sizes_of_large_models_are_the_published_ones(shared_data: Path, name: str, constants: str) -> None:
    known = published(shared_data, name, constants)
    problem = read_jani(folder(shared_data) / f"{name}.jani", constants=constants)
    assert sizes(problem) == {key: known["counts_full"][key] for key in sizes(problem)}


@pytest.mark.parametrize(
    ("name", "constants"), [("consensus/consensus.2", "K=2"), ("firewire_abst/firewire_abst", "delay=3")]
)
def test_labels_rewards_and_probabilities_are_those_of_storm(shared_data: Path, name: str, constants: str) -> None:
    """The states of two builds are told apart by their variables, not by their numbers."""
    path = folder(shared_data) / f"{name}.jani"
    mdp = read_jani(path, constants=constants).mdp
    program, _ = stormpy.instantiate_constants(stormpy.parse_jani_model(str(path))[0], constants)
    options = stormpy.BuilderOptions(build_full=True)
    theirs = stormpy.build_model(program, options=options)
    columns = {
        item.name: item.expression_variable for item in program.global_variables if item.name in mdp.names.variables
    }
    columns |= {
        item.name: item.expression_variable
        for automaton in program.automata
        for item in automaton.variables
        if item.name in mdp.names.variables
    }
    assert set(columns) == set(mdp.names.variables)
    valuations = theirs.state_valuations
    found = [
        mdp.names.find(
            ", ".join(
                f"{column}={str(valuations.get_value(state, variable)).lower()}" for column, variable in columns.items()
            )
        )
        for state in range(theirs.nr_states)
    ]
    assert sorted(found) == list(range(mdp.states))
    for label in theirs.labeling.get_labels() - {"init"}:
        assert {found[state] for state in theirs.labeling.get_states(label)} == set(np.flatnonzero(mdp.labels[label]))
    assert {found[state] for state in theirs.initial_states} == set(mdp.initial)
    for title, reward in theirs.reward_models.items():
        ours = mdp.rewards[title]
        assert reward.has_state_rewards == (ours.state is not None)
        assert reward.has_state_action_rewards == (ours.choice is not None)
        if ours.state is not None:
            assert [ours.state[found[state]] for state in range(mdp.states)] == list(reward.state_rewards)
        if ours.choice is not None:
            assert sorted(ours.choice) == pytest.approx(sorted(reward.state_action_rewards))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "constants"), TWINS)
def test_a_program_and_its_jani_twin_give_the_published_values(
    shared_data: Path, name: str, constants: str | None
) -> None:
    place = folder(shared_data)
    suffix = ".nm" if name.startswith("pacman") else ".prism"
    program = read_prism(place / f"{name}{suffix}", constants=constants)
    twin = read_jani(place / f"{name}.jani", constants=constants)
    assert sizes(program) == sizes(twin)
    assert program.mdp.rewards.keys() == twin.mdp.rewards.keys()
    assert program.mdp.labels.keys() >= twin.mdp.labels.keys()
    values = published(shared_data, name, constants)["published_reference"]
    for title, wanted in twin.properties.items():
        objective = wanted.objective if isinstance(wanted, Threshold) else wanted
        start, bounds = [], []
        for problem in (program, twin):
            solution = solve(problem, parse_property(objective.text, problem))
            first = int(problem.mdp.initial[0])
            start.append(float(solution.values[0, first]))
            bounds.append((solution.lower[0, first], solution.upper[0, first]))
        assert start[0] == pytest.approx(start[1], rel=1e-9)
        if not isinstance(wanted, Threshold) and values.get(title) is not None:
            for lower, upper in bounds:
                assert lower - 1e-6 <= values[title] <= upper + 1e-6

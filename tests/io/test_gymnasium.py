"""Environments of Gymnasium and their tables: what an episode earns, the model earns; what cannot be read is one sentence."""

from __future__ import annotations

import gzip
import json
import random
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.errors import InputError, MissingExtraError, ModelError, PolicyError, SourceError
from ratherthan.io import read, write
from ratherthan.io._gym_calls import Foreign, check_steps, plain_of
from ratherthan.io._gym_entries import table_from
from ratherthan.io._gym_json import is_table
from ratherthan.io._gym_model import Ended, mdp_of
from ratherthan.io._gym_text import split_source
from ratherthan.io._gym_values import UnknowableError, value_bytes
from ratherthan.io._policy_match import decided_states
from ratherthan.io.policies import read_policy
from ratherthan.model.mdp import MDP
from ratherthan.model.problem import Problem
from ratherthan.solve import solve

VALUES = "recomputed_optimal_values (not published; value iteration to 1e-13 by the collector)"


def sentence_of(source: Any, **options: Any) -> str:
    with pytest.raises(InputError) as caught:
        read(source, **options)
    assert "\n" not in caught.value.message
    return caught.value.message


def bare(problem: Problem) -> Problem:
    """Return the model alone."""
    return Problem(mdp=problem.mdp)


def branches(mdp: MDP, state: int) -> Iterator[list[tuple[float, int, float]]]:
    """Yield the branches of each choice of a state: probability, target, reward."""
    for choice in mdp.choices_of(state):
        own = mdp.branches_of(choice)
        yield list(
            zip(
                mdp.branch_to_probability[own].tolist(),
                mdp.branch_to_target[own].tolist(),
                mdp.rewards["reward"].branch[own].tolist(),
                strict=True,
            )
        )


# the tables that others published


@pytest.fixture
def envs(shared_data):
    return shared_data / "envs"


def stored(path) -> dict[str, Any]:
    return json.loads(gzip.decompress(path.read_bytes()))


@pytest.mark.parametrize("ice", ["slippery", "deterministic"])
def test_the_chance_to_cross_the_lake_is_the_known_one_everywhere(envs, ice):
    path = envs / f"FrozenLake-v1_4x4_{ice}.json.gz"
    problem = read(path)
    assert problem.objective.text == 'Pmax=? [!"hazard" U "goal"]'
    expected = np.array(stored(path)[VALUES]["1.0"]["V"])
    expected[15] = 1.0  # at the goal itself nothing more is earned, and it has been reached
    assert solve(problem).values[0] == pytest.approx(expected, abs=1e-9)


OWN = 'R{"reward"}max=? [Fsure "terminal"]'


def test_the_reward_of_the_cliff_is_the_known_one_everywhere(envs):
    path = envs / "CliffWalking-v1.json.gz"
    problem = read(path)
    assert problem.objective.text == OWN
    expected = np.array(stored(path)[VALUES]["1.0"]["V"])
    expected[47] = 0
    values = solve(problem).values[0]
    assert values == pytest.approx(expected, abs=1e-9)
    assert values[problem.mdp.initial].tolist() == pytest.approx([-13.0])


def test_the_reward_of_every_taxi_ride_is_the_known_one(envs):
    path = envs / "Taxi-v4.json.gz"
    problem = read(path)
    assert problem.objective.text == OWN
    assert list(problem.mdp.rewards) == ["reward"]
    values = solve(problem).values[0]
    assert values[:500] == pytest.approx(np.array(stored(path)[VALUES]["1.0"]["V"]), abs=1e-9)
    assert values[500:].tolist() == [0] * 4
    assert values[problem.mdp.initial].mean() == pytest.approx(stored(path)[VALUES]["1.0"]["V_init_mean"])


@pytest.mark.parametrize("discount", ["0.99", "0.95"])
@pytest.mark.parametrize(
    "name", ["Taxi-v4", "CliffWalking-v1", "FrozenLake-v1_4x4_slippery", "FrozenLake-v1_4x4_deterministic"]
)
def test_discounted_rewards_are_the_known_ones_everywhere(envs, name, discount):
    path = envs / f"{name}.json.gz"
    problem = read(path, objective=f'R{{"reward"}}max=? [Cdiscount={discount}]')
    table = stored(path)
    expected = np.array(table[VALUES][discount]["V"])
    live = ~problem.mdp.labels["terminal"][: table["nS"]]  # nothing is earned after the end
    assert solve(problem).values[0][: table["nS"]][live] == pytest.approx(expected[live], abs=1e-9)


def iterated(mdp: MDP, discount: float) -> np.ndarray[Any, Any]:
    """Return the discounted values of a model by plain value iteration."""
    values = np.zeros(mdp.states)
    for _ in range(3000):
        paid = mdp.branch_to_probability * (mdp.rewards["reward"].branch + discount * values[mdp.branch_to_target])
        action_values = np.add.reduceat(paid, mdp.choice_to_branches[:-1])
        values = np.maximum.reduceat(action_values, mdp.state_to_choices[:-1])
    return values


@pytest.mark.parametrize("source", ["gym:Taxi-v4,is_rainy=true", "gym:Taxi-v4", "gym:CliffWalking-v1,is_slippery=true"])
def test_discounted_rewards_are_those_of_value_iteration(gym, source):
    problem = read(source, objective='R{"reward"}max=? [Cdiscount=0.99]')
    assert solve(problem).values[0] == pytest.approx(iterated(problem.mdp, 0.99), abs=1e-8)


@pytest.mark.parametrize(("name", "steps"), [("Empty-5x5-v0_seed0", 5), ("LavaGapS5-v0_seed1", 7)])
def test_the_fewest_steps_through_a_grid_are_the_known_ones(envs, name, steps):
    problem = read(envs / f"MiniGrid-{name}.json.gz")
    assert problem.objective.text == 'Tmin=? [F "goal"]'
    assert problem.mdp.actions == ("left", "right", "forward", "pickup", "drop", "toggle", "done")
    assert solve(problem).values[0][problem.mdp.initial[0]] == pytest.approx(steps)


def test_states_of_a_taxi_are_decoded_and_its_ends_are_states_of_their_own(envs):
    mdp = read(envs / "Taxi-v4.json.gz").mdp
    assert mdp.states == 504
    assert mdp.names[328] == "taxi_row=3, taxi_col=1, passenger=Yellow, destination=Red"
    assert mdp.names[500] == "taxi_row=0, taxi_col=0, passenger=delivered, destination=Red"
    assert len({mdp.names[state] for state in range(mdp.states)}) == 504
    assert np.flatnonzero(mdp.labels["terminal"]).tolist() == [500, 501, 502, 503]
    assert len(mdp.initial) == 300


def test_a_table_is_read_packed_or_not_and_under_any_name(envs, tmp_path, assert_equal):
    path = envs / "CliffWalking-v1.json.gz"
    problem = read(path)
    plain = gzip.decompress(path.read_bytes())
    for name, data in {"a.json": plain, "a": plain, "b.bin": path.read_bytes(), "C.JSON.GZ": path.read_bytes()}.items():
        (tmp_path / name).write_bytes(data)
        assert_equal(read(tmp_path / name), problem)


def test_a_problem_of_a_table_survives_an_archive(envs, tmp_path, assert_equal):
    problem = read(envs / "Taxi-v4.json.gz")
    write(problem, tmp_path / "taxi.umb")
    assert_equal(read(tmp_path / "taxi.umb"), problem)


@pytest.mark.parametrize(
    ("kwargs", "fits"),
    [
        ({}, True),
        ({"nrow": "x", "ncol": 4}, True),  # not how a lake is described: its size is that of the usual one
        ({"desc": [1]}, True),
        ({"desc": ["SFFFFFFF", "FFFFFFFG"]}, True),
        ({"map_name": 5}, False),
        ({"map_name": "99x99"}, False),
    ],
)
def test_what_a_file_says_of_its_environment_is_taken_only_where_it_fits(envs, tmp_path, kwargs, fits):
    table = stored(envs / "FrozenLake-v1_4x4_slippery.json.gz")
    (tmp_path / "lake.json").write_text(json.dumps(table | {"kwargs": kwargs}))
    problem = read(tmp_path / "lake.json")
    assert (problem.world is not None) == fits
    assert problem.mdp.actions == (("left", "down", "right", "up") if fits else ("a0", "a1", "a2", "a3"))


def test_a_file_may_say_that_a_passenger_is_fickle(envs, tmp_path):
    table = stored(envs / "Taxi-v4.json.gz")
    path = tmp_path / "taxi.json"
    for kwargs, states in (({}, 504), ({"fickle_passenger": True}, 1008), ({"fickle_passenger": False}, 504)):
        path.write_text(json.dumps(table | {"kwargs": kwargs}))
        assert read(path).mdp.states == states
    for change in ({"env_id": "Taxi-v3"}, {"kwargs": {"fickle_passenger": True, "fickle_probability": "x"}}):
        path.write_text(json.dumps(table | {"kwargs": {"fickle_passenger": True}} | change))
        assert "fickle" in sentence_of(path)


# the law of ends


def entries(states: int) -> st.SearchStrategy[list[list[float | int | bool]]]:
    weights = st.lists(
        st.tuples(
            st.sampled_from([0, 1, 1, 2]), st.integers(0, states - 1), st.sampled_from([-2.0, 0.0, 1.0]), st.booleans()
        ),
        min_size=1,
        max_size=4,
    )
    kept = weights.filter(lambda listed: sum(weight for weight, *_ in listed) > 0)
    return kept.map(lambda listed: [[w / sum(x[0] for x in listed), *rest] for w, *rest in listed])


@st.composite
def tables(draw: st.DrawFn) -> list[list[list[list[float | int | bool]]]]:
    states, actions = draw(st.integers(1, 5)), draw(st.integers(1, 2))
    return [[draw(entries(states)) for _ in range(actions)] for _ in range(states)]


def most_in_table(table, horizon: int) -> list[float]:
    """Return the largest expected reward of so many steps, by the definition of the table."""
    values = [0.0] * len(table)
    for _ in range(horizon):
        values = [
            max(sum(p * (r + (0 if end else values[t])) for p, t, r, end in outcomes) for outcomes in row)
            for row in table
        ]
    return values


def most_in_model(mdp: MDP, horizon: int) -> list[float]:
    values = [0.0] * mdp.states
    for _ in range(horizon):
        values = [
            max(sum(p * (r + values[t]) for p, t, r in row) for row in branches(mdp, s)) for s in range(mdp.states)
        ]
    return values


@given(tables(), st.integers(0, 6))
def test_what_can_be_earned_in_so_many_steps_is_the_same_in_the_table_and_in_the_model(table, horizon):
    ended = Ended.of(table_from(table, "a table"), np.array([0]))
    mdp, _ = mdp_of(ended, np.array([0]), tuple(f"a{i}" for i in range(len(table[0]))))
    in_table, in_model = most_in_table(table, horizon), most_in_model(mdp, horizon)
    live = [state for state in range(len(table)) if not ended.terminal[state]]
    assert 0 in live
    assert [in_model[state] for state in live] == pytest.approx([in_table[state] for state in live])
    assert all(in_model[state] == 0 for state in np.flatnonzero(ended.terminal))


@given(tables())
def test_ends_are_labelled_by_what_they_pay(table):
    given_table = table_from(table, "a table")
    ended = Ended.of(given_table, np.array([0]))
    mdp, _ = mdp_of(ended, np.array([0]), tuple(f"a{i}" for i in range(len(table[0]))))
    paid: dict[int, float] = {}
    for state in np.flatnonzero(~ended.terminal).tolist():
        for p, target, reward, end in (entry for outcomes in table[state] for entry in outcomes):
            if end and p > 0:
                paid[target] = max(paid.get(target, -np.inf), reward)
    goals = {target for target, reward in paid.items() if reward == max(paid.values())}
    if not mdp.labels:
        assert not paid
        return
    terminal = np.flatnonzero(mdp.labels["terminal"])
    assert {int(ended.origin[state]) for state in np.flatnonzero(mdp.labels["goal"])} == goals
    assert (mdp.labels["hazard"] == (mdp.labels["terminal"] & ~mdp.labels["goal"])).all()
    for state in terminal.tolist():
        assert all(row == [(1.0, state, 0.0)] for row in branches(mdp, state))


@pytest.mark.parametrize(
    ("table", "objective"),
    [
        # only arrival pays, with and without a hazard
        ([[[[0.5, 1, 0.0, True], [0.5, 2, 5.0, True]]], [[[1.0, 1, 0.0, True]]], [[[1.0, 2, 0.0, True]]]], 'Pmax=? [!"hazard" U "goal"]'),
        ([[[[0.5, 0, 0.0, False], [0.5, 1, 5.0, True]]], [[[1.0, 1, 0.0, True]]]], 'Pmax=? [F "goal"]'),
        # steps cost, steps cost and arrival pays, steps pay, arrival pays more or less, nothing pays
        ([[[[0.5, 0, -1.0, False], [0.5, 1, 0.0, True]]], [[[1.0, 1, 0.0, True]]]], OWN),
        ([[[[0.5, 0, -1.0, False], [0.5, 1, 1.0, True]]], [[[1.0, 1, 0.0, True]]]], OWN),
        ([[[[0.5, 0, 1.0, False], [0.5, 1, 1.0, True]]], [[[1.0, 1, 0.0, True]]]], OWN),
        ([[[[0.5, 1, 2.0, True], [0.5, 1, 1.0, True]]], [[[1.0, 1, 0.0, True]]]], OWN),
        ([[[[1.0, 1, 0.0, True]]], [[[1.0, 1, 0.0, True]]]], OWN),
        # no end
        ([[[[1.0, 0, -1.0, False]]]], None),
    ],
)  # fmt: skip
def test_the_objective_is_that_of_the_environment(tmp_path, table, objective):
    path = tmp_path / "table.json"
    path.write_text(json.dumps({"nS": len(table), "nA": 1, "P": table, "initial": 0}))
    found = read(path).objective
    assert (None if found is None else found.text) == objective


def test_without_initial_states_any_state_may_be_the_start(tmp_path):
    path = tmp_path / "table.json"
    path.write_text(json.dumps({"nS": 2, "nA": 1, "P": [[[[1.0, 1, 1.0, True]]], [[[1.0, 1, 0.0, True]]]]}))
    problem = read(path)
    assert problem.mdp.initial.tolist() == [0, 1]
    assert problem.mdp.states == 2
    assert any("any state may be the start" in note for note in problem.notes)


def test_an_action_without_outcomes_is_not_enabled(tmp_path):
    path = tmp_path / "table.json"
    path.write_text(json.dumps({"nS": 2, "nA": 2, "P": [[[], [[1.0, 1, 1.0, True]]], [[], []]], "initial": 0}))
    mdp = read(path).mdp
    assert [mdp.action_name(choice) for choice in mdp.choices_of(0)] == ["a1"]


# bad tables

GOOD = {"nS": 1, "nA": 1, "P": [[[[1.0, 0, 0.0, True]]]], "initial": 0}


def entry(probability: Any, target: Any, reward: Any, terminated: Any) -> dict[str, Any]:
    return {"P": [[[[probability, target, reward, terminated]]]]}


HUGE = 10**400


@pytest.mark.parametrize(
    "change",
    [
        {"nS": 2}, {"nS": 0}, {"nS": True}, {"nS": "1"}, {"nS": None}, {"nA": 2}, {"nA": 1.0},
        {"P": None}, {"P": 5}, {"P": []}, {"P": "PPPP"}, {"P": {}}, {"P": {"1": [[]]}}, {"P": {"x": [[]]}},
        {"P": [[]]}, {"P": [[5]]}, {"P": [[[5]]]}, {"P": [["0000"]]}, {"P": [[[[1.0, 0, 0.0]]]]},
        entry(1.0, 1, 0.0, terminated=True), entry(1.0, -1, 0.0, terminated=True), entry(1.0, 0.0, 0.0, terminated=True), entry(1.0, target=True, reward=0.0, terminated=True),
        entry(1.0, 0, 0.0, 1), entry(1.0, 0, 0.0, None), entry("1.0", 0, 0.0, terminated=True), entry(1.0, 0, "0", terminated=True),
        entry(1.0, 0, 1e300, terminated=True), entry(HUGE, 0, 0.0, terminated=True), entry(1.0, HUGE, 0.0, terminated=True), entry(probability=True, target=0, reward=0.0, terminated=True),
        {"initial": 1}, {"initial": -1}, {"initial": []}, {"initial": 0.5}, {"initial": "0"}, {"initial": True},
        {"initial_state_distribution": {"1": 1.0}}, {"initial_state_distribution": {"x": 1.0}},
        {"initial_state_distribution": {"0": "1"}}, {"initial_state_distribution": {"0": 0.0}},
        {"initial_state_distribution": [1.0, 0.0]}, {"initial_state_distribution": {"0": -1.0}},
        {"actions": ["a", "b"]}, {"actions": "a"}, {"actions": [1]}, {"states": [{}, {}]}, {"states": [1]},
        {"kwargs": 5}, {"env_id": 5},
    ],
    ids=lambda change: str(change)[:60],
)  # fmt: skip
def test_a_malformed_table_is_one_sentence(tmp_path, change):
    path = tmp_path / "table.json"
    path.write_text(json.dumps(GOOD))
    assert read(path).mdp.states == 1 + 1  # its end is a state of its own
    path.write_text(json.dumps(GOOD | change))
    with pytest.raises(SourceError, match="table"):
        read(path)


@pytest.mark.parametrize("probability", [0.5, -1.0, 2.0])
def test_probabilities_of_a_table_must_sum_to_one(tmp_path, probability):
    path = tmp_path / "table.json"
    path.write_text(json.dumps(GOOD | entry(probability, 0, 0.0, terminated=False)))
    with pytest.raises(ModelError):
        read(path)


@pytest.mark.parametrize("text", ["", "{", "[1]", "5", '{"nS": NaN}', '{"nS": 1, "P": ' + "[" * 100_000, "\xff"])
def test_a_damaged_table_is_one_sentence(tmp_path, text):
    path = tmp_path / "table.json.gz"
    path.write_bytes(gzip.compress(text.encode("latin-1")))
    assert str(path) in sentence_of(path)
    whole = gzip.compress(json.dumps(GOOD).encode())
    path.write_bytes(whole[:-9])
    assert str(path) in sentence_of(path)


def test_other_json_and_other_archives_are_no_tables():
    assert is_table(b'{"nS": 1}')
    assert is_table(gzip.compress(b' {"env_id": "x", "nS": 1}'))
    for head in (
        b'{"jani-version": 1, "P": 1}',
        b'{"10": "east"}',
        b'["nS"]',
        gzip.compress(b"nS"),
        b"\x1f\x8b\x00",
        b"",
    ):
        assert not is_table(head)


# names and arguments


@pytest.mark.parametrize(
    ("text", "arguments"),
    [
        ("x", {}),
        ("x,a=1,b=-2.5,c=1e-3", {"a": 1, "b": -2.5, "c": 0.001}),
        ("x,a=true,b=False,c=none", {"a": True, "b": False, "c": None}),
        ("x,a=1/3", {"a": 1 / 3}),
        ("x,a=1/0,b=8x8,c=,d=1e999", {"a": "1/0", "b": "8x8", "c": "", "d": "1e999"}),
        ('x,a="4",b="1,2",c=[1,2,[3]],d=["S,F","G"]', {"a": "4", "b": "1,2", "c": [1, 2, [3]], "d": ["S,F", "G"]}),
        ("x,a=[SF,FG],b=[1", {"a": ["SF", "FG"], "b": "[1"}),
        ("x,a=b=c", {"a": "b=c"}),
    ],
)
def test_arguments_are_read_as_they_look(text, arguments):
    assert split_source(text) == ("x", arguments)


@pytest.mark.parametrize("text", ["", ",a=1", "x,a", "x,=1", "x,a=1,a=2", "x,a b=1", "x,"])
def test_malformed_arguments_are_one_sentence(text):
    with pytest.raises(SourceError, match="gym:"):
        split_source(text)


def test_without_gymnasium_it_is_said_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(MissingExtraError, match=r"ratherthan\[gym\]"):
        read("gym:FrozenLake-v1")


def test_the_command_line_refuses_with_exit_code_2():
    pytest.importorskip("gymnasium")
    for source in ("gym:Nope-v1", "gym:FrozenLake-v1,foo=1", "gym:Blackjack-v1"):
        done = subprocess.run([sys.executable, "-m", "ratherthan", "info", source], capture_output=True, check=False)
        assert done.returncode == 2
        assert done.stdout == b""
        assert done.stderr.count(b"\n") == 1


# environments with a table


@pytest.fixture
def gym() -> Any:
    return pytest.importorskip("gymnasium")


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("gym:FrozenLake-v1", "FrozenLake-v1_4x4_slippery"),
        ("gym:FrozenLake-v1,is_slippery=false", "FrozenLake-v1_4x4_deterministic"),
        ("gym:CliffWalking-v1", "CliffWalking-v1"),
        ("gym:Taxi-v4", "Taxi-v4"),
    ],
)
def test_an_environment_is_its_published_table(gym, envs, source, name, assert_equal):
    problem, table = read(source), read(envs / f"{name}.json.gz")
    assert_equal(bare(problem), bare(table))
    assert (problem.objective, problem.lexicon) == (table.objective, table.lexicon)
    assert (problem.world.kind_of_cell == table.world.kind_of_cell).all()


@pytest.mark.parametrize(
    "change", [{"map_name": "8x8"}, {"is_slippery": False}, {"desc": ["SFF", "FHF"], "success_rate": 0.5}, {}]
)
def test_arguments_reach_the_environment_in_every_way(gym, change, assert_equal):
    written = ",".join(f"{key}={json.dumps(value)}" for key, value in change.items())
    made = gym.make("FrozenLake-v1", **change)
    by_text = read(f"gym:FrozenLake-v1{',' * bool(written)}{written}")
    for other in (read("gym:FrozenLake-v1", **change), read(made), read(made.unwrapped)):
        assert_equal(bare(by_text), bare(other))
    assert by_text.mdp.states == made.observation_space.n


def test_the_lake_is_a_map_with_holes_and_a_goal(gym):
    problem = read("gym:FrozenLake-v1,desc=[SHF,FFG]")
    kinds = [problem.world.kinds[kind] for kind in problem.world.kind_of_cell]
    assert kinds == ["start", "hole", "frozen", "frozen", "frozen", "goal"]
    assert problem.world.place(5) == (2, 1)
    assert problem.mdp.names[4] == "row=1, col=1"
    assert problem.mdp.actions == ("left", "down", "right", "up")
    assert any("100 steps" in note for note in problem.notes)


@pytest.mark.parametrize("schedule", ["[1,0,0.1]", "[1,-1,-0.1]", "[0,-5,-1]"])
def test_where_steps_pay_or_cost_the_most_reward_is_wanted(gym, schedule):
    assert read(f"gym:FrozenLake-v1,reward_schedule={schedule}").objective.text == OWN


def test_where_going_on_pays_a_note_says_what_that_means(gym):
    paying, plain = read("gym:FrozenLake-v1,reward_schedule=[1,0,0.1]"), read("gym:FrozenLake-v1")
    assert any(note.startswith("Going on may pay") for note in paying.notes)
    assert not any(note.startswith("Going on may pay") for note in plain.notes)
    assert solve(paying).values[0][0] == np.inf
    found = read("gym:FrozenLake-v1,reward_schedule=[1,0,0.1]", objective='R{"reward"}max=? [Cdiscount=0.99]')
    assert solve(found).values[0] == pytest.approx(iterated(found.mdp, 0.99), abs=1e-8)


def test_what_earns_the_most_until_the_end_is_told_by_hand(tmp_path):
    # Going on pays 2 with probability 1/2, and ends with 1 else; leaving ends at once with 2: 2 / 0.5 / 2 + 1 = 3.
    table = [[[[0.5, 0, 2.0, False], [0.5, 1, 1.0, True]], [[1.0, 1, 2.0, True]]], [[[1.0, 1, 0.0, True]] * 2]]
    table[1] = [[[1.0, 1, 0.0, True]], [[1.0, 1, 0.0, True]]]
    path = tmp_path / "table.json"
    path.write_text(json.dumps({"nS": 2, "nA": 2, "P": table, "initial": 0, "actions": ["on", "leave"]}))
    solution = solve(read(path))
    assert solution.values[0].tolist() == pytest.approx([3.0, 0.0])
    assert solution.problem.mdp.action_name(int(solution.policy.choice[0])) == "on"


@pytest.mark.parametrize("rainy", [False, True])
def test_a_fickle_passenger_is_in_the_model_as_in_the_steps(gym, rainy):
    class Chance:
        """A generator that gives what it is told."""

        def __init__(self, number: float, index: int) -> None:
            self.number, self.index = number, index

        def random(self) -> float:
            return self.number

        def choice(self, given: list[int]) -> int:
            return given[self.index]

    made = gym.make("Taxi-v4", fickle_passenger=True, fickle_probability=0.25, is_rainy=rainy).unwrapped
    mdp = read(made).mdp
    made.reset(seed=0)
    numbers = {0.0: 0.8, 0.85: 0.1, 0.95: 0.1} if rainy else {0.0: 1.0}
    moves = range(4)
    for state in [16, 76, 117, 236, 257, 378, 419, 478, 1, 233]:
        for action in range(6):
            law: dict[int, float] = {}
            for number, weight in (numbers if rainy and action in moves else {0.0: 1.0}).items():
                for told, share in [(False, 0.75), *[(index, 0.25 / 3) for index in range(3)]]:
                    made.s, made.fickle_step = state, told is not False
                    made._np_random = Chance(number, int(told))
                    target, *_ = made.step(action)
                    law[target] = law.get(target, 0) + weight * share
            got: dict[int, float] = {}
            for chance, target, _ in list(branches(mdp, state))[action]:
                target = [0, 85, 410, 475][target % 4] if target >= 1000 else target % 500
                got[target] = got.get(target, 0) + chance
            assert got == pytest.approx(law)


def test_a_settled_passenger_stays_so(gym):
    mdp = read("gym:Taxi-v4,fickle_passenger=true").mdp
    settled = mdp.names.variables["settled"]
    plain = read("gym:Taxi-v4").mdp
    for state in range(500):
        assert settled[[target for row in branches(mdp, state + 500) for _, target, _ in row]].all()
        assert [len(row) for row in branches(mdp, state + 500)] == [len(row) for row in branches(plain, state)]


def test_a_table_that_steps_do_not_follow_is_refused(gym):
    from gymnasium.envs.toy_text.cliffwalking import CliffWalkingEnv

    class Windy(CliffWalkingEnv):
        def step(self, a):
            _, reward, terminated, truncated, info = super().step(a)
            if self.s >= 24:
                self.s -= 12
            return int(self.s), reward, terminated, truncated, info

    assert "a rule beside its table" in sentence_of(Windy())


def test_tables_of_ones_own_are_read_and_steps_of_another_kind_are_noted(gym):
    class Own(gym.Env):
        action_space, observation_space = gym.spaces.Discrete(1), gym.spaces.Discrete(2)
        isd = np.array([1.0, 0.0])

    Own.P = {0: {0: [(1.0, 1, 1.0, True)]}, 1: {0: [(1.0, 1, 0.0, True)]}}
    problem = read(Own())
    assert problem.mdp.states == 2
    assert problem.mdp.initial.tolist() == [0]
    assert any("could not be compared" in note for note in problem.notes)
    Own.P = {(0, 0): {0: [(1.0, (0, 0), 1.0, True)]}}
    assert "numbered 0" in sentence_of(Own())


def test_steps_are_compared_with_the_right_entries(gym):
    made = gym.make("Taxi-v4", is_rainy=True).unwrapped
    table = table_from(made.P, "Taxi")
    assert check_steps(made, table, Foreign("Taxi")) == ()
    table.reward[:] -= 1
    with pytest.raises(SourceError, match="beside its table"):
        check_steps(made, table, Foreign("Taxi"))


# wrappers


def test_a_wrapper_that_changes_the_task_is_refused(gym):
    made = gym.make("FrozenLake-v1")
    wearing = gym.wrappers.TransformReward(made, lambda reward: -reward)
    assert "TransformReward" in sentence_of(wearing)
    assert "TransformReward" in sentence_of(gym.wrappers.TimeLimit(wearing, 5))
    assert read(wearing.unwrapped).mdp.states == 16


def test_harmless_wrappers_are_taken_off_and_a_time_limit_is_noted(gym):
    made = gym.wrappers.RecordEpisodeStatistics(gym.make("FrozenLake-v1"))
    made = gym.wrappers.TransformObservation(made, lambda seen: seen, None)
    plain, notes = plain_of(made, "it")
    assert plain is made.unwrapped
    assert len(notes) == 1
    assert "100 steps" in notes[0]


def test_several_environments_in_one_are_refused(gym):
    many = gym.make_vec("FrozenLake-v1", num_envs=2, vectorization_mode="sync")
    assert "2 in one" in sentence_of(many)
    many.close()


# environments without a table


def corridor(gym: Any) -> type:
    class Corridor(gym.Env):
        """Five cells in a row: right or left, out at the right end; a lamp that anybody may switch."""

        action_space, observation_space = gym.spaces.Discrete(3), gym.spaces.Discrete(5)

        def __init__(self, **extra: Any) -> None:
            self.cell, self.lamp, self.steps = 0, False, 0
            vars(self).update(extra)

        def reset(self, *, seed=None, options=None):  # noqa: ARG002 - Gymnasium's
            super().reset(seed=seed)
            self.cell, self.lamp, self.steps = 0, False, 0
            return self.cell, {}

        def step(self, action):
            self.steps += 1
            if action == 2:
                self.lamp = not self.lamp
            else:
                self.cell = min(max(self.cell + (1, -1)[action], 0), 4)
            return self.cell, -1.0, self.cell == 4 and self.lamp, False, {}

    return Corridor


def test_an_environment_without_a_table_is_explored(gym):
    made = corridor(gym)()
    made.reset(seed=1)
    made.step(0)
    before = dict(vars(made))
    problem = read(made, ignore="steps")
    assert vars(made) == before  # it stays as it is
    assert problem.mdp.states == 10
    assert problem.mdp.names[0] == "cell=0, lamp=false"
    assert solve(problem).values[0][0] == pytest.approx(-5)
    assert problem.mdp.initial.tolist() == [0]


def test_a_counter_of_steps_is_found_out_by_the_budget(gym):
    message = sentence_of(corridor(gym)(), max_states=50)
    assert "At most 50 states" in message
    assert "ignore" in message
    assert "cell, lamp, steps" in sentence_of(corridor(gym)(), ignore=["walked"])


def test_chance_is_refused_wherever_it_comes_from(gym):
    class Drawing(corridor(gym)):
        def step(self, action):
            draws = {
                "own": self.np_random.random,
                "nested": self.tools["dice"][0].random,
                "old": self.tools["old"].random,
                "python": random.random,
                "numpy": np.random.rand,
            }
            draws[self.draw]()
            return super().step(action)

    for draw in ("own", "nested", "old", "python", "numpy"):
        tools = {"dice": [np.random.default_rng(0)], "old": np.random.RandomState(0)}
        assert "chance" in sentence_of(Drawing(draw=draw, tools=tools), ignore="steps")


def test_what_depends_on_the_world_outside_is_refused(gym):
    calls = iter(range(10**6))

    class Moody(corridor(gym)):
        def step(self, action):
            state, _, *rest = super().step(action)
            return state, -float(next(calls)), *rest

    assert "two outcomes" in sentence_of(Moody(), ignore="steps")


def test_a_start_that_is_drawn_is_picked_by_the_seed(gym):
    class Somewhere(corridor(gym)):
        def reset(self, *, seed=None, options=None):  # noqa: ARG002 - Gymnasium's
            super().reset(seed=seed)
            self.cell = int(self.np_random.integers(4))
            return self.cell, {}

    starts = {seed: read(Somewhere(), ignore="steps", seed=seed) for seed in range(6)}
    assert len({problem.mdp.names[0] for problem in starts.values()}) > 1
    assert read(Somewhere(), ignore="steps", seed=3).mdp.names[0] == starts[3].mdp.names[0]

    class Anywhere(corridor(gym)):
        def reset(self, *, seed=None, options=None):  # noqa: ARG002 - Gymnasium's
            super().reset(seed=seed)
            self.cell = int(np.random.default_rng().integers(10**9))
            return self.cell, {}

    assert "same seed" in sentence_of(Anywhere(), ignore="steps")


@pytest.mark.parametrize(
    ("options", "word"),
    [({"seed": -1}, "seed"), ({"seed": "x"}, "seed"), ({"max_states": 0}, "max_states"), ({"ignore": 5}, "ignore"), ({"size": 3}, "size")],
)  # fmt: skip
def test_options_of_reading_are_checked(gym, options, word):
    assert word in sentence_of(corridor(gym)(), **options)
    assert "transition table" in sentence_of("gym:FrozenLake-v1", seed=3)


def test_environments_that_break_are_one_sentence(gym):
    class Broken(corridor(gym)):
        def step(self, action):  # noqa: ARG002 - Gymnasium's
            raise ZeroDivisionError("on\nthe way")

    class Endless(corridor(gym)):
        def step(self, action):
            state, _, *rest = super().step(action)
            return state, float("nan"), *rest

    with pytest.raises(SourceError, match="ZeroDivisionError"):
        read(Broken())
    assert "finite" in sentence_of(Endless(), ignore="steps")
    assert "cannot be told apart" in sentence_of(corridor(gym)(thing=iter([1])), ignore="steps")


@pytest.mark.parametrize(
    ("source", "word"),
    [
        ("gym:Nope-v1", "Nope"),
        ("gym:nopackage:X-v0", "nopackage"),
        ("gym:FrozenLake-v1,foo=1", "takes the arguments"),
        ("gym:FrozenLake-v1,foo=a", "takes the arguments"),
        ("gym:FrozenLake-v1,map_nam=8x8", "Did you mean 'map_name'"),
        ("gym:FrozenLake-v1,map_name=9x9", "9x9"),
        ("gym:FrozenLake-v1,is_slippery=maybe", "true or false"),
        ("gym:FrozenLake-v1,success_rate=2", "Probabilities"),
        ("gym:FrozenLake-v1,render_mode=human", "render_mode"),
        ("gym:Blackjack-v1", "chance"),
        ("gym:CartPole-v1", "real numbers"),
        ("gym:Pendulum-v1", "Discrete"),
        ("gym:Taxi-v3", "Taxi"),
    ],
)
def test_what_cannot_be_made_or_read_is_one_sentence(gym, source, word):
    assert word in sentence_of(source)


def test_constants_are_refused(gym):
    assert "constants" in sentence_of("gym:FrozenLake-v1", constants="N=5")


def test_what_gymnasium_warns_of_is_noted(gym):
    assert any("FrozenLake-v1" in note for note in read("gym:FrozenLake").notes)


# values that states are told apart by


class Thing:
    def __init__(self, **attributes: Any) -> None:
        vars(self).update(attributes)


def value(**attributes: Any) -> bytes:
    return value_bytes(Thing(**attributes), (), {})[0]


def test_equal_values_have_equal_bytes_and_others_not():
    again = Thing(a=1)
    again.me = again
    assert value_bytes(again, (), {})[0]  # a cycle ends
    same = [(1, 2), [1, 2], np.array([1, 2]), (np.int64(1), 2)]
    assert len({value(x=item) for item in same}) == 1
    pair = (1, 2)
    assert value(x=pair, y=pair) == value(x=(1, 2), y=(*pair,))
    others = [
        1,
        2,
        "1",
        None,
        True,
        1.5,
        (1,),
        {"a": 1},
        {"a": 2},
        {1},
        np.eye(2),
        np.zeros((2, 2)),
        Thing(a=1),
        Thing(a=2),
    ]
    assert len({value(x=item) for item in others}) == len(others)
    assert value(x={"a": 1, "b": 2}) == value(x={"b": 2, "a": 1})
    with pytest.raises(UnknowableError, match="'x'"):
        value(x=[object()])


# MiniGrid


@pytest.mark.parametrize(("name", "seed"), [("Empty-5x5-v0", 0), ("LavaGapS5-v0", 1)])
def test_a_grid_is_its_published_table(gym, envs, name, seed):
    pytest.importorskip("minigrid")
    problem = read(f"gym:MiniGrid-{name},seed={seed}")
    table = read(envs / f"MiniGrid-{name}_seed{seed}.json.gz")
    for state in range(problem.mdp.states):
        assert list(branches(problem.mdp, state)) == list(branches(table.mdp, state))
    assert {name: mask.tolist() for name, mask in problem.mdp.labels.items()} == {
        name: mask.tolist() for name, mask in table.mdp.labels.items()
    }
    assert problem.objective == table.objective
    places = stored(envs / f"MiniGrid-{name}_seed{seed}.json.gz")["states"]
    assert [problem.world.place(state) for state in range(problem.mdp.states)] == [
        tuple(item["pos"]) for item in places
    ]


def test_keys_and_doors_are_told(gym):
    pytest.importorskip("minigrid")
    problem = read("gym:MiniGrid-DoorKey-5x5-v0")
    assert set(problem.mdp.names.variables) == {"x", "y", "facing", "door_2_1", "yellow_key"}
    assert set(problem.mdp.names.variables["door_2_1"]) == {"open", "closed", "locked"}
    assert "carried" in problem.mdp.names.variables["yellow_key"]
    assert len({problem.mdp.names[state] for state in range(problem.mdp.states)}) == problem.mdp.states
    assert any("seed 0" in note for note in problem.notes)
    assert any("here it earns 1" in note for note in problem.notes)


def test_a_grid_is_walked_as_its_plan_says(gym):
    minigrid = pytest.importorskip("minigrid")
    assert minigrid
    problem = read("gym:MiniGrid-DoorKey-5x5-v0,seed=4")
    solution = solve(problem)
    made = gym.make("MiniGrid-DoorKey-5x5-v0")
    made.reset(seed=4)
    mdp, state, steps, reward = problem.mdp, 0, 0, 0.0
    while not mdp.labels["terminal"][state]:
        choice = int(solution.policy.choice[state])
        _, reward, *_ = made.step(int(mdp.choice_to_action[choice]))
        state, steps = int(mdp.branch_to_target[mdp.branches_of(choice)][0]), steps + 1
    assert reward > 0
    assert steps == pytest.approx(solution.values[0][0])


def test_moving_obstacles_are_refused(gym):
    pytest.importorskip("minigrid")
    assert "chance" in sentence_of("gym:MiniGrid-Dynamic-Obstacles-5x5-v0")


# what was learned from an environment


class Learned:
    """An agent that has seen the states of the environment."""

    def __init__(self, table: np.ndarray[Any, Any], states: int) -> None:
        self.table = table
        self.observation_space = type("Discrete", (), {"n": states, "start": 0})()

    def predict(self, observation: np.ndarray[Any, Any], deterministic: bool) -> tuple[Any, None]:
        assert deterministic
        assert (observation < len(self.table)).all()
        return self.table[observation].argmax(axis=1), None


def test_what_was_learned_from_the_taxi_fits_its_model_without_the_added_ends(gym):
    problem = read("gym:Taxi-v4")
    draw = np.random.default_rng(0)
    q = draw.normal(size=(500, 6))
    whole = read_policy(np.concatenate([q, np.zeros((4, 6))]), problem.mdp)
    ends = problem.mdp.state_to_choices[500:504].tolist()
    for learned in (q, q.argmax(axis=1), Learned(q, 500), Learned(np.concatenate([q, q[:4]]), 504)):
        policy = read_policy(learned, problem.mdp)
        assert policy.choice[:500].tolist() == whole.choice[:500].tolist()
        assert ((policy.choice[500:] >= ends) & (policy.choice[500:] < np.array(ends) + 6)).all()
    assert read_policy(-q, problem.mdp, minimise_q=True).choice.tolist() == whole.choice.tolist()


@pytest.mark.parametrize("rows", [499, 505, 1])
def test_a_table_of_another_size_is_refused(gym, rows):
    mdp = read("gym:Taxi-v4").mdp
    for learned in (np.zeros((rows, 6)), np.zeros(rows, dtype=int), Learned(np.zeros((rows, 6)), rows)):
        with pytest.raises(PolicyError, match="504"):
            read_policy(learned, mdp)


def test_only_terminal_states_that_loop_may_be_left_out():
    for source, least in (("example:paper-5x5", 25), ("example:delivery", None)):
        mdp = read(source).mdp
        with pytest.raises(PolicyError):
            read_policy(np.zeros((mdp.states - 1, len(mdp.actions))), mdp)
        assert decided_states(mdp) == (least or mdp.states)


def test_at_the_edges_of_the_lake_and_the_cliff_ends_are_what_they_are(gym):
    lake, cliff = read("gym:FrozenLake-v1").mdp, read("gym:CliffWalking-v1").mdp
    assert np.flatnonzero(lake.labels["hazard"]).tolist() == [5, 7, 11, 12]
    assert np.flatnonzero(lake.labels["goal"]).tolist() == [15]
    assert np.flatnonzero(cliff.labels["terminal"]).tolist() == [47]  # falling off leads back to the start: no end
    assert not cliff.labels["hazard"].any()
    assert decided_states(lake) == 15
    assert decided_states(cliff) == 47

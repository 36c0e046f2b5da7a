"""Arrays: every form that people have means the same model; NumPy archives keep it, and no stranger's does harm."""

from __future__ import annotations

import contextlib
import io
import pickle
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.errors import InputError, ModelError, SourceError
from ratherthan.io._files import Limits
from ratherthan.io.arrays import from_arrays
from ratherthan.io.npz import read_npz, write_npz
from ratherthan.model.mdp import MDP, Reward


def random_dense(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Transitions [S, A, S] in which actions may be disabled, rewards [S, A] and [S, A, S]."""
    rng = np.random.default_rng(seed)
    states, actions = rng.integers(1, 8), rng.integers(1, 5)
    transitions = rng.random((states, actions, states)) * (rng.random((states, actions, states)) < 0.5)
    sums = transitions.sum(axis=2, keepdims=True)
    transitions = np.divide(transitions, sums, out=np.zeros_like(transitions), where=sums > 0)
    return transitions, rng.normal(size=(states, actions)), rng.normal(size=(states, actions, states))


def dense_of(mdp: MDP, actions: int) -> np.ndarray:
    """The transitions [S, A, S] of a model, by the plainest loop."""
    dense = np.zeros((mdp.states, actions, mdp.states))
    for state in range(mdp.states):
        for choice in mdp.choices_of(state):
            for branch in range(mdp.choice_to_branches[choice], mdp.choice_to_branches[choice + 1]):
                if mdp.choice_to_action[choice] >= 0:
                    target = mdp.branch_to_target[branch]
                    dense[state, mdp.choice_to_action[choice], target] += mdp.branch_to_probability[branch]
    return dense


# the forms


@given(st.integers(0, 2**32))
def test_every_form_means_the_same_model(assert_equal, seed):
    sparse = pytest.importorskip("scipy.sparse")
    sas, per_choice, per_branch = random_dense(seed)
    actions = sas.shape[1]
    ass = sas.transpose(1, 0, 2)
    state, action = np.nonzero(sas.any(axis=2))
    rewards = {"c": per_choice, "s": per_choice[:, 0]}
    more = {"labels": {"goal": [0]}, "initial": 0}
    first = from_arrays(sas, rewards | {"b": per_branch}, order="SAS", **more)
    branch_ass = per_branch.transpose(1, 0, 2)
    same = [
        from_arrays(ass, rewards | {"b": branch_ass}, order="ASS", **more),
        from_arrays(list(ass), rewards | {"b": list(branch_ass)}, **more),
        from_arrays([sparse.csr_matrix(m) for m in ass], rewards | {"b": branch_ass}, **more),
        from_arrays(
            [sparse.coo_array(m) for m in ass], rewards | {"b": [sparse.csc_matrix(m) for m in branch_ass]}, **more
        ),
        from_arrays(sas.tolist(), rewards | {"b": per_branch.tolist()}, order="SAS", **more),
    ]
    for problem in same:
        assert_equal(first, problem)
    np.testing.assert_allclose(dense_of(first.mdp, actions), sas, atol=1e-12)
    assert first.mdp.rewards["s"].state.tolist() == per_choice[:, 0].tolist()
    named = first.mdp.choice_to_action >= 0
    assert first.mdp.rewards["c"].choice[named].tolist() == per_choice[state, action].tolist()
    if sas.any(axis=(1, 2)).all() and len(state):
        pairs, values = sas[state, action], per_choice[state, action]
        shuffled = np.random.default_rng(seed).permutation(len(state))
        shuffled = shuffled[np.argsort(action[shuffled], kind="stable")]  # within a state the order listed counts
        alone = from_arrays(sas, per_choice, order="SAS", actions=[f"a{i}" for i in range(actions)], **more)
        for listed in (pairs[shuffled], sparse.csr_array(pairs[shuffled])):
            from_pairs = from_arrays(
                listed,
                values[shuffled],
                s_indices=state[shuffled],
                a_indices=action[shuffled],
                actions=[f"a{i}" for i in range(actions)],
                **more,
            )
            assert_equal(alone, from_pairs)


def test_the_axes_are_told_by_the_shape_where_it_tells():
    sas, *_ = np.zeros((3, 2, 3)), 0
    sas[:, :, 0] = 1
    assert from_arrays(sas).mdp.choices == from_arrays(sas.transpose(1, 0, 2)).mdp.choices == 6
    cube = np.full((2, 2, 2), 0.5)
    with pytest.raises(SourceError, match="order='ASS' or order='SAS'"):
        from_arrays(cube)
    with pytest.raises(SourceError, match=r"must have the shape \[A, S, S\]"):
        from_arrays(sas, order="ASS")


def test_the_order_given_decides_where_the_shape_does_not():
    cube = np.array([[[1.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [0.0, 1.0]]])
    assert from_arrays(cube, order="SAS").mdp.branch_to_target.tolist() == [0, 0, 1, 1]
    assert from_arrays(cube, order="ASS").mdp.branch_to_target.tolist() == [0, 1, 0, 1]


def test_a_row_of_zeros_is_an_action_that_is_not_enabled_and_a_state_without_any_stays():
    transitions = np.zeros((3, 2, 3))
    transitions[0, 1, 2] = transitions[2, 0, 0] = 1
    problem = from_arrays(transitions, np.arange(6).reshape(3, 2), actions=["left", "right"], initial=[0, 2])
    mdp = problem.mdp
    assert [mdp.action_name(choice) for choice in range(mdp.choices)] == ["right", "choice 0", "left"]
    assert mdp.branch_to_target.tolist() == [2, 1, 0]
    assert mdp.rewards["reward"].choice.tolist() == [1, 0, 4]
    assert mdp.initial.tolist() == [0, 2]
    assert problem.notes == ("State 1 has no choice in the source and got a loop in place that earns nothing.",)


def test_numbers_at_actions_that_are_not_enabled_do_not_matter():
    transitions = np.zeros((2, 2, 2))
    transitions[0, 0, 1] = transitions[1, 0, 1] = 1
    rewards = {"r": [[1, np.nan], [2, -np.inf]], "t": np.where(transitions > 0, 3.0, np.nan)}
    mdp = from_arrays(transitions, rewards, order="SAS").mdp
    assert mdp.rewards["r"].choice.tolist() == [1, 2]
    assert mdp.rewards["t"].branch.tolist() == [3, 3]


def test_sparse_rewards_per_choice_are_taken():
    sparse = pytest.importorskip("scipy.sparse")
    mdp = from_arrays([np.eye(3), np.eye(3)], sparse.csr_array([[0, 1], [2, 0], [0, 3]])).mdp
    assert mdp.rewards["reward"].choice.tolist() == [0, 1, 2, 0, 0, 3]


def test_labels_are_truth_values_or_states():
    matrix = [np.eye(3)]
    mdp = from_arrays(
        matrix, labels={"mask": [True, False, True], "list": [1, 2], "none": [], "one": 2, "array": np.array([0])}
    ).mdp
    shown = {name: np.flatnonzero(mask).tolist() for name, mask in mdp.labels.items()}
    assert shown == {"mask": [0, 2], "list": [1, 2], "none": [], "one": [2], "array": [0]}


def test_without_initial_states_any_may_be_the_start():
    problem = from_arrays([np.eye(3)])
    assert problem.mdp.initial.tolist() == [0, 1, 2]
    assert "any state may be the start" in problem.notes[0]
    assert problem.mdp.actions == ("a0",)


def test_compressed_rows_are_taken_by_name():
    rows = {
        "state_to_choices": [0, 2, 3],
        "choice_to_branches": [0, 1, 3, 4],
        "branch_to_target": [0, 0, 1, 1],
        "branch_to_probability": [1, 0.1, 0.9, 1],
        "choice_to_action": [0, 1, 0],
    }
    mdp = from_arrays(
        **rows, actions=["wait", "go"], rewards={"time": {"choice": [1, 1, 0]}}, names=["here", "there"]
    ).mdp
    assert [mdp.action_name(choice) for choice in range(3)] == ["wait", "go", "wait"]
    assert mdp.names[1] == "there"
    assert mdp.rewards["time"].choice.tolist() == [1, 1, 0]
    assert from_arrays(**rows, rewards=Reward(state=np.ones(2))).mdp.rewards["reward"].state.tolist() == [1, 1]
    assert from_arrays(**rows, rewards={"branch": [1, 2, 3, 4]}).mdp.rewards["reward"].branch.tolist() == [1, 2, 3, 4]
    assert from_arrays(**rows).mdp.actions == ("a0", "a1")
    with pytest.raises(SourceError, match="missing: branch_to_probability"):
        from_arrays(**{name: value for name, value in rows.items() if name != "branch_to_probability"})
    with pytest.raises(SourceError, match="unknown: colour"):
        from_arrays(**rows, colour=1)
    with pytest.raises(SourceError, match="one form"):
        from_arrays(np.eye(2), **rows)
    with pytest.raises(SourceError, match="numbers below"):
        from_arrays(**rows | {"choice_to_action": [0, 2**32, 0]}, actions=["wait", "go"])
    with pytest.raises(ModelError, match="choice_to_branches must end at 4, got 5"):
        from_arrays(**rows | {"choice_to_branches": [0, 1, 3, 5]})


def test_arrays_that_fit_no_form_are_one_sentence():
    eye = np.eye(2)
    cases = [
        ((), {}),
        ((eye,), {}),
        ((np.zeros((2, 2, 3)),), {}),
        ((np.zeros((0, 0, 0)),), {}),
        ((np.zeros((1, 2, 2, 2)),), {}),
        (([[[1, 0], [1]]],), {}),
        (([["a", "b"], ["c", "d"]],), {}),
        (("text",), {}),
        (({1: 2},), {}),
        (([eye, np.eye(3)],), {}),
        (([eye], np.ones(3)), {}),
        (([eye], np.ones((1, 2, 3))), {}),
        (([eye], {"r": [np.eye(3)]}), {}),
        (([eye], "much"), {}),
        (([eye],), {"order": "AAS"}),
        (([eye],), {"labels": {"goal": [2]}}),
        (([eye],), {"labels": {"goal": [True]}}),
        (([eye],), {"labels": {"goal": [0.5]}}),
        (([eye],), {"labels": {"goal": ["here"]}}),
        (([eye],), {"initial": 2}),
        (([eye],), {"initial": -1}),
        (([eye],), {"initial": "here"}),
        (([eye],), {"initial": []}),
        (([eye],), {"names": ["only one"]}),
        (([eye, eye],), {"actions": ["only one"]}),
        ((eye, [1, 2]), {"s_indices": [0, 1]}),
        ((eye, [1, 2]), {"s_indices": [0, 2], "a_indices": [0, 0]}),
        ((eye, [1, 2]), {"s_indices": [0, 1], "a_indices": [0, -1]}),
        ((eye, [1, 2]), {"s_indices": [0], "a_indices": [0]}),
        ((eye, [1, 2]), {"s_indices": [0.0, 1.0], "a_indices": [0, 0]}),
        ((eye, [1, 2, 3]), {"s_indices": [0, 1], "a_indices": [0, 0]}),
        ((eye, [1, 2]), {"s_indices": [1, 1], "a_indices": [3, 3]}),
        (([[1, 0], [0, 0]], [1, 2]), {"s_indices": [0, 1], "a_indices": [0, 0]}),
    ]
    for arguments, options in cases:
        with pytest.raises(InputError) as caught:
            from_arrays(*arguments, **options)
        assert "\n" not in caught.value.message


SHAPES = [(), (0,), (1,), (2,), (3,), (2, 2), (2, 3), (2, 2, 2), (3, 2, 3), (0, 2)]
VALUES = [0, 1, -1, 2**62, 0.5, float("nan"), float("inf"), "x", None, True, 1j, np.uint64(2**63)]
ANYTHING = st.builds(np.full, st.sampled_from(SHAPES), st.sampled_from(VALUES)) | st.sampled_from(
    [np.eye(2), [np.eye(2)], [0, 1], 5]
)
FORMS = [
    {"transitions": [np.eye(2), np.eye(2)]},
    {"transitions": np.eye(2), "s_indices": [0, 1], "a_indices": [0, 0]},
    {
        "state_to_choices": [0, 1, 2],
        "choice_to_branches": [0, 1, 2],
        "branch_to_target": [0, 1],
        "branch_to_probability": [1, 1],
    },
]
NAMES = [
    "transitions",
    "rewards",
    "s_indices",
    "a_indices",
    "actions",
    "names",
    "initial",
    *FORMS[2],
    "choice_to_action",
]


@given(st.sampled_from(FORMS), st.dictionaries(st.sampled_from(NAMES), ANYTHING, max_size=3), ANYTHING)
def test_any_arrays_are_read_or_told(form, others, label):
    with contextlib.suppress(InputError):
        from_arrays(**form | others, labels={"some": label})
    with contextlib.suppress(InputError):
        assert from_arrays(**form | others).mdp.states > 0


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (0.5, "sum to 1, got 0.5 at action 'a0' of state 1"),
        (np.nan, "got nan at action 'a0' of state 1"),
        (-1.0, "got -1"),
    ],
)
def test_a_broken_row_is_told_with_its_place(entry, message):
    with pytest.raises(ModelError, match=message):
        from_arrays([[[1, 0], [0, entry]]], order="ASS")


def test_dense_arrays_do_not_load_scipy():
    import subprocess
    import sys

    code = (
        "import sys, numpy as np; from ratherthan.io.arrays import from_arrays;"
        "from_arrays(np.full((1, 2, 2), 0.5), order='ASS'); print('scipy' in sys.modules)"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
        == "False"
    )


# NumPy archives


@given(st.integers(0, 2**32), st.sampled_from(["deflate", "none"]))
def test_what_is_written_is_read_back_equal(tmp_path_factory, random_problem, assert_equal, seed, packing):
    problem = random_problem(seed)
    path = tmp_path_factory.mktemp("npz") / "model.npz"
    write_npz(problem, path, packing=packing)
    assert_equal(problem, read_npz(path))
    with np.load(path, allow_pickle=False) as arrays:
        assert arrays["branch_to_target"].tolist() == problem.mdp.branch_to_target.tolist()


def test_the_same_problem_gives_the_same_bytes(tmp_path, random_problem):
    for name in ("a.npz", "b.npz"):
        write_npz(random_problem(3), tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_an_unknown_packing_and_a_place_that_cannot_be_written_are_said(tmp_path, random_problem):
    with pytest.raises(SourceError, match="deflate, none"):
        write_npz(random_problem(0), tmp_path / "m.npz", packing="xz")
    with pytest.raises(SourceError, match="cannot be written"):
        write_npz(random_problem(0), tmp_path / "missing" / "m.npz")
    with pytest.raises(SourceError, match="is a folder"):
        write_npz(random_problem(0), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_other_forms_are_read_by_the_names_of_the_arguments(tmp_path, assert_equal):
    sas, per_choice, per_branch = random_dense(5)
    actions = [f"act {i}" for i in range(sas.shape[1])]
    names = [f"place {i}" for i in range(sas.shape[0])]
    np.savez(
        tmp_path / "dense.npz",
        transitions=sas,
        order="SAS",
        actions=actions,
        names=names,
        initial=0,
        **{"reward:time": per_choice, "reward:risk": per_branch, "label:goal": [0]},
    )
    expected = from_arrays(
        sas,
        {"time": per_choice, "risk": per_branch},
        order="SAS",
        actions=actions,
        names=names,
        initial=0,
        labels={"goal": [0]},
    )
    assert_equal(read_npz(tmp_path / "dense.npz"), expected)
    np.savez_compressed(
        tmp_path / "pairs.npz", transitions=np.eye(2), rewards=[1, 2], s_indices=[0, 1], a_indices=[0, 0]
    )
    assert_equal(read_npz(tmp_path / "pairs.npz"), from_arrays(np.eye(2), [1, 2], s_indices=[0, 1], a_indices=[0, 0]))


class Bomb:
    """Something that a pickle would run."""

    fired = False

    def __reduce__(self) -> tuple:
        return (setattr, (Bomb, "fired", True))


def test_a_pickle_is_refused_and_never_run(tmp_path):
    path = tmp_path / "pickle.npz"
    np.savez(path, transitions=np.array([Bomb()], dtype=object), allow_pickle=True)
    with pytest.raises(SourceError, match="pickled objects"):
        read_npz(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("transitions.npy", pickle.dumps(Bomb()))
    with pytest.raises(SourceError, match="whole zip archive of arrays"):
        read_npz(path)
    assert not Bomb.fired


def npy(array: np.ndarray, **header: object) -> bytes:
    """The bytes of a .npy file, with another header than the array's where asked for."""
    buffer = io.BytesIO()
    described = np.lib.format.header_data_from_array_1_0(array) | header
    np.lib.format.write_array_header_1_0(buffer, described)
    return buffer.getvalue() + array.tobytes()


def zipped(path: Path, members: dict[str, bytes], packing: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", packing) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


@pytest.mark.parametrize(
    "members",
    [
        {},
        {"readme.txt": b"hello"},
        {"transitions": npy(np.eye(2))},
        {"weights.npy": npy(np.eye(2))},
        {"transitions.npy": b""},
        {"transitions.npy": b"\x93NUMPY"},
        {"transitions.npy": npy(np.eye(2))[:-1]},
        {"transitions.npy": npy(np.eye(2)) + b"\x00"},
        {"transitions.npy": npy(np.eye(2), shape=(3, 2))},
        {"transitions.npy": npy(np.eye(2), shape=(-2, -2))},
        {"transitions.npy": npy(np.eye(2), shape=(10**9, 10**9))},
        {"transitions.npy": npy(np.eye(2), descr="|O")},
        {"transitions.npy": npy(np.eye(2), descr="|V0", shape=(10**18,))},
        {"transitions.npy": npy(np.eye(2), descr="<M8[s]")},
        {"transitions.npy": npy(np.full((1, 2, 2), 0.5)), "actions.npy": npy(np.arange(1))},
        {"transitions.npy": npy(np.full((1, 2, 2), 0.5)), "names.npy": npy(np.array("x"))},
        {"transitions.npy": npy(np.full((1, 2, 2), 0.5)), "order.npy": npy(np.arange(3))},
        {"transitions.npy": npy(np.full((1, 2, 2), 0.5)), "variable:x.npy": npy(np.arange(3))},
        {"transitions.npy": npy(np.full((1, 2, 2), 0.5)), "ratherthan/problem.json.npy": npy(np.arange(3.0))},
        {"state_to_choices.npy": npy(np.arange(3))},
        {
            "transitions.npy": npy(np.full((1, 2, 2), 0.5)),
            "rewards.npy": npy(np.ones(2)),
            "reward:r.npy": npy(np.ones(2)),
        },
    ],
    ids=range(21),
)
def test_a_broken_archive_is_one_sentence_with_its_name(tmp_path, members):
    path = zipped(tmp_path / "broken.npz", members)
    with pytest.raises(InputError) as caught:
        read_npz(path)
    assert str(path) in caught.value.message or caught.value.path == str(path)
    assert "\n" not in caught.value.message


@given(st.data())
def test_a_damaged_byte_is_one_sentence_or_does_no_harm(tmp_path_factory, random_problem, data):
    path = tmp_path_factory.mktemp("damage") / "m.npz"
    write_npz(random_problem(7), path)
    whole = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(whole)
    with contextlib.suppress(InputError):
        problem = read_npz(path)
        assert all(problem.mdp.names[state] for state in range(problem.mdp.states))


def test_a_cut_off_archive_and_another_kind_of_file_are_refused(tmp_path, random_problem):
    path = tmp_path / "m.npz"
    write_npz(random_problem(0), path)
    whole = path.read_bytes()
    for content in (whole[: len(whole) // 2], whole[:-1], b"hello", b"\x00" * 100, npy(np.eye(2))):
        path.write_bytes(content)
        with pytest.raises(SourceError, match="whole zip archive"):
            read_npz(path)


def test_a_bomb_is_refused_before_it_fills_the_memory(tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("transitions.npy", "w") as stream:
        shape = {"descr": "<f8", "fortran_order": False, "shape": (1, 3000, 3000)}
        np.lib.format.write_array_header_1_0(stream, shape)
        for _ in range(69):
            stream.write(b"\x00" * (1 << 20))
    tracemalloc.start()
    try:
        with pytest.raises(SourceError, match="times its size"):
            read_npz(path)
        assert tracemalloc.get_traced_memory()[1] < 32 << 20
    finally:
        tracemalloc.stop()


def test_a_limit_can_be_set(tmp_path, random_problem):
    write_npz(random_problem(0), tmp_path / "m.npz")
    with pytest.raises(SourceError, match="100 bytes of memory"):
        read_npz(tmp_path / "m.npz", limits=Limits(most_bytes=100))


def test_a_reward_may_hold_lists():
    rows = {
        "state_to_choices": [0, 2, 3],
        "choice_to_branches": [0, 1, 2, 3],
        "branch_to_target": [1, 0, 1],
        "branch_to_probability": [1, 1, 1],
    }
    for rewards in (Reward(choice=[1, 2, 0]), {"toll": Reward(choice=[1, 2, 0], state=(0, 5))}):
        (reward,) = from_arrays(**rows, rewards=rewards).mdp.rewards.values()
        assert reward.choice.tolist() == [1.0, 2.0, 0.0]
    for wrong, said in ((["a", 1, 2], "numbers"), ([1, 2], "must have 3 entries"), ([1, [2], 3], "toll")):
        with pytest.raises(InputError, match=said):
            from_arrays(**rows, rewards={"toll": Reward(choice=wrong)})
    for wrong in ("ab", [[1], [2, 3], 4], [None] * 3):
        with pytest.raises(ModelError, match="Reward 'toll' on choices must hold numbers"):
            MDP(**rows, initial=np.array([0]), rewards={"toll": Reward(choice=wrong)})

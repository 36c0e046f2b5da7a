"""Storm's explicit text format: what is written is read back, what Storm writes and reads is the same, faults have lines."""

from __future__ import annotations

import gzip
import io
import lzma
import tarfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.errors import InputError, ModelError, SourceError
from ratherthan.io.drn import AT_ONCE, read_drn, write_drn
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem

HEAD = "@type: MDP\n@parameters\n\n@reward_models\n{rewards}\n@nr_states\n{states}\n@nr_choices\n{choices}\n@model\n"
SMALL = """\
// made by hand
@type: MDP
@value_type: double
@parameters

@placeholders
$third : 1/3
$p2 : 6.6666666666666663e-1
@reward_models
time risk
@nr_states
3
@nr_choices
4
@model
state 0 [1.5, 0] init busy
//[	& !done	& x=0]
\taction wait [0, -2e-1]
\t\t0 : 1
\taction go [1, 0]
\t\t1 : $third
\t\t2 : $p2
state 1 [0, 0] "in the way"
//[!ok	& !done	& x=-1]
\taction __NOLABEL__ [0, 0]
\t\t1 : 1/2
\t\t2 : 0.5
state 2 goal "in the way"
//[	& done	& x=7]
\taction wait
\t\t2 : 1
"""


@pytest.fixture
def drn(tmp_path: Path) -> Callable[[str], Path]:
    """``drn(text)`` writes a file and returns its path."""

    def make(text: str, name: str = "model.drn") -> Path:
        path = tmp_path / name
        path.write_bytes(text.encode("utf-8"))
        return path

    return make


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        rt.read(path)
    assert "\n" not in caught.value.message
    assert str(path) in caught.value.message
    return caught.value.message


def without_branch_rewards(problem: Problem) -> Problem:
    """Fold what lies on branches into choices, and leave out parts that are 0: what the format can hold."""
    mdp = problem.mdp
    rewards = {}
    for name, reward in mdp.rewards.items():
        choice = reward.choice
        if reward.branch is not None:
            folded = [
                float(reward.branch[mdp.branches_of(c)] @ mdp.branch_to_probability[mdp.branches_of(c)])
                for c in range(mdp.choices)
            ]
            choice = np.array(folded) + (0 if choice is None else choice)
        rewards[name] = Reward(state=reward.state, choice=choice)
    return replace(problem, mdp=replace(mdp, rewards=rewards))


def test_what_is_read_is_what_it_says(drn):
    for path in (
        drn(SMALL),
        drn(SMALL, "model.txt"),
        drn(SMALL.replace("\n", "\r\n"), "dos.drn"),
        drn(SMALL.rstrip(), "end.drn"),
    ):
        problem = rt.read(path)
        mdp = problem.mdp
        assert (mdp.states, mdp.choices, mdp.branches) == (3, 4, 6)
        assert mdp.branch_to_target.tolist() == [0, 1, 2, 1, 2, 2]
        assert mdp.branch_to_probability.tolist() == [1, 1 / 3, 2 / 3, 0.5, 0.5, 1]
        assert mdp.actions == ("wait", "go")
        assert mdp.choice_to_action.tolist() == [0, 1, -1, 0]
        assert mdp.initial.tolist() == [0]
        assert {name: mask.tolist() for name, mask in mdp.labels.items()} == {
            "busy": [True, False, False],
            "in the way": [False, True, True],
            "goal": [False, False, True],
        }
        assert mdp.rewards["time"].state.tolist() == [1.5, 0, 0]
        assert mdp.rewards["time"].choice.tolist() == [0, 1, 0, 0]
        assert mdp.rewards["risk"].state is None
        assert mdp.rewards["risk"].choice.tolist() == [-0.2, 0, 0, 0]
        assert problem.notes == ()
        assert [mdp.names[s] for s in range(3)] == [
            "ok=true, done=false, x=0",
            "ok=false, done=false, x=-1",
            "ok=true, done=true, x=7",
        ]


def test_blocks_of_any_size_say_the_same(drn, monkeypatch, assert_equal):
    path = drn(SMALL)
    whole = read_drn(path)
    for size in (1, 2, 7, 50, 400):
        monkeypatch.setattr("ratherthan.io.drn.AT_ONCE", size)
        assert_equal(whole, read_drn(path))


def test_a_dtmc_gets_one_choice_per_state(drn):
    text = HEAD.format(rewards="", states=2, choices=2).replace("MDP", "DTMC")
    for body in (
        "state 0 init\n\taction 0\n\t\t0 : 0.5\n\t\t1 : 0.5\nstate 1\n\taction 0\n\t\t1 : 1\n",
        "state 0 init\n0:0.5\n1:0.5\nstate 1\n1:1\n",
    ):
        problem = rt.read(drn(text + body))
        assert problem.mdp.actions == ()
        assert problem.mdp.choice_to_action.tolist() == [-1, -1]
        assert any("DTMC" in note for note in problem.notes)
    assert "line 14: a DTMC must have one choice per state" in refusal(
        drn(text + "state 0 init\n\taction a\n\t\t1 : 1\n\taction b\n\t\t1 : 1\nstate 1\n\taction 0\n\t\t1 : 1\n")
    )


def test_actions_that_are_positions_have_no_name(drn):
    text = (
        HEAD.format(rewards="", states=1, choices=2) + "state 0 init\n\taction {}\n\t\t0 : 1\n\taction {}\n\t\t0 : 1\n"
    )
    assert rt.read(drn(text.format("0", "1"))).mdp.actions == ()
    assert rt.read(drn(text.format("1", "0"))).mdp.actions == ("1", "0")
    assert rt.read(drn(text.format("0", "a"))).mdp.actions == ("0", "a")
    assert rt.read(drn(text.format("a b", "c"))).mdp.actions == ("a b", "c")


def test_rewards_are_told_by_their_place(drn):
    body = "state 0 [2] init\n\taction a [1]\n\t\t0 : 1\n"
    for names, expected in ((" ", "reward"), ("", "rew0"), ("r", "r"), ("r ", "r")):
        rewards = rt.read(drn(HEAD.format(rewards=names, states=1, choices=1) + body)).mdp.rewards
        assert list(rewards) == [expected]
        assert rewards[expected].state.tolist() == [2]
        assert rewards[expected].choice.tolist() == [1]
    rewards = rt.read(drn(HEAD.format(rewards="r s t", states=1, choices=1) + body.replace("[1]", "[1,3]"))).mdp.rewards
    assert list(rewards) == ["r", "s", "t"]
    assert rewards["s"].choice.tolist() == [3]
    assert dict(rewards["t"].parts()) == {}


def test_a_state_without_choices_gets_a_loop_and_a_note(drn):
    problem = rt.read(
        drn(
            HEAD.format(rewards="r", states=3, choices=3)
            + "state 0 [1] init\n\taction a [2]\n\t\t1 : 1\nstate 1\nstate 2\n\taction b [4]\n\t\t2 : 1\n"
        )
    )
    assert problem.mdp.branch_to_target.tolist() == [1, 1, 2]
    assert problem.mdp.rewards["r"].choice.tolist() == [2, 0, 4]
    assert "State 1 has no choice in the source" in problem.notes[0]


def test_no_initial_state_means_any(drn):
    problem = rt.read(drn(HEAD.format(rewards="", states=2, choices=2) + "state 0\n0 : 1\nstate 1\n1 : 1\n"))
    assert problem.mdp.initial.tolist() == [0, 1]
    assert any("initial" in note for note in problem.notes)


def test_probabilities_with_six_digits_are_rescaled_with_a_note(drn):
    text = (
        HEAD.format(rewards="", states=3, choices=3)
        + "state 0 init\n\taction a\n\t\t0 : 0.333333\n\t\t1 : 0.333333\n\t\t2 : 0.333333\nstate 1\n1 : 1\nstate 2\n2 : 1\n"
    )
    problem = rt.read(drn(text))
    assert problem.mdp.branch_to_probability[:3].tolist() == [1 / 3] * 3
    assert "one choice are written with few digits" in problem.notes[0]
    assert "line 12: the probabilities of a choice must sum to 1, got 0.99999" in refusal(
        drn(text.replace("0.333333", "0.33333"))
    )


@pytest.mark.parametrize("seed", range(40))
def test_what_is_written_is_read_back(seed, tmp_path, random_problem, assert_equal):
    problem = without_branch_rewards(random_problem(seed))
    path = tmp_path / "model.drn"
    rt.write(problem, path)
    again = rt.read(path)
    if problem.mdp.names.strings is not None or "text" in problem.mdp.names.variables:
        assert not again.mdp.names.named
        problem = replace(problem, mdp=replace(problem.mdp, names=StateNames(count=problem.mdp.states)))
    kept = Problem(mdp=problem.mdp)
    assert_equal(kept, Problem(mdp=again.mdp))
    rt.write(again, tmp_path / "again.drn")
    assert (tmp_path / "again.drn").read_bytes() == path.read_bytes()


def test_a_reward_on_branches_keeps_every_value(tmp_path, random_problem):
    problem = random_problem(3)
    values = np.arange(problem.mdp.branches) % 5 / 4
    mdp = replace(
        problem.mdp, rewards={"cost": Reward(branch=values)}, labels={"goal": np.arange(problem.mdp.states) == 0}
    )
    rt.write(Problem(mdp=mdp), tmp_path / "m.drn")
    back = rt.read(tmp_path / "m.drn")
    asked = 'R{"cost"}min=? [F "goal"]'
    left, right = (rt.solve(replace(p, objective=rt.parse_property(asked, p))).values for p in (Problem(mdp=mdp), back))
    np.testing.assert_allclose(left, right, rtol=1e-12)


def test_packed_files_are_read(tmp_path, assert_equal):
    plain = tmp_path / "m.drn"
    plain.write_text(SMALL)
    expected = rt.read(plain)
    archive = io.BytesIO()
    with tarfile.open(fileobj=archive, mode="w:gz") as tar:
        tar.add(plain, "m.drn")
    for name, data in {
        "m.drn.gz": gzip.compress(SMALL.encode()),
        "m.drn.xz": lzma.compress(SMALL.encode()),
        "tar.drn.gz": archive.getvalue(),
        "really-plain.drn.gz": SMALL.encode(),
    }.items():
        (tmp_path / name).write_bytes(data)
        assert_equal(expected, rt.read(tmp_path / name))
    (tmp_path / "cut.drn.gz").write_bytes(gzip.compress(SMALL.encode())[:-20])
    assert "breaks off" in refusal(tmp_path / "cut.drn.gz")
    with tarfile.open(tmp_path / "two.drn.gz", "w:gz") as tar:
        tar.add(plain, "a.drn")
        tar.add(plain, "b.drn")
    assert "one file" in refusal(tmp_path / "two.drn.gz")


@pytest.mark.slow
def test_a_bomb_is_refused(tmp_path):
    (tmp_path / "bomb.drn.gz").write_bytes(gzip.compress(SMALL.encode() + b"\n" * (100 << 20)))
    assert "must unpack to at most" in refusal(tmp_path / "bomb.drn.gz")


def changed(old: str, new: str) -> str:
    assert old in SMALL
    return SMALL.replace(old, new, 1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (changed("MDP", "CTMC"), ["line 2", "continuous-time Markov chain"]),
        (changed("MDP", "Markov Automaton"), ["line 2", "Markov automaton"]),
        (changed("MDP", "POMDP"), ["line 2", "partially observable"]),
        (changed("MDP", "SMG"), ["line 2", "game"]),
        (changed("MDP", "XYZ"), ["line 2", "'XYZ'"]),
        (changed("@type: MDP\n", ""), ["'@type: MDP'"]),
        (changed("@type: MDP\n", "@type: MDP\n@type: MDP\n"), ["line 3", "'@type' must stand once"]),
        (changed(": double", ": double-interval"), ["line 3", "intervals"]),
        (changed(": double", ": parametric"), ["line 3", "parameters"]),
        (changed(": double", ": float128"), ["line 3", "float128"]),
        (changed("@parameters\n\n", "@parameters\np q \n"), ["line 5", "parameters p q"]),
        (changed("$third : 1/3", "third : 1/3"), ["line 7", "placeholder"]),
        (changed("$third : 1/3", "$third : x"), ["line 7", "'x'"]),
        (changed("$third : 1/3", "$third : 1/0"), ["line 7", "1/0"]),
        (changed("$third : 1/3", "$p2 : 1/3"), ["line 8", "$p2"]),
        (changed("time risk", "time time"), ["line 10", "differ"]),
        (changed("@nr_states\n3", "@nr_states\nthree"), ["line 12", "three"]),
        (changed("@nr_states\n3", "@nr_states\n4"), ["4 states", "has 3"]),
        (changed("@nr_states\n3", "@nr_states\n2"), ["2 states", "has 3"]),
        (changed("@nr_choices\n4", "@nr_choices\n5"), ["5 choices", "has 4"]),
        (changed("@nr_choices", "@nr_actions"), ["line 13", "@nr_actions"]),
        (changed("@nr_choices", "nr_choices"), ["line 13", "begin with @"]),
        (changed("@model\n", ""), ["line 15", "begin with @"]),
        (SMALL[: SMALL.index("@model")], ["@model"]),
        (SMALL[: SMALL.index("state 0")], ["3 states", "has 0"]),
        (SMALL[: SMALL.index("state 2")], ["3 states", "has 2"]),
        (SMALL[: SMALL.index("\taction wait\n")], ["4 choices", "has 3"]),
        (changed("state 0", "stat 0"), ["line 16", "'stat 0"]),
        (changed("state 0 [1.5, 0] init busy\n", ""), ["first line after @model", "state 0"]),
        (changed("state 1", "state 2"), ["line 23", "'state 1'", "'state 2"]),
        (changed("state 1", "state 10"), ["line 23", "'state 1'", "'state 10"]),
        (changed("action go", "actions go"), ["line 20", "actions go"]),
        (changed("\t\t2 : $p2", "\t\t3 : $p2"), ["line 22", "0 … 2", "got 3"]),
        (changed("\t\t2 : $p2", "\t\t-1 : $p2"), ["line 22", "'-1 : $p2'"]),
        (changed("\t\t2 : $p2", "\t\t99999999999999999999 : $p2"), ["line 22"]),
        (changed("\t\t2 : $p2", "\t\t2 : $p3"), ["line 22", "no such placeholder"]),
        (changed("\t\t2 : $p2", "\t\t2 : 0.6"), ["line 20", "sum to 1", "0.9333333333", "state 0"]),
        (changed("\t\t2 : $p2", "\t\t2 : 2 : 3"), ["line 22", "'2 : 2 : 3'"]),
        (changed("\t\t2 : $p2", "\t\t2"), ["line 22", "'2'"]),
        (changed("\t\t2 : $p2", "\t\t2 :"), ["line 22", "'2 :'"]),
        (changed("\t\t2 : $p2", "\t\t2 : [0.1, 0.9]"), ["line 22", "Intervals"]),
        (changed("2 : 0.5", "2 : 1.5"), ["line 27", "between 0 and 1", "1.5"]),
        (changed("2 : 0.5", "2 : -0.5"), ["line 27", "between 0 and 1", "-0.5"]),
        (changed("2 : 0.5", "2 : nan"), ["line 27", "nan"]),
        (changed("2 : 0.5", "2 : inf"), ["line 27", "inf"]),
        (changed("2 : 0.5", "2 : 1e999"), ["line 27", "1e999"]),
        (changed("2 : 0.5", "2 : 0_5"), ["line 27", "0_5"]),
        (changed("2 : 0.5", "2 : p"), ["line 27", "'2 : p'"]),
        (changed("[1, 0]", "[1, nan]"), ["line 20", "finite", "1, nan"]),
        (changed("[1.5, 0]", "[1.5; 0]"), ["line 16", "finite"]),
        (changed("[1.5, 0]", "[inf, 0]"), ["line 16", "finite"]),
        (changed('"in the way"', '"in the way'), ["line 23", "double quotes"]),
        (changed("\t\t0 : 1\n", ""), ["line 18", "must have a branch"]),
        (changed("// made by hand", "// ratherthan: [1]"), ["line 1", "pairs of names"]),
        (changed("// made by hand", '// ratherthan: {"labels":[["a","b"],["a","c"]]}'), ["line 1", "each once"]),
        ("hello\n", ["begin with @"]),
        ("@type: MDP\x00", ["binary"]),
    ],
)
def test_a_fault_is_one_sentence_with_its_line(drn, text, words):
    message = refusal(drn(text))
    for word in words:
        assert word in message


def test_every_cut_is_noticed_or_harmless(drn):
    """A file that breaks off says so, unless nothing but the end of its last line is missing."""
    whole = rt.read(drn(SMALL)).mdp
    for end in range(len(SMALL) - 1):
        path = drn(SMALL[:end], "cut.drn")
        if end == 0 or SMALL[end:].strip() == "":
            continue
        with pytest.raises((SourceError, ModelError)) as caught:
            rt.read(path)
        assert "\n" not in caught.value.message
    assert rt.read(drn(SMALL[:-1])).mdp.branches == whole.branches


def test_constants_are_refused(drn):
    with pytest.raises(SourceError, match="constants"):
        rt.read(drn(SMALL), constants="N=3")
    with pytest.raises(SourceError, match="no constants"):
        read_drn(drn(SMALL), constants={"N": 3})


def test_comments_that_name_not_every_state_are_passed_over(drn):
    for text in (
        changed("//[	& done	& x=7]\n", ""),
        changed("x=7", "y=7"),
        changed("x=7", "x=left"),
        changed("	& x=7", ""),
    ):
        assert not rt.read(drn(text)).mdp.names.named


def test_a_large_model_is_read_and_written_soon(tmp_path):
    rng = np.random.default_rng(1)
    states = 20_000
    choices, branches = 2 * states, 6 * states
    probability = rng.random(branches)
    probability /= np.repeat(np.add.reduceat(probability, np.arange(0, branches, 3)), 3)
    mdp = MDP(
        state_to_choices=np.arange(0, choices + 1, 2),
        choice_to_branches=np.arange(0, branches + 1, 3),
        branch_to_target=rng.integers(states, size=branches),
        branch_to_probability=probability,
        choice_to_action=np.tile([0, 1], states),
        actions=("a", "b"),
        labels={"goal": rng.random(states) < 0.01},
        rewards={"cost": Reward(choice=rng.random(choices))},
        initial=np.array([0]),
    )
    write_drn(Problem(mdp=mdp), tmp_path / "m.drn")
    again = read_drn(tmp_path / "m.drn").mdp
    assert (tmp_path / "m.drn").stat().st_size < AT_ONCE * 10
    np.testing.assert_array_equal(mdp.branch_to_target, again.branch_to_target)
    np.testing.assert_array_equal(mdp.branch_to_probability, again.branch_to_probability)
    np.testing.assert_array_equal(mdp.rewards["cost"].choice, again.rewards["cost"].choice)


# Storm reads what is written, and what Storm writes is read


@pytest.mark.parametrize("seed", range(12))
def test_storm_reads_the_same_model(seed, tmp_path, random_problem):
    stormpy = pytest.importorskip("stormpy")
    problem = without_branch_rewards(random_problem(seed))
    mdp = problem.mdp
    path = tmp_path / "m.drn"
    rt.write(problem, path)
    options = stormpy.io.DirectEncodingParserOptions()
    options.build_choice_labeling = True
    model = stormpy.build_model_from_drn(str(path), options=options)
    assert (model.nr_states, model.nr_choices) == (mdp.states, mdp.choices)
    assert list(model.initial_states) == mdp.initial.tolist()
    for choice in range(mdp.choices):
        expected: dict[int, float] = {}
        own = mdp.branches_of(choice)
        for target, chance in zip(
            mdp.branch_to_target[own].tolist(), mdp.branch_to_probability[own].tolist(), strict=True
        ):
            expected[target] = expected.get(target, 0.0) + chance
        found = {entry.column: entry.value for entry in model.transition_matrix.get_row(choice)}
        assert found == pytest.approx(expected, rel=1e-15)
        named = mdp.choice_to_action[choice] >= 0 or not mdp.actions
        assert bool(model.choice_labeling.get_labels_of_choice(choice)) == named
    held = dict(model.reward_models.items())
    for spelled, reward in zip(sorted(held), [mdp.rewards[name] for name in sorted(mdp.rewards)], strict=True):
        for part, values in (("state", reward.state), ("choice", reward.choice)):
            has = held[spelled].has_state_rewards if part == "state" else held[spelled].has_state_action_rewards
            assert has == (values is not None)
            if has:
                got = held[spelled].state_rewards if part == "state" else held[spelled].state_action_rewards
                assert list(got) == values.tolist()
    marked = [label for s in range(mdp.states) for label in model.labeling.get_labels_of_state(s) if label != "init"]
    counts = sorted(int(np.count_nonzero(mask)) for mask in mdp.labels.values() if mask.any())
    assert counts == sorted(marked.count(label) for label in set(marked))


PRISM = """
mdp
module a
  ok : bool init true;
  x : [-1..2] init 0;
  [go] x<2 -> 1/3: (x'=x+1) + 2/3: true;
  [go] x<2 -> 0.5: (x'=x+1) + 0.5: (ok'=false);
  [] x<2 -> 1: (x'=2);
  [rest] x=2 -> true;
endmodule
rewards "time" x<2 : 1.5; [go] true: 0.25; endrewards
rewards "risk" ok : 1; endrewards
label "goal" = x=2;
"""


def test_what_storm_writes_is_the_model_it_built(tmp_path, assert_equal):
    stormpy = pytest.importorskip("stormpy")
    source = tmp_path / "m.prism"
    source.write_text(PRISM)
    built = rt.read(source)
    options = stormpy.BuilderOptions()
    options.set_build_all_labels()
    options.set_build_all_reward_models()
    options.set_build_state_valuations()
    options.set_build_choice_labels()
    model = stormpy.build_model(stormpy.parse_prism_program(str(source), simplify=False), options=options)
    stormpy.io.export_to_drn(model, str(tmp_path / "m.drn"))
    found = rt.read(tmp_path / "m.drn")
    np.testing.assert_allclose(found.mdp.branch_to_probability, built.mdp.branch_to_probability, atol=1e-9)
    labels = {name: mask for name, mask in built.mdp.labels.items() if mask.any()}
    rewards = {name: built.mdp.rewards[name] for name in found.mdp.rewards}
    like = replace(built.mdp, labels=labels, rewards=rewards, branch_to_probability=found.mdp.branch_to_probability)
    assert_equal(Problem(mdp=like), Problem(mdp=found.mdp))
    asked = 'R{"time"}min=? [F "goal"]'
    left, right = (rt.solve(replace(p, objective=rt.parse_property(asked, p))).values for p in (built, found))
    np.testing.assert_allclose(left, right, rtol=1e-6)

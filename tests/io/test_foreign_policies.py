"""Policies made by others: Storm's schedulers, PRISM's strategies, functions and agents, fitted to the model or refused."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import ratherthan as rt
from ratherthan.errors import InputError
from ratherthan.io.policies import read_policy
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.names import StateNames


def model(**changes: object) -> MDP:
    """Four states in Storm's order, x=0 ok, x=1 not ok, x=1 ok, x=0 not ok; `go` twice in the first, a nameless choice in the third."""
    fields = {
        "state_to_choices": np.array([0, 3, 5, 7, 8]),
        "choice_to_branches": np.array([0, 2, 3, 4, 5, 6, 7, 8, 9]),
        "branch_to_target": np.array([1, 2, 2, 3, 0, 2, 3, 0, 3]),
        "branch_to_probability": np.array([1 / 3, 2 / 3, 1, 1, 1, 1, 1, 1, 1]),
        "choice_to_action": np.array([0, 0, 1, 0, 1, -1, 1, 2]),
        "actions": ("go", "back", "rest"),
        "initial": np.array([0]),
        "names": StateNames(
            count=4, variables={"ok": np.array([True, False, True, False]), "x": np.array([0, 1, 1, 0])}
        ),
    }
    return MDP(**fields | changes)


def numbered(**changes: object) -> MDP:
    """The same with two whole numbers as variables, y=1 where it was ok, so that PRISM's order is known: 3, 0, 1, 2."""
    variables = {"x": np.array([0, 1, 1, 0]), "y": np.array([1, 0, 1, 0])}
    return model(**{"names": StateNames(count=4, variables=variables)} | changes)


@pytest.fixture
def file(tmp_path: Path) -> Callable[[str, str], Path]:
    """``file(name, text)`` writes a file and returns its path."""

    def make(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return make


def refusal(source: object, mdp: MDP) -> str:
    with pytest.raises(InputError) as caught:
        read_policy(source, mdp)
    assert "\n" not in caught.value.message
    return caught.value.message


# Storm


def entry(state: object, *choices: dict[str, object]) -> dict[str, object]:
    return {"s": state, "c": list(choices)}


@pytest.mark.parametrize(
    "entries",
    [
        [entry(0, {"index": 1}), entry(1, {"index": 4}), entry(2, {"index": 5}), entry(3, {"index": 7})],
        [
            entry(0, {"index": 1, "labels": ["go"]}),
            entry(1, {"index": 4, "labels": ["back"], "prob": 1.0}),
            entry(2, {"index": 5, "labels": []}),
        ],
        [  # by the values of variables the model may be numbered otherwise: names decide
            entry({"ok": True, "x": 0}, {"index": 1, "labels": ["go"]}),
            entry({"x": 1, "ok": False}, {"index": 99, "labels": ["back"]}),
            entry({"ok": True, "x": 1}, {"index": 42, "labels": [], "prob": "1/1"}),
        ],
        [
            entry(0, {"index": 1, "origin": {"action-label": "go"}}),
            entry(1, {"index": 4}),
            entry(2, {"index": 5, "origin": {"action-label": ""}}),
            {"s": 3, "c": "undefined"},
        ],
    ],
)
def test_storms_json_names_states_and_choices_in_many_ways(file, entries):
    for name in ("scheduler.json", "scheduler.txt"):
        policy = read_policy(file(name, json.dumps(entries)), model())
        assert policy.choice.tolist() == [1, 4, 5, 7]
        assert policy.chance is None


def test_storms_randomised_choices_are_kept(file):
    entries = [entry(0, {"index": 0, "prob": 0.25}, {"index": 2, "prob": "3/4"}), entry(1, {"index": 3})]
    policy = read_policy(file("s.json", json.dumps(entries)), model())
    assert policy.chance.tolist() == [0.25, 0, 0.75, 1, 0, 0, 0, 1]
    text = "Fully defined memoryless randomized scheduler:\nmodel state:    choice(s)\n   0    0.25: (0 {go})   +    3/4: (2 {go})\n   1    0 {go}\n"
    assert read_policy(file("s.txt", text), model()).chance.tolist() == policy.chance.tolist()


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ([entry(9, {"index": 0})], ["no state fits 9", "4 states", "another model"]),
        ([entry({"x": 5, "ok": True}, {"index": 0})], ["x=5, ok=True", "ok, x"]),
        ([entry({"y": 5}, {"index": 0})], ["y=5"]),
        ([entry({"x": 1}, {"index": 0})], ["several states fit", "x=1"]),
        ([entry({"x": 1}, {"labels": ["back"]})], ["several states fit", "x=1"]),
        ([entry(0, {"index": 3})], ["state 0", "choices 0 … 2", "number 3"]),
        ([entry(0, {"index": 1, "labels": ["back"]})], ["number 1", "back"]),
        ([entry(1, {"index": 3, "labels": ["fly"]})], ["'go', 'back'", "fly"]),
        ([entry({"x": 0, "ok": True}, {"labels": ["go"]})], ["'go', 'go (2)', 'back'", "with the action go"]),
        ([entry(0, {"index": 0, "prob": 0.5})], ["sum to 1", "0.5"]),
        ([entry(0, {"index": 0, "prob": -1})], ["between 0 and 1"]),
        ([entry(0, {"index": 0, "prob": "x"})], ["'x'"]),
        ([entry(0, {"index": 0}), entry(0, {"index": 1})], ["twice"]),
        ([{"s": 0, "c": 7}], ["'c'", "7"]),
        ([{"s": 0, "c": [7]}], ["'c'"]),
        ([{"s": True, "c": []}], ["True"]),
        ([{"s": 0, "m": 0, "c": [{"index": 0}]}, {"s": 0, "m": 1, "c": [{"index": 1}]}], ["memory"]),
    ],
)
def test_a_scheduler_that_does_not_fit_is_told(file, entries, words):
    message = refusal(file("s.json", json.dumps(entries)), model())
    for word in words:
        assert word in message


TEXT = """
___________________________________________________________________
Fully defined memoryless deterministic scheduler:
        model state:    choice(s)
  0: [	& x=0]    1 {go}
  1: [!ok	& x=1]    1 {back}
  2: [ok	& x=1]    0 {}
Skipped 1 deterministic states with unique choice.
___________________________________________________________________
"""


def test_storms_text_is_read(file):
    for text in (TEXT, TEXT.replace(" {go}", "").replace(" {back}", "").replace(" {}", "")):
        assert read_policy(file("scheduler", text), model()).choice.tolist() == [1, 4, 5, 7]
    undefined = TEXT.replace("0 {}", "undefined.").replace("Fully", "Partially")
    assert read_policy(file("scheduler", undefined), model()).choice.tolist() == [1, 4, -1, 7]
    origin = TEXT.replace("1 {back}", "back (m: [back] ((x > 0)) -> 1 : (x' = 0);) {back}")
    assert read_policy(file("scheduler", origin), model()).choice.tolist() == [1, 4, 5, 7]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("  0: ", "  7: ", ["line 5", "0 … 3", "7"]),
        ("x=0]", "x=1]", ["line 5", "x=1", "JSON"]),
        ("[!ok", "[ok", ["line 6", "JSON"]),
        ("1 {go}", "1 {back}", ["line 5", "'go', 'go (2)', 'back'", "1 {back}"]),
        ("1 {back}", "2 {back}", ["line 6"]),
        ("1 {go}", "go (m: [go] true;) {go}", ["line 5", "several"]),
        ("1 {go}", "somewhere", ["line 5", "none"]),
        ("  0: [	& x=0]    1 {go}", "nonsense", ["line 5", "nonsense"]),
        ("memoryless deterministic scheduler", "deterministic scheduler with 2 memory states", ["memory"]),
    ],
)
def test_a_scheduler_as_text_that_does_not_fit_is_told(file, old, new, words):
    assert old in TEXT
    message = refusal(file("scheduler.txt", TEXT.replace(old, new, 1)), model())
    for word in words:
        assert word in message


PRISM = """
mdp
module a
  ok : bool init true;
  x : [-1..3] init 0;
  y : [0..1] init 0;
  [go] x<3 -> 1/3: (x'=x+1) + 2/3: true;
  [go] x<3 -> 0.5: (x'=x+1) + 0.5: (ok'=false);
  [] x<3 & y=0 -> 0.9: (y'=1) + 0.1: (x'=3);
  [fall] x<3 -> (x'=-1);
  [rest] x=3 -> true;
endmodule
rewards "time" x<3 : 1; [go] true: 0.25; endrewards
label "goal" = x=3;
"""


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("form", ["json", "text"])
@pytest.mark.parametrize("asked", ['R{"time"}min=? [F "goal"]', 'Pmin=? [F "goal"]'])
def test_a_scheduler_from_storm_attains_what_storm_says(tmp_path, form, named, asked):
    stormpy = pytest.importorskip("stormpy")
    source = tmp_path / "m.prism"
    source.write_text(PRISM)
    problem = rt.read(source, objective=asked)
    program = stormpy.parse_prism_program(str(source), simplify=False)
    options = stormpy.BuilderOptions()
    options.set_build_all_labels()
    options.set_build_all_reward_models()
    if named:
        options.set_build_state_valuations()
        options.set_build_choice_labels()
    built = stormpy.build_model(program, options=options)
    result = stormpy.model_checking(built, stormpy.parse_properties(asked, program)[0], extract_scheduler=True)
    scheduler, value = result.get_scheduler(), float(result[int(problem.mdp.initial[0])])
    (tmp_path / "p.json").write_text(scheduler.to_json_str(built, skip_unique_choices=True))
    (tmp_path / "p.txt").write_text(scheduler.to_str(built, skip_unique_choices=True))
    policy = rt.read_policy(tmp_path / ("p.json" if form == "json" else "p.txt"), problem.mdp)
    found = rt.evaluate(problem, policy)
    start = int(problem.mdp.initial[0])
    assert found.policy_values[0][start] == pytest.approx(value, rel=1e-5)
    assert found.policy_values[0][start] == pytest.approx(found.values[0][start], rel=1e-5)


def test_a_scheduler_of_a_model_with_named_places_fits(tmp_path, shared_data):
    stormpy = pytest.importorskip("stormpy")
    source = shared_data / "models" / "qvbs" / "beb" / "beb.3-4.jani"
    problem = rt.read(source, constants="N=3")
    jani, _ = stormpy.parse_jani_model(str(source), property_filter=[])
    jani, _ = stormpy.instantiate_constants(jani, {"N": 3})
    options = stormpy.BuilderOptions()
    options.set_build_all_labels()
    options.set_build_state_valuations()
    options.set_build_choice_labels()
    built = stormpy.build_model(jani, options=options)
    asked = stormpy.parse_properties('Pmax=? [F "deadlock"]')[0]
    scheduler = stormpy.model_checking(built, asked, extract_scheduler=True).get_scheduler()
    (tmp_path / "p.txt").write_text(scheduler.to_str(built))
    by_text = rt.read_policy(tmp_path / "p.txt", problem.mdp)
    assert (by_text.choice >= 0).all()
    (tmp_path / "p.json").write_text(scheduler.to_json_str(built))
    assert rt.read_policy(tmp_path / "p.json", problem.mdp).choice.tolist() == by_text.choice.tolist()


# PRISM


@pytest.mark.parametrize(
    "text",
    [
        "(true,0)=back\n(false,1)=back\n(true,1)=\n",
        "(0,true):back\n(1,false):back\n(1,true):\n",
        "(ok=true,x=0)=back\n(x=1,ok=false)=back\n(x=1, ok=true)=null\n(ok=false,x=0)=rest\n",
        "# strategy\n\n(true,0)=2\n(false,1)=1\n(true,1)=0\n",
        "(true,0)={2=1.0}\n(false,1)=1.0:back\n(true,1)={0=1}\n(false,0)=?\n",
    ],
)
def test_prisms_lists_name_states_by_their_variables(file, text):
    for name in ("strategy.txt", "strategy", "adv.prism-strategy"):
        policy = read_policy(file(name, text), model())
        assert policy.choice.tolist() == [2, 4, 5, 7]
        assert policy.chance is None


MIXED = """mdp
global lamp : bool init true;
module walker
  x : [0..2] init 0;
  tired : bool init false;
  [go] x<2 & !tired -> 0.5 : (x'=x+1) + 0.5 : (tired'=true);
  [rest] tired -> (tired'=false) & (lamp'=false);
  [stay] true -> true;
endmodule
module other = walker [x=y, tired=weary, go=run, rest=doze, stay=sit] endmodule
"""


def test_a_program_tells_in_which_order_prism_numbers_its_states(file, tmp_path):
    pytest.importorskip("stormpy")
    (tmp_path / "mixed.prism").write_text(MIXED)
    mdp = rt.read(tmp_path / "mixed.prism").mdp
    names = ["lamp", "x", "tired", "y", "weary"]
    assert list(mdp.names.variables) == names  # Storm lists truth values first
    columns = [np.asarray(mdp.names.variables[name]).tolist() for name in names]
    states = sorted(range(mdp.states), key=lambda s: [column[s] for column in columns])
    wanted = ["stay" if column else "sit" for column in columns[2]]
    by_number = "".join(f"{i}={wanted[s]}\n" for i, s in enumerate(states))
    shown = [",".join(str(column[s]).lower() for column in columns) for s in range(mdp.states)]
    by_values = "".join(f"({shown[s]})={wanted[s]}\n" for s in states)
    policy = read_policy(file("numbers.txt", by_number), mdp)
    assert policy.choice.tolist() == read_policy(file("values.txt", by_values), mdp).choice.tolist()
    assert [mdp.action_name(choice) for choice in policy.choice] == wanted
    branches = [(i, states.index(s), wanted[s]) for i, s in enumerate(states)]
    induced = f"{mdp.states} {mdp.states}\n" + "".join(f"{i} {i} 1 {name}\n" for i, _, name in branches)
    assert read_policy(file("induced.tra", induced), mdp).choice.tolist() == policy.choice.tolist()


def test_prism_numbers_states_in_the_order_of_their_variables(file):
    text = "0=rest\n1=back\n2=back\n3=\n"
    assert read_policy(file("s.txt", text), numbered()).choice.tolist() == [2, 4, 5, 7]
    plain = model(names=StateNames(count=4))
    assert read_policy(file("s.txt", "0=back\n1=back\n2=\n3=rest\n"), plain).choice.tolist() == [2, 4, 5, 7]
    assert "cannot be known from this model" in refusal(file("s.txt", text), model())
    declared = model(
        names=StateNames(count=4, variables={"x": np.array([0, 1, 1, 0]), "ok": np.array([True, False, True, False])})
    )
    assert read_policy(file("s.txt", text), declared).choice.tolist() == [2, 4, 5, 7]


def test_prisms_randomised_choices_are_kept(file):
    text = "(true,0)=0.25:go+0.75:back\n(false,1)={0=0.5, 1=0.5}\n(true,1)=0.125:null+0.875:back\n"
    distinct = model(choice_to_action=np.array([0, 2, 1, 0, 1, -1, 1, 2]))
    policy = read_policy(file("s.txt", text), distinct)
    assert policy.chance.tolist() == [0.25, 0, 0.75, 0.5, 0.5, 0.125, 0.875, 1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("(true,0)=go\n", ["line 1", "2 choices of state 0", "type=induced"]),
        ("(true,5)=go\n", ["line 1", "(true,5)", "ok, x", "another model"]),
        ("(0)=go\n", ["line 1", "(0)"]),
        ("(1,2)=go\n", ["line 1"]),
        ("(x=1)=go\n", ["line 1", "several states"]),
        ("(z=1)=go\n", ["line 1", "no state"]),
        ("(true,0)=back\n(false,1)=rest\n", ["line 2", "'go', 'back'", "'rest' is not enabled there"]),
        ("(false,1)=fly\n", ["line 1", "'fly' is no action"]),
        ("(false,1)=7\n", ["line 1", "'7'"]),
        ("(false,1)={7=1}\n", ["line 1", "7"]),
        ("(true,0)=back\nnonsense\n", ["line 2", "nonsense"]),
        ("(true,0),0=back\n(true,0),1=go\n", ["line 1", "memory"]),
        ("0,3=back\n", ["line 1", "memory"]),
        ("(false,1)=0.5:go+0.6:back\n", ["sum to 1", "1.1"]),
        ("(false,1)=1.5:go\n", ["line 1", "between 0 and 1"]),
        ("(false,1)=go\n(false,1)=back\n", ["twice"]),
        ("digraph G {\n}\n", ["drawing"]),
    ],
)
def test_a_strategy_that_does_not_fit_is_told(file, text, words):
    message = refusal(file("s.txt", text), model())
    for word in words:
        assert word in message


INDUCED = """# Transitions (DTMC)
4 5
0 0 1 rest
1 2 0.333333 go
1 3 0.666667 go
2 1 1 go
3 1 1 back
"""


def test_an_induced_model_tells_choices_by_where_they_lead(file):
    """PRISM's numbers: 0 is our state 3, 1 is 0, 2 is 1, 3 is 2."""
    for text in (INDUCED, INDUCED.replace(" rest", "").replace(" go", "").replace(" back", "")):
        policy = read_policy(file("adv.tra", text), numbered())
        assert policy.choice.tolist() == [0, 3, 6, 7]
    assert read_policy(file("adv.txt", INDUCED.replace("5\n0 0 1 rest\n", "4\n")), numbered()).choice.tolist() == [
        0,
        3,
        6,
        7,
    ]
    restricted = "4 4 5\n0 0 0 1 rest\n1 0 2 0.3333333 go\n1 0 3 0.6666667 go\n2 0 1 1 go\n3 0 1 1 back\n"
    assert read_policy(file("adv.tra", restricted), numbered()).choice.tolist() == [0, 3, 6, 7]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("4 5", "3 5", ["line 2", "4 states", "reach=false"]),
        ("4 5", "4 6", ["6 branches", "got 5"]),
        ("0.333333", "0.3", ["line 4", "state 0", "type=actions"]),
        ("2 1 1 go", "2 1 1 back", ["line 6", "state 1"]),
        ("2 1 1 go", "2 0 1 go", ["line 6", "'go', 'back'"]),
        ("2 1 1 go", "2 1 x go", ["line 6", "STATE TARGET PROBABILITY"]),
        ("2 1 1 go", "2 9 1 go", ["line 6"]),
        ("2 1 1 go", "2 1", ["line 6"]),
    ],
)
def test_an_induced_model_that_does_not_fit_is_told(file, old, new, words):
    assert old in INDUCED
    message = refusal(file("adv.tra", INDUCED.replace(old, new, 1)), numbered())
    for word in words:
        assert word in message
    several = "4 4 4\n0 0 0 1 rest\n1 1 2 1 go\n2 0 1 1 go\n3 0 1 1 back\n"
    assert "one choice must be left" in refusal(file("adv.tra", several), numbered())


def test_choices_that_lead_to_the_same_must_be_told_apart_unless_they_are_alike(file):
    twins = {
        "branch_to_target": np.array([1, 2, 2, 2, 0, 2, 3, 0, 3]),
        "choice_to_action": np.array([0, 1, 1, 0, 1, -1, 1, 2]),
    }
    text = "4 1\n1 3 1 back\n"
    assert read_policy(file("a.tra", text), numbered(**twins)).choice.tolist() == [1, -1, -1, 7]
    assert read_policy(file("a.txt", "(0,1)=back\n"), numbered(**twins)).choice.tolist() == [1, -1, -1, 7]
    paid = {"cost": Reward(choice=np.array([0.0, 1, 2, 0, 0, 0, 0, 0]))}
    assert "2 choices" in refusal(file("a.tra", text), numbered(**twins, rewards=paid))
    assert "2 choices" in refusal(file("a.txt", "(0,1)=back\n"), numbered(**twins, rewards=paid))


def test_every_foreign_form_of_a_random_policy_says_the_same(file, random_problem):
    seen = 0
    for seed in range(25):
        mdp = random_problem(seed).mdp
        mdp = replace(mdp, names=StateNames(count=mdp.states))
        twins = any(
            len({repr(branches(mdp, c)) for c in mdp.choices_of(s)}) < len(mdp.choices_of(s)) for s in range(mdp.states)
        )
        rng = np.random.default_rng(seed)
        choice = rng.integers(mdp.state_to_choices[:-1], mdp.state_to_choices[1:])
        expected = choice.tolist()
        entries = [{"s": s, "c": [{"index": c, "prob": 1}]} for s, c in enumerate(expected)]
        assert read_policy(file("p.json", json.dumps(entries)), mdp).choice.tolist() == expected
        within = choice - mdp.state_to_choices[:-1]
        lines = "".join(f"{s:12}    {i}\n" for s, i in enumerate(within.tolist()))
        text = f"____\nFully defined memoryless deterministic scheduler:\n model state:    choice(s)\n{lines}____\n"
        assert read_policy(file("p.txt", text), mdp).choice.tolist() == expected
        indices = "".join(f"{s}={i}\n" for s, i in enumerate(within.tolist()))
        assert read_policy(file("q.txt", indices), mdp).choice.tolist() == expected
        if twins:
            continue
        seen += 1
        rows = [(s, t, p) for s, c in enumerate(expected) for t, p in zip(*branches(mdp, c), strict=True)]
        tra = f"{mdp.states} {len(rows)}\n" + "".join(f"{s} {t} {p!r}\n" for s, t, p in rows)
        assert read_policy(file("p.tra", tra), mdp).choice.tolist() == expected
    assert seen > 5


def branches(mdp: MDP, choice: int) -> tuple[list[int], list[float]]:
    """Return where a choice leads, each state once."""
    own = mdp.branches_of(choice)
    total: dict[int, float] = {}
    for target, chance in zip(mdp.branch_to_target[own].tolist(), mdp.branch_to_probability[own].tolist(), strict=True):
        total[target] = total.get(target, 0.0) + chance
    return sorted(total), [total[target] for target in sorted(total)]


# Python


def test_a_function_is_asked_where_there_is_a_choice():
    asked = []

    def policy(state, actions):
        asked.append((state, actions))
        return {"x=0": "back"}.get(state, actions[-1])

    named = model(names=StateNames(count=4, strings=["x=0", "b", "c", "d"]))
    assert read_policy(policy, named).choice.tolist() == [2, 4, 6, 7]
    assert asked == [("x=0", ["go", "go (2)", "back"]), ("b", ["go", "back"]), ("c", ["choice 0", "back"])]
    asked.clear()
    read_policy(policy, model(names=StateNames(count=4)))
    assert [state for state, _ in asked] == [0, 1, 2]


def test_a_function_may_answer_in_many_ways():
    answers = {0: 1, 1: {"go": 0.25, "back": 0.75}, 2: None}
    policy = read_policy(lambda state, _: answers[state], model(names=StateNames(count=4)))
    assert policy.chance.tolist() == [0, 1, 0, 0.25, 0.75, 0, 0, 1]
    assert read_policy(lambda *_: np.array(1), model(names=StateNames(count=4))).choice.tolist() == [
        1,
        4,
        6,
        7,
    ]


def test_what_a_function_answers_is_checked():
    plain = model(names=StateNames(count=4))

    def wise(state, actions):
        return "fly"

    message = refusal(wise, plain)
    assert "'wise'" in message
    assert "state 0, 'go', 'go (2)', 'back'; but 'fly' is no action of the model" in message
    assert "1.0" in refusal(lambda *_: 1.0, plain)
    assert "sum to 1" in refusal(lambda *_: {0: 0.5}, plain)
    assert "-1" in refusal(lambda *_: -1, plain)


class Agent:
    """Looks like a trained agent: spaces, and `predict` that answers one number per observation."""

    def __init__(self, actions, *, n=4, start=0, doing=3, memory=None):
        self.observation_space = SimpleNamespace(n=n, start=start)
        self.action_space = SimpleNamespace(n=doing, start=0)
        self.actions, self.memory = np.array(actions), memory

    def predict(self, observation, deterministic=False):
        assert deterministic
        return self.actions[np.asarray(observation)], self.memory


def test_an_agent_that_sees_the_state_is_asked():
    distinct = model(choice_to_action=np.array([0, 2, 1, 0, 1, 2, 1, 2]))
    assert read_policy(Agent([2, 1, 1, 0]), distinct).choice.tolist() == [1, 4, 6, 7]
    nameless = model(actions=(), choice_to_action=np.full(8, -1))
    assert read_policy(Agent([2, 1, 0, 0]), nameless).choice.tolist() == [2, 4, 5, 7]


def test_an_agent_that_sees_something_else_is_refused():
    for agent in (Agent([0], n=5), Agent([0] * 4, start=1), Agent([0] * 4, n=None)):
        assert "what the agent observes" in refusal(agent, model())
    box = Agent([0] * 4)
    box.observation_space = "Box(0.0, 1.0, (2,), float32)"
    assert "Box(0.0, 1.0, (2,), float32)" in refusal(box, model())
    assert "3 actions" in refusal(Agent([0] * 4, doing=2), model())
    assert "memory" in refusal(Agent([0] * 4, memory=np.zeros(3)), model())
    message = refusal(Agent([0, 2, 0, 0]), model())
    assert "state 1" in message
    assert "'rest'" in message
    assert "number 7" in refusal(Agent([0, 7, 0, 0]), model())
    assert "one action number per state" in refusal(Agent([0.5] * 4), model())
    assert "observation_space" in refusal(SimpleNamespace(predict=len), model())
    assert "the class Agent" in refusal(Agent, model())


def test_a_saved_agent_is_refused_with_the_way_out(tmp_path):
    with zipfile.ZipFile(tmp_path / "agent.zip", "w") as archive:
        archive.writestr("data", "{}")
    (tmp_path / "agent.zip").rename(tmp_path / "agent")
    (tmp_path / "agent.pkl").write_bytes(b"\x80\x04K\x01.")
    (tmp_path / "policy.pt").write_bytes(b"PK\x03\x04")
    for name in ("agent", "agent.pkl", "policy.pt"):
        message = refusal(tmp_path / name, model())
        assert "can run any program" in message
        assert "read_policy(agent" in message


def test_nothing_of_what_agents_are_made_of_is_imported():
    import sys

    read_policy(Agent([1, 1, 1, 0]), model())
    assert not {"torch", "stable_baselines3"} & set(sys.modules)


def test_the_command_line_takes_foreign_policies(tmp_path):
    from click.testing import CliRunner

    from ratherthan.apps.cli import main

    problem = rt.read("example:paper-5x5")
    best = rt.solve(problem).policy.choice.tolist()
    entries = [{"s": s, "c": [{"index": c, "prob": 1.0}]} for s, c in enumerate(best)]
    (tmp_path / "s.json").write_text(json.dumps(entries))
    found = CliRunner().invoke(
        main, ["explain", "example:paper-5x5", "--policy", str(tmp_path / "s.json"), "--kind", "contrastive"]
    )
    assert found.exit_code == 0
    assert found.output == rt.narrate(rt.explain(rt.solve(problem), kind="contrastive")) + "\n"

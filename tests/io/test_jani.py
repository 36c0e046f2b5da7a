"""JANI models: what comes over from Storm, which of their properties come along, and what is refused."""

from __future__ import annotations

import copy
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ratherthan.errors import MissingExtraError, PropertyError, SourceError
from ratherthan.io._jani_properties import property_text
from ratherthan.io._jani_terms import Vocabulary, term_of
from ratherthan.io.jani import read_jani
from ratherthan.model.mdp import Reward
from ratherthan.model.objective import Mission
from ratherthan.model.property import parse_property
from ratherthan.model.syntax import parse_formula, text_of

INITIAL = {"op": "initial"}


def operation(op: str, left: Any, right: Any) -> dict[str, Any]:
    return {"op": op, "left": left, "right": right}


def asked(values: Any, fun: str = "max", states: Any = INITIAL) -> dict[str, Any]:
    return {"op": "filter", "fun": fun, "values": values, "states": states}


def arrive(goal: Any, op: str = "Pmax") -> dict[str, Any]:
    return {"op": op, "exp": {"op": "F", "exp": goal}}


def reach(reward: Any, *accumulate: str, op: str = "Emin") -> dict[str, Any]:
    return {"op": op, "exp": reward, "accumulate": list(accumulate), "reach": "done"}


def number(name: str, value: int, low: int, high: int) -> dict[str, Any]:
    kind = {"kind": "bounded", "base": "int", "lower-bound": low, "upper-bound": high}
    return {"name": name, "type": kind, "initial-value": value}


def transient(name: str, kind: str) -> dict[str, Any]:
    return {"name": name, "type": kind, "initial-value": False if kind == "bool" else 0, "transient": True}


# A walker that starts, tries (with a chance of 1/4 to end at a time), and a lamp that it can switch off.
MODEL: dict[str, Any] = {
    "jani-version": 1,
    "name": "walk",
    "type": "mdp",
    "features": ["derived-operators"],
    "actions": [{"name": "try"}, {"name": "switch"}],
    "constants": [
        {"name": "N", "type": "int"},
        {"name": "M", "type": "int", "value": operation("*", 2, operation("+", "N", 1))},
        {"name": "only_asked", "type": {"kind": "bounded", "base": "int", "lower-bound": 7, "upper-bound": 9}},
        {"name": "chance", "type": "real", "value": operation("/", 1, 4)},
    ],
    "variables": [
        {**number("x", 0, 0, 9), "type": {"kind": "bounded", "base": "int", "lower-bound": 0, "upper-bound": "N"}},
        {"name": "lamp", "type": "bool", "initial-value": True},
        number("never_set", 4, 0, 9),
        transient("done", "bool"),
        transient("effort", "real"),
        transient("waiting", "real"),
        transient("both", "real"),
    ],
    "automata": [
        {
            "name": "walker",
            "locations": [
                {"name": "start"},
                {
                    "name": "end",
                    "transient-values": [{"ref": "done", "value": True}],
                },
            ],
            "initial-locations": ["start"],
            "edges": [
                {
                    "location": "start",
                    "action": "try",
                    "guard": {"exp": operation("<", "x", "N")},
                    "assignments": [{"ref": "effort", "value": 3}, {"ref": "both", "value": 1}],
                    "destinations": [
                        {
                            "location": "end",
                            "probability": {"exp": "chance"},
                            "assignments": [{"ref": "effort", "value": 8, "index": 1}],
                        },
                        {
                            "location": "start",
                            "probability": {"exp": operation("-", 1, "chance")},
                            "assignments": [{"ref": "x", "value": operation("+", "x", 1)}],
                        },
                    ],
                },
                {
                    "location": "start",
                    "guard": {"exp": operation("=", "x", "N")},
                    "destinations": [{"location": "end"}],
                },
            ],
        },
        {
            "name": "keeper",
            "variables": [{"name": "mine", "type": "bool", "initial-value": False, "transient": True}],
            "locations": [
                {
                    "name": "only",
                    "transient-values": [
                        {"ref": "waiting", "value": 5},
                        {"ref": "both", "value": 1},
                        {"ref": "mine", "value": "lamp"},
                    ],
                }
            ],
            "initial-locations": ["only"],
            "edges": [
                {
                    "location": "only",
                    "action": "switch",
                    "guard": {"exp": "lamp"},
                    "destinations": [{"location": "only", "assignments": [{"ref": "lamp", "value": False}]}],
                }
            ],
        },
    ],
    "system": {
        "elements": [{"automaton": "walker"}, {"automaton": "keeper"}],
        "syncs": [
            {"synchronise": ["try", None], "result": "try"},
            {"synchronise": [None, "switch"], "result": "switch"},
        ],
    },
    "properties": [
        {"name": "arrives", "expression": asked(arrive("done"))},
        {"name": "surely", "expression": asked(operation("≥", arrive("done", "Pmin"), 1), fun="values")},
        {"name": "seldom", "expression": asked(operation("<", 0.5, arrive("done", "Pmin")))},
        {"name": "effort", "expression": asked(reach("effort", "steps"))},
        {"name": "waiting", "expression": asked(reach("waiting", "exit", op="Emax"))},
        {"name": "both", "expression": asked(reach("both", "steps", "exit"))},
        {"name": "half", "expression": asked(reach("both", "steps"))},
        {"name": "steps", "expression": asked(reach(1, "steps"))},
        {"name": "bounded", "expression": asked({"op": "Pmax", "exp": {"op": "F", "exp": "done", "step-bounds": {"upper": "only_asked"}}})},
        {"name": "constants", "expression": asked(arrive(operation("∧", operation("=", operation("*", "x", 2), operation("-", "M", 2)), "lamp")))},
        {"name": "never", "expression": asked(arrive(operation("=", "x", "never_set")))},
        {"name": "unset", "expression": asked(arrive(operation("=", "x", "only_asked")))},
        {"name": "long_run", "expression": asked({"op": "Smax", "exp": "done"})},
    ],
}  # fmt: skip

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def _write(model: Any, *, mark: bool = False) -> Path:
        path = tmp_path / "model.jani"
        text = model if isinstance(model, str) else json.dumps(model, ensure_ascii=False)
        path.write_bytes((b"\xef\xbb\xbf" if mark else b"") + text.encode("utf-8"))
        return path

    return _write


@pytest.fixture
def stormpy() -> Any:
    return pytest.importorskip("stormpy")


def changed(**changes: Any) -> dict[str, Any]:
    return copy.deepcopy(MODEL) | changes


def test_a_model_keeps_its_names(stormpy: Any, write: Write) -> None:
    problem = read_jani(write(MODEL, mark=True), constants="N=2")
    mdp = problem.mdp
    assert set(mdp.names.variables) == {"_loc_walker", "x", "lamp"}
    assert mdp.names[int(mdp.initial[0])] in ("_loc_walker=start, x=0, lamp=true", "_loc_walker=start, lamp=true, x=0")
    assert set(mdp.actions) == {"try", "switch"}
    assert set(mdp.labels) == {"done", "deadlock"}
    assert np.array_equal(mdp.labels["done"], mdp.names.variables["_loc_walker"] == "end")
    assert set(mdp.rewards) == {"effort", "waiting", "both"}
    effort = mdp.rewards["effort"].choice
    assert effort is not None
    tries = [choice for choice in range(mdp.choices) if mdp.action_name(choice) == "try"]
    assert tries
    assert effort[tries] == pytest.approx(3 + 8 / 4)  # what a branch earns counts with its probability
    assert np.count_nonzero(effort) == len(tries)
    waiting = mdp.rewards["waiting"].state
    assert waiting is not None
    assert (waiting[~mdp.labels["deadlock"]] == 5).all()


def test_properties_that_can_be_explained_come_along(stormpy: Any, write: Write) -> None:
    problem = read_jani(write(MODEL), constants={"N": 2})
    assert {name: wanted.text for name, wanted in problem.properties.items()} == {
        "arrives": 'Pmax=? [F "done"]',
        "surely": 'Pmin>=1 [F "done"]',
        "seldom": 'Pmin>0.5 [F "done"]',
        "effort": 'R{"effort"}min=? [F "done"]',
        "waiting": 'R{"waiting"}max=? [F "done"]',
        "both": 'R{"both"}min=? [F "done"]',
        "steps": 'Tmin=? [F "done"]',
        "constants": "Pmax=? [F x * 2 = 2 * (2 + 1) - 2 & lamp]",
        "never": "Pmax=? [F x = 4]",
    }
    left_out = {note.split("'")[1]: note for note in problem.notes if note.startswith("Property")}
    assert set(left_out) == {"half", "bounded", "unset", "long_run"}
    assert "A part only of the reward 'both'" in left_out["half"]
    assert "only_asked" in left_out["bounded"]
    assert "got 'only_asked'" in left_out["unset"]
    assert "long-run average" in left_out["long_run"]
    assert problem.others == {"long_run": 'LRAmax=? ["done"]'}


def test_a_bound_of_steps_is_a_mission(stormpy: Any, write: Write) -> None:
    problem = read_jani(write(MODEL), constants="N=2,only_asked=7")
    assert problem.properties["bounded"] == Mission(formula='F<=7 "done"', maximise=True)


def test_a_user_may_write_labels_and_constants_by_their_bare_names(stormpy: Any, write: Write) -> None:
    problem = read_jani(write(MODEL), constants="N=2,only_asked=7")
    assert parse_property("Pmax=? [lamp U done]", problem).text == 'Pmax=? [lamp U "done"]'
    assert parse_property("Pmax=? [F x + 5 = only_asked]", problem).text == "Pmax=? [F x + 5 = 7]"
    assert "unset" in problem.properties


@pytest.mark.parametrize(
    ("constants", "said"),
    [
        (None, r"these have none: N \(int\).*--constants N=3"),
        ("N=2,M=3", "'M' is defined there"),
        ("N=2,K=3", r"leaves open: N \(int\), only_asked \(int\); got 'K'"),
        ("N=0.5", "'N' of .* must be a whole number"),
    ],
)
def test_constants_must_fit(write: Write, constants: Any, said: str) -> None:
    with pytest.raises(SourceError, match=said):
        read_jani(write(MODEL), constants=constants)


def test_states_without_a_way_on_are_counted(stormpy: Any, write: Write) -> None:
    problem = read_jani(write(MODEL), constants="N=2")
    stuck = int(problem.mdp.labels["deadlock"].sum())
    assert any(note.startswith(f"{stuck} states had no choice") for note in problem.notes)


def test_a_value_out_of_range_is_refused(stormpy: Any, write: Write, capfd: pytest.CaptureFixture[str]) -> None:
    model = changed()
    model["automata"][0]["edges"][0]["guard"]["exp"] = operation("≤", "x", "N")
    with pytest.raises(SourceError, match=r"3\W.*(is out of range for|for the) variable '?x"):
        read_jani(write(model), constants="N=2")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("model", "said"),
    [
        ("hello", "must be JSON in UTF-8"),
        ("[1]", "must hold a model with automata"),
        ('{"jani-version": 1}', "must hold a model with automata"),
        (changed(type="ctmc"), "of type mdp or dtmc, but .* is of type ctmc .it runs in continuous time"),
        (changed(type="lts"), "is of type lts"),
        (changed(variables=[3]), "'variables' of a JANI file must be a list of objects with names"),
        (changed(constants=7), "'constants' of a JANI file must be a list of objects with names"),
        (changed(automata=[]), "Storm can "),
        (changed(automata=[{"name": "walker"}]), "Storm can read"),
    ],
)
def test_a_model_that_cannot_be_used_is_refused_in_one_clean_sentence(
    stormpy: Any, write: Write, capfd: pytest.CaptureFixture[str], model: Any, said: str
) -> None:
    with pytest.raises(SourceError, match=said) as caught:
        read_jani(
            write(model),
            constants=None
            if not isinstance(model, dict) or "constants" not in model or model["constants"] == 7
            else {"N": 2},
        )
    assert "\n" not in caught.value.message
    assert "Exception" not in caught.value.message
    assert capfd.readouterr() == ("", "")


def test_without_storm_the_command_that_installs_it_is_said(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stormpy", None)
    with pytest.raises(MissingExtraError, match=r'pip install "ratherthan\[storm\]"'):
        read_jani(write(MODEL), constants="N=2")


def bounded(bounds: dict[str, Any]) -> dict[str, Any]:
    return {"op": "Pmax", "exp": {"op": "F", "exp": "done", "step-bounds": bounds}}


# -- expressions and properties, without Storm ---------------------------------------------------------------------------

WORDS = Vocabulary(
    labels={"done"},
    hidden={"done", "cost", "mixed"},
    rewards={
        "cost": Reward(choice=np.ones(2)),
        "stay": Reward(state=np.ones(1)),
        "mixed": Reward(state=np.ones(1), branch=np.ones(2)),
        "nothing": Reward(state=np.zeros(1), choice=np.zeros(2)),
    },
)


@pytest.mark.parametrize(
    ("tree", "text"),
    [
        (True, "true"),
        (-2, "-2"),
        (0.5, "0.5"),
        ("x", "x"),
        ("done", '"done"'),
        (INITIAL, '"init"'),
        ({"op": "deadlock"}, '"deadlock"'),
        (operation("∨", operation("∧", "a", "b"), {"op": "¬", "exp": "c"}), "a & b | !c"),
        (operation("∧", operation("∨", "a", "b"), "c"), "(a | b) & c"),
        (operation("⇒", "a", operation("⇒", "b", "c")), "a => (b => c)"),
        (operation("≠", operation("%", "x", 2), operation("-", 1, operation("-", 2, "y"))), "mod(x, 2) != 1 - (2 - y)"),
        (operation("≤", operation("min", "x", 2), {"op": "floor", "exp": operation("/", "y", 2)}), "min(x, 2) <= floor(y / 2)"),
        ({"op": "ite", "if": "a", "then": 1, "else": operation("+", "x", 1)}, "a ? 1 : x + 1"),
    ],
)  # fmt: skip
def test_expressions_are_said_in_prisms_words(tree: Any, text: str) -> None:
    assert text_of(term_of(tree, WORDS)) == text
    assert text_of(parse_formula(text)) == text


@pytest.mark.parametrize(
    ("tree", "text"),
    [
        (asked(arrive("done")), 'Pmax=? [F "done"]'),
        (asked({"op": "Pmin", "exp": operation("U", {"op": "¬", "exp": "a"}, "done")}), 'Pmin=? [!a U "done"]'),
        (asked(operation("≤", arrive("done"), 0.25)), 'Pmax<=0.25 [F "done"]'),
        (asked(operation("≤", 0.25, arrive("done"))), 'Pmax>=0.25 [F "done"]'),
        (asked(reach("cost", "steps")), 'R{"cost"}min=? [F "done"]'),
        (asked(reach("stay", "exit")), 'R{"stay"}min=? [F "done"]'),
        (asked(reach("mixed", "exit", "steps")), 'R{"mixed"}min=? [F "done"]'),
        (asked(reach("nothing")), 'R{"nothing"}min=? [F "done"]'),
        (asked(reach(1, "steps", "exit", op="Emax")), 'Tmax=? [F "done"]'),
        (asked({"op": "Smax", "exp": "a"}), "LRAmax=? [a]"),
        (asked({"op": "Smin", "exp": "cost", "accumulate": ["steps"]}), 'R{"cost"}min=? [LRA]'),
        (asked({"op": "Emax", "exp": "cost", "accumulate": ["steps"]}), 'R{"cost"}max=? [C]'),
        (asked({"op": "Emax", "exp": "cost", "accumulate": ["steps"], "step-instant": "K"}), 'R{"cost"}max=? [C<=K]'),
        (
            asked({"op": "Pmax", "exp": {**operation("U", "a", "done"), "step-bounds": {"upper": "K"}}}),
            'Pmax=? [a U<=K "done"]',
        ),
        (asked(bounded({"upper": operation("+", "K", 1), "upper-exclusive": True})), 'Pmax=? [F<(K + 1) "done"]'),
        (asked(bounded({"lower": 2})), 'Pmax=? [F>=2 "done"]'),
        (asked(bounded({"lower": 2, "upper": 5})), 'Pmax=? [F[2,5] "done"]'),
        (
            asked(
                {
                    "op": "Pmin",
                    "exp": {
                        "op": "F",
                        "exp": "done",
                        "reward-bounds": [{"exp": "cost", "accumulate": ["steps"], "bounds": {"upper": 3}}],
                    },
                }
            ),
            'Pmin=? [F{"cost"}<=3 "done"]',
        ),
        (asked({"op": "Pmax", "exp": {"op": "G", "exp": {"op": "F", "exp": "done"}}}), 'Pmax=? [G (F "done")]'),
        (
            asked(
                {
                    "op": "Pmax",
                    "exp": operation("∧", {"op": "F", "exp": "a"}, {"op": "¬", "exp": {"op": "F", "exp": "done"}}),
                }
            ),
            'Pmax=? [((F a)) & ((!((F "done"))))]',
        ),
    ],
)
def test_properties_are_said_in_prisms_syntax(tree: Any, text: str) -> None:
    assert property_text(tree, WORDS) == text


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        (arrive("done"), "without a filter"),
        (asked(arrive("done"), fun="count"), "A filter over other than the initial states"),
        (asked(arrive("done"), states="a"), "A filter over other than the initial states"),
        (asked({"op": "∀", "exp": "a"}), "The operator '∀'"),
        (asked({"op": "Cmax", "exp": "a"}), "The operator 'Cmax'"),
        (asked({"op": "Emax", "exp": "cost", "step-instant": 3}), "A part only of the reward 'cost'"),
        (asked({"op": "Emax", "exp": "nothing", "step-instant": 3}), "The value of an expression at one step"),
        (asked({"op": "Pmax", "exp": {"op": "F", "exp": "done", "time-bounds": {"upper": 3}}}), "A bound on time"),
        (asked(bounded({"lower": 1, "upper": 3, "lower-exclusive": True})), "two ends"),
        (asked("done"), "no probability and no expected value"),
        (asked({"op": "Pmax", "exp": "a"}), "no until, eventually or always"),
        (asked({**reach("cost", "steps"), "step-instant": 3}), "until a time or until a reward"),
        (asked({**reach("cost", "steps"), "time-instant": 3}), "until a time or until a reward"),
        (asked(reach(operation("*", 2, "cost"), "steps")), "more than one variable"),
        (asked(reach(1, "exit")), "more than one variable"),
        (asked(reach("cost", "exit")), "A part only of the reward 'cost'"),
        (asked(reach("stay", "steps")), "A part only of the reward 'stay'"),
        (asked(reach("mixed", "exit")), "A part only of the reward 'mixed'"),
        (asked(arrive({"op": "call", "function": "f", "args": []})), "The operator 'call'"),
        (asked(arrive(operation(">", {"constant": "π"}, 3))), "The expression"),
        (asked(arrive(operation(">", "cost", 3))), "The variable 'cost', which has no value in a state"),
        (asked(arrive("two words")), "The name 'two words'"),
        (asked(arrive("true")), "The name 'true'"),
    ],
)
def test_what_cannot_be_said_is_refused(tree: Any, said: str) -> None:
    with pytest.raises(PropertyError, match=said):
        property_text(tree, WORDS)

"""State formulas: precedence, types, definitions, errors; and random formulas against an evaluator of one state at a time."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.errors import PropertyError
from ratherthan.model.formula import canonical, states_of, states_where
from ratherthan.model.mdp import MDP
from ratherthan.model.names import StateNames
from ratherthan.model.syntax import Term, parse_formula, text_of

VARIABLES = {
    "x": np.array([0, 1, 2, 3, -1], dtype=np.int16),
    "y": np.array([0.0, 0.5, 1.0, 2.0, -3.25]),
    "busy": np.array([True, False, True, False, False]),
    "small": np.array([0, 200, 255, 1, 2], dtype=np.uint8),
    "place": np.array(["a", "b", "c", "d", "e"]),
}
LABELS = {"goal": np.array([0, 0, 0, 1, 1], dtype=bool), "a b": np.array([1, 0, 0, 0, 1], dtype=bool)}


def chain(**changes: Any) -> MDP:
    """0 → 1 → 2 → 3, which loops; 2 may also loop; 4 loops in two equal choices."""
    arrays = {
        "state_to_choices": np.array([0, 1, 2, 4, 5, 7]),
        "choice_to_branches": np.arange(8),
        "branch_to_target": np.array([1, 2, 3, 2, 3, 4, 4]),
        "branch_to_probability": np.ones(7),
        "initial": np.array([0, 4]),
        "labels": LABELS,
        "names": StateNames(count=5, variables=VARIABLES),
    }
    return MDP(**(arrays | changes))


MODEL = chain()


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("true", "11111"),
        ("false", "00000"),
        ('"goal"', "00011"),
        ('"a b"', "10001"),
        ('"init"', "10001"),
        ('"deadlock"', "00010"),
        ("x = 1", "01000"),
        ("x != 1", "10111"),
        ("!x = 1", "10111"),
        ("!busy", "01011"),
        ("!!busy", "10100"),
        ("busy = true", "10100"),
        ("busy = (x = 2)", "01111"),
        ("busy <=> x = 2", "01111"),
        ("busy != false", "10100"),
        ("x = 1 | x = 2 & busy", "01100"),
        ("(x = 1 | x = 2) & busy", "00100"),
        ("busy => x > 1", "01111"),
        ("busy => x > 1 <=> busy", "01111"),
        ("x > 0 ? busy : y < 0", "00101"),
        ("(busy ? 0 : x > 1 ? 7 : 8) = 7", "00010"),
        ("1 + 2 * 3 = 7", "11111"),
        ("8 / 2 / 2 = 2", "11111"),
        ("8 - 2 - 2 = 4", "11111"),
        ("-x = 1", "00001"),
        ("2 - -1 = 3", "11111"),
        ("x / 2 = 0.5", "01000"),
        ("y * 4 = 2.0e0", "01000"),
        (".5 = 5e-1", "11111"),
        ("small + 100 > 255", "01100"),
        ("small - 1 < 0", "10000"),
        ("min(x, 1, y) = 1", "00110"),
        ("max(x, 1) = x", "01110"),
        ("floor(y) = x", "10000"),
        ("ceil(y) = x", "11000"),
        ("round(y) = x", "11000"),
        ("round(-0.5) = 0", "11111"),
        ("mod(x, 2) = 1", "01011"),
        ("pow(x, 2) = 4", "00100"),
        ("pow(2, -1) = 0.5", "11111"),
        ("log(8, 2) > 2.9 & log(8, 2) < 3.1", "11111"),
        ("func(max, x, 2) = 3", "00010"),
        ("x > 0 & 1 / x >= 1", "01000"),
        ("x = 0 | 2 / x = 1", "10100"),
        ("x = 0 => x = 1", "01111"),
        ("(x > 0 ? mod(7, x) : 0) = 1", "00110"),
        ("x = 1 // & false\n", "01000"),
        ("x > N", "00010"),
        ("ready & !half", "01010"),
    ],
)
def test_formulas_mean_what_prism_says(text: str, where: str) -> None:
    definitions = {"N": "K * 2", "K": "1", "ready": "busy | !busy", "half": "busy | x < 0"}
    mask = states_where(MODEL, text, definitions)
    assert mask.dtype == np.bool_
    assert "".join(str(int(here)) for here in mask) == where
    stored = canonical(text, definitions, VARIABLES)
    assert np.array_equal(states_where(MODEL, stored), mask)
    assert canonical(stored, {}) == stored


def test_a_label_of_the_model_comes_before_the_built_in_one() -> None:
    model = chain(labels=LABELS | {"init": LABELS["goal"], "deadlock": LABELS["a b"]})
    assert np.array_equal(states_where(model, '"init"'), LABELS["goal"])
    assert np.array_equal(states_where(model, '"deadlock"'), LABELS["a b"])


def test_a_variable_comes_before_a_definition_of_the_same_name() -> None:
    assert states_where(MODEL, "x = 3", {"x": "3"}).tolist() == [False, False, False, True, False]


def test_the_answer_is_a_copy() -> None:
    states_where(MODEL, '"goal"')[:] = False
    assert MODEL.labels["goal"].any()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = & 3", "at column 5, got '& 3'"),
        ("(x = 1", r"must have '\)' at column 7, got the end"),
        ("x = 1)", "at column 6, got '\\)'"),
        ("", "at column 1, got the end"),
        ("x == 1", "PRISM writes '=', not '=='"),
        ("busy && busy", "PRISM writes '&', not '&&'"),
        ('x = "goal', "never closed"),
        ("x = !busy", "put brackets around it"),
        ("x § 1", "at column 3"),
        ("1.0.0 = x", "at column 4"),
        ("x = 1 -> busy", "must have '=>' at column 7, got '-> busy'. PRISM writes '=>', not '->'"),
        ("max(x, 1", r"must have ',' or '\)' at column 9, got the end"),
        ("busy ? x", "must have ':' at column 9, got the end"),
        ('F "goal"', "must have an operator or the end at column 3"),
        ("x != != 1", "must have a number, a name, a \"label\" or '\\(' at column 6, got '!= 1'"),
        ("x = 1" + " & busy" * 100 + " & )", "formula '… .* & busy & busy & \\)' must .* at column 709, got '\\)'"),
        ("f(x) = 1", "one of min, max, floor, ceil, round, pow, mod, log, got 'f' at column 1"),
        ("mod(x) = 1", "must have 2 arguments, got 1"),
        ("floor(x, 1) = 1", "must have 1 argument, got 2"),
        ("9" * 50 + " > x", "a number that a computer can hold"),
        ("(" * 5000 + "busy" + ")" * 5000, "nested too deeply"),
        ("x" + " - x" * 5000 + " > 0", "nested too deeply"),
        ("!" * 5000 + "busy", "nested too deeply"),
        ("x + 1", "must be true or false, but 'x \\+ 1' is a number. Compare it, as in 'x \\+ 1 > 0'"),
        ("busy + 1 > 0", "'\\+' in 'busy \\+ 1' must have a number, but 'busy' is a truth value"),
        ("busy > 0", "must have a number, but 'busy' is a truth value"),
        ("x = busy", "the left is a number, the right a truth value"),
        ("x & busy", "must be true or false, but 'x' is a number"),
        ("!x", "must be true or false, but 'x' is a number"),
        ("x ? busy : busy", "before '\\?' in .* must be true or false"),
        ("busy ? busy : 1", "the first is a truth value, the second a number"),
        ("busy ? x : x > 1 ? 7 : 8", "must be true or false, but 'busy \\? x : x > 1 \\? 7 : 8' is a number"),
        ("-busy = 1", "'-' in '-busy' must have a number"),
        ('place = "a b"', "the left is a word"),
        ("mod(y, 2) = 0", "mod must have whole numbers"),
        ('"gaol"', "'goal', 'a b', 'init', 'deadlock'; got 'gaol'"),
        ("z = 1", "variables are 'x', 'y', 'busy', 'small', 'place'; got 'z'"),
        ("bussy", "variables are 'busy', 'x'"),
        ("goal", 'Labels stand in quotation marks: "goal"'),
        ("1 / x > 0 / x", "every number in it defined, but this fails at state 0 \\('x=0, y=0"),
        ("log(-1, 2) > 0", "every number in it defined"),
        ("mod(3, x) = 0", "a divisor above 0, but this fails at state 0"),
        ("floor(1 / x) = 1", "a finite number below 4.6e18, but this fails at state 0"),
        ("pow(10, small) > 0", "whole numbers below 4.6e18, but this fails at state 1"),
        ("4000000000 * 4000000000 > x", "whole numbers below 4.6e18"),
        ("round", "A definition must not lead back to itself, got round → trip → round"),
        ("broken", "The definition of 'broken' '1 \\+' must have"),
    ],
)
def test_a_wrong_formula_is_refused_with_its_reason(text: str, said: str) -> None:
    with pytest.raises(PropertyError, match=said):
        states_where(MODEL, text, {"round": "trip", "trip": "!round", "broken": "1 +"})


def test_a_syntax_error_carries_its_column() -> None:
    with pytest.raises(PropertyError) as caught:
        states_where(MODEL, "x = & 3")
    assert caught.value.column == 5


def test_names_of_temporal_operators_are_names_in_a_formula() -> None:
    model = chain(names=StateNames(count=5, variables={name: np.arange(5) for name in "FGXUWRPS"}))
    for name in "FGXUWRPS":
        assert states_where(model, f"({name} <= 3) & {name} - 1 > 0").tolist() == [False, False, True, True, False]


def test_long_chains_do_not_run_out_of_stack() -> None:
    text = " | ".join(f"x = {i}" for i in range(2, 20000))
    assert states_where(MODEL, text).tolist() == [False, False, True, True, False]
    assert canonical(text, {}) == text
    total = "x" + " + x" * 4999 + " = 5000"
    assert states_where(MODEL, total).tolist() == [False, True, False, False, False]
    assert canonical(total, {}) == total


def test_large_whole_numbers_stay_exact() -> None:
    model = chain(names=StateNames(count=5, variables={"n": 2**60 + np.arange(5)}))
    assert states_where(model, f"n = {2**60 + 1}").tolist() == [False, True, False, False, False]


# -- random formulas ---------------------------------------------------------------------------------------------------

COMPARE = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def _tree(op: str, *args: Term, value: Any = None) -> Term:
    return Term(op, tuple(args), value)


numbers = st.recursive(
    st.one_of(
        st.integers(0, 9).map(lambda n: Term("number", value=n)),
        st.floats(0, 1e3, allow_nan=False).map(lambda n: Term("number", value=n)),
        st.sampled_from(["x", "y", "small"]).map(lambda n: Term("name", value=n)),
    ),
    lambda inner: st.one_of(
        st.builds(_tree, st.sampled_from(["+", "-", "*"]), inner, inner),
        st.builds(_tree, st.just("neg"), inner),
        st.builds(lambda name, a, b: Term("call", (a, b), name), st.sampled_from(["min", "max"]), inner, inner),
        st.builds(lambda name, a: Term("call", (a,), name), st.sampled_from(["floor", "ceil", "round"]), inner),
        st.builds(lambda a: Term("/", (a, Term("number", value=4))), inner),
    ),
    max_leaves=6,
)
truths = st.recursive(
    st.one_of(
        st.booleans().map(lambda b: Term("truth", value=b)),
        st.sampled_from(["goal", "a b"]).map(lambda n: Term("label", value=n)),
        st.just(Term("name", value="busy")),
        st.builds(_tree, st.sampled_from(sorted(COMPARE)), numbers, numbers),
    ),
    lambda inner: st.one_of(
        st.builds(_tree, st.sampled_from(["&", "|", "=>", "<=>", "=", "!="]), inner, inner),
        st.builds(_tree, st.just("!"), inner),
        st.builds(_tree, st.just("?:"), inner, inner, inner),
        st.builds(lambda c, a, b, d: _tree("<", _tree("?:", c, a, b), d), inner, numbers, numbers, numbers),
    ),
    max_leaves=12,
)


RULES: dict[str, Callable[..., Any]] = COMPARE | {
    "neg": operator.neg, "!": operator.not_, "?:": lambda test, yes, no: yes if test else no,
    "=>": lambda a, b: not a or b, "<=>": operator.eq, "&": lambda *args: all(args), "|": lambda *args: any(args),
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
}  # fmt: skip
CALLS: dict[str, Callable[..., Any]] = {
    "min": min, "max": max, "floor": math.floor, "ceil": math.ceil, "round": lambda a: math.floor(a + 0.5),
}  # fmt: skip


def at_state(term: Term, state: int) -> Any:
    """The value of a term at one state, the obvious way."""
    if term.op in ("number", "truth"):
        return term.value
    if term.op in ("label", "name"):
        return (LABELS if term.op == "label" else VARIABLES)[str(term.value)][state].item()
    rule = CALLS[str(term.value)] if term.op == "call" else RULES[term.op]
    return rule(*(at_state(arg, state) for arg in term.args))


@given(truths)
def test_all_states_at_once_agree_with_one_state_at_a_time(term: Term) -> None:
    assert states_of(MODEL, term).tolist() == [at_state(term, state) for state in range(MODEL.states)]


@given(truths)
def test_a_printed_formula_means_the_same_when_read_again(term: Term) -> None:
    text = text_of(term)
    again = parse_formula(text)
    assert text_of(again) == text
    assert np.array_equal(states_of(MODEL, again), states_of(MODEL, term))


def _with(term: Term, old: str, new: Term) -> Term:
    return (
        new
        if (term.op, term.value) == ("name", old)
        else Term(term.op, tuple(_with(a, old, new) for a in term.args), term.value)
    )


@given(truths, truths)
def test_a_definition_means_its_formula(outer: Term, inner: Term) -> None:
    text = text_of(_with(outer, "busy", Term("name", value="ready")))
    mask = states_where(MODEL, text, {"ready": text_of(inner)})
    assert np.array_equal(mask, states_of(MODEL, _with(outer, "busy", inner)))
    assert np.array_equal(mask, states_where(MODEL, canonical(text, {"ready": text_of(inner)})))

"""Properties in PRISM's syntax: what is read, what it becomes, what is refused and which neighbour is offered instead."""

from __future__ import annotations

import re
from dataclasses import replace
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lasso import property_of, random_path

from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.objective import (
    Discounted,
    ExpectedCost,
    ExpectedReward,
    Lexicographic,
    Mission,
    Objective,
    ReachAvoid,
    Threshold,
)
from ratherthan.model.problem import Problem
from ratherthan.model.property import choose_objective, parse_property, wish_of

COST = Reward(choice=np.ones(5))


def problem(**changes: Any) -> Problem:
    """A chain of four states; the first has two choices."""
    fields: dict[str, Any] = {
        "state_to_choices": np.array([0, 2, 3, 4, 5]),
        "choice_to_branches": np.arange(6),
        "branch_to_target": np.array([1, 2, 2, 3, 3]),
        "branch_to_probability": np.ones(5),
        "initial": np.array([0]),
        "labels": {"goal": np.array([0, 0, 0, 1], dtype=bool), "h": np.array([0, 1, 0, 0], dtype=bool)},
        "rewards": {"cost": COST},
        "names": StateNames(count=4, variables={"x": np.arange(4), "busy": np.array([True, True, False, False])}),
    }
    of_problem = {name: changes.pop(name) for name in ("properties", "objective", "definitions") if name in changes}
    return Problem(**({"mdp": MDP(**(fields | changes))} | of_problem))


PROBLEM = problem(definitions={"N": "K + 1", "K": "2", "p": "0.25", "late": "x > 2 | busy"})
TWO_REWARDS = problem(rewards={"cost": COST, "time": COST})
GOAL = '"goal"'
CHAIN = problem(
    state_to_choices=np.arange(5),
    choice_to_branches=np.arange(5),
    branch_to_target=np.array([1, 2, 3, 3]),
    branch_to_probability=np.ones(4),
    rewards={"cost": Reward(choice=np.ones(4))},
)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ('R{"cost"}min=? [ F "goal" ]', ExpectedCost(goal=GOAL, reward="cost")),
        ('R{"cost"}max=?[F "goal"]', ExpectedCost(goal=GOAL, reward="cost", maximise=True)),
        ('Rmin=? [F "goal"]', ExpectedCost(goal=GOAL, reward="cost")),
        ('Rmax=? [F "goal"]', ExpectedCost(goal=GOAL, reward="cost", maximise=True)),
        ('Rmin{"cost"}=? [F "goal"]', ExpectedCost(goal=GOAL, reward="cost")),
        ('R[exp]{"cost"}min=? [F "goal"]', ExpectedCost(goal=GOAL, reward="cost")),
        ('Tmin=? [F "goal"]', ExpectedCost(goal=GOAL, reward=None)),
        ('Tmax=? [F "goal"]', ExpectedCost(goal=GOAL, reward=None, maximise=True)),
        ('Pmax=? [F "goal"]', ReachAvoid(goal=GOAL)),
        ('P max =? [F "goal"]', ReachAvoid(goal=GOAL)),
        ('Pmin=? [F "goal"]', ReachAvoid(goal=GOAL, maximise=False)),
        ('Pmax=? [(F ("goal"))]', ReachAvoid(goal=GOAL)),
        ('Pmax=? [!"h" U "goal"]', ReachAvoid(goal=GOAL, through='!"h"')),
        ('Pmax=? [true U "goal"]', ReachAvoid(goal=GOAL)),
        ('Pmax=? [("h" | busy) U ("goal" & x = 3)]', ReachAvoid(goal='"goal" & x = 3', through='"h" | busy')),
        ("Pmax=? [late U x = N]", ReachAvoid(goal="x = 2 + 1", through="x > 2 | busy")),
        ("Pmax=? [F late & x=K*N]", ReachAvoid(goal="(x > 2 | busy) & x = 2 * (2 + 1)")),
        ('"my name": Pmax=? [F "goal"]; // the way home\n', ReachAvoid(goal=GOAL)),
        ('Pmax=? [F (F "goal")]', ReachAvoid(goal=GOAL)),
        ('Pmax=? [F "goal" | F "h"]', ReachAvoid(goal='"goal" | "h"')),
        ('Pmax=? [(F "goal") | (F busy | F "h")]', ReachAvoid(goal='"goal" | busy | "h"')),
        ('Pmin=? [!(G !"goal")]', ReachAvoid(goal=GOAL, maximise=False)),
        ('Pmax=? [F>=0 "goal"]', ReachAvoid(goal=GOAL)),
        ('// the way home\nPmax=? [\n F // there\n "goal"\n]', ReachAvoid(goal=GOAL)),
    ],
)
def test_objectives_are_read(text: str, wanted: Objective) -> None:
    assert parse_property(text, PROBLEM) == wanted
    assert parse_property(wanted.text, PROBLEM) == wanted


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ('Pmax=? [F<=5 "goal"]', 'F<=5 "goal"'),
        ('Pmax=? [F<5 "goal"]', 'F<=4 "goal"'),
        ('Pmax=? [F=5 "goal"]', 'F[5,5] "goal"'),
        ('Pmax=? [F>5 "goal"]', 'F>=6 "goal"'),
        ('Pmax=? [Fsteps<=5 "goal"]', 'F<=5 "goal"'),
        ('Pmax=? [Ftime<=5 "goal"]', 'F<=5 "goal"'),
        ("Pmax=? [F<=K (x=2)]", "F<=2 (x = 2)"),
        ("Pmax=? [F[1,K+3] busy]", "F[1,5] busy"),
        ("Pmax=? [F[0,3] busy]", "F<=3 busy"),
        ("Pmax=? [F<=max(2,K) x=1]", "F<=2 (x = 1)"),
        ("Pmax=? [F<=2*(K+1) x=1]", "F<=6 (x = 1)"),
        ("Pmax=? [busy U<= 3 // steps\n x=1]", "busy U<=3 (x = 1)"),
        ('Pmax=? [busy Usteps<=200 "goal"]', 'busy U<=200 "goal"'),
        ('Pmax=? [late U<=7 "goal"]', '(x > 2 | busy) U<=7 "goal"'),
        ('Pmax=? [true U<=7 "goal"]', 'F<=7 "goal"'),
        ("Pmax=? [G<=7 busy]", "G<=7 busy"),
        ("Pmax=? [G<K busy]", "G<=1 busy"),
        ('Pmax=? [X "goal"]', 'X "goal"'),
        ('Pmax=? [X X "goal"]', 'X (X "goal")'),
        ('Pmax=? [F "h" & F "goal"]', 'F ("h" & (F "goal"))'),
        ('Pmax=? [(F "h") & F "goal"]', '(F "h") & (F "goal")'),
        ('Pmax=? [(!"h" U "goal") & F busy]', '(!"h" U "goal") & (F busy)'),
        ('Pmax=? [!"h" U "goal" & F busy]', '!"h" U ("goal" & (F busy))'),
        ('Pmax=? [busy & X "goal" | "h"]', 'busy & (X ("goal" | "h"))'),
        ('Pmax=? [F "h" U "goal"]', '(F "h") U "goal"'),
        ('Pmax=? [busy U X "goal"]', 'busy U (X "goal")'),
        ('Pmax=? [!X "goal"]', '!(X "goal")'),
        ('Pmax=? [!(F<=3 "h")]', '!(F<=3 "h")'),
        ('Pmax=? ["h" & !G<=3 !"goal"]', '"h" & !(G<=3 !"goal")'),
        ('Pmax=? ["h" => F<=3 "goal"]', '"h" => (F<=3 "goal")'),
        ('Pmax=? [busy W<=3 "goal"]', 'busy W<=3 "goal"'),
        ('Pmax=? [busy R<=3 "goal"]', 'busy R<=3 "goal"'),
        ('Pmax=? [F ("h" & x + 1 = 2 & F "goal")]', 'F ("h" & x + 1 = 2 & (F "goal"))'),
        ('Pmax=? ["h" ? (F "goal") : (X "goal")]', '"h" ? (F "goal") : (X "goal")'),
        ('Pmax=? ["h" <=> X "goal"]', '"h" <=> (X "goal")'),
    ],
)
def test_what_needs_memory_is_read_as_a_mission(text: str, formula: str) -> None:
    assert parse_property(text, PROBLEM) == Mission(formula=formula)
    assert parse_property(Mission(formula=formula).text, PROBLEM) == Mission(formula=formula)
    least = Mission(formula=formula, maximise=False)
    assert parse_property(text.replace("max=", "min="), PROBLEM) == least
    limit = parse_property(text.replace("max=?", "max>=0.5"), PROBLEM)
    assert limit == Threshold(objective=Mission(formula=formula), relation=">=", bound=0.5)
    assert parse_property(limit.text, PROBLEM) == limit


@pytest.mark.parametrize("seed", range(200))
def test_the_canonical_text_of_a_mission_reads_back_to_itself(seed: int) -> None:
    term = random_path(Random(seed), ("goal", "h"))
    try:
        read = parse_property(property_of(term), PROBLEM)
    except NotExplainableError as error:
        nearest = re.search(r"P(max|min)=\? .*(?=\.$)", error.message)
        assert nearest
        assert parse_property(nearest[0], PROBLEM)
        return
    assert parse_property(read.text, PROBLEM) == read


def test_a_variable_may_be_called_then() -> None:
    odd = problem(names=StateNames(count=4, variables={"then": np.arange(4) > 1}))
    read = parse_property('Pmax=? [F[1,2] then & "goal"]', odd)
    assert read == Mission(formula='F[1,2] (then & "goal")')
    both = parse_property(f'{read.text} then Pmax=? [F "x] then " | then]', replace_label(odd))
    assert isinstance(both, Lexicographic)
    assert both.levels == (read, ReachAvoid(goal='"x] then " | then'))


def replace_label(odd: Problem) -> Problem:
    labels = {**odd.mdp.labels, "x] then ": odd.mdp.labels["goal"]}
    return problem(names=odd.mdp.names, labels=labels)


def test_of_several_properties_only_the_first_may_need_memory() -> None:
    steps, cost = 'Pmax=? [F<=3 "goal"]', 'R{"cost"}min=? [F "goal"]'
    read = parse_property(f"{steps} then {cost}", PROBLEM)
    assert isinstance(read, Lexicographic)
    assert parse_property(read.text, PROBLEM) == read
    with pytest.raises(PropertyError, match="only the first may need memory"):
        parse_property(f"{cost} then {steps}", PROBLEM)


LEAST, ARRIVE = 'R{"cost"}min=? [F "goal"]', 'Pmax=? [F "goal"]'
SUM = 'R{"cost"}max=? [C]'


@pytest.mark.parametrize(
    "text",
    [
        "least then surest",
        '"least" then "surest"',
        f"{LEAST} then surest",
        f"least then {ARRIVE}",
        "least\tthen\n surest",
        "least then arrival",
    ],
)
def test_names_of_the_source_can_stand_between_then(text: str) -> None:
    named = replace(
        PROBLEM,
        properties={name: parse_property(said, PROBLEM) for name, said in (("least", LEAST), ("surest", ARRIVE))},
        others={"arrival": ARRIVE},
    )
    assert choose_objective(named, text) == parse_property(f"{LEAST} then {ARRIVE}", PROBLEM)


def test_a_name_with_then_in_it_is_one_name() -> None:
    wanted = parse_property(LEAST, PROBLEM)
    named = replace(PROBLEM, properties={"now then later": wanted, "now": parse_property(ARRIVE, PROBLEM)})
    assert choose_objective(named, "now then later") == wanted
    with pytest.raises(PropertyError, match="'now then later', 'now'; got 'later'"):
        choose_objective(named, "now then later then later")


def test_a_discount_beside_several_properties_is_for_those_without_end() -> None:
    total = Discounted(reward="cost", discount=0.9, maximise=True)
    read = parse_property(f"{SUM} then {ARRIVE}", PROBLEM, discount=0.9)
    assert read == Lexicographic(levels=(total, ReachAvoid(goal=GOAL)))
    for text in (SUM, LEAST):  # beside another wish it is no matter whether a wish needs it
        assert wish_of(PROBLEM, text, discount=0.9) == parse_property(
            text, PROBLEM, discount=0.9 if text == SUM else None
        )


@pytest.mark.parametrize("text", [LEAST, ARRIVE, f"{LEAST} then {ARRIVE}", "least", "discounted"])
def test_a_discount_that_nothing_takes_is_refused(text: str) -> None:
    discounted = Discounted(reward="cost", discount=0.5, maximise=True)
    named = replace(PROBLEM, properties={"least": parse_property(LEAST, PROBLEM), "discounted": discounted})
    with pytest.raises(PropertyError, match=r"sum without end.*the discount 0\.9"):
        choose_objective(named, text, discount=0.9)


@pytest.mark.parametrize("asked", ["C", "C<=5", "I=3", "S"])
def test_the_nearest_that_can_be_explained_is_about_the_same_reward_and_can_be_read(asked: str) -> None:
    gain = {"gain": Reward(choice=np.resize([-1.0, 1.0], PROBLEM.mdp.choices))}
    signed = replace(PROBLEM, mdp=replace(PROBLEM.mdp, rewards={**PROBLEM.mdp.rewards, **gain}))
    for way in ("min", "max"):
        with pytest.raises(NotExplainableError) as caught:
            parse_property(f'R{{"gain"}}{way}=? [{asked}]', signed)
        assert '"cost"' not in caught.value.message
        nearest = re.findall(r'R\{"gain"\}\w+=\? \[.*?\]', caught.value.message)
        assert [parse_property(text, signed).text for text in nearest] == nearest
        assert ExpectedReward(goal=GOAL, reward="gain", maximise=way == "max").text in nearest


@pytest.mark.parametrize(
    ("text", "maximise", "relation", "bound"),
    [
        ('P>=0.9 [F "goal"]', False, ">=", 0.9),
        ('P>0 [F "goal"]', False, ">", 0),
        ('P<=1 [F "goal"]', True, "<=", 1),
        ('P<p [F "goal"]', True, "<", 0.25),
        ('Pmin>=1 [F "goal"]', False, ">=", 1),
        ('Pmax>=1-p [F "goal"]', True, ">=", 0.75),
        ('Pmin<0.123456789 [F "goal"]', False, "<", 0.123456789),
        ('R{"cost"}<=5 [F "goal"]', True, "<=", 5),
        ('R{"cost"}>=5 [F "goal"]', False, ">=", 5),
        ('R{"cost"}min<=N*2 [F "goal"]', False, "<=", 6),
        ('Tmax>1e3 [F "goal"]', True, ">", 1000),
    ],
)
def test_a_bound_without_min_or_max_must_hold_under_every_policy(
    text: str, maximise: bool, relation: str, bound: float
) -> None:
    read = parse_property(text, PROBLEM)
    assert isinstance(read, Threshold)
    assert (read.objective.maximise, read.relation, read.bound) == (maximise, relation, bound)
    assert read.objective.goal == GOAL
    assert parse_property(read.text, PROBLEM) == read


def test_without_decisions_min_and_max_need_not_be_said() -> None:
    assert parse_property('P=? [F "goal"]', CHAIN) == ReachAvoid(goal=GOAL)
    assert parse_property('R=? [F "goal"]', CHAIN) == ExpectedCost(goal=GOAL, reward="cost")
    for text in ('P=? [F "goal"]', 'R{"cost"}=? [F "goal"]', 'T=? [F "goal"]'):
        with pytest.raises(PropertyError, match="must say min or max"):
            parse_property(text, PROBLEM)


@pytest.mark.parametrize(
    ("text", "what", "nearest"),
    [
        ("Pmax=? [G>K-1 !busy]", "G, W or R without a bound", "Pmin=? [F>=2 busy]"),
        ('Pmax=? [F^{rew{"cost"}>=5} busy]', "F with a bound on a reward", "Pmax=? [F busy]"),
        ('Pmax=? [true Urew{"cost"}>=5 (x = 0)]', "U with a bound on a reward", "Pmax=? [true U (x = 0)]"),
        (
            'Pmax=? [F{"cost"}<=5 (busy & F<=3 "goal")]',
            "F with a bound on a reward",
            'Pmax=? [F (busy & (F<=3 "goal"))]',
        ),
        ('R{"cost"}max=? [Csteps<=200]', "C with a bound", 'R{"cost"}max=? [Fsure "goal"]'),
        ('R{"cost"}max=? [C<=200]', "C with a bound", 'R{"cost"}max=? [Fsure "goal"]'),
        (
            'R{"cost"}max=? [C]',
            "C (a reward that adds up without end)",
            'R{"cost"}max=? [Cdiscount=0.95], or the reward until a goal, R{"cost"}max=? [Fsure "goal"].',
        ),
        ('R{"cost"}min=? [C]', "C (a reward that adds up without end)", 'R{"cost"}min=? [F "goal"].'),
        ('R{"cost"}max=? [I=3]', "I (the reward at one instant)", 'R{"cost"}max=? [Fsure "goal"]'),
        ('R{"cost"}max=? [S]', "A long-run average", 'R{"cost"}max=? [Fsure "goal"]'),
        ('R{"cost"}max=? [LRA]', "A long-run average", 'R{"cost"}max=? [Fsure "goal"]'),
        ("S=? [busy]", "A long-run average", "[F "),
        ('LRAmax=? ["goal"]', "A long-run average", "[F "),
        ('Pmax=? [G !"h"]', "G (always)", 'Pmin=? [F "h"]'),
        ("Pmin=? [G x<2]", "G (always)", "Pmax=? [F !(x < 2)]"),
        ('Pmax=? [busy W "goal"]', "W (weak until)", 'Pmin=? [busy & !"goal" U !busy & !"goal"]'),
        ('Pmax=? [busy R "goal"]', "R (release)", 'Pmin=? [!busy U !"goal"]'),
        ('Pmax=? [G F "goal"]', "G over a temporal operator", 'Pmax=? [F "goal"]'),
        ('Pmax=? [(G !"h") & (F "goal")]', "G, W or R without a bound", 'Pmax=? [!"h" U "goal"]'),
        ('Pmax=? [!(F "goal")]', "G, W or R without a bound", 'Pmin=? [F "goal"]'),
        ('Pmax=? [!(busy U "goal")]', "G, W or R without a bound", 'Pmin=? [busy U "goal"]'),
        ('Pmax=? [F (busy & (G "h"))]', "G, W or R without a bound", 'Pmax=? [F (busy & (G<=100 "h"))]'),
        (
            'Pmax=? [!((G busy) => F "goal") & F "h"]',
            "G, W or R",
            'Pmax=? [!((G<=100 busy) => (F<=100 "goal")) & (F "h")]',
        ),
        ('Pmax=? [!(F (busy & (F "goal")))]', "G, W or R without a bound", 'Pmin=? [F (busy & (F "goal"))]'),
        ('Pmax=? [(busy W "h") & (F "goal")]', "G, W or R without a bound", "Pmax=? [("),
        ('R{"cost"}min=? [F "h" & X "goal"]', "A reward until a formula of linear", 'R{"cost"}min=? [F "goal"]'),
        ('Tmin=? [F<=3 (F "goal")]', "A reward until a formula of linear", 'Tmin=? [F "goal"]'),
        ('Pmax=? [Fsure "goal"]', "Fsure", 'Pmax=? [F "goal"]'),
        ('Pmax=? [F "h" & Fsure "goal"]', "Fsure", "Pmax=? [F "),
        ('Pmax=? [F P>=0.5 [F "goal"]]', "A property inside a property", "[F "),
        ('Pmax=? [F busy & Rmin<=3 [F "goal"]]', "A property inside a property", "[F "),
        ('Pmax=? [E [F "goal"] U busy]', "A property inside a property", "[F "),
        ('multi(Pmax=? [F "goal"], P>=0.5 [F "h"])', "Several objectives at once", "each of them alone"),
        ('filter(max, Pmax=? [F "goal"], busy)', "A filter over states", "the property without it"),
        ('Pmax=? [F "goal" {busy}]', "A filter over states", "the property without it"),
        ('A [F "goal"]', "A or E", 'Pmin>=1 [F "goal"]'),
        ('<<1>> Pmax=? [F "goal"]', "A property of players", "without players"),
        ('[[1]] Pmax=? [F "goal"]', "A property of players", "without players"),
        ("quantile(max A, Pmax>0.5 [F busy])", "A quantile", "threshold"),
        ('Pmax=? [F "goal"] + 1', "A combination of properties", "each of them alone"),
        ('R[var]{"cost"}min=? [F busy]', "A spread", "expected reward"),
        ('R{"cost"}/{"cost"}min=? [F busy]', "A ratio", "each reward alone"),
        ('P=0.5 [F "goal"]', "A value compared with = or !=", "threshold"),
        ('R{"cost"}min=? [busy U "goal"]', "A reward until anything but F", 'R{"cost"}min=? [F "goal"]'),
        ('Tmin=? [F<=3 "goal"]', "A reward until anything but F", 'Tmin=? [F "goal"]'),
        ("Pmax=? [busy]", "A property without a temporal operator", "Pmax=? [F busy]"),
    ],
)
def test_what_cannot_be_explained_is_refused_by_name_with_its_nearest(text: str, what: str, nearest: str) -> None:
    with pytest.raises(PropertyError) as caught:
        parse_property(text, PROBLEM)
    assert caught.value.message.startswith(what)
    assert "cannot be explained here. The nearest that can: " in caught.value.message
    assert nearest in caught.value.message


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "at column 1, got the end"),
        ("hello", "such as Pmax=\\? .* at column 1, got 'hello'"),
        ('"goal"', "such as Pmax"),
        ('Pmax [F "goal"]', "must have '=' at column 6"),
        ('Pmax=? F "goal"', "must have '\\[' at column 8"),
        ('Pmax=? [F "goal"', "must have '\\]' at column 17, got the end"),
        ('Pmax=? [F "goal"] "h"', "one property at a time\\) at column 19"),
        ("Pmax=? [F x = & 3]", "at column 15, got '& 3\\]'"),
        ('Pmax=? ["goal" U ]', "at column 18"),
        ("Pmax=? [F x]", "must be true or false, but 'x' is a number"),
        ('Pmax=? [x U "goal"]', "must be true or false, but 'x' is a number"),
        ('Pmax=? [F "gaol"]', "one of the model's: 'goal', 'h'.* got 'gaol'"),
        ('Pmax=? ["gaol" U "goal"]', "got 'gaol'"),
        ("Pmax=? [F goal]", 'Labels stand in quotation marks: "goal"'),
        ('R{"cots"}min=? [F "goal"]', "A reward must be one of the model's: 'cost'; got 'cots'"),
        ('Rmin=? [F "goal"', "must have '\\]' at column 17, got the end"),
        ('R[first]{"cost"', "A spread rather than"),
        ("R[exp", "must have '\\]' at column 6, got the end"),
        ("R[best of]", "must have 'exp' at column 3, got 'best of\\]'"),
        ("Pmax=? [F x == 3]", "must have '=' at column 13, got '== 3\\]'. PRISM writes '=', not '=='"),
        ("Pmax=? [F busy -> x = 3]", "must have '=>' at column 16, got '-> x = 3\\]'. PRISM writes '=>', not '->'"),
        ("Pmax=? [F ~busy]", "must have '!' at column 11, got '~busy\\]'. PRISM writes '!', not '~'"),
        ("Pmax=? [F busy && x = 3]", "PRISM writes '&', not '&&'"),
        ('Pmax=? [F "goal]', "at column 11, got a quotation mark that is never closed"),
        ("Pmax=? [F max(x, 1 > 1]", "must have ',' or '\\)' at column 23, got '\\]'"),
        ('R{1}min=? [F "goal"]', "the name of a reward in quotation marks.* at column 3"),
        ('Pmax=? [busy U "h" U "goal"]', "put brackets around one of them.* at column 20"),
        ('Pmax=? [(busy U<=3 "h" W "goal")]', "put brackets around one of them.* at column 24"),
        ('Pmax=? [F<=-1 "goal"]', "a whole number from 0 to 1000000000, got -1 in 'F<=-1'"),
        ('Pmax=? [F<=1.5 "goal"]', "a whole number from 0 to 1000000000, got 1.5 in 'F<=1.5'"),
        ('Pmax=? [F<=p "goal"]', "a whole number from 0 to 1000000000, got 0.25 in 'F<=p'"),
        ('Pmax=? [F<=1e99 "goal"]', "a whole number from 0 to 1000000000, got 1e\\+99"),
        ('Pmax=? [F<=0/0 "goal"]', "a whole number from 0 to 1000000000, got nan"),
        ('Pmax=? [F<=x "goal"]', "a number or a constant of the source, got 'x'"),
        ('Pmax=? [F<=M "goal"]', "a number or a constant of the source, got 'M'"),
        ('Pmax=? [F<=busy "goal"]', "a number or a constant of the source, got 'busy'"),
        ('Pmax=? [F<0 "goal"]', "must leave at least step 0, got 'F<0'. Say F<=0"),
        ('Pmax=? [F[5,2] "goal"]', "must not end before it begins, got 'F\\[5,2\\]'"),
        ('Pmax=? [Fsteps "goal"]', "A bound on steps must be said, as in F<=10, got 'Fsteps'"),
        ('Pmax=? [X<=3 "goal"]', "X must have no bound, got 'X<=3'. After k steps: F\\[k,k\\]"),
        ("Pmax=? [F<=3]", "A name must be .* got 'F'. The operator F needs an operand behind it"),
        ('Pmax=? [F[1,] "goal"]', "The bound of F\\[1,\\] '' must have a number"),
        ('Pmax=? [Xsteps<=3 "goal"]', "X must have no bound, got 'Xsteps<=3'"),
        ('Pmax=? [F ("h" & (F x))]', "must be true or false, but 'x' is a number"),
        ('Pmax=? [F ("h" & (F "gaol"))]', "one of the model's: 'goal', 'h'.* got 'gaol'"),
        ('Pmax=? [(F "goal") = (F "h")]', "A temporal operator must stand in a truth value"),
        ("Pmax=? [F<=3 (F " + "(" * 900 + "busy" + ")" * 900 + ")]]", "got ']'"),
        ("Pmax=? [" + "X (" * 1200 + "busy" + ")" * 1200 + "]", "nested too deeply"),
        ('P>=1.5 [F "goal"]', "must lie between 0 and 1, got 1.5"),
        ('P>=-1 [F "goal"]', "must lie between 0 and 1, got -1"),
        ('R{"cost"}<=-1 [F "goal"]', "must be finite and at least 0, got -1"),
        ('P>=0/0 [F "goal"]', "must lie between 0 and 1, got nan"),
        ('P>=x [F "goal"]', "a number or a constant of the source, got 'x'"),
        ('P>=busy [F "goal"]', "a number or a constant of the source, got 'busy'"),
        ('P>=true [F "goal"]', "A bound must have a number, but 'true' is a truth value"),
        ("Pmax=? [F " + "(" * 3000 + "busy" + ")" * 3000 + "]", "nested too deeply"),
    ],
)
def test_a_wrong_property_is_refused_with_its_reason(text: str, said: str) -> None:
    with pytest.raises(PropertyError, match=said):
        parse_property(text, PROBLEM)


def test_a_reward_must_be_named_where_there_are_several_or_none() -> None:
    with pytest.raises(PropertyError, match=r"must name its reward where the model has several.*'cost', 'time'"):
        parse_property('Rmin=? [F "goal"]', TWO_REWARDS)
    with pytest.raises(PropertyError, match=r"it has none.*Tmin"):
        parse_property('Rmin=? [F "goal"]', problem(rewards={}))


def test_variables_may_bear_the_names_of_operators() -> None:
    columns = {name: np.arange(4) for name in "FGXUWRPSTC"}
    odd = problem(names=StateNames(count=4, variables=columns | {"I": np.arange(4) > 2, "E": np.arange(4) > 1}))
    for name in columns:
        assert parse_property(f"Pmax=? [F {name} = 3]", odd) == ReachAvoid(goal=f"{name} = 3")
        compound = f"1 < {name} & {name} + 1 > 2"
        assert parse_property(f"Pmax=? [{compound} U ({compound})]", odd) == ReachAvoid(goal=compound, through=compound)
        compared = f"{name} <= 2 + 1 & {name} - 1 >= 0 & {name} < max(3, 1) & {name} != 3"
        assert parse_property(f"Pmax=? [{compared} U {compared}]", odd) == ReachAvoid(goal=compared, through=compared)
    assert parse_property("Pmax=? [I U E]", odd) == ReachAvoid(goal="E", through="I")
    assert parse_property("Pmax=? [F I]", odd) == ReachAvoid(goal="I")


@pytest.mark.parametrize("name", list("FGXUWRPSTCIAE"))
def test_a_truth_value_may_bear_the_name_of_an_operator(name: str) -> None:
    odd = problem(names=StateNames(count=4, variables={name: np.arange(4) > 1}))
    assert parse_property(f'Pmax=? [!{name} U {name} & "goal"]', odd) == ReachAvoid(
        goal=f'{name} & "goal"', through=f"!{name}"
    )
    assert parse_property(f'Pmax=? [{name} U "goal"]', odd) == ReachAvoid(goal=GOAL, through=name)
    assert parse_property(f"Pmax=? [F {name}]", odd) == ReachAvoid(goal=name)


@given(st.text(alphabet='PRTminax=?[]{}"goalhxbusy FGUXW!&|<>0123().,-;:/\n', max_size=40))
def test_any_text_is_read_or_refused_in_a_sentence(text: str) -> None:
    try:
        read = parse_property(text, PROBLEM)
    except PropertyError:
        return
    assert parse_property(read.text, PROBLEM) == read


# -- what is wanted, if nobody says so -----------------------------------------------------------------------------------


def test_a_text_or_the_name_of_a_property_of_the_source_is_wanted() -> None:
    own = {"home": ReachAvoid(goal=GOAL), "quick": ExpectedCost(goal=GOAL, reward=None)}
    with_own = problem(properties=own, objective=own["quick"])
    assert choose_objective(with_own, "home") is own["home"]
    assert choose_objective(with_own, '"home"') is own["home"]
    assert choose_objective(with_own, 'Pmin=? [F "h"]') == ReachAvoid(goal='"h"', maximise=False)
    assert choose_objective(with_own) is own["quick"]
    with pytest.raises(PropertyError, match="one of the source's own: 'home', 'quick'; got 'hom'"):
        choose_objective(with_own, "hom")


def test_the_only_property_of_the_source_is_wanted() -> None:
    own = ReachAvoid(goal='"h"')
    assert choose_objective(problem(properties={"a": own})) is own


@pytest.mark.parametrize("label", ["goal", "target", "destination"])
def test_else_the_only_reward_until_the_only_goal_is_wanted(label: str) -> None:
    mask = np.array([0, 0, 0, 1], dtype=bool)
    there = problem(labels={label: mask, "elsewhere": mask})
    assert choose_objective(there) == ExpectedCost(goal=f'"{label}"', reward="cost")
    several = {"a": ReachAvoid(goal='"elsewhere"'), "b": ReachAvoid(goal='"elsewhere"', maximise=False)}
    assert choose_objective(problem(labels={label: mask, "elsewhere": mask}, properties=several)) == choose_objective(
        there
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"labels": {"h": np.array([0, 0, 0, 1], dtype=bool)}},
        {"labels": {name: np.array([0, 0, 0, 1], dtype=bool) for name in ("goal", "target")}},
        {"rewards": {}},
        {"rewards": {"cost": COST, "time": COST}},
    ],
)
def test_else_what_there_is_is_listed_with_an_example_that_works(changes: dict[str, Any]) -> None:
    open_problem = problem(**changes)
    with pytest.raises(PropertyError) as caught:
        choose_objective(open_problem)
    message = caught.value.message
    for name in (*open_problem.mdp.labels, *open_problem.mdp.rewards):
        assert name in message
    example = message.rsplit("--property '", 1)[1].removesuffix("'.")
    assert parse_property(example, open_problem).goal  # type: ignore[union-attr]

"""The re-checker builds the product of a model with a mission's memory by its own means: the same arrays come out."""

from __future__ import annotations

import itertools
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from random_models import random_rich_problem

from ratherthan.errors import ExplanationError, ModelError
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.objective import Mission
from ratherthan.model.problem import Problem
from ratherthan.model.product import unfolded
from ratherthan.model.property import parse_property
from ratherthan.verify import missions
from ratherthan.verify.formulas import only_a_deadline
from ratherthan.verify.missions import TooLargeError, memory_of
from ratherthan.verify.product import deviation, pairs_of, unfolded_for

A, B = '"goal"', '"hazard"'
FORMULAS = [
    f"F<=3 {A}",
    f"F<2 {A}",
    f"F[1,3] {A}",
    f"X {A}",
    f"X (X ({A} | {B}))",
    f"!{B} U<=4 {A}",
    f"F ({A} & (F {B}))",
    f"F ({A} & (X (F {A})))",
    f"(F {A}) & (F {B})",
    f"(!{B} U {A}) & (F {B})",
    f"(F {A}) | (X {B})",
    f"G<=3 !{B}",
    f"(F<=5 {A}) & (G<=2 !{B})",
    f"F ({A} & (X (!{B} U {A})))",
    f"!(G<=2 {A})",
    f"F<=4 ({A} & (F<=3 {B}))",
    f"(X {A}) => (F {B})",
    f"(X {A}) <=> (X (X {B}))",
    f"F[2,5] ({A} & (X {B}))",
    f"{A} W<=3 {B}",
    f"{A} R<=3 {B}",
    f"F>=2 {A}",
]


def mission_of(formula: str, problem: Problem) -> Mission:
    """Return a mission in its canonical spelling."""
    found = parse_property(f"Pmax=? [{formula}]", problem)
    assert isinstance(found, Mission)
    return found


def rich(seed: int, states: int = 7) -> Problem:
    return random_rich_problem(Random(seed), most_states=states, objective=Mission(formula=f"X {A}"))


@pytest.mark.parametrize("formula", FORMULAS)
def test_the_product_is_the_one_that_is_built_here(formula: str) -> None:
    for seed in range(6):
        problem = rich(seed)
        mission = mission_of(formula, problem)
        assert deviation(problem, unfolded(problem, mission), pairs_of(problem, mission)) is None, seed


def test_a_second_mission_is_unfolded_on_top_of_the_first() -> None:
    problem = rich(3)
    first, second = mission_of(FORMULAS[0], problem), mission_of(FORMULAS[6], problem)
    product = unfolded(problem, first)
    assert deviation(product, unfolded(product, second), pairs_of(product, second)) is None


Word = tuple[tuple[bool, bool], ...]


def accomplished(word: Word) -> dict[str, bool]:
    """Return which missions a word of (goal, hazard) satisfies whatever follows it, each told in plain Python."""
    a, b = [x for x, _ in word], [y for _, y in word]
    times = range(len(word))
    return {
        f"F<=3 {A}": any(a[:4]),
        f"F[1,3] {A}": any(a[1:4]),
        f"X {A}": any(a[1:2]),
        f"!{B} U<=4 {A}": any(a[j] and not any(b[:j]) for j in times if j <= 4),
        f"F ({A} & (F {B}))": any(a[i] and any(b[i:]) for i in times),
        f"F ({A} & (X (F {A})))": sum(a) >= 2,
        f"(F {A}) & (F {B})": any(a) and any(b),
        f"(!{B} U {A}) & (F {B})": any(a[j] and not any(b[:j]) for j in times) and any(b),
        f"G<=3 !{B}": len(word) >= 4 and not any(b[:4]),
        f"F<=4 ({A} & (F<=3 {B}))": any(a[i] and any(b[i : i + 4]) for i in times if i <= 4),
        f"F[2,5] ({A} & (X {B}))": any(a[i] and b[i + 1] for i in times if 2 <= i <= 5 and i + 1 < len(word)),
        f"F>=2 {A}": any(a[2:]),
        f"{A} R<=3 {B}": (all(b[:4]) and len(word) >= 4) or any(a[i] and all(b[: i + 1]) for i in times if i <= 3),
    }


def four_letters() -> Problem:
    """Return a model with a state for every letter."""
    problem = rich(0, 7)
    while problem.mdp.states < 4:
        problem = rich(problem.mdp.states + 7, 7)
    count = problem.mdp.states
    labels = {"goal": np.arange(count) % 4 >= 2, "hazard": np.arange(count) % 2 == 1}
    return replace(problem, mdp=replace(problem.mdp, labels=labels))


def test_a_word_is_done_when_its_mission_is_accomplished_whatever_follows() -> None:
    problem = four_letters()
    names = list(accomplished(((False, False),)))
    memories = {name: memory_of(mission_of(name, problem).formula, problem.mdp) for name in names}
    state_of = {(bool(a), bool(b)): 2 * a + b for a in (0, 1) for b in (0, 1)}
    for length in range(1, 7):
        words = itertools.product(state_of, repeat=length)
        for word in itertools.islice(words, 0, None, 1 if length < 5 else 7):
            told = accomplished(word)
            for name, memory in memories.items():
                at = memory.start
                for letter in word:
                    at = int(memory.after[at, memory.letter[state_of[letter]]])
                assert bool(memory.done[at]) == told[name], (name, word)


def test_nothing_is_remembered_that_need_not_be() -> None:
    problem = four_letters()
    count = {name: len(memory_of(mission_of(name, problem).formula, problem.mdp).done) for name in FORMULAS}
    assert count[f"F ({A} & (F {B}))"] == 3  # before, after the first, done
    assert count[f"(F {A}) & (F {B})"] == 4
    assert count[f"F<=3 {A}"] == 6  # 4, 3, 2, 1 instants left, done, failed


def test_a_bound_of_a_thousand_steps_is_no_matter() -> None:
    problem = four_letters()
    memory = memory_of(mission_of(f"F<=1000 {A}", problem).formula, problem.mdp)
    assert len(memory.done) == 1003


def test_what_is_too_large_is_said_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = four_letters()
    monkeypatch.setattr(missions, "MOST_MOVES", 100)
    with pytest.raises(TooLargeError):
        memory_of(mission_of(f"F<=1000 {A}", problem).formula, problem.mdp)


def test_a_bound_that_is_no_number_is_refused() -> None:
    with pytest.raises(ExplanationError, match="numbers of steps"):
        memory_of('F<=N "goal"', four_letters().mdp)


def rows_of(mdp: MDP) -> list[np.ndarray]:
    """Return the probabilities of each choice, back to front."""
    return [mdp.branch_to_probability[mdp.branches_of(choice)][::-1] for choice in range(mdp.choices)]


CHANGES = {
    "targets": lambda m: {"branch_to_target": np.roll(m.branch_to_target, 1)},
    "probabilities": lambda m: {"branch_to_probability": np.concatenate(rows_of(m))},
    "actions": lambda m: {"choice_to_action": np.roll(m.choice_to_action, 1)},
    "label 'goal'": lambda m: {"labels": dict(m.labels) | {"goal": ~m.labels["goal"]}},
    "reward 'cost'": lambda m: {"rewards": dict(m.rewards) | {"cost": Reward(choice=m.rewards["cost"].choice + 1)}},
}


@pytest.mark.parametrize("what", CHANGES)
def test_another_product_is_found_out(what: str) -> None:
    found = []
    for seed in range(40):
        problem = rich(seed, 6)
        mission = mission_of(f"F<=3 {A}", problem)
        product = unfolded(problem, mission)
        try:
            other = replace(product, mdp=replace(product.mdp, **CHANGES[what](product.mdp)))
        except ModelError:  # probabilities that do not fit any more
            continue
        flaw = deviation(problem, other, pairs_of(problem, mission))
        if flaw is not None:  # else rolling them changed nothing
            found.append(flaw)
    assert found
    assert all(what in flaw for flaw in found)


def test_other_ends_are_found_out() -> None:
    problem = rich(4)
    mission = mission_of(f"F<=3 {A}", problem)
    product = unfolded(problem, mission)
    assert product.unfolding is not None
    forged = replace(product, unfolding=replace(product.unfolding, satisfied=~product.unfolding.satisfied))
    assert "done" in str(deviation(problem, forged, pairs_of(problem, mission)))
    again, flaw = unfolded_for(forged, mission)
    assert again is forged
    assert flaw is not None


@pytest.mark.parametrize(
    ("formula", "plain"),
    [(f"F<=3 {A}", True), (f"F<=3 ({A} & {B})", True), (f"F ({A} & (F {B}))", False), (f"X {A}", False)],
)
def test_a_deadline_is_told_from_other_missions(formula: str, plain: bool) -> None:
    assert only_a_deadline(formula) is plain


def test_ten_thousand_steps_take_no_time() -> None:
    problem = four_letters()
    memory = memory_of(mission_of(f"(F<=10000 {A}) & (F {B})", problem).formula, problem.mdp)
    assert 20_000 < len(memory.done) < 20_010

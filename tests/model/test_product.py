"""The product of a model with what a mission must remember: its values, its numbering, and what it keeps of the model."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from random import Random

import numpy as np
import pytest
from lasso import Lasso
from missions import chances, random_mission, random_model, unfolding_of
from random_models import random_policy

from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model import product
from ratherthan.model.mdp import MDP
from ratherthan.model.objective import Mission, ReachAvoid
from ratherthan.model.policy import Policy, check_policy
from ratherthan.model.problem import Problem
from ratherthan.model.product import choices_of_origin, lifted, unfolded
from ratherthan.model.property import parse_property
from ratherthan.model.syntax import Term
from ratherthan.model.temporal import chance_of
from ratherthan.model.world import World

TRIES = int(os.environ.get("RATHERTHAN_MODELS", "200"))


def chance_by_histories(problem: Problem, term: Term, start: int, steps: int, *, maximise: bool) -> float:
    """The chance of a mission that is decided after `steps`, over all policies that may look at the whole history."""
    mdp = problem.mdp
    letters = [frozenset(name for name, mask in mdp.labels.items() if mask[state]) for state in range(mdp.states)]

    @cache
    def value(history: tuple[int, ...]) -> float:
        if len(history) == steps + 1:
            return float(Lasso([letters[state] for state in history], [frozenset()]).holds(term))
        found = []
        for choice in mdp.choices_of(history[-1]):
            own = mdp.branches_of(choice)
            pairs = zip(mdp.branch_to_probability[own], mdp.branch_to_target[own], strict=True)
            found.append(sum(float(p) * value((*history, int(t))) for p, t in pairs))
        return max(found) if maximise else min(found)

    return value((start,))


@pytest.mark.parametrize("seed", range(TRIES))
def test_the_best_plan_on_the_product_is_the_best_of_all_that_remember_everything(seed: int) -> None:
    random = Random(seed)
    problem = random_model(random, most_states=4)
    steps = random.choice([1, 2, 3, 4])
    mission, term = random_mission(random, problem, steps=steps)
    values = chances(unfolded(problem, mission), maximise=mission.maximise, sweeps=steps)
    for state in range(problem.mdp.states):
        wanted = chance_by_histories(problem, term, state, steps, maximise=mission.maximise)
        assert values[state] == pytest.approx(wanted, abs=1e-12), mission.text


@pytest.mark.parametrize("seed", range(TRIES))
def test_the_numbering_is_that_of_its_description(seed: int) -> None:
    """The twin of the kernel: pairs in the order in which they are met, memories in the order of the pairs."""
    random = Random(seed)
    problem = random_model(random)
    made = unfolded(problem, random_mission(random, problem)[0])
    mdp, found, ended = problem.mdp, unfolding_of(made), unfolding_of(made).satisfied | unfolding_of(made).violated
    assert made.mdp.names.count == made.mdp.states == len(found.state) == len(found.memory)
    assert found.state[: mdp.states].tolist() == list(range(mdp.states))
    pairs = list(zip(found.state.tolist(), found.memory.tolist(), strict=True))
    assert len(set(pairs)) == len(pairs)
    met = list(range(mdp.states))
    for pair, (state, _) in enumerate(pairs):
        own, was = made.mdp.choices_of(pair), mdp.choices_of(state)
        assert len(own) == len(was)
        for choice, before in zip(own, was, strict=True):
            to, then = made.mdp.branches_of(choice), mdp.branches_of(before)
            assert made.mdp.choice_to_action[choice] == mdp.choice_to_action[before]
            targets, probabilities = made.mdp.branch_to_target[to], made.mdp.branch_to_probability[to]
            if ended[pair]:
                assert (targets.tolist(), probabilities.tolist()) == ([pair], [1.0])
                continue
            assert found.state[targets].tolist() == mdp.branch_to_target[then].tolist()
            assert probabilities.tolist() == mdp.branch_to_probability[then].tolist()
            met += [target for target in dict.fromkeys(targets.tolist()) if target not in met]
    assert met == list(range(made.mdp.states))
    assert list(dict.fromkeys(found.memory.tolist())) == list(range(len(found.left)))


@pytest.mark.parametrize("seed", range(0, TRIES, 2))
def test_what_is_left_to_do_is_what_makes_a_pair(seed: int) -> None:
    """Each branch leads to the memory that the formula of its source leaves, told by words."""
    random = Random(seed)
    problem = random_model(random)
    mission, term = random_mission(random, problem)
    made = unfolded(problem, mission)
    found = unfolding_of(made)
    letters = [
        frozenset(name for name, mask in problem.mdp.labels.items() if mask[state])
        for state in range(problem.mdp.states)
    ]
    left = [
        parse_property(f"Pmax=? [X ({text})]", problem) if text not in ("true", "false") else text
        for text in found.left
    ]
    for _ in range(20):
        pair = random.randrange(problem.mdp.states)
        word = [letters[pair]]
        for _ in range(4):
            choice = random.choice(made.mdp.choices_of(pair))
            pair = int(random.choice(made.mdp.branch_to_target[made.mdp.branches_of(choice)].tolist()))
            if not (found.satisfied | found.violated)[pair]:
                word.append(letters[int(found.state[pair])])
            else:
                break
        told = left[int(found.memory[pair])]
        if isinstance(told, str):
            assert (told == "true") == bool(found.satisfied[pair])
            assert (told == "false") == bool(found.violated[pair])
            continue
        rest = [random.choice(letters) for _ in range(3)]
        assert isinstance(told, Mission)
        said = chance_of(product._read(told.formula), problem, maximise=True).args[0]
        assert Lasso([*word, *rest], rest).holds(term) == Lasso(rest, rest).holds(said)


@pytest.mark.parametrize("seed", range(0, TRIES, 4))
def test_what_the_model_says_of_a_state_the_product_says_of_its_pairs(seed: int) -> None:
    random = Random(seed)
    problem = random_model(random)
    world = World(
        width=problem.mdp.states, height=1, kinds=("floor",), kind_of_cell=np.zeros(problem.mdp.states, dtype=np.uint8),
        cell_of_state=np.arange(problem.mdp.states, dtype=np.int32)[::-1].copy(),
    )  # fmt: skip
    problem = replace(problem, world=world, definitions={"N": "3"})
    mission, _ = random_mission(random, problem)
    made = unfolded(problem, mission)
    found, mdp = unfolding_of(made), made.mdp
    ended = found.satisfied | found.violated
    assert made.objective == mission
    assert found.origin is problem
    assert (made.definitions, made.source, made.properties) == (problem.definitions, problem.source, problem.properties)
    assert mdp.initial.tolist() == problem.mdp.initial.tolist()
    assert mdp.actions == problem.mdp.actions
    for name, mask in problem.mdp.labels.items():
        assert (mdp.labels[name] == mask[found.state]).all()
    assert made.world is not None
    for pair in range(mdp.states):
        assert made.world.place(pair) == world.place(int(found.state[pair]))
    choice = choices_of_origin(made)
    for name, paid in problem.mdp.rewards.items():
        for part, values in mdp.rewards[name].parts():
            was = getattr(paid, part)
            for pair in range(mdp.states):
                for c in mdp.choices_of(pair):
                    if part == "state":
                        got, wanted = [values[pair]], [was[found.state[pair]]]
                    elif part == "choice":
                        got, wanted = [values[c]], [was[choice[c]]]
                    else:
                        got, wanted = (
                            list(values[mdp.branches_of(c)]),
                            list(was[problem.mdp.branches_of(int(choice[c]))]),
                        )
                    assert got == (wanted if not ended[pair] else [0.0])


@pytest.mark.parametrize("seed", range(0, TRIES, 4))
@pytest.mark.parametrize("randomised", [False, True])
def test_a_policy_that_remembers_nothing_does_on_the_product_what_it_does_on_the_model(
    seed: int, *, randomised: bool
) -> None:
    random = Random(seed)
    problem = random_model(random)
    made = unfolded(problem, random_mission(random, problem)[0])
    policy = random_policy(random, problem.mdp, randomised=randomised)
    up = lifted(policy, made)
    check_policy(made.mdp, up)
    weights, was = up.weights(made.mdp), policy.weights(problem.mdp)
    assert weights.tolist() == was[choices_of_origin(made)].tolist()


def test_a_policy_that_says_nothing_of_a_state_says_nothing_of_its_pairs() -> None:
    problem = random_model(Random(1))
    made = unfolded(problem, Mission(formula='F<=3 "goal"'))
    silent = Policy(choice=np.full(problem.mdp.states, -1))
    assert (lifted(silent, made).choice == -1).all()
    assert lifted(silent, problem) is silent
    assert choices_of_origin(problem).tolist() == list(range(problem.mdp.choices))


def test_a_product_for_the_same_mission_is_left_as_it_is() -> None:
    problem = random_model(Random(2))
    mission = Mission(formula='F<=3 "goal"')
    made = unfolded(problem, mission)
    assert unfolded(made, mission) is made
    least = unfolded(made, Mission(formula='F<=3 "goal"', maximise=False))
    assert unfolding_of(least).origin is problem
    assert least.objective == unfolding_of(least).mission == Mission(formula='F<=3 "goal"', maximise=False)
    asked = replace(made, objective=ReachAvoid(goal='"goal"'))
    assert unfolded(asked, mission).objective == mission


def test_a_product_can_be_unfolded_once_more() -> None:
    problem = random_model(Random(3))
    once = unfolded(problem, Mission(formula='F<=3 "goal"'))
    twice = unfolded(once, Mission(formula='F<=2 "spot"'))
    assert unfolding_of(twice).origin is once
    assert twice.mdp.names[0].endswith("2 steps left")


def test_the_labels_that_need_no_definition_are_those_of_the_model() -> None:
    row = np.arange(3)
    there_and_back = MDP(
        state_to_choices=row, choice_to_branches=row, branch_to_target=np.array([1, 0]),
        branch_to_probability=np.ones(2), initial=np.array([0]), labels={"goal": np.array([False, True])},
    )  # fmt: skip
    made = unfolded(Problem(mdp=there_and_back), Mission(formula='X X X (("goal" | "deadlock") & !"init")'))
    assert made.mdp.initial.tolist() == [0]
    assert (made.mdp.labels["init"] == (unfolding_of(made).state == 0)).all()
    assert made.mdp.labels["init"].sum() > 1
    assert not made.mdp.labels["deadlock"].any()  # though an end is left by no choice


@pytest.mark.parametrize(
    "formula", ['G "goal"', "x = 3", '"goal"', 'F<=1.5 "goal"', 'F<=3 "gaol"', "F (", '(F "goal") + 1']
)
def test_a_mission_that_is_none_is_refused_in_a_sentence(formula: str) -> None:
    with pytest.raises(PropertyError) as caught:
        unfolded(random_model(Random(5)), Mission(formula=formula))
    assert caught.value.message.endswith(".")


def test_a_product_that_is_too_large_is_refused_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(product, "MOST_BRANCHES", 50)
    with pytest.raises(NotExplainableError, match=r"at most 50 branches.*things to remember"):
        unfolded(random_model(Random(6)), Mission(formula='F<=30 "goal"'))


def test_a_formula_that_is_nested_deeply_is_refused_in_a_sentence() -> None:
    with pytest.raises(PropertyError, match="nested too deeply"):
        unfolded(random_model(Random(6)), Mission(formula="X (" * 1500 + '"goal"' + ")" * 1500))


@pytest.mark.kernels
def test_compiled_and_plain_number_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_model(Random(7), most_states=8)
    mission = Mission(formula='(F<=9 "goal") & (F<=7 "spot")')
    made = []
    for wish in ("never", "always"):
        monkeypatch.setenv("RATHERTHAN_COMPILE", wish)
        made.append(unfolded(problem, mission))
    for name in ("state_to_choices", "choice_to_branches", "branch_to_target", "branch_to_probability"):
        assert (getattr(made[0].mdp, name) == getattr(made[1].mdp, name)).all()
    assert (unfolding_of(made[0]).state == unfolding_of(made[1]).state).all()
    assert (unfolding_of(made[0]).memory == unfolding_of(made[1]).memory).all()


def test_what_is_said_behind_a_name_has_an_end_and_tells_the_memories_apart() -> None:
    formula = '"goal"'
    for _ in range(40):
        formula = f'"spot" & (X (F ({formula})))'
    problem = unfolded(random_model(Random(3), most_states=4), Mission(formula=f"F ({formula})"))
    names = [problem.mdp.names[state] for state in range(problem.mdp.states)]
    assert len(set(names)) == len(names)
    assert max(map(len, names)) < 150
    assert any(" …" in name for name in names)

"""What explanations of signed, discounted, ordered and unfolded objectives obey, and those with further objectives beside."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from random_models import LEVELS, MISSIONS, OBJECTIVES, SIGNED, random_policy, random_rich_problem

from ratherthan.errors import PolicyError
from ratherthan.explain import KINDS, Explanation, Trade, explain
from ratherthan.explain.further import stopped
from ratherthan.explain.record import from_document, to_document
from ratherthan.factors import Interval
from ratherthan.model.mdp import MDP, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.objective import Level, Lexicographic, Objective, ReachAvoid
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.model.property import parse_property
from ratherthan.narrate import narrate
from ratherthan.solve import Solution, evaluate, solve

EVERY: dict[str, Objective] = SIGNED | MISSIONS | LEVELS
FURTHER = ("cost", "toll", 'R{"gain"}max=? [Fsure "goal"]', 'Pmin=? [F "hazard"]', 'Pmax=? [!"hazard" U "goal"]')
PRECISE = 1e-6


def solution_of(random: Random, objective: Objective) -> Solution:
    problem = random_rich_problem(random, objective=objective)
    if random.random() < 0.6:
        return solve(problem)
    return evaluate(problem, random_policy(random, problem.mdp, randomised=random.random() < 0.3))


def wishes(random: Random, solution: Solution) -> list[str]:
    own = {level.text for level in solution.objectives}
    wanted = random.sample(FURTHER, random.choice([1, 1, 2]))
    return [text for text in wanted if _meant(solution, text).text not in own]


def _meant(solution: Solution, text: str) -> Level:
    wanted = parse_property(text if "[" in text else f'R{{"{text}"}}min=? [F "goal"]', solution.problem)
    assert not isinstance(wanted, Lexicographic)
    return wanted  # type: ignore[return-value]


def has_goal(solution: Solution) -> bool:
    return any("goal" in getattr(level, "goal", "") for level in solution.objectives)


def explained(random: Random, solution: Solution, kind: str, *, further: bool) -> Explanation:
    also = [
        text if "[" in text or has_goal(solution) else f'R{{"{text}"}}min=? [F "goal"]'
        for text in (wishes(random, solution) if further else [])
    ]
    return explain(solution, kind, also=also)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("further", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_an_explanation_survives_a_round_trip_and_is_one_line_of_sentences(seed: int, further: bool, name: str) -> None:
    random = Random(seed)
    solution = solution_of(random, EVERY[name])
    for kind in KINDS:
        explanation = explained(random, solution, kind, further=further)
        text = narrate(explanation)
        again, said = from_document(json.loads(json.dumps(to_document(explanation, text), allow_nan=False)))
        assert again == explanation
        assert said == text == narrate(again)
        assert not re.search(r"\n|  |(?<!R)\{|\bnan\b|-0(?![.\d])|,,|\.\.", text)
        assert text == "" if kind == "none" else text[0].isupper() and text.endswith(".")


def scaled(problem: Problem, factor: float) -> Problem:
    rewards = {
        name: Reward(**{kind: factor * values for kind, values in reward.parts()})
        for name, reward in problem.mdp.rewards.items()
    }
    return replace(problem, mdp=replace(problem.mdp, rewards=rewards))


def said(explanation: Explanation) -> list[object]:
    """Return what is claimed, without the numbers."""
    return [
        (
            step.state,
            step.action,
            step.critical,
            [(claim.claim, claim.level, claim.against) for claim in step.claims],
            [(trade.claim, trade.against, [one.relation for one in trade.judged]) for trade in step.trades],
        )
        for step in explanation.steps
    ]


@pytest.mark.parametrize("name", SIGNED | LEVELS)
@pytest.mark.parametrize("seed", range(5))
def test_scaling_all_rewards_and_the_threshold_changes_no_claim(seed: int, name: str) -> None:
    random = Random(seed)
    problem = random_rich_problem(random, objective=EVERY[name])
    alpha = random.choice([0.0, 0.5])
    unscaled = isinstance(_first(problem), ReachAvoid) or getattr(_first(problem), "reward", None) is None
    first, second = solve(problem), solve(scaled(problem, 4.0))
    risk = 'Pmin=? [F "hazard"]'
    also = [] if risk in {level.text for level in first.objectives} else [risk]
    one = explain(first, also=also, alpha=alpha)
    two = explain(second, also=also, alpha=alpha if unscaled else 4.0 * alpha)
    assert said(one) == said(two)


def _first(problem: Problem) -> Objective | None:
    wanted = problem.objective
    return wanted.levels[0] if isinstance(wanted, Lexicographic) else wanted


@pytest.mark.parametrize("name", LEVELS)
@pytest.mark.parametrize("seed", range(5))
def test_the_first_level_says_what_it_says_alone(seed: int, name: str) -> None:
    problem = random_rich_problem(Random(seed), objective=LEVELS[name])
    several = solve(problem)
    alone = evaluate(replace(problem, objective=several.objectives[0]), several.policy)
    for state in np.flatnonzero(~several.ended).tolist():
        one, two = (explain(solution, "responsibility", state=state) for solution in (several, alone))
        first = [(claim.claim, claim.against) for claim in one.steps[0].claims if claim.level == 0]
        assert first == [(claim.claim, claim.against) for claim in two.steps[0].claims]


@pytest.mark.parametrize("name", LEVELS)
@pytest.mark.parametrize("seed", range(5))
def test_a_further_level_speaks_only_of_what_is_equal_before(seed: int, name: str) -> None:
    solution = solution_of(Random(seed), LEVELS[name])
    for state in np.flatnonzero(~solution.ended).tolist():
        try:
            claims = explain(solution, "responsibility", state=state).steps[0].claims
        except PolicyError:
            continue
        for claim in claims:
            if claim.level == 0:
                continue
            before = [other for other in claims if other.level == claim.level - 1]
            main = next(other for other in before if other.claim == "among the best")
            assert set(claim.against) <= set(main.against)


def _extended(reward: Reward, mdp: MDP, choice: int) -> Reward:
    more = {"state": mdp.state_of(choice), "choice": choice, "branch": mdp.branches_of(choice)}
    return Reward(**{kind: np.append(values, values[more[kind]]) for kind, values in reward.parts()})


def once_then_plan(solution: Solution, choice: int) -> tuple[Problem, Policy]:
    """Return the model with one more state, where `choice` is all that can be done, and the plan on it."""
    problem, policy = stopped(solution)
    mdp = problem.mdp
    own = mdp.branches_of(choice)
    again = MDP(
        state_to_choices=np.append(mdp.state_to_choices, mdp.choices + 1),
        choice_to_branches=np.append(mdp.choice_to_branches, mdp.branches + own.stop - own.start),
        branch_to_target=np.append(mdp.branch_to_target, mdp.branch_to_target[own]),
        branch_to_probability=np.append(mdp.branch_to_probability, mdp.branch_to_probability[own]),
        actions=mdp.actions,
        labels={name: np.append(mask, mask[mdp.state_of(choice)]) for name, mask in mdp.labels.items()},
        rewards={name: _extended(reward, mdp, choice) for name, reward in mdp.rewards.items()},
        initial=np.array([mdp.states]),
    )
    chance = None if policy.chance is None else np.append(policy.chance, 1.0)
    return (
        replace(problem, mdp=again, unfolding=None),
        Policy(choice=np.append(policy.choice, mdp.choices if chance is None else -1), chance=chance),
    )


@pytest.mark.parametrize("name", OBJECTIVES | SIGNED)
@pytest.mark.parametrize("seed", range(4))
def test_a_trade_has_the_numbers_of_the_action_once_and_then_the_plan(seed: int, name: str) -> None:
    random = Random(seed)
    solution = solution_of(random, (OBJECTIVES | SIGNED)[name])
    texts = [text for text in FURTHER if "[" in text and text != solution.objectives[0].text][:2]
    explanation = explain(solution, scope="route", factors=["responsibility"], also=texts)
    wanted: list[Level] = [*solution.objectives, *(_meant(solution, text) for text in texts)]
    for step in explanation.steps[:4]:
        for one in [one for trade in step.trades for one in trade.judged]:
            for row in (one.taken, one.other):
                problem, policy = once_then_plan(solution, row.choice)
                found = evaluate(problem, policy, wanted[one.objective])
                last = problem.mdp.states - 1
                bounds = Interval(
                    value=float(found.policy_values[0, last]),
                    lower=float(found.policy_lower[0, last]),
                    upper=float(found.policy_upper[0, last]),
                )
                assert row.number.lower <= bounds.upper
                assert bounds.lower <= row.number.upper


@pytest.mark.parametrize("seed", range(12))
def test_the_order_of_further_objectives_does_not_matter(seed: int) -> None:
    random = Random(seed)
    solution = solution_of(random, OBJECTIVES["fewest steps"])
    there = explain(solution, also=["cost", "toll"])
    back = explain(solution, also=["toll", "cost"])
    for one, two in zip(there.steps, back.steps, strict=True):
        assert [trade.claim for trade in one.trades] == [trade.claim for trade in two.trades]
        for trade, other in zip(one.trades, two.trades, strict=True):
            assert [judged.taken for judged in trade.judged] == [other.judged[k].taken for k in (0, 2, 1)]
    assert [there.totals[k] for k in (0, 2, 1)] == list(back.totals)


@pytest.mark.parametrize("name", OBJECTIVES | SIGNED)
@pytest.mark.parametrize("seed", range(4))
def test_what_a_trade_claims_its_relations_support(seed: int, name: str) -> None:
    solution = solution_of(Random(seed), (OBJECTIVES | SIGNED)[name])
    texts = [text for text in FURTHER if "[" in text and text != solution.objectives[0].text]
    explanation = explain(solution, scope="route", factors=["responsibility"], also=texts)
    for trade in [trade for step in explanation.steps for trade in step.trades]:
        assert trade.claim == _supported(trade)
        assert len(trade.judged) == len(explanation.levels) + len(explanation.also)


def _supported(trade: Trade) -> str:
    found = [one.relation for one in trade.judged]
    if "better" in found and "worse" in found:
        return "trade"
    if "open" in found:
        return "open"
    if set(found) == {"equal"}:
        return "indifferent"
    return "better on all" if "better" in found else "dominated"


def renamed(problem: Problem, order: list[int]) -> Problem:
    """Return the same problem with states in another order, each keeping its name."""
    mdp = problem.mdp
    new_of = np.argsort(order)
    rows = [choice for old in order for choice in mdp.choices_of(old)]
    own = [mdp.branches_of(choice) for choice in rows]
    branches = [branch for rows_of in own for branch in range(rows_of.start, rows_of.stop)]
    which = {"state": order, "choice": rows, "branch": branches}
    again = MDP(
        state_to_choices=np.concatenate([[0], np.cumsum([len(mdp.choices_of(old)) for old in order])]),
        choice_to_branches=np.concatenate([[0], np.cumsum([each.stop - each.start for each in own])]),
        branch_to_target=new_of[mdp.branch_to_target[branches]],
        branch_to_probability=mdp.branch_to_probability[branches],
        choice_to_action=mdp.choice_to_action[rows],
        actions=mdp.actions,
        labels={name: mask[order] for name, mask in mdp.labels.items()},
        rewards={
            name: Reward(**{kind: values[which[kind]] for kind, values in reward.parts()})
            for name, reward in mdp.rewards.items()
        },
        initial=new_of[mdp.initial],
        names=StateNames(count=mdp.states, strings=[mdp.names[old] for old in order]),
    )
    return replace(problem, mdp=again)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("seed", range(4))
def test_renaming_states_renames_the_explanation(seed: int, name: str) -> None:
    random = Random(seed)
    problem = random_rich_problem(random, objective=EVERY[name])
    names = [f"place {chr(65 + s)}" for s in range(problem.mdp.states)]
    problem = replace(problem, mdp=replace(problem.mdp, names=StateNames(count=len(names), strings=names)))
    order = list(range(len(names)))
    random.shuffle(order)
    also = ['Pmin=? [F "hazard"]', 'R{"toll"}min=? [F "goal"]']
    also = [text for text in also if text not in [level.text for level in solve(problem).objectives]]
    one, two = (explain(solve(same), also=also) for same in (problem, renamed(problem, order)))
    if one.route_outcome in ("arrives", "there", "open end"):  # lists of states are given in the model's order
        assert narrate(one) == narrate(two)

"""Few sentences: detours against the definition in fractions, never more sentences than asked for, and nothing untrue in them."""

from __future__ import annotations

import itertools
import json
import math
import os
from dataclasses import replace
from fractions import Fraction
from random import Random
from typing import Any

import pytest
from exact import Row, chain_values, optimum_by_enumeration, rows_of
from mutations import mutants, retold
from random_explanations import RICH
from random_models import OBJECTIVES, random_policy, random_problem, random_rich_problem

from ratherthan.errors import ExplanationError
from ratherthan.explain import explain, question
from ratherthan.explain.detour import detours_of
from ratherthan.explain.explanation import Rank
from ratherthan.explain.measures import Factors
from ratherthan.explain.question import RANKINGS, Question
from ratherthan.explain.record import to_document
from ratherthan.explain.route import route_from
from ratherthan.explain.shared import graph_of
from ratherthan.explain.telling import matters, told_groups
from ratherthan.explain.visits import chances_to_visit
from ratherthan.io.roadmap import parse_roadmap
from ratherthan.model.objective import Discounted, ExpectedCost, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.narrate import from_json, narrate, sentences, to_json
from ratherthan.solve import Solution, evaluate, solve
from ratherthan.verify import detours, verify

MODELS = int(os.environ.get("RATHERTHAN_MODELS", "300"))
CHUNK = 30
MOST_PLAYS = 20_000
LEAST = ExpectedCost(goal='"goal"', reward="cost")
LIKELIEST = ReachAvoid(goal='"goal"', through='!"hazard"')

Number = Fraction | float


def detour_by_enumeration(problem: Problem, values: list[Number], closed: list[int], taken: int) -> Number | None:
    """Return what the best alternative of the last of some closed states comes to: every plan against every answer to it.

    A branch into a closed state stays, or goes there for what that is worth, whichever is worse. None where there are too many.
    """
    mdp, rows, cost = problem.mdp, rows_of(problem), isinstance(problem.objective, ExpectedCost)
    goal = {s for s in range(mdp.states) if mdp.labels["goal"][s]}
    ended = goal if cost else goal | {s for s in range(mdp.states) if mdp.labels["hazard"][s]}
    root, trap, prize = closed[-1], mdp.states, mdp.states + 1
    options = {root: [row for c, row in zip(mdp.choices_of(root), rows[root], strict=True) if c != taken]}
    options |= {s: rows[s] for s in range(mdp.states) if s not in ended and s not in closed}
    plans = list(itertools.product(*options.values()))
    places = [(s, t) for s in options for t in closed if any(t in row[0] and t != s for row in options[s])]
    if len(plans) * 2 ** len(places) > MOST_PLAYS:
        return None
    best: Number | None = None
    for plan in plans:
        worst: Number | None = None
        for goes in itertools.product((False, True), repeat=len(places)):
            going = dict(zip(places, goes, strict=True))
            chain: list[Row | None] = [None] * (mdp.states + 2)
            chain[trap] = ({trap: Fraction(1)}, Fraction(1))
            for s, (chances, price) in zip(options, plan, strict=True):
                chain[s] = _answered(s, chances, price, closed, going, values, cost=cost, exits=(trap, prize))
            found = chain_values(chain, goal | {prize}, cost=cost)[root]
            worst = found if worst is None else (max if cost else min)(worst, found)
        assert worst is not None
        best = worst if best is None else (min if cost else max)(best, worst)
    return best


def _answered(
    state: int,
    chances: dict[int, Fraction],
    price: Fraction,
    closed: list[int],
    going: dict[tuple[int, int], bool],
    values: list[Number],
    *,
    cost: bool,
    exits: tuple[int, int],
) -> Row:
    """Return a row in which branches into closed states stay, or lead outside for what it is worth."""
    trap, prize = exits
    after: dict[int, Fraction] = {}

    def put(target: int, share: Fraction) -> None:
        after[target] = after.get(target, Fraction(0)) + share

    for target, share in chances.items():
        if target not in closed or target == state:
            put(target, share)
        elif not going[state, target]:
            put(state, share)
        elif cost and values[target] != math.inf:
            put(prize, share)
            price += share * Fraction(values[target])
        elif cost:
            put(trap, share)
        else:
            put(prize, share * Fraction(values[target]))
            put(trap, share * (1 - Fraction(values[target])))
    return {t: p for t, p in after.items() if p}, price


@pytest.mark.kernels
@pytest.mark.parametrize("wanted", [LEAST, LIKELIEST], ids=["cost", "chance"])
@pytest.mark.parametrize("first", range(0, MODELS, CHUNK))
def test_a_detour_is_what_the_definition_says(first: int, wanted: ExpectedCost | ReachAvoid) -> None:
    checked = open_ = 0
    for seed in range(first, first + CHUNK):
        random = Random(seed)
        problem = random_problem(random, most_states=random.choice([4, 5, 6]), objective=wanted)
        solution = solve(problem)
        route = route_from(solution, graph_of(solution), int(problem.mdp.initial[0]))
        wishes = [at for at, s in enumerate(route.states[:-1]) if len(problem.mdp.choices_of(s)) > 1][:3]
        if not wishes or route.outcome != "arrives":
            continue
        values = optimum_by_enumeration(problem)
        numbers = Factors(solution=solution, asked=question()).levels[0]
        found = detours_of(solution, 0, numbers, (route.states[:-1], route.choices), wishes)
        for at in wishes:
            taken = route.choices[at]
            own = detour_by_enumeration(problem, values, list(route.states[: at + 1]), taken)
            if own is None:
                continue
            sign = 1.0 if isinstance(wanted, ExpectedCost) else -1.0
            q = float(numbers.action_value[taken])
            loss = 0.0 if float(own) == q else sign * (float(own) - q)
            checked, open_ = checked + 1, open_ + (not found[at].settled)
            if found[at].settled:
                assert found[at].loss == pytest.approx(loss, abs=1e-8, rel=1e-8), (seed, at)
            else:
                assert found[at].loss <= loss + 1e-8, (seed, at)
    assert checked > 0
    assert open_ <= 0.2 * checked


def asked_of(random: Random, at_most: int) -> Question:
    """Return a random question about a route."""
    return question(
        random.choice(["naive-path", "selective", "contrastive"]),
        at_most=at_most,
        ranking=random.choice(RANKINGS),
        detail=random.random() < 0.5,
        policy_values=random.random() < 0.2,
        alpha=random.choice([0.0, 0.0, 0.3]),
    )


def solution_of(seed: int) -> tuple[Random, Problem, Solution]:
    """Return a random problem with its optimum, or with a random policy."""
    random = Random(seed)
    if seed % 2:
        objective = list(RICH.values())[(seed // 2) % len(RICH)]
        problem = random_rich_problem(random, objective=objective, most_states=random.choice([6, 8, 12]))
    else:
        problem = random_problem(random, objective=list(OBJECTIVES.values())[(seed // 2) % len(OBJECTIVES)])
    solution = solve(problem)
    if random.random() < 0.4:
        solution = evaluate(problem, random_policy(random, problem.mdp))
    return random, problem, solution


@pytest.mark.parametrize("first", range(0, MODELS, CHUNK))
def test_never_more_sentences_than_asked_for_and_never_none_where_a_step_matters(first: int) -> None:
    for seed in range(first, first + CHUNK):
        random, _, solution = solution_of(seed)
        asked = asked_of(random, 1 + seed % 3)
        assert asked.at_most is not None
        found = explain(solution, asked=asked)
        told = [sentence for sentence in sentences(found) if sentence.number is not None]
        groups = told_groups(found)
        assert [sentence.steps for sentence in told] == list(groups)
        assert len(told) <= asked.at_most
        assert bool(told) == any(matters(step, asked) for step in found.steps)
        assert narrate(found) == " ".join(sentence.text for sentence in sentences(found))
        assert from_json(to_json(found)) == found


@pytest.mark.parametrize("first", range(0, MODELS, CHUNK))
def test_what_is_told_in_few_sentences_is_told_in_more_of_them(first: int) -> None:
    for seed in range(first, first + CHUNK):
        random, _, solution = solution_of(seed)
        asked = asked_of(random, 1)
        settings = {"ranking": asked.ranking, "detail": asked.detail, "policy_values": asked.policy_values}
        known: set[int] = set()
        for at_most in (1, 2, 3, 5, 1000):
            found = explain(solution, asked.kind, at_most=at_most, alpha=asked.alpha, **settings)
            told = {at for group in told_groups(found) for at in group}
            assert known <= told, seed
            known = told
        assert known == {at for at, step in enumerate(found.steps) if matters(step, asked)}
        assert found.closing.left_out is None
        assert all(step.told and step.rank is None for step in found.steps)


@pytest.mark.parametrize("ranking", RANKINGS)
def test_few_sentences_are_confirmed_by_the_re_checker(ranking: str) -> None:
    left = ranks = 0
    for seed in range(max(30, MODELS // 4)):
        random, problem, solution = solution_of(seed)
        kind = random.choice(["naive-path", "selective", "contrastive"])
        found = explain(solution, kind, at_most=1, ranking=ranking, detail=random.random() < 0.5)
        document = json.loads(json.dumps(to_document(found, narrate(found))))
        verdicts = verify(document, problem)
        assert not verdicts.fails, (seed, verdicts.summary(), list(map(str, verdicts.checks)))
        left += found.closing.left_out is not None
        ranks += any(step.rank is not None for step in found.steps)
    assert left > 0
    assert bool(ranks) == (ranking != "place")


def test_a_detour_under_a_discount_is_confirmed_whether_equations_help_its_sweeps_or_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compared = 0
    for seed in range(400):
        _, problem, solution = solution_of(seed)
        if not isinstance(problem.objective, Discounted) or problem.objective.discount > 0.99:
            continue
        found = explain(solution, "naive-path", at_most=1)
        document = json.loads(json.dumps(to_document(found, narrate(found))))
        seen = []
        for patience in (1, 2, 10**9):
            monkeypatch.setattr(detours, "PATIENCE", patience)
            verdicts = verify(document, problem)
            seen.append((verdicts.fails, list(map(str, verdicts.checks))))
        assert seen[0] == seen[1] == seen[2]
        assert not seen[0][0], seed
        compared += any(step.rank is not None for step in found.steps)
    assert compared > 5


@pytest.mark.parametrize("first", range(0, MODELS, CHUNK))
def test_the_chance_to_come_to_a_state_is_that_of_the_chain(first: int) -> None:
    for seed in range(first, first + CHUNK):
        random = Random(seed)
        problem = random_problem(random, objective=LEAST)
        solution = evaluate(problem, random_policy(random, problem.mdp))
        rows, mdp, start = rows_of(problem), problem.mdp, int(problem.mdp.initial[0])
        taken = solution.policy.choice
        chain: list[Row | None] = [
            None if solution.ended[s] else rows[s][int(taken[s]) - mdp.choices_of(s).start] for s in range(mdp.states)
        ]
        graph = graph_of(solution)
        reached = [s for s in range(mdp.states) if graph.reachable(start)[s]]
        for state, chance in zip(reached, chances_to_visit(graph, start, reached), strict=True):
            own = [None if s == state else row for s, row in enumerate(chain)]
            exact = chain_values(own, [state], cost=False)[start]
            assert chance == pytest.approx(float(exact), abs=1e-9), (seed, state)


IN_ORDER = (
    """\
property = 'R{"distance"}min=? [F "destination"] then R{"time"}min=? [F "destination"]'
map = """
    "'''"
    """
S . . .
. = . .
. . . .
. . . D
"""
    "'''"
    """
[costs]
distance = 1
time = { other = 2, highway = 1 }
"""
)


def test_a_rank_says_at_which_level_something_differs() -> None:
    problem = parse_roadmap(IN_ORDER, source="in order")
    found = explain(solve(problem), "naive-path", at_most=2)
    later = [at for at, step in enumerate(found.steps) if step.told and step.rank is not None and step.rank.level == 1]
    assert later
    for at in later:
        for size, level in ((0.0, 0), (1e-300, 0)):
            steps = list(found.steps)
            steps[at] = replace(steps[at], rank=Rank(level=level, size=size))
            forged = replace(found, steps=tuple(steps))
            verdicts = verify(json.loads(json.dumps(to_document(forged, narrate(forged)))), problem)
            assert verdicts.fails
            assert any(check.what == "rank" and "does not differ" in check.reason for check in verdicts.checks)
    document = json.loads(json.dumps(to_document(found, narrate(found))))
    assert verify(document, problem).holds


NEW = ("told", "rank", "numbers", "left_out", "at_most")


@pytest.mark.parametrize("first", range(0, MODELS, CHUNK))
def test_a_change_of_what_is_told_is_noticed(first: int) -> None:
    for seed in range(first, first + CHUNK, 2):
        random, problem, solution = solution_of(seed)
        found = explain(solution, "contrastive", at_most=1, ranking=random.choice(RANKINGS), detail=True)
        document = json.loads(json.dumps(to_document(found, narrate(found))))
        if found.closing.left_out is None or not verify(document, problem).holds:
            continue
        changed = [mutant for mutant in mutants(document) if any(name in mutant.place for name in NEW)]
        for mutant in random.sample(changed, min(15, len(changed))):
            forged = retold(mutant)
            if forged is None or mutant.document == document or mutant.place.endswith("settled"):
                continue  # a bound that is less than sure is no lie
            assert noticed(forged.document, problem), (seed, mutant.path, mutant.how)


def noticed(document: dict[str, Any], problem: Problem) -> bool:
    """Return whether a document is refused or contradicted."""
    try:
        return verify(document, problem).fails
    except ExplanationError:
        return True

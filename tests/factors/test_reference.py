"""The factors equal a slow, obvious reference on hundreds of random models, and do not care about names or order."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest
from random_models import OBJECTIVES, Table, problem_of, random_problem, random_table

from ratherthan.factors import Search, constrictiveness, critical_states, nearer_goal, responsibility, search_tree
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.problem import Problem
from ratherthan.solve import solve

SEEDS = range(300)


def rows_of(problem: Problem) -> dict[int, list[tuple[int, list[tuple[float, int]], float]]]:
    """Return, in plain Python, (choice, branches, cost) for every state."""
    mdp = problem.mdp
    rows = {}
    for s in range(mdp.states):
        rows[s] = [
            (
                c,
                list(
                    zip(
                        mdp.branch_to_probability[mdp.branches_of(c)].tolist(),
                        mdp.branch_to_target[mdp.branches_of(c)].tolist(),
                        strict=True,
                    )
                ),
                float(mdp.rewards["cost"].choice[c]),
            )
            for c in mdp.choices_of(s)
        ]
    return rows


@pytest.mark.parametrize("seed", SEEDS)
def test_factors_equal_their_definitions(seed: int) -> None:
    problem = random_problem(Random(seed))
    solution = solve(problem)
    rho, ended = solution.values[0], solution.ended
    measures = responsibility(solution)
    critical = critical_states(problem.mdp, measures, ended)
    wanted = problem.objective
    rows = rows_of(problem)
    reference_critical = {}
    for s, choices in rows.items():
        values = {}
        for c, branches, cost in choices:
            omega = sum(p * rho[t] for p, t in branches)
            immediate = (cost if wanted.reward else 1.0) if isinstance(wanted, ExpectedCost) else 0.0
            values[c] = immediate + omega
            assert measures.impact[c] == pytest.approx(omega, rel=1e-12)
            assert measures.action_value[c] == pytest.approx(values[c], rel=1e-12)
        low, high = min(values.values()), max(values.values())
        assert measures.lambda_min[s] == pytest.approx(low, rel=1e-12)
        assert measures.lambda_max[s] == pytest.approx(high, rel=1e-12)
        for c, value in values.items():
            share = 0.0 if (math.isinf(low) and value == low) or ended[s] else value - low
            assert measures.responsibility[c] == pytest.approx(share, abs=1e-9)
        spread = 0.0 if low == high else high - low
        tau = 1e-6 * max(abs(low), abs(high)) if math.isfinite(spread) else 0.0
        reference_critical[s] = bool(len(choices) > 1 and not ended[s] and spread > tau)
        assert critical.of(s) is reference_critical[s]
    counts = constrictiveness(problem.mdp, critical, ended, range(problem.mdp.choices))
    for s, choices in rows.items():
        for c, branches, _ in choices:
            tree, todo = set(), [t for _, t in branches if t != s]
            while todo:
                u = todo.pop()
                if u not in tree:
                    tree.add(u)
                    if not ended[u]:
                        todo += [t for _, more, _ in rows[u] for _, t in more if t != s]
            expected = sum(len(rows[u]) for u in tree if reference_critical[u])
            assert counts[c].lower == counts[c].upper == expected


@pytest.mark.parametrize("seed", range(100))
def test_a_horizon_counts_what_is_near(seed: int) -> None:
    random = Random(seed)
    problem = random_problem(random)
    solution = solve(problem)
    critical = critical_states(problem.mdp, responsibility(solution), solution.ended)
    horizon = random.randrange(4)
    counts = constrictiveness(
        problem.mdp, critical, solution.ended, range(problem.mdp.choices), search=Search(horizon=horizon)
    )
    rows = rows_of(problem)
    for s, choices in rows.items():
        for c, branches, _ in choices:
            near = {t for _, t in branches} - {s}
            for _ in range(horizon):
                near |= {t for u in near if not solution.ended[u] for _, more, _ in rows[u] for _, t in more} - {s}
            assert counts[c].lower == sum(len(rows[u]) for u in near if critical.certain[u])


@pytest.mark.parametrize("seed", range(100))
@pytest.mark.parametrize("objective", ["least cost", "safest"])
def test_renaming_states_and_permuting_actions_changes_no_factor(seed: int, objective: str) -> None:
    random = Random(seed)
    states = random.randint(2, 7)
    table = random_table(random, states)
    goals, hazards = [random.randrange(states)], [random.randrange(states)]
    renamed = list(range(states))
    random.shuffle(renamed)
    other: Table = {}
    for s in range(states):
        actions = list(table[s])
        random.shuffle(actions)
        other[renamed[s]] = {a: ([(p, renamed[t]) for p, t in table[s][a][0]], table[s][a][1]) for a in actions}
    wanted = OBJECTIVES[objective]
    first = problem_of(table, wanted, goals=goals, hazards=hazards)
    second = problem_of(other, wanted, goals=[renamed[g] for g in goals], hazards=[renamed[h] for h in hazards])
    one, two = _factors_by_name(first), _factors_by_name(second)
    assert one.keys() == {(renamed.index(s), a) for s, a in two}
    for (s, a), (q, share, count) in one.items():
        q_, share_, count_ = two[renamed[s], a]
        assert (q_, share_) == (pytest.approx(q, rel=1e-9), pytest.approx(share, rel=1e-9, abs=1e-9))
        assert count_ == count


def _factors_by_name(problem: Problem) -> dict[tuple[int, str], tuple[float, float, int]]:
    solution = solve(problem)
    measures = responsibility(solution)
    critical = critical_states(problem.mdp, measures, solution.ended)
    counts = constrictiveness(problem.mdp, critical, solution.ended, range(problem.mdp.choices))
    return {
        (s, problem.mdp.action_name(c)): (
            float(measures.action_value[c]),
            float(measures.responsibility[c]),
            counts[c].lower,
        )
        for s in range(problem.mdp.states)
        for c in problem.mdp.choices_of(s)
    }


def test_impact_and_action_value_differ_where_actions_cost_unequally() -> None:
    problem = problem_of(
        {
            0: {"dear": ([(1.0, 2)], 5), "cheap": ([(1.0, 1)], 1)},
            1: {"on": ([(1.0, 2)], 1)},
            2: {"stay": ([(1.0, 2)], 0)},
        },
        OBJECTIVES["least cost"],
        goals=[2],
    )
    measures = responsibility(solve(problem))
    assert measures.impact[:2].tolist() == [0.0, 1.0]  # ω alone would call the dear action good
    assert measures.action_value[:2].tolist() == [5.0, 2.0]
    assert np.allclose(measures.responsibility[:2], [3.0, 0.0])


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.parametrize("toward", [False, True])
def test_the_counting_search_agrees_with_the_tree_itself(seed: int, toward: bool) -> None:
    random = Random(seed)
    problem = random_problem(random)
    solution = solve(problem)
    mdp, ended = problem.mdp, solution.ended
    critical = critical_states(mdp, responsibility(solution), ended)
    nearer = nearer_goal(solution.lower[0], solution.upper[0], maximise=solution.objectives[0].maximise)
    search = Search(horizon=random.choice([None, 0, 1, 2]), toward_goal=toward)
    counts = constrictiveness(mdp, critical, ended, range(mdp.choices), search=search, nearer=nearer)
    size = np.diff(mdp.state_to_choices)
    for choice in range(mdp.choices):
        tree = search_tree(mdp, ended, choice, search=search, nearer=nearer[0])
        assert mdp.state_of(choice) not in tree
        assert len(set(tree.tolist())) == len(tree)
        assert counts[choice].lower == size[tree][critical.certain[tree]].sum()


@pytest.mark.kernels
def test_compiled_searches_count_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    problem = random_problem(Random(7))
    solution = solve(problem)
    critical = critical_states(problem.mdp, responsibility(solution), solution.ended)
    found = {}
    for wish in ("never", "always"):
        monkeypatch.setenv("RATHERTHAN_COMPILE", wish)
        found[wish] = constrictiveness(problem.mdp, critical, solution.ended, range(problem.mdp.choices))
    assert found["never"] == found["always"]

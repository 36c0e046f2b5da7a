"""What must hold of a model that is solved in blocks, whoever solves them."""

from __future__ import annotations

import re
from random import Random

import numpy as np
import pytest
from cluster_models import random_network

import ratherthan as rt
from ratherthan.cluster import ask, route_of, solve_in_blocks, solved_in_blocks
from ratherthan.errors import NotExplainableError, PropertyError, QuestionError, SourceError
from ratherthan.io.umb_write import write_umb

SEEDS = range(10)


def archived(problem, folder, packing="none"):
    path = folder / "model.umb"
    write_umb(problem, path, packing=packing)
    return path


def rounded(text):
    """Return a text without its numbers: 25.05 may be told as 25 or as 25.1."""
    return re.sub(r"\d+(\.\d+)?", "#", text)


def assert_overlap(values, lower, upper, solution):
    finite = np.isfinite(solution.values[0])
    assert (np.isfinite(values) == finite).all()
    assert (lower <= solution.upper[0])[finite].all()
    assert (solution.lower[0] <= upper)[finite].all()
    assert (upper[finite] - lower[finite] <= 1e-6 * values[finite]).all()


@pytest.mark.parametrize("seed", SEEDS)
def test_blocks_give_bounds_that_hold_as_those_of_one_process_do(seed, tmp_path, here):
    here()
    random = Random(seed)
    problem = random_network(random, states=random.randrange(2, 40), far=random.choice([0.0, 0.05]))
    path = archived(problem, tmp_path, random.choice(["none", "gzip"]))
    solution = rt.solve(problem)
    start = random.randrange(problem.mdp.states)
    target = tmp_path / "values.npz"
    found = solve_in_blocks(path, start=start, blocks=random.randrange(1, 6), values=target)
    assert found.certified
    with np.load(target) as stored:
        assert_overlap(stored["values"], stored["lower"], stored["upper"], solution)
        policy = stored["policy"]
        assert found.value == stored["values"][start]
    taken = np.flatnonzero(policy >= 0)
    assert (np.isfinite(solution.values[0]) & ~solution.goal == (policy >= 0)).all()
    choice = solution.policy.choice.copy()
    choice[taken] = policy[taken]
    judged = rt.evaluate(problem, rt.Policy(choice=choice))
    finite = np.isfinite(solution.values[0])
    assert (judged.policy_lower[0] <= solution.upper[0] * (1 + 1e-6))[finite].all()


@pytest.mark.parametrize("seed", SEEDS)
def test_workers_that_forget_cost_time_and_not_the_answer(seed, tmp_path, here):
    here(forgetting=0.3, seed=seed)
    random = Random(1000 + seed)
    problem = random_network(random, states=random.randrange(10, 40), far=0.05)
    path = archived(problem, tmp_path)
    target = tmp_path / "values.npz"
    found = solve_in_blocks(path, start=0, blocks=3, values=target)
    assert found.certified
    with np.load(target) as stored:
        assert_overlap(stored["values"], stored["lower"], stored["upper"], rt.solve(problem))


@pytest.mark.parametrize("seed", range(4))
def test_wrong_values_are_not_certified(seed, tmp_path, here):
    here()
    random = Random(seed)
    problem = random_network(random, states=40, far=0.05)
    with solved_in_blocks(archived(problem, tmp_path), count=3) as solved:
        assert solved.shares is not None
        alive = np.flatnonzero(solved.shared_alive & (solved.values > 0))
        if not len(alive):
            pytest.skip("no block leads to another")
        solved.values[random.choice(alive)] *= 1.001
        solved.certify()
        assert solved.shares is None
        assert not solved.outcome(0).certified


def test_what_was_not_checked_is_not_told(tmp_path, here):
    from ratherthan.cluster import spreading

    here()
    problem = random_network(Random(5), states=60, far=0.05)
    with solved_in_blocks(archived(problem, tmp_path), count=2) as solved:
        digests = list(solved.digests)
        block = spreading._held[solved.extents[0].run, 0]
        block.memory["values"] *= 0.5  # as if it had been solved anew, badly
        before, _ = solved.at_states(np.arange(60))
        assert solved.shares is None or solved.digests != digests
        if solved.shares is not None:
            lower, upper = solved.bounds(before)
            assert_overlap(before, lower, upper, rt.solve(problem))


@pytest.mark.parametrize("seed", range(4))
def test_what_is_said_of_a_state_is_what_one_process_says(seed, tmp_path, here):
    here()
    random = Random(200 + seed)
    problem = random_network(random, states=16, far=0.05)
    solution = rt.solve(problem)
    with solved_in_blocks(archived(problem, tmp_path), count=3) as solved:
        for state in range(problem.mdp.states):
            if np.isinf(solution.values[0, state]):
                with pytest.raises(QuestionError, match="none is"):
                    ask(solved, state)
                continue
            expected = rt.narrate(rt.explain(solution, kind="responsibility", state=state))
            told = ask(solved, state)
            assert rounded(told.text) == rounded(expected)
            others = [row["action"] for row in told.choices if not row["taken"]] if told.action else []
            for other in others:
                asked = rt.explain(solution, rather_than=other, factors=("responsibility",), state=state)
                assert rounded(ask(solved, state, rather_than=other).text) == rounded(rt.narrate(asked))


@pytest.mark.parametrize("seed", range(4))
def test_the_route_is_that_of_one_process(seed, tmp_path, here):
    here()
    problem = random_network(Random(300 + seed), states=30, far=0.05)
    solution = rt.solve(problem)
    with solved_in_blocks(archived(problem, tmp_path), count=3) as solved:
        for start in np.flatnonzero(np.isfinite(solution.values[0]) & ~solution.goal)[:5]:
            expected = rt.explain(solution, kind="naive-path", state=int(start), scope=None)
            route, actions = route_of(solved, int(start))
            assert route.states == expected.route
            assert actions == [step.action for step in expected.steps]


def test_questions_that_blocks_cannot_answer_are_refused(tmp_path, here):
    here()
    problem = random_network(Random(1), states=20)
    path = archived(problem, tmp_path)
    for objective in ('Pmax=? [F "goal"]', 'R{"cost"}max=? [F "goal"]'):
        with pytest.raises(NotExplainableError, match="In blocks the least expected cost"):
            solve_in_blocks(path, objective)
    with pytest.raises(PropertyError):
        solve_in_blocks(path, 'R{"cost"}min=? [F "nowhere"]')
    with pytest.raises(PropertyError):
        solve_in_blocks(path, 'R{"nothing"}min=? [F "goal"]')
    with pytest.raises(QuestionError, match="number in 0"):
        solve_in_blocks(path, start="20")
    with solved_in_blocks(path) as solved, pytest.raises(QuestionError, match="In blocks the kind"):
        ask(solved, 0, "contrastive")
    other = tmp_path / "model.npz"
    rt.write(problem, other)
    with pytest.raises(SourceError, match="must be a UMB archive"):
        solve_in_blocks(other)


def test_a_choice_that_costs_nothing_is_refused_with_its_state(tmp_path, here):
    here()
    problem = rt.read("example:paper-5x5")
    mdp = problem.mdp
    cost = np.ones(mdp.choices)
    cost[mdp.choices_of(7).start] = 0.0
    free = rt.MDP(
        state_to_choices=mdp.state_to_choices,
        choice_to_branches=mdp.choice_to_branches,
        branch_to_target=mdp.branch_to_target,
        branch_to_probability=mdp.branch_to_probability,
        labels={"goal": mdp.labels["destination"]},
        rewards={"cost": rt.Reward(choice=cost)},
        initial=np.array([5]),
    )
    path = archived(rt.Problem(mdp=free, objective=rt.ExpectedCost(goal='"goal"', reward="cost")), tmp_path)
    with pytest.raises(NotExplainableError, match="state 7 costs nothing"):
        solve_in_blocks(path, blocks=2)


def test_a_model_without_a_way_has_no_finite_value(tmp_path, here):
    here()
    problem = random_network(Random(3), states=20, goals=False)
    found = solve_in_blocks(archived(problem, tmp_path), 'R{"cost"}min=? [F "goal"]', blocks=2, start=0)
    assert (found.value, found.lower) == (np.inf, np.inf)


@pytest.mark.parametrize("part", ["branch-to-target.bin", "choice-to-branches.bin"])
def test_a_truncated_archive_is_refused(part, tmp_path, here):
    here()
    path = archived(random_network(Random(3), states=50), tmp_path)
    whole = path.read_bytes()
    at = whole.index(part.encode())
    path.write_bytes(whole[: at + 700])
    with pytest.raises(SourceError):
        solve_in_blocks(path, start=0)

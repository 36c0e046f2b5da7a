"""What the worked models share: a table becomes a Problem (`small`), a Problem becomes its numbers by name (`facts`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

import ratherthan as rt
from ratherthan import MDP, ExpectedCost, Lexicon, Policy, Problem, Reward, Solution, StateNames
from ratherthan.factors import constrictiveness, critical_states, responsibility

Branches = Sequence[tuple[float, str]]
Table = Mapping[str, Mapping[str, tuple[Branches, float | Mapping[str, float]]]]

LEAST_COST = ExpectedCost(goal='"goal"', reward="cost")


def build(
    table: Table,
    *,
    goal: str | Sequence[str] = "goal",
    hazard: str | Sequence[str] = (),
    objective: Any = LEAST_COST,
    start: str | None = None,
    lexicon: Lexicon | None = None,
    labels: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Problem:
    """Return the problem that a readable table says.

    ``{state: {action: ([(probability, target)], cost)}}``, states and actions in order; a state with an empty table stays
    where it is for nothing. The first state is the start. In place of a cost several rewards can be named.
    """
    names = list(table)
    number = {name: i for i, name in enumerate(names)}
    rows = {name: own or {"stay": ([(1.0, name)], 0.0)} for name, own in table.items()}
    flat = [(action, branches, cost) for own in rows.values() for action, (branches, cost) in own.items()]
    actions = list(dict.fromkeys(action for action, _, _ in flat))
    mdp = MDP(
        state_to_choices=np.array([0, *accumulate(len(own) for own in rows.values())]),
        choice_to_branches=np.array([0, *accumulate(len(branches) for _, branches, _ in flat)]),
        branch_to_target=np.array([number[target] for _, branches, _ in flat for _, target in branches]),
        branch_to_probability=np.array([chance for _, branches, _ in flat for chance, _ in branches], dtype=float),
        choice_to_action=np.array([actions.index(action) for action, _, _ in flat]),
        actions=actions,
        labels={"goal": _among(names, goal), "hazard": _among(names, hazard), **_among_all(names, labels)},
        rewards=_rewards([cost for _, _, cost in flat]),
        initial=np.array([number[start or names[0]]]),
        names=StateNames(count=len(names), strings=names),
    )
    return Problem(mdp=mdp, objective=objective, lexicon=lexicon or Lexicon(), source="a worked model")


def _among(names: list[str], wanted: str | Sequence[str]) -> np.ndarray:
    wanted = [wanted] if isinstance(wanted, str) else wanted
    return np.array([name in wanted for name in names])


def _among_all(names: list[str], labels: Mapping[str, Sequence[str]]) -> dict[str, np.ndarray]:
    return {label: _among(names, wanted) for label, wanted in labels.items()}


def _rewards(given: Sequence[float | Mapping[str, float]]) -> dict[str, Reward]:
    """Return the rewards by choice: those that are named, else "cost"."""
    named = list(dict.fromkeys(name for paid in given if isinstance(paid, Mapping) for name in paid)) or ["cost"]
    rows = [paid if isinstance(paid, Mapping) else dict.fromkeys(named, paid) for paid in given]
    return {name: Reward(choice=np.array([row.get(name, 0.0) for row in rows], dtype=float)) for name in named}


@dataclass
class Facts:
    """The package's numbers by name: ``rho["top"]``, ``q["top", "left"]``. ∞ is ``math.inf``."""

    solution: Solution
    rho: dict[str, float] = field(default_factory=dict)
    q: dict[tuple[str, str], float] = field(default_factory=dict)
    omega: dict[tuple[str, str], float] = field(default_factory=dict)
    zeta: dict[tuple[str, str], float] = field(default_factory=dict)
    epsilon: dict[tuple[str, str], int | None] = field(default_factory=dict)
    critical: set[str] = field(default_factory=set)
    critical_by_omega: set[str] = field(default_factory=set)
    policy: dict[str, str] = field(default_factory=dict)
    following: dict[str, float] = field(default_factory=dict)  # ρ^π

    def __post_init__(self) -> None:
        solution, mdp = self.solution, self.solution.problem.mdp
        measures = responsibility(solution)
        critical = critical_states(mdp, measures, solution.ended)
        by_omega = critical_states(mdp, measures, solution.ended, omega=True)
        for found in (critical, by_omega):
            assert (found.certain == found.possible).all(), "a worked model leaves nothing open"
        assert np.all(solution.lower <= solution.values)
        assert np.all(solution.values <= solution.upper)
        counts = constrictiveness(mdp, critical, solution.ended, range(mdp.choices))
        for state in range(mdp.states):
            name = mdp.names[state]
            self.rho[name] = float(solution.values[0, state])
            self.following[name] = float(solution.policy_values[0, state])
            if solution.policy.choice[state] >= 0:
                self.policy[name] = mdp.action_name(int(solution.policy.choice[state]))
            for choice in mdp.choices_of(state):
                key = name, mdp.action_name(choice)
                self.q[key] = float(measures.action_value[choice])
                self.omega[key] = float(measures.impact[choice])
                self.zeta[key] = float(measures.responsibility[choice])
                self.epsilon[key] = counts[choice].count
        self.critical = {mdp.names[int(s)] for s in np.flatnonzero(critical.certain)}
        self.critical_by_omega = {mdp.names[int(s)] for s in np.flatnonzero(by_omega.certain)}

    def proves(self, state: str, value: float) -> bool:
        """Tell whether the bounds of a state's optimum are tight around a number worked out by hand."""
        i = list(self.rho).index(state)
        lower, upper = self.solution.lower[0, i], self.solution.upper[0, i]
        slack = 1e-9 * abs(value)
        return bool(lower <= value + 1e-15 and value - 1e-15 <= upper and (lower == upper or upper - lower <= slack))


@pytest.fixture(scope="session")
def small() -> Callable[..., Problem]:
    """Return `build`: a table becomes a Problem."""
    return build


@pytest.fixture(scope="session")
def facts() -> Callable[..., Facts]:
    """Return a function: a Problem (solved, or followed by a given policy) becomes its numbers by name."""

    def numbers(problem: Problem, policy: Policy | None = None) -> Facts:
        return Facts(rt.solve(problem) if policy is None else rt.evaluate(problem, policy))

    return numbers


@pytest.fixture(scope="session")
def told() -> Callable[..., str]:
    """Return a function: a Problem and ``"kind"`` or ``"kind at STATE"`` become the text."""

    def text(problem: Problem, key: str, policy: Policy | None = None) -> str:
        kind, at, state = key.partition(" at ")
        solution = rt.solve(problem) if policy is None else rt.evaluate(problem, policy)
        details = {"state": problem.mdp.names.find(state)} if at else {}
        return rt.narrate(rt.explain(solution, kind=kind, **details))

    return text


@pytest.fixture(scope="session")
def explained() -> Callable[..., str]:
    """Return a function: a Problem and the details of a question become the text."""

    def text(problem: Problem, policy: Policy | None = None, **details: Any) -> str:
        solution = rt.solve(problem) if policy is None else rt.evaluate(problem, policy)
        return rt.narrate(rt.explain(solution, **details))

    return text


def choices(problem: Problem, taken: Mapping[str, str | Mapping[str, float]]) -> Policy:
    """Return the policy that takes an action per state, or each of some with a chance."""
    mdp = problem.mdp
    choice, chance = np.full(mdp.states, -1), np.zeros(mdp.choices)
    for state in range(mdp.states):
        wanted = taken.get(mdp.names[state], {})
        shares = {wanted: 1.0} if isinstance(wanted, str) else wanted
        for row in mdp.choices_of(state):
            chance[row] = shares.get(mdp.action_name(row), 0.0)
            if chance[row] == 1.0:
                choice[state] = row
    mixed = any(not isinstance(wanted, str) for wanted in taken.values())
    return Policy(choice=choice, chance=chance if mixed else None)


@pytest.fixture(scope="session")
def policy() -> Callable[..., Policy]:
    """Return `choices`: actions by state become a Policy."""
    return choices

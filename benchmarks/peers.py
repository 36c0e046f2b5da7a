"""Functions that make a problem enter, cases leave: how we solve it, and how Storm, quantecon and mdpsolver do."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness import Seen, UnavailableError, lazily
from ratherthan.model.objective import Discounted
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, PolicyIteration, Sweeps, solve

__all__ = ["SOUND", "by_mdpsolver", "by_quantecon", "by_storm", "by_us"]

Maker = Callable[[], Problem]
SOUND = {
    "optimistic value iteration": "OPTIMISTIC_VALUE_ITERATION",
    "sound value iteration": "SOUND_VALUE_ITERATION",
    "interval iteration": "INTERVAL_ITERATION",
}
"""Storm's methods that promise bounds."""
PRECISION = 1e-6
"""The relative width that everybody aims at: Storm's default, and ours."""


def by_us(problem: Maker, method: PolicyIteration | Sweeps | None = None) -> Callable[[], object]:
    """Return a function that solves a problem and looks how wide the proved bounds are."""

    def make() -> Callable[[], object]:
        made = problem()

        def run() -> Seen:
            solution = solve(made, method=method)
            lower, upper = solution.lower[0], solution.upper[0]
            finite = np.isfinite(upper) & (upper != lower)
            width = float(np.max((upper[finite] - lower[finite]) / np.abs(upper[finite]), initial=0.0))
            proved = "" if solution.outcome is Outcome.CERTIFIED else solution.outcome.value
            return Seen(width=width, note=proved or solution.engine)

        return run

    return lazily(make)


def by_storm(problem: Maker, method: str) -> Callable[[], object]:
    """Return a function that lets Storm check the model, which is handed over once, beforehand; it makes a scheduler, too."""

    def make() -> Callable[[], object]:
        storm: Any = _storm()
        made = problem()
        from ratherthan.io import write

        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "model.umb")
            write(made, path)
            model = storm.build_model_from_umb(path) if hasattr(storm, "build_model_from_umb") else None
            if model is None:
                raise UnavailableError("this Storm reads no UMB archives")
        assert made.objective is not None
        wanted = storm.parse_properties(made.objective.text)[0]
        environment = storm.environments.sound()
        environment.solver().min_max().method = getattr(storm.environments.MinMaxMethod, method)

        def run() -> Seen:
            storm.model_checking(model, wanted, environment=environment, extract_scheduler=True)
            return Seen(width=PRECISION)

        return run

    return lazily(make)


def by_quantecon(problem: Maker, tolerance: float = PRECISION) -> Callable[[], object]:
    """Return a function that lets quantecon's modified policy iteration solve a discounted problem."""

    def make() -> Callable[[], object]:
        try:
            from quantecon.markov import DiscreteDP
        except ImportError as error:
            raise UnavailableError("quantecon is not installed") from error
        from scipy.sparse import csr_array

        made = problem()
        mdp, objective = made.mdp, made.objective
        assert isinstance(objective, Discounted)
        entries = (mdp.branch_to_probability.copy(), mdp.branch_to_target.copy(), mdp.choice_to_branches.copy())
        step = csr_array(entries, shape=(mdp.choices, mdp.states))
        step.sum_duplicates()
        gain = mdp.rewards["gain"].choice
        own = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
        action = np.arange(mdp.choices) - mdp.state_to_choices[own]
        program = DiscreteDP(gain, step, objective.discount, own, action)

        def run() -> Seen:
            program.solve(method="mpi", epsilon=tolerance * float(np.abs(gain).max()))
            return Seen(note="no proof")

        return run

    return lazily(make)


def by_mdpsolver(problem: Maker, tolerance: float = PRECISION) -> Callable[[], object]:
    """Return a function that lets mdpsolver's modified policy iteration solve a discounted problem."""

    def make() -> Callable[[], object]:
        try:
            import mdpsolver
        except ImportError as error:
            raise UnavailableError("mdpsolver is not installed") from error
        made = problem()
        mdp, objective = made.mdp, made.objective
        assert isinstance(objective, Discounted)
        gains = mdp.rewards["gain"].choice
        chance = np.split(mdp.branch_to_probability, mdp.choice_to_branches[1:-1])
        target = np.split(mdp.branch_to_target, mdp.choice_to_branches[1:-1])
        rows = [range(mdp.state_to_choices[s], mdp.state_to_choices[s + 1]) for s in range(mdp.states)]
        words: dict[str, Any] = {
            "discount": objective.discount,
            "rewards": [[float(gains[row]) for row in own] for own in rows],
            "tranMatProbs": [[chance[row].tolist() for row in own] for own in rows],
            "tranMatColumns": [[target[row].tolist() for row in own] for own in rows],
        }

        def run() -> Seen:
            program = mdpsolver.model()  # anew each time: it keeps what it found
            program.mdp(**words)
            program.solve(algorithm="mpi", tolerance=tolerance)
            return Seen(note="no proof; the model is handed over each time")

        return run

    return lazily(make)


def _storm() -> Any:
    """Return Storm's module."""
    try:
        import stormpy
    except ImportError as error:
        raise UnavailableError("stormpy is not installed") from error
    return stormpy

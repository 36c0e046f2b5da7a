"""How fast a slippery map is solved with proved bounds, against equations and against Storm's sound methods."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.harness import Case, UnavailableError
from benchmarks.models import slippery_map
from ratherthan.model.problem import Problem
from ratherthan.solve import Outcome, PolicyIteration, solve

SIDE = 300


def solved(problem: Problem, method: PolicyIteration | None = None) -> Callable[[], object]:
    """Return a function that solves a problem and looks whether the bounds are proved."""

    def run() -> None:
        solution = solve(problem, method=method)
        if solution.outcome is not Outcome.CERTIFIED:
            raise UnavailableError(solution.outcome.value)

    return run


def by_storm(problem: Problem, method: str) -> Callable[[], object]:
    """Return a function that lets Storm check the model, which is handed over once, beforehand."""
    try:
        import stormpy
    except ImportError:

        def missing() -> None:
            raise UnavailableError("stormpy is not installed")

        return missing
    import tempfile
    from pathlib import Path

    from ratherthan.io import write

    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "map.drn")
        write(problem, path)
        model = stormpy.build_model_from_drn(path)
    wanted = stormpy.parse_properties('R{"steps"}min=? [F "goal"]')[0]
    environment = stormpy.environments.sound()
    environment.solver().min_max().method = getattr(stormpy.environments.MinMaxMethod, method)
    return lambda: stormpy.model_checking(model, wanted, environment=environment)


def cases() -> list[Case]:
    problem = slippery_map(SIDE)
    size = f"{SIDE} × {SIDE} cells"
    return [
        Case(
            name=f"Storm, optimistic value iteration, {size}",
            run=by_storm(problem, "OPTIMISTIC_VALUE_ITERATION"),
            peer=True,
        ),
        Case(name=f"Storm, sound value iteration, {size}", run=by_storm(problem, "SOUND_VALUE_ITERATION"), peer=True),
        Case(name=f"ratherthan, policy iteration, {size}", run=solved(problem, PolicyIteration())),
        Case(name=f"ratherthan, {size}", run=solved(problem)),
    ]

"""Values that others published come out within the bounds, on every model that builds in a minute."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from ratherthan.errors import PropertyError
from ratherthan.io import read
from ratherthan.model.objective import Mission, Threshold
from ratherthan.model.property import parse_property
from ratherthan.solve import Outcome, solve

pytest.importorskip("stormpy")

LARGE = 20_000
ROOT = Path(__file__).resolve().parent.parent.parent
DATA = Path(os.environ.get("RATHERTHAN_SHARED_DATA", ROOT.parent / "shared" / "data"))


def published() -> list[Any]:
    """Return one case per model instance with published values; none where the data is not there."""
    if not (DATA / "expected.json").is_file():
        return [pytest.param({}, id="no data")]
    cases = []
    for model in json.loads((DATA / "expected.json").read_text())["models"]:
        if model["status"] != "ok" or model.get("type") != "MDP":
            continue
        large = model["counts_full"]["states"] > LARGE
        name = f"{Path(model['file']).stem} {model.get('constants') or ''}".strip()
        cases.append(pytest.param(model, id=name, marks=[pytest.mark.slow] if large else []))
    return cases


@pytest.mark.parametrize("model", published())
def test_published_values_lie_within_the_bounds(model: dict[str, Any], shared_data: Path) -> None:
    problem = read(shared_data / model["file"], constants=model.get("constants"))
    start = int(problem.mdp.initial[0])
    told = 0
    for name, text in model["formulas"].items():
        expected = model["published_reference"][name]
        try:
            wanted = parse_property(text, problem)
        except PropertyError:
            assert "<=" in text or ">=" in text, "only bounded properties are refused"
            continue
        objective = wanted.objective if isinstance(wanted, Threshold) else wanted
        if isinstance(objective, Mission) and problem.mdp.branches > LARGE:
            continue  # its product has as many times the branches as there are steps to be counted
        solution = solve(problem, objective)
        assert solution.outcome is Outcome.CERTIFIED
        lower, upper = float(solution.lower[0, start]), float(solution.upper[0, start])
        if isinstance(wanted, Threshold):
            assert expected is True
            assert lower >= wanted.bound
        else:
            slack = 1e-6 * abs(expected)  # some published values were computed to such a precision
            assert lower - slack <= expected <= upper + slack
            assert upper - lower <= 1e-8 * abs(expected)
        told += 1
    assert told or all("<=" in text or ">=" in text for text in model["formulas"].values())

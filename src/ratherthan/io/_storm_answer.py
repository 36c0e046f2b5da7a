"""A folder with a model as arrays and a property enters; what Storm answers is left there. `ratherthan.io.storm` runs it."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ratherthan.errors import RatherthanError
from ratherthan.io._apart import follow_parent
from ratherthan.io._storm import at_work, sentence_of

__all__ = ["answer"]

_SEVERAL_PRECISION = 1e-6


def answer(folder: Path) -> None:
    """Let Storm answer the property in a folder on the model there, and leave ``answer.json``, perhaps ``values.npy``.

    Parameters
    ----------
    folder : Path
        With ``model.umb`` and ``question.json``: the text, whether every state's value is asked for.
    """
    question = json.loads((folder / "question.json").read_text(encoding="utf-8"))
    try:
        with at_work("the model", "answer this on") as stormpy:
            said = {"version": stormpy.__version__} | _checked(stormpy, folder, question)
    except RatherthanError as error:
        said = {"error": sentence_of(error.__cause__) if error.__cause__ is not None else error.message}
    (folder / "answer.json").write_text(json.dumps(said), encoding="utf-8")


def _checked(stormpy: Any, folder: Path, question: Mapping[str, Any]) -> dict[str, Any]:
    """Return the value at the start, and leave the values of all states in a file where they are asked for."""
    model = stormpy.build_model_from_umb(str(folder / "model.umb"))
    wanted = stormpy.parse_property(question["text"])
    several = "multi" in question["text"]
    result = stormpy.model_checking(
        model,
        wanted,
        only_initial_states=not question["every"],
        environment=_several(stormpy) if several else stormpy.environments.sound(),
    )
    if result is None:
        return {"error": "it has no method for such a property on a model with decisions."}
    if result.is_pareto_curve_check_result():
        return {"error": "it asks for a curve, not for one value. Give bounds to all but one of its parts."}
    start, yes_or_no = model.initial_states[0], result.is_qualitative()
    if question["every"]:
        _keep(result, model.nr_states, folder / "values.npy")
    if several and yes_or_no and "=?" in question["text"]:
        return {"error": "no plan keeps all of the bounds."}
    if yes_or_no:
        return {"value": bool(result[start]), "lower": None, "upper": None}
    told = result[start]
    lower, upper = (
        (repr(float(told.lower)), repr(float(told.upper))) if told.has_lower and told.has_upper else (None, None)
    )
    return {"value": repr(float(told.value)), "lower": lower, "upper": upper}


def _keep(result: Any, count: int, path: Path) -> None:
    """Write the values of all states as an array."""
    if result.is_qualitative():
        truth = result.get_truth_values_vector()
        np.save(path, np.fromiter((truth.get(i) for i in range(count)), dtype=np.bool_, count=count))
    else:
        np.save(path, np.fromiter(result.get_value_vector(), dtype=np.float64, count=count))


def _several(stormpy: Any) -> Any:
    """Return settings for several objectives: the sound methods may not come to an end where a bound is met exactly."""
    environment = stormpy.Environment()
    environment.modelchecker().multi().precision = stormpy.Rational(_SEVERAL_PRECISION)
    return environment


if __name__ == "__main__":
    follow_parent()
    answer(Path(sys.argv[1]))

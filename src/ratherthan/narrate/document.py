"""An Explanation enters, the text of its JSON document leaves; and back."""

from __future__ import annotations

import json
from typing import Any, NoReturn

from ratherthan.errors import ExplanationError
from ratherthan.explain.explanation import Explanation
from ratherthan.narrate.indenting import Spelled, indented
from ratherthan.narrate.narrate import narrate

__all__ = ["from_json", "to_json"]


def to_json(explanation: Explanation) -> str:
    """Return an explanation as JSON, with its sentences and a digest.

    Parameters
    ----------
    explanation : Explanation

    Returns
    -------
    str
        Indented, with a line end; ``docs/schema/explanation.schema.json`` describes it.
    """
    from ratherthan.explain.record import digest_of, frame_of

    document = frame_of(explanation, narrate(explanation))
    document["digest"] = digest_of(explanation, document)
    rows = explanation.policy.rows.spelled().replace(",", ", ").replace("], [", "],\n      [")
    document["policy"]["choices"] = Spelled(rows)
    return indented(document) + "\n"


def from_json(text: str) -> Explanation:
    """Return the explanation that `to_json` wrote.

    Parameters
    ----------
    text : str

    Returns
    -------
    Explanation
        Equal to the one that was written. That it is true of a model, only `ratherthan.verify` tells.

    Raises
    ------
    ExplanationError
        If it is not JSON, of another version or form, or was changed after it was written.
    """
    from ratherthan.explain.record import digest, from_document

    try:
        document = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_once)
    except (ValueError, RecursionError) as error:
        raise ExplanationError(f"An explanation must be a JSON document, but this is none: {error}.") from error
    explanation, _ = from_document(document)
    if digest(document) != document["digest"]:
        raise ExplanationError(
            "An explanation must be as it was written, but its digest does not fit the rest: it was changed. Write it anew."
        )
    return explanation


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object as a dict, refusing keys that come twice."""
    table = dict(pairs)
    if len(table) != len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key '{twice}' comes twice in one object")
    return table

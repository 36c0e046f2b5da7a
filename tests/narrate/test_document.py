"""An explanation survives the way through JSON, and a document that was changed does not."""

from __future__ import annotations

import json

import pytest

import ratherthan as rt
from ratherthan.explain import KINDS


@pytest.fixture(scope="module")
def solution():
    return rt.solve(rt.read("example:paper-5x5"))


@pytest.mark.parametrize("kind", KINDS)
def test_an_explanation_survives_the_way_through_json(solution, kind):
    explanation = rt.explain(solution, kind=kind, state=10)
    again = rt.from_json(rt.to_json(explanation))
    assert again == explanation
    assert rt.narrate(again) == rt.narrate(explanation)
    assert rt.to_json(again) == rt.to_json(explanation)


def test_a_document_ends_with_a_line_end_and_has_no_number_that_is_none(solution):
    text = rt.to_json(rt.explain(solution))
    assert text.endswith("}\n")
    assert "NaN" not in text
    assert "Infinity" not in text


@pytest.mark.parametrize(
    ("before", "after", "part"),
    [
        ("the shortest", "the longest", "changed"),
        ("east", "west", "changed"),
        ('"alpha": 0.0', '"alpha": NaN', "NaN"),
        ('"version": "1"', '"version": "0"', "version"),
        ('"alpha": 0.0', '"alpha": 0.0, "alpha": 1.0', "twice"),
        ("{", "[", "JSON"),
    ],
)
def test_a_changed_document_is_refused(solution, before, after, part):
    text = rt.to_json(rt.explain(solution))
    assert before in text
    with pytest.raises(rt.ExplanationError, match=part):
        rt.from_json(text.replace(before, after, 1))


@pytest.mark.parametrize("text", ["", "{}", "[]", "3", "null", '"x"', "[" * 100_000, json.dumps({"version": "1"})])
def test_what_is_no_document_is_refused(text):
    with pytest.raises(rt.ExplanationError):
        rt.from_json(text)

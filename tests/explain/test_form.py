"""The quick test of a document's form is never more lenient than the schema."""

from __future__ import annotations

import copy
import json
import random

import pytest
from jsonschema import Draft202012Validator

import ratherthan as rt
from ratherthan.explain.form import test_of as form_of
from ratherthan.explain.schema import schema
from ratherthan.narrate import to_json

ODD = [None, True, 0, -1, 1.5, "", "inf", "x", [], {}, [0], [[0, 0, 1.0]], {"a": 1}, float("inf")]


@pytest.fixture(scope="module")
def document():
    solution = rt.solve(rt.read("example:paper-5x5"))
    return json.loads(to_json(rt.explain(solution)))


def places(value, path=()):
    yield path
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in entries:
        yield from places(entry, (*path, key))


def test_a_document_has_its_form(document):
    assert form_of(schema())(document)


@pytest.mark.parametrize("seed", range(300))
def test_what_passes_the_quick_test_passes_the_schema(document, seed):
    rng = random.Random(seed)
    changed = copy.deepcopy(document)
    path = rng.choice([path for path in places(changed) if path])
    inside = changed
    for key in path[:-1]:
        inside = inside[key]
    action = rng.randrange(3)
    if action == 0 and isinstance(inside, dict):
        del inside[path[-1]]
    elif action == 1 and isinstance(inside, dict):
        inside[f"{path[-1]}?"] = rng.choice(ODD)
    else:
        inside[path[-1]] = rng.choice(ODD)
    valid = Draft202012Validator(schema()).is_valid(changed)
    quick = form_of(schema())(changed)
    assert valid or not quick
    assert quick or not valid  # of these changes, none is refused without need


def test_a_keyword_that_is_not_known_is_not_passed_over():
    with pytest.raises(ValueError, match="multipleOf"):
        form_of({"type": "number", "multipleOf": 2})

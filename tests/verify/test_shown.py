"""What a stored explanation shows in pictures is checked against the model, too."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable
from typing import Any

import pytest

import ratherthan as rt
from ratherthan.errors import ExplanationError
from ratherthan.explain.record import digest

Document = dict[str, Any]


def packed(data: bytes) -> str:
    """Return bytes as a document holds cells."""
    return base64.b64encode(zlib.compress(data)).decode("ascii")


def other_ground(document: Document) -> None:
    document["world"]["ground"] = packed(bytes(25))


def other_goal(document: Document) -> None:
    document["world"]["goals"] = packed(bytes([0, 0, 0, 128]))


def other_size(document: Document) -> None:
    document["world"] |= {"width": 1, "height": 25}


def no_such_road(document: Document) -> None:
    document["world"]["roads"][0] = [0, 24]


def other_numbers(document: Document) -> None:
    document["world"]["numbered"] = False


def elsewhere(document: Document) -> None:
    document["steps"][0]["alternatives"][0]["towards"] = 10


def other_action(document: Document) -> None:
    document["steps"][0]["alternatives"][0]["action"] = "east"


@pytest.fixture
def document() -> Document:
    """A fresh explanation of the paper's map."""
    return json.loads(rt.to_json(rt.explain(rt.solve(rt.read("example:paper-5x5")))))


@pytest.mark.parametrize(
    "forge", [other_ground, other_goal, other_size, no_such_road, other_numbers, elsewhere, other_action]
)
def test_a_forged_picture_is_refused(forge: Callable[[Document], None], document: Document) -> None:
    forge(document)
    document["digest"] = digest(document)
    with pytest.raises(ExplanationError):
        rt.verify(document, rt.read("example:paper-5x5"))


def test_a_document_from_before_there_were_maps_in_documents_is_still_good(document: Document) -> None:
    del document["world"]
    for step in document["steps"]:
        step.pop("alternatives", None)
    document["digest"] = digest(document)
    verdicts = rt.verify(document, rt.read("example:paper-5x5"))
    assert not verdicts.fails
    assert rt.from_json(json.dumps(document)).world is None


@pytest.mark.parametrize(
    ("ground", "words"),
    [
        ("AAAA", "deflated"),
        (packed(bytes(24)), "25 bytes, got 24"),
        (packed(bytes(10_000_000)), "got more"),
        (packed(bytes([9] * 25)), "kind 9"),
        ("ü", "deflated"),
    ],
)
def test_cells_that_are_none_are_refused_in_a_sentence(ground: str, words: str, document: Document) -> None:
    document["world"]["ground"] = ground
    document["digest"] = digest(document)
    with pytest.raises(ExplanationError, match=words):
        rt.from_json(json.dumps(document))

"""A lexicon file goes before the words of the model, and travels with the explanation."""

from __future__ import annotations

import pytest

from ratherthan.apps.words import OBJECTIVE_WORDS, lexicon_from
from ratherthan.model.lexicon import Lexicon

PAPER = "example:paper-5x5"
WORDS = """
state = "crossing {number}"
[actions]
east = "drive east"
[gerunds]
south = "going down south"
[states]
12 = "the old market"
[objectives.distance]
best = "the quickest way"
"""


@pytest.fixture
def words(tmp_path):
    (tmp_path / "words.toml").write_text(WORDS, encoding="utf-8")
    return tmp_path / "words.toml"


def test_given_words_are_said(said, words):
    options = ("--lexicon", words, "--kind", "responsibility", "--state")
    assert (
        said("explain", PAPER, *options, "10") == "We drive east at crossing 10 because it leads to the quickest way.\n"
    )
    assert (
        said("explain", PAPER, *options, "12")
        == "We move north at the old market because it leads to the quickest way.\n"
    )


def test_given_words_travel_with_the_explanation(document, words):
    answer = document("explain", PAPER, "--lexicon", words)
    assert answer["lexicon"]["actions"]["east"] == "drive east"
    assert answer["lexicon"]["actions"]["west"] == "move west"
    assert "the critical old market" in answer["text"]


def test_what_is_not_given_is_said_as_before():
    beneath = Lexicon(actions={"a": "go", "b": "stop"}, objectives={"time": {"best": "x"}}, state="place {number}")
    lexicon = lexicon_from({"actions": {"b": "halt"}, "objectives": {"time": {"noun": "y"}}}, "words.toml", beneath)
    assert lexicon.actions == {"a": "go", "b": "halt"}
    assert lexicon.objectives == {"time": {"best": "x", "noun": "y"}}
    assert lexicon.state == "place {number}"
    assert lexicon_from({}, "words.toml", beneath) == beneath


def test_the_words_of_an_objective_are_those_of_the_templates():
    from ratherthan.narrate.words import language

    for objective in language("en").templates["objectives"].values():
        for table in objective.values():
            assert set(table) == set(OBJECTIVE_WORDS)

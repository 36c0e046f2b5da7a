"""A lexicon file goes before the words of the model, and travels with the explanation."""

from __future__ import annotations

import pytest

from ratherthan.apps.words import lexicon_from
from ratherthan.model.lexicon import OBJECTIVE_WORDS, Lexicon

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

    templates = language("en").templates
    arriving = templates["arriving"]["usual"]
    for objective in (*templates["objectives"].values(), *templates["rewards"].values()):
        for table in objective.values():
            assert {*table, *arriving} == set(OBJECTIVE_WORDS)


def test_a_placeholder_that_nothing_fills_is_refused(refused, tmp_path):
    (tmp_path / "words.toml").write_text('state = "crossing {numbr}"')
    assert "got '{numbr}'" in refused("explain", PAPER, "--lexicon", tmp_path / "words.toml")


def test_words_for_what_the_model_does_not_have_are_told(ask, tmp_path):
    (tmp_path / "words.toml").write_text(
        '[actions]\neast = "go"\nup = "rise"\n[states]\n12 = "a"\n99 = "b"\nhome = "c"'
    )
    result = ask("explain", PAPER, "--lexicon", tmp_path / "words.toml", "--kind", "naive-state", "--state", "10")
    assert (result.exit_code, result.stdout) == (0, "We go at grid 10.\n")
    assert "does not have: action 'up', state '99', state 'home'." in result.stderr


def test_an_empty_lexicon_is_called_a_lexicon(refused, tmp_path):
    (tmp_path / "words.toml").write_text("")
    assert refused("explain", PAPER, "--lexicon", tmp_path / "words.toml").startswith("A lexicon must not be empty")

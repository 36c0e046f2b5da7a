"""A model alone is drawn as its map, or as a graph of the states around its start."""

from __future__ import annotations

from random import Random
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from pictures import HARD, on_cells
from random_models import random_problem

import ratherthan as rt
from ratherthan.errors import QuestionError

SVG = "{http://www.w3.org/2000/svg}"


def texts(picture):
    return [text.text or "" for text in ET.fromstring(picture.svg).iter(f"{SVG}text")]


def test_a_map_is_drawn_with_start_and_destination_and_nothing_of_a_plan():
    said = texts(rt.draw(rt.read("example:paper-5x5")))
    assert {"start", "destination", "building", "25 states, 31 choices, 56 branches."} <= set(said)
    assert not {"our route", "a decision that matters"} & set(said)


def test_a_map_without_a_goal_is_drawn_without_one():
    problem = on_cells(["..", ".."]).problem
    bare = rt.Problem(mdp=rt.MDP(**{**parts_of(problem.mdp), "labels": {}, "rewards": {}}), world=problem.world)
    assert "destination" not in texts(rt.draw(bare))


def parts_of(mdp):
    names = ("state_to_choices", "choice_to_branches", "branch_to_target", "branch_to_probability", "choice_to_action")
    return {name: getattr(mdp, name) for name in names} | {"actions": mdp.actions, "initial": mdp.initial}


def test_a_graph_names_each_state_and_each_action():
    problem = rt.read("example:delivery")
    said = texts(rt.draw(problem))
    for words in ("the depot", "street", "lawn", "pick_up ↺"):
        assert words in said
    assert "13 states, 20 choices, 30 branches." in said


def test_of_a_large_model_the_caption_says_how_many_states_are_not_drawn():
    states = 400
    mdp = rt.MDP(
        state_to_choices=np.arange(states + 1),
        choice_to_branches=np.arange(states + 1),
        branch_to_target=(np.arange(states) + 1) % states,
        branch_to_probability=np.ones(states),
        choice_to_action=np.zeros(states, dtype=np.int64),
        actions=("on",),
        initial=np.array([0]),
    )
    picture = rt.draw(mdp)
    drawn = sum(words.startswith("state ") for words in texts(picture))
    assert f"{states - drawn} more states are not drawn." in " ".join(texts(picture))


@pytest.mark.parametrize("seed", range(40))
def test_any_model_can_be_drawn(seed):
    mdp = random_problem(Random(seed)).mdp
    picture = rt.draw(mdp)
    ET.fromstring(picture.svg)
    assert picture.svg == rt.draw(mdp).svg


def test_hard_names_are_shown():
    problem = rt.read("example:delivery")
    mdp = rt.MDP(
        **{**parts_of(problem.mdp), "names": rt.StateNames(count=13, strings=[f"{HARD} {k}" for k in range(13)])}
    )
    root = ET.fromstring(rt.draw(mdp).svg)
    assert any("地図" in (text.text or "") or "A <b>" in (text.text or "") for text in root.iter(f"{SVG}text"))


def test_of_a_model_nothing_else_can_be_asked():
    with pytest.raises(QuestionError, match="solve it first"):
        rt.draw(rt.read("example:paper-5x5"), "value")


def test_a_picture_fits_the_room_it_is_given():
    explanation = rt.explain(rt.solve(rt.read("example:office")))
    for width in (200.0, 400.0, 800.0):
        parts = rt.draw(explanation, room=(width, width)).parts
        assert parts is not None
        assert parts.width <= width + 80.0
        ET.fromstring(parts.body)
        assert parts.legend

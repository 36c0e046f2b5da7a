"""``ratherthan draw`` and ``ratherthan report``: what Python makes, as files or on standard output; what makes no sense is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import ratherthan as rt

PAPER = "example:paper-5x5"


@pytest.fixture
def stored(ask):
    """An explanation of the paper's map, stored in the folder where commands run."""
    assert ask("explain", PAPER, "--output", "route.json").exit_code == 0
    return "route.json"


def explained(**asked):
    return rt.explain(rt.solve(rt.read(PAPER)), **asked)


def test_the_route_is_drawn_as_python_draws_it(said):
    assert said("draw", PAPER) == rt.draw(explained()).svg


@pytest.mark.parametrize("what", ["value", "spread", "policy"])
def test_a_solution_is_drawn_as_python_draws_it(said, what):
    assert said("draw", PAPER, "--what", what) == rt.draw(rt.solve(rt.read(PAPER)), what).svg


def test_what_follows_two_actions_is_drawn(said):
    solution = rt.solve(rt.read(PAPER))
    trees = rt.draw(solution, "trees", state=10, rather_than="south").svg
    assert said("draw", PAPER, "--what", "trees", "--state", "10", "--rather-than", "south") == trees
    assert said("draw", PAPER, "--what", "factors", "--state", "7") == rt.draw(solution, "factors", state=7).svg


def test_one_decision_and_the_model_alone_are_drawn(said):
    one = explained(state=10, rather_than="south")
    assert said("draw", PAPER, "--state", "10", "--rather-than", "south") == rt.draw(one).svg
    assert said("draw", PAPER, "--what", "model") == rt.draw(rt.read(PAPER)).svg


def test_a_file_is_what_its_suffix_says(said):
    pytest.importorskip("resvg_py")
    assert said("draw", PAPER, "--output", "town.png") == ""
    assert Path("town.png").read_bytes().startswith(b"\x89PNG")
    said("draw", PAPER, "--output", "town.svg")
    assert Path("town.svg").read_text(encoding="utf-8").startswith("<svg ")


def test_a_page_is_what_python_makes(said):
    assert said("report", PAPER) == rt.report(explained()).html
    said("report", PAPER, "--output", "town.html")
    assert Path("town.html").read_text(encoding="utf-8") == rt.report(explained()).html


def test_a_stored_explanation_becomes_the_same_picture_and_page(said, stored):
    assert said("draw", stored) == said("draw", PAPER)
    assert said("draw", stored, "--what", "graph") == said("draw", PAPER, "--what", "graph")
    assert said("report", stored) == said("report", PAPER)


def test_a_stored_explanation_takes_other_words(said, stored):
    Path("words.toml").write_text('state = "square {number}"\n', encoding="utf-8")
    assert "move east at critical square 10 because" in said("report", stored, "--lexicon", "words.toml")


def test_many_sentences_become_few_unless_asked_otherwise(said, tmp_path):
    row = "." * 6
    wall = "@" * 5 + "."
    tmp_path.joinpath("hall.map").write_text(
        "type octile\nheight 9\nwidth 6\nmap\n"
        + "\n".join([row, wall, row, wall[::-1], row, wall, row, wall[::-1], row])
        + "\n",
        encoding="utf-8",
    )
    drive = ["hall.map", "--start", "0,0", "--goal", "0,8", "--directions", "4"]
    few = said("report", *drive)
    assert 1 <= few.count('<li id="sentence-') <= 7
    assert said("report", *drive, "--at-most", "3").count('<li id="sentence-') <= 3
    assert said("explain", *drive).count(" we drive ") > 12


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["draw", PAPER, "--output", "town.pdf"], "must end in .svg or .png, got 'town.pdf'"),
        (["report", PAPER, "--output", "town.pdf"], "must end in .html or .htm, got 'town.pdf'"),
        (["report", PAPER, "--output", "no/such/folder/town.html"], "no/such/folder/town.html"),
        (["draw", PAPER, "--what", "beauty"], "'beauty'"),
        (["draw", PAPER, "--what", "value", "--kind", "selective"], "no use for --kind"),
        (["draw", PAPER, "--what", "value", "--state", "3"], "no use for --state"),
        (["draw", PAPER, "--what", "model", "--policy", "p.json"], "no use for --policy"),
        (["draw", PAPER, "--what", "factors", "--state", "99"], "0 … 24, got 99"),
        (["draw", PAPER, "--what", "trees", "--state", "8"], "has one"),
        (["draw", "example:delivery", "-p", "safest", "--what", "value"], "lies on none"),
        (["draw", "nowhere.json"], "nowhere.json"),
        (["report", "nowhere.umb"], "there is no 'nowhere.umb'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_it_is_refused_in_one_sentence(refused, words, part):
    assert part in refused(*words)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["report", "--kind", "selective"], "--kind must be left out"),
        (["draw", "--state", "3", "--detail"], "--state, --detail must be left out"),
        (["report", "-p", "Pmax=? [F true]"], "--property must be left out"),
        (["report", "--goal", "1,1"], "--goal must be left out"),
        (["draw", "--what", "value"], "not what 'value' needs"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_stored_explanation_answers_its_own_question_only(refused, stored, words, part):
    assert part in refused(words[0], stored, *words[1:])


def test_a_stored_explanation_that_was_changed_is_refused(refused, stored):
    document = json.loads(Path(stored).read_text(encoding="utf-8"))
    document["text"] = "We fly."
    Path(stored).write_text(json.dumps(document), encoding="utf-8")
    assert "its digest does not fit" in refused("report", stored)
    Path(stored).write_text(json.dumps({"version": "1", "alpha": 0}), encoding="utf-8")
    assert "nation" in refused("draw", stored)
    Path(stored).write_bytes(b'{"version": "\xff"}')
    assert "UTF-8" in refused("draw", stored)


def test_a_model_in_json_is_no_explanation(refused):
    Path("model.json").write_text('{"jani-version": 1, "version": "1"}', encoding="utf-8")
    assert "explanation" not in refused("report", "model.json").lower()


def test_a_ranking_alone_ranks_the_few_sentences(said):
    page = said("report", "example:office", "--rank", "spread")
    assert 1 <= page.count('<li id="sentence-') <= 7
    assert page == said("report", "example:office", "--rank", "spread", "--at-most", "7")

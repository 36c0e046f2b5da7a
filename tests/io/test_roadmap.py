from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ratherthan.errors import InputError, PropertyError, SourceError
from ratherthan.io._roadmap_tables import ACTIONS, STANDARD_KINDS
from ratherthan.io.examples import read_example
from ratherthan.io.roadmap import _differences, format_roadmap, parse_roadmap, read_roadmap, write_roadmap
from ratherthan.model.lexicon import OBJECTIVE_WORDS
from ratherthan.model.objective import ExpectedCost, ReachAvoid
from ratherthan.model.problem import Problem
from ratherthan.narrate.words import language

TOWN = """\
title = "A town"
success = 0.9
property = 'R{"distance"}min=? [F "destination"]'

map = '''
S.x
.#=
.=D
'''

[kinds]
"~" = { name = "river", enter = false }

[moves]
0 = "south, east"

[costs]
distance = 1
time = { other = 1, highway = 0.5 }

[labels]
fast = ["highway", 0]

[properties]
sure = 'Pmax=? [F "destination"]'

[words]
state = "grid {number}"

[words.cells]
3 = "the lane"
"""


def moves(problem: Problem) -> dict[int, list[str]]:
    return {s: [problem.mdp.action_name(c) for c in problem.mdp.choices_of(s)] for s in range(problem.mdp.states)}


def branches(problem: Problem, state: int, action: str) -> dict[int, float]:
    mdp = problem.mdp
    choice = next(c for c in mdp.choices_of(state) if mdp.action_name(c) == action)
    rows = mdp.branches_of(choice)
    return dict(zip(mdp.branch_to_target[rows].tolist(), mdp.branch_to_probability[rows].tolist(), strict=True))


# ---- what a map says


def test_every_cell_is_a_state_with_its_number_and_its_moves_in_order():
    problem = parse_roadmap(TOWN, source="town")
    assert moves(problem) == {
        0: ["south", "east"],
        1: ["east", "west"],
        2: ["stay"],
        3: ["north", "south"],
        4: ["stay"],
        5: ["north", "south"],
        6: ["north", "east"],
        7: ["east", "west"],
        8: ["stay"],
    }
    assert branches(problem, 0, "south") == {3: 0.9, 0: 0.1}
    assert branches(problem, 4, "stay") == {4: 1}
    assert problem.mdp.actions == ("north", "east", "south", "west", "stay")
    assert problem.mdp.initial.tolist() == [0]
    assert np.flatnonzero(problem.mdp.labels["destination"]).tolist() == [8]
    assert np.flatnonzero(problem.mdp.labels["fast"]).tolist() == [0, 5, 7]


def test_the_problem_carries_its_world_words_and_objective():
    problem = parse_roadmap(TOWN, source="town")
    world = problem.world
    assert (world.width, world.height, world.title, world.note) == (3, 3, "A town", "")
    assert world.cell_of_state.tolist() == list(range(9))
    assert [world.kinds[kind] for kind in world.kind_of_cell[:6]] == [
        "start", "urban road", "dead end", "urban road", "building", "highway"
    ]  # fmt: skip
    assert problem.objective == ExpectedCost(goal='"destination"', reward="distance")
    assert problem.properties == {"sure": ReachAvoid(goal='"destination"')}
    assert problem.lexicon.state == "grid {number}"
    assert problem.lexicon.actions["north"] == "move north"
    assert problem.lexicon.states == {"3": "the lane"}
    assert problem.source == "town"


def test_a_move_costs_what_its_kind_of_ground_costs_and_a_destination_is_free():
    problem = parse_roadmap(TOWN)
    mdp = problem.mdp
    state = np.repeat(np.arange(9), np.diff(mdp.state_to_choices))
    for name, expected in (("distance", [1] * 8 + [0]), ("time", [1, 1, 1, 1, 1, 0.5, 1, 0.5, 0])):
        assert mdp.rewards[name].choice.tolist() == [expected[s] for s in state]


def test_the_least_map_has_a_start_and_a_destination():
    problem = parse_roadmap("map = 'SD'")
    assert moves(problem) == {0: ["east"], 1: ["stay"]}
    assert branches(problem, 0, "east") == {1: 1}
    assert problem.objective is None
    assert list(problem.mdp.rewards) == ["distance"]


def test_a_start_can_be_a_number_and_even_the_destination():
    assert parse_roadmap("start = 1\nmap = '.=D'").mdp.initial.tolist() == [1]
    assert parse_roadmap("start = 2\nmap = '.=D'").mdp.initial.tolist() == [2]


def test_blanks_in_a_drawing_do_not_count():
    dense, spaced = parse_roadmap("map='''\nS.\n.D\n'''"), parse_roadmap("map='''\n\n   S .\n\t. D  \n\n   '''")
    assert _differences(dense, spaced) == []


def test_windows_line_ends_and_a_byte_order_mark_are_read(tmp_path):
    path = tmp_path / "town.roadmap"
    path.write_bytes(b"\xef\xbb\xbf" + TOWN.replace("\n", "\r\n").encode())
    assert _differences(parse_roadmap(TOWN), read_roadmap(path)) == []


def test_the_order_of_preference_holds_for_all_drawn_cells():
    text = "order = 'west south east north'\nmap='''\nS..\n...\n..D\n'''"
    assert moves(parse_roadmap(text))[4] == ["west", "south", "east", "north"]
    assert moves(parse_roadmap("map='''\nS..\n...\n..D\n'''"))[4] == ["north", "east", "south", "west"]


def test_arrows_are_one_way_streets_that_nobody_enters_against():
    text = "map='''\nS..\n...\n..D\n'''\nstreets='''\nS<v\n-+|\n.^D\n'''"
    found = moves(parse_roadmap(text))
    assert found[1] == ["west"]
    assert found[2] == ["south"]
    assert found[0] == ["south"]  # east is the street that comes towards us
    assert found[3] == ["east"]  # - leaves out north and south, and west is off the map
    assert found[4] == ["north", "east", "west"]  # south is the street that comes towards us
    assert found[5] == ["south"]  # north is the street that comes towards us
    assert found[7] == ["north"]


def test_a_list_overrules_the_drawing():
    text = "map='''\nS..\n..D\n'''\nstreets='''\nS>.\n..D\n'''\n[moves]\n1 = 'west south'\n3 = ['stay']\n4 = ['west', 'east']"
    found = moves(parse_roadmap(text))
    assert found[1] == ["west", "south"]
    assert found[3] == ["stay"]
    assert found[4] == ["west", "east"]
    assert found[2] == ["south", "west"]  # cell 1 is no one-way street any more


def test_a_drift_ends_beside_the_cell_ahead_or_in_place_where_it_is_blocked():
    problem = parse_roadmap("success = 0.8\ndrift = 0.1\nmap='''\n...\nS.D\n#x.\n'''")
    assert branches(problem, 3, "east") == {4: 0.8, 0: 0.05, 3: 0.15}  # north is open, south a building
    assert branches(problem, 4, "east") == {5: 0.8, 1: 0.05, 7: 0.05, 4: 0.1}
    assert branches(problem, 1, "south") == {4: 0.8, 2: 0.05, 0: 0.05, 1: 0.1}


def test_chances_may_depend_on_the_kind_of_ground():
    problem = parse_roadmap("success = { other = 0.5, highway = 1 }\nmap='S.=D'")
    assert branches(problem, 0, "east") == {1: 0.5, 0: 0.5}
    assert branches(problem, 2, "east") == {3: 1}


def test_kinds_of_ones_own_can_be_walls_traps_and_new_names_for_a_character():
    text = """
map = 'Swq.D'
[kinds]
w = "water"
q = { name = "quicksand", leave = false }
"." = { name = "hedge", enter = false, leave = true }
"""
    problem = parse_roadmap(text)
    assert moves(problem) == {0: ["east"], 1: ["east", "west"], 2: ["stay"], 3: ["east", "west"], 4: ["stay"]}
    assert problem.world.kinds == (*(kind.name for kind in STANDARD_KINDS.values()), "water", "quicksand", "hedge")


def test_the_words_for_objectives_are_those_of_the_templates():
    templates = language("en").templates
    arriving = templates["arriving"]["usual"]
    for tables in (templates["objectives"], templates["rewards"]):
        assert all({*words, *arriving} == set(OBJECTIVE_WORDS) for kind in tables.values() for words in kind.values())


# ---- what a map must not say

FAULTS = {
    "nothing": ("", 1, None, "The file is empty"),
    "only blanks": (" \n\n", 1, None, "The file is empty"),
    "no TOML": ("map = '''\nSD\n'''\nsuccess 0.9", 4, 9, "must be TOML"),
    "open quotes": ("map = '''\nS.D\n", 3, 1, "Is a closing ''' missing?"),
    "no drawing": ("success = 0.9", None, None, "must have a drawing"),
    "drawing below a section": ("[costs]\ndistance = 1\nmap = 'SD'", None, None, "'map' stands below [costs]"),
    "drawing no text": ("map = 3", 1, 1, "got 3"),
    "empty drawing": ("map = '''\n\n'''", 1, 1, "at least one row"),
    "ragged rows": ("map = '''\nS..\n..\n..D\n'''", 3, 1, "got 2 in row 1 and 3 in row 0"),
    "gap between rows": ("map = '''\nS..\n\n..D\n'''", 3, 1, "got 0 in row 1"),
    "unknown character": ("map = '''\nS..\n  .?D\n'''", 3, 4, "got '?'"),
    "two starts": ("map = '''\nS.\nSD\n'''", 3, 1, "one start, got cells 0 and 2"),
    "start twice": ("start = 1\nmap = 'S.D'", 1, 1, "got the cell S, 0, and start = 1"),
    "no start": ("map = '..D'", 1, 1, "must have a start"),
    "start off the map": ("start = 3\nmap = '..D'", 1, 1, "from 0 to 2"),
    "start in a building": ("start = 0\nmap = '#.D'", 1, 1, "got 0, building"),
    "no destination": ("map = 'S..'", 1, 1, "at least one destination"),
    "move into a building": ("map = 'S#D'\n[moves]\n0 = 'east'", 3, 1, "cell 1 is of the kind 'building'"),
    "move off the map": ("map = 'S.D'\n[moves]\n0 = 'east west'", 3, 1, "west at cell 0, which is at the edge"),
    "move out of a dead end": ("map = 'SxD'\n[moves]\n1 = 'east'", 3, 1, "leave a cell of the kind 'dead end'"),
    "unknown move": ("map = 'S.D'\n[moves]\n1 = 'eats'", 3, 1, "Did you mean 'east'?"),
    "move twice": ("map = 'S.D'\n[moves]\n1 = 'east, east'", 3, 1, "got 'east' twice"),
    "stay and go": ("map = 'S.D'\n[moves]\n1 = 'stay, east'", 3, 1, "'stay' must stand alone"),
    "no move listed": ("map = 'S.D'\n[moves]\n1 = ''", 3, 1, "got none"),
    "move no text": ("map = 'S.D'\n[moves]\n1 = 2", 3, 1, "a text in quotes, got 2"),
    "moves of no cell": ("map = 'S.D'\n[moves]\n3 = 'east'", 3, 1, "from 0 to 2"),
    "moves of a negative cell": ("map = 'S.D'\n[moves]\n-1 = 'east'", 3, 1, "got '-1'"),
    "moves of a very large cell": ("map = 'S.D'\n[moves]\n" + "9" * 5000 + " = 'east'", 3, 1, "from 0 to 2"),
    "cell twice": ("map = 'S.D'\n[moves]\n1 = 'east'\n1 = 'west'", 4, None, "once only"),
    "cell twice in disguise": ("map = 'S.D'\n[moves]\n1 = 'east'\n01 = 'west'", 4, 1, "second list for cell 1"),
    "arrow off the map": ("map='S.D'\nstreets='''\n^.D\n'''", 3, 1, "north at cell 0"),
    "arrow into a building": ("map='''\nS#\n.D\n'''\nstreets='''\n  >#\n  .D\n'''", 6, 3, "cell 1 is of the kind"),
    "arrow in a building": ("map='S#.D'\nstreets='S>.D'", 2, 11, "leave a cell of the kind 'building'"),
    "crossing in a dead end": ("map='SxD'\nstreets='''\nS+D'''", 3, 2, "leave a cell of the kind 'dead end'"),
    "streets of another size": ("map='S.D'\nstreets='''\nS.D\nS.D\n'''", 2, 1, "3 × 1 cells, got 3 × 2"),
    "streets with another cell": ("map='S.D'\nstreets='''\nS=D\n'''", 3, 2, "got '='"),
    "streets no text": ("map='S.D'\nstreets=1", 2, 1, "must have a drawing"),
    "success above one": ("success = 1.5\nmap='SD'", 1, 1, "at most 1, got 1.5 for start"),
    "success zero": ("success = 0\nmap='SD'", 1, 1, "above 0"),
    "success negative": ("success = -0.1\nmap='SD'", 1, 1, "0 or more, got -0.1"),
    "success no number": ("success = 'high'\nmap='SD'", 1, 1, "must be a number, got 'high'"),
    "success true": ("success = true\nmap='SD'", 1, 1, "must be a number, got true"),
    "success not a number": ("success = nan\nmap='SD'", 1, 1, "finite number"),
    "success of a kind": ("success = { other = 1, start = 2 }\nmap='SD'", 1, None, "got 2 for start"),
    "success of few kinds": ("success = { highway = 1 }\nmap='S=D'", 1, 1, "'start' has none"),
    "success of an unknown kind": ("success = { hihgway = 1, other = 1 }\nmap='S=D'", 1, None, "Did you mean 'highway'?"),
    "drift too large": ("success = 0.9\ndrift = 0.2\nmap='SD'", 2, 1, "sum to 1 or less, got 0.9 + 0.2"),
    "cost negative": ("map='SD'\n[costs]\ndistance = -1", 3, 1, "0 or more, got -1"),
    "cost infinite": ("map='SD'\n[costs]\ndistance = inf", 3, 1, "finite number"),
    "cost very long": ("map='SD'\n[costs]\ndistance = 1" + "0" * 400, 3, 1, "finite number"),
    "cost negative in a table": ("map='SD'\n[costs]\nd = {other = 1, start = -2}", 3, None, "0 or more, got -2"),
    "cost of an unknown kind": ("map='SD'\n[costs.d]\nother = 1\nroad = 2", 4, 1, "Did you mean 'urban road'?"),
    "cost with a bad name": ("map='SD'\n[costs]\n'a b' = 1", 3, 1, "letters, digits and _"),
    "costs no section": ("map='SD'\ncosts = 1", 2, 1, "must be a section"),
    "unknown key": ("succes = 0.9\nmap='SD'", 1, 1, "Did you mean 'success'?"),
    "unknown section": ("map='SD'\n[cost]\ndistance = 1", 2, 2, "Did you mean 'costs'?"),
    "order of three": ("order = 'north east south'\nmap='SD'", 1, 1, "the four directions once each"),
    "order unknown": ("order = 'up east south west'\nmap='SD'", 1, 1, "got 'up'"),
    "kind of two characters": ("map='SD'\n[kinds]\nab = 'x'", 3, 1, "one character"),
    "kind of an arrow": ("map='SD'\n[kinds]\nv = 'valley'", 3, 1, "none of ^>v<+-|"),
    "kind without a name": ("map='SD'\n[kinds]\na = ''", 3, 1, "must have a name"),
    "kind other": ("map='SD'\n[kinds]\na = 'other'", 3, 1, "not 'other'"),
    "kind with an unknown flag": ("map='SD'\n[kinds]\na = { name = 'a', entre = true }", 3, None, "Did you mean 'enter'?"),
    "kind with a flag no flag": ("map='SD'\n[kinds]\na = { name = 'a', enter = 1 }", 3, None, "true or false, got 1"),
    "kind known otherwise": ("map='SD'\n[kinds]\na = { name = 'building', enter = true }", 3, 1, "known otherwise"),
    "label of an unknown kind": ("map='SD'\n[labels]\na = 'higway'", 3, 1, "Did you mean 'highway'?"),
    "label of no cell": ("map='SD'\n[labels]\na = [2]", 3, 1, "from 0 to 1"),
    "label destination": ("map='SD'\n[labels]\ndestination = [0]", 3, 1, "given by the map"),
    "label with a bad name": ("map='SD'\n[labels]\ninit = [0]", 3, 1, "init or deadlock"),
    "state phrase": ("map='SD'\n[words]\nstate = 'grid {cell}'", 3, 1, "{number} or {name}"),
    "state phrase unclosed": ("map='SD'\n[words]\nstate = 'grid {'", 3, 1, "{number} or {name}"),
    "word of an unknown action": ("map='SD'\n[words.actions]\nnroth = 'go up'", 3, 1, "Did you mean 'north'?"),
    "word of no cell": ("map='SD'\n[words.cells]\n7 = 'the gate'", 3, 1, "from 0 to 1"),
    "word of a cell twice": ("map='SD'\n[words.cells]\n1 = 'a'\n01 = 'b'", 4, 1, "second one for cell 1"),
    "word of an unknown objective": ("map='SD'\n[words.objectives.distnace]\nbest='x'", 2, None, "Did you mean 'distance'?"),
    "unknown word of an objective": ("map='SD'\n[words.objectives.distance]\nbset='x'", 3, 1, "Did you mean 'best'?"),
    "control characters": ('title = "a\\u001b[31m"\nmap=\'SD\'', 1, 1, "got U+001B"),
    "lists in lists": ("a = " + "[" * 100_000 + "\nmap='SD'", None, None, "nested too deeply"),
    "a number of thousands of digits": ("start = " + "1" * 5000 + "\nmap='SD'", None, None, "must be TOML"),
    "threshold as objective": ("property = 'Pmax>=0.5 [F \"destination\"]'\nmap='SD'", 1, 1, "best value"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_is_told_with_its_place(name):
    text, line, column, fragment = FAULTS[name]
    with pytest.raises(SourceError) as caught:
        parse_roadmap(text, source="town.roadmap")
    message = caught.value.message
    assert fragment in message
    assert message.startswith("town.roadmap")
    assert len(message) < 600
    if line is not None:
        assert caught.value.line == line
        assert f"line {line}" in message
    if column is not None:
        assert caught.value.column == column
        assert f"column {column}:" in message


def test_a_wrong_property_is_told_with_its_line():
    with pytest.raises(PropertyError, match=r"town, line 2: .*distnace") as caught:
        parse_roadmap("map='SD'\nproperty = 'R{\"distnace\"}min=? [F \"destination\"]'", source="town")
    assert caught.value.line == 2


def test_a_drawing_with_escapes_is_told_by_its_rows():
    with pytest.raises(SourceError, match=r"row 2 of the drawing, character 2"):
        parse_roadmap('map = "S.\\n.?\\n.D"')


def test_a_file_must_be_there_and_be_text(tmp_path):
    with pytest.raises(SourceError, match="no such|there is no"):
        read_roadmap(tmp_path / "none.roadmap")
    with pytest.raises(SourceError, match="folder"):
        read_roadmap(tmp_path)
    (tmp_path / "empty.roadmap").write_bytes(b"")
    with pytest.raises(SourceError, match="empty"):
        read_roadmap(tmp_path / "empty.roadmap")
    (tmp_path / "latin.roadmap").write_bytes("map = 'SD'\ntitle = 'Köln'".encode("latin-1"))
    with pytest.raises(SourceError, match=r"line 2, column 11: .*UTF-8 text, got the byte 0xf6"):
        read_roadmap(tmp_path / "latin.roadmap")


def answer(text: str) -> str:
    """Return what a text says, or the sentence that refuses it; anything else is raised."""
    try:
        return repr(parse_roadmap(text).mdp)
    except InputError as error:
        return error.message


@given(
    st.text(alphabet="S.D#x=><^v+-|?~ \n'\"[]{}=,0123abmp", max_size=60), st.integers(0, len(TOWN)), st.integers(0, 20)
)
def test_no_text_makes_a_traceback(noise, at, cut):
    for text in (noise, TOWN[:at] + noise + TOWN[at + cut :]):
        assert answer(text)


VALUES = st.recursive(
    st.none().map(lambda _: "''")
    | st.sampled_from(["1", "-2", "0.5", "nan", "inf", "true", "'a'", "'{'", "'east'", "1979-05-27"]),
    lambda inner: (
        st.lists(inner, max_size=2).map(lambda v: f"[{', '.join(v)}]")
        | st.dictionaries(st.sampled_from(["other", "start", "a", "1", "name", "enter"]), inner, max_size=2).map(
            lambda v: "{" + ", ".join(f"{key} = {value}" for key, value in v.items()) + "}"
        )
    ),
    max_leaves=4,
)
PLACES = (
    *("title", "note", "success", "drift", "order", "start", "property", "streets", "kinds", "moves", "costs", "labels"),
    *("properties", "words", "kinds.a", "moves.1", "costs.d", "labels.a", "properties.p", "words.state", "words.actions"),
    *("words.cells", "words.cells.1", "words.objectives", "words.objectives.distance", "words.actions.north", "kinds.a.name"),
)  # fmt: skip


@given(st.sampled_from(PLACES), VALUES)
def test_no_value_in_any_place_makes_a_traceback(place, value):
    assert answer(f"map = 'S..D'\n{place} = {value}\n")


# ---- round trips and twins


class Town(NamedTuple):
    text: str
    success: dict[str, float]  # by kind, "other" for the rest
    drift: float
    blocked: set[str]  # kinds that cannot be entered


@st.composite
def towns(draw):
    """Any little map: kinds of one's own, streets, lists, chances, costs, labels."""
    width, height = draw(st.sampled_from([(2, 1), (1, 3), (3, 3), (4, 2), (5, 4)]))
    cells = draw(st.lists(st.sampled_from(".=#xwz"), min_size=width * height, max_size=width * height))
    start, goal = draw(st.permutations(range(width * height)))[:2]
    cells[start], cells[goal] = "S", "D"
    hedged, caged = draw(st.booleans()), draw(st.booleans())
    streets = [draw(st.sampled_from([cell, "+", "-", "|"])) if cell in ".=Sw" else cell for cell in cells]
    success, drift = draw(st.sampled_from([(1.0, 0.0), (0.9, 0.0), (0.7, 0.2), (0.9, 0.1), (1e-9, 0.3)]))
    on_highways = 1.0 if drift == 0 else success
    cost = draw(st.sampled_from(["2", "0", "{ other = 1, highway = 0.5 }", "{ other = 0.1, water = 3, start = 1e-9 }"]))
    lines = [
        f"success = {{ other = {success}, highway = {on_highways} }}",
        f"drift = {drift}",
        f"order = '{' '.join(draw(st.permutations(ACTIONS[:4])))}'",
        *("map = '''", *("".join(cells[i : i + width]) for i in range(0, len(cells), width)), "'''"),
        *("streets = '''", *("".join(streets[i : i + width]) for i in range(0, len(cells), width)), "'''"),
        "[kinds]",
        'w = { name = "water", enter = false, leave = true }' if hedged else 'w = "water"',
        'z = { name = "zoo", enter = false }' if caged else 'z = { name = "zoo", leave = false }',
        *("[costs]", "distance = 1", f"time = {cost}"),
        *("[labels]", f"odd = [{goal}, 'highway']"),
    ]
    if draw(st.booleans()):
        lines += ["[moves]", f"{start} = 'stay'"]
    blocked = {"building"} | ({"water"} if hedged else set()) | ({"zoo"} if caged else set())
    return Town("\n".join(lines), {"other": success, "highway": on_highways}, drift, blocked)


@given(towns())
def test_what_is_written_reads_as_the_same_problem(town):
    problem = parse_roadmap(town.text)
    again = parse_roadmap(format_roadmap(problem))
    assert _differences(problem, again) == []


STEP = {"north": (0, -1), "east": (1, 0), "south": (0, 1), "west": (-1, 0)}
LEFT = {"north": "west", "west": "south", "south": "east", "east": "north"}
RIGHT = {there: here for here, there in LEFT.items()}


@given(towns())
def test_the_arrays_are_those_of_the_plain_definition(town):
    problem = parse_roadmap(town.text)
    world, mdp = problem.world, problem.mdp

    def beside(state: int, direction: str) -> int | None:
        column, row = state % world.width + STEP[direction][0], state // world.width + STEP[direction][1]
        cell = row * world.width + column
        inside = 0 <= column < world.width and 0 <= row < world.height
        return cell if inside and world.kinds[world.kind_of_cell[cell]] not in town.blocked else None

    for state in range(mdp.states):
        success = town.success.get(world.kinds[world.kind_of_cell[state]], town.success["other"])
        actions = moves(problem)[state]
        assert len(set(actions)) == len(actions)
        for action in actions:
            if action == "stay":
                assert actions == ["stay"]
                assert branches(problem, state, action) == {state: 1}
                continue
            expected = {beside(state, action): success}
            sides = [beside(state, LEFT[action]), beside(state, RIGHT[action])]
            expected |= {side: town.drift / 2 for side in sides if side is not None and town.drift}
            if 1 - sum(expected.values()) > 1e-12:
                expected[state] = 1 - sum(expected.values())
            assert None not in expected
            assert branches(problem, state, action) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["paper-5x5", "city-1", "city-2", "city-3", "office", "pedestrians"])
def test_examples_survive_being_written(name, tmp_path):
    problem = read_example(name)
    write_roadmap(problem, tmp_path / "again.roadmap")
    assert _differences(problem, read_roadmap(tmp_path / "again.roadmap")) == []


def test_awkward_words_survive_being_written():
    text = """
title = "It's a \\"town\\" \\\\ of ours"
map = 'S.D'
[words]
state = ""
[words.cells]
1 = 'the "gate"'
[words.objectives.distance]
best = "the way that's shortest"
[words.gerunds]
north = "going up"
"""
    problem = parse_roadmap(text)
    assert problem.world.title == 'It\'s a "town" \\ of ours'
    assert _differences(problem, parse_roadmap(format_roadmap(problem))) == []


def test_problems_that_no_road_map_can_say_are_refused_with_the_reason(tmp_path):
    town = parse_roadmap(TOWN)
    with pytest.raises(SourceError, match="it has no map"):
        format_roadmap(read_example("delivery"))
    with pytest.raises(SourceError, match="one initial state, got 2"):
        format_roadmap(replace(town, mdp=replace(town.mdp, initial=np.array([0, 1]))))
    with pytest.raises(SourceError, match="cannot be written as a road map"):
        format_roadmap(replace(town, mdp=replace(town.mdp, initial=np.array([1]))))
    with pytest.raises(SourceError, match="its actions must be among"):
        format_roadmap(replace(town, mdp=replace(town.mdp, actions=("up", "east", "south", "west", "stay"))))
    with pytest.raises(SourceError, match="its kinds of ground"):
        format_roadmap(replace(town, world=replace(town.world, kinds=("a", "b", "c", "d", "e", "f", "g"))))
    with pytest.raises(SourceError, match="its states must be its cells"):
        format_roadmap(replace(town, world=replace(town.world, cell_of_state=town.world.cell_of_state[::-1].copy())))
    with pytest.raises(SourceError, match="no zones"):
        format_roadmap(replace(town, definitions={"N": "3"}))
    with pytest.raises(SourceError, match="read back, its words"):
        format_roadmap(replace(town, lexicon=replace(town.lexicon, actions={})))


@pytest.mark.parametrize("part", ["probability", "cost", "label"])
def test_a_problem_that_differs_in_one_number_is_refused(part):
    town = parse_roadmap(TOWN)
    mdp = town.mdp
    if part == "probability":
        chances = mdp.branch_to_probability.copy()
        chances[:2] = 0.75, 0.25
        other = replace(mdp, branch_to_probability=chances)
    elif part == "cost":
        costs = mdp.rewards["time"].choice.copy()
        costs[2] = 7
        other = replace(mdp, rewards={**mdp.rewards, "time": replace(mdp.rewards["time"], choice=costs)})
    else:
        labels = mdp.labels["destination"].copy()
        labels[0] = True
        other = replace(mdp, labels={**mdp.labels, "destination": labels})
    with pytest.raises(SourceError, match="read back, its (moves|costs|labels)"):
        format_roadmap(replace(town, mdp=other))


@pytest.mark.slow
def test_a_million_cells_are_read():
    drawn = np.frombuffer(b"...==#", dtype=np.uint8)[np.random.default_rng(5).integers(0, 6, (1000, 1000))]
    drawn[0, 0], drawn[-1, -1] = ord("S"), ord("D")
    rows = "\n".join(row.tobytes().decode() for row in drawn)
    text = f"success = 0.9\ndrift = 0.04\nmap = '''\n{rows}\n'''\n[costs]\ntime = {{ other = 1, highway = 0.5 }}"
    problem = parse_roadmap(text)
    assert problem.mdp.states == 1_000_000


WEIGHED = "map='SD'\n[costs]\ndistance=1\nrisk=2\n[words.objectives.'{}']\nbest='the balance'\n"


def test_a_weighted_sum_has_words_of_its_own_in_its_one_spelling():
    problem = parse_roadmap(WEIGHED.format("1*distance+10.0 * risk"))
    assert problem.lexicon.objectives == {"distance + 10 * risk": {"best": "the balance"}}
    assert parse_roadmap(format_roadmap(problem)).lexicon == problem.lexicon


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (WEIGHED.format("distance + 10 * rsik"), "must be among"),
        (WEIGHED.format("distance + -1 * risk"), "A weight must be a finite number from 0 on"),
        (WEIGHED.format("distance + risk") + "[words.objectives.'1*distance + risk']\nbest='b'", "words once"),
    ],
)
def test_words_of_a_sum_that_is_none_are_refused(text, message):
    with pytest.raises(SourceError, match=message):
        parse_roadmap(text)

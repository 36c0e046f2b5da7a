"""Files of properties, beside a model of any kind: what stands in them, constants of both, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import ratherthan as rt
from ratherthan.errors import InputError, PropertyError, SourceError
from ratherthan.io.props import files_of
from ratherthan.model.objective import ExpectedCost, ReachAvoid, Threshold

PROPS = """
// the properties of a walk
const int K;         /* given
                        by the user */
const double p = 1/4;
const bool unused;
label "far" = x >= K;

"arrive": Pmax=? [ F "far" ];
"effort":
  R{"energy"}min=? [ F
     "far" ]
"often" : P>=p [ F "far" ]; "average": LRAmax=? [ "far" ];
Pmax=? [ F x = K ]
"""
WALK = """mdp
const int N;
module walker
  x : [0..N] init 0;
  [go] x<N -> 0.5 : (x'=x+1) + 0.5 : true;
  [rest] true -> true;
endmodule
rewards "energy" [go] true : 2; endrewards
"""

Write = Callable[[str, str], str]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    monkeypatch.chdir(tmp_path)

    def _write(text: str, name: str = "walk.props") -> str:
        (tmp_path / name).write_text(text, encoding="utf-8")
        return name

    return _write


def test_every_property_comes_by_its_name_or_number(write: Write) -> None:
    name = write(PROPS, "walk.props")
    file, _ = files_of([f"{name}:arrive"])[f"{name}:arrive"]
    assert file.texts == {
        "arrive": 'Pmax=? [ F "far" ]',
        "effort": 'R{"energy"}min=? [ F "far" ]',
        "often": 'P>=p [ F "far" ]',
        "average": 'LRAmax=? [ "far" ]',
        "5": "Pmax=? [ F x = K ]",
    }
    assert file.definitions == {"p": "1/4"}
    assert {item.name: (item.kind, item.defined) for item in file.constants} == {
        "K": ("int", False),
        "p": ("double", True),
        "unused": ("bool", False),
    }


def test_a_file_with_one_property_needs_no_name(write: Write) -> None:
    write('Rmin=? [F "destination"] // the only one', "one.pctl")
    assert rt.read("example:paper-5x5", objective="one.pctl").objective == ExpectedCost(
        goal='"destination"', reward="distance"
    )
    assert rt.read("example:paper-5x5", objective=" one.pctl:1 ").objective is not None


def test_constants_and_labels_of_the_file_are_known_to_its_properties(write: Write) -> None:
    pytest.importorskip("stormpy")
    write(WALK, "walk.prism")
    write(PROPS, "walk.props")
    names = [f"walk.props:{name}" for name in ("arrive", "often", "average", "5")]
    for name in names:
        problem = rt.read("walk.prism", constants="N=3,K=2", properties=[name])
        assert problem.mdp.states == 4
        assert (name in problem.properties) != (name in problem.others)
    problem = rt.read("walk.prism", constants={"N": 3, "K": 2}, objective="walk.props:5")
    assert problem.objective == ReachAvoid(goal="x = 2")
    problem = rt.read("walk.prism", constants="N=3,K=2", properties=["walk.props:often"])
    wish = problem.properties["walk.props:often"]
    assert isinstance(wish, Threshold)
    assert wish.bound == 0.25


def test_a_constant_may_be_of_both_the_file_and_the_model(write: Write) -> None:
    pytest.importorskip("stormpy")
    write(WALK, "walk.prism")
    write("const int N;\nPmax=? [F x = N]", "both.props")
    assert rt.read("walk.prism", constants="N=3", objective="both.props").objective == ReachAvoid(goal="x = 3")


@pytest.mark.parametrize(
    ("text", "asked", "said"),
    [
        (
            PROPS,
            "walk.props",
            "has arrive, effort, often, average, 5. Give one, for example --property walk.props:arrive",
        ),
        (PROPS, "walk.props:leave", "must be one of arrive, .*; got 'leave'"),
        (PROPS, "walk.props:arrive", r"these have none: K \(int\)"),
        ("", "walk.props", "A file of properties must not be empty"),
        ("// nothing", "walk.props", "has none"),
        ("", "none.props:x", "there is no 'none.props'"),
        ('"a": P>0 [F true]; "a": P>1 [F true];', "walk.props:a", "got 'a' twice"),
        ('label "destination" = true; Pmax=? [F "destination"]', "walk.props", "has one called 'destination'"),
        ("Pmax=? [F", "walk.props", "column"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(write: Write, text: str, asked: str, said: str) -> None:
    write(text, "walk.props")
    with pytest.raises(InputError, match=said):
        rt.read("example:paper-5x5", objective=asked)


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "walk.props"
    path.write_bytes(b"Pmax=? [F \xff]")
    with pytest.raises(SourceError, match="at byte 10"):
        rt.read("example:paper-5x5", objective=str(path))


def test_what_only_a_model_checker_answers_keeps_its_reason(write: Write) -> None:
    write('LRAmax=? ["destination"]', "one.props")
    with pytest.raises(PropertyError, match="long-run average cannot be explained"):
        rt.read("example:paper-5x5", objective="one.props")
    assert rt.read("example:paper-5x5", properties=["one.props"]).others == {"one.props": 'LRAmax=? ["destination"]'}

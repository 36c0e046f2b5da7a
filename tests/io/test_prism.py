"""PRISM programs: what comes over from Storm, what is refused, and what is said then."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ratherthan.errors import InputError, MissingExtraError, ModelError, SourceError
from ratherthan.io.prism import read_prism
from ratherthan.model.formula import states_where
from ratherthan.model.objective import ExpectedCost
from ratherthan.model.property import choose_objective, parse_property

pytest.importorskip("stormpy")

WALK = """// a walk along a line
mdp
const int N;            // how far
const double slip = 1/4;
const int unused;
formula there = x = N;
global lamp : bool init true;
module walker
  x : [0..N] init 0;
  fixed : [0..5] init 3;
  [go] x<N -> 1-slip : (x'=x+1) + slip : (x'=x);
  [back] x>0 & x<N -> (x'=x-1);
  [] x=1 -> (lamp'=false);
  [go] x<N-1 -> 0.5 : (x'=x+2) + 0.5 : (x'=x);
endmodule
label "goal" = there;
label "dark" = !lamp;
rewards "energy"
  x=1 : 0.5;
  [go] true : 2;
  [] true : 7;
endrewards
"""

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def _write(text: str, name: str = "model.prism") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return _write


def test_a_program_keeps_its_names(write: Write) -> None:
    problem = read_prism(write(WALK), constants={"N": "3"})
    mdp = problem.mdp
    assert list(mdp.names.variables) == ["lamp", "x", "fixed"]
    assert mdp.names[int(mdp.initial[0])] == "lamp=true, x=0, fixed=3"
    assert set(mdp.labels) == {"goal", "dark", "deadlock"}
    assert np.array_equal(mdp.labels["goal"], mdp.names.variables["x"] == 3)
    assert np.array_equal(mdp.labels["dark"], ~mdp.names.variables["lamp"].astype(bool))
    state = mdp.names.find("lamp=true, x=1")
    names = [mdp.action_name(choice) for choice in mdp.choices_of(state)]
    assert sorted(name for name in names if not name.startswith("choice")) == ["back", "go", "go (2)"]
    assert len(names) == 4
    assert problem.source.endswith("model.prism")
    assert choose_objective(problem) == ExpectedCost(goal='"goal"', reward="energy")


def test_rewards_lie_on_states_and_choices(write: Write) -> None:
    mdp = read_prism(write(WALK), constants={"N": "3"}).mdp
    energy = mdp.rewards["energy"]
    assert energy.state is not None
    assert energy.choice is not None
    assert np.array_equal(energy.state, np.where(mdp.names.variables["x"] == 1, 0.5, 0.0))
    expected = np.array(
        [{"go": 2.0, "back": 0.0, "": 7.0}[mdp.actions[a] if a >= 0 else ""] for a in mdp.choice_to_action]
    )
    stuck = mdp.labels["deadlock"][[mdp.state_of(choice) for choice in range(mdp.choices)]]
    assert np.array_equal(energy.choice[~stuck], expected[~stuck])
    assert not energy.choice[stuck].any()


def test_properties_may_mention_constants_and_formulas(write: Write) -> None:
    problem = read_prism(write(WALK), constants={"N": "3"})
    assert problem.definitions == {"slip": "1/4", "there": "x = N", "N": "3"}
    assert parse_property("Pmax=? [!(x = N - 1) U there]", problem).text == "Pmax=? [!(x = 3 - 1) U x = 3]"
    assert np.array_equal(states_where(problem.mdp, "there", problem.definitions), problem.mdp.labels["goal"])
    assert states_where(problem.mdp, "fixed = 3").all()


def test_states_without_a_way_on_are_counted(write: Write) -> None:
    problem = read_prism(write(WALK), constants={"N": "2"})
    stuck = int(problem.mdp.labels["deadlock"].sum())
    assert stuck > 0
    assert any(note.startswith(f"{stuck} state") for note in problem.notes)


@pytest.mark.parametrize("constants", ["N=3", "N = 3 ", "N=1+2,unused=5", {"N": 3}, {"N": "min(3,4)"}, {"N": 3.0}])
def test_constants_come_as_text_or_values(write: Write, constants: object) -> None:
    problem = read_prism(write(WALK), constants=constants)  # type: ignore[arg-type]
    assert problem.mdp.names.variables["x"].max() == 3


@pytest.mark.parametrize(
    ("constants", "said"),
    [
        (None, r"these have none: N \(int\)\. Give them, for example --constants N=3\."),
        ({}, r"these have none: N \(int\)"),
        ("N=x", "'N' of '.*' must be a whole number, got 'x'"),
        ("N=1.5", "must be a whole number, got '1.5'"),
        ("N=true", "must be a whole number, got 'true'"),
        ("N=1/0", "must be a whole number"),
        ("N=", "must be given as N=5,K=2"),
        ("3", "must be given as N=5,K=2"),
        ("N=3,N=4", "'N' stands twice"),
        ("N=3,M=4", r"leaves open: N \(int\), unused \(int\); got 'M'"),
        ("N=3,slip=0.1", "'slip' is defined there"),
    ],
)
def test_constants_must_fit(write: Write, constants: object, said: str) -> None:
    with pytest.raises(SourceError, match=said):
        read_prism(write(WALK), constants=constants)  # type: ignore[arg-type]


def test_all_kinds_of_constants_are_checked(write: Write) -> None:
    path = write(
        "mdp const bool b; const double p; const k; module m x : [0..k] init 0; [] b -> p : (x'=k) + 1-p : true; endmodule"
    )
    assert read_prism(path, constants="b=true,p=1/3,k=2").mdp.branch_to_probability.tolist()[:2] == pytest.approx(
        [2 / 3, 1 / 3]
    )
    for wrong, said in (("b=1", "true or false"), ("p=true", "a number"), ("k=0.5", "a whole number")):
        name = wrong[0]
        with pytest.raises(SourceError, match=f"'{name}' of .* must be {said}"):
            read_prism(
                path,
                constants=",".join(
                    [wrong, *(f"{n}={v}" for n, v in (("b", "true"), ("p", "0.5"), ("k", "2")) if n != name)]
                ),
            )
    with pytest.raises(SourceError, match=r"b \(bool\), p \(double\), k \(int\).*--constants b=true,p=0\.5,k=3"):
        read_prism(path)


def test_a_chain_is_a_model_with_one_choice_per_state(write: Write) -> None:
    problem = read_prism(
        write("dtmc module m x : [0..2] init 0; [] x<2 -> 0.5 : (x'=x+1) + 0.5 : true; [] x=2 -> true; endmodule")
    )
    assert problem.mdp.choices == problem.mdp.states == 3
    assert any("DTMC" in note for note in problem.notes)
    assert parse_property("P=? [F x=2]", problem).maximise  # type: ignore[union-attr]


def test_several_initial_states_are_kept(write: Write) -> None:
    problem = read_prism(
        write("mdp module m x : [0..3]; [go] x<3 -> (x'=x+1); [] x=3 -> true; endmodule init x<2 endinit")
    )
    assert len(problem.mdp.initial) == 2


def test_a_reward_without_a_name_gets_one(write: Write) -> None:
    problem = read_prism(
        write("mdp module m x : bool init false; [] true -> (x'=true); endmodule rewards true : 1; endrewards")
    )
    assert list(problem.mdp.rewards) == ["reward"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "mdp module m x : [0..3] init 0; [go] x<3 -> 0.5 : (x'=x+1) + : (x'=x); endmodule",
            r"Storm can read.*line 1, column \d+",
        ),
        ("mdp module m x : [0..3] init 0; [] true -> (x'=0)&(x'=1); endmodule", "duplicate assignment to variable 'x'"),
        ("mdp module m x : [0..3] init 0; [] true -> (x'=y); endmodule", "Storm can read"),
        (
            "mdp module m x : [0..3] init 0; [go] true -> (x'=x+1); endmodule",
            r"out-of-bounds value \(4\) for the variable 'x'",
        ),
        ("ctmc module m x : [0..3] init 0; [] true -> 2 : (x'=1); endmodule", "continuous time"),
        ("pta module m x : [0..3] init 0; c : clock; [] true -> (x'=1); endmodule", "has clocks"),
        (
            "pomdp observables x endobservables module m x : bool; y : bool; [] true -> (x'=true); endmodule",
            "hides parts",
        ),
        ("smg player p m endplayer module m x : bool init false; [a] true -> (x'=true); endmodule", "several players"),
        ("hello", "Storm can read"),
    ],
)
def test_a_program_that_cannot_be_used_is_refused_in_one_clean_sentence(
    write: Write, capfd: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    with pytest.raises(SourceError, match=said) as caught:
        read_prism(write(text))
    assert "\n" not in caught.value.message
    assert "Exception" not in caught.value.message
    assert capfd.readouterr() == ("", "")


def test_a_name_like_a_kind_of_model_is_only_a_name(write: Write) -> None:
    text = 'mdp const int imdp = 1; formula tsg = x>imdp; module csg x : [0..2] init 0; [lts] x<2 -> (x\'=x+1); endmodule label "tsgs" = tsg;'
    assert read_prism(write(text)).mdp.actions == ("lts",)


def test_probabilities_that_do_not_sum_to_1_are_refused_with_their_place(write: Write) -> None:
    with pytest.raises(ModelError, match=r"sum to 1, got 1\.1 at action 'go' of state 0 \('x=0'\)") as caught:
        read_prism(write("mdp module m x : [0..3] init 0; [go] x<3 -> 0.5 : (x'=x+1) + 0.6 : (x'=x); endmodule"))
    assert str(caught.value.path).endswith("model.prism")
    assert not any("OutOfBounds" in fault for fault in caught.value.faults)


def test_formulas_mean_the_same_to_storm(write: Write) -> None:
    texts = [
        "x > 1 & b | y < 0",
        "x > 1 & (b | y < 0)",
        "b => x = 1 => y >= 0",
        "x - y - 1 = 0 | x - (y - 1) = 0",
        "x * 2 / K / 2 < 1",
        "-x + 2 = y * -1",
        "min(x, y + 1, K) = max(y, 0)",
        "floor(x / 2) = 1 & ceil(x / 2) != x",
        "(b ? x : y) >= (x > 1 ? K : y > 0 ? 1 : 0)",
        "b = (x > 1) | b != (y > 0)",
        "mod(x + 4, 3) = 1 & pow(x, 2) > x + 1",
        "!b & !(x = 1) & !!(y > -1)",
    ]
    labels = "".join(f'label "q{i}" = {text};' for i, text in enumerate(texts))
    program = """mdp const int K = 2;
        module m x : [0..3] init 0; y : [-2..2] init 0; b : bool init false;
        [] x<3 -> (x'=x+1); [] y<2 -> (y'=y+1); [] y>-2 -> (y'=y-1); [] true -> (b'=!b); endmodule """
    problem = read_prism(write(program + labels))
    assert problem.mdp.states == 4 * 5 * 2
    for i, text in enumerate(texts):
        mask = states_where(problem.mdp, text, problem.definitions)
        assert np.array_equal(mask, problem.mdp.labels[f"q{i}"]), text


def test_a_missing_or_empty_file_is_refused(tmp_path: Path, write: Write) -> None:
    for path in (tmp_path / "none.prism", tmp_path, write("", "empty.prism")):
        with pytest.raises(InputError):
            read_prism(path)


def test_without_storm_the_command_that_installs_it_is_said(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stormpy", None)
    with pytest.raises(MissingExtraError, match=r'pip install "ratherthan\[storm\]"'):
        read_prism(write(WALK), constants={"N": "3"})


def test_storms_log_level_is_left_as_it_was(write: Write) -> None:
    import stormpy

    before = stormpy.developer.get_log_level()
    read_prism(write(WALK), constants={"N": "3"})
    with pytest.raises(SourceError):
        read_prism(write("hello", "broken.prism"))
    assert stormpy.developer.get_log_level() == before


@pytest.fixture
def interrupted() -> Iterator[None]:
    """Somebody who presses Ctrl-C after two seconds."""
    timer = threading.Timer(2.0, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    yield
    timer.cancel()


posix = pytest.mark.skipif(sys.platform != "linux", reason="signals, and copies of a process")


@posix
@pytest.mark.slow
@pytest.mark.usefixtures("interrupted")
def test_storm_can_be_interrupted_while_it_builds(write: Write) -> None:
    variables = "".join(f"x{i} : [0..99] init 0;" for i in range(4))
    ways = "".join(f"[] x{i}<99 -> (x{i}'=x{i}+1);" for i in range(4))
    path = write(f"mdp module m {variables} {ways} endmodule")
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        read_prism(path)
    assert time.monotonic() - begun < 8


@posix
@pytest.mark.slow
@pytest.mark.usefixtures("interrupted")
def test_after_storm_has_worked_an_interruption_is_heard_at_once(write: Write) -> None:
    read_prism(write(WALK), constants={"N": "3"})
    begun = time.monotonic()
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(30)"]) as child:
        with pytest.raises(KeyboardInterrupt):
            os.waitpid(child.pid, 0)
        child.kill()
    assert time.monotonic() - begun < 8


def test_variables_come_in_the_order_of_their_declaration(write: Write) -> None:
    text = """mdp
    module a  p : [0..1] init 0; q : bool init false; [] true -> (p'=1) & (q'=true); endmodule
    global g : [0..1] init 0; global h : bool init true; // r : bool;
    module b = a [p=s, q=t] endmodule
    module c = a [p=u, q=v] endmodule
    """
    variables = read_prism(write(text)).mdp.names.variables
    assert list(variables) == ["g", "h", "p", "q", "s", "t", "u", "v"]

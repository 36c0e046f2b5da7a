"""Any property that Storm takes, on a model from any source: how it is told to Storm, what Storm answers, what is refused."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from random_models import OBJECTIVES, random_problem

from ratherthan.errors import MissingExtraError, PropertyError, QuestionError, SourceError
from ratherthan.io._storm_text import translated
from ratherthan.io._storm_words import outer_filter
from ratherthan.io.arrays import from_arrays
from ratherthan.io.jani import read_jani
from ratherthan.io.storm import _patience, ask_storm, storm_is_there
from ratherthan.model.mdp import Reward
from ratherthan.model.names import StateNames
from ratherthan.model.problem import Problem
from ratherthan.solve import solve

needs_storm = pytest.mark.skipif(not storm_is_there(), reason="needs Storm (the extra [storm])")


@pytest.fixture
def walk() -> Problem:
    """States 0 … 3 along a line: "go" succeeds with 0.5, "stay" stays; from 3 nothing leads away. Each "go" costs 2."""
    transitions = {
        (0, "go"): {0: 0.5, 1: 0.5},
        (0, "stay"): {0: 1.0},
        (1, "go"): {1: 0.5, 2: 0.5},
        (1, "stay"): {1: 1.0},
        (2, "go"): {2: 0.5, 3: 0.5},
        (2, "back"): {0: 1.0},
        (3, "stay"): {3: 1.0},
    }
    problem = from_arrays(
        state_to_choices=np.array([0, 2, 4, 6, 7]),
        choice_to_branches=np.array([0, 2, 3, 5, 6, 8, 9, 10]),
        branch_to_target=np.array([0, 1, 0, 1, 2, 1, 2, 3, 0, 3]),
        branch_to_probability=np.array([p for row in transitions.values() for p in row.values()]),
        choice_to_action=np.array([0, 1, 0, 1, 0, 2, 1]),
        actions=["go", "stay", "back"],
        labels={"the end": np.array([False, False, False, True]), "middle": np.array([False, True, True, False])},
        rewards={
            "fuel used": Reward(choice=np.array([2.0, 0, 2, 0, 2, 0, 0])),
            "mood": Reward(state=np.array([1.0, -1, 0, 0])),
        },
        initial=[0],
    )
    names = StateNames(count=4, variables={"x": np.arange(4), "F": np.array([True, False, False, True])})
    return replace(
        problem, mdp=replace(problem.mdp, names=names), definitions={"N": "2", "half": "1 / N", "far": "x > N"}
    )


# -- how a property is told to Storm --------------------------------------------------------------------------------------


def sets(problem: Problem, text: str) -> dict[str, list[int]]:
    return {name: np.flatnonzero(mask).tolist() for name, mask in translated(text, problem).labels.items()}


@pytest.mark.parametrize(
    ("text", "told", "labels"),
    [
        ('Pmax=? [F "the end"]', 'Pmax=? [ F "s0"', {"s0": [3]}),
        ("Pmax=? [G !far]", 'Pmax=? [ G "s0"', {"s0": [0, 1, 2]}),
        ("Pmax=? [F<=N x = N]", 'Pmax=? [ F<=2 "s0"', {"s0": [2]}),
        ("Pmax=? [F<=N+1 (x = N)]", 'Pmax=? [ F<=3 "s0"', {"s0": [2]}),
        ("Pmax=? [x < 2 U[1,N] far]", 'Pmax=? [ "s0" U[1,2] "s1"', {"s0": [0, 1], "s1": [3]}),
        ("Pmax=? [F F]", 'Pmax=? [ F "s0"', {"s0": [0, 3]}),
        ("Pmax=? [F F & x<1]", 'Pmax=? [ F "s0"', {"s0": [0]}),
        ("Pmax=? [x=0 & (X x=1)]", 'Pmax=? [ "s0" & ( X "s1" )', {"s0": [0], "s1": [1]}),
        ("Pmax=? [(G F far) & (F x=N)]", 'Pmax=? [ ( G F "s0" ) & ( F "s1" )', {"s0": [3], "s1": [2]}),
        ("Pmax=? [F far || F x=N]", 'Pmax=? [ F "s0" || F "s1"', {"s0": [3], "s1": [2]}),
        ("P>=half [G F (far | x=0)]", 'P>=0.5 [ G F "s0"', {"s0": [0, 3]}),
        ('"mine": P>half [G far];', 'P>0.5 [ G "s0"', {"s0": [3]}),
        ("LRAmax=? [x+1 > N] // often", 'LRAmax=? [ "s0"', {"s0": [2, 3]}),
        ("Pmax=? [F P>=1 [X far]]", 'Pmax=? [ F P>=1 [ X "s0" ]', {"s0": [3]}),
        ('Rmax{"mood"}=? [C<=N]', 'R{"r0"}max=? [ C<=2', {}),
        ('R{"mood"}max=? [I=N]', 'R{"r0"}max=? [ I=2', {}),
        ('R[exp]{"mood"}max<=N [C<=7]', 'R{"r0"}max<=2 [ C<=7', {}),
        ('R{"mood"}max=? [LRA]', 'R{"r0"}max=? [ LRA', {}),
        ('Pmax=? [F^{rew{"fuel used"}<=2*N} far]', 'Pmax=? [ F{"r0"}<=4 "s0"', {"s0": [3]}),
        ('Pmax=? [true U{"fuel used"}<=3 far]', 'Pmax=? [ true U{"r0"}<=3 "s0"', {"s0": [3]}),
        (
            'multi(R{"mood"}max=? [C<=4], P>=half [F far])',
            'multi ( R{"r0"}max=? [ C<=4 ] , P>=0.5 [ F "s0"',
            {"s0": [3]},
        ),
        (
            'quantile(max A, B, Pmax>half [F{"fuel used"}<=B far])',
            'quantile ( A , B , Pmax>0.5 [ F{"r0"}<=B "s0"',
            {"s0": [3]},
        ),
        ("(P>=half [F far]) | x > 2", '( P>=0.5 [ F "s0" ] ) | "s0"', {"s0": [3]}),
    ],
)
def test_state_formulas_rewards_and_numbers_are_put_in_words_storm_can_read(
    walk: Problem, text: str, told: str, labels: dict[str, list[int]]
) -> None:
    assert translated(text, walk).text.removesuffix(" )").removesuffix(" ]") == told
    assert sets(walk, text) == labels


def test_a_weighted_reward_is_one_reward(walk: Problem) -> None:
    found = translated('R{"2 * mood + fuel used"}max=? [C<=3]', walk)
    assert found.rewards["r0"].state is not None
    assert found.rewards["r0"].state.tolist() == [2, -2, 0, 0]
    assert found.rewards["r0"].choice is not None
    assert found.rewards["r0"].choice.tolist() == [2, 0, 2, 0, 2, 0, 0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('Pmax=? [F{"fuel"}<=3 far]', "'fuel used'.*got 'fuel'"),
        ("Rmax=? [C<=3]", "a property must name it"),
        ('LRAmax=? ["edge"]', "got 'edge'"),
        ("LRAmax=? [y > 3]", "got 'y'"),
        ("LRAmax=? [x]", "must be true or false"),
        ('R{"mood"}max=? [C<=K]', "K"),
        ("Pmax=? [F " + "(" * 30_000, "at most"),
        ("LRAmax>=1.5 [far]", "a number from 0 to 1 here, got 1.5"),
        ('multi(R{"mood"}min=? [F far], P<=0-1 [F x=1])', "a number from 0 to 1 here, got -1"),
        ('R{"mood"}max=? [C<=-3]', "a number from 0 on here, got -3"),
        ('Pmax=? [F{"fuel used"}<=0-3 far]', "a number from 0 on here, got -3"),
        ("Pmax=? [F[0-3,2] G far]", "a number from 0 on here, got -3"),
        ('R{"mood"}max=? [C<=99999999999999999999]', "got 1e.20"),
        ('R{"mood"}max=? [C<=log(0,2)]', "got -inf"),
    ],
)
def test_what_means_nothing_on_the_model_is_refused_before_storm_is_asked(walk: Problem, text: str, said: str) -> None:
    with pytest.raises(PropertyError, match=said):
        translated(text, walk)


def test_a_filter_is_taken_apart() -> None:
    assert outer_filter('filter(avg, P>=0.5 [F "a"], x=min(1,2))') == ("avg", 'P >= 0.5 [ F "a" ]', "x = min ( 1 , 2 )")
    assert outer_filter('filter(max, Pmax=? [F "a"])') == ("max", 'Pmax =? [ F "a" ]', "true")
    for text in ('Pmax=? [F "a"]', "filter(max)", "filter(max, P>0 [F a]) & filter(max, a)", "filter(max, a"):
        assert outer_filter(text) is None


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Storm works in this process, which takes less time than one of its own."""
    from ratherthan.io._storm_answer import answer

    def run(folder: Path, patience: float) -> int:
        answer(folder)
        return 0

    monkeypatch.setattr("ratherthan.io.storm._run", run)


# -- what Storm answers ---------------------------------------------------------------------------------------------------


@needs_storm
@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("LRAmax=? [far]", 1.0),
        ("LRAmin=? [far]", 0.0),
        ('R{"mood"}max=? [LRA]', 1.0),
        ('R{"mood"}max=? [C<=4]', 4.0),
        ('R{"mood"}min=? [C<=2]', 1.0),  # first 1; then as likely 1 as -1
        ('R{"mood"}max=? [I=0]', 1.0),
        ('R{"fuel used"}max=? [C]', float("inf")),
        ("Pmax=? [G F x=1]", 1.0),
        ("Pmin=? [F x=1]", 0.0),
        ("Pmax=? [F<=3 far]", 1 / 8),
        ('Pmax=? [F{"fuel used"}<=6 far]', 1 / 8),
        ("Pmax=? [X X x=2]", 1 / 4),
        ("Pmax=? [F x=1 || F x=1]", 1.0),
        ("multi(Pmax=? [F<=3 far], P>=0.5 [F<=1 x=1])", 1 / 8),
        ('quantile(B, Pmax>=0.5 [F{"fuel used"}<=B far])', 10.0),
        ("Tmin=? [F far]", 6.0),
        ("filter(avg, Tmin=? [F far], x<2)", 5.0),
        ("filter(min, Tmin=? [F far])", 0.0),
        ("filter(sum, Pmax=? [X far])", 1.5),
        ("filter(count, Pmax>=0.2 [F<=2 far])", 3.0),
        ("filter(state, Tmin=? [F far], x=2)", 2.0),
        ("filter(first, Tmin=? [F far], x>0)", 4.0),
    ],
)
def test_storm_gives_the_number(walk: Problem, text: str, value: float) -> None:
    answer = ask_storm(walk, text)
    assert answer.value == pytest.approx(value, abs=2e-6)
    assert answer.text == text
    assert answer.engine.startswith("Storm 2.")
    assert "nothing of it is proved here" in answer.message


@needs_storm
@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("P>=1 [G x<3]", False),
        ("Pmax>=1 [G x<3]", True),
        ("Pmin>=1 [G F far]", False),
        ("Pmax>=1 [F (x<3 & P>=0.5 [X far])]", False),
        ("Pmax>=1 [F (x<3 & Pmax>=0.5 [X far])]", True),
        ("multi(P>=0.5 [F<=1 x=1], P>=0.25 [F<=2 x=2])", True),
        ("multi(P>=0.6 [F<=1 x=1], P>=0.25 [F<=2 x=2])", False),
        ("LRAmax>0.5 [far]", True),
        ("!(LRAmax>0.5 [far])", False),
        ("x = 0 & LRAmax>0.5 [far]", True),
        ("filter(forall, Pmax>=1 [F far])", True),
        ("filter(exists, Pmax>0.4 [X far], x<2)", False),
    ],
)
def test_storm_gives_the_truth(walk: Problem, text: str, value: bool) -> None:
    assert ask_storm(walk, text).value is value


@needs_storm
@pytest.mark.usefixtures("here")
def test_where_storm_is_sure_its_bounds_are_told(walk: Problem) -> None:
    answer = ask_storm(walk, "Tmin=? [F far]")
    assert answer.lower is not None
    assert answer.upper is not None
    assert answer.lower <= 6 <= answer.upper
    assert "Its own methods put it between" in answer.message
    assert ask_storm(walk, "LRAmax=? [far]").lower is None


@needs_storm
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Pmax=? [F far", "Storm cannot answer"),
        ("P=? [G F far]", "minimal or maximal"),
        ("multi(Pmax=? [F far], P>=0.5 [X x=1])", "not supported"),
        ("multi(Pmax=? [F far], Pmin=? [F x=1])", "a curve, not for one value"),
        ('R{"mood"}max=? [C]', "must not be negative, got -1"),
        ('R{"mood"}max=? [F far]', "must not be negative, got -1"),
        ('Pmax=? [F{"mood"}<=3 far]', "must not be negative, got -1"),
        ('multi(R{"fuel used"}min=? [F far], P>=0.6 [F<=1 x=1])', "no plan keeps all of the bounds"),
        ("Pmax=? [F far || F x > 9]", "condition"),
        ("filter(print, Pmax=? [F far])", "got 'print'"),
        ("filter(max, Pmax=? [F far], x > 9)", "holds in none"),
        ("filter(avg, Pmax>=0.5 [F far])", "got a yes-or-no question"),
        ("filter(count, Pmax=? [F far])", "yes-or-no question"),
        ("filter(state, Pmax=? [F far], x>0)", "got 3"),
    ],
)
def test_what_storm_cannot_answer_is_one_sentence(
    walk: Problem, capfd: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    with pytest.raises(PropertyError, match=said) as caught:
        ask_storm(walk, text)
    assert "\n" not in caught.value.message
    assert "Exception" not in caught.value.message
    assert capfd.readouterr() == ("", "")


@needs_storm
@pytest.mark.usefixtures("here")
def test_a_model_without_decisions_is_a_chain() -> None:
    chain = from_arrays(
        state_to_choices=np.arange(4),
        choice_to_branches=np.array([0, 2, 3, 4]),
        branch_to_target=np.array([1, 2, 1, 2]),
        branch_to_probability=np.array([0.25, 0.75, 1, 1]),
        labels={"a": np.array([False, True, False]), "b": np.array([False, False, True])},
        rewards={"r": Reward(state=np.array([4.0, 0, 0]))},
        initial=[0],
    )
    for text, value in (
        ('LRA=? ["a"]', 0.25),
        ('S=? ["b"]', 0.75),
        ('P=? [F "a" || F ("a" | "b")]', 0.25),
        ('R{"r"}=? [C]', 4.0),
        ('Pmax=? [G F "a"]', 0.25),
    ):
        assert ask_storm(chain, text).value == pytest.approx(value)


@needs_storm
def test_it_must_be_clear_where_to_start(walk: Problem) -> None:
    several = replace(walk, mdp=replace(walk.mdp, initial=np.array([0, 1])))
    with pytest.raises(QuestionError, match="2 initial states"):
        ask_storm(several, "LRAmax=? [far]")
    assert ask_storm(several, "filter(min, Tmin=? [F far], x>1)").value == 0.0


@needs_storm
@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("seed", range(6))
def test_storm_and_we_agree_where_both_answer(seed: int) -> None:
    for name in ("least cost", "likeliest", "safest", "least risk"):
        problem = random_problem(Random(seed), objective=OBJECTIVES[name])
        first = int(problem.mdp.initial[0])
        problem = replace(problem, mdp=replace(problem.mdp, initial=np.array([first])))
        assert problem.objective is not None
        ours, theirs = float(solve(problem).values[0, first]), ask_storm(problem, problem.objective.text).value
        assert theirs == pytest.approx(ours, rel=2e-6, abs=1e-9), name


def test_without_storm_the_command_that_installs_it_is_said(walk: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ratherthan.io.storm.storm_is_there", lambda: False)
    with pytest.raises(MissingExtraError, match=r'pip install "ratherthan\[storm\]"'):
        ask_storm(walk, "LRAmax=? [far]")


@pytest.fixture
def interrupted() -> Iterator[float]:
    """Somebody who presses Ctrl-C after three seconds."""
    timer = threading.Timer(3.0, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    yield time.monotonic()
    timer.cancel()


@needs_storm
@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_storm_can_be_interrupted(walk: Problem, interrupted: float) -> None:
    with pytest.raises(KeyboardInterrupt):
        ask_storm(walk, 'Pmax=? [F{"fuel used"}<=1000000000 far]')
    assert time.monotonic() - interrupted < 8


@pytest.fixture
def ring() -> Problem:
    """0 → 1 or 2, 1 → 0 or 1, 2 → 0: two fifths of the time in 0 and in 1; of both signs and only losses."""
    return from_arrays(
        state_to_choices=np.array([0, 1, 2, 3]),
        choice_to_branches=np.array([0, 2, 4, 5]),
        branch_to_target=np.array([1, 2, 0, 1, 0]),
        branch_to_probability=np.array([0.5, 0.5, 0.5, 0.5, 1.0]),
        rewards={
            "gain": Reward(choice=np.array([-1.0, 2.0, -3.0])),
            "even": Reward(choice=np.array([0.0, -1.0, 0.0]), state=np.array([1.0, 0.0, 0.0])),
            "loss": Reward(branch=np.array([-1.0, -3.0, -4.0, -6.0, 0.0])),
        },
        initial=[0],
    )


@needs_storm
@pytest.mark.parametrize(("reward", "mean"), [("gain", -0.2), ("even", 0.0), ("loss", -2.8)])
def test_the_mean_of_a_reward_that_may_be_negative_comes_out(ring: Problem, reward: str, mean: float) -> None:
    for text in (f'R{{"{reward}"}}=? [LRA]', f'R{{"{reward}"}}=? [S]', f'filter(max, R{{"{reward}"}}=? [LRA])'):
        answer = ask_storm(ring, text)
        assert answer.value == pytest.approx(mean, abs=1e-5)
        assert answer.lower is None or answer.lower <= mean <= answer.upper


@needs_storm
def test_what_storm_refines_for_ever_is_given_up_with_a_sentence(
    ring: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ratherthan.io.storm._PATIENCE_FOR_MEANS", 1.5)
    began = time.monotonic()
    with pytest.raises(SourceError, match="after 1.5 seconds it has none: the mean in the long run"):
        ask_storm(ring, 'R{"gain"}>=0 [LRA]')
    assert time.monotonic() - began < 8


@pytest.mark.parametrize(("text", "patient"), [("LRA", False), ("S", False), ("C<=4", True), ("I=0", True)])
def test_patience_is_short_where_the_mean_of_what_may_be_negative_is_asked_for(
    walk: Problem, text: str, patient: bool
) -> None:
    assert (_patience(translated(f'R{{"mood"}}max=? [{text}]', walk)) > 60) == patient
    assert _patience(translated(f'R{{"fuel used"}}max=? [{text}]', walk)) > 60


# -- what others published ------------------------------------------------------------------------------------------------

OTHERS = [
    ("eajs/eajs.2", "energy_capacity=100,B=5", "ProbUtil"),
    ("resource-gathering/resource-gathering", "B=1000000,GOLD_TO_COLLECT=0,GEM_TO_COLLECT=0", "expgold"),
]
SLOW = [
    ("resource-gathering/resource-gathering", "B=200,GOLD_TO_COLLECT=15,GEM_TO_COLLECT=15", "expgold"),
    ("resource-gathering/resource-gathering", "B=400,GOLD_TO_COLLECT=30,GEM_TO_COLLECT=30", "expgold"),
]


@needs_storm
@pytest.mark.parametrize(
    ("name", "constants", "title"), [*OTHERS, *(pytest.param(*row, marks=pytest.mark.slow) for row in SLOW)]
)
def test_published_values_beyond_our_own_objectives_come_out(
    shared_data: Path, name: str, constants: str, title: str
) -> None:
    models: list[dict[str, Any]] = json.loads((shared_data / "expected.json").read_text(encoding="utf-8"))["models"]
    known = next(m for m in models if m["file"].endswith(f"/{name}.jani") and m.get("constants") == constants)
    problem = read_jani(shared_data / "models" / "qvbs" / f"{name}.jani", constants=constants)
    answer = ask_storm(problem, problem.others[title])
    assert answer.value == pytest.approx(known["published_reference"][title], rel=2e-6)

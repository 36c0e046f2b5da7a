"""Fixtures of the command line's tests: a person who types, and small models lying about."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import ratherthan as rt


@pytest.fixture
def ask(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """``ask("explain", "example:paper-5x5")`` runs one command in an empty folder."""
    from ratherthan.apps.cli import main

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")

    def run(*words: object) -> Result:
        return CliRunner().invoke(main, list(map(str, words)))

    return run


@pytest.fixture
def said(ask: Callable[..., Result]) -> Callable[..., str]:
    """The standard output of a command that answers, and says nothing else."""

    def run(*words: object) -> str:
        result = ask(*words)
        assert (result.exit_code, result.stderr) == (0, ""), result.output
        return result.stdout

    return run


@pytest.fixture
def document(said: Callable[..., str]) -> Callable[..., Any]:
    """The JSON of a command that answers."""

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no number of JSON")

    return lambda *words: json.loads(said(*words, "--format", "json"), parse_constant=refuse)


@pytest.fixture
def refused(ask: Callable[..., Result]) -> Callable[..., str]:
    """The sentence with which a command refuses bad input: one line, exit code 2, nothing on standard output."""

    def run(*words: object) -> str:
        result = ask(*words)
        assert result.exit_code == 2, result.output
        assert result.stdout == ""
        assert result.stderr.startswith("ratherthan: ")
        assert result.stderr.count("\n") == 1
        assert result.stderr.endswith("\n")
        assert "Traceback" not in result.stderr
        return result.stderr.removeprefix("ratherthan: ").strip()

    return run


@pytest.fixture(scope="session")
def process() -> Callable[..., subprocess.CompletedProcess[bytes]]:
    """Run the command as a process of its own; `env` adds to the surroundings."""

    def run(*words: object, env: dict[str, str] | None = None, **settings: Any) -> subprocess.CompletedProcess[bytes]:
        surroundings = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "RATHERTHAN_DEBUG")}
        command = [sys.executable, "-W", "error", "-m", "ratherthan", *map(str, words)]
        settings = {"capture_output": True, "stdin": subprocess.DEVNULL, "timeout": 60} | settings
        return subprocess.run(command, env=surroundings | (env or {}), check=False, **settings)

    return run


def model(**changes: Any) -> rt.MDP:
    """A fork: from 0 left or right to the goal 2, right through 1; 3 is a trap."""
    parts: dict[str, Any] = {
        "state_to_choices": np.array([0, 2, 4, 5, 6]),
        "choice_to_branches": np.array([0, 2, 4, 5, 7, 8, 9]),
        "branch_to_target": np.array([2, 0, 1, 3, 2, 0, 3, 2, 3]),
        "branch_to_probability": np.array([0.5, 0.5, 0.9, 0.1, 1.0, 0.5, 0.5, 1.0, 1.0]),
        "choice_to_action": np.array([0, 1, 0, 1, 2, 2]),
        "actions": ("left", "right", "rest"),
        "labels": {"goal": np.array([False, False, True, False]), "trap": np.array([False, False, False, True])},
        "rewards": {"toll": rt.Reward(choice=np.array([3.0, 1.0, 1.0, 0.5, 0.0, 0.0]))},
        "initial": np.array([0]),
        "names": rt.StateNames(count=4, strings=["home", "bridge", "market", "ditch"]),
    }
    return rt.MDP(**{**parts, **changes})


@pytest.fixture
def fork_with() -> Callable[..., rt.MDP]:
    """Make the fork's MDP with other parts."""
    return model


@pytest.fixture
def fork(tmp_path: Path) -> str:
    """A model file with names, one reward and the labels goal and trap."""
    path = tmp_path / "fork.umb"
    rt.write(rt.Problem(mdp=model()), path)
    return str(path)


@pytest.fixture
def two_starts(tmp_path: Path) -> str:
    """The same with two initial states."""
    path = tmp_path / "two-starts.npz"
    rt.write(rt.Problem(mdp=model(initial=np.array([0, 1]))), path)
    return str(path)


@pytest.fixture
def unlabelled(tmp_path: Path) -> str:
    """The same with two rewards: what is wanted of it is not plain."""
    path = tmp_path / "two-rewards.umb"
    rewards = {"toll": rt.Reward(choice=np.ones(6)), "time": rt.Reward(state=np.ones(4))}
    rt.write(rt.Problem(mdp=model(rewards=rewards)), path)
    return str(path)

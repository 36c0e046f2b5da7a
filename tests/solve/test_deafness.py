"""No method is deaf for long: an alarm rings all the time, and limits are looked at, while each has its turn."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import ratherthan as rt
from benchmarks.models import gambles, loops, ring, slippery_map, trap_map, walk
from ratherthan.model import watch
from ratherthan.model.mdp import Reward
from ratherthan.model.policy import Policy
from ratherthan.model.problem import Problem
from ratherthan.solve import PolicyIteration, Sweeps

pytestmark = [
    pytest.mark.kernels,
    pytest.mark.slow,
    pytest.mark.skipif(os.name != "posix", reason="needs an alarm clock of Unix"),
    pytest.mark.skipif(
        os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="for models that are too large for that"
    ),
]
OFTEN = 0.05
"""Seconds between two alarms."""
DEAF = 1.0
"""Seconds after which an interrupt must be heard."""
LATE = 0.5
"""Seconds that a limit of time may be passed by."""


def with_free_moves(problem: Problem) -> Problem:
    """Return a problem in which every fifth choice costs nothing."""
    cost = np.where(np.random.default_rng(7).random(problem.mdp.choices) < 0.2, 0.0, 1.0)
    return replace(problem, mdp=replace(problem.mdp, rewards={"steps": Reward(choice=cost)}))


MODELS: dict[str, tuple[Callable[[], Problem], object]] = {
    "windowed sweeps": (partial(slippery_map, 300), None),
    "policy iteration by components": (lambda: with_free_moves(slippery_map(120)), None),
    "policy iteration past traps": (partial(trap_map, 120), None),
    "discounted sweeps": (partial(gambles, 20_000), None),
    "discounted sweeps ": (partial(gambles, 10_000, discount=0.999), None),
    "sweeps": (partial(ring, 20_000), None),
    "policy iteration": (partial(walk, 30, 5), PolicyIteration()),
    "policy iteration ": (partial(loops, 20_000), PolicyIteration()),
    "value iteration": (partial(slippery_map, 150), Sweeps(most=300)),
}


class Clock:
    """A clock of what the processor did for this process, which notes how long nobody looked at it."""

    def __init__(self) -> None:
        self.last, self.longest = time.process_time(), 0.0

    def monotonic(self) -> float:
        now = time.process_time()
        self.longest, self.last = max(self.longest, now - self.last), now
        return now


@contextmanager
def alarmed() -> Iterator[list[float]]:
    """Let an alarm ring all the time; the numbers are how long it was not heard."""
    heard, last = [0.0], [time.process_time()]

    def ring(*_: object) -> None:
        now = time.process_time()
        heard.append(now - last[0])
        last[0] = now

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, OFTEN, OFTEN)
    try:
        yield heard
        ring()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@pytest.mark.parametrize("method", MODELS)
def test_every_method_hears_an_interrupt_and_looks_at_the_limits(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, how = MODELS[method]
    problem = make()
    solution = rt.solve(problem, method=how)  # what has to be compiled is
    assert method.strip() in solution.engine
    clock = Clock()
    with monkeypatch.context() as patched:
        patched.setattr(watch, "time", clock)
        with alarmed() as heard, rt.watching(rt.Limits(seconds=1e6)):
            clock.last = time.process_time()
            rt.solve(problem, method=how)
    assert len(heard) > 2
    assert max(heard) < DEAF
    assert clock.longest < LATE


@pytest.mark.parametrize("method", MODELS)
@pytest.mark.parametrize("share", [0.3, 0.7])
def test_a_limit_of_time_is_not_passed_by_much(method: str, share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    make, how = MODELS[method]
    problem = make()
    rt.solve(problem, method=how)
    begun = time.process_time()
    rt.solve(problem, method=how)
    limit = share * (time.process_time() - begun)
    monkeypatch.setattr(watch, "time", Clock())
    begun = time.process_time()
    with suppress(rt.LimitError), rt.watching(rt.Limits(seconds=limit)):
        rt.solve(problem, method=how)
    assert time.process_time() - begun < limit + LATE


@pytest.mark.parametrize("free", [False, True])
def test_a_given_policy_is_judged_with_open_ears(free: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = slippery_map(150)
    if free:
        problem = with_free_moves(problem)
    mdp = problem.mdp
    best = rt.solve(problem).policy.choice
    shares = np.full(mdp.choices, 0.05)
    shares[best[best >= 0]] += 0.8
    policy = Policy(choice=best, chance=shares)
    rt.evaluate(problem, policy)
    clock = Clock()
    monkeypatch.setattr(watch, "time", clock)
    with alarmed() as heard, rt.watching(rt.Limits(seconds=1e6)):
        clock.last = time.process_time()
        rt.evaluate(problem, policy)
    assert max(heard) < DEAF
    assert clock.longest < LATE

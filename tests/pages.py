"""Explanations to make pages of: of every kind and end, with names that are hard to show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from pictures import on_cells, solved

import ratherthan as rt
from ratherthan.explain.explanation import Explanation

HOSTILE = '</script><script>document.title="x"</script> <b>&amp;"\' ]]> --> url(#a) id="b" \x07\u202e地図 ' + "n" * 300


def named(name: str) -> Explanation:
    """Return an explanation in which every name is the same hard one."""
    mdp = rt.MDP(
        state_to_choices=np.array([0, 2, 3, 4]),
        choice_to_branches=np.array([0, 1, 2, 3, 4]),
        branch_to_target=np.array([1, 2, 2, 2]),
        branch_to_probability=np.ones(4),
        choice_to_action=np.array([0, 1, 0, 0]),
        actions=(f"{name} one", f"{name} two"),
        labels={"goal": np.array([False, False, True])},
        rewards={name: rt.Reward(choice=np.array([1.0, 3.0, 1.0, 0.0]))},
        initial=np.array([0]),
        names=rt.StateNames(count=3, strings=[f"{name} {k}" for k in range(3)]),
    )
    return rt.explain(rt.solve(rt.Problem(mdp=mdp, source=name)))


def circling() -> Explanation:
    """Return the explanation of a policy that goes round and never arrives."""
    problem = rt.read("example:office")
    mdp = problem.mdp
    policy = rt.Policy(choice=mdp.state_to_choices[:-1].copy())
    return rt.explain(rt.evaluate(problem, policy))


def at_the_goal() -> Explanation:
    return rt.explain(rt.solve(rt.read("example:paper-5x5", start=4)))


def on_a_large_map() -> Explanation:
    rows = ["." * 60 for _ in range(40)]
    rows[20] = "@" * 55 + "." * 5
    return rt.explain(on_cells(rows, title="the hall", metres=True), at_most=5)


def safest() -> Explanation:
    problem = rt.read("example:delivery", objective="safest")
    return rt.explain(rt.solve(problem), also=[rt.parse_property('R{"time"}min=? [F "delivered"]', problem)])


KINDS = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
EXPLAINED: dict[str, Callable[[], Explanation]] = {
    **{kind: lambda kind=kind: rt.explain(solved("paper-5x5"), kind=kind) for kind in KINDS},
    "rather than": lambda: rt.explain(solved("paper-5x5"), state=10, rather_than="south"),
    "a graph": lambda: rt.explain(solved("delivery")),
    "two objectives": safest,
    "no route": lambda: rt.explain(on_cells([".@.", "@@.", "..."], title="closed")),
    "already there": at_the_goal,
    "for ever": circling,
    "a large map": on_a_large_map,
    "hostile names": lambda: named(HOSTILE),
    "a hostile map": lambda: rt.explain(on_cells(["...", ".@.", "..."], title=HOSTILE)),
    "other words": lambda: replace(
        rt.explain(solved("paper-5x5")), lexicon=rt.Lexicon(state="</p>{number}", actions={"east": "<i>drive</i>"})
    ),
}

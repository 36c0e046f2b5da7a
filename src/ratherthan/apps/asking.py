"""Decorators for what can be asked of a plan, shared by the commands that explain, draw and report it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from ratherthan.apps.options import option

__all__ = ["KIND_NAMES", "question_options"]

F = TypeVar("F", bound=Callable[..., Any])
RANKINGS = ("detour", "spread", "expected", "place")
KIND_NAMES = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")


def question_options(command: F) -> F:
    """Decorate a command with which explanation is wanted: kind, scope, factors, state, rather-than, also, detail, at-most, rank."""
    for add in reversed(_QUESTION):
        command = add(command)
    return command


_QUESTION: tuple[Callable[[F], F], ...] = (
    option(
        "--kind",
        section="Question",
        type=click.Choice(KIND_NAMES),
        metavar="KIND",
        help=f"Which explanation: {', '.join(KIND_NAMES)}.  [default: contrastive]",
    ),
    option(
        "--scope",
        section="Question",
        type=click.Choice(("state", "route")),
        help="In place of a kind: one step, or all of them.",
    ),
    option(
        "--factors",
        section="Question",
        metavar="A,B",
        help="In place of a kind: of selectiveness, responsibility and constrictiveness, those that are told.",
    ),
    option(
        "--state",
        section="Question",
        metavar="STATE",
        help="Where: a number from 0, or an exact name.  [default: the initial state]",
    ),
    option("--rather-than", section="Question", metavar="ACTION", help="Why not this action, at the one state?"),
    option(
        "--also",
        section="Question",
        metavar="TEXT",
        multiple=True,
        show_default=False,
        help="Judge the plan and its alternatives by this, too: a property, its name in the source, or a reward that counts until the goal; can be repeated.",
    ),
    option(
        "--detail",
        section="Question",
        is_flag=True,
        help="Say also what the other actions would lead to, and what they would cost.",
    ),
    option(
        "--at-most",
        section="Question",
        type=click.IntRange(min=1),
        metavar="N",
        help="Tell the route in N sentences or fewer: steps alike in a row become one, and of the rest those come first that matter most. "
        "What is said of the whole route at the end is not counted.  [default: a sentence for every step that is told]",
    ),
    option(
        "--rank",
        "ranking",
        section="Question",
        type=click.Choice(RANKINGS),
        help="What matters most where there are more than --at-most: the longest detour there would be without turning back (detour), "
        "the largest difference between two actions (spread), that times the chance to come there at all (expected), or what comes "
        "first on the route (place).  [default: detour]",
    ),
)

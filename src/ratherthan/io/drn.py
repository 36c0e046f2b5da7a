"""A model in Storm's explicit text format (``.drn``) enters, a Problem leaves, and back.

A DRN file is a head of lines that begin with ``@`` and, after ``@model``, a list of states, each with its choices, each
with its branches::

    @type: MDP
    @parameters

    @reward_models
    time
    @nr_states
    2
    @nr_choices
    3
    @model
    state 0 [0] init
        action wait [1]
            0 : 1
        action go [1]
            0 : 1/10
            1 : 0.9
    state 1 [0] goal "is here"
        action __NOLABEL__ [0]
            1 : 1

Numbers in brackets are rewards, in the order of their names; what follows them are labels, and ``init`` marks the initial
states. Numbers are decimal or fractions, or placeholders that the head explains. Lines that begin with ``//`` are comments;
what Storm says there of a state's variables is read as its name.

Read are MDPs, and DTMCs as MDPs with one choice per state. Refused, with the reason: continuous time, partial observation,
games, intervals, parameters.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from ratherthan.errors import RatherthanError, SourceError
from ratherthan.io._drn_body import Body
from ratherthan.io._drn_head import read_head
from ratherthan.io._drn_model import problem_of
from ratherthan.io._drn_text import open_text
from ratherthan.io._drn_writer import lines_of
from ratherthan.io._files import Limits, write_atomically
from ratherthan.model.problem import Problem

__all__ = ["read_drn", "write_drn"]

AT_ONCE = 8 << 20
"""How much text is looked at in one go; it bounds the memory that short strings take."""


def read_drn(
    path: str | os.PathLike[str],
    *,
    constants: str | Mapping[str, Any] | None = None,
    limits: Limits | None = None,
) -> Problem:
    """Read a model from a file in Storm's explicit text format.

    Parameters
    ----------
    path : path
        Plain, or packed by gzip or xz, in a tar archive or not.
    constants : str or mapping, optional
        Must be left out: such a file has no constants.
    limits : Limits, optional
        What a packed file may unpack to.

    Returns
    -------
    Problem
        What was repaired on the way is in its `notes`.

    Raises
    ------
    SourceError
        Where the file is missing, damaged, of another kind, or breaks the format; with the number of the line.
    ModelError
        Where the model in it breaks a law; with the number of the line.
    """
    shown = os.fspath(path)
    if constants:
        raise SourceError(
            f"A DRN file has no constants to set, but '{shown}' was given some. Leave them out.", path=shown
        )
    try:
        with open_text(path, limits or Limits()) as text:
            head, rest, line = read_head(text, shown)
            body = Body(head, line, shown)
            while block := text.read(AT_ONCE):
                block = rest + block
                cut = block.rfind(b"\n") + 1
                rest = block[cut:]
                body.take(block[:cut])
            body.take(rest)
        return problem_of(head, body, shown)
    except RatherthanError as error:
        error.place.setdefault("path", shown)
        raise


def write_drn(problem: Problem, path: str | os.PathLike[str]) -> None:
    """Write a model in Storm's explicit text format, whole or not at all; the same Problem gives the same bytes.

    Reading the file gives the same arrays, labels, rewards, actions, initial states and state variables (booleans, whole
    numbers and finite numbers). Names that the format cannot hold as they are (with blanks, or twice the same), the order of
    names, and labels of no state lie in a comment at the top, which Storm passes over. The format has no place for names of
    states that are text, for map, objective, properties, words and notes; parts of a reward that are 0 everywhere are left
    out, and a reward on branches is written as what a choice may expect of it.

    Parameters
    ----------
    problem : Problem
    path : path
        Replaced only once the new file is whole.

    Raises
    ------
    SourceError
        Where the file cannot be written.
    """
    with write_atomically(path) as file:
        for part in lines_of(problem.mdp):
            file.write(part)

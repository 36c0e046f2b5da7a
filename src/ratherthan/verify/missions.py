"""The text of a mission and a model enter; the least memory that tells how it stands leaves, as a table of moves.

A mission is read as a formula over the letters of a model: which of its state formulas hold together in some state. From the
formulas that can be left of it (`formulas`), over all letters, the memories are made:

* *done*: true, and (again and again) what every letter turns into what is done;
* *failed*: what no letters turn into something done;
* the others are split apart, first by the least number of letters to either end, then until every letter leads all members of
  a class to the same class (Moore 1956).

The mission is about words: two histories after which the same is left share a memory, whatever the formulas look like.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ratherthan.model.formula import states_of
from ratherthan.model.mdp import MDP, Bools
from ratherthan.verify.formulas import TRUE, Formula, Letter, Tree, left_after, read_mission
from ratherthan.verify.frame import Array, slices

__all__ = ["Memory", "TooLargeError", "memory_of"]

MOST_MOVES = 500_000
"""The most pairs of a formula and a letter."""


class TooLargeError(Exception):
    """There is more to be remembered than a re-checker should go through."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Memory:
    """What must be remembered: M memories, L letters.

    Parameters
    ----------
    letter : array of int, ``[S]``
        The letter of each state.
    after : array of int, ``[M, L]``
        The memory after a memory and a letter.
    start : int
        The memory before the first letter.
    done, failed : array of bool, ``[M]``
    left : array of int, ``[M]``
        After how many letters at the soonest it may have failed, -1 for never.
    """

    letter: Array  # [S]
    after: Array  # [M, L]
    start: int
    done: Bools  # [M]
    failed: Bools  # [M]
    left: Array  # [M]


def _moves(start: Formula, letters: list[Letter]) -> tuple[list[Formula], Array]:
    """Return all formulas that can be left, the start first, and which one each leaves after each letter, ``[N, L]``."""
    number, formulas, moves = {start: 0}, [start], []
    known: list[dict[Formula, Formula]] = [{} for _ in letters]
    for f in formulas:  # it grows
        row = []
        for letter, cache_of_letter in zip(letters, known, strict=True):
            left = left_after(f, letter, cache_of_letter)
            if left not in number:
                number[left] = len(formulas)
                formulas.append(left)
            row.append(number[left])
        moves.append(row)
        if len(formulas) * len(letters) > MOST_MOVES:
            raise TooLargeError
    return formulas, np.array(moves, dtype=np.int64).reshape(len(formulas), len(letters))


def _closed(moves: Array, inside: Bools) -> Bools:
    """Return a set with all that every letter leads into it, again and again."""
    while True:
        hits = inside[moves].all(axis=1)
        if not (hits & ~inside).any():
            return inside
        inside = inside | hits


def _distances(moves: Array, to: Bools) -> Array:
    """Return the least number of letters that lead to a set, -1 where none do, ``[N]``."""
    order = np.argsort(moves, axis=None, kind="stable")
    origin = order // moves.shape[1]
    first = np.searchsorted(moves.reshape(-1)[order], np.arange(len(moves) + 1))
    distance = np.where(to, 0, -1)
    layer, steps = np.flatnonzero(to), 0
    while len(layer):
        steps += 1
        near = np.unique(origin[slices(first[layer], first[layer + 1])])
        layer = near[distance[near] < 0]
        distance[layer] = steps
    return distance


def _split(moves: Array, traits: Array) -> Array:
    """Return the coarsest partition, finer than some traits, in which every letter leads from a class to a class, ``[N]``."""
    part = np.unique(traits, axis=0, return_inverse=True)[1].reshape(-1)
    while True:
        finer = np.unique(np.column_stack([part, part[moves]]), axis=0, return_inverse=True)[1].reshape(-1)
        if finer.max() == part.max():
            return np.asarray(finer, dtype=np.int64)
        part = finer


def memory_of(formula: str, mdp: MDP) -> Memory:
    """Return the least memory that a mission needs on a model.

    Raises
    ------
    TooLargeError
        If there are too many pairs of a formula that is left and a letter.
    ExplanationError, PropertyError
        If it does not fit the model.
    """
    tree = Tree()
    start = tree.of(read_mission(formula))
    holds = np.array([states_of(mdp, atom) for atom in tree.atoms], dtype=np.bool_).reshape(len(tree.atoms), mdp.states)
    table, letter = np.unique(holds.T, axis=0, return_inverse=True)
    letters: list[Letter] = [tuple(map(bool, row)) for row in table]
    formulas, moves = _moves(start, letters)
    done = _closed(moves, np.array([f == TRUE for f in formulas]))
    to_done = _distances(moves, done)
    failed = to_done < 0
    to_failed = _distances(moves, failed)
    part = _split(moves, np.column_stack([to_done, to_failed]))
    _, first, part = np.unique(part, return_index=True, return_inverse=True)
    part = part.reshape(-1)
    return Memory(
        letter=letter.reshape(-1).astype(np.int64),
        after=part[moves[first]].astype(np.int64),
        start=int(part[0]),
        done=done[first],
        failed=failed[first],
        left=to_failed[first],
    )

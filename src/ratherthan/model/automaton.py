"""A co-safe path formula and a model enter; the memory that the formula needs on this model leaves, as an automaton.

The *letters* are the sets of state formulas that hold together in some state of the model. A co-safe formula f over them is a
set of infinite words. After a finite word w, what is left of f is the set of the words v such that wv satisfies f. Two finite
words need not be told apart if they leave the same; the *memories* are these classes (Myhill and Nerode). Two of them
are ends: *satisfied*, where every word is left, and *violated*, where none is.

They are found by progression (see progression.py): from f, the formulas that are left after one letter, and so on. This gives
finitely many formulas; then

* satisfied is the greatest class: true, and each formula from which every letter leads there;
* violated is each formula from which true cannot be reached;
* the others are told apart by refining a partition until every letter leads from a class to a class [1]_. It begins with
  how many letters lead at least to satisfied, and to violated: so a step bound of k takes one round, not k.

So the memories do not depend on how f is written, and there are as few as possible on these letters.

References
----------
.. [1] Moore, E. F. (1956). Gedanken-experiments on sequential machines. Automata Studies, 129-153.
.. [2] Kupferman, O. and Vardi, M. Y. (2001). Model checking of safety properties. Formal Methods in System Design 19,
   291-314.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ratherthan.errors import NotExplainableError
from ratherthan.model.formula import states_of
from ratherthan.model.mdp import MDP, Bools
from ratherthan.model.progression import FALSE, TRUE, Formulas, TooManyFormsError
from ratherthan.model.syntax import Term, text_of

__all__ = ["Automaton", "automaton_of"]

MOST_MOVES = 200_000
"""The most pairs of a formula that is left and a letter."""

_Numbers = npt.NDArray[np.int64]
_FAR = np.iinfo(np.int64).max
_LONGEST = 120


@dataclass(frozen=True, kw_only=True, eq=False)
class Automaton:
    """The memory that a mission needs on a model: M memories, L letters.

    Parameters
    ----------
    formulas : Formulas
    mission : int
        The formula itself, a number of `formulas`.
    left : array of int, ``[M]``
        One of the formulas that are left with each memory; true and false for the ends.
    letters : list of tuple of bool
        The truth of each state formula of `formulas` in each letter.
    after : array of int, ``[M, L]``
        The memory after a memory and a letter.
    start : int
        The memory before the first letter.
    satisfied, violated : array of bool, ``[M]``
        The ends; one of each at most.
    letter_of_state : array of int, ``[S]``
        The letter of each state of the model.
    """

    formulas: Formulas
    mission: int
    left: _Numbers  # [M]
    letters: list[tuple[bool, ...]]  # [L]
    after: _Numbers  # [M, L]
    start: int
    satisfied: Bools  # [M]
    violated: Bools  # [M]
    letter_of_state: _Numbers  # [S]


def automaton_of(path: Term, mdp: MDP) -> Automaton:
    """Return the memory that a mission needs on a model.

    Parameters
    ----------
    path : Term
        A co-safe path formula in positive normal form.
    mdp : MDP

    Returns
    -------
    Automaton

    Raises
    ------
    NotExplainableError
        If there is too much to be remembered.
    PropertyError
        If a state formula does not fit the model.
    """
    formulas = Formulas()
    try:
        mission = formulas.add(path)
        letter_of_state, letters = _letters(formulas, mdp)
        found, moves = _progressions(formulas, mission, letters)
    except TooManyFormsError:
        text = text_of(path)
        shown = text if len(text) <= _LONGEST else text[:_LONGEST] + " …"
        raise NotExplainableError(
            f"What can be left of a mission must take few enough forms to be remembered (with the sets of its state formulas "
            f"that hold in some state at most {MOST_MOVES} pairs), but '{shown}' takes more. "
            "Give smaller bounds on steps, or fewer parts."
        ) from None
    satisfied = _spread(moves, found == TRUE, every=True) < _FAR
    to_satisfied = _spread(moves, satisfied, every=False)
    violated = to_satisfied == _FAR
    ends = np.stack([satisfied, violated])
    moves[ends.any(axis=0)] = np.flatnonzero(ends.any(axis=0))[:, None]
    keys = np.column_stack(
        [to_satisfied, _spread(moves, violated, every=False), ends.argmax(axis=0) + ends.any(axis=0)]
    )
    classes = _refined(moves, keys)
    first = np.unique(classes, return_index=True)[1]
    return Automaton(
        formulas=formulas,
        mission=mission,
        left=np.select([satisfied[first], violated[first]], [TRUE, FALSE], default=found[first]),
        letters=letters,
        after=classes[moves[first]],
        start=int(classes[0]),
        satisfied=satisfied[first],
        violated=violated[first],
        letter_of_state=letter_of_state,
    )


def _letters(formulas: Formulas, mdp: MDP) -> tuple[_Numbers, list[tuple[bool, ...]]]:
    """Return the letter of each state, and the truth values of each letter."""
    letter = np.zeros(mdp.states, dtype=np.int64)
    first = np.zeros(1, dtype=np.int64)
    truths = [states_of(mdp, atom) for atom in formulas.atoms]
    for truth in truths:
        _, first, letter = np.unique(2 * letter + truth, return_index=True, return_inverse=True)
    return letter, [tuple(bool(truth[state]) for truth in truths) for state in first]


def _progressions(formulas: Formulas, mission: int, letters: list[tuple[bool, ...]]) -> tuple[_Numbers, _Numbers]:
    """Return all formulas that can be left, the mission first, and where each letter leads from each."""
    place = {mission: 0}
    waiting, moves = [mission], []
    for formula in waiting:
        row = [formulas.progressed(formula, letter, truth) for letter, truth in enumerate(letters)]
        for after in row:
            if after not in place:
                place[after] = len(waiting)
                waiting.append(after)
        moves.append([place[after] for after in row])
        if len(waiting) * len(letters) > MOST_MOVES:
            raise TooManyFormsError
    return np.array(waiting), np.array(moves).reshape(len(waiting), len(letters))


def _spread(moves: _Numbers, target: Bools, *, every: bool) -> _Numbers:
    """Return in how many letters `target` can be reached, or with `every` in how many it is at most; _FAR where not at all.

    Breadth-first search backwards: linear in the moves, though a bound of k steps makes a chain of k formulas.
    """
    count, letters = moves.shape
    order = np.argsort(moves, axis=None, kind="stable")
    before = (order // letters).tolist()
    first = np.concatenate([[0], np.cumsum(np.bincount(moves.reshape(-1), minlength=count))]).tolist()
    distance: list[int] = np.where(target, 0, _FAR).tolist()
    missing = [letters if every else 1] * count
    waiting = deque(np.flatnonzero(target).tolist())
    while waiting:
        reached = waiting.popleft()
        for formula in before[first[reached] : first[reached + 1]]:
            missing[formula] -= 1
            if missing[formula] <= 0 and distance[formula] == _FAR:
                distance[formula] = distance[reached] + 1
                waiting.append(formula)
    return np.array(distance)


def _refined(moves: _Numbers, keys: _Numbers) -> _Numbers:
    """Return the coarsest partition that is finer than `keys`, and in which each letter leads from class to class."""
    classes = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    count = 0
    while classes.max() + 1 > count:
        count = int(classes.max()) + 1
        rows = np.column_stack([classes, classes[moves]])
        classes = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
    return classes

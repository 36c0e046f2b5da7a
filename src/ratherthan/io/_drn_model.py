"""The head and the body of a DRN file enter; a Problem leaves, with a note on every repair."""

from __future__ import annotations

import re

import numpy as np

from ratherthan.errors import ModelError
from ratherthan.io._drn_body import Body, Numbers, joined, plain
from ratherthan.io._drn_head import Head
from ratherthan.io._drn_names import names_of
from ratherthan.io._drn_numbers import stacked
from ratherthan.io._rows import Rows, with_loops
from ratherthan.model.mdp import MDP, Bools, Floats, Reward
from ratherthan.model.problem import Problem

__all__ = ["INITIAL", "UNNAMED", "problem_of"]

INITIAL = "init"
UNNAMED = "__NOLABEL__"
NAMELESS_REWARD = "reward"
EXACT = 1e-8
"""How far any sum of probabilities may be from 1; `MDP` itself then rescales it."""
DIGITS = 5e-7, 5e-6
"""Six digits a number, as Storm may write them, miss by so much at most: per branch, and all branches of a choice."""

LABEL = re.compile(r'"([^"]*)"|([^\s"]+)')


def problem_of(head: Head, body: Body, shown: str) -> Problem:
    """Put a model together.

    Parameters
    ----------
    head : Head
    body : Body
        With all lines taken in.
    shown : str
        How the file is called.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        Where counts disagree or names cannot be read.
    ModelError
        Where the model breaks a law.
    """
    _check_counts(head, body)
    labels = _labels(body)
    actions, choice_to_action = _actions(head, body)
    notes: list[str] = []
    rows = _rows(body, notes)
    whole, repairs = with_loops(
        Rows(
            state_to_choices=rows[0],
            choice_to_branches=rows[1],
            branch_to_target=joined(body.targets),
            branch_to_probability=rows[2],
            choice_to_action=choice_to_action,
            rewards=_rewards(head, body),
        )
    )
    initial = np.flatnonzero(labels.pop(INITIAL, np.zeros(body.state_count, dtype=bool)))
    if len(initial) == 0:
        notes.append("The source names no initial state: any state may be the start.")
        initial = np.arange(body.state_count)
    if head.type == "dtmc":
        notes.append("The source is a DTMC: every state got one choice.")
    mdp = MDP(
        state_to_choices=whole.state_to_choices,
        choice_to_branches=whole.choice_to_branches,
        branch_to_target=whole.branch_to_target,
        branch_to_probability=whole.branch_to_probability,
        choice_to_action=whole.choice_to_action,
        actions=tuple(actions),
        labels=_restored(head, labels, body.state_count),
        rewards=whole.rewards,
        initial=initial,
        names=names_of(body.valuations, body.state_count),
    )
    return Problem(mdp=mdp, source=shown, notes=(*notes, *repairs))


def _check_counts(head: Head, body: Body) -> None:
    """Refuse a body that has not as many states and choices as the head says."""
    state = joined(body.state_of_choice)
    if head.type == "dtmc":
        twice = np.flatnonzero(np.diff(state) == 0)
        if len(twice):
            line = int(body.choices.line()[twice[0] + 1])
            body.fail(line, "a DTMC must have one choice per state, got a second. Say '@type: MDP' if it is an MDP.")
    stuck = body.state_count - len(np.unique(state))
    whole = len(state) > 0 and state[-1] == body.state_count - 1  # else the file may be cut off at its last state
    counts = [body.state_count], [body.choice_count, body.choice_count + stuck if whole else -1]
    for what, said, (found, *others) in zip(("states", "choices"), (head.states, head.choices), counts, strict=True):
        if said is not None and said not in (found, *others):
            body.fail(
                body.line,
                f"here, at its end, the file must have had the {said} {what} that @nr_{what} says, but it has {found}. "
                f"{'It may be cut off: copy' if found < said else 'Copy'} or write it anew.",
            )
    if body.state_count == 0:
        body.fail(body.line, "there must be at least one state after @model, but the file ends.")


def _rows(body: Body, notes: list[str]) -> tuple[Numbers, Numbers, Floats]:
    """Return offsets of states and of choices, and probabilities; refuse what breaks a law."""
    counts = np.bincount(joined(body.choice_of_branch), minlength=body.choice_count)
    if (counts == 0).any():
        line = int(body.choices.line()[int((counts == 0).argmax())])
        body.fail(line, "an action must have a branch, 'STATE : PROBABILITY' on a line after it, but it has none.")
    _check_targets(body)
    choice_to_branches = np.concatenate([[0], np.cumsum(counts)])
    own = np.bincount(joined(body.state_of_choice), minlength=body.state_count)
    return (
        np.concatenate([[0], np.cumsum(own)]),
        choice_to_branches,
        _checked_probabilities(body, choice_to_branches, notes),
    )


def _check_targets(body: Body) -> None:
    targets = joined(body.targets)
    wrong = targets >= body.state_count
    if wrong.any():
        at = int(wrong.argmax())
        body.fail(
            int(joined(body.branch_lines)[at]),
            f"a branch must lead to one of the states 0 … {body.state_count - 1}, got {targets[at]}.",
        )


def _checked_probabilities(body: Body, rows: Numbers, notes: list[str]) -> Floats:
    """Return probabilities that sum to 1: those that were written with few digits are rescaled."""
    probability = joined(body.probabilities, np.float64)
    wrong = ~((probability >= 0.0) & (probability <= 1.0 + EXACT))
    if wrong.any():
        at = int(wrong.argmax())
        raise ModelError(
            f"'{body.shown}', line {joined(body.branch_lines)[at]}: a probability must lie between 0 and 1, got "
            f"{probability[at]:g}.",
            line=int(joined(body.branch_lines)[at]),
        )
    counts = np.diff(rows)
    if len(counts) == 0:
        return probability
    sums = np.add.reduceat(probability, rows[:-1])
    allowed = EXACT + np.where(counts > 1, np.minimum(DIGITS[0] * counts, DIGITS[1]), 0.0)
    off = np.abs(sums - 1.0)
    if (off > allowed).any():
        at = int((off > allowed).argmax())
        line = int(body.choices.line()[at])
        raise ModelError(
            f"'{body.shown}', line {line}: the probabilities of a choice must sum to 1, got {sums[at]:.10g} at the choice "
            f"that begins here, in state {joined(body.state_of_choice)[at]}.",
            line=line,
            state=int(joined(body.state_of_choice)[at]),
        )
    rounded = off > EXACT
    if rounded.any():
        count = int(np.count_nonzero(rounded))
        which = "one choice" if count == 1 else f"{count} choices"
        notes.append(
            f"The probabilities of {which} are written with few digits and miss 1 by up to {off.max():.1g}; they were rescaled."
        )
        probability = probability / np.repeat(np.where(rounded, sums, 1.0), counts)
    return probability


def _labels(body: Body) -> dict[str, Bools]:
    """Return the labels as sets of states."""
    holders: dict[str, list[int]] = {}
    for words, code in body.states.texts.items():
        for label in _words(body, code, words):
            holders.setdefault(label, []).append(code)
    codes = body.states.code()
    labels = {}
    for label, texts in holders.items():
        has = np.zeros(len(body.states.texts), dtype=bool)
        has[texts] = True
        labels[label] = has[codes]
    return labels


def _words(body: Body, code: int, words: bytes) -> list[str]:
    """Return the labels of a state: words, or anything in double quotes."""
    try:
        text = words.decode("utf-8")
    except UnicodeDecodeError:
        body.fail(body.states.first_line(code), "labels must be UTF-8 text, but these are not.")
    if text.count('"') % 2:
        body.fail(body.states.first_line(code), f"a label in double quotes must end with one, got '{plain(words)}'.")
    return [found[1] if found[1] is not None else found[2] for found in LABEL.finditer(text)]


def _actions(head: Head, body: Body) -> tuple[list[str], Numbers]:
    """Return the names of actions, and the action of every choice."""
    spelled = []
    for text, code in body.choices.texts.items():
        try:
            spelled.append(text.decode("utf-8"))
        except UnicodeDecodeError:
            body.fail(body.choices.first_line(code), "the name of an action must be UTF-8 text, but this is not.")
    codes, state = body.choices.code(), joined(body.state_of_choice)
    position = np.arange(len(codes)) - np.searchsorted(state, state)
    known = head.own.get("actions", ())
    names = [name for name, _ in known]
    number = {name: action for action, name in enumerate(names)}
    if not known and _are_positions(spelled, codes, position):
        spelled = [""] * len(spelled)
    for name in spelled:
        if name not in ("", UNNAMED):
            number.setdefault(name, len(number))
    of_text = np.array([-1 if name in ("", UNNAMED) else number[name] for name in spelled], dtype=np.int64)
    true = dict(known)
    return [true.get(name, name) for name in number], of_text[codes]


def _are_positions(spelled: list[str], codes: Numbers, position: Numbers) -> bool:
    """Return whether every action is but its position in its state: then it has no name."""
    if not all(name == "" or (name.isascii() and name.isdigit() and len(name) < 18) for name in spelled):
        return False
    numbers = np.array([int(name) if name else -1 for name in spelled], dtype=np.int64)[codes]
    return bool(((numbers == position) | (numbers == -1)).all())


def _rewards(head: Head, body: Body) -> dict[str, Reward]:
    """Return the rewards by their true names; parts that are 0 everywhere are left out."""
    tables = stacked(body.state_rewards, len(head.rewards)), stacked(body.choice_rewards, len(head.rewards))
    names = head.rewards + [f"rew{i}" for i in range(len(head.rewards), max(table.shape[1] for table in tables))]
    true = dict(head.own.get("rewards", ()))
    rewards: dict[str, Reward] = {}
    for i, name in enumerate(names):
        name = true.get(name, name)
        if not name and NAMELESS_REWARD not in names and name not in true.values():
            name = NAMELESS_REWARD
        columns = (table[:, i] if i < table.shape[1] else np.zeros(0) for table in tables)
        state, choice = (column.copy() if column.any() else None for column in columns)
        rewards[name] = Reward(state=state, choice=choice)
    return rewards


def _restored(head: Head, labels: dict[str, Bools], states: int) -> dict[str, Bools]:
    """Return the labels by their true names, with those of no state, in the order of our own comment."""
    known = head.own.get("labels", ())
    restored = {true: labels.pop(spelled, np.zeros(states, dtype=bool)) for spelled, true in known}
    return restored | labels

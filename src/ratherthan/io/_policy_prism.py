"""A strategy as PRISM exports it enters, a Policy that fits the model leaves.

``-exportstrat FILE:type=actions`` and ``type=indices`` write a line per state, the state as the values of its variables or
as a number, then its action or the position of its choice; older PRISMs write a colon. Randomised ones give probabilities::

    (0,true)=east
    (1,true)=0.25:east+0.75:north
    7=1

``type=induced`` (the default for ``.tra``) writes the model that is left: its size, and a line per branch, ``state [choice]
target probability [action]``. Here a state's choice is found by where it leads, and by its action where that is told; so
this form also shows whether the strategy belongs to the model at all.

PRISM numbers states in the order of the values of their variables; these numbers are taken so where the model has variables,
and as the model's own numbers where it has none. Strategies with memory (``state,memory=action``) are refused.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from ratherthan.errors import PolicyError
from ratherthan.io._policy_match import (
    Numbers,
    are_alike,
    called,
    own_choice,
    policy_of,
    shown_actions,
    state_of_choices,
)
from ratherthan.io._policy_valuations import NONE, find_valuations, parse_tuple, parse_valuation, prism_order
from ratherthan.model.mdp import MDP, Bools, Floats
from ratherthan.model.policy import Policy

__all__ = ["is_induced", "is_strategy", "numbers_of_prism", "read_induced", "read_strategy"]

LINE = re.compile(r"\s*(?:\((?P<values>[^()]*)\)|(?P<number>\d+))(?P<memory>,\s*-?\d+)?\s*[=:]\s*(?P<said>.*?)\s*")
PART = re.compile(r"(?P<chance>[0-9.]+(?:[eE][+-]?\d+)?|\d+/\d+):(?P<action>.*)")
POSITIONS = re.compile(r"\{(\d+=[^,{}]+(?:,\s*\d+=[^,{}]+)*)\}")
SIZE = re.compile(r"\s*\d+\s+\d+(\s+\d+)?\s*")
BRANCH = re.compile(r"\s*\d+\s+\d+\s+\S+(\s+\S+){0,2}\s*")
UNDEFINED = ("?", "-")
NEAR = 1e-6
"""How far a probability in an induced model may be from the model's: it may be written with few digits."""


def _telling(text: str, count: int | None = None) -> list[tuple[int, str]]:
    """Return the lines that are neither blank nor comments, with their numbers; the first `count` of them."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() and not line.lstrip().startswith("#"):
            found.append((number, line))
            if len(found) == count:
                break
    return found


def is_strategy(text: str) -> bool:
    """Return whether this begins like a list of states and actions."""
    first = _telling(text[:100_000], 1)
    return bool(first) and LINE.fullmatch(first[0][1]) is not None


def is_induced(text: str) -> bool:
    """Return whether this begins like a list of branches with its size before it."""
    first = _telling(text[:100_000], 2)
    return len(first) == 2 and bool(SIZE.fullmatch(first[0][1])) and bool(BRANCH.fullmatch(first[1][1]))


def numbers_of_prism(mdp: MDP, what: str) -> Numbers:
    """Return the model's number of every state in PRISM's order, or raise where it cannot be known."""
    order = prism_order(mdp)
    if order is None:
        raise PolicyError(
            f"{what} numbers states in the order of PRISM, which cannot be known from this model: export the strategy with "
            "the values of variables, -exportstrat FILE:type=actions."
        )
    return order


def read_strategy(text: str, mdp: MDP, what: str) -> Policy:
    """Read a list of states and actions, or positions of choices.

    Parameters
    ----------
    text : str
    mdp : MDP
    what : str
        How the policy is called in errors.

    Raises
    ------
    PolicyError
        Where it has memory, is broken, or does not fit the model; with the first line.
    """
    lines: list[tuple[int, re.Match[str]]] = []
    for number, line in _telling(text):
        found = LINE.fullmatch(line)
        if found is None:
            raise PolicyError(
                f"{what}, line {number}: a state and its action must stand here, like (0,1)=east or 7=east, got "
                f"'{line.strip()[:80]}'.",
                line=number,
            )
        if found["memory"]:
            raise PolicyError(
                f"{what}, line {number}: what is done must not depend on more than the state to be explained, but the "
                "strategy has memory. Explain it on the product with its memory, or export a memoryless one.",
                line=number,
            )
        if found["said"] not in UNDEFINED or found["said"] in mdp.actions:
            lines.append((number, found))
    states = _states(lines, mdp, what)
    rows: list[tuple[int, int, float]] = []
    for (number, found), state in zip(lines, states.tolist(), strict=True):
        where = f"{what}, line {number}:"
        rows += [(state, _choice(state, given, mdp, where), chance) for given, chance in _said(found["said"], where)]
    chosen = [np.array([row[i] for row in rows], dtype=np.int64) for i in (0, 1)]
    chances = np.array([row[2] for row in rows], dtype=np.float64)
    return policy_of(mdp, chosen[0], chosen[1], chances, what, complete=True)


def _states(lines: list[tuple[int, re.Match[str]]], mdp: MDP, what: str) -> Numbers:
    found = np.full(len(lines), NONE, dtype=np.int64)
    valued = [i for i, (_, line) in enumerate(lines) if line["values"] is not None]
    if valued:
        texts = [lines[i][1]["values"] for i in valued]
        found[valued] = find_valuations(mdp, [parse_valuation(t, mdp) or parse_tuple(t, mdp) or {} for t in texts])
    if len(valued) < len(lines):
        order = numbers_of_prism(mdp, what)
        for i, (_, line) in enumerate(lines):
            number = line["number"]
            if number is not None and len(number) < 18 and int(number) < mdp.states:
                found[i] = order[int(number)]
    if (found < 0).any():
        at = int((found < 0).argmax())
        number, line = lines[at]
        shown = f"({line['values']})" if line["number"] is None else line["number"]
        names = list(mdp.names.variables) if mdp.names.strings is None else []
        several = "several states of the model fit" if found[at] != NONE else "no state of the model fits"
        has = f"the variables {', '.join(names[:10])}" if names else "no variables"
        raise PolicyError(
            f"{what}, line {number}: {several} {shown}; it has {mdp.states} states and {has}. The strategy may belong to "
            "another model.",
            line=number,
        )
    return found


def _said(said: str, where: str) -> list[tuple[str | int, float]]:
    """Return actions, or positions of choices, with their probabilities; NaN stands for certainty."""
    positions = POSITIONS.fullmatch(said)
    if positions is not None:
        pairs = [part.split("=") for part in positions[1].split(",")]
        return [(int(position), _chance(chance, where)) for position, chance in pairs]
    parts = [PART.fullmatch(part.strip()) for part in said.split("+")]
    if any(part is None for part in parts):
        return [(said, np.nan)]
    return [(part["action"], _chance(part["chance"], where)) for part in parts if part is not None]


def _chance(text: str, where: str) -> float:
    top, _, bottom = text.partition("/")
    try:
        chance = float(top) / float(bottom or 1)
    except (ValueError, ZeroDivisionError):
        chance = np.nan
    if not 0.0 <= chance <= 1.0 + NEAR:
        raise PolicyError(f"{where} probabilities must lie between 0 and 1, got '{text.strip()}'.")
    return chance


def _choice(state: int, given: str | int, mdp: MDP, where: str) -> int:
    """Return the choice with an action's name (none: '' or 'null'), else at a position; one only may fit."""
    own = mdp.choices_of(state)
    names = [mdp.actions[a] if a >= 0 else "" for a in mdp.choice_to_action[own.start : own.stop].tolist()]
    wanted = "" if given == "null" and "null" not in names else given
    fitting = [choice for choice, name in zip(own, names, strict=True) if name == wanted]
    if len(fitting) == 1 or (fitting and are_alike(mdp, fitting)):
        return fitting[0]
    if fitting:
        raise PolicyError(
            f"{where} one choice must be meant, but {len(fitting)} choices of {called(mdp, state)} have "
            f"{f'the action {given!r}' if wanted else 'no name'}. An export with type=induced tells them apart.",
            state=state,
        )
    return own_choice(state, given, mdp, where.removesuffix(":"))


class _Induced(NamedTuple):
    """The branches of an induced model, in its own numbers."""

    source: Numbers
    target: Numbers
    probability: Floats
    action: list[str | None]
    line: Numbers


def read_induced(text: str, mdp: MDP, what: str) -> Policy:
    """Read the model that a strategy leaves; as `read_strategy`."""
    (number, size), *lines = _telling(text)
    counts = [int(part) for part in size.split()]
    if counts[0] != mdp.states:
        raise PolicyError(
            f"{what}, line {number}: the induced model must have the {mdp.states} states of the model, got {counts[0]}. It "
            "belongs to another model, or to its reachable part: export it with -exportstrat FILE:type=induced,reach=false.",
            line=number,
        )
    given = _branches(lines, counts, what)
    order = numbers_of_prism(mdp, what)
    given = given._replace(source=order[given.source], target=order[given.target])
    fits = _leads_there(mdp, given) & _named(mdp, given)
    state = state_of_choices(mdp)
    found = np.bincount(state[fits], minlength=mdp.states)
    told = np.unique(given.source)
    wrong = told[found[told] == 0]
    if len(wrong):
        raise PolicyError(
            f"{what}, line {_line_of(given, wrong[0])}: a state must go where one of its choices leads, but none of "
            f"{called(mdp, int(wrong[0]))}, {shown_actions(mdp, int(wrong[0]))}, leads there. The strategy belongs to another "
            "model, or is randomised: then export it with type=actions.",
            state=int(wrong[0]),
        )
    choices = np.flatnonzero(fits)[np.searchsorted(state[fits], told)]
    for several in told[found[told] > 1].tolist():
        fitting = [choice for choice in mdp.choices_of(several) if fits[choice]]
        if not are_alike(mdp, fitting):
            raise PolicyError(
                f"{what}, line {_line_of(given, several)}: one choice must be meant, but {len(fitting)} choices of "
                f"{called(mdp, several)} lead there, {', '.join(repr(mdp.action_name(c)) for c in fitting[:5])}. An export "
                "with type=indices tells them apart.",
                state=several,
            )
    return policy_of(mdp, told, choices, np.full(len(told), np.nan), what, complete=True)


def _line_of(given: _Induced, state: int) -> int:
    return int(given.line[np.argmax(given.source == state)])


def _branches(lines: list[tuple[int, str]], counts: list[int], what: str) -> _Induced:
    """Return the branches; the choice within the state, which an MDP's lines have, must be the first."""
    extra = len(counts) - 2
    columns: list[tuple[int, int, float, str | None]] = []
    for number, line in lines:
        cells = line.split()
        try:
            source, target = int(cells[0]), int(cells[1 + extra])
            chance, action = float(cells[2 + extra]), " ".join(cells[3 + extra :]) or None
            whole = 0 <= source < counts[0] and 0 <= target < counts[0] and 0.0 <= chance <= 1.0 + NEAR
            first = not extra or int(cells[1]) == 0
        except (ValueError, IndexError):
            whole = first = False
            source = target = 0
            chance, action = 0.0, None
        if not first and whole:
            raise PolicyError(
                f"{what}, line {number}: one choice must be left in every state, but state {source} has more. Export it with "
                "type=actions.",
                line=number,
            )
        if not whole:
            form = "STATE CHOICE TARGET PROBABILITY" if extra else "STATE TARGET PROBABILITY"
            raise PolicyError(
                f"{what}, line {number}: a branch must be written '{form}', got '{line.strip()[:80]}'.", line=number
            )
        columns.append((source, target, chance, action))
    if len(columns) != counts[-1]:
        raise PolicyError(
            f"{what} must have {counts[-1]} branches as its first line says, got {len(columns)}. It may be cut off: export it "
            "anew."
        )
    return _Induced(
        np.array([row[0] for row in columns], dtype=np.int64),
        np.array([row[1] for row in columns], dtype=np.int64),
        np.array([row[2] for row in columns], dtype=np.float64),
        [row[3] for row in columns],
        np.array([number for number, _ in lines], dtype=np.int64),
    )


def _leads_there(mdp: MDP, given: _Induced) -> Bools:
    """Return which choices lead with the same probabilities to the same states as theirs does in the induced model."""
    states = mdp.states
    pairs, at = np.unique(given.source * states + given.target, return_inverse=True)
    wanted = np.bincount(at, weights=given.probability, minlength=len(pairs))
    choice = np.repeat(np.arange(mdp.choices), np.diff(mdp.choice_to_branches))
    reached, at = np.unique(choice * states + mdp.branch_to_target, return_inverse=True)
    has = np.bincount(at, weights=mdp.branch_to_probability, minlength=len(reached))
    own = reached // states
    key = state_of_choices(mdp)[own] * states + reached % states
    place = np.minimum(np.searchsorted(pairs, key), len(pairs) - 1)
    same = (pairs[place] == key) & (np.abs(wanted[place] - has) <= NEAR)
    there = np.bincount(pairs[wanted > 0] // states, minlength=states)
    hits, all_ = np.bincount(own[same], minlength=mdp.choices), np.bincount(own, minlength=mdp.choices)
    fits: Bools = (hits == all_) & (hits == there[state_of_choices(mdp)])
    return fits


def _named(mdp: MDP, given: _Induced) -> Bools:
    """Return which choices have the action that the induced model tells for their state, or any where it tells none."""
    number: dict[str, int] = {}
    for action, name in enumerate(mdp.actions):
        number.setdefault(name, action)
    canonical = np.array([number[name] for name in mdp.actions] + [-1], dtype=np.int64)
    told = np.full(mdp.states, -2, dtype=np.int64)
    nameless = -2 if set(given.action) == {None} else -1  # without any name in the file, names tell nothing
    told[given.source] = [nameless if name is None else number.get(name, -3) for name in given.action]
    wanted = told[state_of_choices(mdp)]
    matches: Bools = (wanted == -2) | (wanted == canonical[mdp.choice_to_action])
    return matches

"""A scheduler as Storm exports it (JSON or text) enters, a Policy that fits the model leaves.

``storm --exportscheduler x.json`` and `scheduler.to_json_str` write a list with one entry per state::

    {"s": 7, "c": [{"index": 19, "labels": ["go"], "prob": 1.0}]}

``s`` is the state's number, or the values of its variables where the model was built with them; ``index`` counts the
choices of the whole model, ``labels`` are the names of the action. A name wins over a number where both are there and the
model was numbered otherwise. Any other suffix gets the text form: a line per state with the choice's position in the state,
and its labels in braces.

Schedulers with memory are refused: what they do depends on more than the state.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from ratherthan.errors import PolicyError
from ratherthan.io._policy_match import Numbers, are_alike, called, policy_of, shown_actions
from ratherthan.io._policy_valuations import NONE, SEVERAL, find_valuations, has_value, numeric_columns
from ratherthan.model.mdp import MDP
from ratherthan.model.policy import Policy

__all__ = ["is_storm_json", "is_storm_text", "read_storm_json", "read_storm_text"]

TITLE = re.compile(r"^(Fully|Partially) defined .*scheduler(?P<memory> with \d+ memory states)?:\s*$", re.MULTILINE)
LINE = re.compile(r"\s*(?P<state>\d+)(: \[(?P<values>.*?)\])?\s{4}(?P<choice>.*)")
PART = re.compile(r"(?P<chance>[^\s:]+): \((?P<choice>.*?)\)(?:\s{3}\+\s{4}|\s*$)")
CHOICE = re.compile(r"(?P<position>\d+)?(?P<origin>.*?)\s*(?:\{(?P<labels>[^{}]*)\})?\s*")
LOCATION = "_loc_"
CERTAIN = [np.nan]
MEMORY = "must not depend on more than the state to be explained, but it is a scheduler with memory. Explain it on the product with its memory, or export a memoryless one"


def is_storm_json(content: object) -> bool:
    """Return whether this is a list of entries like those of a scheduler."""
    return isinstance(content, list) and all(isinstance(entry, dict) and {"s", "c"} <= set(entry) for entry in content)


def is_storm_text(text: str) -> bool:
    """Return whether this begins like a scheduler that Storm prints."""
    return TITLE.search(text[:2000]) is not None


def read_storm_json(content: list[dict[str, Any]], mdp: MDP, what: str) -> Policy:
    """Read a scheduler in JSON.

    Parameters
    ----------
    content : list of dict
    mdp : MDP
    what : str
        How the policy is called in errors.

    Raises
    ------
    PolicyError
        Where it has memory, is broken, or does not fit the model; with the first place.
    """
    if any("m" in entry for entry in content):
        raise PolicyError(f"{what} {MEMORY}.")
    said = [entry for entry in content if entry["c"] != "undefined"]
    states = _states(said, mdp, what)
    rows: list[tuple[int, int, float]] = []
    for entry, state in zip(said, states.tolist(), strict=True):
        if not isinstance(entry["c"], list) or not all(isinstance(part, dict) for part in entry["c"]):
            raise PolicyError(f"{what} must list the choices of {called(mdp, state)} under 'c', got {entry['c']!r}.")
        by_number = not isinstance(entry["s"], dict)
        chances = [_chance(part, state, mdp, what) for part in entry["c"]]
        chosen = [_choice(part, state, mdp, what, by_number=by_number) for part in entry["c"]]
        rows += [(state, c, chance) for c, chance in zip(chosen, CERTAIN if chances == [1.0] else chances, strict=True)]
    return _policy(rows, mdp, what)


def _policy(rows: list[tuple[int, int, float]], mdp: MDP, what: str) -> Policy:
    states, choices = (np.array([row[i] for row in rows], dtype=np.int64) for i in (0, 1))
    chances = np.array([row[2] for row in rows], dtype=np.float64)
    return policy_of(mdp, states, choices, chances, what, complete=True)


def _states(said: list[dict[str, Any]], mdp: MDP, what: str) -> Numbers:
    """Return the states that are meant by numbers or by values of variables."""
    given = [entry["s"] for entry in said]
    found = np.full(len(given), NONE, dtype=np.int64)
    valued = [i for i, key in enumerate(given) if isinstance(key, dict)]
    # What a model names in words (the locations of a JANI model) Storm exports as numbers: the rest must do.
    columns = numeric_columns(mdp)
    wanted = [
        {name: value for name, value in given[i].items() if name in columns or not name.startswith(LOCATION)}
        for i in valued
    ]
    if valued:
        found[valued] = find_valuations(mdp, wanted)
    for i, values in zip(valued, wanted, strict=True):
        if found[i] == SEVERAL:
            found[i] = _state_of_index(said[i], values, mdp, columns)
    for i, key in enumerate(given):
        if isinstance(key, int) and not isinstance(key, bool) and 0 <= key < mdp.states:
            found[i] = key
    if (found < 0).any():
        at = int((found < 0).argmax())
        shown = ", ".join(f"{name}={value}" for name, value in given[at].items()) if at in set(valued) else given[at]
        several = "several states fit" if found[at] != NONE else "no state fits"
        raise PolicyError(
            f"{what} must list states of the model, but {several} {shown!r} among its {mdp.states} states"
            f"{_variables(mdp)}. It may belong to another model.",
            state=given[at],
        )
    return found


def _state_of_index(entry: Mapping[str, Any], values: Mapping[str, Any], mdp: MDP, columns: Mapping[str, Any]) -> int:
    """Return the one of several states that fit which the index of a choice singles out, else that there are several."""
    parts = entry["c"] if isinstance(entry["c"], list) else []
    index = parts[0].get("index") if parts and isinstance(parts[0], dict) else None
    if not isinstance(index, int) or not 0 <= index < mdp.choices:
        return SEVERAL
    state = mdp.state_of(index)
    return state if all(has_value(columns[name][state], value) for name, value in values.items()) else SEVERAL


def _variables(mdp: MDP) -> str:
    names = list(mdp.names.variables) if mdp.names.strings is None else []
    return f" with the variables {', '.join(names[:10])}" if names else ", which have no variables"


def _choice(part: Mapping[str, Any], state: int, mdp: MDP, what: str, *, by_number: bool) -> int:
    """Return the choice that an entry means: by its labels, and by its index among all choices of the model."""
    index, labels = part.get("index"), part.get("labels")
    origin = part.get("origin")
    if labels is None and isinstance(origin, dict) and isinstance(origin.get("action-label"), str):
        labels = [origin["action-label"]] if origin["action-label"] else []
    own = mdp.choices_of(state)
    fitting = [choice for choice in own if labels is None or _fits(mdp, choice, labels)]
    whole = isinstance(index, int) and not isinstance(index, bool)
    if whole and index in fitting:
        return int(index)
    if fitting and (len(fitting) == 1 or are_alike(mdp, fitting)) and not (by_number and whole):
        return fitting[0]
    named = "" if labels is None else f" with the action {' '.join(map(str, labels)) or '(without a name)'}"
    numbered = f" number {index}" if whole else ""
    raise PolicyError(
        f"{what} must choose among the actions of {called(mdp, state)}, {shown_actions(mdp, state)} (the choices {own.start} "
        f"… {own.stop - 1} of the model), but it takes choice{numbered}{named}. It may belong to another model.",
        state=state,
    )


def _fits(mdp: MDP, choice: int, labels: Any) -> bool:
    action = int(mdp.choice_to_action[choice])
    name = mdp.actions[action] if action >= 0 else ""
    return name in labels if isinstance(labels, list) and labels else not name


def _chance(part: Mapping[str, Any], state: int, mdp: MDP, what: str) -> float:
    chance = _number(part.get("prob", 1))
    if chance is None or not 0.0 <= chance <= 1.0 + 1e-6:
        raise PolicyError(
            f"{what} must give probabilities between 0 and 1, got {part.get('prob')!r} at {called(mdp, state)}.",
            state=state,
        )
    return chance


def _number(given: Any) -> float | None:
    """Return a number, which may be written as a fraction."""
    if isinstance(given, str):
        try:
            return float(Fraction(given)) if re.fullmatch(r"\d+\s*/\s*\d+", given) else float(given)
        except (ValueError, ZeroDivisionError, OverflowError):
            return None
    return float(given) if isinstance(given, int | float) and not isinstance(given, bool) else None


def read_storm_text(text: str, mdp: MDP, what: str) -> Policy:
    """Read a scheduler as Storm prints it; as `read_storm_json`."""
    title = TITLE.search(text)
    assert title is not None  # is_storm_text has seen it
    if title["memory"]:
        raise PolicyError(f"{what} {MEMORY}.")
    variables = mdp.names.variables if mdp.names.strings is None else {}
    columns = {
        name: np.asarray(column) for name, column in variables.items() if np.asarray(column).dtype.kind in "biuf"
    }
    rows: list[tuple[int, int, float]] = []
    before = text.count("\n", 0, title.end())
    for number, line in enumerate(text[title.end() :].splitlines(), before + 1):
        bare = line.strip(" _\t\r")
        if not bare or bare.startswith(("model state:", "Skipped ")):
            continue
        found, where = LINE.fullmatch(line), f"{what}, line {number}:"
        if found is None:
            raise PolicyError(
                f"{where} a state and its choice must stand here, got '{line.strip()[:80]}'.", line=number
            )
        if found["choice"].strip() == "undefined.":
            continue
        state = _numbered_state(found, mdp, columns, where)
        rows += [(state, choice, chance) for choice, chance in _printed(found["choice"], state, mdp, where)]
    return _policy(rows, mdp, what)


def _numbered_state(found: re.Match[str], mdp: MDP, columns: Mapping[str, Any], where: str) -> int:
    """Return a state by its number, once what is said of its variables fits."""
    state = int(found["state"]) if len(found["state"]) < 18 else mdp.states
    if state >= mdp.states:
        raise PolicyError(
            f"{where} states must lie in 0 … {mdp.states - 1}, got {found['state']}. It may belong to another model."
        )
    for cell in (found["values"] or "").split("&"):
        name, equals, value = cell.strip().partition("=")
        truth, name = not name.startswith("!"), name.removeprefix("!")
        if name in columns and not has_value(columns[name][state], value if equals else truth):
            raise PolicyError(
                f"{where} state {state} must be '{mdp.names[state]}' as in the model, but here it has {cell.strip()}. The "
                "states are numbered otherwise: export the scheduler as JSON with the values of variables.",
                state=state,
            )
    return state


def _printed(text: str, state: int, mdp: MDP, where: str) -> list[tuple[int, float]]:
    """Return the choices of a line with their probabilities."""
    parts = list(PART.finditer(text))
    if parts and parts[0].start() == 0 and parts[-1].end() == len(text):
        # In such a line Storm prints the labels of the first choice with every other: the positions alone are right.
        found = [(_printed_choice(part["choice"], state, mdp, where, labelled=False), part["chance"]) for part in parts]
        chances = [_number(chance) for _, chance in found]
        if None in chances:
            raise PolicyError(f"{where} probabilities must be numbers, got '{text.strip()[:80]}'.", state=state)
        return [(choice, float(chance or 0.0)) for (choice, _), chance in zip(found, chances, strict=True)]
    return [(_printed_choice(text, state, mdp, where, labelled=True), np.nan)]


def _printed_choice(text: str, state: int, mdp: MDP, where: str, *, labelled: bool) -> int:
    found = CHOICE.fullmatch(text.strip())
    labels = (
        None
        if found is None or found["labels"] is None
        else [x.strip() for x in found["labels"].split(",") if x.strip()]
    )
    own = mdp.choices_of(state)
    fitting = [c for c in own if not labelled or labels is None or _fits(mdp, c, labels)]
    if found is not None and found["position"] is not None and not found["origin"]:
        position = int(found["position"])
        fitting = [own[position]] if position < len(own) and own[position] in fitting else []
    elif not labelled or labels is None:
        fitting = []
    if not fitting or not are_alike(mdp, fitting):
        raise PolicyError(
            f"{where} one of the actions of {called(mdp, state)} must be chosen, {shown_actions(mdp, state)}, but "
            f"'{text.strip()[:80]}' is {'several' if len(fitting) > 1 else 'none'} of them. It may belong to another model; "
            "a scheduler exported as JSON tells choices apart.",
            state=state,
        )
    return fitting[0]

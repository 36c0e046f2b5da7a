"""A model written out state by state (a TOML text) enters, a Problem leaves: for examples that are no map.

::

    variables = ["place", "battery"]            # a state is one value for each; whole numbers are numbers
    start = "depot 2"
    property = 'R{"energy"}min=? [F "home"]'
    [labels]
    home = { place = "home" }                   # the states with these values
    [words.actions]                             # and so on, as in a road map
    drive = "drive on"
    [[state]]
    is = "depot 2"
    said = "the depot"                          # its noun phrase
    drive = { energy = 3, to = "0.9 home 1, 0.1 depot 2" }
    [[state]]
    is = "home 1"
    rest = { to = "home 1" }                    # costs that are left out are 0

The states are numbered in the order of the file, the choices of each in the order of its actions. What is wrong with the
numbers (a sum that is not 1) the MDP itself tells.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ratherthan.io._roadmap_tables import check_keys, number_of, spelled, table_of, text_of
from ratherthan.io._roadmap_text import Document, closest
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP, Bools, Reward
from ratherthan.model.names import StateNames
from ratherthan.model.objective import Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.property import parse_property

__all__ = ["parse_state_table"]

TOP_KEYS = ("variables", "start", "property", "properties", "labels", "words", "state")
Branches = list[tuple[float, str]]


class _Choice(NamedTuple):
    action: str
    costs: dict[str, float]
    branches: Branches


def parse_state_table(text: str, *, source: str) -> Problem:
    """Read a model from its text.

    Parameters
    ----------
    text : str
    source : str
        What to call it in messages.

    Returns
    -------
    Problem

    Raises
    ------
    SourceError
        If the text breaks a rule of the format.
    ModelError
        If the model in it breaks a law.
    PropertyError
        If a property in it cannot be parsed.
    """
    document = Document.read(text, source)
    check_keys(document, document.tables, TOP_KEYS)
    for key in ("variables", "start", "state"):
        if not document.tables.get(key):
            document.fail(f"A table of states must have '{key}'.")
    names = [_name(document, entry) for entry in document.tables["state"]]
    choices = [_choices(document, entry) for entry in document.tables["state"]]
    number = {name: i for i, name in enumerate(names)}
    if len(number) < len(names):
        twice = next(name for i, name in enumerate(names) if number[name] != i)
        document.fail(f"A state must be described once, got '{twice}' twice.")
    problem = Problem(
        mdp=_mdp(document, names, number, choices),
        lexicon=_words(document),
        source=source,
    )
    properties = {
        name: parse_property(text_of(document, ("properties", name), one), problem)
        for name, one in table_of(document, ("properties",)).items()
    }
    default = document.tables.get("property")
    objective = parse_property(text_of(document, ("property",), default), problem) if default is not None else None
    if isinstance(objective, Threshold):
        document.fail(f"'property' must ask for a best value (=?), got {spelled(default)}.", ("property",))
    return replace(problem, objective=objective, properties=properties)


def _name(document: Document, entry: Any) -> str:
    """Return the values of a state as one text, blanks made single."""
    if not isinstance(entry, dict) or "is" not in entry:
        document.fail(f"Every state must say what it is, is = '…', got {spelled(entry)}.", ("state",))
    values = text_of(document, ("state", "is"), entry["is"]).split()
    if len(values) != len(document.tables["variables"]):
        document.fail(
            f"A state must have one value per variable ({' '.join(document.tables['variables'])}), got '{entry['is']}'."
        )
    return " ".join(values)


def _choices(document: Document, entry: dict[str, Any]) -> list[_Choice]:
    found = []
    for action, value in entry.items():
        if action in ("is", "said"):
            continue
        if not isinstance(value, dict) or "to" not in value:
            document.fail(
                f"An action must say where it leads, {{ to = '…' }}, got {spelled(value)} at '{entry['is']}'."
            )
        costs = {name: number_of(document, (name,), cost) for name, cost in value.items() if name != "to"}
        found.append(_Choice(action, costs, _branches(document, text_of(document, ("to",), value["to"]))))
    if not found:
        document.fail(f"A state must have an action, '{entry['is']}' has none.")
    return found


def _branches(document: Document, text: str) -> Branches:
    """Read ``0.9 home 1, 0.1 depot 2``; a single successor needs no probability."""
    branches = []
    for part in text.split(","):
        values = part.split()
        chance = 1.0
        if len(values) > len(document.tables["variables"]):
            try:
                chance = float(values.pop(0))
            except ValueError:
                document.fail(f"A successor must be a probability and a state, got '{part.strip()}'.")
        branches.append((chance, " ".join(values)))
    return branches


def _mdp(document: Document, names: list[str], number: dict[str, int], choices: list[list[_Choice]]) -> MDP:
    flat = [choice for own in choices for choice in own]
    actions = list(dict.fromkeys(choice.action for choice in flat))
    branches = [branch for choice in flat for branch in choice.branches]
    rewards = list(dict.fromkeys(name for choice in flat for name in choice.costs))
    variables = _variables(document, names)
    return MDP(
        state_to_choices=np.array([0, *accumulate(len(own) for own in choices)]),
        choice_to_branches=np.array([0, *accumulate(len(choice.branches) for choice in flat)]),
        branch_to_target=np.array([_number(document, name, number) for _, name in branches]),
        branch_to_probability=np.array([chance for chance, _ in branches]),
        choice_to_action=np.array([actions.index(choice.action) for choice in flat]),
        actions=tuple(actions),
        labels={
            name: _label(document, name, values, variables) for name, values in table_of(document, ("labels",)).items()
        },
        rewards={name: Reward(choice=np.array([choice.costs.get(name, 0.0) for choice in flat])) for name in rewards},
        initial=np.array([_number(document, " ".join(str(document.tables["start"]).split()), number)]),
        names=StateNames(count=len(names), variables=variables),
    )


def _number(document: Document, name: str, number: dict[str, int]) -> int:
    if name not in number:
        document.fail(f"A state must be described in a section [[state]], but '{name}' is not.{closest(name, number)}")
    return number[name]


def _variables(document: Document, names: list[str]) -> dict[str, npt.NDArray[Any]]:
    """Return a column per variable: whole numbers where all its values are."""
    columns = zip(*(name.split() for name in names), strict=True)
    return {
        variable: np.array([int(value) for value in column] if all(map(str.isdigit, column)) else column)
        for variable, column in zip(document.tables["variables"], columns, strict=True)
    }


def _label(document: Document, name: str, values: Any, variables: dict[str, npt.NDArray[Any]]) -> Bools:
    keys = ("labels", name)
    if not isinstance(values, dict) or not values:
        document.fail(
            f"A label must say which values its states have, {{ variable = … }}, got {spelled(values)}.", keys
        )
    check_keys(document, values, tuple(variables), keys)
    mask = np.ones(len(next(iter(variables.values()))), dtype=bool)
    for variable, value in values.items():
        mask &= np.asarray(variables[variable] == value)
    return mask


def _words(document: Document) -> Lexicon:
    table = table_of(document, ("words",))
    check_keys(document, table, ("actions", "gerunds"), ("words",))
    said = {str(i): entry["said"] for i, entry in enumerate(document.tables["state"]) if "said" in entry}
    return Lexicon(
        actions={key: text_of(document, (key,), word) for key, word in table.get("actions", {}).items()},
        gerunds={key: text_of(document, (key,), word) for key, word in table.get("gerunds", {}).items()},
        states={number: text_of(document, ("said",), phrase) for number, phrase in said.items()},
    )

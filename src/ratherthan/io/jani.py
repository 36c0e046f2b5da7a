"""A model in the JANI format enters, a Problem leaves: Storm builds it.

Read are MDPs, and DTMCs as MDPs with one choice per state, with their action names, state variables, labels (variables that
are true or false and transient) and reward structures (other transient ones). Constants become definitions that properties
may mention. Properties in the file come along by name: those that can be explained, and as texts those that only a model
checker can answer; what cannot be said in PRISM's syntax is left out. The notes tell of both.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from ratherthan.errors import NotExplainableError, PropertyError, SourceError
from ratherthan.io._constants import Constant, Given, Value, chosen_values, text_of_value
from ratherthan.io._files import open_source
from ratherthan.io._jani_properties import property_text
from ratherthan.io._jani_terms import Vocabulary, term_of
from ratherthan.io._storm import build, parse_jani
from ratherthan.model.objective import Objective, Threshold
from ratherthan.model.problem import Problem
from ratherthan.model.property import parse_property
from ratherthan.model.syntax import Term, text_of

__all__ = ["read_jani"]

_READ = ("mdp", "dtmc")
_CONTINUOUS = ("ctmc", "ctmdp", "ma", "ta", "pta", "sta", "ha", "pha", "sha")


def read_jani(path: str | os.PathLike[str], *, constants: Given = None) -> Problem:
    """Read a model in the JANI format.

    Parameters
    ----------
    path : path
        To a ``.jani`` file.
    constants : str or mapping, optional
        Values of the constants that the model leaves open, ``"N=5,K=2"`` or by name.

    Returns
    -------
    Problem
        With the file's own properties by name.

    Raises
    ------
    SourceError
        If the file is missing or broken, of a kind other than an MDP or DTMC, or a constant is missing, unknown or of the
        wrong type.
    ModelError
        If the model breaks a law, such as probabilities that do not sum to 1.
    MissingExtraError
        If Storm is not installed.
    """
    shown = os.fspath(path)
    with open_source(path) as file:
        model = _parsed(file.read(), shown)
    declared = [_declared(item) for item in _objects(model, "constants")]
    body = {key: value for key, value in model.items() if key not in ("properties", "constants")}
    bodies = {str(item["name"]): item.get("value") for item in _objects(model, "constants")}
    needed = _mentioned(body, bodies)
    values = chosen_values(declared, constants, needed=needed, shown=shown)
    kept = [item for item in _objects(model, "constants") if item["name"] in needed]
    symbolic = parse_jani(json.dumps(body | {"constants": kept, "properties": []}), shown)
    kinds = _transient(model)
    problem = build(symbolic, {name: value for name, value in values.items() if name in needed}, hidden=kinds)
    words = Vocabulary(
        labels={name for name, kind in kinds.items() if kind == "bool" and name in problem.mdp.labels},
        hidden=set(kinds),
        rewards=problem.mdp.rewards,
    )
    bodies |= _unchanging(model, problem)
    problem = replace(problem, definitions=_definitions(bodies, values, words))
    properties, others, notes = _properties(model, problem, words)
    return replace(problem, properties=properties, others=others, notes=problem.notes + notes)


def _parsed(data: bytes, shown: str) -> dict[str, Any]:
    """Return the JSON of a model that is an MDP or DTMC."""
    try:
        model = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise SourceError(f"A JANI file must be JSON in UTF-8, but '{shown}' is not: {error}.", path=shown) from error
    if not isinstance(model, dict) or "automata" not in model:
        raise SourceError(f"A JANI file must hold a model with automata, but '{shown}' holds none.", path=shown)
    kind = model.get("type")
    if kind not in _READ:
        why = " (it runs in continuous time)" if kind in _CONTINUOUS else ""
        raise SourceError(
            f"A model must be of type mdp or dtmc, but '{shown}' is of type {kind}{why}.", path=shown, kind=kind
        )
    for key in ("constants", "variables", "properties", "automata"):
        items = model.get(key, [])
        if not isinstance(items, list) or not all(isinstance(item, dict) and "name" in item for item in items):
            raise SourceError(
                f"'{key}' of a JANI file must be a list of objects with names, but in '{shown}' it is not.", path=shown
            )
    return model


def _objects(model: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    """Return the objects of a list that may be absent."""
    items = model.get(key, [])
    return [item for item in items if isinstance(item, dict)] if isinstance(items, list) else []


def _declared(item: Mapping[str, Any]) -> Constant:
    kind = item.get("type")
    if isinstance(kind, dict):  # {"kind": "bounded", "base": "int", …}
        kind = kind.get("base")
    return Constant(
        name=str(item["name"]),
        kind="bool" if kind == "bool" else "int" if kind == "int" else "double",
        defined=item.get("value") is not None,
    )


def _mentioned(body: Any, bodies: Mapping[str, Any]) -> set[str]:
    """Return the constants that the model depends on, also through other constants."""
    found: set[str] = set()
    trees = [body]
    while trees:
        for name in _strings(trees.pop()):
            if name in bodies and name not in found:
                found.add(name)
                trees.append(bodies[name])
    return found


def _strings(tree: Any) -> Iterator[str]:
    """Yield every string in a JSON tree but the keys."""
    trees = [tree]
    while trees:
        tree = trees.pop()
        if isinstance(tree, str):
            yield tree
        elif isinstance(tree, dict):
            trees += tree.values()
        elif isinstance(tree, list):
            trees += tree


def _transient(model: Mapping[str, Any]) -> dict[str, Any]:
    """Return the types of the transient variables by the names that Storm gives them: they are no part of a state."""
    kinds = {str(item["name"]): item.get("type") for item in _objects(model, "variables") if item.get("transient")}
    for automaton in _objects(model, "automata"):
        for item in _objects(automaton, "variables"):
            if item.get("transient"):
                kinds[f"{automaton.get('name')}_{item.get('name')}"] = None
    return kinds


def _unchanging(model: Mapping[str, Any], problem: Problem) -> dict[str, Any]:
    """Return the first values of variables that nothing assigns: Storm takes them out of the states."""
    assigned = set(_strings([_values_at("ref", item) for item in _objects(model, "automata")]))
    return {
        str(item["name"]): item["initial-value"]
        for item in _objects(model, "variables")
        if not item.get("transient")
        and item.get("initial-value") is not None
        and item["name"] not in assigned
        and item["name"] not in problem.mdp.names.variables
    }


def _values_at(key: str, tree: Any) -> list[Any]:
    """Return what stands at `key` anywhere in a JSON tree."""
    found = []
    trees = [tree]
    while trees:
        tree = trees.pop()
        if isinstance(tree, dict):
            found += [tree[key]] if key in tree else []
            trees += tree.values()
        elif isinstance(tree, list):
            trees += tree
    return found


def _definitions(bodies: Mapping[str, Any], values: Mapping[str, Value], words: Vocabulary) -> dict[str, str]:
    """Return the constants, and the labels by their bare names, as PRISM expressions."""
    definitions = {name: text_of(Term("label", value=name)) for name in sorted(words.labels)}
    for name, tree in bodies.items():
        if name in values:
            definitions[name] = text_of_value(values[name])
        elif tree is not None:
            try:
                definitions[name] = text_of(term_of(tree, words))
            except (PropertyError, RecursionError):
                continue  # whoever mentions the name is told that it is unknown
    return definitions


def _properties(
    model: Mapping[str, Any], problem: Problem, words: Vocabulary
) -> tuple[dict[str, Objective | Threshold], dict[str, str], tuple[str, ...]]:
    """Return the properties that can be explained by name, the texts of others, and a note on every one of these."""
    properties: dict[str, Objective | Threshold] = {}
    others: dict[str, str] = {}
    notes = []
    for item in _objects(model, "properties"):
        name, text = str(item["name"]), ""
        try:
            text = property_text(item.get("expression"), words)
            properties[name] = parse_property(text, problem)
        except NotExplainableError as error:
            others[name] = text
            notes.append(f"Property '{name}' of the source can only be solved: {error.message}")
        except PropertyError as error:
            notes.append(f"Property '{name}' of the source was left out: {error.message}")
        except RecursionError:
            notes.append(f"Property '{name}' of the source was left out: it is nested too deeply.")
    return properties, others, tuple(notes)

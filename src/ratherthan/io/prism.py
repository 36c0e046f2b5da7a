"""A program in PRISM's language enters, a Problem leaves: Storm builds it.

Read are MDPs, and DTMCs as MDPs with one choice per state. Action names, state variables, labels and reward structures are
kept under the program's own names; its constants and formulas are kept as definitions, so that properties may mention them.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

from ratherthan.errors import SourceError
from ratherthan.io._constants import Given, chosen_values, reachable_names, text_of_value
from ratherthan.io._files import open_source
from ratherthan.io._storm import build, parse_prism
from ratherthan.model.problem import Problem

__all__ = ["read_prism"]

_REFUSED = {
    "ctmc": "runs in continuous time (a CTMC)",
    "stochastic": "runs in continuous time (a CTMC)",
    "ma": "runs in continuous time (a Markov automaton)",
    "pta": "has clocks (a PTA); PRISM can translate it with digital clocks",
    "popta": "has clocks and hidden parts (a POPTA)",
    "pomdp": "hides parts of the state (a POMDP)",
    "smg": "is a game of several players",
    "tsg": "is a game of several players",
    "csg": "is a game of several players",
    "imdp": "has intervals in the place of probabilities (an IMDP)",
    "idtmc": "has intervals in the place of probabilities (an IDTMC)",
    "lts": "has no probabilities (an LTS)",
}
_KEYWORD = re.compile(rf"(?:\A|;|\bend\w+)\s*({'|'.join(_REFUSED)})\b(?!\s*=)")
_COMMENT = re.compile(r'"[^"\n]*"|//[^\n]*')
_MODULE = re.compile(
    r"\bmodule\s+(?P<name>\w+)\s*(?:=\s*(?P<base>\w+)\s*\[(?P<renamed>[^\]]*)\]|(?P<body>.*?))\s*\bendmodule\b",
    re.DOTALL,
)
_VARIABLE = re.compile(r"\b(\w+)\s*:\s*(?=bool\b|\[)")
_DECLARED = re.compile(
    r"\b(?:const\s+(?:(?:int|double|bool)\b\s*)?|rate\s+|prob\s+)(?P<constant>\w+)\s*(?:=(?P<value>[^;]*))?;"
    r"|\bformula\s+(?P<formula>\w+)\s*=(?P<body>[^;]*);"
)


def read_prism(path: str | os.PathLike[str], *, constants: Given = None) -> Problem:
    """Read a program in PRISM's language.

    Parameters
    ----------
    path : path
        To a ``.prism``, ``.nm`` or ``.pm`` file.
    constants : str or mapping, optional
        Values of the constants that the program leaves open, ``"N=5,K=2"`` or by name.

    Returns
    -------
    Problem

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
        text = file.read().decode("utf-8", errors="replace")
    text = _COMMENT.sub(lambda found: found[0] if found[0][0] == '"' else " ", text)
    _check_kind(text, shown)
    symbolic = replace(parse_prism(Path(path), shown), order=_declared_variables(text))
    definitions, body = _definitions(text)
    values = chosen_values(symbolic.constants, constants, needed=reachable_names([body], definitions), shown=shown)
    problem = build(symbolic, values)
    definitions |= {name: text_of_value(value) for name, value in values.items()}
    return replace(problem, definitions=definitions)


def _check_kind(text: str, shown: str) -> None:
    """Refuse what is neither MDP nor DTMC; a program without a keyword is an MDP."""
    found = _KEYWORD.search(text)
    if found is not None:
        raise SourceError(
            f"A model must be an MDP or a DTMC, but '{shown}' {_REFUSED[found[1]]}.", path=shown, kind=found[1]
        )


def _definitions(text: str) -> tuple[dict[str, str], str]:
    """Return the constants and formulas by name, and the text without them."""
    definitions = {}
    for found in _DECLARED.finditer(text):
        body = found["value"] if found["constant"] else found["body"]
        if body is not None:
            definitions[found["constant"] or found["formula"]] = " ".join(body.split())
    return definitions, _DECLARED.sub(" ", text)


def _declared_variables(text: str) -> tuple[str, ...]:
    """Return the state variables in PRISM's order: global ones, then those of the modules, as they are declared."""
    found = []
    by_module: dict[str, list[str]] = {}
    for module in _MODULE.finditer(text):
        if module["base"] is None:
            own = _VARIABLE.findall(module["body"])
        else:
            pairs = [pair.partition("=") for pair in module["renamed"].split(",")]
            renamed = {old.strip(): new.strip() for old, _, new in pairs}
            own = [renamed.get(name, name) for name in by_module.get(module["base"], [])]
        by_module[module["name"]] = own
        found += own
    return (*_VARIABLE.findall(_MODULE.sub(" ", text)), *found)

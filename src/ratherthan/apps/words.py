"""A TOML file of words enters, a Lexicon leaves: it goes before the words that the model has."""

from __future__ import annotations

import difflib
import re
import tomllib
import unicodedata
from collections.abc import Collection, Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, NoReturn

from ratherthan.errors import QuestionError, SourceError
from ratherthan.model.lexicon import OBJECTIVE_WORDS, Lexicon

if TYPE_CHECKING:
    from ratherthan.model.mdp import MDP

__all__ = ["lexicon_from", "read_lexicon", "strangers"]

TEXTS = ("language", "state")
TABLES = ("actions", "gerunds", "states")
PLACEHOLDER = re.compile(r"\{([^{}]*)\}")
PLACEHOLDERS = ("number", "name")
MOST_LISTED = 5


def read_lexicon(path: str, beneath: Lexicon) -> Lexicon:
    """Return the lexicon of a TOML file, over another one.

    Parameters
    ----------
    path : str
        With the keys of `Lexicon`: language, state; the tables actions, gerunds, states, objectives.
    beneath : Lexicon
        Speaks where the file says nothing.

    Raises
    ------
    SourceError
        Where the file cannot be read, or has a key or value that a lexicon cannot have.
    """
    from ratherthan.io._files import open_source

    with open_source(path, "a lexicon") as file:
        try:
            table = tomllib.loads(file.read().decode("utf-8-sig"))
        except UnicodeDecodeError as error:
            raise SourceError(
                f"A lexicon must be text in UTF-8, but '{path}' is not, at byte {error.start}. Save it as UTF-8.",
                path=path,
            ) from error
        except (tomllib.TOMLDecodeError, RecursionError) as error:
            raise SourceError(f"A lexicon must be in TOML, but '{path}' is not: {error}.", path=path) from error
    return lexicon_from(table, path, beneath)


def lexicon_from(table: Mapping[str, Any], path: str, beneath: Lexicon) -> Lexicon:
    """Return the lexicon of a table that was read from `path`, over another one."""
    _check_keys(table, [field.name for field in fields(Lexicon)], path, "a lexicon")
    given: dict[str, Any] = {}
    for key in TEXTS:
        if key in table:
            given[key] = _text(table[key], path, key)
    for placeholder in PLACEHOLDER.findall(given.get("state", "")):
        if placeholder not in PLACEHOLDERS:
            _fail(path, f"'state' may have the placeholders {{number}} and {{name}}, got '{{{placeholder}}}'.")
    for key in TABLES:
        if key in table:
            given[key] = {**getattr(beneath, key), **_texts(table[key], path, key)}
    if "objectives" in table:
        given["objectives"] = {**beneath.objectives}
        for name, words in _table(table["objectives"], path, "objectives").items():
            where = f"objectives.{name}"
            _check_keys(_table(words, path, where), OBJECTIVE_WORDS, path, where)
            given["objectives"][name] = {**beneath.objectives.get(name, {}), **_texts(words, path, where)}
    return replace(beneath, **given)


def strangers(lexicon: Lexicon, mdp: MDP) -> str:
    """Return a sentence on the actions and states of a lexicon that a model does not have, empty where it has them all."""
    unknown = [f"action '{name}'" for name in {**lexicon.actions, **lexicon.gerunds} if name not in mdp.actions]
    unknown += [f"state '{name}'" for name in lexicon.states if not _is_state(name, mdp)]
    if not unknown:
        return ""
    more = f" and {len(unknown) - MOST_LISTED} more" if len(unknown) > MOST_LISTED else ""
    return f"The lexicon has words for what the model does not have: {', '.join(unknown[:MOST_LISTED])}{more}."


def _is_state(name: str, mdp: MDP) -> bool:
    from ratherthan.model.states import state_number

    try:
        state_number(mdp, name)
    except QuestionError:
        return False
    return True


def _check_keys(table: Mapping[str, Any], known: Collection[str], path: str, what: str) -> None:
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            hint = f" Did you mean '{near[0]}'?" if near else ""
            _fail(path, f"The keys of {what} must be among {', '.join(known)}; got '{key}'.{hint}")


def _table(value: object, path: str, key: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        _fail(path, f"'{key}' must be a table, got {value!r}.")
    return value


def _texts(value: object, path: str, key: str) -> dict[str, str]:
    return {name: _text(text, path, f"{key}.{name}") for name, text in _table(value, path, key).items()}


def _text(value: object, path: str, key: str) -> str:
    if not isinstance(value, str):
        _fail(path, f"'{key}' must be a text in quotes, got {value!r}.")
    if any(unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp") for character in value):
        _fail(path, f"'{key}' must be one line without control characters.")
    return value


def _fail(path: str, sentence: str) -> NoReturn:
    raise SourceError(f"{sentence} It stands in '{path}'.", path=path)

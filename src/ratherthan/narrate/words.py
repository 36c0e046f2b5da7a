"""An Explanation's names and lexicon enter, the phrases for actions, states and the objective leave."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from ratherthan.errors import InputError
from ratherthan.explain.explanation import Explanation, ObjectiveRecord
from ratherthan.narrate import english

__all__ = ["Language", "Vocabulary", "language", "vocabulary"]


@dataclass(frozen=True, kw_only=True)
class Language:
    """The templates of a language and its rules."""

    templates: Mapping[str, Any]
    gerund: Callable[[str], str]
    joined: Callable[[Sequence[str], str], str]
    verb_phrase_after: Callable[[str, str], str]
    qualified: Callable[[str, str], str]


@cache
def language(code: str) -> Language:
    """Return a language by its code.

    Raises
    ------
    InputError
        If there are no templates for it.
    """
    if code != "en":
        raise InputError(f"The language must be one of: en; got '{code}'.", language=code)
    text = resources.files("ratherthan.narrate").joinpath("templates", "en.toml").read_text(encoding="utf-8")
    return Language(
        templates=tomllib.loads(text),
        gerund=english.gerund,
        joined=english.joined,
        verb_phrase_after=english.verb_phrase_after,
        qualified=english.qualified,
    )


@dataclass(frozen=True, kw_only=True)
class Vocabulary:
    """The words of one explanation.

    Parameters
    ----------
    explanation : Explanation
    language : Language
    objective : mapping of str to str
        The objective's words: best, best_flexible, among, better, worse, equal, noun.
    """

    explanation: Explanation
    language: Language
    objective: Mapping[str, str]

    def table(self, name: str) -> Mapping[str, Any]:
        """Return one table of the templates."""
        found: Mapping[str, Any] = self.language.templates[name]
        return found

    def act(self, action: str) -> str:
        """Return the verb phrase of an action: the lexicon's, else the common one, else "take NAME"."""
        given = self.explanation.lexicon.actions
        base, number = _without_number(action)
        common = self.table("actions")
        for name in (action, base):
            if name in given or name in common:
                phrase: str = given.get(name) or common[name]
                return f"{phrase}{number}" if name != action else phrase
        return str(self.table("phrases")["action"]).format(name=action)

    def doing(self, action: str) -> str:
        """Return the same as a gerund phrase: "moving east"."""
        base, number = _without_number(action)
        given = self.explanation.lexicon.gerunds
        if action in given or base in given:
            return given.get(action) or given[base] + number
        return self.language.gerund(self.act(action))

    def alternatives(self, actions: Sequence[str], word: str = "or") -> str:
        """Return several actions as one phrase: "moving east or moving north"."""
        return self.language.joined([self.doing(action) for action in actions], word)

    def place(self, state: int) -> str:
        """Return the noun phrase of a state."""
        lexicon, record = self.explanation.lexicon, self.explanation.states[state]
        single = lexicon.states.get(record.name) or lexicon.states.get(str(state))
        if single:
            return single
        phrases = self.table("phrases")
        if lexicon.state:
            template = lexicon.state
        elif not record.named:
            template = phrases["state_number"]
        else:
            template = phrases[_phrase_of(record.name)]
        return template.replace("{number}", str(state)).replace("{name}", record.name)

    def places(self, states: Sequence[int], total: int | None = None, most: int = 5) -> str:
        """Return a list of states in words, shortened to `most`, of `total` in all."""
        total = len(states) if total is None else total
        shown = [self.place(state) for state in (states if total <= most else states[: most - 1])]
        if total > len(shown):
            shown.append(self.table("route")["more_places"].format(count=total - len(shown)))
        return self.language.joined(shown, "and")


MOST_VARIABLES = 6
"""A state with more variables than these is called by its number alone: nobody reads twenty values in a sentence."""


def _phrase_of(name: str) -> str:
    variables = name.count("=")
    if name.strip("+-. ").isdigit():
        return "state_variables"  # a name that could be taken for a number stands beside the number
    return "state_name" if not variables else "state_variables" if variables <= MOST_VARIABLES else "state_number"


def _without_number(action: str) -> tuple[str, str]:
    """Split " (2)" off, which tells equal names in one state apart."""
    match = re.fullmatch(r"(.*?)( \(\d+\))", action)
    return (match[1], match[2]) if match else (action, "")


def vocabulary(explanation: Explanation) -> Vocabulary:
    """Return the words of an explanation: its lexicon's, and the language's where that says nothing."""
    spoken = language(explanation.lexicon.language)
    objective = _objective_words(explanation.objective, spoken.templates["objectives"])
    own = explanation.lexicon.objectives.get(_own_key(explanation.objective), {})
    return Vocabulary(explanation=explanation, language=spoken, objective={**objective, **own})


def _own_key(objective: ObjectiveRecord) -> str:
    return (objective.reward or "steps") if objective.kind == "cost" else objective.kind


def _objective_words(objective: ObjectiveRecord, tables: Mapping[str, Any]) -> dict[str, str]:
    direction = "max" if objective.maximise else "min"
    reward = objective.reward or ""
    key = _own_key(objective).lower() if objective.kind == "cost" else objective.kind
    known = objective.kind != "cost" or key in ("distance", "time", "steps")
    words: Mapping[str, str] = tables[key if known else "cost"][direction]
    return {name: text.replace("{reward}", reward.replace("_", " ")) for name, text in words.items()}

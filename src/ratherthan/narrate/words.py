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
from ratherthan.model.lexicon import Lexicon
from ratherthan.narrate import english
from ratherthan.narrate.naming import goals_in_words, told_apart

__all__ = ["Language", "Vocabulary", "language", "vocabulary"]


@dataclass(frozen=True, kw_only=True)
class Language:
    """The templates of a language and its rules."""

    templates: Mapping[str, Any]
    gerund: Callable[[str], str]
    joined: Callable[[Sequence[str], str], str]
    verb_phrase_after: Callable[[str, str], str]
    qualified: Callable[[str, str], str]
    shortened: Callable[[str], str]
    counted: Callable[[str], str]
    names_several_cells: Callable[[str], bool]


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
        shortened=english.shortened,
        counted=english.counted,
        names_several_cells=english.names_several_cells,
    )


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """An objective, its words (best, best_flexible, among, better and so on, as the templates list), and its goal in words."""

    record: ObjectiveRecord
    words: Mapping[str, str]
    goal: str | None = None


@dataclass(frozen=True, kw_only=True)
class Vocabulary:
    """The words of one explanation.

    Parameters
    ----------
    explanation : Explanation
    language : Language
    objectives : tuple of Wanted
        Words for each level of the objective, then for each further objective.
    """

    explanation: Explanation
    language: Language
    objectives: tuple[Wanted, ...]

    @property
    def objective(self) -> Mapping[str, str]:
        """The words of the first level."""
        return self.objectives[0].words

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
        return str(self.table("phrases")["action"]).format(name=_in_one_line(action))

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
        phrases, name = self.table("phrases"), _in_one_line(record.name)
        if lexicon.state:
            template = lexicon.state
        elif not record.named or not name:
            template = phrases["state_number"]
        else:
            template = phrases[_phrase_of(name)]
        return template.replace("{number}", str(state)).replace("{name}", name)

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


def _in_one_line(name: str) -> str:
    """Return a name without line breaks, and without blanks around it: the text of an explanation is one line."""
    return " ".join(part.strip() for part in name.splitlines()).strip()


def _without_number(action: str) -> tuple[str, str]:
    """Split " (2)" off, which tells equal names in one state apart."""
    match = re.fullmatch(r"(.*?)( \(\d+\))", action)
    return (match[1], match[2]) if match else (action, "")


def vocabulary(explanation: Explanation) -> Vocabulary:
    """Return the words of an explanation: its lexicon's, and the language's where that says nothing."""
    spoken = language(explanation.lexicon.language)
    records = (*explanation.levels, *(further.objective for further in explanation.also))
    lexicon, shorten = explanation.lexicon, spoken.shortened
    properties, phrases = _properties(explanation), spoken.templates["phrases"]
    goals = goals_in_words(properties, phrases)
    others = _other_goals(records, goals)
    words = [
        _objective_words(record, spoken.templates, lexicon, shorten, other)
        for record, other in zip(records, others, strict=True)
    ]
    words = told_apart(words, properties, goals, phrases)
    return Vocabulary(
        explanation=explanation,
        language=spoken,
        objectives=tuple(
            Wanted(record=record, words=own, goal=goal) for record, own, goal in zip(records, words, goals, strict=True)
        ),
    )


def _other_goals(records: Sequence[ObjectiveRecord], goals: Sequence[str | None]) -> list[str | None]:
    """Return the goal of each chance to arrive that must be called by its goal; None for those that need not be."""
    likely = [record.kind in ("probability", "safety") for record in records]
    known = {goal for goal, chance in zip(goals, likely, strict=True) if chance and goal is not None}
    return [
        goal if chance and (i or likely[0]) and known - {goals[0]} else None
        for i, (goal, chance) in enumerate(zip(goals, likely, strict=True))
    ]


def _properties(explanation: Explanation) -> list[str]:
    """Return the property of each level, then of each further objective."""
    levels = re.split(r"(?<=\])\s*then\s+", explanation.property) if len(explanation.levels) > 1 else []
    own = levels if len(levels) == len(explanation.levels) else [explanation.property] * len(explanation.levels)
    return [*own, *(further.property for further in explanation.also)]


_LISTED = ("distance", "time", "steps", "risk", "collisions")


def _objective_words(
    record: ObjectiveRecord,
    templates: Mapping[str, Any],
    lexicon: Lexicon,
    shorten: Callable[[str], str],
    goal: str | None,
) -> dict[str, str]:
    """Return the words of an objective, those of a lexicon first; `goal` is what it is called by, if it is."""
    direction = "max" if record.maximise else "min"
    if record.kind in ("cost", "reward"):
        key = record.reward or "steps"
        words = templates["rewards"][_table_of(key)][direction]
    else:
        key = record.kind
        words = templates["objectives"][key][direction]
    own = lexicon.objectives.get(key, {})
    short = {f"{name}_one": shorten(own[name]) for name in ("best", "among", "better", "worse") if name in own}
    words = {**words, **short}
    for name in ("up_to", "up_to_short"):
        words[name] = templates["phrases"][f"{name}_chance" if record.chance else name]
    arriving = templates["arriving"]
    ways = arriving.get(record.kind, arriving["usual"])
    if goal is not None:
        ways = {
            **ways,
            **{name: text.replace("{goal}", goal) for name, text in arriving[f"other_{record.kind}"].items()},
        }
    filled = {name: text.replace("{arrive}", ways["arrive"]) for name, text in words.items()} | ways
    reward, formula = _reward_in_words(record.reward, templates["phrases"]), (record.formula or "").replace('"', "")
    plain = {
        name: text.replace("{reward}", reward).replace("{formula}", formula) if "{" in text else text
        for name, text in filled.items()
    }
    return {**plain, **own}


def _table_of(reward: str) -> str:
    """Return which table of words belongs to a reward."""
    name = reward.lower()
    if name in _LISTED:
        return name
    return "count" if re.fullmatch(r"[\w ]*[^\W\d_]{2}s", name) and not name.endswith(("ss", "us", "is")) else "other"


def _reward_in_words(reward: str | None, phrases: Mapping[str, str]) -> str:
    """Return a reward as words: "distance plus 10 times risk"."""
    if reward is None:
        return phrases["steps"]
    return reward.replace("_", " ").replace(" + ", phrases["plus"]).replace(" * ", phrases["times"])

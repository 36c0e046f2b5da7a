"""Trade-offs enter, their sentences leave: what each step from one plan to the next gains and costs, and what a bound allows."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from ratherthan.model.objective import Level
from ratherthan.narrate.numbers import percent
from ratherthan.narrate.words import language
from ratherthan.solve.pareto import Bounded, Trade, Tradeoffs
from ratherthan.solve.weighing import STEPS, called

__all__ = ["bound_lines", "rounded", "trade_lines", "weight_head", "weight_range"]

DIGITS = 4
"""How many digits of a number are said."""
MOST_COINS = 3
"""At how many states it is said what is left to chance; more are counted."""
CERTAIN = 1e-6
"""Up to which relative gap between what is attained and what is proved to be best it is called best."""


@cache
def _templates(code: str) -> Mapping[str, Any]:
    language(code)  # refuses what there are no templates for
    text = resources.files("ratherthan.narrate").joinpath("templates", f"tradeoffs.{code}.toml")
    return tomllib.loads(text.read_text(encoding="utf-8"))


def rounded(value: float) -> str:
    """Return a number in four digits.

    Examples
    --------
    >>> rounded(13.7499999), rounded(0.2), rounded(123456.7), rounded(2e-7)
    ('13.75', '0.2', '123500', '2e-07')
    """
    if value == 0 or not 1e-5 <= abs(value) < 1e9:
        return f"{value:.{DIGITS}g}"
    return np.format_float_positional(float(f"{value:.{DIGITS}g}"), trim="-")


def exact(value: float) -> str:
    """Return a number that a person gave, as it was given."""
    return f"{value:g}" if float(f"{value:g}") == value else repr(value)


def trade_lines(found: Tradeoffs) -> list[str]:
    """Return a sentence for each step between plans, and what there is to say of plans that are not there.

    Parameters
    ----------
    found : Tradeoffs

    Returns
    -------
    list of str
    """
    words = _templates(found.problem.lexicon.language)
    if not found.plans:
        return [words["plans"]["none"].format(place=_place(found, found.start))]
    lines = [_step(found, trade, words["step"]) for trade in found.trades]
    return [words["plans"]["one"]] if len(found.plans) == 1 else lines


def _step(found: Tradeoffs, trade: Trade, words: Mapping[str, Any]) -> str:
    first, other = found.objectives[0], found.objectives[trade.objective]
    return str(words["step" if trade.complete else "open"]).format(
        gain=words["gain"][_way(other)].format(number=rounded(trade.gain), name=_name(other)),
        price=words["price"][_way(first)].format(number=rounded(trade.price), name=_name(first)),
        origin=trade.origin + 1,
        target=trade.target + 1,
        partings=_partings(found, trade, words),
    )


def _partings(found: Tradeoffs, trade: Trade, words: Mapping[str, Any]) -> str:
    """Return what the second plan does where the two part, if that is at one state; else at how many they part."""
    if len(trade.partings) != 1:
        return str(words["parts"]).format(count=len(trade.partings)) if trade.partings else ""
    state, mdp = trade.partings[0], found.problem.mdp
    foil, act = (
        _act(found, mdp.action_name(int(found.plans[place].policy.choice[state])))
        for place in (trade.origin, trade.target)
    )
    shortened = language(found.problem.lexicon.language).verb_phrase_after(foil, act)
    return str(words["part"]).format(act=act, foil=shortened, place=_place(found, state))


def _way(objective: Level) -> str:
    """Return which words an objective takes."""
    if objective.maximise:
        return "max"
    return "steps" if called(objective) == STEPS else "min"


def _name(objective: Level) -> str:
    return called(objective).replace("_", " ")


def weight_head(found: Tradeoffs, objective: int) -> str:
    """Return what the weights of one objective mean: "best for least distance + W * risk"."""
    words = _templates(found.problem.lexicon.language)["weights"]
    first, other = found.objectives[0], found.objectives[objective]
    together = words["sum"]["plus" if first.maximise == other.maximise else "minus"]
    total = together.format(first=_name(first), name=_name(other))
    return str(words["head"]["max" if first.maximise else "min"]).format(sum=total)


def weight_range(found: Tradeoffs, place: int, objective: int) -> str:
    """Return for which weights of an objective a plan is known to be best: "W from 2.778 to 12.5"."""
    words = _templates(found.problem.lexicon.language)["weights"]
    weights = found.plans[place].weights[objective]
    if weights is None:
        return str(words["none"])
    low, high = weights
    other = found.objectives[objective]
    if low == np.inf:  # for no weight that there is: for the other objective alone
        return str(words["alone"][_way(other)]).format(name=_name(other))
    key = "only" if low == high else "onward" if high == np.inf else "up_to" if low == 0 else "between"
    if low == 0 and high == np.inf:
        key = "all"
    return str(words[key]).format(low=rounded(low), high=rounded(high))


def bound_lines(found: Tradeoffs) -> list[str]:
    """Return what is to be said of the bound, nothing where there is none.

    Parameters
    ----------
    found : Tradeoffs

    Returns
    -------
    list of str
    """
    bounded = found.bounded
    if bounded is None:
        return []
    words = _templates(found.problem.lexicon.language)["bound"]
    kept, limited = found.objectives[bounded.objective], found.objectives[bounded.limited]
    limit = words["limit"][_way(limited)].format(name=_name(limited), bound=exact(bounded.bound))
    if bounded.plan is None:
        return [words["refused"][_way(limited)].format(limit=limit, nearest=rounded(bounded.nearest))]
    value = float(bounded.plan.values[bounded.objective])
    proved = abs(value - bounded.best) <= CERTAIN * abs(value) + 1e-12
    sentence = words["value" if proved else "open"][_way(kept)]
    return [sentence.format(limit=limit, name=_name(kept), value=rounded(value)), *_coins(found, bounded, words)]


def _coins(found: Tradeoffs, bounded: Bounded, words: Mapping[str, Any]) -> list[str]:
    """Return what the plan does where it tosses a coin."""
    assert bounded.plan is not None
    mdp = found.problem.mdp
    chances = bounded.plan.policy.weights(mdp)
    if len(bounded.coins) > MOST_COINS:
        return [words["coins"].format(count=len(bounded.coins))]
    lines = []
    for state in bounded.coins:
        taken = [choice for choice in mdp.choices_of(state) if chances[choice] > 0.0]
        shares = [
            words["share"].format(act=_act(found, mdp.action_name(choice)), percent=percent(float(chances[choice])))
            for choice in taken
        ]
        listed = language(found.problem.lexicon.language).joined(shares, "and")
        lines.append(words["coin"].format(place=_place(found, state), shares=listed))
    return lines


def _place(found: Tradeoffs, state: int) -> str:
    """Return the noun phrase of a state."""
    lexicon, name = found.problem.lexicon, found.problem.mdp.names[state]
    single = lexicon.states.get(name) or lexicon.states.get(str(state))
    if single:
        return single
    phrases = language(lexicon.language).templates["phrases"]
    named = found.problem.mdp.names.named
    template = lexicon.state or phrases["state_variables" if named else "state_number"]
    return str(template).replace("{number}", str(state)).replace("{name}", name)


def _act(found: Tradeoffs, action: str) -> str:
    """Return the verb phrase of an action."""
    templates = language(found.problem.lexicon.language).templates
    phrase = found.problem.lexicon.actions.get(action) or templates["actions"].get(action)
    return str(phrase or templates["phrases"]["action"].format(name=action))

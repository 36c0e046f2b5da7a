"""A sum without end enters, its discount leaves; without one, a refusal with the nearest question about the same reward."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model.formula import constant, resolved
from ratherthan.model.objective import Discounted, Objective, Threshold, levels_of
from ratherthan.model.problem import Problem
from ratherthan.model.temporal import Statement, refusal, with_example
from ratherthan.model.weights import canonical_reward, reward_of

__all__ = ["GOALS", "discount_of", "discount_taken", "fitting"]

GOALS = ("goal", "target", "destination")
"""What a goal is mostly called."""
_ASKED = re.compile(
    r'\s*(?:"[^"\n]*"\s*:)?\s*R\s*(?P<front>min|max)?\s*\{\s*"(?P<reward>[^"\n]+)"\s*\}\s*(?P<way>min|max)?'
)


def discount_of(said: Statement, reward: str | None, problem: Problem, given: float | None) -> float:
    """Return the discount that a sum without end has or is given.

    Parameters
    ----------
    said : Statement
    reward : str, optional
        The reward that it is about; None counts steps.
    problem : Problem
    given : float, optional
        What is said beside the property.

    Raises
    ------
    PropertyError
        For two that differ, and for one that is none.
    NotExplainableError
        Where there is none.
    """
    path = said.path
    if path.args:
        own = constant(resolved(path.args[0], problem.definitions))
        if given is not None and given != own:
            raise PropertyError(f"A discount must be given once, got {own:g} in the property and {given:g} beside it.")
        given = own
    if given is None:
        raise refusal("total", example=_example(reward, said.way, problem))
    if not 0 < given < 1:
        raise PropertyError(f"A discount must lie between 0 and 1, both excluded, got {given:g}.", discount=given)
    return float(given)


def _example(reward: str | None, way: str, problem: Problem) -> tuple[str, str]:
    """Return how a question about a reward begins, and a path that can be explained: ``R{"gain"}max=?``, ``Fsure "goal"``."""
    head = "T" if reward is None else f'R{{"{reward}"}}'
    found = None if reward is None else reward_of(problem.mdp, reward)
    signed = found is not None and any((values < 0).any() for _, values in found.parts())
    goal = next((label for label in GOALS if label in problem.mdp.labels), GOALS[0])
    return f"{head}{way or 'min'}=?", f'{"Fsure" if signed or way == "max" else "F"} "{goal}"'


def fitting(error: NotExplainableError, text: str, problem: Problem) -> NotExplainableError:
    """Return a refusal whose example is about the reward that the property names, where it names one of the model's."""
    asked = _ASKED.match(text)
    reward = None if asked is None else canonical_reward(asked["reward"], problem.mdp.rewards)
    if asked is None or reward is None:
        return error
    return with_example(error, _example(reward, asked["way"] or asked["front"] or "", problem))


def discount_taken(wishes: Iterable[Objective | Threshold], discount: float | None) -> None:
    """Raise PropertyError where a discount is given that none of the wishes has.

    Parameters
    ----------
    wishes : iterable of objectives
        As they were read with the discount.
    discount : float, optional
    """
    objectives = [wish.objective if isinstance(wish, Threshold) else wish for wish in wishes]
    levels = [level for objective in objectives for level in levels_of(objective)]
    if discount is None or any(isinstance(level, Discounted) and level.discount == discount for level in levels):
        return
    raise PropertyError(
        f'A discount must come with a sum without end, such as R{{"reward"}}max=? [C], got '
        f"{', '.join(repr(objective.text) for objective in objectives)} and the discount {discount:g}."
    )

"""A level of an objective and a problem enter, its Frame leaves: where it ends, what counts, and among which choices."""

from __future__ import annotations

import numpy as np

from ratherthan.errors import ExplanationError
from ratherthan.model.formula import states_where
from ratherthan.model.mdp import Bools
from ratherthan.model.objective import Discounted, ExpectedCost, ExpectedReward, Level, Mission
from ratherthan.model.problem import Problem
from ratherthan.verify.frame import Frame
from ratherthan.verify.prices import prices_of

__all__ = ["frame_of"]


def frame_of(problem: Problem, level: Level) -> Frame:
    """Return a level on a problem's model; a mission on the product that it was unfolded into.

    Parameters
    ----------
    problem : Problem
    level : objective

    Raises
    ------
    PropertyError
        For a formula that does not fit the model.
    ExplanationError
        For a reward that the model has not, or that cannot be added up.
    """
    mdp = problem.mdp
    nowhere = np.zeros(mdp.states, dtype=np.bool_)
    if isinstance(level, Mission):
        done, failed = _ends_of(problem, level)
        return Frame(mdp=mdp, maximise=level.maximise, target=done, out=failed)
    if isinstance(level, Discounted):
        prices = prices_of(mdp, level.reward)
        return Frame(
            mdp=mdp, maximise=level.maximise, target=nowhere, out=nowhere, prices=prices, discount=level.discount
        )
    target = states_where(mdp, level.goal, problem.definitions)
    if isinstance(level, ExpectedReward):
        prices = prices_of(mdp, level.reward)
        return Frame(mdp=mdp, maximise=level.maximise, target=target, out=nowhere, prices=prices, demanding=True)
    if isinstance(level, ExpectedCost):
        prices = prices_of(mdp, level.reward)
        if (prices.signs < 0).any():
            choice = int(np.argmin(prices.signs))
            raise ExplanationError(
                f"A reward that is added up until a goal must not be negative, but '{level.reward}' is at choice {choice}. "
                "Such a model has no explanation for this property.",
                choice=choice,
            )
        return Frame(mdp=mdp, maximise=level.maximise, target=target, out=nowhere, prices=prices)
    out = nowhere if level.through is None else ~states_where(mdp, level.through, problem.definitions) & ~target
    return Frame(mdp=mdp, maximise=level.maximise, target=target, out=out)


def _ends_of(problem: Problem, mission: Mission) -> tuple[Bools, Bools]:
    """Return where a mission is done, and where it has failed, on a product that was unfolded for it."""
    product = problem.unfolding
    if product is None:
        raise ExplanationError(f"A mission must be judged on its product, got '{mission.text}' on another model.")
    if product.mission.formula == mission.formula:
        return product.satisfied, product.violated
    done, failed = _ends_of(product.origin, mission)
    return done[product.state], failed[product.state]

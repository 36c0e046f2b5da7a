"""One choice per state, or a chance per choice, enters; a Policy leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ratherthan.errors import PolicyError
from ratherthan.model.mdp import MDP, Floats, Ints

__all__ = ["Policy", "check_policy"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Policy:
    """What is chosen in each state.

    Parameters
    ----------
    choice : array of int, ``[S]``
        The choice taken in each state (a row of the model, not an index within the state); -1 where nothing is said, or
        where `chance` decides.
    chance : array of float, ``[C]``, optional
        For a randomised policy: the probability of each choice given its state; each state sums to 1, or to 0 where
        nothing is said.
    """

    choice: Ints  # [S]
    chance: Floats | None = None  # [C]

    def weights(self, mdp: MDP) -> Floats:
        """Return the probability of each choice given its state, ``[C]``."""
        if self.chance is not None:
            return self.chance
        weights = np.zeros(mdp.choices)
        weights[self.choice[self.choice >= 0]] = 1.0
        return weights


def check_policy(mdp: MDP, policy: Policy) -> None:
    """Raise PolicyError where `policy` does not fit `mdp`: shapes, foreign choices, chances that do not sum to 1."""
    if policy.choice.shape != (mdp.states,):
        raise PolicyError(f"A policy must have one entry per state ({mdp.states}), got {policy.choice.shape}.")
    said = np.flatnonzero(policy.choice >= 0)
    chosen = policy.choice[said]
    foreign = (chosen < mdp.state_to_choices[said]) | (chosen >= mdp.state_to_choices[said + 1])
    if foreign.any():
        state = int(said[np.argmax(foreign)])
        own = mdp.choices_of(state)
        raise PolicyError(
            f"A policy must take a choice of the state itself: state {state} has choices {own.start} … {own.stop - 1}, "
            f"got {int(policy.choice[state])}.",
            state=state,
        )
    if policy.chance is None:
        return
    chance = policy.chance
    if chance.shape != (mdp.choices,) or not ((chance >= 0) & (chance <= 1 + 1e-9)).all():
        raise PolicyError(f"A randomised policy must have one probability per choice ({mdp.choices}), between 0 and 1.")
    sums = np.add.reduceat(chance, mdp.state_to_choices[:-1])
    wrong = np.flatnonzero((np.abs(sums - 1) > 1e-9) & (sums != 0))
    if len(wrong):
        raise PolicyError(
            f"The probabilities of a state's choices must sum to 1, got {sums[wrong[0]]:.10g} at state {wrong[0]}.",
            state=int(wrong[0]),
        )

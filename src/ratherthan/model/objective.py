"""What is wanted of a plan, as data: a reward to keep small until a goal, or a chance to reach one.

Sets of states are kept as PRISM state formulas over labels (``"goal"``) and state variables (``x = 3 & !busy``), so that
an objective means the same on every representation of a model and survives a round trip through JSON.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["ExpectedCost", "Objective", "ReachAvoid", "Threshold"]


@dataclass(frozen=True, kw_only=True)
class ExpectedCost:
    """Minimise (maximise) the expected total of a reward until a goal: ``R{"r"}min=? [F g]``, ``R{"r"}max=? [F g]``.

    Minimised: over policies that reach the goal with probability 1, ∞ where none does. Maximised, it has PRISM's meaning:
    +∞ where the goal can be dodged. Rewards must not be negative.

    Parameters
    ----------
    goal : str
        A state formula.
    reward : str, optional
        The name of the reward; None counts steps (``Tmin=? [F g]``).
    maximise : bool
    """

    goal: str
    reward: str | None
    maximise: bool = False

    @property
    def text(self) -> str:
        """The objective in PRISM's property syntax."""
        what = "T" if self.reward is None else f'R{{"{self.reward}"}}'
        return f"{what}{'max' if self.maximise else 'min'}=? [F {self.goal}]"


@dataclass(frozen=True, kw_only=True)
class ReachAvoid:
    """Maximise (minimise) the probability to reach `goal` through `through` only: ``Pmax=? [!h U g]``.

    A minimised target is itself a hazard.

    Parameters
    ----------
    goal : str
        A state formula.
    through : str, optional
        A state formula that must hold until then; None where anything may (``F g``). States where neither holds are
        hazards: the objective ends there.
    maximise : bool
    """

    goal: str
    through: str | None = None
    maximise: bool = True

    @property
    def text(self) -> str:
        """The objective in PRISM's property syntax."""
        path = f"F {self.goal}" if self.through is None else f"{self.through} U {self.goal}"
        return f"P{'max' if self.maximise else 'min'}=? [{path}]"


Objective = ExpectedCost | ReachAvoid


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """A yes-or-no property: the value of an objective compared with a number, ``P>=0.9 [F g]``.

    ``P>=p`` must hold under every policy, so it compares the minimum (PRISM's meaning); ``Pmax>=p`` says it outright.
    """

    objective: Objective
    relation: str  # one of >=, >, <=, <
    bound: float

    @property
    def text(self) -> str:
        """The property in PRISM's syntax."""
        bound = f"{self.bound:g}" if float(f"{self.bound:g}") == self.bound else repr(self.bound)
        return self.objective.text.replace("=?", f"{self.relation}{bound}", 1)

"""What is wanted of a plan, as data: a reward to keep small or to gather, a chance to reach a goal, or several in order.

Sets of states are kept as PRISM state formulas over labels (``"goal"``) and state variables (``x = 3 & !busy``), so that
an objective means the same on every representation of a model and survives a round trip through JSON.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "Discounted",
    "ExpectedCost",
    "ExpectedReward",
    "Level",
    "Lexicographic",
    "Mission",
    "Objective",
    "ReachAvoid",
    "Threshold",
    "levels_of",
]


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
        return f"{_head(self.reward, maximise=self.maximise)} [F {self.goal}]"


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


@dataclass(frozen=True, kw_only=True)
class ExpectedReward:
    """Maximise (minimise) the expected total of a reward until a goal that must be reached: ``R{"r"}max=? [Fsure g]``.

    Over policies that reach the goal in a finite expected number of steps; where none does the value is -∞ (∞ where it is
    minimised). Rewards may have both signs. Where more and more can be gathered before the goal the value is ∞ (-∞). With rewards that are
    nowhere negative, minimised, it is the same as `ExpectedCost`.

    Parameters
    ----------
    goal : str
        A state formula.
    reward : str, optional
        The name of the reward; None counts steps.
    maximise : bool
    """

    goal: str
    reward: str | None
    maximise: bool = True

    @property
    def text(self) -> str:
        """The objective as a property; ``Fsure`` demands arrival."""
        return f"{_head(self.reward, maximise=self.maximise)} [Fsure {self.goal}]"


@dataclass(frozen=True, kw_only=True)
class Discounted:
    """Maximise (minimise) the expected discounted sum of a reward: ``R{"r"}max=? [Cdiscount=0.95]``.

    Parameters
    ----------
    reward : str, optional
        The name of the reward, of any sign; None counts steps.
    discount : float
        γ, above 0 and below 1: what is paid after k steps counts γᵏ.
    maximise : bool
    """

    reward: str | None
    discount: float
    maximise: bool = True

    @property
    def text(self) -> str:
        """The objective in Storm's property syntax."""
        return f"{_head(self.reward, maximise=self.maximise)} [Cdiscount={self.discount!r}]"


@dataclass(frozen=True, kw_only=True)
class Mission:
    """Maximise (minimise) the probability of what takes memory to tell: ``Pmax=? [F<=10 g]``, ``Pmax=? [F (a & (F b))]``.

    It is solved and explained on the product of the model with what must be remembered.

    Parameters
    ----------
    formula : str
        A co-safe formula of linear temporal logic with step bounds, over state formulas.
    maximise : bool
    """

    formula: str
    maximise: bool = True

    @property
    def text(self) -> str:
        """The objective in PRISM's property syntax."""
        return f"P{'max' if self.maximise else 'min'}=? [{self.formula}]"


Level = ExpectedCost | ExpectedReward | ReachAvoid | Discounted | Mission


@dataclass(frozen=True, kw_only=True)
class Lexicographic:
    """The first level first; of the choices that are best for it those that are best for the second, and so on.

    Parameters
    ----------
    levels : tuple of objectives
        At least two.
    """

    levels: tuple[Level, ...]

    @property
    def text(self) -> str:
        """The levels as properties with "then" between them."""
        return " then ".join(level.text for level in self.levels)


Objective = Level | Lexicographic


def levels_of(objective: Objective) -> tuple[Level, ...]:
    """Return the levels of a lexicographic objective; any other is its own only one."""
    return objective.levels if isinstance(objective, Lexicographic) else (objective,)


def _head(reward: str | None, *, maximise: bool) -> str:
    what = "T" if reward is None else f'R{{"{reward}"}}'
    return f"{what}{'max' if maximise else 'min'}=?"


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """A yes-or-no property: the value of an objective compared with a number, ``P>=0.9 [F g]``.

    ``P>=p`` must hold under every policy, so it compares the minimum (PRISM's meaning); ``Pmax>=p`` says it outright.
    """

    objective: Level
    relation: str  # one of >=, >, <=, <
    bound: float

    @property
    def text(self) -> str:
        """The property in PRISM's syntax."""
        bound = f"{self.bound:g}" if float(f"{self.bound:g}") == self.bound else repr(self.bound)
        return self.objective.text.replace("=?", f"{self.relation}{bound}", 1)

"""Questions, claims and explanations: the factors are turned into what can be said. There are no words here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ratherthan.explain.explanation import Claim, Evidence, Explanation, Judged, Measured, Step, Tally, Trade
from ratherthan.explain.question import FACTORS, KINDS, Question, question

if TYPE_CHECKING:
    from ratherthan.explain.explainer import explain, initial_state
    from ratherthan.explain.measures import Factors

__all__ = [
    "FACTORS",
    "KINDS",
    "Claim",
    "Evidence",
    "Explanation",
    "Factors",
    "Judged",
    "Measured",
    "Question",
    "Step",
    "Tally",
    "Trade",
    "explain",
    "initial_state",
    "question",
]


def __getattr__(name: str) -> Any:
    """Load what needs the solver only when it is asked for: a stored explanation is narrated without it."""
    if name == "Factors":
        from ratherthan.explain.measures import Factors

        return Factors
    if name in ("explain", "initial_state"):
        from ratherthan.explain import explainer

        return getattr(explainer, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

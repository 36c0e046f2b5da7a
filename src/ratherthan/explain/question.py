"""What a person asks enters, a checked Question leaves: which scope, which factors, about which state, against which action."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from ratherthan.errors import QuestionError
from ratherthan.factors import TOLERANCE, Search

__all__ = ["FACTORS", "KINDS", "Question", "question"]

FACTORS = ("selectiveness", "constrictiveness", "responsibility")

KINDS: dict[str, tuple[str, frozenset[str]]] = {
    "none": ("none", frozenset()),
    "naive-state": ("state", frozenset()),
    "responsibility": ("state", frozenset({"responsibility"})),
    "constrictive": ("state", frozenset({"constrictiveness"})),
    "naive-path": ("route", frozenset()),
    "selective": ("route", frozenset({"selectiveness"})),
    "contrastive": ("route", frozenset(FACTORS)),
}
"""The seven kinds of the paper as combinations of scope and factors."""


@dataclass(frozen=True, kw_only=True)
class Question:
    """What is asked of a plan.

    Parameters
    ----------
    kind : str
        One of the seven kinds, ``"rather-than"``, or ``"scope: factors"`` for another combination.
    scope : str
        ``"none"``, ``"state"`` or ``"route"``.
    factors : frozenset of str
        Of "selectiveness", "constrictiveness", "responsibility".
    state : int, optional
        The state asked about; None is the initial state.
    rather_than : str, optional
        The foil: another action (or "choice k") of the state.
    alpha : float
        Threshold of critical states, at least 0, in the objective's unit.
    omega : bool
        Take λ, critical states and ζ from the paper's impact ω instead of the action value q.
    policy_values : bool
        Judge single steps against ρ^π instead of the optimum.
    search : Search
        Settings of the search tree.
    tolerance : float
        The factor of τ in comparisons.
    detail : bool
        Say also what the alternatives would lead to.
    """

    kind: str
    scope: str
    factors: frozenset[str]
    state: int | None = None
    rather_than: str | None = None
    alpha: float = 0.0
    omega: bool = False
    policy_values: bool = False
    search: Search = field(default_factory=Search)
    tolerance: float = TOLERANCE
    detail: bool = False


def question(
    kind: str | None = None,
    *,
    scope: str | None = None,
    factors: Iterable[str] | None = None,
    state: int | None = None,
    rather_than: str | None = None,
    alpha: float = 0.0,
    omega: bool = False,
    policy_values: bool = False,
    search: Search | None = None,
    detail: bool = False,
) -> Question:
    """Build a Question from a kind, or from scope and factors.

    Parameters
    ----------
    kind : str, optional
        One of `KINDS`; "contrastive" if nothing else is said.
    scope, factors : optional
        Another combination: scope "state" or "route", any of `FACTORS`.
    state, rather_than, alpha, omega, policy_values, search, detail
        As in `Question`.

    Raises
    ------
    QuestionError
        For an unknown kind, scope or factor, a contradiction, or a threshold that is no number from 0 on.
    """
    if not (isinstance(alpha, int | float) and math.isfinite(alpha) and alpha >= 0):
        raise QuestionError(f"The threshold alpha must be a number from 0 on, got {alpha!r}.", alpha=alpha)
    if rather_than is not None:
        if kind is not None or scope not in (None, "state"):
            raise QuestionError("'rather than' asks about one state and one other action: leave kind and scope out.")
        kind, scope, chosen = "rather-than", "state", frozenset({"responsibility", "constrictiveness"})
        if factors is not None:
            chosen = _checked(factors)
    elif scope is not None or factors is not None:
        if kind is not None:
            raise QuestionError(f"Give either a kind or scope and factors, got kind '{kind}' and both.")
        scope = scope or ("route" if state is None else "state")
        if scope not in ("none", "state", "route"):
            raise QuestionError(f"The scope must be 'state' or 'route', got '{scope}'.")
        chosen = _checked(factors or ())
        kind = _kind_of(scope, chosen)
    else:
        kind = kind or "contrastive"
        if kind not in KINDS:
            raise QuestionError(f"The kind must be one of {', '.join(KINDS)}; got '{kind}'.", kind=kind)
        scope, chosen = KINDS[kind]
    return Question(
        kind=kind,
        scope=scope,
        factors=chosen,
        state=state,
        rather_than=rather_than,
        alpha=float(alpha),
        omega=omega,
        policy_values=policy_values,
        search=search or Search(),
        detail=detail,
    )


def _checked(factors: Iterable[str]) -> frozenset[str]:
    chosen = frozenset(factors)
    unknown = sorted(chosen - set(FACTORS))
    if unknown:
        raise QuestionError(f"Factors must be of {', '.join(FACTORS)}; got '{unknown[0]}'.", factor=unknown[0])
    return chosen


def _kind_of(scope: str, factors: frozenset[str]) -> str:
    for kind, combination in KINDS.items():
        if combination == (scope, factors):
            return kind
    return f"{scope}: {', '.join(f for f in FACTORS if f in factors) or 'no factors'}"

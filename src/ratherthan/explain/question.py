"""What a person asks enters, a checked Question leaves: which scope, which factors, about which state, against which action."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from ratherthan.errors import QuestionError
from ratherthan.factors import TOLERANCE, Search

__all__ = ["FACTORS", "KINDS", "RANKINGS", "Question", "question"]

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

RANKINGS = ("detour", "spread", "expected", "place")
"""By what the decisions are chosen that are told where not all are: see `ratherthan.explain.ranking`."""


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
    at_most : int, optional
        How many sentences about steps there may be; steps alike in a row are then told in one. None tells every step alone.
    ranking : str
        One of `RANKINGS`: which steps are told where there are more.
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
    at_most: int | None = None
    ranking: str = "detour"


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
    at_most: int | None = None,
    ranking: str | None = None,
) -> Question:
    """Build a Question from a kind, or from scope and factors.

    Parameters
    ----------
    kind : str, optional
        One of `KINDS`; "contrastive" if nothing else is said.
    scope, factors : optional
        Another combination: scope "state" or "route", any of `FACTORS`.
    state, rather_than, alpha, omega, policy_values, search, detail, at_most, ranking
        As in `Question`.

    Raises
    ------
    QuestionError
        For an unknown kind, scope, factor or ranking, a contradiction, a threshold that is no number from 0 on, or a number of
        sentences that is none from 1 on.
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
    _check_few(at_most, ranking, scope, kind)
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
        at_most=at_most,
        ranking=ranking or "detour",
    )


def _check_few(at_most: int | None, ranking: str | None, scope: str, kind: str) -> None:
    """Raise where it makes no sense how many sentences there may be, or which come first."""
    if ranking is not None and ranking not in RANKINGS:
        raise QuestionError(f"The ranking must be one of {', '.join(RANKINGS)}; got {ranking!r}.", ranking=ranking)
    if at_most is None:
        if ranking is not None:
            raise QuestionError(
                "A ranking must come with a number of sentences that there may be: give --at-most N, too (at_most=N in Python)."
            )
        return
    if isinstance(at_most, bool) or not isinstance(at_most, int) or at_most < 1:
        raise QuestionError(f"There may be at most N sentences, N a whole number from 1 on; got {at_most!r}.")
    if scope != "route":
        raise QuestionError(
            f"A number of sentences (--at-most) must be for a route, which has many steps; kind '{kind}' is not about one. "
            "Ask for naive-path, selective or contrastive."
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

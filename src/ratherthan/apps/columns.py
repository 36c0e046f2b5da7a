"""A solution and a question enter, the table of factors leaves as columns: a row per choice, in the model's order.

Columns are arrays; what is null has a mask. Names are made block by block, so that a table of millions of rows is never
held as text.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ratherthan.model.names import StateNames, spell

if TYPE_CHECKING:
    from ratherthan.explain import Factors
    from ratherthan.factors import Counts, Effort
    from ratherthan.model.mdp import MDP

__all__ = [
    "BLOCK",
    "KEYS",
    "Column",
    "action_words",
    "blocks",
    "counted_at",
    "factor_columns",
    "route_states",
    "state_names",
]

KEYS = (
    *("state", "state_name", "choice", "choice_index", "action", "impact", "action_value", "lower", "upper"),
    *("lambda_min", "lambda_max", "responsibility", "constrictiveness", "critical", "taken"),
)
BLOCK = 4096
FEW_CHOICES = 16
"""Up to so many choices of a state each is compared with all before it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """One column: an array, names or words by row, and where it is null."""

    values: npt.NDArray[Any]  # [C]; for names and words the index into these
    null: npt.NDArray[np.bool_] | None = None  # [C]
    names: StateNames | None = None
    words: Sequence[str] | None = None

    def rows(self, first: int, last: int) -> list[Any]:
        """Return rows `first` up to, not including, `last` as Python values; None where null."""
        part = self.values[first:last]
        if self.names is not None:
            return state_names(self.names, part)
        listed: list[Any] = part.tolist()
        if self.words is not None:
            listed = list(map(self.words.__getitem__, listed))
        if self.null is not None:
            listed = [None if gone else value for value, gone in zip(listed, self.null[first:last], strict=True)]
        return listed


def factor_columns(
    factors: Factors, states: Iterable[int] | None, counts: Counts | None = None, *, estimates: bool = False
) -> dict[str, Column]:
    """Return the columns of `KEYS`, and for objectives in order those of the further levels: ``action_value_2`` and so on.

    ``compared_2`` tells which choices the second level compares, those equal to the best at the first; the extremes and the
    responsibility of a further level are among these, and null for all others.

    Parameters
    ----------
    factors : Factors
    states : iterable of int, optional
        Where constrictiveness is counted: everywhere if None.
    counts : Counts, optional
        What was counted there; by default all of it.
    estimates : bool
        Add the columns ``constrictiveness_estimate`` and ``constrictiveness_estimate_error``, the standard error as a share.
    """
    from ratherthan.factors import Effort

    mdp, measures, solution = factors.solution.problem.mdp, factors.measures, factors.solution
    state = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
    choice = np.arange(mdp.choices)
    critical = factors.critical
    action, words = action_words(mdp)
    found = counts or counted_at(factors, states, Effort())
    lower, upper = measures.lower, measures.upper
    return {
        "state": Column(values=state),
        "state_name": Column(values=state, names=mdp.names),
        "choice": Column(values=choice),
        "choice_index": Column(values=choice - mdp.state_to_choices[state]),
        "action": Column(values=action, words=words),
        "impact": Column(values=measures.impact),
        "action_value": Column(values=measures.action_value),
        "lower": Column(values=lower, null=np.isneginf(lower) & ~np.isneginf(upper)),
        "upper": Column(values=upper, null=np.isposinf(upper) & ~np.isposinf(lower)),
        "lambda_min": Column(values=measures.lambda_min[state]),
        "lambda_max": Column(values=measures.lambda_max[state]),
        "responsibility": Column(values=measures.responsibility),
        "constrictiveness": _spread(mdp, found, found.lower, found.lower == found.upper),
        "critical": Column(values=critical.certain[state], null=(critical.possible & ~critical.certain)[state]),
        "taken": Column(values=solution.policy.weights(mdp) > 0),
        **({} if not estimates else _estimates(mdp, found)),
        **_further_levels(factors, state),
    }


def _further_levels(factors: Factors, state: npt.NDArray[np.int64]) -> dict[str, Column]:
    """Return the columns of the levels after the first."""
    found: dict[str, Column] = {}
    starts = factors.solution.problem.mdp.state_to_choices[:-1]
    for k, measures in enumerate(factors.levels[1:], start=1):
        certain, possible = factors.compared[k]
        open_ = np.logical_or.reduceat(certain != possible, starts)[state]
        apart = open_ | ~certain
        value = measures.action_value
        low = np.minimum.reduceat(np.where(certain, value, np.inf), starts)[state]
        high = np.maximum.reduceat(np.where(certain, value, -np.inf), starts)[state]
        with np.errstate(invalid="ignore"):
            share = np.where((value == low) | factors.ended[k][state], 0.0, value - low)
        columns = {
            "impact": Column(values=measures.impact),
            "action_value": Column(values=value),
            "lower": Column(values=measures.lower, null=np.isneginf(measures.lower) & ~np.isneginf(measures.upper)),
            "upper": Column(values=measures.upper, null=np.isposinf(measures.upper) & ~np.isposinf(measures.lower)),
            "compared": Column(values=certain, null=certain != possible),
            "lambda_min": Column(values=np.where(apart, 0.0, low), null=apart),
            "lambda_max": Column(values=np.where(apart, 0.0, high), null=apart),
            "responsibility": Column(values=np.where(apart, 0.0, share), null=apart),
        }
        found |= {f"{name}_{k + 1}": column for name, column in columns.items()}
    return found


def counted_at(factors: Factors, states: Iterable[int] | None, effort: Effort) -> Counts:
    """Return ε of the choices of `states`, of all if None, with no more work than is granted."""
    mdp = factors.solution.problem.mdp
    if states is None:
        return factors.counted(np.arange(mdp.choices), effort)
    own = [np.arange(mdp.state_to_choices[s], mdp.state_to_choices[s + 1]) for s in sorted(states)]
    return factors.counted(np.concatenate([np.zeros(0, dtype=np.int64), *own]), effort)


def _spread(mdp: MDP, counts: Counts, values: npt.NDArray[Any], known: npt.NDArray[np.bool_]) -> Column:
    """Return a column of what is known of the choices that were counted; null elsewhere."""
    column, null = np.zeros(mdp.choices, dtype=values.dtype), np.ones(mdp.choices, dtype=np.bool_)
    column[counts.choices], null[counts.choices] = values, ~known
    return Column(values=column, null=null)


def _estimates(mdp: MDP, counts: Counts) -> dict[str, Column]:
    """Return the columns of estimates: they are no counts, and their names say so."""
    return {
        "constrictiveness_estimate": _spread(mdp, counts, counts.estimate, counts.estimated),
        "constrictiveness_estimate_error": _spread(mdp, counts, counts.error, counts.estimated),
    }


def route_states(factors: Factors, start: int) -> set[int]:
    """Return the states of the route from `start`."""
    from ratherthan.explain.route import policy_graph, route_from

    return set(route_from(factors.solution, policy_graph(factors.solution), start).states)


def blocks(count: int, size: int = BLOCK) -> Iterator[tuple[int, int]]:
    """Yield (first, last) of the blocks of `count` rows; one empty block where there are none."""
    for first in range(0, max(count, 1), size):
        yield first, min(first + size, count)


def action_words(mdp: MDP) -> tuple[npt.NDArray[np.int64], list[str]]:
    """Return the shown name of every choice as a number, ``[C]``, into a list: what `MDP.action_name` says of one, for all."""
    state = np.repeat(np.arange(mdp.states), np.diff(mdp.state_to_choices))
    index = np.arange(mdp.choices) - mdp.state_to_choices[state]
    unnamed = mdp.choice_to_action < 0
    if any(not name for name in mdp.actions):
        unnamed |= np.array([not name for name in mdp.actions])[mdp.choice_to_action]
    widest = int(index[unnamed].max(initial=-1)) + 1
    spelled = [*mdp.actions, *(f"choice {k}" for k in range(widest))]
    code_of = {name: code for code, name in reversed(list(enumerate(spelled)))}
    same = np.array([code_of[name] for name in spelled], dtype=np.int64)
    code = same[np.where(unnamed, len(mdp.actions) + index, mdp.choice_to_action)]
    earlier = _earlier(state, index, code)
    again = np.flatnonzero(earlier)
    if len(again):
        pairs, at = np.unique(np.stack([code[again], earlier[again]]), axis=1, return_inverse=True)
        code[again] = len(spelled) + at.ravel()
        spelled += [f"{spelled[c]} ({k + 1})" for c, k in pairs.T.tolist()]
    return code, spelled


def _earlier(
    state: npt.NDArray[np.int64], index: npt.NDArray[np.int64], code: npt.NDArray[np.int64]
) -> npt.NDArray[np.int64]:
    """Return how many choices before it in its state have the code of each choice, ``[C]``."""
    earlier = np.zeros(len(code), dtype=np.int64)
    most = int(index.max(initial=0))
    if most <= FEW_CHOICES:
        for back in range(1, most + 1):
            earlier[back:] += (code[back:] == code[:-back]) & (index[back:] >= back)
        return earlier
    order = np.lexsort((code, state))
    begins = np.ones(len(order), dtype=bool)
    begins[1:] = (state[order][1:] != state[order][:-1]) | (code[order][1:] != code[order][:-1])
    starts = np.flatnonzero(begins)
    earlier[order] = np.arange(len(order)) - np.repeat(starts, np.diff([*starts, len(order)]))
    return earlier


def state_names(names: StateNames, states: npt.NDArray[Any]) -> list[str]:
    """Return the names of many states, column by column where they are made of variables."""
    if names.strings is not None:
        strings = names.strings
        return [str(strings[state]) for state in states.tolist()]
    if not names.variables:
        return list(map(str, states.tolist()))
    parts = []
    for name, column in names.variables.items():
        kept, at = np.unique(np.asarray(column)[states], return_inverse=True)
        shown = np.array([f"{name}={spell(value)}" for value in kept], dtype=object)
        parts.append(shown[at].tolist())
    return [", ".join(row) for row in zip(*parts, strict=True)]

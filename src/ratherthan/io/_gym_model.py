"""The entries of a transition table enter, an MDP leaves in which an episode that ends has come to a terminal state.

A table has no end: after an entry that says *terminated* nothing more is earned, though the state it leads to may have
rows of its own. Let T be the largest set of states such that every entry into a state of T, from a state outside T, says
terminated, and at least one does; initial states are not in T.

- A state of T becomes terminal: its rows are replaced by loops, one per action, that earn nothing.
- A state outside T that is also entered with *terminated* keeps its rows, and each such entry leads to a terminal state of
  its own instead. These are numbered from S on, after all states of the table, which keep their numbers.

Every policy then earns in the MDP what it earns in the episodes, and every value of the table is a value of the MDP.
Entries of one choice that lead to the same state are one branch: probabilities add up, rewards are averaged by them,
which leaves every expectation as it is.

Labels: ``terminal``; ``goal``, the terminal states that are entered with the largest reward of all terminal states;
``hazard``, the other terminal states. What an environment wants is the largest reward until an episode ends. Where all that is ever
earned is one reward for arriving, that is the largest probability to arrive, and is said so.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ratherthan.io._gym_entries import Numbers, Table
from ratherthan.io._rows import Rows, with_loops
from ratherthan.model.mdp import MDP, Bools, Floats, Reward
from ratherthan.model.objective import ExpectedReward, Objective, ReachAvoid

__all__ = ["Ended", "mdp_of", "objective_of"]

MOST_LISTED = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Ended:
    """A table whose episodes end in terminal states: ``[S']`` states, the table's own and those added.

    Parameters
    ----------
    table : Table
        The entries of states that are not terminal, with targets among all states.
    origin : array of int, ``[S']``
        The state of the original table that each state stands for.
    terminal : array of bool, ``[S']``
    own : int
        How many states the original table has; those added follow them.
    """

    table: Table
    origin: Numbers  # [S']
    terminal: Bools  # [S']
    own: int

    @staticmethod
    def of(table: Table, initial: Numbers) -> Ended:
        """Find out where episodes end."""
        own = np.zeros(table.states, dtype=np.bool_)
        own[table.target[table.terminated]] = True
        own[initial] = False
        while True:
            entered = table.target[~table.terminated & ~own[table.state]]
            if not own[entered].any():
                break
            own[entered] = False
        live = table.taken(~own[table.state])
        added = np.unique(live.target[live.terminated & ~own[live.target]])
        target = live.target.copy()
        apart = live.terminated & ~own[live.target]
        target[apart] = table.states + np.searchsorted(added, live.target[apart])
        return Ended(
            table=Table(
                states=table.states + len(added),
                actions=live.actions,
                state=live.state,
                action=live.action,
                target=target,
                probability=live.probability,
                reward=live.reward,
                terminated=live.terminated,
            ),
            origin=np.concatenate([np.arange(table.states), added]),
            terminal=np.concatenate([own, np.ones(len(added), dtype=np.bool_)]),
            own=table.states,
        )

    @property
    def added(self) -> Bools:
        """Which states were added, ``[S']``."""
        return np.arange(len(self.origin)) >= self.own

    @cached_property
    def goal(self) -> Bools:
        """Which terminal states are entered with the largest reward, ``[S']``."""
        ends, reward = self.table.target[self.table.terminated], self.table.reward[self.table.terminated]
        best = np.full(self.table.states, -np.inf)
        np.maximum.at(best, ends, reward)
        return np.asarray(self.terminal & (best == best.max()) & np.isfinite(best))

    @property
    def labels(self) -> dict[str, Bools]:
        """The labels, none where no episode ends."""
        if not self.terminal.any():
            return {}
        return {"terminal": self.terminal, "goal": self.goal, "hazard": self.terminal & ~self.goal}

    @cached_property
    def only_arrival_pays(self) -> bool:
        """Whether all that is ever earned is one and the same reward above 0, on every entry to a goal."""
        arrives = self.table.terminated & self.goal[self.table.target]
        paid = self.table.reward[arrives]
        return bool(len(paid) and paid.min() == paid.max() > 0 and not self.table.reward[~arrives].any())


def mdp_of(
    ended: Ended, initial: Numbers, actions: tuple[str, ...], names: object = None
) -> tuple[MDP, tuple[str, ...]]:
    """Return the MDP, and notes on what a reader should know of it.

    Parameters
    ----------
    ended : Ended
    initial : array of int, ``[I]``
    actions : tuple of str
        A name per action number.
    names : StateNames, optional
        Of all states, ``[S']``.

    Raises
    ------
    ModelError
        Where the table breaks a law, such as probabilities that do not sum to 1.
    """
    table, count = ended.table, ended.table.actions
    loops = np.flatnonzero(ended.terminal)
    row = np.concatenate([table.state * count + table.action, (loops[:, None] * count + np.arange(count)).ravel()])
    target = np.concatenate([table.target, np.repeat(loops, count)])
    chance = np.concatenate([table.probability, np.ones(len(loops) * count)])
    pair, first, inverse = np.unique(row * table.states + target, return_index=True, return_inverse=True)
    order = np.lexsort((first, pair // table.states))  # by choice, and in it as the table lists them
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    at = place[inverse]  # the branch of each entry
    probability: Floats = np.bincount(at, weights=chance, minlength=len(order)).astype(np.float64)
    paid = np.concatenate([table.reward, np.zeros(len(loops) * count)])
    base = paid[first[order]]  # where all entries of a branch earn the same, that is kept to the last bit
    mean = base + np.bincount(at, weights=chance * (paid - base[at]), minlength=len(order)) / probability
    choice_row, branches = np.unique(pair[order] // table.states, return_counts=True)
    rows, notes = with_loops(
        Rows(
            state_to_choices=_offsets(np.bincount(choice_row // count, minlength=table.states)),
            choice_to_branches=_offsets(branches),
            branch_to_target=pair[order] % table.states,
            branch_to_probability=probability,
            choice_to_action=choice_row % count,
            rewards={"reward": Reward(branch=mean)},
        )
    )
    mdp = MDP(
        state_to_choices=rows.state_to_choices,
        choice_to_branches=rows.choice_to_branches,
        branch_to_target=rows.branch_to_target,
        branch_to_probability=rows.branch_to_probability,
        choice_to_action=rows.choice_to_action,
        actions=actions,
        labels=ended.labels,
        rewards=rows.rewards,
        initial=initial,
        names=names,  # type: ignore[arg-type]
    )
    return mdp, notes + _notes(ended)


def _offsets(counts: Numbers) -> Numbers:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _notes(ended: Ended) -> tuple[str, ...]:
    notes = []
    added = np.flatnonzero(ended.added)
    if len(added):
        some = ", ".join(map(str, ended.origin[added[:MOST_LISTED]].tolist()))
        more = ", …" if len(added) > MOST_LISTED else ""
        notes.append(
            f"Episodes may end in states that can also be passed through ({some}{more}): where they end there, the "
            f"model has states of its own, {int(added[0])} … {int(added[-1])}."
        )
    if not ended.terminal.any():
        notes.append("No episode ends: there are no terminal states.")
    elif (table := ended.table).reward[~table.terminated].max(initial=0.0) > 0.0:
        notes.append(
            "Going on may pay: where it can be gone on with for ever, the largest reward until an episode ends is infinite. "
            "A discounted reward is finite: --property 'R{\"reward\"}max=? [C]' --discount 0.99."
        )
    return tuple(notes)


def objective_of(ended: Ended) -> Objective | None:
    """Return the objective whose best policies are those that earn the most until an episode ends; None where none ends.

    Where only arrival pays, that is the largest probability to arrive.
    """
    if ended.only_arrival_pays:
        hazards = bool((ended.terminal & ~ended.goal).any())
        return ReachAvoid(goal='"goal"', through='!"hazard"' if hazards else None)
    return ExpectedReward(goal='"terminal"', reward="reward") if ended.terminal.any() else None

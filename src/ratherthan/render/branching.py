"""A Solution and one of its choices enter, the beginning of the choice's search tree leaves, as a tree that can be drawn.

The search tree T(s,a) holds every state that can be reached from the successors of (s,a) without s. Drawn as a tree, the first visit of
a state in breadth-first order is unfolded, later ones are leaves. A branch that stays where it is, or leads back to s, is not followed.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from enum import Enum

from ratherthan.explain.measures import Factors
from ratherthan.factors import search_tree
from ratherthan.model.mdp import MDP

__all__ = ["Kind", "Node", "Tree", "tree_of"]

MOST_NODES, MOST_DEPTH = 36, 12
"""How many nodes a drawn tree has, and how deep it is."""


class Kind(Enum):
    """What a node of a tree is."""

    UNFOLDED = "unfolded"
    AGAIN = "again"
    ENDED = "ended"
    CUT = "cut"
    BACK = "back"


@dataclass(eq=False)
class Node:
    """A state in a tree, with the action that led to it; a node of kind BACK stands for a choice that leads nowhere new."""

    state: int
    action: str
    counts: bool
    depth: int
    kind: Kind
    critical: bool = False
    children: list[Node] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Tree:
    """The drawn part of a search tree.

    Parameters
    ----------
    action : str
        The choice that it begins with.
    roots : tuple of Node
        The states that the choice leads to.
    states : int
        How many states the whole tree has.
    count : tuple of int
        Between which numbers ε lies.
    more : int
        How many of its states are not drawn.
    """

    action: str
    roots: tuple[Node, ...]
    states: int
    count: tuple[int, int]
    more: int


def tree_of(factors: Factors, choice: int) -> Tree:
    """Return the beginning of the search tree of a choice.

    Parameters
    ----------
    factors : Factors
    choice : int
    """
    mdp, ended = factors.solution.problem.mdp, factors.solution.ended
    root = mdp.state_of(choice)
    seen: set[int] = set()
    made = 0

    def node(state: int, action: str, depth: int, *, counts: bool) -> Node:
        nonlocal made
        made += 1
        again = state in seen
        seen.add(state)
        kind = Kind.AGAIN if again else Kind.ENDED if ended[state] else Kind.CUT
        return Node(state, action, counts, depth, kind, critical=factors.critical.of(state) is not False)

    roots = [node(state, mdp.action_name(choice), 0, counts=False) for state in _targets(mdp, choice, {root})]
    queue = deque(roots)
    while queue:
        here = queue.popleft()
        if here.kind is not Kind.CUT or here.depth >= MOST_DEPTH:
            continue
        own = mdp.choices_of(here.state)
        ways = [(other, _targets(mdp, other, {root, here.state})) for other in own]
        if made + sum(max(1, len(targets)) for _, targets in ways) > MOST_NODES:
            continue
        here.kind = Kind.UNFOLDED
        for other, targets in ways:
            action = mdp.action_name(other)
            below = [node(target, action, here.depth + 1, counts=here.critical) for target in targets]
            if not below and (here.critical or len(own) > 1):
                made += 1
                below = [Node(here.state, action, here.critical, here.depth + 1, Kind.BACK)]
            here.children += below
            queue.extend(below)
    whole = search_tree(mdp, ended, choice)
    count = factors.counts([choice])[choice]
    return Tree(
        action=mdp.action_name(choice),
        roots=tuple(roots),
        states=len(whole),
        count=(count.lower, count.upper),
        more=len(set(whole.tolist()) - seen),
    )


def _targets(mdp: MDP, choice: int, without: set[int]) -> list[int]:
    """Return where a choice leads, each state once, in the order of its branches."""
    return [t for t in dict.fromkeys(map(int, mdp.branch_to_target[mdp.branches_of(choice)])) if t not in without]

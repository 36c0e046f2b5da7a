"""Two costs and a bound on the second enter; the plan that pays least in the first within the bound leaves.

On the border of two costs (`front`) the bound cuts one chord. Both its ends are best for the same weighting, and so is every
policy that does in each state as one or the other: passing from the left end to the right one state by state, all lie on the chord.
Somewhere on the way the bound is crossed by the change of one state, and the policy that tosses a coin there, with the chance that the
frequencies tell (`frequencies`), attains the bound exactly. It is evaluated like any other; where its proved upper bound is
above the bound, the coin is shifted a little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ratherthan.model.index import index_of
from ratherthan.model.mdp import Floats
from ratherthan.model.policy import Policy
from ratherthan.solve.frequencies import frequencies, mixed
from ratherthan.solve.front import Front, Point
from ratherthan.solve.plan import Plan, certified
from ratherthan.solve.weighing import Found

__all__ = ["Bounded", "within"]

TINY = 1e-9
"""How far a plan may be above a bound, relative to it, and still count as within: no more than rounding."""
ON = 1e-7
"""How far above the chord, relative to the first cost, a policy still counts as on it."""
ROUNDING = 1e-14
"""More than weighted sums of proved numbers lose by rounding."""
MOST_SHIFTS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Bounded:
    """The best plan within a bound.

    Parameters
    ----------
    objective : int
        Which objective is kept as good as it can be.
    limited : int
        Which one is bounded.
    bound : float
        The most it may be; the least, where it is gathered.
    plan : Plan, optional
        None where no plan is within the bound.
    best : float
        A proved bound of what any plan within the bound can attain for `objective`: none is better than this.
    nearest : float
        The best value that the limited objective can have at all, as it is proved.
    coins : tuple of int
        The states where the plan leaves it to chance, at most one as a rule.
    """

    objective: int
    limited: int
    bound: float
    plan: Plan | None
    best: float
    nearest: float
    coins: tuple[int, ...] = ()


def within(front: Front, bound: float) -> Bounded:
    """Return the best plan for the first of two objectives within a bound on the second.

    Parameters
    ----------
    front : Front
        Of the two objectives; it is refined where the bound cuts it.
    bound : float
    """
    weighing, pair = front.weighing, front.pair
    signs = weighing.signs[list(pair)]
    most = float(signs[1]) * bound
    room = TINY * abs(most) + float(front.points[-1].found.doubt[pair[1]])
    while True:
        cut = [chord for chord in front.open if chord.left.second > most + room]
        cut = [chord for chord in cut if chord.right.second <= most + room]
        if not cut:
            break
        front.refine(cut[0])
    border = front.border()
    plan, coins, best = _chosen(front, border, most, room)
    return Bounded(
        objective=pair[0],
        limited=pair[1],
        bound=bound,
        plan=plan,
        best=float(signs[0]) * best,
        nearest=float(signs[1]) * front.least[1],
        coins=coins,
    )


def _chosen(front: Front, border: list[Point], most: float, room: float) -> tuple[Plan | None, tuple[int, ...], float]:
    """Return the plan within the bound, where it tosses a coin, and a lower bound of the first cost of all such plans."""
    place = next((i for i, point in enumerate(border) if point.second <= most + room), None)
    if place is None:
        return None, (), np.inf
    point = border[place]
    if place == 0:
        return point.found.plan, (), front.least[0]
    ends = tuple(_End.of(front, found) for found in (border[place - 1].found, point.found))
    least = max(front.least[0], *(chord.least - chord.weight * most for chord in front.chords if chord.closed))
    least -= ROUNDING * max(end.size for end in ends)
    if point.second >= most - room:
        return point.found.plan, (), least
    return *_tossed(front, _neighbours(front, (ends[0], ends[1]), most), most), least


@dataclass(frozen=True, kw_only=True, eq=False)
class _End:
    """One end of a stretch of chord: a policy, how often it takes each choice, and the size of all that is summed for its costs."""

    found: Found
    taken: Floats  # [C]
    size: float

    @staticmethod
    def of(front: Front, found: Found) -> _End:
        weighing, pair = front.weighing, list(front.pair)
        policy = found.plan.policy
        taken = frequencies(weighing.problem.mdp, policy, weighing.start, weighing.ended, weighing.discount)
        assert taken is not None  # its totals are finite
        return _End(found=found, taken=taken, size=float((np.abs(weighing.costs[pair]) @ taken).sum()))


def _neighbours(front: Front, ends: tuple[_End, _End], most: float) -> tuple[_End, _End]:
    """Return two policies on the chord, on either side of the bound, that differ in one state; else its ends."""
    mdp, second = front.weighing.problem.mdp, front.pair[1]
    left, right = (end.found.plan.policy.choice for end in ends)
    visited = np.zeros(mdp.states, dtype=np.bool_)
    visited[index_of(mdp).choice_to_state[(ends[0].taken > 0.0) | (ends[1].taken > 0.0)]] = True
    changing = np.flatnonzero(visited & (left != right))
    near, places = (ends[0].found, ends[1].found), (0, len(changing))
    while places[1] - places[0] > 1:
        middle = sum(places) // 2
        choice = np.array(left, dtype=np.int64)
        choice[changing[:middle]] = right[changing[:middle]]
        found = front.weighing.followed(Policy(choice=choice))
        if found is None or not _on(front, ends, found):
            return ends
        if found.costs[second] > most:
            near, places = (found, near[1]), (middle, places[1])
        else:
            near, places = (near[0], found), (places[0], middle)
    return _End.of(front, near[0]), _End.of(front, near[1])


def _on(front: Front, ends: tuple[_End, _End], found: Found) -> bool:
    """Return whether a policy lies on the line through two others, as all that are best for one weighting do."""
    first, second = front.pair
    origin = ends[0].found.costs
    step, off = ends[1].found.costs - origin, found.costs - origin
    slope = step[first] / step[second]
    doubt = found.doubt[first] + found.doubt[second] * abs(slope)
    return bool(off[first] - off[second] * slope <= ON * abs(origin[first]) + 2.0 * doubt)


def _tossed(front: Front, ends: tuple[_End, _End], most: float) -> tuple[Plan, tuple[int, ...]]:
    """Return the mixture of two policies that meets the bound, and the states where it tosses a coin."""
    weighing, which = front.weighing, front.pair[1]
    mdp, sign = weighing.problem.mdp, float(front.weighing.signs[which])
    left, right = (end.found for end in ends)
    step = float(left.costs[which] - right.costs[which])
    share = (most - float(right.costs[which])) / step
    sides = [(end.found.plan.policy, end.taken) for end in ends]
    for attempt in range(MOST_SHIFTS):
        policy = mixed(mdp, sides[0], sides[1], min(max(share, 0.0), 1.0))
        plan = certified(weighing.problem, weighing.objectives, weighing.start, policy)
        highest = max(sign * plan.lower[which], sign * plan.upper[which])
        if highest <= most:
            break
        share -= 2.0**attempt * ((highest - most) / step + 1e-16)
    owner = index_of(mdp).choice_to_state
    several = np.bincount(owner, weights=plan.policy.weights(mdp) > 0.0, minlength=mdp.states) > 1
    return plan, tuple(np.flatnonzero(several).tolist())

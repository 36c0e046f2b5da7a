"""A Solution and a start without a way to the goal enter, the hazards in between leave."""

from __future__ import annotations

from ratherthan.solve.solution import Solution

__all__ = ["in_the_way"]


def in_the_way(solution: Solution, start: int) -> tuple[int, ...]:
    """Return the hazards on a shortest path to a goal that passes through hazards, if there is such a path."""
    if not solution.hazard.any():
        return ()
    mdp = solution.problem.mdp
    before = {start: -1}
    layer = [start]
    while layer:
        following = []
        for state in layer:
            first = mdp.choice_to_branches[mdp.state_to_choices[state]]
            last = mdp.choice_to_branches[mdp.state_to_choices[state + 1]]
            for target in map(int, mdp.branch_to_target[first:last]):
                if target in before:
                    continue
                before[target] = state
                if solution.goal[target]:
                    return _hazards_on(solution, before, target)
                following.append(target)
        layer = following
    return ()


def _hazards_on(solution: Solution, before: dict[int, int], state: int) -> tuple[int, ...]:
    path = []
    while state >= 0:
        path.append(state)
        state = before[state]
    return tuple(s for s in reversed(path) if solution.hazard[s])

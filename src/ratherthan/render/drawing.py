"""An Explanation, a Solution or a model enters, a Picture leaves."""

from __future__ import annotations

from ratherthan.errors import QuestionError
from ratherthan.explain.explanation import Explanation
from ratherthan.model.mdp import MDP
from ratherthan.model.problem import Problem
from ratherthan.render.canvas import Picture
from ratherthan.solve.solution import Solution

__all__ = ["VIEWS", "draw"]

VIEWS = ("route", "graph", "value", "spread", "policy", "trees", "factors")
"""What can be drawn: the first two of an Explanation, the others of a Solution."""


def draw(
    thing: Explanation | Solution | Problem | MDP,
    what: str | None = None,
    *,
    state: int | None = None,
    rather_than: str | None = None,
    room: tuple[float, float] | None = None,
) -> Picture:
    """Draw an explanation, a solution or a model.

    Parameters
    ----------
    thing : Explanation, Solution, Problem or MDP
    what : str, optional
        Of an Explanation: "route", its route on the map with the decisions that matter (the default; without a map as
        "graph"), or "graph", a line of states. Of a Solution: "value", a map of the values (the default), "spread", of how
        much the decision in each cell matters, "policy", arrows; "trees", the search trees of two actions, or "factors",
        bars of the three factors of each action, both of `state`. Of a Problem or an MDP: its map with nothing on it but the
        start and the destination; without a map a graph of the states around the start.
    state : int, optional
        For "trees" and "factors"; by default the only initial state.
    rather_than : str, optional
        For "trees": the action beside the one that is taken.
    room : (float, float), optional
        Of an Explanation: how wide and high the map may be, or how wide the graph, without the words around it; 96 units are
        an inch.

    Returns
    -------
    Picture
        With ``save("x.svg")`` and ``save("x.png")``.

    Raises
    ------
    QuestionError
        If this cannot be drawn of this thing: no map, no such state or action, several initial states and none chosen.

    Examples
    --------
    >>> import ratherthan as rt
    >>> picture = rt.draw(rt.explain(rt.solve(rt.read("example:paper-5x5"))))
    >>> picture.svg.startswith("<svg ")
    True
    """
    if isinstance(thing, Explanation):
        return _explanation(thing, what, asked=state is not None or rather_than is not None, room=room)
    if isinstance(thing, Solution):
        return _solution(thing, what or "value", state, rather_than)
    if isinstance(thing, Problem | MDP):
        if not (what is None and state is None and rather_than is None and room is None):
            raise QuestionError("A model alone is drawn as it is: solve it first to see more.")
        from ratherthan.render.modelview import draw_model

        return draw_model(thing)
    raise QuestionError(f"An Explanation, a Solution or a model can be drawn, got {type(thing).__name__}.")


def _explanation(
    explanation: Explanation, what: str | None, *, asked: bool, room: tuple[float, float] | None
) -> Picture:
    if asked:
        raise QuestionError("An explanation has its own state and actions: leave state and rather_than out.")
    if what not in (None, "route", "graph"):
        raise QuestionError(f"Of an explanation 'route' or 'graph' can be drawn, got '{what}'. Others need a solution.")
    if what != "graph" and explanation.world is not None:
        from ratherthan.render.mapview import draw_map

        return draw_map(explanation) if room is None else draw_map(explanation, room)
    from ratherthan.render.graphview import draw_graph

    return draw_graph(explanation) if room is None else draw_graph(explanation, room[0])


def _solution(solution: Solution, what: str, state: int | None, rather_than: str | None) -> Picture:
    if what not in VIEWS[2:]:
        raise QuestionError(
            f"Of a solution {', '.join(VIEWS[2:])} can be drawn, got '{what}'. Others need an explanation."
        )
    if rather_than is not None and what != "trees":
        raise QuestionError("'rather than' names the second of two search trees: ask for 'trees'.")
    if what in ("value", "spread", "policy"):
        from ratherthan.render.heat import draw_heat

        if state is not None:
            raise QuestionError(f"A map of {what} shows all states: leave the state out.")
        return draw_heat(solution, what)
    from ratherthan.explain.explainer import initial_state

    chosen = initial_state(solution) if state is None else state
    if what == "factors":
        from ratherthan.render.bars import draw_factors

        return draw_factors(solution, chosen)
    from ratherthan.render.trees import draw_trees

    return draw_trees(solution, chosen, rather_than)

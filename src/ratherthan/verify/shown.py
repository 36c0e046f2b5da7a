"""A stored explanation and a problem enter; an ExplanationError leaves where what pictures show is not the problem's.

The map must be the problem's, cell by cell; its roads must be ways that some choice can lead (not all need be there); what else
could have been done at a step must be other actions of its state, and lead where they most likely do. A document from before there
were maps in documents says none of this, which is no fault.
"""

from __future__ import annotations

import numpy as np

from ratherthan.explain.explanation import Explanation, Step, WorldRecord
from ratherthan.model.mdp import MDP
from ratherthan.model.problem import Problem
from ratherthan.model.world import World
from ratherthan.verify.frame import Frame
from ratherthan.verify.wanted import refuse

__all__ = ["refuse_foreign_pictures"]


def refuse_foreign_pictures(told: Explanation, problem: Problem, frame: Frame) -> None:
    """Raise where what a picture of an explanation would show is not so.

    Parameters
    ----------
    told : Explanation
        Whose states are known to be the model's.
    problem : Problem
    frame : Frame
        Of the first level.

    Raises
    ------
    ExplanationError
    """
    for step in told.steps:
        _refuse_alternatives(step, problem.mdp)
    if told.world is None:
        return
    if problem.world is None:
        refuse("A map must be given only for a model that lies on one", f"{told.world.width}×{told.world.height} cells")
    _refuse_map(told.world, problem.world, named=problem.mdp.names.named)
    _refuse_marks(told.world, problem.world, frame)
    _refuse_roads(told.world, problem.world, problem.mdp)


def _refuse_map(told: WorldRecord, world: World, *, named: bool) -> None:
    numbered = not named and np.array_equal(world.cell_of_state, np.arange(world.width * world.height))
    if told.numbered != numbered:
        refuse(f"Whether states are called by the numbers of their cells must be {numbered}", told.numbered)
    for name in ("width", "height", "kinds", "frame", "title", "note"):
        if getattr(told, name) != getattr(world, name):
            refuse(f"The {name} of the map must be {getattr(world, name)!r}", repr(getattr(told, name)))
    if not np.array_equal(told.ground, world.kind_of_cell):
        refuse("The ground of the map must be the model's", "another")
    if list(told.zones) != list(world.zones):
        refuse(f"The zones of the map must be {list(world.zones)}", list(told.zones))
    for name, inside in world.zones.items():
        if not np.array_equal(told.zones[name], inside):
            refuse(f"Zone '{name}' of the map must be the model's", "another")


def _refuse_marks(told: WorldRecord, world: World, frame: Frame) -> None:
    """Raise where the cells in which the objective ends are others."""
    for name, marked, where in (("goals", told.goals, frame.goal), ("hazards", told.hazards, frame.hazard)):
        wanted = np.zeros(world.width * world.height, dtype=np.bool_)
        there = world.cell_of_state[where]
        wanted[there[there >= 0]] = True
        if not np.array_equal(marked, wanted):
            refuse(f"The {name} of the map must be where the objective ends", "others")


def _refuse_roads(told: WorldRecord, world: World, mdp: MDP) -> None:
    """Raise where a road joins cells between which no choice can lead."""
    if not told.roads:
        return
    state = np.repeat(np.arange(mdp.states), np.diff(mdp.choice_to_branches[mdp.state_to_choices]))
    ways = np.stack([world.cell_of_state[state], world.cell_of_state[mdp.branch_to_target]], axis=1)
    known = set(map(tuple, np.unique(ways, axis=0).tolist()))
    for road in told.roads:
        if road not in known or road[0] == road[1]:
            refuse("A road of the map must be a way that a choice can lead", f"one from cell {road[0]} to {road[1]}")


def _refuse_alternatives(step: Step, mdp: MDP) -> None:
    """Raise where what else could have been done at a step is not what the model says."""
    if not step.alternatives:
        return
    own = {mdp.action_name(choice): choice for choice in mdp.choices_of(step.state) if choice != step.choice}
    wanted, got = list(own) if step.foil is None else [step.foil], [other.action for other in step.alternatives]
    if got != wanted:
        refuse(f"The alternatives at state {step.state} must be {wanted}", got, state=step.state)
    for other in step.alternatives:
        branches = mdp.branches_of(own[other.action])
        likeliest = int(mdp.branch_to_target[branches][int(np.argmax(mdp.branch_to_probability[branches]))])
        if other.towards != likeliest:
            refuse(f"'{other.action}' must most likely lead to state {likeliest}", other.towards, state=step.state)

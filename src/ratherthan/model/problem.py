"""An MDP with its world, objective and words enters one noun, the Problem, and is passed on whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP, Bools, Ints
from ratherthan.model.objective import Mission, Objective, Threshold
from ratherthan.model.world import World

__all__ = ["Problem", "Unfolding"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Unfolding:
    """How the model of a problem came from another: each state is one of the other model's with what must be remembered.

    Parameters
    ----------
    mission : Mission
        What it was unfolded for.
    origin : Problem
        The problem on the model as it is.
    state : array of int, ``[S]``
        The state of `origin` that each state is. The first states are those of `origin`, in their order: the mission
        begins anew there.
    memory : array of int, ``[S]``
        What is remembered, an index into `left`.
    left : tuple of str
        What is left to do for each memory, a formula.
    satisfied, violated : array of bool, ``[S]``
        Where the mission is done, and where it has failed for good.
    """

    mission: Mission
    origin: Problem
    state: Ints  # [S]
    memory: Ints  # [S]
    left: tuple[str, ...]
    satisfied: Bools  # [S]
    violated: Bools  # [S]


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """What a source gives: a model, where its states lie, what is wanted, and the words to speak of it.

    Parameters
    ----------
    mdp : MDP
    world : World, optional
        Where the states lie, if the source is a map.
    objective : Objective, optional
        What the source itself wants, or what was asked for.
    properties : mapping of str to Objective or Threshold
        The properties that came with the source, by name, if they can be explained.
    others : mapping of str to str
        The other ones, by name, as texts in PRISM's syntax: a model checker may answer them.
    definitions : mapping of str to str
        Constants and formulas of the source by name, as PRISM expressions, which properties may mention.
    lexicon : Lexicon
    source : str
        Where it came from, as it was named.
    notes : tuple of str
        What a reader should know: repairs made while reading, for instance.
    unfolding : Unfolding, optional
        Where the model is the product of another with what must be remembered.
    lacks : str
        What must still be given before anything can be wanted of it, in sentences; empty where nothing is missing.
    """

    mdp: MDP
    world: World | None = None
    objective: Objective | None = None
    properties: Mapping[str, Objective | Threshold] = field(default_factory=dict)
    others: Mapping[str, str] = field(default_factory=dict)
    definitions: Mapping[str, str] = field(default_factory=dict)
    lexicon: Lexicon = field(default_factory=Lexicon)
    source: str = ""
    notes: tuple[str, ...] = ()
    unfolding: Unfolding | None = None
    lacks: str = ""

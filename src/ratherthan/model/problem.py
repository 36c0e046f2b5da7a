"""An MDP with its world, objective and words enters one noun, the Problem, and is passed on whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import MDP
from ratherthan.model.objective import Objective, Threshold
from ratherthan.model.world import World

__all__ = ["Problem"]


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
        The properties that came with the source, by name (texts that could not be parsed are left out, with a note).
    definitions : mapping of str to str
        Constants and formulas of the source by name, as PRISM expressions, which properties may mention.
    lexicon : Lexicon
    source : str
        Where it came from, as it was named.
    notes : tuple of str
        What a reader should know: repairs made while reading, for instance.
    """

    mdp: MDP
    world: World | None = None
    objective: Objective | None = None
    properties: Mapping[str, Objective | Threshold] = field(default_factory=dict)
    definitions: Mapping[str, str] = field(default_factory=dict)
    lexicon: Lexicon = field(default_factory=Lexicon)
    source: str = ""
    notes: tuple[str, ...] = ()

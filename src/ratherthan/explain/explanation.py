"""Steps, claims and their evidence enter one noun, the Explanation, and are passed on whole. There are no sentences here.

An Explanation is data. Sentences and pictures are pure functions of it, also after a round trip through JSON, so it carries
the names and places of the states it mentions and the words of the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ratherthan.explain.question import Question
from ratherthan.factors import Interval
from ratherthan.model.lexicon import Lexicon

__all__ = [
    "VERSION",
    "Claim",
    "Closing",
    "Evidence",
    "Explanation",
    "Measured",
    "ObjectiveRecord",
    "PolicyRecord",
    "StateRecord",
    "Step",
    "Tally",
]

VERSION = "1"


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A choice with its number: the action value q (or ω), with bounds.

    `fate` tells what an infinite expected cost means: ``"dead end"`` where nothing after the action can arrive any more,
    ``"may fail"`` where it may.
    """

    choice: int
    action: str
    number: Interval
    fate: str | None = None


@dataclass(frozen=True, kw_only=True)
class Tally:
    """A choice with its count of decisions left open, ε, between two bounds."""

    choice: int
    action: str
    lower: int
    upper: int


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a claim rests on: the number (or count) of the choice taken, and those of the choices it is compared with.

    `follows` lists, for claims about the rest of the way, each successor with ρ and ρ^π.
    """

    taken: Measured | Tally
    others: tuple[Measured | Tally, ...] = ()
    follows: tuple[tuple[int, Interval, Interval], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One thing that holds of the choice taken, against which actions, and why.

    Parameters
    ----------
    claim : str
        Outcome: "best", "among the best", "right start only", "not best", "hopeless"; judged by single steps: "better
        step", "equal step", "worse step"; flexibility: "most flexible", "equally flexible"; details: "avoids", "only way
        on"; against a foil: "better", "worse", "equal", "more flexible", "less flexible", "as flexible".
    against : tuple of str
        The actions it is claimed against.
    evidence : Evidence
    """

    claim: str
    against: tuple[str, ...]
    evidence: Evidence


@dataclass(frozen=True, kw_only=True)
class Step:
    """One step of the route, or the one state asked about.

    Parameters
    ----------
    state, choice, choice_index : int
        The choice taken there, as a row of the model and within its state.
    action : str
    share : float
        How often a randomised policy takes it, else 1.
    critical : bool, optional
        None where the bounds leave it open; False also where it was not asked.
    spread : pair of Interval
        λmax and λmin, what criticality rests on; None where it was not asked.
    claims : tuple of Claim
    foil : str, optional
        The action asked about ("rather than").
    """

    state: int
    choice: int
    choice_index: int
    action: str
    share: float = 1.0
    critical: bool | None = False
    spread: tuple[Interval, Interval] | None = None
    claims: tuple[Claim, ...] = ()
    foil: str | None = None


@dataclass(frozen=True, kw_only=True)
class StateRecord:
    """The name of a state that is mentioned, and its place on the map (column, row) where it has one."""

    name: str
    named: bool
    place: tuple[int, int] | None = None


@dataclass(frozen=True, kw_only=True)
class Closing:
    """What can be said of the steps that are not told.

    Parameters
    ----------
    printed : bool
        Whether a sentence about the untold steps of this route is true and is said.
    largest_difference : float, optional
        The largest λmax - λmin among the untold steps: 0 if all their choices are equal, None if no step is untold or the
        bounds leave it open.
    off_route : int
        How many critical states can be reached under the policy, off the route.
    off_route_open : int
        How many more are open.
    """

    printed: bool = False
    largest_difference: float | None = None
    off_route: int = 0
    off_route_open: int = 0


@dataclass(frozen=True, kw_only=True)
class ObjectiveRecord:
    """What kind of thing is wanted, so that words can be found for it.

    `kind` is "cost" (an expected total of `reward`; None counts steps), "probability" (to arrive), "safety" (to arrive
    where there are hazards) or "risk" (a probability to be kept small).
    """

    kind: str
    reward: str | None = None
    maximise: bool = False


@dataclass(frozen=True, kw_only=True)
class PolicyRecord:
    """The policy explained, the optimum or a given one, with its choices where the explanation can lead.

    `choices` has (state, choice, probability) for every state that can be reached from the states mentioned under the
    policy (by any choices, where steps are judged by a given policy's values). Of several optimal policies this tells
    which one is meant.
    """

    given: bool
    choices: tuple[tuple[int, int, float], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Why this, rather than that.

    Parameters
    ----------
    source, property : str
        Where the model came from, and the objective in PRISM's syntax.
    objective : ObjectiveRecord
    question : Question
    start : int
        The state where the route begins, or the state asked about.
    route : tuple of int
        The states of the route in order, the last one where it ends.
    route_outcome : str
        "arrives", "there" (already), "ended" (in a hazard already), "circles" (the policy never arrives), "no way" (no
        policy does), "open end" (the objective has no goal), or "none" for a single state.
    route_probability : float
        The probability of following exactly this route, delays left out.
    arrival : Interval
        The probability that the policy arrives at all from the start.
    circle : tuple of int
        Where a policy that does not arrive goes round for ever; for "no way", what can be reached at most. The first 20.
    circle_size : int
        How many states these are in all.
    circle_certain : bool
        Whether it ends there for sure.
    in_the_way : tuple of int
        For "no way": hazards that block it.
    steps : tuple of Step
    closing : Closing
    states : mapping of int to StateRecord
        Every state mentioned.
    size : tuple of int
        States, choices and branches of the model.
    policy : PolicyRecord
    lexicon : Lexicon
    outcome : str
        How the values were got, a sentence.
    """

    source: str
    property: str
    objective: ObjectiveRecord
    question: Question
    start: int
    route: tuple[int, ...] = ()
    route_outcome: str = "none"
    route_probability: float | None = None
    arrival: Interval | None = None
    circle: tuple[int, ...] = ()
    circle_size: int = 0
    circle_certain: bool = True
    in_the_way: tuple[int, ...] = ()
    steps: tuple[Step, ...] = ()
    closing: Closing = field(default_factory=Closing)
    states: Mapping[int, StateRecord] = field(default_factory=dict)
    size: tuple[int, int, int] = (0, 0, 0)
    policy: PolicyRecord = field(default_factory=lambda: PolicyRecord(given=False))
    lexicon: Lexicon = field(default_factory=Lexicon)
    outcome: str = ""

"""Steps, claims and their evidence enter one noun, the Explanation, and are passed on whole. There are no sentences here.

An Explanation is data. Sentences and pictures are pure functions of it, also after a round trip through JSON, so it carries
the names and places of the states it mentions and the words of the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ratherthan.explain.evidence import Claim, Evidence, Judged, Measured, Tally, Trade
from ratherthan.explain.places import WorldRecord
from ratherthan.explain.policy_rows import PolicyRows
from ratherthan.explain.question import Question
from ratherthan.factors import Interval
from ratherthan.model.lexicon import Lexicon

__all__ = [
    "VERSION",
    "Alternative",
    "Claim",
    "Closing",
    "Evidence",
    "Explanation",
    "Further",
    "Judged",
    "LeftOut",
    "Measured",
    "ObjectiveRecord",
    "Opening",
    "PolicyRecord",
    "PolicyRows",
    "Rank",
    "StateRecord",
    "Step",
    "Tally",
    "Trade",
    "Unfolded",
    "WorldRecord",
]

VERSION = "1"


@dataclass(frozen=True, kw_only=True)
class Alternative:
    """Another action of a state, and where it most likely leads: the state itself where staying is likeliest."""

    action: str
    towards: int


@dataclass(frozen=True, kw_only=True)
class Rank:
    """What a step was ranked by, where not all could be told (see `ratherthan.explain.ranking`).

    Parameters
    ----------
    level : int
        The level of the objective that it is about: the first that differs, else the last.
    size : float
        How much worse the best alternative is, without turning back; or what else the ranking is by. Negative where it is
        better, ∞ where it does not arrive.
    settled : bool
        False where the search ended early: then it is a lower bound.
    """

    level: int
    size: float
    settled: bool = True


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
    further_spreads : tuple of pairs of Interval
        For each level after the first, the largest and the smallest number among the choices that are equal to the best at
        all levels before; None where fewer than two are, where that is open, or where it was not asked.
    trades : tuple of Trade
        Where further objectives were given: one for the foil, or for each other action of the state.
    told : bool
        False where it matters and yet no sentence tells it, as there are to be few.
    alternatives : tuple of Alternative
        What else could have been done: the foil, or for a told step that is critical each other action.
    rank : Rank, optional
        Where not all steps could be told.
    numbers : tuple of tuple of Measured
        Where details were asked for: for each level that matters here the choice taken and each alternative.
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
    further_spreads: tuple[tuple[Interval, Interval] | None, ...] = ()
    trades: tuple[Trade, ...] = ()
    told: bool = True
    alternatives: tuple[Alternative, ...] = ()
    rank: Rank | None = None
    numbers: tuple[tuple[Measured, ...], ...] = ()


@dataclass(frozen=True, kw_only=True)
class StateRecord:
    """The name of a state that is mentioned, and its place on the map (column, row) where it has one."""

    name: str
    named: bool
    place: tuple[int, int] | None = None


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """The steps that matter and are not told, as there are to be few sentences.

    Parameters
    ----------
    steps : int
        How many there are.
    unsure : int
        At how many of them some action, though not every one, is infinitely bad at the first level: it is not sure to arrive.
    largest : tuple of float or None
        For each level the largest difference that one of the others makes, at most; None where that is open or has no end.
    """

    steps: int
    unsure: int = 0
    largest: tuple[float | None, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Closing:
    """What can be said of the steps that are not told.

    Parameters
    ----------
    printed : bool
        Whether a sentence about the untold steps of this route is true and is said.
    largest_difference : float, optional
        The largest λmax - λmin among the untold steps: 0 if all their choices are equal (at every level), None if no step
        is untold or the bounds leave it open. Of the first level only.
    off_route : int
        How many critical states can be reached under the policy, off the route.
    off_route_open : int
        How many more are open.
    left_out : LeftOut, optional
        What matters and is not told either.
    """

    printed: bool = False
    largest_difference: float | None = None
    off_route: int = 0
    off_route_open: int = 0
    left_out: LeftOut | None = None


@dataclass(frozen=True, kw_only=True)
class ObjectiveRecord:
    """What kind of thing is wanted, so that words can be found for it.

    Parameters
    ----------
    kind : str
        "cost" (an expected total of `reward`; None counts steps), "reward" (the same, over plans that are sure to arrive and
        with rewards of any sign), "discounted" (a discounted sum without end), "probability" (to arrive), "safety" (to
        arrive where there are hazards), "deadline" (to arrive within some steps), "mission" (to do what takes memory to
        tell), "risk" (of reaching a hazard, to be kept small; also within some steps) or "event" (any other probability to
        be kept small).
    reward : str, optional
    maximise : bool
    discount : float, optional
        Of "discounted".
    formula : str, optional
        Of "event": what must not happen, a path formula.
    """

    kind: str
    reward: str | None = None
    maximise: bool = False
    discount: float | None = None
    formula: str | None = None

    @property
    def chance(self) -> bool:
        """Whether its numbers are probabilities."""
        return self.kind not in ("cost", "reward", "discounted")


@dataclass(frozen=True, kw_only=True)
class Further:
    """An objective beside the plan's own, under which the plan and its alternatives are judged."""

    property: str
    objective: ObjectiveRecord


@dataclass(frozen=True, kw_only=True)
class Unfolded:
    """How large the model was before it was unfolded with what must be remembered, and how many memories there are."""

    states: int
    memories: int


@dataclass(frozen=True, kw_only=True)
class Opening:
    """A closed cell of the map that would have to open: where it lies (column, row), how it is called, what kind of ground it is."""

    place: tuple[int, int]
    name: str
    kind: str


@dataclass(frozen=True, kw_only=True)
class PolicyRecord:
    """The policy explained, the optimum or a given one, with its choices where the explanation can lead.

    `choices` has (state, choice, probability) for every state that can be reached from the states mentioned under the
    policy (by any choices, where steps are judged by a given policy's values). Of several optimal policies this tells
    which one is meant.
    """

    given: bool
    choices: PolicyRows | Sequence[tuple[int, int, float]] = ()

    def __post_init__(self) -> None:
        """Keep the choices as columns."""
        if not isinstance(self.choices, PolicyRows):
            object.__setattr__(self, "choices", PolicyRows.of(self.choices))

    @property
    def rows(self) -> PolicyRows:
        """The choices as columns."""
        assert isinstance(self.choices, PolicyRows)
        return self.choices


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Why this, rather than that.

    Parameters
    ----------
    source, property : str
        Where the model came from, and the objective in PRISM's syntax.
    objective : ObjectiveRecord
        Of the first level.
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
    openings : tuple of Opening
        For "no way" on a map, where no hazard blocks it: a smallest set of closed cells that would have to open, in the order
        of the way.
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
    levels : tuple of ObjectiveRecord
        All levels of the objective, `objective` first.
    also : tuple of Further
        The objectives given beside it.
    totals : tuple of Interval
        For a route with `also`: what the whole plan comes to at the start, under each level and each further objective.
    unfolded : Unfolded, optional
        Where the model is the product of another with what must be remembered.
    world : WorldRecord, optional
        The map that the states lie on.
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
    openings: tuple[Opening, ...] = ()
    steps: tuple[Step, ...] = ()
    closing: Closing = field(default_factory=Closing)
    states: Mapping[int, StateRecord] = field(default_factory=dict)
    size: tuple[int, int, int] = (0, 0, 0)
    policy: PolicyRecord = field(default_factory=lambda: PolicyRecord(given=False))
    lexicon: Lexicon = field(default_factory=Lexicon)
    outcome: str = ""
    levels: tuple[ObjectiveRecord, ...] = ()
    also: tuple[Further, ...] = ()
    totals: tuple[Interval, ...] = ()
    unfolded: Unfolded | None = None
    world: WorldRecord | None = None

    def __post_init__(self) -> None:
        """Let an objective without levels be its own only one."""
        if not self.levels:
            object.__setattr__(self, "levels", (self.objective,))

"""What a study consists of, as frozen data: the texts, maps, kinds and orders of its file, its stored stimuli, and its screens.

Nothing here reads, computes or serves. `ratherthan.apps.study.design.reading` makes a `Design` of a file,
`ratherthan.apps.study.design.screens` makes its screens, which are of the nouns of `ratherthan.apps.study.design.pages`.
Texts are plain: whoever shows them shows them as text, never as HTML.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ratherthan.apps.study.design.pages import NEITHER, PHASES, RECORD_TYPES, Card, Option, Record, Screen

__all__ = [
    "NEITHER",
    "PHASES",
    "RECORD_TYPES",
    "Attention",
    "Card",
    "Codes",
    "Comprehension",
    "Consent",
    "Design",
    "Grouping",
    "Kind",
    "Option",
    "Order",
    "Page",
    "Picture",
    "Record",
    "Screen",
    "Stimulus",
    "StudyMap",
    "Trial",
]


@dataclass(frozen=True, kw_only=True)
class Page:
    """A title and paragraphs of plain text."""

    title: str
    paragraphs: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Consent:
    """What a person agrees to before anything is stored of them.

    Parameters
    ----------
    page : Page
    question, agree, decline : str
        The question and its two answers, which are recorded as ``consent`` = "yes" or "no". "no" ends the study.
    """

    page: Page
    question: str
    agree: str
    decline: str


@dataclass(frozen=True, kw_only=True)
class Comprehension:
    """Questions on the instructions.

    Parameters
    ----------
    page : Page
    questions : tuple of Record
        Each with `correct`; none: there is no such screen.
    attempts : int
        After so many tries with a wrong answer a person is screened out.
    """

    page: Page
    questions: tuple[Record, ...]
    attempts: int


@dataclass(frozen=True, kw_only=True)
class Attention:
    """A check that states in the item itself what to answer.

    Parameters
    ----------
    record : Record
        With `correct`.
    page : Page
    after : int
        It stands behind so many trials, counted over all maps.
    """

    record: Record
    page: Page
    after: int


@dataclass(frozen=True, kw_only=True)
class Trial:
    """The words around an explanation.

    Parameters
    ----------
    title : str
        May hold ``{map}`` (its title).
    paragraphs : tuple of str
        Above an explanation; may hold ``{map}``.
    without : tuple of str
        In their place where the kind says nothing.
    picture : str
        What a screen reader says in place of the picture; may hold ``{map}``, ``{moves}`` and ``{places}``.
    """

    title: str
    paragraphs: tuple[str, ...]
    without: tuple[str, ...]
    picture: str


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of explanation.

    Parameters
    ----------
    id : str
    label : str
        What figures and tables call it.
    kind : str, optional
        The core's name of it; None where `scope` and `factors` are given instead.
    scope : str, optional
        "state" or "route".
    factors : tuple of str
        Of "selectiveness", "responsibility", "constrictiveness".
    at_most : int, optional
        How many sentences about moves it may have on every map, of a kind about a whole route; each map's own where this is None.
    """

    id: str
    label: str
    kind: str | None = None
    scope: str | None = None
    factors: tuple[str, ...] = ()
    at_most: int | None = None


@dataclass(frozen=True, kw_only=True)
class StudyMap:
    """A map of the study, or any other model.

    Parameters
    ----------
    id : str
    title : str
    source : str
        A file, seen from the folder of the design, or any other source that ``ratherthan explain`` takes.
    property : str, optional
        What the route is best at; the source's own where this is None.
    start : str, optional
        Where the route begins; the source's own where this is None.
    state : str, optional
        Where the kinds that explain one step explain it; chosen where this is None.
    picture_text : str, optional
        What a screen reader says in place of the picture; that of `Trial` where this is None.
    at_most : int, optional
        How many sentences about moves the kinds about a whole route may have; None: every move that they tell has its own.
    """

    id: str
    title: str
    source: str
    property: str | None = None
    start: str | None = None
    state: str | None = None
    picture_text: str | None = None
    at_most: int | None = None


@dataclass(frozen=True, kw_only=True)
class Grouping:
    """Explanations of one map of which a person prefers one.

    Parameters
    ----------
    id : str
    kinds : tuple of str
        Ids of kinds.
    neither : str, optional
        The words for neither, the last card; None: one has to be chosen.
    page : Page
        May hold ``{map}``.
    question : str
        The label of what is recorded.
    """

    id: str
    kinds: tuple[str, ...]
    neither: str | None
    page: Page
    question: str


@dataclass(frozen=True, kw_only=True)
class Order:
    """In which order kinds (or maps) are shown.

    Parameters
    ----------
    how : str
        "williams" (balanced over places and neighbours), "latin" (balanced over places), "fixed" (as listed) or "rows".
    rows : tuple of tuple of str
        Of "rows": the orders themselves, taken in turn.
    """

    how: str
    rows: tuple[tuple[str, ...], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Codes:
    """Codes that a platform is told, by how a participant ends; None: none."""

    done: str | None = None
    screened_out: str | None = None
    no_consent: str | None = None
    failed_checks: str | None = None


@dataclass(frozen=True, kw_only=True)
class Stimulus:
    """A stored explanation.

    Parameters
    ----------
    map, kind : str
    text : str
        As it is shown, to the letter.
    words, sentences, steps : int
        How large the text is; `steps`: of how many moves it tells.
    by_hand : bool
        Whether a person wrote it: a translation. False: the core did.
    language : str, optional
        Of the text, where it is not that of the pages.
    """

    map: str
    kind: str
    text: str
    words: int
    sentences: int
    steps: int
    by_hand: bool = False
    language: str | None = None


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A stored picture of a map with its route.

    Parameters
    ----------
    map : str
    file : Path
        The SVG.
    sha256 : str
        Of its bytes.
    text : str
        What a screen reader says in its place.
    width, height : float
        In pixels.
    """

    map: str
    file: Path
    sha256: str
    text: str
    width: float
    height: float


@dataclass(frozen=True, kw_only=True)
class Design:
    """A whole study, ready to be served.

    Parameters
    ----------
    folder : Path
        Where its files lie.
    fingerprint : str
        Changes with everything that a participant can see or that is recorded.
    title, language, contact, version : str
        `language` is a tag such as "en"; `contact` an address for questions ("" where none is given).
    kinds, maps, items, groupings : tuples
        In the order of the file. `items` are rated after every explanation.
    consent, instructions, comprehension, attention, trial, about, thanks
        The other pages; `about` may record nothing, then there is no such screen.
    kind_order, map_order : Order
    seed : int
        Of the order of cards.
    quota : int
        How many participants are wanted.
    longest_gap : float
        Hours after which an unfinished participant has dropped out, and their place is given to another.
    failed_checks_allowed : int
        So many attention checks may fail: more end with the code of failed checks.
    codes : Codes
    stimuli : mapping of (map, kind) to Stimulus
    pictures : mapping of map to Picture
    words : mapping of str to str
        Words of the interface (buttons, what is said while an answer is saved) in place of those that come with the program.
    """

    folder: Path
    fingerprint: str
    title: str
    language: str
    contact: str
    version: str
    kinds: tuple[Kind, ...]
    maps: tuple[StudyMap, ...]
    items: tuple[Record, ...]
    groupings: tuple[Grouping, ...]
    consent: Consent
    instructions: tuple[Page, ...]
    comprehension: Comprehension
    attention: tuple[Attention, ...]
    trial: Trial
    about: Page
    about_records: tuple[Record, ...]
    thanks: Page
    kind_order: Order
    map_order: Order
    seed: int
    quota: int
    longest_gap: float
    failed_checks_allowed: int
    codes: Codes
    stimuli: Mapping[tuple[str, str], Stimulus] = field(default_factory=dict)
    pictures: Mapping[str, Picture] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)

"""The text of a DRN file enters; what its head says leaves: type, names of rewards, counts, placeholders."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NoReturn

from ratherthan.errors import SourceError
from ratherthan.io._drn_text import Text

__all__ = ["OWN", "Head", "read_head", "value_of"]

OWN = b"// ratherthan: "
"""How our own comment begins: the true names, where the format cannot hold them as they are."""

LONGEST_LINE = 64 << 20
STEP = 1 << 16
DECIMAL = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,9})?")
FRACTION = re.compile(rb"([+-]?[\d.]+)\s*/\s*([\d.]+)")
REFUSED = {
    "ctmc": "a continuous-time Markov chain",
    "markov automaton": "a Markov automaton, which runs in continuous time",
    "ma": "a Markov automaton, which runs in continuous time",
    "pomdp": "a partially observable MDP",
    "s2pg": "a game of two players",
    "smg": "a game of several players",
}


@dataclass
class Head:
    """What stands before ``@model``.

    Parameters
    ----------
    type : str
        ``"mdp"`` or ``"dtmc"``.
    rewards : list of str
        Names of the reward structures in the order of the brackets.
    states, choices : int, optional
        How many there must be, where it is said.
    placeholders : mapping of bytes to float
    own : mapping of str to anything
        Our own comment.
    """

    type: str = ""
    rewards: list[str] = field(default_factory=list)
    states: int | None = None
    choices: int | None = None
    placeholders: dict[bytes, float] = field(default_factory=dict)
    own: Mapping[str, Any] = field(default_factory=dict)


def value_of(text: bytes, placeholders: Mapping[bytes, float]) -> float | None:
    """Return a finite number, decimal or a fraction, or what a placeholder stands for; None where it is none of these."""
    if DECIMAL.fullmatch(text):
        value = float(text)
        return value if math.isfinite(value) else None
    if text.startswith(b"$"):
        return placeholders.get(text)
    fraction = FRACTION.fullmatch(text)
    if fraction is None:
        return None
    try:
        return float(Fraction(fraction[1].decode()) / Fraction(fraction[2].decode()))
    except (ValueError, ZeroDivisionError, OverflowError):
        return None


class _Lines:
    """The lines of the head, one by one, with their numbers; what follows the head is given back to the text."""

    def __init__(self, text: Text, shown: str) -> None:
        self.text, self.shown = text, shown
        self.left = b""
        self.number = 0
        self.ended = False

    def opens_section(self) -> bool:
        """Return whether the next line begins a section, or there is none."""
        self._fill()
        return not self.left or self.left.lstrip(b" \t").startswith(b"@")

    def _fill(self) -> None:
        """Read on until a whole line is there."""
        while b"\n" not in self.left and not self.ended:
            more = self.text.read(STEP)
            self.ended = not more
            self.left += more
            if b"\x00" in more or len(self.left) > LONGEST_LINE:
                raise SourceError(f"A DRN file must be text, but '{self.shown}' is binary. Check what it is.")

    def next(self) -> bytes | None:
        """Return the next line without its end, None after the last."""
        self._fill()
        if not self.left:
            return None
        self.number += 1
        line, _, self.left = self.left.partition(b"\n")
        return line.removeprefix(b"\xef\xbb\xbf").rstrip(b"\r") if self.number == 1 else line.rstrip(b"\r")

    def fail(self, sentence: str) -> NoReturn:
        raise SourceError(f"'{self.shown}', line {self.number}: {sentence}", line=self.number)


def read_head(text: Text, shown: str) -> tuple[Head, bytes, int]:
    """Read the head of a DRN file.

    Parameters
    ----------
    text : Text
        At its beginning.
    shown : str
        How the file is called in errors.

    Returns
    -------
    Head
    bytes
        What was read beyond it.
    int
        How many lines it has.

    Raises
    ------
    SourceError
        With the line that breaks the format, or the reason why such a model is not read.
    """
    lines, head = _Lines(text, shown), Head()
    seen: set[bytes] = set()
    for line in _sections(lines):
        key = line.split(b":")[0].split()[0]
        if key in seen:
            lines.fail(f"'{_plain(key)}' must stand once, but it stands twice. Remove one.")
        seen.add(key)
        if key == b"@model":
            break
        _take_section(lines, head, key, line)
    else:
        what = f"'{shown}' ends before its line @model" if seen else f"'{shown}' has no line that begins with @"
        raise SourceError(
            f"A DRN file must have a head and, after a line @model, its states; but {what}. Check the file."
        )
    if not head.type:
        lines.fail("the head must have a line '@type: MDP' or '@type: DTMC' before @model. Add it.")
    return head, lines.left, lines.number


def _sections(lines: _Lines) -> Iterator[bytes]:
    """Yield the lines of the head that begin a section; our own comment as a section of its own."""
    while (line := lines.next()) is not None:
        line = line.strip()
        if line.startswith(OWN):
            yield b"@own: " + line.removeprefix(OWN)
        elif line and not line.startswith(b"//"):
            if not line.startswith(b"@"):
                lines.fail(f"the head of a DRN file must consist of lines that begin with @, got '{_plain(line)}'.")
            yield line


def _take_section(lines: _Lines, head: Head, key: bytes, line: bytes) -> None:
    """Read one section of the head into `head`."""
    said = _plain(line.partition(b":")[2].strip())
    match key:
        case b"@own":
            head.own = _own(lines, line.partition(b":")[2])
        case b"@type":
            head.type = said.lower()
            _check_type(lines, said)
        case b"@value_type":
            _check_value_type(lines, said)
        case b"@parameters":
            names = "" if lines.opens_section() else _plain((lines.next() or b"").strip())
            if names:
                lines.fail(
                    f"probabilities must be plain numbers, but the model has the parameters {names}. Give them values first."
                )
        case b"@placeholders":
            _take_placeholders(lines, head)
        case b"@reward_models":
            head.rewards = _reward_names(lines)
        case b"@nr_states":
            head.states = _count(lines, "@nr_states")
        case b"@nr_choices":
            head.choices = _count(lines, "@nr_choices")
        case _:
            lines.fail(f"the head knows no '{_plain(key)}'. Remove the line, or write the file anew.")


def _check_type(lines: _Lines, said: str) -> None:
    if said.lower() not in ("mdp", "dtmc"):
        came = f"it is {REFUSED[said.lower()]}" if said.lower() in REFUSED else f"its type is '{said}'"
        lines.fail(f"the model must be an MDP or a DTMC, but {came}.")


def _check_value_type(lines: _Lines, said: str) -> None:
    if said in ("double", "rational"):
        return
    reason = f"are of the unknown type '{said}'"
    if said == "parametric":
        reason = "are functions of parameters: give these values first"
    elif said.endswith("interval"):
        reason = "are intervals"
    lines.fail(f"probabilities must be plain numbers (double or rational), but they {reason}.")


def _reward_names(lines: _Lines) -> list[str]:
    """Return names with one blank between them; Storm ends the line with one, and calls a nameless reward nothing."""
    line = b"" if lines.opens_section() else lines.next() or b""
    try:
        text = line.decode("utf-8")
    except UnicodeDecodeError:
        lines.fail("names must be UTF-8 text, but these are not.")
    names = re.split(r"[ \t]", text.removesuffix(" ")) if text else []
    if len(set(names)) < len(names):
        lines.fail(f"the names of rewards must differ, got '{text}'.")
    return names


def _own(lines: _Lines, text: bytes) -> Mapping[str, Any]:
    try:
        own = json.loads(text)
    except (ValueError, RecursionError):
        own = None
    if not (isinstance(own, dict) and all(_are_pairs(pairs, unique=key != "actions") for key, pairs in own.items())):
        lines.fail(
            "the comment that begins with '// ratherthan:' must hold lists of pairs of names, each once. Remove it, or "
            "write the file anew."
        )
    checked: Mapping[str, Any] = own
    return checked


def _are_pairs(pairs: Any, *, unique: bool) -> bool:
    """Return whether these are pairs of a name as it is spelled, each once, and the true one (each once, too: `unique`)."""
    if not isinstance(pairs, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in pairs):
        return False
    if not all(isinstance(name, str) for pair in pairs for name in pair):
        return False
    return all(len({pair[i] for pair in pairs}) == len(pairs) for i in ((0, 1) if unique else (0,)))


def _take_placeholders(lines: _Lines, head: Head) -> None:
    """Read lines ``$name : value`` up to the next section, which begins with @."""
    while not lines.opens_section():
        line = lines.next() or b""
        if not line.strip() or line.startswith(b"//"):
            continue
        name, colon, text = (part.strip() for part in line.partition(b":"))
        value = value_of(text, head.placeholders)
        if not (name.startswith(b"$") and colon):
            lines.fail(f"a placeholder must be written '$name : number', got '{_plain(line)}'.")
        if value is None:
            lines.fail(f"the placeholder {_plain(name)} must stand for a number, got '{_plain(text)}'.")
        if name in head.placeholders:
            lines.fail(f"the placeholder {_plain(name)} must be explained once, but it stands here twice.")
        head.placeholders[name] = value


def _count(lines: _Lines, what: str) -> int:
    text = (lines.next() or b"").strip()
    if not (text.isdigit() and len(text) < 18):
        lines.fail(f"after {what} there must be a whole number, got '{_plain(text)}'.")
    return int(text)


def _plain(text: bytes) -> str:
    """Return a piece of the file as an error shows it."""
    shown = text.decode("utf-8", errors="replace")
    return shown if len(shown) <= 80 else shown[:77] + "…"

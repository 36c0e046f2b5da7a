"""The lines of a DRN file after ``@model`` enter, block by block; arrays of its states, choices and branches leave.

Nothing is interpreted twice: of the many lines that are equal but for a number, what follows the number is kept once, with
a code per line. So a million lines take about a second.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ratherthan.errors import SourceError
from ratherthan.io._drn_head import Head
from ratherthan.io._drn_numbers import brackets, numbers
from ratherthan.model.mdp import Floats

__all__ = ["Body", "Said", "plain"]

Numbers = npt.NDArray[np.int64]
STATE, ACTION, COMMENT, END = ord("s"), ord("a"), ord("/"), ord("\n")
BLANKS = np.frombuffer(b" \t\r", dtype=np.uint8)
MOST_INDENT = 40
VALUATION = b"//["
MOST_DIGITS = 18


def plain(text: bytes) -> str:
    """Return a piece of the file as an error shows it."""
    shown = text.decode("utf-8", errors="replace")
    return shown if len(shown) <= 80 else shown[:77] + "…"


@dataclass
class Said:
    """What is said on many lines: each different text once, a code and the number of its line for each."""

    texts: dict[bytes, int] = field(default_factory=dict)
    codes: list[Numbers] = field(default_factory=list)
    lines: list[Numbers] = field(default_factory=list)

    def add(self, texts: Iterable[bytes], lines: Numbers) -> None:
        """Add lines in their order."""
        known = self.texts
        codes = [known.setdefault(text, len(known)) for text in texts]
        self.codes.append(np.array(codes, dtype=np.int64))
        self.lines.append(lines)

    def code(self) -> Numbers:
        """Return the code of every line."""
        return joined(self.codes)

    def line(self) -> Numbers:
        """Return the number of every line."""
        return joined(self.lines)

    def first_line(self, code: int) -> int:
        """Return the first line that says the text with this code."""
        return int(self.line()[np.argmax(self.code() == code)])


def joined(parts: list[npt.NDArray[Any]], dtype: Any = np.int64) -> npt.NDArray[Any]:
    """Return arrays as one; none give an empty one."""
    return np.concatenate(parts) if parts else np.zeros(0, dtype=dtype)


class Body:
    """The states of a DRN file.

    Parameters
    ----------
    head : Head
    line : int
        How many lines stand before.
    shown : str
        How the file is called in errors.
    """

    def __init__(self, head: Head, line: int, shown: str) -> None:
        self.head, self.line, self.shown = head, line, shown
        self.states, self.choices = Said(), Said()
        self.state_rewards: list[Floats] = []
        self.choice_rewards: list[Floats] = []
        self.state_of_choice: list[Numbers] = []
        self.choice_of_branch: list[Numbers] = []
        self.targets: list[Numbers] = []
        self.probabilities: list[npt.NDArray[np.float64]] = []
        self.branch_lines: list[Numbers] = []
        self.valuations: list[tuple[int, bytes]] = []
        self.state_count = self.choice_count = 0
        self._before = 0  # the kind of the last line that says something

    def fail(self, line: int, sentence: str) -> NoReturn:
        """Raise SourceError for a line."""
        raise SourceError(f"'{self.shown}', line {line}: {sentence}", line=int(line))

    def take(self, block: bytes) -> None:
        """Take in whole lines."""
        if not block:
            return
        lines = _Lines.of(block)
        first = self.line + 1
        self.line += len(lines.kinds)
        self._take_valuations(lines)
        kinds = lines.kinds
        telling = np.flatnonzero((kinds != COMMENT) & (kinds != END))
        if len(telling) == 0:
            return
        kinds = kinds[telling]
        digit = (kinds >= ord("0")) & (kinds <= ord("9"))
        strange = ~(digit | (kinds == STATE) | (kinds == ACTION))
        if strange.any():
            at = int(telling[strange.argmax()])
            self.fail(
                first + at,
                "after @model a line must begin with 'state', with 'action', or with the number of a state that is "
                f"reached, got '{lines.shown(at)}'.",
            )
        if self._before == 0 and kinds[0] != STATE:
            shown = lines.shown(int(telling[0]))
            self.fail(first + int(telling[0]), f"the first line after @model must be 'state 0', got '{shown}'.")
        before = np.concatenate([[self._before], kinds[:-1]])
        begins = (kinds == ACTION) | (digit & (before == STATE))  # a state's first branch may do without an action
        state = self.state_count - 1 + np.cumsum(kinds == STATE)
        self.state_of_choice.append(state[begins])
        self.choice_of_branch.append((self.choice_count - 1 + np.cumsum(begins))[digit])
        self._take_states(lines, telling[kinds == STATE], first)
        self._take_choices(lines, telling[begins], first)
        self._take_branches(lines, telling[digit], first)
        self._before = int(kinds[-1])

    def _take_states(self, lines: _Lines, at: Numbers, first: int) -> None:
        rows = lines.rows(at)
        numbers_ = [b"state %d" % i for i in range(self.state_count, self.state_count + len(rows))]
        for i, row, wanted in zip(at.tolist(), rows, numbers_, strict=True):
            if not row.startswith(wanted) or row[len(wanted) : len(wanted) + 1].strip():
                self.fail(
                    first + i,
                    f"states must be numbered one after the other, here '{wanted.decode()}', got '{plain(row)}'.",
                )
        self.state_count += len(rows)
        tails = [row[len(wanted) :].lstrip() for row, wanted in zip(rows, numbers_, strict=True)]
        rewards = [tail[1:].partition(b"]")[0] if tail[:1] == b"[" else b"" for tail in tails]
        self.state_rewards.append(self._rewards(rewards, first + at))
        self.states.add([tail.partition(b"]")[2] if tail[:1] == b"[" else tail for tail in tails], first + at)

    def _take_choices(self, lines: _Lines, at: Numbers, first: int) -> None:
        """Take in the lines that begin a choice: an action, or the first branch of a state without one."""
        rows = lines.rows(at)
        self.choice_count += len(rows)
        for i in [i for i, row in enumerate(rows) if row[:7] != b"action "]:
            if rows[i][:1] == b"a" and rows[i] != b"action":
                self.fail(first + int(at[i]), f"a choice must be written 'action NAME', got '{plain(rows[i])}'.")
            rows[i] = b"action "
        names = [row[6:].rpartition(b" [")[0] if row[-1:] == b"]" and b" [" in row else row[6:] for row in rows]
        rewards = [row[len(name) + 8 : -1] for row, name in zip(rows, names, strict=True)]
        self.choice_rewards.append(self._rewards(rewards, first + at))
        self.choices.add([name.strip() for name in names], first + at)

    def _rewards(self, texts: list[bytes], lines: Numbers) -> Floats:
        table = brackets(texts, self.head.placeholders)
        if isinstance(table, int):
            self.fail(int(lines[table]), f"rewards must be finite numbers, got '[{plain(texts[table])}]'.")
        return table

    def _take_branches(self, lines: _Lines, at: Numbers, first: int) -> None:
        parts = lines.text(at).replace(b":", b" : ").split()
        if len(parts) != 3 * len(at) or parts[1::3].count(b":") != len(at):  # 1 / 3 has blanks; or something is wrong
            split = [row.partition(b":") for row in lines.rows(at)]
            parts = [part.strip() for parts_ in split for part in parts_]
        targets, said = parts[0::3], parts[2::3]
        if not all(map(bytes.isdigit, targets)) or max(map(len, targets), default=0) > MOST_DIGITS:
            wrong = next(i for i, target in enumerate(targets) if not target.isdigit() or len(target) > MOST_DIGITS)
            self._fail_branch(first + int(at[wrong]), lines.rows(at[wrong : wrong + 1])[0])
        values = numbers(said, self.head.placeholders)
        if isinstance(values, int):
            self._fail_branch(first + int(at[values]), lines.rows(at[values : values + 1])[0])
        self.targets.append(np.array(list(map(int, targets)), dtype=np.int64))
        self.probabilities.append(values)
        self.branch_lines.append(first + at)

    def _fail_branch(self, line: int, row: bytes) -> NoReturn:
        value = row.partition(b":")[2].strip()
        reason = ""
        if value.startswith((b"[", b"(")):
            reason = " Intervals are not read."
        elif value.startswith(b"$"):
            reason = " The head explains no such placeholder."
        self.fail(
            line, f"a branch must be written 'STATE : PROBABILITY', two plain numbers, got '{plain(row)}'.{reason}"
        )

    def _take_valuations(self, lines: _Lines) -> None:
        """Keep the comments right after a state in which Storm tells its variables."""
        kinds = lines.kinds
        follows = np.concatenate([[self._before == STATE], kinds[:-1] == STATE])
        states = self.state_count - 1 + np.cumsum(kinds == STATE)
        at = np.flatnonzero((kinds == COMMENT) & follows)
        for state, row in zip(states[at].tolist(), lines.rows(at), strict=True):
            if row.startswith(VALUATION) and row.endswith(b"]"):
                self.valuations.append((state, row[3:-1]))


class _Lines:
    """The lines of a block: where each begins, and the first character of each that is no blank."""

    def __init__(self, block: bytes, starts: Numbers, lengths: Numbers, kinds: npt.NDArray[np.uint8]) -> None:
        self.block, self.starts, self.lengths, self.kinds = block, starts, lengths, kinds

    @classmethod
    def of(cls, block: bytes) -> _Lines:
        """Find the lines of a block."""
        if not block.endswith(b"\n"):
            block += b"\n"
        letters = np.frombuffer(block, dtype=np.uint8)
        ends = np.flatnonzero(letters == END)
        starts = np.concatenate([[0], ends[:-1] + 1])
        at = starts.copy()
        blank = np.arange(len(at))
        for _ in range(MOST_INDENT):
            blank = blank[np.isin(letters[at[blank]], BLANKS)]
            if len(blank) == 0:
                break
            at[blank] += 1
        for i in blank.tolist():
            row = block[at[i] : ends[i] + 1]
            at[i] += len(row) - len(row.lstrip(b" \t\r"))
        return cls(block, starts, ends + 1 - starts, letters[at])

    def text(self, at: Numbers) -> bytes:
        """Return some of the lines as one text."""
        chosen = np.zeros(len(self.kinds), dtype=bool)
        chosen[at] = True
        letters = np.frombuffer(self.block, dtype=np.uint8)
        text: bytes = letters[np.repeat(chosen, self.lengths)].tobytes()
        return text

    def rows(self, at: Numbers) -> list[bytes]:
        """Return some of the lines, without blanks around them."""
        return [row.strip() for row in self.text(at).split(b"\n")[:-1]]

    def shown(self, at: int) -> str:
        """Return a line as an error shows it."""
        return plain(self.rows(np.array([at]))[0])

"""An automaton and the names of a model enter; the names of a product's states leave: "grid 7, parcel picked up, 3 steps left".

What is said behind the name of a state, and only if it is so:

* the parts of the mission that are done: state formulas that had to come, are no longer asked for, and have held on *each*
  way that leads to this memory (a fixed point over the automaton: ⋂ over what leads there);
* how many steps are left, where one bound is running;
* in an end "done", "failed", or "too late" where nothing but its steps can make the mission fail; where the mission is to be
  avoided (its chance is minimised) "failed", or "averted" where it can come no more;
* what is left to do, where the above does not tell two memories apart; what is longer than a line is cut, and numbered.

Nothing is said where all of the mission is still to do.
"""

from __future__ import annotations

import re
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence

from ratherthan.model.automaton import Automaton
from ratherthan.model.lexicon import Lexicon
from ratherthan.model.mdp import Ints
from ratherthan.model.names import Columns, Pairs, StateNames
from ratherthan.model.progression import FALSE, TRUE, Formulas
from ratherthan.model.syntax import Term, text_of

__all__ = ["endings", "pair_names"]

_DONE, _FAILED, _LATE, _AVERTED = "done", "failed", "too late", "averted"
_PARTICIPLE = ("done", "got", "found", "met", "made", "taken", "seen", "sent", "brought", "left", "won", "lost")
_COMPARED = {
    "=": "was", "!=": "was not", "<": "was below", "<=": "was at most", ">": "was above", ">=": "was at least"
}  # fmt: skip
_MOST_LETTERS = 100  # of what is said behind a name
_MOST_VARIABLES = 6  # a state with more is called by its number


def pair_names(names: StateNames, lexicon: Lexicon, state: Ints, memory: Ints, endings: Sequence[str]) -> StateNames:
    """Return the names of a product's states.

    Parameters
    ----------
    names : StateNames
        Those of the model.
    lexicon : Lexicon
        How it calls its states.
    state, memory : array of int, ``[S]``
        The state of the model and the memory of each pair.
    endings : sequence of str
        What is said behind a state's name for each memory.
    """
    pairs = Pairs(_phrase(names, lexicon), names, state, memory, endings)
    return StateNames(count=len(state), strings=pairs, variables=Columns(names.variables, state))


def _phrase(names: StateNames, lexicon: Lexicon) -> Callable[[int], str]:
    """Return how states are called in sentences, as a function of their number."""

    def phrase(state: int) -> str:
        name = names[state]
        single = lexicon.states.get(name) or lexicon.states.get(str(state))
        if single:
            return single
        if lexicon.state:
            return lexicon.state.replace("{number}", str(state)).replace("{name}", name)
        if not names.named or name.count("=") > _MOST_VARIABLES:
            return f"state {state}"
        return f"state {state} ({name})" if "=" in name or name.strip("+-. ").isdigit() else name

    return phrase


def endings(automaton: Automaton, memories: Sequence[int], *, maximise: bool = True) -> tuple[str, ...]:
    """Return what is said behind a state's name for each of some memories, "" or beginning with a comma.

    Parameters
    ----------
    automaton : Automaton
    memories : sequence of int
        The memories that occur; the answers differ.
    maximise : bool
        Whether the mission is wanted; else it is to be avoided.
    """
    spoken = _Spoken(automaton, wanted=maximise)
    said = {m: spoken.briefly(m) for m in memories}
    counted = Counter(said.values())
    for m in memories:
        if counted[said[m]] > 1 and not spoken.fixed(m):
            said[m] = ", ".join([*spoken.done(m), f"left: {spoken.whole(m)}"])
    counted = Counter(said.values())
    for m in memories:
        if counted[said[m]] > 1 and not spoken.fixed(m):
            said[m] = f"left: {spoken.exactly(m)}"
    said = {m: _shortened(text) for m, text in said.items()}
    taken: Counter[str] = Counter()
    for m in memories:  # a label may be spelt like any of these words, and long ones may begin alike
        taken[said[m]] += 1
        if taken[said[m]] > 1:
            said[m] = f"{said[m]} ({taken[said[m]]})"
    return tuple(f", {said[m]}" if said[m] else "" for m in memories)


class _Spoken:
    """The memories of an automaton in words."""

    def __init__(self, automaton: Automaton, *, wanted: bool) -> None:
        self.automaton = automaton
        self.wanted = wanted
        self.formulas = automaton.formulas
        self.targets = list(dict.fromkeys(_targets(self.formulas, automaton.mission)))
        self.held = _held(automaton)
        occurring = [any(column) for column in zip(*automaton.letters, strict=True)]
        self.can_fail = not all(occurring) or _can_fail(self.formulas, automaton.mission)

    def fixed(self, memory: int) -> bool:
        """Whether the words of a memory stay as they are: an end, and the beginning."""
        a = self.automaton
        return bool(a.satisfied[memory] or a.violated[memory] or a.left[memory] == a.mission)

    def exactly(self, memory: int) -> str:
        """Return what is left as a formula."""
        return text_of(self.formulas.term(int(self.automaton.left[memory])))

    def briefly(self, memory: int) -> str:
        """Return which parts are done and how many steps are left."""
        a, left = self.automaton, int(self.automaton.left[memory])
        if a.satisfied[memory]:
            return _DONE if self.wanted else _FAILED
        if a.violated[memory]:
            return _AVERTED if not self.wanted else _FAILED if self.can_fail else _LATE
        steps = set(_running(self.formulas, left))
        count = steps.pop() if len(steps) == 1 else None
        running = [] if count is None else [f"{_steps(count)} left"]
        return ", ".join(self.done(memory) + running)

    def done(self, memory: int) -> list[str]:
        """Return the parts that are done."""
        open_ = set(_targets(self.formulas, int(self.automaton.left[memory])))
        done = [t for t in self.targets if t not in open_ and self.held[memory] >> t & 1]
        return [_reached(self.formulas.atoms[t]) for t in done if _can_be_reached(self.formulas.atoms[t])]

    def whole(self, memory: int) -> str:
        """Return what is left to do, in words as far as there are some."""
        return self._words(int(self.automaton.left[memory]), 1)

    def _words(self, formula: int, elapsed: int) -> str:
        """Return a formula in words; `elapsed` is 1 where its steps count from the next instant."""
        op, args, low, high = self.formulas.node(formula)
        if op == "a":
            return _called(self.formulas.atoms[args[0]]) + " next" * elapsed
        if op in ("&", "|"):
            return self._joined(op, args, elapsed)
        if op == "X":
            inner = self._words(args[0], 0)
            inner = inner if self.formulas.node(args[0])[0] == "a" else f"({inner})"
            return f"{inner} {_in_steps(low + elapsed, low + elapsed)}"
        inner = self._words(args[1], 0)
        first, last = low + elapsed if low else 0, high if high < 0 else high + elapsed
        span = "" if (low, high) == (0, -1) else f" {_in_steps(first, last)}"
        if span and self.formulas.node(args[1])[0] != "a":
            inner = f"({inner})"
        if op == "U":
            return f"{inner}{span}" if args[0] == TRUE else f"{self._words(args[0], 0)} until {inner}{span}"
        if args[0] == FALSE and low == 0:
            return f"{inner} for {_steps(high + elapsed)}"
        return text_of(self.formulas.term(formula))

    def _joined(self, op: str, args: Sequence[int], elapsed: int) -> str:
        now = [arg for arg in args if self.formulas.node(arg)[0] == "a"]
        later = [arg for arg in args if arg not in now]
        words = [self._words(arg, elapsed) for arg in (*now, *later)]
        bracketed = [
            f"({text})" if self.formulas.node(arg)[0] in ("&", "|") else text
            for arg, text in zip((*now, *later), words, strict=True)
        ]
        if op == "&" and now and later and not elapsed:
            return f"{' and '.join(bracketed[: len(now)])} then {' and '.join(bracketed[len(now) :])}"
        return (" and " if op == "&" else " or ").join(bracketed)


def _targets(formulas: Formulas, formula: int) -> Iterator[int]:
    """Yield the state formulas that must come, as numbers of atoms, in the order of the mission."""
    op, args, _, _ = formulas.node(formula)
    if op == "a":
        yield args[0]
    elif op == "U":
        yield from _targets(formulas, args[1])
    elif op in ("&", "|", "X"):
        for arg in args:
            yield from _targets(formulas, arg)


def _running(formulas: Formulas, formula: int) -> Iterator[int | None]:
    """Yield the steps after which each part is decided, None for a part where that is not one bound's matter."""
    op, args, low, high = formulas.node(formula)
    if op in ("&", "|"):
        for arg in args:
            yield from _running(formulas, arg)
    elif op == "a":
        yield 1
    elif not all(_momentary(formulas, arg) for arg in args):
        yield None
    elif op == "X":
        yield low + 1
    else:
        yield high + 1 if high >= 0 else None


def _momentary(formulas: Formulas, formula: int) -> bool:
    """Whether a formula speaks of one instant only."""
    op, args, _, _ = formulas.node(formula)
    return op in ("a", "true", "false") or (op in ("&", "|") and all(_momentary(formulas, arg) for arg in args))


def _can_fail(formulas: Formulas, formula: int) -> bool:
    """Whether a formula may fail otherwise than by its steps running out; True where it is not seen."""
    op, args, low, _ = formulas.node(formula)
    if op == "U" and args[0] == TRUE and low == 0:
        return _can_fail_later(formulas, args[1])
    if op in ("&", "|"):
        return any(_can_fail(formulas, arg) for arg in args)
    return True


def _can_fail_later(formulas: Formulas, formula: int) -> bool:
    """Whether a formula, awaited for ever, can become impossible: state formulas come or do not."""
    op, args, _, _ = formulas.node(formula)
    if op == "a":
        return False
    if op == "&" and sum(formulas.node(arg)[0] == "a" for arg in args) > 1:
        return True  # they may never hold together
    if op in ("&", "|"):
        return any(_can_fail_later(formulas, arg) for arg in args)
    return _can_fail(formulas, formula)


def _held(automaton: Automaton) -> list[int]:
    """Return, as bits, the atoms that have held on each way to a memory."""
    letters = [sum(1 << atom for atom, true in enumerate(truth) if true) for truth in automaton.letters]
    held: dict[int, int] = {}
    after, ended = automaton.after.tolist(), automaton.satisfied | automaton.violated
    waiting = deque([(automaton.start, 0)])  # the beginning: nothing has held before the first letter
    while waiting:
        memory, before = waiting.popleft()
        for reached, bits in zip(after[memory], letters, strict=True):
            known = held.get(reached, -1)  # all bits set: no way there is known yet
            if known & (before | bits) != known:
                held[reached] = known & (before | bits)
                if not ended[reached]:
                    waiting.append((reached, held[reached]))
    return [held.get(memory, 0) for memory in range(len(after))]


def _can_be_reached(term: Term) -> bool:
    """Whether "reached" can stand behind a state formula: labels and comparisons, not what is not."""
    return term.op not in ("!", "=>", "<=>", "?:") and all(map(_can_be_reached, term.args))


def _reached(term: Term) -> str:
    """Return a state formula as something done: "picked up", "door reached", "x was 3"."""
    if term.op in _COMPARED:
        left, right = (text_of(arg) for arg in term.args)
        return f"{left} {_COMPARED[term.op]} {right}"
    words = _called(term)
    done = any(word in _PARTICIPLE or re.fullmatch(r"\w{2,}[^\We]ed", word) for word in words.split())
    reserved = words in (_DONE, _FAILED, _LATE, _AVERTED) or re.fullmatch(r"\d+ steps? left", words)
    return words if done and not reserved else f"{words} reached"


def _called(term: Term) -> str:
    """Return a state formula in words: labels with blanks for underscores."""
    if term.op in ("label", "name"):
        return str(term.value).replace("_", " ")
    if term.op == "!" and term.args[0].op in ("label", "name"):
        return f"not {_called(term.args[0])}"
    if term.op in ("&", "|"):
        words = [f"({_called(arg)})" if arg.op in ("&", "|") else _called(arg) for arg in term.args]
        return (" and " if term.op == "&" else " or ").join(words)
    return text_of(term)


def _shortened(text: str) -> str:
    """Return a text, cut behind a word where it is longer than a line."""
    if len(text) <= _MOST_LETTERS:
        return text
    kept = text[:_MOST_LETTERS].rpartition(" ")[0] or text[:_MOST_LETTERS]
    return f"{kept.rstrip(' (,')} …"


def _steps(count: int) -> str:
    return f"{count} step{'s' * (count != 1)}"


def _in_steps(low: int, high: int) -> str:
    if high < 0:
        return f"after {_steps(low)} or more"
    if low == high:
        return f"in {_steps(low)}"
    return f"in {low} to {_steps(high)}" if low else f"within {_steps(high)}"

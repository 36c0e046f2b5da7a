"""The memory of a mission: it accepts what the formula says, is as small as can be, and is refused when it is too large."""

from __future__ import annotations

import itertools
import os
from random import Random

import numpy as np
import pytest
from lasso import Lasso, Letter, random_path, random_word

from ratherthan.errors import NotExplainableError, PropertyError
from ratherthan.model import automaton as automata
from ratherthan.model.automaton import Automaton, automaton_of
from ratherthan.model.mdp import MDP
from ratherthan.model.path import positive, settled
from ratherthan.model.problem import Problem
from ratherthan.model.progression import TRUE
from ratherthan.model.reading import read
from ratherthan.model.syntax import Term, text_of
from ratherthan.model.temporal import chance_of

LABELS = ("a", "b", "c")
SETS = [frozenset(some) for n in range(4) for some in itertools.combinations(LABELS, n)]
TRIES = int(os.environ.get("RATHERTHAN_MODELS", "300"))


def model_with(sets: list[Letter]) -> MDP:
    """A model with one state per set of labels, each leading to all."""
    count = len(sets)
    return MDP(
        state_to_choices=np.arange(count + 1),
        choice_to_branches=np.arange(0, count * count + 1, count),
        branch_to_target=np.tile(np.arange(count), count),
        branch_to_probability=np.full(count * count, 1 / count),
        initial=np.array([0]),
        labels={label: np.array([label in some for some in sets]) for label in LABELS},
    )


EVERYTHING = model_with(SETS)


def path(text: str) -> Term:
    return settled(read("property", f"Pmax=? [{text}]", "property").path, {})


def automaton(text: str, mdp: MDP = EVERYTHING) -> Automaton:
    return automaton_of(positive(path(text)), mdp)


def live(found: Automaton) -> int:
    return int((~(found.satisfied | found.violated)).sum())


def random_cosafe(random: Random) -> Term:
    while True:
        term = random_path(random, LABELS)
        try:
            return chance_of(term, Problem(mdp=EVERYTHING), maximise=True)
        except PropertyError:
            continue


@pytest.mark.parametrize("seed", range(TRIES))
def test_a_word_is_accepted_exactly_if_it_satisfies_the_formula(seed: int) -> None:
    random = Random(seed)
    term = random_cosafe(random)
    found = automaton_of(positive(term), EVERYTHING)
    for _ in range(25):
        before, again = random_word(random, LABELS, random.randrange(5)), random_word(random, LABELS, 1 + seed % 3)
        memory, rounds = found.start, 2 + len(found.left)
        for letter in itertools.chain(before, *([again] * rounds)):
            memory = int(found.after[memory, found.letter_of_state[SETS.index(letter)]])
        assert bool(found.satisfied[memory]) == Lasso(before, again).holds(term), (text_of(term), before, again)


@pytest.mark.parametrize("seed", range(0, TRIES, 3))
def test_no_two_memories_leave_the_same(seed: int) -> None:
    found = automaton_of(positive(random_cosafe(Random(seed))), EVERYTHING)
    count = len(found.left)
    differ = found.satisfied[:, None] != found.satisfied[None, :]
    for _ in range(count):
        differ |= differ[found.after[:, None, :], found.after[None, :, :]].any(axis=2)
    assert (differ | np.eye(count, dtype=bool)).all()
    assert found.satisfied.sum() <= 1
    assert found.violated.sum() <= 1
    for end in np.flatnonzero(found.satisfied | found.violated):
        assert (found.after[end] == end).all()


@pytest.mark.parametrize("seed", range(0, TRIES, 3))
def test_an_end_is_told_as_soon_as_nothing_can_change_it(seed: int) -> None:
    """From every other memory there is a way to satisfy the mission, and one on which it never is."""
    found = automaton_of(positive(random_cosafe(Random(seed))), EVERYTHING)
    can = found.satisfied.copy()
    never = ~found.satisfied
    for _ in found.left:
        can |= can[found.after].any(axis=1)
        never &= never[found.after].any(axis=1)
    assert (can == ~found.violated).all()
    assert (never == ~found.satisfied).all()


@pytest.mark.parametrize("seed", range(0, TRIES, 3))
def test_what_is_left_is_what_the_memory_stands_for(seed: int) -> None:
    """The formula told for a memory holds of exactly the words that lead from there to the end."""
    random = Random(seed)
    found = automaton_of(positive(random_cosafe(random)), EVERYTHING)
    for memory, formula in enumerate(found.left):
        told = found.formulas.term(int(formula))
        for _ in range(5):
            before, again = random_word(random, LABELS, 4), random_word(random, LABELS, 2)
            after = memory
            for letter in itertools.chain(before, *([again] * (2 + len(found.left)))):
                after = int(found.after[after, found.letter_of_state[SETS.index(letter)]])
            assert bool(found.satisfied[after]) == Lasso(before, again).holds(told), text_of(told)


@pytest.mark.parametrize(
    ("text", "memories"),
    [
        ('F "a"', 1),
        ('F ("a" & (F "b"))', 2),
        ('(F "a") & (F "b")', 3),
        ('(F "a") & (F "b") & (F "c")', 7),
        ('F "a" | F "b"', 1),
        ('!"c" U "a"', 1),
        ('(!"c" U "a") & (F "b")', 3),
        ('F<=5 "a"', 6),
        ('F[2,5] "a"', 6),
        ('G<=5 "a"', 6),
        ('X X "a"', 3),
        ('(F<=5 "a") & (F<=5 "b")', 1 + 5 * 3),
        ('F ("a" & ("a" => X "b"))', 2),
    ],
)
def test_as_little_is_remembered_as_can_be(text: str, memories: int) -> None:
    assert live(automaton(text)) == memories


def test_what_never_happens_together_is_not_expected() -> None:
    apart = model_with([frozenset(), frozenset("a"), frozenset("b")])
    assert live(automaton('F ("a" & "b")', apart)) == 0
    assert automaton('F ("a" & "b")', apart).violated[automaton('F ("a" & "b")', apart).start]
    always = model_with([frozenset("a"), frozenset("ab")])
    assert automaton('X X "a"', always).satisfied[automaton('X X "a"', always).start]


def test_it_does_not_matter_how_a_formula_is_written() -> None:
    for one, other in [
        ('F ("a" & (F "b"))', 'F ("a" & (true U "b"))'),
        ('!(G<=3 !"a")', 'F<=3 "a"'),
        ('"a" => (X "b")', '!"a" | (X "b")'),
        ('F<=3 (F<=4 "a")', 'F<=7 "a"'),
        ('"a" W<=4 "b"', '(G<=4 "a") | ("a" U<=4 "b")'),
        ('F ("a" | (F "b"))', 'F ("a" | "b")'),
    ]:
        first, second = automaton(one), automaton(other)
        assert len(first.left) == len(second.left)
        pairs = {(first.start, second.start)}
        for _ in range(len(first.left)):
            pairs |= {
                (int(first.after[m, x]), int(second.after[n, y]))
                for m, n in pairs
                for x, y in zip(first.letter_of_state, second.letter_of_state, strict=True)
            }
        assert len(pairs) == len(first.left)
        assert all(first.satisfied[m] == second.satisfied[n] for m, n in pairs)


def test_a_thousand_steps_are_remembered_at_once() -> None:
    found = automaton('F<=1000 "a"')
    assert live(found) == 1001
    memory = found.start
    for steps in range(1000, -1, -1):
        assert text_of(found.formulas.term(int(found.left[memory]))) == (f'F<={steps} "a"' if steps else '"a"')
        memory = int(found.after[memory, found.letter_of_state[0]])
    assert found.violated[memory]


def test_too_much_to_remember_is_refused_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automata, "MOST_MOVES", 100)
    assert live(automaton('F<=8 "a"')) == 9
    with pytest.raises(NotExplainableError, match=r"at most 100 pairs\), but 'F<=1000 .a.' takes more.*smaller bounds"):
        automaton('F<=1000 "a"')


def test_of_two_parts_that_follow_from_each_other_one_stays() -> None:
    found = automaton('(F ("a" & (F<=2 "b"))) | (F ("a" & !(G<=2 !"b")))')
    assert not found.violated.any()
    assert TRUE in found.left

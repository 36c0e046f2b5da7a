from __future__ import annotations

from collections import Counter

import pytest
from apps.study.designs import KINDS, small_design

from ratherthan.apps.study.design import rounds, screens
from ratherthan.apps.study.design.nouns import NEITHER, PHASES


@pytest.fixture
def design(tmp_path):
    return small_design(tmp_path)


def test_the_same_design_and_slot_give_the_same_screens(design):
    assert screens(design, 5) == screens(design, 5)
    assert [one.id for one in screens(design, 5)] == [one.id for one in screens(design, 47)]


def test_ids_are_unique_and_phases_known(design):
    for slot in range(rounds(design)):
        shown = screens(design, slot)
        assert len({one.id for one in shown}) == len(shown) == 41
        assert {one.phase for one in shown} == set(PHASES)


def test_consent_comes_first_and_thanks_last(design):
    shown = screens(design, 3)
    assert [one.phase for one in shown[:4]] == ["consent", "instructions", "instructions", "comprehension"]
    assert [one.phase for one in shown[-2:]] == ["about", "thanks"]
    assert shown[-1].records == ()


def test_everybody_sees_every_kind_of_every_map_once(design):
    for slot in range(rounds(design)):
        seen = Counter((one.map, one.kind) for one in screens(design, slot) if one.phase == "trial")
        assert set(seen.values()) == {1}
        assert len(seen) == 21


def test_trials_of_a_map_stand_together_and_its_groupings_follow(design):
    for slot in range(rounds(design)):
        parts = [(one.map, one.phase) for one in screens(design, slot) if one.phase in ("trial", "grouping")]
        blocks = [key for place, key in enumerate(parts) if place == 0 or parts[place - 1] != key]
        assert [phase for _, phase in blocks] == ["trial", "grouping"] * 3
        assert all(blocks[2 * i][0] == blocks[2 * i + 1][0] for i in range(3))


def test_places_count_from_one_in_the_order_shown(design):
    trials = [one for one in screens(design, 9) if one.phase == "trial"]
    assert [one.map_place for one in trials] == [1] * 7 + [2] * 7 + [3] * 7
    assert [one.kind_place for one in trials] == [1, 2, 3, 4, 5, 6, 7] * 3


def test_attention_checks_stand_between_the_trials(design):
    for slot in range(rounds(design)):
        shown = [one.phase for one in screens(design, slot) if one.phase in ("trial", "attention")]
        assert [place for place, phase in enumerate(shown) if phase == "attention"] == [5, 13]


def test_the_kind_that_says_nothing_shows_a_neutral_line_in_its_place(design):
    trials = [one for one in screens(design, 0) if one.phase == "trial"]
    silent = [one for one in trials if one.kind == "none"]
    assert [one.explanation for one in silent] == [""] * 3
    assert {one.paragraphs for one in silent} == {design.trial.without}
    assert {one.paragraphs for one in trials if one.kind != "none"} == {design.trial.paragraphs}


def test_explanations_are_shown_as_stored(design):
    for one in screens(design, 7):
        if one.phase == "trial":
            assert one.explanation == design.stimuli[one.map, one.kind].text


def test_what_may_be_preferred_are_the_cards_and_neither_is_the_last(design):
    for one in screens(design, 11):
        if one.phase == "grouping":
            values = [card.value for card in one.cards]
            assert [option.value for option in one.records[0].options] == values
            assert (NEITHER in values) == (values[-1] == NEITHER) == (one.grouping != "g4")
            assert sorted(values) == sorted(set(values))


def test_over_a_round_each_card_is_in_each_place_equally_often_but_for_one(design):
    places = Counter()
    for slot in range(rounds(design)):
        for one in screens(design, slot):
            places.update((one.map, one.grouping, card.value, place) for place, card in enumerate(one.cards))
    for one in ("m1", "m2", "m3"):
        for grouping in design.groupings:
            counts = {
                places[one, grouping.id, kind, place] for kind in grouping.kinds for place in range(len(grouping.kinds))
            }
            assert max(counts) - min(counts) <= 1


def test_the_order_of_cards_is_not_tied_to_the_order_of_kinds(design):
    """Of the slots that see the same kind first, some have the cards one way round and some the other."""
    for first in KINDS:
        seen = set()
        for slot in range(rounds(design)):
            shown = screens(design, slot)
            if next(one for one in shown if one.map == "m1" and one.phase == "trial").kind == first:
                seen.add(next(one for one in shown if one.id == "grouping-m1-g1").cards[0].value)
        assert len(seen) == 2


def test_only_checks_have_a_right_answer(design):
    for one in screens(design, 0):
        for record in one.records:
            assert (record.correct is not None) == (one.phase in ("comprehension", "attention"))


def test_a_slot_below_zero_is_refused(design):
    with pytest.raises(ValueError, match="counted from 0"):
        screens(design, -1)

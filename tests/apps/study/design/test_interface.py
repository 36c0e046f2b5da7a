"""Words of the interface that a design brings along, for a language that the program has none in, and the language of explanations."""

from __future__ import annotations

import re
import tomllib

import pytest

from ratherthan.apps.study.design import screens
from ratherthan.apps.study.design.checking import check
from ratherthan.apps.study.design.faults import DesignError
from ratherthan.apps.study.design.filling import languages
from ratherthan.apps.study.design.interface import GAP, english_texts, left_in_english
from ratherthan.apps.study.design.reading import FILE, read_design
from ratherthan.apps.study.design.stimuli import build
from ratherthan.apps.study.design.writing import New, new_study
from ratherthan.apps.study.pages.wording import for_participants, words

FEW = ("none", "naive-path", "contrastive")


@pytest.fixture
def with_words(changed):
    """Return a function that puts lines below ``[words]``, and returns the folder."""

    def make(*lines: str, more: tuple[tuple[str, str], ...] = ()):
        return changed(("[thanks]", "\n".join(("[words]", *lines, "", "[thanks]"))), *more)

    return make


def faults(folder) -> list[str]:
    with pytest.raises(DesignError) as caught:
        read_design(folder)
    return [str(fault) for fault in caught.value.faults]


def test_a_design_without_words_has_none(made):
    assert read_design(made).words == {}


def test_words_are_read_as_they_stand(with_words):
    folder = with_words('continue = "Allons-y"', 'progress = "{of}, {number}"', 'direction = "rtl"')
    own = {"continue": "Allons-y", "progress": "{of}, {number}", "direction": "rtl"}
    assert read_design(folder).words == own
    assert {key: text for key, text in words("en", own).items() if text != words("en")[key]} == own


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('contineu = "Weiter"', "The interface has no such word. Did you mean 'continue'?"),
        ('zzzzzz = "Weiter"', "study new FOLDER --language TAG"),
        ('language = "Français"', "no such word"),
        ('progress = "Étape {number}"', "must occur here, to the letter: {of}. In English: “Step {number} of {of}”"),
        ('progress = "Étape"', "to the letter: {number}, {of}"),
        ('progress = "Étape {number} {of} {all}"', "Nothing fills in {all}: here only {number}, {of} is filled in"),
        ('continue = "Allons {name}"', "Nothing fills in {name}: here nothing is filled in"),
        ("continue = 3", "must be a text in quotes, got 3"),
        ('continue = ""', "The text is empty"),
        ('continue = "a\\u0000"', "control characters"),
        (f'continue = "{"x" * 700}"', "at most 600 characters"),
        ('direction = "up"', "one of ltr, rtl"),
        ('study = { continue = "x" }', "no such word"),
    ],
)
def test_a_fault_of_a_word_is_told_with_its_line(with_words, line, said):
    folder = with_words(line)
    (found,) = faults(folder)
    text = (folder / FILE).read_text(encoding="utf-8")
    where = text[: text.index(line)].count("\n") + 1
    assert found.startswith(f"design.toml, line {where}: words.{line.split(' ')[0]}: ")
    assert said in found


def test_words_that_are_no_section_are_refused(changed):
    (found,) = faults(changed(('language = "en"', 'language = "en"\nwords = "French"')))
    assert "must be a section, [words]" in found


def test_every_word_changes_the_fingerprint(made, with_words):
    assert read_design(with_words('continue = "Go on"')).fingerprint != read_design(made).fingerprint


@pytest.mark.parametrize(("language", "left"), [("en", 0), ("en-GB", 0), ("de-AT", 0), ("fr", 96), ("pt-BR", 96)])
def test_what_participants_meet_in_english_is_counted(language, left):
    found = left_in_english(language)
    assert (len(found) > 0) == (left > 0)
    assert set(found) <= set(for_participants())


def test_a_word_is_translated_when_it_is_no_longer_the_english_one():
    everything = {key: f"{text} ?" for key, text in words("en").items()}
    assert left_in_english("fr", everything) == ()
    assert left_in_english("fr", {**everything, "continue": "Continue"}) == ("continue",)


def test_the_check_names_what_is_left_in_english(tmp_path):
    folder = tmp_path / "study"
    new_study(folder, New(language="fr", kinds=FEW))
    text = (folder / FILE).read_text(encoding="utf-8")
    text = text.replace('\ncontinue = "Continue"', '\ncontinue = "Continuer"').replace(
        'title = "Thank you"', 'title = "Merci"'
    )
    (folder / FILE).write_text(text, encoding="utf-8")
    found = [str(one) for one in check(folder).warnings]
    (said,) = [one for one in found if "are in English: " in one]
    line = text[: text.index("[words]")].count("\n") + 1
    assert said.startswith(f"design.toml, line {line}: words: ")
    named = said.rpartition("are in English: ")[2].rstrip(".").split(", ")
    assert "saving" in named
    assert "continue" not in named
    (texts,) = [one for one in found if "there are texts in English at" in one]
    assert {"consent", "items[1]", "about.questions[2]"} <= set(re.findall(r"[a-z.]+(?:\[\d+\])?", texts))


def test_a_language_of_its_own_begins_with_all_words_to_translate(tmp_path):
    new_study(tmp_path / "study", New(language="fr-CA", kinds=FEW))
    table = tomllib.loads((tmp_path / "study" / FILE).read_text(encoding="utf-8"))
    assert table["language"] == "fr-CA"
    assert table["words"] == {"direction": "ltr"} | {key: words("en")[key] for key in for_participants()}


def test_a_language_from_right_to_left_begins_there(tmp_path):
    assert new_study(tmp_path / "study", New(language="ar", kinds=FEW)).words["direction"] == "rtl"


@pytest.mark.parametrize("language", languages())
def test_a_language_that_has_words_begins_without_own_ones(tmp_path, language):
    design = new_study(tmp_path / "study", New(language=language, kinds=FEW))
    assert design.words == {}
    assert not [one for one in check(tmp_path / "study").warnings if "in English at" in one.sentence]


def test_the_notes_of_explanations_become_translations(tmp_path):
    folder = tmp_path / "study"
    new_study(folder, New(language="fr", kinds=FEW))
    text = (folder / FILE).read_text(encoding="utf-8")
    text = re.sub(r"^# (\[translations\.m1\]|naive-path = )", r"\1", text, count=2, flags=re.MULTILINE)
    (folder / FILE).write_text(text, encoding="utf-8")
    design = read_design(folder)
    assert design.stimuli["m1", "naive-path"].by_hand
    assert not design.stimuli["m1", "contrastive"].by_hand


def test_explanations_in_another_language_say_so(changed):
    own = '[translations.m1]\nselective = "X."\n\n[thanks]'
    folder = changed(('language = "en"', 'language = "de-AT"'), ("[thanks]", own))
    build(folder)
    shown = {screen.id: screen for screen in screens(read_design(folder), 0)}
    assert shown["trial-m1-contrastive"].language == "en"
    assert shown["trial-m1-selective"].language is None
    assert shown["trial-m1-none"].language is None
    cards = {card.value: card.language for card in shown["grouping-m1-g3"].cards}
    assert cards == {"naive-path": "en", "selective": None, "neither": None}


@pytest.mark.parametrize("language", ["en", "en-GB"])
def test_explanations_in_the_language_of_the_pages_need_none(changed, language):
    folder = changed(('language = "en"', f'language = "{language}"'))
    build(folder)
    shown = screens(read_design(folder), 0)
    assert {screen.language for screen in shown} == {None}
    assert {card.language for screen in shown for card in screen.cards} == {None}


def test_the_english_texts_are_those_of_the_template(made):
    own = {
        record.label for screen in screens(read_design(made), 0) for record in screen.records if screen.phase == "trial"
    }
    assert own <= english_texts()


def test_no_question_says_twice_that_it_may_be_left_out(tmp_path):
    for language in languages():
        design = new_study(tmp_path / language, New(language=language, kinds=FEW))
        free = [record.label for record in design.about_records if not record.required]
        assert free
        assert not [label for label in free if "(" in label]


def test_gaps_are_what_stands_in_braces():
    assert GAP.findall("Step {number} of {of}") == ["{number}", "{of}"]

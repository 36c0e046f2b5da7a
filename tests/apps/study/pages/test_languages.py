"""A study in a language that the interface has no words in: the design's own words, and explanations that say in which language they are."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("sqlalchemy", reason="needs the extra study")
pytest.importorskip("starlette", reason="needs the extra study")
pytest.importorskip("uvicorn", reason="needs the extra study")

from apps.study.designs import small_design
from apps.study.pages.walking import go, ready, shown

from ratherthan.apps.study.server.opening import opened
from ratherthan.apps.study.server.researchers import entrance
from ratherthan.apps.study.server.running import serving

pytestmark = pytest.mark.slow

WORDS = {
    "continue": "Continuer",
    "progress": "Étape {number} sur {of}",
    "explanation": "L'explication du robot",
    "direction": "rtl",
}


@pytest.fixture
def link(tmp_path: Path) -> Iterator[str]:
    """The address of a study in French (written from right to left, for the sake of the test), with one explanation translated."""
    design = small_design(tmp_path, maps=1, kinds=("none", "naive-path", "selective"))
    said = {
        key: one if not one.text or one.kind == "selective" else replace(one, language="en")
        for key, one in design.stimuli.items()
    }
    design = replace(design, language="fr", words=WORDS, stimuli=said)
    with ExitStack() as stack:
        study = stack.enter_context(closing(opened(design, str(tmp_path / "answers.sqlite3"))))
        address = stack.enter_context(serving(study))
        yield entrance(study.secret, address)


def test_a_design_brings_the_words_of_a_language_and_the_rest_is_english(visit, link):
    with visit(link) as seen:
        page = seen.page
        page.locator("article").wait_for()
        assert page.evaluate("[document.documentElement.lang, document.documentElement.dir]") == ["fr", "rtl"]
        go(page)
        assert page.get_by_role("button", name="Continuer").count() == 1
        assert page.locator("#progress-text").inner_text() == "Étape 2 sur 11"
        assert page.get_by_role("link", name="Withdraw from the study").count() == 1
        assert seen.axe() == []


def test_an_explanation_in_another_language_than_the_page_says_so(visit, link):
    found: dict[str, object] = {}
    with visit(link) as seen:
        page = seen.page
        page.locator("article").wait_for()
        for _ in range(30):
            screen = shown(page)
            if screen == "grouping-m1-g3":
                break
            told = page.locator("blockquote.explanation p")
            if told.count():
                found[screen] = (told.get_attribute("lang"), told.get_attribute("dir"))
            go(page)
        ready(page)
        cards = page.locator("fieldset.cards label.option .text").all()
        spoken = {card.inner_text()[:20].strip(): card.get_attribute("lang") for card in cards}
        assert seen.axe() == []
    assert found == {"trial-m1-naive-path": ("en", "auto"), "trial-m1-selective": (None, None)}
    assert spoken == {"First, we move south": "en", "First, we move east": None, "Neither of them": None}

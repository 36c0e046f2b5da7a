"""A page says what the explanation says, asks for nothing, and is the same bytes every time."""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from pages import EXPLAINED, HOSTILE
from pictures import solved

import ratherthan as rt
from ratherthan.errors import InputError, SourceError
from ratherthan.narrate import sentences

VOID = {"meta", "link", "br", "hr", "img", "input", "path", "rect", "circle", "image", "line", "use"}
PAGES: dict[str, str] = {}


class Reader(HTMLParser):
    """Reads a page: its elements with their attributes, what is open at the end, and the text of each element."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[tuple[str, int]] = []
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text: dict[int, str] = {}
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        self.text[len(self.found) - 1] = ""
        if tag not in VOID:
            self.open.append((tag, len(self.found) - 1))

    def handle_startendtag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        self.text[len(self.found) - 1] = ""

    def handle_endtag(self, tag):
        last, _ = self.open.pop()
        assert last == tag

    def handle_data(self, data):
        for _, place in self.open:
            self.text[place] += data

    def said(self, tag: str, **attributes: str) -> list[str]:
        """Return the texts of the elements with these attributes, blanks as one."""
        wanted = {name.rstrip("_"): value for name, value in attributes.items()}
        return [
            " ".join(self.text[place].split())
            for place, (name, given) in enumerate(self.found)
            if name == tag and all(given.get(key) == value for key, value in wanted.items())
        ]


@pytest.fixture(params=EXPLAINED)
def name(request):
    return request.param


@pytest.fixture
def explanation(name):
    return EXPLAINED[name]()


@pytest.fixture
def page(name):
    if name not in PAGES:
        PAGES[name] = rt.report(EXPLAINED[name]()).html
    return Reader(PAGES[name])


def fit(text: str) -> str:
    """Return text as a page shows it."""
    return " ".join(re.sub("[\x00-\x08\x0b-\x1f\u202a-\u202e\u2066-\u2069]", "\ufffd", text).split())


def test_a_page_is_whole(page):
    assert page.open == []
    assert page.found[0] == ("html", {"lang": "en"})
    assert len(page.said("title")) == 1
    assert len(page.said("h1")) == 1


def test_the_text_is_the_narration(page, explanation):
    told = sentences(explanation)
    shown = [text for text in page.said("p") if text]
    for sentence in told:
        assert fit(sentence.text) in shown
    numbered = [fit(one.text) for one in told if one.number is not None]
    listed = [given.get("data-sentence") for tag, given in page.found if tag == "li" and "data-sentence" in given]
    assert listed == [str(number) for number in range(1, len(numbered) + 1)]


def test_a_page_asks_for_nothing_and_runs_nothing_of_others(page):
    for tag, given in page.found:
        assert not [key for key in given if key.startswith("on") or key == "style"], (tag, given)
        for key in ("src", "href", "action", "data", "srcset", "poster", "xlink:href"):
            value = given.get(key)
            assert value is None or value.startswith(("#", "data:image/png;base64,")), (tag, value)
    assert [tag for tag, _ in page.found].count("script") == 1
    assert [tag for tag, _ in page.found].count("style") == 1
    assert not {"iframe", "object", "embed", "base", "form", "link"} & {tag for tag, _ in page.found}


def test_the_policy_allows_the_script_and_the_style_of_the_page_and_no_other(page):
    policy = next(given["content"] for tag, given in page.found if given.get("http-equiv") == "Content-Security-Policy")
    assert policy.startswith("default-src 'none'; ")
    assert "unsafe" not in policy
    for tag in ("script", "style"):
        place = next(place for place, (name, _) in enumerate(page.found) if name == tag)
        digest = base64.b64encode(hashlib.sha256(page.text[place].encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy


def test_every_name_is_there_once_and_every_link_leads_somewhere(page):
    names = [given["id"] for _, given in page.found if "id" in given]
    assert len(names) == len(set(names))
    for _, given in page.found:
        href = given.get("href")
        assert href is None or not href.startswith("#") or href[1:] in names
        for key in ("aria-labelledby", "aria-describedby"):
            assert set((given.get(key) or "").split()) <= set(names)
        for value in given.values():
            patterns = re.findall(r"^url\(#([^)]*)\)$", value or "")
            assert set(patterns) <= set(names)


def test_sentences_and_marks_lead_to_each_other(page):
    marks = {given["data-sentence"] for _, given in page.found if given.get("class") == "step"}
    linked = {given["href"] for tag, given in page.found if tag == "a" and given.get("class") == "number"}
    assert linked == {f"#w-mark-{number}" for number in marks}


def test_the_same_explanation_gives_the_same_bytes(name):
    html = rt.report(EXPLAINED[name]()).html
    assert html == PAGES.setdefault(name, html)


def test_a_page_is_the_same_after_a_round_trip_through_json(name, explanation):
    assert rt.report(rt.from_json(rt.to_json(explanation))).html == PAGES.setdefault(name, rt.report(explanation).html)


@pytest.mark.parametrize("name", ["hostile names", "a hostile map"])
def test_names_are_shown_as_they_are_and_do_nothing(page):
    assert page.said("h1") == [fit(HOSTILE)]
    assert "b" not in [tag for tag, _ in page.found]
    assert not any("\u202e" in text or "\x07" in text for text in page.text.values())


def test_the_numbers_are_those_of_the_paper():
    page = Reader(rt.report(rt.explain(solved("paper-5x5"))).html)
    rows = [text for text in page.said("tr", role="row") if "●" in text or "○" in text]
    assert rows[2] == "2 grid 10 ● move east 6.67 proved: 6.66666 to 6.66667 0 4"
    assert rows[3] == "○ move south 10.67 proved: 10.6666 to 10.6667 4 2"
    assert "may fail to arrive" in rows[1]


def test_every_step_is_listed_with_whether_it_matters():
    page = Reader(rt.report(rt.explain(solved("paper-5x5"))).html)
    rows = [text.split() for text in page.said("tr") if re.match(r"\d+ grid \d+ move", text)]
    assert [(row[2], row[-2], row[-1]) for row in rows] == [
        ("5", "yes", "1"),
        ("10", "yes", "2"),
        ("11", "no", "–"),
        ("12", "yes", "3"),
        ("7", "yes", "4"),
        ("8", "no", "–"),
        ("3", "no", "–"),
    ]


def test_a_given_policy_is_not_called_ours():
    problem = rt.read("example:paper-5x5")
    policy = rt.Policy(choice=problem.mdp.state_to_choices[:-1].copy())
    page = Reader(rt.report(rt.explain(rt.evaluate(problem, policy))).html)
    assert "one that was given; it is not ours" in page.said("dd")


def test_values_without_a_proof_are_called_so():
    explanation = rt.explain(solved("paper-5x5"))
    said = Reader(rt.report(replace(explanation, outcome=rt.Outcome.UNCERTIFIED.value)).html).said("dd")
    assert rt.Outcome.UNCERTIFIED.value in said
    assert "one that was computed; that it is a best one is not proved" in said


def test_a_file_is_html(tmp_path):
    page = rt.report(rt.explain(solved("paper-5x5")))
    page.save(tmp_path / "town.html")
    assert (tmp_path / "town.html").read_text(encoding="utf-8") == page.html
    with pytest.raises(SourceError, match=r"\.html"):
        page.save(tmp_path / "town.pdf")


def test_a_language_without_words_is_refused():
    explanation = rt.explain(solved("paper-5x5"))
    with pytest.raises(InputError, match="must be one of: en"):
        rt.report(replace(explanation, lexicon=rt.Lexicon(language="xx")))

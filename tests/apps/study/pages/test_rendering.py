"""Pages as text: words in every language, nothing that a policy forbids, and the code of others exactly as published."""

from __future__ import annotations

import hashlib
import re
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from string import Formatter
from typing import Any

import pytest
from apps.study.pages.samples import monitor, researchers

from ratherthan.apps.study import pages

STUDY = {"title": "A small study", "language": "en", "contact": "a@example.org", "simulated": False}
HOSTILE = "</script><script>alert(1)</script>\"'><img src=x onerror=alert(1)>{{ 7*7 }}{% raw %}"
FOLDER = Path(pages.__file__).parent
OURS = sorted(pages.STATIC.glob("*.js"))
VOID = {"meta", "link", "input", "img", "br", "rect"}


class Reader(HTMLParser):
    """Gathers what a strict policy would forbid, and tags that are not closed."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.open: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.found += [f"{tag} {name}" for name in given if name.startswith("on") or name == "style"]
        if tag == "style" or (tag == "script" and "src" not in given and given.get("type") != "application/json"):
            self.found.append(tag)
        for name in ("src", "href", "action"):
            if re.match(r"(?i)\s*(javascript:|//)", given.get(name) or ""):
                self.found.append(f"{tag} {name}")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if self.open and self.open[-1] == tag:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag, f"{tag} is closed where it is not open"


def read(html: str) -> Reader:
    reader = Reader()
    reader.feed(html)
    reader.close()
    assert reader.open == []
    return reader


def every_page(study: dict[str, Any]) -> dict[str, str]:
    return {
        **researchers(pages.render, study),
        "/": pages.render("entry.html", study, platform=""),
        "/withdraw": pages.render("withdraw.html", study),
        "/said": pages.render("message.html", study, heading=HOSTILE, paragraphs=[HOSTILE], status=500),
    }


@pytest.mark.parametrize("path", sorted(every_page(STUDY)))
def test_no_page_has_a_script_or_a_style_in_it(path):
    assert read(every_page(STUDY)[path]).found == []


@pytest.mark.parametrize("path", sorted(every_page(STUDY)))
def test_hostile_texts_make_no_further_element(path):
    hostile = {**STUDY, "title": HOSTILE, "contact": HOSTILE, "words": dict.fromkeys(pages.words("en"), HOSTILE)}
    assert read(every_page(hostile)[path]).found == []
    assert read(every_page(hostile)[path]).tags == read(every_page(STUDY)[path]).tags


def test_hostile_rows_make_no_further_element():
    people = [{**row, "screen": HOSTILE, "platform": HOSTILE, "key": HOSTILE} for row in monitor()["people"]]
    hostile = monitor(people=people, entrance=HOSTILE, states=[{"state": HOSTILE, "people": 3}])
    page = pages.render("monitor.html", STUDY, csrf=HOSTILE, monitor=hostile, notice=HOSTILE)
    assert read(page).found == []
    assert "alert(1)</script>" not in page


def test_a_study_may_leave_out_all_but_its_title():
    assert "<h1>Hello</h1>" in pages.render("message.html", {"title": "T"}, heading="Hello", paragraphs=())


def test_a_study_may_be_an_object():
    class Study:
        title, language, contact, simulated = "An object", "de", "", True

    page = pages.render("withdraw.html", Study())
    assert "An object" in page
    assert "Simuliert: Die Teilnehmenden dieser Studie sind Roboter." in page


@pytest.mark.parametrize(
    "page", ["entry.html", "withdraw.html", "login.html", "monitor.html", "export.html", "erase.html"]
)
def test_a_study_of_robots_says_so_on_every_page(page):
    context = {
        "csrf": "c",
        "refused": "",
        "monitor": monitor(),
        "notice": "",
        "files": [],
        "participant": None,
        "asked": "",
    }
    assert "the participants of this study are robots" in pages.render(page, {**STUDY, "simulated": True}, **context)


@pytest.mark.parametrize("language", sorted(pages.languages()))
def test_every_language_has_the_same_words_with_the_same_gaps(language):
    files = {tag: (FOLDER / "words" / f"{tag}.toml").read_text(encoding="utf-8") for tag in ("en", language)}
    tables = {tag: tomllib.loads(text) for tag, text in files.items()}
    assert {name: set(table) for name, table in tables[language].items()} == {
        name: set(table) for name, table in tables["en"].items()
    }
    for name, table in tables["en"].items():
        for key, text in table.items():
            assert gaps(tables[language][name][key]) == gaps(text), key


def gaps(text: str) -> set[str]:
    return {name for _, name, _, _ in Formatter().parse(text) if name is not None}


def test_every_word_is_said_somewhere():
    texts = [path.read_text(encoding="utf-8") for path in (*OURS, *(FOLDER / "templates").glob("*.html"))]
    sayings = "\n".join(texts)
    families = ("fault-", "count-", "said-", "login-", "erase-refused-", "language", "direction")
    titled = {f"{name}-{part}" for name in re.findall(r'"([a-z-]+)"', sayings) for part in ("title", "text")}
    messages = {
        f"{name}-{part}"
        for name in ("not-found", "link", "too-many", "storage", "server")
        for part in ("title", "text")
    }
    unsaid = [
        key
        for key in pages.words("en")
        if f'"{key}"' not in sayings and not key.startswith(families) and key not in titled | messages
    ]
    assert unsaid == []


def test_every_word_that_is_said_is_there():
    known = set(pages.words("en"))
    for path in (*OURS, *(FOLDER / "templates").glob("*.html")):
        said = set(re.findall(r'say\("([a-z-]+)"[,)]', path.read_text(encoding="utf-8")))
        assert said <= known, path.name


@pytest.mark.parametrize(
    ("asked", "found"), [("en", "en"), ("de", "de"), ("DE-at", "de"), ("pt-BR", "en"), ("", "en"), ("../x", "en")]
)
def test_a_language_without_words_speaks_english(asked, found):
    assert pages.spoken(asked) == found
    assert pages.words(asked) == pages.words(found)


def test_a_design_brings_words_of_its_own_and_no_others():
    assert pages.words("en", {"continue": "Go on", "nonsense": "x"})["continue"] == "Go on"
    assert "nonsense" not in pages.words("en", {"nonsense": "x"})


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_no_script_of_ours_makes_elements_of_texts(path):
    text = path.read_text(encoding="utf-8")
    forbidden = r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function|\.style\b|\"style\"|https?://[a-z]"
    assert re.findall(forbidden, text) == []


def test_code_of_others_is_exactly_as_published():
    folder = pages.STATIC / "vendor"
    about = tomllib.loads((folder / "vendor.toml").read_text(encoding="utf-8"))
    files = {entry["file"]: entry for entry in about.values()}
    assert {path.name for path in folder.glob("*.js")} == set(files)
    for name, entry in files.items():
        content = (folder / name).read_bytes()
        assert hashlib.sha256(content).hexdigest() == entry["sha256"]
        assert entry["version"] in name
        assert f'"{entry["version"]}"'.encode() in content
        licence = (folder / entry["licence_file"]).read_text(encoding="utf-8")
        assert "Permission is hereby granted, free of charge" in licence
        assert all(part in licence for part in ("jsPsych", *entry["holds"]))


def test_an_address_changes_with_the_bytes_of_its_file():
    digest = hashlib.sha256((pages.STATIC / "style.css").read_bytes()).hexdigest()
    assert pages.static("style.css") == f"/static/style.css?v={digest[:12]}"

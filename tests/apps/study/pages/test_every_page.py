"""Every page at every size, in every dress: nothing that a screen reader, a narrow phone or a strict policy stumbles over."""

from __future__ import annotations

from typing import Any

import pytest
from apps.study.pages.samples import researchers
from apps.study.pages.walking import at, go, ready, shown

from ratherthan.apps.study import pages

pytestmark = pytest.mark.slow
SIZES = (320, 375, 768, 1280)  # 320: also what is left of 640 at a zoom of 200 %
STUDY = {"title": "A small study", "language": "en", "contact": "researcher@example.org", "simulated": False}


def faults(seen: Any) -> list[str]:
    """Return what is wrong with the page as it stands, at every size, by day and by night."""
    found = []
    for scheme in ("light", "dark"):
        seen.page.emulate_media(color_scheme=scheme)
        for width in SIZES:
            seen.page.set_viewport_size({"width": width, "height": 800})
            if seen.overflow():
                found.append(f"{width} {scheme}: wider than its window by {seen.overflow()}")
            if width in (375, 1280):  # where the layout differs
                found += [f"{width} {scheme}: {fault}" for fault in seen.axe()]
    found += structure(seen.page)
    return found


def structure(page: Any) -> list[str]:
    """Return what is wrong with the headings, the landmarks and the names of what can be used."""
    counts = {name: page.locator(f"{name}:visible").count() for name in ("h1", "main")}
    found = [f"{count} elements {name}" for name, count in counts.items() if count != 1]
    small = page.evaluate(
        """() => [...document.querySelectorAll("button, a.button, label.option, input[type=text]")]
            .map(e => [e.textContent.slice(0, 30), e.getBoundingClientRect()])
            .filter(([, box]) => box.height > 0 && box.height < 44).map(([text]) => text)"""
    )
    return found + [f"smaller than a finger: {text}" for text in small]


def test_every_screen_of_a_participant(visit, serve, listed):
    fake = serve(
        listed, ending={"code": "DONE1234", "redirect": "https://app.prolific.com/submissions/complete?cc=DONE1234"}
    )
    with visit(fake.address) as seen:
        seen.page.locator("article").wait_for()
        for screen in listed:
            at(seen.page, screen.id)
            ready(seen.page)
            assert faults(seen) == [], screen.id
            if screen is not listed[-1]:
                go(seen.page)


@pytest.mark.parametrize("path", [*researchers(pages.render, STUDY), "/withdraw", "/no-such-page"])
def test_every_page_of_researchers_and_every_message(visit, serve, path):
    fake = serve((), pages=researchers(pages.render, STUDY))
    with visit(fake.address + path) as seen:
        assert faults(seen) == []
        seen.faults[:] = [fault for fault in seen.faults if "404" not in fault]


@pytest.mark.parametrize(
    "dress", [{"forced_colors": "active"}, {"reduced_motion": "reduce"}, {"has_touch": True, "is_mobile": True}]
)
def test_a_trial_in_another_dress(visit, serve, listed, dress):
    with visit(serve(listed, start="trial-m1-selective").address, width=360, **dress) as seen:
        at(seen.page, "trial-m1-selective")
        ready(seen.page)
        assert seen.axe() == []
        assert seen.overflow() == 0
        first = seen.page.locator("label.option").first
        before = first.evaluate("e => [getComputedStyle(e).outlineStyle, getComputedStyle(e).boxShadow].join()")
        first.click()
        seen.page.get_by_role("heading", level=1).focus()
        after = first.evaluate("e => [getComputedStyle(e).outlineStyle, getComputedStyle(e).boxShadow].join()")
        assert before != after, "what is chosen can be told from what is not, in every dress"
        if "reduced_motion" in dress:
            assert first.evaluate("e => getComputedStyle(e).transitionDuration") == "0s"


def test_letters_of_twice_the_size_leave_nothing_out(visit, serve, listed):
    with visit(serve(listed, start="trial-m1-selective").address, width=640) as seen:
        at(seen.page, "trial-m1-selective")
        seen.page.evaluate("() => { document.documentElement.style.fontSize = '200%'; }")
        assert seen.overflow() == 0
        assert go(seen.page) != "trial-m1-selective"


def test_a_language_that_is_read_from_the_right(visit, serve, listed):
    fake = serve(
        listed,
        start="trial-m1-selective",
        study={"language": "ar", "words": {"direction": "rtl", "continue": "متابعة"}},
    )
    with visit(fake.address) as seen:
        at(seen.page, "trial-m1-selective")
        ready(seen.page)
        places = {
            name: seen.page.locator(name).bounding_box()["x"]
            for name in (".map", ".told", ".option >> nth=0", ".option >> nth=1")
        }
        assert places[".map"] > places[".told"]
        assert places[".option >> nth=0"] > places[".option >> nth=1"]
        assert seen.axe() == []
        assert seen.overflow() == 0
        seen.page.get_by_role("button", name="متابعة").click()
        assert shown(seen.page) == "trial-m1-selective"


def test_another_language_reaches_every_corner(visit, serve, listed):
    fake = serve(listed, start="trial-m1-selective", study={"language": "de-AT"})
    with visit(fake.address) as seen:
        at(seen.page, "trial-m1-selective")
        text = seen.page.inner_text("body")
        assert "Weiter" in text
        assert "Schritt " in text
        assert "Teilnahme widerrufen" in text
        assert seen.page.evaluate("document.documentElement.lang") == "de-AT"


def test_a_screen_reader_hears_what_each_item_asks(visit, serve, listed):
    with visit(serve(listed, start="trial-m1-selective").address) as seen:
        at(seen.page, "trial-m1-selective")
        tree = seen.page.locator("main").aria_snapshot()
        assert 'radiogroup "I understand what this explanation says."' in tree
        assert 'radio "Strongly agree"' in tree
        assert 'img "The map m1."' in tree
        assert "blockquote" in tree
        assert seen.page.get_by_role("status").count() == 1
        assert seen.page.get_by_role("progressbar").get_attribute("aria-labelledby") == "progress-text"

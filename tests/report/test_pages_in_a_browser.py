"""Pages as people meet them: on telephones and large screens, light and dark, with a mouse and with keys, printed."""

from __future__ import annotations

import pytest
from pages import EXPLAINED
from pictures import on_cells

import ratherthan as rt

pytestmark = pytest.mark.slow
SEVERAL = ("a graph", "a large map", "no route", "two objectives", "hostile names", "none")
LOOKS = [(375, "light"), (375, "dark"), (768, "light"), (1280, "light"), (1280, "dark")]


@pytest.fixture
def page(request, tmp_path):
    path = tmp_path / "page.html"
    rt.report(EXPLAINED[getattr(request, "param", "contrastive")]()).save(path)
    return path


def lit(seen):
    return seen.page.evaluate(
        "[...document.querySelectorAll('.lit')].filter(e => e.getClientRects().length).map(e => e.tagName + e.dataset.sentence)"
    )


def visible(seen, css):
    return seen.page.evaluate(
        "css => [...document.querySelectorAll(css)].filter(e => e.getClientRects().length).length", css
    )


@pytest.mark.parametrize(
    ("page", "width", "scheme"),
    [("contrastive", *look) for look in LOOKS] + [(name, *LOOKS[1 + 2 * (k % 2)]) for k, name in enumerate(SEVERAL)],
    indirect=["page"],
)
def test_everybody_can_read_it(visit, page, width, scheme):
    with visit(page, width=width, scheme=scheme) as seen:
        assert seen.axe() == []
        assert seen.overflow() == 0


def test_nothing_is_small_or_cut_on_a_telephone(visit, page):
    with visit(page, width=375) as seen:
        assert (visible(seen, "svg.narrow"), visible(seen, "svg.wide")) == (1, 0)
        sizes = seen.page.evaluate(
            "[...document.querySelectorAll('svg.narrow text')].map(e => e.getBoundingClientRect().height)"
        )
        assert min(sizes) >= 9
        reach = seen.page.evaluate(
            "[...document.querySelectorAll('main *')].filter(e => !e.closest('svg, .unseen, thead, details'))"
            ".map(e => e.getBoundingClientRect()).filter(b => b.width && b.right > innerWidth + 1).length"
        )
        assert reach == 0


def test_a_sentence_lights_its_mark_and_a_mark_its_sentence(visit, page):
    with visit(page) as seen:
        assert lit(seen) == []
        seen.page.hover("#sentence-2 p")
        assert {"LI2", "a2", "g2", "TBODY2"} <= set(lit(seen))
        assert {name[-1] for name in lit(seen)} == {"2"}
        seen.page.hover("#w-mark-3")
        assert {"LI3", "a3", "g3"} <= set(lit(seen))
        assert {name[-1] for name in lit(seen)} == {"3"}
        seen.page.hover("h1")
        assert lit(seen) == []


@pytest.mark.parametrize("page", ["a large map"], indirect=True)
def test_a_sentence_about_several_steps_lights_all_of_them(visit, page):
    with visit(page) as seen:
        seen.page.hover("#sentence-1 p")
        classes = seen.page.evaluate(
            "[...document.querySelectorAll('svg.wide .lit')].map(e => e.getAttribute('class'))"
        )
        assert {"step lit", "stretch lit"} <= set(classes)
        seen.page.hover("svg.wide .stretch[data-sentence='2']", position={"x": 3, "y": 3}, force=True)
        assert {name[-1] for name in lit(seen)} == {"2"}
        seen.page.mouse.down()
        seen.page.mouse.up()
        assert seen.page.evaluate("document.activeElement.closest('[id]').id") == "sentence-2"


def test_keys_do_all_that_a_mouse_does(visit, page):
    with visit(page) as seen:
        focused = "document.activeElement.id || document.activeElement.closest('[id]').id"
        order = []
        for _ in range(8):
            seen.page.keyboard.press("Tab")
            order.append(seen.page.evaluate(focused))
        assert order == [*(f"w-mark-{k}" for k in (1, 2, 3, 4)), *(f"sentence-{k}" for k in (1, 2, 3, 4))]
        assert "a4" in lit(seen)
        seen.page.keyboard.press("Enter")
        assert seen.page.evaluate(focused) == "w-mark-4"
        assert "LI4" in lit(seen)
        seen.page.keyboard.press("Enter")
        assert seen.page.evaluate(focused) == "sentence-4"
        seen.page.keyboard.press("Escape")
        seen.page.evaluate("document.activeElement.blur()")
        assert lit(seen) == []


def test_a_finger_lights_and_lets_go(visit, page):
    with visit(page, width=375, has_touch=True, is_mobile=True) as seen:
        seen.page.tap("#sentence-2 a")
        assert {"LI2", "a2"} <= set(lit(seen))
        seen.page.tap("h1")
        assert lit(seen) == []


def test_a_mark_that_is_lit_does_not_rest_on_colour_alone(visit, page):
    with visit(page) as seen:
        seen.page.hover("#sentence-1 p")
        seen.page.wait_for_timeout(200)
        width = "e => parseFloat(getComputedStyle(e.querySelector('path')).strokeWidth)"
        one, other = (seen.page.eval_on_selector(f"#w-mark-{k}", width) for k in (1, 2))
        assert one >= other + 1
        faint = "e => parseFloat(getComputedStyle(e).opacity)"
        assert seen.page.eval_on_selector("#w-mark-2", faint) < 0.5 < seen.page.eval_on_selector("#w-mark-1", faint)


def test_without_scripts_all_is_there_and_links_lead_on(visit, page):
    with visit(page, java_script_enabled=False) as seen:
        assert seen.page.is_visible("#sentence-4")
        seen.page.click("#w-mark-3")
        assert seen.page.url.endswith("#sentence-3")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_print_is_black_on_white_with_the_large_picture(visit, page, scheme, tmp_path):
    with visit(page, width=375, scheme=scheme) as seen:
        seen.page.emulate_media(media="print", color_scheme=scheme)
        assert seen.page.evaluate("getComputedStyle(document.body).color") == "rgb(0, 0, 0)"
        assert seen.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        assert (visible(seen, "svg.narrow"), visible(seen, "svg.wide")) == (0, 1)
        assert visible(seen, "thead") == 1
        assert len(seen.page.pdf(prefer_css_page_size=True)) > 10_000


def test_the_steps_open_and_close(visit, page):
    with visit(page) as seen:
        assert not seen.page.is_visible("table.steps")
        seen.page.focus("summary")
        seen.page.keyboard.press("Enter")
        assert seen.page.is_visible("table.steps")
        assert seen.axe() == []


@pytest.mark.parametrize("page", ["hostile names", "a hostile map"], indirect=True)
def test_names_of_strangers_run_nothing(visit, page):
    with visit(page) as seen:
        assert seen.page.title() != "x"
        assert visible(seen, "b") == 0


def test_what_is_said_of_the_numbers_is_true_of_the_picture_that_is_seen(visit, tmp_path):
    path = tmp_path / "crowded.html"
    explanation = rt.explain(on_cells(["." * 60] * 40))
    rt.report(explanation).save(path)
    matter = sum(step.critical is not False for step in explanation.steps)
    for width in (375, 1280):
        with visit(path, width=width) as seen:
            marks = visible(seen, ".step")
            said = seen.page.inner_text("figcaption")
            more = matter - marks
            words = "One more decision matters" if more == 1 else f"{more} more decisions matter"
            assert (words in said) == (more > 0)
            described = seen.page.evaluate(
                "[...document.querySelectorAll('svg[role=group]')].filter(e => e.getClientRects().length)"
                ".map(e => document.getElementById(e.getAttribute('aria-describedby')).textContent)"
            )
            assert [words in text for text in described] == [more > 0]

"""The pages and the server together, in a real browser: participants and researchers, as they will be."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("sqlalchemy", reason="needs the extra study")
pytest.importorskip("starlette", reason="needs the extra study")
pytest.importorskip("uvicorn", reason="needs the extra study")

from apps.study.designs import small_design
from apps.study.pages.walking import again, at, go, go_to, past, ready

from ratherthan.apps.study.server.opening import opened
from ratherthan.apps.study.server.researchers import entrance
from ratherthan.apps.study.server.running import serving

pytestmark = pytest.mark.slow


class Running:
    """A study that is served, and can be taken away and brought back."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        design = small_design(folder, maps=1, kinds=("none", "naive-path", "selective"))
        self.study = stack.enter_context(closing(opened(design, str(folder / "answers.sqlite3"))))
        self.up = stack.enter_context(ExitStack())
        self.address = self.up.enter_context(serving(self.study))
        self.link = entrance(self.study.secret, self.address)

    def away(self) -> None:
        self.up.close()

    def back(self) -> None:
        self.up.enter_context(serving(self.study, port=int(self.address.rpartition(":")[2])))


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    with ExitStack() as stack:
        yield Running(tmp_path, stack)


def answers(running: Running) -> dict[str, dict[str, Any]]:
    """Return what is stored, screen to values, of all participants."""
    from sqlalchemy import select

    from ratherthan.apps.study.server.tables import ANSWER

    rows = running.study.store.read(
        lambda connection: connection.execute(select(ANSWER.c.screen, ANSWER.c.content)).all()
    )
    return {screen: json.loads(content) for screen, content in rows}


def log_in(page: Any, running: Running) -> None:
    page.goto(running.address + "/researchers")
    page.get_by_label("Password").fill(running.study.password)
    page.get_by_role("button", name="Log in").click()
    page.get_by_role("heading", name="How the study is going").wait_for()


def test_from_consent_to_code_over_a_reload_and_a_server_that_goes_away(visit, running):
    with visit(running.link) as seen:
        page = seen.page
        go_to(page, "trial-m1-naive-path")
        assert page.url == running.address + "/"
        page.reload()
        at(page, "trial-m1-naive-path")
        ready(page)
        for group in page.get_by_role("radiogroup").all():
            group.locator("label").nth(4).click()
        running.away()
        page.get_by_role("button", name="Continue").click()
        page.get_by_text("Saving your answer, trying again.").wait_for()
        running.back()
        past(page, "trial-m1-naive-path")
        go_to(page, "thanks")
        assert "DONE1234" in page.inner_text("main")
        seen.faults[:] = [fault for fault in seen.faults if "Failed to load resource" not in fault]
    kept = answers(running)
    assert kept["trial-m1-naive-path"] == {"understanding": 5, "trust": 5}
    assert {"consent", "comprehension", "attention-1", "grouping-m1-g3", "about-you"} <= set(kept)


def test_keys_alone_lead_through_the_real_study(visit, running):
    with visit(running.link) as seen:
        page = seen.page
        screen = at(page, "consent").get_attribute("data-screen")
        for _ in range(30):
            if screen == "thanks":
                break
            ready(page)
            for _ in range(1 + page.locator("img").count()):
                page.keyboard.press("Tab")
            for group in page.get_by_role("radiogroup").all():
                key = "2" if screen == "attention-1" else "1"
                page.keyboard.press(key)
                if group.locator("input:checked").count() == 0:
                    raise AssertionError(f"{screen}: the key {key} chose nothing")
                page.keyboard.press("Tab")
            if page.get_by_role("radiogroup").count():
                page.keyboard.press("Shift+Tab")
            page.keyboard.press("Enter")
            screen = past(page, screen)
        assert screen == "thanks"
        assert "DONE1234" in page.inner_text("main")


def test_prolific_is_gone_back_to_with_its_code(visit, running):
    with visit(running.address + "/?PROLIFIC_PID=p1&STUDY_ID=s1&SESSION_ID=x1") as seen:
        go_to(seen.page, "thanks")
        link = seen.page.get_by_role("link", name="Go back and finish").get_attribute("href")
        assert link == "https://app.prolific.com/submissions/complete?cc=DONE1234"
        seen.page.goto(running.address + "/?PROLIFIC_PID=p1&STUDY_ID=s1&SESSION_ID=x1")
        at(seen.page, "thanks")


def test_mturk_is_looked_at_and_then_submitted_to(visit, running):
    back = "turkSubmitTo=https%3A%2F%2Fworkersandbox.mturk.com"
    with visit(running.address + f"/?assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE&hitId=h&{back}") as seen:
        page = seen.page
        at(page, "consent")
        assert page.get_by_role("button").count() == 0
        page.goto(running.address + f"/?assignmentId=a1&hitId=h&workerId=w&{back}")
        at(page, "consent")
        page.reload()
        go_to(page, "thanks")
        form = page.locator("form")
        assert form.get_attribute("action") == "https://workersandbox.mturk.com/mturk/externalSubmit"
        fields = page.eval_on_selector_all("form input", "all => all.map(one => [one.name, one.value])")
        assert ["assignmentId", "a1"] in fields
        posts: list[str] = []
        page.context.unroute_all()
        page.context.route(
            "https://workersandbox.mturk.com/**",
            lambda route: (posts.append(route.request.post_data), route.fulfill(body="done")),
        )
        page.get_by_role("button", name="Submit and finish").click()
        page.get_by_text("done").wait_for()
        assert "assignmentId=a1" in posts[0], "the policy lets the form go where it must"


def test_without_a_link_nobody_comes_in(visit, running):
    with visit(running.address) as seen:
        at(seen.page, "failed")
        assert "with the link that you were given" in seen.page.inner_text("main")
        assert seen.axe() == []
        seen.faults[:] = [fault for fault in seen.faults if "403" not in fault]


def test_a_preview_says_so_and_never_counts(visit, running):
    with visit(running.address + "/?preview=1") as seen:
        go_to(seen.page, "trial-m1-selective")
        assert "nothing that you answer here counts" in seen.page.inner_text("header")
        seen.page.reload()
        at(seen.page, "trial-m1-selective")
    assert answers(running) == {}


def test_who_fails_the_comprehension_twice_is_told_the_end(visit, running):
    with visit(running.link) as seen:
        page = seen.page
        go_to(page, "comprehension")
        for told in ("this is the last try", ""):
            for group in page.get_by_role("radiogroup").all():
                group.locator("label").last.click()
            page.get_by_role("button", name="Continue").click()
            if told:
                page.get_by_role("alert").get_by_text(told).wait_for()
        at(page, "screened-out")
        assert "SCREEN12" in page.inner_text("main")


def test_a_participant_withdraws_and_nothing_is_left(visit, running):
    with visit(running.link) as seen:
        page = seen.page
        go_to(page, "instructions-2")
        code = re.search(r"\(your code: (\S+)\)", page.inner_text("footer"))
        assert code is not None
        page.get_by_role("link", name="Withdraw from the study").click()
        page.wait_for_function("code => document.getElementById('code')?.value === code", arg=code.group(1))
        page.get_by_label("Erase all my answers, too").check()
        page.get_by_role("button", name="Withdraw").click()
        page.get_by_text("all your answers are erased").wait_for()
    assert answers(running) == {}


def test_researchers_see_pause_limit_export_and_erase(visit, running):
    with visit(running.link) as seen:
        page = seen.page
        go_to(page, "thanks")
        page.goto(running.address + "/researchers")
        page.get_by_label("Password").fill("wrong")
        page.get_by_role("button", name="Log in").click()
        page.get_by_text("That is not the password.").wait_for()
        assert seen.axe() == []
        log_in(page, running)
        assert seen.axe() == []
        assert page.get_by_role("row", name="finished 1", exact=True).count() == 1
        page.get_by_role("button", name="Pause the study").click()
        page.get_by_text("The study is paused").wait_for()
        page.get_by_role("button", name="Let the study go on").click()
        page.get_by_text("The study goes on.").wait_for()
        page.get_by_label("How many may finish").fill("42")
        page.get_by_role("button", name="Set the quota").click()
        page.get_by_text("1 of 42 finished.").wait_for()
        page.get_by_label("How many may finish").fill("many")
        page.locator("#quota").evaluate("e => e.removeAttribute('pattern')")
        page.get_by_role("button", name="Set the quota").click()
        page.get_by_text("A quota is a whole number").wait_for()
        page.get_by_role("link", name="Export the answers").click()
        assert seen.axe() == []
        with page.expect_download() as download:
            page.get_by_role("button", name="Download the archive").click()
        assert Path(download.value.path()).read_bytes()[:2] == b"PK"
        page.get_by_role("link", name="Back to the overview").click()
        page.get_by_role("link", name=re.compile(r"Erase P\d+")).click()
        assert seen.axe() == []
        page.get_by_label("Yes, erase everything of this participant").check()
        page.get_by_role("button", name="Erase for good").click()
        page.get_by_text("The participant is erased.").wait_for()
        page.get_by_role("button", name="Log out").click()
        page.get_by_role("heading", name="Log in").wait_for()
        seen.faults[:] = [fault for fault in seen.faults if "403" not in fault]
    assert answers(running) == {}


def test_a_paused_study_lets_nobody_begin_and_everybody_finish(visit, running):
    with visit(running.link) as seen:
        page = seen.page
        go_to(page, "instructions-1")
        with page.context.expect_page() as opened_page:
            page.evaluate("() => { window.open('/researchers'); }")
        researcher = opened_page.value
        log_in(researcher, running)
        researcher.get_by_role("button", name="Pause the study").click()
        researcher.get_by_text("The study is paused").wait_for()
        go(page)
        page.evaluate("() => { sessionStorage.clear(); localStorage.clear(); }")
        page.goto(running.link)
        at(page, "paused")
        assert seen.axe() == []
        researcher.get_by_role("button", name="Let the study go on").click()
        researcher.get_by_text("The study goes on.").wait_for()
        again(page)
        at(page, "consent")

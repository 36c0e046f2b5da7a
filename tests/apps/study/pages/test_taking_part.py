"""From consent to code in a real browser: with the mouse, with keys alone, over reloads and a server that is away."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import pytest
from apps.study.pages.walking import again, at, go, go_to, past, ready, shown

from ratherthan.apps.study.design.nouns import Card, Option, Record, Screen

pytestmark = pytest.mark.slow
ENDING = {"code": "DONE1234", "redirect": "https://app.prolific.com/submissions/complete?cc=DONE1234"}
HOSTILE = "<script>alert(1)</script></script><img src=x onerror=alert(1)> \"'&amp; {{ 7*7 }} 漢字カナ العربية 🚗"


def only(fake: Any) -> Any:
    """Return the one participant that a server knows."""
    assert len(fake.people) == 1
    return next(iter(fake.people.values()))


def test_from_consent_to_code_with_the_mouse(visit, serve, listed):
    fake = serve(listed, ending=ENDING)
    with visit(fake.address) as seen:
        go_to(seen.page, "thanks")
        assert "DONE1234" in seen.page.inner_text("main")
        assert seen.page.get_by_role("link", name="Go back and finish").get_attribute("href") == ENDING["redirect"]
        assert "WORD-WORD-1234" in seen.page.inner_text("main")
    answers = only(fake).answers
    assert list(answers) == [screen.id for screen in listed[:-1]]
    for screen in listed[:-1]:
        values = answers[screen.id]["values"]
        assert set(values) == {record.name for record in screen.records if record.required}
        for record in screen.records:
            if record.options and record.required:
                assert values[record.name] in {option.value for option in record.options}
    assert answers["consent"]["values"] == {"consent": "yes"}
    assert all(given["hidden_ms"] >= 0 and 0 < given["time_ms"] < 60_000 for given in answers.values())


def press(page: Any, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)


def test_from_consent_to_code_with_keys_alone(visit, serve, listed):
    fake = serve(listed, ending=ENDING)
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "consent")
        press(page, "Tab", "Enter")
        screen = past(page, "consent")
        while screen != "thanks":
            ready(page)
            assert page.evaluate("document.activeElement.tagName") == "H1", "a new screen begins at its heading"
            groups = page.get_by_role("radiogroup").count()
            if page.locator("img").count():
                press(page, "Tab")
                assert page.evaluate("document.activeElement.textContent") == "Enlarge the map"
            for _ in range(groups):
                press(page, "Tab", "1", "ArrowDown", "2")
                assert page.evaluate("document.activeElement.type") == "radio"
                if screen == "comprehension":
                    press(page, "1")
            if groups:
                press(page, "Enter")
            else:
                press(page, "Tab", "Enter")
            screen = past(page, screen)
    answers = only(fake).answers
    assert list(answers) == [screen.id for screen in listed[:-1]]
    assert answers["trial-m1-selective"]["values"] == {"understanding": 2, "trust": 2}


def test_skipping_leads_past_the_head_of_the_page(visit, serve, listed):
    with visit(serve(listed).address) as seen:
        at(seen.page, "consent")
        seen.page.get_by_role("link", name="Skip to the content").focus()
        seen.page.keyboard.press("Enter")
        assert seen.page.evaluate("document.activeElement.id") == "main"


def test_the_code_to_withdraw_with_stands_on_every_screen(visit, serve, listed):
    with visit(serve(listed).address) as seen:
        at(seen.page, "consent")
        assert "WORD-WORD-1234" in seen.page.inner_text("footer")


def test_a_digit_answers_only_the_item_that_has_the_focus(visit, serve, listed):
    with visit(serve(listed, start="trial-m1-naive-path").address) as seen:
        at(seen.page, "trial-m1-naive-path")
        ready(seen.page)
        seen.page.keyboard.press("4")
        assert seen.page.locator("input:checked").count() == 0
        groups = seen.page.get_by_role("radiogroup")
        groups.nth(1).locator("input").first.focus()
        seen.page.keyboard.press("5")
        assert groups.nth(0).locator("input:checked").count() == 0
        assert groups.nth(1).locator("input").nth(4).is_checked()


def test_a_missing_answer_is_told_where_it_is_missing(visit, serve, listed):
    fake = serve(listed, start="trial-m1-naive-path")
    with visit(fake.address) as seen:
        at(seen.page, "trial-m1-naive-path")
        ready(seen.page)
        seen.page.get_by_role("radiogroup").nth(0).locator("label").first.click()
        seen.page.get_by_role("button", name="Continue").click()
        second = seen.page.get_by_role("radiogroup").nth(1)
        assert second.get_attribute("aria-invalid") == "true"
        assert "Please choose an answer." in second.inner_text()
        assert seen.page.evaluate("document.activeElement.closest('fieldset') !== null")
        assert seen.axe() == []
        assert "trial-m1-naive-path" not in only(fake).answers
        second.locator("label").first.click()
        assert second.get_attribute("aria-invalid") is None


def test_a_reload_shows_the_same_screen_as_a_further_attempt(visit, serve, listed):
    fake = serve(listed, start="trial-m1-selective")
    with visit(fake.address) as seen:
        at(seen.page, "trial-m1-selective")
        seen.page.wait_for_timeout(60)
        seen.page.reload()
        at(seen.page, "trial-m1-selective")
        go(seen.page)
    person = only(fake)
    assert person.opened.count("trial-m1-selective") == 2
    told = next(times for times in person.times if times["screen"] == "trial-m1-selective")
    assert person.answers["trial-m1-selective"]["attempt"] > told["attempt"]
    assert set(told) == {"screen", "attempt", "time_ms", "hidden_ms"}
    assert told["time_ms"] >= 50


def test_going_back_and_forth_in_the_history_does_no_harm(visit, serve, listed):
    fake = serve(listed, start="comprehension")
    with visit(fake.address + "/?link=abc") as seen:
        at(seen.page, "comprehension")
        seen.page.goto(fake.address + "/withdraw")
        seen.page.go_back()
        at(seen.page, "comprehension")
        seen.page.go_forward()
        seen.page.get_by_role("link", name="Back to the study").click()
        at(seen.page, "comprehension")
        go(seen.page)
    assert list(only(fake).answers) == ["comprehension"]


def test_two_tabs_answer_each_screen_once(visit, serve, listed):
    fake = serve(listed)
    with visit(fake.address) as seen:
        first = seen.page
        go_to(first, "instructions-1")
        with first.expect_popup() as opened:
            first.evaluate("() => { window.open('/'); }")
        second = opened.value
        at(second, "instructions-1")
        go(first)
        go(first)
        assert shown(first) == "comprehension"
        go(second)
        assert shown(second) == "comprehension"
        go(second)
        go(first)
    answered = list(only(fake).answers)
    assert answered[:4] == [screen.id for screen in listed[:4]]
    assert len(answered) == len(set(answered))


@pytest.mark.parametrize("away", ["down", "503", "500", "429"])
def test_an_answer_waits_until_the_server_is_back(visit, serve, listed, away):
    fake = serve(listed, start="trial-m1-naive-path")
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "trial-m1-naive-path")
        ready(page)
        for group in page.get_by_role("radiogroup").all():
            group.locator("label").nth(3).click()
        fake.away = away
        page.get_by_role("button", name="Continue").click()
        page.get_by_text("Saving your answer, trying again.").wait_for()
        assert seen.axe() == []
        assert page.get_by_role("status").get_by_text("trying again").is_visible()
        assert shown(page) == "trial-m1-naive-path"
        assert page.locator("input:checked").count() == 2, "what was answered stays in its place"
        page.get_by_role("button", name="Continue").click()  # impatience does nothing
        fake.away = None
        again(page)
        past(page, "trial-m1-naive-path")
        assert page.locator("#saving").inner_text() == ""
        seen.faults[:] = [
            fault for fault in seen.faults if not fault.startswith("console error: Failed to load resource")
        ]
    assert only(fake).answers["trial-m1-naive-path"]["values"] == {"understanding": 4, "trust": 4}


def test_an_answer_leaves_when_the_network_is_back(visit, serve, listed):
    fake = serve(listed, start="trial-m1-naive-path")
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "trial-m1-naive-path")
        ready(page)
        for group in page.get_by_role("radiogroup").all():
            group.locator("label").nth(3).click()
        page.context.set_offline(True)
        page.get_by_role("button", name="Continue").click()
        page.get_by_text("Saving your answer, trying again.").wait_for()
        page.context.set_offline(False)
        past(page, "trial-m1-naive-path")
        seen.faults[:] = [fault for fault in seen.faults if "ERR_INTERNET_DISCONNECTED" not in fault]
    assert only(fake).answers["trial-m1-naive-path"]["values"] == {"understanding": 4, "trust": 4}


def test_time_behind_another_window_is_counted_apart(visit, serve, listed):
    fake = serve(listed, start="trial-m1-naive-path")
    turn = """hidden => {
        Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
        document.dispatchEvent(new Event("visibilitychange"));
    }"""
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "trial-m1-naive-path")
        ready(page)
        page.evaluate(turn, arg=True)
        page.wait_for_timeout(1500)
        page.evaluate(turn, arg=False)
        go(page)
    given = only(fake).answers["trial-m1-naive-path"]
    assert given["hidden_ms"] >= 1500
    told = only(fake).times[0]
    assert told["attempt"] == given["attempt"]
    assert told["hidden_ms"] < 1500, "told when it was hidden, not when it came back"
    assert told["time_ms"] <= given["time_ms"]


def test_an_answer_outlives_a_reload_while_the_server_is_away(visit, serve, listed):
    fake = serve(listed, start="trial-m1-naive-path")
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "trial-m1-naive-path")
        ready(page)
        for group in page.get_by_role("radiogroup").all():
            group.locator("label").nth(1).click()
        fake.away = "503"
        page.get_by_role("button", name="Continue").click()
        page.get_by_text("Saving your answer, trying again.").wait_for()
        page.on("dialog", lambda dialog: dialog.accept())
        page.reload()
        page.get_by_text("The study cannot be reached, trying again.").wait_for()
        fake.away = None
        again(page)
        past(page, "trial-m1-naive-path")
        seen.faults[:] = [
            fault for fault in seen.faults if not fault.startswith("console error: Failed to load resource")
        ]
    assert only(fake).answers["trial-m1-naive-path"]["values"] == {"understanding": 2, "trust": 2}


def test_a_study_that_cannot_be_reached_opens_by_itself_when_it_can(visit, serve, listed):
    fake = serve(listed, away="503")
    with visit(fake.address) as seen:
        seen.page.get_by_text("The study cannot be reached").wait_for()
        fake.away = None
        at(seen.page, "consent")
        seen.faults[:] = [
            fault for fault in seen.faults if not fault.startswith("console error: Failed to load resource")
        ]


def test_a_wrong_try_is_said_and_the_last_one_ends(visit, serve, listed):
    fake = serve(listed, start="comprehension", tries=3, ending={"code": "SCREEN12"})
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "comprehension")
        for told in ("you have 2 tries left", "this is the last try"):
            for group in page.get_by_role("radiogroup").all():
                group.locator("label").last.click()
            page.get_by_role("button", name="Continue").click()
            page.get_by_role("alert").get_by_text(told).wait_for()
            assert page.locator("input:checked").count() == 0
            assert seen.axe() == []
        for group in page.get_by_role("radiogroup").all():
            group.locator("label").last.click()
        page.get_by_role("button", name="Continue").click()
        past(page, "comprehension")
        assert "SCREEN12" in page.inner_text("main")


def test_who_does_not_agree_takes_no_part(visit, serve, listed):
    fake = serve(listed[:1], ending={"code": "NOCONS12"})
    with visit(fake.address) as seen:
        at(seen.page, "consent")
        seen.page.get_by_role("button", name="I do not agree").click()
        at(seen.page, "no-consent")
        assert "NOCONS12" in seen.page.inner_text("main")
        assert not seen.page.locator("#withdraw").is_visible()
        assert seen.axe() == []
    assert only(fake).answers["consent"]["values"] == {"consent": "no"}


def asking(*records: Record, **more: Any) -> tuple[Screen, ...]:
    """Return the screens of a study that asks for `records` at once."""
    asked = Screen(id="about-you", phase="about", title="About you", paragraphs=(), records=records, **more)
    return asked, Screen(id="thanks", phase="thanks", title="Thank you", paragraphs=())


def test_numbers_and_texts_are_asked_for_within_their_bounds(visit, serve):
    age = Record(name="age", type="number", label="Your age", unit="years", least=18, most=120)
    answer = Record(name="answer", type="text", label="One word", longest=6)
    more = Record(name="more", type="text", label="Anything else?", required=False)
    robots = Record(name="robots", type="flag", label="I have worked with robots")
    fake = serve(asking(age, answer, more, robots))
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "about-you")
        send = page.get_by_role("button", name="Continue")
        for given, told in [("", "Please write a number."), ("x", "Please write a number."), ("1e9", "a number."),
                            ("17", "at least 18"), ("121", "at most 120")]:  # fmt: skip
            page.get_by_label("Your age").fill(given)
            send.click()
            assert told in page.locator(".item").first.inner_text()
            assert page.get_by_label("Your age").get_attribute("aria-invalid") == "true"
        page.get_by_label("One word").fill("more than six")
        send.click()
        assert "at most 6" in page.locator(".item").nth(1).inner_text()
        assert seen.axe() == []
        page.get_by_label("Your age").fill(" 33,5 ")
        page.get_by_label("One word").fill("  ro\u0000bo\u0007t  ")
        page.get_by_label("I have worked with robots").check()
        send.click()
        at(page, "thanks")
    assert only(fake).answers["about-you"]["values"] == {"age": 33.5, "answer": "robot", "robots": True}


def test_what_the_server_refuses_is_told_at_its_item(visit, serve):
    age = Record(name="age", type="number", label="Your age")
    answer = Record(name="answer", type="text", label="One word", required=False)
    fake = serve(asking(age, answer))
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "about-you")
        page.get_by_label("Your age").fill("99")
        page.get_by_role("button", name="Continue").click()
        page.locator(".item").first.get_by_text("Ages end at 98 here.").wait_for()
        page.get_by_label("Your age").fill("98")
        page.get_by_label("One word").fill("refuse")
        page.get_by_role("button", name="Continue").click()
        page.locator(".item").nth(1).get_by_text("characters in this answer that cannot be saved").wait_for()
        page.get_by_label("One word").fill("")
        page.get_by_role("button", name="Continue").click()
        at(page, "thanks")
        seen.faults[:] = [fault for fault in seen.faults if "422" not in fault]
    assert only(fake).answers["about-you"]["values"] == {"age": 98}


def test_hostile_texts_are_shown_as_they_are(visit, serve):
    long = "A very long text. " * 200 + "x" * 3000
    options = (Option(value="a", label=HOSTILE), Option(value="b", label=long))
    records = (
        Record(name="__proto__", type="choice", label=HOSTILE, options=options),
        Record(name="constructor", type="text", label=HOSTILE, required=False),
    )
    trial = dataclasses.replace(
        asking(*records)[0],
        id="trial",
        phase="trial",
        title=HOSTILE,
        paragraphs=(HOSTILE, long),
        explanation=HOSTILE,
        map="m 1/../x",
    )
    cards = (Card(value="a", text=HOSTILE), Card(value="b", text=long))
    grouping = dataclasses.replace(trial, id="grouping", phase="grouping", records=records[:1], cards=cards)
    end = Screen(id="thanks", phase="thanks", title=HOSTILE, paragraphs=(HOSTILE, long))
    study = {"title": HOSTILE, "contact": HOSTILE, "words": {"withdraw": HOSTILE, "progress": HOSTILE}}
    ending = {"code": HOSTILE, "redirect": "javascript:alert(1)"}
    fake = serve((trial, grouping, end), study=study, ending=ending)
    with visit(fake.address, width=320) as seen:
        page = seen.page
        page.on("dialog", lambda _dialog: seen.faults.append("a script ran"))
        for screen in ("trial", "grouping"):
            at(page, screen)
            ready(page)
            assert page.inner_text("h1") == HOSTILE
            assert page.inner_text("legend") == HOSTILE
            assert page.inner_text(".option .text >> nth=0") == HOSTILE
            assert seen.overflow() == 0
            page.locator("label.option").first.click()
            page.get_by_role("button", name="Continue").click()
        at(page, "thanks")
        assert page.inner_text(".code >> nth=0") == HOSTILE
        assert page.get_by_role("link", name="Go back and finish").count() == 0
        assert page.inner_text("#withdraw a") == HOSTILE
        assert HOSTILE in page.inner_text("footer")
        assert seen.overflow() == 0
        assert seen.axe() == []
        assert page.locator("main script, main img[src=x]").count() == 0
    assert only(fake).answers["trial"]["values"] == {"__proto__": "a"}


def test_a_picture_that_is_not_there_is_asked_for_again(visit, serve, listed):
    fake = serve(listed, start="comprehension", picture_faults=1)
    with visit(fake.address) as seen:
        page = seen.page
        at(page, "comprehension")
        for group in page.get_by_role("radiogroup").all():
            group.locator("label").first.click()
        page.get_by_role("button", name="Continue").click()
        past(page, "comprehension")
        for group in page.get_by_role("radiogroup").all():
            group.locator("label").first.click()
        page.get_by_role("button", name="Continue").click()
        assert "The map is not here yet." in page.inner_text("main")
        ready(page)
        go(page)
        seen.faults[:] = [fault for fault in seen.faults if "503" not in fault]


def test_a_map_is_enlarged_and_stays_within_reach_of_the_keys(visit, serve, listed):
    with visit(serve(listed, start="trial-m1-selective").address, width=375) as seen:
        page = seen.page
        at(page, "trial-m1-selective")
        ready(page)
        before = page.locator("img").bounding_box()["width"]
        button = page.get_by_role("button", name="Enlarge the map")
        button.click()
        assert page.locator("img").bounding_box()["width"] > 2 * before
        assert button.get_attribute("aria-pressed") == "true"
        assert seen.overflow() == 0
        assert seen.axe() == []
        page.locator(".frame").focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_function("() => document.querySelector('.frame').scrollLeft > 0")
        button.click()
        assert page.locator("img").bounding_box()["width"] == before
        assert go(page) != "trial-m1-selective"


def test_a_fault_of_the_page_itself_is_told(visit, serve, listed):
    with visit(serve(listed).address) as seen:
        at(seen.page, "consent")
        seen.page.evaluate(
            "() => { Object.defineProperty(performance, 'now', { value: () => { throw new Error('broken'); } }); }"
        )
        seen.page.get_by_role("button").first.click()
        seen.page.get_by_text("Something went wrong on this page.").wait_for()
        seen.page.get_by_role("button", name="Load the page again").click()
        at(seen.page, "consent")
        assert seen.page.get_by_text("Something went wrong").count() == 0
        seen.faults[:] = [fault for fault in seen.faults if "broken" not in fault]


def test_a_study_that_is_paused_goes_on_later(visit, serve, listed):
    fake = serve(listed, paused=True)
    with visit(fake.address) as seen:
        at(seen.page, "paused")
        assert seen.axe() == []
        fake.paused = False
        again(seen.page)
        at(seen.page, "consent")


def test_every_end_is_told(visit, serve, listed):
    fake = serve(listed)
    with visit(fake.address) as seen:
        at(seen.page, "consent")
        for state in ("closed", "full", "screened-out", "withdrawn", "no-consent"):
            only(fake).state = state
            seen.page.reload()
            at(seen.page, state)
            assert seen.page.locator("h1").count() == 1
            assert seen.axe() == []


def test_a_page_that_the_server_does_not_know_any_more_says_so(visit, serve, listed):
    fake = serve(listed)
    with visit(fake.address) as seen:
        at(seen.page, "consent")
        fake.people.clear()
        seen.page.get_by_role("button", name="agree").first.click()
        at(seen.page, "failed")
        assert "does not know you any more" in seen.page.inner_text("main")
        seen.page.get_by_role("button", name="Try again now").click()
        at(seen.page, "failed")
        seen.faults[:] = [fault for fault in seen.faults if "401" not in fault]


def test_identities_leave_the_address_and_are_told_to_the_server_alone(visit, serve, listed):
    fake = serve(listed)
    with visit(fake.address + "/?PROLIFIC_PID=5f0c&STUDY_ID=s1&SESSION_ID=x%26y") as seen:
        at(seen.page, "consent")
        assert seen.page.url == fake.address + "/"
        kept = seen.page.evaluate("() => JSON.stringify([{...localStorage}, {...sessionStorage}])")
        assert "5f0c" not in kept
        assert re.search(r"^\[\{\},", kept), "platforms know people: nothing of them outlives the tab"
        seen.page.reload()
        at(seen.page, "consent")
        assert seen.page.evaluate("() => localStorage.length") == 0
    assert fake.platforms == [{"PROLIFIC_PID": "5f0c", "STUDY_ID": "s1", "SESSION_ID": "x&y"}]
    assert not any("5f0c" in path for path in fake.asked[1:])


def test_mturk_is_told_the_end_by_a_form(visit, serve, listed):
    post = {"action": "/mturk/externalSubmit", "fields": {"assignmentId": "A<1>", "code": "DONE1234"}}
    fake = serve(listed[-1:], ending={"code": "DONE1234", "post": post})
    with visit(fake.address) as seen:
        at(seen.page, "thanks")
        seen.page.get_by_role("button", name="Submit and finish").click()
        seen.page.get_by_role("heading", name="Posted").wait_for()
    assert fake.posted == [("/mturk/externalSubmit", {"assignmentId": ["A<1>"], "code": ["DONE1234"]})]


def test_a_frame_of_mturks_keeps_what_it_was_opened_with(visit, serve, listed):
    fake = serve(listed)
    fake.pages["/frame"] = (
        '<!DOCTYPE html><html lang="en"><title>F</title><iframe title="Task" src="/?assignmentId=A1&amp;workerId=W"></iframe>'
    )
    with visit(fake.address + "/frame") as seen:
        frame = seen.page.frame_locator("iframe")
        frame.locator("article").wait_for()
        assert "assignmentId=A1" in seen.page.frames[1].url
        assert frame.locator("#withdraw a").get_attribute("target") == "_blank"


def test_who_only_looks_on_mturk_can_answer_nothing(visit, serve, listed):
    with visit(serve(listed).address + "/?assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE") as seen:
        at(seen.page, "consent")
        assert "accept the task" in seen.page.inner_text("main")
        assert seen.page.get_by_role("button").count() == 0


def test_a_study_goes_on_after_the_browser_went_down_unless_it_is_somebody_else(visit, serve, listed):
    fake = serve(listed)
    with visit(fake.address + "/?link=common") as seen:
        page = seen.page
        go_to(page, "instructions-2")
        page.evaluate("() => sessionStorage.clear()")  # as after the browser went down
        page.goto(fake.address + "/?link=common")
        at(page, "resume")
        assert seen.axe() == []
        page.get_by_role("button", name="Yes, go on where I was").click()
        at(page, "instructions-2")
        page.evaluate("() => sessionStorage.clear()")
        page.goto(fake.address + "/?link=common")
        at(page, "resume")
        page.get_by_role("button", name="No, I am another person").click()
        at(page, "consent")
    assert len(fake.people) == 2


@pytest.mark.parametrize(("query", "people"), [("/?link=common", 1), ("/?link=common&new=1", 2)])
def test_who_came_to_the_end_sees_it_again_unless_others_may_begin_here(visit, serve, listed, query, people):
    fake = serve(listed[:1] + listed[-1:])
    with visit(fake.address + query) as seen:
        go_to(seen.page, "thanks")
        seen.page.reload()
        at(seen.page, "thanks")
        seen.page.evaluate("() => sessionStorage.clear()")
        seen.page.goto(fake.address + query)
        at(seen.page, "thanks" if people == 1 else "consent")
    assert len(fake.people) == people


def test_a_participant_withdraws_alone(visit, serve, listed):
    fake = serve(listed)
    with visit(fake.address) as seen:
        page = seen.page
        go_to(page, "instructions-1")
        page.get_by_role("link", name="Withdraw from the study").click()
        page.get_by_role("heading", name="Withdraw from the study").wait_for()
        code = page.get_by_label("Your withdrawal code")
        page.wait_for_function("() => document.getElementById('code')?.value === 'WORD-WORD-1234'")
        assert seen.axe() == []
        send = page.get_by_role("button", name="Withdraw")
        code.fill("")
        send.click()
        page.get_by_text("Please write the withdrawal code.").wait_for()
        code.fill("WRONG")
        send.click()
        page.get_by_text("There is no such withdrawal code.").wait_for()
        assert seen.axe() == []
        fake.away = "down"
        send.click()
        page.get_by_text("Nothing has changed").wait_for()
        fake.away = None
        code.fill(" WORD-WORD-1234 ")
        page.get_by_label("Erase all my answers, too").check()
        send.click()
        page.get_by_text("all your answers are erased").wait_for()
        assert page.evaluate("() => sessionStorage.length + localStorage.length") == 0
        seen.faults[:] = [
            fault for fault in seen.faults if not fault.startswith("console error: Failed to load resource")
        ]
    assert fake.withdrawn == [{"code": "WORD-WORD-1234", "erase": True}]


def test_without_scripts_the_page_says_what_is_missing(visit, serve, listed):
    with visit(serve(listed).address, java_script_enabled=False) as seen:
        assert "needs JavaScript" in seen.page.inner_text("main")


def test_storage_that_is_forbidden_is_done_without(visit, serve, listed):
    fake = serve(listed, start="trial-m1-selective")
    with visit("about:blank") as seen:
        forbid = """for (const name of ["sessionStorage", "localStorage"])
            Object.defineProperty(globalThis, name, { get() { throw new DOMException("no", "SecurityError"); } });"""
        seen.page.context.add_init_script(forbid)
        seen.page.context.unroute_all()
        seen.page.goto(fake.address + "/?PROLIFIC_PID=5f0c&SESSION_ID=1")
        at(seen.page, "trial-m1-selective")
        assert "PROLIFIC_PID=5f0c" in seen.page.url, "a reload can say who it is by the address alone"

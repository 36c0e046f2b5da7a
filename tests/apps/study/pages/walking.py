"""A page of a study in a browser enters, answers leave: how tests go through it, with the mouse or with keys alone."""

from __future__ import annotations

from typing import Any

AGAIN = "Try again now"


def at(page: Any, screen: str) -> Any:
    """Wait until a screen is shown, and return its article."""
    article = page.locator(f'article[data-screen="{screen}"]')
    article.wait_for()
    return article


def shown(page: Any) -> str:
    """Return the id of the screen that is shown."""
    name = page.locator("article").get_attribute("data-screen")
    assert name is not None
    return str(name)


def past(page: Any, screen: str) -> str:
    """Wait until another screen than `screen` is shown, and return its id."""
    page.wait_for_function(
        "id => { const a = document.querySelector('article'); return a !== null && a.dataset.screen !== id; }",
        arg=screen,
    )
    return shown(page)


def again(page: Any) -> None:
    """Try again now, if the page has not by itself: then the button is gone."""
    page.evaluate("name => [...document.querySelectorAll('button')].find(b => b.textContent === name)?.click()", AGAIN)


def ready(page: Any) -> None:
    """Wait until the pictures are there."""
    page.wait_for_function("() => [...document.images].every(image => image.complete && image.naturalWidth > 0)")


def right(page: Any, screen: str) -> None:
    """Choose answers with the mouse, the right ones where a check asks for one; all else is the last but one option."""
    for group in page.get_by_role("radiogroup").all():
        labels = group.locator("label").all()
        wanted = labels[0] if screen == "comprehension" else labels[-1 if screen.startswith("attention") else -2]
        wanted.click()


def go(page: Any) -> str:
    """Answer the screen that is shown, with the mouse, and return the next one's id."""
    screen = shown(page)
    ready(page)
    right(page, screen)
    page.locator("article button[type=submit]").first.click()
    return past(page, screen)


def go_to(page: Any, screen: str) -> None:
    """Answer with the mouse until a screen is shown."""
    page.locator("article").wait_for()
    for _ in range(60):
        if shown(page) == screen:
            return
        go(page)
    raise AssertionError(f"{screen} never came; the last one was {shown(page)}")

"""A page's address enters, the page in a browser leaves: with what went wrong on it, and what axe-core finds fault with.

The browser is the system's Chromium (``RATHERTHAN_CHROMIUM`` names another); nothing is downloaded. Where it or the
packages are missing, the tests skip. The fixtures `chromium` and `visit` of conftest.py come from here::

    def test_a_page_is_whole(visit):
        with visit(path_or_address, width=375, scheme="dark") as seen:
            seen.page.keyboard.press("Tab")  # a Page of playwright's sync API
            assert seen.axe() == []

Leaving the block fails the test if the console had errors or warnings, a script failed, the content security policy was
violated, or the page asked for anything from another place. A test that means to provoke that empties `seen.faults` first.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome", "chrome")
FLAGS = ["--disable-dev-shm-usage", "--disable-gpu", "--hide-scrollbars"]
SETTLE = "new Promise(done => setTimeout(() => setTimeout(done), 10))"  # what happened by now is told by then
WATCH = """document.addEventListener("securitypolicyviolation", event =>
    console.error(`policy violated: ${event.violatedDirective} by ${event.blockedURI || event.sample}`));"""
AT_REST = """() => Promise.all(document.getAnimations()
    .filter(one => one.effect.getComputedTiming().endTime < Infinity).map(one => one.finished.catch(() => null)))
    .then(() => null)"""
"""Waits until nothing fades any more that comes to an end."""


@dataclass(kw_only=True)
class Seen:
    """A page that is open in the browser, and its faults so far."""

    page: Any  # playwright.sync_api.Page
    faults: list[str] = field(default_factory=list)

    def axe(self) -> list[str]:
        """Return what axe-core finds fault with, by all of its rules that are on by default, a sentence for each place."""
        from axe_playwright_python.sync_playwright import Axe

        self.page.evaluate(AT_REST)  # colours between two are nobody's fault
        found = Axe().run(self.page).response["violations"]
        return [
            f"{rule['id']}: {rule['help']} at {' '.join(map(str, node['target']))}: {node['html'][:120]}"
            for rule in found
            for node in rule["nodes"]
        ]

    def overflow(self) -> int:
        """Return by how many pixels the page is wider than its window: 0 where nobody has to scroll sideways."""
        width = self.page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        return int(width)


def browser_path() -> str | None:
    """Return where the browser is, None if there is none."""
    named = os.environ.get("RATHERTHAN_CHROMIUM")
    return named or next((path for name in NAMES if (path := shutil.which(name))), None)


@contextmanager
def opened() -> Iterator[Any]:
    """Start the browser, and end it; skip the test where it or its driver is missing."""
    driver = pytest.importorskip("playwright.sync_api", reason="needs playwright, which the extra dev brings")
    pytest.importorskip("axe_playwright_python", reason="needs axe-playwright-python, which the extra dev brings")
    path = browser_path()
    if path is None:
        pytest.skip("needs chromium: install it with the system's package manager, or set RATHERTHAN_CHROMIUM")
    with driver.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def visiting(
    browser: Any,
    place: str | Path,
    *,
    width: int = 1280,
    height: int = 900,
    scheme: str = "light",
    **more: Any,
) -> Iterator[Seen]:
    """Open a page, and fail at the end if it had faults.

    `place` is a file, or an address ``http://…`` whose other pages may be visited too; `more` are settings of playwright's
    ``new_context``, as ``java_script_enabled=False``, ``has_touch=True``, ``reduced_motion="reduce"``.
    """
    address = place.resolve().as_uri() if isinstance(place, Path) else place
    home = urlsplit(address)
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme, **more)
    try:
        context.add_init_script(WATCH)
        page = context.new_page()
        seen = Seen(page=page)

        def judge(route: Any) -> None:
            asked = urlsplit(route.request.url)
            same = asked == home if home.scheme == "file" else asked[:2] == home[:2]
            if same or asked.scheme in ("data", "blob", "about"):
                route.continue_()
            else:
                seen.faults.append(f"asked for {route.request.url[:200]}")
                route.abort()

        def heard(message: Any) -> None:
            if message.type in ("error", "warning"):
                seen.faults.append(f"console {message.type}: {message.text[:300]}")

        context.route("**/*", judge)
        page.on("console", heard)
        page.on("pageerror", lambda error: seen.faults.append(f"script: {str(error)[:300]}"))
        page.goto(address)
        yield seen
        if not page.is_closed() and more.get("java_script_enabled", True):
            page.evaluate(SETTLE)
        if seen.faults:
            raise AssertionError(f"{address} has faults:\n" + "\n".join(seen.faults))
    finally:
        context.close()

"""The default study enters, docs/study/pages-*.png leave: every page of it, in a browser, at three widths, by day and by night.

Needs the extras dev and study, and Chromium. Prints what the browser complained of and what axe-core found; exits with 1 if anything.
"""

from __future__ import annotations

import io
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "study"
WIDTHS = {375: 138, 768: 230, 1280: 340}  # of the window: of its picture on the sheet
SCHEMES = ("light", "dark")
ACROSS = 1400  # pixels of a sheet
TALLEST = 620  # pixels of a picture on the sheet, what is below is cut off; the monitor stands alone at the end
MONITOR = "monitor"
GAP, LINE = 12, 16
COLOURS = 160
PEOPLE = 14  # participants that have answered before the researchers' pages are taken
PROLIFIC = "/?PROLIFIC_PID=5f0c&STUDY_ID=s1&SESSION_ID="


class Sheets:
    """Pictures of pages, by width and scheme."""

    def __init__(self) -> None:
        self.taken: dict[tuple[int, str], list[tuple[str, Image.Image]]] = {
            (width, scheme): [] for width in WIDTHS for scheme in SCHEMES
        }
        self.faults: list[str] = []

    def take(self, seen: Any, name: str) -> None:
        """Take the page that is open, at every width and in every scheme."""
        from apps.study.pages.walking import ready

        ready(seen.page)
        for (width, scheme), pictures in self.taken.items():
            seen.page.emulate_media(color_scheme=scheme)
            seen.page.set_viewport_size({"width": width, "height": 720 if width > 400 else 667})
            seen.page.evaluate("() => scrollTo(0, 0)")
            seen.page.wait_for_timeout(120)
            self.faults += [f"{name}, {width} {scheme}: {fault}" for fault in seen.axe()]
            if seen.overflow():
                self.faults.append(f"{name}, {width}: wider than its window")
            picture = Image.open(io.BytesIO(seen.page.screenshot(full_page=True))).convert("RGB")
            scale = WIDTHS[width] / picture.width
            small = picture.resize((WIDTHS[width], max(1, round(picture.height * scale))), Image.Resampling.LANCZOS)
            tallest = small.height if name == MONITOR else TALLEST
            pictures.append((name, small.crop((0, 0, small.width, min(small.height, tallest)))))

    def write(self) -> Iterator[Path]:
        """Write the sheets, and yield where."""
        for (width, scheme), pictures in self.taken.items():
            path = OUT / f"pages-{width}-{scheme}.png"
            sheet = laid_out(sorted(pictures, key=lambda one: one[0] == MONITOR), WIDTHS[width])
            sheet.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
            yield path


def laid_out(pictures: list[tuple[str, Image.Image]], width: int) -> Image.Image:
    """Return one picture of all, row by row, each under its name."""
    across = max(1, (ACROSS + GAP) // (width + GAP))
    rows = [pictures[at : at + across] for at in range(0, len(pictures), across)]
    heights = [max(picture.height for _, picture in row) + LINE + GAP for row in rows]
    sheet = Image.new("RGB", (across * (width + GAP) + GAP, sum(heights) + GAP), "#8a8f98")
    pen, font, top = ImageDraw.Draw(sheet), ImageFont.load_default(12), GAP
    for row, height in zip(rows, heights, strict=True):
        for at, (name, picture) in enumerate(row):
            left = GAP + at * (width + GAP)
            pen.text((left, top - 4), name, fill="#000", font=font)
            sheet.paste(picture, (left, top + LINE))
        top += height
    return sheet


def participants(sheets: Sheets, visit: Callable[..., Any], address: str, link: str) -> None:
    """Take what participants see, from consent to code."""
    from apps.study.pages.walking import at, go, shown

    wanted = ("consent", "instructions", "comprehension", "attention", "about", "thanks")
    taken: set[str] = set()
    with visit(address + PROLIFIC + "1") as seen:
        page = seen.page
        at(page, "consent")
        while True:
            screen = shown(page)
            kind = screen.partition("-")[2].partition("-")[2] if screen.startswith(("trial", "grouping")) else screen
            if kind not in taken and (
                screen.startswith(wanted) or kind in ("none", "naive-path", "contrastive", "g1", "g4")
            ):
                taken.add(kind)
                sheets.take(seen, screen)
                if screen == "comprehension":
                    wrong(page)
                    page.get_by_role("alert").first.wait_for()
                    sheets.take(seen, "comprehension, once more")
                if kind == "contrastive":
                    page.get_by_role("button", name="Continue").click()
                    sheets.take(seen, "an answer is missing")
            if screen == "thanks":
                break
            answer(page, screen) if screen == "comprehension" else go(page)
    with visit(link) as seen:
        go(seen.page)
        seen.page.evaluate("() => sessionStorage.clear()")
        seen.page.goto(link)
        at(seen.page, "resume")
        sheets.take(seen, "who comes back")
        seen.page.get_by_role("button").first.click()
        at(seen.page, "instructions-1")
        seen.page.goto(address + "/withdraw")
        sheets.take(seen, "withdraw")


def ends(sheets: Sheets, visit: Callable[..., Any], address: str, link: str) -> None:
    """Take the other ends of a study."""
    from apps.study.pages.walking import at, go_to

    with visit(link) as seen:
        at(seen.page, "consent")
        seen.page.locator("button[type=submit]").last.click()
        at(seen.page, "no-consent")
        sheets.take(seen, "no-consent")
    with visit(link) as seen:
        go_to(seen.page, "comprehension")
        wrong(seen.page)
        seen.page.get_by_role("alert").first.wait_for()
        wrong(seen.page)
        at(seen.page, "screened-out")
        sheets.take(seen, "screened-out")
    with visit(address) as seen:
        at(seen.page, "failed")
        sheets.take(seen, "without a link")
        seen.faults.clear()
    with visit(address + "/no-such-page") as seen:
        sheets.take(seen, "no such page")
        seen.faults.clear()
    with visit(address + "/?assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE") as seen:
        at(seen.page, "consent")
        sheets.take(seen, "looked at on MTurk")


def away(sheets: Sheets, visit: Callable[..., Any], link: str, stop: Callable[[], None]) -> None:
    """Take what is seen while the server is away."""
    from apps.study.pages.walking import at

    with visit(link) as seen:
        at(seen.page, "consent")
        stop()
        seen.page.locator("button[type=submit]").first.click()
        seen.page.get_by_text("trying again").wait_for()
        sheets.take(seen, "the server is away")
        seen.faults.clear()


def researchers(sheets: Sheets, visit: Callable[..., Any], address: str, password: str, link: str) -> None:
    """Take the researchers' pages, and the study that is paused."""
    from apps.study.pages.walking import at

    with visit(address + "/researchers") as seen:
        page = seen.page
        sheets.take(seen, "log in")
        page.get_by_label("Password").fill(password)
        page.get_by_role("button", name="Log in").click()
        page.get_by_role("heading", name="How the study is going").wait_for()
        sheets.take(seen, MONITOR)
        page.goto(address + "/researchers/export")
        sheets.take(seen, "export")
        page.goto(address + "/researchers/erase")
        sheets.take(seen, "erase whom")
        page.goto(address + "/researchers")
        page.get_by_role("link", name="Erase P").first.click()
        page.get_by_role("button", name="Erase for good").wait_for()
        sheets.take(seen, "erase")
        page.goto(address + "/researchers")
        page.get_by_role("button", name="Pause the study").click()
        page.get_by_text("nobody new").wait_for()
    with visit(link) as seen:
        at(seen.page, "paused")
        sheets.take(seen, "paused")


def wrong(page: Any) -> None:
    """Answer the comprehension check wrongly."""
    for group in page.get_by_role("radiogroup").all():
        group.locator("label").last.click()
    page.locator("article button[type=submit]").first.click()


def answer(page: Any, screen: str) -> None:
    """Answer the comprehension check of the default study."""
    from apps.study.pages.walking import past

    for words in ("The route that the robot takes", "Only in the direction of the arrows"):
        page.locator("label", has_text=words).click()
    page.locator("article button[type=submit]").first.click()
    past(page, screen)


def main() -> int:
    sys.path.insert(0, str(ROOT / "tests"))  # what tests use to drive the browser
    from functools import partial

    from apps.study.server.visitors import Visitor, query_of
    from browsing import opened as browsers
    from browsing import visiting

    from ratherthan.apps.study.design.writing import New, new_study
    from ratherthan.apps.study.server.opening import opened
    from ratherthan.apps.study.server.researchers import entrance
    from ratherthan.apps.study.server.running import serving

    sheets = Sheets()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "study"
        design = new_study(folder, New())
        study = opened(design, str(folder / "answers.sqlite3"))
        stack.callback(study.close)
        browser = stack.enter_context(browsers())
        up = stack.enter_context(ExitStack())
        address = up.enter_context(serving(study))
        link, visit = entrance(study.secret, address), partial(visiting, browser)
        participants(sheets, visit, address, link)
        ends(sheets, visit, address, link)
        for seed in range(PEOPLE):
            stop = {3: "instructions-2", 8: "trial-m2-selective"}.get(seed)
            Visitor(address, design, query_of(link), seed=seed).walk(
                lambda told, stop=stop: told["screen"]["id"] == stop
            )
        researchers(sheets, visit, address, study.password or "", link)
        away(sheets, visit, address + "/?preview=1", up.close)
    OUT.mkdir(parents=True, exist_ok=True)
    for path in sheets.write():
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1000:.0f} kB")
    print("\n".join(sorted(set(sheets.faults))) or "No page had a fault.")
    return 1 if sheets.faults else 0


if __name__ == "__main__":
    sys.exit(main())

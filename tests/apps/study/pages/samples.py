"""Nothing enters, what a server might know of a study leaves: for tests and pictures of the researchers' pages."""

from __future__ import annotations

from typing import Any

KINDS = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
MAPS = ("m1", "m2", "m3")


def person(who: int, **more: Any) -> dict[str, Any]:
    """Return a participant, as a row of the researchers' page."""
    return {
        "key": f"P{who:04}",
        "state": "finished",
        "slot": who % 42,
        "screen": "",
        "number": 41,
        "of": 41,
        "entered": "2026-11-20 10:04",
        "last": "2026-11-20 10:21",
        "minutes": 17.2,
        "checks_failed": 0,
        "platform": "prolific",
        **more,
    }


def monitor(**more: Any) -> dict[str, Any]:
    """Return how a study is going: 12 of 84 finished."""
    states = [
        ("running", 5),
        ("finished", 12),
        ("dropped-out", 3),
        ("screened-out", 1),
        ("no-consent", 2),
        ("withdrawn", 1),
    ]
    going = {
        "simulated": False,
        "paused": False,
        "quota": 84,
        "full": False,
        "design": "A small study",
        "fingerprint": "f" * 16,
        "entrance": "https://study.example.org/?link=4fd0c7a9d1e84c55b1a3",
        "preview_link": "https://study.example.org/?preview=1",
        "states": [{"state": state, "people": people} for state, people in states],
        "started": 24,
        "consented": 21,
        "finished": 12,
        "running": 5,
        "dropped_out": 3,
        "screened_out": 1,
        "no_consent": 2,
        "withdrawn": 1,
        "erased": 1,
        "dropouts": [
            {"screen": "instructions-2", "phase": "instructions", "people": 1},
            {"screen": "trial-m2-naive-path", "phase": "trial", "people": 2},
        ],
        "slots": [
            {"slot": slot, "running": int(slot in (3, 7, 12, 15, 16)), "finished": int(slot < 12)} for slot in range(42)
        ],
        "balance": [
            {"kind": kind, "place": place, "finished": 5 + (at + place) % 2}
            for at, kind in enumerate(KINDS)
            for place in range(1, 8)
        ],
        "maps": [{"map": name, "place": place, "finished": 4} for name in MAPS for place in (1, 2, 3)],
        "balanced": False,
        "round": 42,
        "times": [
            {
                "kind": kind,
                "label": kind,
                "trials": 36,
                "median_s": 8.0 + 2.5 * at,
                "low_s": 6.1 + 2 * at,
                "high_s": 12.3 + 3 * at,
            }
            for at, kind in enumerate(KINDS)
        ],
        "checks": [
            {"screen": "comprehension", "answered": 18, "failed": 4},
            {"screen": "attention-1", "answered": 15, "failed": 1},
            {"screen": "attention-2", "answered": 13, "failed": 0},
        ],
        "checks_failed": [{"failed": 0, "people": 12}, {"failed": 1, "people": 1}, {"failed": 2, "people": 0}],
        "people": [
            person(24, state="running", screen="trial-m2-selective", number=19, minutes=6.0),
            person(23, state="dropped-out", screen="trial-m2-naive-path", number=22, checks_failed=1, platform="mturk"),
            *(person(number) for number in range(22, 10, -1)),
        ],
    }
    return {**going, **more}


def empty() -> dict[str, Any]:
    """Return how a study is going that nobody has seen yet."""
    return monitor(
        quota=None,
        finished=0,
        states=[{"state": "running", "people": 0}, {"state": "finished", "people": 0}],
        dropouts=[],
        slots=[{"slot": slot, "running": 0, "finished": 0} for slot in range(42)],
        balance=[{"kind": kind, "place": place, "finished": 0} for kind in KINDS for place in range(1, 8)],
        maps=[],
        times=[
            {"kind": kind, "label": kind, "trials": 0, "median_s": None, "low_s": None, "high_s": None}
            for kind in KINDS
        ],
        checks=[],
        checks_failed=[],
        people=[],
    )


FILES = [
    {"name": "observations.csv", "address": "", "about": "A row per observation."},
    {"name": "observations.parquet", "address": "", "about": "The same as Parquet."},
    {"name": "codebook.md", "address": "", "about": "What each column and each item means."},
]


def researchers(render: Any, study: dict[str, Any]) -> dict[str, str]:
    """Return all of the researchers' pages: path to HTML, by ``render(page, study, **context)``."""
    csrf = "c" * 40
    return {
        "/researchers/login": render("login.html", study, csrf=csrf, refused=""),
        "/researchers/login-refused": render("login.html", study, csrf=csrf, refused="wrong"),
        "/researchers": render("monitor.html", study, csrf=csrf, monitor=monitor(), notice=""),
        "/researchers-paused": render("monitor.html", study, csrf=csrf, monitor=monitor(paused=True), notice="paused"),
        "/researchers-empty": render(
            "monitor.html", {**study, "simulated": True}, csrf=csrf, monitor=empty(), notice=""
        ),
        "/researchers/export": render("export.html", study, csrf=csrf, files=FILES),
        "/researchers/erase": render("erase.html", study, csrf=csrf, participant=None, asked="", refused=""),
        "/researchers/erase-unknown": render(
            "erase.html", study, csrf=csrf, participant=None, asked="P9999", refused=""
        ),
        "/researchers/erase-one": render(
            "erase.html", study, csrf=csrf, participant=person(7), asked="P0007", refused=""
        ),
        "/message": render("message.html", study, kind="storage"),
    }

"""The query of an address enters, who comes and from where leaves; and how they are sent back.

============ ===================================== ============================ =======================================
platform     what its address carries              the same participant again   the end
============ ===================================== ============================ =======================================
Prolific     PROLIFIC_PID, STUDY_ID, SESSION_ID    the same SESSION_ID          redirect to its page of submissions
MTurk        assignmentId, hitId, workerId,        the same assignmentId        a form posted to turkSubmitTo
             turkSubmitTo
link         link=TOKEN, signed by the study       a personal link, else the    the code on the page
                                                   token that the browser keeps
robots       simulated=KEY                         its token                    nothing
============ ===================================== ============================ =======================================

Whoever types another's Prolific id gets a participant of their own: only a platform's session brings one back, and it is a secret
between the platform and the person. An MTurk preview (ASSIGNMENT_ID_NOT_AVAILABLE) is no participant.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote, urlsplit

from ratherthan.apps.study.design.nouns import Codes
from ratherthan.apps.study.server import tokens
from ratherthan.apps.study.server.refusals import RefusedError
from ratherthan.apps.study.server.values import clean_text

__all__ = ["MTURK_ENDS", "MTURK_FRAMES", "OPEN", "Arrival", "arrival", "ending", "platform_of", "simulated_key"]

PROLIFIC_END = "https://app.prolific.com/submissions/complete?cc="
MTURK_ENDS = ("https://www.mturk.com", "https://workersandbox.mturk.com")
"""Where an assignment may be submitted to: anything else would make this server a way to lead people astray."""
MTURK_FRAMES = (
    "https://worker.mturk.com",
    "https://workersandbox.mturk.com",
    "https://www.mturk.com",
    "https://requester.mturk.com",
)
"""Who may show the study in a frame."""
NO_ASSIGNMENT = "ASSIGNMENT_ID_NOT_AVAILABLE"
OPEN = "everybody"
"""The name in the link that all share; a personal link has another."""
LONGEST = 300


@dataclass(frozen=True, kw_only=True)
class Arrival:
    """Somebody who comes.

    Parameters
    ----------
    platform : str
        "prolific", "mturk", "link" or "simulated".
    session : str, optional
        What brings the same participant back.
    person, study, submit_to : str, optional
        As the platform tells them.
    preview : str
        "" for somebody who counts, "all" for a preview of the whole study, "look" for one that cannot answer.
    anew : bool
        Whether who has ended here before may begin again, on the same machine.
    """

    platform: str
    session: str | None = None
    person: str | None = None
    study: str | None = None
    submit_to: str | None = None
    preview: str = ""
    anew: bool = False


def platform_of(query: Mapping[str, str]) -> str:
    """Return which platform an address was made by, "" where none is told."""
    if "assignmentId" in query:
        return "mturk"
    if any(name in query for name in ("PROLIFIC_PID", "SESSION_ID", "STUDY_ID")):
        return "prolific"
    if "simulated" in query:
        return "simulated"
    return "link" if "link" in query else ""


def simulated_key(secret: str) -> str:
    """Return the key with which robots enter a study of robots."""
    return tokens.signed(secret, "simulated", "robots")


def arrival(query: Mapping[str, Any], secret: str, *, simulated: bool) -> Arrival:
    """Return who comes with the query of an address.

    Parameters
    ----------
    query : mapping
        As the browser or the platform sent it.
    secret : str
        Of the study.
    simulated : bool
        Whether the study is one of robots.

    Raises
    ------
    RefusedError
        Where nobody may enter like that.
    """
    asked = {
        str(name)[:40]: clean_text(value, "platform", longest=LONGEST)
        for name, value in query.items()
        if value is not None
    }
    if asked.get("preview") in ("1", "true", "yes"):
        return Arrival(platform="preview", preview="all")
    platform = platform_of(asked)
    if platform == "simulated" and not simulated:
        raise RefusedError(
            403,
            "platform",
            "simulated",
            "The participants of this study are people: robots need a database of their own.",
        )
    if simulated and platform != "simulated":
        raise RefusedError(
            403, "platform", "simulated", "The participants of this study are robots: nobody else can take part."
        )
    if platform == "mturk":
        return _from_mturk(asked)
    if platform == "prolific":
        return _from_prolific(asked)
    if platform == "simulated" and tokens.read(secret, "simulated", asked["simulated"]) is not None:
        return Arrival(platform="simulated")
    name = tokens.read(secret, "link", asked.get("link", ""))
    if name is None:
        raise RefusedError(403, "platform", "link", "A study is entered with the link that its researchers sent.")
    session = None if name == OPEN else f"link:{name}"
    return Arrival(platform="link", session=session, anew=asked.get("new") in ("1", "true", "yes"))


def ending(state: str, arrived: Mapping[str, Any], codes: Codes, *, failed: bool) -> dict[str, Any] | None:
    """Return how a participant is sent back, None while there is nothing to send.

    Parameters
    ----------
    state : str
        Of the participant.
    arrived : mapping
        "platform", "session" and "submit_to" of the identity.
    codes : Codes
    failed : bool
        Whether too many attention checks failed.

    Returns
    -------
    dict or None
        "code", and "redirect" or "post" where the platform has them.
    """
    by_state = {
        "finished": (codes.failed_checks or codes.done) if failed else codes.done,
        "screened-out": codes.screened_out,
        "no-consent": codes.no_consent,
    }
    if state not in by_state:
        return None
    code = by_state[state]
    told: dict[str, Any] = {"code": code, "redirect": None, "post": None}
    if arrived["platform"] == "prolific" and code:
        told["redirect"] = PROLIFIC_END + quote(code, safe="")
    if arrived["platform"] == "mturk" and arrived.get("submit_to") and state != "no-consent":
        told["post"] = {
            "action": f"{arrived['submit_to']}/mturk/externalSubmit",
            "fields": {"assignmentId": str(arrived["session"]).removeprefix("mturk:"), "code": code or state},
        }
    return told if code or told["post"] else None


def _from_prolific(asked: Mapping[str, str]) -> Arrival:
    session = asked.get("SESSION_ID") or None
    person = asked.get("PROLIFIC_PID") or None
    if session is None or person is None:
        raise RefusedError(
            403,
            "platform",
            "link",
            "A link of Prolific must carry PROLIFIC_PID and SESSION_ID; open the study from there.",
        )
    return Arrival(platform="prolific", session=f"prolific:{session}", person=person, study=asked.get("STUDY_ID"))


def _from_mturk(asked: Mapping[str, str]) -> Arrival:
    if asked["assignmentId"] == NO_ASSIGNMENT:
        return Arrival(platform="mturk", preview="look")
    person, back = asked.get("workerId") or None, asked.get("turkSubmitTo", "")
    if person is None or not asked["assignmentId"]:
        raise RefusedError(
            403, "platform", "link", "A task of MTurk must carry assignmentId and workerId; open the study from there."
        )
    try:
        parts = urlsplit(back)
        origin = f"{parts.scheme}://{parts.netloc}".lower()
    except ValueError:
        origin = ""
    if origin not in MTURK_ENDS:
        raise RefusedError(
            403, "platform", "submit-to", "A task of MTurk must be submitted to MTurk: open the study from there."
        )
    return Arrival(
        platform="mturk",
        session=f"mturk:{asked['assignmentId']}",
        person=person,
        study=asked.get("hitId"),
        submit_to=origin,
    )

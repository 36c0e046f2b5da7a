"""A design and a model of responses enter, a whole simulated study leaves: its database, its export, and what it was made from.

The real server is started on a database of its own, marked as simulated, and each robot goes through the study by the same HTTP requests
as a browser. Robots come in waves: those who left, declined or were screened out in one wave are gone, their places in the balanced plan
are free at once (a server for people waits for the gap that the design sets), and the next wave takes them, until as many have
finished as are wanted. So the plan is balanced over those who finish.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ratherthan.apps.study.design.nouns import Design
from ratherthan.apps.study.robots.answering import Robot
from ratherthan.apps.study.robots.model import ResponseModel
from ratherthan.errors import InputError, LimitError, SourceError

if TYPE_CHECKING:
    import httpx

__all__ = ["Run", "Simulation", "simulated"]

WAVES = 40
PATIENCE = 60.0
TRIES = 6
FINISHED, RUNNING = "finished", "running"
Tell = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Run:
    """What is simulated.

    Parameters
    ----------
    people : int
        How many finish.
    seed : int
        The same seed makes the same robots; which place in the plan each gets depends on who comes first.
    factor : float
        By which the model's differences between kinds are multiplied.
    at_once : int
        How many robots answer at the same time.
    """

    people: int
    seed: int = 1
    factor: float = 1.0
    at_once: int = 20


@dataclass(kw_only=True)
class Simulation:
    """How a simulation went.

    Parameters
    ----------
    ends : dict of str to int
        How many robots ended in which state; "dropped-out" for those who left.
    answers : int
        How many answers were acknowledged.
    export : Path
    """

    ends: dict[str, int] = field(default_factory=dict)
    answers: int = 0
    export: Path = Path()


def simulated(design: Design, model: ResponseModel, run: Run, folder: Path, tell: Tell | None = None) -> Simulation:
    """Let robots take part in a study, and export what they answered.

    Parameters
    ----------
    design : Design
    model : ResponseModel
    run : Run
    folder : Path
        Where the database and the export go; it must not hold a simulation yet.
    tell : callable, optional
        Is told how far it is.

    Raises
    ------
    InputError
        If the folder holds a simulation.
    LimitError
        If too few robots finish: the model has nearly all of them leave.
    """
    from ratherthan.apps.study.server import places
    from ratherthan.apps.study.server.exporting import written
    from ratherthan.apps.study.server.opening import existing, opened
    from ratherthan.apps.study.server.running import robots_key, serving
    from ratherthan.apps.study.server.sessions import milliseconds

    database = folder / "simulated.sqlite3"
    if database.exists():
        raise InputError(f"A simulation begins anew, and '{folder}' holds one already. Give another --output.")
    found = Simulation(export=folder / "export")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SourceError(
            f"The simulation needs a folder, and '{folder}' cannot be made: {error.strerror or error}."
        ) from error
    study = opened(replace(design, quota=run.people), str(database), simulated=True)
    try:
        with serving(study) as address:
            first = 0
            for _ in range(WAVES):
                missing = run.people - found.ends.get(FINISHED, 0)
                if missing <= 0:
                    break
                robots = [
                    Robot(number=first + i, seed=run.seed, design=design, model=model, factor=run.factor)
                    for i in range(missing)
                ]
                first += missing
                asyncio.run(_wave(robots, _Way(address, robots_key(study), run, found, tell)))
                study.store.write_now(lambda connection: places.free_abandoned(connection, milliseconds() + 1))
    finally:
        study.close()
    if found.ends.get(FINISHED, 0) < run.people:
        raise LimitError(
            f"{run.people} robots must finish, and after {WAVES} waves {found.ends.get(FINISHED, 0)} have. "
            "Let the response model have fewer of them leave or fail.",
            limit="time",
            phase="simulating",
        )
    with existing(str(database)) as (connection, stored):
        written(connection, stored, found.export)
    _note(found, design, model, run)
    return found


def _note(found: Simulation, design: Design, model: ResponseModel, run: Run) -> None:
    """Write down what was simulated, beside the export."""
    from ratherthan.apps.study.analysis.words import say
    from ratherthan.io._files import write_atomically

    told = {
        "simulated": True,
        "notice": say("forms.simulated"),
        "design": design.fingerprint,
        "model": model.name,
        "people": run.people,
        "factor": run.factor,
        "seed": run.seed,
        "ends": dict(sorted(found.ends.items())),
        "answers": found.answers,
    }
    with write_atomically(found.export / "simulation.json") as file:
        file.write((json.dumps(told, indent=2, ensure_ascii=False) + "\n").encode("utf-8"))


@dataclass(frozen=True)
class _Way:
    """How a wave of robots reaches the server, and what is counted."""

    address: str
    key: str
    run: Run
    found: Simulation
    tell: Tell | None

    def ended(self, state: str) -> None:
        self.found.ends[state] = self.found.ends.get(state, 0) + 1
        if self.tell is not None:
            self.tell(f"{self.found.ends.get(FINISHED, 0)} of {self.run.people} have finished")


async def _wave(robots: list[Robot], way: _Way) -> None:
    """Let robots go through the study, some at a time."""
    import httpx

    limits = httpx.Limits(max_connections=way.run.at_once, max_keepalive_connections=way.run.at_once)
    turn = asyncio.Semaphore(way.run.at_once)
    async with httpx.AsyncClient(base_url=way.address, limits=limits, timeout=PATIENCE, trust_env=False) as client:

        async def go(robot: Robot) -> None:
            async with turn:
                way.ended(await _through(client, robot, way))

        await asyncio.gather(*(go(robot) for robot in robots))


async def _through(client: httpx.AsyncClient, robot: Robot, way: _Way) -> str:
    """Let one robot go through the study, and return how it ended."""
    entered = await _asked(client, "POST", "/api/enter", None, {"platform": {"simulated": way.key}})
    token = entered["token"]
    if not token:
        return str(entered["state"])
    now = await _asked(client, "GET", "/api/now", token)
    while now["state"] == RUNNING:
        screen = now["screen"]
        if robot.leaves(screen):
            return "dropped-out"
        answered = robot.answer(screen)
        body = {
            "screen": screen["id"],
            "attempt": now["attempt"],
            "values": answered.values,
            "time_ms": answered.milliseconds,
            "hidden_ms": 0,
        }
        now = await _asked(client, "POST", "/api/answer", token, body)
        way.found.answers += 1
    return str(now["state"])


async def _asked(
    client: httpx.AsyncClient, method: str, path: str, token: str | None, body: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return what the server answers; asked again where it cannot at the moment."""
    import httpx

    headers = {} if token is None else {"Authorization": f"Bearer {token}"}
    for attempt in range(TRIES):
        try:
            response = await client.request(method, path, headers=headers, json=body)
        except httpx.TransportError:
            if attempt == TRIES - 1:
                raise InputError("The server of the simulation went away.") from None
        else:
            if response.status_code == 200:
                answer: dict[str, Any] = response.json()
                return answer
            if response.status_code not in (429, 503) or attempt == TRIES - 1:
                raise InputError(f"The server refused a robot: {response.status_code} {_sentence(response)}")
        await asyncio.sleep(0.1 * 2**attempt)
    raise AssertionError("the last try returns or raises")


def _sentence(response: httpx.Response) -> str:
    """Return what a refusal says."""
    try:
        told = response.json()["error"]
        return f"({told['place']}, {told['kind']}) {told['sentence']}"
    except (ValueError, KeyError, TypeError):
        return ""

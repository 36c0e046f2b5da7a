"""Finished rows enter one by one, each durable before the next; an interrupted run's rows leave when it goes on.

The journal is a file of JSON lines beside the results: first what the run was about, then a line per row, written through to the
disk. A line that the interruption cut off is dropped. When all rows are done the results are written and the journal goes.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from ratherthan.cluster.missions import Mission
from ratherthan.errors import SourceError

__all__ = ["Journal", "journal_path"]

VERSION = 1


def journal_path(results: str | os.PathLike[str]) -> Path:
    """Return where the journal of a file of results lies."""
    return Path(results).with_name(Path(results).name + ".journal")


class Journal:
    """The rows of a run that are done.

    Parameters
    ----------
    results : path
        The file that the run is to write.
    missions : sequence of Mission
    resume : bool
        Whether to go on with what a run before left.

    Raises
    ------
    SourceError
        Where a journal lies there and is not to be gone on with, or it is of other missions, or models changed since.
    """

    def __init__(self, results: str | os.PathLike[str], missions: Sequence[Mission], *, resume: bool) -> None:
        self.path = journal_path(results)
        self.shown = os.fspath(self.path)
        self.head = _head(missions)
        self.done: dict[int, dict[str, Any]] = {}
        self.resumed = False
        self.file: BinaryIO | None = None
        try:
            self._open(resume=resume)
        except OSError as error:
            raise SourceError(
                f"'{self.shown}' must be writable, but it is not: {error.strerror or error}. Check its folder.",
                path=self.shown,
            ) from error

    def _open(self, *, resume: bool) -> None:
        there = self.path.exists() and self.path.stat().st_size > 0
        if there and not resume:
            raise SourceError(
                f"An interrupted run left '{self.shown}'. Go on with it by --resume, or delete it to begin anew.",
                path=self.shown,
            )
        if there:
            whole = self._read()
            os.truncate(self.path, whole)
        self.file = self.path.open("ab")
        if not there or not self.resumed:
            self._append(self.head)

    def _read(self) -> int:
        """Read the rows that are done; return how many bytes are whole lines."""
        whole = 0
        with self.path.open("rb") as file:
            for line in file:
                try:
                    entry = json.loads(line) if line.endswith(b"\n") else None
                except (json.JSONDecodeError, UnicodeDecodeError):
                    entry = None
                if not isinstance(entry, dict):
                    break
                if whole == 0:
                    self._check(entry)
                elif isinstance(entry.get("row"), int):
                    self.done[entry["row"]] = entry
                whole += len(line)
        return whole

    def _check(self, head: dict[str, Any]) -> None:
        self.resumed = True
        if head.get("missions") != self.head["missions"] or head.get("version") != VERSION:
            raise SourceError(
                f"'{self.shown}' must be of these missions to go on with, but the table has changed since. "
                "Delete it to begin anew.",
                path=self.shown,
            )
        changed = [name for name, stamp in self.head["models"].items() if head.get("models", {}).get(name) != stamp]
        if changed:
            raise SourceError(
                f"'{changed[0]}' must be what it was when the run began, but it has changed since. "
                f"Delete '{self.shown}' to begin anew.",
                path=changed[0],
            )

    def add(self, row: dict[str, Any]) -> None:
        """Add a finished row, durably."""
        self.done[row["row"]] = row
        self._append(row)

    def _append(self, entry: dict[str, Any]) -> None:
        assert self.file is not None
        try:
            self.file.write(json.dumps(entry, allow_nan=False).encode("ascii") + b"\n")
            self.file.flush()
            os.fsync(self.file.fileno())
        except OSError as error:
            raise SourceError(
                f"'{self.shown}' must be writable, but it is not: {error.strerror or error}. Make room and go on by --resume.",
                path=self.shown,
            ) from error

    def remove(self) -> None:
        """Take the journal away: the results are written."""
        self.close()
        self.path.unlink(missing_ok=True)

    def close(self) -> None:
        """Close the file; what is in it stays."""
        if self.file is not None:
            with suppress(OSError):  # it tries once more to write what was told to be too much
                self.file.close()
            self.file = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _head(missions: Sequence[Mission]) -> dict[str, Any]:
    """Return what tells one run from another: the missions, and the files of their models as they are now."""
    text = json.dumps([asdict(mission) for mission in missions], sort_keys=True)
    models: dict[str, list[int]] = {}
    for name in dict.fromkeys(name for mission in missions for name in (mission.source, mission.policy) if name):
        with suppress(OSError, ValueError):  # what is no file has no stamp, and its row is told why it fails
            found = os.stat(name)  # noqa: PTH116 - once, and of a name that may be none
            if stat.S_ISREG(found.st_mode):
                models[name] = [found.st_size, found.st_mtime_ns]
    return {"version": VERSION, "missions": hashlib.sha256(text.encode()).hexdigest(), "models": models}

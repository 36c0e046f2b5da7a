"""The address of a cluster, or how many local workers are wanted, enters; an Engine leaves that runs functions on workers.

This is the only module that knows Dask's ``distributed``: it starts workers, sends functions to them, starts those anew that
die, and runs again what they were at. What runs must therefore give the same answer when it is run twice.

A local cluster listens on 127.0.0.1 alone, on free ports, with no web page, and ends with the block that started it, also when
the block is interrupted; its workers end with the process that started them, however that ends.
"""

from __future__ import annotations

import logging
import shutil
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from ratherthan.errors import InputError, MissingExtraError, RatherthanError
from ratherthan.io._leftovers import temporary_folder
from ratherthan.model.watch import look

__all__ = ["ClusterError", "Engine", "Task", "WorkerLostError", "engine", "here", "is_there"]

HOST = "127.0.0.1"
PATIENCE = 20.0
"""Seconds to wait for a scheduler, and for the first worker."""
STARTING = 120.0
"""Seconds to wait for all local workers: many may start at once, on a machine that is busy."""
SCHEMES = ("", "tcp", "tls", "ucx", "ws", "wss")
WINK = 0.02
STEP = 0.25
"""Seconds between two looks at what the caller may want meanwhile."""
SETTINGS: dict[str, Any] = {
    "distributed.scheduler.allowed-failures": 3,
    "distributed.scheduler.work-stealing": False,  # a block stays where its rows are
    "distributed.worker.daemon": False,
    "distributed.worker.memory.target": False,  # what a worker holds is kept by our modules, not by the engine
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
    "distributed.scheduler.worker-ttl": None,  # a compiled loop may keep a worker from saying that it lives
    "distributed.comm.timeouts.connect": "10s",
    "distributed.admin.tick.limit": "1h",  # a compiled loop may keep the worker's event loop waiting
    # Ctrl-C in a terminal is for the process that waits for the answer: it ends its workers itself.
    "distributed.worker.preload": ["import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"],
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.nanny.pre-spawn-environ": {
        "OMP_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "MALLOC_TRIM_THRESHOLD_": "67108864",  # the engine's own 64 kB makes large arrays be asked for anew each time
        "MALLOC_MMAP_THRESHOLD_": "33554432",
    },
}


class ClusterError(InputError):
    """A cluster cannot be reached or started."""


class WorkerLostError(RatherthanError):
    """Worker after worker was lost at one piece of work; most often the memory did not suffice."""


def is_there() -> bool:
    """Return whether the engine is installed."""
    from importlib.util import find_spec

    return find_spec("distributed") is not None


class Task:
    """What a worker is to run, and where; made by `Engine.submit`."""

    def __init__(self, function: Callable[..., Any], given: tuple[Any, ...], at: str | None) -> None:
        self.function, self.given, self.at = function, given, at
        self.future: Any = None


class Engine:
    """A cluster to run functions on. Made by `engine`."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def workers(self) -> list[str]:
        """Return the addresses of the workers that are there, in the order in which they came."""
        return list(self._client.scheduler_info(n_workers=-1)["workers"])

    def submit(self, function: Callable[..., Any], *given: Any, at: str | None = None) -> Task:
        """Let a worker run a function; return what the result can be asked from.

        Parameters
        ----------
        function : callable
            Of a module that workers can import, too.
        *given
            What it is called with.
        at : str, optional
            The worker that should run it; another one does if that is gone.
        """
        task = Task(function, given, at)
        self._send(task)
        return task

    def _send(self, task: Task) -> None:
        """Send a task to the worker that should run it, or if that is not there to any."""
        if task.at is not None and task.at not in self.workers():
            task.at = None
        place = {} if task.at is None else {"workers": [task.at], "allow_other_workers": True}
        task.future = self._client.submit(task.function, *task.given, pure=False, **place)

    def _renew(self, tasks: Iterable[Task]) -> None:
        """Send anew what waits for a worker that is gone: where none was left for a moment, the engine would wait for ever."""
        there = self.workers()
        for task in tasks:
            if task.at is not None and task.at not in there and not task.future.done():
                task.future.cancel(force=True)
                self._send(task)

    def first_of(self, pending: Iterable[Task], meanwhile: Callable[[], None] | None = None) -> list[Task]:
        """Wait until some of the submitted are done; return those.

        Parameters
        ----------
        pending : iterable
            What `submit` returned.
        meanwhile : callable, optional
            Called some times a second: it may raise to stop waiting.
        """
        return self._wait(list(pending), "FIRST_COMPLETED", meanwhile)

    def all_of(self, pending: Iterable[Task], meanwhile: Callable[[], None] | None = None) -> list[Any]:
        """Return the results of all, in their order; raise what one of them raised."""
        tasks = list(pending)
        self._wait(tasks, "ALL_COMPLETED", meanwhile)
        return [self.result(task) for task in tasks]

    def _wait(self, tasks: list[Task], until: str, meanwhile: Callable[[], None] | None) -> list[Task]:
        from distributed import wait

        while True:
            with suppress(TimeoutError), self._client.as_current():
                wait([task.future for task in tasks], timeout=STEP, return_when=until)
                return [task for task in tasks if task.future.done()]
            self._renew(tasks)
            if meanwhile is not None:
                meanwhile()

    def result(self, task: Task) -> Any:
        """Return the result of what is done, or raise what it raised.

        Raises
        ------
        WorkerLostError
            Where worker after worker was lost at it.
        """
        from distributed import KilledWorker
        from distributed.client import FutureCancelledError

        try:
            return task.future.result()
        except KilledWorker as error:
            raise WorkerLostError(
                f"Work must end on a worker, but {SETTINGS['distributed.scheduler.allowed-failures']} workers were lost at "
                "it one after the other. Most often the memory does not suffice: take workers with more."
            ) from error
        except FutureCancelledError as error:
            raise ClusterError(
                "The cluster must stay until the work is done, but it went away. Start it anew."
            ) from error


def here() -> str:
    """Return the address of the worker that runs this, empty where none does."""
    from distributed import get_worker

    try:
        return str(get_worker().address)
    except ValueError:
        return ""


@contextmanager
def engine(address: str | None = None, *, workers: int = 2) -> Iterator[Engine]:
    """Connect to a cluster, or start one of this machine's processes for the time of the block.

    Parameters
    ----------
    address : str, optional
        Of a Dask scheduler, ``tcp://host:8786``. Without it local workers are started.
    workers : int
        How many.

    Raises
    ------
    MissingExtraError
        Where the engine is not installed.
    ClusterError
        Where nobody answers at the address, or it has no workers.
    """
    if not is_there():
        raise MissingExtraError(
            "Several workers need Dask's 'distributed', which is not installed. "
            "Install it with: pip install 'ratherthan[cluster]'.",
            library="distributed",
        )
    if address is not None:
        _check_address(address)
    import dask

    with dask.config.set(_settings()), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the engine's, about ports and clocks
        logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)
        if address is not None:
            with _connected(address) as client:
                yield Engine(client)
            return
        with temporary_folder() as folder, _local(workers, str(folder)) as client:
            yield Engine(client)


def _settings() -> Mapping[str, Any]:
    return {**SETTINGS, "logging": {"distributed": "critical", "distributed.nanny": "critical"}}


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    from distributed import Client

    try:
        client = Client(address, timeout=PATIENCE / 2, set_as_default=False, name="ratherthan")
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterError(
            f"A cluster must answer at its scheduler's address, such as tcp://host:8786, but none does at '{address}': "
            f"{str(error).splitlines()[0] if str(error) else type(error).__name__}. Start one with: dask scheduler.",
            address=address,
        ) from error
    try:
        _wait_for_worker(client, address)
        yield client
    finally:
        with suppress(OSError, TimeoutError):
            client.close(timeout=2)


def _check_address(address: str) -> None:
    """Raise ClusterError for what can be no scheduler's address: the engine itself would try for long, and again when it ends."""
    scheme, _, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    if scheme == "inproc":
        return
    if scheme in SCHEMES and host and port.isascii() and port.isdigit() and 0 < int(port) < 2**16:
        return
    raise ClusterError(
        f"A cluster must be named by its scheduler's address, such as tcp://host:8786, got '{address}'. "
        "For workers on this machine leave the address out.",
        address=address,
    )


def _wait_for_local(cluster: Any, number: int) -> None:
    """Wait until all local workers are there, unless one of them cannot start."""
    until = time.monotonic() + STARTING
    while len(cluster.scheduler.workers) < number:
        look()
        failed = any(nanny.status.name in ("failed", "closing", "closed") for nanny in cluster.workers.values())
        if failed or time.monotonic() > until:
            raise ClusterError(
                f"Local workers must start, but only {len(cluster.scheduler.workers)} of {number} did. They are new processes, "
                "which import the main program: that must be a file, not what is read from standard input."
            )
        time.sleep(WINK)


def _wait_for_worker(client: Any, shown: str, number: int = 1) -> None:
    try:
        client.wait_for_workers(number, timeout=PATIENCE)
    except TimeoutError as error:
        raise ClusterError(
            f"A cluster must have workers, but that at '{shown}' has none. Start some with: dask worker {shown}.",
            address=shown,
        ) from error


@contextmanager
def _local(workers: int, folder: str) -> Iterator[Any]:
    """Start local workers, and end them: in good order, and where that takes long by force."""
    import multiprocessing

    process = multiprocessing.current_process()
    if getattr(process, "_inheriting", False) or process.daemon:  # it is just being started, or may start none
        raise ClusterError(
            "Local workers must be started by the main program, but this is a process that it started: put the call under "
            'if __name__ == "__main__":, or leave several workers out.'
        )
    from distributed import Client, LocalCluster

    cluster: Any = None
    client: Any = None
    others = set(multiprocessing.active_children())
    try:
        with _undisturbed():
            cluster = LocalCluster(
                n_workers=0,
                threads_per_worker=1,
                processes=True,
                host=HOST,
                scheduler_port=0,
                scheduler_kwargs={"dashboard": False, "dashboard_address": f"{HOST}:0"},
                worker_dashboard_address=None,
                silence_logs=logging.CRITICAL + 1,
                local_directory=folder,
                memory_limit=0,
            )
        cluster.scale(workers)  # from the cluster's own thread, which hears no Ctrl-C, nor does what it starts
        _wait_for_local(cluster, workers)
        client = Client(cluster, set_as_default=False, name="ratherthan")
        _wait_for_worker(client, "local workers", workers)
        shutil.rmtree(folder, ignore_errors=True)  # nothing is ever written there: it must not outlive this process
        yield client
    finally:
        _end(client, cluster, others)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let the threads that start in the block, and the processes that these start, never hear Ctrl-C.

    In a terminal all processes hear it, and a worker that is still importing would end with a traceback. It is for the process
    that waits for the answer, which ends its workers itself; what comes within the block is heard behind it. The process that
    tidies up after all others is started here, too, and kept from telling that there was something to tidy up.
    """
    import os
    import signal
    from multiprocessing import resource_tracker

    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    warned = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = "ignore::UserWarning:multiprocessing.resource_tracker"
    try:
        resource_tracker.ensure_running()  # before the block, as it lets Ctrl-C through at its end
    finally:
        if warned is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = warned
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end(client: Any, cluster: Any, others: set[Any]) -> None:
    """End a local cluster within a second or so, whatever its workers are at, and leave the `others` of this process alone."""
    import multiprocessing

    for nanny in () if cluster is None else cluster.workers.values():
        nanny.auto_restart = False
    for process in set(multiprocessing.active_children()) - others:  # they hold nothing that is still wanted
        with suppress(OSError, ValueError, AttributeError):
            process.kill()
    for part in (client, cluster):
        if part is not None:
            with suppress(OSError, TimeoutError, RuntimeError):
                part.close(timeout=2)

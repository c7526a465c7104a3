"""Diagnoses by the workers of a Dask cluster: of this computer, or one by its address."""

from __future__ import annotations

import logging
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from importlib import import_module
from itertools import islice
from multiprocessing import resource_tracker
from typing import Any

from winchkit.errors import ConnectionLost, UsageError
from winchkit.fleet.library.tasks import Outcome, Task, failed, outcome_of
from winchkit.version import __version__

_WORKER_BYTES = 2 << 30
"""Memory that a diagnosis of long runs needs, with reserve."""
_AHEAD = 4
"""Tasks per worker that the scheduler holds: its memory does not grow with the library."""
_LOSSES = 3
"""Lost workers after which a task counts as the cause and fails."""
_TIMEOUT = 30.0
"""s: a scheduler answers at once, and workers of a cluster that is starting come within it."""
_LOOK = 1.0
"""s between two looks at the workers."""


def cluster_outcomes(
    due: Sequence[Task],
    jobs: int | None = None,
    scheduler: str | None = None,
    work: Callable[[Task], Outcome] = outcome_of,
) -> Iterator[Outcome]:
    """Outcomes of tasks as they end, in any order, by ``jobs`` processes of this computer or an
    existing ``scheduler``, such as ``tcp://host:8786``. Raises UsageError without Dask, and for
    workers with another version of winchkit; ConnectionLost for a scheduler that does not answer,
    or has no workers any more."""
    try:
        dask: Any = import_module("dask")
        distributed: Any = import_module("distributed")
    except ImportError:
        raise UsageError(
            "several processes need Dask; install it with pip install 'winchkit[cluster]', or "
            "use one process (--jobs 1)"
        ) from None
    with dask.config.set({"distributed.scheduler.allowed-failures": _LOSSES}):
        if scheduler is None:
            threads = {f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL")}
            with _without_sigint():
                local = distributed.LocalCluster(
                    n_workers=min(jobs or _processes(), len(due)),
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",
                    env=threads,
                    silence_logs=logging.ERROR,  # cancelled tasks are no news
                )
            with local, distributed.Client(local) as client:
                yield from _outcomes(client, due, work)
            return
        try:
            client = distributed.Client(scheduler, timeout=_TIMEOUT, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ConnectionLost(f"{scheduler}: no Dask scheduler answers ({error})") from None
        with client:
            try:
                client.wait_for_workers(1, timeout=_TIMEOUT)
            except TimeoutError:
                raise ConnectionLost(
                    f"{scheduler}: has no workers after {_TIMEOUT:g} s; start one with "
                    f"'dask worker {scheduler}'"
                ) from None
            _require_version(client, scheduler)
            yield from _outcomes(client, due, work)


@contextmanager
def _without_sigint() -> Iterator[None]:
    """Processes and threads that begin here never get SIGINT; this thread, or another one of the
    process, gets it afterwards.

    A terminal sends Ctrl-C to workers too, which would end with tracebacks. The signal mask is
    inherited, also by the worker that a nanny starts in place of a lost one.
    """
    if sys.platform == "win32":
        yield
        return
    # Before: where it starts the tracker, it unblocks SIGINT in the thread that asks for it.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _outcomes(
    client: Any, due: Sequence[Task], work: Callable[[Task], Outcome]
) -> Iterator[Outcome]:
    """Results of a window of tasks; one that fails is tried once more."""
    distributed: Any = import_module("distributed")
    tasks = iter(due)
    window = _AHEAD * max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
    running: dict[str, tuple[Any, Task, int]] = {}
    """Future, task and attempt by the key of the future."""

    def submit(task: Task, attempt: int) -> Any:
        future = client.submit(work, task, key=f"winchkit-{task.key}-{attempt}")
        running[future.key] = (future, task, attempt)
        return future

    first = [submit(task, 0) for task in islice(tasks, window)]
    ended = distributed.as_completed(first, loop=client.loop)

    def give_up() -> None:
        client.cancel([future for future, _, _ in list(running.values())])

    with _watched(client, give_up) as deserted:
        for future in ended:
            _, task, attempt = running[future.key]
            try:
                outcome = _result(future, task)
            except CancelledError:
                if not deserted.is_set():
                    raise
                raise ConnectionLost(
                    f"the cluster has had no workers for {_TIMEOUT:g} s; what was diagnosed is "
                    "kept: look at the memory of its computers and repeat the command"
                ) from None
            # Not before: a result whose worker is lost is computed again, or given up.
            del running[future.key]
            future.release()
            if outcome.diagnosis.get("failure") is not None and attempt == 0:
                ended.add(submit(task, 1))
                continue
            yield outcome
            for task in islice(tasks, 1):
                ended.add(submit(task, 0))


def _result(future: Any, task: Task) -> Outcome:
    """Outcome of a future that has ended, or its failure; raises CancelledError."""
    if error := future.exception():
        return failed(task, f"{type(error).__name__}: {error}")
    found: Outcome = future.result()
    return found


@contextmanager
def _watched(client: Any, give_up: Callable[[], object]) -> Iterator[threading.Event]:
    """Event that is set, before ``give_up`` is called, once no worker has been there for 30 s. The
    nanny of a worker that ends gives up where its start takes too long; tasks would wait
    forever."""
    deserted, over = threading.Event(), threading.Event()

    def watch() -> None:
        alone = 0.0
        while not over.wait(_LOOK):
            there: Mapping[str, object] = {}
            with suppress(OSError):  # the scheduler does not answer
                there = client.scheduler_info(n_workers=-1)["workers"]
            alone = 0.0 if there else alone + _LOOK
            if alone >= _TIMEOUT:
                deserted.set()
                give_up()
                return

    watcher = threading.Thread(target=watch, name="workers of the cluster", daemon=True)
    watcher.start()
    try:
        yield deserted
    finally:
        over.set()
        watcher.join()


def _processes() -> int:
    """Processes for the cores and the memory of this computer."""
    cores: int = import_module("dask.system").CPU_COUNT
    memory: int = import_module("distributed.system").MEMORY_LIMIT
    return max(1, min(cores, memory // _WORKER_BYTES))


def _version_of_worker() -> str:
    from winchkit.version import __version__ as own

    return own


def _require_version(client: Any, scheduler: str) -> None:
    found = set(client.run(_version_of_worker).values())
    if found - {__version__}:
        others = ", ".join(sorted(found - {__version__}))
        raise UsageError(
            f"{scheduler}: its workers have winchkit {others}, this computer {__version__}; "
            "install the same version there"
        )

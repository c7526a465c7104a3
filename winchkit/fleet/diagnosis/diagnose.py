"""Diagnosis of every winch of a recording by itself."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from threading import Thread

from winchkit.arguments import ProgressCallback, no_progress, require_each, require_type
from winchkit.diagnosis.diagnose import WinchAnswer, diagnose
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

_CONCURRENT = 2
"""Winches that are diagnosed at the same time; computing cost: memory and cores."""


def diagnose_each(
    winches: Mapping[str, Sequence[Run]],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    decimate: bool = True,
    as_recorded: bool = False,
    progress: ProgressCallback = no_progress,
) -> Iterator[tuple[str, WinchAnswer]]:
    """Name and answer of every winch, in order, all compared with one profile.

    Parameters
    ----------
    winches
        Name to its runs.
    profile
        Winch profile of all of them.
    catalogue
        Effects; None for the shipped ones.
    band
        Cut-off of the torque's low-pass, Hz; None for the default.
    decimate
        Whether long runs are decimated.
    as_recorded
        Look for effects although a sign or unit looks wrong.
    progress
        Progress callback: text and share of the work done.

    Yields
    ------
    tuple of str and WinchAnswer
        Name and answer of every winch, in order.

    Notes
    -----
    Two winches are computed at a time. An answer holds hundreds of megabytes after long runs:
    release one before taking the next.
    """
    require_each(winches, Run, "winches")
    require_type(profile, WinchProfile, "profile")
    catalogue = catalogue or load_catalogue()
    shares = dict.fromkeys(winches, 0.0)

    def one(name: str) -> WinchAnswer:
        def report_progress(what: str, share: float | None) -> None:
            shares[name] = share or shares[name]
            progress(f"{name}: {what}" if name else what, sum(shares.values()) / len(shares))

        answer = diagnose(
            winches[name],
            profile,
            catalogue,
            band,
            decimate=decimate,
            as_recorded=as_recorded,
            progress=report_progress,
        )
        report_progress("done", 1.0)
        return answer

    running: deque[tuple[str, Future[WinchAnswer]]] = deque()
    for name in winches:
        running.append((name, _started(one, name)))
        if len(running) == _CONCURRENT:
            yield _oldest_answer(running)
    while running:
        yield _oldest_answer(running)


def _oldest_answer(running: deque[tuple[str, Future[WinchAnswer]]]) -> tuple[str, WinchAnswer]:
    """Wait for the oldest answer; no reference to it is kept here."""
    name, future = running.popleft()
    return name, future.result()


def _started(work: Callable[[str], WinchAnswer], name: str) -> Future[WinchAnswer]:
    """Start the computation of an answer in a thread; a pool would wait for its threads, for
    seconds, when the caller is interrupted."""
    future: Future[WinchAnswer] = Future()

    def run() -> None:
        try:
            future.set_result(work(name))
        except BaseException as error:  # noqa: BLE001 - handed to whoever waits for the answer
            future.set_exception(error)

    Thread(target=run, name=f"diagnose {name}").start()
    return future

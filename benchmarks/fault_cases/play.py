"""Plays a case: motion, faults, keys held on, mending, resets, release and a new command."""

from __future__ import annotations

import logging
import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from fault_cases.case import Case, Planned
from fault_cases.kinds import KINDS
from fault_cases.operator import Operator
from fault_cases.world import Sample, Strange, World, opened_world
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.recording.recorder import Recorder
from winchkit.bench.winch import Winch
from winchkit.runs import read_run
from winchkit.runs.recording.open_log import RowLog

_AFTER = 1.1
"""From the last fault until all is mended, s."""
_HELD_ON = 0.5
_RELEASED = 0.95
"""A held command counts as released after 0.8 s."""


@dataclass(frozen=True)
class Forbidden:
    """A condition that forbids motion."""

    kind: str
    time: float
    """When it first did, s."""
    words: str


@dataclass
class Record:
    """What happened, as it is true."""

    case: Case
    begun: float = 0.0
    onsets: list[tuple[Planned, float]] = field(default_factory=list)
    """Faults that came to be, and when, s."""
    unheard: list[Planned] = field(default_factory=list)
    """Foreign frames that the drive did not receive; the host receives them and stops it."""
    frames: list[tuple[tuple[Planned, float], Strange]] = field(default_factory=list)
    """The foreign frame of a fault that is one."""
    recoveries: list[tuple[str, str, float]] = field(default_factory=list)
    """Part, winch and moment of each end of a fault before the mending, s."""
    mended: float = 0.0
    reset: float = math.inf
    """When the first reset that succeeded began, or the last one, s."""
    released: float = 0.0
    pressed: float = 0.0
    ended: float = 0.0
    truth: dict[str, list[Sample]] = field(default_factory=dict)
    tripped_at: float = math.inf
    """When the first trip was shown, s."""
    trips: list[tuple[str, str]] = field(default_factory=list)
    """Kind and words of the trips before the reset, in their order."""
    forbidden: list[Forbidden] = field(default_factory=list)
    """Each kind of condition that forbade motion, when it first did, in that order."""
    refused: list[tuple[float, str]] = field(default_factory=list)
    """When a command was refused before the mending, s, and the words."""
    failure: BaseException | None = None
    early_reset: str = ""
    late_reset: str = ""
    logged_from: float = 0.0
    """Moment of the log's first row, s."""
    log_end: float = 0.0
    """Time of the log's last row, s; NaN where it could not be read."""
    log_error: str = ""
    lengths: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Cable length at the end, by winch: as shown, NaN where it is unknown, and the true one, m."""
    moved_again: bool = False
    """Whether the new command at the end moved a winch."""
    error: str = ""
    """What the harness did not expect."""


def play(case: Case) -> Record:
    """Play a case in a folder of its own."""
    record = Record(case)
    with _no_messages(), tempfile.TemporaryDirectory() as folder:
        try:
            with opened_world(
                case.winches,
                case.seed,
                Path(folder),
                real_time=case.real_time,
                independent=case.independent,
                incremental=case.incremental,
                guarded=case.guarded,
            ) as world:
                _play(world, record)
                record.truth = world.truth
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001 - a case that breaks is reported as one
            known = record.failure is not None and error is record.failure
            record.error = "" if known else f"{type(error).__name__}: {error}"
        _read_log(record, Path(folder))
    return record


@contextmanager
def _no_messages() -> Iterator[None]:
    """Without messages of the libraries, of which faults cause thousands."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _play(world: World, record: Record) -> None:
    case, clock, bench = record.case, world.clock, world.bench
    recorder = bench.log(world.folder / "case.csv")
    bench.on_cycle(partial(_note_trip, record))
    clock.sleep(case.rest)
    record.begun = world.now
    operator = Operator(world, case)
    ends: list[Callable[[], None]] = []
    last = _schedule(world, record, operator, ends)
    clock.sleep(record.begun + last + _AFTER - world.now)
    record.trips = _trips(world)
    if case.resets_early and (record.trips or bench.loop.failure is not None):
        operator.orders = False
        begun = world.now
        record.early_reset = operator.reset()
        record.reset = math.inf if record.early_reset else begun
        clock.sleep(0.3)
    record.trips = record.trips or _trips(world)
    record.mended = world.now
    record.refused = [(moment, str(error)) for moment, error in operator.errors]
    for end in ends:
        end()
    clock.sleep(_HELD_ON)
    record.trips = record.trips or _trips(world)
    operator.orders = False
    record.failure = bench.loop.failure
    record.reset = min(record.reset, world.now)
    if _trips(world) or record.failure is not None:
        record.late_reset = operator.reset()
    clock.sleep(_HELD_ON)
    record.released = world.now
    operator.let_go()
    clock.sleep(_RELEASED)
    record.pressed = world.now
    _press(world, case)
    record.ended = world.now
    record.lengths = _lengths(world)
    record.logged_from = _first_row(recorder)
    try:
        recorder.close()
    except Exception as error:  # noqa: BLE001 - a full disk is reported here
        record.log_error = str(error)
    world.sample()
    for onset, frame in record.frames:
        if frame.heard is False:
            record.unheard.append(onset[0])
    record.moved_again = any(
        abs(sample.velocity) > 0.5
        for samples in world.truth.values()
        for sample in samples
        if sample.time > record.pressed
    )


def _schedule(
    world: World, record: Record, operator: Operator, ends: list[Callable[[], None]]
) -> float:
    """Let the faults come at their times; the last of these, s."""

    def begin(fault: Planned) -> None:
        onset = (fault, world.now)
        record.onsets.append(onset)
        if fault.kind == "released":
            operator.holds = False
            return
        sent = len(world.strange)
        end = KINDS[fault.kind].begin(world, fault.winch)
        record.frames += [(onset, frame) for frame in world.strange[sent:]]
        if end is None:
            return
        if fault.span is None:
            ends.append(end)
        else:
            world.call_at(world.now + fault.span, partial(finish, fault, end))

    def finish(fault: Planned, end: Callable[[], None]) -> None:
        end()
        record.recoveries.append((KINDS[fault.kind].part, fault.winch, world.now))

    for fault in record.case.faults:
        world.call_at(record.begun + fault.at, lambda fault=fault: begin(fault))  # type: ignore[misc]
    return max(fault.at + (fault.span or 0.0) for fault in record.case.faults)


def _note_trip(record: Record, snapshot: BenchSnapshot) -> None:
    if snapshot.tripped and not math.isfinite(record.tripped_at):
        record.tripped_at = snapshot.time
    for one in snapshot.blocked:
        if all(one.kind != before.kind for before in record.forbidden):
            record.forbidden.append(Forbidden(one.kind, snapshot.time, str(one)))


def _press(world: World, case: Case) -> None:
    """A new command, as a person gives one after a reset."""
    end = world.now + 0.4
    winches = world.bench.winch.values()
    way = "wind_in" if case.paying_out else "pay_out"
    orders = [partial(winch.jog, **{way: _speed(winch)}) for winch in winches]
    while world.now < end:
        for order in orders:
            with suppress(Exception):  # judged by what moves
                order()
        orders = [winch.refresh for winch in winches]
        world.clock.sleep(0.05)
    world.clock.sleep(0.4)


def _speed(winch: Winch) -> float:
    """Of a new command, m/s: while the cable length is unknown it is slow."""
    return 0.1 if winch.snapshot.length_known else winch.wiring.limits.speed_unhomed


def _lengths(world: World) -> dict[str, tuple[float, float]]:
    with world.live.up_to_date():
        plants = {name: one.plant for name, one in world.live.winches.items()}
        return {
            name: (world.bench.snapshot.winch[name].cable_length, plant.cable_length)
            for name, plant in plants.items()
        }


def _first_row(recorder: Recorder) -> float:
    """When the first row of a log of rows was sampled, s: from there its time counts."""
    log = recorder._log
    assert isinstance(log, RowLog), "a case is logged as rows"
    return math.nan if log._aligner.start is None else log._aligner.start


def _trips(world: World) -> list[tuple[str, str]]:
    return [(trip.kind, str(trip)) for trip in world.bench.snapshot.tripped]


def _read_log(record: Record, folder: Path) -> None:
    try:
        run = read_run(folder / "case.csv")
        record.log_end = record.logged_from + float(run.time[-1])
    except Exception as error:  # noqa: BLE001 - counted as a log that is not whole
        record.log_error = record.log_error or f"{type(error).__name__}: {error}"
        record.log_end = float("nan")

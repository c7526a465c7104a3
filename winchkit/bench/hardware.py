"""Turns a bench file into open buses, commissioned drives, polled sensors and a control loop."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from datetime import UTC, datetime

from winchkit import catalog
from winchkit.bench.cells.instruments import can_buses, device_of, instruments
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.controller import Controller
from winchkit.bench.control.frozen_cell import FrozenCell, PredictedTension
from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.observation import Supervised
from winchkit.bench.control.snapshot import Direction, Phase, Trip
from winchkit.bench.control.supervisor import Supervisor
from winchkit.bench.control.winch_state import WinchParts
from winchkit.bench.drives.set_up_progress import SetUpProgress, Tell, tell_hardware, to_stderr
from winchkit.bench.records.latch import LatchFile
from winchkit.bench.records.position_file import PositionFile
from winchkit.bench.robot import WiredRobot, robot_of_bench
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.limits import LimitsAtShaft
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.instrument_process.process import InstrumentProcess
from winchkit.drivers.reading import Sensor
from winchkit.drivers.slow import SlowDevices, SlowLine
from winchkit.errors import ConnectionLost, Fault, FileError
from winchkit.schema.bench import BenchSpec, LimitSpec, WinchWiring
from winchkit.schema.bench_warnings import bench_warnings
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.units import GRAVITY
from winchkit.version import __version__

_STALE_BEATS = 2
"""Feedback may be this many heartbeats old: the bench file says how soon silence must count."""
_LEAST_GAP = 6
"""Cycles that may be late in any case: with a slow cycle two heartbeats are too short."""
_FURTHER = 0.02
"""Of cable, by which the drive's own length limits lie beyond the bench's, m."""
_FELT = 0.02
"""Cable speed at which the counts of a good cell cannot stand still, m/s."""
_FASTEST = 1.5
"""Motor speed over that of ``limits.speed`` at which a drive may be missed turning."""
_HEADROOM = 4.0
"""Of a drive's own ramps in a profile mode over those that the host makes."""
_QUICK = 2.0
"""Of a quick stop over the winch's own ramp: it ends sooner; at 2 m/s² 10 kg add 20 N."""
_PLAY = 2e-3
"""Of cable, by which a winch at rest moves between two processes, m: play of the brake."""
_ELASTIC = 0.05
"""Of cable, m: elongation and temperature by which a length may be beyond what the drum holds."""


@dataclass(frozen=True)
class Wired:
    """Hardware of an open bench."""

    loop: ControlLoop
    axes: Mapping[str, Cia402Axis]
    buses: Mapping[str, CanBus]
    sensors: Mapping[str, Mapping[str, Sensor]]
    lines: Sequence[SlowLine]
    slow: SlowDevices
    metadata: Mapping[str, str]
    robot: WiredRobot | None = None
    """The robot that the winches move."""
    process: InstrumentProcess | None = None
    """The process that serves the lines that are not CAN; None where threads of this one do."""

    @property
    def companions(self) -> tuple[int, ...]:
        """Numbers of the processes that belong to this one."""
        pid = None if self.process is None else self.process.pid
        return () if pid is None else (pid,)

    def disarm(self) -> None:
        """Switch off the host watchdog of drives at rest; that of any other stops it."""
        for name, axis in self.axes.items():
            if self.loop.winches[name].controller.phase is Phase.DISABLED:
                with suppress(ConnectionLost):
                    axis.host.disarm()


def wire(
    spec: BenchSpec,
    clock: Clock,
    stack: ExitStack,
    latch: LatchFile,
    positions: PositionFile,
    *,
    separate: bool = False,
    tell: Tell = to_stderr,
) -> Wired:
    """Open all buses and lines; ``separate``: a process of its own for those that are not CAN."""
    from winchkit.effects import load_catalogue, terms_of
    from winchkit.estimation.cable_state import CableEstimator

    profiles = {name: _profile(spec, winch) for name, winch in spec.winch.items()}
    robot = robot_of_bench(spec)
    if robot is not None:
        profiles |= robot.profiles
    catalogue = load_catalogue(spec.effect_files)
    cables = {
        name: CableMap.of(
            CableEstimator(profile, terms_of(profile, catalogue), _weight(spec.winch[name]))
        )
        for name, profile in profiles.items()
    }
    buses = _open_buses(spec, clock, stack)
    axes = {
        name: _axis(spec, winch, cables[name], buses, clock) for name, winch in spec.winch.items()
    }
    moving = {name: _moving(axes[name], cables[name]) for name in spec.winch}
    process = _instrument_process(clock, stack) if separate else None
    sensors, lines = instruments(spec, clock, buses, moving, process)
    if process is not None:
        process.start()
    slow = SlowDevices(lines, clock)
    stack.callback(slow.close)
    for name, axis in axes.items():
        axis.position.recall(positions.found.get(name))
    _commission(axes, clock, tell)
    tell_hardware(spec)
    _tell_notes(spec, axes, buses)
    winches = _winches(spec, axes, cables, sensors, profiles)
    stale = max(_STALE_BEATS * spec.bus[name].heartbeat for name in buses)
    supervisor = _supervisor(spec, stale, axes, cables, profiles)
    hosts = [(bus, spec.bus[name].node, spec.bus[name].heartbeat) for name, bus in buses.items()]
    loop = ControlLoop(
        hosts,
        winches,
        supervisor,
        clock,
        spec.cycle,
        stop_together=spec.stop_together,
        latch=latch,
        positions=positions,
        longest_gap=max(stale, _LEAST_GAP * spec.cycle),
    )
    _warn_of_sync(buses, loop)
    if process is not None:
        process.await_start()
    return Wired(loop, axes, buses, sensors, lines, slow, _metadata(spec, profiles), robot, process)


def _instrument_process(clock: Clock, stack: ExitStack) -> InstrumentProcess | None:
    """The process for slow instruments; None where it would have another clock."""
    if not isinstance(clock, MonotonicClock):
        return None
    process = InstrumentProcess(clock)
    stack.callback(process.close)
    return process


def _supervisor(
    spec: BenchSpec,
    stale: float,
    axes: Mapping[str, Cia402Axis],
    cables: Mapping[str, CableMap],
    profiles: Mapping[str, WinchProfile],
) -> Supervisor:
    """What holds each winch to its limits; feedback counts as stale after ``stale`` s."""
    return Supervisor(
        {
            name: Supervised(
                winch.limits,
                stale,
                spec.cycle,
                _resolution(axes[name], cables[name]),
                _safe_length(profiles[name]),
            )
            for name, winch in spec.winch.items()
        }
    )


def _winches(
    spec: BenchSpec,
    axes: Mapping[str, Cia402Axis],
    cables: Mapping[str, CableMap],
    sensors: Mapping[str, Mapping[str, Sensor]],
    profiles: Mapping[str, WinchProfile],
) -> dict[str, WinchParts]:
    """Each winch as the loop sees it."""
    return {
        name: WinchParts(
            axes[name],
            cables[name],
            Controller(axes[name], cables[name], winch.limits),
            sensors[name],
            _frozen_cell(spec, winch),
            PredictedTension(math.nan if winch.load_mass is None else winch.load_mass),
            cable_spec=profiles[name].cable,
            capacity=_capacity(profiles[name]),
        )
        for name, winch in spec.winch.items()
    }


def _resolution(axis: Cia402Axis, cable: CableMap) -> float:
    """Of the measured cable speed, m/s: one count of 606Ch."""
    return 0.0 if axis.drive is None else abs(axis.drive.scale.velocity * cable.arm(0.0))


def _safe_length(profile: WinchProfile) -> float:
    """Cable length (m) that leaves the last dead wraps on the drum, where the profile has it."""
    from winchkit.model.capacity import safe_lengths

    longest = safe_lengths(profile)[1] if profile.reference.wound_turns else math.inf
    return longest if math.isfinite(longest) else math.inf


def _capacity(profile: WinchProfile) -> tuple[float, float]:
    """Least and greatest cable length (m) that the drum can have paid out, by the profile."""
    from winchkit.model.capacity import length_at

    whole = length_at(profile, 0.0) if profile.reference.wound_turns else math.nan
    if not math.isfinite(whole):
        return -math.inf, math.inf
    return -_ELASTIC, whole + _ELASTIC


def _commission(axes: Mapping[str, Cia402Axis], clock: Clock, tell: Tell) -> None:
    """Set every drive up; undo what some did while the host was silent to all, to prove one."""
    progress = SetUpProgress(clock, len(axes), tell)
    for name, axis in axes.items():
        progress.set_up(name, axis)
    if any(axis.host.disturbs for axis in axes.values()):
        for axis in axes.values():
            axis.host.settle()


def _warn_of_sync(buses: Mapping[str, CanBus], loop: ControlLoop) -> None:
    """Show as a warning, until the next reset, that another node sends SYNC."""
    for bus in buses.values():
        bus.on_foreign_sync = lambda words: loop.warn(Trip("sync", "", words, Direction.NONE))


def _tell_notes(
    spec: BenchSpec, axes: Mapping[str, Cia402Axis], buses: Mapping[str, CanBus]
) -> None:
    """Report missing limits, changes in the drives, and other senders of SYNC."""
    notes = [f"{'.'.join(key)}: {message} (warning)" for key, message in bench_warnings(spec)]
    notes += [note for axis in axes.values() if axis.drive for note in axis.drive.notes]
    notes += [note for bus in buses.values() if (note := bus.foreign_sync)]
    for note in notes:
        to_stderr(note)


def _weight(winch: WinchWiring) -> float | None:
    """Of the load that the bench file declares, N."""
    return None if winch.load_mass is None else winch.load_mass * GRAVITY


def _frozen_cell(spec: BenchSpec, winch: WinchWiring) -> FrozenCell | None:
    """The test of a winch's load cell, with the numbers of its device file."""
    if winch.cell is None:
        return None
    device = device_of(spec, winch.cell)
    table = device.instrument
    return None if table is None else FrozenCell(table.rate, correlation=table.filter_delay)


def _moving(axis: Cia402Axis, cable: CableMap) -> Callable[[], bool]:
    """Whether a winch moves fast enough for its cells to feel it."""

    def moves() -> bool:
        feedback = axis.feedback
        if feedback is None:
            return False
        return abs(feedback.velocity * cable.arm(feedback.angle)) > _FELT

    return moves


def _profile(spec: BenchSpec, winch: WinchWiring) -> WinchProfile:
    from winchkit.schema.read import read_winch

    return read_winch(catalog.find("profiles", winch.profile, spec.path or None))


def _open_buses(spec: BenchSpec, clock: Clock, stack: ExitStack) -> dict[str, CanBus]:
    """Every CAN bus that a servo or an instrument is on."""
    buses: dict[str, CanBus] = {}
    servos = dict.fromkeys(winch.servo.bus for winch in spec.winch.values())
    for name in servos:
        if spec.bus[name].kind != "can":
            raise FileError(Fault(f"servos need a CAN bus; '{name}' is none", spec.path))
    for name in servos | dict.fromkeys(can_buses(spec)):
        buses[name] = CanBus(spec.bus[name], name, clock)
        stack.callback(buses[name].close)
    return buses


def _axis(
    spec: BenchSpec,
    winch: WinchWiring,
    cable: CableMap,
    buses: Mapping[str, CanBus],
    clock: Clock,
) -> Cia402Axis:
    ref = winch.servo
    bus = spec.bus[ref.bus]
    if ref.node is None:
        raise FileError(Fault(f"servo '{ref.device}' needs its node number", spec.path))
    arm = abs(cable.arm(0.0))
    acceleration = _HEADROOM * winch.limits.acceleration / arm
    declared = (spec.robot and spec.robot.quick_stop) or winch.limits.quick_stop
    quick = declared or _QUICK * winch.limits.acceleration
    watch = WatchSpec(
        bus.node,
        bus.heartbeat,
        spec.cycle,
        winch.brake,
        acceleration,
        quick_stop=quick / arm,
        quick_stop_declared=declared is not None,
        limits=_at_shaft(cable, winch.limits),
        speed=_FASTEST * winch.limits.speed / arm,
        response=winch.limits.response_time,
        late=winch.limits.acceleration * winch.limits.response_time**2 / 2 / arm,
        play=_PLAY / arm,
        options=winch.options,
        hardware=winch.host_loss_description if winch.host_loss else "",
    )
    return Cia402Axis(buses[ref.bus], ref.node, device_of(spec, ref), watch, clock)


def _at_shaft(cable: CableMap, limits: LimitSpec) -> LimitsAtShaft:
    """Limits for the drive itself, where the bench file declares them."""
    angle = None
    if limits.in_drive and limits.length is not None:
        low, high = limits.length
        ends = (max(0.0, low - _FURTHER), high + _FURTHER)
        first, second = sorted(map(cable.motor_angle, ends))
        angle = (first, second)
    error = limits.following_error
    following = None if error is None else error / abs(cable.arm(0.0))
    return LimitsAtShaft(angle=angle, following_error=following, torque=limits.torque)


def _metadata(spec: BenchSpec, profiles: Mapping[str, WinchProfile]) -> dict[str, str]:
    """Origin of a log, for its metadata."""
    about = {
        "bench": spec.name,
        "recorded": datetime.now(UTC).isoformat(timespec="seconds"),
        "winchkit": __version__,
        "wiring": json.dumps(dataclasses.asdict(spec), default=str),
        "profile": ", ".join(item.name for item in profiles.values()),
        "declared": json.dumps(
            {name: dataclasses.asdict(item) for name, item in profiles.items()}, default=str
        ),
    }
    about |= {
        f"host_loss.{name}": f"hardware: {winch.host_loss_description}"
        for name, winch in spec.winch.items()
        if winch.host_loss
    }
    masses = {winch.load_mass for winch in spec.winch.values()}
    if len(spec.winch) == 1 and None not in masses:
        about["load_mass"] = f"{masses.pop():g} kg"
    return about

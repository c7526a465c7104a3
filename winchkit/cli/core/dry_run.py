"""``--dry-run``: the frames that a command would send, in words; nothing reaches a real bus.

Commands that move are rehearsed on simulated drives with the bench's own wiring, in this process;
commands that only write name their frames without any drive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.output import echo_json, is_json
from winchkit.schema.programme import ALL

if TYPE_CHECKING:
    from winchkit.bench.remote.operations import Station
    from winchkit.drivers.can.tools.decode import DecodedFrame, KnownNode
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.sim_platform import PlatformTruth
    from winchkit.schema.simbench import SimBench
    from winchkit.sim.live.buses import Carried

_CYCLIC = ("SYNC", "RPDO", "heartbeat")
_CONTROL_WORD = "6040h"
_READINGS = 0.5
"""Time in which the cells and the tracker of a rehearsal have shown something, s."""
_NOISE = 0.1
"""Of the cells of a rehearsal, N: one without noise counts as frozen."""


@dataclass(frozen=True)
class PlannedFrame:
    """A frame that would be sent."""

    time: float
    """Since the first, s."""
    bus: str
    identifier: int
    data: bytes


@contextmanager
def station_for(
    bench: str,
    *,
    client: str,
    dry_run: bool,
    effects: Sequence[str] = (),
    winch: str | None = ALL,
    tension: float | None = None,
    platform: bool = False,
) -> Iterator[Station]:
    """A station at the bench or, for a dry run, at a rehearsal whose frames are then shown.

    ``client`` is the command's name, as other clients of the bench see it. A ``winch`` that the
    bench lacks is refused before anything is opened. A rehearsal has cells, in place of none, where
    a load of a ``tension`` (N) hangs on each cable, or its robot's ``platform`` on all.
    """
    from winchkit.bench.remote.session import at_station
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    if winch != ALL:
        spec.winch_named(winch)
    if not dry_run:
        with at_station(spec, effects, client=client) as station:
            yield station
        return
    spec = spec.with_effects(effects)
    frames: list[PlannedFrame] = []
    with _rehearsal(spec, frames, tension, platform=platform) as station:
        yield station
    show_frames(frames, nodes_of(spec))


def nodes_of(spec: BenchSpec) -> dict[str, dict[int, KnownNode]]:
    """The drives of a bench as their device files declare them, by bus and node."""
    from winchkit.bench.cells.instruments import device_of
    from winchkit.drivers.can.tools.decode import KnownNode, known_node

    nodes: dict[str, dict[int, KnownNode]] = {
        name: {bus.node: KnownNode("host")} for name, bus in spec.bus.items() if bus.kind == "can"
    }
    for name, winch in spec.winch.items():
        ref = winch.servo
        node = ref.node or 1
        nodes[ref.bus][node] = known_node(f"winch {name}", device_of(spec, ref), node)
    return nodes


def writes(bus: str, node: int, values: Iterable[tuple[int, int, bytes]]) -> list[PlannedFrame]:
    """Frames that write objects (index, sub-index, bytes) by SDO, one after another."""
    from winchkit.drivers.can.tools.decode import write_frames

    return [
        PlannedFrame(0.0, bus, identifier, data)
        for index, sub, value in values
        for identifier, data in write_frames(node, index, sub, value)
    ]


def show_frames(
    frames: Sequence[PlannedFrame], nodes: Mapping[str, Mapping[int, KnownNode]]
) -> None:
    """Print frames in words; as JSON all of them, else cyclic ones where they change."""
    from winchkit.drivers.can.tools.decode import decode

    decoded = [
        (frame, decode(frame.identifier, frame.data, nodes.get(frame.bus, {}))) for frame in frames
    ]
    if is_json():
        listed = [
            {
                "time": frame.time,
                "bus": frame.bus,
                "id": frame.identifier,
                "data": frame.data.hex(),
                **vars(words),
            }
            for frame, words in decoded
        ]
        echo_json({"schema": 1, "dry_run": True, "frames": listed})
        return
    for line in _digest(decoded):
        click.echo(line)
    click.echo("dry run: nothing was sent", err=True)


def _digest(decoded: Sequence[tuple[PlannedFrame, DecodedFrame]]) -> Iterator[str]:
    """A line for each frame; cyclic ones between changes of a control word are summed up."""
    words: dict[tuple[str, int], float | None] = {}
    quiet: list[DecodedFrame] = []
    for frame, item in decoded:
        key = (frame.bus, frame.identifier)
        control = item.values.get(_CONTROL_WORD)
        if item.kind in _CYCLIC and key in words and words[key] == control:
            quiet.append(item)
            continue
        words[key] = control
        yield from _summed(quiet)
        quiet.clear()
        data = frame.data.hex(" ").upper()
        yield f"{frame.time:9.3f} s  {frame.bus} {frame.identifier:03X} [{data}]  {item.text}"
    yield from _summed(quiet)


def _summed(items: Sequence[DecodedFrame]) -> Iterator[str]:
    """How many frames there were, and between which values their targets lay."""
    if not items:
        return
    counts = {kind: sum(item.kind == kind for item in items) for kind in _CYCLIC}
    parts = [f"{count} × {kind}" for kind, count in counts.items() if count]
    ranges: dict[tuple[int, str], list[float]] = {}
    for item in items:
        for name, value in item.values.items():
            ranges.setdefault((item.node, name), []).append(value)
    parts += [
        f"node {node} {name} {min(values)} … {max(values)}"
        for (node, name), values in ranges.items()
        if name != _CONTROL_WORD and min(values) != max(values)
    ]
    yield f"           …  {', '.join(parts)}"


@contextmanager
def _rehearsal(
    spec: BenchSpec, frames: list[PlannedFrame], tension: float | None, *, platform: bool
) -> Iterator[Station]:
    """The bench with simulated drives, in simulated time; frames of the host are collected."""
    from winchkit.bench.open import open_bench
    from winchkit.bench.remote.station import LocalStation
    from winchkit.bench.robot import no_robot, robot_of_bench
    from winchkit.sim.clock.simulated_clock import SimulatedClock
    from winchkit.sim.live.bench import LiveBench
    from winchkit.units import GRAVITY

    click.echo(
        "dry run on simulated drives, each cable at its reference length; nothing is sent", err=True
    )
    clock, robot = SimulatedClock(), robot_of_bench(spec)
    mass = None if tension is None else tension / GRAVITY
    profiles, body = None, None
    if platform:
        if robot is None:
            raise no_robot(spec)
        body = robot.truth
    elif robot is not None:
        profiles = robot.profiles
        mass = mass or robot.mass / len(profiles)
    simulated = _simulated(spec, mass, body, cells=platform or tension is not None)
    with LiveBench(simulated, profiles=profiles, simulated_time=clock) as live:
        for name, wire in live.wire.items():
            wire.taps.append(_tap(name, clock.now(), frames))
        with open_bench(live.bench_spec, clock) as bench:
            station = LocalStation(bench)
            clock.sleep(_READINGS if simulated.platform or tension else 0.0)
            yield station
            station.close()


def _tap(bus: str, start: float, frames: list[PlannedFrame]) -> Callable[[Carried], None]:
    """Collects the frames of the host on one bus, with times since ``start``."""

    def take(carried: Carried) -> None:
        if not carried.from_drive:
            time = carried.time - start
            frames.append(PlannedFrame(time, bus, carried.identifier, carried.data))

    return take


def _simulated(
    spec: BenchSpec,
    mass: float | None,
    body: PlatformTruth | None = None,
    *,
    cells: bool = False,
) -> SimBench:
    """The bench as it is wired; ``mass`` (kg) of winches without one, with ``cells`` on all."""
    from winchkit.schema.simbench import NoiseSpec, SimBench, WinchTruth

    winches = {
        name: replace(
            winch,
            cell=winch.cell if cells else None,
            load=winch.load if cells else None,
            length=None,
            temperature=None,
        )
        for name, winch in spec.winch.items()
    }
    used = {ref.bus for winch in winches.values() for ref in (winch.cell, winch.load) if ref}
    buses = {name: bus for name, bus in spec.bus.items() if bus.kind == "can" or name in used}
    hanging = {
        name: mass if cells or one.load_mass is None else one.load_mass
        for name, one in winches.items()
    }
    truth = {
        name: WinchTruth() if load is None else WinchTruth(load_mass=load)
        for name, load in hanging.items()
    }
    bench = replace(spec, winch=winches, bus=buses, latch_file="")
    noise = NoiseSpec(tension=_NOISE) if cells else NoiseSpec()
    return SimBench(spec.name, bench, truth, noise, (), platform=body)

"""Execution of a programme on simulated winches without buses, faster than real time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import ceil
from typing import TYPE_CHECKING

from winchkit.arguments import require_mapping, require_type
from winchkit.errors import UsageError
from winchkit.schema.bench import WinchWiring
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.programme import Programme
from winchkit.schema.simbench import SimBench, WinchTruth
from winchkit.sim.plant.kinematics import Kinematics
from winchkit.sim.plant.plant import MAX_STEP, WinchPlant
from winchkit.sim.plant.sensors import Measurement
from winchkit.sim.plant.servo import DriveCommand
from winchkit.sim.schedule import RunPlan, schedule

if TYPE_CHECKING:
    from winchkit.runs.run import Run

Row = tuple[float, dict[str, Measurement]]

_UNITS = {
    "motor_angle": "rad",
    "motor_velocity": "rad/s",
    "motor_torque": "N m",
    "tension": "N",
    "load": "N",
    "cable_length": "m",
    "temperature": "degC",
}
_SWITCH_ON = 0.02
"""Hold of the drive before the first sample, s."""


def simulate(
    bench: SimBench,
    profiles: Mapping[str, WinchProfile],
    programme: Programme,
    *,
    seed: int = 0,
    rate: float = 50.0,
) -> Iterator[Run]:
    """Simulate a programme.

    Parameters
    ----------
    bench : SimBench
        The simulated bench.
    profiles : mapping
        Declared profiles by winch.
    programme : Programme
        The motion programme.
    seed : int
        Seed of the noise; the same arguments give the same runs.
    rate : float
        Sampling rate, Hz.

    Yields
    ------
    Run
        One per repeat and load. Each starts at rest with new noise and with all effects with memory
        at their null; only the temperature continues from run to run.

    Raises
    ------
    UsageError
        For an impossible rate, and for a robot.
    FileError
        For a programme that does not match the bench.
    """
    require_type(bench, SimBench, "bench")
    require_mapping(profiles, "profiles", "profiles by winch")
    require_type(programme, Programme, "programme")
    if bench.platform is not None:
        raise UsageError(
            f"{bench.name} is a robot, whose winches move one platform, and '{programme.name}' "
            "moves each winch alone; give a robot programme (docs/howto/robot-motion.md)"
        )
    if not 0 < rate <= 1 / MAX_STEP:
        raise UsageError(f"rate {rate:g} Hz must be above 0 and at most {1 / MAX_STEP:g} Hz")
    wiring = bench.bench.winch
    plans = schedule(
        programme,
        {name: winch.limits for name, winch in wiring.items()},
        {name: Kinematics.of(profiles[name]).length_reference for name in wiring},
        {name: bench.truth[name].load_mass for name in wiring},
    )
    seen: Counter[str] = Counter()
    for index, run_plan in enumerate(plans):
        label = "-".join(f"{mass:g}kg" for mass in dict.fromkeys(run_plan.load_mass.values()))
        seen[label] += 1
        name = f"{programme.name}-{label}-{seen[label]}"
        own_seed = f"{seed}/{programme.name}/{index}"
        rows = _Recording(bench, profiles, run_plan, own_seed, rate).rows()
        yield _as_run(name, rows, bench, programme, run_plan)


class _Recording:
    """One run in progress: a plant per winch, integrated together."""

    def __init__(
        self,
        bench: SimBench,
        profiles: Mapping[str, WinchProfile],
        run_plan: RunPlan,
        seed: str,
        rate: float,
    ) -> None:
        self._plan = run_plan
        self._rate = rate
        self._chains = {name: Kinematics.of(profiles[name]) for name in bench.bench.winch}
        self._plants = {
            name: WinchPlant(
                profiles[name],
                _truth_of_run(bench.truth[name], run_plan, name),
                seed=f"{seed}/{name}",
                noise=bench.noise,
                cable_length=run_plan.start[name],
            )
            for name in bench.bench.winch
        }

    def rows(self) -> list[Row]:
        """Time and readings of every winch, by row."""
        length = dict(self._plan.start)
        for name, plant in self._plants.items():
            plant.advance(_SWITCH_ON, self._command(name, length[name], 0.0))
        rows = [self._row(0.0)]
        leg_start, legs = 0.0, list(self._plan.legs)
        substeps = ceil(1 / self._rate / MAX_STEP - 1e-9)
        dt = 1 / self._rate / substeps
        for tick in range(1, int(self._plan.duration * self._rate + 1e-9) * substeps + 1):
            time = tick * dt
            while len(legs) > 1 and time - leg_start >= legs[0].duration:
                done = legs.pop(0)
                leg_start += done.duration
                for name, move in done.moves.items():
                    length[name] += move.distance
            for name, plant in self._plants.items():
                move_now = legs[0].moves.get(name)
                gone, speed = move_now.at(time - leg_start) if move_now else (0.0, 0.0)
                plant.advance(dt, self._command(name, length[name] + gone, speed))
            if tick % substeps == 0:
                rows.append(self._row(time))
        return rows

    def _command(self, name: str, length: float, speed: float) -> DriveCommand:
        """Command at which the declared winch has the cable length ``length``."""
        chain = self._chains[name]
        angle = chain.motor_angle(length)
        return DriveCommand(angle=angle, speed=-speed / chain.arm(angle))

    def _row(self, time: float) -> Row:
        return time, {name: plant.measure() for name, plant in self._plants.items()}


def _truth_of_run(truth: WinchTruth, run_plan: RunPlan, winch: str) -> WinchTruth:
    """True values with the run's load and the temperature at its start."""
    begun = run_plan.temperature.get(winch, truth.temperature)
    warmer = truth.temperature_drift * (run_plan.elapsed - run_plan.warmed) / 3600
    return replace(truth, load_mass=run_plan.load_mass[winch], temperature=begun + warmer)


def _as_run(
    name: str, rows: Sequence[Row], bench: SimBench, programme: Programme, run_plan: RunPlan
) -> Run:
    """Columns of the bench's instruments, with the metadata of the run."""
    import numpy as np

    from winchkit.runs.run import Channel, Run

    wiring = bench.bench.winch
    channels = {}
    for winch, wired in wiring.items():
        prefix = "" if len(wiring) == 1 else f"{winch}."
        for signal in _signals(wired):
            values = np.array([getattr(readings[winch], signal) for _, readings in rows])
            channels[prefix + signal] = Channel(values, _UNITS[signal])
    time = np.array([time for time, _ in rows])
    return Run(name, time, channels, _metadata(bench, programme, run_plan))


def _signals(wired: WinchWiring) -> list[str]:
    signals = ["motor_angle", "motor_velocity", "motor_torque"]
    for signal, device in (
        ("tension", wired.cell),
        ("load", wired.load),
        ("cable_length", wired.length),
        ("temperature", wired.temperature),
    ):
        if device is not None:
            signals.append(signal)
    return signals


def _metadata(bench: SimBench, programme: Programme, run_plan: RunPlan) -> dict[str, str]:
    """Metadata of a recorder on the real bench, without the true values."""
    wiring = bench.bench.winch
    metadata = {"bench": bench.name, "programme": programme.name}
    if len(wiring) == 1:
        ((winch, wired),) = wiring.items()
        metadata |= {"winch": winch, "profile": wired.profile}
    for winch, wired in wiring.items():
        prefix = "" if len(wiring) == 1 else f"{winch}."
        if wired.load is None:
            metadata[f"{prefix}load_mass"] = f"{run_plan.load_mass[winch]:g} kg"
    masses = set(run_plan.load_mass.values())
    if len(masses) == 1 and all(wired.load is None for wired in wiring.values()):
        metadata["load_mass"] = f"{masses.pop():g} kg"
    return metadata

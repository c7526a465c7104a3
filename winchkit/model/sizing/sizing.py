"""Sizing of a winch by the winding-device paper: every requirement with its value and its limit.

for row in sized(read_size("winding-device.toml")):
    print(row.name, row.value, row.relation, row.limit, row.ok)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from winchkit.arguments import require_type
from winchkit.model.gearbox import worm_stage
from winchkit.model.sizing import parts
from winchkit.model.sizing.guide import guide_rows
from winchkit.model.sizing.row import Row, down, up
from winchkit.schema.profiles.sizing import SizeSpec


@dataclass(frozen=True)
class _Drive:
    """Requirements at the motor from those at the cable."""

    efficiency: float
    power: float
    """At the motor, W."""
    torque: float
    """At the motor with all cable on the drum, N m."""
    speed: float
    """Of the motor with the drum empty, rad/s."""
    radius: float
    """Largest winding radius, m."""


def sized(spec: SizeSpec) -> list[Row]:
    """Every requirement, in the order of the paper's chain; SI.

    Parameters
    ----------
    spec : SizeSpec
        Requirements and chosen parts.

    Returns
    -------
    list of Row
        Rows with value, limit and alternatives.
    """
    require_type(spec, SizeSpec, "spec")
    drive = _drive(spec)
    rows = [*_motor_rows(spec, drive), *_gearbox_rows(spec), *_drum_rows(spec)]
    return [*rows, *guide_rows(spec)]


def _drive(spec: SizeSpec) -> _Drive:
    loss, need, drum = spec.efficiency, spec.requirement, spec.drum
    efficiency = parts.transmission_efficiency(
        loss.gearbox, loss.belt, loss.belts, loss.bearing, loss.bearings
    )
    radius = drum.winding_radius if drum.full_radius is None else drum.full_radius
    ratio = spec.gearbox.ratio
    return _Drive(
        efficiency,
        parts.motor_power(need.force, need.speed, efficiency),
        parts.motor_torque(need.force, radius, ratio, efficiency),
        parts.motor_speed(need.speed, drum.winding_radius, ratio),
        radius,
    )


def _motor_rows(spec: SizeSpec, drive: _Drive) -> Iterator[Row]:
    motor = spec.motor
    yield Row("transmission efficiency", "Eq. 10", drive.efficiency, "1")
    power = drive.power * motor.margin
    yield Row.at_most("motor power", "Eq. 11", power, motor.power, "W", f"a motor of {up(power)} W")
    torque, rated = drive.torque * motor.margin, motor.rated_torque
    options = _less_torque(spec, drive) if torque > rated else ()
    yield Row.at_most("motor torque", "Eq. 13", torque, rated, "N m", *options)
    options = _slower(spec) if drive.speed > motor.speed else ()
    yield Row.at_most("motor speed", "Eq. 13", drive.speed, motor.speed, "rad/s", *options)


def _ratio_limits(spec: SizeSpec) -> tuple[float, float]:
    """Lowest gear ratio by the torque and highest by the speed."""
    drive, ratio = _drive(spec), spec.gearbox.ratio
    lowest = ratio * drive.torque * spec.motor.margin / spec.motor.rated_torque
    return lowest, ratio * spec.motor.speed / drive.speed


def _less_torque(spec: SizeSpec, drive: _Drive) -> tuple[str, ...]:
    """Single changes that bring the torque below its limit."""
    share = spec.motor.rated_torque / (drive.torque * spec.motor.margin)
    return (
        *_other_ratio(spec),
        f"a motor of {up(drive.torque * spec.motor.margin)} N m at this ratio",
        f"a cable force of at most {down(spec.requirement.force * share)} N",
        f"a winding radius of at most {down(drive.radius * share * 1e3)} mm",
    )


def _slower(spec: SizeSpec) -> tuple[str, ...]:
    speed = spec.motor.speed * spec.drum.winding_radius / spec.gearbox.ratio
    return (*_other_ratio(spec), f"a cable speed of at most {down(speed)} m/s")


def _other_ratio(spec: SizeSpec) -> tuple[str, ...]:
    lowest, highest = _ratio_limits(spec)
    if lowest > highest:
        return ("no gear ratio gives both the torque and the speed: take a stronger motor",)
    fit = [ratio for ratio in spec.gearbox.offered if lowest <= ratio <= highest]
    offered = f"; offered: {', '.join(f'{ratio:g}' for ratio in fit)}" if fit else ""
    ratios = f"a gear ratio from {up(lowest, 3)} to {down(highest, 3)}"
    # The efficiency of a worm falls as its ratio grows.
    return (f"{ratios} of the same efficiency{offered}",)


def _gearbox_rows(spec: SizeSpec) -> Iterator[Row]:
    gear = spec.gearbox
    if gear.worm is None:
        yield Row("gear ratio", "Eq. 14", gear.ratio, "1")
        return
    teeth = gear.ratio * gear.worm.starts
    stage = worm_stage(
        gear.worm.starts, max(1, round(teeth)), gear.worm.lead_angle, gear.worm.friction
    )
    yield Row.equal(
        "gear ratio",
        "Eq. 14",
        gear.ratio,
        stage.ratio,
        "1",
        f"a wheel of a whole number of teeth: {stage.ratio:g}",
    )
    holds: Literal["locks", "turns back"] = "locks" if stage.self_locking else "turns back"
    yield Row("worm efficiency", "", stage.efficiency, "1", note=holds)
    yield Row("worm efficiency backwards", "", stage.backward, "1", note=holds)


def _drum_rows(spec: SizeSpec) -> Iterator[Row]:
    drum, need = spec.drum, spec.requirement
    turns = parts.drum_turns(need.cable_length, drum.winding_radius, drum.groove_pitch)
    turns += drum.dead_wraps
    width = turns * drum.groove_pitch
    room = (drum.width / drum.groove_pitch - drum.dead_wraps) / (turns - drum.dead_wraps)
    options: tuple[str, ...] = (f"a drum of {up(width * 1e3)} mm",)
    if room > 0:
        options += (
            f"a winding radius of at least {up(drum.winding_radius / room * 1e3)} mm",
            f"at most {down(need.cable_length * room)} m of cable",
        )
    yield Row("turns on the drum", "Eq. 12", turns, "1", note=f"{drum.dead_wraps:g} dead wraps")
    yield Row.at_most("drum width", "Eq. 12", width, drum.width, "m", *options)

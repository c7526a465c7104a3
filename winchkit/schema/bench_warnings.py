"""Warnings of a bench file: limits and times that are valid but unusual."""

from __future__ import annotations

from collections.abc import Iterator

from winchkit.schema.bench import BenchSpec, LimitSpec

_SLOW_HEARTBEAT = 0.25
"""After 2.5 of them a drive stops by itself: 0.6 s, 0.3 m of cable at 0.5 m/s."""
_LONG_RAMP = 2.0
"""From ``limits.speed`` to rest, s: 0.5 m of cable at 0.5 m/s; with 1 m/s² 0.5 s."""
_LONG_RESPONSE = 0.5
"""Of the velocity loop of a drive, s: ten times that of a usual one."""


def bench_warnings(spec: BenchSpec) -> Iterator[tuple[tuple[str, ...], str]]:
    """Key and message for each limit of a bench file that is valid but unusual."""
    for name, winch in spec.winch.items():
        yield from _of_limits(("winch", name, "limits"), winch.limits, cell=winch.cell is not None)
    for name, bus in spec.bus.items():
        if bus.kind == "can" and bus.heartbeat > _SLOW_HEARTBEAT:
            yield (
                ("bus", name, "heartbeat"),
                f"{bus.heartbeat:g} s: after a failure of this computer the drives run on for up "
                f"to {2.5 * bus.heartbeat:g} s; 50 to 100 ms are usual",
            )


def _of_limits(
    at: tuple[str, ...], limits: LimitSpec, *, cell: bool
) -> Iterator[tuple[tuple[str, ...], str]]:
    if limits.length is None:
        yield (
            at,
            "there are no length limits: the cable may be paid out to its end or wound in to its "
            'stop; declare such as length = ["0.5 m", "9 m"]',
        )
    if limits.tension_high is None:
        yield (
            at,
            "there is no upper tension limit: a load that jams is not stopped"
            + ("; declare tension_high" if cell else ", and there is no load cell to detect it"),
        )
    ramp = limits.speed / limits.acceleration
    if ramp > _LONG_RAMP:
        yield (
            (*at, "acceleration"),
            f"{limits.acceleration:g} m/s^2: a stop from limits.speed, {limits.speed:g} m/s, takes "
            f"{ramp:.3g} s and {limits.speed * ramp / 2:.3g} m of cable, that of a released key "
            "too; at most 1 s is usual",
        )
    if limits.response_time > _LONG_RESPONSE:
        yield (
            (*at, "response_time"),
            f"{limits.response_time:g} s: a drive that does not slow down is noticed after so "
            f"long, {limits.speed * limits.response_time:.3g} m of cable at limits.speed; at least "
            "twice the time constant of the velocity loop, 60 ms as a rule, is enough",
        )

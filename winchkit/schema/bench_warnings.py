"""Warnings of a bench file: limits and times that are possible and rarely meant."""

from __future__ import annotations

from collections.abc import Iterator

from winchkit.schema.bench import BenchSpec, LimitSpec

__all__ = ["doubts"]

_SLOW_HEARTBEAT = 0.25
"""After 2.5 of them a drive stops by itself: 0.6 s, 0.3 m of cable at 0.5 m/s."""


def doubts(spec: BenchSpec) -> Iterator[tuple[tuple[str, ...], str]]:
    """Limits of a bench file that are possible and rarely meant: the key, and the warning."""
    for name, winch in spec.winch.items():
        yield from _of_limits(("winch", name, "limits"), winch.limits, cell=winch.cell is not None)
    for name, bus in spec.bus.items():
        if bus.kind == "can" and bus.heartbeat > _SLOW_HEARTBEAT:
            yield (
                ("bus", name, "heartbeat"),
                f"{bus.heartbeat:g} s: when this computer dies, the drives go on for up to "
                f"{2.5 * bus.heartbeat:g} s; 50 to 100 ms are usual",
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
            "there is no upper tension limit: nothing stops a load that is caught"
            + ("; declare tension_high" if cell else ", and there is no load cell to see it"),
        )

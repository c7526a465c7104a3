"""What ``winchkit check`` says about drums: too few turns, too much cable, a guide astray."""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.errors import Fault

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.read import Declared


def warnings_of_drums(file: str, value: Declared) -> tuple[Fault, ...]:
    """Warnings of a profile at its reference, or of a bench at the ends of its length limits."""
    from winchkit.model.capacity import drum_warnings
    from winchkit.model.guide import guide_warnings
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.profiles.winch import WinchProfile
    from winchkit.schema.reading.source import open_source
    from winchkit.schema.simbench import SimBench

    if isinstance(value, WinchProfile):
        source = open_source(file)
        return tuple(
            source.fault(tuple(key.split(".")), message)
            for key, message in (*drum_warnings(value), *guide_warnings(value))
        )
    bench = value.bench if isinstance(value, SimBench) else value
    return _bench_warnings(file, bench) if isinstance(bench, BenchSpec) else ()


def _bench_warnings(file: str, bench: BenchSpec) -> tuple[Fault, ...]:
    from winchkit.catalog import find
    from winchkit.model.capacity import drum_warnings
    from winchkit.model.guide import guide_warnings
    from winchkit.schema.read import read_winch
    from winchkit.schema.reading.source import open_source

    faults = []
    for name, wiring in bench.winch.items():
        if wiring.limits.length is None:
            continue
        profile = read_winch(find("profiles", wiring.profile, beside=bench.path))
        faults += [
            open_source(file).fault(("winch", name, "limits", "length"), message)
            for _, message in (
                *drum_warnings(profile, *wiring.limits.length),
                *guide_warnings(profile, wiring.limits.length[0]),
            )
        ]
    return tuple(faults)


def stroke_of(value: Declared) -> str:
    """Between which cable lengths a profile's drum is neither full nor down to its dead wraps."""
    from math import isfinite

    from winchkit.model.capacity import safe_lengths
    from winchkit.schema.profiles.winch import WinchProfile

    if not isinstance(value, WinchProfile):
        return ""
    shortest, longest = safe_lengths(value)
    if not isfinite(shortest):
        return ""
    return f"its drum is safe from {max(shortest, 0.0):.3g} m to {longest:.3g} m of cable"

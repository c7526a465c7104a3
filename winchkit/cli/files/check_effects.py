"""Checks the effects that profiles declare, without executing a file that a bench file names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit import wings
from winchkit.errors import Fault

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.profiles.winch import WinchProfile
    from winchkit.schema.read import Declared


def faults_and_warnings(
    file: str, value: Declared, effects: Sequence[str]
) -> tuple[list[Fault], list[Fault]]:
    """Faults of the effects of a declaration's profiles, and effects that were not checked.

    ``effects`` are the Python files that the user named (``--effects``): they are executed. Those
    that a bench file names (its key ``effects``) are not, unless the user named them as well: an
    effect that the catalogue lacks may stand in one of them, so it is no fault then.
    """
    from winchkit.schema.profiles.robot import RobotProfile

    profiles, bench = _profiles(value), bench_of(value)
    unread = _not_executed(bench, effects)
    warnings = [
        Fault(
            f"'{name}' is Python code, which check does not execute; opening the bench does "
            f"(check it with --effects {name})",
            file,
            key="effects",
        )
        for name in unread
    ]
    robot = value if isinstance(value, RobotProfile) and value.effect else None
    if not (effects or robot or any(profile.effect for profile in profiles)):
        return [], warnings
    from winchkit.effects import check_profile, load_catalogue

    catalogue = load_catalogue(effects)
    if unread:
        profiles = [
            replace(item, effect=tuple(table for table in item.effect if table.id in catalogue))
            for item in profiles
        ]
    faults = [fault for profile in profiles for fault in check_profile(profile, catalogue)]
    if robot is not None and (by_wing := wings.call("check_effects", robot)) is not None:
        faults += by_wing(robot, catalogue)
    return list(dict.fromkeys(faults)), warnings


def _not_executed(bench: BenchSpec | None, effects: Sequence[str]) -> list[str]:
    """Effect files that a bench file names and the user did not."""
    named = {Path(file).resolve() for file in effects}
    files = () if bench is None else bench.effect_files
    return [str(file) for file in dict.fromkeys(files) if file.resolve() not in named]


def _profiles(value: Declared) -> list[WinchProfile]:
    """The winch profiles of a declaration; those that a bench names are read as well."""
    from winchkit.catalog import find
    from winchkit.schema.profiles.robot import RobotProfile
    from winchkit.schema.profiles.winch import WinchProfile
    from winchkit.schema.read import read_winch

    if isinstance(value, WinchProfile):
        return [value]
    if isinstance(value, RobotProfile):
        return [line.winch for line in value.line if isinstance(line.winch, WinchProfile)]
    bench = bench_of(value)
    if bench is None:
        return []
    named = dict.fromkeys(wiring.profile for wiring in bench.winch.values())
    return [read_winch(find("profiles", name, beside=bench.path)) for name in named]


def bench_of(value: Declared) -> BenchSpec | None:
    """The bench that a declaration is, if it is one."""
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.simbench import SimBench

    bench = value.bench if isinstance(value, SimBench) else value
    return bench if isinstance(bench, BenchSpec) else None

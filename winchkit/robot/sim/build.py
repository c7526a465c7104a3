"""The simulated robot that a file declares, with its hidden geometry, at rest at home."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from winchkit.catalog import find
from winchkit.errors import FileError
from winchkit.robot.sim.cable_end import CableEnd, Coupling
from winchkit.robot.sim.platform import CablePlatform, Pulleys, RigidBody
from winchkit.robot.sim.rotation import rotation
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.sim_platform import PlatformTruth
from winchkit.schema.simbench import SimBench, WinchTruth

_BALANCED = 1e-6
"""Largest unbalanced force at home, as a share of the weight."""


class BuiltRobot(NamedTuple):
    """Platform, and per winch its profile and the end of its cable."""

    platform: CablePlatform
    profiles: dict[str, WinchProfile]
    """With the unstrained cable length at home as their reference."""
    ends: dict[str, CableEnd]
    truth: dict[str, WinchTruth]
    """With the true radii of the drums."""


def build_robot(bench: SimBench, truth: PlatformTruth, *, compiled: bool = False) -> BuiltRobot:
    """Build a declared robot, its mechanics ``compiled`` by numba; FileError where its cables do
    not hold the platform at home, ImportError without numba."""
    from winchkit.schema.read import read_robot

    wiring = bench.bench.robot
    if wiring is None:
        raise FileError(f"{bench.name}: [platform] describes a robot; a table [robot] is missing")
    profile = read_robot(find("profiles", wiring.profile, beside=bench.bench.path or None))
    random = np.random.default_rng(truth.geometry_seed)
    lines = profile.line
    exits = np.array([line.exit_point for line in lines], dtype=float)
    anchors = np.array([line.anchor_point for line in lines], dtype=float)
    exits += truth.geometry * random.standard_normal(exits.shape)
    anchors += truth.geometry * random.standard_normal(anchors.shape)
    axes = np.array([line.swivel_axis for line in lines], dtype=float)
    radii = np.array([line.swivel_radius for line in lines], dtype=float)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    body = RigidBody(
        profile.platform.mass if truth.mass is None else truth.mass,
        np.array(truth.center_of_mass or profile.platform.center_of_mass, dtype=float),
        np.diag(truth.inertia),
        anchors,
        profile.platform.free,
    )
    home = rotation(*profile.home.rotation)
    position = np.array(profile.home.position, dtype=float)
    pulleys = Pulleys(exits, axes, radii)
    platform = CablePlatform(body, pulleys, position, home, truth.damping_time, compiled=compiled)
    tension = platform.equilibrium(truth.pretension)
    left = float(np.abs(platform.unbalanced(tension)).max())
    if tension.min() <= 0 or left > _BALANCED * body.mass * 9.8:
        raise FileError(
            f"{bench.name}: no cable forces near {truth.pretension:g} N hold the platform of "
            f"{body.mass:g} kg at home (smallest {tension.min():.1f} N, unbalanced {left:.2g} N); "
            "change platform.pretension"
        )
    profiles = {line.name: _winch(line.winch, line.name) for line in lines}
    dead = [one.cable.dead_length for one in profiles.values()]
    coupling = Coupling(platform, tension, truth.axial_stiffness, dead)
    ends = dict(zip(profiles, coupling.ends, strict=True))
    for name, one in profiles.items():
        reference = replace(one.reference, cable_length=ends[name].home_length)
        profiles[name] = replace(one, reference=reference)
    true: dict[str, WinchTruth] = {}
    changes = truth.winding_radius * np.clip(random.standard_normal(len(lines)), -2, 2)
    for name, change in zip(profiles, changes.tolist(), strict=True):
        radius = profiles[name].drum.winding_radius + change
        given = bench.truth[name]
        overrides = {"drum.winding_radius": f"{radius!r} m"} if truth.winding_radius else {}
        true[name] = replace(given, overrides={**overrides, **given.overrides})
    return BuiltRobot(platform, profiles, ends, true)


def _winch(winch: str | WinchProfile, name: str) -> WinchProfile:
    if not isinstance(winch, WinchProfile):
        raise FileError(f"line {name}: winch '{winch}' has not been read")
    return winch


def profiles_of(bench: SimBench) -> dict[str, WinchProfile]:
    """Declared profile of every winch, with the cable's length at home."""
    if bench.platform is None:
        raise FileError(f"{bench.name}: declares no [platform]")
    return build_robot(bench, bench.platform).profiles

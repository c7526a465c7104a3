"""A profile for other programs: C, Python, a model of MuJoCo, or formulas."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal

from winchkit import wings
from winchkit.arguments import positive, require_type
from winchkit.dynamics.balance import refuse_load
from winchkit.dynamics.c_code import as_json, c_header
from winchkit.dynamics.mjcf import mjcf
from winchkit.dynamics.python_code import python_module
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.errors import UsageError
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile


@dataclass(frozen=True)
class ExportedModel:
    """A profile as a text of another program."""

    text: str
    missing: tuple[str, ...] = ()
    """Parts of the profile without a counterpart there."""


def export_model(
    profile: WinchProfile | RobotProfile,
    to: Literal["c", "python", "mjcf", "json"],
    catalogue: Catalogue | None = None,
    load_mass: float | None = None,
) -> ExportedModel:
    """Write a profile with its effects for a controller or a simulator.

    Parameters
    ----------
    profile : WinchProfile or RobotProfile
        The winch, the axis or the robot.
    to : {"c", "python", "mjcf", "json"}
        A header in C99 that needs ``math.h`` only, a Python module that needs ``math`` only, a
        model of MuJoCo, or the formulas as JSON; not Python of a robot.
    catalogue : Catalogue, optional
        Effects; by default all that are installed.
    load_mass : float, optional
        Mass on the cable of a winch, or payload of an axis, kg, for MuJoCo.

    Returns
    -------
    ExportedModel
        The text, and what it lacks of the profile.

    Raises
    ------
    UsageError
        For an unknown form, effects that have no formula of one sample (not MuJoCo), and a profile
        without masses (MuJoCo).
    """
    if (by_wing := wings.call("export_model", profile)) is not None:
        found: ExportedModel = by_wing(profile, to, catalogue, load_mass)
        return found
    require_type(profile, WinchProfile, "profile")
    assert isinstance(profile, WinchProfile), "just required"
    terms = terms_of(profile, catalogue)
    if load_mass is not None:
        load_mass = positive("export_model", "load_mass", load_mass)
        refuse_load(profile, terms, load_mass)
        if to != "mjcf":
            raise UsageError(f"'{to}' has the load as an input: leave the load mass out")
    if to == "c":
        return ExportedModel(c_header(profile, terms))
    if to == "python":
        return ExportedModel(python_module(profile, terms))
    if to == "json":
        formulas = json.dumps(as_json(profile, terms), indent=1, ensure_ascii=False)
        return ExportedModel(f"{formulas}\n")
    if to == "mjcf":
        text, missing = mjcf(profile, terms, load_mass)
        return ExportedModel(text, tuple(missing))
    raise UsageError(f"'{to}' is no form of a model; give c, python, mjcf or json")

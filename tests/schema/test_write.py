"""Profiles made in Python: written, read again as the same, and refused where no file may be so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snippets import ROOT
from winchkit import FileError, UsageError, read_profile, write_profile
from winchkit.schema.read import load
from winchkit.types import (
    CableSpec,
    DrumSpec,
    EffectTable,
    GearboxSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)

SHIPPED = ("bench-spiral", "bench-grooved", "cabtive-winch", "winding-device-winch", "joint-axis")
OWN = WinchProfile(
    name="own",
    drum=DrumSpec(kind="spiral", winding_radius=0.05, layer_growth=0.004, width=0.1),
    reference=ReferenceSpec(motor_angle=0.5, cable_length=12.0, wound_turns=2.0),
    gearbox=GearboxSpec(ratio=25.0, direction=-1),
    cable=CableSpec(diameter=0.006, axial_stiffness=9.5e5),
    pulley=(PulleySpec(radius=0.04), PulleySpec(radius=0.03, wrap=1.0)),
    effect=(EffectTable("motor-coulomb", {"torque": "0.2 N m"}),),
)


def same(one: WinchProfile, other: WinchProfile) -> None:
    """Every declared number to the 15 digits of a file, and the effects as declared."""
    assert one.drum == other.drum
    assert one.reference == other.reference
    assert one.gearbox == other.gearbox
    assert one.cable == other.cable
    assert one.motor == other.motor
    assert [e.id for e in one.effect] == [e.id for e in other.effect]
    assert [e.values for e in one.effect] == [e.values for e in other.effect]
    numbers = [[(p.radius, p.wrap) for p in each.pulley] for each in (one, other)]
    np.testing.assert_allclose(*numbers, rtol=1e-14)


def test_a_profile_made_in_python_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    write_profile(OWN, str(path))
    same(read_profile(path), OWN)
    with pytest.raises(UsageError, match="exists already"):
        write_profile(OWN, path)
    write_profile(replace(OWN, name="other"), path, replace=True)
    assert read_profile(path).name == "other"


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_profile_is_read_again(name: str, tmp_path: Path) -> None:
    declared = load(ROOT / "profiles" / f"{name}.toml").value
    assert isinstance(declared, WinchProfile)
    write_profile(declared, tmp_path / "again.toml")
    again = load(tmp_path / "again.toml").value
    assert type(again) is type(declared)
    assert isinstance(again, WinchProfile)
    same(again, declared)


def test_what_no_profile_may_have_is_not_written(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    with pytest.raises(FileError, match=r"drum\.winding_radius"):
        write_profile(replace(OWN, drum=DrumSpec(kind="spiral", winding_radius=-0.05)), path)
    assert not path.exists()

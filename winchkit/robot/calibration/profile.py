"""Writes a calibrated robot into a copy of its profile, with date, runs and errors of the fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from winchkit.arguments import path_of, require_type
from winchkit.arrays import Array
from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.model.rotation import angles_of, rotation_by, rotation_of
from winchkit.profile_edit.document import (
    effect_tables,
    read_document,
    refuse_other,
    write_document,
)
from winchkit.robot.calibration.calibrate import Calibrated
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.identification.instruments import NUMBERS
from winchkit.robot.identification.parameters import LAWS, Estimated
from winchkit.schema.profiles.winch import LAYERED
from winchkit.units import format_quantity, parse

_SHOWN = {"m": "mm"}
_DIGITS = 9
"""Significant digits: 1 nm in 1 m, below every uncertainty of a geometry."""
_STD_DIGITS = 3
"""Significant digits of an uncertainty: GUM 7.2.6 asks for two at most, and one more against
rounding."""


@dataclass(frozen=True)
class Provenance:
    """Runs and date of a fit."""

    runs: Sequence[str]
    date: date


def write_calibrated(
    source: str | Path,
    found: Calibrated,
    path: str | Path,
    where: Provenance,
    *,
    replace: bool = False,
) -> None:
    """Copy a robot's profile with the estimates of a calibration.

    Lines that name a winch file get its tables as their own, since their radii now differ.

    Parameters
    ----------
    source, path : str or Path
        Profile to copy, and the copy.
    found : Calibrated
        The estimates.
    where : Provenance
        Date and runs, written into the table ``[fitted]``.
    replace : bool
        Write over another profile that exists; over ``source`` always.

    Raises
    ------
    FileError
        Where a file cannot be read or written.
    UsageError
        With ``found.refusal`` where the robot is not calibrated, and for a file that is not to be
        replaced.
    """
    require_type(found, Calibrated, "found")
    if found.refusal:
        raise UsageError(found.refusal)
    source, path = path_of(source, "source"), path_of(path)
    refuse_other(source, path, replace)
    document = read_document(source)
    for line in document["line"]:
        _line(line, source, found)
    _instruments(document, found)
    _of_lines(document, found)
    _effects(document, found.estimates)
    _platform(document, found.estimates)
    document["fitted"] = _fitted(found, where)
    write_document(document, path)


def _instruments(document: Any, found: Calibrated) -> None:
    """Fitted numbers of the tracker; with the datum ``tracker`` the robot in the tracker's frame. A
    frame of several sessions stays unknown."""
    own = found.equations.instruments_at(found.values)
    if own is None or not own.free & set(NUMBERS):
        return
    if document["home"].pop("frame", "base") == "tracker":
        home = found.equations.robot.home
        document["home"]["position"] = _vector(home.position[0], "mm")
        document["home"]["rotation"] = _vector(angles_of(home.rotation[0]), "deg")
    tables = document.setdefault("instrument", tomlkit.table(is_super_table=True))
    table = tables.setdefault("tracker", tomlkit.table())
    tracker = own.trackers[0]
    if "frame" in own.free:
        of_file = found.equations.robot.profile.instrument.tracker
        if len(own.sessions) > 1:
            table["frame"] = "unknown"
        elif of_file.datum == "tracker":
            _into_frame(document, *tracker.frame_in_base)
            table.pop("frame", None)
        else:
            origin, turned = tracker.frame_in_base
            frame = tomlkit.inline_table()
            frame["position"] = _vector(origin, "mm")
            frame["rotation"] = _vector(angles_of(turned), "deg")
            table["frame"] = frame
    if "reflector" in own.free:
        table["reflector"] = _vector(tracker.offset, "mm")
    if "scale" in own.free:
        table["scale"] = format_quantity(tracker.scale, "ppm", _DIGITS)
    if "mounting" in own.free and tracker.mounting is not None:
        there = table
        if found.equations.robot.profile.instrument.imu is not None:
            there = tables.setdefault("imu", tomlkit.table())
        there["mounting"] = _vector(angles_of(rotation_by(tracker.mounting)), "deg")


def _of_lines(document: Any, found: Calibrated) -> None:
    """Fitted gains of cells and scales of length counters, with the known errors of before."""
    own, spec = found.equations.instruments, found.equations.robot.profile.instrument
    if own is None:
        return
    for name, table, key, known in (
        ("cell_gain", "cells", "gain", spec.cells.gain),
        ("length_scale", "length_counters", "scale", spec.length_counters.scale),
    ):
        if name in own.free:
            tables = document.setdefault("instrument", tomlkit.table(is_super_table=True))
            values = tomlkit.inline_table()
            for line in found.equations.robot.names:
                before = 0.0 if isinstance(known, str) else known.get(line, 0.0)
                error = (1 + before) * (1 + found.estimates[f"{line}.{name}"].value) - 1
                values[line] = format_quantity(error, "%", _DIGITS)
            tables.setdefault(table, tomlkit.table())[key] = values


def _into_frame(document: Any, origin: Array, turned: Array) -> None:
    """Move exit points, swivel axes and home pose by a rigid transformation."""
    for line in document["line"]:
        exit_point = np.array([parse(text, "length") for text in line["exit_point"]])
        line["exit_point"] = _vector(turned @ exit_point + origin, "mm")
        axis = np.array([float(x) for x in line.get("swivel_axis", (0.0, 0.0, 1.0))])
        line["swivel_axis"] = [float(f"{x:.{_DIGITS}g}") for x in turned @ axis]
    home = document["home"]
    position = np.array([parse(text, "length") for text in home["position"]])
    home["position"] = _vector(turned @ position + origin, "mm")
    angles = [parse(text, "angle") for text in home.get("rotation", ("0 rad",) * 3)]
    home["rotation"] = _vector(angles_of(turned @ rotation_of(*angles)), "deg")


def _vector(values: Array, unit: str) -> list[str]:
    return [format_quantity(float(value), unit, _DIGITS) for value in values]


def _line(line: Any, source: Path, found: Calibrated) -> None:
    name, estimates = str(line["name"]), found.estimates
    for point in ("exit_point", "anchor_point"):
        fitted = [estimates.get(f"{name}.{point}.{axis}") for axis in "xyz"]
        pairs = zip(fitted, line[point], strict=True)
        line[point] = [known if own is None else _written(own) for own, known in pairs]
    if (radius := estimates.get(f"{name}.swivel_radius")) is not None:
        line["swivel_radius"] = _written(radius)
    if isinstance(line["winch"], str):
        line["winch"] = _tables_of(line["winch"], source)
    drum = line["winch"]["drum"]
    drum["winding_radius"] = _written(estimates[f"{name}.winding_radius"])
    if (ratio := estimates.get(f"{name}.gear_ratio")) is not None:
        line["winch"]["gearbox"]["ratio"] = _written(ratio)
    if drum["kind"] in LAYERED and (growth := estimates.get("layer_growth")) is not None:
        drum["layer_growth"] = _written(growth)


def _tables_of(winch: str, source: Path) -> Any:
    """A winch's own tables, as a robot's line may hold them."""
    tree = read_document(find("profiles", winch, beside=source)).unwrap()
    table = tomlkit.table()
    for key, value in tree.items():
        if key not in {"schema", "kind", "description"}:
            table[key] = value
    return table


def _effects(document: Any, estimates: Mapping[str, Estimated]) -> None:
    for law in LAWS:
        own = {
            name.partition(".")[2]: estimate
            for name, estimate in estimates.items()
            if name.startswith(f"{law}.")
        }
        if own:
            table = _effect(document, law)
            for name, estimate in own.items():
                if isfinite(estimate.value):
                    table[name] = _written(estimate)
                else:
                    table.pop(name, None)
    homes = {
        name.rpartition(".")[0]: estimate
        for name, estimate in estimates.items()
        if name.endswith(".home_length")
    }
    if homes:
        lengths = tomlkit.inline_table()
        lengths.update({line: _written(estimate) for line, estimate in homes.items()})
        _effect(document, "home-length")["length"] = lengths


def _effect(document: Any, effect: str) -> Any:
    """The table of an effect; a new one where there is none."""
    tables = effect_tables(document)
    for table in tables:
        if table.get("id") == effect:
            return table
    tables.append(tomlkit.item({"id": effect}))
    return tables[-1]


def _platform(document: Any, estimates: Mapping[str, Estimated]) -> None:
    platform = document.setdefault("platform", tomlkit.table())
    if (mass := estimates.get("payload-mass.mass")) is not None:
        platform["mass"] = _written(mass)
    centre = [estimates.get(f"payload-centre.{axis}") for axis in "xyz"]
    if all(centre):
        platform["center_of_mass"] = [_written(c) for c in centre if c is not None]


def _fitted(found: Calibrated, where: Provenance) -> Any:
    table = tomlkit.table()
    table["date"] = where.date
    table["runs"] = list(where.runs)
    table["poses"] = len(found.equations.measured)
    for key, errors in (
        ("position_rms", found.fit_after),
        ("held_out_rms", found.validation_after),
    ):
        if isfinite(size := rms(errors.distance)):
            table[key] = format_quantity(size, "mm", _STD_DIGITS)
    std = tomlkit.table()
    for name, estimate in found.estimates.items():
        if isfinite(estimate.std) and not estimate.parameter.zero:
            unit = estimate.parameter.unit
            std[name] = format_quantity(estimate.std, _SHOWN.get(unit, unit), _STD_DIGITS)
    table["std"] = std
    return table


def _written(estimate: Estimated) -> str | float:
    unit = estimate.parameter.unit
    text = format_quantity(estimate.value, _SHOWN.get(unit, unit), _DIGITS)
    return float(text) if unit == "1" else text

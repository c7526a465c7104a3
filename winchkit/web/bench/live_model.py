"""The newest minute of a bench by its profiles: predictions, residuals, the drums."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.catalog import find
from winchkit.diagnosis.data.transients import white_noise
from winchkit.effects.bind import line_of
from winchkit.effects.catalogue import load_catalogue
from winchkit.errors import WinchkitError
from winchkit.model.capacity import capacity, turns_at
from winchkit.model.drum import drum_of
from winchkit.model.guide import guide_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.plain_json import finite_or_none
from winchkit.schema.bench import BenchSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_winch

CHANNELS = (
    "cable_length", "length", "tension", "load", "cable_speed", "commanded_speed",
    "motor_angle", "motor_torque", "motor_velocity", "temperature",
)  # fmt: skip
"""Channels of a winch's status that are kept for the strip charts."""
_MEASURED = {"cable_length": "length", "tension": "tension", "motor_torque": "motor_torque"}
"""Channel that measures an output of the model."""
_FEWEST = 20
"""Samples for a prediction."""
_PRESENT = 0.5
"""Share of the moments at which a channel has a value, from which it is used."""
_DECIMALS = 6
"""Of what is sent, in SI."""


class LiveModel:
    """The profiles of a bench's winches."""

    def __init__(self, spec: BenchSpec, file: str, effects: Sequence[str]) -> None:
        self.spec = spec
        self.profiles = {
            name: read_winch(find("profiles", winch.profile, beside=file))
            for name, winch in spec.winch.items()
        }
        self._lines = {name: _line(profile, effects) for name, profile in self.profiles.items()}

    def declared(self, name: str) -> dict[str, Any]:
        """Geometry and limits of a winch, for its picture."""
        wiring, profile = self.spec.winch[name], self.profiles[name]
        limits, drum = wiring.limits, profile.drum
        full = capacity(profile).turns
        return {
            "profile": profile.name,
            "effects": [table.id for table in profile.effect],
            "load_mass": wiring.load_mass,
            "limits": {
                "speed": limits.speed,
                "unhomed": limits.speed_unhomed,
                "length": limits.length,
                "tension": [limits.tension_slack, limits.tension_high],
            },
            "ratio": profile.gearbox.ratio * profile.gearbox.direction,
            "drum_radius": drum.winding_radius,
            "drum": {
                "kind": drum.kind,
                "width": drum.width,
                "flange_radius": drum.flange_radius,
                "turns": finite_or_none(full),
            },
            "cable_diameter": profile.cable.diameter,
            "guide": None if profile.guide is None else {"distance": profile.guide.distance},
            "pulleys": [{"radius": p.radius, "wrap": p.wrap} for p in profile.pulley],
        }

    def drums(self, status: Mapping[str, Any]) -> dict[str, dict[str, float | None]]:
        """Turns, winding radius (m) and guide travel from an empty drum (m) by winch, or None."""
        return {
            name: _drum(self.profiles[name], winch.get("cable_length"))
            for name, winch in status.get("winch", {}).items()
        }

    def prediction(self, name: str, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
        """Predict the outputs over the history of a winch, rows of time and :data:`CHANNELS` (SI).

        By output ``predicted``, ``residual``, ``mean`` (of the residual over 1 s) and ``noise``:
        the standard deviation of the readings' white noise. None without a usable profile.
        """
        line = self._lines[name]
        if line is None or len(rows) < _FEWEST:
            return None
        with suppress(WinchkitError, ValueError, FloatingPointError):
            return _predicted(line, rows, self.spec.winch[name].load_mass)
        return None


def _line(profile: WinchProfile, effects: Sequence[str]) -> Line | None:
    try:
        return line_of(profile, load_catalogue(effects))
    except WinchkitError:
        return None  # the bench process says what is wrong with it


def _drum(profile: WinchProfile, length: float | None) -> dict[str, float | None]:
    turns = np.nan if length is None else turns_at(profile, length)
    if not np.isfinite(turns):
        return {"turns": None, "radius": None, "guide": None}
    angle = np.asarray(2 * np.pi * turns)
    guide = None if profile.guide is None else float(guide_of(profile).position(angle))
    return {"turns": turns, "radius": float(drum_of(profile).arm(angle)), "guide": guide}


def _predicted(
    line: Line, rows: Sequence[Mapping[str, Any]], mass: float | None
) -> dict[str, Any] | None:
    column = {
        key: np.array([np.nan if row[key] is None else row[key] for row in rows], dtype=float)
        for key in ("time", *CHANNELS)
    }
    # A reading that is missing now and then takes its moment with it, an absent instrument nothing.
    present = {k: np.isfinite(v) for k, v in column.items() if np.isfinite(v).mean() > _PRESENT}
    whole = np.all(list(present.values()), axis=0)
    if "motor_angle" not in present or np.count_nonzero(whole) < _FEWEST:
        return None
    column = {key: values[whole] for key, values in column.items()}
    known = {key: column[key] for key in present}
    predicted = line.predict(
        line.motion(
            Signals(
                column["time"],
                column["motor_angle"],
                load=known.get("load"),
                load_mass=None if "load" in known else mass,
                tension=known.get("tension"),
                motor_torque=known.get("motor_torque"),
                temperature=known.get("temperature"),
            )
        )
    )
    out: dict[str, Any] = {"time": column["time"].tolist()}
    for output, channel in _MEASURED.items():
        if output not in predicted or channel not in known:
            continue
        error = known[channel] - predicted[output]
        if output == "cable_length":  # the instrument's zero is not the profile's
            error = error - float(np.median(error))
        out[output] = {
            "predicted": _plain(known[channel] - error),
            "residual": _plain(error),
            "mean": _plain(_mean(column["time"], error)),
            "noise": finite_or_none(white_noise(known[channel])),
        }
    return out


def _mean(time: Array, values: Array) -> Array:
    """Mean over the second around each sample."""
    low, high = np.searchsorted(time, time - 0.5), np.searchsorted(time, time + 0.5)
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[high] - total[low]) / np.maximum(high - low, 1))


def _plain(values: Array) -> list[float | None]:
    """Rounded numbers, None where one is not finite."""
    finite = np.isfinite(values)
    return [
        value if known else None
        for value, known in zip(np.round(values, _DECIMALS).tolist(), finite.tolist(), strict=True)
    ]

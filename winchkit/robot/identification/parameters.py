"""Parameters of a robot's identification: names, units, priors and bounds, in one vector."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.errors import Fault, FileError, UsageError, suggest
from winchkit.model.drum import drum_of
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.constraints import ZERO_STD
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.instruments import LARGEST_SCALE, InstrumentValues
from winchkit.schema.profiles.robot import CENTRE_STD, PRIORS, PriorName, PriorSpec, RobotProfile
from winchkit.schema.profiles.winch import LAYERED, WinchProfile
from winchkit.units import dimension_of, parse

HOME_LENGTH = "home-length"


def own_effects(profile: RobotProfile) -> dict[str, dict[str, float]]:
    """Values of a profile's effects that a calibration fits, SI: those of a law of elongation, and
    home lengths by line. Raises FileError."""
    out: dict[str, dict[str, float]] = {}
    faults: list[Fault] = []
    for table in profile.effect:
        if table.id in LAWS and "line" not in table.values:
            units = {p.name: p.unit for p in LAWS[table.id]}
            given: Mapping[str, Any] = table.values
        elif table.id == HOME_LENGTH:
            units = {line.name: "m" for line in profile.line}
            lengths = table.values.get("length")
            if not isinstance(lengths, Mapping):
                lengths = {str(table.values.get("line")): lengths}
            given = {**dict.fromkeys(units, "0 m"), **lengths}
        else:
            continue
        try:
            found = _values(given, units)
            if before := out.get(table.id):
                found = {name: value + before[name] for name, value in found.items()}
            out[table.id] = found
        except UsageError as error:
            faults.append(Fault(str(error), table.path, table.line, f"effect {table.id}"))
    if faults:
        raise FileError(faults)
    return out


def _values(given: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, float]:
    out = {}
    for name, unit in units.items():
        if name in given:
            try:
                out[name] = parse(given[name], dimension_of(unit) or "ratio")
            except UsageError as error:
                raise UsageError(f"{name}: {error}") from error
    return out


@dataclass(frozen=True)
class IdentifiedParameter:
    """One parameter in the unit that is fitted."""

    name: str
    """``LINE.exit_point.x``, ``layer_growth``, ``cable-elongation-linear.axial_stiffness`` …"""
    unit: str
    """Unit of the value in files."""
    nominal: float
    std: float
    """Of the prior; zero for a parameter that is held."""
    low: float = -np.inf
    high: float = np.inf
    reciprocal: bool = False
    """Files have 1/value."""
    zero: bool = False
    """Whether it is the zero of an instrument and no part of the robot."""

    def shown(self, value: float, std: float) -> tuple[float, float]:
        """Value and standard deviation in the unit of files; NaN for an infinite stiffness's."""
        if not self.reciprocal:
            return value, std
        return (1 / value, std / value**2) if value > 0 else (np.inf, np.nan)


LAWS: dict[str, tuple[IdentifiedParameter, ...]] = {
    "cable-elongation-linear": (
        IdentifiedParameter("axial_stiffness", "N", 0.0, 2e-5, 0.0, 1e-3, reciprocal=True),
    ),
    "cable-elongation-quartic": (
        IdentifiedParameter("k1", "N", 0.0, 2e-5, 0.0, 1e-3, reciprocal=True),
        IdentifiedParameter("b2", "1", 0.0, 100.0),
        IdentifiedParameter("b3", "1", 0.0, 3e4),
        IdentifiedParameter("b4", "1", 0.0, 1e7),
    ),
    "cable-elongation-exponential": (
        IdentifiedParameter("strain_scale", "1", 0.0, 2e-3, 0.0, 0.2),
        IdentifiedParameter("force_scale", "N", 200.0, 100.0, 1.0, 1e6),
    ),
}
"""Laws of elongation that can be parameters, one for all cables."""

Indices = NDArray[np.intp]

GEOMETRY = ("exit-point", "anchor-point", "swivel-radius")
"""Effects of the catalogue that every calibration fits."""
EFFECTS = (*LAWS, "home-length", "gear-ratio", "payload-mass", "payload-centre")
"""Effects that are fitted where they are named; ``gear-ratio/LINE`` on one line."""

_MASS_SHARE, _MASS_LEAST = 0.2, 0.1
"""Standard deviation of the prior: a fifth of the mass, at least 0.1 kg for a tool or cable carrier
that is in no drawing (rule of thumb)."""
_ALONG = 1e-3
"""Share of an axis of the platform that lies along a guide's axis from which on it is held
(numerical: axes are parallel up to rounding)."""
_TRACKER_STD = {"m": 1.0, "rad": 1.0, "1": 0.01}
"""Standard deviations of the priors of a tracker's numbers about their registration, by unit: far
above what the registration leaves, so that the data decide."""
_RATIO_SHARE = 0.1
"""Standard deviation of the prior of a gear ratio that is fitted, as a share: rounded ratios and
wrong counts per turn are per cent off."""
_OF_LINES_STD = {"cell_gain": 0.2, "length_scale": 0.02}
"""Standard deviations of the priors of a cell's gain and a length counter's scale: wider than those
of instruments in use, so that the data decide."""
_REFLECTOR_STD = 0.1
"""Of a reflector's offset, m: the size of a platform."""
_FLAT = 1e3
"""Standard deviation of the prior of an effect's coordinates."""


@dataclass(frozen=True)
class Estimated:
    """Estimate of one parameter, in the unit of files."""

    parameter: IdentifiedParameter
    nominal: float
    value: float
    std: float
    """Posterior standard deviation."""
    bound: str
    """``low`` or ``high`` where the fit stopped at a bound, else empty."""


@dataclass(frozen=True)
class Parameters:
    """All parameters, and the indices of each block."""

    all: tuple[IdentifiedParameter, ...]
    block: dict[str, Indices]
    """Indices by block; (n, 3) for points, (n,) for what a line has one of."""
    law: str | None
    """Law of elongation that is fitted."""

    def __iter__(self) -> Iterator[IdentifiedParameter]:
        return iter(self.all)

    def __len__(self) -> int:
        return len(self.all)

    @property
    def nominal(self) -> Array:
        """(q,)."""
        return np.array([p.nominal for p in self.all])

    @property
    def std(self) -> Array:
        """Of the priors, (q,)."""
        return np.array([p.std for p in self.all])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """(q,) each."""
        return np.array([p.low for p in self.all]), np.array([p.high for p in self.all])

    @property
    def free(self) -> NDArray[np.bool_]:
        """Mask of parameters that are fitted, (q,)."""
        return np.array([p.std > 0 for p in self.all])

    @property
    def lasting(self) -> NDArray[np.bool_]:
        """Mask of parameters that are fitted and belong to the robot, (q,)."""
        return np.array([p.std > 0 and not p.zero for p in self.all])

    def starting(self, block: str, values: Array) -> Parameters:
        """The same parameters with other nominal values of a block."""
        everything = list(self.all)
        for at, value in zip(self.block[block].ravel(), values.ravel(), strict=True):
            everything[at] = replace(everything[at], nominal=float(value))
        return replace(self, all=tuple(everything))

    def about(self, values: Array) -> Parameters:
        """The same parameters with other nominal values, (q,)."""
        both = zip(self.all, values.tolist(), strict=True)
        return replace(self, all=tuple(replace(own, nominal=value) for own, value in both))

    def carried(self, values: NDArray[Any], wider: Parameters, others: Array) -> Array:
        """Values of these parameters in the layout of wider ones, beside those of ``others``."""
        out = others.copy()
        for name, place in self.block.items():
            out[wider.block[name]] = values[place]
        return out

    def with_terms(self, terms: Sequence[Term]) -> Parameters:
        """These and the coordinates of effects, which are near one in size, with a flat prior."""
        more: list[IdentifiedParameter] = []
        for term in terms:
            own = Coordinates(term.effect)
            start, low, high = own.vector(term.values), *own.bounds()
            for name, *numbers in zip(own.names, start, low, high, strict=True):
                at, least, most = map(float, numbers)
                more.append(
                    IdentifiedParameter(f"{term.effect.id}.{name}", "1", at, _FLAT, least, most)
                )
        block = {**self.block, "terms": np.arange(len(self), len(self) + len(more))}
        return replace(self, all=(*self.all, *more), block=block)


class _Builder:
    """Appends blocks of parameters."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.all: list[IdentifiedParameter] = []
        self.block: dict[str, Indices] = {}

    def add(self, block: str, parameters: Sequence[IdentifiedParameter], *shape: int) -> None:
        """Append a block; its indices get ``shape``."""
        start = len(self.all)
        self.all += parameters
        self.block[block] = np.arange(start, len(self.all)).reshape(shape or (-1,))

    def prior(self, name: PriorName) -> PriorSpec:
        """Prior of the robot's file, else of the paper."""
        return self.robot.profile.prior.get(name, PriorSpec(PRIORS[name]))

    def points(self, name: PriorName, values: Array, fitted: NDArray[np.bool_]) -> None:
        """Three coordinates a line; those that are not ``fitted`` (3,) have no prior's width."""
        std = self.prior(name).std
        found = [
            IdentifiedParameter(f"{line}.{name}.{axis}", "m", float(value), std * free)
            for line, point in zip(self.robot.names, values, strict=True)
            for axis, value, free in zip("xyz", point, fitted.tolist(), strict=True)
        ]
        self.add(name, found, -1, 3)

    def lengths(self, name: PriorName, values: Sequence[float], fitted: Sequence[bool]) -> None:
        """One length a line; those that are not fitted have a prior of zero width."""
        prior = self.prior(name)
        low, high = prior.bounds or (0.0, np.inf)
        found = [
            IdentifiedParameter(f"{line}.{name}", "m", value, prior.std * free, low, high)
            for line, value, free in zip(self.robot.names, values, fitted, strict=True)
        ]
        self.add(name, found)

    def ratios(self, effects: Sequence[str]) -> None:
        """Gear ratios; those that no effect frees have a prior of zero width."""
        if not any(effect.partition("/")[0] == "gear-ratio" for effect in effects):
            return
        found = [
            IdentifiedParameter(
                f"{line}.gear_ratio",
                "1",
                winch.gearbox.ratio,
                _RATIO_SHARE
                * winch.gearbox.ratio
                * bool({"gear-ratio", f"gear-ratio/{line}"} & set(effects)),
                low=1e-3,
            )
            for line, winch in zip(self.robot.names, self.robot.winches, strict=True)
        ]
        self.add("gear_ratio", found)

    def zeros(self, name: str, unit: str, std: float, *, zero: bool) -> None:
        """One number a line that starts at zero."""
        found = [
            IdentifiedParameter(f"{line}.{name}", unit, 0.0, std, zero=zero)
            for line in self.robot.names
        ]
        self.add(name, found)


def parameters_of(
    robot: Robot,
    measured: MeasuredPoses,
    effects: Sequence[str] = (),
    instruments: InstrumentValues | None = None,
) -> Parameters:
    """Parameters of geometry, winches, named effects and unknown numbers of instruments. A law of
    elongation adds home lengths, since the tension at home is unknown. Raises UsageError for an
    effect that is no parameter, or two laws of elongation."""
    own = own_effects(robot.profile)
    effects = tuple(dict.fromkeys((*effects, *own)))
    _known(effects)
    law = next((effect for effect in effects if effect in LAWS), None)
    build = _Builder(robot)
    # Nothing is measured across a guide, and without rotation exit and anchor points are the same.
    moved = robot.geometry.free[:3]
    across = np.abs((1 - moved) @ robot.home.rotation[0])
    turns = bool(robot.geometry.free[3:].any())
    build.points("exit_point", robot.geometry.exit_point, moved > 0)
    build.points("anchor_point", robot.geometry.anchor_point, turns & (across < _ALONG))
    winches = robot.winches
    radii = [winch.drum.winding_radius for winch in winches]
    build.lengths("winding_radius", radii, [True] * len(winches))
    swivels = robot.geometry.swivel_radius.tolist()
    build.lengths("swivel_radius", swivels, [radius > 0 for radius in swivels])
    _growth(build, winches)
    build.ratios(effects)
    if law or "home-length" in effects:
        build.zeros("home_length", "m", build.prior("home_length").std, zero=False)
    if law:
        build.add("law", [*_of_law(law, own.get(law, {}))])
    _payload(build, effects)
    unknown = isinstance(robot.profile.instrument.swivels.zero, str)
    if unknown and np.any(np.isfinite(measured.swivel)):
        build.zeros("swivel_zero", "rad", ZERO_STD["swivel"], zero=True)
    if not measured.length_zeroed and np.any(np.isfinite(measured.cable_length)):
        build.zeros("length_offset", "m", ZERO_STD["cable_length"], zero=True)
    if instruments is not None:
        _tracker(build, instruments)
        for name, std in _OF_LINES_STD.items():
            if name in instruments.free:
                build.zeros(name, "1", std, zero=True)
    found = Parameters(tuple(build.all), build.block, law)
    if offsets := own.get("home-length"):
        found = found.starting("home_length", np.array([offsets[n] for n in robot.names]))
    return found


def _of_law(law: str, own: Mapping[str, float]) -> Iterator[IdentifiedParameter]:
    """Parameters of a law that start at the values of the robot's file."""
    for spec in LAWS[law]:
        start = own.get(spec.name, np.nan)
        start = 1 / start if spec.reciprocal else start
        at = start if spec.name in own else spec.nominal
        yield replace(spec, name=f"{law}.{spec.name}", nominal=at)


def _known(effects: Sequence[str]) -> None:
    for effect in effects:
        if effect.partition("/")[0] not in (*GEOMETRY, *EFFECTS) or (
            "/" in effect and not effect.startswith("gear-ratio/")
        ):
            raise UsageError(
                f"effect '{effect}' cannot join a robot's calibration; use one of "
                f"{', '.join(EFFECTS)} ({', '.join(GEOMETRY)} are always in it)"
                f"{suggest(effect, [*EFFECTS, *GEOMETRY])}"
            )
    laws = [effect for effect in effects if effect in LAWS]
    if len(set(laws)) > 1:
        raise UsageError(f"{' and '.join(laws)} are laws of the same cable; name one of them")


def _growth(build: _Builder, winches: Sequence[WinchProfile]) -> None:
    """One growth for all layered drums, which wind the same cable."""
    growths = [
        getattr(drum_of(winch), "growth", 0.0) for winch in winches if winch.drum.kind in LAYERED
    ]
    prior = build.prior("layer_growth")
    low, high = prior.bounds or (0.0, np.inf)
    std = prior.std if growths else 0.0
    value = growths[0] if growths else 0.0
    build.add("layer_growth", [IdentifiedParameter("layer_growth", "m", value, std, low, high)])


def _payload(build: _Builder, effects: Sequence[str]) -> None:
    platform = build.robot.profile.platform
    std = max(_MASS_SHARE * platform.mass, _MASS_LEAST) * ("payload-mass" in effects)
    build.add(
        "payload_mass", [IdentifiedParameter("payload-mass.mass", "kg", platform.mass, std, 0.0)]
    )
    std = CENTRE_STD * ("payload-centre" in effects)
    found = [
        IdentifiedParameter(f"payload-centre.{axis}", "m", value, std)
        for axis, value in zip("xyz", platform.center_of_mass, strict=True)
    ]
    build.add("payload_centre", found)


def _tracker(build: _Builder, instruments: InstrumentValues) -> None:
    """Numbers of a tracker that are free; a frame per session."""

    def add(block: str, names: Sequence[str], units: Sequence[str], values: Array) -> None:
        found = [
            IdentifiedParameter(
                name,
                unit,
                float(value),
                _REFLECTOR_STD if block == "reflector" else _TRACKER_STD[unit],
                low=-LARGEST_SCALE if unit == "1" else -np.inf,
                high=LARGEST_SCALE if unit == "1" else np.inf,
                zero=True,
            )
            for name, unit, value in zip(names, units, values.ravel(), strict=True)
        ]
        shape = (-1, 6) if block == "tracker_frame" else ()
        build.add(block, found, *shape)

    first = instruments.trackers[0]
    if "frame" in instruments.free:
        several = len(instruments.sessions) > 1
        names = [
            f"tracker_frame{f'[{session}]' if several else ''}.{axis}"
            for session in instruments.sessions
            for axis in ("x", "y", "z", "rx", "ry", "rz")
        ]
        values = np.array([[*t.shift, *t.turn] for t in instruments.trackers])
        add("tracker_frame", names, ["m", "m", "m", "rad", "rad", "rad"] * len(values), values)
    if "reflector" in instruments.free:
        add("reflector", [f"reflector.{axis}" for axis in "xyz"], ["m"] * 3, first.offset)
    if "scale" in instruments.free:
        add("tracker_scale", ["tracker_scale"], ["1"], np.array([first.scale]))
    if "mounting" in instruments.free:
        mounting = np.zeros(3) if first.mounting is None else first.mounting
        add("mounting", [f"mounting.r{axis}" for axis in "xyz"], ["rad"] * 3, mounting)

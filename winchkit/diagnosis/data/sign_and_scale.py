"""Sign and scale of measured channels against the prediction of a profile.

Every run's tension and torque are regressed on their prediction, with the standard deviation of a
block jackknife; a slope far from one is a wrong unit, factor or sign. Friction and inertia are
fitted beside; a run whose motion does not separate them from the load has the slope of all runs
together. A prediction that is friction and inertia alone has no slope of its own, but a correlation
below −0.9 is an inverted sign. A factor is the same in all runs, or in some while the others have
none; where the slopes of the others differ, none is suspected. Without a load the prediction of the
torque may vanish: then the work of its dissipative part must not be negative (passivity).

References
----------
Künsch, H. R. (1989). Ann. Statist. 17, 1217-1241.
Marquardt, D. W. (1970). Technometrics 12, 591-612 (variance inflation).
Willems, J. C. (1972). Dissipative dynamical systems. Arch. Ration. Mech. Anal. 45, 321-351.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.sampling import bridged, bridged_channel
from winchkit.effects.bind import line_of
from winchkit.effects.catalogue import Catalogue
from winchkit.model.line import Line
from winchkit.model.stages import OUTPUTS, Signals
from winchkit.runs.columns import column_dimension
from winchkit.runs.run import Run
from winchkit.runs.sanity.factors import Slope, known_factors, named_factor, slope_text
from winchkit.runs.sanity.finding import Finding
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.units import UNITS

_LARGEST = 1.8
"""Slope of measured over predicted, or its reciprocal, beyond which a unit is wrong; below the
smallest constant of another unit but ft lb (1.36), above every effect: slopes of 120 simulated runs
of all benches lie within 0.90 to 1.06."""
_BLOCKS = 8
"""Blocks of the jackknife of a slope; screened: seven degrees of freedom."""
_SIGMAS = 5.0
"""Standard deviations by which a slope must lie outside; with seven degrees of freedom exceeded in
1 of 600 cases, on top of a range that no effect reaches."""
MOST_SAMPLES = 20_000
"""Samples on which a slope is fitted; computing cost, rule of thumb."""
_EQUAL = 1.1
"""Ratio up to which slopes are equal: of tension and torque, where the load is wrong instead; of
runs, where a factor may be wrong in others; effects change a slope by less than 10 %."""
_LEAST_SAMPLES = 50
"""Samples with which a slope is fitted; as in `data/validation.py`."""
_LEAST_EXPLAINED = 0.8
"""Share of the measured square that the fit of a wrong factor explains at least: random values from
zero to a limit have three quarters by their mean alone, whatever is predicted."""
_NONE = 1.34
"""Slope, or its reciprocal, up to which a run counts as one without a wrong factor, where others
have one: the root of `_LARGEST`, nearer to one than to any factor."""
_LARGEST_INFLATION = 10.0
"""Variance inflation of the prediction by friction and inertia above which its slope is not judged;
the textbook limit of a column that others explain to nine tenths (Marquardt 1970)."""
_OPPOSITE = -0.9
"""Correlation of measured and predicted below which the sign is inverted although friction or
inertia could explain the prediction: four fifths of the variance, with the wrong sign."""
_NEAR = 0.05
"""Difference from one of the slope of the length with the angle in another unit; as the tolerance
of a constant in `runs/sanity/factors.py`."""


def sign_and_scale(
    runs: Sequence[Run], profile: WinchProfile, catalogue: Catalogue | None = None
) -> list[Finding]:
    """Findings ``inverted-sign`` and ``wrong-factor`` of tension, torque and load.

    Their value is the slope of measured over predicted. Where tension and torque of a run are wrong
    by the same factor, the load is.
    """
    wrong: dict[tuple[str, str, str], list[tuple[str, Slope]]] = {}
    every = _slopes(runs, profile, catalogue)
    scattered = {
        name for name in OUTPUTS if _differ(name, [own[name] for own in every if name in own])
    }
    for run, own in zip(runs, every, strict=True):
        slopes = {name: slope for name, slope in own.items() if name not in scattered}
        for (channel, other), slope in _wrong_channels(run, slopes).items():
            code = "inverted-sign" if slope.value < 0 else "wrong-factor"
            wrong.setdefault((channel, other, code), []).append((run.name, slope))
    out = []
    for (channel, other, code), found in wrong.items():
        mean = _mean([slope for _, slope in found])
        known = _known(channel, mean) if _outside(abs(mean.value)) else ""
        text = _text(channel, code, known, mean, other)
        out += [Finding(code, name, channel, slope.value, text) for name, slope in found]
    told = {f.run for f in out if f.channel == "motor_torque"}
    return [*out, *_passivity([run for run in runs if run.name not in told], profile)]


def length_words(slope: float, slope_at: Callable[[float], float]) -> str:
    """Words on a wrong slope of the cable length over its prediction; empty if nothing explains it.

    ``slope_at`` gives the slope with a factor on the motor angle: a drum with layers is not linear.
    """
    either = "'cable_length' or 'motor_angle'"
    if slope < 0 and not _outside(abs(slope)):
        return f"inverted sign of {either}"
    if known := named_factor(Slope(slope, 0.0)):
        sign = "inverted sign and " if slope < 0 else ""
        return f"{sign}wrong factor or unit of {either}, {known}"
    for factor in known_factors():
        if abs(slope_at(factor) - 1) < _NEAR:
            known = named_factor(Slope(factor, 0.0))
            return f"wrong factor or unit of 'motor_angle', {known}"
    return (
        f"wrong factor or unit of {either}, which no known constant explains"
        if _outside(abs(slope))
        else ""
    )


def mending_column(finding: Finding) -> str:
    """Value of ``import --column`` that corrects a channel with a wrong sign or unit, such as
    ``motor_torque=-motor_torque*0.1 [N m]``; empty for the load, which may be metadata."""
    channel, slope = finding.channel, finding.value
    dimension = column_dimension(channel)
    if dimension is None or channel == "load":
        return ""
    sign = "-" if finding.code == "inverted-sign" else ""
    factor = ""
    if np.isfinite(slope) and _outside(abs(slope)):
        exact = min(known_factors(dimension), key=lambda known: abs(known * abs(slope) - 1))
        wrong = abs(exact * abs(slope) - 1) < _NEAR
        factor = f"*{exact if wrong else 1 / abs(slope):.4g}"
    return f"{channel}={sign}{channel}{factor} [{next(iter(UNITS[dimension]))}]"


def _known(channel: str, slope: Slope) -> str:
    """Known constants that a channel may be wrong by, in words; else empty."""
    return named_factor(slope, column_dimension(channel) or "")


def _outside(size: float) -> bool:
    return not 1 / _LARGEST < size < _LARGEST


def _slopes(
    runs: Sequence[Run], profile: WinchProfile, catalogue: Catalogue | None
) -> list[dict[str, Slope]]:
    """Slopes of measured over predicted outputs of every run, where they are determined."""
    rows = [_rows(run, profile, catalogue) for run in runs]
    alike: dict[tuple[str, int], list[tuple[Array, Array]]] = {}
    for own in rows:
        for name, (measured, columns) in own.items():
            alike.setdefault((name, columns.shape[1]), []).append((measured, columns))
    together = {
        key: _slope(
            np.concatenate([measured for measured, _ in found]),
            np.concatenate([columns for _, columns in found]),
        )
        for key, found in alike.items()
    }
    out = []
    for own in rows:
        slopes = {
            name: _slope(measured, columns) or together[name, columns.shape[1]]
            for name, (measured, columns) in own.items()
        }
        out.append({name: slope for name, slope in slopes.items() if slope is not None})
    return out


def _rows(
    run: Run, profile: WinchProfile, catalogue: Catalogue | None
) -> dict[str, tuple[Array, Array]]:
    """Measured outputs of a run, and columns: the prediction, then what is fitted beside."""
    signals = _signals(run, profile)
    nominal = Line(profile)
    motion = nominal.motion(signals)
    predicted = dict(nominal.predict(motion))
    at = motion.at
    beside = [at.motor_rate, np.sign(at.motor_rate), at.motor_acceleration]
    outputs = {"tension": beside[:2], "motor_torque": beside}
    if not np.any(predicted["motor_torque"]):
        # Without a load the prediction is that of the profile's effects, such as gravity.
        whole = line_of(profile, catalogue)
        predicted["motor_torque"] = whole.predict(motion)["motor_torque"]
        outputs["motor_torque"] = [np.ones(len(signals.time)), *beside]
    return {
        name: (run[name], np.column_stack([predicted[name], *columns]))
        for name, columns in outputs.items()
        if name in run and name in predicted and np.any(predicted[name])
    }


def _wrong_channels(run: Run, slopes: Mapping[str, Slope]) -> dict[tuple[str, str], Slope]:
    """Channels with a wrong sign or scale, and the channel that may be wrong instead.

    That is the load where tension and torque agree on one; tension or torque where no load is
    known, since the one is predicted from the other.
    """
    wrong = {name: s for name, s in slopes.items() if _is_wrong(s)}
    if len(wrong) == 2:
        tension, torque = wrong["tension"], wrong["motor_torque"]
        ratio = tension.value / torque.value
        if 1 / _EQUAL < ratio < _EQUAL:
            return {("load", ""): _reciprocal(tension)}
    if "motor_torque" in wrong and "tension" in run and not _knows_load(run):
        torque = wrong["motor_torque"]
        return {
            ("motor_torque", "tension"): torque,
            ("tension", "motor_torque"): _reciprocal(torque),
        }
    return {(name, ""): slope for name, slope in wrong.items()}


def _knows_load(run: Run) -> bool:
    return "load" in run or run.load_mass is not None


def _reciprocal(slope: Slope) -> Slope:
    return Slope(1 / slope.value, slope.std / slope.value**2, slope.explained)


def _is_wrong(slope: Slope) -> bool:
    """Whether a slope is negative or outside the range of effects, beyond its uncertainty.

    Values without any relation to the prediction have a slope by their mean: the factor must also
    explain what was measured.
    """
    low, high = abs(slope.value) - _SIGMAS * slope.std, abs(slope.value) + _SIGMAS * slope.std
    is_factor = slope.explained >= _LEAST_EXPLAINED and (low > _LARGEST or high < 1 / _LARGEST)
    return slope.value < 0 or is_factor


def _differ(channel: str, slopes: Sequence[Slope]) -> bool:
    """Whether the slopes that are not wrong differ from run to run, or the units of the others.

    Two units, with slopes that differ beyond their uncertainty, are no unit but a missing effect.
    Runs that are not wrong beside wrong ones have a slope near one.
    """
    wrong = sorted((s for s in slopes if _is_wrong(s)), key=lambda slope: abs(slope.value))
    units = {known for slope in wrong if (known := _known(channel, slope))}
    if len(units) > 1:
        low, high = wrong[0], wrong[-1]
        excess = abs(high.value) - _EQUAL * abs(low.value)
        if excess > _SIGMAS * float(np.hypot(high.std, low.std)):
            return True
    sizes = [slope.value for slope in slopes if not _is_wrong(slope)]
    if wrong and any(not 1 / _NONE < size < _NONE for size in sizes):
        return True
    return len(sizes) > 1 and max(sizes) > _EQUAL * min(sizes)


def _slope(measured: Array, columns: Array) -> Slope | None:
    """Coefficient of the first column by least squares, with its block jackknife.

    None where it is not five standard deviations from zero, or where the other columns explain the
    first to nine tenths of its square.
    """
    rows = _complete_rows(measured, columns)
    if len(rows) < _LEAST_SAMPLES:
        return None
    x, y = columns[rows], measured[rows]
    x = x / np.maximum(np.sqrt(np.mean(x**2, axis=0)), 1e-300)
    own = x[:, 0] - x[:, 1:] @ np.linalg.lstsq(x[:, 1:], x[:, 0], rcond=None)[0]
    if _LARGEST_INFLATION * float(np.mean(own**2)) < 1:
        if not np.ptp(x[:, 0]) or not np.ptp(y) or np.corrcoef(x[:, 0], y)[0, 1] > _OPPOSITE:
            return None
        # Whatever else acts, nothing turns a prediction round.
        x = np.column_stack([x[:, 0], np.ones(len(y))])
        own = x[:, 0] - np.mean(x[:, 0])
    scale = float(np.sqrt(np.mean(columns[rows, 0] ** 2)))
    without = _jackknifed(x, y)[:, 0] / scale
    # The coefficient of what the other columns leave of the first (Frisch, Waugh).
    value = float(own @ y) / float(own @ own) / scale
    left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    explained = 1.0 - float(left @ left) / max(float(y @ y), 1e-300)
    slope = Slope(value, _jackknife_std(without), explained)
    return slope if abs(slope.value) > _SIGMAS * slope.std else None


def _complete_rows(measured: Array, columns: Array) -> NDArray[np.intp]:
    """Rows without a missing value, decimated to about `MOST_SAMPLES`."""
    rows = np.flatnonzero(np.isfinite(measured) & np.all(np.isfinite(columns), axis=1))
    return rows[:: max(1, len(rows) // MOST_SAMPLES)]


def _jackknifed(x: Array, y: Array) -> Array:
    """Coefficients without one block of time each, shape (blocks, columns)."""
    edges = np.linspace(0, len(y), _BLOCKS + 1).astype(int)
    products = [(x[a:b].T @ x[a:b], x[a:b].T @ y[a:b]) for a, b in pairwise(edges)]
    gram = np.sum([p for p, _ in products], axis=0)
    right = np.sum([r for _, r in products], axis=0)
    return np.array([np.linalg.lstsq(gram - p, right - r, rcond=1e-10)[0] for p, r in products])


def _jackknife_std(without: Array) -> float:
    count = len(without)
    return float(np.sqrt((count - 1) / count * np.sum((without - without.mean()) ** 2)))


def _passivity(runs: Sequence[Run], profile: WinchProfile) -> Iterator[Finding]:
    """A torque whose dissipative part does negative work, where no load is known.

    The friction is one of all runs: of runs in one direction each it is an offset that follows the
    direction, and of the wrong sign where the angle's is inverted.
    """
    free = [run for run in runs if "motor_torque" in run and _has_no_load(run, profile)]
    if not free:
        return
    motions = [Line(profile).motion(_signals(run, profile)).at for run in free]
    angle, rate, acceleration = (
        np.concatenate([getattr(at, name) for at in motions])
        for name in ("motor_angle", "motor_rate", "motor_acceleration")
    )
    shape = angle - angle.mean()
    shape = shape / max(float(np.abs(shape).max()), 1e-300)
    conservative = [np.ones_like(shape), shape, shape**2, shape**3, np.sin(angle), np.cos(angle)]
    columns = np.column_stack([np.sign(rate), rate, *conservative, acceleration])
    measured = np.concatenate([run["motor_torque"] for run in free])
    rows = _complete_rows(measured, columns)
    if len(rows) < _LEAST_SAMPLES or not np.any(rate):
        return
    x, rate = columns[rows], rate[rows]
    scale = np.maximum(np.sqrt(np.mean(x**2, axis=0)), 1e-300)
    without = _jackknifed(x / scale, measured[rows]) / scale
    power = without[:, 0] * np.mean(np.abs(rate)) + without[:, 1] * np.mean(rate**2)
    mean, std = float(power.mean()), _jackknife_std(power)
    inertia = without[:, -1]
    if mean < -_SIGMAS * std and float(inertia.mean()) <= _SIGMAS * _jackknife_std(inertia):
        text = (
            "the sign looks inverted: friction would do work on the motor, "
            f"{slope_text(Slope(mean, std))} W"
        )
        for run in free:
            yield Finding("inverted-sign", run.name, "motor_torque", np.nan, text)


def _has_no_load(run: Run, profile: WinchProfile) -> bool:
    motion = Line(profile).motion(_signals(run, profile))
    if motion.at.predicted_torque is not None:
        return False
    if motion.load is None:
        return motion.drum_tension is None
    return not np.any(motion.load)


def _signals(run: Run, profile: WinchProfile) -> Signals:
    has_cable = not isinstance(profile, AxisProfile)
    return Signals(
        time=run.time,
        motor_angle=bridged(run["motor_angle"]),
        load=bridged_channel(run, "load") if has_cable else None,
        load_mass=run.load_mass if has_cable else None,
        payload=None if has_cable else run.load_mass,
        tension=bridged_channel(run, "tension") if has_cable else None,
        predicted_torque=bridged_channel(run, "predicted_torque"),
    )


def _mean(slopes: Sequence[Slope]) -> Slope:
    """Mean over the runs; its standard deviation by theirs, or by the scatter if that is larger."""
    values = np.array([slope.value for slope in slopes])
    variance = float(np.mean([slope.std**2 for slope in slopes]))
    if len(values) > 1:
        variance = max(variance, float(np.var(values, ddof=1)))
    return Slope(float(values.mean()), float(np.sqrt(variance / len(values))))


def _text(channel: str, code: str, known: str, slope: Slope, other: str) -> str:
    what = "the slope over the prediction"
    if channel == "load":
        what = "the slope over that which tension and torque need"
    if other:
        what = f"the slope over the prediction with '{other}', of which either may be wrong,"
    beside = f"{what} is {slope_text(slope)}"
    if code == "inverted-sign":
        unit = f", and the unit wrong by {known}" if known else ""
        if not known and _outside(abs(slope.value)):
            unit = ", and the factor wrong by no known constant"
        return f"the sign looks inverted{unit}: {beside}"
    why = f"that is {known}" if known else "no known constant explains it"
    return f"the unit or factor looks wrong: {beside}; {why}"

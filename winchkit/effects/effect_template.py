"""Writing of a Python file with a user effect that is derived from data."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from pathlib import Path

from winchkit.effects.effect import Effect
from winchkit.effects.empirical import heights, knots, variable_of
from winchkit.effects.term import Term
from winchkit.errors import Fault, FileError, UsageError
from winchkit.model.variables import ANGLES, VARIABLE_UNITS
from winchkit.regular_file import file_errors

HEAD = '''"""{id}: residual of the {output} over the {variable}; its physics is to be filled in.

Use it with --effects {file}. Written by winchkit effects new; replace the formula in apply, the
stage at which it acts, and the description.
"""

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array

from winchkit import Effect, Parameter
from winchkit.effects import Values
from winchkit.model.stages import At, Stage
from winchkit.model.variables import VARIABLES


'''
WAVE = '''ORDER = {order:g}
"""Periods per turn."""


def apply(value: Array, at: At, values: Values) -> Array:
    """The {output} plus a sine; exactly the input at amplitude zero."""
    x = VARIABLES["{variable}"](at)
    return value + values["amplitude"] * np.sin(ORDER * x + values["phase"])


PARAMETERS = (
    Parameter("amplitude", "{unit}", null=0.0, typical={typical:.3g}, low=0.0, high={high:.3g}),
    Parameter("phase", "rad", null=0.0, typical=1.0),
)
POLAR = ("amplitude", "phase")
'''
CURVE = '''X = np.array({x})
"""The {variable}, {own_unit}."""
Y = np.array({y})
"""Mean residual of the {output} there, {unit}."""


def apply(value: Array, at: At, values: Values) -> Array:
    """The {output} plus the curve; exactly the input at scale zero."""
    x = VARIABLES["{variable}"](at)
    return np.asarray(value + values["scale"] * np.interp(x, X, Y))


PARAMETERS = (Parameter("scale", "1", null=0.0, typical=1.0, low=-100.0, high=100.0),)
POLAR = None
'''
FOOT = """
# Stage at which it acts. Control uses effects on the cable (Stage.CABLE, FRAME, PULLEY, CELL), not
# those on an instrument or the torque: 'winchkit effects {id} --effects {file}' prints which.
EFFECT = Effect(
    id="{id}",
    stage=Stage.{stage},
    parameters=PARAMETERS,
    apply=apply,
    outputs=("{output}",),
    what="Cause unknown: a curve over the {words}.",
    formula="as in apply",
    source="the runs to which it was fitted",
    looks_like="An error of the {output_words} over the {words}.",
    told_apart="To be filled in: the run that distinguishes it from similar effects.",
    needs={needs},
    polar=POLAR,
)
"""
DRUM = '''"""{id}: a sine of {order} periods per drum turn; its physics is to be filled in.

Use it with --effects {file}. Written by winchkit effects new since several outputs have the same
order of the drum: the sine is added to the wound length, and torque and tension follow from it.
"""

import numpy as np

from winchkit import Effect, Parameter
from winchkit.effects import Values
from winchkit.model.stages import At, Path, Stage

ORDER = {order}
"""Periods per drum turn."""


def apply(path: Path, at: At, values: Values) -> Path:
    """Wound length (m) and torque arm (m) with a sine."""
    size, phase = values["amplitude"], values["phase"]
    angle = ORDER * at.drum_angle + phase
    wave = size * (np.sin(angle) - np.sin(phase))
    return Path(path.value + wave, path.slope + ORDER * size * np.cos(angle))


EFFECT = Effect(
    id="{id}",
    stage=Stage.WOUND,
    parameters=(
        Parameter("amplitude", "m", null=0.0, typical=1e-4, low=0.0, high=0.02),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=apply,
    outputs=("cable_length", "tension", "motor_torque"),
    what="Cause unknown: the wound length has a sine of {order} periods per drum turn.",
    formula="W + a (sin({order} φ + p) − sin p)",
    source="the runs to which it was fitted",
    looks_like="{order} periods per drum turn in length, torque and the load's acceleration.",
    told_apart="To be filled in: the run that distinguishes it from similar effects.",
    polar=("amplitude", "phase"),
)
'''


_THERE = "exists already; give another file name, or remove it first"


_ID = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


def check_own(effect_id: str, path: Path, taken: Container[object]) -> None:
    """Check the name and the file of a user effect before its computation. Raises UsageError for an
    invalid or existing id, FileError for a file that exists.
    """
    if path.suffix != ".py":
        raise UsageError(f"'{path}' is not a Python file; name it {path.stem or 'mine'}.py")
    if not _ID.fullmatch(effect_id):
        raise UsageError(
            f"'{effect_id}' is not an id of an effect: lower-case letters and digits, joined by "
            "hyphens, such as stuck-sheave; give one with --id"
        )
    if effect_id in taken:
        raise UsageError(f"there is an effect '{effect_id}' already; give another with --id")
    if path.exists():
        raise FileError(Fault(_THERE, str(path)))


def write_own(term: Term, effect_id: str, path: Path) -> None:
    """Write an empirical term as a file of a user effect. Raises FileError where the file exists or
    cannot be written.
    """
    effect = term.effect
    facts: dict[str, object] = {
        "id": effect_id,
        "file": path.name,
        "output": effect.outputs[0],
        "output_words": effect.outputs[0].replace("_", " "),
        "variable": variable_of(effect),
        "words": variable_of(effect).replace("_", " "),
        "stage": effect.stage.name,
        "needs": repr(tuple(effect.needs)),
        "own_unit": VARIABLE_UNITS[variable_of(effect)],
    }
    body = _wave(effect, term.values) if variable_of(effect) in ANGLES else _curve(term)
    _write("\n".join((HEAD + body[0], FOOT)).format(**facts, **body[1]), path)


def write_wave_on_drum(order: int, effect_id: str, path: Path) -> None:
    """Write a sine of the wound length, with ``order`` periods per drum turn, as a user effect;
    raises as :func:`write_own`.
    """
    _write(DRUM.format(id=effect_id, order=order, file=path.name), path)


def _write(text: str, path: Path) -> None:
    with file_errors(path):
        try:
            with path.open("x", encoding="utf-8") as file:
                file.write(text)
        except FileExistsError as error:
            raise FileError(Fault(_THERE, str(path))) from error


def _wave(effect: Effect, values: Mapping[str, float]) -> tuple[str, dict[str, object]]:
    size = values["amplitude"]
    facts: dict[str, object] = {
        "order": values["order"],
        "unit": effect.parameter("amplitude").unit,
        "typical": size,
        "high": 100 * size,
    }
    return WAVE, facts


def _curve(term: Term) -> tuple[str, dict[str, object]]:
    """The curve through the values that data determine; the others are zero."""
    curve = zip(knots(term.values), heights(term.values), strict=True)
    points = [(x, v) for x, v in curve if v != 0.0]
    facts: dict[str, object] = {
        "x": [float(f"{x:.6g}") for x, _ in points],
        "y": [float(f"{v:.6g}") for _, v in points],
        "unit": term.effect.parameter("value_1").unit,
    }
    return CURVE, facts

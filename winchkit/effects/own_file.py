"""Writes a Python file with an effect of a user's own, begun from what the data show."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from pathlib import Path

from winchkit.effects.bind import Term
from winchkit.effects.effect import Effect
from winchkit.effects.empirical import heights, knots, variable_of
from winchkit.effects.own_templates import CURVE, DRUM, FOOT, HEAD, WAVE
from winchkit.errors import Fault, FileError, UsageError
from winchkit.model.variables import ANGLES, VARIABLE_UNITS

__all__ = ["check_own", "write_own", "write_wave_on_drum"]

_THERE = "is there already; name another file, or remove it first"


_ID = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


def check_own(effect_id: str, path: Path, taken: Container[object]) -> None:
    """Refuse a name or a file before anything is worked out for it.

    Raises UsageError for an id that is none or taken, FileError where the file cannot be new.
    """
    if path.suffix != ".py":
        raise UsageError(f"'{path}' is no Python file; name it {path.stem or 'mine'}.py")
    if not _ID.fullmatch(effect_id):
        raise UsageError(
            f"'{effect_id}' is no id of an effect: lower-case letters and digits, joined by "
            "hyphens, such as stuck-sheave; give one with --id"
        )
    if effect_id in taken:
        raise UsageError(f"there is an effect '{effect_id}' already; give another with --id")
    if path.exists():
        raise FileError(Fault(_THERE, str(path)))


def write_own(term: Term, effect_id: str, path: Path) -> None:
    """Write an empirical term as a file of a user's own effect.

    Raises FileError where the file is there already or cannot be written.
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
    """Write a wave of the wound length as a file of a user's own effect; raises as above."""
    _write(DRUM.format(id=effect_id, order=order, file=path.name), path)


def _write(text: str, path: Path) -> None:
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError as error:
        raise FileError(Fault(_THERE, str(path))) from error
    except OSError as error:
        raise FileError(Fault(f"cannot be written: {error.strerror}", str(path))) from error


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
    """The curve through the values that data determined; one that none touched stays at zero."""
    curve = zip(knots(term.values), heights(term.values), strict=True)
    points = [(x, v) for x, v in curve if v != 0.0]
    facts: dict[str, object] = {
        "x": [float(f"{x:.6g}") for x, _ in points],
        "y": [float(f"{v:.6g}") for _, v in points],
        "unit": term.effect.parameter("value_1").unit,
    }
    return CURVE, facts

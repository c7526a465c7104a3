"""Check of a user effect on the standard motion: null value and finite results."""

from __future__ import annotations

import numpy as np

from winchkit.effects.card import signature, usual_values
from winchkit.effects.effect import Effect, Values
from winchkit.model.stages import OUTPUT_UNITS

_ROUNDING = 1e-9
"""SI, of metres and newtons."""


def broken_promises(effect: Effect) -> list[str]:
    """Messages on an effect that changes its input at the null or gives no finite values. Raises
    FileError where its function fails.
    """
    # Divisions by zero in a user's function are reported below, not as a warning.
    with np.errstate(all="ignore"):
        still, moved = signature(effect, effect.null), signature(effect)
    out = []
    for name, change in still.changes.items():
        by = float(np.max(np.abs(change)))
        size = (
            f"by up to {by:.3g} {OUTPUT_UNITS[name]}"
            if np.isfinite(by)
            else "to a value that is not finite"
        )
        if not by <= _ROUNDING:
            out.append(
                f"changes the {name.replace('_', ' ')} {size} where it should vanish "
                f"({_listed(effect, effect.null)}); at its null it must return its input"
            )
    out += [
        f"gives no finite {name.replace('_', ' ')} anywhere on the standard motion, with "
        f"{_listed(effect, usual_values(effect))}; correct its formula or its typical values"
        for name, change in moved.changes.items()
        if name not in still.changes and not np.isfinite(change).any()
    ]
    return out


def _listed(effect: Effect, values: Values) -> str:
    sizes = [p.name for p in effect.parameters if p.role == "amplitude"]
    return ", ".join(f"{name} = {values[name]:g}" for name in sizes)

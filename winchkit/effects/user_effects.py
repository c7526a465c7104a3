"""Whether a user's own effect keeps what every effect promises, on the standard motion."""

from __future__ import annotations

import numpy as np

from winchkit.effects.card import UNITS, signature, usual_values
from winchkit.effects.effect import Effect, Values

__all__ = ["broken_promises"]

_ROUNDING = 1e-9
"""SI, of metres and newtons."""


def broken_promises(effect: Effect) -> list[str]:
    """What is wrong, in words: it does something at its null, or gives no numbers at a usual size.

    Raises FileError where its function fails.
    """
    # What a function of a user's own divides by is told in words below, not as a warning.
    with np.errstate(all="ignore"):
        still, moved = signature(effect, effect.null), signature(effect)
    out = []
    for name, change in still.changes.items():
        by = float(np.max(np.abs(change)))
        told = f"by up to {by:.3g} {UNITS[name]}" if np.isfinite(by) else "into no number"
        if not by <= _ROUNDING:
            out.append(
                f"changes the {name.replace('_', ' ')} {told} where it should vanish "
                f"({_told(effect, effect.null)}); at its null it must return the value as it is"
            )
    out += [
        f"gives no number for the {name.replace('_', ' ')} anywhere on the standard motion, with "
        f"{_told(effect, usual_values(effect))}; mend its formula or its typical values"
        for name, change in moved.changes.items()
        if name not in still.changes and not np.isfinite(change).any()
    ]
    return out


def _told(effect: Effect, values: Values) -> str:
    sizes = [p.name for p in effect.parameters if p.role == "amplitude"]
    return ", ".join(f"{name} = {values[name]:g}" for name in sizes)

"""What poses must be for a robot's calibration: enough, not a whole log, and of this robot."""

from __future__ import annotations

import numpy as np

from winchkit.calibration.robot_equations import Equations
from winchkit.calibration.robot_parameters import Parameters
from winchkit.errors import UsageError

__all__ = ["outside_bounds", "refuse_unfit"]

_FEW, _MOST = 3, 20_000
_REACH = 2.0


def refuse_unfit(equations: Equations) -> None:
    """Raise UsageError for poses that are too few, too many, or of another robot.

    Something must be left over for parameters once the poses are found.
    """
    measured, many = equations.measured, len(equations.measured)
    known = sum(
        int(np.count_nonzero(np.isfinite(values)))
        for values in (
            measured.motor_angle,
            measured.position,
            measured.angles,
            measured.swivel,
            measured.cable_length,
        )
    )
    lines = measured.motor_angle.shape[1]
    if many > _MOST:
        raise UsageError(
            f"{many} rows: each is a pose at rest, and at most {_MOST} can be fitted; keep the "
            "rows where the platform stood"
        )
    _near(equations)
    if many < _FEW or known <= 6 * many:
        cure = f"record more poses (90 is a good number, {_FEW} the least)"
        if known <= 6 * many:
            cure = "measure more at each: positions, rotations, swivel angles or rope lengths"
        raise UsageError(
            f"{many} poses with {known} measured values cannot calibrate a robot of {lines} lines: "
            f"{6 * many} of them go into the poses themselves; {cure}"
        )


def _near(equations: Equations) -> None:
    """Refuse positions that no robot of this size can reach: another unit, or another frame."""
    exits, home = equations.robot.geometry.exit_point, equations.robot.home.position
    size = float(np.max(np.linalg.norm(exits[:, None] - exits, axis=2)))
    away = np.linalg.norm(equations.measured.position - home, axis=1)
    away = away[np.isfinite(away)]
    if len(away) and float(np.median(away)) > _REACH * size:
        raise UsageError(
            f"the positions measured lie {float(np.median(away)):.4g} m from home, in a robot "
            f"whose exit points are at most {size:.4g} m apart; is platform_x … in its unit and in "
            "the base frame?"
        )


def outside_bounds(parameters: Parameters) -> list[str]:
    """Nominal values that their own bounds exclude: a bound, or the profile, is mistaken."""
    names = [p.name for p in parameters if p.std > 0 and not p.low <= p.nominal <= p.high]
    if not names:
        return []
    return [f"nominal values outside their bounds, begun from the bound: {', '.join(names)}"]

"""Figure of a winch's profile: the drum over its cable length."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from winchkit.effects.bind import line_of
from winchkit.errors import UsageError
from winchkit.report.notebook.style import BLUE, WIDTH, Size, new_figure
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LENGTHS = 400
"""Points of a curve, one for two or three pixels."""
_TURN = 2 * np.pi


def winch_figure(profile: WinchProfile, *, figsize: Size = None) -> Figure:
    """Motor angle, and cable per drum angle, over the cable length.

    ``figsize``: width and height, inches.
    """
    longest = profile.reference.cable_length
    if isinstance(profile, AxisProfile) or not longest:
        raise UsageError(
            f"profile '{profile.name}' has no reference.cable_length: there is no cable to draw"
        )
    line = line_of(profile)
    lengths = np.linspace(0.0, longest, _LENGTHS)
    angles = line.nominal_motor_angle(lengths)
    arms = np.array([line.arm(float(angle)) for angle in angles]) * profile.gearbox.ratio
    with new_figure(figsize or (WIDTH, 2.4)) as figure:
        left, right = figure.subplots(1, 2)
        left.plot(lengths, angles / _TURN, color=BLUE)
        left.set_ylabel("Motor angle [turns]")
        right.plot(lengths, np.abs(arms) * 1e3, color=BLUE)
        right.set_ylabel("Cable per drum angle [mm/rad]")
        for axis in (left, right):
            axis.set_xlabel("cable length [m]")
        figure.suptitle(profile.name, x=0.0, ha="left", fontsize=8)
    return figure

"""Preview of a robot programme: what it would do, planned from the home pose."""

from __future__ import annotations

from typing import Any

import numpy as np

from winchkit.errors import UsageError
from winchkit.plain_json import significant
from winchkit.robot.bench.planner import Planner
from winchkit.robot.bench.programme import planned_motions
from winchkit.schema.bench import BenchSpec
from winchkit.schema.robot_programme import RobotProgramme

_DIGITS = 6
"""Significant digits of positions on the page: a micrometre of a metre."""


def preview(declared: RobotProgramme, spec: BenchSpec) -> dict[str, Any]:
    """Duration (s), steps in words, and the path of the platform: ``time`` (s), ``curves`` in m."""
    planner = Planner.of(spec)
    motions, _ = planned_motions(planner, declared, planner.robot.home)
    now, time, places = 0.0, [], []
    for motion in motions:
        if isinstance(motion, float):
            now += motion
            continue
        time.append(now + motion.time)
        places.append(motion.pose.position)
        now += motion.duration
    if not time:
        raise UsageError(f"the programme '{declared.name}' moves nothing")
    position = np.concatenate(places)
    return {
        "duration": now,
        "steps": [f"{len(declared.step)} steps, planned from the home pose"],
        "asks": [],
        "time": significant(np.concatenate(time), _DIGITS),
        "curves": {axis: significant(position[:, i], _DIGITS) for i, axis in enumerate("xyz")},
    }

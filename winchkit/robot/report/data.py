"""The poses of a diagnosis in its report: their number, a table of the runs, what they lack."""

from __future__ import annotations

import numpy as np

from winchkit.report.html.markup import Markup, table
from winchkit.robot.diagnosis.dataset import RobotDataset
from winchkit.robot.diagnosis.diagnose import RobotAnswer
from winchkit.robot.diagnosis.preparation import missing_pose_excitation


def size_text(dataset: RobotDataset) -> str:
    """``90 poses of 8 cables``."""
    return f"{len(dataset.pose)} poses of {len(dataset.names)} cables"


def runs_table(dataset: RobotDataset) -> Markup:
    """Runs of a robot: a row is a pose."""
    often = np.bincount(dataset.pose)
    rows = []
    for number, name in enumerate(dataset.runs):
        own = dataset.pose[dataset.measured.run == number]
        again = int(np.count_nonzero(often[own] > 1))
        rows.append([name, f"{len(own)}", f"{len(np.unique(own))}", f"{again}"])
    head = ["run", "poses", "distinct", "repeated"]
    return table("Runs; a row of a run is a pose.", head, rows)


def limits(answer: RobotAnswer) -> list[str]:
    """Notes on what the poses cannot show, which are no fault of them."""
    return list(missing_pose_excitation(answer.selection.preparation))

"""Poses of the CABTIVE robot for the tests, made by benchmarks/robot_poses, not by winchkit."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from math import radians
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from robot_poses.truth import Noise, Row, Truth, csv, poses
from winchkit.catalog import find
from winchkit.robot import Robot, robot_of
from winchkit.robot.files.poses import MeasuredPoses, read_poses
from winchkit.runs import read_run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_robot

EXACT = Noise(tracker=0.0, encoder=0.0, angle=0.0)
ELASTIC = Truth(stiffness=2e4, home_tension=30.0)


@lru_cache(maxsize=1)
def robot() -> Robot:
    """As it was designed."""
    return robot_of(read_robot(find("profiles", "cabtive")))


def with_turns(turns: float) -> Robot:
    """The robot with another number of turns wound at home."""
    lines = []
    for line in robot().profile.line:
        winch = line.winch
        assert isinstance(winch, WinchProfile)
        reference = replace(winch.reference, wound_turns=turns)
        lines.append(replace(line, winch=replace(winch, reference=reference)))
    return robot_of(replace(robot().profile, line=tuple(lines)))


@lru_cache(maxsize=32)
def rows(
    count: int = 90,
    seed: int = 1,
    box: float = 0.075,
    tilt: float = radians(7.5),
    noise: Noise | None = None,
    truth: Truth | None = None,
) -> tuple[Row, ...]:
    return tuple(poses(truth or Truth(), count, seed, box=box, tilt=tilt, noise=noise))


@lru_cache(maxsize=4)
def elastic_rows(count: int, seed: int, noise: Noise | None = None) -> tuple[Row, ...]:
    """With cables that stretch, under tensions between 20 and 60 N."""
    pull: Callable[[random.Random], float] = lambda rng: rng.uniform(20.0, 60.0)  # noqa: E731
    return tuple(poses(ELASTIC, count, seed, noise=noise, tension=pull))


def measured(*texts: str) -> MeasuredPoses:
    """Runs' texts as the poses that are read from them."""
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / f"poses-{number}.csv" for number in range(len(texts))]
        for path, text in zip(paths, texts, strict=True):
            path.write_text(text)
        return read_poses([read_run(path) for path in paths], robot().profile)


def held() -> MeasuredPoses:
    """Poses without any noise, to judge by."""
    return measured(csv(rows(40, 99, noise=EXACT), angles=True))


def true_values(truth: Truth | None = None) -> dict[str, float]:
    """The 65 parameters by name."""
    truth = truth or Truth()
    out = {"layer_growth": truth.growth}
    for i in range(len(truth.exit)):
        for k, axis in enumerate("xyz"):
            out[f"{i + 1}.exit_point.{axis}"] = truth.exit[i][k]
            out[f"{i + 1}.anchor_point.{axis}"] = truth.anchor[i][k]
        out[f"{i + 1}.swivel_radius"] = truth.swivel[i]
        out[f"{i + 1}.winding_radius"] = truth.winding[i]
    assert np.all(np.isfinite(list(out.values())))
    return out

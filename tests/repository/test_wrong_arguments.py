"""Public functions given a path for a run, a run for a path, nothing or another type: our errors.

The functions and their parameters are those of the public names; a parameter takes part where its
annotation is a file, a type of winchkit or a list of one of these.
"""

from __future__ import annotations

import inspect
import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import winchkit
from snippets import ROOT
from winchkit.errors import WinchkitError
from winchkit.robot.files.poses import read_poses

FILES = r"str \| Path|PathLike|Path|Wiring"
OURS = r"Run|WinchProfile|RobotProfile|Robot|Measured|Log|CalibrationPoint|Calibrated|WinchAnswer"
OURS += (
    r"|Profile|Answer|RobotAnswer|Addition|Removal|Programme|SimBench|SizeSpec|BenchSpec|Tracker"
)
TAKES = re.compile(rf"({FILES}|{OURS}|\||Sequence|Mapping|None|str|[\[\], ])+")
FACES = runpy.run_path(str(ROOT / "docs/make_api.py"))
FUNCTIONS = {
    name: value
    for title, names in FACES["SECTIONS"].items()
    for name in names
    if inspect.isfunction(value := getattr(FACES["face_of"](title), name))
}
MEANT = re.compile(rf"\b({FILES}|{OURS})\b")
CASES = [
    (name, parameter.name)
    for name, value in FUNCTIONS.items()
    for parameter in inspect.signature(value).parameters.values()
    if TAKES.fullmatch(str(parameter.annotation)) and MEANT.search(str(parameter.annotation))
]


@pytest.fixture(scope="module")
def winch_run(tmp_path_factory: pytest.TempPathFactory) -> winchkit.Run:
    path = tmp_path_factory.mktemp("wrong") / "a.csv"
    rows = [f"{k * 0.02},{k * 0.1},{100 + k}" for k in range(60)]
    path.write_text("\n".join(["time [s],motor_angle [rad],tension [N]", *rows]), encoding="utf-8")
    return winchkit.read_run(path)


@pytest.fixture(scope="module")
def valid(winch_run: winchkit.Run, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A right value by annotation, as far as one is at hand without a computation."""
    robot = winchkit.robot.read_robot(winchkit.find("profiles", "cabtive"))
    columns = [f"{line.name}.motor_angle [rad]" for line in robot.line]
    rows = [",".join([str(k), *["0.1" if k % 2 else str(k)] * len(columns)]) for k in range(12)]
    poses = tmp_path_factory.mktemp("poses") / "p.csv"
    poses.write_text("\n".join([",".join(["time [s]", *columns]), *rows]), encoding="utf-8")
    return {
        "Sequence[Run]": [winch_run],
        "Mapping[str, Sequence[Run]]": {"A": [winch_run]},
        "Run": winch_run,
        "WinchProfile": winchkit.read_profile(winchkit.find("profiles", "bench-spiral")),
        "Profile": winchkit.read_profile(winchkit.find("profiles", "bench-spiral")),
        "Mapping[str, WinchProfile]": {},
        "RobotProfile": robot,
        "Robot": winchkit.robot.robot_of(robot),
        "SimBench": winchkit.read_simbench(winchkit.find("sim", "demo-elastic-rope")),
        "MeasuredPoses": read_poses([winchkit.read_run(poses)], robot),
        "str | Path": poses.parent / "absent.py",
        "Sequence[str | Path]": [winch_run.path],
        "Sequence[str]": [winch_run.path],
        "str": "gear-ratio",
        "int": 1,
    }


def given(run: winchkit.Run) -> dict[str, Any]:
    path = run.path
    return {
        "path": path,
        "paths": [path],
        "empty": [],
        "None": None,
        "number": 7.5,
        "numbers": [7.5],
        "run": run,
        "runs": [run],
    }


def accepted(annotation: str, kind: str) -> bool:
    """Whether a value is of the type that is declared."""
    one, several = re.search(rf"^(?:.* \| )?({FILES})\b", annotation), "Sequence[" in annotation
    return (
        (kind == "None" and "None" in annotation)
        or (kind == "path" and one is not None)
        or (kind == "paths" and (one is not None or "Sequence[str" in annotation))
        or (kind == "runs" and annotation == "Sequence[Run]")
        or (kind == "run" and annotation in {"Run", "Run | None"})
        or (kind == "empty" and several and annotation != "Sequence[Run]")
    )


def finished(result: object) -> None:
    """Take the first item of an iterator, which then has read its arguments."""
    if isinstance(result, Iterator):
        next(result)


@pytest.mark.parametrize(("function", "parameter"), CASES, ids=[".".join(c) for c in CASES])
def test_a_wrong_argument_is_named(
    function: str,
    parameter: str,
    winch_run: winchkit.Run,
    valid: dict[str, Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    called = FUNCTIONS[function]
    signature = inspect.signature(called)
    annotation = str(signature.parameters[parameter].annotation)
    others = {
        other.name: valid.get(str(other.annotation))
        for other in signature.parameters.values()
        if other.default is inspect.Parameter.empty and other.kind is not other.VAR_POSITIONAL
    }
    for kind, value in given(winch_run).items():
        if accepted(annotation, kind):
            continue
        with pytest.raises(WinchkitError) as error:
            finished(called(**{**others, parameter: value}))
        assert str(error.value), kind
        if re.search(rf"^(Sequence\[|Mapping\[str, Sequence\[)?({OURS})\b", annotation):
            assert kind == "empty" or str(error.value).startswith(parameter), (kind, error.value)


def test_all_public_functions_that_take_runs_are_tried() -> None:
    tried = {name for name, _ in CASES}
    takes = {
        name
        for name, value in FUNCTIONS.items()
        if any(
            p in inspect.signature(value).parameters
            for p in ("runs", "run", "winches", "fit", "paths")
        )
    }
    assert takes <= tried
    assert len(takes) > 10


def test_a_run_none_of_whose_outputs_is_predicted_is_refused(winch_run: winchkit.Run) -> None:
    profile = winchkit.read_profile(ROOT / "profiles/bench-spiral.toml")
    for call in (winchkit.compare, winchkit.diagnose):
        with pytest.raises(winchkit.RunError, match=r"nothing of tension .*'load_mass'"):
            call([winch_run], profile)

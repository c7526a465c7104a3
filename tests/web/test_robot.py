"""The Robot view: poses calibrated through the page's server, its picture and its slice."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")

from starlette.testclient import TestClient

from robot_poses.truth import Truth, csv, poses
from winchkit.schema.read import read_robot
from winchkit.web.application import application
from winchkit.web.views import views_of
from winchkit.web.workspace import DiagnoseView

TOKEN = "t0ken"
HEADERS = {"x-winchkit-token": TOKEN}
LIMITS = "low=20&high=150"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    folder = tmp_path_factory.mktemp("page")
    workspace = DiagnoseView(folder)
    app = application(workspace, TOKEN, views_of(workspace, folder))
    with TestClient(app, base_url="http://127.0.0.1:1234") as opened:
        opened.workspace = workspace  # type: ignore[attr-defined]
        yield opened


@pytest.fixture(scope="module")
def calibrated(client: TestClient) -> Any:
    """View after a robot's profile was chosen and 60 poses were dropped."""
    text = csv(poses(Truth(), 60, 7), angles=True)
    order = json.dumps({"do": "profile", "name": "cabtive"})
    assert client.post("/api/do", content=order, headers=HEADERS).status_code == 202
    headers = {**HEADERS, "x-file-name": "poses.csv", "x-view": "robot"}
    assert client.post("/api/drop", content=text, headers=headers).status_code == 202
    client.workspace._pool.submit(lambda: None).result(120)  # type: ignore[attr-defined]
    view = client.get("/api/view", headers=HEADERS).json()
    assert view["faults"] == []
    assert view["robot"]["name"] == "cabtive"
    return get(client, "/api/robot")


def get(client: TestClient, path: str) -> Any:
    answer = client.get(path, headers=HEADERS)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_error_falls_and_the_profile_can_be_saved(
    client: TestClient, calibrated: Any, tmp_path: Path
) -> None:
    found = calibrated["calibration"]
    assert (calibrated["poses"], calibrated["held_out"]) == (60, 6)
    assert found["after"] < 0.1 * found["before"]
    assert len(found["arrows"]["at"]) == 6
    lengths = np.linalg.norm(found["arrows"]["before"], axis=1)
    assert np.sqrt(np.mean(lengths**2)) == pytest.approx(found["before"], rel=1e-3)
    assert all(np.array(found["cables"]["after"]) < found["cables"]["before"])
    saved = client.get("/api/robot/profile", headers=HEADERS)
    path = tmp_path / "better.toml"
    path.write_text(saved.text)
    assert read_robot(path).fitted is not None
    assert "Pose error falls" in client.get("/api/robot/report", headers=HEADERS).text


def test_the_forces_of_a_picture_hold_the_platform(client: TestClient, calibrated: Any) -> None:
    seen = get(client, f"/api/robot/picture?row=0&{LIMITS}")
    force, exits = np.array(seen["tension"]), np.array(calibrated["exit_points"])
    assert seen["source"] == "computed"
    assert np.all((force >= 20) & (force <= 150))
    # Straight cables: the swivel pulleys' arcs move their directions by a few degrees only.
    along = exits - np.array(seen["anchors"])
    along /= np.linalg.norm(along, axis=1)[:, None]
    weight = 9.81 * calibrated["mass"]
    assert force @ along == pytest.approx([0.0, 0.0, weight], abs=0.1 * force.sum() / 8)
    low, high = np.min(seen["corners"], axis=0), np.max(seen["corners"], axis=0)
    assert np.all(low <= np.array(seen["anchors"]) + 1e-9)
    assert np.all(np.array(seen["anchors"]) <= high + 1e-9)


@pytest.mark.slow
def test_a_slice_is_feasible_in_the_middle_and_not_at_the_frame(
    client: TestClient, calibrated: Any
) -> None:
    home = get(client, f"/api/robot/picture?row=0&{LIMITS}")["position"]
    found = get(client, f"/api/robot/slice?z={home[2]}&row=0&{LIMITS}")
    margin = np.array([[np.nan if v is None else v for v in row] for row in found["margin"]])
    middle = np.argmin(np.abs(np.array(found["y"]) - home[1]))
    across = np.argmin(np.abs(np.array(found["x"]) - home[0]))
    assert margin[middle, across] > 0
    border = np.concatenate([margin[0], margin[-1], margin[:, 0], margin[:, -1]])
    assert not np.any(border > 0), "no platform hangs at the frame itself"
    assert 0 < np.nanmax(margin) <= 65, "at most half of the range of the forces"


def test_wrong_requests_are_refused_in_words(client: TestClient, calibrated: Any) -> None:
    for path in (
        f"/api/robot/picture?row=61&{LIMITS}",
        "/api/robot/picture?row=0",
        "/api/robot/picture?row=0&low=9&high=3",
        f"/api/robot/slice?z=low&row=0&{LIMITS}",
    ):
        answer = client.get(path, headers=HEADERS)
        assert answer.status_code == 400, path
        assert answer.json()["error"]
    assert client.get(f"/api/robot/picture?row=0&{LIMITS}").status_code == 403


def test_poses_of_another_robot_are_a_fault_and_lose_nothing(
    client: TestClient, calibrated: Any
) -> None:
    headers = {**HEADERS, "x-file-name": "other.csv", "x-view": "robot"}
    client.post("/api/drop", content=b"time [s],A.motor_angle [rad]\n0,0\n1,1\n", headers=headers)
    client.workspace._pool.submit(lambda: None).result(120)  # type: ignore[attr-defined]
    view = client.get("/api/view", headers=HEADERS).json()
    assert view["faults"]
    assert get(client, "/api/robot")["calibration"] == calibrated["calibration"]

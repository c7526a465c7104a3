"""The page's server: what it refuses, and the whole story by requests alone."""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command_line import own_process

pytest.importorskip("starlette")
pytest.importorskip("httpx2")

from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from winchkit.diagnosis.add import add
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.write import write_addition
from winchkit.fleet import index_library
from winchkit.fleet.library.partitions import Partitions
from winchkit.fleet.web.runs import Library
from winchkit.runs.read import read_run
from winchkit.runs.writer import write_run
from winchkit.schema.read import read_profile
from winchkit.web.application import application
from winchkit.web.examples import example_runs
from winchkit.web.state import Judgement
from winchkit.web.views import views_of
from winchkit.web.words import INTERNAL
from winchkit.web.workspace import DiagnoseView

TOKEN = "t0ken"
HEADERS = {"x-winchkit-token": TOKEN}
PATIENCE = 120.0


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs of a bench whose drum is fatter than its profile says."""
    folder = tmp_path_factory.mktemp("runs")
    for run in example_runs("demo-fat-drum").runs:
        write_run(run, folder / f"{run.name}.csv")
    return folder


@pytest.fixture(scope="module")
def client(recorded: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    workspace = DiagnoseView(tmp_path_factory.mktemp("page"))
    app = application(workspace, TOKEN, views_of(workspace, recorded))
    with TestClient(app, base_url="http://127.0.0.1:1234") as opened:
        opened.workspace = workspace  # type: ignore[attr-defined]
        yield opened


def get(client: TestClient, path: str) -> Any:
    return client.get(path, headers=HEADERS).json()


def do(client: TestClient, action: str, **more: Any) -> None:
    answer = client.post("/api/do", content=json.dumps({"do": action, **more}), headers=HEADERS)
    assert answer.status_code == 202, answer.text


def settled(client: TestClient) -> Any:
    """View as soon as nothing is under way."""
    end = time.monotonic() + PATIENCE
    client.workspace._pool.submit(lambda: None).result(PATIENCE)  # type: ignore[attr-defined]
    while time.monotonic() < end:
        view = get(client, "/api/view")
        if view["busy"] is None:
            return view
        time.sleep(0.01)
    raise AssertionError("still busy")


def test_foreign_requests_are_refused(client: TestClient) -> None:
    assert client.get("/").status_code == 200
    assert client.get("/api/view").status_code == 403
    assert client.get("/api/view", headers={"x-winchkit-token": "wrong"}).status_code == 403
    foreign = {**HEADERS, "origin": "http://evil.example"}
    assert client.get("/api/view", headers=foreign).status_code == 403
    assert client.get("/", headers={"host": "evil.example:1234"}).status_code == 403
    own = {**HEADERS, "origin": "http://127.0.0.1:1234"}
    assert client.get("/api/view", headers=own).status_code == 200


def test_a_socket_without_the_token_or_from_elsewhere_is_closed(client: TestClient) -> None:
    for path, headers in (
        ("/live", {}),
        (f"/live?token={TOKEN}", {"origin": "http://evil.example"}),
    ):
        with (
            pytest.raises(WebSocketDisconnect) as refused,
            client.websocket_connect(path, headers=headers),
        ):
            pass
        assert refused.value.code == 1008


def test_the_server_starts_without_the_statistics_of_a_fleet() -> None:
    code = "import sys; import winchkit.web.application; print('scipy.stats' in sys.modules)"
    done = own_process(sys.executable, "-c", code)
    assert done.stdout == "False\n"


def test_nothing_but_this_server_may_be_loaded(client: TestClient) -> None:
    policy = client.get("/").headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    text = client.get("/").text + "".join(
        client.get(f"/static/{name}").text
        for name in (
            "main.js",
            "page.js",
            "plots.js",
            "diagnose.js",
            "bench.js",
            "library.js",
            "robot.js",
            "exports.js",
            "fleet.js",
            "import.js",
            "figures.js",
            "sides.js",
            "model_errors.js",
            "channels.js",
        )
    )
    assert "https://" not in text
    assert "innerHTML" not in text, "names in files must not become markup"


@pytest.mark.parametrize(
    "body", ["", "[]", "{}", '{"do": "fly"}', '{"do": "mystery", "seed": "x"}', "{" * 70_000]
)
def test_malformed_requests_are_refused(client: TestClient, body: str) -> None:
    answer = client.post("/api/do", content=body, headers=HEADERS)
    assert answer.status_code == 400
    assert answer.json()["error"]


def test_a_file_of_another_program_opens_its_columns(client: TestClient) -> None:
    rows = "\n".join(
        f"{i * 0.02:.2f};{57.3 * np.sin(0.02 * i):.3f};{9 + i % 3}" for i in range(300)
    )
    text = f"Zeit [s];Pos [deg];Kraft\n{rows}\n"
    headers = {**HEADERS, "x-file-name": "..%2F..%2Flogger%20%3Cb%3E.csv"}
    found = client.post("/api/drop", content=text.encode(), headers=headers).json()
    assert ".." not in found["file"]
    assert "<" not in found["file"]
    channels = {row["source"]: row["channel"] for row in found["import"]["columns"]}
    assert channels["Pos"] == "motor_angle"
    assert found["import"]["questions"], "the unit of Kraft is not known"
    answers = {"columns": ["tension=Kraft [N]"], "load_mass": "1 kg"}
    again = client.post(
        "/api/guess",
        content=json.dumps({"file": found["file"], "answers": answers}),
        headers=HEADERS,
    ).json()
    assert again["import"]["questions"] == []
    before = len(get(client, "/api/view")["runs"])
    do(client, "import", file=found["file"], answers=answers)
    view = settled(client)
    assert len(view["runs"]) == before + 1
    name = view["runs"][-1]["name"]
    assert view["runs"][-1]["load"] == "1 kg"
    do(client, "remove", name=name)
    assert len(settled(client)["runs"]) == before


def test_constants_are_read_as_on_the_command_line(client: TestClient) -> None:
    rows = "\n".join(f"{i * 0.1:.1f};{i};{i % 7}" for i in range(90))
    headers = {**HEADERS, "x-file-name": "bridge.csv"}
    text = f"t [s];Pos [deg];cell [mV/V]\n{rows}\n"
    found = client.post("/api/drop", content=text.encode(), headers=headers).json()
    assert {q["key"] for q in found["import"]["questions"]} == {"sensitivity", "capacity"}
    answers = {"sensitivity": "2 mV/V", "capacity": "500N"}
    asked = json.dumps({"file": found["file"], "answers": answers})
    again = client.post("/api/guess", content=asked, headers=HEADERS).json()
    assert again["import"]["questions"] == []
    refused = client.post("/api/guess", content=asked.replace("500N", "5 kg"), headers=HEADERS)
    assert refused.status_code == 400


@pytest.mark.slow
def test_look_learn_add_and_the_error_falls(
    client: TestClient, recorded: Path, tmp_path: Path
) -> None:
    for path in sorted(recorded.glob("*.csv")):
        headers = {**HEADERS, "x-file-name": path.name}
        assert (
            client.post("/api/drop", content=path.read_bytes(), headers=headers).status_code == 202
        )
    do(client, "profile", name="bench-spiral")
    view = settled(client)
    assert view["faults"] == []
    first = view["diagnosis"]
    assert first["verdict"] == "explained"
    effect = next(row for row in first["models"]["rows"] if row["kind"] == "candidate")["effect"]
    assert effect in {"drum-radius", "gear-ratio"}, "these runs do not distinguish the two"

    card = get(client, f"/api/card?effect={effect}")
    assert card["parameters"][0]["text"]
    assert np.corrcoef(card["signature"]["means"], card["signature"]["signature"])[0, 1] > 0.9

    before = _today(first)
    workspace = client.workspace  # type: ignore[attr-defined]
    wake, shown = workspace.changed, []
    workspace.changed = lambda: (shown.append(workspace.view()["diagnosis"]), wake())
    do(client, "add", effect=effect)
    view = settled(client)
    workspace.changed = wake
    refit = next(found for found in shown if found["verdict"] == "refitted")
    kinds = [row["kind"] for row in refit["models"]["rows"]]
    assert kinds == ["history", "today", "floor"], "shown before it is diagnosed"
    assert _today(refit) == pytest.approx(_today(view["diagnosis"]), rel=0.05)
    _is_that_of_the_command_line(workspace, effect, tmp_path / "better.toml")
    after = _today(view["diagnosis"])
    assert min(after[o] / before[o] for o in before) < 0.6
    assert view["diagnosis"]["verdict"] == "adequate"
    assert [row["kind"] for row in view["diagnosis"]["models"]["rows"]].count("history") == 1
    assert view["profile"]["added"] == [effect]
    saved = client.get("/api/profile", headers=HEADERS)
    assert effect in saved.text
    assert "<!DOCTYPE html>" in client.get("/api/report", headers=HEADERS).text
    assert any(line.startswith(f"winchkit add {effect}") for line in view["commands"])

    _both_sides_have_one_axis(client, before, view)

    do(client, "undo")  # needs no fit
    view = settled(client)
    assert _today(view["diagnosis"]) == pytest.approx(before)
    assert effect not in client.get("/api/profile", headers=HEADERS).text


def _both_sides_have_one_axis(client: TestClient, before: dict[str, float], after: Any) -> None:
    """The earlier profile beside the present one: its errors, in the same units, and back."""
    names = [run["name"] for run in after["runs"]]
    do(client, "compare", profile=0, runs=names)
    view = settled(client)
    assert _today(view["beside"]["diagnosis"]) == pytest.approx(before)
    models = [side["diagnosis"]["models"] for side in (view, view["beside"])]
    assert models[0]["columns"] == models[1]["columns"]
    for output in before:
        (own, other) = (get(client, f"/api/curve?output={output}{s}") for s in ("", "&beside=1"))
        assert (own["unit"], own["residual_unit"]) == (other["unit"], other["residual_unit"])
        assert own["residual"] != other["residual"]
    wanted = "/api/multiples?output=tension&over=speed&over=load"
    for path in (wanted, f"{wanted}&beside=1"):
        assert [panel["variable"] for panel in get(client, path)["panels"]] == ["speed", "load"]
    do(client, "swap")
    swapped = settled(client)
    assert swapped["profile"]["added"] == []
    assert swapped["beside"]["profile"] == after["profile"]
    do(client, "swap")
    do(client, "compare", profile=7, runs=names)
    assert "there is no version 7" in settled(client)["faults"][0]
    do(client, "end")
    assert settled(client)["beside"] is None


def _is_that_of_the_command_line(workspace: DiagnoseView, effect: str, path: Path) -> None:
    """The refitted profile of the page, and its errors, are those of ``add`` and ``diagnose``."""
    earlier, present = (version.path for version in workspace.state.versions)
    runs = [item.run for item in workspace.state.runs]
    names = [item.name for item in workspace.state.runs]
    write_addition(earlier, add(effect, runs, read_profile(earlier)), names, path)
    assert path.read_text() == present.read_text()
    answer = workspace.state.answer
    assert answer is not None
    for output, found in diagnose(runs, read_profile(path)).diagnosis.outputs.items():
        shown = answer.diagnosis.outputs[output].heldout_rms_before
        assert shown == pytest.approx(found.heldout_rms_before, rel=1e-9)


def _today(diagnosis: Any) -> dict[str, float]:
    row = next(row for row in diagnosis["models"]["rows"] if row["kind"] == "today")
    return {output: cell["ratio"] for output, cell in row["cells"].items()}


@pytest.mark.slow
def test_curves_keep_the_extremes_and_a_zoom_shows_every_sample(client: TestClient) -> None:
    settled(client)
    curves = client.workspace.curves("tension")  # type: ignore[attr-defined]
    whole = get(client, "/api/curve?output=tension&points=200")
    worth = curves.scale.worth
    torque = client.workspace.curves("motor_torque")  # type: ignore[attr-defined]
    # Both are within the band of the comparison: a raw torque less a low-passed residual is not.
    traces = client.workspace.state.answer.diagnosis.traces  # type: ignore[attr-defined]
    shown = np.concatenate([t.measured for t in traces if t.output == "motor_torque"])
    np.testing.assert_array_equal(torque.measured, shown)
    drawn = np.array([np.nan if v is None else v for v in whole["residual"]])
    assert np.nanmax(drawn) == pytest.approx(np.nanmax(curves.residual) / worth, rel=1e-4)
    assert np.nanmin(drawn) == pytest.approx(np.nanmin(curves.residual) / worth, rel=1e-4)
    first, last = curves.time[100], curves.time[140]
    part = get(client, f"/api/curve?output=tension&points=400&from={first}&to={last}")
    assert len(part["x"]) == 41
    panels = get(client, "/api/multiples?output=tension")
    shares = [panel["share"] for panel in panels["panels"]]
    assert shares == sorted(shares, reverse=True)
    assert {len(panel["x"]) for panel in panels["panels"]} == {len(panels["residual"])}
    assert client.get("/api/curve?output=speed", headers=HEADERS).status_code == 400


def test_a_bad_file_is_reported_and_the_others_load(client: TestClient) -> None:
    headers = {**HEADERS, "x-file-name": "noise.bin"}
    answer = client.post("/api/drop", content=bytes(range(256)) * 40, headers=headers)
    assert answer.status_code == 400
    assert "noise" in answer.json()["error"]
    do(client, "profile", name="no-such-profile")
    assert "no-such-profile" in settled(client)["faults"][0]


def test_the_library_lists_and_overlays(client: TestClient, recorded: Path) -> None:
    (recorded / "broken.csv").write_text("time\nx\n")
    found = get(client, "/api/runs")
    assert len(found["runs"]) == len(list(recorded.glob("*.csv")))
    assert "fault" in next(row for row in found["runs"] if row["name"] == "broken.csv")
    name = next(row["name"] for row in found["runs"] if "fault" not in row)
    (line,) = get(client, f"/api/overlay?channel=tension&name={name}")["lines"]
    run = read_run(recorded / name)
    assert np.nanmax(np.array(line["y"], dtype=float)) == pytest.approx(
        run["tension"].max(), rel=1e-4
    )
    other = next(row["name"] for row in found["runs"] if "fault" not in row and row["name"] != name)
    both = get(client, f"/api/overlay?channel=tension&name={name}&name={other}")["difference"]
    assert both["name"] == f"{other} less {name}"
    later, (t, y) = read_run(recorded / other), (run.time - run.time[0], run["tension"])
    at = later.time - later.time[0]
    change = (later["tension"] - np.interp(at, t, y))[at <= t[-1]]
    assert max(both["y"]) == pytest.approx(change.max(), rel=1e-4)
    assert min(both["y"]) == pytest.approx(change.min(), rel=1e-4)
    outside = client.get("/api/overlay?name=../../etc/passwd", headers=HEADERS)
    assert outside.status_code == 400


def test_verdicts_are_those_of_the_page_and_of_the_tables(recorded: Path, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    for name in ("A/one.csv", "B/two.csv"):
        (tmp_path / name).parent.mkdir()
        shutil.copy(recorded / "demo-fast-10kg-1.csv", tmp_path / name)
    index_library(tmp_path)
    tables = Partitions(tmp_path)
    outputs = {"tension": {"heldout_rms_before": 3.0, "noise_rms": 1.5}}
    told = {"winch": "A", "time": datetime(2026, 1, 5, tzinfo=UTC), "runs": ["A/one.csv"]}
    told |= {"verdict": "explained", "effects": ["drum-radius"], "profile_name": "p"}
    tables.change(
        "diagnoses", lambda row: False, [], [told | {"result": json.dumps({"outputs": outputs})}]
    )
    library = Library(tmp_path)
    judged = {tmp_path / "B/two.csv": Judgement("adequate", (), {}, "p + q")}
    rows = {row["name"]: row["verdict"] for row in library.rows(judged)["runs"]}
    assert rows["A/one.csv"]["cause"] == "winding radius of the drum"
    assert rows["A/one.csv"]["ratios"] == {"tension": 2.0}
    assert (rows["B/two.csv"]["chip"], rows["B/two.csv"]["profile"]) == ("Adequate", "p + q")
    (tmp_path / "A/one.csv").write_text("time\nx\n")
    changed = {row["name"]: row for row in library.rows()["runs"]}
    assert "fault" in changed["A/one.csv"], "a changed file is read, not its row of the index"
    assert changed["B/two.csv"]["verdict"] is None


@pytest.mark.slow
def test_a_cancelled_addition_leaves_the_profile_as_it_was(tmp_path: Path) -> None:
    workspace = DiagnoseView(tmp_path)
    workspace.example("demo-fat-drum").result(PATIENCE)
    before = workspace.view()
    effect = next(r["effect"] for r in before["diagnosis"]["models"]["rows"] if "effect" in r)
    workspace.changed = workspace.cancel
    workspace.add(effect).result(PATIENCE)
    after = workspace.view()
    assert "cancelled" in after["faults"][0]
    for key in ("profile", "diagnosis", "commands", "can_undo"):
        assert after[key] == before[key]
    workspace.close()


def test_an_unexpected_error_of_a_task_is_shown_and_not_lost(tmp_path: Path) -> None:
    workspace = DiagnoseView(tmp_path)
    workspace.task("calibrating", [].pop).result(60.0)
    view = workspace.view()
    assert view["busy"] is None
    assert view["faults"] == [f"calibrating: {INTERNAL}"]
    workspace.close()


def test_long_runs_are_drawn_before_they_are_compared(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("winchkit.web.work._LONG", 1000)
    seen: list[tuple[bool, list[str], bool]] = []
    workspace = DiagnoseView(tmp_path)

    def note() -> None:
        view = workspace.view()
        seen.append((view["compared"], view["outputs"], view["diagnosis"] is not None))

    workspace.changed = note
    workspace.open([str(path) for path in sorted(recorded.glob("*.csv"))], "bench-spiral").result(
        PATIENCE
    )
    outputs = ["cable_length", "tension", "motor_torque"]
    first = next(at for at, (_, drawn, _) in enumerate(seen) if drawn)
    assert seen[first] == (False, outputs, False)
    assert seen[-1] == (True, outputs, True)
    workspace.close()

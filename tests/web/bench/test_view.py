"""The Bench view without a browser: messages, programmes, drums, frames, settings of drives."""

from __future__ import annotations

import asyncio
import re
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")

from hypothesis import given
from hypothesis import strategies as st
from starlette.applications import Starlette
from starlette.testclient import TestClient

from declared import ONE_WINCH
from winchkit.catalog import find
from winchkit.errors import FileError, NotPermitted, UsageError, WinchkitError
from winchkit.runs.read import read_run
from winchkit.schema.bench import BenchSpec
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import read_simbench
from winchkit.schema.write import write_programme
from winchkit.web.application import _refused
from winchkit.web.bench.browser import Browser, Inbox
from winchkit.web.bench.drive_objects import (
    FrameWords,
    drive_objects,
    drive_settings,
    write_setting,
)
from winchkit.web.bench.live_model import CHANNELS, LiveModel
from winchkit.web.bench.messages import Message
from winchkit.web.bench.programmes import Programmes
from winchkit.web.bench.trip_file import trip_file
from winchkit.web.bench.view import BenchView


def taken(inbox: Inbox) -> list[Message]:
    """Everything that waits, in its order."""

    async def all_of() -> list[Message]:
        found = []
        while inbox._waiting:
            found.append(await inbox.next())
        return found

    return asyncio.run(all_of())


@given(st.lists(st.sampled_from(["jog", "refresh", "release", "step", "alive"])))
def test_of_jogs_that_wait_only_the_newest_is_left_and_every_other_message_ends_it(
    names: list[str],
) -> None:
    inbox = Inbox()
    for number, name in enumerate(names):
        inbox.put({"do": name, "number": number})
    left = taken(inbox)
    held = ("jog", "refresh")
    others = [n for n, name in enumerate(names) if name not in held]
    assert [item["number"] for item in left if item["do"] not in held] == others
    # Of those after the last other message: the last jog, and the last refresh after it.
    tail = names[others[-1] + 1 if others else 0 :]
    kept = [item["do"] for item in left if item["do"] in held]
    after = tail[len(tail) - tail[::-1].index("jog") :] if "jog" in tail else tail
    assert kept == ["jog"] * ("jog" in tail) + ["refresh"] * ("refresh" in after)


@pytest.mark.parametrize(
    ("message", "call"),
    [
        ({"do": "jog", "speed": 0.1}, ("jog", {"wind_in": 0.1})),
        ({"do": "jog", "speed": -0.1}, ("jog", {"pay_out": 0.1})),
        ({"do": "refresh", "speed": -0.1}, ("refresh", {"pay_out": 0.1})),
        ({"do": "release"}, ("release", {})),
        ({"do": "step", "change": 0.01, "speed": 0.1}, ("step", {"pay_out": 0.01, "speed": 0.1})),
        ({"do": "step", "change": -0.01, "speed": 0.1}, ("step", {"wind_in": 0.01, "speed": 0.1})),
        ({"do": "move", "to": 3.0, "speed": 0.1}, ("move", {"to": 3.0, "speed": 0.1})),
    ],
)
def test_a_message_of_the_page_names_the_direction(
    tmp_path: Path, message: dict[str, Any], call: tuple[str, dict[str, float]]
) -> None:
    """A jog's speed is positive for the button Wind in, a step's change for a longer cable."""
    seen: list[tuple[str, Any, dict[str, float]]] = []

    class Station:
        def __getattr__(self, name: str) -> Any:
            return lambda winch, **named: seen.append((name, winch, named))

        def close(self) -> None:
            pass

    spec = read_simbench(find("sim", "spiral-bench")).bench
    browser = Browser("page", spec, Programmes(spec, tmp_path, tmp_path))
    browser.take(Station())  # type: ignore[arg-type]
    browser.action({**message, "winch": "A"})()
    assert seen == [(call[0], "A", call[1])]


@pytest.mark.parametrize("phase", ["moving", "running down", "enabling", None])
def test_objects_are_not_read_where_a_winch_is_not_disabled(
    spec: BenchSpec, phase: str | None
) -> None:
    status = {} if phase is None else {"winch": {"A": {"phase": phase}}}
    with pytest.raises(UsageError, match="where it is disabled"):
        drive_objects(spec, status, "A")
    with pytest.raises(UsageError, match="there is no winch 'B'"):
        drive_objects(spec, status, "B")


@pytest.fixture(scope="module")
def spec() -> BenchSpec:
    return read_simbench(find("sim", "demo-adequate")).bench


def test_a_programme_is_planned_in_closed_form_and_compared_with_the_limits(
    spec: BenchSpec, tmp_path: Path
) -> None:
    work = tmp_path / "work"
    work.mkdir()
    programmes = Programmes(spec, tmp_path, work)
    steps = (
        ProgrammeStep(to=3.0, speed=0.1, acceleration=0.5),
        ProgrammeStep(ask="look"),
        ProgrammeStep(hold=2.0),
    )
    write_programme(Programme("own", steps), work / "own.toml")
    (work / "other.toml").write_text("no = 'programme'")
    found = programmes.preview("own.toml", {"A": 4.0})
    # Trapezoid with ramps of constant jerk: distance / speed + speed / acceleration + rise time.
    assert found["duration"] == pytest.approx(1.0 / 0.1 + 0.1 / 0.5 + 0.1 / 0.5 + 2.0, abs=0.11)
    assert found["curves"]["winch A"][0] == 4.0
    assert found["curves"]["winch A"][-1] == 3.0
    assert found["asks"] == [[pytest.approx(found["duration"] - 2.0), "look"]]
    with pytest.raises(UsageError, match="there are programme-demo"):
        programmes.preview("other.toml", {"A": 4.0})
    with pytest.raises(NotPermitted, match="step 1: the cable length of winch A is not known"):
        programmes.preview("own.toml", {})
    name = programmes.keep("../far.toml", (work / "own.toml").read_bytes().replace(b"3 m", b"9 m"))
    assert name == "far.toml"
    with pytest.raises(NotPermitted, match="step 1: a cable length of 9 m is beyond the limits"):
        programmes.preview("far.toml", {"A": 4.0})
    with pytest.raises(FileError):
        programmes.keep("bad.toml", b"schema = 1\nkind = 'programme'\n")
    assert not (tmp_path / "bad.toml").exists()


def test_turns_on_the_drum_are_those_of_its_winding_law(spec: BenchSpec) -> None:
    model = LiveModel(spec, "", ())
    profile = model.profiles["A"]
    drum = model.drums({"winch": {"A": {"cable_length": profile.reference.cable_length}}})["A"]
    assert drum["turns"] == pytest.approx(profile.reference.wound_turns)
    shorter = model.drums({"winch": {"A": {"cable_length": None}}})["A"]
    assert shorter == {"turns": None, "radius": None, "guide": None}


def test_a_missing_reading_takes_its_moment_from_the_prediction_and_no_channel(
    spec: BenchSpec,
) -> None:
    model, random = LiveModel(spec, "", ()), np.random.default_rng(3)
    angle = model.profiles["A"].reference.motor_angle
    rows: list[dict[str, float | None]] = [
        dict.fromkeys(CHANNELS) | {"time": 0.05 * k, "motor_angle": angle, "tension": tension}
        for k, tension in enumerate(98.0 + 0.8 * random.standard_normal(600))
    ]
    for row in rows[::10]:
        row["tension"] = None
    found = model.prediction("A", rows)
    assert len(found["time"]) == 540
    assert set(found) == {"time", "tension"}
    assert found["tension"]["noise"] == pytest.approx(0.8, rel=0.2)
    assert found["tension"]["predicted"] == pytest.approx([98.1] * 540, abs=0.2)
    assert max(map(abs, found["tension"]["mean"])) < 0.8
    for row in rows:
        row["motor_angle"] = None
    assert model.prediction("A", rows) is None


def test_frames_are_said_in_words_the_newest_of_each_identifier_first(spec: BenchSpec) -> None:
    frames = {
        "can": {
            "newest": [[7, 1.0, 0x701, "05"], [9, 1.1, 0x80, ""]],
            "last": [[0.9, 0x80, ""], [1.0, 0x701, "05"]],
        }
    }
    table = FrameWords(spec).table(frames)
    assert [(row["identifier"], row["count"]) for row in table["newest"]] == [(0x80, 9), (0x701, 7)]
    assert table["newest"][1]["words"] == "A: operational"
    assert [row["kind"] for row in table["last"]] == ["heartbeat", "SYNC"]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("6040h", "1", "'6040h' is no setting"),
        ("6083h", "-1", "is no whole number from 0 to 4294967295"),
        ("6083h", "fast", "'fast' is no whole number"),
        ("605Ah", "99", "is no whole number from -32768 to 8"),
    ],
)
def test_a_setting_is_refused_before_the_drive_is_asked(
    spec: BenchSpec, name: str, text: str, message: str
) -> None:
    status = {"winch": {"A": {"phase": "disabled"}}}
    with pytest.raises(UsageError, match=message):
        write_setting(spec, status, "A", name, text)
    with pytest.raises(UsageError, match="winch A is moving"):
        write_setting(spec, {"winch": {"A": {"phase": "moving"}}}, "A", name, text)


def test_settings_are_listed_with_types_and_limits_of_the_eds(spec: BenchSpec) -> None:
    known = {item["object"]: item for item in drive_settings(spec, "A")}
    assert known["605Ah"] | {"name": ""} == {
        "object": "605Ah",
        "name": "",
        "type": "whole number",
        "low": -32768.0,
        "high": 8.0,
    }
    assert "6040h" not in known


def tripped() -> dict[str, Any]:
    """History of a trip of two winches."""
    time = [-0.02, -0.01, 0.0, 0.01]
    own = {
        "motor_angle": [1.0, 1.1, 1.2, 1.2],
        "motor_velocity": [10.0, 10.0, 5.0, 0.0],
        "motor_torque": [0.1, 0.1, None, 0.1],
        "tension": [98.0, 105.0, 113.5, 90.0],
        "load": [None] * 4,
        "length": [None] * 4,
        "cable_length": [3.0] * 4,
        "cable_speed": [-0.1, -0.1, -0.05, 0.0],
        "commanded_speed": [-0.1, -0.1, 0.0, 0.0],
    }
    message = "winch A: tension 113.5 N is above the limit 112 N"
    return {
        "at": 7.0,
        "tripped": [{"message": message, "forbids": "winding in"}],
        "blocked": [],
        "time": time,
        "winch": {"A": own, "B": own},
        "events": [],
    }


def test_the_cycles_of_a_trip_are_a_run_that_commands_read(tmp_path: Path) -> None:
    found = tripped()
    own = found["winch"]["A"]
    name, text = trip_file(found, "spiral-bench", tmp_path)
    assert re.fullmatch(r"trip-\d{8}-\d{6}\.csv", name)
    (tmp_path / name).write_text(text)
    run = read_run(tmp_path / name)
    assert run.winches() == ["A", "B"]
    assert run.metadata["tripped"] == found["tripped"][0]["message"]
    assert run.time == pytest.approx(found["time"])
    assert run["B.tension"] == pytest.approx(own["tension"])
    assert np.isnan(run["A.motor_torque"]).tolist() == [False, False, True, False]
    assert "A.load" not in run
    assert "A.cable_length" not in run, "a run's cable length is that of the length instrument"


def test_the_page_saves_a_trip_until_its_reset(tmp_path: Path) -> None:
    class Watching:
        history: dict[str, Any] | None = None

        def trip_history(self) -> dict[str, Any] | None:
            return self.history

    bench = tmp_path / "bench.toml"
    bench.write_text(ONE_WINCH)
    view = BenchView(str(bench), allow_motion=False, folder=tmp_path)
    refusals = {WinchkitError: partial(_refused, SimpleNamespace(words=str))}
    with TestClient(Starlette(routes=view.routes(), exception_handlers=refusals)) as client:
        assert "not attached yet" in client.get("/api/bench/trip.csv").json()["error"]
        view._watcher = station = Watching()  # type: ignore[assignment]
        assert "nothing is tripped" in client.get("/api/bench/trip.csv").json()["error"]
        station.history = tripped()
        answer = client.get("/api/bench/trip.csv")
    assert re.search(r'filename="trip-.*\.csv"', answer.headers["content-disposition"])
    assert "B.tension [N]" in answer.text
    assert list(tmp_path.iterdir()) == [bench]

"""Stamps of the source of a message and log times of its recorder, with faults of either clock."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from winchkit.errors import RunError
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of

TIME = np.arange(1000) / 100
ANGLE = 16 * np.sin(2 * np.pi * 0.15 * TIME)
START = 1_700_000_000
Clock = Callable[[float], float]


def real(time: float) -> float:
    """A clock that counts from 1970."""
    return START + time


def back(time: float) -> float:
    """A clock that is set back at 7 s."""
    return START + time - (3.0037 if time > 7 else 0)


def zero_first(time: float) -> float:
    """A stamp before the first message of the simulated clock."""
    return START + time if time >= 0.5 else 0.0


def _stamp(time: float) -> dict[str, int]:
    whole = int(np.floor(time))
    return {"sec": whole, "nanosec": round((time - whole) * 1e9)}


def bag(path: Path, log: Clock, stamp: Clock | None, cell: Clock | None) -> Guess:
    """Two topics, each with the stamp of a clock or without a header."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        topics = {
            name: writer.register_channel(name, "json", schema) for name in ("/joint", "/cell")
        }
        for time, angle in zip(TIME, ANGLE, strict=True):
            logged = round(log(float(time)) * 1e9)
            for name, clock, fields in (
                ("/joint", stamp, {"position": angle}),
                ("/cell", cell, {"force": 200 + angle}),
            ):
                header = {} if clock is None else {"header": {"stamp": _stamp(clock(float(time)))}}
                content = json.dumps({**header, **fields}).encode()
                writer.add_message(topics[name], logged, content, logged)
        writer.finish()
    given = ("motor_angle=position [rad]", "tension=force [N]")
    return guess_columns(read_table(path), Answers(columns=tuple(map(read_column, given))))


@pytest.mark.parametrize(
    ("log", "stamp", "cell", "told"),
    [
        (real, real, real, "header.stamp; the delay of the log time is 0"),
        (lambda t: real(t) + 0.02, real, real, "log time is 20 ms"),
        (back, real, real, "goes back by up to 2.9937 s"),
        (real, lambda t: t + 0.5, lambda t: t + 0.5, "time is header.stamp"),
        (real, zero_first, zero_first, "50 of 1000 stamps are 0; none is used"),
        (real, lambda _t: 0.0, lambda _t: 0.0, "1000 of 1000 stamps are 0; none is used"),
        (real, real, None, "log time is the time of all topics: no usable header.stamp in /cell"),
        (real, real, zero_first, "log time is the time of all topics"),
    ],
)
def test_the_angle_has_its_true_times(
    log: Clock, stamp: Clock, cell: Clock | None, told: str, tmp_path: Path
) -> None:
    guess = bag(tmp_path / "a.mcap", log, stamp, cell)
    assert told in " ".join((*guess.table.notes, *guess.notes))
    run = run_of(streams_of(guess), {})
    assert len(run) == len(TIME)
    assert run.time == pytest.approx(TIME, abs=1e-6)
    assert run["motor_angle"] == pytest.approx(ANGLE)
    assert run["tension"] == pytest.approx(200 + ANGLE, abs=1e-6)


def test_a_stamp_out_of_order_leaves_the_clock_of_the_source(tmp_path: Path) -> None:
    def stamp(time: float) -> float:
        return real(time - 0.035 if time == 5.0 else time)

    guess = bag(tmp_path / "a.mcap", lambda t: real(t) + 0.01 * np.sin(99 * t), stamp, stamp)
    assert "time is header.stamp" in " ".join(guess.notes)
    run = run_of(streams_of(guess), {})
    assert run.time == pytest.approx(np.delete(TIME, 500), abs=1e-6)


@pytest.mark.parametrize("stamp", [back, None, lambda _t: 0.0])
def test_times_that_go_back_are_refused(stamp: Clock | None, tmp_path: Path) -> None:
    """Rows are in the order of the file, as those of text are."""
    guess = bag(tmp_path / "a.mcap", back, stamp, stamp)
    with pytest.raises(RunError, match="time goes back from"):
        run_of(streams_of(guess), {})


@pytest.mark.parametrize(
    ("head", "cells"),
    [
        ("%time,field.header.stamp,position,effort", "{log:d},{stamp:d},{angle:.6f},1"),
        (
            "log_time,header.stamp.sec,header.stamp.nanosec,position,effort",
            "{log:d},{sec:d},{nano:d},{angle:.6f},1",
        ),
        ("__time,/joints/header/stamp,position,effort", "{logs:.6f},{stamps:.6f},{angle:.6f},1"),
    ],
)
def test_an_exported_table_has_the_times_of_its_source(
    head: str, cells: str, tmp_path: Path
) -> None:
    """rostopic echo, ROS 2 and PlotJuggler: the recorder's times are late and jitter."""
    late = np.random.default_rng(3).uniform(0.003, 0.005, len(TIME))
    lines = [head]
    for time, angle, delay in zip(TIME, ANGLE, late, strict=True):
        stamp = START * 10**9 + round(time * 1e9)
        log = stamp + round(delay * 1e9)
        sec, nano = divmod(stamp, 10**9)
        fields = {"log": log, "stamp": stamp, "sec": sec, "nano": nano, "angle": angle}
        lines.append(cells.format(**fields, logs=log / 1e9, stamps=stamp / 1e9))
    path = tmp_path / "joints.csv"
    path.write_text("\n".join(lines) + "\n")
    guess = guess_columns(read_table(path))
    (note,) = [text for text in guess.notes if "the delay of the log time is" in text]
    assert float(note.split("log time is ")[1].split(" ms")[0]) == pytest.approx(4, abs=0.1)
    run = run_of(streams_of(guess), {})
    assert run.time == pytest.approx(TIME, abs=2e-6)


def messages(path: Path, fields: Callable[[int], dict[str, object]], late: float) -> Path:
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        topic = writer.register_channel("/axis", "json", 0)
        for k, time in enumerate(TIME):
            logged = round((real(float(time)) + late) * 1e9)
            writer.add_message(topic, logged, json.dumps(fields(k)).encode(), logged)
        writer.finish()
    return path


@pytest.mark.parametrize(("name", "scale"), [("timestamp", 1.0), ("stamp", 1e9), ("stamp", 1e3)])
def test_a_number_may_be_the_stamp_of_a_message(name: str, scale: float, tmp_path: Path) -> None:
    def fields(k: int) -> dict[str, object]:
        stamp = (START + float(TIME[k])) * scale
        return {name: stamp if scale == 1 else round(stamp), "position": ANGLE[k], "effort": 1.0}

    guess = guess_columns(read_table(messages(tmp_path / "a.mcap", fields, 0.009)))
    assert "the delay of the log time is 9" in " ".join(guess.notes)
    run = run_of(streams_of(guess), {})
    assert run.metadata["start_time"].endswith(":20.000000+00:00")


def test_degrees_in_messages_that_are_none_of_ros_are_asked(tmp_path: Path) -> None:
    def fields(k: int) -> dict[str, object]:
        return {"angle": float(np.degrees(ANGLE[k] / 8)), "torque": 0.1 * k}

    guess = guess_columns(read_table(messages(tmp_path / "a.mcap", fields, 0.0)))
    assert any("may be deg or rad" in question.text for question in guess.questions)

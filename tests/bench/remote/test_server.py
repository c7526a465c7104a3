"""Requests of the owner's socket: read, then executed; a defect is named and ends no connection."""

from __future__ import annotations

import json
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from command_line import own_process
from slave.power import State
from slave.rig import Rig
from winchkit.bench.bench import Bench
from winchkit.bench.ownership import connect_to_owner
from winchkit.bench.remote.client import RemoteStation
from winchkit.bench.remote.station import LocalStation
from winchkit.errors import UsageError, WinchkitError


@pytest.fixture
def line(bench: Bench) -> Iterator[socket.socket]:
    connection = connect_to_owner(bench.spec)
    assert connection is not None
    with connection:
        yield connection


def asked(line: socket.socket, text: str) -> dict[str, Any]:
    """The owner's answer to a line."""
    line.sendall(text.encode() + b"\n")
    return dict(json.loads(line.makefile("rb").readline()))


def request(operation: str, *arguments: Any, age: float = 0.0, **named: Any) -> str:
    """A request that was made ``age`` s ago."""
    sent = time.monotonic() - age
    return json.dumps({"id": 3, "op": operation, "sent": sent, "args": arguments, "named": named})


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no JSON",
        "[]",
        "17",
        '{"id": 1}',
        '{"id": 1, "op": "status", "args": []}',
        '{"id": 1, "op": "status", "sent": "noon", "args": []}',
        '{"id": 1, "op": "status", "sent": 0, "args": 5}',
        '{"id": 1, "op": "status", "sent": 0, "args": [], "named": 7}',
        '{"id": 1, "op": "status", "sent": 0, "args": [1, 2]}',
        '{"id": 1, "op": "release", "sent": 0, "args": ["A"], "named": {"height": 3}}',
        '{"id": 1, "op": "introduce", "sent": 0, "args": []}',
        '{"id": 1, "op": "leave", "sent": 0, "args": [5]}',
    ],
)
def test_what_is_no_request_is_named_as_such(line: socket.socket, text: str) -> None:
    answer = asked(line, text)
    assert answer["error"] == "UsageError"
    assert "a request that cannot be read" in answer["message"]
    assert "ok" in asked(line, request("status")), "the connection stays"


@pytest.mark.parametrize(
    ("defect", "words"),
    [
        (TypeError("unsupported operand"), "TypeError: unsupported operand"),
        (OSError(5, "Input/output error"), r"OSError: \[Errno 5\] Input/output error"),
        (KeyError("tension"), "KeyError: 'tension'"),
        (ValueError("no value"), "ValueError: no value"),
        (BrokenPipeError("pipe"), "BrokenPipeError: pipe"),
    ],
)
def test_what_fails_in_the_owner_is_named_as_a_defect_and_logged(
    bench: Bench,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    defect: Exception,
    words: str,
) -> None:
    def fail(_station: LocalStation) -> None:
        raise defect

    monkeypatch.setattr(LocalStation, "names", fail)
    connection = connect_to_owner(bench.spec)
    assert connection is not None
    with RemoteStation(connection, name="page 7") as station:
        text = rf"^names failed in the process that owns the bench: {words} \(a defect of winchkit"
        with pytest.raises(WinchkitError, match=text) as raised:
            station.names()
        assert type(raised.value) is WinchkitError, "no error of the request, none of a connection"
        assert station.status()["winch"]["A"]["phase"] == "disabled", "the connection stays"
    assert "names of page 7 failed" in caplog.text
    assert "Traceback" in caplog.text


def test_an_answer_that_is_no_json_is_a_defect_too(
    bench: Bench, line: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LocalStation, "names", lambda _station: {1, 2})
    answer = asked(line, request("names"))
    assert answer["error"] == "WinchkitError"
    assert "a defect of winchkit" in answer["message"]
    assert "ok" in asked(line, request("status"))


@pytest.mark.parametrize(
    ("operation", "named"),
    [
        ("jog", {"pay_out": 0.1, "hold": 0.7}),
        ("step", {"pay_out": 0.1}),
        ("move", {"to": 3.0}),
        ("hold_tension", {"tension": 100.0, "hold": 0.2, "bounds": {}}),
        ("home", {"method": None, "at": 2.0, "speed": None}),
    ],
)
def test_a_command_that_waited_on_its_way_moves_nothing(
    rig: Rig, bench: Bench, line: socket.socket, operation: str, named: dict[str, Any]
) -> None:
    """An owner that stood still finds the requests of before in its socket."""
    answer = asked(line, request(operation, "A", age=0.8, **named))
    assert answer["error"] == "NotPermitted"
    assert "this command was 0.8" in answer["message"]
    assert not bench.winch["A"].moving
    rig.wait(0.5)
    assert all(sample.state is not State.ENABLED for sample in rig.samples[0])
    assert "ok" in asked(line, request("release", "A", age=60.0)), "an end is never too old"


def test_the_time_on_its_way_is_a_part_of_the_hold(
    rig: Rig, bench: Bench, line: socket.socket
) -> None:
    assert "ok" in asked(line, request("jog", "A", age=0.4, pay_out=0.1, hold=0.7))
    rig.wait(0.2)
    assert bench.winch["A"].moving
    rig.wait(0.3)
    assert not bench.winch["A"].moving


def test_an_argument_that_cannot_be_sent_is_refused_and_the_connection_stays(bench: Bench) -> None:
    connection = connect_to_owner(bench.spec)
    assert connection is not None
    with RemoteStation(connection) as station:
        with pytest.raises(UsageError, match="move: an argument cannot be sent: a PosixPath is no"):
            station.move("A", to=Path("3 m"))  # type: ignore[arg-type]
        assert station.names() == ["A"]


def test_what_fails_in_a_bench_process_before_it_is_open_is_a_defect_of_it_too() -> None:
    code = (
        "import sys; from winchkit.schema import read; read.read_bench = lambda _: 1 / 0; "
        "from winchkit.bench.remote import process; sys.argv = ['', 'bench.toml']; process.main()"
    )
    done = own_process(sys.executable, "-c", code, code=None)
    assert json.loads(done.stdout) == {"defect": "ZeroDivisionError: division by zero"}
    assert "Traceback" in done.stderr, "its log has the place"

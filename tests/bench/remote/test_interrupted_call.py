"""A call to the bench's owner that Ctrl-C interrupts, wherever it does."""

from __future__ import annotations

import json
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import pytest

from winchkit.bench.remote import client, motion_operations, operation, operations, requests
from winchkit.bench.remote.client import RemoteStation

CLIENT = {one.__file__ for one in (client, motion_operations, operation, operations, requests)}


class Owner(threading.Thread):
    """The other side: answers calls at once, and leaving when the winch is at rest."""

    def __init__(self, connection: socket.socket) -> None:
        super().__init__(daemon=True)
        self.connection = connection
        self.at_rest = False
        self.jogs = 0

    def run(self) -> None:
        with self.connection, self.connection.makefile("rwb") as stream:
            for line in stream:
                request = json.loads(line)
                answer: Any = None
                if request["op"] == "introduce":
                    answer = {"owner": "it", "lends": True, "digest": ""}
                elif request["op"] == "jog":
                    self.jogs += 1
                elif request["op"] == "leave":
                    time.sleep(0.005)
                    self.at_rest = True
                stream.write(json.dumps({"id": request["id"], "ok": answer}).encode() + b"\n")
                stream.flush()


class Interrupts:
    """Raises Ctrl-C at one of the points at which the interpreter looks for signals.

    These are the beginnings and ends of calls; those of the client's modules count.
    """

    def __init__(self, point: int) -> None:
        self.left = point
        self.came = False

    def __call__(self, frame: FrameType, event: str, _argument: object) -> None:
        if frame.f_code.co_filename not in CLIENT or event == "c_call":
            return
        self.left -= 1
        if self.left < 0 and not self.came:
            self.came = True
            sys.setprofile(None)
            raise KeyboardInterrupt


@contextmanager
def interrupted(point: int) -> Iterator[Interrupts]:
    before = sys.getprofile()
    interrupts = Interrupts(point)
    sys.setprofile(interrupts)
    try:
        yield interrupts
    finally:
        sys.setprofile(before)


def test_leaving_waits_for_rest_wherever_the_call_before_was_interrupted() -> None:
    """The answer to the interrupted call is not taken for that to leaving, nor waited for."""
    points = 0
    while True:
        ours, theirs = socket.socketpair()
        owner = Owner(theirs)
        owner.start()
        station = RemoteStation(ours, timeout=5.0)
        with interrupted(points) as interrupts:
            try:
                station.jog("A", wind_in=0.1)
            except KeyboardInterrupt:
                assert interrupts.came
        station.close()
        assert owner.at_rest, f"it left before the winch was at rest (point {points})"
        if not interrupts.came:
            break
        points += 1
    assert points > 10, "a call has some points at which it can be interrupted"


@pytest.mark.parametrize("cut", [1, 9, 20])
def test_the_rest_of_an_answer_whose_beginning_was_lost_is_passed_over(cut: int) -> None:
    ours, theirs = socket.socketpair()
    Owner(theirs).start()
    station = RemoteStation(ours, timeout=5.0)
    whole = json.dumps({"id": 17, "ok": {"A": 1.5}}).encode() + b"\n"
    theirs.sendall(whole[cut:])
    station.jog("A", wind_in=0.1)
    station.close()

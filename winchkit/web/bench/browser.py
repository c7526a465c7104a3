"""One open page of the Bench view: its messages in order, and its station while it commands."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from winchkit.bench.direction import directed
from winchkit.bench.remote.client import RemoteStation
from winchkit.errors import UsageError, WinchkitError
from winchkit.schema.bench import BenchSpec
from winchkit.web.bench.programmes import Programmes

__all__ = ["Browser", "Inbox", "counting", "received"]

_COUNTED = 0.5
"""Period in which the rows of a log are asked for, s."""
_LARGEST = 4_000
"""Bytes of a message of a browser."""


class Inbox:
    """Messages in their order; a jog replaces one that waits, and every other message ends it."""

    def __init__(self) -> None:
        self._waiting: deque[dict[str, Any]] = deque()
        self._filled = asyncio.Event()

    def put(self, asked: dict[str, Any]) -> None:
        """Take a message."""
        kept = [item for item in self._waiting if item.get("do") != "jog"]
        self._waiting = deque([*kept, asked])
        self._filled.set()

    async def next(self) -> dict[str, Any]:
        """The oldest message."""
        while not self._waiting:
            self._filled.clear()
            await self._filled.wait()
        return self._waiting.popleft()


async def received(socket: WebSocket, browser: Browser) -> None:
    """Read messages until the browser closes; malformed ones are reported and dropped."""
    with suppress(WebSocketDisconnect):
        while True:
            text = await socket.receive_text()
            try:
                asked = json.loads(text) if len(text) <= _LARGEST else None
            except ValueError:
                asked = None
            if isinstance(asked, dict):
                browser.inbox.put(asked)
            else:
                browser.said = f"the message is no JSON object of at most {_LARGEST} characters"


async def counting(browser: Browser) -> None:
    """Ask for the rows of the log that a browser started, while there is one."""
    while True:
        await asyncio.sleep(_COUNTED)
        await asyncio.to_thread(browser.count)


class Browser:
    """One open page; with a station of its own while it commands."""

    def __init__(self, name: str, spec: BenchSpec, programmes: Programmes) -> None:
        self.name = name
        self.spec, self._programmes = spec, programmes
        self.shown = next(iter(spec.winch))
        self.said = ""
        self.inbox = Inbox()
        self._station: RemoteStation | None = None
        self._log: tuple[str, float] | None = None
        self._counted: dict[str, Any] = {}
        self.programme: dict[str, Any] | None = None
        """Where the programme is that this page started; None where it started none."""

    def take(self, station: RemoteStation) -> None:
        """Command by a station."""
        self.leave()
        self._station = station

    def leave(self) -> None:
        """Close the station: the owner ends what was started by it."""
        station, self._station, self._log = self._station, None, None
        self._counted, self.programme = {}, None
        if station is not None:
            with suppress(WinchkitError):
                station.close()

    def recording(self) -> dict[str, Any] | None:
        """File, time and counters of the log that this browser started."""
        if self._log is None:
            return None
        file, began = self._log
        return {"file": file, "seconds": time.monotonic() - began, **self._counted}

    def count(self) -> None:
        """Count the rows of the log, and those that it lost."""
        if self._station is not None and self._log is not None:
            with suppress(WinchkitError, KeyError):
                log = self._station.counters()["log"]
                self._counted = {"rows": log["rows"], "lost": log["drops"]}

    def do(self, name: str, asked: dict[str, Any]) -> None:
        """Carry out a message; raises what the station raises."""
        station = self._station
        if station is None:
            raise UsageError("this page only watches; request command first")
        winch = str(asked["winch"]) if "winch" in asked else None
        if winch is not None and winch != "all" and winch not in self.spec.winch:
            raise UsageError(f"there is no winch '{winch}'")
        actions: dict[str, Callable[[], object]] = {
            # In a message a jog's speed is positive winding in, a step's change paying out.
            "jog": lambda: station.jog(winch, **directed(-_number(asked["speed"]))),
            "release": lambda: station.release(winch),
            "alive": lambda: station.moving(winch),
            "step": lambda: station.step(
                winch, **directed(_number(asked["change"])), speed=_number(asked["speed"])
            ),
            "move": lambda: station.move(
                winch, to=_number(asked["to"]), speed=_number(asked["speed"])
            ),
            "move_pose": lambda: station.move_pose(
                {str(asked["axis"]): _number(asked["change"])}, True, _number(asked["speed"])
            ),
            "reset": station.reset,
            "tare": lambda: station.tare(winch),
            "take_over": lambda: station.take_over(winch),
            "run_programme": lambda: self._run(station, asked),
            "programme": lambda: self._look(station),
            "answer_programme": station.answer_programme,
            "end_programme": station.end_programme,
            "record": lambda: self._record(station, str(asked["file"])),
            "end_record": lambda: self._end_record(station),
        }
        if name not in actions:
            raise UsageError(f"there is no action '{name}'; there are {', '.join(actions)}")
        actions[name]()

    def _run(self, station: RemoteStation, asked: dict[str, Any]) -> None:
        """Start a programme; its runs go into a folder beside those of the page's work."""
        folder = str(asked["folder"]).strip() or "."
        if Path(folder).name != folder and folder != ".":
            raise UsageError(f"folder '{folder}': name one without / beside this page's work")
        path = self._programmes.path(str(asked["name"]))
        station.start_programme(
            str(path.resolve()), str((self._programmes.work / folder).resolve())
        )
        self._look(station)

    def _look(self, station: RemoteStation) -> None:
        self.programme = station.programme()

    def _record(self, station: RemoteStation, name: str) -> None:
        path = Path(name)
        if path.name != name or path.suffix not in {".csv", ".mcap"}:
            raise UsageError("a log's name has no folder and ends with .csv or .mcap")
        station.start_log(str(path.resolve()))
        self._log, self._counted = (name, time.monotonic()), {}

    def _end_record(self, station: RemoteStation) -> None:
        station.end_log()
        self._log = None


def _number(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise UsageError("a speed or a length is no finite number")
    return number

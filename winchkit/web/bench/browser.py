"""One open page of the Bench view: its messages in order, and its station while it commands."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from winchkit.bench.direction import directed
from winchkit.bench.remote.client import RemoteStation
from winchkit.errors import UsageError, WinchkitError
from winchkit.schema.bench import BenchSpec
from winchkit.schema.programme import ALL
from winchkit.web.bench import messages
from winchkit.web.bench.messages import Message
from winchkit.web.bench.programmes import Programmes
from winchkit.web.words import page_text

BEGINS_NOTHING = frozenset(
    {"show", "leave", "keep_command", "release", "alive"}
    | {"programme", "end_programme", "end_record"}
)
"""Messages that may come late: they end something, or say that the page is seen."""

_COUNTED = 0.5
"""Period in which the rows of a log are asked for, s."""
_AXES = ("x", "y", "z")
"""Of a robot's platform."""


class Inbox:
    """Messages in order; every one ends a waiting jog, a refresh replaces a waiting one."""

    def __init__(self) -> None:
        self._waiting: deque[Message] = deque()
        self._filled = asyncio.Event()

    def put(self, asked: Message) -> None:
        """Take a message."""
        over = {"refresh"} if asked.get("do") == "refresh" else {"jog", "refresh"}
        kept = [item for item in self._waiting if item.get("do") not in over]
        self._waiting = deque([*kept, asked])
        self._filled.set()

    async def next(self) -> Message:
        """The oldest message."""
        while not self._waiting:
            self._filled.clear()
            await self._filled.wait()
        return self._waiting.popleft()


async def received(socket: WebSocket, browser: Browser) -> None:
    """Read messages until the browser closes; malformed ones are reported and dropped."""
    with suppress(WebSocketDisconnect):
        while True:
            got = await socket.receive()
            if got["type"] == "websocket.disconnect":
                return
            try:
                browser.inbox.put(messages.decoded(got.get("text") or ""))
            except UsageError as error:
                browser.say(str(error))


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
        self.said: dict[str, Any] = {"number": 0, "text": ""}
        """Answer to the latest order, empty for one that was carried out; each has its number."""
        self.inbox = Inbox()
        self._station: RemoteStation | None = None
        self._log: tuple[Path, float] | None = None
        self._counted: dict[str, Any] = {}
        self._tares: dict[str, dict[str, Any]] = {}
        self._started: set[str] = set()
        """Winches, or all, with a move or a step of this page whose end was not reported."""
        self.programme: dict[str, Any] | None = None
        """Where the programme is that this page started; None where it started none."""

    def say(self, words: str) -> None:
        """Answer an order; words that repeat are said again."""
        if words or self.said["text"]:
            self.said = {"number": self.said["number"] + 1, "text": page_text(words)}

    @property
    def undo_tare(self) -> list[str]:
        """Winches whose tares of before this page's can be restored."""
        return list(self._tares)

    def take(self, station: RemoteStation) -> None:
        """Command by a station."""
        self.leave()
        self._station = station

    def leave(self) -> None:
        """Close the station: the owner ends what was started by it."""
        station, self._station, self._log = self._station, None, None
        self._counted, self.programme, self._tares = {}, None, {}
        self._started.clear()
        if station is not None:
            with suppress(WinchkitError):
                station.close()

    def recording(self) -> dict[str, Any] | None:
        """File, time and counters of the log that this browser started."""
        if self._log is None:
            return None
        path, began = self._log
        seconds = time.monotonic() - began
        return {"file": path.name, "path": str(path), "seconds": seconds, **self._counted}

    def count(self) -> None:
        """Count the rows of the log, and those that it lost."""
        if self._station is not None and self._log is not None:
            with suppress(WinchkitError, KeyError):
                log = self._station.counters()["log"]
                self._counted = {"rows": log["rows"], "lost": log["drops"]}

    def action(self, asked: Message) -> Callable[[], object]:
        """What a message orders, not carried out yet; UsageError for any wrong value in it."""
        station = self._station
        if station is None:
            raise UsageError("this page only watches; request command first")
        decoders: dict[str, Callable[[], Callable[[], object]]] = {
            # In a message a jog's speed is positive winding in, a step's change paying out.
            "jog": lambda: partial(
                station.jog, self._winch(asked), **directed(-messages.signed_speed(asked))
            ),
            "refresh": lambda: partial(
                station.refresh, self._winch(asked), **directed(-messages.signed_speed(asked))
            ),
            "release": lambda: partial(station.release, self._winch(asked)),
            "alive": lambda: partial(
                self._live, station, ALL if asked.get("winch") == ALL else self._winch(asked)
            ),
            "step": lambda: partial(
                self._start,
                winch := self._winch(asked),
                partial(
                    station.step,
                    winch,
                    **directed(messages.change(asked, "change")),
                    speed=messages.speed(asked),
                ),
            ),
            "move": lambda: partial(
                self._start,
                winch := self._winch(asked),
                partial(
                    station.move,
                    winch,
                    to=messages.length(asked, "to"),
                    speed=messages.speed(asked),
                ),
            ),
            "move_pose": lambda: partial(
                self._start,
                ALL,
                partial(
                    station.move_pose,
                    {messages.name(asked, "axis", _AXES): messages.change(asked, "change")},
                    True,
                    messages.speed(asked),
                ),
            ),
            "reset": lambda: station.reset,
            "tare": lambda: partial(self._tare, station, self._winch(asked)),
            "undo_tare": lambda: partial(self._undo_tare, station, self._winch(asked)),
            "take_over": lambda: partial(station.take_over, self._winch(asked)),
            "run_programme": lambda: partial(
                self._run, station, messages.text(asked, "name"), messages.text(asked, "folder")
            ),
            "programme": lambda: partial(self._look, station),
            "answer_programme": lambda: station.answer_programme,
            "end_programme": lambda: station.end_programme,
            "record": lambda: partial(self._record, station, messages.text(asked, "file")),
            "end_record": lambda: partial(self._end_record, station),
        }
        return decoders[messages.name(asked, "do", decoders, "action")]()

    def _winch(self, asked: Message) -> str:
        return messages.name(asked, "winch", self.spec.winch)

    def _start(self, moved: str, order: Callable[[], object]) -> None:
        order()
        self._started.add(moved)

    def _live(self, station: RemoteStation, moved: str) -> None:
        """A sign of life for a motion of this page; what ended it is raised once."""
        if moved not in self._started:
            return
        self._started.discard(moved)
        if station.moving(moved):
            self._started.add(moved)

    def _tare(self, station: RemoteStation, winch: str) -> None:
        """Tare a load cell, and note what it was tared by before."""
        before = station.cell("tares", f"{winch}.cell")
        station.tare(winch)
        self._tares[winch] = before

    def _undo_tare(self, station: RemoteStation, winch: str) -> None:
        if winch not in self._tares:
            raise UsageError(f"this page has not tared winch {winch}")
        station.cell("restore tares", f"{winch}.cell", self._tares[winch])
        del self._tares[winch]

    def _run(self, station: RemoteStation, programme: str, folder: str) -> None:
        """Start a programme; its runs go into a folder beside those of the page's work."""
        folder = folder.strip() or "."
        if Path(folder).name != folder and folder != ".":
            raise UsageError(f"folder '{folder}': name one without / beside this page's work")
        path = self._programmes.path(programme)
        station.start_programme(
            str(path.resolve()), str((self._programmes.work / folder).resolve())
        )
        self._look(station)

    def _look(self, station: RemoteStation) -> None:
        self.programme = station.programme()

    def _record(self, station: RemoteStation, file: str) -> None:
        path = Path(file)
        if path.name != file or path.suffix not in {".csv", ".mcap"}:
            raise UsageError("a log's name has no folder and ends with .csv or .mcap")
        station.start_log(str(path.resolve()))
        self._log, self._counted = (path.resolve(), time.monotonic()), {}

    def _end_record(self, station: RemoteStation) -> None:
        station.end_log()
        self._log = None

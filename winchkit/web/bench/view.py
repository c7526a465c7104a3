"""The bench of the page: one observer that watches, one station for the browser that commands.

The page supervises nothing. A jog is renewed only by a message of the browser, with the dead-man
of every other client; a move lasts as long as that browser sends signs of life, which become calls
of its station; with its socket the station is closed, and the owner of the bench ends what it
moved. Stop is every browser's.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, Protocol, Self
from urllib.parse import unquote

from starlette.datastructures import QueryParams
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from winchkit import wings
from winchkit.bench.control.dead_man import DEAD_MAN
from winchkit.bench.remote.client import RemoteStation
from winchkit.bench.remote.session import attach
from winchkit.catalog import find
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import ConnectionLost, UsageError, WinchkitError
from winchkit.schema.read import read_bench
from winchkit.web.bench import messages
from winchkit.web.bench.browser import BEGINS_NOTHING, Browser, counting, received
from winchkit.web.bench.drive_objects import (
    FrameWords,
    drive_objects,
    drive_settings,
    read_setting,
    write_setting,
)
from winchkit.web.bench.live_model import CHANNELS, LiveModel
from winchkit.web.bench.messages import Message
from winchkit.web.bench.programmes import Programmes
from winchkit.web.bench.trip_file import trip_file
from winchkit.web.views import answered, attachment
from winchkit.web.words import INTERNAL, free_path

_LOGGER = logging.getLogger(__name__)

_PERIOD = 0.05
"""Pictures are sent 20 times a second."""
_KEPT = 60.0
"""History of the strip charts, s."""
_PREDICTED = 0.5
"""Period of the model's prediction over the history, s."""
_POSES = 0.1
"""Period of the pose of a robot's platform, s."""
_LATEST_PICTURE = 0.4
"""Age of the picture that a browser had when it ordered a jog, s: eight periods."""
_OLD = 1.0
"""Age of the picture that a browser had when it ordered anything else, s: with an older one the
page offers nothing."""
_AT_REST = 10.0
"""For what a page moved to come to rest at the end, s: the longest ramp."""
_ENDING = 0.3
"""For the threads that watch to end, s: a call of a station takes milliseconds."""
_ORDERS = 8
"""Browsers whose orders are carried out at once."""
_LARGEST_PROGRAMME = 1_000_000
"""Bytes of a programme file of the browser."""


class _Period:
    """Instants at a fixed period: the time that the work takes is a part of it."""

    def __init__(self) -> None:
        self._due = time.monotonic()

    def left(self) -> float:
        """Time to the next instant, s; after a late one at least half a period."""
        now = time.monotonic()
        self._due = max(self._due + _PERIOD, now + _PERIOD / 2)
        return self._due - now


class RobotDrawing(Protocol):
    """The robot of a bench as its wing draws it."""

    def picture(self, status: Mapping[str, Any]) -> dict[str, Any] | None:
        """Pose and cables at a status; None where they are not known."""


class BenchView:
    """A bench as the page shows and commands it; a context manager."""

    def __init__(
        self, bench: str, effects: Sequence[str] = (), *, allow_motion: bool, folder: Path
    ) -> None:
        self.spec = read_bench(bench)
        self.file = bench
        self.effects = tuple(effects)
        self.allow_motion = allow_motion
        self.folder = folder
        self._history: dict[str, deque[dict[str, Any]]] = {}
        self._newest: dict[str, Any] = {}
        self._predicted: dict[str, dict[str, Any]] = {}
        self._lost: str = ""
        self._watcher: RemoteStation | None = None
        self._ended = threading.Event()
        self._lent = threading.Event()
        """Set while the bench is given away, so that a drive can be written to."""
        self._model = LiveModel(self.spec, self.file, self.effects)
        live: RobotDrawing | None = None
        if self.spec.robot is not None:
            live = wings.part("robot", "live_robot")(self.spec)
        self._robot = live
        self._posed: dict[str, Any] | None = None
        self._words = FrameWords(self.spec)
        self._programmes = Programmes(self.spec, folder, Path.cwd())
        working = [self._watch, self._predict, *([] if self._robot is None else [self._pose])]
        self._threads = [
            threading.Thread(target=target, name=f"page{target.__name__}", daemon=True)
            for target in working
        ]
        self._stops = ThreadPoolExecutor(2, "page-stop")
        self._orders = ThreadPoolExecutor(_ORDERS, "page-order")
        """Threads of their own: neither Stop nor a jog waits behind a picture that is computed."""
        self._commander: Browser | None = None
        self._requesting: Browser | None = None
        """Page that asked for the command while another one has it."""
        self._browsers = 0
        self._open: set[Browser] = set()
        self._leaving: set[Future[None]] = set()
        """Stations of closed pages, until what they moved stands still."""

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        if self._commander is not None:
            self._commander.leave()
        wait(tuple(self._leaving), _AT_REST)
        # What attaches to the bench just now waits for its owner; nothing needs it any more.
        end = time.monotonic() + _ENDING
        for thread in self._threads:
            thread.join(max(0.0, end - time.monotonic()))
        for pool in (self._stops, self._orders):
            pool.shutdown(wait=False, cancel_futures=True)

    @property
    def robot_profile(self) -> str:
        """File of the profile of the bench's robot; empty without one."""
        wiring = self.spec.robot
        return "" if wiring is None else str(find("profiles", wiring.profile, beside=self.file))

    def routes(self) -> list[Any]:
        """Routes of the Bench view."""
        return [
            Route("/api/bench", self._declared),
            answered("/api/bench/history", lambda _: self._past()),
            answered("/api/bench/trip", lambda _: self._watched().trip_history()),
            Route("/api/bench/trip.csv", self._trip_file),
            answered("/api/bench/frames", lambda _: self._words.table(self._watched().frames())),
            answered(
                "/api/bench/programmes", lambda _: {"programmes": list(self._programmes.paths())}
            ),
            answered("/api/bench/programme", self._preview),
            Route("/api/bench/programme", self._upload, methods=["POST"]),
            answered("/api/bench/objects", self._objects),
            answered("/api/bench/setting", self._setting),
            Route("/api/bench/setting", self._write, methods=["POST"]),
            Route("/api/bench/stop", self._stop, methods=["POST"]),
            WebSocketRoute("/live/bench", self._live),
        ]

    # What is declared: limits and geometry for the picture.

    async def _declared(self, request: Request) -> Response:
        return JSONResponse(
            {
                "name": self.spec.name,
                "allow_motion": self.allow_motion,
                "winch": {name: self._model.declared(name) for name in self.spec.winch},
                "robot": None if self.spec.robot is None else self.spec.robot.profile,
                "dead_man": DEAD_MAN,
                "log": free_path(Path.cwd(), "bench.csv").name,
            }
        )

    def _past(self) -> dict[str, list[dict[str, Any]]]:
        return {name: list(rows) for name, rows in self._history.items()}

    async def _trip_file(self, request: Request) -> Response:
        found = await asyncio.to_thread(self._watched().trip_history)
        if found is None:
            raise UsageError("nothing is tripped: the cycles of a trip are kept until its reset")
        name, text = await asyncio.to_thread(trip_file, found, self.spec.name, self.folder)
        return attachment(text, name, "text/csv")

    def _watched(self) -> RemoteStation:
        """The station that watches; raises ConnectionLost where there is none."""
        station = self._watcher
        if station is None:
            raise ConnectionLost(self._lost or "the bench is not attached yet; ask again")
        return station

    def _preview(self, query: QueryParams) -> dict[str, Any]:
        here = {
            winch: float(state["cable_length"])
            for winch, state in self._newest.get("winch", {}).items()
            if state["cable_length"] is not None
        }
        return self._programmes.preview(query.get("name", ""), here)

    async def _upload(self, request: Request) -> Response:
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > _LARGEST_PROGRAMME:
                raise UsageError(f"a programme has at most {_LARGEST_PROGRAMME / 1e6:g} MB")
        name = unquote(request.headers.get("x-file-name", ""))
        return JSONResponse({"name": await asyncio.to_thread(self._programmes.keep, name, body)})

    def _objects(self, query: QueryParams) -> dict[str, Any]:
        winch = query.get("winch", "")
        found = drive_objects(self.spec, self._newest, winch)
        return found | {"settings": drive_settings(self.spec, winch) if self.allow_motion else []}

    def _setting(self, query: QueryParams) -> dict[str, Any]:
        winch, setting = query.get("winch", ""), query.get("object", "")
        return {"value": read_setting(self.spec, self._newest, winch, setting)}

    async def _write(self, request: Request) -> Response:
        asked = messages.decoded((await request.body()).decode(errors="replace"))
        winch = messages.name(asked, "winch", self.spec.winch)
        values = winch, *(messages.text(asked, key) for key in ("object", "value"))
        return JSONResponse(await asyncio.to_thread(self._write_setting, *values))

    def _write_setting(self, winch: str, setting: str, value: str) -> dict[str, Any]:
        """Write a setting of a drive while no page commands."""
        if not self.allow_motion:
            raise UsageError("this page only watches: it was started without permission to move")
        if self._commander is not None:
            raise UsageError(
                f"{self._commander.name} commands; it must release the bench first: the drives are "
                "set up anew after a setting is written"
            )
        self._lent.set()
        try:
            return write_setting(self.spec, self._newest, winch, setting, value)
        finally:
            self._lent.clear()

    async def _stop(self, request: Request) -> Response:
        await self._in(self._stops, self._stop_now)
        return JSONResponse({"stopped": True})

    async def _in(
        self, pool: ThreadPoolExecutor, call: Callable[..., object], *arguments: Any
    ) -> None:
        await asyncio.get_running_loop().run_in_executor(pool, call, *arguments)

    def _stop_now(self) -> None:
        """Quick-stop by a station of its own, which waits behind no other call."""
        with attach(self.file, self.effects, name="Stop on the page", observer=True) as station:
            station.stop()

    # Watching.

    def _watch(self) -> None:
        while not self._ended.is_set():
            if self._lent.is_set():
                self._lost = "a setting of a drive is written; the bench is opened anew"
                self._ended.wait(_PERIOD)
                continue
            try:
                with attach(self.file, self.effects, name="page", observer=True) as station:
                    self._lost, self._watcher = "", station
                    period = _Period()
                    while not (self._ended.wait(period.left()) or self._lent.is_set()):
                        self._take(station.status())
                    self._watcher = None
            except WinchkitError as error:
                self._lost, self._watcher = str(error), None
                self._ended.wait(1.0)

    def _take(self, status: dict[str, Any]) -> None:
        self._newest = status | {"drum": self._model.drums(status)}
        for name, winch in status["winch"].items():
            rows = self._history.setdefault(name, deque(maxlen=int(_KEPT / _PERIOD)))
            row = {"time": status["time"]} | {key: winch.get(key) for key in CHANNELS}
            if not rows or rows[-1]["time"] < row["time"]:
                rows.append(row)

    def _predict(self) -> None:
        """Predict the outputs of the winches that are shown, over their history."""
        while not self._ended.wait(_PREDICTED):
            for name in {browser.shown for browser in tuple(self._open)}:
                found = self._model.prediction(name, list(self._history.get(name, ())))
                if found is not None:
                    self._predicted[name] = found

    def _pose(self) -> None:
        """Find the pose of the platform from the motor angles."""
        while not self._ended.wait(_POSES):
            if self._robot is not None:
                self._posed = self._robot.picture(self._newest)

    # Browsers.

    async def _live(self, socket: WebSocket) -> None:
        await socket.accept()
        self._browsers += 1
        browser = Browser(f"page {self._browsers}", self.spec, self._programmes)
        self._open.add(browser)
        listening = asyncio.ensure_future(received(socket, browser))
        tasks = self._obeying(browser), counting(browser)
        working = [asyncio.ensure_future(task) for task in tasks]
        predicted: dict[str, Any] | None = None
        posed: dict[str, Any] | None = None
        period = _Period()
        try:
            while not listening.done():
                shown: dict[str, Any] = {
                    "status": self._newest,
                    "lost": self._lost,
                    "you_command": self._commander is browser,
                    "commander": self._commander.name if self._commander else "",
                    "you_request": self._requesting is browser,
                    "requested": self._commander is browser and self._requesting is not None,
                    "said": browser.said,
                    "undo_tare": browser.undo_tare,
                    "recording": browser.recording(),
                    "programme": browser.programme,
                }
                if posed is not self._posed:
                    posed = shown["robot"] = self._posed
                if predicted is not self._predicted.get(browser.shown):
                    predicted = self._predicted.get(browser.shown)
                    shown["predicted"] = {browser.shown: predicted}
                await socket.send_json(shown)
                await asyncio.wait({listening}, timeout=period.left())
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            self._open.discard(browser)
            listening.cancel()
            for task in working:
                task.cancel()
            leaving = self._orders.submit(self._leave, browser)
            self._leaving.add(leaving)
            leaving.add_done_callback(self._leaving.discard)

    async def _obeying(self, browser: Browser) -> None:
        """Carry out the messages of a browser in their order, one after another."""
        refused = False
        while True:
            asked = await browser.inbox.next()
            held = asked.get("do") in ("jog", "refresh")
            if refused and asked.get("do") == "refresh":
                continue  # until it is released and pressed again
            try:
                await self._obey(asked, browser)
            except WinchkitError as error:
                browser.say(str(error))
                refused = held
                continue
            except Exception:
                _LOGGER.exception("the order %s failed", asked)
                browser.say(f"The order {INTERNAL}.")
                refused = held
                continue
            refused = False
            if held or asked.get("do") not in BEGINS_NOTHING:
                browser.say("")

    async def _obey(self, asked: Message, browser: Browser) -> None:
        order = asked.get("do")
        if order == "show":
            browser.shown = messages.name(asked, "winch", self.spec.winch)
            return
        if order == "command":
            await self._in(self._orders, self._give_command, browser)
            return
        if order == "leave":
            await self._in(self._orders, self._leave, browser)
            return
        if order == "keep_command":
            self._keep_command(browser)
            return
        if self._commander is not browser:
            if order in BEGINS_NOTHING:
                return  # a sign of life that crossed the end of its command
            raise UsageError("this page only watches; request command first")
        action = browser.action(asked)
        if order in ("jog", "refresh"):
            if not self._has_seen(asked, _LATEST_PICTURE):
                raise UsageError("Jog ended: the browser was too slow. Release and press again.")
        elif order not in BEGINS_NOTHING and not self._has_seen(asked, _OLD):
            raise UsageError(
                "The order came late: the page showed older values. Look at it and order again."
            )
        await self._in(self._orders, action)

    def _has_seen(self, asked: Message, age: float) -> bool:
        """Whether an order is of somebody who saw the bench within the last ``age`` seconds.

        Messages that waited on their way, or in this process, would otherwise move the winch after
        its key was released.
        """
        seen = asked.get("seen")
        if isinstance(seen, bool) or not isinstance(seen, int | float):
            return False
        return 0 <= MonotonicClock().now() - seen <= age

    def _give_command(self, browser: Browser) -> None:
        if not self.allow_motion:
            raise UsageError("this page only watches: it was started without permission to move")
        if self._commander is not None and self._commander is not browser:
            self._requesting = browser
            return
        browser.take(attach(self.file, self.effects, name=browser.name))
        self._commander = browser
        if browser not in self._open:  # closed meanwhile
            self._leave(browser)

    def _keep_command(self, browser: Browser) -> None:
        """Refuse the request of another page."""
        if self._commander is browser and self._requesting is not None:
            self._requesting.say("The other page keeps the command.")
            self._requesting = None

    def _leave(self, browser: Browser) -> None:
        """End the command of a page, or its request; a page that requests it gets the command."""
        if self._requesting is browser:
            self._requesting = None
        if self._commander is not browser:
            return
        self._commander = None
        browser.leave()
        following, self._requesting = self._requesting, None
        if following is not None:
            try:
                self._give_command(following)
            except WinchkitError as error:
                following.say(str(error))

"""The bench of the page: one observer that watches, one station for the browser that commands.

The page supervises nothing. A jog is renewed only by a message of the browser, with the dead-man
of every other client; a move lasts as long as that browser sends signs of life, which become calls
of its station; with its socket the station is closed, and the owner of the bench ends what it
moved. Stop is every browser's.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from winchkit.bench.control.dead_man import DEAD_MAN
from winchkit.bench.remote.client import RemoteStation
from winchkit.bench.remote.session import attach
from winchkit.catalog import find
from winchkit.effects.bind import line_of
from winchkit.effects.catalogue import load_catalogue
from winchkit.errors import ConnectionLost, UsageError, WinchkitError
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.schema.read import read_bench, read_profile
from winchkit.web.drive_objects import drive_objects

__all__ = ["BenchView", "simulated_bench"]

_PERIOD = 0.05
"""Pictures are sent 20 times a second."""
_KEPT = 60.0
"""History of the strip charts, s."""
_PREDICTED = 0.5
"""Period of the model's prediction over the history, s."""
_COUNTED = 0.5
"""Period in which the rows of a log are asked for, s."""
_LATEST_PICTURE = 0.4
"""Age of the picture that a browser had when it ordered a jog, s: eight periods."""
_LARGEST = 4_000
"""Bytes of a message of a browser."""
_CHANNELS = (
    "cable_length", "length", "tension", "load", "cable_speed",
    "motor_angle", "motor_torque", "motor_velocity", "temperature",
)  # fmt: skip
_PATIENCE = 30.0
"""For a simulated bench to start, s."""


class simulated_bench:
    """Runs a simulated bench in a process of its own; gives its bench file.

    Parameters
    ----------
    name : str
        Of the catalogue, or a file.
    folder : Path
        For the bench file.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        self.file = folder / f"{Path(name).stem}-bench.toml"
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> str:
        find("sim", self.name)
        command = [sys.executable, "-m", "winchkit", "sim", "serve", self.name, "--json"]
        self._process = subprocess.Popen(
            [*command, "--bench-file", str(self.file)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait(_PATIENCE)
            raise ConnectionLost(
                f"the simulated bench '{self.name}' did not start; "
                f"'winchkit sim serve {self.name}' says why"
            )
        return str(json.loads(line)["bench"])

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._process is not None:
            self._process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._process.communicate(timeout=_PATIENCE)


class BenchView:
    """A bench as the page shows and commands it; a context manager.

    Parameters
    ----------
    bench : str
        Bench file.
    effects : sequence of str
        Files with effects of the user's own.
    allow_motion : bool
        Whether a browser may command.
    """

    def __init__(self, bench: str, effects: Sequence[str] = (), *, allow_motion: bool) -> None:
        self.spec = read_bench(bench)
        self.file = bench
        self.effects = tuple(effects)
        self.allow_motion = allow_motion
        self._history: dict[str, deque[dict[str, Any]]] = {}
        self._newest: dict[str, Any] = {}
        self._predicted: dict[str, dict[str, Any]] = {}
        self._lost: str = ""
        self._ended = threading.Event()
        self._threads = [
            threading.Thread(target=self._watch, name="page-watch", daemon=True),
            threading.Thread(target=self._predict, name="page-model", daemon=True),
        ]
        self._commander: _Browser | None = None
        self._browsers = 0
        self._lines = {name: self._line(winch.profile) for name, winch in self.spec.winch.items()}

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._ended.set()
        if self._commander is not None:
            self._commander.leave()
        for thread in self._threads:
            thread.join(5.0)

    def routes(self) -> list[Any]:
        """Routes of the Bench view."""
        return [
            Route("/api/bench", self._declared),
            Route("/api/bench/history", self._past),
            Route("/api/bench/objects", self._objects),
            Route("/api/bench/stop", self._stop, methods=["POST"]),
            WebSocketRoute("/live/bench", self._live),
        ]

    # What is declared: limits and geometry for the picture.

    async def _declared(self, request: Request) -> Response:
        winches = {}
        for name, winch in self.spec.winch.items():
            profile = read_profile(find("profiles", winch.profile, beside=self.file))
            limits = winch.limits
            winches[name] = {
                "profile": profile.name,
                "effects": [table.id for table in profile.effect],
                "load_mass": winch.load_mass,
                "limits": {
                    "speed": limits.speed,
                    "length": limits.length,
                    "tension": [limits.tension_slack, limits.tension_high],
                },
                "ratio": profile.gearbox.ratio,
                "drum_radius": profile.drum.winding_radius,
                "pulleys": [
                    {"radius": p.radius, "wrap": p.wrap} for p in getattr(profile, "pulley", ())
                ],
            }
        return JSONResponse(
            {
                "name": self.spec.name,
                "allow_motion": self.allow_motion,
                "winch": winches,
                "dead_man": DEAD_MAN,
            }
        )

    async def _past(self, request: Request) -> Response:
        return JSONResponse({name: list(rows) for name, rows in self._history.items()})

    async def _objects(self, request: Request) -> Response:
        winch = request.query_params.get("winch", "")
        return JSONResponse(await asyncio.to_thread(drive_objects, self.spec, self._newest, winch))

    async def _stop(self, request: Request) -> Response:
        await asyncio.to_thread(self._stop_now)
        return JSONResponse({"stopped": True})

    def _stop_now(self) -> None:
        """Quick-stop by a station of its own, which waits behind no other call."""
        with attach(self.file, self.effects, name="page, Stop", observer=True) as station:
            station.stop()

    # Watching.

    def _watch(self) -> None:
        while not self._ended.is_set():
            try:
                with attach(self.file, self.effects, name="page", observer=True) as station:
                    self._lost = ""
                    while not self._ended.wait(_PERIOD):
                        self._take(station.status())
            except WinchkitError as error:
                self._lost = str(error)
                self._ended.wait(1.0)

    def _take(self, status: dict[str, Any]) -> None:
        self._newest = status
        for name, winch in status["winch"].items():
            rows = self._history.setdefault(name, deque(maxlen=int(_KEPT / _PERIOD)))
            row = {"time": status["time"]} | {key: winch.get(key) for key in _CHANNELS}
            if not rows or rows[-1]["time"] < row["time"]:
                rows.append(row)

    def _line(self, profile: str) -> Line | None:
        try:
            declared = read_profile(find("profiles", profile, beside=self.file))
            return line_of(declared, load_catalogue(self.effects))
        except WinchkitError:
            return None

    def _predict(self) -> None:
        """Predict the outputs over the history from angle and force, for the residuals."""
        while not self._ended.wait(_PREDICTED):
            for name, line in self._lines.items():
                rows = list(self._history.get(name, ()))
                if line is not None and len(rows) > 20:
                    with suppress(WinchkitError, ValueError, FloatingPointError):
                        self._predicted[name] = self._prediction(line, name, rows)

    def _prediction(self, line: Line, name: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
        column = {
            key: np.array([np.nan if row[key] is None else row[key] for row in rows], dtype=float)
            for key in ("time", *_CHANNELS)
        }
        known = {key: values for key, values in column.items() if np.isfinite(values).all()}
        mass = self.spec.winch[name].load_mass
        predicted = line.predict(
            line.motion(
                Signals(
                    column["time"],
                    column["motor_angle"],
                    load=known.get("load"),
                    load_mass=None if "load" in known else mass,
                    tension=known.get("tension"),
                    motor_torque=known.get("motor_torque"),
                    temperature=known.get("temperature"),
                )
            )
        )
        measured = {"cable_length": "length", "tension": "tension", "motor_torque": "motor_torque"}
        out: dict[str, Any] = {"time": column["time"].tolist()}
        for output, channel in measured.items():
            if output not in predicted or channel not in known:
                continue
            error = known[channel] - predicted[output]
            if output == "cable_length":  # the instrument's zero is not the profile's
                error = error - float(np.median(error))
            out[output] = {
                "predicted": (known[channel] - error).tolist(),
                "residual": error.tolist(),
            }
        return out

    # Browsers.

    async def _live(self, socket: WebSocket) -> None:
        await socket.accept()
        self._browsers += 1
        browser = _Browser(f"page {self._browsers}", self)
        listening = asyncio.ensure_future(_received(socket, browser))
        tasks = self._obeying(browser), _counting(browser)
        working = [asyncio.ensure_future(task) for task in tasks]
        predicted: dict[str, Any] | None = None
        try:
            while not listening.done():
                shown: dict[str, Any] = {
                    "status": self._newest,
                    "lost": self._lost,
                    "you_command": self._commander is browser,
                    "commander": self._commander.name if self._commander else "",
                    "said": browser.said,
                    "recording": browser.recording(),
                }
                if predicted is not self._predicted.get(browser.shown):
                    predicted = self._predicted.get(browser.shown)
                    shown["predicted"] = {browser.shown: predicted}
                await socket.send_json(shown)
                await asyncio.wait({listening}, timeout=_PERIOD)
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            listening.cancel()
            for task in working:
                task.cancel()
            if self._commander is browser:
                self._commander = None
            await asyncio.to_thread(browser.leave)

    async def _obeying(self, browser: _Browser) -> None:
        """Carry out the messages of a browser in their order, one after another."""
        while True:
            asked = await browser.inbox.next()
            keeps = asked.get("do") in {"jog", "alive"}
            try:
                await self._obey(asked, browser)
                browser.said = browser.said if keeps else ""
            except WinchkitError as error:
                browser.said = str(error)
            except (ValueError, KeyError, TypeError) as error:
                browser.said = f"the message is malformed: {error}"

    async def _obey(self, asked: dict[str, Any], browser: _Browser) -> None:
        name = str(asked.get("do"))
        if name == "show":
            browser.shown = str(asked["winch"])
            return
        if name == "command":
            await asyncio.to_thread(self._give_command, browser)
            return
        if name == "leave":
            if self._commander is browser:
                self._commander = None
            await asyncio.to_thread(browser.leave)
            return
        if self._commander is not browser:
            raise UsageError("this page only watches; request command first")
        if name == "jog" and not self._is_fresh(asked):
            raise UsageError("the page answers too late to jog; the winch stops")
        await asyncio.to_thread(browser.do, name, asked)

    def _is_fresh(self, asked: dict[str, Any]) -> bool:
        """Whether a jog was ordered by somebody who saw the bench within the last 0.4 s.

        Messages that waited on their way would otherwise move the winch after its key was released.
        """
        now = self._newest.get("time")
        return now is not None and now - float(asked["seen"]) <= _LATEST_PICTURE

    def _give_command(self, browser: _Browser) -> None:
        if not self.allow_motion:
            raise UsageError(
                "this page only watches: start 'winchkit serve' with --allow-motion to move"
            )
        if self._commander is not None and self._commander is not browser:
            raise UsageError(f"{self._commander.name} commands; it must release the bench first")
        browser.take(attach(self.file, self.effects, name=browser.name))
        self._commander = browser


class _Inbox:
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


async def _received(socket: WebSocket, browser: _Browser) -> None:
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


async def _counting(browser: _Browser) -> None:
    """Ask for the rows of the log that a browser started, while there is one."""
    while True:
        await asyncio.sleep(_COUNTED)
        await asyncio.to_thread(browser.count)


class _Browser:
    """One open page; with a station of its own while it commands."""

    def __init__(self, name: str, view: BenchView) -> None:
        self.name = name
        self.view = view
        self.shown = next(iter(view.spec.winch))
        self.said = ""
        self.inbox = _Inbox()
        self._station: RemoteStation | None = None
        self._log: tuple[str, float] | None = None
        self._counted: dict[str, Any] = {}

    def take(self, station: RemoteStation) -> None:
        """Command by a station."""
        self.leave()
        self._station = station

    def leave(self) -> None:
        """Close the station: the owner ends what was started by it."""
        station, self._station, self._log = self._station, None, None
        self._counted = {}
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
        if winch is not None and winch != "all" and winch not in self.view.spec.winch:
            raise UsageError(f"there is no winch '{winch}'")
        actions: dict[str, Callable[[], object]] = {
            "jog": lambda: station.jog(winch, _number(asked["speed"]), DEAD_MAN),
            "release": lambda: station.jog(winch, 0.0, _PERIOD),
            "alive": lambda: station.moving(winch),
            "step": lambda: station.step(winch, _number(asked["change"]), _number(asked["speed"])),
            "move": lambda: station.move(
                winch, _number(asked["to"]), None, _number(asked["speed"])
            ),
            "reset": station.reset,
            "tare": lambda: station.tare(winch),
            "take_over": lambda: station.take_over(winch),
            "record": lambda: self._record(station, str(asked["file"])),
            "end_record": lambda: self._end_record(station),
        }
        if name not in actions:
            raise UsageError(f"there is no action '{name}'; there are {', '.join(actions)}")
        actions[name]()

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
    if not np.isfinite(number):
        raise UsageError("a speed or a length is no finite number")
    return number

"""The page in Chromium: served processes, opened pages, a relay that can be cut, true speeds."""

from __future__ import annotations

import contextlib
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from stalls import StallWatch
from winchkit.sim.live.client import send

__all__ = [
    "STARTS",
    "Motor",
    "Relay",
    "Served",
    "opened",
    "texts",
    "until",
]

STARTS = 60.0
"""For a page or a server to start, s."""


class Served:
    """``winchkit serve`` in a process of its own."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "winchkit", "serve", "--no-browser", *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.url = self.process.stdout.readline().strip()
        assert self.url.startswith("http://127.0.0.1:"), self.url

    def end(self) -> None:
        """End it like Ctrl-C does."""
        self.process.terminate()
        self.process.communicate(timeout=STARTS)


def opened(browser: Any, url: str, **options: Any) -> tuple[Any, list[str]]:
    """A page and its complaints: errors of scripts, and requests that leave this computer."""
    context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})
    page, complaints = context.new_page(), []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "console",
        lambda message: complaints.append(message.text) if message.type == "error" else None,
    )
    page.on(
        "request",
        lambda request: (
            None
            if request.url.startswith(("http://127.0.0.1", "ws://127.0.0.1", "data:", "blob:"))
            else complaints.append(request.url)
        ),
    )
    page.goto(url)
    return page, complaints


def until(page: Any, condition: Callable[[], bool], seconds: float = STARTS) -> float:
    """Wait for a condition; the time that it took, s."""
    start = time.monotonic()
    while not condition():
        assert time.monotonic() - start < seconds, "it did not happen"
        page.wait_for_timeout(20)
    return time.monotonic() - start


def texts(page: Any, selector: str) -> list[str]:
    """Texts of the elements of a selector."""
    return [str(text) for text in page.locator(selector).all_inner_texts()]


class Relay:
    """A TCP port that leads to another one until it is cut, with notice to both or without."""

    def __init__(self, port: int) -> None:
        self._to = port
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self._passes = threading.Event()
        self._passes.set()
        self._open: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._start(self._accept)

    def _start(self, target: Callable[..., None], *arguments: socket.socket) -> None:
        thread = threading.Thread(target=target, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def stall(self) -> None:
        """Pass nothing more, and close nothing."""
        self._passes.clear()

    def cut(self) -> None:
        """Close every connection, and take no further one."""
        for one in (self._server, *self._open):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
        self._passes.set()
        for thread in tuple(self._threads):
            thread.join(5.0)
        for one in (self._server, *self._open):
            one.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._server.accept()
                far = socket.create_connection(("127.0.0.1", self._to))
                self._open += [near, far]
                for pair in ((near, far), (far, near)):
                    self._start(self._pass, *pair)

    def _pass(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65_536):
                self._passes.wait()
                sink.sendall(data)
            sink.shutdown(socket.SHUT_RDWR)


class Motor:
    """The true speed of a simulated winch's motor, asked of the simulation itself."""

    def __init__(self, bench_file: str, watch: StallWatch) -> None:
        self._file, self._watch = bench_file, watch

    def now(self) -> float:
        """rad/s."""
        reply = send(self._file, "status")
        found = re.search(r"(-?[\d.]+) rad/s", reply)
        assert found is not None, reply
        return float(found[1])

    def moved_after(self, event: Callable[[], object], still: float = 0.6) -> float:
        """Time from an event to the last moment with speed, before it stood for ``still`` s.

        Less the time for which the processes of the test waited for a processor meanwhile: that
        delays the event on its way, and not what the event leads to.
        """
        waited, since = self._watch.total(), time.monotonic()
        event()
        last = (since, waited)
        while time.monotonic() < last[0] + still:
            if self.now() != 0.0:
                last = time.monotonic(), self._watch.total()
            assert time.monotonic() < since + STARTS, "the motor does not stop"
            time.sleep(0.01)
        return last[0] - since - (last[1] - waited)

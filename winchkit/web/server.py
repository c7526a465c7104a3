"""Runs the page on the loopback address until it is ended."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from winchkit.arguments import path_of, require_types
from winchkit.catalog import find
from winchkit.errors import ConnectionLost, UsageError

if TYPE_CHECKING:
    import uvicorn

_HOST = "127.0.0.1"
_SHUTDOWN = 1
"""For open sockets to close at the end, s; a browser that does not answer is left."""
_CANCELLED = 0.3
"""For cancelled requests to end, s."""


def serve(
    runs: Sequence[str | Path] = (),
    profile: str | Path | None = None,
    *,
    port: int = 0,
    folder: str | Path = ".",
    bench: str | Path | None = None,
    sim: str | Path | None = None,
    allow_motion: bool = False,
    effect_files: Sequence[str | Path] = (),
    mystery: int | None = None,
    ready: Callable[[str], None] = print,
) -> None:
    """Serve the page until the process is interrupted.

    Parameters
    ----------
    runs : sequence of str or Path
        Run files to open.
    profile : str or Path, optional
        Profile to open, a name or a file.
    port : int
        0 for a free one.
    folder : str or Path
        Whose runs the Library view lists.
    bench : str or Path, optional
        A bench file to attach to.
    sim : str or Path, optional
        A simulated bench to start and attach to.
    allow_motion : bool
        Whether the page may move the bench.
    effect_files : sequence of str or Path
        Files with effects of the user's own.
    mystery : int, optional
        Seed of a simulated bench with a hidden effect, whose runs are opened.
    ready : callable
        Called with the URL as soon as the page answers.

    Raises
    ------
    UsageError
        Where the port is in use, or the extra ``web`` is not installed.
    """
    require_types(runs, (str, Path), "runs")
    require_types(effect_files, (str, Path), "effect_files")
    folder = path_of(folder, "folder")
    try:
        import uvicorn

        from winchkit.web.application import application
    except ImportError as error:
        raise UsageError(
            f"the page needs the extra 'web' ({error.name} is missing): pip install 'winchkit[web]'"
        ) from None
    from winchkit.web.views import views_of
    from winchkit.web.workspace import DiagnoseView

    effects = [str(file) for file in effect_files]
    named = None if profile is None else str(path_of(profile, "profile"))
    token = secrets.token_urlsafe(24)
    with ExitStack() as stack:
        own_folder = TemporaryDirectory(prefix="winchkit-page-", ignore_cleanup_errors=True)
        own = Path(stack.enter_context(own_folder))
        workspace = DiagnoseView(own, effects, work=folder)
        stack.callback(workspace.close)
        view = None
        if bench is not None or sim is not None:
            from winchkit.web.bench.view import BenchView
            from winchkit.web.server import simulated_bench

            if sim is not None:
                bench = stack.enter_context(simulated_bench(str(sim), own))
            assert bench is not None
            view = stack.enter_context(
                BenchView(str(bench), effects, allow_motion=allow_motion, folder=own)
            )
        views = views_of(workspace, folder)
        app = application(workspace, token, views, view)
        shown = next((one for one in views if named and one.is_profile(named)), None)
        if mystery is not None:
            workspace.mystery(mystery)
        elif runs or named:
            (shown or workspace).open([str(run) for run in runs], named)
        if view is not None and view.robot_profile and shown is None:
            for one in views:
                if one.is_profile(view.robot_profile):
                    one.open([], view.robot_profile)
        listening = stack.enter_context(_listening(port))
        config = uvicorn.Config(
            app,
            log_level="critical",
            ws_max_size=64_000,
            timeout_graceful_shutdown=_SHUTDOWN,
            lifespan="on",
        )
        at = "" if shown is None else f"#{shown.name}"
        ready(f"http://{_HOST}:{listening.getsockname()[1]}/?token={token}{at}")
        _run(uvicorn.Server(config), listening)


def _run(server: uvicorn.Server, listening: socket.socket) -> None:
    """Serve until a signal; computations under way in threads are not waited for at the end."""
    loop = asyncio.new_event_loop()
    try:
        loop.run_until_complete(server.serve(sockets=[listening]))
    finally:
        pending = asyncio.all_tasks(loop)
        for task in pending:
            task.cancel()
        if pending:
            loop.run_until_complete(asyncio.wait(pending, timeout=_CANCELLED))
        loop.close()


def _listening(port: int) -> socket.socket:
    found = socket.socket()
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind((_HOST, port))
    except OSError as error:
        found.close()
        raise UsageError(
            f"--port {port}: cannot be used: {error.strerror}; name another"
        ) from error
    found.listen()
    return found


_TIMEOUT = 30.0
"""For a simulated bench to start, s."""
_ENDING = 0.5
"""For a simulated bench to end, s; after that it ends by itself."""


class simulated_bench:
    """Runs a simulated bench in a process of its own; gives its bench file."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name = name
        self.file = folder / f"{Path(name).stem}-bench.toml"
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> str:
        find("sim", self.name)
        command = [sys.executable, "-m", "winchkit", "sim", "serve", self.name, "--json"]
        self._process = subprocess.Popen(
            # Its input is a pipe, which closes with this process however that ends.
            [*command, "--end-with-input", "--bench-file", str(self.file)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait(_TIMEOUT)
            raise ConnectionLost(
                f"the simulated bench '{self.name}' did not start; "
                f"'winchkit sim serve {self.name}' says why"
            )
        return str(json.loads(line)["bench"])

    def __exit__(self, *_: object) -> None:
        process = self._process
        if process is None:
            return
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.communicate(timeout=_ENDING)
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                stream.close()

"""Routes of the page. Requests that are too large or malformed are refused."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from starlette.applications import Starlette
from starlette.datastructures import QueryParams
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from winchkit.catalog import names
from winchkit.errors import UsageError, WinchkitError
from winchkit.profile_edit.new_profile import drawing
from winchkit.version import __version__
from winchkit.web.channels import TIME, lines_of
from winchkit.web.foreign import is_run, preview
from winchkit.web.guard import Guard
from winchkit.web.views import View, answered, attachment
from winchkit.web.workspace import DiagnoseView

if TYPE_CHECKING:
    from winchkit.web.bench.view import BenchView

_STATIC = Path(__file__).parent / "static"
_LARGEST_FILE = 400_000_000
"""Bytes of a dropped file: 20 channels of 10⁶ samples as text."""
_MOST_POINTS = 8000
"""Points of a curve: two per pixel of a screen of 4000."""
_LARGEST_MESSAGE = 64_000
"""Bytes of a message that orders something."""


def application(
    workspace: DiagnoseView,
    token: str,
    views: Sequence[View] = (),
    bench: BenchView | None = None,
) -> Starlette:
    """The page as an ASGI application."""
    listeners = _Listeners()
    workspace.changed = listeners.wake

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        listeners.loop = asyncio.get_running_loop()
        yield
        listeners.loop = None
        workspace.close()

    routes = [
        *_Work(workspace, views, has_bench=bench is not None).routes(listeners),
        *_Drawings(workspace).routes(),
        *(route for view in views for route in view.routes()),
        *([] if bench is None else bench.routes()),
        Route("/", _page),
        Mount("/static", StaticFiles(directory=_STATIC)),
    ]
    return Starlette(
        routes=routes,
        middleware=[Middleware(Guard, token=token)],
        exception_handlers={
            WinchkitError: partial(_refused, workspace),
            ValueError: _malformed,
            KeyError: _malformed,
            TypeError: _malformed,
        },
        lifespan=lifespan,
    )


async def _page(request: Request) -> Response:
    return FileResponse(_STATIC / "index.html", media_type="text/html")


class _Listeners:
    """Open pages that are notified of every change of the workspace."""

    def __init__(self) -> None:
        self.loop: asyncio.AbstractEventLoop | None = None
        self.events: set[asyncio.Event] = set()

    def wake(self) -> None:
        """Notify all of them; callable from any thread."""
        if self.loop is not None:
            self.loop.call_soon_threadsafe(self._set)

    def _set(self) -> None:
        for event in self.events:
            event.set()


class _Work:
    """Routes that change the workspace, and its view."""

    def __init__(self, workspace: DiagnoseView, views: Sequence[View], *, has_bench: bool) -> None:
        self.workspace = workspace
        self.views = views
        self.has_bench = has_bench

    def routes(self, listeners: _Listeners) -> list[Route | WebSocketRoute]:
        """The routes."""

        async def live(socket: WebSocket) -> None:
            await self._live(socket, listeners)

        return [
            Route("/api/view", self._view),
            Route("/api/choices", self._choices),
            Route("/api/drop", self._drop, methods=["POST"]),
            Route("/api/guess", self._guess, methods=["POST"]),
            Route("/api/do", self._order, methods=["POST"]),
            WebSocketRoute("/live", live),
        ]

    def _shown(self) -> dict[str, Any]:
        shown = self.workspace.view() | {"bench": self.has_bench, "version": __version__}
        for view in self.views:
            shown |= view.shown()
        return shown

    async def _view(self, request: Request) -> Response:
        return JSONResponse(self._shown())

    async def _choices(self, request: Request) -> Response:
        effects = [effect.id for effect in self.workspace.catalogue]
        known = names("profiles")
        choices: dict[str, Any] = {
            "profiles": [name for name in known if self._view_of(name) is None],
            "examples": names("sim"),
            "effects": effects,
            "drawing": drawing(),
        }
        for view in self.views:
            choices |= view.choices(known)
        return JSONResponse(choices)

    async def _drop(self, request: Request) -> Response:
        name = unquote(request.headers.get("x-file-name", ""))
        path = self.workspace.keep(name, await _body(request, _LARGEST_FILE)).resolve()
        if path.suffix == ".toml":
            self._open_profile(str(path))
        elif await asyncio.to_thread(is_run, path):
            there = request.headers.get("x-view")
            opens = next((view for view in self.views if view.name == there), self.workspace)
            opens.open([path])
        else:
            found = await asyncio.to_thread(preview, path)
            return JSONResponse({"import": found, "file": self._place(path)})
        return _accepted()

    async def _guess(self, request: Request) -> Response:
        asked = await _object(request)
        path = self.workspace.dropped(str(asked["file"]))
        found = await asyncio.to_thread(preview, path, dict(asked["answers"]))
        return JSONResponse({"import": found, "file": self._place(path)})

    def _place(self, path: Path) -> str:
        """A dropped file as further requests name it."""
        return path.relative_to(self.workspace.folder.resolve()).as_posix()

    async def _order(self, request: Request) -> Response:
        asked, work = await _object(request), self.workspace
        actions: dict[str, Callable[[], object]] = {
            "profile": lambda: self._open_profile(str(asked["name"])),
            "example": lambda: work.example(str(asked["name"])),
            "mystery": lambda: work.mystery(int(asked["seed"])),
            "use": lambda: work.use(str(asked["name"]), used=bool(asked["used"])),
            "remove": lambda: work.remove(str(asked["name"])),
            "import": lambda: work.take(str(asked["file"]), dict(asked["answers"])),
            "new-profile": lambda: work.new_profile(
                str(asked["name"]), dict(asked["values"]), list(asked["pulleys"])
            ),
            "diagnose": work.diagnose,
            "use-effect": lambda: work.use_effect(str(asked["file"])),
            "add": lambda: work.add(str(asked["effect"])),
            "undo": work.undo,
            "compare": lambda: work.compare(_version(asked["profile"]), list(asked["runs"])),
            "swap": work.swap,
            "end": work.end_comparison,
            "cancel": work.cancel,
        }
        for view in self.views:
            actions |= {key: partial(order, asked) for key, order in view.orders().items()}
        name = str(asked.get("do"))
        if name not in actions:
            raise UsageError(f"there is no action '{name}'; there are {', '.join(actions)}")
        actions[name]()
        return _accepted()

    def _open_profile(self, name: str) -> None:
        (self._view_of(name) or self.workspace).open([], name)

    def _view_of(self, profile: str) -> View | None:
        """The view that opens a profile; None for one of a winch."""
        return next((view for view in self.views if view.is_profile(profile)), None)

    async def _live(self, socket: WebSocket, listeners: _Listeners) -> None:
        await socket.accept()
        event = asyncio.Event()
        listeners.events.add(event)
        closed = asyncio.ensure_future(_until_closed(socket))
        try:
            while not closed.done():
                event.clear()
                await socket.send_json(self._shown())
                woken = asyncio.ensure_future(event.wait())
                await asyncio.wait({woken, closed}, return_when=asyncio.FIRST_COMPLETED)
                woken.cancel()
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            listeners.events.discard(event)
            closed.cancel()


class _Drawings:
    """Routes that read or write files: curves, cards, plans, an effect of the user's."""

    def __init__(self, workspace: DiagnoseView) -> None:
        self.workspace = workspace

    def routes(self) -> list[Route]:
        """The routes."""
        work = self.workspace
        return [
            answered("/api/curve", self._curve),
            answered("/api/multiples", self._multiples),
            answered("/api/lines", self._lines),
            answered("/api/card", lambda query: work.card(query.get("effect", ""))),
            answered("/api/pattern", lambda query: work.pattern(int(query.get("number", "0")))),
            answered("/api/plan", lambda _: work.plan(), "POST"),
            answered("/api/effect", lambda _: work.new_effect(), "POST"),
            answered("/api/truth", lambda _: {"truth": work.truth()}),
            Route("/api/profile", self._profile),
            Route("/api/report", self._report),
        ]

    def _curve(self, query: QueryParams) -> object:
        if self._has_ended(query):
            return None
        curves = self.workspace.curves(query.get("output", ""), beside="beside" in query)
        first, last = float(query.get("from", "-inf")), float(query.get("to", "inf"))
        return curves.over_time(first, last, min(_MOST_POINTS, int(query.get("points", "1600"))))

    def _multiples(self, query: QueryParams) -> object:
        if self._has_ended(query):
            return None
        output, beside = query.get("output", ""), "beside" in query
        known = self.workspace.side(beside).order_of(output)
        curves = self.workspace.curves(output, beside=beside)
        return curves.multiples(known, query.getlist("over"))

    def _has_ended(self, query: QueryParams) -> bool:
        """Whether a side of a comparison is asked for that was ended meanwhile."""
        return "beside" in query and self.workspace.state.beside is None

    def _lines(self, query: QueryParams) -> object:
        runs = [(item.name, item.run) for item in self.workspace.state.used]
        return lines_of(runs, query.get("channel", ""), query.get("over", TIME))

    async def _profile(self, request: Request) -> Response:
        name, text = self.workspace.profile_text()
        return attachment(text, name, "application/toml")

    async def _report(self, request: Request) -> Response:
        text = await asyncio.to_thread(self.workspace.report)
        return attachment(text, "report.html", "text/html")


def _version(asked: object) -> int | str:
    """Number of a version, or a name."""
    return asked if isinstance(asked, int) else str(asked)


def _accepted() -> Response:
    return JSONResponse({"accepted": True}, 202)


async def _object(request: Request) -> dict[str, Any]:
    """Body of a request as a JSON object; raises UsageError."""
    asked = json.loads(await _body(request, _LARGEST_MESSAGE))
    if not isinstance(asked, dict):
        raise UsageError("the request is no JSON object")
    return asked


async def _refused(workspace: DiagnoseView, request: Request, error: Exception) -> Response:
    return JSONResponse({"error": workspace.words(str(error))}, 400)


async def _malformed(request: Request, error: Exception) -> Response:
    lacks = f" lacks {error}" if isinstance(error, KeyError) else " has a value of a wrong kind"
    return JSONResponse({"error": f"The request of the page{lacks}; reload the page."}, 400)


async def _body(request: Request, largest: int) -> bytes:
    """Body of a request; raises UsageError where it is too large."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > largest:
            raise UsageError(f"the file has more than {largest / 1e6:g} MB; use the command line")
        parts.append(part)
    return b"".join(parts)


async def _until_closed(socket: WebSocket) -> None:
    """Read, and forget, what the browser sends until it closes."""
    try:
        while True:
            await socket.receive_text()
    except (WebSocketDisconnect, RuntimeError, KeyError):
        return

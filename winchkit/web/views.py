"""Views of the page beside those of a winch: what a wing has of them on the server."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from starlette.datastructures import QueryParams
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from winchkit import wings
from winchkit.errors import UsageError
from winchkit.web.workspace import DiagnoseView

Order = Callable[[Mapping[str, Any]], object]
"""Does what a request of the page orders."""


class View:
    """A view with its routes and orders; made for the workspace and the folder of the page's runs.

    A view has what it needs of the methods; these have nothing.
    """

    name = ""
    """First part of its address on the page; files that are dropped there name it."""

    def __init__(self, workspace: DiagnoseView, folder: Path) -> None:
        self.workspace = workspace
        self.folder = folder

    def routes(self) -> list[Route]:
        """Routes that read."""
        return []

    def orders(self) -> Mapping[str, Order]:
        """Orders by their name."""
        return {}

    def shown(self) -> dict[str, Any]:
        """Part of what every page is sent at every change."""
        return {}

    def choices(self, profiles: Sequence[str]) -> dict[str, Any]:
        """Part of the choices, among them those of the shipped profiles that it opens."""
        return {}

    def is_profile(self, name: str) -> bool:
        """Whether it opens a profile, by name or file."""
        return False

    def open(self, runs: Sequence[str | Path], profile: str | None = None) -> None:
        """Open runs or a profile."""
        raise UsageError(f"the view '{self.name}' opens no files")


def views_of(workspace: DiagnoseView, folder: Path) -> list[View]:
    """Views of all wings."""
    return [
        wings.imported(place)(workspace, folder) for wing in wings.own() for place in wing.views
    ]


def answered(path: str, call: Callable[[QueryParams], object], method: str = "GET") -> Route:
    """A route that answers what ``call`` makes of the query, on a thread, as JSON."""

    async def answer(request: Request) -> Response:
        return JSONResponse(await asyncio.to_thread(call, request.query_params))

    return Route(path, answer, methods=[method])


def attachment(text: str, name: str, media: str) -> Response:
    """A file to be saved by the browser."""
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(text, media_type=media, headers=headers)

"""The Library view on the server: runs of the folder, and the fleet as a grid."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from winchkit.fleet.web.fleet import Fleet
from winchkit.fleet.web.runs import Library
from winchkit.web.channels import TIME
from winchkit.web.views import Order, View
from winchkit.web.workspace import DiagnoseView


class LibraryView(View):
    """Runs of the folder, and one set of effects over winches and time."""

    name = "library"

    def __init__(self, workspace: DiagnoseView, folder: Path) -> None:
        super().__init__(workspace, folder)
        self.library = Library(folder)
        self.fleet = Fleet(self.library, workspace.effects)

    def routes(self) -> list[Route]:
        """Tables of runs and of the fleet."""
        return [
            Route("/api/runs", self._runs),
            Route("/api/overlay", self._overlay),
            Route("/api/fleet", self._fleet),
            Route("/api/fleet/runs", self._fleet_runs),
        ]

    def orders(self) -> Mapping[str, Order]:
        """Show runs of the folder, or fit the fleet."""
        work = self.workspace
        return {
            "library": lambda asked: work.show(
                [self.library.run(str(name)) for name in asked["names"]], asked.get("profile")
            ),
            "fleet": lambda asked: work.task("fitting the fleet", lambda: self._fit(asked)),
        }

    def _fit(self, asked: Mapping[str, Any]) -> None:
        effects = [str(effect) for effect in asked.get("effects", ())]
        self.fleet.fit(str(asked["profile"]), effects, self.workspace.progress)

    async def _runs(self, request: Request) -> Response:
        judged = dict(self.workspace.judged)
        return JSONResponse(await asyncio.to_thread(self.library.rows, judged))

    async def _overlay(self, request: Request) -> Response:
        query = request.query_params
        wanted, channel = query.getlist("name"), query.get("channel", "tension")
        over = query.get("over", TIME)
        return JSONResponse(await asyncio.to_thread(self.library.overlay, wanted, channel, over))

    async def _fleet(self, request: Request) -> Response:
        return JSONResponse(await asyncio.to_thread(self.fleet.view))

    async def _fleet_runs(self, request: Request) -> Response:
        query = request.query_params
        winch, time = query["winch"], float(query["time"])
        return JSONResponse(await asyncio.to_thread(self.fleet.runs, winch, time))

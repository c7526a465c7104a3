"""The Robot view on the server: its routes, its orders, and the profiles that it opens."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from winchkit.catalog import find
from winchkit.errors import WinchkitError
from winchkit.robot.web.robot import RobotWork
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.read import read_any
from winchkit.web.views import Order, View, attachment
from winchkit.web.workspace import DiagnoseView


class RobotView(View):
    """Calibration of a robot, its picture and the forces of its cables."""

    name = "robot"

    def __init__(self, workspace: DiagnoseView, folder: Path) -> None:
        super().__init__(workspace, folder)
        self.work = RobotWork(workspace.folder, workspace.named)

    def routes(self) -> list[Route]:
        """Data, pictures and files."""
        return [
            Route("/api/robot", self._view),
            Route("/api/robot/picture", self._picture),
            Route("/api/robot/slice", self._slice),
            Route("/api/robot/profile", self._profile),
            Route("/api/robot/report", self._report),
        ]

    def orders(self) -> Mapping[str, Order]:
        """Calibrate, and propose poses."""
        task, work = self.workspace.task, self.work
        return {
            "calibrate": lambda asked: task("calibrating", work.calibrate),
            "propose": lambda asked: task("proposing poses", work.propose),
        }

    def shown(self) -> dict[str, Any]:
        """Name of the open robot, and the number of its last change."""
        return {"robot": self.work.summary()}

    def choices(self, profiles: Sequence[str]) -> dict[str, Any]:
        """Shipped robots."""
        return {"robots": [name for name in profiles if self.is_profile(name)]}

    def is_profile(self, name: str) -> bool:
        """Whether a profile is that of a robot; False where it cannot be read."""
        try:
            return isinstance(read_any(find("profiles", name)), RobotProfile)
        except WinchkitError:
            return False  # the reader of winches says what is wrong with it

    def open(self, runs: Sequence[str | Path], profile: str | None = None) -> None:
        """Open a robot's profile or its poses in the thread of the workspace."""
        self.workspace.task("calibrating", lambda: self.work.open(runs, profile))

    async def _view(self, request: Request) -> Response:
        return JSONResponse(await asyncio.to_thread(self.work.view))

    async def _picture(self, request: Request) -> Response:
        query = request.query_params
        limits = float(query["low"]), float(query["high"])
        return JSONResponse(await asyncio.to_thread(self.work.picture, int(query["row"]), limits))

    async def _slice(self, request: Request) -> Response:
        query = request.query_params
        limits = float(query["low"]), float(query["high"])
        height, row = float(query["z"]), int(query["row"])
        return JSONResponse(await asyncio.to_thread(self.work.slice, height, row, limits))

    async def _profile(self, request: Request) -> Response:
        name, text = await asyncio.to_thread(self.work.profile_text)
        return attachment(text, name, "application/toml")

    async def _report(self, request: Request) -> Response:
        text = await asyncio.to_thread(self.work.report)
        return attachment(text, "calibration.html", "text/html")

"""The Library view on the server: runs of the folder, and the fleet as a grid."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from starlette.datastructures import QueryParams
from starlette.routing import Route

from winchkit.fleet.web.fleet import Fleet
from winchkit.fleet.web.runs import Library
from winchkit.web.channels import TIME
from winchkit.web.views import Order, View, answered
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
            answered("/api/runs", lambda _: self.library.rows(dict(self.workspace.judged))),
            answered("/api/overlay", self._overlay),
            answered("/api/fleet", lambda _: self.fleet.view()),
            answered(
                "/api/fleet/runs",
                lambda query: self.fleet.runs(query["winch"], float(query["time"])),
            ),
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

    def _overlay(self, query: QueryParams) -> object:
        wanted, channel = query.getlist("name"), query.get("channel", "tension")
        return self.library.overlay(wanted, channel, query.get("over", TIME))

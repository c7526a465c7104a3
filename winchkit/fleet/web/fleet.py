"""The fleet of the Library view: winches × effects × time, and the runs behind every estimate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from winchkit.errors import UsageError
from winchkit.fleet.diagnosis.history import FleetParameter, WinchHistory
from winchkit.fleet.library.history import LibraryHistory, library_history
from winchkit.fleet.library.index import profile_path
from winchkit.fleet.library.sessions import winch_sessions
from winchkit.fleet.report.text import change_text, nothing_text, odd_texts
from winchkit.fleet.web.runs import Library
from winchkit.plain_json import significant
from winchkit.quantity_text import scale_for
from winchkit.report.words.sentence import capital
from winchkit.report.words.vocabulary import effect_name

_DIGITS = 4


class Fleet:
    """One set of effects over all sessions of the library, fitted on request."""

    def __init__(self, library: Library, effects: Sequence[str] = ()) -> None:
        self.library = library
        self.effects = tuple(effects)
        self._profile = ""
        self._found: LibraryHistory | None = None

    def fit(
        self, profile: str, effects: Sequence[str], progress: Callable[[str, float], None]
    ) -> None:
        """Fit every session, with one profile or a folder of ``WINCH.toml``; by default the effects
        that the library's diagnoses name. Raises FileError and UsageError."""
        found = library_history(
            self.library.folder,
            profile,
            effects=effects,
            effect_files=self.effects,
            progress=lambda what, share: progress(what, share or 0.0),
        )
        self._profile, self._found = profile, found

    def view(self) -> dict[str, Any]:
        """Facts on the fleet."""
        tables = self.library.tables
        sessions = [] if tables is None else winch_sessions(tables)
        rows = [] if tables is None else tables.read("diagnoses", ("profile_name",)).to_pylist()
        out: dict[str, Any] = {
            "folder": self.library.folder.name,
            "indexed": tables is not None,
            "sessions": len(sessions),
            "diagnosed": len(rows),
            "profile": self._profile or next((row["profile_name"] for row in rows), ""),
            "fitted": None,
        }
        if self._found is not None:
            history = self._found.history
            out["fitted"] = {
                "effects": list(self._found.effects),
                "sessions": self._found.sessions,
                "failures": dict(self._found.failures) | dict(self._found.faults),
                "changed": len(history.changed),
                "odd": len(history.odd),
                "nothing": nothing_text(history),
                "winches": len({session.winch for session in sessions}),
                "procedure": history.procedure,
                "undetermined": history.undetermined,
                "parameters": [parameter_json(own) for own in history.parameters],
            }
        return out

    def runs(self, winch: str, time: float) -> dict[str, Any]:
        """Names of the runs of a winch's session (start, s since 1970, UTC), and the profile that
        they were fitted with."""
        tables = self.library.tables
        for session in [] if tables is None else winch_sessions(tables):
            if session.winch == winch and abs(session.time.timestamp() - time) < 1.0:
                names = [f"{r.path}:{r.prefix}" if r.prefix else r.path for r in session.runs]
                profile = self._profile and str(profile_path(self._profile, winch))
                return {"session": session.session, "runs": names, "profile": profile}
        raise UsageError(f"there is no session of winch '{winch}' at {time:.0f}")


def parameter_json(own: FleetParameter) -> dict[str, Any]:
    """A parameter of an effect over the fleet, in the unit that suits its common value."""
    sizes = (own.common, own.common_std, own.between_std, own.session_std)
    scale = scale_for(sizes, "%" if own.unit == "1" else own.unit)
    factor = 1.0 / scale.worth
    return {
        "effect": own.effect,
        "name": capital(effect_name(own.effect)),
        "parameter": own.parameter,
        "unit": scale.label,
        "common": factor * own.common,
        "common_std": factor * own.common_std,
        "between_std": factor * own.between_std,
        "session_std": factor * own.session_std,
        "winches": [_winch(own, winch, factor) for winch in own.winches],
    }


def _winch(own: FleetParameter, winch: WinchHistory, factor: float) -> dict[str, Any]:
    series, change = winch.series, winch.change
    step = None
    texts: list[str] = []
    if winch.changed and change is not None:
        words = change_text(own, winch)
        texts += [
            f"{words.cause}: changed by {words.size} {words.since}",
            f"now {words.now}",
            f"costs {words.cost} (rms over the runs)" if words.cost else "",
            f"do: {words.advice}",
        ]
        step = {
            "kind": winch.kind,
            "before": factor * change.level_before,
            "after": factor * change.level,
            "date": None if change.date is None else change.date.date,
            "earliest": None if change.date is None else change.date.earliest,
            "latest": None if change.date is None else change.date.latest,
        }
    if winch.odd:
        texts += [line.strip() for line in odd_texts(own, winch)]
    return {
        "winch": winch.winch,
        "times": series.times.tolist(),
        "values": significant((factor * series.values).tolist(), _DIGITS + 2),
        "stds": significant((factor * series.stds).tolist(), _DIGITS),
        "deviations": significant(own.deviations(winch).tolist(), _DIGITS),
        "change": step,
        "odd": winch.odd,
        "texts": [text for text in texts if text],
    }

"""The Diagnose view as its routes use it: requests, which the thread carries out, and what is read.

Requests are carried out in their order; each returns at once.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from winchkit.diagnosis.new_effect import new_effect, order_of_drum
from winchkit.diagnosis.plan import plan
from winchkit.effects.effect_template import write_wave_on_drum
from winchkit.errors import UsageError
from winchkit.profile_edit.new_profile import new_profile, profile_command
from winchkit.report.words.sentence import capital, plan_texts
from winchkit.report.words.vocabulary import effect_name, listed
from winchkit.schema.read import read_profile
from winchkit.schema.write import write_programme
from winchkit.web.candidate import candidate_card, pattern
from winchkit.web.curves import OutputCurves
from winchkit.web.work import NO_NAME, DiagnoseWork, StoredRun


def _duration(minutes: float) -> str:
    return f"{minutes:.1f} minutes" if minutes >= 1 else f"{60 * minutes:.0f} seconds"


class DiagnoseView(DiagnoseWork):
    """State of the Diagnose view, its requests, and what the page reads of it."""

    def open(self, paths: Sequence[str | Path], profile: str | None = None) -> Future[None]:
        """Load run files, and a profile by name or file."""
        return self.task("reading files", lambda: self._open(paths, profile))

    def show(self, runs: Sequence[StoredRun], profile: str | None = None) -> Future[None]:
        """Show runs of the library in place of the loaded ones."""
        return self.task("reading files", lambda: self._show(runs, profile))

    def use(self, name: str, *, used: bool) -> Future[None]:
        """Take a run into the comparison or leave it out."""
        return self.task("reading files", lambda: self._use(name, used=used))

    def remove(self, name: str) -> Future[None]:
        """Forget a run."""
        kept = tuple(item for item in self._state.runs if item.name != name)
        return self.task("reading files", lambda: self._set(runs=kept, answer=None, curves={}))

    def diagnose(self) -> Future[None]:
        """Diagnose the present profile on the runs that are used."""
        return self.task("diagnosing", self._diagnose)

    def add(self, effect: str) -> Future[None]:
        """Add an effect to the profile, refitted, and diagnose again."""
        return self.task(f"adding {effect_name(effect)}", lambda: self._add(effect))

    def example(self, name: str) -> Future[None]:
        """Simulate runs of a bench of the catalogue, and open them with its profile."""
        return self.task("simulating runs", lambda: self._example(name))

    def mystery(self, seed: int) -> Future[None]:
        """Simulate runs of a bench with a hidden effect; no command makes them without its name."""
        return self.task("simulating runs", lambda: self._mystery(seed))

    def take(self, file: str, answers: Mapping[str, Any]) -> Future[None]:
        """Import a dropped file of another program with the answers to its questions."""
        return self.task("importing", lambda: self._take(file, answers))

    def new_profile(self, name: str, values: Mapping[str, str], pulleys: Sequence[str]) -> None:
        """Write the profile of a winch into the user's folder, and open it; raises UsageError."""
        plain = f"{NO_NAME.sub('-', name.strip()).removesuffix('.toml').strip('. ')}.toml"
        if plain == ".toml":
            raise UsageError("the profile has no name; type one, for example my-winch")
        self._made(self.work)
        path = self.work / plain
        new_profile(path, values, pulleys)
        origin = profile_command(self.named(path), values, pulleys)
        self.task("reading files", lambda: self._opened_new(str(path), origin))

    def undo(self) -> Future[None]:
        """Take the last addition back, and diagnose again."""
        return self.task("undoing", self._undo)

    def compare(self, profile: int | str, runs: Sequence[str]) -> Future[None]:
        """Show another profile, or other runs, beside the present ones."""
        return self.task("diagnosing beside", lambda: self._compare(profile, runs))

    def swap(self) -> Future[None]:
        """Exchange the two sides."""
        return self.task("exchanging", self._swap)

    def end_comparison(self) -> Future[None]:
        """Forget the profile and runs beside the present ones."""
        return self.task("ending the comparison", lambda: self._set(beside=None))

    # What routes read.

    def view(self) -> dict[str, Any]:
        """The state as the page shows it."""
        work, refusals = self._work, self._refusals  # before the state: it has their words
        busy = None if work is None else {"what": work.what, "share": work.share}
        return self._state.to_json() | {"busy": busy, "refusals": refusals}

    def curves(self, output: str, *, beside: bool = False) -> OutputCurves:
        """Curves of an output, in units that suit both sides; raises UsageError."""
        state = self.side(beside)
        try:
            own = state.curves[output]
        except KeyError:
            known = ", ".join(state.curves) or "none; diagnose first"
            raise UsageError(f"no output '{output}'; there are {known}") from None
        other = self._state if beside else self._state.beside
        known_beside = None if other is None else other.curves.get(output)
        return own if known_beside is None else own.in_units_of(known_beside)

    def card(self, effect: str) -> dict[str, Any]:
        """Card of a candidate, with its signature; fitted at the first request."""
        if effect not in self._cards:
            self._cards[effect] = candidate_card(self._state, effect)
        return self._cards[effect]

    def pattern(self, number: int) -> dict[str, Any]:
        """An open law or unexplained pattern with its curve."""
        return pattern(self._state, number)

    def plan(self) -> dict[str, str]:
        """Write the best programme for the next run; its file, text and purpose.

        Raises UsageError without a diagnosis.
        """
        found = plan(self._state.diagnosed, self.catalogue)
        path = self._free("next.toml")
        write_programme(found.programme(path.stem), path)
        best = found.offers[0]
        texts = plan_texts(found)
        if best.shows:
            also = "also " if texts else ""
            shows = listed([effect_name(e) for e in best.shows])
            texts.append(f"It {also}shows these effects if they are there: {shows}.")
        runs, profile = self._state.selection()
        return {
            "file": self.named(path),
            "text": path.read_text(encoding="utf-8"),
            "words": " ".join([f"{capital(best.kind.name)}, {_duration(best.minutes)}.", *texts]),
            "command": f"winchkit plan {runs} -p {profile} -o {shlex.quote(self.named(path))}",
        }

    def new_effect(self) -> dict[str, str]:
        """Write an effect of the user's from the main pattern; its file and text.

        Raises UsageError where nothing unexplained was located.
        """
        state, path = self._state, self._free("my-effect.py")
        found = state.diagnosed.diagnosis
        name = path.stem
        if not found.empirical:
            raise UsageError("nothing unexplained was located that an effect could begin from")
        order = order_of_drum(found)
        if order is not None:
            write_wave_on_drum(order, name, path)
        else:
            profile, runs = read_profile(state.profile), state.winch_runs()[1]
            new_effect(path, runs, profile, self.catalogue, curve=found.empirical[0])
        return {"file": self.named(path), "text": path.read_text(encoding="utf-8")}

    def use_effect(self, file: str) -> Future[None]:
        """Read an effect of the user's, and diagnose with it."""
        return self.task("diagnosing", lambda: self._use_effect(file))

    def profile_text(self) -> tuple[str, str]:
        """File name and text of the present profile."""
        text = self._state.profile.read_text(encoding="utf-8")
        return self._state.names[-1], text

    def report(self) -> str:
        """The report of the present diagnosis as one page."""
        from winchkit.report.pages.pages import report_html

        source = self._state.source
        return report_html(self._state.diagnosed, source, profile=source)

    def truth(self) -> str:
        """Hidden effects of the simulated bench; raises UsageError for measured runs."""
        if self._state.truth is None:
            raise UsageError("these runs were not simulated here; their truth is not known")
        return self._state.truth

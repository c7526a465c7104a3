"""What the Diagnose view works on: run files, a profile with its history, and the last diagnosis.

All work runs in one thread, in the order of the requests; a cancelled request leaves the state as
it was. Files are kept in a folder of the server's own: nothing of the user's is written to.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.catalog import find
from winchkit.diagnosis.add import Grown, grow_prepared
from winchkit.diagnosis.compare import initial_residual
from winchkit.diagnosis.data.dataset import Dataset, prepare
from winchkit.diagnosis.diagnose import WinchAnswer, diagnose_prepared
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.traces import traces_of
from winchkit.diagnosis.results import Estimate
from winchkit.diagnosis.write import write_addition
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.errors import FileError, UsageError, WinchkitError
from winchkit.model.variables import ANGLES
from winchkit.report.words.numbers import quantity
from winchkit.report.words.vocabulary import OUTPUT_NAMES
from winchkit.runs.read import read_run
from winchkit.runs.run import Run
from winchkit.runs.writer import write_run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile
from winchkit.web.curves import OutputCurves, curves_of
from winchkit.web.examples import Simulated, example_runs, mystery_runs
from winchkit.web.foreign import imported
from winchkit.web.ladder import Rung, card, ladder, refitted, verdict

__all__ = ["Cancelled", "LoadedRun", "Workspace"]

_NO_NAME = re.compile(r"[^\w.-]+")


class Cancelled(Exception):
    """Work that the user ended."""


@dataclass(frozen=True)
class LoadedRun:
    """A run file of the page."""

    path: Path
    run: Run
    used: bool = True

    @property
    def name(self) -> str:
        """Name of the file."""
        return self.path.name


@dataclass(frozen=True)
class Version:
    """A profile of the page: a file, and what was added last."""

    path: Path
    added: str = ""


@dataclass(frozen=True)
class State:
    """What the page shows; replaced as a whole."""

    runs: tuple[LoadedRun, ...] = ()
    source: str = ""
    """Profile as the user named it."""
    versions: tuple[Version, ...] = ()
    """The profile and what it became by additions, the present one last."""
    winch: str = ""
    answer: WinchAnswer | None = None
    curves: Mapping[str, OutputCurves] = field(default_factory=dict)
    before: tuple[WinchAnswer, Mapping[str, OutputCurves]] | None = None
    """Answer and curves before the last addition, so that undoing it needs no fit; one only, for
    the memory that an answer holds."""
    refitted: bool = False
    """Whether an addition is fitted and shown, and its diagnosis under way."""
    rungs: tuple[Rung, ...] = ()
    """Errors of the profiles before the present one."""
    said: str = ""
    """What the last addition changed, for the live region."""
    truth: str | None = None
    """What a simulated bench hides; None for measured runs."""
    faults: tuple[str, ...] = ()
    """Why files were not loaded, or the last request was refused."""


@dataclass
class _Work:
    what: str = ""
    share: float = 0.0
    cancelled: threading.Event = field(default_factory=threading.Event)


class Workspace:
    """State of the Diagnose view and the one thread that changes it.

    Parameters
    ----------
    folder : Path
        Of the server's own, for dropped files and profiles.
    effects : sequence of str
        Files with effects of the user's own.
    changed : callable
        Called, from the working thread, whenever there is something new to show.
    """

    def __init__(
        self, folder: Path, effects: Sequence[str] = (), changed: Callable[[], None] = lambda: None
    ) -> None:
        self.folder = folder
        self.effects = tuple(effects)
        self.changed = changed
        self.catalogue: Catalogue = load_catalogue(effects)
        self._state = State()
        self._work: _Work | None = None
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="workspace")
        self._cards: dict[str, dict[str, Any]] = {}
        self._prepared: Dataset | None = None

    @property
    def state(self) -> State:
        """The present state."""
        return self._state

    def close(self) -> None:
        """End the work under way."""
        self.cancel()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def cancel(self) -> None:
        """End the work under way; the state stays as it was."""
        if self._work is not None:
            self._work.cancelled.set()

    # Requests; each returns at once and works in the thread.

    def open(self, paths: Sequence[str | Path], profile: str | None = None) -> Future[None]:
        """Load run files, and a profile by name or file."""
        return self.task("reading files", lambda: self._open(paths, profile))

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
        return self.task(f"adding {effect}", lambda: self._add(effect))

    def example(self, name: str) -> Future[None]:
        """Simulate runs of a bench of the catalogue, and open them with its profile."""
        return self.task("simulating runs", lambda: self._simulate(name, example_runs(name)))

    def mystery(self, seed: int) -> Future[None]:
        """Simulate runs of a bench whose hidden effect is shown on request only."""
        return self.task("simulating runs", lambda: self._simulate("mystery", mystery_runs(seed)))

    def take(self, file: str, answers: Mapping[str, Any]) -> Future[None]:
        """Import a dropped file of another program with the answers to its questions."""
        return self.task("importing", lambda: self._take(file, answers))

    def undo(self) -> Future[None]:
        """Take the last addition back, and diagnose again."""
        return self.task("undoing", self._undo)

    # What routes read.

    def view(self) -> dict[str, Any]:
        """The state as the page shows it."""
        state, work = self._state, self._work
        out: dict[str, Any] = {
            "runs": [_run_json(item) for item in state.runs],
            "profile": None,
            "winch": state.winch,
            "busy": None if work is None else {"what": work.what, "share": work.share},
            "faults": list(state.faults),
            "said": state.said,
            "diagnosis": None,
            "outputs": list(state.curves),
            "can_undo": len(state.versions) > 1,
        }
        if state.versions:
            added = [version.added for version in state.versions[1:]]
            out["profile"] = {"name": state.source, "added": added}
        if state.answer is not None:
            words = refitted(state.said) if state.refitted else verdict(state.answer.diagnosis)
            out["diagnosis"] = words | {
                "ladder": ladder(state.answer, state.rungs),
                "next": [
                    {"separates": list(run.separates), "programme": run.programme}
                    for run in state.answer.diagnosis.next_runs
                ],
            }
            out["commands"] = self.commands()
        return out

    def curves(self, output: str) -> OutputCurves:
        """Curves of an output; raises UsageError for an unknown one."""
        try:
            return self._state.curves[output]
        except KeyError:
            known = ", ".join(self._state.curves) or "none; diagnose first"
            raise UsageError(f"no output '{output}'; there are {known}") from None

    def order_of(self, output: str) -> tuple[str, int] | None:
        """Angle and periods per turn of the main pattern of an output's residual, if any."""
        answer = self._state.answer
        found = () if answer is None else answer.diagnosis.where
        for where in found:
            if where.output == output and where.order is not None and where.variable in ANGLES:
                return where.variable, where.order
        return None

    def card(self, effect: str) -> dict[str, Any]:
        """Card of a candidate, with its signature; fitted at the first request."""
        if effect not in self._cards:
            self._cards[effect] = self._card(effect)
        return self._cards[effect]

    def profile_text(self) -> tuple[str, str]:
        """File name and text of the present profile."""
        if not self._state.versions:
            raise UsageError("no profile is open; choose one first")
        present = self._state.versions[-1].path
        return f"{Path(self._state.source).stem}-better.toml", present.read_text(encoding="utf-8")

    def report(self) -> str:
        """The report of the present diagnosis as one page."""
        from winchkit.report.pages.pages import report_html

        if self._state.answer is None or self._state.refitted:
            raise UsageError("nothing is diagnosed yet")
        return report_html(self._state.answer, self._state.source, profile=self._state.source)

    def commands(self) -> list[str]:
        """What was clicked, as commands."""
        state = self._state
        runs = " ".join(item.name for item in state.runs if item.used)
        lines = [f"winchkit diagnose {runs} -p {state.source}"]
        profile = state.source
        for number, version in enumerate(state.versions[1:], start=1):
            better = f"better-{number}.toml"
            lines.append(f"winchkit add {version.added} --fit {runs} -p {profile} -o {better}")
            lines.append(f"winchkit diagnose {runs} -p {better}")
            profile = better
        return lines

    def truth(self) -> str:
        """What the simulated bench hides; raises UsageError for measured runs."""
        if self._state.truth is None:
            raise UsageError("these runs were not simulated here; their truth is not known")
        return self._state.truth

    def dropped(self, name: str) -> Path:
        """A file in the server's folder; raises UsageError for another name."""
        path = self.folder / Path(name).name
        if not path.is_file():
            raise UsageError(f"there is no file '{name}'; drop it again")
        return path

    def keep(self, name: str, content: bytes) -> Path:
        """Write a dropped file into the server's folder, under a harmless name."""
        plain = _NO_NAME.sub("-", Path(name).name).lstrip(".-") or "run.csv"
        target, number = self.folder / plain, 2
        while target.exists():
            target = self.folder / f"{Path(plain).stem}-{number}{Path(plain).suffix}"
            number += 1
        target.write_bytes(content)
        return target

    # The work.

    def task(self, what: str, call: Callable[[], None]) -> Future[None]:
        """Let the thread do something after what it has to do; its errors become faults."""
        return self._pool.submit(self._run, what, call)

    def _run(self, what: str, call: Callable[[], None]) -> None:
        self._work = _Work(what)
        self.changed()
        try:
            call()
        except Cancelled:
            self._set(faults=(f"{what}: cancelled",))
        except FileError as error:
            self._set(faults=tuple(str(fault) for fault in error.faults))
        except WinchkitError as error:
            self._set(faults=(str(error),))
        finally:
            self._work = None
            self.changed()

    def _progress(self, what: str, share: float) -> None:
        work = self._work
        if work is None:
            return
        if work.cancelled.is_set():
            raise Cancelled
        if what != work.what or share - work.share > 0.01:
            work.what, work.share = what, share
            self.changed()

    def _set(self, **changes: Any) -> None:
        if changes.keys() & {"answer", "runs", "versions"}:
            self._cards = {}
        if changes.keys() & {"runs", "source"}:
            changes = {"before": None, **changes}
            self._prepared = None
        self._state = replace(self._state, **{"faults": (), **changes})

    def _open(self, paths: Sequence[str | Path], profile: str | None) -> None:
        if profile is not None:
            self._open_profile(profile)
        runs, faults = [*self._state.runs], []
        for path in paths:
            try:
                run = read_run(path)
            except FileError as error:
                faults += [str(fault) for fault in error.faults]
                continue
            runs = [item for item in runs if item.name != Path(path).name]
            runs.append(LoadedRun(Path(path), run))
        self._set(runs=tuple(runs), answer=None, curves={}, faults=tuple(faults))
        if runs and self._state.versions:
            self._diagnose(faults)

    def _open_profile(self, profile: str) -> None:
        path = find("profiles", profile)
        read_profile(path)
        copy = self.keep(path.name, path.read_bytes())
        self._set(source=profile, versions=(Version(copy),), rungs=(), answer=None, curves={})

    def _simulate(self, name: str, simulated: Simulated) -> None:
        runs = []
        for run in simulated.runs:
            path = self.keep(f"{run.name}.csv", b"")
            write_run(run, path)
            runs.append(LoadedRun(path, read_run(path)))
        self._open_profile(simulated.profile)
        self._set(runs=tuple(runs), winch="", truth=simulated.truth)
        self._diagnose()

    def _take(self, file: str, answers: Mapping[str, Any]) -> None:
        run = imported(self.dropped(file), answers)
        path = self.keep(f"{Path(file).stem}-imported.csv", b"")
        write_run(run, path)
        self._open([path], None)

    def _use(self, name: str, *, used: bool) -> None:
        runs = tuple(
            replace(item, used=used) if item.name == name else item for item in self._state.runs
        )
        self._set(runs=runs)
        self._diagnose()

    def _runs(self) -> list[Run]:
        used = [item.run for item in self._state.runs if item.used]
        if not used:
            raise UsageError("no run is loaded; drop run files on the page")
        names = sorted({name for run in used for name in run.winches()})
        winch = self._state.winch or names[0]
        if winch != self._state.winch:
            self._set(winch=winch)
        return [run.of_winch(winch if winch in run.winches() else "") for run in used]

    def _profile(self) -> WinchProfile:
        if not self._state.versions:
            raise UsageError("no profile is open; choose one first")
        return read_profile(self._state.versions[-1].path)

    def _diagnose(self, faults: Sequence[str] = ()) -> None:
        profile = self._profile()
        self._progress("reading the signals", 0.0)
        regression = TimeSeriesRegression(self._dataset(profile))
        residual = initial_residual(self.catalogue, regression)
        self._set(answer=None, curves=curves_of(regression, residual, {}), faults=tuple(faults))
        answer, curves = self._diagnosed(profile)
        self._set(answer=answer, curves=curves, faults=tuple(faults))

    def _dataset(self, profile: WinchProfile) -> Dataset:
        """Data set of the runs that are used; the last one is kept while these stay the same."""
        if self._prepared is None or self._prepared.profile != profile:
            runs = self._runs()
            self._prepared = prepare(
                runs, profile, decimate=True, fast=True, catalogue=self.catalogue
            )
        return self._prepared

    def _diagnosed(self, profile: WinchProfile) -> tuple[WinchAnswer, Mapping[str, OutputCurves]]:
        dataset = self._dataset(profile)
        answer = diagnose_prepared(dataset, self.catalogue, progress=self._progress)
        initial = answer.result.initial_model
        noise = {name: out.noise_rms for name, out in answer.diagnosis.outputs.items()}
        return answer, curves_of(answer.engine.regression, initial.residual, noise)

    def _add(self, effect: str) -> None:
        state = self._state
        if state.answer is None:
            raise UsageError("nothing is diagnosed yet")
        if effect not in self.catalogue:
            raise UsageError(f"there is no effect '{effect}'")
        grown = grow_prepared(effect, self._dataset(self._profile()), self.catalogue)
        path = self.folder / f"version-{len(state.versions)}.toml"
        names = [item.name for item in state.runs if item.used]
        write_addition(state.versions[-1].path, grown.addition, names, path)
        self._show_refit(state.answer, grown, Version(path, effect))
        try:
            answer, curves = self._diagnosed(read_profile(path))
        except BaseException:
            self._cards, self._state = {}, state
            raise
        self._set(answer=answer, curves=curves, refitted=False)

    def _show_refit(self, answer: WinchAnswer, grown: Grown, version: Version) -> None:
        """Show the refitted profile, its errors and curves, before it is diagnosed."""
        state, outputs = self._state, grown.addition.outputs
        before = {name: out.heldout_rms_before for name, out in outputs.items()}
        label = "Profile as loaded" if len(state.versions) == 1 else f"+ {state.versions[-1].added}"
        largest = max(
            outputs,
            key=lambda o: outputs[o].heldout_rms_before / max(outputs[o].heldout_rms_after, 1e-300),
        )
        out = outputs[largest]
        said = (
            f"{OUTPUT_NAMES.get(largest, largest).capitalize()} error "
            f"{quantity(out.heldout_rms_after, out.unit)}, was "
            f"{quantity(out.heldout_rms_before, out.unit)}"
        )
        now = {
            name: replace(out, heldout_rms_before=out.heldout_rms_after)
            for name, out in outputs.items()
        }
        shown = replace(answer.diagnosis, outputs=now, steps=(), candidates=(), where=())
        noise = {name: out.noise_rms for name, out in outputs.items()}
        self._set(
            versions=(*state.versions, version),
            rungs=(*state.rungs, Rung(label, before)),
            said=said,
            answer=WinchAnswer(answer.engine, answer.result, shown),
            refitted=True,
            curves=curves_of(grown.regression, grown.final.residual, noise),
            before=(answer, state.curves),
        )
        self.changed()

    def _undo(self) -> None:
        state = self._state
        if len(state.versions) < 2:
            raise UsageError("there is nothing to undo")
        earlier = state.versions[-2].path
        answer, curves = state.before or self._diagnosed(read_profile(earlier))
        versions, rungs = state.versions[:-1], state.rungs[:-1]
        self._set(
            versions=versions, rungs=rungs, said="", answer=answer, curves=curves, before=None
        )

    def _card(self, effect_id: str) -> dict[str, Any]:
        state = self._state
        if state.answer is None or state.refitted:
            raise UsageError("nothing is diagnosed yet")
        answer, engine, result = state.answer, state.answer.engine, state.answer.result
        item = next((s for s in result.scores if s.candidate.effect.id == effect_id), None)
        if item is None:
            raise UsageError(f"effect '{effect_id}' is no candidate for these runs")
        initial, noise = result.initial_model, result.noise
        fitted = engine.trial(initial, item, noise).fit
        change = initial.residual - fitted.residual
        values: Mapping[str, Estimate] = {}
        spread = spread_of(engine.regression, fitted, noise, engine.regression.blocks)
        for term, own in estimates(engine.regression, fitted, spread):
            if term.effect.id == effect_id:
                values = own
        equal = next(
            (step.effects for step in answer.diagnosis.steps if effect_id in step.effects), ()
        )
        out = card(answer, item.candidate.effect, values, [e for e in equal if e != effect_id])
        drawn = self._most_changed(item.candidate.effect.outputs, change)
        if drawn is not None:
            output, own_change = drawn
            curves = state.curves[output]
            order = self.order_of(output)
            variable = order[0] if order else next(iter(curves.shares))
            periods = order[1] if order else None
            out["signature"] = curves.signature(own_change, variable, periods)
            out["signature"]["variable"] = variable
        return out

    def _most_changed(self, outputs: Sequence[str], change: Array) -> tuple[str, Array] | None:
        """Output that a candidate changes most against its noise, and the change in time."""
        answer = self._state.answer
        assert answer is not None
        traces = traces_of(answer.engine.regression, change)
        best: tuple[float, str, Array] | None = None
        for name in outputs:
            parts = [trace.residual for trace in traces if trace.output == name]
            if not parts:
                continue
            own = np.concatenate(parts)
            size = float(np.sqrt(np.nanmean(own**2))) / (self._state.curves[name].noise or 1.0)
            if best is None or size > best[0]:
                best = size, name, own
        return None if best is None else best[1:]


def _run_json(item: LoadedRun) -> dict[str, Any]:
    run = item.run
    return {
        "name": item.name,
        "used": item.used,
        "samples": len(run),
        "seconds": float(run.time[-1] - run.time[0]) if len(run) > 1 else 0.0,
        "load": run.metadata.get("load_mass", ""),
        "programme": run.metadata.get("programme", ""),
        "winches": run.winches(),
    }

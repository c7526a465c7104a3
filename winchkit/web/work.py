"""Work of the Diagnose view: one thread that reads runs, diagnoses them and changes the state.

A cancelled request leaves the state as it was. Dropped files are kept in a folder of the server's
own. Files that the page makes and its commands name are in the user's: imported runs, runs of a
hidden effect, a new profile.
"""

from __future__ import annotations

import logging
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Protocol

from winchkit.catalog import find
from winchkit.diagnosis.compare import initial_residual
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import WinchAnswer, diagnose_prepared
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.errors import FileError, UsageError, WinchkitError
from winchkit.regular_file import file_errors
from winchkit.runs.read import read_run
from winchkit.runs.run import Run
from winchkit.runs.writer import write_run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile
from winchkit.web.candidate import refit
from winchkit.web.curves import OutputCurves, curves_of, recorded_curves
from winchkit.web.examples import ExampleRuns, example_runs, mystery_runs
from winchkit.web.foreign import import_command, imported
from winchkit.web.state import Judgement, LoadedRun, PageState, Version
from winchkit.web.words import INTERNAL, free_path, page_text

Diagnosed = tuple[WinchAnswer, Mapping[str, OutputCurves]]
"""A diagnosis and the curves of its outputs."""
_READERS = 2
"""Files that are read at once: a parser of large files runs beside the interpreter."""
_LONG = 200_000
"""Samples above which runs are drawn before they are compared, which takes seconds."""
_LOGGER = logging.getLogger(__name__)
NO_NAME = re.compile(r'[\x00-\x1f<>:"/\\|?*]+')
"""Characters that a name of a file lacks on one of the systems."""


def _read(path: str | Path) -> Run | FileError:
    try:
        return read_run(path)
    except FileError as error:
        return error


class Cancelled(Exception):
    """Work that the user ended."""


@dataclass
class _ViewWork:
    what: str = ""
    share: float = 0.0
    cancelled: threading.Event = field(default_factory=threading.Event)


class StoredRun(Protocol):
    """A winch of a run in a file."""

    @property
    def path(self) -> Path:
        """The file."""

    def read(self) -> Run:
        """Read it; raises FileError."""


class DiagnoseWork:
    """State of the Diagnose view and the one thread that changes it, which calls ``changed``.

    ``folder``: of the server's own. ``work``: the user's folder, by default one within ``folder``.
    """

    def __init__(
        self,
        folder: Path,
        effects: Sequence[str] = (),
        changed: Callable[[], None] = lambda: None,
        work: Path | None = None,
    ) -> None:
        self.folder = folder
        self.work = folder / "work" if work is None else work
        self.effects = tuple(effects)
        self.changed = changed
        self.catalogue: Catalogue = load_catalogue(effects)
        self._state = PageState()
        self._work: _ViewWork | None = None
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="workspace")
        self._cards: dict[str, dict[str, Any]] = {}
        self._prepared: Dataset | None = None
        self._written: set[Path] = set()
        self._refusals = 0
        """Number of refusals so far: the same words twice are two of them."""
        self.judged: dict[Path, Judgement] = {}
        """Latest verdict on each run."""

    @property
    def state(self) -> PageState:
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

    def side(self, beside: bool = False) -> PageState:
        """The present state or that beside it; raises UsageError without one."""
        if not beside:
            return self._state
        if self._state.beside is None:
            raise UsageError("nothing is shown beside these runs")
        return self._state.beside

    def dropped(self, name: str) -> Path:
        """A file in the server's folder; raises UsageError for another name."""
        path = (self.folder / name).resolve()
        if not (path.is_file() and path.is_relative_to(self.folder.resolve())):
            raise UsageError(f"there is no file '{name}'; drop it again")
        return path

    def keep(self, name: str, content: bytes) -> Path:
        """Write a dropped file under its name into a folder of its own within the server's."""
        plain = NO_NAME.sub("-", name.replace("\\", "/").rpartition("/")[2]).strip(". ")
        target = Path(mkdtemp(prefix="", dir=self.folder)) / (plain or "run.csv")
        target.write_bytes(content)
        return target

    def named(self, path: str | Path) -> str:
        """A file as the user's commands name it: a dropped one by name, others by their place."""
        file = Path(path).resolve()
        if not file.is_file() and not file.is_dir():
            return str(path)  # a shipped profile
        if file.is_relative_to(self.folder.resolve()):
            return file.name
        here = Path.cwd().resolve()
        return str(file.relative_to(here) if file.is_relative_to(here) else file)

    def words(self, text: str) -> str:
        """A message of the command line without the paths of the server's folder, and options."""
        own = {re.escape(str(folder)) for folder in (self.folder, self.folder.resolve())}
        return page_text(re.sub(rf"(?:{'|'.join(own)})/(?:[^/\s]+/)?", "", text))

    def task(self, what: str, call: Callable[[], None]) -> Future[None]:
        """Let the thread do something after what it has to do; its errors become faults."""
        return self._pool.submit(self._run, what, call)

    def _run(self, what: str, call: Callable[[], None]) -> None:
        self._work = _ViewWork(what)
        self.changed()
        try:
            call()
        except Cancelled:
            self._refuse(f"{what}: cancelled")
        except FileError as error:
            self._refuse(*map(str, error.faults))
        except WinchkitError as error:
            self._refuse(str(error))
        except Exception:
            _LOGGER.exception("%s failed", what)
            self._refuse(f"{what}: {INTERNAL}")
        finally:
            self._work = None
            self.changed()

    def progress(self, what: str, share: float | None) -> None:
        """Report the progress; raises Cancelled where the user ended it."""
        work = self._work
        if work is None:
            return
        if work.cancelled.is_set():
            raise Cancelled
        share = work.share if share is None else share
        if what != work.what or share - work.share > 0.01:
            work.what, work.share = what, share
            self.changed()

    def _refuse(self, *faults: str) -> None:
        self._set(faults=faults)
        self._refusals += 1

    def _set(self, **changes: Any) -> None:
        if changes.keys() & {"answer", "runs", "versions"}:
            self._cards = {}
        if changes.keys() & {"runs", "source"}:
            changes = {"before": None, **changes}
            self._prepared = None
        faults = tuple(map(self.words, changes.get("faults", ())))
        self._state = replace(self._state, **{**changes, "faults": faults})

    def _open(
        self, paths: Sequence[str | Path], profile: str | None = None, origin: str = ""
    ) -> None:
        if profile is not None:
            self._open_profile(profile)
        runs, faults = [*self._state.runs], []
        with ThreadPoolExecutor(_READERS) as pool:
            read = list(pool.map(_read, paths))
        for path, run in zip(paths, read, strict=True):
            if isinstance(run, FileError):
                faults += [str(fault) for fault in run.faults]
                continue
            file = Path(path).resolve()
            runs = [item for item in runs if item.path != file]
            twin = any(item.path.name == file.name for item in runs)
            folder = file.parent.name if twin else ""
            runs.append(LoadedRun(file, run, folder=folder, file=self.named(file), origin=origin))
        self._loaded(runs, faults)

    def _show(self, chosen: Sequence[StoredRun], profile: str | None) -> None:
        if profile:
            self._open_profile(profile)
        runs: list[LoadedRun] = []
        for item in chosen:
            twin = any(run.path.name == item.path.name for run in runs)
            folder = item.path.parent.name if twin else ""
            file = self.named(item.path)
            runs.append(LoadedRun(item.path, item.read(), folder=folder, file=file))
        self._set(winch="", truth=None, beside=None)
        self._loaded(runs, [])

    def _loaded(self, runs: Sequence[LoadedRun], faults: Sequence[str]) -> None:
        self._set(runs=tuple(runs), answer=None, curves={}, faults=tuple(faults))
        self._refusals += bool(faults)
        if runs and self._state.versions:
            if sum(len(item.run.time) for item in runs) > _LONG:
                recorded = recorded_curves(self._state.winch_runs()[1])
                self._set(curves=recorded, faults=tuple(faults))
                self.changed()
            self._diagnose(faults)

    def _opened_new(self, path: str, origin: str) -> None:
        self._open_profile(path, origin)
        self._loaded(self._state.runs, ())

    def _open_profile(self, profile: str, origin: str = "") -> None:
        path = find("profiles", profile)
        read_profile(path)
        copy = self.keep(path.name, path.read_bytes())
        named = self.named(profile)
        made = (origin,) if origin else ()
        self._set(source=named, made=made, versions=(Version(copy),), earlier=())
        self._set(answer=None, curves={})

    def _simulate(self, simulated: ExampleRuns, folder: Path, place: str, origin: str) -> None:
        runs = []
        for run in simulated.runs:
            path = folder / f"{run.name}.csv"
            write_run(run, path, replace=True)
            file = f"{place}/{path.name}"
            runs.append(LoadedRun(path, read_run(path), file=file, origin=origin))
        self._open_profile(simulated.profile)
        self._set(runs=tuple(runs), winch="", truth=simulated.truth, beside=None)
        self._diagnose()

    def _example(self, name: str) -> None:
        found = example_runs(name)
        folder = Path(mkdtemp(dir=self.folder))
        self._simulate(found, folder, Path(name).stem, found.command(name))

    def _mystery(self, seed: int) -> None:
        folder = self._made(self.work / f"mystery-{seed}")
        self._simulate(mystery_runs(seed), folder, self.named(folder), "")

    def _take(self, file: str, answers: Mapping[str, Any]) -> None:
        source = self.dropped(file)
        run = imported(source, answers)
        path, number = self.work / "imported" / f"{source.stem}.csv", 2
        while path.exists() and path not in self._written:
            path, number = self.work / f"imported-{number}" / path.name, number + 1
        folder = self._made(path.parent)
        write_run(run, path, replace=True)
        self._written.add(path)
        self._open([path], origin=import_command(source.name, answers, self.named(folder)))

    def _use_effect(self, file: str) -> None:
        path = (Path.cwd() / file).resolve()
        if not (path.is_file() and path.is_relative_to(self.work.resolve())):
            raise UsageError(f"there is no file '{file}' with an effect in the folder of this page")
        self.effects = tuple(dict.fromkeys([*self.effects, str(path)]))
        self.catalogue, self._prepared = load_catalogue(self.effects), None
        *earlier, last = self._state.versions
        own = tuple(dict.fromkeys([*last.own, self.named(path)]))
        self._set(versions=(*earlier, replace(last, own=own)))
        self._diagnose()

    def _free(self, name: str) -> Path:
        """A new file in the user's folder."""
        return free_path(self._made(self.work), name)

    @staticmethod
    def _made(folder: Path) -> Path:
        with file_errors(folder, "made"):
            folder.mkdir(parents=True, exist_ok=True)
        return folder

    def _use(self, name: str, *, used: bool) -> None:
        runs = tuple(
            replace(item, used=used) if item.name == name else item for item in self._state.runs
        )
        self._set(runs=runs)
        self._diagnose()

    def _diagnose(self, faults: Sequence[str] = ()) -> None:
        profile = read_profile(self._state.profile)
        self.progress("reading the signals", 0.0)
        regression = TimeSeriesRegression(self._dataset(profile))
        residual = initial_residual(self.catalogue, regression)
        self._set(answer=None, curves=curves_of(regression, residual, {}), faults=tuple(faults))
        answer, curves = self._diagnosed(profile)
        self._set(answer=answer, curves=curves, faults=tuple(faults))
        self._judge()

    def _dataset(self, profile: WinchProfile) -> Dataset:
        """Data set of the runs that are used; the last one is kept while these stay the same."""
        if self._prepared is None or self._prepared.profile != profile:
            winch, runs = self._state.winch_runs()
            if winch != self._state.winch:
                self._set(winch=winch)
            self._prepared = self._prepare(runs, profile)
        return self._prepared

    def _prepare(self, runs: Sequence[Run], profile: WinchProfile) -> Dataset:
        return prepare(runs, profile, decimate=True, fast=True, catalogue=self.catalogue)

    def _diagnosed(self, profile: WinchProfile) -> Diagnosed:
        return self._diagnosed_on(self._dataset(profile))

    def _diagnosed_on(self, dataset: Dataset) -> Diagnosed:
        answer = diagnose_prepared(dataset, self.catalogue, progress=self.progress)
        initial = answer.result.initial_model
        noise = {name: out.noise_rms for name, out in answer.diagnosis.outputs.items()}
        return answer, curves_of(answer.engine.regression, initial.residual, noise)

    def _add(self, effect: str) -> None:
        state = self._state
        dataset = self._dataset(read_profile(state.profile))
        extended = refit(state, effect, dataset, self.catalogue, self.folder)
        self._cards, self._state = {}, extended
        self.changed()
        try:
            answer, curves = self._diagnosed(read_profile(extended.profile))
        except BaseException:
            self._cards, self._state = {}, state
            raise
        self._set(answer=answer, curves=curves, refitted=False)
        self._judge()

    def _judge(self) -> None:
        verdict = self._state.judgement
        self.judged |= {item.path: verdict for item in self._state.used}

    def _undo(self) -> None:
        state = self._state
        if len(state.versions) < 2:
            raise UsageError("there is nothing to undo")
        earlier = state.versions[-2].path
        answer, curves = state.before or self._diagnosed(read_profile(earlier))
        versions, before = state.versions[:-1], state.earlier[:-1]
        self._set(
            versions=versions, earlier=before, said="", answer=answer, curves=curves, before=None
        )

    def _compare(self, profile: int | str, names: Sequence[str]) -> None:
        state = self._state
        runs = tuple(replace(item, used=item.name in names) for item in state.runs)
        side = PageState(runs, state.source, state.versions, winch=state.winch)
        if isinstance(profile, str):
            path = find("profiles", profile)
            read_profile(path)
            version = Version(self.keep(path.name, path.read_bytes()))
            side = replace(side, source=profile, versions=(version,))
        elif 0 <= profile < len(state.versions):
            side = replace(
                side, versions=state.versions[: profile + 1], earlier=state.earlier[:profile]
            )
        else:
            raise UsageError(f"there is no version {profile} of the profile")
        known = self._known(state, side)
        if known is None:
            self.progress("diagnosing beside", 0.0)
            winch, used = side.winch_runs()
            side = replace(side, winch=winch)
            known = self._diagnosed_on(self._prepare(used, read_profile(side.profile)))
        self._set(beside=replace(side, answer=known[0], curves=known[1]))

    @staticmethod
    def _known(state: PageState, side: PageState) -> Diagnosed | None:
        """Diagnosis of a side that is the present state, or that before the last addition."""
        if [i.path for i in side.used] != [i.path for i in state.used]:
            return None
        if state.answer is None or state.refitted:
            return None
        if side.versions == state.versions:
            return state.answer, state.curves
        return state.before if side.versions == state.versions[:-1] else None

    def _swap(self) -> None:
        state, beside = self._state, self.side(beside=True)
        first = replace(beside, beside=replace(state, beside=None), truth=state.truth)
        self._cards, self._prepared, self._state = {}, None, first

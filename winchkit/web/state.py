"""State of the Diagnose view: runs, a profile with its history, and its diagnosis."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.steps import place_text
from winchkit.errors import UsageError
from winchkit.model.variables import ANGLES
from winchkit.profile_edit.naming import extended_name
from winchkit.report.words.vocabulary import VERDICT_NAMES, effect_name, listed
from winchkit.runs.run import Run
from winchkit.web.curves import OutputCurves
from winchkit.web.model_errors import ModelErrors, model_errors, refitted, verdict

_MOST_EFFECTS = 3
"""Effects of a set that a cause names; of a larger one its place."""


@dataclass(frozen=True)
class Judgement:
    """Verdict of a diagnosis with its cause, as the Library view lists it."""

    verdict: str
    causes: Sequence[str]
    """Every step in words."""
    outputs: Mapping[str, Mapping[str, Any]]
    """Errors of every output as ``winchkit diagnose --json`` gives them."""
    profile: str

    def to_json(self) -> dict[str, Any]:
        """Chip, cause, and error over noise floor of every output."""
        named = " + ".join(self.causes)
        at_floor = "at the noise floor" if self.verdict == "adequate" else ""
        return {
            "verdict": self.verdict,
            "chip": VERDICT_NAMES[self.verdict],
            "cause": named or at_floor,
            "profile": self.profile,
            "ratios": {
                name: out["heldout_rms_before"] / out["noise_rms"]
                for name, out in self.outputs.items()
                if out["noise_rms"] and out["heldout_rms_before"] is not None
            },
        }


@dataclass(frozen=True)
class LoadedRun:
    """A run file of the page."""

    path: Path
    run: Run
    used: bool = True
    folder: str = ""
    """Name of its folder, where another file has the same name."""
    file: str = ""
    """As the user's commands name it."""
    origin: str = ""
    """Command that writes the file; empty for one of the user's."""

    @property
    def name(self) -> str:
        """Name of the file, with its folder where it is not the only one."""
        return f"{self.folder}/{self.path.name}" if self.folder else self.path.name

    def to_json(self) -> dict[str, Any]:
        """The run as the page lists it."""
        run = self.run
        return {
            "name": self.name,
            "used": self.used,
            "samples": len(run),
            "seconds": float(run.time[-1] - run.time[0]) if len(run) > 1 else 0.0,
            "load": run.metadata.get("load_mass", ""),
            "programme": run.metadata.get("programme", ""),
            "winches": run.winches(),
            "channels": list(run.channels),
        }


@dataclass(frozen=True)
class Version:
    """A profile of the page: a file, and what was added last."""

    path: Path
    added: str = ""
    own: tuple[str, ...] = ()
    """Files of effects of the user's own that were made for it."""


@dataclass(frozen=True)
class PageState:
    """State of the page; replaced as a whole."""

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
    earlier: tuple[ModelErrors, ...] = ()
    """Errors of the profiles before the present one."""
    said: str = ""
    """What the last addition changed, for the live region."""
    truth: str | None = None
    """What a simulated bench hides; None for measured runs."""
    faults: tuple[str, ...] = ()
    """Why files were not loaded, or the last request was refused."""
    made: tuple[str, ...] = ()
    """Command that writes the profile; none for one of the user's."""
    beside: PageState | None = None
    """Another profile or other runs, shown beside these."""

    @property
    def used(self) -> tuple[LoadedRun, ...]:
        """Runs that are compared with the profile."""
        return tuple(item for item in self.runs if item.used)

    @property
    def diagnosed(self) -> WinchAnswer:
        """Diagnosis of the present profile; raises UsageError where there is none yet."""
        if self.answer is None or self.refitted:
            raise UsageError("nothing is diagnosed yet")
        return self.answer

    @property
    def profile(self) -> Path:
        """File of the present profile; raises UsageError where none is open."""
        if not self.versions:
            raise UsageError("no profile is open; choose one first")
        return self.versions[-1].path

    @property
    def names(self) -> list[str]:
        """Proposed file name of every version, the present one last."""
        added = [version.added for version in self.versions[1:]]
        return [extended_name(self.source, *added[:count]) for count in range(len(added) + 1)]

    @property
    def judgement(self) -> Judgement:
        """Verdict on the used runs; raises UsageError without a diagnosis."""
        found = self.diagnosed.diagnosis
        causes = [
            listed([effect_name(effect) for effect in step.effects], "or")
            if len(step.effects) <= _MOST_EFFECTS
            else place_text(step).replace("_", " ")
            for step in found.steps
        ]
        outputs = {name: vars(out) for name, out in found.outputs.items()}
        added = [version.added for version in self.versions[1:]]
        return Judgement(found.verdict, causes, outputs, " + ".join([self.source, *added]))

    def order_of(self, output: str) -> Attribution | None:
        """Main pattern of an output's residual that is an order of an angle, if any."""
        found = () if self.answer is None else self.answer.diagnosis.where
        for where in found:
            if where.output == output and where.order is not None and where.variable in ANGLES:
                return where
        return None

    def selection(self) -> tuple[str, str]:
        """The used runs and the present profile, as commands name them."""
        runs = shlex.join(item.file or item.name for item in self.used)
        return runs, shlex.quote([self.source, *self.names[1:]][-1])

    def commands(self) -> list[str]:
        """The user's actions as commands."""
        runs = self.selection()[0]
        origins = dict.fromkeys([*(item.origin for item in self.used), *self.made])
        lines, effects, before = [line for line in origins if line], "", ""
        for version, named in zip(self.versions, [self.source, *self.names[1:]], strict=True):
            profile = shlex.quote(named)
            if version.added:
                fitted = f"--fit {runs} -p {before}{effects} -o {profile}"
                lines.append(f"winchkit add {version.added} {fitted}")
            lines.append(f"winchkit diagnose {runs} -p {profile}{effects}")
            for file in version.own:
                effects += f" --effects {shlex.quote(file)}"
                lines.append(f"winchkit diagnose {runs} -p {profile}{effects}")
            before = profile
        return lines

    def winch_runs(self) -> tuple[str, list[Run]]:
        """Winch of the used runs, and their channels of it; raises UsageError without runs."""
        used = [item.run for item in self.used]
        if not used:
            raise UsageError("no run is loaded; drop run files on the page")
        winch = self.winch or sorted({name for run in used for name in run.winches()})[0]
        return winch, [run.of_winch(winch if winch in run.winches() else "") for run in used]

    def to_json(self) -> dict[str, Any]:
        """Runs, profile and diagnosis as the page shows them, and those beside."""
        other = self.beside
        return self._side(other) | {"beside": None if other is None else other._side(self)}

    def _side(self, other: PageState | None) -> dict[str, Any]:
        out: dict[str, Any] = {
            "runs": [item.to_json() for item in self.runs],
            "profile": None,
            "winch": self.winch,
            "faults": list(self.faults),
            "said": self.said,
            "diagnosis": None,
            "outputs": list(self.curves),
            "compared": all(own.is_compared for own in self.curves.values()),
            "can_undo": len(self.versions) > 1,
            "simulated": self.truth is not None,
        }
        if self.versions:
            added = [version.added for version in self.versions[1:]]
            names = [effect_name(effect) for effect in added]
            out["profile"] = {"name": self.source, "added": added, "names": names}
        if self.answer is not None:
            known = None if other is None else other.answer
            beside = None if known is None else known.diagnosis
            words = refitted(self.said) if self.refitted else verdict(self.answer.diagnosis)
            words = in_units_of(self.answer.engine.regression.dataset.profile, words)
            out["diagnosis"] = words | {"models": model_errors(self.answer, self.earlier, beside)}
            out["commands"] = self.commands()
        return out

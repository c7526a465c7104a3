"""Reproduction of a result: runs, versions, and commands, also those that continue from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from platform import python_version
from shlex import quote
from typing import Any

from winchkit import wings
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.report.html.markup import Markup, compact, details, element, folded, table
from winchkit.report.words.vocabulary import runs_listed

_FEW = 3
"""Runs that a command names; more are written with a wildcard."""


@dataclass(frozen=True)
class CommandLine:
    """Arguments of a command, from which it and further commands are written."""

    dataset: Dataset
    named: str = ""
    """The profile as the user named it; empty where only the name within the file is known."""
    options: Sequence[str] = ()

    @property
    def profile(self) -> str:
        """The profile as commands name it."""
        return self.named or self.dataset.profile_name

    @property
    def source(self) -> str:
        """Profile, runs and version, as figures print them."""
        runs = runs_listed(self.dataset.run_names, _FEW)
        return f"profile {self.profile}; {runs}; winchkit {version('winchkit')}"

    def compare(self, profile: str) -> str:
        """Command that compares the runs with a profile."""
        return f"winchkit compare {self._runs} --profile {quote(profile)}{self._options}"

    def diagnose(self, profile: str) -> str:
        """Command that diagnoses a profile."""
        diagnose = f"winchkit diagnose {self._runs} --profile {quote(profile)}{self._options}"
        return f"{diagnose} --html report.html"

    def add(self, effect: str, profile: str, better: str) -> str:
        """Command that writes the extended profile."""
        named = f"{quote(effect)} --profile {quote(profile)}"
        return f"winchkit add {named} --fit {self._runs} -o {quote(better)}{self._options}"

    def calibrate(self, profile: str, better: str) -> str:
        """Command that fits a robot's geometry."""
        return f"winchkit calibrate {quote(profile)} {self._runs} -o {quote(better)}"

    def begin_effect(self, profile: str, file: str) -> str:
        """Command that creates a user effect from the residual."""
        named = f"{quote(file)} --profile {quote(profile)}"
        return f"winchkit effects new {named} --fit {self._runs}{self._options}"

    @property
    def _runs(self) -> str:
        return " ".join(map(quote, self.dataset.run_files))

    @property
    def _options(self) -> str:
        return "".join(f" {quote(option)}" for option in self.options)


def repeat(
    command: CommandLine, commands: Sequence[str], what: str, raw: Mapping[str, Any]
) -> Markup:
    """The section on reproduction; ``what`` is the name of the result ``raw``."""
    versions = ", ".join(f"{name} {version(name)}" for name in ("winchkit", "numpy", "scipy"))
    profile = element("code", command.profile)
    return folded(
        "repeat",
        "Commands to reproduce this result and to continue",
        _runs(command.dataset),
        element("p", "Profile: ", profile, f". {versions}, Python {python_version()}."),
        element("pre", element("code", "\n".join(commands)), tabindex="0"),
        details(f"The {what} as JSON", element("pre", compact(raw, indent=1))),
    )


def _runs(dataset: Dataset) -> Markup:
    if (by_wing := wings.call("runs_table", dataset)) is not None:
        return Markup(by_wing(dataset))
    sets = {run: n for n, group in enumerate(dataset.repeated, 1) for run in group.runs}
    rows = []
    for index, recording in enumerate(dataset.recordings):
        time = recording.signals.time
        left_out = sum(int((~valid).sum()) for valid in recording.valid.values())
        rows.append(
            [
                recording.name,
                recording.programme or "–",
                f"set {sets[index]}" if index in sets else "none",
                f"{len(time)}",
                f"{time[-1] - time[0]:.1f} s",
                f"{left_out}",
            ]
        )
    head = ["run", "programme", "repeats", "samples", "length", "excluded"]
    return table("Runs; those of one set are repeats of each other.", head, rows, words=3)

"""A case as winchkit reads it: profile, runs, and predictions of the run that is held out."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.spectrum import to_time
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.runs.read import read_run
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile

NOMINAL = "nominal_"


class Case:
    """What an entrant gets of one case."""

    def __init__(self, folder: Path) -> None:
        known = json.loads((folder / "machine.json").read_text(encoding="utf-8"))
        self.machine = {name.split(" [")[0]: value for name, value in known["machine"].items()}
        self.runs = [read_run(folder / name) for name in known["runs"]]
        self.held_out = read_run(folder / known["held_out"])
        self._folder = folder

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs of the machine."""
        return tuple(name.split(" [")[0] for name in self.machine["noise"])

    @cached_property
    def profile(self) -> WinchProfile:
        """The declared machine, written beside its runs and read."""
        path = self._folder / "profile.toml"
        path.write_text("\n".join(_profile_lines(self.machine)) + "\n", encoding="utf-8")
        return read_profile(path)

    @cached_property
    def _held(self) -> TimeSeriesRegression:
        """The held-out run; in the place of its outputs those of the declared machine."""
        channels = dict(self.held_out.channels)
        for name in self.outputs:
            channels[name] = channels[NOMINAL + name]
        return TimeSeriesRegression(
            prepare([replace(self.held_out, channels=channels)], self.profile)
        )

    def change(self, model: Hypothesis) -> Array:
        """Change of the held-out run's outputs by a model, one after another, filtered as there."""
        return self._held.change(model)

    def predicted(self, change: Array) -> dict[str, list[float]]:
        """Outputs of the held-out run, SI: the bare profile's with a change."""
        recording = self._held.dataset.recordings[0]
        return {
            s.output: (recording.nominal[s.output] + to_time(change[s.rows], s.band)).tolist()
            for s in self._held.segments
        }


def table(run: Run, outputs: tuple[str, ...]) -> tuple[Array, Array]:
    """Features of a run's samples (n, f), and what the declared machine would show (n, outputs)."""
    angle, time = run["motor_angle"], run.time
    speed = np.gradient(angle, time)
    nominal = np.column_stack([run[NOMINAL + name] for name in outputs])
    load = np.full_like(time, run.load_mass or 0.0)
    motion = [np.sin(angle), np.cos(angle), angle, speed, np.sign(speed), np.gradient(speed, time)]
    warm = [run["temperature"]] if "temperature" in run.channels else []
    return np.column_stack([*motion, load, *warm, nominal]), nominal


def _profile_lines(m: dict[str, object]) -> list[str]:
    """The machine as a profile."""
    winch = m["kind"] == "winch"
    lines = ["schema = 1", f'kind = "{m["kind"]}"', 'name = "case"']
    lines += ["[motor]", f'inertia = "{m["inertia"]} kg m^2"', "[gearbox]", f"ratio = {m['ratio']}"]
    if winch:
        growth = {"grooved": "groove_pitch", "archimedean": "layer_growth"}[str(m["drum"])]
        lines += ["[drum]", f'kind = "{m["drum"]}"', f'winding_radius = "{m["radius"]} m"']
        lines += [f'{growth} = "{m["growth"]} m"', "[cable]", 'diameter = "2 mm"']
        lines += [f'dead_length = "{m["dead_length"]} m"']
        lines += ["[path]", f'inclination = "{m["inclination"]} deg"']
        for wrap in m["wraps"]:  # type: ignore[attr-defined]
            lines += ["[[pulley]]", f'radius = "{m["pulley_radius"]} m"', f'wrap = "{wrap} rad"']
    lines += ["[reference]", 'motor_angle = "0 rad"']
    if winch:
        lines += [f'cable_length = "{m["length"]} m"', f"wound_turns = {m['turns']}"]
    return lines

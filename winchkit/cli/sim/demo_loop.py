"""Steps of the demonstration: record on a simulated bench, diagnose, add, compare."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.catalog import find

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench
    from winchkit.diagnosis.add import Addition
    from winchkit.diagnosis.diagnose import WinchAnswer
    from winchkit.runs.run import Run
    from winchkit.schema.programme import Programme, ProgrammeStep
    from winchkit.schema.simbench import SimBench

ProgressCallback = Callable[[str, float], None]
"""Called with the present step and the recorded time, s."""

PROGRAMMES = ("programme-demo-fast", "programme-demo-slow")
_AT_NOISE = 1.3
"""Held-out error in units of the noise at which a hidden effect counts as found. Rule of thumb."""
_APPROACH = 0.5
"""m/s, within the limits of every simulated bench."""


@dataclass(frozen=True)
class LoopResult:
    """Result of the loop, without knowledge of the hidden effect."""

    answer: WinchAnswer
    addition: Addition | None
    """Addition of the first named effect to the profile."""

    @property
    def named(self) -> tuple[str, ...]:
        """Effects of the first step; empty where none is missing."""
        steps = self.answer.diagnosis.steps
        return steps[0].effects if steps else ()

    @property
    def worst_held_out(self) -> float:
        """Largest held-out error of any output, in units of its noise."""
        outputs = self.addition.outputs if self.addition else self.answer.diagnosis.outputs
        return max(
            fitted.heldout_rms_after / fitted.noise_rms if fitted.noise_rms else float("inf")
            for fitted in outputs.values()
        )

    def right(self, truth: tuple[str, ...]) -> bool:
        """Whether only the hidden effect was found and the error is at the noise floor."""
        steps = self.answer.diagnosis.steps
        if not truth:
            return not steps and self.answer.diagnosis.verdict == "adequate"
        return len(steps) == 1 and truth[0] in self.named and self.worst_held_out <= _AT_NOISE


def programmes() -> list[Programme]:
    """The motion programmes of the demonstration."""
    from winchkit.schema.read import read_programme

    return [read_programme(find("sim", name)) for name in PROGRAMMES]


def record(bench: SimBench, seed: int, folder: Path, report: ProgressCallback) -> list[Path]:
    """Run the programmes on a simulated bench, in simulated time; MotionError where it was late."""
    from winchkit.bench.open import open_bench
    from winchkit.bench.programme import run_programme
    from winchkit.errors import MotionError
    from winchkit.sim.clock.simulated_clock import SimulatedClock
    from winchkit.sim.live.bench import LiveBench

    written: list[Path] = []
    clock = SimulatedClock()
    start = clock.now()

    def progress(repeat: int, _number: int, step: ProgrammeStep) -> None:
        report(f"repeat {repeat}: {_words(step)}", clock.now() - start)

    with LiveBench(bench, seed=seed, simulated_time=clock) as live:
        report("commissioning the drive", 0.0)
        with open_bench(live.bench_spec, clock) as opened:
            for programme in programmes():
                _go_to_start(opened, programme)
                written += run_programme(
                    opened, programme, folder, live.answer, progress=progress, replace=True
                )
            late = opened.loop.overruns
    if late:
        raise MotionError(
            f"this computer could not keep the cycle: {late} late cycles, result not valid; "
            "run the demo again with fewer other programs"
        )
    return written


def learn(runs: list[Run], profile_name: str, out: Path) -> LoopResult:
    """Diagnose recorded runs, add the named effect to a copy of the profile, and fit it."""
    from winchkit.diagnosis.add import add
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.diagnosis.write import write_addition
    from winchkit.schema.read import read_profile

    source = find("profiles", profile_name)
    nominal = out / "nominal.toml"
    shutil.copyfile(source, nominal)
    profile = read_profile(nominal)
    answer = diagnose(runs, profile)
    if not answer.diagnosis.steps:
        return LoopResult(answer, None)
    addition = add(answer.diagnosis.steps[0].effects[0], runs, profile)
    names = [run.name for run in runs]
    write_addition(nominal, addition, names, out / "improved.toml", replace=True)
    return LoopResult(answer, addition)


def _go_to_start(opened: Bench, programme: Programme) -> None:
    """Move to the final length of the programme, so that all its repeats have the same motion."""
    last = next(step for step in reversed(programme.step) if step.to is not None)
    for winch in opened.winch.values():
        if last.to is not None:
            winch.move_to(last.to, speed=_APPROACH)


def _words(step: ProgrammeStep) -> str:
    if step.ask is not None:
        return step.ask
    if step.hold is not None:
        return f"hold {step.hold:g} s"
    return f"to {step.to:g} m" if step.to is not None else f"by {step.by:g} m"

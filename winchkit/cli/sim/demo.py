"""``winchkit demo``: the whole loop on a simulated bench, with the hidden effect shown last."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.catalog import find
from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import output_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.terminal import progress_bar

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


_RECORDING_SECONDS = 62.0
"""s of simulated time of the programme; the progress bar needs its length only."""
_BEFORE_THE_END = 0.98
"""Largest share that the bar shows, since the diagnosis follows the recording."""
_LONG = "takes half a minute; .ci/run executes it"
_OPENING = (
    "A simulated bench with seed {seed}: a winch, a CiA 402 drive on CAN, a load cell, a length "
    "and a temperature instrument on Modbus. It has at most one effect that its profile lacks."
)


@click.command(
    cls=ToolCommand,
    examples=(
        Example("winchkit demo", _LONG),
        Example("winchkit demo --seed 3 -o demo-3 --json", _LONG),
    ),
)
@click.option("--seed", default=1, show_default=True, help="Seed of hidden effect and noise.")
@output_option(
    "Folder for runs, profiles and report.",
    "DIR",
    "--out",
    default="winchkit-demo",
    show_default=True,
    type=click.Path(file_okay=False, path_type=Path),
)
@json_flag("Print the result as JSON.")
@click.pass_context
def command(ctx: click.Context, seed: int, output: Path) -> None:
    """Find a hidden effect on a simulated bench, from the first CAN frame to the extended profile.

    A drive on a CAN bus and instruments on Modbus are simulated, with real protocols; a minute of
    simulated time passes as fast as this computer allows. Exits with 0 when the hidden effect was
    found and the held-out error is at the noise floor, else with 1.
    """
    from winchkit.report.words.sentence import sentence
    from winchkit.runs import read_run
    from winchkit.sim import choose_bench

    started, out = time.monotonic(), output
    story = _Sentences(quiet=is_json())
    bench = choose_bench(seed)
    profile_name = next(iter(bench.bench.winch.values())).profile
    with _progress(_RECORDING_SECONDS) as progress:
        paths = record(bench, seed, out / "runs", progress)
        progress("diagnosing", _RECORDING_SECONDS)
        runs = [read_run(path) for path in paths]
        findings = learn(runs, profile_name, out)
    truth = bench.answers
    right = findings.right(truth)
    hidden = ", ".join(truth) or "nothing"
    story.add(sentence(findings.answer.diagnosis))
    story.add(f"Hidden effect: {hidden}. {'Found.' if right else 'Not found.'}")
    story.print("")
    story.add(_OPENING.format(seed=seed))
    story.add(
        f"It recorded {len(runs)} runs, each motion twice under two loads: "
        f"{sum(len(run) for run in runs)} rows in {out / 'runs'}."
    )
    _add_errors(story, findings)
    report = _write_report(out, story, findings, profile_name, hidden)
    seconds = time.monotonic() - started
    story.print(f"Report: {report}   ({seconds:.0f} s)")
    if is_json():
        echo_json(_outcome(seed, findings, truth, seconds, out))
    if right and findings.addition is not None:
        improved = str(out / "improved.toml")
        suggest_next("compare", sorted(str(path) for path in paths), "-p", improved)
    ctx.exit(0 if right else 1)


class _Sentences:
    """Sentences that are printed and kept for the report."""

    def __init__(self, quiet: bool) -> None:
        self.sentences: list[str] = []
        self._quiet = quiet

    def add(self, sentence: str) -> None:
        """Print a sentence and keep it."""
        self.sentences.append(sentence)
        self.print(sentence)

    def print(self, text: str) -> None:
        """Print a text to stdout, or to stderr where JSON goes to stdout."""
        from winchkit.report.words.columns import paragraph

        click.echo("\n".join(paragraph(text, then="  ")), err=self._quiet)


def _add_errors(story: _Sentences, findings: LoopResult) -> None:
    from winchkit.report.words.headline import size_texts
    from winchkit.report.words.sentence import capital
    from winchkit.report.words.vocabulary import OUTPUT_NAMES

    for name, text in size_texts(findings.answer.diagnosis.outputs).items():
        story.add(f"{capital(OUTPUT_NAMES[name])} error of the profile: {text}.")
    if findings.addition is not None:
        added = findings.addition.added[0].effect.id
        story.add(f"improved.toml is the profile with {added}, beside nominal.toml.")


def _write_report(
    out: Path, story: _Sentences, findings: LoopResult, profile_name: str, hidden: str
) -> Path:
    from winchkit.cli.model.options import save_page
    from winchkit.report.pages.pages import report_html

    path = out / "report.html"
    page = report_html(
        findings.answer,
        "winchkit demo: the missing effect",
        story=story.sentences,
        truth={"hidden": hidden},
        profile=profile_name,
    )
    save_page(str(path), page)
    return path


def _outcome(
    seed: int, findings: LoopResult, truth: tuple[str, ...], seconds: float, out: Path
) -> dict[str, Any]:
    addition = findings.addition
    return {
        "schema": 1,
        "seed": seed,
        "truth": truth,
        "found": findings.named,
        "right": findings.right(truth),
        "held_out_over_noise": findings.worst_held_out,
        "diagnosis": findings.answer.diagnosis.to_json(),
        "addition": addition.to_json() if addition else None,
        "seconds": seconds,
        "out": out,
    }


@contextmanager
def _progress(total: float) -> Iterator[Callable[[str, float], None]]:
    """A progress bar on stderr, by the recorded time."""
    with progress_bar() as bar:
        yield lambda what, recorded: bar(what, min(recorded / total, _BEFORE_THE_END))

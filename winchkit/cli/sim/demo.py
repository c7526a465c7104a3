"""``winchkit demo``: the whole loop on a simulated bench, with the hidden effect shown last."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import output_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.terminal import progress_bar

if TYPE_CHECKING:
    from winchkit.cli.sim.demo_loop import LoopResult
    from winchkit.diagnosis.results import Comparison

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
    from winchkit.catalog import find
    from winchkit.cli.sim import demo_loop
    from winchkit.diagnosis.compare import compare
    from winchkit.report.words.sentence import sentence
    from winchkit.runs import read_run
    from winchkit.schema.read import read_profile
    from winchkit.sim import choose_bench

    started, out = time.monotonic(), output
    story = _Story(quiet=is_json())
    bench = choose_bench(seed)
    profile_name = next(iter(bench.bench.winch.values())).profile
    with _progress(_RECORDING_SECONDS) as progress:
        paths = demo_loop.record(bench, seed, out / "runs", progress)
        progress("diagnosing", _RECORDING_SECONDS)
        runs = [read_run(path) for path in paths]
        comparison = compare(runs, read_profile(find("profiles", profile_name)))
        findings = demo_loop.learn(runs, profile_name, out)
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
    _add_errors(story, comparison, findings)
    report = _write_report(out, story, findings, profile_name, hidden)
    seconds = time.monotonic() - started
    story.print(f"Report: {report}   ({seconds:.0f} s)")
    if is_json():
        echo_json(_outcome(seed, findings, truth, seconds, out))
    if right and findings.addition is not None:
        improved = str(out / "improved.toml")
        suggest_next("compare", sorted(str(path) for path in paths), "-p", improved)
    ctx.exit(0 if right else 1)


class _Story:
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


def _add_errors(story: _Story, comparison: Comparison, findings: LoopResult) -> None:
    from winchkit.report.words.headline import size_texts
    from winchkit.report.words.sentence import capital
    from winchkit.report.words.vocabulary import OUTPUT_NAMES

    for name, text in size_texts(comparison.outputs).items():
        story.add(f"{capital(OUTPUT_NAMES[name])} error of the profile: {text}.")
    if findings.addition is not None:
        added = findings.addition.added[0].effect.id
        story.add(f"improved.toml is the profile with {added}, beside nominal.toml.")


def _write_report(
    out: Path, story: _Story, findings: LoopResult, profile_name: str, hidden: str
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

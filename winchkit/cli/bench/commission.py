"""``winchkit commission``: the guided commissioning of a bench, with a signed-off record."""

from __future__ import annotations

import dataclasses
import sys

import click

from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import bench_argument
from winchkit.cli.core.output import json_flag, tell


@click.command(
    cls=ToolCommand,
    examples=(
        Example("winchkit commission bench.toml", "asks somebody beside the winch"),
        Example("winchkit commission --answers answers.toml", "asks somebody beside the winch"),
    ),
)
@bench_argument
@click.option(
    "--answers",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False),
    help="Answers by key (TOML), for tests; the record says that they were not typed.",
)
@json_flag("Print the record as JSON.")
def command(*, bench: str, answers: str | None) -> None:
    """Commission BENCH: directions, units, brake, cell sign, limits, and the loss of the host.

    Asks on stderr and reads answers from stdin; enables one drive at a time and moves slowly. The
    record is written beside the bench file. On real hardware nothing else moves without it, and a
    changed drive, device file or bench file makes it stale. There is no --yes: what is confirmed
    here somebody has seen.
    """
    from winchkit.bench.commissioning.dialogue import AnswerFile, Dialogue, TypedAnswers
    from winchkit.bench.commissioning.procedure import commission_bench
    from winchkit.drivers.clock import MonotonicClock
    from winchkit.schema.read import read_bench

    def say(text: str) -> None:
        click.echo(text, err=True)

    spec = read_bench(bench)
    dialogue: Dialogue = (
        TypedAnswers(say, sys.stdin.readline) if answers is None else AnswerFile(answers, say)
    )
    record = commission_bench(spec, dialogue, MonotonicClock())
    tell(
        {"path": spec.record_file, **dataclasses.asdict(record)},
        [f"{spec.record_file}: commissioned by {record.by}, {record.date}"],
    )
    suggest_next("monitor", "-b", bench)

"""``winchkit sim serve``: a simulated bench in real time, for other terminals to connect to."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.completion import complete_sim_bench
from winchkit.cli.core.output import json_flag, tell

if TYPE_CHECKING:
    from winchkit.sim.live.bench import LiveBench
    from winchkit.sim.live.buses import Interface

_CHECK_EVERY = 0.1
"""s between two looks at the simulation; it delays the end of the command only."""
_TURN = 1e-4
"""s: longest turn of a thread of the interpreter, a fortieth of a cycle of 4 ms."""
_DETERMINED = 6
"""Cables from which they determine the pose of a platform, so that it can be moved as one."""


@click.command(
    "serve",
    cls=ToolCommand,
    examples=(
        "winchkit sim serve demo-elastic-rope",
        "winchkit sim serve spiral-bench -o bench.toml --seed 3",
    ),
)
@click.argument("bench", shell_complete=complete_sim_bench)
@click.option("--seed", default=0, show_default=True, help="Seed of the noise.")
@click.option(
    "-o",
    "--bench-file",
    "--output",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Bench file to write.  [default: BENCH-bench.toml]",
)
@click.option(
    "--interface",
    default="udp_multicast",
    show_default=True,
    type=click.Choice(["udp_multicast", "virtual"]),
    help="CAN of the drives: between processes, or within this one only.",
)
@click.option(
    "--hidden",
    multiple=True,
    metavar="PHYSICS",
    help="Hide this instead of what the bench hides, as in 'sim record'.",
)
@click.option(
    "--end-with-input",
    is_flag=True,
    help="End where standard input ends, as with the program that started it.",
)
@json_flag("Print a line of JSON when it is ready, and per reply.")
def command(
    *,
    bench: str,
    seed: int,
    bench_file: Path | None,
    interface: Interface,
    hidden: tuple[str, ...],
    end_with_input: bool,
) -> None:
    """Run a simulated BENCH live until Ctrl-C: drives on CAN, instruments on Modbus or serial.

    Prints the bench file to connect to. Takes lines on its input: load A 32 kg, fault A.cell
    silence, recover A.cell, status, quit. While it runs, 'winchkit run --yes' with that bench
    file lets it hang the loads that a programme asks for; it finds the simulation by the file
    BENCH-bench.toml.sim beside it. With --json the first line on stdout says that others can
    connect now: {"schema": 1, "bench": FILE, "ready": true}. Writes over an earlier bench file of
    its own only, and not while its simulation runs.
    """
    from winchkit.bench.control.realtime import acquire
    from winchkit.catalog import find
    from winchkit.schema.read import read_simbench
    from winchkit.sim.live.bench import LiveBench
    from winchkit.sim.live.control import ControlServer

    # Bus and instruments share this interpreter, whose default turn of 5 ms is a whole cycle. The
    # bus waits for a turn at each of several thousand system calls a second.
    sys.setswitchinterval(_TURN)
    declared = read_simbench(find("sim", bench))
    path = bench_file or Path(f"{Path(bench).stem}-bench.toml")
    _refuse_to_replace(path)
    ended = threading.Event()
    with LiveBench(declared, seed=seed, hidden=hidden, interface=interface) as live:
        live.write_bench_file(path, replace=True)
        with (
            ControlServer(live, path, ended.set),
            _ended_by_signals(ended),
            # As the bench process: ordinary threads would wait for those of a bench in real time.
            closing(acquire("try", live.bus_threads)),
        ):
            _introduce(live, path)
            _listen(live, ended, end_with_input=end_with_input)
            while not ended.wait(_CHECK_EVERY):
                live.check()
    click.echo(f"ended: no bench answers at {path} any more", err=True)


def _refuse_to_replace(path: Path) -> None:
    """Raise UsageError where the bench file is somebody's own, or leads to a running simulation."""
    from winchkit.errors import ConnectionLost, UsageError
    from winchkit.sim.live.bench_file import is_written_here
    from winchkit.sim.live.client import is_simulated, send

    if is_simulated(path):
        try:
            send(path, "status")
        except ConnectionLost:
            pass  # killed before it could remove the file
        else:
            raise UsageError(f"{path}: a running simulation uses this file; name another (-o)")
    if path.exists() and (
        not path.is_file() or (path.stat().st_size and not is_written_here(path))
    ):
        raise UsageError(
            f"{path} exists, and no simulation wrote it; name another file (-o), or remove it"
        )


@contextmanager
def _ended_by_signals(ended: threading.Event) -> Iterator[None]:
    """Take Ctrl-C and SIGTERM as the way to end, even where a shell had them ignored."""
    signals = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: ended.set()) for number in signals]
    try:
        yield
    finally:
        for number, handler in zip(signals, before, strict=True):
            signal.signal(number, handler)


def _introduce(live: LiveBench, path: Path) -> None:
    move = f"jog {next(iter(live.winches))}"
    if live.robot is not None and live.robot.platform.count >= _DETERMINED:
        move = "move --pose-by z=10mm"  # one cable alone would become slack or be overloaded
    tell({"bench": path, "ready": True}, [str(path)])
    name = path.name.removesuffix("-bench.toml").removesuffix(".toml")
    click.echo(f"{name} runs. From another terminal:", err=True)
    click.echo(f"  winchkit monitor --bench {path}", err=True)
    click.echo(f"  winchkit {move} --bench {path}", err=True)
    click.echo("Lines here: load, fault, recover, status, quit, help. Ctrl-C ends it.", err=True)


def _listen(live: LiveBench, ended: threading.Event, *, end_with_input: bool) -> None:
    """Obey what is typed, on a thread; the end of the input ends nothing unless it is to."""
    context = click.get_current_context()

    def listen() -> None:
        with context.scope(cleanup=False):
            _obey_input(live, ended)
        if end_with_input:
            ended.set()

    threading.Thread(target=listen, name="sim-input", daemon=True).start()


def _obey_input(live: LiveBench, ended: threading.Event) -> None:
    from winchkit.errors import WinchkitError
    from winchkit.sim.live.control import HELP, obey

    for raw in sys.stdin:
        line = raw.strip()
        if line == "quit":
            ended.set()
            return
        if not line:
            continue
        try:
            reply = HELP if line == "help" else obey(live, line)
            tell({"line": line, "reply": reply}, [reply])
        except WinchkitError as error:
            click.echo(f"{error}", err=True)

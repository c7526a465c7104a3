"""The command line: one file per command, in folders by subject.

``bench``, ``cell``, ``drive``, ``files``, ``log``, ``model``, ``sim`` and ``web`` have the
commands, ``core`` their common parts; the wings have their own. The tables are all that ``--help``
needs: a command imports other packages when it runs. :func:`~winchkit.cli.main` is the entry.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import Any, NoReturn

import click

from winchkit import wings
from winchkit.cli.core.command import Example
from winchkit.cli.core.lazy import CommandPlace, LazyGroup
from winchkit.cli.core.outcome import finish
from winchkit.version import __version__

# The matrices here are small: threads of a linear algebra library spin longer than they work, and
# take the processor from a bench in real time. They read this once, when numpy is imported.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")


def _at(module: str, words: str, name: str = "command") -> CommandPlace:
    return CommandPlace(f"winchkit.cli.{module}", words, name)


SECTIONS: dict[str, dict[str, CommandPlace]] = {
    "Model and runs": {
        "demo": _at("sim.demo", "Find a hidden effect on a simulated bench, start to end."),
        "compare": _at("model.compare", "Compare runs with a model: its errors, by variable."),
        "diagnose": _at("model.diagnose", "Name the physical effect that the model lacks."),
        "add": _at("model.add", "Fit an effect and write it into a profile."),
        "forward": _at("model.forward", "Simulate a profile's motion under a torque or loops."),
        "remove": _at("model.add", "Remove an effect from a profile.", "remove"),
        "undo": _at("model.add", "Undo the last add or remove of a profile.", "undo"),
        "ledger": _at("model.add", "List the changes of a profile, with their errors.", "ledger"),
        "serve": _at("web.serve", "Serve the page in the browser: all of this, with figures."),
        "profile": _at("model.profile", "Write the profile of a winch of your own."),
        "plan": _at("model.plan", "Propose the next motion programme."),
        "effects": _at("model.effects", "List the physical effects, or describe one."),
        "size": _at("model.size", "Size a winch: compare each requirement with its limit."),
    },
    "Bench": {
        "commission": _at("bench.commission", "Commission a bench: test, confirm, record."),
        "jog": _at("bench.jog", "Move a winch by hand."),
        "move": _at("bench.move", "Move one winch, or all, to a cable length."),
        "hold-tension": _at(
            "bench.hold_tension", "Keep the tension of a cable by the winch's speed."
        ),
        "home": _at("bench.home", "Find the drive's zero, or define the present length."),
        "run": _at("bench.run", "Execute a motion programme and log it."),
        "stop": _at("bench.stop", "Stop every winch of a bench, now."),
        "reset": _at("bench.stop", "Clear trips and drive faults; nothing is enabled.", "reset"),
        "monitor": _at("bench.monitor", "Show a bench live."),
        "log": _at("log.log", "Log a bench; inspect, recover, replay logs."),
        "tare": _at("bench.tare", "Tare a load cell."),
    },
    "Devices": {
        "cell": _at("cell.group", "Load cells: info, rate, diagnose, tare, calibrate."),
        "scan": _at("drive.info", "List the nodes of a CAN bus.", "scan"),
        "info": _at("drive.info", "Show identity, state and limits of a drive."),
        "config": _at("drive.config", "Drive settings: save, load, diff, store, restore."),
        "lss": _at("drive.lss", "Set node number and bit rate of a drive (CiA 305)."),
        "busload": _at("drive.busload", "CAN load of a bench, and the fastest SYNC that fits."),
    },
    "Files and simulation": {
        "check": _at("files.check", "Check files of any kind and list every fault."),
        "import": _at(
            "files.import_logs", "Import recordings of other programs: channels and units."
        ),
        "export": _at("files.export", "Convert a run to CSV, MCAP, Parquet or MF4."),
        "export-model": _at("files.export_model", "Write a profile as C, Python, MuJoCo or JSON."),
        "sim": _at("sim.group", "Simulated benches: record, serve, list."),
        "completion": _at("files.completion", "Print the completion script of a shell."),
    },
}
"""The core's commands by subject, as ``--help`` lists them; those of the wings follow."""


def _of(declared: Iterable[wings.Wing]) -> Iterator[tuple[str, str, CommandPlace]]:
    """Section, name and place of the commands of wings."""
    for wing in declared:
        for section, commands in wing.commands.items():
            for name, (module, words) in commands.items():
                yield section, name, CommandPlace(module, words)


class _Main(LazyGroup):
    """The root group, which turns errors into exit codes."""

    def main(self, *args: Any, **options: Any) -> NoReturn:
        """Run the command line and leave the process."""
        options["standalone_mode"] = False
        finish(lambda: super(_Main, self).main(*args, **options))


@click.group(
    cls=_Main,
    sections=SECTIONS,
    further=lambda: _of(wings.own()),
    foreign=lambda: _of(wings.others()),
    examples=(
        Example("winchkit demo", "takes half a minute; .ci/run executes it"),
        "winchkit sim record demo-elastic-rope programme-demo",
        "winchkit diagnose demo-*.csv -p bench-spiral",
    ),
    context_settings={"auto_envvar_prefix": "WINCHKIT", "help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="winchkit")
def main() -> None:
    """Move winches, measure tension, and identify the physical effect that a model lacks.

    Every option is also an environment variable: --json of check is WINCHKIT_CHECK_JSON. Results
    go to stdout, everything else to stderr. Exit codes: 0 done, 1 the check failed, 2 usage,
    3 bad file, 4 bus or device unreachable, 5 drive fault or limit, 130 interrupted.
    """

"""``winchkit config``: the settings of a drive, in files and in its memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import Group
from winchkit.cli.core.completion import complete_winch
from winchkit.cli.core.early_checks import check_exists, check_output
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import (
    TABLE,
    BusChoice,
    bus_options,
    dry_run_option,
    output_option,
    replace_option,
    yes_option,
)
from winchkit.cli.core.output import is_json, json_flag, tell

if TYPE_CHECKING:
    from winchkit.cli.core.dry_run import PlannedFrame
    from winchkit.drivers.can.canopen.node import Objects
    from winchkit.drivers.can.tools.config import Difference

_FORMATS = (".dcf", ".json")
_FILE = click.Path(dir_okay=False, path_type=Path)
_who = click.argument("who", required=True, metavar="WINCH|NODE", shell_complete=complete_winch)
_file = click.argument("file", type=TABLE, metavar="FILE")
_json = json_flag("Print the result as JSON.")


@click.group(
    cls=Group,
    examples=(
        "winchkit config save A -o a.dcf",
        "winchkit config diff A a.dcf",
    ),
)
def command() -> None:
    """Settings of a drive: save and load a file (.dcf or .json), store and restore its memory.

    Settings are what the drive keeps for you: gains, limits, ramps, option codes. What a bench
    sets at each opening (PDOs, heartbeats) is none, nor are commands and targets.
    """


@command.command(
    examples=("winchkit config save A -o a.dcf", "winchkit config save A -b bench.toml -o a.json")
)
@_who
@bus_options
@output_option("A .dcf or .json file.", required=True, type=_FILE, callback=None)
@replace_option
@_json
def save(who: str, *, output: Path, replace: bool, **bus: Any) -> None:
    """Read every setting of a drive into a file."""
    from winchkit.bench.drives.node_access import drive_at
    from winchkit.drivers.can.tools.config import read_config, write_config_file
    from winchkit.regular_file import refuse_existing

    check_output(output, _FORMATS)
    refuse_existing(output, replace)
    choice = BusChoice(**bus)
    with drive_at(choice.spec(), who) as node:
        config = read_config(node.objects)
        write_config_file(output, config, node.eds, node.node, node.bitrate)
    for reason in config.refused:
        click.echo(f"left out: {reason}", err=True)
    count = len(config.values)
    tell(
        {"output": output, "settings": count, "refused": config.refused},
        [f"{output}: {count} settings of {node.name}"],
    )
    suggest_next("config", "diff", who, str(output), *choice.words)


@command.command(
    examples=("winchkit config diff A a.dcf", "winchkit config diff A a.dcf -b bench.toml --json")
)
@_who
@_file
@bus_options
@_json
def diff(who: str, file: str, **bus: Any) -> None:
    """Compare a file with a drive; ends with 1 where they differ."""
    from winchkit.bench.drives.node_access import drive_at
    from winchkit.drivers.can.tools.config import difference, fitting_config

    check_exists(file)
    with drive_at(BusChoice(**bus).spec(), who) as node:
        config = fitting_config(Path(file), node.objects)
        found = difference(config, node.objects)
    tell({"differences": found}, map(_line, found))
    if not is_json():
        click.echo(f"{len(found)} of {len(config.values)} settings differ", err=True)
    click.get_current_context().exit(1 if found else 0)


@command.command(
    examples=(
        "winchkit config load A a.dcf",
        "winchkit config load A a.dcf -b bench.toml --dry-run",
    )
)
@_who
@_file
@bus_options
@dry_run_option
@_json
def load(who: str, file: str, *, dry_run: bool, **bus: Any) -> None:
    """Write what differs from a file to a drive, and read it back.

    The drive must be disabled. It forgets what was loaded when it is switched off, unless
    `config store` follows. A dry run shows every setting of the file, differing or not.
    """
    from winchkit.bench.drives.node_access import drive_at
    from winchkit.drivers.can.tools.config import fitting_config, write_config

    check_exists(file)
    choice = BusChoice(**bus)
    if dry_run:
        _show_load(choice, who, file)
        return
    with drive_at(choice.spec(), who, writes=True) as node:
        config = fitting_config(Path(file), node.objects)
        changed = write_config(config, node.objects)
    same = len(config.values) - len(changed)
    tell({"changed": changed, "same": same}, map(_line, changed))
    if is_json():
        return
    note(f"{len(changed)} settings written and read back, {same} were so already")
    if changed:
        suggest_next("config", "store", who, *choice.words)


@command.command(
    examples=("winchkit config store A -y", "winchkit config store A -b bench.toml --dry-run")
)
@_who
@bus_options
@yes_option
@dry_run_option
@_json
def store(who: str, *, yes: bool, dry_run: bool, **bus: Any) -> None:
    """Store the present settings of a drive in its memory (1010h)."""
    from winchkit.drivers.can.tools.config import STORE
    from winchkit.drivers.can.tools.config import store as write

    _sign(BusChoice(**bus), who, STORE, write, "overwrite its memory", yes=yes, dry_run=dry_run)


@command.command(
    examples=("winchkit config restore A -y", "winchkit config restore A -b bench.toml --dry-run")
)
@_who
@bus_options
@yes_option
@dry_run_option
@_json
def restore(who: str, *, yes: bool, dry_run: bool, **bus: Any) -> None:
    """Restore the maker's settings at the drive's next start (1011h)."""
    from winchkit.drivers.can.tools.config import RESTORE
    from winchkit.drivers.can.tools.config import restore as write

    what = "forget its settings at its next start"
    _sign(BusChoice(**bus), who, RESTORE, write, what, yes=yes, dry_run=dry_run)


def _sign(
    choice: BusChoice,
    who: str,
    signed: tuple[int, bytes],
    write: Callable[[Objects], None],
    what: str,
    *,
    yes: bool,
    dry_run: bool,
) -> None:
    """Ask, then let the drive act on its memory, which cannot be undone."""
    from winchkit.bench.drives.node_access import drive_at

    index, signature = signed
    if dry_run:
        _show(choice, who, [(index, 1, signature)])
        return
    with drive_at(choice.spec(), who, writes=True) as node:
        if not yes:
            click.confirm(f"{node.name}: {what}?", abort=True, err=True)
        write(node.objects)
    tell({"name": node.name, "done": what}, [f"{node.name}: done"])


def _show_load(choice: BusChoice, who: str, file: str) -> None:
    from winchkit.bench.drives.node_access import declared_drive
    from winchkit.drivers.can.tools.config import read_config_file, settings

    dictionary = declared_drive(choice.spec(), who).dictionary
    config = read_config_file(Path(file), dictionary)
    known = settings(dictionary)
    values = [(*key, known[key].encode_raw(value)) for key, value in config.values.items()]
    _show(choice, who, values)


def _show(choice: BusChoice, who: str, values: list[tuple[int, int, bytes]]) -> None:
    """Print the frames that would write these objects."""
    from winchkit.bench.drives.node_access import declared_drive
    from winchkit.cli.core.dry_run import nodes_of, show_frames, writes

    spec = choice.spec()
    drive = declared_drive(spec, who)
    frames: list[PlannedFrame] = writes(drive.bus, drive.node, values)
    show_frames(frames, nodes_of(spec))


def _line(item: Difference) -> str:
    drive = "not there" if item.drive is None else item.drive
    return f"{item.object} {item.name}: file {item.file}, drive {drive}"

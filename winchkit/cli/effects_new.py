"""``winchkit effects new``: a Python file for an effect of one's own, begun from runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.runs_option import Asked, ManyValues, model_options

if TYPE_CHECKING:
    from winchkit.diagnosis.result import Diagnosis
    from winchkit.effects.catalogue import Catalogue
    from winchkit.runs.run import Run
    from winchkit.schema.winch import WinchProfile

    _Data = tuple[Sequence[Run], WinchProfile, Catalogue, float | None]
    """Runs, profile, effects and band, as a diagnosis takes them."""

__all__ = ["command"]


@click.command(cls=ManyValues)
@click.argument("file", metavar="FILE.py")
@click.option("--fit", "runs", multiple=True, required=True, metavar="RUN...", help="Runs.")
@click.option("--curve", metavar="ID", help="Empirical effect to begin from; else the strongest.")
@click.option("--id", "effect_id", metavar="ID", help="Of the new effect; else the file's name.")
@model_options
def command(
    file: str, runs: Sequence[str], curve: str | None, effect_id: str | None, asked: Asked
) -> None:
    """Write FILE.py with the variable and the curve that the runs show and no effect explains.

    It is ready for --effects: diagnose with it, then put in the physics that you recognise.
    """
    from winchkit.cli.robot_model import read_profile, refuse_curves
    from winchkit.effects.own_file import check_own, write_wave_on_drum

    refuse_curves(read_profile(asked.source))
    name = effect_id or Path(file).stem.replace("_", "-")
    check_own(name, Path(file), asked.catalogue)
    data = (asked.runs(runs), asked.declared, asked.catalogue, asked.band)
    if curve is None:
        found = _unexplained(data)
        order = _order_of_drum(found)
        if order is not None:
            write_wave_on_drum(order, name, Path(file))
            _tell(file, name, f"a wave of {order} periods per drum turn")
            return
        curve = found.empirical[0]
    _write_curve(curve, name, Path(file), data)
    _tell(file, name, curve)


def _tell(file: str, name: str, start: str) -> None:
    click.echo(f"written: {file}; it holds the effect '{name}', begun from {start}", err=True)


def _write_curve(curve: str, name: str, file: Path, data: _Data) -> None:
    from winchkit.diagnosis.add import add
    from winchkit.effects.empirical import EMPIRICAL
    from winchkit.effects.own_file import write_own
    from winchkit.errors import UsageError
    from winchkit.units import suggest

    if curve not in EMPIRICAL:
        raise UsageError(f"'{curve}' is no empirical effect{suggest(curve, list(EMPIRICAL))}")
    term, _ = add(curve, *data).added
    write_own(term, name, file)


def _unexplained(data: _Data) -> Diagnosis:
    """A diagnosis that leaves something, and says where."""
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.errors import UsageError

    found = diagnose(*data).diagnosis
    if not found.empirical:
        raise UsageError(
            f"the verdict is '{found.verdict}' and nothing unexplained was located; name the "
            "curve to begin from with --curve, e.g. empirical-motor-torque-speed"
        )
    return found


def _order_of_drum(found: Diagnosis) -> int | None:
    """Order per drum turn that several outputs share: then the drum's own path has it."""
    orders = [w.order for w in found.where if w.variable == "drum_angle" and w.order is not None]
    return next((order for order in orders if orders.count(order) > 1), None)

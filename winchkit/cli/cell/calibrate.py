"""``winchkit cell calibrate``: known weights up and down, a fit, a report, accept or abort."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.completion import complete_winch
from winchkit.cli.core.early_checks import check_output
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import (
    TABLE,
    bench_by_default,
    bench_file_option,
    duration_option,
    quantity_option,
)
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.standard_input import is_standard_input
from winchkit.cli.model.options import figures_option, write_figures, write_page
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.bench.cells.tasks import BenchCells
    from winchkit.calibration.cell.fit import CellFit, FigureOfMerit
    from winchkit.schema.calibration import CalibrationPoint, CellCalibration, LoadDirection

_AT_REST = 4.0
"""The spread of a mean over what white noise would make of it; more is a load that moves."""


def _bench(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The bench file; none is needed for points without the name of a cell."""
    if value is None and ctx.params.get("points") and not ctx.params.get("cell"):
        return None
    return bench_by_default(ctx, param, value)


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit cell calibrate --points points.csv -o cell-4711.toml -y",
        Example(
            "winchkit cell calibrate A --weights '0 5 10 20 kg' --html report.html",
            "asks somebody to hang weights",
        ),
    ),
)
@click.argument("cell", required=False, shell_complete=complete_winch, is_eager=True)
@bench_file_option(
    "Bench file; not needed with --points.  [default: the only one of this folder]", callback=_bench
)
@click.option("--weights", help='Weights in rising order, e.g. "0 2 5 10 15 20 kg"; or N.')
@click.option("--series", default=3, show_default=True, help="Number of series, up and down.")
@click.option(
    "--points",
    metavar="CSV",
    is_eager=True,
    type=TABLE,
    help="Fit these points instead of measuring.",
)
@click.option(
    "--weight-class",
    "weight_class",
    type=click.Choice(["E2", "F1", "F2", "M1", "M2", "M3"]),
    help="Accuracy class of the weights (OIML R 111), whose tolerance is added to the uncertainty.",
)
@click.option("--order", type=click.Choice(["linear", "quadratic"]), default="linear")
@duration_option("Averaging time per weight.", default="3 s")
@quantity_option("--settle", of="time", default="2 s", help="Waiting time after a weight is hung.")
@click.option("--serial", help="Serial number of the cell; else what the device says.")
@quantity_option(
    "--temperature",
    of="temperature",
    example="21 degC",
    help='Temperature at the cell, e.g. "21 degC".',
)
@click.option(
    "--direction",
    type=click.Choice(["tension", "compression"]),
    default="tension",
    show_default=True,
)
@click.option(
    "-o", "--output", metavar="FILE", help="The calibration's file; CELL.toml by default."
)
@click.option("--html", metavar="FILE", help="Also write the report as one page.")
@figures_option
@click.option("-y", "--yes", is_flag=True, help="Accept the fit without asking.")
@json_flag("Print the fit as JSON.")
def command(
    cell: str | None,
    bench: str | None,
    points: str | None,
    weight_class: str | None,
    order: Literal["linear", "quadratic"],
    serial: str | None,
    temperature: str | None,
    direction: LoadDirection,
    output: str | None,
    html: str | None,
    *,
    figures: str | None,
    yes: bool,
    **guided: Any,
) -> None:
    """Calibrate the load cell CELL with known weights, and write the calibration beside the bench.

    The device is not changed. Name the file in the wiring: cell = { …, calibration = "FILE" }.
    Points from a file need neither CELL nor a bench.
    """
    from winchkit.calibration.cell.files import calibration_toml, write_text
    from winchkit.calibration.cell.fit import WEIGHT_CLASSES, fit_cell
    from winchkit.calibration.cell.static_effects import static_effects
    from winchkit.cli.core.quantities import optional
    from winchkit.report.pages.cell_calibration import effect_lines, report_lines

    if is_standard_input(points) and not yes:
        raise UsageError(
            "--points -: the question whether the fit is accepted has no input left; give -y"
        )
    degrees = optional(temperature, "temperature")
    if output is not None:
        check_output(output, (".toml",))
    found = _found(cell, bench, points, serial, guided)
    tolerance = WEIGHT_CLASSES[weight_class] if weight_class else 0.0
    fit = fit_cell(found.points, order, tolerance)
    needed = static_effects(found.points, found.unit, found.creep_shape)
    beside = Path(bench or points or "").parent
    target = Path(output or beside / f"{found.name.replace('.', '-')}.toml")
    calibration = _calibration(target.stem, fit, found, degrees, direction)
    for line in [*report_lines(fit, found.points, found.unit, found.creep), *effect_lines(needed)]:
        click.echo(line, err=is_json())
    if html is not None:
        from winchkit.report.pages.cell_calibration import report_page

        write_page(html, report_page(calibration, fit, needed, found.creep))
    if figures is not None:
        from winchkit.report.pages.cell_calibration import cell_figures

        write_figures(figures, cell_figures(fit, calibration))
    if not yes:
        click.confirm(f"Accept, and write {target}?", abort=True, err=True)
    write_text(target, calibration_toml(calibration))
    note(f"written: {target}")
    if is_json():
        echo_json(
            {"schema": 1, "file": str(target), "fit": fit, "points": found.points}
            | {"diagnosis": needed, "creep": found.creep}
        )
    suggest_next("check", str(target))


@dataclass(frozen=True)
class _Measured:
    """Points, and the cell that they are of."""

    name: str
    device: str
    serial: str
    points: tuple[CalibrationPoint, ...]
    unit: str = "N"
    """Of the readings."""
    creep_shape: tuple[float, ...] = ()
    creep: FigureOfMerit | None = None
    """Of a file of points with times."""


def _found(
    cell: str | None,
    bench: str | None,
    points: str | None,
    serial: str | None,
    guided: dict[str, Any],
) -> _Measured:
    """Points from a file or from the bench."""
    if points and guided["weights"]:
        raise click.UsageError("'--points' measures nothing, so '--weights' has no place there.")
    if bench is None:
        found = _from_file_alone(str(points))
    else:
        name = _force_cell(cell, bench)
        found = _from_file(name, bench, points) if points else _measure(name, bench, **guided)
    return found if serial is None else replace(found, serial=serial)


def _calibration(
    name: str,
    fit: CellFit,
    found: _Measured,
    temperature: float | None,
    direction: LoadDirection,
) -> CellCalibration:
    from winchkit.schema.calibration import CellCalibration

    loads = [point.load for point in found.points]
    return CellCalibration(
        name=name,
        date=date.today(),
        coefficients=fit.coefficients,
        device=found.device,
        serial_number=found.serial,
        temperature=temperature,
        direction=direction,
        low=min(loads),
        high=max(loads),
        residual_std=fit.residual_std,
        nonlinearity=fit.nonlinearity.value,
        unit=found.unit,
        zero_return=fit.zero_return.value,
        hysteresis=fit.hysteresis.value,
        repeatability=fit.repeatability.value,
        point=found.points,
    )


def _force_cell(cell: str | None, bench: str) -> str:
    """Full name of what is to be calibrated; raises UsageError for what measures no force."""
    from winchkit.bench.cells.desk import full_name
    from winchkit.cli.cell.options import unit_of
    from winchkit.schema.read import read_bench

    name = full_name(read_bench(bench), cell)
    if unit_of(name) != "N":
        raise click.UsageError(f"{name} measures no force; weights calibrate a load cell.")
    return name


def _from_file(name: str, bench: str, points: str) -> _Measured:
    """Points of a CSV file for a cell of the bench file; nothing is opened."""
    from winchkit.bench.cells.instruments import device_of, refs_of
    from winchkit.calibration.cell.files import read_points
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    winch, _, role = name.rpartition(".")
    device = device_of(spec, refs_of(spec)[winch, role]).name
    found = read_points(points)
    return _Measured(name, device, "", found.points, found.unit, found.creep_shape, found.creep)


def _from_file_alone(points: str) -> _Measured:
    """Points of a CSV file for a cell of no bench, named as the file."""
    from winchkit.calibration.cell.files import read_points

    found = read_points(points)
    name = f"{Path(points).stem}-calibration"
    return _Measured(name, "", "", found.points, found.unit, found.creep_shape, found.creep)


def _measure(
    cell: str, bench: str, *, weights: str | None, series: int, duration: str, settle: str
) -> _Measured:
    """Lead through the weights."""
    from winchkit.bench.cells.instruments import device_of, is_raw, refs_of
    from winchkit.calibration.cell.weighing_order import plan
    from winchkit.cli.cell.options import cells
    from winchkit.cli.core.quantities import quantity
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    try:
        steps = plan(weights or click.prompt("Weights, rising (0 2 5 10 kg)", err=True), series)
    except UsageError as error:
        raise UsageError(f"--weights: {error}") from None
    average, wait = quantity(duration, "time"), quantity(settle, "time")
    with cells(bench, cell) as (found, name):
        winch, _, role = name.rpartition(".")
        known = found.do("identify", name)
        identity = known["identity"]
        serial = f"{identity['serial number']:.0f}" if "serial number" in identity else ""
        points = tuple(
            _hang(found, name, f"{number}/{len(steps)}", step, average, wait)
            for number, step in enumerate(steps, start=1)
        )
        device = device_of(spec, refs_of(spec)[winch, role])
        return _Measured(name, known["device"], serial, points, "counts" if is_raw(device) else "N")


def _hang(
    found: BenchCells, name: str, number: str, step: CalibrationPoint, average: float, wait: float
) -> CalibrationPoint:
    """Ask for one weight and measure it, again where the operator wants."""
    from winchkit.calibration.cell.weighing_order import spoken

    while True:
        click.prompt(
            f"[{number}] hang {spoken(step)}, let it come to rest, press Enter",
            default="",
            show_default=False,
            err=True,
        )
        seen = found.do("indicated", name, wait, average)
        click.echo(
            f"    indicated {seen['mean']:.4f} ± {seen['std']:.4f} N (noise {seen['noise']:.3g} N, "
            f"{seen['readings']} readings)",
            err=True,
        )
        at_rest = seen["std"] <= _AT_REST * seen["noise"] / seen["readings"] ** 0.5
        if at_rest or click.confirm(
            "    it is not at rest; take it all the same?", default=False, err=True
        ):
            return replace(step, indicated=seen["mean"], std=seen["std"])

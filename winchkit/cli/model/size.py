"""``winchkit size``: a winch's design chain, each requirement with value, limit and verdict."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.options import TABLE
from winchkit.cli.core.output import json_flag, tell

if TYPE_CHECKING:
    from winchkit.model.sizing.row import Row

_SHOWN = {"m": ("mm", 1e-3), "rad/s": ("rpm", 0.10471975511965977)}
"""SI units that a table for people writes in others."""


@click.command(
    cls=ToolCommand,
    examples=(
        Example("winchkit size winding-device.toml", exit_code=1),
        Example("winchkit size winding-device.toml --json", exit_code=1),
    ),
)
@click.argument("spec", metavar="SPEC", type=TABLE)
@json_flag("Print the table as JSON, in SI units.")
@click.pass_context
def command(ctx: click.Context, spec: str) -> None:
    """Size a winch: motor, gearbox, drum, screw and belt of a SPEC file (kind = "size").

    After the winding-device paper, Eq. 10 to 18, corrected; see docs/papers.md. Where a
    requirement fails it says what would do. Exits with 1 when one fails.
    """
    from winchkit.model.sizing.sizing import sized
    from winchkit.schema.read import read_size

    declared = read_size(spec)
    rows = sized(declared)
    failed = [row for row in rows if row.ok is False]
    tell(
        {"name": declared.name, "ok": not failed, "requirements": rows},
        [_table(rows), _summary(declared.name, len(failed))],
    )
    ctx.exit(1 if failed else 0)


def _table(rows: Sequence[Row]) -> str:
    """Aligned columns; below a requirement that fails, a value that meets it."""
    cells = [("requirement", "source", "value", "", "limit", "verdict")]
    cells += [_cells(row) for row in rows]
    widths = [max(len(line[k]) for line in cells) for k in range(6)]
    lines = []
    for row, line in zip([None, *rows], cells, strict=True):
        padded = (
            f"{text:>{width}}" if k in {2, 4} else f"{text:<{width}}"
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        )
        lines.append("  ".join(padded).rstrip())
        lines += [f"    would do: {option}" for option in (row.alternatives if row else ())]
    return "\n".join(lines)


def _cells(row: Row) -> tuple[str, str, str, str, str, str]:
    verdict = row.note if row.ok is None else "ok" if row.ok else "FAILS"
    limit = "" if row.limit is None else _shown(row.limit, row.unit)
    return row.name, row.equation, _shown(row.value, row.unit), row.relation, limit, verdict


def _shown(value: float, unit: str) -> str:
    name, size = _SHOWN.get(unit, (unit, 1.0))
    return f"{value / size:.4g}" + ("" if name == "1" else f" {name}")


def _summary(name: str, failed: int) -> str:
    if not failed:
        return f"{name}: every requirement is met"
    return f"{name}: {failed} requirement{'s' if failed > 1 else ''} not met"

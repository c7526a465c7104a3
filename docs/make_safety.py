"""Writes the tables of docs/safety.md from the code: ``python docs/make_safety.py``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from winchkit.bench.control.conditions import BENCH_CONDITIONS, CONDITIONS, Condition
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.control.stop_escalation import STOP_TABLE

PAGE = Path(__file__).with_name("safety.md")
_FORBIDS = {
    Direction.BOTH: "all motion of all winches",
    Direction.WIND_IN: "winding in this winch, all motion of the others",
    Direction.PAY_OUT: "paying out this winch, all motion of the others",
    Direction.NONE: "nothing: a warning",
}


def tables(page: str) -> str:
    """The page with its tables as the code has them."""
    for name, lines in (("conditions", _conditions()), ("stops", _stops())):
        begin, end = f"<!-- table {name} -->\n", f"<!-- end of table {name} -->"
        before, _, rest = page.partition(begin)
        _, _, after = rest.partition(end)
        page = before + begin + "\n".join(lines) + "\n" + end + after
    return page


def _conditions() -> Iterator[str]:
    yield "| condition | variable | limit | holds for | forbids | latched | reaction |"
    yield "|---|---|---|---|---|---|---|"
    for row in CONDITIONS:
        yield _row(
            row.kind,
            row.variable,
            row.limit,
            f"{row.debounce:g} s" if row.debounce else "1 cycle",
            _FORBIDS[row.blocks],
            _latched(row),
            "quick stop of all" if row.blocks else "a warning",
        )
    for item in BENCH_CONDITIONS:
        forbids = "all motion of all winches" if item.latches else "nothing: a warning"
        latched = "at once" if item.latches else "until the reset"
        yield _row(item.kind, item.variable, item.limit, "1 cycle", forbids, latched, item.reaction)


def _latched(row: Condition) -> str:
    if not row.blocks:
        return "no"
    return "at once" if row.latches else "if it forbids a motion under way"


def _stops() -> Iterator[str]:
    yield "| way | sends | the next one is used at |"
    yield "|---|---|---|"
    for row in STOP_TABLE:
        wait = f"; not before {row.timeout * 1e3:g} ms" if row.timeout else ""
        yield _row(row.method.name, row.sends, row.not_heard + wait)


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    PAGE.write_text(tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

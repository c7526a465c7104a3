"""Writes the tables of docs/safety.md from the code: ``python docs/make_safety.py``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from winchkit.bench.control.conditions import CONDITIONS, Condition
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.control.stop_escalation import STOP_TABLE

PAGE = Path(__file__).with_name("safety.md")
_FORBIDS = {
    Direction.BOTH: "all motion of all winches",
    Direction.WIND_IN: "winding in this winch, all motion of the others",
    Direction.PAY_OUT: "paying out this winch, all motion of the others",
    Direction.NONE: "nothing: a warning",
}


@dataclass(frozen=True, slots=True)
class BenchCondition:
    """A row on the bench as a whole, or on states of the control loop."""

    kind: str
    variable: str
    limit: str
    reaction: str = "quick stop of all"
    latches: bool = True


BENCH_CONDITIONS: tuple[BenchCondition, ...] = (
    BenchCondition("bus", "sending and receiving on each CAN bus", "no error that lasts"),
    BenchCondition(
        "computer",
        "time between two cycles by the bench's clock",
        "2 heartbeat periods, at least 6 cycles (while nothing moves also 2.5 since the heartbeat)",
    ),
    BenchCondition(
        "loop",
        "exceptions in the control loop",
        "none",
        "RPDO with 02h, SYNC, SDO 6040h = 02h, from prepared frames; only stops from then on",
    ),
    BenchCondition("target", "targets against the range of the drive's objects", "within it"),
    BenchCondition(
        "unresponsive",
        "stops that the drive does not obey",
        "none",
        "silence (see Ways to stop a drive)",
    ),
    BenchCondition(
        "tension control",
        "cable that a held tension has moved, while it asks for more",
        "the declared travel, by default 100 mm, for 0.5 s",
    ),
    BenchCondition(
        "correction",
        "cable that a correction of a platform's forces or pose has moved, while it asks for more",
        "the declared travel, by default 10 mm, for 0.5 s",
    ),
    BenchCondition(
        "cable forces",
        "measured cable forces of a platform against its weight, and of a cable that was taut, "
        "while they are held, or along a motion with `tension_trim`",
        "5.7 standard deviations (see Cable forces against the weight), low-passed over 0.1 s; "
        "half of the lower limit of `tension` of [robot] for 0.1 s",
    ),
    BenchCondition(
        "tracker age",
        "age of the newest pose that differs from the one before, while a pose is held",
        "`max_age` of the tracker, by default 0.1 s",
    ),
    BenchCondition(
        "tracker jump",
        "change between two poses of the tracker, while a pose is held",
        "1 mm, 0.2 deg, and what `speed` and `rotation_speed` of [robot] make in the time between",
    ),
    BenchCondition(
        "tracker disagreement",
        "change of the tracker's pose against that by the motor angles, since a pose is held",
        "5 mm, 1 deg",
    ),
    BenchCondition(
        "motion",
        "a drive that cannot be enabled; cable that the motor has moved at the end of a motion",
        "half of the commanded length, from 1 mm on",
        "the command ends with exit code 5, quick stop of all unless stop_together = false; a "
        "warning",
        latches=False,
    ),
    BenchCondition("latch file", "reading and writing of the latch file", "possible"),
    BenchCondition("position record", "reading and writing of the record of positions", "possible"),
    BenchCondition("owner", "records of positions at opening", "closed at rest by their process"),
    BenchCondition(
        "sync", "SYNC frames that were not sent here", "none", "a warning", latches=False
    ),
    BenchCondition("recorder", "exceptions of a recorder", "none", "a warning", latches=False),
)
"""Tested by the control loop and what it drives; tests raise each of them."""


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

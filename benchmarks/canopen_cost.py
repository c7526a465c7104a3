"""What CANopen costs: a frame taken in, a cycle of eight axes, and how late the cycles begin.

``python benchmarks/canopen_cost.py [--seconds 60] [--busy 4] [--realtime] [--json]``: our receive
path beside canopen's PdoMap and BaseNode402 in one run; processor time of ``ControlLoop.step`` and
of the receive thread with eight axes in motion, in held time; in real time the lateness of the
same cycles, beside ``--busy`` processes that compute without end, and eight axes at 1 kHz on two
buses. ``--link virtual`` is python-can's interface, whose own cost is included, with the drives in
the same process; ``--link socket`` is winchkit's SocketCAN code, with the drives in another one.
``--realtime`` takes what this computer permits (docs/computer.md). Exits 1 when a frame is lost,
or when the machine is so busy that the supervisor stops the winches.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from typing import Any

from can_cost.cycle import HEARTBEAT, cost_of_cycle, lateness_of_cycle
from can_cost.decoding import cost_of_decoding

AIMS = {
    "pdo_map_over_feedback": "at least 20",
    "cycle_us": "at most 200",
    "cycle_over_pdo_map": "at most 31",
    "lost": "0",
}


def main() -> int:
    """Measure, print, judge."""
    given = _arguments()
    decoding = cost_of_decoding(rounds=given.rounds)
    cycle = {link: cost_of_cycle(given.axes, given.cycles, link) for link in given.link}
    figures: dict[str, dict[str, Any]] = {"decoding": decoding}
    for link, cost in cycle.items():
        cost["cycle_over_pdo_map"] = cost["cycle_p10_us"] / decoding["pdo_map_us"]
        figures[f"cycle, {link}"] = cost
    link = given.link[-1]
    load: dict[str, Any] = {"link": link, "busy": given.busy, "realtime": given.realtime}
    load["heartbeat"] = given.heartbeat
    figures["lateness"] = lateness_of_cycle(given.seconds, given.axes, **load)
    if given.fast:
        figures["two buses at 1 kHz"] = lateness_of_cycle(
            min(given.seconds, 10.0), given.axes, buses=2, cycle=1e-3, **load
        )
    figures["computer"] = {"load_average": os.getloadavg()[0], "cores": os.cpu_count()}
    if given.json:
        print(json.dumps({"schema": 1, **figures, "aims": AIMS}, indent=2))
    else:
        _show(figures)
    lateness = figures["lateness"]
    return 0 if lateness["kept_moving"] and not lateness["lost"] else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="of real-time cycles")
    parser.add_argument("--axes", type=int, default=8)
    parser.add_argument("--cycles", type=int, default=2000, help="in held time")
    parser.add_argument("--rounds", type=int, default=400, help="of decoding")
    parser.add_argument("--heartbeat", type=float, default=HEARTBEAT, help="of drives and host, s")
    parser.add_argument("--busy", type=int, default=0, help="processes that compute beside it")
    parser.add_argument("--realtime", action="store_true", help="priority, locked memory")
    parser.add_argument("--link", nargs="+", choices=("virtual", "socket"), default=["virtual"])
    parser.add_argument("--fast", action="store_true", help="1 kHz on two buses as well")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def _show(figures: dict[str, dict[str, Any]]) -> None:
    for name, values in figures.items():
        print(name)
        for key, value in values.items():
            if isinstance(value, list):
                for item in value:
                    print(f"  {key:30} {item}")
                continue
            aim = f"   (aim: {AIMS[key]})" if key in AIMS else ""
            print(f"  {key:30} {value:10.3f}{aim}")


if __name__ == "__main__":
    sys.exit(main())

"""Feeds every parser with random input; prints JSON, exits 1 when one of them fails.

``python benchmarks/fuzz_parsers.py --minutes 60``: serial instruments (every device file), Modbus
registers (every device file) and frames, declarations, object dictionaries, quantities, runs, logs,
damaged logs. Failed means: an exception that is not one of winchkit's own, an input that takes
longer than a second, a number that is no finite one and has no flag, an answer that is none. With
atheris installed (``pip install atheris``) its coverage leads the way, else valid inputs are
changed at random; ``--seed`` brings the same inputs back.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from fuzzing.engines import with_atheris, with_mutation, within_atheris
from fuzzing.targets import every


def main() -> int:
    """Fuzz for the time given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--engine", choices=["auto", "atheris", "mutation"], default="auto")
    parser.add_argument("--target", help="only those whose name holds this")
    parser.add_argument("--within-atheris", action="store_true", help=argparse.SUPPRESS)
    options, limits = parser.parse_known_args()
    if limits and not options.within_atheris:
        parser.error(f"unknown: {' '.join(limits)}")
    with tempfile.TemporaryDirectory() as scratch:
        targets = [one for one in every(Path(scratch)) if (options.target or "") in one.name]
        if options.within_atheris:
            within_atheris(targets[0], limits)
        engine = options.engine
        if engine == "auto":
            engine = "atheris" if find_spec("atheris") else "mutation"
        seconds = 60.0 * options.minutes
        if engine == "atheris":
            done, failures = with_atheris(__file__, targets, seconds, options.seed)
        else:
            done, failures = with_mutation(targets, seconds, options.seed)
    cpu = sum(os.times()[:4])
    print(
        json.dumps(
            {
                "engine": engine,
                "cpu_minutes": round(cpu / 60, 1),
                "inputs": done,
                "failures": failures,
            },
            indent=1,
        )
    )
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

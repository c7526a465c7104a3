"""What a log loses when its process is killed; prints JSON, exits 1 when it is too much.

``python benchmarks/recorder_kill.py --times 200``: eight winches at 1 kHz and their load cells at
100 Hz recorded to MCAP (or ``--format csv``), SIGKILL at a random moment up to two seconds. The
promise: at most 0.3 s lost, no sample missing before, ``recover`` makes a whole file with the same
samples, and an independent reader (the package ``mcap``, Python's csv) finds as many as winchkit.
On a machine that stands still at times, what is lost can be more than the recorder ``held``.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
from pathlib import Path

from recording.kill import kill_once

LIMIT = 0.3
LONGEST = 2.0


def main() -> int:
    """Kill as often as asked; every second recording is in parts of a second."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=200)
    parser.add_argument("--format", choices=("mcap", "csv"), default="mcap")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    moments = random.Random(given.seed)
    with tempfile.TemporaryDirectory() as folder:
        killed = [
            kill_once(
                Path(folder), moments.uniform(0, LONGEST), "1s" if n % 2 else None, given.format
            )
            for n in range(given.times)
        ]
    over = [vars(item) for item in killed if item.lost > LIMIT]
    lost = sorted(item.lost for item in killed)
    answer = {
        "times": given.times,
        "cycles": sum(item.given for item in killed),
        "lost_median": lost[len(lost) // 2],
        "lost_worst": lost[-1],
        "held_worst": max(item.held for item in killed),
        "over_limit": over,
        "gaps": sum(item.gaps for item in killed),
        "not_recovered": sum(not item.recovered for item in killed),
        "not_whole": sum(not item.whole for item in killed),
        "aim": {"lost_worst": LIMIT, "gaps": 0, "not_recovered": 0, "not_whole": 0},
    }
    print(json.dumps(answer))
    failures = ("over_limit", "gaps", "not_recovered", "not_whole")
    return int(any(answer[name] for name in failures))


if __name__ == "__main__":
    sys.exit(main())

"""Imports files whose structure is changed at random; prints JSON, exits 1 where one is wrong.

``python benchmarks/import_files.py --files 20000 --seed 1``: each file is of a known motion
(``fuzzing/recordings.py``) and is imported by ``winchkit import -y``. Wrong is a traceback, and a
number that differs from the truth by more than its resolution without a finding, a note or a
question on it. How many files came in right, were refused or asked, is printed as well.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from fuzzing.imported import Outcome, outcome_of
from fuzzing.recordings import recording


def main() -> int:
    """Import the files of a range of seeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    wrong: list[dict[str, Any]] = []
    for number in range(options.files):
        seed = options.seed * 1_000_000 + number
        with tempfile.TemporaryDirectory() as scratch:
            made = recording(seed, Path(scratch))
            found: Outcome = outcome_of(made, Path(scratch) / "runs")
        counts[found.kind] += 1
        if found.is_fault:
            wrong.append(
                {"seed": seed, "kind": found.kind, "text": found.text, "changes": made.changes}
            )
    print(json.dumps({"files": options.files, **counts, "faults": wrong}, indent=1))
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())

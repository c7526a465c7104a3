"""Runs the conformance suite on the machine's first CAN interface, with candump as witness.

On the second one it runs what only SocketCAN can show (``on_vcan.py``).

    python suite.py FOLDER

leaves ``candump.log`` and ``seen.log`` (what the suite's own witness saw) in the folder.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

CHANNEL = "vcan0"
SUITES = (Path(__file__).parents[2] / "conformance", Path(__file__).with_name("on_vcan.py"))
_WAKE = 0.5


def main(folder: Path) -> int:
    os.environ |= {
        "WINCHKIT_TEST_CAN": CHANNEL,
        "WINCHKIT_TEST_SEEN": str(folder / "seen.log"),
    }
    with (folder / "candump.log").open("wb") as log:
        # -d reports frames that it lost, -L is its log format.
        witness = subprocess.Popen(["candump", "-d", "-L", "-r", "4000000", CHANNEL], stdout=log)
        time.sleep(_WAKE)
        options = ["-q", "-rs", "-p", "no:cacheprovider", "-p", "no:xdist", "--durations=3"]
        options += ["-o", "addopts=--import-mode=importlib"]
        suite = [sys.executable, "-m", "pytest", *map(str, SUITES), *options]
        code = subprocess.run(suite, check=False).returncode
        time.sleep(_WAKE)
        witness.terminate()
        witness.wait()
    return code


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))

"""Runs the conformance suite on the machine's first CAN interface, with candump as witness.

On the second one it runs what only SocketCAN can show (``on_vcan.py``).

    python suite.py FOLDER [whole]

leaves ``candump.log`` and ``seen.log`` (what the suite's own witness saw) in the folder. Without
``whole`` it leaves out the cases of the suite that send and receive nothing else than ``SHORT``.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

CHANNEL = "vcan0"
SUITES = (Path(__file__).parents[2] / "conformance", Path(__file__).with_name("on_vcan.py"))
SHORT = (
    "test_pdos_are_set_up_in_the_order_of_the_standard",
    "test_a_boot_up_is_noticed_and_the_mapping_known_to_be_lost",
    "test_the_drives_silence_is_noticed",
    "test_emergencies_arrive_in_words",
    "test_states_and_transitions_one_by_one",
    "test_a_jog_moves_and_ends_by_its_dead_man",
    "test_a_stop_takes_effect_within_two_cycles",
    "test_the_end_of_the_loop_stops_the_drive",
)
"""Set-up, boot-up, heartbeat, emergencies, power, a motion, its stop, the loss of the host."""
_WAKE = 0.5


def main(folder: Path, *, whole: bool) -> int:
    os.environ |= {"WINCHKIT_TEST_CAN": CHANNEL, "WINCHKIT_TEST_SEEN": str(folder / "seen.log")}
    with (folder / "candump.log").open("wb") as log:
        # -d reports frames that it lost, -L is its log format.
        witness = subprocess.Popen(["candump", "-d", "-L", "-r", "4000000", CHANNEL], stdout=log)
        time.sleep(_WAKE)
        options = ["-q", "-rs", "-p", "no:cacheprovider", "-p", "no:xdist", "--durations=3"]
        options += ["-o", "addopts=--import-mode=importlib"]
        if not whole:
            options += ["-k", " or ".join((*SHORT, SUITES[1].stem))]
        suite = [sys.executable, "-m", "pytest", *map(str, SUITES), *options]
        code = subprocess.run(suite, check=False).returncode
        time.sleep(_WAKE)
        witness.terminate()
        witness.wait()
    return code


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), whole="whole" in sys.argv[2:]))

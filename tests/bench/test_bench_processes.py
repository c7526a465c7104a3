"""Commands in processes of their own against ``winchkit sim serve``: attach, stop, die."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from winchkit.runs import read_run
from winchkit.sim.live_client import tell

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="signals of POSIX"),
]

WINCHKIT = [sys.executable, "-c", "from winchkit.cli import main; main()"]


def start(*arguments: str, **options: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*WINCHKIT, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,  # type: ignore[call-overload]
    )


def winchkit(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*WINCHKIT, *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A simulated bench in its own process; yields its wiring file."""
    path = tmp_path_factory.mktemp("served") / "bench.toml"
    with start("sim", "serve", "spiral-bench", "--bench-file", str(path)) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        if not process.stdout.readline():
            reason = process.stderr.read()
            if "ip route add" in reason:
                pytest.skip(f"no route for multicast here: {reason}")
            pytest.fail(reason)
        yield path
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
        assert process.returncode == 0


def state(served: Path) -> tuple[float, str]:
    """True cable length, m, and the drive's state, as the simulation tells."""
    found = re.match(r"A: ([\d.]+) m, .* kg, ([a-z ]+)", tell(served, "status"))
    assert found is not None
    return float(found[1]), found[2]


def until_moving(served: Path) -> None:
    begin, _ = state(served)
    deadline = time.monotonic() + 20
    while abs(state(served)[0] - begin) < 0.02:
        assert time.monotonic() < deadline, "it did not move"
        time.sleep(0.02)


def assert_stands_still(served: Path) -> None:
    before, power = state(served)
    time.sleep(0.3)
    after, _ = state(served)
    assert power != "operation enabled"
    assert abs(after - before) < 1e-3


def test_jog_moves_and_says_where_it_is(served: Path) -> None:
    before, _ = state(served)
    done = winchkit("jog", "-b", str(served), "--speed", "-0.1 m/s", "--for", "1s")
    assert done.returncode == 0, done.stderr
    after, _ = state(served)
    assert 0.05 < after - before < 0.12
    shown = re.match(r"A: ([\d.]+) m", done.stdout)
    assert shown is not None
    assert float(shown[1]) == pytest.approx(after, abs=5e-3)
    back = winchkit("jog", "-b", str(served), "--step", "0.05 m", "--speed", "0.2m/s")
    assert back.returncode == 0, back.stderr
    assert state(served)[0] == pytest.approx(after - 0.05, abs=5e-3)
    assert_stands_still(served)


def test_others_attach_to_the_owner_and_one_stops_it(served: Path, tmp_path: Path) -> None:
    log = tmp_path / "beside.csv"
    with start("jog", "-b", str(served), "--speed", "-0.02 m/s", "--for", "60s") as owner:
        until_moving(served)
        shown = winchkit("monitor", "-b", str(served), "--json", "--for", "0.3s")
        assert shown.returncode == 0, shown.stderr
        pictures = [json.loads(line) for line in shown.stdout.splitlines()]
        assert pictures[-1]["winch"]["A"]["phase"] == "moving"
        logged = winchkit("log", "-b", str(served), "-o", str(log), "--for", "1s")
        assert logged.returncode == 0, logged.stderr
        assert len(read_run(log)) > 50
        refused = winchkit("tare", "-b", str(served))
        assert refused.returncode == 5
        assert "stop it first" in refused.stderr
        stopped = winchkit("stop", "-b", str(served))
        assert stopped.returncode == 0, stopped.stderr
        assert_stands_still(served)
        owner.communicate(timeout=20)
    assert owner.returncode == 5


def test_a_killed_owner_is_missed_by_the_drive(served: Path) -> None:
    with start("jog", "-b", str(served), "--speed", "0.1 m/s", "--for", "60s") as owner:
        until_moving(served)
        owner.kill()
        owner.communicate()
    time.sleep(0.8)
    assert_stands_still(served)
    assert winchkit("stop", "-b", str(served)).returncode == 0
    again = winchkit("jog", "-b", str(served), "--speed", "-0.1 m/s", "--for", "0.5s", "--reset")
    assert again.returncode == 0, again.stderr


def test_an_interrupt_stops_and_confirms(served: Path) -> None:
    with start("jog", "-b", str(served), "--speed", "-0.1 m/s", "--for", "60s") as owner:
        until_moving(served)
        owner.send_signal(signal.SIGINT)
        _, errors = owner.communicate(timeout=20)
    assert owner.returncode == 130, errors
    assert_stands_still(served)


def test_a_hand_needs_a_terminal_or_a_time(served: Path) -> None:
    done = winchkit("jog", "-b", str(served))
    assert done.returncode == 2
    assert "--for" in done.stderr
    assert winchkit("stop", "-b", str(served.with_name("none.toml"))).returncode == 3

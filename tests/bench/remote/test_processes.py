"""Commands in processes of their own against ``winchkit sim serve``: attach, stop, die.

The heartbeat is long, so that a busy machine trips nothing: what is timed here is no drive.
"""

from __future__ import annotations

import json
import os
import pty
import random
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from client_stalls import served as stalls_served
from client_stalls import stall
from command_line import own_process
from sim_process import WINCHKIT, served_bench, start
from waiting import until
from winchkit import attach, open_bench
from winchkit.bench.ownership import owner_process
from winchkit.errors import NotPermitted
from winchkit.runs import read_run
from winchkit.schema.read import read_bench
from winchkit.sim.live.client import send

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(os.name != "posix", reason="signals of POSIX"),
]


def winchkit(*arguments: str) -> subprocess.CompletedProcess[str]:
    return own_process(*WINCHKIT, *arguments, code=None, stdin=subprocess.DEVNULL)


def relaxed(text: str) -> str:
    """A bench file with a drive only, slow cycles and long delays allowed."""
    text = re.sub(r"\[winch\.A\.(cell|length|temperature)\]\n(.+\n)*", "", text)
    text = re.sub(r"tension_\w+ = .*\n", "", text)
    text = text.replace('heartbeat = "0.1 s"', 'heartbeat = "0.5 s"')
    text = text.replace("[winch.A.limits]", '[winch.A.limits]\nresponse_time = "1 s"')
    return text.replace("[winch.A]", 'cycle = "0.01 s"\n[winch.A]', 1)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A simulated bench in its own process; yields its bench file."""
    with served_bench(tmp_path_factory.mktemp("served")) as path:
        path.write_text(relaxed(path.read_text()))
        yield path


def state(served: Path) -> tuple[float, str]:
    """True cable length, m, and the drive's state, by the simulation."""
    found = re.match(r"A: ([\d.]+) m, .* kg, ([a-z ]+)", send(served, "status"))
    return float(found[1]), found[2]


def until_moving(served: Path, command: subprocess.Popen[str]) -> None:
    begin, _ = state(served)
    deadline = time.monotonic() + 90
    while abs(state(served)[0] - begin) < 0.01:
        assert command.poll() is None, f"the command has ended: {command.communicate()}"
        assert time.monotonic() < deadline, "it did not move"
        time.sleep(0.02)


def owner(served: Path) -> int:
    """Number of the process that owns the bench."""
    number = owner_process(read_bench(served))
    assert number is not None
    return number


def runs(process: int) -> bool:
    """Whether a process runs."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


@contextmanager
def jogging(
    served: Path, *arguments: str, way: str = "--pay-out"
) -> Iterator[subprocess.Popen[str]]:
    """A jog in a process of its own, once the winch moves; it is ended at the end."""
    with start("jog", "-b", str(served), way, "0.02 m/s", "--for", "60s", *arguments) as jog:
        try:
            until_moving(served, jog)
            yield jog
        finally:
            if jog.poll() is None:
                jog.kill()
                jog.communicate()


@contextmanager
def logging(served: Path, log: Path) -> Iterator[subprocess.Popen[str]]:
    """A log in a process of its own, once it writes; it is ended at the end."""
    with start("log", "-b", str(served), "-o", str(log), "--json") as logger:
        try:
            until_written(log, logger)
            yield logger
        finally:
            if logger.poll() is None:
                logger.kill()
                logger.communicate()


def until_written(log: Path, logger: subprocess.Popen[str]) -> None:
    """Wait for 20 more lines of a CSV log that are no comments: events are comments, rows not."""

    def lines() -> int:
        text = log.read_text() if log.is_file() else ""
        return sum(not line.startswith("#") for line in text.splitlines())

    def written() -> bool:
        assert logger.poll() is None, f"the log has ended: {logger.communicate()}"
        return lines() > before + 20

    before = lines()
    until(written, 90, f"no 20 rows came to {log}")


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Exit code and messages of a process."""
    _, errors = process.communicate(timeout=90)
    return process.returncode, errors


def assert_stands_still(served: Path) -> None:
    before, power = state(served)
    time.sleep(0.3)
    after, _ = state(served)
    assert power != "operation enabled"
    assert abs(after - before) < 1e-3


def test_jog_moves_and_says_where_it_is(served: Path) -> None:
    before, _ = state(served)
    done = winchkit("jog", "-b", str(served), "--pay-out", "0.1 m/s", "--for", "1s")
    assert done.returncode == 0, done.stderr
    after, _ = state(served)
    assert 0.05 < after - before < 0.12
    shown = re.match(r"A: ([\d.]+) m", done.stdout)
    assert float(shown[1]) == pytest.approx(after, abs=5e-3)
    back = winchkit("jog", "-b", str(served), "--wind-in", "50mm", "--speed", "0.1m/s")
    assert back.returncode == 0, back.stderr
    assert state(served)[0] == pytest.approx(after - 0.05, abs=5e-3)
    assert_stands_still(served)


@pytest.mark.parametrize(
    "order",
    [
        ("move", "--wind-in", "0.9 m", "--speed", "0.03 m/s"),
        ("jog", "--wind-in", "900mm", "--speed", "0.03 m/s"),
    ],
    ids=lambda order: order[0],
)
def test_a_suspended_command_moves_nothing(served: Path, order: tuple[str, ...]) -> None:
    """SIGSTOP of the client, and not of the process that owns the bench."""
    with start(*order, "-b", str(served)) as client:
        try:
            until_moving(served, client)
            client.send_signal(signal.SIGSTOP)
            stopped = time.monotonic()
            until(lambda: state(served)[1] != "operation enabled", 10, "it moves on")
            # The dead-man, the ramp and a busy computer; before, it moved on for 30 s.
            assert time.monotonic() - stopped < 3.0
            assert_stands_still(served)
            shown = winchkit("monitor", "-b", str(served), "--json", "--for", "0.3s")
            (warning,) = json.loads(shown.stdout.splitlines()[-1])["warnings"]
            assert f"{order[0]} (process {client.pid}, user " in warning
            assert "gave no sign of life for 0.5 s" in warning
            client.send_signal(signal.SIGCONT)
            code, errors = ended(client)
            assert code == 5, errors
            assert "the dead-man" in errors
        finally:
            if client.poll() is None:
                client.kill()
                client.communicate()
    assert winchkit("reset", "-b", str(served)).returncode == 0


@pytest.mark.parametrize("kind", ["keys", "hold-tension"])
def test_a_client_that_was_suspended_goes_on_with_nothing(tmp_path: Path, kind: str) -> None:
    """The loop of benchmarks/client_stalls.py, once for each kind that is not above."""
    with stalls_served(tmp_path) as bench:
        assert stall(bench, kind, random.Random(7)).wrong == ""


def test_others_attach_and_one_stops_it_by_name(served: Path, tmp_path: Path) -> None:
    log = tmp_path / "beside.csv"
    with jogging(served) as jog:
        shown = winchkit("monitor", "-b", str(served), "--json", "--for", "0.3s")
        assert shown.returncode == 0, shown.stderr
        picture = json.loads(shown.stdout.splitlines()[-1])
        assert picture["winch"]["A"]["phase"] == "moving"
        assert picture["winch"]["A"]["cable_speed"] > 0, "it pays out"
        assert f"jog (process {jog.pid}, user " in picture["winch"]["A"]["commander"]
        logged = winchkit("log", "-b", str(served), "-o", str(log), "--for", "1s")
        assert logged.returncode == 0, logged.stderr
        assert len(read_run(log)) > 30
        stopped = winchkit("stop", "-b", str(served))
        assert stopped.returncode == 0, stopped.stderr
        assert_stands_still(served)
        code, words = ended(jog)
    assert code == 5
    assert "winch A was stopped by stop (process " in words


def test_a_stop_of_a_programme_that_owns_the_bench_latches_nothing(
    served: Path, tmp_path: Path
) -> None:
    """The programme ends by the stop, and closes the bench while the stop confirms."""
    words = ("run", "programme-demo-slow", "-y", "-b", str(served), "-o", str(tmp_path))
    with start(*words) as run:
        until_moving(served, run)
        stopped = winchkit("stop", "-b", str(served))
        assert stopped.returncode == 0, stopped.stderr
        code, said = ended(run)
    assert code == 5
    assert "was stopped by stop" in said
    assert winchkit("jog", "-b", str(served), "--wind-in", "5mm").returncode == 0


def test_one_bench_process_serves_commands_that_start_together(served: Path) -> None:
    until(lambda: not runs(owner(served)), 90, "the bench process did not end")
    options = ("-b", str(served), "--json", "--for", "2s")
    with start("monitor", *options) as first, start("monitor", *options) as second:
        told = [process.communicate(timeout=60) for process in (first, second)]
    assert first.returncode == second.returncode == 0, told
    owners = [json.loads(out.splitlines()[-1])["owner"] for out, _ in told]
    assert owners[0] == owners[1]
    assert owners[0].startswith(f"bench process (process {owner(served)}, user ")
    until(lambda: not runs(owner(served)), 90, "the bench process outlives its last client")


def test_a_second_jog_is_refused_by_name_and_the_first_goes_on(served: Path) -> None:
    with jogging(served) as jog:
        refused = winchkit("jog", "-b", str(served), "--wind-in", "0.05 m/s", "--for", "1s")
        assert refused.returncode == 5, refused.stderr
        assert f"winch A is commanded by jog (process {jog.pid}, user " in refused.stderr
        moved = winchkit("move", "A", "-b", str(served), "--wind-in", "5mm")
        assert moved.returncode == 5
        assert jog.poll() is None, "nothing changes for the first"
        until_moving(served, jog)


def test_who_is_overtaken_ends_with_5_and_by_whose_hand(served: Path) -> None:
    length = f"{state(served)[0] + 0.4} m"
    with start("move", "A", "-b", str(served), "--to", length, "--speed", "20mm/s") as move:
        until_moving(served, move)
        taker = start("jog", "-b", str(served), "--wind-in", "30mm", "--take-over")
        with taker:
            code, words = ended(move)
            assert code == 5, words
            assert f"winch A was taken over by jog (process {taker.pid}, user " in words
            assert ended(taker)[0] == 0
    assert_stands_still(served)


def test_a_killed_bench_process_is_missed_by_the_drive_and_reported_to_its_clients(
    served: Path,
) -> None:
    with jogging(served, way="--wind-in") as jog:
        os.kill(owner(served), signal.SIGKILL)
        code, words = ended(jog)
    assert code == 4, words
    assert "the process that owned the bench has ended; its drives stop" in words
    until(lambda: state(served)[1] != "operation enabled", 3.0, "it is still enabled")
    assert_stands_still(served)
    assert winchkit("stop", "-b", str(served)).returncode == 0
    again = winchkit("jog", "-b", str(served), "--pay-out", "10mm", "--reset")
    assert again.returncode == 0, again.stderr


def test_a_killed_client_stops_what_it_started_and_the_bench_process_ends(served: Path) -> None:
    with jogging(served) as jog:
        process = owner(served)
        jog.kill()
        jog.communicate()
        until(lambda: state(served)[1] != "operation enabled", 5.0, "it is still enabled")
        assert_stands_still(served)
    until(lambda: not runs(process), 90, "the bench process outlives its last client")


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_signal_to_a_command_stops_and_confirms(served: Path, number: int, code: int) -> None:
    with jogging(served) as jog:
        jog.send_signal(number)
        assert ended(jog)[0] == code
        assert state(served)[1] != "operation enabled", "at rest before the command has ended"
    assert_stands_still(served)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_to_the_bench_process_stops_and_closes_its_logs(
    served: Path, tmp_path: Path, number: int
) -> None:
    log = tmp_path / "cut.csv"
    with jogging(served) as jog, logging(served, log) as logger:
        process = owner(served)
        os.kill(process, number)
        code, words = ended(jog)
        assert code == 4, words
        until(lambda: not runs(process), 90, "it did not end")
        assert state(served)[1] != "operation enabled"
        assert log.read_text().endswith("\n"), "the log was closed"
        assert len(read_run(log)) > 10
        logger.send_signal(signal.SIGINT)
        assert ended(logger)[0] in (0, 130)
    assert_stands_still(served)


@pytest.mark.parametrize("how", ["hang up", "end of input"])
def test_a_closed_terminal_stops(served: Path, how: str) -> None:
    """With a controlling terminal comes SIGHUP, without one the end of the input."""
    master, slave = pty.openpty()
    begin = [sys.executable, "-c", CONTROLLED] if how == "hang up" else WINCHKIT
    jog = subprocess.Popen(
        [*begin, "jog", "-b", str(served)],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        start_new_session=True,
    )
    os.close(slave)
    try:
        read_until(master, b"hold up")
        shown = b""
        for _ in range(60):
            os.write(master, b"\x1b[B")
            shown += read_for(master, 0.05)
        assert state(served)[1] == "operation enabled", shown
    finally:
        os.close(master)
    assert jog.wait(timeout=30) == 129
    assert_stands_still(served)


CONTROLLED = (
    "import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    "from winchkit.cli import main; main()"
)


def read_for(terminal: int, duration: float) -> bytes:
    """What a terminal shows within a time (s)."""
    shown, deadline = b"", time.monotonic() + duration
    while (left := deadline - time.monotonic()) > 0:
        if select.select([terminal], [], [], left)[0]:
            shown += os.read(terminal, 4096)
    return shown


def read_until(terminal: int, words: bytes) -> None:
    """Read a terminal until it shows these words, and go on reading beside the test."""
    shown, deadline = b"", time.monotonic() + 60
    while words not in shown:
        assert time.monotonic() < deadline, shown
        if select.select([terminal], [], [], 0.5)[0]:
            shown += os.read(terminal, 4096)


def test_a_log_outlives_the_jog_that_opened_the_bench(served: Path, tmp_path: Path) -> None:
    log = tmp_path / "whole.csv"
    with jogging(served) as jog, logging(served, log) as logger:
        jog.send_signal(signal.SIGINT)
        ended(jog)
        until_written(log, logger)
        logger.send_signal(signal.SIGINT)
        out, errors = logger.communicate(timeout=90)
    assert logger.returncode == 0, errors
    told = json.loads(out)
    assert told["files"] == {str(log): told["rows"]}
    assert len(read_run(log)) == told["rows"]


def test_files_that_were_edited_while_the_bench_is_open_are_reported_or_read_again(
    tmp_path: Path,
) -> None:
    with served_bench(tmp_path) as bench, logging(bench, tmp_path / "lift.csv") as logger:
        before = owner(bench)
        text = bench.read_text()
        bench.write_text(
            text.replace("[winch.A.limits]", '[winch.A.limits]\nresponse_time = "1 s"')
        )
        second = winchkit("log", "-b", str(bench), "-o", str(tmp_path / "b.csv"), "--for", "0.5s")
        assert second.returncode == 0, second.stderr
        assert "with other files than these: what is shown and logged is by those" in second.stderr
        assert owner(bench) == before
        asked = winchkit("cell", "info", "A", "-b", str(bench))
        assert asked.returncode == 0, asked.stderr
        assert owner(bench) != before, "a calibration, say, is that of the new file"
        until_written(tmp_path / "lift-2.csv", logger)


def test_a_program_takes_the_bench_from_a_log_which_goes_on(served: Path, tmp_path: Path) -> None:
    log = tmp_path / "lift.csv"
    with logging(served, log) as logger:
        second = tmp_path / "lift-2.csv"
        with open_bench(served, name="a control program") as bench:
            until_written(second, logger)
            assert any(client.name.startswith("log ") for client in bench.stations.clients)
            with pytest.raises(NotPermitted, match=r"owned by a control program"):
                open_bench(served)
        third = tmp_path / "lift-3.csv"
        until_written(third, logger)
        logger.send_signal(signal.SIGINT)
        out, errors = logger.communicate(timeout=90)
    assert logger.returncode == 0, errors
    assert errors.count("connecting again; the log goes on in") == 2
    told = json.loads(out)
    assert list(told["files"]) == [str(log), str(second), str(third)]
    assert all(len(read_run(Path(file))) > 10 for file in told["files"])


def test_python_attaches_and_is_refused_while_another_client_may_move(served: Path) -> None:
    with attach(served, name="first") as first, attach(served, name="second") as second:
        assert first.owner == second.owner
        first.jog("A", pay_out=0.05, hold=0.7)
        with pytest.raises(NotPermitted, match="winch A is commanded by first"):
            second.jog("A", wind_in=0.05, hold=0.7)
        with pytest.raises(NotPermitted, match=r"used by (first, second|second, first)"):
            open_bench(served)
        second.stop()
        assert_stands_still(served)
        assert second.status()["winch"]["A"]["commander"] == "first"


def test_what_keeps_the_bench_process_from_opening_is_the_commands_own_error(
    served: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.toml"
    text = served.read_text()
    other.write_text(re.sub(r"port = (\d+)\n\n\[bus.instr", "port = 3\n\n[bus.instr", text))
    unreachable = winchkit("jog", "-b", str(other), "--pay-out", "10mm")
    assert unreachable.returncode == 4, unreachable.stderr
    assert "no answer" in unreachable.stderr
    other.write_text(text.replace('profile = "bench-spiral"', 'profile = "bench-spirall"'))
    assert winchkit("jog", "-b", str(other), "--pay-out", "10mm").returncode in (2, 3)


def test_a_hand_needs_a_terminal_or_a_time(served: Path) -> None:
    done = winchkit("jog", "-b", str(served))
    assert done.returncode == 2
    assert "--for" in done.stderr
    assert winchkit("stop", "-b", str(served.with_name("none.toml"))).returncode == 3

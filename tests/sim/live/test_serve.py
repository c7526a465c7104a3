"""``winchkit sim serve`` in a process of its own."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest

from command_line import own_process
from sim_process import WINCHKIT, start
from waiting import until
from winchkit import open_bench
from winchkit.schema.read import read_bench
from winchkit.sim.live.client import address_file, send

COMMAND = [*WINCHKIT, "sim", "serve"]


@contextmanager
def serving(
    folder: Path, *options: str, bench: str = "spiral-bench"
) -> Iterator[subprocess.Popen[str]]:
    words = ("sim", "serve", bench, *options)
    process = start(*words, stdin=subprocess.PIPE, folder=folder)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def wait_for_file(process: subprocess.Popen[str], path: Path) -> None:
    end = time.monotonic() + 60
    while not path.is_file():
        if process.poll() is not None:
            words = process.stderr.read()
            if "multicast" in words:
                pytest.skip(f"no multicast on this machine: {words}")
            pytest.fail(words)
        assert time.monotonic() < end, "sim serve did not start"
        time.sleep(0.02)


def end(process: subprocess.Popen[str]) -> tuple[str, str]:
    words = process.communicate(timeout=30)
    assert process.returncode == 0, words
    return words


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for another process")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_it_is_interrupted(tmp_path: Path, number: int) -> None:
    path = tmp_path / "spiral-bench-bench.toml"
    with serving(tmp_path) as process:
        wait_for_file(process, address_file(path))
        bus = read_bench(path).bus["can"]
        assert isinstance(bus.port, int)
        send(path, "load A 14 kg")
        assert "14 kg" in send(path, "status")
        with can.Bus(interface="udp_multicast", channel=bus.channel, port=bus.port) as master:
            # Upload 1018:4, the serial number, of node 1.
            request = can.Message(
                arbitration_id=0x601, data=bytes.fromhex("4018100400000000"), is_extended_id=False
            )
            master.send(request)
            replies = iter(lambda: master.recv(10.0), None)
            reply = next(frame for frame in replies if frame.arbitration_id == 0x581)
            assert bytes(reply.data) == bytes.fromhex("4318100400000000")
        process.send_signal(number)
        out, err = end(process)
    assert out.splitlines()[0] == "spiral-bench-bench.toml"
    assert "winchkit jog A --bench spiral-bench-bench.toml" in err
    assert not address_file(path).exists()


@pytest.mark.realtime
def test_a_served_robot_moves_its_platform_without_a_trip(tmp_path: Path) -> None:
    """With half of its frames: its own cycle of 8 ms takes nine tenths of a slow processor."""
    path = tmp_path / "robot.toml"
    with serving(tmp_path, "-o", "robot.toml", bench="cabtive-robot") as process:
        wait_for_file(process, address_file(path))
        text = path.read_text()
        path.write_text(re.sub(r"(?m)^cycle = .*$", 'cycle = "16 ms"', text))
        assert path.read_text() != text
        with open_bench(path, realtime="try") as bench:
            until(lambda: not bench.snapshot.blocked)
            before = bench.robot.coordinates()
            bench.robot.move(bench.robot.moved({"x": 0.02}, relative=True), 0.05)
            after = bench.robot.coordinates()
            assert after["x"] - before["x"] == pytest.approx(0.02, abs=1e-3)
            assert bench.snapshot.tripped == ()


@pytest.mark.slow
@pytest.mark.parametrize(("options", "last"), [([], "quit\n"), (["--end-with-input"], "")])
def test_it_takes_lines_on_its_input(tmp_path: Path, options: list[str], last: str) -> None:
    path = tmp_path / "here.toml"
    own = ("--bench-file", "here.toml", "--interface", "virtual", *options)
    with serving(tmp_path, *own) as process:
        wait_for_file(process, address_file(path))
        assert process.stdin is not None
        lines = f"load A 21 kg\nstatus\nlood A 3 kg\n{last}"
        out, err = process.communicate(lines, timeout=30)
    assert process.returncode == 0
    assert "21 kg on A" in out
    assert "did you mean 'load'?" in err


def test_it_writes_over_no_file_of_somebody_else(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text("# the bench in the hall\n")
    with serving(tmp_path, "-o", path.name) as process:
        _, words = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "no simulation wrote it" in words
    assert path.read_text() == "# the bench in the hall\n"


def test_of_two_onto_one_bench_file_the_second_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    with serving(tmp_path, "-o", path.name) as first:
        wait_for_file(first, address_file(path))
        written = path.read_bytes()
        with serving(tmp_path, "-o", path.name, "--seed", "2") as second:
            _, words = second.communicate(timeout=60)
        assert second.returncode == 2
        assert "a running simulation uses this file" in words
        assert path.read_bytes() == written
        assert "10 kg" in send(path, "status")
    with serving(tmp_path, "-o", path.name) as later:
        address_file(path).write_text("127.0.0.1:1\n")
        end_of_wait = time.monotonic() + 60
        while path.read_bytes() == written and time.monotonic() < end_of_wait:
            assert later.poll() is None
            time.sleep(0.02)
    assert path.read_bytes() != written, "the killed one's file is written anew"


def test_an_unknown_bench_is_a_clear_error(tmp_path: Path) -> None:
    found = own_process(*COMMAND, "spirl-bench", code=3, cwd=tmp_path)
    assert "did you mean 'spiral-bench'?" in found.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_folder_that_is_not_there_is_a_clear_error(tmp_path: Path) -> None:
    words = ("spiral-bench", "--interface", "virtual", "--bench-file", "no/where.toml")
    found = own_process(*COMMAND, *words, code=3, cwd=tmp_path)
    assert found.stderr.startswith(str(Path("no/where.toml")))

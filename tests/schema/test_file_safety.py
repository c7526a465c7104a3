"""Untrusted files: nothing in them is executed, controls the terminal, or blocks a command."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import Result

from command_line import done, invoke
from winchkit import catalog
from winchkit.errors import Fault, one_line, printable
from winchkit.runs import open_writer
from winchkit.runs.formats.mcap_file import COLUMNS, METADATA, PROFILE, McapFile

EVIL = "\x1b]0;owned\x07\x1b[2J\x1b[31m\r\u202egpj\x9b2Kend"
"""Renames the window, rings, clears the screen, colours, returns, turns the text around, CSI."""
CELL = EVIL.replace("\r", "")
"""As a name of a column, which has no line breaks."""
STEERING = ("\x1b", "\x07", "\r", "\u202e", "\x9b", "\x7f", "\x08", "\u2028")
PROFILE_FILE = "bench-spiral"


@contextlib.contextmanager
def not_longer_than(seconds: int) -> Iterator[None]:
    """Raise instead of waiting for ever."""

    def late(*_: object) -> None:
        raise AssertionError(f"waited longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def assert_steers_nothing(result: Result) -> None:
    assert result.exit_code != 70, result.stderr
    for character in STEERING:
        assert character not in result.stdout, ascii(result.stdout)
        assert character not in result.stderr, ascii(result.stderr)


# --- control characters ---------------------------------------------------------------------------


def evil_csv(folder: Path) -> Path:
    path = folder / "evil.csv"
    name = f"x{CELL}".replace("]", "").replace("[", "")
    columns = [("time", "s"), ("motor_angle", "rad"), (name, name)]
    with open_writer(path, columns, {"note": f"a{EVIL}", f"k{EVIL}": "b"}) as writer:
        for n in range(30):
            writer.append_values([n * 0.01, n, n])
    return path


def evil_mcap(folder: Path) -> Path:
    """Written record by record: winch names, metadata with line feeds, another note."""
    path = folder / "evil.mcap"
    name = f"A{CELL}.motor_angle"
    with open_writer(path, [("time", "s"), (name, "rad"), ("B.motor_angle", "rad")]) as writer:
        for n in range(30):
            writer.append_values([n * 0.01, n, n])
    with (folder / "other.mcap").open("wb") as stream:
        file = McapFile(stream, PROFILE, "x")
        file.put_metadata(METADATA, {"note": f"first\nforged.csv: ok{EVIL}"})
        file.put_metadata(COLUMNS, {"time": "s", f"q{EVIL}": f"u{EVIL}"})
        file.finish()
    return path


def evil_profile(folder: Path) -> Path:
    path = folder / "evil.toml"
    text = catalog.find("profiles", PROFILE_FILE).read_text()
    escaped = json.dumps(f"evil{EVIL}\nforged.toml: ok")
    path.write_text(text.replace(f'name = "{PROFILE_FILE}"', f"name = {escaped}", 1))
    assert escaped in path.read_text()
    return path


def test_nothing_that_a_file_says_steers_the_terminal(tmp_path: Path) -> None:
    rows, messages, profile = evil_csv(tmp_path), evil_mcap(tmp_path), evil_profile(tmp_path)
    bare = tmp_path / "other.mcap"
    commands = [
        *(("check", file) for file in (rows, messages, profile, bare)),
        *(("log", "info", file) for file in (rows, messages, bare)),
        ("export", messages, "-o", tmp_path / "a.csv"),
        ("export", messages, "-o", tmp_path / "a.csv", "--winch", f"Z{EVIL}"),
        ("compare", rows, "-p", profile),
        ("compare", rows, "-p", f"no{EVIL}"),
        ("compare", messages, "-p", PROFILE_FILE),
        ("compare", messages, "-p", PROFILE_FILE, "--winch", "all"),
        ("diagnose", rows, "-p", profile),
        ("import", rows),
        ("log", "replay", "--fast", "--jsonl", messages),
        ("log", "replay", "--fast", messages),
        ("log", "recover", messages, "-o", tmp_path / f"r{EVIL.replace('/', '')}.mcap"),
        ("check", tmp_path / f"none{EVIL}.csv"),
        (f"chekc{EVIL}",),
    ]
    shown = ""
    for words in commands:
        result = invoke(*words)
        assert_steers_nothing(result)
        shown += result.stdout + result.stderr
    assert "\\x1b]0;owned\\x07\\x1b[2J\\x1b[31m\\r\\u202egpj\\x9b2Kend" in shown, (
        "it is shown escaped"
    )
    assert not any(line.startswith("forged") for line in shown.splitlines())


def test_json_has_the_text_and_steers_nothing(tmp_path: Path) -> None:
    for words in (("log", "info", evil_csv(tmp_path)), ("check", evil_profile(tmp_path))):
        result = invoke(*words, "--json")
        assert_steers_nothing(result)
        found = json.loads(result.stdout)
        told = found["metadata"]["note"] if "metadata" in found else found["files"][0]["name"]
        assert told in (f"a{EVIL}".replace("\r", " "), f"evil{EVIL}\nforged.toml: ok")


def test_what_counts_as_steering() -> None:
    for character in STEERING:
        assert character not in printable(f"a{character}b")
    assert printable("tab\tline\nµ − 20 °C “x” é 漢") == "tab\tline\nµ − 20 °C “x” é 漢"
    assert printable("\x1b\r\u202e\ud800") == "\\x1b\\r\\u202e\\ud800"
    assert one_line("a\nb\tc") == "a\\nb\\tc"
    assert str(Fault("m\x1b", "p\n", 3, "k\r")) == "p\\n:3: k\\r: m\\x1b"


@pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals of POSIX")
def test_a_table_on_a_real_terminal_shows_names_and_obeys_none(tmp_path: Path) -> None:
    """rich steers the terminal; names in its cells must not, nor be taken for its markup."""
    path = tmp_path / "evil.mcap"
    name = f"A[/red][link=x]{CELL}"
    with open_writer(path, [("time", "s"), (f"{name}.motor_angle", "rad")]) as writer:
        for n in range(30):
            writer.append_values([n * 0.01, n])
    master, slave = pty.openpty()
    words = [sys.executable, "-m", "winchkit", "log", "replay", "--fast", str(path)]
    wide = os.environ | {"COLUMNS": "300", "TERM": "xterm"}
    with subprocess.Popen(words, stdin=slave, stdout=slave, stderr=slave, env=wide) as process:
        os.close(slave)
        seen, end = b"", time.monotonic() + 60
        while time.monotonic() < end:
            ready, _, _ = select.select([master], [], [], 0.2)
            try:
                seen += os.read(master, 65536) if ready else b""
            except OSError:
                break
            if process.poll() is not None and not ready:
                break
    os.close(master)
    assert process.returncode == 0, seen
    text = seen.decode()
    assert "\\x1b]0" in text, "the name is shown, escaped"
    for steering in ("\x1b]0;", "\x07", "\x1b[2J", "\x9b", "\u202e"):
        assert steering not in text, ascii(text)


# --- files that are none --------------------------------------------------------------------------


def special(kind: str, path: Path) -> None:
    if kind == "FIFO":
        os.mkfifo(path)
    elif kind == "character device":
        path.symlink_to("/dev/zero")
    elif kind == "directory":
        path.mkdir()
    else:
        server = socket.socket(socket.AF_UNIX)
        folder = os.open(path.parent, os.O_RDONLY)
        before = Path.cwd()
        try:
            os.fchdir(folder)
            server.bind(path.name)
        finally:
            os.chdir(before)
            os.close(folder)
        server.close()


READERS = [
    ("check", "a.csv"),
    ("check", "a.mcap"),
    ("check", "a.toml"),
    ("check", "a.eds"),
    ("log", "info", "a.csv"),
    ("log", "info", "a.mcap"),
    ("log", "recover", "a.csv"),
    ("log", "recover", "a.mcap"),
    ("log", "replay", "a.mcap"),
    ("export", "a.csv", "-o", "b.mcap"),
    ("compare", "a.csv", "-p", PROFILE_FILE),
    ("compare", "a.mcap", "-p", PROFILE_FILE),
    ("diagnose", "a.csv", "-p", PROFILE_FILE),
    ("compare", "run.csv", "-p", "a.toml"),
    ("run", "a.toml", "-b", "bench.toml"),
    ("monitor", "-b", "a.toml"),
    ("scan", "-b", "a.toml"),
    ("sim", "record", "a.toml", "programme-demo"),
    ("sim", "record", "spiral-bench", "a.toml"),
    ("sim", "serve", "a.toml"),
    ("remove", "drum-radius", "-p", "a.toml", "-o", "b.toml"),
    ("ledger", "-p", "a.toml"),
]


@pytest.mark.skipif(os.name != "posix", reason="special files of POSIX")
@pytest.mark.parametrize("words", READERS, ids=" ".join)
@pytest.mark.parametrize("kind", ["FIFO", "socket", "character device", "directory"])
def test_what_is_no_regular_file_is_refused_and_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, words: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    with open_writer("run.csv", [("time", "s"), ("motor_angle", "rad")]) as writer:
        for n in range(30):
            writer.append_values([n * 0.01, n])
    special(kind, tmp_path / next(word for word in words if word.startswith("a.")))
    with not_longer_than(30):
        result = invoke(*words)
    assert result.exit_code == 3, (result.exit_code, result.stdout, result.stderr)
    named = ("directory", "is a folder") if kind == "directory" else (kind,)
    assert any(words in result.stderr for words in named), result.stderr


# --- numbers --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("time_at", "angle", "part"),
    [
        ("1e308", "1", "beyond ±9.2e+09 s"),
        ("-1e308", "1", "beyond ±9.2e+09 s"),
        ("1.7e12", "1", "write its unit, e.g. 'time [ms]'"),
        ("inf", "1", "column 'time' is infinite"),
        ("0.5", "inf", "column 'motor_angle' is infinite"),
    ],
)
@pytest.mark.parametrize("command", ["check", "log info", "export", "compare", "log replay"])
def test_numbers_that_no_measurement_gives_are_faults_of_the_file(
    tmp_path: Path, command: str, time_at: str, angle: str, part: str
) -> None:
    path = tmp_path / "a.csv"
    rows = "".join(f"{n * 0.01},{n}\n" for n in range(-30, 0))
    path.write_text(f"time [s],motor_angle [rad]\n{rows}{time_at},{angle}\n")
    more = {
        "export": ("-o", tmp_path / "b.mcap"),
        "compare": ("-p", PROFILE_FILE),
        "log replay": ("--fast", "--jsonl"),
    }
    result = done(*command.split(), path, *more.get(command, ()), code=3)
    assert part in result.stderr
    assert f"{path}:32: " in result.stderr


# --- code -----------------------------------------------------------------------------------------

OWN_EFFECT = """
from pathlib import Path
Path({marker!r}).write_text("executed")
"""


@pytest.fixture
def trap(tmp_path: Path) -> tuple[Path, Path]:
    """A bench file whose effect file leaves a mark when it is executed."""
    marker, effects = tmp_path / "executed", tmp_path / "mine.py"
    effects.write_text(OWN_EFFECT.format(marker=str(marker)))
    profile = tmp_path / "mine.toml"
    text = catalog.find("profiles", PROFILE_FILE).read_text()
    profile.write_text(text + '\n[[effect]]\nid = "my-own"\n')
    bench = tmp_path / "bench.toml"
    bench.write_text(
        'schema = 1\nkind = "bench"\neffects = ["mine.py"]\n'
        '[bus.can]\nkind = "can"\ninterface = "virtual"\nchannel = "trap"\n'
        '[winch.A]\nprofile = "./mine.toml"\n'
        'servo = { device = "generic-cia402", bus = "can", node = 1 }\n'
        '[winch.A.limits]\nspeed = "0.5 m/s"\nacceleration = "1 m/s^2"\n'
    )
    return bench, marker


def test_check_executes_nothing_that_a_file_names(trap: tuple[Path, Path]) -> None:
    bench, marker = trap
    for words in (("check", bench), ("check", "--json", bench)):
        result = invoke(*words)
        assert not marker.exists()
        assert "mine.py' is Python code, which check does not execute" in result.stderr
        assert "no effect 'my-own'" not in result.stderr, "it may stand in that file"
    own = bench.with_name("mine.py")
    result = invoke("check", bench, "--effects", own)
    assert marker.exists(), "--effects is the user's own word"
    assert "has no object of class winchkit.effects.effect.Effect" in result.stderr
    assert "does not execute" not in result.stderr


def test_commands_that_only_read_execute_nothing(trap: tuple[Path, Path]) -> None:
    bench, marker = trap
    for words in (
        ("check", bench),
        ("check", bench.with_name("mine.toml")),
        ("busload", "-b", bench),
        ("compare", bench.with_name("none.csv"), "-p", bench.with_name("mine.toml")),
        ("ledger", "-p", bench.with_name("mine.toml")),
        ("log", "info", bench),
    ):
        invoke(*words)
        assert not marker.exists(), words


def test_both_pages_say_what_is_executed() -> None:
    docs = Path(__file__).parents[2] / "docs"
    effects, formats = ((docs / page).read_text() for page in ("effects.md", "formats.md"))
    assert "Commands that only read do not execute files that a bench file names" in effects
    assert "not by `check` and the other commands that only read" in formats

"""The command line as a whole: fast help, exit codes, one line for whatever goes wrong."""

from __future__ import annotations

import datetime
import enum
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import Result

import winchkit
from command_line import done, invoke, own_process
from winchkit.cli import main
from winchkit.cli.core.output import to_json
from winchkit.errors import (
    ConnectionLost,
    DriveFault,
    Fault,
    FileError,
    LimitTripped,
    NoReply,
    RunError,
    UsageError,
    WinchkitError,
)

HEAVY = {"numpy", "scipy", "canopen", "can", "pymodbus", "pydantic", "rich", "mcap", "tomlkit"}


def python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return own_process(sys.executable, "-c", code, code=None, env=os.environ | environment)


def running(
    monkeypatch: pytest.MonkeyPatch, body: Callable[[], object], name: str = "check"
) -> Result:
    """Run the command line with another body in place of a command."""
    command = click.Command(name, callback=body)
    monkeypatch.setattr("winchkit.cli.files.check.command", command)
    return invoke(name)


@pytest.mark.parametrize(
    "code",
    [
        "import winchkit",
        "import winchkit.cli",
        "from winchkit.cli import main; main(['--help'])",
        "from winchkit.cli import main; main(['--version'])",
        "from winchkit.cli import main; main(['check', '--help'])",
        "from winchkit.cli import main; main(['export', '--help'])",
    ],
)
def test_start_up_imports_nothing_heavy(code: str) -> None:
    names = f"import atexit, sys; atexit.register(lambda: print(*sys.modules)); {code}"
    done = python(names)
    assert done.returncode == 0, done.stderr
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert "winchkit" in loaded
    assert not loaded & HEAVY


def test_help_lists_every_command() -> None:
    result = done("--help")
    for name, entry in main.table.items():
        assert f"  {name} " in result.output
        assert entry.help in result.output


def test_the_version() -> None:
    result = invoke("--version")
    assert (result.exit_code, result.output) == (0, f"winchkit, version {winchkit.__version__}\n")


def test_the_package_is_the_command_line_too() -> None:
    command = [sys.executable, "-m", "winchkit", "--version"]
    told = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout
    assert told == f"winchkit, version {winchkit.__version__}\n"


@pytest.mark.parametrize("name", sorted(main.table))
def test_every_command_of_the_table_is_there(name: str) -> None:
    result = done(name, "--help")
    assert result.output.startswith("Usage: ")


def test_a_wrong_option_is_usage() -> None:
    assert invoke("check", "--wrong").exit_code == 2
    assert invoke("check").exit_code == 2


def test_options_are_environment_variables(tmp_path: Path) -> None:
    file = tmp_path / "p.toml"
    file.write_text('schema = 1\nkind = "programme"\n[[step]]\nhold = "1 s"\n')
    result = invoke("check", file, env={"WINCHKIT_CHECK_JSON": "1"})
    assert json.loads(result.stdout)["files"][0]["ok"] is True


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (WinchkitError("x"), 1),
        (UsageError("x"), 2),
        (FileError("x"), 3),
        (RunError("x"), 3),
        (ConnectionLost("x"), 4),
        (NoReply("x"), 4),
        (DriveFault("x"), 5),
        (LimitTripped("x"), 5),
        (KeyboardInterrupt(), 130),
        (click.Abort(), 1),
        (click.UsageError("x"), 2),
        (ZeroDivisionError("x"), 70),
        (SystemExit(7), 7),
    ],
    ids=lambda value: type(value).__name__,
)
def test_an_error_becomes_an_exit_code(
    monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int
) -> None:
    def body() -> None:
        raise error

    monkeypatch.delenv("WINCHKIT_DEBUG", raising=False)
    result = running(monkeypatch, body)
    assert result.exit_code == code
    assert result.stdout == ""
    assert "Traceback" not in result.stderr


def test_a_bad_file_is_reported_fault_by_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    def body() -> None:
        raise FileError([Fault("first", "a.toml", 3, "x.y"), Fault("second", "a.toml", 5)])

    result = running(monkeypatch, body)
    assert result.stderr == "a.toml:3: x.y: first\na.toml:5: second\n"


def test_a_defect_is_one_line_unless_it_is_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def body() -> None:
        raise KeyError("gone")

    monkeypatch.delenv("WINCHKIT_DEBUG", raising=False)
    result = running(monkeypatch, body)
    assert result.stderr.count("\n") == 1
    assert "internal error: KeyError: 'gone'" in result.stderr
    assert "please report it" in result.stderr
    monkeypatch.setenv("WINCHKIT_DEBUG", "1")
    assert isinstance(running(monkeypatch, body).exception, KeyError)


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (PermissionError(13, "Permission denied", "runs/a.csv"), "runs/a.csv: cannot be used: "),
        (OSError(28, "No space left on device"), "standard output: cannot be used: "),
    ],
)
def test_a_refusal_of_the_operating_system_names_its_file(
    monkeypatch: pytest.MonkeyPatch, error: OSError, message: str
) -> None:
    def body() -> None:
        raise error

    monkeypatch.delenv("WINCHKIT_DEBUG", raising=False)
    result = running(monkeypatch, body)
    assert result.exit_code == 3
    assert result.stderr == f"{message}{error.strerror}\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full is of Linux")
def test_a_full_disk_below_standard_output_is_no_defect() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "winchkit", "effects"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=60,
        )
    assert done.returncode == 3
    assert done.stderr == "standard output: cannot be used: No space left on device\n"


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_an_interrupt_during_the_imports_is_one_line() -> None:
    code = (
        "import sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'winchkit.cli':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "from winchkit.__main__ import program\n"
        "program()"
    )
    done = python(code)
    assert done.returncode == 130
    assert done.stderr == "winchkit: interrupted\n"


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("chekc", "did you mean 'check'?"),
        ("page", "did you mean 'serve'?"),
        ("diagnos", "did you mean 'diagnose'?"),
    ],
)
def test_an_unknown_command_suggests_the_one_that_is_meant(word: str, meant: str) -> None:
    result = done(word, code=2)
    assert meant in result.stderr


@pytest.mark.parametrize(("value", "code"), [(None, 0), (3, 3), (True, 0), ("text", 0)])
def test_what_a_command_returns(monkeypatch: pytest.MonkeyPatch, value: object, code: int) -> None:
    assert running(monkeypatch, lambda: value).exit_code == code


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_interrupt_from_outside_is_130() -> None:
    code = (
        "import os, signal, click, winchkit.cli.files.check as check\n"
        "from winchkit.cli import main\n"
        "check.command = click.Command('check', callback=lambda: os.kill(os.getpid(), 2))\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "main(['check'])"
    )
    done = python(code)
    assert done.returncode == 130
    assert "Traceback" not in done.stderr
    assert int(signal.SIGINT) == 2


@pytest.mark.skipif(sys.platform == "win32", reason="pipes are POSIX")
def test_a_closed_pipe_is_quiet(tmp_path: Path) -> None:
    """As in ``winchkit check … | head -1``: the reader is gone before anything is printed."""
    file = tmp_path / "p.toml"
    file.write_text('schema = 1\nkind = "programme"\n[[step]]\nhold = "1 s"\n')
    reading, writing = os.pipe()
    os.close(reading)
    code = f"from winchkit.cli import main; main(['check', {str(file)!r}])"
    done = subprocess.run(
        [sys.executable, "-c", code], stdout=writing, stderr=subprocess.PIPE, check=False
    )
    os.close(writing)
    assert done.stderr == b""
    assert done.returncode != 0


def test_completion_knows_the_commands_without_importing_them() -> None:
    done = python(
        "from winchkit.cli import main; main(prog_name='winchkit')",
        _WINCHKIT_COMPLETE="bash_complete",
        COMP_WORDS="winchkit dia",
        COMP_CWORD="1",
    )
    assert done.stdout == "plain,diagnose\n"


def test_json_has_null_where_there_is_no_number() -> None:
    @dataclass(frozen=True)
    class Thing:
        path: Path
        colour: enum.Enum
        level: enum.IntEnum

    colour, level = enum.Enum("Colour", {"RED": "red"}), enum.IntEnum("Level", {"HIGH": 2})
    value = {
        "nan": float("nan"),
        "inf": np.float64("inf"),
        "array": np.array([[1.5, np.nan]]),
        "count": np.int64(4),
        "flag": np.bool_(True),
        "yes": True,
        "nothing": None,
        "thing": Thing(Path("a/b"), colour["RED"], level["HIGH"]),
        "set": {3, 1},
        "pair": (1, "x"),
        "day": datetime.date(2026, 11, 21),
        3: "key",
    }
    assert json.loads(to_json(value)) == {
        "nan": None,
        "inf": None,
        "array": [[1.5, None]],
        "count": 4,
        "flag": True,
        "yes": True,
        "nothing": None,
        "thing": {"path": "a/b", "colour": "red", "level": 2},
        "set": [1, 3],
        "pair": [1, "x"],
        "day": "2026-11-21",
        "3": "key",
    }
    with pytest.raises(TypeError, match="object has no form in JSON"):
        to_json(object())

"""Completion by the shell, and the environment variables of every option."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from command_line import done, own_process
from winchkit import catalog
from winchkit.cli import main

BENCH = 'schema = 1\nkind = "bench"\n[winch.left]\n[winch.right]\n[winch."a b"]\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "bench.toml").write_text(BENCH)
    (tmp_path / "lift.toml").write_text('schema = 1\nkind = "programme"\n')
    (tmp_path / "broken.toml").write_text('kind = "bench"\n[winch')
    effect = '[[effect]]\nid = "cell-gain"\n'
    (tmp_path / "mine.toml").write_text(f'schema = 1\nkind = "winch"\n{effect}')
    for name in ("lift-1.csv", "lift-2.mcap", "lift.txt"):
        (tmp_path / name).touch()
    (tmp_path / "deep").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def complete(line: str, **environment: str) -> list[str]:
    """What bash is offered at the end of a line."""
    words = {
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(line.split(" ")) - 1),
        "_WINCHKIT_COMPLETE": "bash_complete",
        **environment,
    }
    result = done(env=words, prog_name="winchkit")
    return [item.partition(",")[2] for item in result.stdout.splitlines() if item]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("winchkit mo", {"move", "monitor"}),
        ("winchkit config st", {"store"}),
        ("winchkit move -b be", {"bench.toml"}),
        ("winchkit move -b ", {"bench.toml", "broken.toml", "deep/"}),
        ("winchkit move -b bench.toml ", {"left", "right", "a b"}),
        ("winchkit move -b bench.toml r", {"right"}),
        ("winchkit move -b broken.toml ", set()),
        ("winchkit move -b none.toml ", set()),
        ("winchkit run l", {"lift.toml"}),
        ("winchkit busload be", {"bench.toml"}),
        ("winchkit info --device generic-cia402", {"generic-cia402"}),
        ("winchkit add cable-elongation-l", {"cable-elongation-linear"}),
        ("winchkit remove -p mine.toml ", {"cell-gain"}),
        ("winchkit compare -p bench-sp", {"bench-spiral"}),
        ("winchkit sim serve spiral", {"spiral-bench"}),
        ("winchkit diagnose l", {"lift-1.csv", "lift-2.mcap"}),
    ],
)
def test_what_a_shell_is_offered(line: str, offered: set[str]) -> None:
    assert set(complete(line)) == offered


@pytest.mark.usefixtures("folder")
def test_a_bench_in_the_environment_has_winches_too() -> None:
    assert set(complete("winchkit move ", WINCHKIT_MOVE_BENCH="bench.toml")) == {
        "left",
        "right",
        "a b",
    }
    assert "programme-demo" in complete("winchkit run pro")
    assert catalog.names("devices")[0] in complete("winchkit info --device ")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_each_shell(shell: str) -> None:
    result = done("completion", shell)
    assert f"_WINCHKIT_COMPLETE={shell}_complete" in result.stdout
    if shell == "bash":
        subprocess.run(["bash", "-n"], input=result.stdout, text=True, check=True)


@pytest.mark.usefixtures("folder")
@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_itself_completes() -> None:
    """With the script as a user evaluates it, and the function that it defines."""
    programs = str(Path(sys.executable).parent)
    line = (
        'eval "$(winchkit completion bash)" && COMP_WORDS=(winchkit ledger -p bench-sp) '
        '&& COMP_CWORD=3 && _winchkit_completion winchkit bench-sp -p && echo "${COMPREPLY[*]}"'
    )
    environment = {**os.environ, "PATH": programs + os.pathsep + os.environ["PATH"]}
    done = own_process("bash", "--norc", "-c", line, code=None, env=environment)
    assert done.stdout.split() == ["bench-spiral"], done.stderr


def test_an_unknown_shell() -> None:
    result = done("completion", "ksh", code=2)
    assert "'bash', 'zsh', 'fish'" in result.stderr


def every_option() -> Iterator[tuple[str, click.Option]]:
    """Each option of each command, with the command's words."""
    context = click.Context(main, info_name="winchkit", **main.context_settings)
    for name in main.table:
        command = main.get_command(context, name)
        assert command is not None
        yield from options_of(context, command, name)


def options_of(
    context: click.Context, command: click.Command, words: str
) -> Iterator[tuple[str, click.Option]]:
    for option in command.params:
        if isinstance(option, click.Option):
            yield words, option
    if isinstance(command, click.Group):
        inner = click.Context(command, parent=context, info_name=words.rpartition(" ")[2])
        for name in command.list_commands(inner):
            below = command.get_command(inner, name)
            assert below is not None
            yield from options_of(inner, below, f"{words} {name}")


def variable(words: str) -> str:
    return words.replace(" ", "_").replace("-", "_").upper()


def test_every_option_has_an_environment_variable() -> None:
    possible: dict[int, tuple[click.Option, list[list[str]]]] = {}
    for words, option in every_option():
        typed = [name[2:] for name in option.opts if name.startswith("--")]
        own = [variable(f"WINCHKIT_{words}_{name}") for name in typed]
        for_all = {"bench", "profile", "quiet", "verbose"}
        shared = [variable(f"WINCHKIT_{name}") for name in typed if name in for_all]
        # A command that stands in two groups has the name by which it was called first.
        possible.setdefault(id(option), (option, []))[1].append([*own, *shared])
    for option, names in possible.values():
        assert option.envvar in names, option.opts
    assert len(possible) > 60


def test_an_environment_variable_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WINCHKIT_CONFIG_SAVE_BENCH", "none.toml")
    result = done("config", "save", "A", "-o", "a.json", code=3)
    assert "none.toml: there is no such file" in result.stderr

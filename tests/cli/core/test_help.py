"""What all commands have in common: examples, ``-q``, ``-v``, one meaning of each letter, ``-``."""

from __future__ import annotations

import shlex
import sys
from collections import defaultdict
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from command_line import commands, done, examples, invoke
from winchkit.cli.core.command import LETTERS
from winchkit.cli.core.messages import suggest_next

NOT_RUN = {
    "needs a Dask scheduler",
    "needs a bench with a load cell",
    "needs a bench with a robot",
    "needs an index",
    "asks somebody beside the winch",
    "asks somebody to hang weights",
    "needs a CAN adapter",
    "serves until Ctrl-C",
    "takes half a minute; .ci/run executes it",
    "takes minutes; a test executes it with fewer poses",
    "needs a drive that is alone on its bus",
}
MOTION = 'schema = 1\nkind = "programme"\n[[step]]\nhold = "1 s"\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_command_has_two_examples() -> None:
    for words, command in commands():
        lines = [example.line for example in command.examples]
        assert len(lines) >= 2, words
        if not isinstance(command, click.Group) and "new" not in words:
            # One that is reached in two groups has the examples of one of them.
            assert all(line.startswith("winchkit ") for line in lines)
            assert any(words.split()[-1] in line.split() for line in lines), words


def test_examples_stand_in_the_help_as_one_line_each() -> None:
    for words, command in commands():
        shown = invoke(*words.split(), "--help").stdout.splitlines()
        at = shown.index("Examples:")
        assert shown[at + 1 :] == [f"  {example.line}" for example in command.examples], words


def test_every_example_can_be_parsed(folder: Path) -> None:
    """Also those that are not run, of which there are few, each with its reason."""
    for name in ("bench", "answers"):
        (folder / f"{name}.toml").write_text(f'schema = 1\nkind = "{name}"\n')
    known, not_run = dict(commands()), set()
    for words, example in examples():
        if not example.not_run:
            continue
        not_run.add(example.line)
        assert example.not_run in NOT_RUN
        rest = shlex.split(example.line)[1 + len(words.split()) :]
        known[words].make_context(words, rest)
    assert len(not_run) <= 20


def test_a_letter_means_one_thing() -> None:
    meanings = defaultdict(set)
    for words, command in commands():
        for param in command.get_params(click.Context(command, help_option_names=["-h", "--help"])):
            # click keeps the help option as the first call had it.
            if isinstance(param, click.Option) and "--help" not in param.opts:
                spelled = {name[2:] for name in param.opts if name.startswith("--")}
                for name in param.opts:
                    if not name.startswith("--"):
                        assert LETTERS[name[1:]] in spelled, f"{words}: {param.opts}"
                        meanings[name[1:]].add(LETTERS[name[1:]])
                # And what a letter means has its letter everywhere.
                for letter, meaning in LETTERS.items():
                    if meaning in spelled:
                        assert f"-{letter}" in param.opts, f"{words}: {param.opts}"
    assert set(meanings) | {"h"} == set(LETTERS)
    assert invoke("sim", "record", "-h").stdout == invoke("sim", "record", "--help").stdout


def test_a_letter_that_a_command_lacks_is_explained() -> None:
    result = done("sim", "record", "spiral-bench", "-p", "programme-demo", code=2)
    assert "'-p': it is --profile in every command" in result.stderr


def test_quiet_leaves_out_everything_but_results(folder: Path) -> None:
    (folder / "m.toml").write_text(MOTION)
    words = ("sim", "record", "spiral-bench", "m.toml", "--rate", "10 Hz", "--replace")
    told, quiet = invoke(*words), invoke(*words, "-q")
    assert told.stdout == quiet.stdout
    assert told.stderr == f"next: winchkit compare {told.stdout.strip()} -p bench-spiral\n"
    assert quiet.stderr == ""
    assert invoke("-q", *words).stderr == "", "as of the whole command line"
    assert invoke(*words, env={"WINCHKIT_QUIET": "1"}).stderr == ""
    assert "exclude each other" in invoke(*words, "-qv").stderr


def test_verbose_reports_what_was_read_and_how_long(folder: Path) -> None:
    (folder / "m.toml").write_text(MOTION)
    environment = {"WINCHKIT_SIM_RECORD_RATE": "10 Hz"}
    words = ("sim", "record", "spiral-bench", "m.toml", "--replace", "-v")
    lines = invoke(*words, env=environment).stderr.splitlines()
    reported = [line.partition(" s] ")[2] for line in lines if line.startswith("[")]
    assert reported[0] == "--rate 10 Hz by WINCHKIT_SIM_RECORD_RATE"
    assert "read m.toml: programme" in reported
    assert reported[-1].startswith("main sim record: 0.") or reported[-1].endswith("s in all")
    times = [float(line[1:].partition(" s]")[0]) for line in lines if line.startswith("[")]
    assert times == sorted(times)
    assert not [line for line in invoke(*words[:-1]).stderr.splitlines() if line.startswith("[")]


def test_no_suggestion_beside_json(folder: Path) -> None:
    (folder / "m.toml").write_text(MOTION)
    words = ("sim", "record", "spiral-bench", "m.toml", "--rate", "10 Hz", "--replace", "--json")
    assert invoke(*words).stderr == ""


@pytest.mark.parametrize(
    ("files", "shown"),
    [
        (["a 1.csv", "b.csv"], "'a 1.csv' b.csv"),
        (["run-1.csv", "run-2.csv", "run-3.csv"], "run-*.csv"),
        (["run-1.csv", "run-2.csv"], "run-1.csv run-2.csv"),
        (["deep/x1.csv", "deep/x2.csv", "deep/x3.csv"], "deep/x1.csv deep/x2.csv deep/x3.csv"),
        (["it's 1.csv", "it's 2.csv", "it's 3.csv"], "{}"),
    ],
)
def test_a_suggestion_can_be_copied(folder: Path, files: list[str], shown: str) -> None:
    (folder / "deep").mkdir()
    for name in ("run-1.csv", "run-2.csv", "run-3.csv", "deep/x4.csv", *files):
        (folder / name).touch()

    @click.command()
    def command() -> None:
        suggest_next("compare", files, "-p", "my profile.toml")

    said = CliRunner().invoke(command).stderr
    expected = shown.format(shlex.join(files))
    assert said == f"next: winchkit compare {expected} -p 'my profile.toml'\n"


def test_a_file_from_standard_input(folder: Path) -> None:
    assert "-: ok (programme" in invoke("check", "-", input=MOTION).stdout
    wrong = done("check", "-", input=MOTION.replace("hold", "hald"), code=3)
    assert "\n-:4: step[1].hald: unknown key; did you mean 'hold'?" in wrong.stderr
    (folder / "m.toml").write_text(MOTION)
    assert invoke("sim", "record", "spiral-bench", "m.toml", "--rate", "10 Hz").exit_code == 0
    [run] = folder.glob("*.csv")
    rows = run.read_bytes()
    assert "-: ok (run 'stdin'" in invoke("check", "-", input=rows).stdout
    assert invoke("export", "-", "-o", "x.mcap", input=rows).exit_code == 0
    assert "-: ok (run 'stdin'" in invoke("check", "-", input=Path("x.mcap").read_bytes()).stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("compare", "-", "-p", "-"), "which can be read once"),
        (("size", "-"), "standard input is empty"),
        (("move", "A", "--to", "1 m", "-b", "-"), "--bench -: this cannot come from standard"),
        (("check", "a.toml", "--effects", "-"), "--effects -: this cannot come from standard"),
        (("export", "a.csv", "-o", "-"), "--output -: this writes a file"),
        (("compare", "a.csv", "-p", "bench-spiral", "--html", "-"), "--html -: this writes"),
        (("undo", "-p", "-"), "is written to a file with -o"),
        (("log", "recover", "-"), "is saved to a file with -o"),
        (("run", "-", "-b", "bench.toml"), "give -y"),
        (("cell", "calibrate", "--points", "-"), "give -y"),
    ],
)
def test_where_standard_input_cannot_be(words: tuple[str, ...], message: str) -> None:
    text = "" if words[0] == "size" else MOTION.replace('hold = "1 s"', 'ask = "ready?"')
    result = done(*words, input=text, code=2)
    assert message in result.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="the copy is a file that is open")
def test_the_copy_of_standard_input_is_deleted(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    assert invoke("check", "-", input=MOTION).exit_code == 0
    assert list(folder.iterdir()) == []

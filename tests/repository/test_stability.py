"""docs/stability.md: the public names are those that were decided, and every command is a call."""

from __future__ import annotations

import difflib
import inspect
import re
import runpy
from collections.abc import Iterator

import click
import pytest

import winchkit
import winchkit.fleet
import winchkit.robot
from snippets import ROOT
from winchkit.bench.remote.client import RemoteStation
from winchkit.bench.winch import Winch
from winchkit.cli import main

PAGE = (ROOT / "docs/stability.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([^`]+)` \| (.+) \|$", PAGE.partition("## Commands and calls")[2], re.M)
CALL = re.compile(r"`([^`]+)`")
NAME = re.compile(r"(?<![\w.=\"])([A-Za-z_]\w*)(?=\()")
METHOD = re.compile(r"(attach\([^()]*\)|Winch|Bench|plan)\.(\w+)")
PUBLIC = {
    name: getattr(face, name)
    for face in (winchkit, winchkit.robot, winchkit.fleet)
    for name in face.__all__
}
OWNERS = {"Winch": Winch, "Bench": winchkit.Bench}


def test_public_names_and_signatures_are_those_of_the_committed_file() -> None:
    written = (ROOT / "docs/public_names.txt").read_text(encoding="utf-8")
    now = runpy.run_path(str(ROOT / "docs/make_signatures.py"))["text"]()
    changes = list(difflib.unified_diff(written.split("\n"), now.split("\n"), n=0, lineterm=""))
    assert not changes, "decide, note it in the changelog, run: python docs/make_signatures.py"


def test_a_changed_signature_is_noticed() -> None:
    script = runpy.run_path(str(ROOT / "docs/make_signatures.py"))

    def compare(runs: list[str], profile: str = "x", *, band: float | None = None) -> bool:
        return bool(runs and profile and band)

    (line,) = script["_described"]("compare", compare)
    shown = "compare(runs: list[str], profile: str = 'x', *, band: float | None = None) -> bool"
    assert line.strip() == shown
    assert line not in script["text"]()


def commands(group: click.Group, path: str = "") -> Iterator[str]:
    """Every command without commands below it, and those that do something by themselves."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        whole = f"{path}{name}"
        if not isinstance(command, click.Group):
            yield whole
            continue
        if command.invoke_without_command:
            yield whole
        yield from commands(command, f"{whole} ")


def test_the_table_has_every_command_and_no_other() -> None:
    assert isinstance(main, click.Group)
    listed = [name for name, _ in ROWS]
    assert len(listed) == len(set(listed))
    assert set(listed) == set(commands(main))


@pytest.mark.parametrize(("command", "calls"), ROWS, ids=[name for name, _ in ROWS])
def test_the_calls_of_a_command_exist_with_these_arguments(command: str, calls: str) -> None:
    code = CALL.findall(calls)
    assert code or command == "completion"
    for call in code:
        methods = METHOD.findall(call)
        for owner, method in methods:
            kind = OWNERS.get(owner) or (RemoteStation if owner.startswith("attach") else None)
            assert hasattr(kind or winchkit_plan(), method), call
        own = {method for _, method in methods}
        names = set(NAME.findall(call)) - own
        names |= {call} if re.fullmatch(r"\w+", call) else set()
        for name in names:
            assert name in PUBLIC, call


def winchkit_plan() -> type:
    from winchkit.diagnosis.plan import WinchPlan

    return WinchPlan


def test_calls_take_as_many_arguments_as_the_table_shows() -> None:
    for _, calls in ROWS:
        for call in CALL.findall(calls):
            found = re.fullmatch(r"(\w+)\(([^()]*)\)", call)
            if found is None or found[1] not in PUBLIC:
                continue
            function = PUBLIC[found[1]]
            given = [part.strip() for part in found[2].split(",") if part.strip()]
            names = {part.partition("=")[0]: None for part in given if "=" in part}
            plain = [None for part in given if "=" not in part]
            inspect.signature(function).bind(*plain, **names)

"""The wings: what loads none of their modules, and how another distribution adds one."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from math import sin
from pathlib import Path
from typing import ClassVar

import click
import pytest

from command_line import done, invoke, own_process
from snippets import ROOT
from winchkit import wings
from winchkit.cli import main
from winchkit.cli.model.options import declared_profile

_SEEN = (
    "import sys\nfound = [m for m in sys.modules if m.startswith(('winchkit.robot', "
    "'winchkit.fleet'))]\nassert not found, found\n"
)
_COMMAND = "from winchkit.cli import main\ntry:\n    main({words!r})\nexcept SystemExit as end:\n"


def loads_no_wing(code: str, folder: Path) -> None:
    words = [sys.executable, "-c", code + _SEEN]
    own_process(*words, cwd=folder)


def recorded(folder: Path) -> Path:
    rows = [f"{k * 0.02:.2f},{20 * sin(0.02 * k):.4f},{100 + k % 7},100" for k in range(600)]
    path = folder / "log.csv"
    path.write_text("\n".join(["time [s],motor_angle [rad],tension [N],load [N]", *rows, ""]))
    return path


@pytest.mark.parametrize("command", ["compare", "diagnose"])
def test_a_winch_loads_no_wing(command: str, tmp_path: Path) -> None:
    recorded(tmp_path)
    words = [command, "log.csv", "-p", str(ROOT / "profiles/bench-spiral.toml"), "--json"]
    loads_no_wing(_COMMAND.format(words=words) + "    assert not end.code, end.code\n", tmp_path)


def test_a_diagnosis_in_python_loads_no_wing(tmp_path: Path) -> None:
    recorded(tmp_path)
    code = (
        "import winchkit\nrun, profile = winchkit.read_run('log.csv'), "
        "winchkit.read_profile('bench-spiral')\nanswer = winchkit.diagnose([run], profile)\n"
        "answer.diagnosis.to_json()\n"
    )
    loads_no_wing(code, tmp_path)


def test_an_import_loads_no_wing(tmp_path: Path) -> None:
    rows = [f"{k * 0.02:.2f};{k % 300 * 5.7:.2f};{100 + k % 7}" for k in range(600)]
    (tmp_path / "other.csv").write_text("\n".join(["Zeit [s];Pos [deg];Kraft [N]", *rows, ""]))
    words = ["import", "other.csv", "-o", "out", "-y"]
    loads_no_wing(_COMMAND.format(words=words) + "    assert not end.code, end.code\n", tmp_path)
    assert list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("wing", list(wings.own()), ids=["robot", "fleet"])
def test_everything_that_a_wing_declares_is_there(wing: wings.Wing) -> None:
    calls = [place for functions in wing.calls.values() for place in functions.values()]
    for place in (*calls, *wing.kinds.values(), *wing.parts.values(), *wing.views):
        assert wings.imported(place) is not None


@dataclass(frozen=True)
class _Crane:
    wing: ClassVar[str] = "crane"
    boom: float


def crane_of(reading: object, tree: dict[str, float]) -> _Crane:
    return _Crane(**tree)


@click.command
def command() -> None:
    """Turn a crane."""


WING = wings.Wing(
    kinds={"crane": "wing_of_cranes:crane_of"},
    calls={"_Crane": {"compare": "builtins:len"}},
    commands={"Cranes": {"slew": ("wing_of_cranes", "Turn a crane.")}},
)
"""A wing of another distribution."""


@pytest.fixture
def crane(monkeypatch: pytest.MonkeyPatch) -> None:
    """An environment in which this module is declared as a wing."""
    sys.modules["wing_of_cranes"] = sys.modules[__name__]
    point = EntryPoint("crane", "wing_of_cranes:WING", "winchkit.wings")
    monkeypatch.setattr(
        "importlib.metadata.entry_points",
        lambda **chosen: [point] if chosen.get("name", "crane") == "crane" else [],
    )


@pytest.mark.usefixtures("crane")
def test_another_distribution_adds_a_kind_of_profile_and_a_command(tmp_path: Path) -> None:
    path = tmp_path / "crane.toml"
    path.write_text('schema = 1\nkind = "crane"\nboom = 12.0\n')
    declared = declared_profile(path)
    assert declared == _Crane(12.0)
    assert wings.call("compare", declared) is len
    assert wings.call("diagnose", declared) is None
    assert invoke("slew", "--help").exit_code == 0
    assert "slew" not in main.table


def test_a_command_that_no_wing_has_is_refused() -> None:
    done("slew", code=2)

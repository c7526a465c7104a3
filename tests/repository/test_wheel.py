"""The wheel: it builds, holds the declarations and the types, and works where it is installed."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZipFile

import pytest

from snippets import ROOT

pytestmark = pytest.mark.skipif(
    find_spec("hatchling") is None, reason="hatchling builds the wheel; it is in the extra 'dev'"
)


def python(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=250,
        **options,  # type: ignore[call-overload]
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    python(
        *("-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps"),
        *("--no-build-isolation", "--no-index", "--wheel-dir", str(folder), str(ROOT)),
    )
    (built,) = folder.glob("*.whl")
    return built


def test_it_holds_every_declaration_and_the_types(wheel: Path) -> None:
    inside = {name for name in ZipFile(wheel).namelist() if not name.endswith("/")}
    declared = {
        f"winchkit/_data/{path.relative_to(ROOT).as_posix()}"
        for folder in ("devices", "profiles", "sim")
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
    }
    sources = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "winchkit").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert "winchkit/py.typed" in sources
    assert inside >= declared | sources
    others = {name.split("/")[0] for name in inside - declared - sources}
    assert len(others) == 1
    assert next(iter(others)).endswith(".dist-info")


def test_it_works_where_it_is_installed(wheel: Path, tmp_path: Path) -> None:
    target = tmp_path / "installed"
    with ZipFile(wheel) as archive:
        archive.extractall(target)
    # Without site-packages' own path files the checkout itself cannot be found.
    code = (
        f"import sys; sys.path[:0] = [{str(target)!r}]; import winchkit; "
        f"assert winchkit.__file__.startswith({str(target)!r}), winchkit.__file__; "
        "from winchkit.cli import main; main()"
    )
    listed = python("-c", code, "sim", "list", cwd=tmp_path, env={**os.environ}).stdout
    for path in (ROOT / "sim").glob("demo-*.toml"):
        assert path.stem in listed
    python(
        *("-c", code, "sim", "record", "demo-elastic-rope", "-p", "programme-demo"),
        *("--rate", "5 Hz"),
        cwd=tmp_path,
    )
    assert len(list(tmp_path.glob("demo-*.csv"))) == 4

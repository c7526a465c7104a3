"""Wheel and sdist: they build, hold declarations and types, and work where they are installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
from importlib.util import find_spec
from pathlib import Path
from zipfile import ZipFile

import pytest

from command_line import own_process
from snippets import ROOT

pytestmark = pytest.mark.skipif(
    find_spec("hatchling") is None, reason="hatchling builds the wheel; it is in the extra 'dev'"
)


def python(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    return own_process(sys.executable, *arguments, **options)


VERSION = "7.8.9.dev1"
PIP_WHEEL = (
    *("-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps"),
    *("--no-build-isolation", "--no-index"),
)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy to build from: a build writes the version beside the code that other tests import."""
    folder = tmp_path_factory.mktemp("source") / "winchkit"
    left = shutil.ignore_patterns(".*", "__pycache__", "_version.py", "build", "dist", "site")
    shutil.copytree(ROOT, folder, ignore=left)
    shutil.copy(ROOT / ".gitignore", folder)
    return folder


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    tagged = {**os.environ, "SETUPTOOLS_SCM_PRETEND_VERSION": VERSION}
    python(*PIP_WHEEL, "--wheel-dir", str(folder), str(source), env=tagged)
    (built,) = folder.glob("*.whl")
    assert built.name.startswith(f"winchkit-{VERSION}-")
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
    sources.add("winchkit/_version.py")  # written by the build
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
        *("-c", code, "sim", "record", "demo-elastic-rope", "programme-demo"),
        *("--rate", "5 Hz"),
        cwd=tmp_path,
    )
    assert len(list(tmp_path.glob("demo-*.csv"))) == 4


def test_the_sdist_builds_the_same_wheel_without_git(
    wheel: Path, source: Path, tmp_path: Path
) -> None:
    tagged = {**os.environ, "SETUPTOOLS_SCM_PRETEND_VERSION": VERSION}
    python("-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path), cwd=source, env=tagged)
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    python(*PIP_WHEEL, "--wheel-dir", str(tmp_path), ".", cwd=unpacked)
    (again,) = tmp_path.glob("*.whl")
    assert again.name == wheel.name
    contents = [
        {name: ZipFile(built).read(name) for name in ZipFile(built).namelist()}
        for built in (wheel, again)
    ]
    assert contents[0] == contents[1]


def test_it_runs_in_a_new_environment(wheel: Path, tmp_path: Path) -> None:
    """Installed by pip with its dependencies, as by a user; skipped where pip cannot get them."""
    # This environment's pip installs into it, so that none has to be installed there first.
    python("-m", "venv", "--without-pip", str(tmp_path / "venv"))
    programs = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}

    def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        return own_process(
            str(programs / program), *arguments, code=None, cwd=tmp_path, env=environment
        )

    # Of all that is installed, a few modules are used.
    quick = ("-q", "--disable-pip-version-check", "--no-compile")
    there = ("--python", str(programs / "python"))
    installed = run(sys.executable, "-m", "pip", *there, "install", *quick, str(wheel))
    if "No matching distribution" in installed.stderr or "onnection" in installed.stderr:
        pytest.skip(f"pip cannot get the dependencies here: {installed.stderr[-200:]}")
    assert installed.returncode == 0, installed.stderr
    assert run("winchkit", "--version").stdout == f"winchkit, version {VERSION}\n"
    assert "drum-radius" in run("winchkit", "effects").stdout
    assert "demo-fat-drum" in run("winchkit", "sim", "list").stdout
    for declared in ("devices/laumas-tlb", "profiles/bench-spiral", "sim/programme-demo"):
        kind, name = declared.split("/")
        code = f"from winchkit import find; print(find({kind!r}, {name!r}))"
        path = run("python", "-c", code).stdout.strip()
        assert str(tmp_path) in path
        checked = run("winchkit", "check", path)
        assert checked.returncode == 0, checked.stdout + checked.stderr

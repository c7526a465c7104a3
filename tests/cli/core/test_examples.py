"""Every example in a command's help is executed, in a folder with the files that it names."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Iterator
from contextlib import chdir
from glob import glob
from importlib.util import find_spec
from pathlib import Path

import pytest

from calibration_cases import EXACT, rows
from can_commands import served, without_trip
from command_line import done, examples
from robot_poses.truth import csv
from winchkit import find, read_simbench
from winchkit.cli.core.command import Example

ROOT = Path(__file__).parents[3]
ON_BENCH = ("jog", "move", "home", "run", "stop", "reset", "monitor", "log")
ON_DRIVE = ("scan", "info", "config", "lss")
ON_CELL = ("cell",)
BENCHES = (*ON_BENCH, *ON_DRIVE, *ON_CELL, "tare")
WITHOUT_BENCH = (
    "log info",
    "log recover",
    "log replay",
    "log export",
    "log decode",
    "cell calibrate",
)
HAS_LIBRARY = all(find_spec(name) for name in ("pyarrow", "duckdb"))
INPUT = "quit\n"
"""What is typed: it ends ``sim serve``."""
POINTS = "load [kg],indicated [N]\n0,0.1\n5,49.3\n10,98.4\n5,49.2\n0,0.2\n"
CELL = "t [s],F [N]\n" + "".join(f"{0.01 * n:.2f},{98 + n % 5}\n" for n in range(400))
CANDUMP = "(1.000000) can0 701#7F\n(1.100000) can0 581#4B41600037060000\n"
TRC = """;$FILEVERSION=1.1
;$STARTTIME=45000.5
;
   1)     100.0  Rx     0581  8  4B 41 60 00 37 06 00 00
"""
EDS = """[DeviceInfo]
VendorName=x
[MandatoryObjects]
SupportedObjects=1
1=0x1000
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
"""
LOGGER = "t [s],pos [deg],torque [N m],F [N]\n" + "".join(
    f"{0.02 * n:.2f},{3.6 * n:.1f},{0.3 + 0.01 * (n % 7):.2f},{98 + n % 5}\n" for n in range(400)
)


PREPARED = (
    "winchkit sim record demo-elastic-rope programme-demo",
    "winchkit add cable-elongation-linear --fit demo-*.csv -p bench-spiral -o better.toml",
    "winchkit add motor-viscous --fit demo-*.csv -p better.toml -o both.toml",
    "winchkit export demo-10kg-1.csv -o lift.mcap",
    "winchkit import logger.csv -o imported -y --save-mapping mapping.toml",
    *(["winchkit library index ."] if HAS_LIBRARY else []),
)
"""What makes the files of the others; examples among them are executed here."""


def chosen(*groups: str) -> list[Example]:
    """Examples of these groups of commands that are executed; those of files for none."""
    found = {}
    for words, example in examples():
        on_bench = words.startswith(BENCHES) and not words.startswith(WITHOUT_BENCH)
        wanted = words.startswith(groups) if groups else True
        if wanted and on_bench is bool(groups) and not example.not_run:
            found[example.line] = example
    return list(found.values())


def of() -> list[object]:
    return [
        pytest.param(item, id=item.line.replace("/", "|"), marks=_marks(item))
        for item in chosen()
        if item.line not in PREPARED
    ]


def _marks(example: Example) -> list[pytest.MarkDecorator]:
    """Examples on a library's tables need the extra ``library``."""
    if HAS_LIBRARY or not example.line.startswith(("winchkit library", "winchkit fleet")):
        return []
    return [pytest.mark.skip(reason="needs the extra 'library'")]


def run(line: str, code: int = 0) -> None:
    """A line as a shell executes it, in this process; with a redirection by a shell."""
    before, _, redirected = line.partition(" < ")
    before, _, written = before.partition(" > ")
    words = [w for word in shlex.split(before)[1:] for w in (sorted(glob(word)) or [word])]
    typed = Path(redirected.strip()).read_text(encoding="utf-8") if redirected else INPUT
    result = done(*words, input=typed, code=code)
    if written:
        Path(written.strip()).write_text(result.stdout, encoding="utf-8")


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the examples name, made by the commands themselves."""
    folder = tmp_path_factory.mktemp("prepared")
    for name in ("short.toml", "winding-device.toml"):
        shutil.copy(ROOT / "examples" / name, folder)
    (folder / "logger.csv").write_text(LOGGER, encoding="utf-8")
    (folder / "points.csv").write_text(POINTS, encoding="utf-8")
    (folder / "cell.csv").write_text(CELL, encoding="utf-8")
    (folder / "candump.log").write_text(CANDUMP, encoding="utf-8")
    (folder / "bus.trc").write_text(TRC, encoding="utf-8")
    (folder / "drive.eds").write_text(EDS, encoding="utf-8")
    (folder / "poses.csv").write_text(csv(rows(50, 3)), encoding="utf-8")
    (folder / "more.csv").write_text(csv(rows(10, 99, noise=EXACT)), encoding="utf-8")
    with chdir(folder), served(folder, "A"):
        for line in PREPARED:
            run(line)
        Path("cut.mcap").write_bytes(Path("lift.mcap").read_bytes()[:-200])
    return folder


@pytest.fixture
def folder(prepared: Path, tmp_path: Path) -> Iterator[Path]:
    """A copy of it, in which a command is run."""
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    with chdir(tmp_path):
        yield tmp_path


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("example", of())
def test_examples_of_files(example: Example) -> None:
    if example.line.startswith("winchkit sim record"):
        for earlier in Path().glob("demo-*.csv"):
            earlier.unlink()
    run(example.line, example.exit_code)


def test_examples_that_move_in_simulated_time(folder: Path) -> None:
    with served(folder, "A") as bench:
        for example in chosen(*ON_BENCH):
            without_trip(bench)
            for earlier in (Path("lift.mcap"), *Path("runs").glob("*.csv")):
                earlier.unlink(missing_ok=True)
            run(example.line)


def test_examples_of_drives(folder: Path) -> None:
    with served(folder, "A", paced=True):
        run("winchkit config save A -o a.dcf")
        for example in chosen(*ON_DRIVE):
            if example.line.startswith("winchkit config save"):
                Path("a.dcf").unlink()
            run(example.line)


def test_examples_of_cells_in_simulated_time(folder: Path) -> None:
    with served(folder, bench=read_simbench(find("sim", "spiral-bench"))):
        for example in chosen(*ON_CELL):
            run(example.line)

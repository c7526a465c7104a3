"""The main command of every extra with default options, where the extra is installed.

``python benchmarks/compatibility.py --extras`` runs each in an environment of its own, with the
newest and with the oldest versions, where none of them may be skipped; of ``docs`` it is the site
(tests/repository/test_site.py), of ``dev`` the whole suite.
"""

from __future__ import annotations

import subprocess
import sys
import urllib.request
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from command_line import own_process
from winchkit import compare, read_profile, read_run
from winchkit.catalog import find

PROGRAMME = """\
schema = 1
kind = "programme"
name = "short"
repeat = 2
[[step]]
by = "-0.5 m"
speed = "0.5 m/s"
[[step]]
by = "0.5 m"
speed = "0.5 m/s"
"""


def needs(*modules: str) -> pytest.MarkDecorator:
    lost = [name for name in modules if find_spec(name) is None]
    return pytest.mark.skipif(bool(lost), reason=f"{', '.join(lost)}: an extra is not installed")


def winchkit(folder: Path, *words: str) -> str:
    done = own_process(
        sys.executable, "-W", "ignore::DeprecationWarning", "-m", "winchkit", *words, cwd=folder
    )
    assert "Traceback" not in done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two short runs of a simulated winch in ``runs/``."""
    folder = tmp_path_factory.mktemp("extras")
    (folder / "short.toml").write_text(PROGRAMME)
    winchkit(folder, "sim", "record", "demo-fat-drum", "short.toml", "--rate=50 Hz", "-o", "runs")
    return folder


@pytest.mark.parametrize(
    "suffix",
    [
        pytest.param("parquet", marks=needs("pyarrow"), id="parquet"),
        pytest.param("mf4", marks=needs("asammdf"), id="mf4"),
    ],
)
def test_export_and_compare(recorded: Path, suffix: str) -> None:
    first = f"runs/short-10kg-1.{suffix}"
    winchkit(recorded, "export", "runs/short-10kg-1.csv", "-o", first, "--replace")
    winchkit(recorded, "import", first, "--yes", "-o", f"from-{suffix}", "--replace")
    (again,) = (recorded / f"from-{suffix}").glob("*.csv")
    before, after = read_run(recorded / "runs/short-10kg-1.csv"), read_run(again)
    for name in ("motor_angle", "tension"):
        np.testing.assert_allclose(after.channels[name].values, before.channels[name].values)


def _xlsx(path: Path, columns: dict[str, np.ndarray]) -> None:
    from openpyxl import Workbook

    book = Workbook()
    book.active.append(list(columns))
    for row in zip(*columns.values(), strict=True):
        book.active.append([float(value) for value in row])
    book.save(path)


def _hdf5(path: Path, columns: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file[name] = values


def _tdms(path: Path, columns: dict[str, np.ndarray]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("log", n, v) for n, v in columns.items()])


def _ros2(path: Path, columns: dict[str, np.ndarray]) -> None:
    from mcap_ros2.writer import Writer

    time, angle, torque = columns.values()
    with path.open("wb") as file, Writer(file) as writer:
        schema = writer.register_msgdef(
            "sensor_msgs/msg/JointState", "string[] name\nfloat64[] position\nfloat64[] effort\n"
        )
        for t, a, m in zip(time, angle, torque, strict=True):
            stamp = int(t * 1e9)
            message = {"name": ["motor"], "position": [float(a)], "effort": [float(m)]}
            writer.write_message("/joint_states", schema, message, stamp, stamp)
        writer.finish()


@pytest.mark.parametrize(
    ("suffix", "write"),
    [
        pytest.param("xlsx", _xlsx, marks=needs("openpyxl"), id="xlsx"),
        pytest.param("h5", _hdf5, marks=needs("h5py"), id="hdf5"),
        pytest.param("tdms", _tdms, marks=needs("nptdms"), id="tdms"),
        pytest.param("mcap", _ros2, marks=needs("mcap_ros2"), id="ros2"),
    ],
)
def test_import(
    tmp_path: Path, suffix: str, write: Callable[[Path, dict[str, np.ndarray]], None]
) -> None:
    time = np.arange(100) * 0.01
    columns = {"time [s]": time, "motor angle [rad]": np.sin(time), "torque [N m]": 1 + time}
    write(tmp_path / f"log.{suffix}", columns)
    winchkit(tmp_path, "import", f"log.{suffix}", "--yes", "-o", "runs")
    run = read_run(tmp_path / "runs/log.csv")
    np.testing.assert_allclose(run.channels["motor_angle"].values, np.sin(time), atol=1e-12)
    np.testing.assert_allclose(run.channels["motor_torque"].values, 1 + time, atol=1e-12)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # as a program shows none
@needs("matplotlib")
def test_plot(recorded: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    figure = _compared(recorded).plot()
    figure.savefig(recorded / "compared.png")
    assert (recorded / "compared.png").read_bytes().startswith(b"\x89PNG")


@needs("pandas")
def test_pandas(recorded: Path) -> None:
    table = _compared(recorded).to_pandas()
    assert len(table)


def _compared(folder: Path) -> object:
    runs = [read_run(path) for path in sorted((folder / "runs").glob("*.csv"))]
    return compare(runs, read_profile(find("profiles", "bench-spiral")))


@needs("starlette", "uvicorn", "websockets")
def test_web(recorded: Path) -> None:
    command = [sys.executable, "-m", "winchkit", "serve", "runs/short-10kg-1.csv"]
    with subprocess.Popen(
        [*command, "-p", "bench-spiral", "--no-browser"],
        cwd=recorded,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        try:
            url = process.stdout.readline().strip()
            with urllib.request.urlopen(url, timeout=60) as page:
                assert b"<title>" in page.read()
        finally:
            process.terminate()


@needs("pyarrow", "duckdb")
def test_library(recorded: Path) -> None:
    winchkit(recorded, "library", "index", "runs", "-p", "bench-spiral")
    assert "short-10kg-2.csv" in winchkit(recorded, "library", "list", "runs")
    counted = winchkit(recorded, "library", "query", "runs", "select count(*) as n from runs")
    assert "2" in counted


@pytest.mark.slow
@needs("pyarrow", "duckdb", "distributed")
def test_cluster(recorded: Path) -> None:
    winchkit(recorded, "library", "index", "runs", "-p", "bench-spiral")
    said = winchkit(recorded, "fleet", "diagnose", "runs", "-p", "bench-spiral")
    assert "1 diagnosed, 0 unchanged, 0 failed" in said


@needs("numba")
def test_fast() -> None:
    from winchkit.robot import RobotCycle, fastest, flat_pose, read_robot, robot_of

    robot = robot_of(read_robot(find("profiles", "cabtive")))
    pose = flat_pose(robot.home)
    kernels = fastest()
    compiled = RobotCycle(robot, kernels).motor_angles(
        kernels.array(pose), kernels.array([0.0] * 8)
    )
    plain = RobotCycle(robot).motor_angles(pose, [0.0] * 8)
    np.testing.assert_allclose(compiled, plain, atol=1e-9)

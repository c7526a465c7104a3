"""``hold-tension`` and ``hold-platform``: their rehearsals, and what is not reached."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from command_line import invoke
from winchkit.catalog import find
from winchkit.errors import MotionError
from winchkit.robot.cli.hold_platform import _require_reached
from winchkit.schema.read import read_simbench
from winchkit.sim.live.bench_file import write_bench


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sim", "arguments"),
    [
        ("spiral-bench", ("hold-tension", "A", "120N")),
        ("winding-device-robot", ("hold-platform", "--preload", "1=550N,2=500N")),
        ("winding-device-robot", ("hold-platform", "--pose", "x=1mm")),
    ],
)
def test_a_rehearsal_has_cells_and_enables_the_drives(
    tmp_path: Path, sim: str, arguments: tuple[str, ...]
) -> None:
    spec = read_simbench(find("sim", sim)).bench
    file = tmp_path / "bench.toml"
    write_bench(replace(spec, cycle=0.02), file)
    done = invoke(*arguments, "-b", file, "--dry-run", "--json")
    assert done.exit_code == 0, done.output
    frames = json.loads(done.stdout)["frames"]
    assert {"RPDO", "SYNC"} <= {frame["kind"] for frame in frames}
    words = {frame["values"].get("6040h") for frame in frames if frame["kind"] == "RPDO"}
    assert 0x0F in words, "the drives are enabled"


def test_a_force_that_can_be_given_and_is_missing_is_an_error() -> None:
    held = {"force": {"1": 600.0, "2": 400.0}, "missing": {"1": -2.0, "2": 11.5}}
    with pytest.raises(MotionError, match=r"cable 2: \+11\.5 N are missing .* \(limit 5\.0 N\)"):
        _require_reached(held)
    _require_reached({**held, "missing": {"1": -2.0, "2": 4.9}})
    _require_reached({"force": None})

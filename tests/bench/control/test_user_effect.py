"""A user's own effects on a bench: named in its file, used in control, stopped when they fail."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from command_line import invoke
from fake_axis import Rig
from winchkit import open_bench
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.motion import PlannedMove
from winchkit.bench.control.snapshot import Phase
from winchkit.catalog import find
from winchkit.effects import load_catalogue, terms_of
from winchkit.errors import FileError
from winchkit.estimation.cable_state import CableEstimator, Sample
from winchkit.schema.bench import LimitSpec
from winchkit.schema.read import read_bench, read_profile, read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.bench_file import write_bench

OWN = """\
from winchkit.effects import Effect, Parameter
from winchkit.model.stages import Stage


def yields(length, at, values):
    return length + at.tension / values["stiffness"]


def shows(tension, at, values):
    return tension * (1 + values["share"])


WORDS = dict(what="Mine.", formula="f", source="me", looks_like="a line", told_apart="ask me")
SOFT = Effect(
    id="my-soft-frame", stage=Stage.FRAME, apply=yields, outputs=("cable_length",), **WORDS,
    parameters=(
        Parameter("stiffness", "N/m", null=float("inf"), typical=1e5, low=1e3, reciprocal=True),
    ),
)
CELL = Effect(
    id="my-gain", stage=Stage.CELL, apply=shows, outputs=("tension",), **WORDS,
    parameters=(Parameter("share", "1", null=0.0, typical=1e-2),),
)
"""
MINE = '[[effect]]\nid = "my-soft-frame"\nstiffness = "60 kN/m"\n'
GAIN = '[[effect]]\nid = "my-gain"\nshare = 0.05\n'
THEIRS = (
    '[[effect]]\nid = "frame-compliance"\nstiffness = "60 kN/m"\n'
    '[[effect]]\nid = "cell-gain"\ngain_error = 0.05\n'
)
SPIRAL = read_simbench(find("sim", "spiral-bench"))


def write(folder: Path, effects: str, own: str = OWN) -> tuple[Path, Path]:
    """A file of effects and a profile beside it."""
    file, profile = folder / "mine.py", folder / "better.toml"
    file.write_text(own)
    profile.write_text(find("profiles", "bench-spiral").read_text() + effects)
    return file, profile


def bench_file(folder: Path, profile: Path, line: str = "") -> Path:
    """A bench file with a line more on top."""
    wired = replace(SPIRAL.bench.winch["A"], profile=str(profile))
    path = write_bench(replace(SPIRAL.bench, winch={"A": wired}), folder / "bench.toml")
    path.write_text(f"{line}\n{path.read_text()}")
    return path


def rope_now(folder: Path, effects: str) -> CableEstimator:
    file, profile = write(folder, effects)
    declared = read_profile(profile)
    return CableEstimator(declared, terms_of(declared, load_catalogue([file])), 0.0)


def test_an_own_effect_moves_length_and_tension_as_one_of_the_catalogue_does(
    tmp_path: Path,
) -> None:
    own, theirs, bare = (rope_now(tmp_path, text) for text in (MINE + GAIN, THEIRS, ""))
    assert own.yields
    assert bare.trivial
    states = []
    for step in range(200):
        angle = 0.3 * step
        sample = Sample(0.02 * step, angle, 15.0, cell=210.0 + (step > 90) * 100.0)
        got, same, plain = own.update(sample), theirs.update(sample), bare.update(sample)
        states.append(got)
        assert got.length == pytest.approx(same.length, abs=1e-9)
        assert got.tension == pytest.approx(same.tension, abs=1e-6)
        assert got.length - plain.length == pytest.approx(got.tension / 60e3, abs=1e-9)
    assert states[-1].tension == pytest.approx(310.0 / 1.05, rel=3e-3)  # it is held to that


def test_a_bench_names_its_files_beside_it(tmp_path: Path) -> None:
    _, profile = write(tmp_path, MINE)
    path = bench_file(tmp_path, profile, 'effects = ["mine.py"]')
    spec = read_bench(path)
    assert spec.effects == ("mine.py",)
    assert spec.effect_files == (tmp_path / "mine.py",)
    assert invoke("check", path).exit_code == 0
    # Copied elsewhere, as a simulated bench is, it names the same file.
    (tmp_path / "elsewhere").mkdir()
    copied = read_bench(write_bench(spec, tmp_path / "elsewhere" / "copy.toml"))
    assert copied.effect_files == (tmp_path / "mine.py",)


def test_a_file_that_is_not_there_is_reported_with_its_line(tmp_path: Path) -> None:
    _, profile = write(tmp_path, MINE)
    path = bench_file(tmp_path, profile, 'effects = ["mine.py", "yours.py"]')
    with pytest.raises(FileError) as caught:
        read_bench(path)
    (fault,) = caught.value.faults
    assert (fault.path, fault.line) == (str(path), 1)
    assert fault.message.startswith(f"no such file of effects: {tmp_path / 'yours.py'}")


@pytest.mark.parametrize("command", [("move", "A", "--to", "2 m"), ("check",)])
def test_a_profile_with_an_unknown_effect_says_what_to_do(
    tmp_path: Path, command: tuple[str, ...]
) -> None:
    _, profile = write(tmp_path, MINE)
    path = bench_file(tmp_path, profile)
    done = invoke(*command, *(("-b",) if command[0] == "move" else ()), path)
    line = profile.read_text().splitlines().index('id = "my-soft-frame"')
    assert done.exit_code == 3
    assert f"{profile}:{line}: effect.id: no effect 'my-soft-frame'" in done.stderr
    assert '--effects FILE.py, or effects = ["FILE.py"]' in done.stderr


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return length + at.nothing", "mine.py:7: effect 'my-soft-frame': its function fails"),
        ("return None", "mine.py:5: effect 'my-soft-frame': its function gives nothing"),
        ("return 0.1", "its function gives values of shape () for values of shape (2,)"),
        ("return length * float('nan')", "the effects of the profile give no cable length (NaN)"),
    ],
    ids=["raises", "forgets to return", "a single number", "not a number"],
)
def test_an_effect_that_fails_under_way_ramps_the_winch_down(
    tmp_path: Path, body: str, said: str
) -> None:
    """It works until the winch moves fast; then all ramps down, and its place is reported."""
    own = OWN.replace(
        "def yields(length, at, values):\n",
        f"def yields(length, at, values):\n    if at.speed[-1] > 0.3:\n        {body}\n",
    )
    file, profile = write(tmp_path, MINE, own)
    declared = read_profile(profile)
    now = CableEstimator(declared, terms_of(declared, load_catalogue([file])), 0.0)
    limits = LimitSpec(0.6, 1.0, (0.5, 9.0))
    rig = Rig(limits, cable=CableMap.of(now))
    rig.controller().begin(PlannedMove(rig.cable(), limits, 2.0))
    rig.run(0.25)
    assert rig.axes["A"].velocity > 0
    assert rig.loop.failure is None
    rig.run(4.0)
    assert isinstance(rig.loop.failure, FileError)
    assert said in str(rig.loop.failure)
    assert rig.controller().phase is Phase.DISABLED
    assert rig.axes["A"].velocity == 0
    assert len(rig.axes["A"].words) > 900, "the loop goes on"


@pytest.mark.realtime
def test_a_winch_ends_where_the_own_effect_says(tmp_path: Path) -> None:
    """The frame yields by 60 kN/m: with an own effect as with the catalogue's, without not."""
    soft = read_simbench(find("sim", "soft-frame"))
    missed = {}
    for name, effects, files in (("bare", "", ()), ("own", MINE, (tmp_path / "mine.py",))):
        _, profile = write(tmp_path, effects)
        clock = SimulatedClock()
        with LiveBench(soft, simulated_time=clock) as live:
            wired = replace(live.bench_spec.winch["A"], profile=str(profile))
            spec = replace(live.bench_spec, winch={"A": wired})
            with open_bench(spec, clock, effect_files=files) as bench:
                bench.winch["A"].move_to(3.0, speed=0.4)
                with live.up_to_date():
                    missed[name] = live.winches["A"].plant.cable_length - 3.0
    assert missed["bare"] == pytest.approx(98.1 / 60e3, rel=0.1)
    assert abs(missed["own"]) < 0.1 * missed["bare"]

"""Commands that move, on simulated drives in simulated time: motions, stops, holds and dry runs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from can_commands import Served, length, served, without_trip
from command_line import done, invoke
from winchkit.bench.programme import earlier_runs
from winchkit.catalog import find
from winchkit.cli.core.dry_run import _simulated
from winchkit.errors import MotionError
from winchkit.robot.cli.hold_platform import _require_reached
from winchkit.schema.programme import Programme
from winchkit.schema.read import read_bench, read_simbench
from winchkit.sim.live.bench_file import write_bench


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("moving"), "AB") as found:
        yield found


@pytest.fixture
def bench(running: Served) -> Served:
    """The served bench, without a trip that another test has left latched."""
    return without_trip(running)


@pytest.mark.slow
def test_move_to_and_by(bench: Served) -> None:
    before = length(bench, "B")
    result = done("move", "A", "--to", "3.8 m", "--speed", "0.4 m/s", "-b", bench.file, "--json")
    assert length(bench) == pytest.approx(3.8, abs=5e-3)
    status = json.loads(result.stdout)
    assert status["winch"]["A"]["phase"] == "disabled"
    done("move", "A", "--pay-out", "0.1 m", "-b", bench.file)
    assert length(bench) == pytest.approx(3.9, abs=5e-3)
    assert length(bench, "B") == pytest.approx(before, abs=1e-3)


def test_move_all(bench: Served) -> None:
    done("move", "all", "--to", "3.7 m", "-b", bench.file)
    for winch in "AB":
        assert length(bench, winch) == pytest.approx(3.7, abs=5e-3)


REFUSED = {
    "move": [
        ("A", 2, "give one of --to, --pay-out and --wind-in"),
        ("A --to 1m --pay-out 1m", 2, "give one of"),
        ("A --pay-out 1m --wind-in 1m", 2, "opposite directions"),
        ("A --pay-out -50mm", 2, "must be above zero"),
        ("A --wind-in 0.1m/s", 2, "is a speed here and must be a length"),
        ("A --wind-in 3kg", 2, "is not a speed or a length"),
        ("A --to 1", 2, "has no unit"),
        ("--to 1m", 2, "no winch is given"),
        ("C --to 1m", 2, "no winch 'C'"),
        ("A --to 20m", 5, "is beyond the limits 0.5 m to 4.7 m"),
        ("A --to 3m --speed 2m/s", 5, "speed 2 m/s is not within"),
        ("A --to 3m --speed -1m/s", 5, "speed -1 m/s is not within"),
    ],
    "jog": [
        ("A --speed -0.1m/s --for 1s", 2, "--for needs --pay-out SPEED or --wind-in SPEED"),
        ("A --wind-in 0.1m/s", 2, "--wind-in SPEED needs --for TIME"),
        ("A --wind-in 50mm --for 1s", 2, "is a length here and must be a speed"),
        ("A --pay-out -0.1m/s --for 1s", 2, "must be above zero"),
        ("A --pay-out 0.1m/s --for 0s", 2, "no time to move in"),
        ("A --pay-out 50mm --speed -0.1m/s", 2, "--speed -0.1m/s: must be above zero"),
        ("A --pay-out 0.1m/s --for 1s --speed 1m/s", 2, "does not belong to --for"),
        ("A --pay-out 0.1m/s --wind-in 0.1m/s --for 1s", 2, "opposite directions"),
    ],
    "home": [
        ("A", 2, "give either --here LENGTH or --method NUMBER"),
        ("A --here 1m --at 1m", 2, "--at belongs to --method"),
        ("A --method 99", 4, "refused to write 99"),
        ("A --method 999", 2, "999 is not in the range"),
        ("A --method 34 --speed 3m/s", 5, "is not within its limit"),
    ],
}


@pytest.mark.parametrize(
    ("command", "arguments", "code", "words"),
    [(command, *row) for command, rows in REFUSED.items() for row in rows],
)
def test_what_cannot_be_meant_is_refused(
    bench: Served, command: str, arguments: str, code: int, words: str
) -> None:
    result = done(command, *arguments.split(), "-b", bench.file, code=code)
    assert words in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize("command", ["jog", "move"])
@pytest.mark.parametrize(("option", "sign"), [("--pay-out", 1), ("--wind-in", -1)])
def test_jog_and_move_agree_on_each_direction(
    bench: Served, command: str, option: str, sign: int
) -> None:
    before = length(bench)
    done(command, "A", option, "30mm", "--speed", "0.2 m/s", "-b", bench.file)
    assert length(bench) - before == pytest.approx(0.03 * sign, abs=3e-3)


def test_home_here_defines_the_length_and_moves_nothing(bench: Served) -> None:
    before = length(bench, "B")
    result = done("home", "B", "--here", "2.5 m", "-b", bench.file, "--json")
    shown = json.loads(result.stdout)["winch"]["B"]["cable_length"]
    assert shown == pytest.approx(2.5, abs=2e-3)
    assert length(bench, "B") == pytest.approx(before, abs=1e-3)
    # The drive keeps it: the bench, opened anew, still sees it, and a move sees it too.
    assert invoke("move", "B", "--wind-in", "0.1 m", "-b", bench.file).exit_code == 0
    assert length(bench, "B") == pytest.approx(before - 0.1, abs=0.01)


def test_home_by_the_index_finds_a_zero(bench: Served) -> None:
    result = done("home", "B", "--method", "34", "--at", "3 m", "-b", bench.file, "--json")
    status = json.loads(result.stdout)["winch"]["B"]
    assert status["phase"] == "disabled"
    assert status["cable_length"] == pytest.approx(3.0, abs=0.02)
    assert bench.live.winches["B"].drive.objects.number(0x6061) == 9, "back in its mode, CSV"


def test_a_homing_that_fails_leaves_the_drive_disabled_in_its_mode(bench: Served) -> None:
    """There is no limit switch on this winch to search for."""
    result = done("home", "A", "--method", "17", "-b", bench.file, code=5)
    assert "homing failed" in result.stderr
    objects = bench.live.winches["A"].drive.objects
    assert objects.number(0x6041) & 0x6F != 0x27
    assert objects.number(0x6061) == 9


def test_reset_clears_a_fault_and_enables_nothing(bench: Served) -> None:
    bench.live.inject("A.servo", "over-current")
    done("move", "A", "--pay-out", "0.1 m", "-b", bench.file, code=5)
    result = done("reset", "-b", bench.file)
    *cleared, last = result.stdout.splitlines()
    assert last == "reset: nothing is tripped"
    assert any("winch A: drive fault: error 2310h" in line for line in cleared)
    assert bench.live.winches["A"].drive.objects.number(0x6041) & 0x4F == 0x40
    assert invoke("move", "A", "--pay-out", "0.05 m", "-b", bench.file).exit_code == 0


def test_a_rehearsed_move_touches_no_drive(bench: Served) -> None:
    before = length(bench)
    result = done("move", "A", "--pay-out", "0.1 m", "-b", bench.file, "--dry-run", "--json")
    frames = json.loads(result.stdout)["frames"]
    words = [f["values"]["6040h"] for f in frames if f["kind"] == "RPDO" and f["node"] == 1]
    order = [word for word, last in zip(words, [None, *words], strict=False) if word != last]
    assert [word for word in order if word in (0x06, 0x07, 0x0F)] == [0x06, 0x07, 0x0F]
    assert order[-1] in (0x00, 0x02)
    others = {f["values"]["6040h"] for f in frames if f["kind"] == "RPDO" and f["node"] == 2}
    assert others <= {0x00, 0x02}, "B is never enabled"
    assert length(bench) == pytest.approx(before, abs=1e-4)
    assert bench.number(0x1016, 1) == 0


def test_a_rehearsal_in_words(bench: Served) -> None:
    shown = done("jog", "A", "--for", "0.2s", "--wind-in", "50mm/s", "-b", bench.file, "--dry-run")
    assert "winch A: 6040h Controlword 0Fh enable operation" in shown.stdout
    assert "dry run: nothing was sent" in shown.stderr
    stop = invoke("stop", "-b", bench.file, "--dry-run")
    assert stop.stdout.count("= 02h quick stop") == 2


def test_a_programme_is_rehearsed_move_by_move(bench: Served, tmp_path: Path) -> None:
    programme = tmp_path / "p.toml"
    programme.write_text(
        'schema = 1\nkind = "programme"\n[[step]]\nwinch = "all"\nby = "0.05 m"\n'
        'speed = "0.3 m/s"\n[[step]]\nhold = "30 s"\n'
    )
    shown = done("run", programme, "-b", bench.file, "-o", tmp_path / "runs", "--dry-run")
    assert "0Fh enable operation" in shown.stdout
    assert not (tmp_path / "runs").exists()


def test_earlier_runs_of_a_programme_are_not_written_over(bench: Served, tmp_path: Path) -> None:
    programme, runs = tmp_path / "p.toml", tmp_path / "runs"
    programme.write_text(
        'schema = 1\nkind = "programme"\nname = "tiny"\n'
        '[[step]]\nwinch = "all"\nby = "0.02 m"\nspeed = "0.2 m/s"\n'
    )
    runs.mkdir()
    for name in ("tiny-10kg-1.csv", "tiny-2b.csv", "tiny-1.mcap", "tinyer-1.csv", "mine.csv"):
        (runs / name).write_text("precious")
    assert [p.name for p in earlier_runs(Programme("tiny", ()), runs)] == [
        "tiny-10kg-1.csv",
        "tiny-2b.csv",
    ]
    refused = done("run", programme, "-b", bench.file, "-o", runs, code=2)
    assert "tiny-10kg-1.csv holds an earlier run of 'tiny'" in refused.stderr
    assert {path.read_text() for path in runs.iterdir()} == {"precious"}


def test_stop_says_in_json_who_has_confirmed(bench: Served) -> None:
    alone = done("stop", "-b", bench.file, "--json")
    told = {item["winch"]: item for item in json.loads(alone.stdout)["stopped"]}
    assert set(told) == {"A", "B"}
    assert all(item["confirmed"] for item in told.values())


@pytest.mark.parametrize(
    "arguments",
    [
        ("move", "C", "--to", "1 m"),
        ("jog", "C", "--pay-out", "10 mm"),
        ("home", "C", "--here", "1 m"),
        ("tare", "C"),
    ],
)
def test_a_wrong_winch_is_refused_before_its_bus_is_opened(
    tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    file = tmp_path / "bench.toml"
    file.write_text(
        'schema = 1\nkind = "bench"\nname = "away"\n'
        '[bus.can]\nkind = "can"\ninterface = "socketcan"\nchannel = "absent0"\n'
        '[winch.A]\nprofile = "bench-spiral"\n'
        'servo = { device = "generic-cia402", bus = "can", node = 1, encoder = "absolute" }\n'
        'limits = { speed = "0.1 m/s", acceleration = "0.1 m/s^2" }\n',
        encoding="utf-8",
    )
    result = done(*arguments, "-b", str(file), code=2)
    assert "no winch 'C'" in result.stderr


def test_a_dry_run_keeps_no_trip_and_shares_the_platform_among_the_winches(bench: Served) -> None:
    declared = read_bench(bench.file)
    assert declared.latch_file
    rehearsed = _simulated(declared, 0.4)
    assert rehearsed.bench.latch_file == ""
    loads = {name: one.load_mass or 0.4 for name, one in declared.winch.items()}
    assert {name: one.load_mass for name, one in rehearsed.truth.items()} == loads


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
    result = done(*arguments, "-b", file, "--dry-run", "--json")
    frames = json.loads(result.stdout)["frames"]
    assert {"RPDO", "SYNC"} <= {frame["kind"] for frame in frames}
    words = {frame["values"].get("6040h") for frame in frames if frame["kind"] == "RPDO"}
    assert 0x0F in words, "the drives are enabled"


def test_a_force_that_can_be_given_and_is_missing_is_an_error() -> None:
    held = {"force": {"1": 600.0, "2": 400.0}, "missing": {"1": -2.0, "2": 11.5}}
    with pytest.raises(MotionError, match=r"cable 2: \+11\.5 N are missing .* \(limit 5\.0 N\)"):
        _require_reached(held)
    _require_reached({**held, "missing": {"1": -2.0, "2": 4.9}})
    _require_reached({"force": None})

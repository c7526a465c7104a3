"""`winchkit commission` against the independent slave, and motion with and without its record."""

from __future__ import annotations

import io
import json
import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from rich.console import Console

from slave import Reactions, Slave, State
from slave_bench import ANSWERS, SlaveBench, served, write_bench
from winchkit.bench.bench import Bench
from winchkit.bench.commissioning import record
from winchkit.bench.commissioning.dialogue import AnswerFile
from winchkit.bench.commissioning.procedure import commission_bench
from winchkit.bench.commissioning.record import CommissioningRecord
from winchkit.bench.ownership import mark_stop
from winchkit.bench.remote.server import StationServer
from winchkit.cli.bench.commission import command
from winchkit.errors import MotionError, NotPermitted, UsageError


def commissioned(
    bench: SlaveBench, say: Callable[[str], None] = lambda _text: None
) -> CommissioningRecord:
    return commission_bench(bench.spec, AnswerFile(bench.answers, say), bench.clock)


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the virtual bus count as a real one."""
    monkeypatch.setattr(record, "_SIMULATED", ())


def test_motion_waits_for_the_record_and_ends_with_a_changed_drive(
    tmp_path: Path, real: None
) -> None:
    path = write_bench(tmp_path)
    (tmp_path / "answers.toml").write_text(
        ANSWERS.replace('try_in_motion = "no"', 'try_in_motion = "yes"')
    )
    with served(path) as bench:
        with bench.open() as opened:
            with pytest.raises(NotPermitted, match=r"no commissioning record.*winchkit commission"):
                opened.winch["A"].move_by(pay_out=0.01)
            assert bench.slave.power.state is State.SWITCH_ON_DISABLED
        said: list[str] = []
        record = commissioned(bench, said.append)
        text = json.loads(bench.record.read_text())
        assert text["by"] == "T. Ester"
        assert text["answers"].startswith("answers.toml sha256 ")
        winch = record.winch["A"]
        assert winch.drive.serial == 4711
        loss = winch.host_loss
        assert loss.mechanism == "heartbeat"
        assert loss.noticed_after is not None
        # From the last cycle; the last heartbeat was up to 0.1 s earlier.
        assert loss.stopped_after is not None
        assert 0.14 < loss.stopped_after < 0.25 + 0.01
        assert loss.stopped_moving_after is not None
        direction = next(one for one in winch.confirmed if one.item == "direction")
        assert direction.measured["commanded"] * direction.measured["moved"] > 0
        assert winch.stops_on_nmt
        assert {"brake", "host loss", "direction", "units", "limits"} <= winch.items
        assert any("did the motor make one turn" in line for line in said)
        with bench.open() as opened:
            assert opened.axes["A"].stops_on_nmt
            drive = opened.axes["A"].drive
            assert drive.host_loss.words.startswith("seen to stop")
            opened.winch["A"].move_by(pay_out=0.01)
    with (
        served(path, serial=4712) as other,
        other.open() as opened,
        pytest.raises(NotPermitted, match="serial number is 4712, commissioned was 4711"),
    ):
        opened.winch["A"].jog(pay_out=0.05, duration=0.2)


@pytest.mark.parametrize("key", ["A.brake", "A.host_loss", "A.direction_go", "A.units", "sign"])
def test_a_stop_ends_it_and_nothing_is_recorded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    """Given by somebody else while a question is open; the answer enables nothing."""
    with served(write_bench(tmp_path)) as bench:
        ask, begun = AnswerFile.ask, list[int]()

        def stopped(self: AnswerFile, now: str, *rest: Any) -> str:
            if now == key:
                mark_stop(bench.spec)
                begun.append(len(bench.rig.samples[0]))
            return ask(self, now, *rest)

        monkeypatch.setattr(AnswerFile, "ask", stopped)
        with pytest.raises(MotionError, match=r"a stop came while .* being commissioned"):
            commissioned(bench)
        assert not bench.record.exists()
        later = bench.rig.samples[0][begun[0] :]
        assert all(sample.state is not State.ENABLED for sample in later)


def test_a_drive_that_goes_on_when_the_host_dies_gets_no_record(tmp_path: Path) -> None:
    """It takes 1016h, sends EMCY 8130h, and stays enabled: only the trial shows it."""
    path = write_bench(tmp_path)
    with served(path) as bench:
        bench.slave.objects.entries.pop((0x6007, 0))
        bench.slave.objects.set(0x1029, 1, 0)
        bench.slave.power.lose_connection = lambda _code: None  # type: ignore[method-assign]
        with pytest.raises(NotPermitted, match=r"goes on moving: .*still 'operation enabled'"):
            commissioned(bench)
        assert not bench.record.exists()
        assert bench.slave.power.state is State.SWITCH_ON_DISABLED


def test_a_drive_that_minds_no_nmt_stopped_is_recorded_as_such(tmp_path: Path) -> None:
    path = write_bench(tmp_path)
    with served(path, reactions=Reactions(leaves_operational="none")) as bench:
        bench.slave.network.on_state = lambda _old, _new: None
        assert not commissioned(bench).winch["A"].stops_on_nmt


def test_a_negative_answer_is_not_permitted_and_a_missing_one_is_a_usage_error(
    tmp_path: Path,
) -> None:
    path = write_bench(tmp_path)
    with served(path) as bench:
        bench.answers.write_text(ANSWERS.replace('direction = "yes"', 'direction = "no"'))
        with pytest.raises(NotPermitted, match=r"answer was no: .*\(A\.direction\)"):
            commissioned(bench)
        bench.answers.write_text(ANSWERS.replace('units = "yes"', ""))
        with pytest.raises(UsageError, match=r"no answer 'A\.units'"):
            commissioned(bench)
        bench.answers.write_text(ANSWERS.replace('area = "yes"', 'area = "no"'))
        with pytest.raises(NotPermitted, match=r"answer was no: .*\(safety\.area\)"):
            commissioned(bench)
        assert not bench.record.exists()
        assert bench.slave.power.state is State.SWITCH_ON_DISABLED


def test_hardware_has_to_be_seen_stopping(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A relay that opens the enable input when no frame has come for a while; here by the test."""
    more = 'host_loss = "hardware"\nhost_loss_description = "watchdog relay K3"'
    path = write_bench(tmp_path, more=more)
    with served(path) as bench:
        relay = Relay(bench)
        bench.slave.watch = relay
        record = commissioned(bench)
        assert record.winch["A"].host_loss.hardware == "watchdog relay K3"
        assert record.winch["A"].host_loss.stopped_after is not None
        assert "what stops the winch then is watchdog relay K3" in capfd.readouterr().err
        with bench.open() as opened, opened.log(tmp_path / "a.csv"):
            opened.clock.sleep(0.1)
        assert "# host_loss.A: hardware: watchdog relay K3" in (tmp_path / "a.csv").read_text()


class Relay:
    """Opens the enable input where no SYNC has come for 0.3 s; SDO is no life sign to it."""

    def __init__(self, bench: SlaveBench) -> None:
        self._rig = bench.rig

    def __call__(self, slave: Slave) -> None:
        syncs = [at for at, frame in self._rig.frames[-2000:] if frame.identifier == 0x080]
        quiet = not syncs or self._rig.time - syncs[-1] > 0.3
        if quiet and not slave.power.inhibited:
            slave.power.drop()
        slave.power.inhibited = quiet


def test_another_thread_may_not_move_a_bench_that_is_being_commissioned(tmp_path: Path) -> None:
    path = write_bench(tmp_path)
    seen: list[NotPermitted] = []
    with (
        served(path) as bench,
        Bench(bench.spec, bench.clock, serve=StationServer, commissioning=True) as opened,
    ):

        def jog() -> None:
            try:
                opened.winch["A"].jog(pay_out=0.05)
            except NotPermitted as error:
                seen.append(error)

        other = threading.Thread(target=jog)
        other.start()
        other.join()
        assert "is being commissioned" in str(seen[0])


def test_the_command_says_where_the_record_is_and_a_closed_input_records_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_bench(tmp_path)
    with served(path) as bench:
        monkeypatch.setattr("winchkit.drivers.clock.MonotonicClock", lambda: bench.clock)
        ended = CliRunner().invoke(command, [str(path)], input="T. Ester\nyes\n")
        assert isinstance(ended.exception, NotPermitted)
        assert "without an answer to: Is everyone clear" in str(ended.exception)
        assert not bench.record.exists()
        done = CliRunner().invoke(command, [str(path), "--answers", str(bench.answers), "--json"])
        assert done.exit_code == 0, done.output
        assert json.loads(done.stdout)["winch"]["A"]["drive"]["serial"] == 4711


def test_check_and_monitor_say_which_item_is_missing(
    tmp_path: Path, real: None, capsys: pytest.CaptureFixture[str]
) -> None:
    from winchkit.bench.remote.station import LocalStation
    from winchkit.cli.bench.monitor import status_table
    from winchkit.cli.files.check import command as check

    path = write_bench(tmp_path)
    checked = CliRunner().invoke(check, [str(path)])
    assert checked.exit_code == 0
    assert "not commissioned: there is no commissioning record" in checked.stderr
    with served(path) as bench, bench.open() as opened:
        status = LocalStation(opened).status()
        assert "there is no commissioning record" in status["not_commissioned"]
        shown = Console(width=80, file=io.StringIO())
        shown.print(status_table(status))
        assert isinstance(shown.file, io.StringIO)
        assert "there is no commissioning record" in shown.file.getvalue().replace("\n", " ")


def test_a_brake_is_not_tried_on_a_drive_that_stays_enabled(tmp_path: Path) -> None:
    """The drive that does not take up its disabling holds the load itself."""
    path = write_bench(tmp_path)
    with served(path) as bench:
        power, take = bench.slave.power, bench.slave.power.take
        bench.answers.write_text(
            ANSWERS.replace('brake = "unloaded"', 'brake = "brake"\nbrake_held = "yes"')
        )

        stuck: list[float] = []

        def obstinate(word: int) -> None:
            if power.state is State.ENABLED and not word & 0x8:
                stuck.append(bench.rig.time)
            if not stuck or bench.rig.time > stuck[0] + 2.2:
                take(word)

        power.take = obstinate  # type: ignore[method-assign]
        with pytest.raises(NotPermitted, match=r"is 'operation enabled' and holds the load itself"):
            commissioned(bench)
        assert not bench.record.exists()
        assert bench.slave.power.state is State.SWITCH_ON_DISABLED


def test_the_trial_in_motion_needs_room_for_its_whole_way(tmp_path: Path) -> None:
    path = write_bench(tmp_path)
    path.write_text(path.read_text().replace('["0.5 m", "4.7 m"]', '["3.98 m", "4.7 m"]'))
    with served(path) as bench:
        bench.answers.write_text(ANSWERS.replace('try_in_motion = "no"', 'try_in_motion = "yes"'))
        before = bench.slave.motor.angle
        with pytest.raises(NotPermitted, match=r"below the limit 3\.98 m; pay out first"):
            commissioned(bench)
        assert bench.slave.motor.angle == pytest.approx(before, abs=1e-3)
        assert not bench.record.exists()


def test_a_device_file_that_changes_meanwhile_ends_in_no_record(tmp_path: Path) -> None:
    path = write_bench(tmp_path)
    with served(path) as bench:

        def edit(text: str) -> None:
            if "limits" in text:
                bench.device.write_text(bench.device.read_text() + "\n# edited\n")

        with pytest.raises(NotPermitted, match=r"device\.toml changed meanwhile"):
            commissioned(bench, edit)
        assert not bench.record.exists()


def test_an_answer_of_a_file_counts_in_any_case_as_a_typed_one(tmp_path: Path) -> None:
    path = tmp_path / "answers.toml"
    path.write_text('[A]\nbrake = "Unloaded"\nby = "Ann"\n', encoding="utf-8")
    answers = AnswerFile(path, lambda _text: None)
    assert answers.ask("A.brake", "?", ("unloaded", "brake")) == "unloaded"
    assert answers.ask("A.by", "?") == "Ann"
    with pytest.raises(UsageError, match="write pulled or right"):
        answers.ask("A.brake", "?", ("pulled", "right"))


@pytest.mark.parametrize("homed", [False, True])
def test_a_winch_with_an_incremental_encoder_is_commissioned_before_its_first_homing(
    tmp_path: Path, homed: bool
) -> None:
    """By short motions without a length; a length that is known outlives a commissioning."""
    path = write_bench(tmp_path)
    path.write_text(path.read_text().replace('encoder = "absolute"\n', ""))
    with served(path) as bench:
        if homed:
            with bench.open() as opened:
                opened.winch["A"].home(at=3.5)
        angle = bench.slave.motor.angle
        record = commissioned(bench)
        moved = {item.item: item.measured for item in record.winch["A"].confirmed}
        turned = (bench.slave.motor.angle - angle) / math.tau
        assert moved["units"]["turns"] == pytest.approx(-1.0 if turned < 0 else 1.0, abs=0.05)
        with bench.open() as opened:
            snapshot = opened.winch["A"].snapshot
            assert snapshot.length_known is homed
            if homed:
                way = (bench.slave.motor.angle - angle) * 2.96e-3
                assert snapshot.cable_length == pytest.approx(3.5 - way, abs=2e-3)


@pytest.mark.parametrize("ends", ["right", "refused"])
def test_the_record_of_positions_is_open_while_a_drive_is_enabled(
    tmp_path: Path, ends: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that begins after a kill finds what the killed one had written, and trips."""
    path = write_bench(tmp_path)
    record, killed = path.with_suffix(".position.json"), list[bytes]()
    (tmp_path / "answers.toml").write_text(
        ANSWERS.replace('try_in_motion = "no"', 'try_in_motion = "yes"')
    )
    ask = AnswerFile.ask

    def closed() -> bool:
        return bool(json.loads(record.read_bytes())["winch"]["A"]["closed"])

    def asked(self: AnswerFile, key: str, *rest: Any) -> str:
        if record.exists() and json.loads(record.read_bytes())["winch"]:
            assert closed(), f"no drive is enabled at the question {key}"
        if ends == "refused" and key == "A.host_loss":
            return "no"
        return ask(self, key, *rest)

    monkeypatch.setattr(AnswerFile, "ask", asked)
    with served(path) as bench:

        def watch(slave: Slave) -> None:
            if slave.power.state is State.ENABLED:
                assert not closed()
                killed[:] = [record.read_bytes()]

        bench.slave.watch = watch
        if ends == "right":
            commissioned(bench)
        else:
            with pytest.raises(NotPermitted):
                commissioned(bench)
        assert closed()
        bench.slave.watch = lambda _slave: None
        with bench.open() as opened:
            assert not opened.snapshot.tripped
        record.write_bytes(killed[0])
        with bench.open() as opened:
            (trip,) = opened.snapshot.tripped
            assert trip.kind == "owner"

"""Drives of makers' EDS files: each moves on a slave built from its file and minds a dead host.

The slave shares no code with winchkit. The files are not part of the project; the tests are skipped
where they are not at hand.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from drive_trial import moves, stopped
from makers_drafts import DRAFTS, FOLDER, completed_animatics, draft
from slave import Declared, Reactions, Slave
from slave.held_key import HeldKey
from slave.on_bus import SlavesOnBus
from slave.rig import Rig, bench_text
from winchkit import open_bench
from winchkit.cli.files.check import command
from winchkit.errors import NotPermitted

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the makers' files are not at hand")

_RPM = 0.10471975511965977
_STOPS = Reactions(leaves_operational="quick stop")
"""A drive without 6007h that stops when it leaves the state operational."""
SLAVES: dict[str, tuple[Declared, Reactions]] = {
    "zeroerr": (Declared(counts=524288), _STOPS),
    "maxon": (Declared(counts=2000, velocity_unit=_RPM, velocity_resolution=_RPM), Reactions()),
    "elmo": (Declared(counts=65536), Reactions()),
    "kria": (Declared(counts=4096, velocity_unit=_RPM, velocity_resolution=_RPM), _STOPS),
    "animatics": (Declared(counts=4000), Reactions()),
}
WAYS = [
    # drive, mechanism of its EDS
    ("zeroerr", "heartbeat"),
    ("zeroerr", "rpdo-timeout"),
    ("maxon", "heartbeat"),
    ("elmo", "heartbeat"),
    ("kria", "heartbeat"),
    ("kria", "rpdo-timeout"),
]
HARDWARE = """\
host_loss = "hardware"
host_loss_description = "a safety relay that the computer's watchdog output holds"
"""


def rig_of(folder: Path, name: str, eds: Path | None = None) -> Rig:
    declared, reactions = SLAVES[name]
    path = eds or FOLDER / DRAFTS[name][0]
    slave = Slave.from_file(path, 1, declared=declared, reactions=reactions)
    # Elmo's DCF limits it to 65535, in which no node number fits (node << 16); the drive takes it.
    if (consumer := slave.objects.entries.get((0x1016, 1))) is not None:
        consumer.high = None
    for ramp in (0x6084, 0x6085):
        slave.objects.declare(ramp, 0, 0x07, 50_000_000)
    return Rig(folder, [slave])


def checked(path: Path) -> tuple[int, str]:
    result = CliRunner().invoke(command, [str(path)])
    return result.exit_code, result.output


@pytest.mark.parametrize("name", ["zeroerr", "elmo"])
def test_the_loss_of_sync_is_proved_by_commissioning_only(tmp_path: Path, name: str) -> None:
    """At rest no drive shows that it minds: nothing moves without a commissioning record."""
    rig = rig_of(tmp_path, name)
    home = draft(tmp_path, name, servo='host_loss = "sync-loss"\n')
    text = bench_text(rig.channel, device=str(home))
    with rig.opened(text) as bench:
        key = HeldKey(rig, bench, pay_out=0.05).press()
        rig.wait(0.5)
        assert rig.slaves[0].motor.velocity == 0.0
        assert "not commissioned" in str(key.errors[0][1])
        key.release()


@pytest.mark.realtime
def test_a_drive_moves_with_guarding(tmp_path: Path) -> None:
    """Guarding needs remote frames, which the simulated bus does not carry: in real time."""
    declared, reactions = SLAVES["zeroerr"]
    slave = Slave.from_file(FOLDER / DRAFTS["zeroerr"][0], declared=declared, reactions=reactions)
    home = draft(tmp_path, "zeroerr", servo='host_loss = "guarding"\n')
    channel = f"guarded {tmp_path.name}"
    file = tmp_path / "bench.toml"
    file.write_text(bench_text(channel, device=str(home), heartbeat="100 ms"))
    with SlavesOnBus([slave], channel), open_bench(file) as bench:
        drive = bench.axes["A"].drive
        assert drive is not None
        assert drive.proof is not None
        bench.winch["A"].home(at=4.0)
        bench.winch["A"].move_by(pay_out=0.02)
        assert abs(slave.motor.angle) > 1.0
        assert bench.axes["A"].objects.read(0x1017) == 0, "one error control at a time"


@pytest.mark.parametrize(("name", "way"), WAYS)
def test_a_drive_moves_and_notices_a_dead_host(tmp_path: Path, name: str, way: str) -> None:
    rig = rig_of(tmp_path, name)
    home = draft(tmp_path, name, servo=f'host_loss = "{way}"\n')
    code, output = checked(home / "device.toml")
    assert code == 0, output
    text = bench_text(rig.channel, device=str(home))
    code, output = checked(rig.write_bench(text))
    assert code == 0, output
    assert f"winch A: if the computer falls silent, the drive notices it by {way}" in output
    moves(rig, text, stopped)


def test_a_drive_that_notices_nothing_is_refused(tmp_path: Path) -> None:
    """The EDS as it is has neither 6064h nor an RPDO: `check` says so."""
    home = draft(tmp_path, "animatics")
    code, output = checked(home / "device.toml")
    assert code == 3
    assert "6064h is not in the EDS" in output
    assert "rpdo 1 needs 1400h, which the EDS lacks" in output


def test_a_drive_that_notices_nothing_moves_with_hardware_that_stops_it(tmp_path: Path) -> None:
    """With what its EDS leaves out it could move, but no mechanism is there until one is named."""
    eds = completed_animatics(tmp_path)
    rig = rig_of(tmp_path, "animatics", eds)
    home = draft(tmp_path, "animatics", eds=eds)
    text = bench_text(rig.channel, device=str(home))
    code, output = checked(rig.write_bench(text))
    assert code == 3
    assert "no way to notice a dead host" in output
    with pytest.raises(NotPermitted), rig.opened(text):
        pass
    named = text.replace("brake = true\n", f"brake = true\n{HARDWARE}")
    code, output = checked(rig.write_bench(named))
    assert code == 0, output
    assert "winch A: if the computer falls silent, hardware stops the winch" in output
    moves(rig, named)


def test_the_page_on_an_unknown_drive_leads_to_a_jog(tmp_path: Path) -> None:
    """Its two files as they stand there, its checks, and a jog; only the channel is the rig's."""
    page = (Path(__file__).parents[2] / "docs/howto/drive.md").read_text(encoding="utf-8")
    device, bench = re.findall(r"^```toml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    home = tmp_path / "erob"
    home.mkdir()
    (home / "device.toml").write_text(device, encoding="utf-8")
    shutil.copy(FOLDER / "zeroerr-erob.eds", home)
    rig = rig_of(tmp_path, "zeroerr")
    text = bench.replace("socketcan", "virtual").replace("can0", rig.channel)
    shown = {
        home / "zeroerr-erob.eds": "erob/zeroerr-erob.eds",
        home / "device.toml": "erob/device.toml",
        rig.write_bench(text): "bench.toml",
    }
    for path, name in shown.items():
        expected = re.search(rf"^\$ winchkit check {name}\n(.*?)^```$", page, re.M | re.S)
        assert expected is not None
        code, output = checked(path)
        assert code == 0, output
        pieces = [" ".join(part.split()) for part in expected[1].split("...")]
        printed = " ".join(output.replace(str(path), name).split())
        for piece in pieces:
            for line in filter(None, piece.split("  ")):
                assert line.strip() in printed, line
    moves(rig, text, stopped)
    with rig.opened() as again:
        again.reset()  # the process before was killed
        winch, shaft = again.winch["A"], rig.slaves[0].motor.angle
        arm = winch.cable.at(winch.snapshot.motor_angle)[1]
        assert winch.cable_length == pytest.approx(2.0 - shaft * arm, abs=1e-3), "homed at 2 m"

"""A live simulated bench: real CAN frames, real Modbus, real time, one plant."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import canopen
import pytest
from pymodbus.client import ModbusTcpClient

from waiting import until
from winchkit.catalog import find
from winchkit.errors import ConnectionLost, DeviceRefused, FileError, NotPermitted, UsageError
from winchkit.schema.programme import ProgrammeStep
from winchkit.schema.read import read_bench, read_simbench
from winchkit.schema.simbench import FaultSpec, NoiseSpec, SimBench
from winchkit.sim.live import buses
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.client import address_file, answer, is_simulated, send
from winchkit.sim.live.control import ControlServer, obey

COUNT = 2 * 3.141592653589793 / 65536


pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def declared() -> SimBench:
    return replace(read_simbench(find("sim", "spiral-bench")), noise=NoiseSpec())


@pytest.fixture
def live(declared: SimBench) -> Iterator[LiveBench]:
    with LiveBench(declared, seed=1) as running:
        yield running


class Master:
    """canopen on the bench's own channel, and pymodbus at its port."""

    def __init__(self, live: LiveBench) -> None:
        bus = live.bench_spec.bus["can"]
        self.network = canopen.Network()
        self.network.connect(interface=bus.interface, channel=bus.channel)
        eds = find("devices", "generic-cia402").parent / "generic-cia402.eds"
        self.node: Any = self.network.add_node(1, str(eds))
        line = live.bench_spec.bus["instruments"]
        assert line.host is not None
        assert isinstance(line.port, int)
        self.modbus = ModbusTcpClient(line.host, port=line.port)
        assert self.modbus.connect()

    def close(self) -> None:
        self.modbus.close()
        self.network.disconnect()

    def tension(self) -> float:
        high, low = self.modbus.read_holding_registers(7, count=2, device_id=1).registers
        return float(high << 16 | low) * 0.01

    def length(self) -> float:
        registers = self.modbus.read_holding_registers(1, count=2, device_id=2).registers
        return float(struct.unpack(">i", struct.pack(">2H", *registers))[0]) * 1e-5

    def enable(self) -> None:
        self.node.sdo[0x6060].raw = 9
        for word in (0x06, 0x07, 0x0F):
            self.node.sdo[0x6040].raw = word


@pytest.fixture
def master(live: LiveBench) -> Iterator[Master]:
    found = Master(live)
    until(lambda: live.winches["A"].drive.state == 0x40)
    yield found
    found.close()


def test_the_written_wiring_is_the_one_in_use(live: LiveBench, tmp_path: Path) -> None:
    path = live.write_bench_file(tmp_path / "a b.toml")
    with pytest.raises(UsageError, match="exists already"):
        live.write_bench_file(path)
    read = read_bench(path)
    assert read == replace(live.bench_spec, path=read.path)
    assert read.bus["instruments"].port != 5020
    assert read.bus["can"].channel == live.bench_spec.bus["can"].channel


def test_a_profile_beside_the_declaration_is_found_from_elsewhere(tmp_path: Path) -> None:
    here = tmp_path / "here"
    here.mkdir()
    text = find("sim", "spiral-bench").read_text(encoding="utf-8")
    (here / "mine.toml").write_text(text.replace('"bench-spiral"', '"own.toml"'), encoding="utf-8")
    (here / "own.toml").write_bytes(find("profiles", "bench-spiral").read_bytes())
    with LiveBench(read_simbench(here / "mine.toml")) as live:
        path = live.write_bench_file(tmp_path / "bench.toml")
    assert read_bench(path).winch["A"].profile == str((here / "own.toml").resolve())


def test_what_turns_the_motor_moves_the_cable_and_the_instruments(
    live: LiveBench, master: Master
) -> None:
    before, angle = master.length(), master.node.sdo[0x6064].raw
    assert master.tension() == pytest.approx(98.07, abs=0.02)
    master.enable()
    master.node.sdo[0x60FF].raw = -500_000
    until(lambda: master.length() > before + 0.05)
    master.node.sdo[0x60FF].raw = 0
    until(lambda: abs(live.winches["A"].plant.motor_velocity) < 1e-3)
    until(lambda: master.length() == pytest.approx(live.winches["A"].plant.cable_length, abs=2e-5))
    turned = (master.node.sdo[0x6064].raw - angle) * COUNT
    paid_out = master.length() - before
    assert turned < 0
    assert paid_out == pytest.approx(-turned * 0.06 / 20.4, rel=0.02)
    torque = master.node.sdo[0x6077].raw * 2e-3
    assert torque == pytest.approx(98.07 * 0.06 / 20.4, rel=0.03)


def test_a_load_is_changed_at_rest_only(live: LiveBench, master: Master) -> None:
    live.answer(ProgrammeStep(ask="hang the 20 kg load", load_mass=20.0))
    until(lambda: master.tension() == pytest.approx(196.13, abs=0.02))
    master.enable()
    master.node.sdo[0x60FF].raw = -300_000
    until(lambda: live.winches["A"].plant.motor_velocity < -10)
    with pytest.raises(NotPermitted, match=r"winch A: its motor turns at"):
        live.hang("A", 10.0)
    with pytest.raises(UsageError, match=r"no winch 'B'.*it has A"):
        live.hang("B", 10.0)


def test_sync_brings_the_position_of_that_moment(live: LiveBench, master: Master) -> None:
    master.node.nmt.state = "OPERATIONAL"
    until(lambda: live.winches["A"].drive.nmt == 5)
    bus = live.bench_spec.bus["can"]
    with can.Bus(interface=bus.interface, channel=bus.channel) as listener:
        listener.set_filters([{"can_id": 0x181, "can_mask": 0x7FF}])
        for _ in range(20):
            master.network.sync.transmit()
        frames = [listener.recv(5.0) for _ in range(20)]
    assert all(frame is not None and len(frame.data) == 7 for frame in frames)


def test_faults_of_the_declaration_happen_at_their_time(declared: SimBench) -> None:
    faults = (FaultSpec(0.05, "over-current", "A.servo"), FaultSpec(0.02, "silence", "A.cell"))
    with LiveBench(replace(declared, fault=faults)) as live:
        until(lambda: live.winches["A"].drive.state == 0x08)
        assert live.winches["A"].drive.error_code == 0x2310
        assert "silence" in live.winches["A"].instruments["cell"].faults


def test_a_declared_fault_that_cannot_be_is_refused_before_anything_starts(
    declared: SimBench,
) -> None:
    for target, kind in (("A.servo", "overcurrent"), ("A.sell", "silence"), ("Q.servo", "reboot")):
        wrong = replace(declared, fault=(FaultSpec(1.0, kind, target),))
        with pytest.raises(UsageError), LiveBench(wrong):
            pass


def test_a_suspended_process_suspends_the_world(declared: SimBench) -> None:
    """A gap of a minute is no minute of falling, and the master did not fall silent."""
    skip = [0.0]
    with LiveBench(declared, clock=lambda: time.monotonic() + skip[0]) as live:
        with live.up_to_date():
            before = live.winches["A"].plant.time
        skip[0] = 60.0
        with live.up_to_date():
            after = live.winches["A"].plant.time
        assert after - before < 30


def test_seeds_give_the_noise(declared: SimBench) -> None:
    noisy = replace(declared, noise=NoiseSpec(tension=1.0))
    readings = []
    for seed in (4, 4, 5):
        live = LiveBench(noisy, seed=seed, clock=lambda: 0.0)
        with live:
            readings.append(live.winches["A"].plant.measure().tension)
    assert readings[0] == readings[1] != readings[2]


def test_hidden_physics_is_chosen_by_name(declared: SimBench) -> None:
    with LiveBench(declared, hidden=["fat drum"]) as live:
        specs = live.sim_bench.truth["A"].hidden
    assert [spec.physics for spec in specs] == ["fat drum"]
    with pytest.raises(FileError, match="elastic rope"):
        LiveBench(declared, hidden=["elastick rope"])


def test_temperature_is_the_true_one(live: LiveBench) -> None:
    assert live.temperature("A") == pytest.approx(20.0, abs=0.1)


def test_lines_are_obeyed_and_wrong_ones_explained(live: LiveBench) -> None:
    assert obey(live, "load A 32 kg") == "32 kg on A"
    assert live.winches["A"].plant.load_mass == 32
    obey(live, "load all 12 kg")
    assert "12 kg" in obey(live, "status")
    obey(live, "fault A.length frozen")
    assert live.winches["A"].instruments["length"].faults == {"frozen"}
    obey(live, "recover A.length")
    assert not live.winches["A"].instruments["length"].faults
    for line in ("lod A 3 kg", "load A 3 N", "load A", "load Z 3 kg", "fault A.servo fire", ""):
        with pytest.raises(UsageError):
            obey(live, line)


def test_another_process_finds_the_simulation_beside_its_bench_file(
    live: LiveBench, tmp_path: Path
) -> None:
    path = live.write_bench_file(tmp_path / "bench.toml")
    ended = []
    assert not is_simulated(path)
    with ControlServer(live, path, lambda: ended.append(True)):
        assert answer(path, ProgrammeStep(ask="hang it", load_mass=25.0))
        assert live.winches["A"].plant.load_mass == 25
        assert not answer(path, ProgrammeStep(ask="look at it"))
        with pytest.raises(DeviceRefused, match="unknown line 'dance'"):
            send(path, "dance")
        assert send(path, "quit") == "ending"
        assert ended
    assert not answer(path, ProgrammeStep(ask="hang it", load_mass=25.0))
    address_file(path).write_text("127.0.0.1:1\n", encoding="utf-8")
    with pytest.raises(ConnectionLost, match="sim serve"):
        send(path, "status")


def test_a_machine_without_a_multicast_route_gets_the_command_for_one(
    declared: SimBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(19, "No such device")

    monkeypatch.setattr(buses, "MulticastPort", refuse)
    with (
        pytest.raises(ConnectionLost, match=r"ip route add 239\.0\.0\.0/8 dev lo"),
        LiveBench(declared, interface="udp_multicast"),
    ):
        pass


def test_a_bus_that_dies_is_not_hidden(declared: SimBench, monkeypatch: pytest.MonkeyPatch) -> None:
    def unplugged(_timeout: float) -> None:
        raise can.CanOperationError("unplugged")

    def run() -> None:
        with LiveBench(declared) as live:
            monkeypatch.setattr(live._ports["can"]._bus, "receive", unplugged)
            until(live._loops[0].done)

    with pytest.raises(ConnectionLost, match="cannot receive: unplugged"):
        run()

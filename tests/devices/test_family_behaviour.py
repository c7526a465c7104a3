"""Every drive that has a device file: its simulated one moves, and in what the families differ."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from math import pi
from pathlib import Path

import pytest

from winchkit import catalog, open_bench
from winchkit.bench.control.snapshot import Phase
from winchkit.drivers.can.canopen.node import read_eds
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.servo import ServoSpec
from winchkit.schema.read import read_device, read_simbench
from winchkit.schema.simbench import NoiseSpec, SimBench
from winchkit.sim.drive.drive import SimDrive
from winchkit.sim.drive.object_dictionary import Abort, Entry, ObjectDictionary
from winchkit.sim.drive.object_dictionary import read_eds as read_for_simulation
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.paced_clock import PacedClock
from winchkit.sim.plant.servo import DriveCommand

VENDORS = {
    "generic-cia402": 0x0,
    "nanotec-pd4c": 0x26C,
    "maxon-epos4": 0xFB,
    "elmo-gold": 0x9A,
    "delta-asda-a2": 0x1DD,
    "delta-asda-a3": 0x1DD,
    "beckhoff-ax8000": 0x2,
    "ingenia-pluto": 0x29C,
}
BITS = {"PP": 0, "PV": 2, "PT": 3, "HM": 5, "IP": 6, "CSP": 7, "CSV": 8, "CST": 9}


class Wheel:
    """Turns as commanded."""

    motor_angle = motor_velocity = motor_torque = 0.0

    def advance(self, duration: float, command: DriveCommand) -> None:
        self.motor_velocity = command.speed if command.power else 0.0
        self.motor_angle += self.motor_velocity * duration

    def measure(self) -> Wheel:
        return self


class Bench:
    """A simulated drive of a device file, written to as an SDO client does."""

    def __init__(self, name: str) -> None:
        self.wheel = Wheel()
        self.frames: list[tuple[int, bytes]] = []
        self.objects = ObjectDictionary(read_for_simulation(eds_of(name), 1))
        self.drive = SimDrive(
            lambda identifier, data: self.frames.append((identifier, data)),
            1,
            servo_of(name),
            self.objects,
            self.wheel,
            brake=True,
        )
        self.drive.power_on(0.0, boot_time=0.0)
        self.now = 0.001
        self.drive.tick(self.now)

    def write(self, index: int, sub: int, value: int) -> Abort | None:
        entry = self.objects.entry((index, sub))
        assert isinstance(entry, Entry)
        return self.objects.write((index, sub), entry.pack(value))

    def run(self, duration: float) -> None:
        for _ in range(round(duration / 1e-3)):
            self.now += 1e-3
            self.drive.tick(self.now)

    def enable(self, mode: int) -> str:
        assert self.write(0x6060, 0, mode) is None
        for word in (0x06, 0x07, 0x0F):
            self.write(0x6040, 0, word)
        return self.drive.state.name


def device(name: str) -> DeviceSpec:
    return read_device(catalog.find("devices", name))


def servo_of(name: str) -> ServoSpec:
    servo = device(name).servo
    assert servo is not None
    return servo


def eds_of(name: str) -> Path:
    return catalog.find("devices", name).parent / servo_of(name).eds


@pytest.mark.parametrize("name", list(VENDORS))
def test_identity_and_modes_of_the_eds(name: str) -> None:
    dictionary, _ = read_eds(eds_of(name), 1)
    assert dictionary[0x1018][1].default == VENDORS[name]
    assert dictionary.device_information.vendor_number == VENDORS[name]
    assert dictionary.device_information.product_number == dictionary[0x1018][2].default
    assert dictionary[0x6502].default == sum(1 << BITS[mode] for mode in servo_of(name).modes)


@pytest.mark.parametrize("name", list(VENDORS))
def test_every_file_says_where_its_numbers_come_from(name: str) -> None:
    found = device(name)
    assert len(found.source) > 40
    assert found.trust == "generic"
    assert servo_of(name).motion_mode in servo_of(name).modes


@pytest.mark.parametrize("name", list(VENDORS))
def test_the_eds_has_what_a_winch_needs_watched(name: str) -> None:
    """Watchdog, option codes, limits: what winchkit checks or sets before it moves anything."""
    dictionary, _ = read_eds(eds_of(name), 1)
    for index in (0x1016, 0x1017, 0x6007, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E):
        assert index in dictionary, hex(index)
    for index in (0x6065, 0x6066, 0x6072, 0x607D, 0x6085, 0x60C2):
        assert index in dictionary, hex(index)
    assert dictionary[0x6007].default != 0
    for index in (0x605A, 0x605E):
        assert dictionary[index].default != 0


def test_nanotec_is_not_enabled_without_a_mode() -> None:
    assert Bench("nanotec-pd4c").enable(0) == "SWITCHED_ON"
    assert Bench("nanotec-pd4c").enable(9) == "OPERATION_ENABLED"
    assert Bench("elmo-gold").enable(0) == "OPERATION_ENABLED"


def test_delta_a2_takes_its_cycles_only_and_has_no_cyclic_modes() -> None:
    bench = Bench("delta-asda-a2")
    taken = [period for period in range(256) if bench.write(0x60C2, 1, period) is None]
    assert taken == list(range(1, 21))
    assert bench.write(0x60C2, 2, -3) is None
    assert bench.write(0x60C2, 2, -4) is Abort.RANGE
    for mode in (8, 9, 10):
        assert bench.write(0x6060, 0, mode) is Abort.RANGE


def test_delta_ramps_are_times_and_speeds_tenths_of_rpm() -> None:
    bench = Bench("delta-asda-a2")
    bench.write(0x6083, 0, 1000)
    bench.enable(3)
    bench.write(0x60FF, 0, 15_000)
    bench.run(0.25)
    assert bench.wheel.motor_velocity == pytest.approx(0.25 * 3000 * pi / 30, rel=0.01)
    bench.run(0.5)
    assert bench.wheel.motor_velocity == pytest.approx(1500 * pi / 30)


def test_delta_a3_watches_the_host_only_while_it_beats_itself() -> None:
    for own, watched in ((0, False), (100, True)):
        bench = Bench("delta-asda-a3")
        bench.write(0x1016, 1, 127 << 16 | 50)
        bench.write(0x1017, 0, own)
        bench.drive.receive(0x77F, b"\x05", bench.now)
        bench.run(0.2)
        lost = [data for identifier, data in bench.frames if identifier == 0x81]
        assert bool(lost) == watched


def test_beckhoff_takes_its_option_codes_only() -> None:
    bench = Bench("beckhoff-ax8000")
    for index, codes in ((0x605A, {-1, 2, 6}), (0x605E, {-2, -1, 0, 2})):
        taken = {code for code in range(-3, 9) if bench.write(index, 0, code) is None}
        assert taken == codes


@pytest.mark.parametrize(
    ("name", "per_turn"),
    [
        ("generic-cia402", 65536),
        ("nanotec-pd4c", 3600),
        ("maxon-epos4", 2000),
        ("elmo-gold", 65536),
        ("delta-asda-a2", 1_280_000),
        ("delta-asda-a3", 100_000),
        ("beckhoff-ax8000", 1 << 20),
        ("ingenia-pluto", 8192),
    ],
)
def test_a_turn_has_the_declared_positions(name: str, per_turn: int) -> None:
    bench = Bench(name)
    bench.wheel.motor_angle = 2 * pi
    bench.drive.receive(0x601, bytes((0x40, 0x64, 0x60, 0, 0, 0, 0, 0)), bench.now)
    answer = next(data for identifier, data in bench.frames if identifier == 0x581)
    assert int.from_bytes(answer[4:], "little") == per_turn


@pytest.mark.parametrize("name", list(VENDORS))
def test_a_slow_boot_is_as_slow_as_declared(name: str) -> None:
    bench = Bench(name)
    bench.frames.clear()
    bench.drive.inject("reboot")
    declared = servo_of(name).boot_time
    bench.run(0.7 * declared)
    assert not bench.frames
    bench.run(0.3 * declared)
    assert bench.frames[0] == (0x701, b"\0")


def declared_servo(name: str) -> ServoSpec | None:
    return read_device(catalog.find("devices", name)).servo


DRIVES = [name for name in catalog.names("devices") if declared_servo(name) is not None]


def bench_with(device: str) -> SimBench:
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    wiring = declared.bench.winch["A"]
    wiring = replace(wiring, servo=replace(wiring.servo, device=device))
    bench = replace(declared.bench, winch={"A": wiring})
    return replace(declared, bench=bench, noise=NoiseSpec(), fault=())


@pytest.fixture
def clock() -> PacedClock:
    return PacedClock()


@pytest.fixture
def live(request: pytest.FixtureRequest, clock: PacedClock) -> Iterator[LiveBench]:
    with LiveBench(bench_with(request.param), seed=3, clock=clock.simulation) as running:
        yield running


def test_there_are_the_families_of_a_winch_bench() -> None:
    assert len(DRIVES) >= 8
    makers = {read_device(catalog.find("devices", name)).maker for name in DRIVES}
    assert len(makers) >= 7


@pytest.mark.realtime
@pytest.mark.parametrize("live", DRIVES, indirect=True)
def test_its_simulated_drive_is_commissioned_and_jogged(live: LiveBench, clock: PacedClock) -> None:
    with open_bench(live.bench_spec, clock) as bench:
        bench.on_cycle(clock.control)
        winch = bench.winch["A"]
        start, plant = winch.cable_length, live.winches["A"].plant
        turned, wound = plant.motor_angle, plant.cable_length
        if not winch.snapshot.length_known:
            winch.home(at=wound)
            start = winch.cable_length
        winch.jog(wind_in=0.2, duration=0.5)
        assert winch.snapshot.phase is Phase.DISABLED
        gone = start - winch.cable_length
        # The ramp at its end makes up for that at its begin.
        assert gone == pytest.approx(0.2 * 0.5, abs=0.02)
        assert wound - plant.cable_length == pytest.approx(gone, abs=2e-3)
        assert plant.motor_angle - turned > 10.0
        snapshot = winch.snapshot
        assert math.isfinite(snapshot.cable_speed)
    assert abs(plant.motor_velocity) < 1e-3

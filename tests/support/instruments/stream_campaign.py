"""A campaign of random faults against one device; also run by benchmarks/fuzz_parsers.py."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

from stream_rig import Rig, device
from winchkit.drivers.reading import InstrumentReading

RAMP = 0.5
"""Of the truth, N/s: a value identifies its time."""
KINDS = (
    "silence",
    "late reply",
    "very late reply",
    "garbage",
    "bad checksum",
    "half line",
    "refusal",
    "overload",
    "sensor break",
    "unplug",
    "echo",
    "lost byte",
    "noise byte",
    "merged lines",
    "stalled host",
)
_UNGUARDED = ("mantracourt-dsc-ascii", "hx711-line", "generic-line")
"""No check sum and no fixed width: a number that lost a digit is a number. Not to be known."""
_CUTTING = ("half line", "lost byte")
_DIGIT = {"and-ad-4406": 0.0981, "mettler-mt-sics": 1e-4, "sartorius-sbi": 1e-4}


@dataclass
class Outcome:
    """What came of a campaign."""

    readings: int = 0
    wrong: list[str] = field(default_factory=list)
    counted: int = 0


class Wire:
    """Spoils what comes over it while a fault lasts."""

    def __init__(self, random: Random) -> None:
        self.random = random
        self.kind = ""
        self.held = b""

    def __call__(self, data: bytes) -> bytes:
        if self.kind != "stalled host":
            data, self.held = self.held + data, b""
        at = self.random.randrange(len(data))
        if self.kind == "lost byte":
            return data[:at] + data[at + 1 :]
        if self.kind == "noise byte":
            return data[:at] + self.random.choice([b"\xff", b"\x00", b"~", b"\x1b"]) + data[at:]
        if self.kind == "merged lines":
            return data.replace(b"\r", b"").replace(b"\n", b"")
        if self.kind == "stalled host":
            self.held += data
            if self.random.random() < 0.8:
                return b""
            data, self.held = self.held, b""
        return data


def campaign(name: str, random: Random, *, cases: int) -> Outcome:
    """Let faults come and go, several at once; wrong is what was not true when it says it was."""
    wire = Wire(random)
    rig = Rig(device(name), truth=_ramp, wire=wire, addresses=(1,))
    rig.run(1.0)
    outcome = Outcome()
    kinds = [kind for kind in KINDS if name not in _UNGUARDED or kind not in _CUTTING]
    for _ in range(cases):
        kind = random.choice(kinds)
        _begin(rig, wire, kind)
        readings = rig.run(random.uniform(0.05, 1.0))
        _end(rig, wire)
        readings += rig.run(random.uniform(0.3, 1.5))
        outcome.readings += len(readings)
        outcome.wrong += [f"{kind}: {one}" for one in readings if _is_wrong(name, one)]
    counts = rig.instrument.counters
    outcome.counted = (
        counts.timeouts + counts.crc + counts.malformed + counts.late + counts.resynchronised
    ) + counts.reconnects
    return outcome


def _begin(rig: Rig, wire: Wire, kind: str) -> None:
    wire.kind = kind
    if kind == "unplug":
        rig.plugged = False
    elif kind == "echo":
        rig.echo = True
    elif kind == "very late reply":
        rig.sim.reply_delay = 0.9 * max(rig.sim.spec.longest_reply, 0.2)
        rig.sim.inject("late reply")
    elif kind in ("silence", "late reply", "garbage", "bad checksum", "half line"):
        rig.sim.reply_delay = 0.5 * rig.sim.spec.longest_reply
        rig.sim.inject(kind)
    elif kind in ("refusal", "overload", "sensor break"):
        rig.sim.inject(kind)


def _end(rig: Rig, wire: Wire) -> None:
    wire.kind, rig.plugged, rig.echo = "", True, False
    rig.sim.inject("recover")


def _ramp(time: float) -> float:
    return RAMP * (time - 90.0)


def _is_wrong(name: str, one: InstrumentReading) -> bool:
    if not one.quality.usable:
        return one.value == one.value
    age = RAMP * (one.t_uncertainty + 3e-3)
    return abs(one.value - _ramp(one.t_sample)) > _DIGIT.get(name, 0.1) / 2 + age

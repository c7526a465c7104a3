"""What ``winchkit check`` says of this computer as one that a control loop runs on."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec

_SIMULATED = ("virtual", "udp_multicast")


def about_computer() -> tuple[str, ...]:
    """Everything that the control loop asks of this computer, a line each."""
    from winchkit.bench.control.computer import survey

    return tuple(f"{'ok' if item.granted else 'no'}  {item}" for item in survey())


def refusals(bench: BenchSpec) -> tuple[str, ...]:
    """Missing settings of this computer for the drives of a bench; none for simulated buses."""
    real = [
        bus
        for bus in bench.bus.values()
        if bus.kind == "can"
        and bus.interface not in _SIMULATED
        and not (bus.channel or "").startswith("vcan")
    ]
    if not real:
        return ()
    from winchkit.bench.control.computer import instrument_reading, survey

    items = list(survey())
    if any(bus.kind != "can" for bus in bench.bus.values()):
        scheduled = any(item.name == "scheduling" and item.granted for item in items)
        items.append(instrument_reading(scheduled=scheduled))
    return tuple(f"this computer, {item}" for item in items if not item.granted)

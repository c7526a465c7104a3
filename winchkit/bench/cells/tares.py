"""Tares and zeros of instruments: on the host, in a file beside the bench, or by the device."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from winchkit.bench.cells.desk import CellDesk, steady
from winchkit.bench.cells.instruments import tares_of
from winchkit.calibration.cell.files import tares_toml, write_text
from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.errors import NoReply, NotPermitted, UsageError
from winchkit.schema.calibration import HostTare, TareBook, tare_book_path

_CHECK = 0.3
"""s: an indicator's filter of some readings has settled, and a fast cell gives ten readings."""


def host_tare(desk: CellDesk, name: str, duration: float) -> dict[str, Any]:
    """Add the mean of the present value to the host's tare; raises NotPermitted, NoReply.

    It is kept beside the bench file; a bench without one keeps it until it is closed.
    """
    desk.permit(name)
    _refuse_temperature(name)
    seen = steady(desk.readings(name, duration))
    book = tares_of(desk.spec)
    value = seen.mean + desk.publisher(name).scale.tare
    taken = datetime.now(UTC).replace(microsecond=0)
    _keep(desk, book, {**book.tare, name: HostTare(value, seen.std, taken)})
    _apply(desk, name, value)
    after = steady(desk.readings(name, max(duration, _CHECK)))
    return {
        "before": seen.mean,
        "std": seen.std,
        "readings": seen.readings,
        "tare": value,
        "after": after.mean,
        "file": _book_path(desk),
    }


def clear_tare(desk: CellDesk, name: str) -> dict[str, Any]:
    """Take the host's tare of an instrument away; raises UsageError where it has none."""
    book, removed = tares_of(desk.spec), desk.publisher(name).scale.tare
    if name not in book.tare and not removed:
        raise UsageError(
            f"{name} has no tare of the host; a tare of the device itself, which `winchkit tare` "
            "sets where the device has one, is cleared by `winchkit cell tare --device --clear`"
        )
    desk.permit(name)
    _keep(desk, book, {other: tare for other, tare in book.tare.items() if other != name})
    _apply(desk, name, 0.0)
    return {"removed": removed, "file": _book_path(desk)}


def tares_now(desk: CellDesk, name: str) -> dict[str, Any]:
    """The tares of an instrument, for :func:`restore_tares`.

    ``device``: whether the device shows a net value, None where it does not say; ``host``: value,
    standard deviation and time of the host's tare, None without one.
    """
    kept, value = tares_of(desk.spec).tare.get(name), desk.publisher(name).scale.tare
    if kept is None and value:
        kept = HostTare(value)
    host = None
    if kept is not None:
        taken = None if kept.taken is None else kept.taken.isoformat()
        host = {"value": kept.value, "std": kept.std, "taken": taken}
    return {"device": desk.sensors[name].tared, "host": host}


def restore_tares(desk: CellDesk, name: str, before: Mapping[str, Any]) -> dict[str, Any]:
    """Restore the tares of :func:`tares_now`; raises NotPermitted where the device cannot."""
    desk.permit(name)
    if desk.device(name).commands.get("tare") is False:
        if before["device"]:
            raise NotPermitted(
                f"{name}: the device had a tare of its own before and keeps no earlier one; "
                "`winchkit cell tare --device --clear` shows the gross value"
            )
        desk.command(name, "gross")
    book, host = tares_of(desk.spec), before["host"]
    others = {other: tare for other, tare in book.tare.items() if other != name}
    if host is not None:
        taken = None if host["taken"] is None else datetime.fromisoformat(host["taken"])
        others[name] = HostTare(float(host["value"]), float(host["std"]), taken)
    if others != book.tare:
        _keep(desk, book, others)
    _apply(desk, name, 0.0 if host is None else float(host["value"]))
    return {}


def by_device(desk: CellDesk, name: str, duration: float, *, command: str) -> dict[str, Any]:
    """Send the device a volatile command; raises NotPermitted, NoReply, DeviceRefused."""
    desk.permit(name)
    before = steady(desk.readings(name, duration))
    desk.command(name, command)
    desk.clock.sleep(_CHECK)
    after = steady(desk.readings(name, duration))
    return {
        "before": before.mean,
        "std": before.std,
        "readings": before.readings,
        "after": after.mean,
        "host_tare": desk.publisher(name).scale.tare,
    }


def _keep(desk: CellDesk, book: TareBook, tares: dict[str, HostTare]) -> None:
    if (path := _book_path(desk)) is not None:
        write_text(path, tares_toml(TareBook(book.name, tares)))


def _book_path(desk: CellDesk) -> str | None:
    """Where tares are kept; None for a bench without a bench file."""
    return tare_book_path(desk.spec.path) if desk.spec.path else None


def _apply(desk: CellDesk, name: str, value: float) -> None:
    publisher = desk.publisher(name)
    publisher.scale = replace(publisher.scale, tare=value)


def _refuse_temperature(name: str) -> None:
    if name.endswith(".temperature"):
        raise UsageError(f"{name} is a thermometer; taring it makes no sense")


_POLL = 0.01
"""s: a reading of the fastest usual cell."""
_WITHIN = 2.0
"""s: an indicator waits for a stable load, usually 1 s, before it takes a tare."""
_SETTLING = 3
"""Readings that were requested after the command, before one counts."""


def await_device_tare(clock: Clock, winch: str, cell: Sensor) -> float:
    """Wait for readings after the tare; returns the tension, N. Raises NoReply if unconfirmed."""
    sent, seen, deadline = clock.now(), 0, clock.now() + _WITHIN
    last = sent
    while clock.now() < deadline:
        clock.sleep(_POLL)
        reading = cell.latest
        if reading is None or reading.t_request <= last:
            continue
        last, seen = reading.t_request, seen + 1
        if seen >= _SETTLING and cell.tared is not False and reading.quality.usable:
            return reading.value
    raise NoReply(
        f"winch {winch}: {cell.name} did not confirm the tare within {_WITHIN:g} s; "
        "check that the reading is stable and within the device's tare range"
    )

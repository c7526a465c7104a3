"""Commands of device files (tare, zero …): whether they may be sent, and their confirmation."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar

from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.errors import DeviceRefused, NotPermitted
from winchkit.schema.devices.modbus import StatusMeaning

_Any = TypeVar("_Any")


class _StatusCommand(Protocol):
    """A command whose execution the status of the device shows."""

    @property
    def comes(self) -> StatusMeaning | None: ...
    @property
    def goes(self) -> StatusMeaning | None: ...
    @property
    def within(self) -> float: ...
    @property
    def permanent(self) -> bool: ...


_Command = TypeVar("_Command", bound=_StatusCommand)


def declared_command(device: str, commands: Mapping[str, _Any], name: str) -> _Any:
    """The command of a device by its name; raises NotPermitted where there is none."""
    if name not in commands:
        known = ", ".join(commands) or "none"
        raise NotPermitted(f"{device} has no command '{name}'; its device file has {known}")
    return commands[name]


def permitted_command(
    device: str, commands: Mapping[str, _Command], name: str, *, may_store: bool
) -> _Command:
    """The same; NotPermitted also for one that writes the EEPROM where that is not allowed."""
    command = declared_command(device, commands, name)
    if command.permanent and not may_store:
        raise NotPermitted(
            f"{device}: '{name}' writes the device's EEPROM, which wears out; "
            f"`winchkit cell store --command {name}` does it on purpose"
        )
    return command


async def confirm(
    sensor: Sensor,
    name: str,
    command: _StatusCommand,
    has: Callable[[StatusMeaning], bool],
    *,
    sent: float,
    clock: Clock,
) -> None:
    """Wait for a status of after ``sent`` that the command is executed; raises DeviceRefused."""
    if command.comes is None and command.goes is None:
        return
    while clock.now() < sent + command.within:
        await asyncio.sleep(sensor.period / 2)
        reading = sensor.latest
        came = command.comes is None or has(command.comes)
        gone = command.goes is None or not has(command.goes)
        if reading is not None and reading.t_request > sent and came and gone:
            return
    wanted = f"'{command.comes}' to come" if command.comes else f"'{command.goes}' to go"
    raise DeviceRefused(
        f"{sensor.name} accepted the command '{name}' but did not confirm it within "
        f"{command.within:g} s: its status shows no sign of {wanted}; check that the reading is "
        "stable and within the device's range for it"
    )

"""Commands of a Modbus device file: sent, and confirmed by the status that must come or go."""

from __future__ import annotations

import asyncio

from winchkit.drivers.clock import Clock
from winchkit.drivers.modbus.client import ModbusClient
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.words import number_of, words_of
from winchkit.errors import DeviceRefused, NotPermitted
from winchkit.schema.devices.modbus import REGISTERS, CommandSpec, ReadBlock

__all__ = ["command_of", "confirm", "identity", "send"]


def command_of(instrument: Instrument, name: str) -> CommandSpec:
    """The command by its name; raises NotPermitted where there is none or it is not allowed."""
    commands = instrument.decoder.spec.command
    if name not in commands:
        known = ", ".join(commands) or "none"
        raise NotPermitted(
            f"{instrument.name} has no command '{name}'; its device file has {known}"
        )
    command = commands[name]
    if command.permanent and not instrument.may_store:
        raise NotPermitted(
            f"{instrument.name}: '{name}' writes the device's EEPROM, which wears out; "
            f"`winchkit cell store --command {name}` does it on purpose"
        )
    return command


async def send(client: ModbusClient, instrument: Instrument, command: CommandSpec) -> None:
    """Unlock and write; raises NoReply, DeviceRefused, ConnectionLost."""
    many = command.writes_many
    for step in command.unlock:
        await client.write(instrument.unit, step.register, [step.value], many=many)
    words = words_of(command.type, command.order, command.value)
    await client.write(instrument.unit, command.register, words, many=many)


async def confirm(instrument: Instrument, name: str, sent: float, clock: Clock) -> None:
    """Wait for readings whose status says that a command sent at ``sent`` is confirmed.

    Raises DeviceRefused where none says so in time.
    """
    command = instrument.decoder.spec.command[name]
    if command.comes is None and command.goes is None:
        return
    while clock.now() < sent + command.within:
        await asyncio.sleep(instrument.period / 2)
        reading = instrument.latest
        if reading is not None and reading.t_request > sent and _confirmed(instrument, command):
            return
    wanted = f"'{command.comes}' to come" if command.comes else f"'{command.goes}' to go"
    raise DeviceRefused(
        f"{instrument.name} accepted the command '{name}' but did not confirm it within "
        f"{command.within:g} s: its status shows no sign of {wanted}; check that the reading is "
        "stable and within the device's range for it"
    )


async def identity(client: ModbusClient, instrument: Instrument) -> dict[str, float]:
    """What a device says of itself, e.g. its serial number; raises as :func:`send`."""
    found: dict[str, float] = {}
    spec = instrument.decoder.spec
    for item in spec.identity:
        count = REGISTERS[item.type]
        block = ReadBlock(item.register, count, spec.read.function, fixed=True)
        words = await instrument.ask(client, block)
        number = number_of(
            item.type, item.order, dict(enumerate(words, item.register)), block.start
        )
        found[item.name] = number * item.scale
    return found


def _confirmed(instrument: Instrument, command: CommandSpec) -> bool:
    has, status = instrument.decoder.status.has, instrument.status
    came = command.comes is None or has(command.comes, status)
    return came and not (command.goes is not None and has(command.goes, status))

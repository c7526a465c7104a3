"""Writes of a Modbus device file's commands, and reads of the identity of a device."""

from __future__ import annotations

from winchkit.drivers.modbus.client import ModbusClient
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.words import number_of, words_of
from winchkit.schema.devices.modbus import REGISTERS, CommandSpec, ReadBlock


async def send(client: ModbusClient, instrument: Instrument, command: CommandSpec) -> None:
    """Unlock and write; raises NoReply, DeviceRefused, ConnectionLost."""
    many = command.writes_many
    for step in command.unlock:
        await client.write(instrument.unit, step.register, [step.value], many=many)
    words = words_of(command.type, command.order, command.value)
    await client.write(instrument.unit, command.register, words, many=many)


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

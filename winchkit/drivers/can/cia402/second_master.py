"""Commands to one drive that were not sent here: RPDOs, SDO writes, NMT, the host's heartbeat.

Reading by SDO changes nothing and does not count. Every SDO write does, whatever its object: a
maker's own object may command a motion, and one of the communication area end the supervision.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial

from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.nmt import command_text
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo_parameters import IDENTIFIER, INVALID, cob_id
from winchkit.drivers.can.cia402.state_machine import QUICK_STOP

_NMT, _SDO_REQUEST, _HEARTBEAT = 0x000, 0x600, 0x700
_FURTHER_SERVERS = range(0x1201, 0x1280)
_RPDOS = range(0x1400, 0x1600)
_DOWNLOAD, _BLOCK_DOWNLOAD = 1, 6
"""Command specifiers of requests (CiA 301); a block download begins where bit 0 is 0."""
_HEAD = 4
"""Bytes of an SDO request: command, index and sub-index."""
_CONTROL_WORD = 0x6040
"""Object (CiA 402) whose writes are counted."""
_QUICK_STOP = QUICK_STOP.to_bytes(2, "little")


class SecondMaster:
    """Commands to one drive from another master; no interface hands back what is sent from here."""

    def __init__(self, bus: CanBus, node: int, rpdos: Iterable[int], host: int) -> None:
        """Listen to the commands to ``node``; ``rpdos`` are the numbers of its RPDOs in use.

        ``host`` is the node number of this host: its heartbeat from elsewhere would keep the drive
        enabled after this program has ended.
        """
        self.heard = ""
        """The first command that was not sent here, in words; empty where there was none."""
        self.last_request = -math.inf
        """When somebody else last sent an SDO request of any kind, s."""
        self.control_words = 0
        """SDO writes of 6040h that somebody else has started so far."""
        self._bus, self._node = bus, node
        self._rpdos = set(rpdos)
        for number in self._rpdos:
            bus.on_foreign(cob_id("rpdo", number, node), partial(self._take_rpdo, number))
        bus.on_foreign(_SDO_REQUEST + node, self._take_sdo)
        bus.on_foreign(_NMT, self._take_nmt)
        bus.on_foreign(_HEARTBEAT + host, self._take_heartbeat)

    def hear_further_servers(self, node: SdoNode) -> None:
        """Listen to the drive's further SDO servers too; raises NoReply, DeviceRefused."""
        for record in _FURTHER_SERVERS:
            if record in node.dictionary:
                identifier = node.read_if_there(record, 1)
                if identifier is not None and not identifier & INVALID:
                    self._bus.on_foreign(identifier & IDENTIFIER, self._take_sdo)

    def hear_further_rpdos(self, node: SdoNode) -> None:
        """Listen to the RPDOs that could not be switched off; raises NoReply, DeviceRefused."""
        for record in _RPDOS:
            number = record - _RPDOS.start + 1
            if number in self._rpdos or record not in node.dictionary or node.writes(record, 1):
                continue
            identifier = node.read_if_there(record, 1)
            if identifier is not None and not identifier & INVALID:
                self._rpdos.add(number)
                self._bus.on_foreign(identifier & IDENTIFIER, partial(self._take_rpdo, number))

    def forget(self) -> None:
        """A reset has shown it."""
        self.heard = ""

    def _take_rpdo(self, number: int, data: bytes, _now: float) -> None:
        self._note(f"RPDO {number} to node {self._node} ({data.hex(' ')})")

    def _take_sdo(self, data: bytes, now: float) -> None:
        self.last_request = now
        if len(data) < _HEAD:
            return
        specifier = data[0] >> 5
        if specifier == _DOWNLOAD or (specifier == _BLOCK_DOWNLOAD and not data[0] & 1):
            index = int.from_bytes(data[1:3], "little")
            self.control_words += index == _CONTROL_WORD
            sub = f":{data[3]}" if data[3] else ""
            stops = index == _CONTROL_WORD and data[_HEAD : _HEAD + 2] == _QUICK_STOP
            what = ", a quick stop, as of a `winchkit stop` on the bus itself" if stops else ""
            sent = f"{data.hex(' ')}{what}"
            self._note(f"SDO write of {index:04X}h{sub} of node {self._node} ({sent})")

    def _take_nmt(self, data: bytes, _now: float) -> None:
        if len(data) > 1 and data[1] in (0, self._node):
            to = f"node {self._node}" if data[1] else "all nodes"
            self._note(f"NMT command {command_text(data[0])} to {to}")

    def _take_heartbeat(self, data: bytes, _now: float) -> None:
        self._note(f"heartbeat with the node number of this host ({data.hex(' ')})")

    def _note(self, words: str) -> None:
        if not self.heard:
            self.heard = words

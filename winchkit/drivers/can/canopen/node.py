"""SDO client of one CANopen node: typed reads and writes, one at a time, every answer checked."""

from __future__ import annotations

import configparser
import io
from collections.abc import Callable, Iterator
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import can
import canopen
from canopen.objectdictionary import ODVariable, datatypes
from canopen.objectdictionary import eds as _canopen_eds
from canopen.sdo import client as library

from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.bus.interface import queue_full
from winchkit.drivers.can.canopen.nmt import NmtState
from winchkit.drivers.can.canopen.pdo import MappedObject
from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import event_of, lock_of
from winchkit.errors import ConnectionLost, DeviceRefused, Fault, FileError, NoReply, NotPermitted
from winchkit.schema.eds.eds import read_eds_text

_SdoClient: Any = library.SdoClient
_OBJECT = slice(1, 4)
"""Bytes of an SDO frame with index and sub-index (CiA 301)."""
_STOPS = (b"\x40\x60\x00", b"\x41\x60\x00")
"""6040h and 6041h: stops by SDO ask for these too, beside this client; two answers say nothing."""
_REPLIES = {1: (3, 4), 2: (2, 4)}
"""Server's command specifiers that answer the client's: initiate download, upload; 4 is abort."""


def sdo_client(remote: canopen.RemoteNode, clock: Clock) -> Any:
    """Replace the SDO client of a node on a network by one that waits on a clock."""
    plain = remote.sdo
    remote.network.unsubscribe(plain.tx_cobid, plain.on_response)
    client = _WaitingSdoClient(plain.rx_cobid, plain.tx_cobid, remote.object_dictionary, clock)
    client.network = remote.network
    remote.sdo, remote.sdo_channels = client, [client]
    remote.network.subscribe(client.tx_cobid, client.on_response)
    return client


class _NoAnswer(canopen.SdoCommunicationError):
    """No answer within the time-out; ``after`` (s) where it came within the same time again."""

    def __init__(self, after: float | None) -> None:
        super().__init__("no answer")
        self.after = after


class _WaitingSdoClient(_SdoClient):  # type: ignore[misc]
    def __init__(self, request: int, reply: int, dictionary: Any, clock: Clock) -> None:
        super().__init__(request, reply, dictionary)
        self._clock = clock
        self._arrived = event_of(clock)
        self._open = self._answered = b""
        """Index and sub-index of the request under way, and of the one answered last."""
        self._replies: tuple[int, ...] = ()
        """Command specifiers of its answer; none where any answers, such as a segment."""
        self.answered_twice = 0
        """Answers to a request that was answered: of a second node, or to another client."""
        self.awaits_late = True
        """Whether an answer that missed its time is waited for, to say how late it comes."""

    def send_request(self, request: Any) -> None:
        self._arrived.clear()
        self._open, self._replies = bytes(request[_OBJECT]), _REPLIES.get(request[0] >> 5, ())
        super().send_request(request)

    def on_response(self, can_id: int, data: Any, timestamp: float) -> None:
        answer, replies = bytes(data[_OBJECT]), self._replies
        # A late answer to a stop by SDO, or one to another client, answers nothing of this one.
        other = bool(replies) and (answer != self._open or data[0] >> 5 not in replies)
        if answer == self._open and not other:
            self._open, self._answered, self._replies = b"", answer, ()
        elif answer == self._answered and answer not in _STOPS:
            self.answered_twice += 1
        if other:
            return
        super().on_response(can_id, data, timestamp)
        self._arrived.set()

    def read_response(self) -> Any:
        asked = self._clock.now()
        if not self._arrived.wait(self.RESPONSE_TIMEOUT):
            # Only a node that has answered before is waited for again: a dead one costs no more.
            waits = self._answered and self.awaits_late
            late = waits and self._arrived.wait(self.RESPONSE_TIMEOUT)
            raise _NoAnswer(self._clock.now() - asked if late else None)
        return super().read_response()


Value = int | float | str
"""Of an object: numbers, and texts."""

_SIGNED = {
    *(0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6007, 0x6060, 0x6061, 0x6062, 0x6064, 0x606B),
    *(0x606C, 0x6071, 0x6074, 0x6077, 0x6078, 0x607A, 0x607C, 0x607D, 0x6098, 0x60B0, 0x60B1),
    *(0x60B2, 0x60F4, 0x60FA, 0x60FF),
}
"""Objects that CiA 402-2 makes signed; some makers declare them unsigned in their EDS."""


class ObjectPort(Protocol):
    """Moves the bytes of objects; ``SdoNode`` is one."""

    def upload_if_there(self, index: int, sub: int = 0) -> bytes | None:
        """Bytes of an object; None where the device has none. Raises NoReply, DeviceRefused."""

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write the bytes of an object; raises NoReply, DeviceRefused."""


class Objects:
    """A port and the object dictionary by which its bytes are read."""

    def __init__(self, port: ObjectPort, dictionary: Any) -> None:
        """Take canopen's dictionary of an EDS."""
        self.port = port
        self.dictionary = dictionary

    def number(self, index: int, sub: int = 0) -> int | None:
        """An integer, signed as the dictionary says; None where the device has no such object."""
        data = self.port.upload_if_there(index, sub)
        if data is None:
            return None
        signed = is_signed(self.dictionary.get_variable(index, sub))
        return int.from_bytes(data, "little", signed=signed)

    def text(self, index: int, sub: int = 0) -> str:
        """A text; empty where the device has no such object."""
        data = self.port.upload_if_there(index, sub) or b""
        return data.split(b"\0")[0].decode("ascii", errors="replace").strip()

    def value(self, variable: ODVariable) -> Value | None:
        """Value of a declared object; None where the device has none, or of another size."""
        data = self.port.upload_if_there(variable.index, variable.subindex)
        if data is None or (variable.fixed_size and 8 * len(data) < len(variable)):
            return None
        raw = variable.decode_raw(data[: len(variable) // 8] if variable.fixed_size else data)
        return raw if isinstance(raw, int | float | str) else None

    def write(self, variable: ODVariable, value: Value) -> None:
        """Write a declared object; raises ValueError where the value does not fit its type."""
        self.port.download(variable.index, variable.subindex, variable.encode_raw(value))


def is_signed(variable: ODVariable | None) -> bool:
    """Whether the bits of an object are two's complement: by its type, or by CiA 402-2.

    Five of Roboteq's EDS files declare 60FFh UNSIGNED32; a negative speed is written to it as the
    two's complement of its size all the same.
    """
    if variable is None:
        return False
    if variable.data_type in datatypes.SIGNED_TYPES:
        return True
    return (
        variable.index in _SIGNED
        and variable.data_type in datatypes.UNSIGNED_TYPES
        and (variable.index != 0x607D or variable.subindex > 0)
    )


def variables(dictionary: Any) -> Iterator[ODVariable]:
    """Every object and sub-object of a dictionary, in order."""
    for index in sorted(dictionary):
        item = dictionary[index]
        if isinstance(item, ODVariable):
            yield item
        else:
            yield from (item[sub] for sub in sorted(item))


def object_name(index: int, sub: int = 0) -> str:
    """``6064h``, or ``607Dh:1``."""
    return f"{index:04X}h:{sub}" if sub else f"{index:04X}h"


ABSENT = frozenset({0x06020000, 0x06090011, 0x08000024})
"""SDO abort codes of an object or sub-index that does not exist, or has no data (CiA 301)."""
_TWICE = 3
"""Requests with two answers that are evidence of a second node: single ones are late answers."""
_SDO_REQUEST = 0x600
_FULL_TRIES, _FULL_PAUSE = 20, 0.005
"""How often, and after which pause (s), a full queue of the interface is tried again."""


def read_dictionary(path: Path, node: int) -> Any:
    """Object dictionary of an EDS or DCF; raises FileError. Its warnings are for ``check``."""
    return read_eds(path, node)[0]


class SdoNode:
    """A node's object dictionary over SDO. Safe to use from several threads."""

    def __init__(self, bus: CanBus, node: int, eds: Path) -> None:
        """Attach to ``node`` of an open bus; nothing is sent yet."""
        self.bus = bus
        self.node = node
        self.dictionary = read_dictionary(eds, node)
        remote = canopen.RemoteNode(node, self.dictionary)
        bus.network.add_node(remote)
        self._sdo = sdo_client(remote, bus.clock)
        self._sdo.RESPONSE_TIMEOUT = bus.sdo_timeout
        self._lock = lock_of(bus.clock)
        self.on_transfer: Callable[[], None] | None = None
        """Called after each transfer, answered or not."""
        self._other_client = False
        """Whether somebody else has sent this node an SDO request."""
        bus.on_foreign(_SDO_REQUEST + node, self._hear_other_client)

    def place(self, index: int, sub: int = 0) -> str:
        """How messages name an object."""
        variable = self.dictionary.get_variable(index, sub)
        name = f" ({variable.name})" if variable is not None else ""
        return f"bus '{self.bus.name}' node {self.node} {object_name(index, sub)}{name}"

    def read(self, index: int, sub: int = 0) -> int:
        """Value of an integer object; raises NoReply, DeviceRefused."""
        return self._number(index, sub, self.upload(index, sub))

    def probe(self, index: int) -> int:
        """Read from a node that may still boot, and then answers nothing; as :meth:`read`."""
        self._sdo.awaits_late = False
        try:
            return self.read(index)
        finally:
            self._sdo.awaits_late = True

    def upload(self, index: int, sub: int = 0) -> bytes:
        """Bytes of any object as the device sends them; raises NoReply, DeviceRefused."""
        with self._lock:
            try:
                return bytes(self._insist(lambda: self._sdo.upload(index, sub)))
            except canopen.SdoAbortedError as error:
                raise self._refused("read", index, sub, error) from error
            except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
                raise self._silent(index, sub, error) from error

    def read_if_there(self, index: int, sub: int = 0) -> int | None:
        """Value of an object that the device may lack; None where it does."""
        data = self.upload_if_there(index, sub)
        return None if data is None else self._number(index, sub, data)

    def upload_if_there(self, index: int, sub: int = 0) -> bytes | None:
        """Bytes of an object that the device may lack; None where it does."""
        try:
            return self.upload(index, sub)
        except DeviceRefused as error:
            cause = error.__cause__
            if isinstance(cause, canopen.SdoAbortedError) and cause.code in ABSENT:
                return None
            raise

    def write(self, index: int, sub: int, value: int) -> None:
        """Write an integer object; raises NoReply, DeviceRefused, NotPermitted for its range."""
        item = self._variable(index, sub, 4)
        try:
            data = value.to_bytes(item.bits // 8, "little", signed=value < 0 or item.signed)
        except OverflowError as error:
            raise NotPermitted(
                f"{self.place(index, sub)}: {value} does not fit into its {item.bits} bits"
            ) from error
        self.download(index, sub, data)

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write the bytes of any object; raises NoReply, DeviceRefused."""
        with self._lock:
            try:
                self._insist(lambda: self._sdo.download(index, sub, data))
            except canopen.SdoAbortedError as error:
                value = int.from_bytes(data, "little")
                raise self._refused(f"write {value} to", index, sub, error) from error
            except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
                raise self._silent(index, sub, error) from error

    def write_verified(self, index: int, sub: int, value: int) -> None:
        """Write, read back and compare; raises DeviceRefused when the device kept another value."""
        self.write(index, sub, value)
        self.verify(index, sub, value)

    def verify(self, index: int, sub: int, value: int) -> None:
        """Read a written value back; raises DeviceRefused when the device kept another value."""
        kept = self.read(index, sub)
        if kept != value:
            self.require_alone()
            raise DeviceRefused(
                f"{self.place(index, sub)}: wrote {value}, reads back {kept}; "
                "the device does not take this value"
            )

    def require_alone(self) -> None:
        """Raise DeviceRefused where requests so far were answered by two nodes of this number."""
        if error := self._duplicate():
            raise error

    def writes(self, index: int, sub: int) -> bool:
        """Whether the EDS lets the object be written; True where it does not know it."""
        variable = self.dictionary.get_variable(index, sub)
        return variable is None or bool(variable.writable)

    def mapped(self, index: int, sub: int) -> MappedObject:
        """The object as a PDO carries it; raises FileError when the EDS does not know it."""
        if self.dictionary.get_variable(index, sub) is None:
            raise FileError(f"{self.place(index, sub)}: not in the EDS, so it cannot be mapped")
        return self._variable(index, sub, 4)

    def _insist(self, transfer: Callable[[], Any]) -> Any:
        """Run a transfer; while the interface's queue is full, again after a pause."""
        try:
            for _ in range(_FULL_TRIES):
                try:
                    return transfer()
                except (can.CanError, OSError) as error:
                    if not queue_full(error):
                        raise
                    self.bus.clock.sleep(_FULL_PAUSE)
            return transfer()
        finally:
            if self.on_transfer is not None:
                self.on_transfer()

    def _number(self, index: int, sub: int, data: bytes) -> int:
        signed = self._variable(index, sub, len(data)).signed
        return int.from_bytes(data, "little", signed=signed)

    def _variable(self, index: int, sub: int, size: int) -> MappedObject:
        variable = self.dictionary.get_variable(index, sub)
        if variable is None:
            return MappedObject(index, sub, 8 * size, False)
        return MappedObject(index, sub, len(variable), is_signed(variable))

    def _hear_other_client(self, _data: bytes, _now: float) -> None:
        self._other_client = True

    def _duplicate(self) -> DeviceRefused | None:
        twice = self._sdo.answered_twice
        if twice < _TWICE or self._other_client:
            return None
        return DeviceRefused(
            f"bus '{self.bus.name}' node {self.node}: two nodes have this number: {twice} requests "
            "had two answers; switch one off and give it another"
        )

    def _refused(self, what: str, index: int, sub: int, error: Exception) -> DeviceRefused:
        return self._duplicate() or DeviceRefused(
            f"{self.place(index, sub)}: the device refused to {what} it: {error}"
        )

    def _silent(self, index: int, sub: int, error: Exception) -> ConnectionLost:
        if (duplicate := self._duplicate()) is not None:
            return duplicate
        longer = f"sdo_timeout in [bus.{self.bus.name}] of the bench file"
        if self._other_client and self._sdo.answered_twice:
            action = "another program asks this node by SDO at the same time; end it"
        elif self.bus.nmt_state(self.node) == NmtState.STOPPED:
            action = (
                "by its heartbeat it is NMT stopped, which ends SDO; look for another NMT master, "
                "then open the bench (winchkit monitor), which makes it pre-operational"
            )
        else:
            action = f"check power, wiring, bit rate and node id, and for a slow drive set {longer}"
        within = f"{self.place(index, sub)}: no answer within {self.bus.sdo_timeout:g} s"
        if not isinstance(error, _NoAnswer):
            return NoReply(f"{within} ({error}); {action}")
        if error.after is None:
            return NoReply(f"{within}; {action}")
        return NoReply(
            f"{within}; it came after {error.after:.2g} s: set {longer} to twice that, "
            f'"{2 * error.after:.2g} s"'
        )


def read_eds(path: Path, node: int) -> tuple[Any, tuple[Fault, ...]]:
    """Object dictionary of an EDS or DCF for a node id, with warnings; raises FileError."""
    eds = read_eds_text(path)
    try:
        return deepcopy(_imported(eds.text, node)), eds.warnings
    except (ValueError, KeyError, configparser.Error) as error:
        raise FileError(Fault(f"cannot be read as an EDS: {error}", str(path))) from error


@lru_cache(maxsize=32)
def _imported(text: str, node: int) -> Any:
    """Object dictionary of an EDS, which takes five times as long as its copy."""
    library: Any = _canopen_eds
    return library.import_eds(io.StringIO(text), node)

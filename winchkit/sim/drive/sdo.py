"""The SDO server of a simulated drive: expedited and segmented transfers of CiA 301."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from winchkit.sim.drive.object_dictionary import Abort, Key, ObjectDictionary

_DOWNLOAD_SEGMENT, _DOWNLOAD, _UPLOAD, _UPLOAD_SEGMENT, _ABORT = range(5)
_SEGMENT = 7
"""Data bytes in a segment (CiA 301)."""


@dataclass
class _SegmentedTransfer:
    """A segmented transfer in progress."""

    key: Key
    upload: bool
    data: bytes
    """Data to send, or received so far."""
    size: int | None = None
    """Size announced by the client."""
    toggle: int = 0


class SdoServer:
    """Answers requests one at a time; a new request ends a transfer in progress."""

    def __init__(self, objects: ObjectDictionary) -> None:
        self._objects = objects
        self._transfer: _SegmentedTransfer | None = None

    def reset(self) -> None:
        """Discard a transfer in progress."""
        self._transfer = None

    def answer(self, request: bytes) -> bytes | None:
        """Reply to a frame of eight bytes; None where CiA 301 requires no reply."""
        if len(request) != 8:
            return None
        command = request[0] >> 5
        if command == _DOWNLOAD_SEGMENT:
            return self._download_segment(request)
        if command == _UPLOAD_SEGMENT:
            return self._upload_segment(request)
        self._transfer = None
        return None if command == _ABORT else self._begin(command, request)

    def refuse(self, request: bytes) -> bytes | None:
        """Reply to any request with a general abort."""
        if len(request) != 8 or request[0] >> 5 == _ABORT:
            return None
        index, sub = struct.unpack_from("<HB", request, 1)
        return self._abort((index, sub), Abort.GENERAL)

    def _begin(self, command: int, request: bytes) -> bytes:
        index, sub = struct.unpack_from("<HB", request, 1)
        if command == _DOWNLOAD:
            return self._download((index, sub), request)
        if command == _UPLOAD:
            return self._upload((index, sub))
        return self._abort((index, sub), Abort.COMMAND)

    def _upload(self, key: Key) -> bytes:
        data = self._objects.read(key)
        if isinstance(data, Abort):
            return self._abort(key, data)
        if 1 <= len(data) <= 4:
            head = 0x43 | (4 - len(data)) << 2
            return struct.pack("<BHB", head, *key) + data.ljust(4, b"\0")
        self._transfer = _SegmentedTransfer(key, upload=True, data=data)
        return struct.pack("<BHBI", 0x41, *key, len(data))

    def _upload_segment(self, request: bytes) -> bytes:
        transfer = self._transfer
        if transfer is None or not transfer.upload:
            return self._abort((0, 0), Abort.COMMAND)
        if request[0] & 0x10 != transfer.toggle:
            return self._abort(transfer.key, Abort.TOGGLE)
        part, transfer.data = transfer.data[:_SEGMENT], transfer.data[_SEGMENT:]
        last = not transfer.data
        head = transfer.toggle | (_SEGMENT - len(part)) << 1 | last
        transfer.toggle ^= 0x10
        if last:
            self._transfer = None
        return bytes((head,)) + part.ljust(_SEGMENT, b"\0")

    def _download(self, key: Key, request: bytes) -> bytes:
        refused = self._objects.refusal(key)
        if refused is not None:
            return self._abort(key, refused)
        head = request[0]
        sized = bool(head & 1)
        if not head & 2:
            size = int.from_bytes(request[4:], "little") if sized else None
            self._transfer = _SegmentedTransfer(key, upload=False, data=b"", size=size)
            return struct.pack("<BHBI", 0x60, *key, 0)
        entry = self._objects.entry(key)
        declared = 4 if isinstance(entry, Abort) else entry.size or 4
        length = 4 - (head >> 2 & 3) if sized else declared
        return self._finish(key, request[4 : 4 + length], struct.pack("<BHBI", 0x60, *key, 0))

    def _download_segment(self, request: bytes) -> bytes:
        transfer = self._transfer
        if transfer is None or transfer.upload:
            return self._abort((0, 0), Abort.COMMAND)
        head = request[0]
        if head & 0x10 != transfer.toggle:
            return self._abort(transfer.key, Abort.TOGGLE)
        transfer.data += request[1 : 1 + _SEGMENT - (head >> 1 & 7)]
        reply = bytes((0x20 | transfer.toggle,)) + bytes(7)
        transfer.toggle ^= 0x10
        if not head & 1:
            return reply
        self._transfer = None
        if transfer.size is not None and transfer.size != len(transfer.data):
            return self._abort(transfer.key, Abort.LENGTH)
        return self._finish(transfer.key, transfer.data, reply)

    def _finish(self, key: Key, data: bytes, reply: bytes) -> bytes:
        refused = self._objects.write(key, data)
        return reply if refused is None else self._abort(key, refused)

    def _abort(self, key: Key, code: Abort) -> bytes:
        self._transfer = None
        return struct.pack("<BHBI", 0x80, *key, code)

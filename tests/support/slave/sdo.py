"""The SDO server of CiA 301: expedited and segmented transfers; block transfers are refused."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from slave.dictionary import Abort

_TOGGLE = 0x05030000
_COMMAND = 0x05040001
_LENGTH = 0x06070010


@dataclass
class _Transfer:
    """A segmented transfer under way."""

    index: int
    sub: int
    data: bytes
    toggle: int = 0
    downloads: bool = False


class SdoServer:
    """Answers one client; ``upload`` and ``download`` raise Abort."""

    def __init__(
        self, upload: Callable[[int, int], bytes], download: Callable[[int, int, bytes], None]
    ) -> None:
        self._upload, self._download = upload, download
        self._transfer: _Transfer | None = None

    def reset(self) -> None:
        """Forget a transfer under way."""
        self._transfer = None

    def answer(self, data: bytes) -> bytes | None:
        """The reply to a request of 8 bytes; None where the standard has none."""
        if len(data) != 8:
            return None
        command, index, sub = data[0], int.from_bytes(data[1:3], "little"), data[3]
        try:
            match command >> 5:
                case 0:
                    return self._download_segment(data)
                case 1:
                    return self._begin_download(command, index, sub, data[4:])
                case 2:
                    return self._begin_upload(index, sub)
                case 3:
                    return self._upload_segment(data)
                case 4:
                    self._transfer = None
                    return None
                case _:
                    return _abort(index, sub, _COMMAND)
        except Abort as abort:
            if command >> 5 in (0, 3) and self._transfer is not None:
                index, sub = self._transfer.index, self._transfer.sub
            self._transfer = None
            return _abort(index, sub, abort.code)

    def _begin_download(self, command: int, index: int, sub: int, data: bytes) -> bytes:
        if command & 0x02:
            unused = command >> 2 & 3 if command & 0x01 else 0
            self._download(index, sub, data[: 4 - unused])
        else:
            self._transfer = _Transfer(index, sub, b"", downloads=True)
        return struct.pack("<BHBI", 0x60, index, sub, 0)

    def _download_segment(self, data: bytes) -> bytes:
        transfer = self._under_way(data[0], downloads=True)
        transfer.data += data[1 : 8 - (data[0] >> 1 & 7)]
        reply = bytes((0x20 | transfer.toggle << 4,)) + bytes(7)
        transfer.toggle ^= 1
        if data[0] & 1:
            self._download(transfer.index, transfer.sub, transfer.data)
            self._transfer = None
        return reply

    def _begin_upload(self, index: int, sub: int) -> bytes:
        value = self._upload(index, sub)
        if 0 < len(value) <= 4:
            head = 0x43 | (4 - len(value)) << 2
            return struct.pack("<BHB", head, index, sub) + value.ljust(4, b"\0")
        self._transfer = _Transfer(index, sub, value)
        return struct.pack("<BHBI", 0x41, index, sub, len(value))

    def _upload_segment(self, data: bytes) -> bytes:
        transfer = self._under_way(data[0], downloads=False)
        part, transfer.data = transfer.data[:7], transfer.data[7:]
        last = not transfer.data
        head = transfer.toggle << 4 | (7 - len(part)) << 1 | int(last)
        transfer.toggle ^= 1
        if last:
            self._transfer = None
        return bytes((head,)) + part.ljust(7, b"\0")

    def _under_way(self, command: int, *, downloads: bool) -> _Transfer:
        transfer = self._transfer
        if transfer is None or transfer.downloads is not downloads:
            raise Abort(_COMMAND)
        if command >> 4 & 1 != transfer.toggle:
            raise Abort(_TOGGLE)
        return transfer


def _abort(index: int, sub: int, code: int) -> bytes:
    return struct.pack("<BHBI", 0x80, index, sub, code)

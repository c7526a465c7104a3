"""Layer setting services (CiA 305): give a node its number and its bit rate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import can
from canopen.lss import (
    CS_INQUIRE_PRODUCT_CODE,
    CS_INQUIRE_REVISION_NUMBER,
    CS_INQUIRE_SERIAL_NUMBER,
    CS_INQUIRE_VENDOR_ID,
    LssError,
    LssMaster,
)

from winchkit.drivers.can.bus.bus import Handler
from winchkit.drivers.can.canopen.identity import Identity
from winchkit.errors import DeviceRefused, NoReply, UsageError

BIT_RATES = {
    1_000_000: 0,
    800_000: 1,
    500_000: 2,
    250_000: 3,
    125_000: 4,
    50_000: 6,
    20_000: 7,
    10_000: 8,
}
"""Index of each bit rate in table 0 of the standard."""
UNCONFIGURED = 255
"""Node id of a device that has none."""

_REPLY = 0x7E4
"""COB-ID from LSS slave to master (CiA 305)."""
_SCAN_TIME = 0.05
"""For an answer in the fast scan, of which there are up to 133, s."""
_ANSWER_TIME = 0.5
"""s, as of an SDO request: a device that stores its node id writes a flash memory first."""
_INQUIRIES = (
    CS_INQUIRE_VENDOR_ID,
    CS_INQUIRE_PRODUCT_CODE,
    CS_INQUIRE_REVISION_NUMBER,
    CS_INQUIRE_SERIAL_NUMBER,
)
_REASONS = {"LSS Error: 1": "this value is inadmissible", "LSS Error: 2": "its memory is at fault"}


def check_node(node: int | None) -> None:
    """Raise UsageError for a number that is no node id; None is none to set."""
    if node is not None and not 1 <= node <= 127:
        raise UsageError(f"{node} is no node id; it is a whole number from 1 to 127")


def check_bitrate(bitrate: int | None) -> None:
    """Raise UsageError for a bit rate that the standard does not have; None is none to set."""
    if bitrate is not None and bitrate not in BIT_RATES:
        known = ", ".join(map(str, BIT_RATES))
        raise UsageError(f"{bitrate} bit/s is not in the standard's table: {known}")


class LssPort(Protocol):
    """What LSS needs of a bus; ``CanBus`` is one, a rehearsal another."""

    @property
    def name(self) -> str:
        """Of the bus."""

    @property
    def network(self) -> Any:
        """canopen's network, which has the LSS master."""

    def on(self, identifier: int, handler: Handler) -> None:
        """Call ``handler`` for every frame with this identifier."""


class LssLine:
    """The LSS master of a bus; one at a time."""

    def __init__(self, bus: LssPort) -> None:
        self._name = bus.name
        self._master: Any = bus.network.lss
        bus.on(_REPLY, lambda data, now: self._master.on_message_received(_REPLY, data, now))

    def find_unconfigured(self) -> Identity | None:
        """Find a device without a node id; it is left selected. None where there is none."""
        self._wait()
        self._master.RESPONSE_TIMEOUT = _SCAN_TIME
        with self._errors("search"):
            found, numbers = self._master.fast_scan()
        self._master.RESPONSE_TIMEOUT = _ANSWER_TIME
        return Identity(*numbers) if found and numbers is not None else None

    def select(self, identity: Identity) -> None:
        """Select the device of this identity; raises NoReply where there is none."""
        self._wait()
        numbers = (identity.vendor, identity.product, identity.revision, identity.serial)
        with self._errors(f"select {identity}"):
            self._master.send_switch_state_selective(*numbers)

    def select_only(self) -> Identity:
        """Select whichever device there is; for a bus with one device only."""
        with self._errors("select the only device"):
            self._master.send_switch_state_global(LssMaster.CONFIGURATION_STATE)
            return Identity(*(self._master.inquire_lss_address(what) for what in _INQUIRIES))

    def node(self) -> int:
        """Node id of the selected device; :data:`UNCONFIGURED` where it has none."""
        with self._errors("ask for the node id"):
            return int(self._master.inquire_node_id())

    def configure(self, node: int | None, bitrate: int | None, *, store: bool) -> None:
        """Set what is given, and let the selected device keep it where ``store`` is true.

        A node id is valid from its next start of communication on, a bit rate from its next start
        on once stored.
        """
        check_node(node)
        if node is not None:
            with self._errors(f"set the node id {node}"):
                self._master.configure_node_id(node)
        check_bitrate(bitrate)
        if bitrate is not None:
            with self._errors(f"set the bit rate {bitrate}"):
                self._master.configure_bit_timing(BIT_RATES[bitrate])
        if store:
            with self._errors("store"):
                self._master.store_configuration()

    def close(self) -> None:
        """Leave every device in the state in which it takes part in the network."""
        self._wait()

    def _wait(self) -> None:
        with self._errors("deselect"):
            self._master.send_switch_state_global(LssMaster.WAITING_STATE)

    @contextmanager
    def _errors(self, what: str) -> Iterator[None]:
        place = f"bus '{self._name}': LSS cannot {what}"
        try:
            yield
        except LssError as error:
            if "No LSS response" in str(error):
                raise NoReply(
                    f"{place}: no device answers; check its identity, the bit rate and that it "
                    "knows LSS"
                ) from error
            raise DeviceRefused(f"{place}: {_REASONS.get(str(error), error)}") from error
        except (can.CanError, OSError) as error:
            raise NoReply(f"{place}: {error}") from error

"""A simulated instrument on a serial line: replies, continuous sending, tare, faults."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from math import nan

from winchkit.schema.devices.stream import AskSpec, StreamSpec
from winchkit.sim.instruments.instrument import SimulatedInstrument, in_unit
from winchkit.sim.instruments.stream_frames import IndicatorState, Speech, example_unit


class SimulatedStreamInstrument(SimulatedInstrument):
    """One device on a serial line; ``measure`` gives the quantity in counts of the device."""

    KIND = "a simulated serial instrument"
    FAULTS = (
        "silence",
        "late reply",
        "frozen",
        "overload",
        "sensor break",
        "garbage",
        "bad checksum",
        "half line",
        "refusal",
        "unplug",
        "replug",
        "recover",
    )
    """``unplug`` and ``replug`` concern the whole line."""

    def __init__(
        self,
        spec: StreamSpec,
        measure: Callable[[], float],
        *,
        now: float,
        address: int | None = None,
    ) -> None:
        """Raise FileError where the device file's example does not fit its frame."""
        super().__init__(measure, spec.rate, spec.filter_delay, now=now)
        self.spec = spec
        self.address = address
        self.reply_delay = 2 * spec.longest_reply
        """Delay of a late reply, s."""
        self._old = True
        self._sending = spec.mode == "continuous" and not spec.start
        self._open = spec.select is None or address is None
        self._received = b""
        self._output: list[tuple[float, bytes]] = []
        self._speech = Speech(spec)
        self._actions = self._known_requests()

    def _showing(self) -> None:
        self._old = False
        if self._sending:
            self._send(self._speech.frame(self._state()), self._shown.due)

    # Interface for the host.

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes that the host sent."""
        self._received += data
        while self._received:
            found = next((text for text in self._actions if self._received.startswith(text)), None)
            if found is not None:
                self._received = self._received[len(found) :]
                self._actions[found](now)
            elif any(text.startswith(self._received) for text in self._actions):
                return
            else:
                self._received = self._received[1:]

    def take_output(self, now: float) -> bytes:
        """Bytes that are on the line by ``now``."""
        due = [data for time, data in self._output if time <= now]
        self._output = [item for item in self._output if item[0] > now]
        return b"".join(due)

    def inject(self, kind: str) -> None:
        """Inject a fault; raises UsageError for an unknown kind."""
        super().inject(kind)
        if kind == "recover":
            self.faults.add("replug")

    def _known_requests(self) -> dict[bytes, Callable[[float], None]]:
        """Requests of this device, longest first, with their actions."""
        spec = self.spec
        known: dict[str, Callable[[float], None]] = {}
        if spec.poll:
            known[spec.poll] = lambda now: self._answer(self._read(), now)
        if spec.fresh is not None:
            known[spec.fresh.send] = lambda now: self._answer(
                self._speech.status(self._state(), old=self._old), now
            )
        if spec.stop:
            known[spec.stop] = lambda now: self._stop()
        for ask in spec.start:
            known[ask.send] = self._doing(ask, "start")
        for name, ask in spec.command.items():
            known[ask.send] = self._doing(ask, name)
        if spec.select is not None:
            for address in range(256):
                send = spec.select.send.format(address=_Digits(address))
                known[send] = self._selecting(spec.select, address)
        mine = {self._bytes(text): action for text, action in known.items()}
        return dict(sorted(mine.items(), key=lambda item: -len(item[0])))

    def _doing(self, ask: AskSpec, name: str) -> Callable[[float], None]:
        def do(now: float) -> None:
            if not self._open:
                return
            no = self._speech.reply("refused", "busy") if "refusal" in self.faults else None
            if no is not None:
                self._answer(self._speech.line(no), now)
                return
            if name == "start":
                self._sending = self.spec.mode == "continuous"
            self._obey(name)
            if ask.answer:
                self._answer(self._speech.line(ask.answer[0].replace("*", "")), now)

        return do

    def _selecting(self, ask: AskSpec, address: int) -> Callable[[float], None]:
        def do(now: float) -> None:
            self._open = address == self.address
            if self._open:
                self._answer(self._speech.line(ask.answer[0]), now)

        return do

    def _stop(self) -> None:
        self._sending = False

    def _answer(self, data: bytes, now: float) -> None:
        if self._open:
            self._send(data, now + (self.reply_delay if "late reply" in self.faults else 0.0))

    def _send(self, data: bytes, time: float) -> None:
        if "silence" in self.faults:
            return
        if "garbage" in self.faults:
            data = b"\xff" + data
        if "half line" in self.faults:
            data = data[len(data) // 2 :]
        self._output.append((time, data))

    # Output.

    def _read(self) -> bytes:
        self._old = True
        return self._speech.frame(self._state())

    def _state(self) -> IndicatorState:
        """State of the conversion that is shown."""
        shown = self._shown
        gross = self.gross
        capacity = self.spec.capacity
        over = shown.overload or (capacity is not None and abs(gross) > capacity)
        if over or shown.broken:
            gross = nan
        return IndicatorState(
            gross - self._tare,
            gross,
            self._converter.motion,
            self._net,
            over,
            shown.broken,
            self.address,
            spoilt="bad checksum" in self.faults,
        )

    def _bytes(self, template: str) -> bytes:
        return template.format(address=_Digits(self.address or 0)).encode("latin-1")


class _Digits:
    """An address in a template: ``{address:3}`` is three digits."""

    def __init__(self, address: int) -> None:
        self._address = address

    def __format__(self, width: str) -> str:
        return str(self._address).rjust(int(width or "0"), "0")


def shown_by(spec: StreamSpec, measure: Callable[[], float]) -> Callable[[], float]:
    """Convert a measurement in SI to counts of the device, in the unit of its example."""
    one = example_unit(spec)
    return in_unit(one.unit, measure, one.scale)


class SerialCable(ABC):
    """Instruments on a serial line whose cable can be unplugged.

    ``up_to_date`` advances the simulation to the present time and locks it; ``now`` is its time.
    """

    def __init__(
        self,
        instruments: Sequence[SimulatedStreamInstrument],
        up_to_date: Callable[[], AbstractContextManager[None]],
        now: Callable[[], float],
    ) -> None:
        self._instruments = tuple(instruments)
        self._up_to_date, self._now = up_to_date, now

    @abstractmethod
    def _plug_in(self) -> None:
        """Connect the host."""

    @abstractmethod
    def _unplug(self) -> None:
        """Disconnect the host."""

    def _obey_the_cable(self) -> None:
        """Execute the faults ``unplug`` and ``replug``, each once."""
        for instrument in self._instruments:
            for fault, action in (("unplug", self._unplug), ("replug", self._plug_in)):
                if fault in instrument.faults:
                    instrument.faults.discard(fault)
                    action()

    def _serve(self, received: bytes) -> bytes:
        """Pass received bytes to the instruments and return their output that is due."""
        said = b""
        with self._up_to_date():
            now = self._now()
            for instrument in self._instruments:
                if received:
                    instrument.receive(received, now)
                said += instrument.take_output(now)
        return said

"""One instrument on a serial line: readings from its frames, and counts."""

from __future__ import annotations

from math import inf, nan
from typing import Protocol

from winchkit.drivers.clock import Clock
from winchkit.drivers.counters import Tally
from winchkit.drivers.publisher import InstrumentReadings, Publisher, Sampled
from winchkit.drivers.reading import REPLY_HORIZON, Quality
from winchkit.drivers.sharing import LATE, QUICK_RETRIES, RETRY, STALE_TIMEOUTS
from winchkit.drivers.stream.decoder import StreamContent
from winchkit.drivers.stream.parser import (
    StreamFrame,
    StreamParser,
    asking_whether_fresh,
    stream_of,
    talking,
)
from winchkit.errors import ConnectionLost
from winchkit.schema.devices.device import DeviceSpec

_JITTER = 0.8
"""Two frames come at least this share of a conversion apart."""


class LineTiming(Protocol):
    """Times of a line, s."""

    @property
    def byte_time(self) -> float:
        """Of one character with its start, parity and stop bits."""

    @property
    def latency(self) -> float:
        """How late the port hands bytes over."""


class StreamInstrument(InstrumentReadings):
    """An instrument that sends frames. ``latest`` is what other threads read."""

    def __init__(
        self,
        name: str,
        device: DeviceSpec,
        address: int | None,
        clock: Clock,
        *,
        timeout: float,
        rate: float = inf,
    ) -> None:
        """Poll as often as the device converts, at most ``rate`` (1/s); ``timeout`` in s."""
        self.name = name
        self.address = address
        self.spec = spec = stream_of(device)
        self.parser = StreamParser(device, address)
        self.talk = StreamParser(talking(device), address)
        """Reads the answers to commands."""
        self.fresh = StreamParser(asking_whether_fresh(device), address) if spec.fresh else None
        self.wanted_rate = min(rate, spec.rate) if spec.mode == "polled" else spec.rate
        self._timeout = timeout
        self.on_line(1.0 / self.wanted_rate)
        self.publisher = Publisher(spec.rate)
        self.problem: ConnectionLost | None = None
        """Why there is no new reading, while there is none."""
        self.due = self.asked = clock.now()
        self.started = False
        """Whether it has got its start command."""
        self._clock = clock
        self._failures = 0
        self._outstanding = False
        """Whether a reply is outstanding that could be taken for the next answer."""
        self._net: bool | None = None
        self._flags = Quality.GOOD
        self._chunk_at = clock.now()
        self._least_step = _JITTER / spec.rate

    def on_line(self, period: float) -> None:
        """Take the period that is to be expected, s."""
        self.period = period
        self.max_age = max(STALE_TIMEOUTS * self._timeout, 5 * period)
        """A reading older than this is stale, s."""

    @property
    def tally(self) -> Tally:
        """Counts, with those of its parsers."""
        tally = self.publisher.tally
        parsers = [self.parser, self.talk, *([self.fresh] if self.fresh else [])]
        counts = [parser.counts for parser in parsers]
        tally.crc = sum(one.bad_checksums for one in counts)
        tally.malformed = sum(one.malformed for one in counts)
        tally.resynchronised = sum(one.resynchronised for one in counts)
        return tally

    @property
    def tared(self) -> bool | None:
        """Whether the device says that it shows a net value; None where it does not say."""
        return self._net

    def text(self, template: str) -> bytes:
        """Bytes to send, with the address."""
        return template.format(address=_Address(self.address or 0)).encode("latin-1")

    def took(self, decoded: StreamContent) -> None:
        """Keep the status that a device gives beside its next value."""
        self._flags = decoded.quality

    def answered(
        self, item: StreamFrame, t_request: float, t_chunk: float, wire: LineTiming
    ) -> None:
        """Publish the answer to a request: the last conversion before it was sent."""
        t_receive = max(t_request, t_chunk - item.behind * wire.byte_time)
        earliest = t_request - 1.0 / self.spec.rate
        latest = max(t_request, t_receive - item.size * wire.byte_time)
        late = Quality.LATE if t_receive - t_request > LATE else Quality.GOOD
        when = self._sampled(t_request, t_receive, earliest, latest)
        if self._outstanding:
            self._outstanding, self.problem, self._failures = False, None, 0
            self.publisher.publish(nan, nan, nan, late | Quality.AMBIGUOUS, when)
            return
        self._publish(item, when, late)

    def sent(self, items: list[StreamFrame], t_chunk: float, wire: LineTiming) -> None:
        """Publish the frames of one chunk that the device sent by itself.

        Several at once mean that host or adapter held them back: all that is known then is that
        they came after the chunk before, one conversion after the other.
        """
        held_since, self._chunk_at = self._chunk_at, t_chunk
        newest_first = []
        for after, item in enumerate(reversed(items)):
            t_receive = t_chunk - max(item.behind * wire.byte_time, after * self._least_step)
            began = t_receive - item.size * wire.byte_time
            earliest = began - wire.latency - wire.byte_time
            if len(items) > 1:
                earliest = min(earliest, held_since - wire.latency)
            newest_first.append((item, self._sampled(began, t_receive, earliest, began)))
        for item, when in reversed(newest_first):
            self._publish(item, when, Quality.GOOD)

    def _sampled(
        self, t_request: float, t_receive: float, earliest: float, latest: float
    ) -> Sampled:
        """Wire and port are taken off already, the filter now."""
        delay = self.spec.filter_delay
        return Sampled(t_request, t_receive, earliest - delay, latest - delay)

    def _publish(self, item: StreamFrame, when: Sampled, late: Quality) -> None:
        decoded = item.frame.decoded
        assert decoded is not None, "a frame that is a reading says something"
        quality = decoded.quality | self._flags | late
        self._flags = Quality.GOOD
        if decoded.net is not None:
            self._net = decoded.net
        self.problem, self._failures = None, 0
        self.publisher.publish(decoded.value, decoded.gross, decoded.counts, quality, when)

    def failed(self, error: ConnectionLost, *, timeout: bool) -> None:
        """Keep and count a failure; one that fails again and again is asked less often."""
        tally = self.publisher.tally
        tally.drops += 1
        tally.timeouts += timeout
        self.problem = error
        self._failures += 1
        often = self._failures > QUICK_RETRIES
        if often:
            self.started = False
        pause = RETRY if often else 0.0
        if timeout and self.spec.mode == "polled":
            # Its answers have no number: nothing is asked until the reply cannot come any more,
            # and the first answer after it is discarded.
            self._outstanding = True
            pause = max(pause, REPLY_HORIZON * self.spec.longest_reply)
        self.due = self._clock.now() + pause

    def overheard(self) -> None:
        """Note that something came that was not asked for: perhaps what was outstanding."""
        if self._outstanding:
            self.due = min(self.due, self._clock.now() + self.spec.longest_reply)

    def refused(self, error: ConnectionLost) -> None:
        """Keep and count an answer that is a refusal."""
        self.publisher.tally.exceptions += 1
        self.problem = error
        self.due = self._clock.now() + self.period


class _Address:
    """An address in a template: ``{address:3}`` is three digits."""

    def __init__(self, value: int) -> None:
        self._value = value

    def __format__(self, width: str) -> str:
        return f"{self._value:0{width}d}" if width else str(self._value)

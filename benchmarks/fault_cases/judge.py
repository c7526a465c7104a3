"""Judges a case from the truth: stopped in time, nothing moved again, tension, cause, log.

Three bounds are those of two faults together:

- A bound that ends while the computer stands still is that of the drives' own watchdogs:
  nothing else can stop them in that time.
- A drive that does not receive the stop of an earlier fault, because a communication fault began
  before that stop was due and lasts, is stopped by what this second fault leaves (SDO, or its own
  watchdog after withheld heartbeats). That takes the bound of a communication fault, counted from
  the onset of the second fault.

- What only a cell's readings show, while another fault withholds them, is stopped by their age.

A cause must be named by a trip. One exception: a condition latches where it forbids a motion under
way (docs/safety.md). A motion that came to its own end between the fault and the moment at which
the condition is due is no longer under way, nothing has to be stopped, and nothing latches. The
condition must then refuse the next command, in its own words.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from fault_cases.case import NOISE_KNOWN, Planned
from fault_cases.kinds import KINDS, READING_DELAY, STIFFNESS, Kind
from fault_cases.play import Record
from fault_cases.world import LIMITS, Sample

_REPLY = 0.2
"""Time-out of a request to a cell, s: that of the bench files."""
_STALLS = {"computer stalls 0.1 s": 0.1, "computer stalls 0.5 s": 0.5}
"""s."""
_MOVES = 0.004
"""Cable speed above which a winch moves, m/s."""
_SETTLES = 0.05
"""The brake and the drive's filters take this long beside v/a, s."""
_DEAD_MAN = 0.2
_NUMBER = re.compile(r"\d+(\.\d+)?")
_FLUSH = 0.05
"""What a closed log may lack at its end, s: the filter, conversion and poll of the load cell."""
_NOISE = 15.0
"""Above the true tension at which the cell's noise may trip, and oscillations, N."""
_LENGTH = 0.01
"""By which a known length may be wrong, m: the smallest jump of 6064h that is seen in motion, and
what passes before a trip (docs/safety.md)."""


@dataclass(frozen=True)
class Verdict:
    """What a case showed; empty strings are good."""

    stopped: str = ""
    moved_after_trip: str = ""
    over_tension: str = ""
    cause: str = ""
    log: str = ""
    length: str = ""
    error: str = ""
    reaction: float = math.nan
    """From the onset of the first fault until no drive followed set-points, s."""
    recovered: bool = True
    """Whether a new command after the reset moved it."""
    refusal: str = ""
    """What refused the reset, in words."""

    @property
    def good(self) -> bool:
        """Whether nothing is wrong."""
        return not (
            self.stopped
            or self.moved_after_trip
            or self.over_tension
            or self.cause
            or self.log
            or self.length
            or self.error
        )


def judge(record: Record) -> Verdict:
    """Judge what is true."""
    if record.error:
        return Verdict(error=record.error)
    reference = _must_stop(record)
    stopped, reaction = _judge_stop(record, reference)
    return Verdict(
        stopped or _judge_release(record),
        _judge_rest(record, reference),
        _judge_tension(record),
        _judge_cause(record, reference),
        _judge_log(record),
        _judge_length(record),
        reaction=reaction,
        recovered=record.moved_again,
        refusal=record.late_reset,
    )


def _must_stop(record: Record) -> tuple[float, float] | None:
    """Onset and bound of what must stop the bench first; None where nothing must."""
    found = []
    for planned, onset in record.onsets:
        kind = KINDS[planned.kind]
        if not kind.stops or _span(record, planned, onset) < kind.least:
            continue
        start = _crossing(record, planned, kind, onset)
        if start is not None:
            found.append((start, _bound(record, kind, start)))
    return min(found, key=sum, default=None)


def _span(record: Record, planned: Planned, onset: float) -> float:
    """How long a fault lasted, s: until its own end, or that of another fault of the same part."""
    part = KINDS[planned.kind].part
    own = math.inf if planned.span is None else planned.span
    ends = [
        moment - onset
        for other, winch, moment in record.recoveries
        if part and other == part and moment >= onset and (part == "line" or winch == planned.winch)
    ]
    return min([own, *ends])


def _bound_of(record: Record, name: str, start: float, bound: float) -> float:
    """The bound of a winch whose drive receives no stop is that of the fault that blocks it."""
    for planned, onset in record.onsets:
        kind = KINDS[planned.kind]
        blocked = kind.blocks == "bus" or (kind.blocks == "drive" and planned.winch == name)
        if blocked and onset < start + bound < onset + _span(record, planned, onset):
            bound = max(bound, onset + KINDS["cut wire"].bound - start)
    return bound


def _bound(record: Record, kind: Kind, start: float) -> float:
    """Bound of a fault that began at ``start``, with that of another one which delays its stop."""
    bound = kind.bound
    for planned, onset in record.onsets:
        other = KINDS[planned.kind]
        stall = _STALLS.get(planned.kind, 0.0)
        if onset < start + bound < onset + stall:
            bound = max(bound, onset + KINDS["computer stalls 0.5 s"].bound - start)
        # The request whose answer it spoilt has yet to time out.
        unread = onset + _span(record, planned, onset) + _REPLY
        if kind.part == other.blocks == "cell" and onset < start + bound < unread:
            bound = max(bound, onset + other.bound - start)
    return bound


def _crossing(record: Record, planned: Planned, kind: Kind, onset: float) -> float | None:
    """When the time begins to count; None where nothing shows it."""
    if not kind.crosses:
        return onset
    for sample in record.truth[planned.winch]:
        high = kind.crosses == "high" and sample.tension > LIMITS["tension_high"]
        slack = kind.crosses == "slack" and sample.tension < LIMITS["tension_slack"]
        if sample.time > onset and (high or slack):
            seen = _shown_from(record, planned.winch, sample.time)
            return seen if math.isfinite(seen) else None
    return None


def _shown_from(record: Record, winch: str, crossing: float) -> float:
    """When a tension that crosses a limit is in the readings, s; infinity where it never is.

    A load cell that froze before it read the crossing shows an earlier tension. Where the
    predicted tension does not change, only the cell's noise would show that, and the noise is not
    known before the cell has been at rest for a time (docs/safety.md).
    """
    if record.case.rest >= NOISE_KNOWN:
        return crossing
    for planned, onset in record.onsets:
        hides = planned.kind == "cell frozen" and planned.winch == winch
        end = onset + _span(record, planned, onset)
        if hides and onset < crossing + READING_DELAY < end:
            return end
    return crossing


def _between(samples: Sequence[Sample], start: float, end: float) -> list[Sample]:
    return [sample for sample in samples if start <= sample.time < end]


def _judge_stop(record: Record, reference: tuple[float, float] | None) -> tuple[str, float]:
    if reference is None:
        return "", math.nan
    onset, least = reference
    reaction = 0.0
    for name, samples in record.truth.items():
        bound = _bound_of(record, name, onset, least)
        later = _between(samples, onset, min(record.mended, record.reset))
        if not later:
            continue
        moving = [s for s in later if s.follows]
        left = moving[-1].time - onset if moving and later[0].follows else 0.0
        reaction = max(reaction, left)
        if left > bound:
            return f"winch {name} followed set-points for {left:.3f} s (bound {bound:.3f} s)", left
        fastest = max(s.speed for s in _between(samples, onset - 0.01, onset + bound + 0.01))
        allowed = bound + fastest / LIMITS["acceleration"] + _SETTLES
        running = [s.time - onset for s in later if s.speed > _MOVES]
        rest = running[-1] if running else 0.0
        if rest > allowed:
            return f"winch {name} stood still after {rest:.3f} s only (bound {allowed:.3f} s)", left
    return "", reaction


def _judge_release(record: Record) -> str:
    """After the release, and after a dead-man that was released, everything comes to rest."""
    moments = [record.released] if record.case.motion == "jog" else []
    if record.case.motion == "jog":  # a move and a programme hold no key
        moments += [onset for planned, onset in record.onsets if planned.kind == "released"]
    for moment in moments:
        for name, samples in record.truth.items():
            before = _between(samples, moment - 0.05, moment + _DEAD_MAN + 0.15)
            fastest = max((s.speed for s in before), default=0.0)
            allowed = _DEAD_MAN + 0.15 + fastest / LIMITS["acceleration"] + _SETTLES
            end = record.pressed if moment == record.released else record.reset
            late = [s for s in _between(samples, moment + allowed, end) if s.speed > _MOVES]
            if late:
                return f"winch {name} moved {late[-1].time - moment:.2f} s after the release"
    return ""


def _tripped_at(record: Record, name: str, reference: tuple[float, float] | None) -> float | None:
    """From when on a winch may not move, as the truth has it."""
    if reference is not None:
        onset, bound = reference
        bound = _bound_of(record, name, onset, bound)
        return onset + bound + LIMITS["speed"] / LIMITS["acceleration"] + _SETTLES
    if not math.isfinite(record.tripped_at):
        return None
    # Something tripped that need not have: from then on nothing may move either.
    stopping = KINDS["cut wire"].bound + LIMITS["speed"] / LIMITS["acceleration"] + _SETTLES
    return record.tripped_at + stopping


def _judge_rest(record: Record, reference: tuple[float, float] | None) -> str:
    end = record.released if record.case.motion == "jog" else record.reset
    if not math.isfinite(record.tripped_at):
        # What only forbade a motion at rest forbids none once it is mended.
        end = min(end, record.mended)
    for name, samples in record.truth.items():
        start = _tripped_at(record, name, reference)
        if start is None:
            return ""
        for sample in _between(samples, start, end):
            if sample.speed > _MOVES or sample.enabled:
                what = "was enabled" if sample.enabled else f"moved at {sample.speed:.3f} m/s"
                place = "before the reset" if sample.time < record.reset else "after the reset"
                return f"winch {name} {what} {sample.time - start:.2f} s after the stop, {place}"
    return ""


def _judge_tension(record: Record) -> str:
    speed = record.case.speed
    snags = any(KINDS[planned.kind].crosses == "high" for planned, _ in record.onsets)
    way = speed * 0.15 + speed * speed / (2 * LIMITS["acceleration"])
    limit = LIMITS["tension_high"] + _NOISE + (STIFFNESS * way if snags else 0.0)
    for name, samples in record.truth.items():
        highest = max((s.tension for s in _between(samples, 0, record.ended)), default=0.0)
        if highest > limit:
            return f"winch {name}: {highest:.0f} N (computed {limit:.0f} N)"
    return ""


def _judge_cause(record: Record, reference: tuple[float, float] | None) -> str:
    right = {cause for planned, _ in record.onsets for cause in KINDS[planned.kind].causes}
    named = [kind for kind, _ in record.trips]
    if record.failure is not None:
        named.append("failure")
    if not named:
        due = reference is not None and _enabled(record)
        return "nothing was told" if due and not _refused_at_rest(record, right) else ""
    if named[0] in right:
        return ""
    words = next((text for _, text in record.trips), str(record.failure))
    return f"'{words}' for {', '.join(planned.kind for planned, _ in record.onsets)}"


def _refused_at_rest(record: Record, right: set[str]) -> bool:
    """Whether the condition came to winches at rest, which stayed so until it was mended.

    The commands that were given meanwhile were refused in its words; after a jog that its operator
    released there is none.
    """
    released = any(planned.kind == "released" for planned, _ in record.onsets)
    for one in record.forbidden:
        moving = any(
            sample.enabled
            for samples in record.truth.values()
            for sample in _between(samples, one.time - 0.01, record.mended)
        )
        later = [words for moment, words in record.refused if moment >= one.time]
        if one.kind in right and not moving and (later or released):
            return all(_NUMBER.sub("", words) == _NUMBER.sub("", one.words) for words in later)
    return False


def _enabled(record: Record) -> bool:
    """Whether a drive that a fault concerns was enabled when that came: else there is no trip."""
    for planned, onset in record.onsets:
        before = _between(record.truth[planned.winch], onset - 0.01, onset)
        if any(sample.enabled for sample in before):
            return True
    return False


def _judge_length(record: Record) -> str:
    """A length is right or unknown."""
    for name, (shown, true) in record.lengths.items():
        if abs(shown - true) > _LENGTH:
            return f"winch {name}: {shown:.3f} m is shown as known, {true:.3f} m is true"
    return ""


def _judge_log(record: Record) -> str:
    full = [onset for planned, onset in record.onsets if planned.kind == "recorder fails"]
    if record.log_error and not full:
        return record.log_error
    end = min(full) if full else record.ended
    if not record.log_end >= end - _FLUSH - (1.0 if full else 0.0):
        return f"the log ends {end - record.log_end:.2f} s early {record.log_error}"
    return ""

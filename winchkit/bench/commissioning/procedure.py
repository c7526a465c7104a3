"""The guided commissioning of a bench: trials first, then small motions, then the record.

Nothing is enabled while a question is open, each motion is announced and begins after an answer,
and the record is written only when every item of every winch has been confirmed.
"""

from __future__ import annotations

import math
import platform
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path

from winchkit.arguments import path_of
from winchkit.bench.bench import Bench
from winchkit.bench.cells.instruments import device_of, eds_of
from winchkit.bench.commissioning.dialogue import (
    YES_OR_NO,
    AnswerFile,
    Dialogue,
    StoppedDialogue,
    TypedAnswers,
    agreed,
    confirm,
)
from winchkit.bench.commissioning.motions import Motions, by_way, millimetres
from winchkit.bench.commissioning.record import (
    CommissioningRecord,
    Confirmation,
    DriveRecord,
    FileHash,
    HostLossRecord,
    WinchRecord,
    drive_record,
    hash_of,
    write_record,
)
from winchkit.bench.commissioning.trial import TrialResult, Trials
from winchkit.bench.ownership import unless_stopped
from winchkit.bench.recording.provenance import installed
from winchkit.bench.remote.handover import own
from winchkit.bench.remote.identity import client_name
from winchkit.bench.remote.server import StationServer
from winchkit.drivers.can.canopen.identity import Identity
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.errors import NotPermitted
from winchkit.schema.bench import BenchSpec, WinchWiring
from winchkit.schema.read import read_bench
from winchkit.version import __version__

_COMMAND = "commission"
_SLIP = 5e-3
"""Of the cable within two seconds after the drive was disabled, m."""
_SLOW = 0.1
"""Share of ``limits.speed``, between `_SLOWEST` and `_FASTEST`."""
_SLOWEST, _FASTEST = 0.005, 0.05
"""m/s: static friction is overcome at the lower one; at the upper one an operator can stop within 5
cm (1 s)."""
_LIBRARIES = ("canopen", "python-can", "numpy")
_LIMITS = (
    ("speed", "m/s"),
    ("acceleration", "m/s²"),
    ("tension_high", "N"),
    ("tension_slack", "N"),
    ("tension_rate", "N/s"),
)


def commission_bench(spec: BenchSpec, dialogue: Dialogue, clock: Clock) -> CommissioningRecord:
    """Lead through every item and write the record; raises NotPermitted for an unconfirmed one."""
    with unless_stopped(spec, "commissioned: nothing was recorded; begin anew") as check:
        return _commission(spec, StoppedDialogue(dialogue, check), clock)


def _commission(spec: BenchSpec, dialogue: Dialogue, clock: Clock) -> CommissioningRecord:
    spec.require_winches()
    if not spec.path:
        raise NotPermitted("a bench without a file cannot be commissioned; write a bench file")
    by = dialogue.ask("by", "Who commissions this bench (name, for the record)?")
    confirm(
        dialogue,
        "safety.emergency_stop",
        "Is the emergency stop (EN 60204-1) within reach, and was it tried today?",
    )
    confirm(
        dialogue,
        "safety.area",
        "Is everyone clear of the drum, the cable and the load, and of where the load may fall?",
    )
    hashed = hash_of(spec.path)
    steps = {name: _Steps(spec, name, dialogue) for name in spec.winch}
    ownership = own(spec, client_name(_COMMAND))
    with ExitStack() as stack:
        # Held from the first trial to the last motion: no other process comes in between.
        stack.callback(ownership.close)
        with Trials(spec, clock) as trials:
            for step in steps.values():
                step.trials(trials)
        stack.pop_all()
    with Bench(spec, clock, _COMMAND, ownership, serve=StationServer, commissioning=True) as bench:
        for step in steps.values():
            step.motions(bench)
    confirm(dialogue, "sign", f"Everything above is right; sign the record as {by}?")
    record = CommissioningRecord(
        bench=spec.name,
        date=_now(),
        by=by,
        answers=dialogue.source,
        software=_software(),
        bench_file=hashed,
        winch={name: step.record() for name, step in steps.items()},
    )
    changed = [spec.path] if hash_of(spec.path) != hashed else []
    changed += [path for step in steps.values() for path in step.changed_files()]
    if changed:
        raise NotPermitted(f"{', '.join(changed)} changed meanwhile; nothing was recorded")
    write_record(record, spec.record_file)
    return record


class _Steps:
    """The items of one winch."""

    def __init__(self, spec: BenchSpec, name: str, dialogue: Dialogue) -> None:
        self._spec, self._name, self._dialogue = spec, name, dialogue
        self._wiring: WinchWiring = spec.winch[name]
        device = device_of(spec, self._wiring.servo)
        self._files = device.path, eds_of(device)
        self._hashes = self._hashed()
        self._confirmed: list[Confirmation] = []
        self._drive = DriveRecord()
        self._host_loss = HostLossRecord("", 0.0)
        self._stops_on_nmt = False

    def trials(self, trials: Trials) -> None:
        """Identity, brake, host loss, NMT stopped."""
        axis, name = trials.axes[self._name], self._name
        self._drive = drive_record(axis)
        self._dialogue.show(f"winch {name}: {_identity(self._drive)}")
        if not self._drive.serial:
            self._dialogue.show(
                f"winch {name}: the drive has no serial number (1018h:4); another drive of the "
                "same type in its place cannot be recognised"
            )
        self._brake(trials)
        drive = axis.drive
        assert drive is not None, "the bench was opened"
        noticed = drive.proof.delay if drive.proof is not None and drive.proof.noticed else None
        standstill = self._host_silent(trials, 0.0)
        moving = self._moving(trials)
        self._host_loss = HostLossRecord(
            mechanism=drive.host_loss.mechanism,
            limit=drive.host_loss.limit,
            noticed_after=noticed,
            stopped_after=standstill.after,
            stopped_moving_after=None if moving is None else moving.after,
            hardware=self._wiring.host_loss_description,
        )
        self._nmt(trials)

    def motions(self, bench: Bench) -> None:
        """Direction, units, cell, limits."""
        motions = Motions(bench, self._name, _slow(self._wiring))
        self._direction(motions)
        self._units(motions)
        if self._wiring.cell is not None:
            self._cell(motions)
        self._limits()

    def changed_files(self) -> tuple[str, ...]:
        """Device file and EDS that are not what they were when this winch was opened."""
        now = self._hashed()
        return tuple(
            str(path)
            for path, was, one in zip(self._files, self._hashes, now, strict=True)
            if one != was
        )

    def _hashed(self) -> tuple[FileHash, FileHash]:
        device, eds = self._files
        return hash_of(device), hash_of(eds)

    def record(self) -> WinchRecord:
        """The record of this winch."""
        device, eds = self._hashes
        return WinchRecord(
            drive=self._drive,
            device=device,
            eds=eds,
            host_loss=self._host_loss,
            stops_on_nmt=self._stops_on_nmt,
            confirmed=tuple(self._confirmed),
        )

    def _brake(self, trials: Trials) -> None:
        question = (
            f"winch {self._name}: next, the drive is enabled at rest. Does a load hang on the "
            "cable? Type 'unloaded' if none does, or 'brake' if a brake holds it (the brake is "
            "then tried at once):"
        )
        answer = self._dialogue.ask(f"{self._name}.brake", question, ("unloaded", "brake"))
        if answer == "unloaded":
            self._note("brake", question, answer)
            return
        if not self._wiring.brake:
            raise NotPermitted(
                f"winch {self._name}: the bench file declares no brake; unload the cable, or fit a "
                "brake and declare it (brake = true)"
            )
        seen = trials.brake(self._name)
        if not seen.stopped:
            raise NotPermitted(
                f"winch {self._name}: {seen.after:g} s after the command to disable, the drive is "
                f"'{seen.state}' and holds the load itself, so that nothing is known of the brake. "
                "Nothing was recorded; look at what keeps the drive enabled (605Ch, its inputs)"
            )
        if abs(seen.travel) > _SLIP:
            raise NotPermitted(
                f"winch {self._name}: the brake does not hold: in {seen.after:g} s after the "
                f"drive was disabled it {by_way(seen.travel)} (limit {_SLIP * 1e3:g} mm). Nothing "
                "was recorded; secure the load and repair the brake"
            )
        text = f"winch {self._name}: with the drive disabled it {by_way(seen.travel)}."
        held = confirm(self._dialogue, f"{self._name}.brake_held", f"{text} Did the brake hold?")
        self._note("brake", f"{question} {text}", f"{answer}, {held}", slip=seen.travel)

    def _host_silent(self, trials: Trials, speed: float) -> TrialResult:
        where = f"in motion at {speed:g} m/s" if speed else "at standstill"
        seen = trials.host_loss(self._name, speed)
        if not seen.stopped:
            raise NotPermitted(
                f"winch {self._name}: when the computer fails, this drive goes on moving: "
                f"{seen.after:.2f} s after the last message it was still '{seen.state}' ({where}). "
                "Nothing was recorded; set its reaction (docs/howto/drive.md, host_loss)"
            )
        text = (
            f"winch {self._name}: the computer fell silent with the drive enabled {where}. "
            f"{seen.after:.3f} s later the drive was '{seen.state}'; until it was at rest it "
            f"{by_way(seen.travel)}."
        )
        item = "host loss in motion" if speed else "host loss"
        key = f"{self._name}.{item.replace(' ', '_')}"
        answer = confirm(self._dialogue, key, f"{text} Is that what you saw?")
        self._note(item, text, answer, after=seen.after, travel=seen.travel)
        return seen

    def _moving(self, trials: Trials) -> TrialResult | None:
        speed = _slow(self._wiring)
        question = (
            f"winch {self._name}: try the same in motion? 'yes' winds in at {speed:g} m/s for "
            "0.8 s, then the computer falls silent; 'no' leaves this test out."
            f"{trials.room(self._name)}"
        )
        answer = self._dialogue.ask(f"{self._name}.try_in_motion", question, YES_OR_NO)
        return self._host_silent(trials, speed) if agreed(answer) else None

    def _nmt(self, trials: Trials) -> None:
        seen = trials.nmt_stopped(self._name)
        self._stops_on_nmt = seen.stopped
        verb = "switches off" if seen.stopped else "does not switch off"
        text = f"winch {self._name}: the drive {verb} when its node is stopped (NMT)"
        self._dialogue.show(f"{text}; it was then '{seen.state}'.")
        self._note("NMT stopped", text, "measured", after=seen.after)

    def _direction(self, motions: Motions) -> None:
        step = motions.step
        pays_out = motions.has_room(step)
        verb = "pay out" if pays_out else "wind in"
        go = f"winch {self._name}: next, it will {verb} {millimetres(step)}. Begin?"
        confirm(self._dialogue, f"{self._name}.direction_go", go)
        change = step if pays_out else -step
        moved = motions.go(change)
        question = f"winch {self._name}: did it {verb} cable?"
        answer = confirm(self._dialogue, f"{self._name}.direction", question)
        self._note("direction", question, answer, commanded=change, moved=moved.cable)

    def _units(self, motions: Motions) -> None:
        turn = motions.turn
        name = self._name
        sign = 1.0 if motions.has_room(turn) else -1.0
        verb = "pay out" if sign > 0 else "wind in"
        go = f"winch {name}: next, the motor makes one turn: {verb} {millimetres(turn)}. Begin?"
        confirm(self._dialogue, f"{name}.units_go", go)
        moved = motions.go(sign * turn)
        measured = {"turns": moved.turns, "cable": moved.cable}
        if math.isfinite(moved.sensor):
            measured["length sensor"] = moved.sensor
            motions.check_sensor(moved)
            question = (
                f"winch {name}: by the length sensor it {by_way(moved.sensor)}, by the profile "
                f"{millimetres(abs(moved.cable))}. Did the motor make one turn?"
            )
        else:
            question = (
                f"winch {name}: did the motor make one turn, and the cable move by "
                f"{millimetres(turn)} as measured with a tape?"
            )
        answer = confirm(self._dialogue, f"{name}.units", question)
        self._note("units", question, answer, **measured)

    def _cell(self, motions: Motions) -> None:
        name, before = self._name, motions.tension()
        question = (
            f"winch {name}: the cell reads {before:.1f} N. Type 'right' if a known load hangs now "
            "and this is its tension. Else hang a load on the cable, or pull on it and go on "
            "pulling, and type 'pulled':"
        )
        answer = self._dialogue.ask(f"{name}.cell", question, ("pulled", "right"))
        after = motions.tension()
        if answer == "pulled":
            if after - before <= motions.cell_noise:
                raise NotPermitted(
                    f"winch {name}: a pull must raise the cell's reading: it was {before:.1f} N "
                    f"and then {after:.1f} N. Nothing was recorded; check its sign (`scale` of its "
                    "device file), its wiring, and whether it is on this cable"
                )
        elif not after > motions.cell_noise:
            raise NotPermitted(
                f"winch {name}: the cell reads {after:.1f} N, no more than its noise of "
                f"{motions.cell_noise:.1f} N. Nothing was recorded; hang a known load on the "
                "cable, or pull on it"
            )
        self._note("cell", question, answer, before=before, after=after)

    def _limits(self) -> None:
        limits = self._wiring.limits
        shown = [
            f"{key} {value:g} {unit}"
            for key, unit in _LIMITS
            if (value := getattr(limits, key)) is not None
        ]
        if limits.length is not None:
            shown.append(f"length {limits.length[0]:g} to {limits.length[1]:g} m")
        missing = [key for key in ("length", "tension_high") if getattr(limits, key) is None]
        lacking = f"; NOT limited: {', '.join(missing)}" if missing else ""
        question = f"winch {self._name}: limits: {', '.join(shown)}{lacking}. Are they right?"
        answer = confirm(self._dialogue, f"{self._name}.limits", question)
        self._note("limits", question, answer)

    def _note(self, item: str, question: str, answer: str, **measured: float) -> None:
        self._confirmed.append(Confirmation(item, question, answer, _now(), measured))


def _identity(drive: DriveRecord) -> str:
    """Identity and software version in words."""
    identity = Identity(drive.vendor, drive.product, drive.revision, drive.serial)
    return f"{identity}, software {drive.software}" if drive.software else str(identity)


def _slow(wiring: WinchWiring) -> float:
    """Speed of the motions of a commissioning, m/s."""
    limit = wiring.limits.speed
    return min(limit, max(_SLOWEST, min(_FASTEST, _SLOW * limit)))


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _software() -> Mapping[str, str]:
    own = {"winchkit": __version__, "python": platform.python_version()}
    return {**own, **installed(_LIBRARIES)}


def commission(bench: str | Path, answers: str | Path | None = None) -> CommissioningRecord:
    """Commission a bench: try directions, units, brake, limits and the loss of the host.

    Parameters
    ----------
    bench : str or Path
        Bench file; the record is written beside it.
    answers : str or Path, optional
        TOML file of answers; by default questions go to stderr and answers are read from stdin.

    Returns
    -------
    CommissioningRecord
        Tests, confirmations, and the person who confirmed them.

    Raises
    ------
    FileError
        For an invalid bench file or file of answers.
    NotPermitted
        For an item that was not confirmed or did not stop.
    ConnectionLost
        Where a bus or device does not answer.
    """

    def say(text: str) -> None:
        print(text, file=sys.stderr)  # noqa: T201 - questions to a person

    dialogue: Dialogue = (
        TypedAnswers(say, sys.stdin.readline)
        if answers is None
        else AnswerFile(path_of(answers, "answers"), say)
    )
    return commission_bench(read_bench(path_of(bench, "bench")), dialogue, MonotonicClock())

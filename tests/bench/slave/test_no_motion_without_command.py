"""No sequence of calls, faults, resets, clients and process ends moves a winch without a command.

A model-based test: hypothesis makes the sequences, the slave's shaft is the witness.
``WINCHKIT_SEQUENCES=200`` tries more of them.
"""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from slave import Declared, Slave, State
from slave.held_key import HeldKey
from slave.network import Nmt
from slave.oracle import ESCALATED, FIRST_STOP, Oracle
from slave.rig import Rig
from slave.wire import GENERIC
from winchkit.bench.bench import Bench
from winchkit.bench.remote.identity import Client
from winchkit.errors import WinchkitError

_EXAMPLES = int(os.environ.get("WINCHKIT_SEQUENCES", "6"))
_DRIVE = Declared(disabled_deceleration=400.0)
"""Its brake stops the shaft from limits.speed in 0.26 s."""
_JOG = 0.2 + 0.3 + 0.25
"""Dead-man, ramp from limits.speed, and the cycles between, s."""
_MOVE = 4.0
"""A move of 5 cm with its settling, enabling included, s."""
_HOME = 3.0
_ENABLED_BY_OTHERS = ("second master enables", "enables itself")
_BLOCKS_STOPS = ("quick stop ignored", "control word unheeded", "status frozen")
_NOTHING_HELPS = ("unresponsive", "turns while disabled", "monitoring fails")
_OFF = frozenset({"host frames lost", "off the bus"})
_NO_RPDO = _OFF | {"rpdo unheard", "sync unheard"}
"""RPDOs and TPDOs are synchronous."""
_NO_TPDO = _OFF | {"tpdo lost", "sync unheard", "silent"}
_NO_SDO = _OFF | {"sdo unheard", "sdo refused"}
_TRIPS_ALWAYS = (
    "reboots",
    "reset by a stranger",
    "stopped by a stranger",
    "pre-operational by a stranger",
    "goes pre-operational",
)
_TRIPS_WHILE_ENABLED = ("enable input open", "second master disables", "drive fault")
_WHILE_MOVING = (
    *_TRIPS_ALWAYS,
    *_TRIPS_WHILE_ENABLED,
    "mode changed",
    "rpdo unheard",
    "sync unheard",
    "host frames lost",
    "heartbeat unheard",
    "tpdo lost",
    "off the bus",
    "control word unheeded",
)
_NOTICED = 0.3
"""After a fault that is a trip by itself, s: heartbeats of 50 ms show the NMT state."""
_FAULTS = (
    *_ENABLED_BY_OTHERS,
    *_BLOCKS_STOPS,
    *_NOTHING_HELPS,
    "enable input open",
    "second master disables",
    "drive fault",
    "emergency",
    "reboots",
    "reset by a stranger",
    "stopped by a stranger",
    "pre-operational by a stranger",
    "goes pre-operational",
    "rpdo unheard",
    "sync unheard",
    "host frames lost",
    "heartbeat unheard",
    "nmt unheard",
    "sdo unheard",
    "tpdo lost",
    "heartbeat lost",
    "silent",
    "off the bus",
    "sdo refused",
    "sdo delayed",
    "velocity stuck",
    "position stuck",
    "mode changed",
    "position wraps",
)


class NoMotionWithoutCommand(RuleBasedStateMachine):
    """One winch, its drive, the people around it and their processes."""

    @initialize()
    def begin(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.rig = Rig(Path(self.folder.name), [Slave.from_file(GENERIC, 1, declared=_DRIVE)])
        self.slave = self.rig.slaves[0]
        self.oracle = Oracle(self.slave)
        self.bench: Bench | None = None
        self.people: dict[str, HeldKey] = {}
        self.tripped = False
        self.must = math.inf
        """From when on a trip has to be latched, whatever winchkit says, s."""
        self.ended = -1.0
        """When the last trip, quick stop or reset was, s."""
        self.rig.each.append(self._watch_trips)
        self._open()

    def teardown(self) -> None:
        if hasattr(self, "folder"):
            self.slave.mend_all()
            if self.bench is not None:
                self._release_all()
                with contextlib.suppress(WinchkitError):
                    self.bench.close()
            self.folder.cleanup()

    @invariant()
    def nothing_without_a_command(self) -> None:
        if hasattr(self, "oracle"):
            assert not self.oracle.wrongs, self.oracle.wrongs

    # Time

    @rule(duration=st.sampled_from([0.02, 0.1, 0.3, 1.0, 2.0]))
    def wait(self, duration: float) -> None:
        self.rig.wait(duration)

    @precondition(lambda self: self.bench is not None)
    @rule(duration=st.sampled_from([0.05, 0.3, 1.0]))
    def computer_stalls(self, duration: float) -> None:
        self.rig.clock.stall(duration)
        self.must = self._later(duration)

    # People

    @precondition(lambda self: self.bench is not None)
    @rule(who=st.sampled_from(["owner", "guest"]), pay_out=st.sampled_from([0.1, -0.1, 0.3]))
    def press(self, who: str, pay_out: float) -> None:
        assert self.bench is not None
        if who not in self.people:
            client = None if who == "owner" else Client(who)
            key = HeldKey(self.rig, self.bench, pay_out=pay_out, client=client)
            key.accepted = self._on_jog(key)
            self.people[who] = key.press()

    @precondition(lambda self: self.bench is not None)
    @rule(pay_out=st.sampled_from([0.1, -0.1]), fault=st.sampled_from(_WHILE_MOVING))
    def run_into_a_fault(self, pay_out: float, fault: str) -> None:
        """A winch at speed, under a key that stays held."""
        self.release("owner")
        self.rig.wait(0.9)
        self.press("owner", pay_out)
        self.rig.wait(0.5)
        self.fault(fault)
        self.rig.wait(0.6)

    @precondition(lambda self: self.bench is not None)
    @rule()
    def bring_back(self) -> None:
        """What an operator does after a trip: mend, release, reset."""
        self.mend()
        self._release_all()
        self.rig.wait(0.9)
        self.reset()

    @rule(who=st.sampled_from(["owner", "guest"]))
    def release(self, who: str) -> None:
        key = self.people.pop(who, None)
        if key is not None:
            key.release()

    @precondition(lambda self: self.bench is not None and "guest" in self.people)
    @rule()
    def guest_leaves(self) -> None:
        assert self.bench is not None
        key = self.people.pop("guest")
        key.release()
        if key.client is not None:
            self.bench.commanders.leave(key.client)

    @precondition(lambda self: self.bench is not None)
    @rule(change=st.sampled_from([0.05, -0.05]))
    def move(self, change: float) -> None:
        def begin() -> None:
            winch = self.bench.winch["A"]
            if change > 0:
                winch.move_by(pay_out=change, wait=False)
            else:
                winch.move_by(wind_in=-change, wait=False)

        self._commands(begin, _MOVE)

    @precondition(lambda self: self.bench is not None)
    @rule(what=st.sampled_from(["home", "tare", "stop", "stop now"]))
    def call(self, what: str) -> None:
        winch = self.bench.winch["A"]
        if what == "stop now":
            self.ended = self.rig.time
            self.oracle.trip()
        elif what == "home" and not self.bench.snapshot.tripped:
            # It takes effect while it runs.
            self.oracle.command(_HOME)
        with contextlib.suppress(WinchkitError):
            {
                "home": lambda: winch.home(37, at=2.0),
                "tare": winch.tare,
                "stop": winch.stop,
                "stop now": self.bench.stop_now,
            }[what]()

    @precondition(lambda self: self.bench is not None)
    @rule()
    def reset(self) -> None:
        assert self.bench is not None
        self.ended = self.rig.time
        with contextlib.suppress(WinchkitError):
            self.bench.reset()
            self.ended, self.must = self.rig.time, math.inf

    # Processes

    @precondition(lambda self: self.bench is not None)
    @rule(killed=st.booleans())
    def process_ends(self, killed: bool) -> None:
        assert self.bench is not None
        self._release_all()
        bench, self.bench = self.bench, None
        if self.must > self.rig.time:
            # It ends before it can have noticed.
            self.must = math.inf
        if killed:
            self.rig.kill(bench)
            self.oracle.trip()
        else:
            with contextlib.suppress(WinchkitError):
                bench.close()
            self.oracle.trip()
        self.ended = self.rig.time

    @precondition(lambda self: self.bench is None)
    @rule()
    def process_begins(self) -> None:
        self._open()

    # Faults

    @rule(name=st.sampled_from(_FAULTS))
    def fault(self, name: str) -> None:
        if name in _NOTHING_HELPS or (name in _ENABLED_BY_OTHERS and self._out_of_reach()):
            self.oracle.excused = True
        if name in _BLOCKS_STOPS:
            self.oracle.unasked(ESCALATED)
        alone = not self.slave.faults and self.bench is not None
        powered, commanded = self.slave.power.state, self.oracle.time <= self.oracle.allowed
        self.slave.inject(name)
        if alone and self._must_trip(name, powered, commanded=commanded):
            self.must = min(self.must, self.rig.time + _NOTICED)
        if name in _ENABLED_BY_OTHERS:
            # Without a process there is no client to stop it.
            self.oracle.unasked(FIRST_STOP if self.bench is not None else 1e6)

    @rule()
    def mend(self) -> None:
        self.slave.mend_all()
        if self.oracle.excused:
            self.rig.wait(0.5)
            # A command that no trip has ended meanwhile still stands.
            self.oracle.unasked(FIRST_STOP)
            self.oracle.excused = False

    # What the model knows

    def _out_of_reach(self) -> bool:
        """Whether nothing shows this drive's state, and no control word changes it (safety.md)."""
        faults = set(self.slave.faults)
        processes_pdos = self.slave.network.state is Nmt.OPERATIONAL
        serves_sdos = self.slave.network.state is not Nmt.STOPPED and not faults & _NO_SDO
        shown = processes_pdos and not faults & _NO_TPDO
        shown = (
            shown or (serves_sdos and "silent" not in faults)
        ) and "status frozen" not in faults
        obeys = (processes_pdos and not faults & _NO_RPDO) or serves_sdos
        return not shown and ("control word unheeded" in faults or not obeys)

    def _must_trip(self, name: str, before: State, *, commanded: bool) -> bool:
        """Whether this alone is a trip, by what the slave did."""
        if name in _TRIPS_ALWAYS:
            return True
        now = self.slave.power.state
        if name in _ENABLED_BY_OTHERS:
            return not commanded and before is not State.ENABLED and now is State.ENABLED
        return name in _TRIPS_WHILE_ENABLED and before is State.ENABLED and now is not before

    def _later(self, duration: float) -> float:
        """A standstill of this computer is no time in which it could notice anything."""
        return self.must if math.isinf(self.must) else self.must + duration + _NOTICED

    def _open(self) -> None:
        with contextlib.suppress(WinchkitError):
            self.bench = self.rig.open()
        if self.bench is not None:
            self.tripped = bool(self.bench.snapshot.tripped)
            self.oracle.allowed = min(self.oracle.allowed, self.oracle.time)

    def _watch_trips(self) -> None:
        if self.bench is None or self.bench.loop.snapshot is None:
            return
        tripped = bool(self.bench.snapshot.tripped)
        if tripped and not self.tripped:
            self.ended = self.rig.time
            blocked = any(name in self.slave.faults for name in _BLOCKS_STOPS)
            self.oracle.trip(ESCALATED if blocked else FIRST_STOP)
        self.tripped = tripped

    def _commands(self, call: Callable[[], None], lasts: float) -> None:
        tripped = bool(self.bench.snapshot.tripped) or self.rig.time > self.must
        try:
            call()
        except WinchkitError:
            return
        assert not tripped, "a command was accepted while a trip is latched"
        self.oracle.command(lasts)

    def _on_jog(self, key: HeldKey) -> Callable[[], None]:
        def accepted() -> None:
            assert not self.tripped, "a jog was accepted while a trip is latched"
            assert self.rig.time <= self.must, "nothing was latched"
            assert self.ended <= key.first, "a key that was held through a stop or reset moves it"
            self.oracle.command(_JOG)

        return accepted

    def _release_all(self) -> None:
        for key in self.people.values():
            key.release()
        self.people.clear()


NoMotionWithoutCommand.TestCase.settings = settings(
    max_examples=_EXAMPLES,
    stateful_step_count=14,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
TestNoMotionWithoutCommand = NoMotionWithoutCommand.TestCase

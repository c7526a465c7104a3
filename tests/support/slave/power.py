"""The power state machine of CiA 402-2 with the option codes 605Ah to 605Eh and 6007h."""

from __future__ import annotations

from enum import Enum
from typing import Protocol

from slave.dictionary import Dictionary


class State(Enum):
    """States with the bits of the status word that show them."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


_DRIVEN = (State.ENABLED, State.QUICK_STOP, State.FAULT_REACTION)


class Shaft(Protocol):
    """What the state machine needs of the motor."""

    @property
    def at_rest(self) -> bool:
        """Whether it stands still."""


class Power:
    """Takes control words; ``braking`` says which ramp brings the motor to rest.

    ``braking`` is None while the mode of operation drives the motor, "ramp" (6084h) or "quick"
    (6085h) while a stop does.
    """

    def __init__(self, objects: Dictionary, shaft: Shaft) -> None:
        self.objects, self.shaft = objects, shaft
        self.state = State.NOT_READY
        self.word = 0
        self.braking: str | None = None
        self.after: State | None = None
        """The state that a stop under way ends in."""
        self.inhibited = False
        """The enable input or STO is open."""
        self.cause_stands = False
        """Whether the cause of a fault is still there, so that no reset clears it."""
        self.error = 0
        self.cleared = False
        """A fault was reset since this was last asked."""

    @property
    def driven(self) -> bool:
        """Whether the motor has torque."""
        return self.state in _DRIVEN

    @property
    def halted(self) -> bool:
        """Bit 8 of the control word."""
        return bool(self.word & 0x100)

    def power_on(self) -> None:
        """Transitions 0 and 1."""
        self._enter(State.SWITCH_ON_DISABLED)
        self.word = self.error = 0

    def take(self, word: int) -> None:
        """Act on a control word as it comes."""
        rising = word & ~self.word
        self.word = word
        state = self.state
        if state is State.FAULT:
            if rising & 0x80 and not self.cause_stands:
                self._enter(State.SWITCH_ON_DISABLED)
                self.error, self.cleared = 0, True
            return
        if word & 0x80 or state in (State.NOT_READY, State.FAULT_REACTION):
            return
        if not word & 0x02:
            self._disable_voltage(state)
        elif not word & 0x04:
            self._quick_stop(state)
        elif not word & 0x01:
            self._shutdown(state)
        elif not word & 0x08:
            self._switch_on(state)
        else:
            self._enable(state)

    def fail(self, code: int) -> None:
        """Transition 13: a fault with its code of 603Fh."""
        if self.state in (State.FAULT, State.FAULT_REACTION):
            return
        self.error = code
        driven = self.driven
        option = self.objects.get(0x605E, 0, 2)
        self._enter(State.FAULT_REACTION)
        if not driven or option == 0:
            self._enter(State.FAULT)
            return
        self.braking, self.after = ("ramp" if option == 1 else "quick"), State.FAULT

    def drop(self) -> None:
        """Lose torque at once: STO or the enable input."""
        if self.state not in (State.FAULT, State.FAULT_REACTION, State.NOT_READY):
            self._enter(State.SWITCH_ON_DISABLED)

    def force(self, state: State) -> None:
        """Go to a state that nothing led to."""
        self._enter(state)

    def lose_connection(self, code: int) -> None:
        """Do what 6007h says; ``code`` is that of the fault that it may make of it."""
        option = self.objects.get(0x6007, 0, 0)
        if option == 1:
            self.fail(code)
        elif option == 2:
            self._disable_voltage(self.state)
        elif option == 3:
            self._quick_stop(self.state)

    def quick_stop(self) -> None:
        """A quick stop that no control word asked for."""
        self._quick_stop(self.state)

    def advance(self) -> None:
        """End a stop whose motor stands still."""
        if self.braking is not None and self.after is not None and self.shaft.at_rest:
            after, stays = self.after, self.after is self.state
            self.after = None
            if not stays:
                self._enter(after)

    def status(self) -> int:
        """The bits of the status word that belong to the state."""
        volts = 0x10 if self.state not in (State.NOT_READY, State.FAULT) else 0
        return self.state.value | volts

    def _enter(self, state: State) -> None:
        self.state, self.braking, self.after = state, None, None

    def _disable_voltage(self, state: State) -> None:
        if state not in (State.SWITCH_ON_DISABLED, State.FAULT, State.NOT_READY):
            self._enter(State.SWITCH_ON_DISABLED)

    def _quick_stop(self, state: State) -> None:
        if state in (State.READY, State.SWITCHED_ON):
            self._enter(State.SWITCH_ON_DISABLED)
        elif state is State.ENABLED:
            option = self.objects.get(0x605A, 0, 2)
            if option == 0:
                self._enter(State.SWITCH_ON_DISABLED)
                return
            self._enter(State.QUICK_STOP)
            self.braking = "ramp" if option in (1, 5) else "quick"
            self.after = State.QUICK_STOP if option >= 5 else State.SWITCH_ON_DISABLED

    def _shutdown(self, state: State) -> None:
        if (state is State.SWITCH_ON_DISABLED and not self.inhibited) or state is State.SWITCHED_ON:
            self._enter(State.READY)
        elif state is State.ENABLED:
            self._leave(State.READY, self.objects.get(0x605B, 0, 0))

    def _switch_on(self, state: State) -> None:
        if state is State.READY:
            self._enter(State.SWITCHED_ON)
        elif state is State.ENABLED:
            self._leave(State.SWITCHED_ON, self.objects.get(0x605C, 0, 1))

    def _enable(self, state: State) -> None:
        stays = self.objects.get(0x605A, 0, 2) >= 5
        # Bit 3 also leads through 'switched on' where the drive was only ready (CiA 402-2).
        if state in (State.READY, State.SWITCHED_ON) or (state is State.QUICK_STOP and stays):
            self._enter(State.ENABLED)
        elif state is State.ENABLED and self.after is not None:
            self.braking = self.after = None

    def _leave(self, target: State, option: int) -> None:
        """Disable the drive function, at once or after the slow-down ramp."""
        if option == 0:
            self._enter(target)
        else:
            self.braking, self.after = "ramp", target

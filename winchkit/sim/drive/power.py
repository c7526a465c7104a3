"""The power stage of a simulated drive: state machine of CiA 402, and stops."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, IntEnum
from typing import NamedTuple

from winchkit.sim.drive.object_dictionary import ObjectDictionary

FAULT_RESET = 0x0080
HALT = 0x0100
"""Bits 7 and 8 of the control word 6040h (CiA 402)."""


class PowerState(IntEnum):
    """The value is the status word's bits 0 to 3, 5 and 6."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


class PowerCommand(IntEnum):
    """Commands in bits 0 to 3 and 7 of a control word."""

    DISABLE_VOLTAGE = 0
    QUICK_STOP = 1
    SHUTDOWN = 2
    SWITCH_ON = 3
    ENABLE = 4


class PowerTransition(NamedTuple):
    """A row of the table of transitions in CiA 402."""

    number: int
    target: PowerState


TRANSITIONS: dict[tuple[PowerState, PowerCommand], PowerTransition] = {
    (PowerState.SWITCH_ON_DISABLED, PowerCommand.SHUTDOWN): PowerTransition(2, PowerState.READY),
    (PowerState.READY, PowerCommand.SWITCH_ON): PowerTransition(3, PowerState.SWITCHED_ON),
    (PowerState.READY, PowerCommand.ENABLE): PowerTransition(3, PowerState.SWITCHED_ON),
    (PowerState.SWITCHED_ON, PowerCommand.ENABLE): PowerTransition(4, PowerState.OPERATION_ENABLED),
    (PowerState.OPERATION_ENABLED, PowerCommand.SWITCH_ON): PowerTransition(
        5, PowerState.SWITCHED_ON
    ),
    (PowerState.SWITCHED_ON, PowerCommand.SHUTDOWN): PowerTransition(6, PowerState.READY),
    (PowerState.READY, PowerCommand.QUICK_STOP): PowerTransition(7, PowerState.SWITCH_ON_DISABLED),
    (PowerState.READY, PowerCommand.DISABLE_VOLTAGE): PowerTransition(
        7, PowerState.SWITCH_ON_DISABLED
    ),
    (PowerState.OPERATION_ENABLED, PowerCommand.SHUTDOWN): PowerTransition(8, PowerState.READY),
    (PowerState.OPERATION_ENABLED, PowerCommand.DISABLE_VOLTAGE): PowerTransition(
        9, PowerState.SWITCH_ON_DISABLED
    ),
    (PowerState.SWITCHED_ON, PowerCommand.QUICK_STOP): PowerTransition(
        10, PowerState.SWITCH_ON_DISABLED
    ),
    (PowerState.SWITCHED_ON, PowerCommand.DISABLE_VOLTAGE): PowerTransition(
        10, PowerState.SWITCH_ON_DISABLED
    ),
    (PowerState.OPERATION_ENABLED, PowerCommand.QUICK_STOP): PowerTransition(
        11, PowerState.QUICK_STOP_ACTIVE
    ),
    (PowerState.QUICK_STOP_ACTIVE, PowerCommand.DISABLE_VOLTAGE): PowerTransition(
        12, PowerState.SWITCH_ON_DISABLED
    ),
    (PowerState.QUICK_STOP_ACTIVE, PowerCommand.ENABLE): PowerTransition(
        16, PowerState.OPERATION_ENABLED
    ),
}
"""Transitions by command. 0, 1 (boot), 13, 14 (fault) and 15 (reset) need none."""


def command_of(word: int) -> PowerCommand:
    """Decode a control word without the bits that a command ignores."""
    if not word & 0b0010:
        return PowerCommand.DISABLE_VOLTAGE
    if not word & 0b0100:
        return PowerCommand.QUICK_STOP
    if not word & 0b0001:
        return PowerCommand.SHUTDOWN
    return PowerCommand.ENABLE if word & 0b1000 else PowerCommand.SWITCH_ON


_ABORT_FAULT, _ABORT_DISABLE, _ABORT_QUICK_STOP = 1, 2, 3
"""Values of 6007h, abort connection option code (CiA 402)."""
_STAYS = 5
"""Lowest quick-stop option code with which the drive stays in Quick Stop Active."""


class Order(Enum):
    """Order to the motion."""

    OFF = "no torque"
    CUT = "no torque at once, independent of the load"
    FOLLOW = "follow the set-points"
    SLOW_DOWN = "stop on 6084h"
    QUICK_STOP = "stop on 6085h"
    HARD_STOP = "stop on 60C6h, at the current or voltage limit"


RAMPS = {1: Order.SLOW_DOWN, 2: Order.QUICK_STOP, 3: Order.HARD_STOP, 4: Order.HARD_STOP}
"""Ramps of the option codes 605Ah (plus 4 for staying in quick stop), 605Dh and 605Eh."""
_DEFAULTS = {0x605A: 2, 0x605B: 0, 0x605C: 1, 0x605E: 2, 0x6007: 1}
"""Defaults of CiA 402 for missing option codes."""


class PowerStage:
    """State machine of the power stage, driven by control words.

    A ramp is in progress while ``order`` is one of the stops; :meth:`standstill` ends it. A command
    takes effect when it is written: an earlier control word does not move a drive that has stopped.
    """

    def __init__(self, objects: ObjectDictionary, changed: Callable[[PowerState], None]) -> None:
        self._objects = objects
        self._changed = changed
        self.may_enable: Callable[[], bool] = lambda: True
        self.state = PowerState.NOT_READY
        self.order = Order.OFF
        self._after: PowerState | None = None
        self._last_word = 0
        self.cause_persists = False
        """Whether the cause of a fault persists, so that it cannot be reset."""

    def reset(self) -> None:
        """Power on: not ready to switch on."""
        self._last_word = 0
        self._enter(PowerState.NOT_READY)

    def ready(self) -> None:
        """Transition 1: the self-test is over."""
        self._enter(PowerState.SWITCH_ON_DISABLED)

    def control(self, word: int) -> None:
        """Evaluate a control word that was just written."""
        rising = word & ~self._last_word & FAULT_RESET
        self._last_word = word
        if self.state is PowerState.FAULT:
            if rising and not self.cause_persists:
                self._enter(PowerState.SWITCH_ON_DISABLED)
            return
        command = command_of(word)
        if command is PowerCommand.ENABLE and self._ramp_can_be_cancelled():
            self._after, self.order = None, Order.FOLLOW
        self.obey(command)

    def obey(self, command: PowerCommand) -> None:
        """Execute a command, as one of a control word, through every transition that it makes."""
        while self._obey(command):
            pass

    def abort_connection(self) -> None:
        """React to a lost connection by 6007h, except for the fault, which the drive raises."""
        option = self._option(0x6007)
        if option == _ABORT_DISABLE:
            self.obey(PowerCommand.DISABLE_VOLTAGE)
        elif option == _ABORT_QUICK_STOP:
            self.obey(PowerCommand.QUICK_STOP)

    @property
    def faults_on_abort(self) -> bool:
        """Whether a lost connection is a fault by 6007h."""
        return self._option(0x6007) == _ABORT_FAULT

    def fault(self, *, cut: bool = False) -> None:
        """Transition 13, with the reaction of 605Eh or with a ``cut`` of the power, then 14."""
        if self.state in (PowerState.FAULT, PowerState.FAULT_REACTION, PowerState.NOT_READY):
            return
        ramp = RAMPS.get(self._option(0x605E))
        if cut or ramp is None or self.order in (Order.OFF, Order.CUT):
            self._enter(PowerState.FAULT)
            self.order = Order.CUT if cut else Order.OFF
        else:
            self._ramp(ramp, PowerState.FAULT_REACTION, PowerState.FAULT)

    def standstill(self) -> None:
        """End a ramp."""
        after, self._after = self._after, None
        if after is not None:
            self._enter(after)

    def _ramp_can_be_cancelled(self) -> bool:
        return self.state is PowerState.OPERATION_ENABLED and self._after is not None

    def _obey(self, command: PowerCommand) -> bool:
        row = TRANSITIONS.get((self.state, command))
        if row is None:
            return False
        if row.number == 11:
            return self._begin_quick_stop()
        if row.number == 16:
            if self._option(0x605A) < _STAYS:
                return False
            self._enter(row.target)
        elif row.number == 4 and not self.may_enable():
            return False
        elif row.number in (5, 8):
            option = self._option(0x605C if row.number == 5 else 0x605B)
            if option == 1:
                if self._after is not row.target:
                    self._ramp(Order.SLOW_DOWN, self.state, row.target)
                return False
            self._enter(row.target)
        else:
            self._enter(row.target)
        return True

    def _option(self, index: int) -> int:
        return self._objects.number(index, 0, _DEFAULTS[index])

    def _begin_quick_stop(self) -> bool:
        option = self._option(0x605A)
        if option < 0:
            return False
        if option == 0:
            self._enter(PowerState.SWITCH_ON_DISABLED)
        elif option < _STAYS:
            self._ramp(RAMPS[option], PowerState.QUICK_STOP_ACTIVE, PowerState.SWITCH_ON_DISABLED)
        else:
            self._ramp(RAMPS[option - 4], PowerState.QUICK_STOP_ACTIVE, None)
        return True

    def _ramp(self, order: Order, state: PowerState, after: PowerState | None) -> None:
        self.order, self._after = order, after
        self._set(state)

    def _enter(self, state: PowerState) -> None:
        self.order = Order.FOLLOW if state is PowerState.OPERATION_ENABLED else Order.OFF
        self._after = None
        self._set(state)

    def _set(self, state: PowerState) -> None:
        if state is not self.state:
            self.state = state
            self._changed(state)

"""What the slave can do wrong, as a table: every row is a switch that can be set at any time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from slave.frames import Frame
from slave.network import Nmt
from slave.power import State

if TYPE_CHECKING:
    from slave.slave import Slave

_EVERYTHING = frozenset({"nmt", "sync", "rpdo", "sdo", "heartbeat", "guarding", "other"})


@dataclass(frozen=True)
class Fault:
    """A row: what is not heard, what is not sent, what happens once, or what the code asks for."""

    name: str
    meaning: str
    value: Any = True
    """What ``inject`` sets where it is given none."""
    unheard: frozenset[str] = frozenset()
    """Kinds of received frames that are lost; a set of numbers as value names the RPDOs."""
    unsent: frozenset[str] = frozenset()
    """Kinds of sent frames that are lost; a set of numbers as value names the TPDOs."""
    unwatched: bool = False
    """The slave's own monitoring of the host fails too."""
    begin: Callable[[Slave, Any], None] | None = None
    end: Callable[[Slave], None] | None = None
    lasts: bool = True
    """Whether it stands until it is mended; else it happens once."""


def _inhibit(slave: Slave, _value: Any) -> None:
    slave.power.inhibited = True
    slave.power.drop()


def _release(slave: Slave) -> None:
    slave.power.inhibited = False


def _from_second_master(*words: int) -> Callable[[Slave, Any], None]:
    """Control words by SDO, on the same bus as those of the host."""

    def write(slave: Slave, _value: Any) -> None:
        for word in words:
            data = b"\x2b\x40\x60\x00" + word.to_bytes(2, "little") + b"\0\0"
            slave.receive(Frame(0x600 + slave.node, data))

    return write


def _nmt(command: int) -> Callable[[Slave, Any], None]:
    def send(slave: Slave, _value: Any) -> None:
        slave.receive(Frame(0x000, bytes((command, slave.node))))

    return send


def _enable(slave: Slave, _value: Any) -> None:
    slave.power.word = 0x0F
    slave.power.force(State.ENABLED)


def _change_mode(slave: Slave, value: Any) -> None:
    slave.motion.select(int(value))


def _emergency(slave: Slave, value: Any) -> None:
    slave.emergency.report(int(value), 0x01)


def _fail(slave: Slave, value: Any) -> None:
    slave.power.cause_stands = True
    slave.fail(int(value))


def _cause_ends(slave: Slave) -> None:
    slave.power.cause_stands = False


def _switch_off(slave: Slave, _value: Any) -> None:
    slave.power.drop()


def _lose_mapping(slave: Slave, _value: Any) -> None:
    """The communication profile area has its values of power-on, and nothing was said of it."""
    slave.objects.restart(0x1000, 0x1FFF)
    slave.pdos.reset()


def _near_wrap(slave: Slave, value: Any) -> None:
    """Shift the counter so that it wraps ``value`` position units ahead of the motor."""
    top = (1 << slave.motion.declared.counter_bits) // 2 - 1
    slave.motion.offset += top - int(value) - slave.motion.counts()


def _scale_position(slave: Slave, value: Any) -> None:
    """From here on 6064h changes by ``value`` times what the motor turns."""
    slave.motion.scaled = (slave.motor.angle, float(value))


def _unscale_position(slave: Slave) -> None:
    """The counts that the scale has made stay."""
    kept = slave.motion.counts()
    slave.motion.scaled = (0.0, 1.0)
    slave.motion.offset += kept - slave.motion.counts()


def _repeat_content(slave: Slave, _value: Any) -> None:
    slave.stale = {}


def _twin(slave: Slave, _value: Any) -> None:
    slave.begin_twin()


def _end_twin(slave: Slave) -> None:
    slave.twin = None


_ROWS = (
    # Power stage
    Fault("enable input open", "STO or the enable input: no torque", begin=_inhibit, end=_release),
    Fault(
        "second master disables",
        "another master writes 6040h = 0 by SDO",
        begin=_from_second_master(0x00),
        lasts=False,
    ),
    Fault(
        "second master enables",
        "another master writes 6040h = 06h, 07h, 0Fh by SDO",
        begin=_from_second_master(0x06, 0x07, 0x0F),
        lasts=False,
    ),
    Fault("enables itself", "operation enabled without a command", begin=_enable, lasts=False),
    Fault("control word unheeded", "the control word changes nothing"),
    Fault("quick stop ignored", "control words without bit 2 change nothing"),
    Fault("turns while disabled", "the shaft turns at this speed without torque, rad/s", 5.0),
    Fault(
        "drive fault",
        "a fault with this code; its cause stands",
        0x7121,
        begin=_fail,
        end=_cause_ends,
    ),
    Fault(
        "emergency", "EMCY with this code, without a fault", 0x4210, begin=_emergency, lasts=False
    ),
    # Network
    Fault(
        "reboots", "power lost for a moment", begin=lambda slave, _v: slave.power_on(), lasts=False
    ),
    Fault(
        "switched off",
        "no supply: no torque, nothing heard or sent; mended, it boots up",
        unheard=_EVERYTHING,
        unsent=_EVERYTHING | {"tpdo", "emergency"},
        begin=_switch_off,
        end=lambda slave: slave.power_on(),
    ),
    Fault(
        "mapping lost",
        "PDO mapping, 1016h and 1017h have their values of power-on, without a boot-up message",
        begin=_lose_mapping,
        lasts=False,
    ),
    Fault("reset by a stranger", "NMT reset node", begin=_nmt(0x81), lasts=False),
    Fault("stopped by a stranger", "NMT stopped", begin=_nmt(0x02), lasts=False),
    Fault("pre-operational by a stranger", "NMT pre-operational", begin=_nmt(0x80), lasts=False),
    Fault(
        "goes pre-operational",
        "leaves operational by itself",
        begin=lambda slave, _v: slave.network.enter(Nmt.PRE_OPERATIONAL),
        lasts=False,
    ),
    Fault("rpdo unheard", "RPDOs are lost", unheard=frozenset({"rpdo"})),
    Fault("sync unheard", "SYNC is lost", unheard=frozenset({"sync"})),
    Fault("host frames lost", "nothing from the bus comes in", unheard=_EVERYTHING),
    Fault("heartbeat unheard", "the host's heartbeat is lost", unheard=frozenset({"heartbeat"})),
    Fault("guarding unheard", "guarding polls are lost", unheard=frozenset({"guarding"})),
    Fault("nmt unheard", "NMT commands are lost", unheard=frozenset({"nmt"})),
    Fault("sdo unheard", "SDO requests are lost", unheard=frozenset({"sdo"})),
    Fault("tpdo lost", "TPDOs are lost", unsent=frozenset({"tpdo"})),
    Fault("tpdo repeated", "every TPDO is sent twice"),
    Fault("tpdo stale", "TPDOs come with what they had first", begin=_repeat_content),
    Fault("rpdo repeated", "every RPDO is received twice"),
    Fault("heartbeat lost", "the slave's heartbeat is lost", unsent=frozenset({"heartbeat"})),
    Fault("silent", "nothing goes out", unsent=_EVERYTHING | {"tpdo", "emergency"}),
    Fault(
        "off the bus",
        "the cable is pulled: nothing comes in or goes out",
        unheard=_EVERYTHING,
        unsent=_EVERYTHING | {"tpdo", "emergency"},
    ),
    Fault(
        "unresponsive",
        "SYNC alone is heard, nothing is obeyed and nothing monitored",
        unheard=_EVERYTHING - {"sync"},
        unwatched=True,
    ),
    Fault("monitoring fails", "the slave does not mind a silent host", unwatched=True),
    Fault("sdo refused", "every SDO request is aborted with this code", 0x08000022),
    Fault("sdo delayed", "SDO replies come this late, s", 0.3),
    Fault("two nodes with one number", "a second node answers too", begin=_twin, end=_end_twin),
    # Motion and feedback
    Fault("follows wrongly", "the motor does this multiple of what it is told", -1.0),
    Fault("driven by its load", "the enabled motor turns at this speed whatever it is told", 7.0),
    Fault(
        "position scaled",
        "6064h changes by this multiple of the motor's turns",
        2.0,
        begin=_scale_position,
        end=_unscale_position,
    ),
    Fault("velocity scaled", "606Ch is this multiple of the motor's speed", 2.0),
    Fault("status lies", "6041h shows these state bits whatever the state is", 0x27),
    Fault("mode lies", "6061h shows this mode, another one acts", 3),
    Fault(
        "counter begins anew",
        "an incremental encoder: after power-on or a reset of the node 6064h has this value",
        0,
    ),
    Fault("homing forgotten", "bits 10 and 12 of 6041h are clear once it is disabled"),
    Fault("home offset ignored", "a homing sets 6064h to zero whatever 607Ch is"),
    Fault("velocity stuck", "606Ch no longer changes"),
    Fault("position stuck", "6064h no longer changes"),
    Fault("status frozen", "6041h no longer changes"),
    Fault("mode changed", "another mode than it was given", 3, begin=_change_mode, lasts=False),
    Fault(
        "position wraps",
        "6064h wraps after this many position units",
        1000,
        begin=_near_wrap,
        lasts=False,
    ),
)

FAULTS: dict[str, Fault] = {row.name: row for row in _ROWS}

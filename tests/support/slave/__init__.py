"""A CANopen slave with a CiA 402 drive that shares no code with winchkit.

It is written from CiA 301 and CiA 402-2 and is an independent oracle: tests judge the stack by
what this slave's shaft truly does.
"""

from slave.dictionary import Dictionary, read
from slave.faults import FAULTS
from slave.frames import Frame
from slave.motor import Declared
from slave.network import Nmt
from slave.power import State
from slave.slave import Reactions, Slave

__all__ = [
    "FAULTS",
    "Declared",
    "Dictionary",
    "Frame",
    "Nmt",
    "Reactions",
    "Slave",
    "State",
    "read",
]

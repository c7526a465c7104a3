"""The EDS of the generic drive with the event timer of RPDO 1 (CiA 301, 1400h sub-index 5)."""

from __future__ import annotations

_EVENT_TIMER = """\
[1400sub5]
ParameterName=Event timer
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue=0
PDOMapping=0

"""


def with_event_timer(eds: str) -> str:
    """The text of an EDS, 1400h sub-index 5 before its section 1401."""
    head, found, tail = eds.partition("[1401]\n")
    assert found
    return head + _EVENT_TIMER + found + tail

"""What ``winchkit check`` says of a drive's device file and the EDS that it names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.schema.device import DeviceSpec

if TYPE_CHECKING:
    from winchkit.errors import Fault

__all__ = ["faults_and_warnings"]


def faults_and_warnings(value: object) -> tuple[tuple[Fault, ...], tuple[Fault, ...]]:
    """Faults and warnings of a drive; none of anything else. Raises FileError."""
    if not isinstance(value, DeviceSpec) or value.servo is None:
        return (), ()
    from winchkit.drivers.can.eds import check_drive

    report = check_drive(value)
    return report.faults, report.warnings

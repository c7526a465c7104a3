"""Which objects of a dictionary are settings, whatever an EDS says about access."""

from __future__ import annotations

from canopen.objectdictionary import ObjectDictionary, ODVariable, datatypes

from winchkit.drivers.can.tools.config import settings

OUTPUTS = (
    *(0x1001, 0x1002, 0x603F, 0x6041, 0x6061, 0x6062, 0x6063, 0x6064, 0x6069, 0x606B, 0x606C),
    *(0x6074, 0x6077, 0x6078, 0x6079, 0x60B9, 0x60BA, 0x60E4, 0x60F4, 0x60FA, 0x60FC, 0x60FD),
    0x6502,
)
"""Read-only in CiA 402-2 and CiA 301."""
KEPT = (0x6065, 0x606D, 0x6072, 0x6075, 0x6076, 0x607C, 0x6081, 0x6085, 0x60E0, 0x60E1)
"""Windows, limits, rated values, ramps."""


def test_outputs_of_a_drive_are_no_settings_although_an_eds_declares_them_rw() -> None:
    dictionary = ObjectDictionary()
    for index in (*OUTPUTS, *KEPT):
        variable = ODVariable(f"object {index:04X}", index)
        variable.data_type, variable.access_type = datatypes.INTEGER32, "rw"
        dictionary.add_object(variable)
    assert {index for index, _ in settings(dictionary)} == set(KEPT)

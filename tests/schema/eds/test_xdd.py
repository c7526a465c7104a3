"""XDD and XDC files: the dictionary of an EDS of the same device, in the XML of CiA 311."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from eds_text import GOOD, written
from winchkit.drivers.can.canopen.node import read_eds, variables
from winchkit.errors import FileError
from winchkit.sim.drive.object_dictionary import read_eds as read_for_simulation

HEAD = """<?xml version="1.0" encoding="utf-8"?>
<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1"
 xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><ISO15745Profile>
<ProfileBody xsi:type="ProfileBody_Device_CANopen"><DeviceIdentity><vendorName>Nobody</vendorName>
<vendorID>0x12</vendorID><productID>3</productID></DeviceIdentity><ApplicationProcess>
"""
OBJECTS = """<CANopenObjectList>
<CANopenObject index="1000" name="Device type" objectType="7" dataType="0007" accessType="ro"
 defaultValue="0x00020192" PDOmapping="no"/>
<CANopenObject index="1001" name="Error register" objectType="7" dataType="0005" accessType="ro"
 PDOmapping="optional"/>
<CANopenObject index="1018" name="Identity" objectType="9" subNumber="2">
<CANopenSubObject subIndex="00" name="Highest sub-index" objectType="7" dataType="0005"
 accessType="ro" defaultValue="1" PDOmapping="no"/>
<CANopenSubObject subIndex="01" name="Vendor" objectType="7" dataType="0007" accessType="ro"
 defaultValue="0x12" PDOmapping="no"/></CANopenObject>
<CANopenObject index="1014" name="COB-ID EMCY" objectType="7" dataType="0007" accessType="rw"
 defaultValue="$NODEID+0x80" PDOmapping="no"/>
POSITION
</CANopenObjectList>"""
POSITION = """<CANopenObject index="6064" name="Position actual value" objectType="7"
 dataType="0004" accessType="ro" lowLimit="-5" highLimit="0x7FFFFFFF" PDOmapping="TPDO"/>"""
BY_REFERENCE = """<CANopenObject index="6064" name="Position actual value" objectType="7"
 uniqueIDRef="UID_6064" PDOmapping="TPDO"/>"""
PARAMETER = """<parameterList><parameter uniqueID="UID_6064"><label lang="en">x</label><DINT/>
<allowedValues><range><minValue value="-5"/><maxValue value="0x7FFFFFFF"/></range></allowedValues>
</parameter></parameterList>"""
TAIL = """<NetworkManagement><CANopenGeneralFeatures nrOfTxPDO="4"/></NetworkManagement>
</ProfileBody></ISO15745Profile></ISO15745ProfileContainer>
"""


def text(position: str = POSITION, parameters: str = "") -> str:
    between = """</ApplicationProcess></ProfileBody></ISO15745Profile><ISO15745Profile>
<ProfileBody xsi:type="ProfileBody_CommunicationNetwork_CANopen">"""
    return HEAD + parameters + between + OBJECTS.replace("POSITION", position) + TAIL


def described(path: Path) -> dict[tuple[int, int], tuple[object, ...]]:
    dictionary, warnings = read_eds(path, 5)
    assert warnings == ()
    assert dictionary.device_information.vendor_number == 0x12
    assert dictionary.device_information.product_number == 3
    assert dictionary.device_information.nr_of_TXPDO == 4
    keys = ("name", "data_type", "access_type", "pdo_mappable", "default", "min", "max")
    return {
        (one.index, one.subindex): tuple(getattr(one, key) for key in keys)
        for one in variables(dictionary)
    }


@pytest.mark.parametrize(("position", "parameters"), [(POSITION, ""), (BY_REFERENCE, PARAMETER)])
def test_an_xdd_has_the_dictionary_of_the_eds_of_its_device(
    tmp_path: Path, position: str, parameters: str
) -> None:
    path = tmp_path / "drive.xdd"
    path.write_text(text(position, parameters), encoding="utf-8")
    assert described(path) == described(written(tmp_path, GOOD))
    assert (
        read_for_simulation(path, 5).keys()
        == read_for_simulation(written(tmp_path, GOOD), 5).keys()
    )


def test_an_xdc_has_the_values_of_the_device_as_it_is_set_up(tmp_path: Path) -> None:
    path = tmp_path / "drive.xdc"
    set_up = POSITION.replace("<CANopenObject", '<CANopenObject actualValue="-3"')
    path.write_text(text(set_up), encoding="utf-8")
    assert read_eds(path, 5)[0][0x6064].value == -3


@pytest.mark.parametrize(("way", "access"), [("TPDO", "rwr"), ("RPDO", "rww"), ("optional", "rw")])
def test_the_direction_of_a_mapping_is_the_access_of_cia_306(
    tmp_path: Path, way: str, access: str
) -> None:
    path = tmp_path / "drive.xdd"
    position = POSITION.replace('"ro"', '"rw"').replace('"TPDO"', f'"{way}"')
    path.write_text(text(position), encoding="utf-8")
    assert read_eds(path, 5)[0][0x6064].access_type == access


@pytest.mark.parametrize(
    ("content", "at", "said"),
    [
        ("<EtherCATInfo/>", "<", "is XML of <EtherCATInfo>"),
        ("<ISO15745ProfileContainer/>", "<", "has no CANopenObject"),
        (text()[:-9], "</ISO15745Profile></", "is not well-formed XML"),
        ('<!DOCTYPE a [<!ENTITY b "c">]>\n<a>&b;</a>', "<", "declares entities"),
        (
            text(POSITION.replace("6064", "position")),
            '<CANopenObject index="p',
            "is no index of an object",
        ),
        (
            text(POSITION.replace('dataType="0004"', "")),
            '<CANopenObject index="6064',
            "has no DataType",
        ),
    ],
)
def test_what_is_no_xdd_is_refused_with_its_line(
    tmp_path: Path, content: str, at: str, said: str
) -> None:
    path = tmp_path / "drive.xdd"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(FileError, match=said) as refused:
        read_eds(path, 5)
    assert refused.value.faults[0].line == 1 + content.count("\n", 0, content.index(at))


def test_a_parameter_that_is_missing_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "drive.xdd"
    path.write_text(text(POSITION.replace("index=", 'uniqueIDRef="none" index=')), encoding="utf-8")
    _, warnings = read_eds(path, 5)
    assert ["refers to parameter 'none'" in fault.message for fault in warnings] == [True]


@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.integers(0, len(text()) - 1), st.integers(1, 40), st.text(max_size=10))
def test_no_damage_is_a_traceback(tmp_path: Path, place: int, length: int, other: str) -> None:
    path = tmp_path / "drive.xdd"
    damaged = text()[:place] + other + text()[place + length :]
    path.write_text(damaged, encoding="utf-8", errors="replace")
    try:
        read_eds(path, 5)
    except FileError as error:
        assert all(fault.path == str(path) for fault in error.faults)  # noqa: PT017

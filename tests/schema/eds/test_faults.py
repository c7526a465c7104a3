"""EDS files that are not as they should be: read with a warning, or refused with their line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from eds_text import GOOD, written
from winchkit import catalog
from winchkit.drivers.can.canopen.node import read_eds
from winchkit.errors import Fault, FileError
from winchkit.schema.eds.eds import read_eds_text
from winchkit.sim.drive.object_dictionary import read_eds as read_for_simulation


def line_of(text: str, part: str) -> int:
    """Number of the last line that begins with ``part``."""
    rows = [number for number, row in enumerate(text.split("\n"), 1) if row.startswith(part)]
    return rows[-1]


def test_a_file_in_order_has_no_warnings(tmp_path: Path) -> None:
    dictionary, warnings = read_eds(written(tmp_path, GOOD), 5)
    assert warnings == ()
    assert dictionary[0x1014].default == 0x85
    assert dictionary[0x6064].min == -5
    assert dictionary[0x1018][1].default == 0x12
    assert dictionary.device_information.vendor_number == 0x12


@pytest.mark.parametrize("name", catalog.names("devices"))
def test_the_files_that_we_ship_have_no_warnings(name: str) -> None:
    for path in catalog.find("devices", name).parent.glob("*.eds"):
        assert read_eds_text(path).warnings == ()


MENDED: list[tuple[str, str, str, str]] = [
    # replaced text, replacement, reported line, and message
    ("VendorNumber=0x12", "VendorNumber=", "VendorNumber", "is empty; taken as 0"),
    ("ProductNumber=3", "ProductNumber=three", "ProductNumber", "'three' is not a number"),
    ("[DeviceInfo]", "[DeviceInformation]", "[FileInfo]", "[DeviceInfo] is missing"),
    ("NrOfTXPDO=4", "NrOfTXPDO=4\nNrOfTXPDO=4", "NrOfTXPDO", "stands twice"),
    ("SupportedObjects=3", "SupportedObjects=4", "SupportedObjects=4", "but 3 are listed"),
    ("SupportedObjects=2", "", "[OptionalObjects]", "SupportedObjects is missing"),
    ("2=0x6064", "2=0x6065", "2=0x6065", "lists 6065h, which has no section"),
    ("2=0x6064", "2=0x6065", "[6064]", "is in no list of objects"),
    ("2=0x1001", "2=one", "2=one", "is not an index"),
    ("SubNumber=2", "SubNumber=7", "SubNumber", "SubNumber is 7, but 2 sub-indices follow"),
    ("SubNumber=2", "SubNumber=", "SubNumber", "SubNumber is empty, but 2"),
    ("DataType=0x0004", "DataType=0x0017", "DataType=0x0017", "data type 17h is unknown"),
    ("DataType=0x0004", "DataType=0x00A0", "DataType=0x00A0", "a structure of the maker's"),
    ("LowLimit=-5", "LowLimit=low", "LowLimit", "'low' is not a number; left out"),
    ("LowLimit=-5", "LowLimit=0x123456789", "LowLimit", "does not fit into 32 bits"),
    ("DefaultValue=$NODEID+0x80", "DefaultValue=$NODEID+x", "DefaultValue=$N", "is not a number"),
    ("PDOMapping=1\n[Man", "PDOMapping=yes\n[Man", "PDOMapping=yes", "taken as 0"),
    ("AccessType=rw", "AccessType=full", "AccessType=full", "'full' is none of ro, rw"),
    ("AccessType=rw\n", "", "[1014]", "no AccessType; taken as ro"),
    ("ParameterName=Vendor\n", "", "[1018sub1]", "has no ParameterName"),
    (
        "[1018]\nParameterName=Identity\nObjectType=0x9\nSubNumber=2\n",
        "",
        "[1018sub0]",
        "no [1018]",
    ),
    ("[1001]\n", "[1001]\nan odd line\n", "an odd line", "neither a section nor key=value"),
    ("[6064]", "[6064sub1]\nDataType=5\n[6064]", "[6064sub1]", "[6064] is one value"),
    ("[6064]", "[6064Name]\n1=x\n[6064]", "[6064Name]", "names no compact array's entries"),
    ("[6064]", "[DummyUsage]\nDummy0001=2\n[6064]", "Dummy0001", "neither 0 nor 1"),
    ("NrOfTXPDO=4", "NrOfTXPDO=4\nNrOfTXPDO=8", "NrOfTXPDO=8", "not used, the first counts"),
    ("2=0x1001", "2=0x1001\n2=0x1008", "2=0x1008", "has number 2 twice"),
    ("2=0x1001", "²=0x1001\n²=0x1008", "²=0x1008", "has number ² twice"),
    ("2=0x1001", f"{'9' * 5000}=0x1001\n{'9' * 5000}=2", "9" * 5000 + "=2", "twice, here"),
    ("[1000]", "[Comments]\nLines=1\n[Comments]\nLines=2\n[1000]", "[Comm", "a second time"),
]


@pytest.mark.parametrize(("old", "new", "place", "said"), MENDED)
def test_what_can_be_mended_is_read_with_a_warning(
    tmp_path: Path, old: str, new: str, place: str, said: str
) -> None:
    assert old in GOOD
    text = GOOD.replace(old, new)
    path = written(tmp_path, text)
    dictionary, warnings = read_eds(path, 5)
    assert dictionary[0x1000].default == 0x20192
    assert 0x6064 in dictionary
    told = [fault for fault in warnings if said in fault.message]
    assert told, [str(fault) for fault in warnings]
    line = line_of(text, place)
    assert str(told[0]).startswith(f"{path}:{line}: "), (line, str(told[0]))
    assert (0x1000, 0) in read_for_simulation(path, 5)


def test_numbers_with_leading_zeros_are_read(tmp_path: Path) -> None:
    """As editors of object dictionaries write them; a digit 8 or 9 makes one decimal."""
    text = GOOD.replace("SupportedObjects=3", "SupportedObjects=0003").replace(
        "ObjectType=0x9\nSubNumber=2", "ObjectType=09\nSubNumber=002"
    )
    text = text.replace("DataType=0x0004", "DataType=0004").replace("LowLimit=-5", "LowLimit=0009")
    text = text.replace("VendorNumber=0x12", "VendorNumber=0018").replace("+0x80", "+0128")
    dictionary, warnings = read_eds(written(tmp_path, text), 5)
    assert dictionary.device_information.vendor_number == 18
    assert dictionary[0x6064].data_type == 4
    assert dictionary[0x6064].min == 9
    assert dictionary[0x1014].default == 128 + 5
    assert len(dictionary[0x1018]) == 2
    # 0x12 as the default of 1018h:1 is 18 too.
    assert not [str(fault) for fault in warnings if "0018" not in fault.message]
    assert (0x6064, 0) in read_for_simulation(written(tmp_path, text), 5)


@pytest.mark.parametrize("spell", [str.upper, str.lower])
def test_sections_in_any_case(tmp_path: Path, spell: Callable[[str], str]) -> None:
    text = re.sub(r"\[[A-Za-z]+\]", lambda found: spell(found[0]), GOOD)
    dictionary, warnings = read_eds(written(tmp_path, text), 5)
    assert warnings == ()
    assert dictionary.device_information.vendor_number == 0x12
    assert dictionary.device_information.product_number == 3


@pytest.mark.parametrize(
    ("commissioned", "value", "of_node_9", "said"),
    [
        ("", "0x85", 0x89, "it is of node 5, read as $NODEID+0x80"),
        ("[DeviceComissioning]\nNodeID=5\n", "0x85", 0x89, "it is of node 5"),
        ("[DeviceCommissioning]\nNodeId=0x7\n", "0x85", 0x85, "every node, 7 included"),
        ("", "0x80000085", 0x80000089, "it is of node 5, read as $NODEID+0x80000080"),
        ("", "0x700", 0x700, "the same for every node"),
        ("", "$NODEID+0x90", 0x99, ""),
    ],
)
def test_a_value_of_one_node_stands_against_a_default_of_any(
    tmp_path: Path, commissioned: str, value: str, of_node_9: int, said: str
) -> None:
    text = GOOD.replace("+0x80\n", f"+0x80\nParameterValue={value}\n") + commissioned
    dictionary, warnings = read_eds(written(tmp_path, text), 9)
    assert dictionary[0x1014].value == of_node_9
    assert [fault.line for fault in warnings] == [line_of(text, "ParameterValue")] * bool(said)
    assert all(said in fault.message for fault in warnings)


def test_every_reader_has_a_dictionary_of_its_own_of_the_file_as_it_is_now(tmp_path: Path) -> None:
    first, _ = read_eds(written(tmp_path, GOOD), 5)
    del first[0x1014]
    assert 0x1014 in read_eds(written(tmp_path, GOOD), 5)[0]
    assert "VendorNumber=0x12\n" in GOOD
    changed = GOOD.replace("VendorNumber=0x12\n", "VendorNumber=0x13\n")
    assert read_eds(written(tmp_path, changed), 5)[0].device_information.vendor_number == 0x13


def test_the_same_section_twice_counts_once(tmp_path: Path) -> None:
    section = GOOD[GOOD.index("[1001]") : GOOD.index("[1018]")]
    text = GOOD + section
    dictionary, warnings = read_eds(written(tmp_path, text), 5)
    first = line_of(GOOD, "[1001]")
    assert [(fault.line, fault.message) for fault in warnings] == [
        (line_of(text, "[1001]"), f"[1001] stands a second time, as on line {first}")
    ]
    assert dictionary[0x1001].name == "Error register"


def test_sections_in_any_order_and_spelling(tmp_path: Path) -> None:
    parts = [f"[{part}" for part in GOOD.split("[") if part]
    text = "; a comment\n" + "".join(reversed(parts)).replace("[1018sub1]", "[1018SUB01]")
    text = text.replace("\n", "\r\n")
    path = tmp_path / "drive.eds"
    path.write_bytes(text.encode())
    dictionary, warnings = read_eds(path, 5)
    assert warnings == ()
    assert dictionary[0x1018][1].default == 0x12


def test_comments_behind_values_and_indented_lines(tmp_path: Path) -> None:
    text = GOOD.replace("DataType=0x0004", "  DataType = 0x0004 ; INTEGER32")
    dictionary, warnings = read_eds(written(tmp_path, text), 5)
    assert warnings == ()
    assert dictionary[0x6064].data_type == 4


def test_other_alphabets_are_latin_1_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_bytes(GOOD.replace("Nobody", "Böse").encode("latin-1"))
    dictionary, warnings = read_eds(path, 5)
    assert str(warnings[0]) == f"{path}:4: byte F6h is not UTF-8; read as Latin-1"
    assert dictionary.device_information.vendor_name == "Böse"


def test_bits_of_a_negative_default_are_a_negative_number(tmp_path: Path) -> None:
    text = GOOD.replace("LowLimit=-5", "DefaultValue=0xFFFFFFFE")
    entries = read_for_simulation(written(tmp_path, text), 5)
    assert entries[0x6064, 0].default == -2


def test_an_object_twice_under_two_names_is_one_object(tmp_path: Path) -> None:
    """Names are not used: the first section counts."""
    section = GOOD[GOOD.index("[1001]") : GOOD.index("[1018]")]
    dictionary, warnings = read_eds(written(tmp_path, GOOD + section.replace("Error", "An")), 5)
    assert dictionary[0x1001].name == "Error register"
    assert "what differs is not used" in warnings[0].message


def test_a_makers_object_that_is_two_things_is_left_out(tmp_path: Path) -> None:
    own = "[2001]\nParameterName=Own\nDataType={}\nAccessType=ro\n"
    text = GOOD + own.format(4) + own.format(7)
    dictionary, warnings = read_eds(written(tmp_path, text), 5)
    assert 0x2001 not in dictionary
    assert "the object is left out" in warnings[0].message


def test_both_lists_of_one_name_count(tmp_path: Path) -> None:
    """6064h stands in the second list only; both lists number their entry 1."""
    text = GOOD.replace("1=0x1014\n2=0x6064", "1=0x1014")
    text += "[OptionalObjects]\nSupportedObjects=1\n1=0x6064\n"
    _, warnings = read_eds(written(tmp_path, text), 5)
    assert [item.message for item in warnings] == [
        "[OptionalObjects] stands a second time; its entries are added to those of line 40"
    ]


def test_keys_count_in_any_spelling(tmp_path: Path) -> None:
    text = GOOD.replace("DataType=0x0004", "datatype=0x0004").replace(
        "ParameterName", "PARAMETERNAME"
    )
    dictionary, warnings = read_eds(written(tmp_path, text), 5)
    assert (dictionary[0x6064].data_type, warnings) == (4, ())


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        # data types of CiA 301: 2, 3, 4, 15h are signed of 8, 16, 32, 64 bits; 7 is UNSIGNED32
        (0x4, "0xFFFFFFFE", -2),
        (0x4, "0x7FFFFFFF", 2**31 - 1),
        (0x4, "0x80000000", -(2**31)),
        (0x4, "-2", -2),
        (0x2, "0xFD", -3),
        (0x3, "0xFFFF", -1),
        (0x15, "0xFFFFFFFFFFFFFFFF", -1),
        (0x7, "0xFFFFFFFE", 2**32 - 2),
        (0x7, "-1", 2**32 - 1),
        (0x4, "010", 8),
    ],
)
@pytest.mark.parametrize("key", ["DefaultValue", "ParameterValue"])
def test_hexadecimal_values_are_the_bits_of_their_type(
    tmp_path: Path, kind: int, text: str, value: int, key: str
) -> None:
    """CiA 306 writes a negative number as the hexadecimal digits of its two's complement."""
    eds = GOOD.replace("DataType=0x0004", f"DataType={kind:#x}\n{key}={text}")
    eds = eds.replace("LowLimit=-5\n", "").replace("HighLimit=0x7FFFFFFF\n", "")
    dictionary, warnings = read_eds(written(tmp_path, eds), 5)
    variable = dictionary[0x6064]
    assert (variable.default if key == "DefaultValue" else variable.value) == value
    # A number with a leading zero is octal by CiA 306, and often meant to be decimal.
    assert all("010 begins with 0" in warning.message for warning in warnings)
    assert len(warnings) == (text == "010")


def test_the_node_number_counts_in_any_spelling(tmp_path: Path) -> None:
    text = GOOD.replace("$NODEID+0x80", "$NodeID+0x80")
    dictionary, warnings = read_eds(written(tmp_path, text), 5)
    assert (dictionary[0x1014].default, dictionary[0x1014].relative, warnings) == (0x85, True, ())


REFUSED: list[tuple[str, str, str, str]] = [
    ("DataType=0x0004", "DataType=INT32", "DataType=INT32", "'INT32' is not a number"),
    ("DataType=0x0004\n", "", "[6064]", "has no DataType"),
    ("[1001]", "[1001", "[1001", "is not a section; it should read [name]"),
    ("ObjectType=0x9", "ObjectType=record", "ObjectType=record", "'record' is not a number"),
    ("ProductNumber=3", "ProductNumber=3\nProductNumber=8", "ProductNumber=8", "'8' here and '3'"),
    ("DataType=0x0004", "DataType=0x0004\nDataType=7", "DataType=7", "'7' here and '0x0004'"),
    ("[OptionalObjects]", "[1001]\nDataType=7\n[OptionalObjects]", "[1001]", "differs from line"),
]


@pytest.mark.parametrize(("old", "new", "place", "said"), REFUSED)
def test_what_would_be_a_guess_is_refused(
    tmp_path: Path, old: str, new: str, place: str, said: str
) -> None:
    text = GOOD.replace(old, new)
    path = written(tmp_path, text)
    for read in (lambda: read_eds(path, 5), lambda: read_for_simulation(path, 5)):
        with pytest.raises(FileError) as refused:
            read()
        assert refused.value.exit_code == 3
        (fault,) = refused.value.faults
        assert str(fault).startswith(f"{path}:{line_of(text, place)}: ")
        assert said in fault.message


def test_all_faults_of_a_file_are_reported_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("DataType=0x0004", "DataType=x").replace("ObjectType=0x9", "ObjectType=y")
    with pytest.raises(FileError) as refused:
        read_eds(written(tmp_path, text), 5)
    assert len(refused.value.faults) == 2


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", ":1: is not an EDS: it has no sections"),
        (b"; only a comment\n", ":1: is not an EDS: it has no sections"),
        (b"\n\nhello = 3\n", ":3: is not an EDS: expected a section"),
        (b"<?xml version='1.0'?>\n", ":2: is not well-formed XML: no element found"),
        (b"[FileInfo]\n\x00\x01\x02", ":2: is binary, not the text of an EDS"),
    ],
)
def test_what_is_no_eds_at_all_is_refused(tmp_path: Path, data: bytes, said: str) -> None:
    path = tmp_path / "drive.eds"
    path.write_bytes(data)
    with pytest.raises(FileError) as refused:
        read_eds(path, 5)
    assert str(refused.value).startswith(f"{path}{said}")


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.eds", tmp_path):
        with pytest.raises(FileError, match="cannot be read"):
            read_eds(path, 5)


ROWS = GOOD.split("\n")


@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(
        st.tuples(
            st.integers(0, len(ROWS) - 1),
            st.sampled_from(["drop", "twice", "no value", "odd value", "swap", "cut"]),
            st.integers(0, len(ROWS) - 1),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_no_damage_is_a_traceback(tmp_path: Path, damage: list[tuple[int, str, int]]) -> None:
    """Whatever is done to its lines: it is read, or refused with a line in this file."""
    rows = list(ROWS)
    for place, kind, other in damage:
        row = rows[place]
        if kind == "drop":
            rows[place] = ""
        elif kind == "twice":
            rows[place] = f"{row}\n{row}"
        elif kind == "no value":
            rows[place] = row.partition("=")[0] + "="
        elif kind == "odd value":
            rows[place] = row.partition("=")[0] + "=$?"
        elif kind == "swap":
            rows[place], rows[other] = rows[other], row
        else:
            rows[place] = row[: len(row) // 2]
    path = written(tmp_path, "\n".join(rows))
    faults = [*faults_of(read_eds, path), *faults_of(read_for_simulation, path)]
    assert all(fault.path == str(path) and fault.line is not None for fault in faults)


def faults_of(read: Callable[[Path, int], object], path: Path) -> tuple[Fault, ...]:
    try:
        read(path, 5)
    except FileError as error:
        return error.faults
    return ()

"""Reader of XDD and XDC files (CiA 311, the XML form of EDS and DCF) as sections of an EDS.

Tables declare the key of CiA 306 of each XML attribute. An object may refer to a parameter of the
application process (``uniqueIDRef``), which then has its type, access and values.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.parsers import expat

from winchkit.schema.eds.repair import MANDATORY, EdsFindings, Section

_ROOT = "ISO15745ProfileContainer"
_OBJECT = {
    "name": "ParameterName",
    "objectType": "ObjectType",
    "dataType": "DataType",
    "accessType": "AccessType",
    "PDOmapping": "PDOMapping",
    "defaultValue": "DefaultValue",
    "actualValue": "ParameterValue",
    "lowLimit": "LowLimit",
    "highLimit": "HighLimit",
    "subNumber": "SubNumber",
}
"""Attributes of CANopenObject and CANopenSubObject."""
_DEVICE = {
    "vendorName": "VendorName",
    "vendorID": "VendorNumber",
    "productName": "ProductName",
    "productID": "ProductNumber",
}
"""Elements of DeviceIdentity."""
_FEATURES = {"nrOfRxPDO": "NrOfRXPDO", "nrOfTxPDO": "NrOfTXPDO"}
"""Attributes of CANopenGeneralFeatures."""
_TYPES = {
    **{"BOOL": 0x01, "SINT": 0x02, "INT": 0x03, "DINT": 0x04, "LINT": 0x15},
    **{"USINT": 0x05, "UINT": 0x06, "UDINT": 0x07, "ULINT": 0x1B},
    **{"BYTE": 0x05, "CHAR": 0x05, "WORD": 0x06, "DWORD": 0x07, "LWORD": 0x1B},
    **{"REAL": 0x08, "LREAL": 0x11, "STRING": 0x09, "WSTRING": 0x0B, "BITSTRING": 0x0A},
}
"""Elements of a parameter's type, and the data types of CiA 301."""
_ACCESS = {
    **{"const": "const", "read": "ro", "write": "wo", "readWrite": "rw", "noAccess": "ro"},
    **{"readWriteInput": "rwr", "readWriteOutput": "rww"},
}
"""Values of a parameter's ``access``; without it a parameter can be read (CiA 311)."""
_ONE_WAY = {"TPDO": "rwr", "RPDO": "rww"}
"""Access of an object that can be written and is mapped in PDOs of one direction only."""
_MAKERS_OWN = range(0x2000, 0x6000)


@dataclass
class _Element:
    name: str
    line: int
    attributes: dict[str, str]
    parents: tuple[str, ...]
    text: str = ""


def read_xml(text: str, findings: EdsFindings) -> list[Section]:
    """Sections of an XDD or XDC; faults and warnings are added to ``findings``."""
    elements = _elements(text, findings)
    if not elements:
        return []
    if elements[0].name != _ROOT:
        findings.fault(
            elements[0].line,
            f"is XML of <{elements[0].name}>, not the <{_ROOT}> of CiA 311 (ESI files of EtherCAT "
            "are another format): use the maker's EDS, XDD or XDC",
        )
        return []
    parameters = _parameters(elements)
    info = Section("DeviceInfo", elements[0].line)
    sections = [Section("FileInfo", elements[0].line), info]
    index = ""
    for one in elements:
        if one.name == "CANopenObject":
            index = one.attributes.get("index", "")
            sections.append(_object(index.upper(), one, parameters, findings))
        elif one.name == "CANopenSubObject":
            sub = one.attributes.get("subIndex", "")
            name = f"{index.upper()}sub{sub.lstrip('0').upper() or '0'}"
            sections.append(_object(name, one, parameters, findings))
        elif one.name == "CANopenGeneralFeatures":
            _set(info, one, {_FEATURES[k]: v for k, v in one.attributes.items() if k in _FEATURES})
        elif one.name in _DEVICE and "DeviceIdentity" in one.parents:
            _set(info, one, {_DEVICE[one.name]: one.text.strip()})
        elif one.name == "deviceCommissioning":
            node = one.attributes.get("nodeID", one.attributes.get("NodeID", ""))
            sections.append(Section("DeviceComissioning", one.line, {"NodeID": node}))
    if not index:
        findings.fault(
            elements[0].line, "has no CANopenObject: its communication profile is missing"
        )
    sections += _lists([section for section in sections if section.index is not None])
    return sections


def _set(section: Section, element: _Element, values: dict[str, str]) -> None:
    section.values |= values
    section.lines |= dict.fromkeys(values, element.line)


def _elements(text: str, findings: EdsFindings) -> list[_Element]:
    """Elements in the order of the file; none where it is not well-formed."""
    found: list[_Element] = []
    open_ones: list[_Element] = []
    parser = expat.ParserCreate("utf-8", namespace_separator=" ")
    parser.buffer_text = True

    def start(name: str, attributes: dict[str, str]) -> None:
        plain = {
            key.rpartition(" ")[2]: " ".join(value.split()) for key, value in attributes.items()
        }
        parents = tuple(one.name for one in open_ones)
        line = parser.CurrentLineNumber
        element = _Element(name.rpartition(" ")[2], line, plain, parents)
        found.append(element)
        open_ones.append(element)

    def content(data: str) -> None:
        open_ones[-1].text += data

    def refuse(*_declaration: object) -> None:
        findings.fault(parser.CurrentLineNumber, "declares entities, which no XDD needs")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _name: open_ones.pop()
    parser.CharacterDataHandler = content
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        findings.fault(error.lineno, f"is not well-formed XML: {expat.ErrorString(error.code)}")
    return [] if findings.faults else found


def _parameters(elements: list[_Element]) -> dict[str, dict[str, str]]:
    """Parameters of the application process by their identifier, in keys of CiA 306."""
    found: dict[str, dict[str, str]] = {}
    current: dict[str, str] | None = None
    for one in elements:
        if one.name == "parameter":
            current = found.setdefault(one.attributes.get("uniqueID", ""), {})
            access = one.attributes.get("access", "read")
            current["AccessType"] = _ACCESS.get(access, access)
        elif current is None or "parameter" not in one.parents:
            continue
        elif one.parents[-1] == "parameter" and one.name in _TYPES:
            current["DataType"] = f"0x{_TYPES[one.name]:04X}"
        elif one.parents[-1] == "parameter" and one.name in ("defaultValue", "actualValue"):
            current[_OBJECT[one.name]] = one.attributes.get("value", "")
        elif one.name in ("minValue", "maxValue"):
            key = "LowLimit" if one.name == "minValue" else "HighLimit"
            current.setdefault(key, one.attributes.get("value", ""))
    return found


def _object(
    name: str, one: _Element, parameters: dict[str, dict[str, str]], findings: EdsFindings
) -> Section:
    """Section of an object; its own attributes count before those of its parameter."""
    own = {_OBJECT[key]: value for key, value in one.attributes.items() if key in _OBJECT}
    if "DataType" in own:
        own["DataType"] = f"0x{own['DataType'].removeprefix('0x')}"
    reference = one.attributes.get("uniqueIDRef")
    if reference is not None and reference not in parameters:
        findings.warn(one.line, f"[{name}] refers to parameter '{reference}', which is missing")
    values = {**parameters.get(reference or "", {}), **own}
    way = values.get("PDOMapping", "no")
    values["PDOMapping"] = "0" if way == "no" else "1"
    if way in _ONE_WAY and values.get("AccessType") == "rw":
        values["AccessType"] = _ONE_WAY[way]
    section = Section(name, one.line, values)
    section.lines = dict.fromkeys(values, one.line)
    if section.index is None:
        findings.fault(one.line, f"'{name}' is no index of an object (four hexadecimal digits)")
    return section


def _lists(objects: list[Section]) -> list[Section]:
    """The lists of an EDS, which an XDD does not need."""
    found = {name: Section(name, 1) for name in ("Mandatory", "Optional", "Manufacturer")}
    for section in objects:
        if section.sub is not None or section.index is None:
            continue
        kind = "Manufacturer" if section.index in _MAKERS_OWN else "Optional"
        values = found["Mandatory" if section.index in MANDATORY else kind].values
        values[str(len(values) + 1)] = f"0x{section.index:04X}"
    for name, section in found.items():
        section.name = f"{name}Objects"
        section.values["SupportedObjects"] = str(len(section.values))
    return list(found.values())

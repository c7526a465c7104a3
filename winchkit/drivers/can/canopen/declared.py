"""Objects as an EDS or DCF declares them: values, access, and what a PDO can carry."""

from __future__ import annotations

from typing import Any

from canopen.objectdictionary import datatypes

_RPDO, _TPDO, _MAPPING = 0x1400, 0x1800, 0x200


def declared(dictionary: Any, index: int, sub: int = 0) -> Any:
    """The object that the EDS declares; canopen by itself makes up entries of an array."""
    found = dictionary.get(index)
    subs = getattr(found, "subindices", None)
    if subs is not None:
        return subs.get(sub)
    return found if sub == 0 else None


def unmappable(variable: Any, *, receive: bool, real: bool = False) -> str:
    """Reason why an object cannot be mapped into a PDO; empty where it can, `real`: REAL32 too."""
    if variable.data_type not in datatypes.INTEGER_TYPES and not (
        real and variable.data_type in datatypes.FLOAT_TYPES
    ):
        return "it is no whole number"
    if not variable.pdo_mappable:
        return "its PDOMapping is 0 in the EDS"
    wrong = ("ro", "const", "rwr") if receive else ("wo", "rww")
    if variable.access_type in wrong:
        return f"it is {variable.access_type} in the EDS"
    return ""


def fixed_mapping(dictionary: Any, receive: bool, number: int) -> tuple[str, ...] | None:
    """Objects of a PDO whose mapping (its sub-index 0) the EDS declares const, else None."""
    mapping = (_RPDO if receive else _TPDO) + _MAPPING + number - 1
    count = declared(dictionary, mapping)
    if count is None or count.access_type in ("rw", "wo", "rww", "rwr"):
        return None
    return mapped_objects(dictionary, mapping)


def mapped_objects(dictionary: Any, mapping: int) -> tuple[str, ...]:
    """Objects of a mapping record by its default values, or a DCF's own."""
    count = configured_value(declared(dictionary, mapping)) or 0
    entries = (
        configured_value(declared(dictionary, mapping, sub)) or 0 for sub in range(1, count + 1)
    )
    return tuple(_object_text(entry >> 16, entry >> 8 & 0xFF) for entry in entries if entry)


def configured_value(variable: Any) -> int | None:
    """Value of an object: a DCF's own, else the default; None where the file has none."""
    if variable is None:
        return None
    value = getattr(variable, "value", None)
    found = variable.default if value is None else value
    return found if isinstance(found, int) else None


def _object_text(index: int, sub: int) -> str:
    return f"0x{index:04X}:{sub}" if sub else f"0x{index:04X}"


def writable(dictionary: Any, index: int, sub: int = 0) -> bool:
    """Whether the EDS has an object and lets it be written."""
    variable = declared(dictionary, index, sub)
    return variable is not None and bool(variable.writable)

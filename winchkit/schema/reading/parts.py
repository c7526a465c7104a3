"""Parts that several kinds of declaration share, read with every fault collected."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from winchkit.catalog import Kind, find
from winchkit.errors import Fault, FileError
from winchkit.schema.profiles.axis import AxisProfile, LinearAxisProfile
from winchkit.schema.profiles.winch import EffectTable, WinchProfile
from winchkit.schema.reading.lines import Key
from winchkit.schema.reading.source import TomlSource
from winchkit.schema.reading.tables import read_table

T = TypeVar("T")
_PARTS_OF_A_WINCH = "drum", "cable", "path", "guide", "pulley"
_PARTS_OF_A_ROTARY_AXIS: Mapping[tuple[str, ...], str] = {
    ("gearbox",): "belongs to a rotary axis; a linear one has its position without a gearbox",
    ("reference",): "belongs to a rotary axis; positions of a linear one are those of its runs",
    ("motor", "inertia"): "belongs to a rotary axis; the mass of a linear one is the effect "
    "rotor-inertia",
    ("motor", "torque_constant"): "belongs to a rotary axis; a linear one has a force_constant",
}


@dataclass
class FileReading:
    """One file being read: its source and the faults found so far."""

    source: TomlSource
    faults: list[Fault] = field(default_factory=list)

    @property
    def stem(self) -> str:
        """The name of a thing whose file does not name it."""
        return Path(self.source.path).stem

    def fault(self, key: Key, message: str) -> None:
        """Note a fault at a key."""
        self.faults.append(self.source.fault(key, message))

    def table(self, kind: type[T], raw: object, at: Key = ()) -> T | None:
        """Read a table, or note its faults."""
        result = read_table(self.source, kind, raw, at)
        if isinstance(result, list):
            self.faults += result
            return None
        return result

    def refuse_faults(self) -> None:
        """Raise FileError with all faults in line order, if there are any."""
        if self.faults:
            unique = dict.fromkeys(self.faults)
            raise FileError(sorted(unique, key=lambda fault: (fault.path, fault.line or 0)))

    def effects(self, raw: object, at: Key = ()) -> tuple[EffectTable, ...]:
        """Keep ``[[effect]]`` tables unread, each with its line."""
        key: Key = (*at, "effect")
        if not isinstance(raw, list) or not all(isinstance(item, dict) for item in raw):
            self.fault(key, "expected tables, each opened by [[effect]]")
            return ()
        tables = []
        for index, item in enumerate(raw):
            values = dict(item)
            name = values.pop("id", None)
            place: Key = (*key, index)
            if not isinstance(name, str):
                wrong = "missing" if name is None else f"{name!r} is no name"
                self.fault((*place, "id"), f"{wrong}; an effect is named by its id in quotes")
                continue
            line = self.source.fault(place, "").line
            tables.append(EffectTable(name, values, self.source.path, line))
        return tuple(tables)

    def winch(self, raw: Mapping[str, Any], name: str, at: Key = ()) -> WinchProfile | None:
        """Read a winch's own tables."""
        return self.table(WinchProfile, self._with_effects(raw, name, at), at)

    def axis(self, raw: Mapping[str, Any]) -> AxisProfile | None:
        """Read an axis; the parts of a winch are refused with the reason."""
        parts = [key for key in _PARTS_OF_A_WINCH if key in raw]
        for key in parts:
            self.fault((key,), "belongs to a winch; an axis has no drum and no cable")
        own = {key: value for key, value in raw.items() if key not in parts}
        if own.get("motion") != "linear":
            return self.table(AxisProfile, self._with_effects(own, self.stem))
        for rotary, message in _PARTS_OF_A_ROTARY_AXIS.items():
            part, *names = rotary
            table = own.get(part)
            if not names and part in own:
                self.fault(rotary, message)
                del own[part]
            elif names and isinstance(table, Mapping) and names[0] in table:
                self.fault(rotary, message)
                own[part] = {name: value for name, value in table.items() if name != names[0]}
        return self.table(LinearAxisProfile, self._with_effects(own, self.stem))

    def _with_effects(self, raw: Mapping[str, Any], name: str, at: Key = ()) -> dict[str, Any]:
        tree = {"name": name, **raw}
        if "effect" in tree:
            tree["effect"] = self.effects(tree["effect"], at)
        return tree

    def declared(self, kind: Kind, name: object, at: Key, read: Callable[[Path], T]) -> T | None:
        """The declaration that this one names; notes its faults."""
        path = self.shipped(kind, name, at)
        try:
            return None if path is None else read(path)
        except FileError as error:
            self.faults += error.faults
            return None

    def shipped(self, kind: Kind, name: object, at: Key) -> Path | None:
        """The file of a declaration that this one names; notes a fault where there is none."""
        if not isinstance(name, str):
            return None
        try:
            return find(kind, name, beside=self.source.path)
        except FileError as error:
            self.faults += [self.source.fault(at, fault.message) for fault in error.faults]
            return None

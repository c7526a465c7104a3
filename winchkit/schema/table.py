"""Base class of every declared table: unknown keys are refused, and rules relate its keys.

The rules are checked when a file is read, not when code builds a dataclass from SI numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic_core import CoreSchema

Rule = tuple[str, str]
"""A key of the table (dotted, positions in arrays from 0; empty for the table itself) and its
fault."""


class BrokenRules(ValueError):
    """The rules that one table violates; passed from pydantic to the reader."""

    def __init__(self, rules: tuple[Rule, ...]) -> None:
        super().__init__(*rules)
        self.rules = rules


class Table:
    """A table of a file; a dataclass that derives from it yields its violated :meth:`rules`."""

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 - pydantic reads this name

    def rules(self) -> Iterator[Rule]:
        """Yield contradictions between keys that are each valid."""
        yield from ()

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: object, handler: Callable[[Any], CoreSchema]
    ) -> CoreSchema:
        """Make pydantic check the rules after reading the fields."""
        from pydantic_core import core_schema

        return core_schema.no_info_after_validator_function(_obey, handler(source))


def _obey(table: Table) -> Table:
    if broken := tuple(table.rules()):
        raise BrokenRules(broken)
    return table

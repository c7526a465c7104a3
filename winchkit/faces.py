"""Public faces: packages that import each of their names when it is first used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def homes(names: Mapping[str, str]) -> dict[str, str]:
    """Module of each name, from the names (separated by spaces) of each module; sorted."""
    return dict(sorted((name, module) for module, own in names.items() for name in own.split()))


def lazy(
    face: dict[str, Any], home: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of a package with these globals, whose names have homes."""

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module '{face['__name__']}' has no attribute '{name}'")
        value = face[name] = getattr(import_module(home[name]), name)
        return value

    return get, lambda: sorted({*face, *home})

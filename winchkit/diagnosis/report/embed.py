"""JSON for a page: short, and safe inside a script element."""

from __future__ import annotations

import json
from math import isfinite
from typing import Any

__all__ = ["compact", "inline"]


def compact(value: Any, indent: int | None = None) -> str:
    """JSON with null where there is no finite number."""
    separators = (",", ":") if indent is None else (",", ": ")
    plain = _finite(value)
    return json.dumps(
        plain, ensure_ascii=False, allow_nan=False, indent=indent, separators=separators
    )


def inline(value: Any) -> str:
    """JSON that no text in it can end the script element of."""
    text = compact(value)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float):
        return float(value) if isfinite(value) else None
    return value

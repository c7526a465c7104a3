"""winchkit: moves winches, measures tension, and tells which physical effect a model lacks."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from winchkit.version import __version__

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench
    from winchkit.bench.open import open_bench
    from winchkit.bench.remote.session import attach
    from winchkit.runs import read_run

__all__ = ["Bench", "__version__", "attach", "open_bench", "read_run"]

_HOME = {
    "Bench": "winchkit.bench.bench",
    "attach": "winchkit.bench.remote.session",
    "open_bench": "winchkit.bench.open",
    "read_run": "winchkit.runs",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that importing winchkit stays light."""
    if name not in _HOME:
        raise AttributeError(f"module 'winchkit' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

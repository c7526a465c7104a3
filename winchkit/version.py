"""The version of winchkit: the build writes it from the tag (docs/release.md)."""

from __future__ import annotations

from importlib import import_module


def _version() -> str:
    try:
        return str(import_module("winchkit._version").__version__)
    except ModuleNotFoundError:
        # A checkout that was never built or installed. The package's metadata would be those of
        # another installation, and reading them takes as long as all else that --version does.
        return "0+unknown"


__version__ = _version()

"""What a shell offers after Tab: winches, wiring files, devices and programmes."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from winchkit.regular_file import regular

__all__ = ["complete_bench", "complete_device", "complete_programme", "complete_winch"]

_KIND = re.compile(r'^kind\s*=\s*"([\w-]+)"', re.MULTILINE)
_HEAD = 2000
"""Characters of a file in which its kind stands."""


def complete_bench(ctx: click.Context, _param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Wiring files, and folders that may hold some."""
    return _files(typed, ("bench",))


def complete_programme(
    ctx: click.Context, _param: click.Parameter, typed: str
) -> list[CompletionItem]:
    """Programmes in files, and those that are shipped, by name."""
    from winchkit import catalog

    shipped = [path.stem for path in catalog.folder("sim").glob("programme-*.toml")]
    return _names(shipped, typed) + _files(typed, ("programme",))


def complete_device(
    ctx: click.Context, _param: click.Parameter, typed: str
) -> list[CompletionItem]:
    """Shipped devices."""
    from winchkit import catalog

    return _names(catalog.names("devices"), typed)


def complete_winch(ctx: click.Context, param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Winches of the wiring file that stands on the line already, or in the environment."""
    bench = ctx.params.get("bench") or _from_environment(ctx)
    if not bench:
        return []
    try:
        with open(bench, "rb", opener=regular) as file:
            winches = tomllib.load(file).get("winch", {})
    except (OSError, tomllib.TOMLDecodeError):
        return []
    return _names(winches if isinstance(winches, dict) else (), typed)


def _from_environment(ctx: click.Context) -> str | None:
    for option in ctx.command.params:
        if option.name == "bench":
            value = option.value_from_envvar(ctx)
            return value if isinstance(value, str) else None
    return None


def _names(known: Iterable[str], typed: str) -> list[CompletionItem]:
    return [CompletionItem(name) for name in sorted(known) if name.startswith(typed)]


def _files(typed: str, kinds: tuple[str, ...]) -> list[CompletionItem]:
    """TOML files of these kinds, and folders, that begin with what is typed."""
    folder, _, name = typed.rpartition("/")
    lead = f"{folder}/" if "/" in typed else ""
    try:
        here = sorted((Path(lead) if lead else Path()).iterdir())
    except OSError:
        return []
    found = [path for path in here if path.name.startswith(name) and not path.name.startswith(".")]
    folders = [CompletionItem(f"{lead}{path.name}/") for path in found if path.is_dir()]
    files = [
        CompletionItem(f"{lead}{path.name}")
        for path in found
        if path.suffix == ".toml" and path.is_file() and _kind(path) in kinds
    ]
    return files + folders


def _kind(path: Path) -> str:
    """Kind of a declaration by its first lines; empty where it has none."""
    try:
        with open(path, encoding="utf-8", errors="replace", opener=regular) as file:
            found = _KIND.search(file.read(_HEAD))
    except OSError:
        return ""
    return found[1] if found else ""

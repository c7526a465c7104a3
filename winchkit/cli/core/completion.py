"""Completions for a shell: effects, profiles, benches, programmes, devices, runs, winches.

Nothing is imported but the catalogue of shipped files, and no effect is executed: a shell waits for
the answer.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from winchkit.errors import FileError
from winchkit.regular_file import regular

if TYPE_CHECKING:
    from winchkit.catalog import Kind

_KIND = re.compile(r'^kind\s*=\s*"([\w-]+)"', re.MULTILINE)
_HEAD = 2000
"""Characters of a file in which its kind stands."""
_RUNS = (".csv", ".mcap")

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def _completer(
    wanted: Callable[[Path], bool] | None, shipped: Callable[[], Iterable[str]] = tuple
) -> Completer:
    """Names that are shipped, and files that are wanted, with folders that may hold some."""

    def complete(ctx: click.Context, _param: click.Parameter, typed: str) -> list[CompletionItem]:
        return _names(shipped(), typed) + ([] if wanted is None else _files(typed, wanted))

    return complete


def _of_kind(*kinds: str) -> Callable[[Path], bool]:
    return lambda path: path.suffix == ".toml" and _kind(path) in kinds


def _shipped(kind: Kind, *, programmes: bool = False) -> Callable[[], list[str]]:
    """Names of the catalogue, which is imported for a completion only."""

    def names() -> list[str]:
        from winchkit import catalog

        return [n for n in catalog.names(kind) if n.startswith("programme-") is programmes]

    return names


complete_bench = _completer(_of_kind("bench"))
complete_programme = _completer(_of_kind("programme"), _shipped("sim", programmes=True))
complete_sim_bench = _completer(_of_kind("sim-bench"), _shipped("sim"))
complete_profile = _completer(_of_kind("winch", "axis", "robot"), _shipped("profiles"))
complete_device = _completer(None, _shipped("devices"))
complete_run = _completer(lambda path: path.suffix.lower() in _RUNS)
complete_file = _completer(lambda _path: True)


_EFFECT = re.compile(r'^    id="([\w-]+)",$', re.MULTILINE)


def complete_effect(
    ctx: click.Context, _param: click.Parameter, typed: str
) -> list[CompletionItem]:
    """Effects of the catalogue, as their files declare them: nothing heavy is imported."""
    from importlib.resources import files

    folder = Path(str(files("winchkit"))) / "effects"
    texts = (path.read_text(encoding="utf-8") for path in folder.glob("on_*/*.py"))
    return _names((name for text in texts for name in _EFFECT.findall(text)), typed)


def complete_effect_of_profile(
    ctx: click.Context, _param: click.Parameter, typed: str
) -> list[CompletionItem]:
    """Effects that the profile on the line has already; all effects where there is none."""
    from winchkit import catalog

    profile = _given(ctx, "profile")
    if not profile:
        return complete_effect(ctx, _param, typed)
    try:
        effects = _table(catalog.find("profiles", profile)).get("effect", [])
    except FileError:
        return []
    listed = effects if isinstance(effects, list) else []
    return _names((str(e["id"]) for e in listed if isinstance(e, dict) and "id" in e), typed)


def complete_winch(ctx: click.Context, param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Winches of the bench on the line, in the environment, or else of the only bench file here."""
    bench = _given(ctx, "bench")
    if not bench:
        here = files_of_kind(Path(), ("bench",))
        if len(here) != 1:
            return []
        bench = str(here[0])
    winches = _table(Path(bench)).get("winch", {})
    return _names(winches if isinstance(winches, dict) else (), typed)


def files_of_kind(folder: Path, kinds: tuple[str, ...]) -> list[Path]:
    """Declarations of these kinds in a folder, sorted by name."""
    return [path for path in sorted(folder.glob("*.toml")) if _kind(path) in kinds]


def _given(ctx: click.Context, option: str) -> str | None:
    """Value of an option on the line, or in the environment."""
    value = ctx.params.get(option)
    if value is None:
        for param in ctx.command.params:
            if param.name == option:
                value = param.value_from_envvar(ctx)
    return value if isinstance(value, str) and value else None


def _table(path: Path) -> dict[str, Any]:
    """A TOML file; empty where it cannot be read."""
    try:
        with open(path, "rb", opener=regular) as file:
            return tomllib.load(file)
    except (OSError, ValueError):
        return {}


def _names(known: Iterable[str], typed: str) -> list[CompletionItem]:
    return [CompletionItem(name) for name in sorted(known) if name.startswith(typed)]


def _files(typed: str, wanted: Callable[[Path], bool]) -> list[CompletionItem]:
    """Files that are wanted, and folders, that begin with what is typed."""
    folder, _, name = typed.rpartition("/")
    lead = f"{folder}/" if "/" in typed else ""
    try:
        here = sorted((Path(lead) if lead else Path()).iterdir())
    except OSError:
        return []
    found = [path for path in here if path.name.startswith(name) and not path.name.startswith(".")]
    folders = [CompletionItem(f"{lead}{path.name}/") for path in found if path.is_dir()]
    files = [
        CompletionItem(f"{lead}{path.name}") for path in found if path.is_file() and wanted(path)
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

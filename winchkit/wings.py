"""Wings: the packages beside the winch's own, of which the core knows the names only.

A wing imports the core, and the core imports no wing: what it needs of one it looks up here when
it needs it. A type whose objects a wing works on names it (``wing = "robot"``). Each wing has a
module with its declaration; those of ``_OWN`` are this distribution's, that of any other name is
the entry point of this name (group ``winchkit.wings``), which is looked for where no own name fits.

The public names of a package, too, are imported when they are first used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

_OWN = {"robot": "winchkit.robot.wing", "fleet": "winchkit.fleet.wing"}
"""Modules with a declaration ``WING``, in the order in which they are listed."""
_GROUP = "winchkit.wings"


@dataclass(frozen=True)
class Wing:
    """What a wing gives the core; things are ``module:name`` and imported when they are used."""

    kinds: Mapping[str, str] = field(default_factory=dict)
    """Readers of declarations by their kind, as those of :mod:`winchkit.schema.read`."""
    calls: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """By name of the type that decides: functions by name of the call."""
    parts: Mapping[str, str] = field(default_factory=dict)
    """What the core asks for by name."""
    commands: Mapping[str, Mapping[str, tuple[str, str]]] = field(default_factory=dict)
    """By section of ``winchkit --help`` and name: module of the command, and its help."""
    effects: tuple[str, ...] = ()
    """Packages with an effect in each module."""
    renderers: tuple[str, ...] = ()
    """Modules that register renderers of results (:mod:`winchkit.rendering`) when imported."""
    views: tuple[str, ...] = ()
    """Views of the page (:class:`winchkit.web.views.View`)."""


def own() -> Iterator[Wing]:
    """Wings of this distribution."""
    return map(_declared, _OWN)


def others() -> Iterator[Wing]:
    """Wings of other distributions; all metadata of the environment are read for it."""
    from importlib.metadata import entry_points

    return (point.load() for point in entry_points(group=_GROUP))


def reader(kind: str) -> Any:
    """The reader of a kind of declarations; None where no wing has it."""
    for found in (own, others):
        for wing in found():
            if kind in wing.kinds:
                return imported(wing.kinds[kind])
    return None


def call(name: str, of: object) -> Callable[..., Any] | None:
    """The function of a wing for an object of its type; None for the core's own types."""
    if not (named := getattr(type(of), "wing", "")):
        return None
    calls = _declared(named).calls
    for kind in type(of).__mro__:
        if place := calls.get(kind.__name__, {}).get(name):
            function: Callable[..., Any] = imported(place)
            return function
    return None


def part(wing: str, name: str) -> Any:
    """What a wing declares under a name."""
    return imported(_declared(wing).parts[name])


def imported(place: str) -> Any:
    """The thing at ``module:name``."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def _declared(name: str) -> Wing:
    if name in _OWN:
        wing: Wing = import_module(_OWN[name]).WING
        return wing
    from importlib.metadata import entry_points

    return next((point.load() for point in entry_points(group=_GROUP, name=name)), Wing())


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

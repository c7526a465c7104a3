"""Simulated benches: their profiles and hidden effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random

from winchkit import wings
from winchkit.catalog import find, folder, names
from winchkit.errors import FileError, suggest
from winchkit.regular_file import file_kind
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.simbench import HiddenSpec, SimBench
from winchkit.sim.physics.table import build, scaled

_DEMO = "demo-"
_PROGRAMME = "programme-"
_SIZES = (0.8, 1.3)
"""Factors of hidden effects in a random bench: sizes differ from the declared ones by more than any
uncertainty, and stay plausible."""


def profiles_of(bench: SimBench) -> dict[str, WinchProfile]:
    """Read the declared profile of every winch on the bench."""
    from winchkit.schema.read import read_winch

    if bench.platform is not None:
        profiles: dict[str, WinchProfile] = wings.part("robot", "simulated_profiles")(bench)
        return profiles
    return {
        name: read_winch(find("profiles", wiring.profile, beside=bench.bench.path or None))
        for name, wiring in bench.bench.winch.items()
    }


def programme_path(name: str) -> Path:
    """Path of a motion programme: a file, or one shipped beside the benches; raises FileError."""
    for path in (Path(name), folder("sim") / f"{name}.toml"):
        if path.is_file():
            return path
    if Path(name).exists() and (special := file_kind(Path(name).stat().st_mode)):
        raise FileError(f"{name}: is {special}, not a regular file")
    known = [shipped for shipped in names("sim") if shipped.startswith(_PROGRAMME)]
    raise FileError(
        f"there is no motion programme '{name}', neither as a file nor shipped "
        f"({', '.join(known)}){suggest(name, known)}"
    )


def hiding(bench: SimBench, physics: Sequence[str]) -> SimBench:
    """Replace the hidden effects of every winch.

    ``physics``: names, such as ``"elastic rope"`` at its typical size, or with values,
    ``"elastic rope, axial_stiffness=80 kN"``; ``none`` hides nothing. Returns: a copy. Raises
    FileError for an unknown name, with the known ones.
    """
    specs = tuple(_spec(text) for text in physics if text != "none")
    build(specs)
    truth = {name: replace(truth, hidden=specs) for name, truth in bench.truth.items()}
    return replace(bench, truth=truth)


def _spec(text: str) -> HiddenSpec:
    name, *numbers = (part.strip() for part in text.split(","))
    pairs = (number.partition("=") for number in numbers)
    return HiddenSpec(name, {key.strip(): value.strip() for key, _, value in pairs})


def demo_names() -> list[str]:
    """Names of the simulated benches of the demonstration."""
    return [name for name in names("sim") if name.startswith(_DEMO)]


@dataclass(frozen=True)
class ListedEffect:
    """A hidden effect of a simulated bench."""

    physics: str
    answers: tuple[str, ...]
    """Effects of the catalogue that describe it."""


@dataclass(frozen=True)
class ListedBench:
    """A shipped simulated bench."""

    name: str
    """As ``simulate`` and ``--sim`` take it."""
    description: str
    """One line."""
    hidden: Mapping[str, tuple[ListedEffect, ...]]
    """By winch."""


def listed_benches() -> list[ListedBench]:
    """List the shipped simulated benches.

    Returns
    -------
    list of ListedBench
        By name.
    """
    from winchkit.schema.read import load

    rows = []
    for name in names("sim"):
        value = load(find("sim", name)).value
        if isinstance(value, SimBench):
            hidden = {
                winch: tuple(ListedEffect(spec.physics, spec.answers) for spec in truth.hidden)
                for winch, truth in value.truth.items()
            }
            rows.append(ListedBench(name, value.description, hidden))
    return rows


def choose_bench(seed: int) -> SimBench:
    """The demonstration's bench for a seed, all in turn; 0.8 to 1.3 times the declared sizes."""
    from winchkit.schema.read import read_simbench

    known = demo_names()
    if not known:
        raise FileError(f"no simulated bench named {_DEMO}… is installed; reinstall winchkit")
    bench = read_simbench(find("sim", known[seed % len(known)]))
    random = Random(f"demo/{seed}")
    truth = {
        name: replace(
            truth, hidden=tuple(scaled(spec, random.uniform(*_SIZES)) for spec in truth.hidden)
        )
        for name, truth in bench.truth.items()
    }
    return replace(bench, truth=truth)


def choose_hidden(seed: int) -> dict[str, tuple[HiddenSpec, ...]]:
    """Hidden effects of :func:`choose_bench` for a seed, by winch; an empty tuple for none."""
    return {name: truth.hidden for name, truth in choose_bench(seed).truth.items()}

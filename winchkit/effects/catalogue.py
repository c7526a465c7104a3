"""The catalogue: all effects of this package, of entry points and of user files."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache, cached_property
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from pkgutil import iter_modules

from winchkit import wings
from winchkit.arguments import require_types
from winchkit.effects.effect import NEED_WORDS, Effect, Parameter
from winchkit.effects.empirical import EMPIRICAL, LINEAR_IDS
from winchkit.errors import Fault, FileError, UsageError, suggest
from winchkit.model.stages import OUTPUTS
from winchkit.units import UNITS, dimension_of

_ROOMS = (
    "winchkit.effects.on_length",
    "winchkit.effects.on_tension",
    "winchkit.effects.on_torque",
    "winchkit.effects.on_axis",
)


class Catalogue:
    """Effects by id, in a fixed order: simple ones first.

    Empirical effects are found by name and not listed, since a free curve fits any residual. Those
    of the wings are imported when all effects, or one that no winch has, are asked for.
    """

    def __init__(
        self,
        effects: Iterable[Effect],
        of_wings: Callable[[], Sequence[Effect]] = tuple,
        empirical: Mapping[str, Effect] = EMPIRICAL,
    ) -> None:
        self._of_winches = {effect.id: effect for effect in effects}
        self._of_wings = of_wings
        self._empirical = empirical

    @cached_property
    def _by_id(self) -> dict[str, Effect]:
        further = self._of_wings()
        every = [*self._of_winches.values(), *further]
        return {effect.id: effect for effect in (_simple_first(every) if further else every)}

    def of_winches(self) -> Iterator[Effect]:
        """Effects without those of the wings."""
        return iter(self._of_winches.values())

    def __iter__(self) -> Iterator[Effect]:
        return iter(self._by_id.values())

    def __bool__(self) -> bool:
        return bool(self._of_winches) or bool(self._by_id)

    def __len__(self) -> int:
        return len(self._by_id)

    def __contains__(self, effect_id: object) -> bool:
        effect_id = LINEAR_IDS.get(str(effect_id), effect_id)
        return effect_id in {**self._of_winches, **self._empirical} or effect_id in self._by_id

    def mapped(self, change: Callable[[Effect], Effect]) -> Catalogue:
        """The effects of winches, each changed; the empirical ones too."""
        empirical = {effect_id: change(effect) for effect_id, effect in self._empirical.items()}
        return Catalogue(map(change, self.of_winches()), empirical=empirical)

    def __getitem__(self, effect_id: str) -> Effect:
        effect_id = LINEAR_IDS.get(effect_id, effect_id)
        found = self._of_winches.get(effect_id) or self._empirical.get(effect_id)
        found = found or self._by_id.get(effect_id)
        if found is None:
            raise UsageError(
                f"no effect '{effect_id}'{suggest(effect_id, [*self._by_id, *EMPIRICAL])}"
                " ('winchkit effects' lists them, 'winchkit effects WORD' searches)"
            )
        return found


def _simple_first(effects: Iterable[Effect]) -> list[Effect]:
    return sorted(effects, key=lambda effect: (len(effect.parameters), effect.id))


def load_catalogue(files: Sequence[str | Path] = ()) -> Catalogue:
    """Load all effects: of the package, of entry points ``winchkit.effects``, then of files.

    Parameters
    ----------
    files : sequence of str or Path, optional
        Python files with user effects.

    Returns
    -------
    Catalogue
        Effects by id.

    Raises
    ------
    FileError
        For a file that cannot be loaded or has no effect, and for an effect that changes its input
        at the null or returns no finite value.

    Notes
    -----
    Entry points are searched once in a process; files are read at every call.
    """
    require_types(files, (str, Path), "files")
    found = list(_installed())
    for path in dict.fromkeys(Path(file).absolute() for file in files):
        for effect in _from_file(path):
            if any(other.id == effect.id for other in (*found, *_of_wings())):
                message = f"there is an effect '{effect.id}' already; give yours another id"
                raise FileError(Fault(message, str(path)))
            found.append(effect)
    return Catalogue(_simple_first(found), _of_wings)


@cache
def _installed() -> tuple[Effect, ...]:
    """Effects of the package and of entry points; these are searched in every distribution."""
    found = [effect for room in _ROOMS for effect in _in_package(room)]
    for point in entry_points(group="winchkit.effects"):
        found.extend(_effects_in(point.load(), point.name))
    return tuple(found)


@cache
def _of_wings() -> tuple[Effect, ...]:
    return tuple(e for wing in wings.own() for room in wing.effects for e in _in_package(room))


def _in_package(name: str) -> Iterator[Effect]:
    for module in iter_modules(import_module(name).__path__):
        yield from _effects_of(import_module(f"{name}.{module.name}"))


def _effects_of(module: object) -> list[Effect]:
    return [value for value in vars(module).values() if isinstance(value, Effect)]


def _from_file(path: Path) -> list[Effect]:
    """Effects of a user's Python file: its module-level ``Effect`` objects."""
    if not path.is_file():
        raise FileError(Fault("no such file of effects", str(path)))
    spec = spec_from_file_location(f"winchkit_user_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise FileError(Fault("not a Python file (.py)", str(path)))
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        line = getattr(error, "lineno", None)
        raise FileError(Fault(f"cannot be run: {error!r}", str(path), line)) from error
    effects = _effects_in(module, str(path))
    # A card needs bound effects, and binding needs a catalogue.
    from winchkit.effects.user_effects import broken_promises

    faults = [
        Fault(f"effect '{effect.id}' {broken}", str(path))
        for effect in effects
        for broken in broken_promises(effect)
    ]
    if faults:
        raise FileError(faults)
    return effects


def _effects_in(thing: object, where: str) -> list[Effect]:
    """Effects in a module, or the effect itself."""
    effects = [thing] if isinstance(thing, Effect) else _effects_of(thing)
    if not effects:
        raise FileError(Fault("has no object of class winchkit.effects.effect.Effect", where))
    faults = [
        Fault(f"effect '{effect.id}': {wrong}", where)
        for effect in effects
        for wrong in _wrong_with(effect)
    ]
    if faults:
        raise FileError(faults)
    return effects


def _wrong_with(effect: Effect) -> list[str]:
    """Contradictions in the declaration of an effect."""
    lists: tuple[tuple[str, object, Collection[str]], ...] = (
        ("needs", effect.needs, NEED_WORDS),
        ("outputs", effect.outputs, OUTPUTS),
    )
    wrong = []
    for name, given, known in lists:
        if isinstance(given, str) or not isinstance(given, Collection):
            wrong.append(f"{name} = {given!r}: must be a tuple of names, such as ({given!r},)")
            continue
        names = list(known)
        wrong += [
            f"{name}: unknown name '{item}'; known are {', '.join(names)}{suggest(item, names)}"
            for item in map(str, given)
            if item not in known
        ]
    if not effect.outputs:
        wrong.append(f"outputs: empty; one at least of {', '.join(OUTPUTS)}")
    amplitudes = [p.name for p in effect.parameters if p.role == "amplitude"]
    if any(p.onset for p in effect.parameters) and (len(amplitudes) != 1 or effect.probes):
        wrong.append(
            f"onset: the effect has {len(amplitudes)} amplitudes ({', '.join(amplitudes)}) and "
            f"{len(effect.probes)} probes; the scan of an onset needs one amplitude and no probe"
        )
    return wrong + [
        f"{parameter.name}: {text}"
        for parameter in effect.parameters
        if (text := _wrong_with_parameter(parameter))
    ]


def _wrong_with_parameter(parameter: Parameter) -> str:
    """Contradiction in the declaration of a parameter; empty without one."""
    if dimension_of(parameter.unit) is None:
        known = ", ".join(dict.fromkeys(next(iter(table)) for table in UNITS.values()))
        return (
            f"unknown unit '{parameter.unit}'; the SI ones are {known}; a compliance is a "
            "stiffness with null=inf and reciprocal=True"
        )
    if parameter.onset and not (
        parameter.onset > 0.0
        and parameter.unit == "s"
        and parameter.role == "shape"
        and parameter.low == 0.0
    ):
        return (
            f"onset {parameter.onset:g}: role '{parameter.role}', unit {parameter.unit}, low "
            f"{parameter.low:g}; it is the positive spacing at which a shape in s is scanned, "
            "whose low is the start of a run, 0"
        )
    if not parameter.low <= parameter.null <= parameter.high:
        return (
            f"null {parameter.null:g} lies outside [{parameter.low:g}, {parameter.high:g}]; "
            "the bounds must contain the value at which the effect vanishes"
        )
    return ""

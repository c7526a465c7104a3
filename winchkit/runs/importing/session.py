"""An import from tables to runs: the command, the page and :func:`import_runs` call it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from winchkit.arguments import number, require_types
from winchkit.errors import Fault, FileError, RunError, UsageError, of_each, one_line, some_of
from winchkit.runs.importing.answers import Answers, answers_of, read_answers
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.candidates import is_linear
from winchkit.runs.importing.clocks.joint import Joint, joined
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.mapping import guess_by, mapping_id, mapping_of
from winchkit.runs.importing.pieces import jumps_of, pieces_of
from winchkit.runs.importing.runs import has_angle, metadata_of, run_of, with_angle
from winchkit.runs.importing.streams import Streams, streams_of
from winchkit.runs.importing.table import ColumnTable
from winchkit.runs.run import Run
from winchkit.schema.mapping import ImportMapping
from winchkit.schema.read import read_mapping

Ask = Callable[[Guess, Answers], tuple[Guess, Answers]]
"""Asks the open questions of a file; the guess and the answers with what was answered."""

NO_ANGLE = (
    "no column is the motor angle or velocity, without which there is no run: name it by --column "
    '"motor_angle=COLUMN [deg]", or import the file together with the one that has it'
)
_CELL_ALONE = (
    "no column is the motor angle or velocity: a run of a load cell alone, for `winchkit cell "
    "diagnose --run`; import the file together with the one that has the angle, or name it by "
    '--column "motor_angle=COLUMN [deg]", for a run of a winch'
)


def _as_unit(channel: str, unit: str) -> str:
    return f'; --column "{channel}=COLUMN [{unit}]" where one is'


_CONSTANTS = {
    "rated_torque": ("a share of the rated torque", _as_unit("motor_torque", "%")),
    "torque_constant": ("A", _as_unit("motor_torque", "A")),
    "counts_per_turn": ("counts", _as_unit("motor_angle", "counts")),
    "sensitivity": ("mV/V", _as_unit("tension", "mV/V")),
    "capacity": ("mV/V", _as_unit("tension", "mV/V")),
}
"""Constants of answers, with the unit that needs them and the option that gives it to a column."""
_ANGLES, _VELOCITIES = {"motor_angle", "position"}, {"motor_velocity", "velocity"}


@dataclass(frozen=True)
class Imported:
    """Runs of imported files."""

    runs: tuple[tuple[int, Run], ...]
    """With the index of their file, the first of those that were joined."""
    joints: tuple[Joint, ...]
    jumps: tuple[Fault, ...]
    """Of motor angles; the pieces before and after one are runs of their own."""


def import_runs(
    paths: str | Path | Sequence[str | Path],
    *,
    mapping: str | Path | ImportMapping | None = None,
    join: bool = False,
    lag: float | None = None,
    load_mass: str | None = None,
    **answers: Any,
) -> list[Run]:
    """Import recordings of other programs as runs, as ``winchkit import --yes`` does.

    Parameters
    ----------
    paths : str, Path or sequence of these
        Files in any format of ``winchkit import``.
    mapping : str, Path, ImportMapping or None
        Channels and units of an earlier import, in place of a guess.
    join : bool
        Join all files to one run; files without a motor angle are joined to the one that has it.
    lag : float or None
        Clock of the first file less that of the others, s; by their stamps or by cross-correlation
        where it is None.
    load_mass : str or None
        Mass on the cable, ``"10 kg"``.
    **answers : Any
        Options of the command by name, as texts: ``columns=["motor_angle=Pos [deg]"]``,
        ``rated_torque="2.4 N m"``, ``signed=["torque"]``.

    Returns
    -------
    list of Run
        In the order of the files; pieces between jumps of the motor angle are runs of their own.

    Raises
    ------
    UsageError
        For an unknown or wrong answer, and for questions that are open, with the options that
        answer them.
    RunError, FileError
        With every fault of the files or the mapping.
    """
    known = {"columns", "options", *(item.name for item in fields(Answers))}
    if unknown := answers.keys() - known:
        names = ", ".join(sorted(unknown))
        raise UsageError(f"import_runs has no {names}; it has {', '.join(sorted(known))}")
    files = [paths] if isinstance(paths, str | Path) else [*paths]
    require_types(files, (str, Path), "paths")
    if not files:
        raise UsageError("paths: no file to import")
    if lag is not None:
        lag = number("import_runs", "lag", lag)
    declared = read_mapping(mapping) if isinstance(mapping, str | Path) else mapping
    guesses = guesses_of([read_table(file) for file in files], read_answers(answers), declared)
    if questions := [(g.table.path, q) for g in guesses for q in g.questions]:
        texts = [f"{one_line(path)}: {q.text}: {' or '.join(q.options)}" for path, q in questions]
        raise UsageError("; ".join(texts))
    found = runs_of(guesses, declared, masses=[load_mass] * len(files), join=join, lag=lag)
    return [run for _, run in found.runs]


def guesses_of(
    tables: Sequence[ColumnTable],
    answers: Answers,
    mapping: ImportMapping | None = None,
    ask: Ask | None = None,
) -> list[Guess]:
    """Assignments of the columns of all files; raises RunError with all faults of all files."""
    faults: list[Fault] = []
    timed = [] if mapping else _with_own_times(tables, answers)
    guesses = []
    for table in tables:
        own = answers_of(table, tables, answers)
        own = replace(own, sample_rate=None) if any(t is table for t in timed) else own
        try:
            guess = guess_by(table, mapping) if mapping else guess_columns(table, own)
        except FileError as error:
            faults += error.faults
            continue
        if ask is not None and mapping is None:
            guess, told = ask(guess, own)
            columns = (*answers.columns, *told.columns[len(own.columns) :])
            rate = told.sample_rate or answers.sample_rate
            answers = replace(told, columns=columns, sample_rate=rate)
        guesses.append(guess)
    if faults := [*faults, *_given_twice(guesses)]:
        raise RunError(faults)
    if mapping is None:
        guesses = _with_one_motion(guesses, tables, answers)
    named = {
        "--unsigned": answers.unsigned,
        "--signed": answers.signed,
        "--modulo": [name for name, _ in answers.modulo],
    }
    for option, name in [(option, name) for option, names in named.items() for name in names]:
        if not any(guess.file.column(name) for guess in guesses):
            has = some_of([repr(c.source) for guess in guesses for c in guess.file.columns])
            raise UsageError(f"{option}: there is no column '{name}'; there are {has}")
    if mapping is None and guesses and (idle := tuple(_without_use(guesses, tables, answers))):
        guesses[0] = replace(guesses[0], notes=(*guesses[0].notes, *idle))
    if mapping is None and _lack_angle(guesses):
        text = _CELL_ALONE if _have(guesses, {"tension", "load"}) else NO_ANGLE
        guesses = [replace(guess, notes=(*guess.notes, text)) for guess in guesses]
    return guesses


def _given_twice(guesses: Sequence[Guess]) -> Iterator[Fault]:
    """Faults of files with the numbers of another one: as its repeat they would have no noise."""
    found: dict[tuple[object, ...], str] = {}
    for guess in guesses if len(guesses) > 1 else ():
        table = guess.file if guess.axis else guess.table
        columns = {column.source: column for column in table.columns}
        used = [(item, columns[item.source]) for item in guess.used]
        moving = any((c.known != c.known[:1]).any() for i, c in used if i.channel != "time")
        content = tuple(
            (item.channel, item.factor, sha256(c.values.tobytes()).digest(), tuple(c.texts or ()))
            for item, c in used
        )
        if moving and content in found:
            path, other = guess.table.path, found[content]
            text = f"has the same numbers as {one_line(other)}, and is no repeat of it"
            yield Fault(f"{'is named twice' if path == other else text}: give it once", path)
        found.setdefault(content, guess.table.path)


def _without_use(
    guesses: Sequence[Guess], tables: Sequence[ColumnTable], answers: Answers
) -> Iterator[str]:
    """Notes on constants that change nothing: the columns have units of their own."""
    for name, (unit, remedy) in _CONSTANTS.items():
        if getattr(answers, name) is None:
            continue
        nothing: dict[str, Any] = {name: None}
        without = replace(answers, **nothing)
        others = [
            guess_columns(guess.file, answers_of(guess.file, tables, without)) for guess in guesses
        ]
        if all(
            (one.used, one.questions, one.notes) == (other.used, other.questions, other.notes)
            for one, other in zip(guesses, others, strict=True)
        ):
            yield f"--{name.replace('_', '-')} is not used: no column is in {unit}{remedy}"


def _with_one_motion(
    guesses: list[Guess], tables: Sequence[ColumnTable], answers: Answers
) -> list[Guess]:
    """Assignments by the motion that all files together have.

    A length and a force beside a file with the motor angle are those of its cable; a position in
    one file and a force in another, where nothing turns, are those of a linear axis.
    """
    columns = tuple(column for table in tables for column in table.columns)
    given = {item.source: item.channel for item in answers.columns}
    if answers.motion or len(tables) < 2:
        return guesses
    if _have(guesses, {"motor_angle"}):
        motion, concerned = "rotary", {"position"}
    elif _have(guesses, {"force"}):
        motion, concerned = "linear", {"cable_length", "velocity"}
    elif is_linear(replace(tables[0], columns=columns), given):
        motion, concerned = "linear", {"cable_length", "velocity", "tension", "load"}
    else:
        return guesses
    moving = replace(answers, motion=motion)
    return [
        guess_columns(guess.file, answers_of(guess.file, tables, moving))
        if _have([guess], concerned)
        else guess
        for guess in guesses
    ]


def _with_own_times(tables: Sequence[ColumnTable], answers: Answers) -> list[ColumnTable]:
    """Files with times beside others that have none, of which a sample rate is."""
    if not answers.sample_rate or len(tables) < 2:
        return []
    without_rate = replace(answers, sample_rate=None)
    own = [guess_columns(table, answers_of(table, tables, without_rate)) for table in tables]
    timed = [table for table, guess in zip(tables, own, strict=True) if _have([guess], {"time"})]
    return timed if len(timed) < len(tables) else []


def are_integrated(guesses: Sequence[Guess]) -> bool:
    """Whether the motor angle is the integral of a velocity: no file has an angle."""
    return _have(guesses, _VELOCITIES) and not _have(guesses, _ANGLES)


def _lack_angle(guesses: Sequence[Guess]) -> bool:
    """Whether channels of a run were found in the files, and none that may be the motor angle."""
    needed = _ANGLES | _VELOCITIES
    asked = " ".join(o for guess in guesses for q in guess.questions for o in q.options)
    is_found = any(item.channel not in {"", "time"} for guess in guesses for item in guess.used)
    is_body = "--body" in asked
    is_asked = any(f"{name}=" in asked for name in needed)
    return (is_found or is_body) and not is_asked and not _have(guesses, needed)


def _have(guesses: Sequence[Guess], channels: set[str]) -> bool:
    """Whether a file has one of some channels."""
    return any(
        item.channel.rpartition(".")[2] in channels for guess in guesses for item in guess.used
    )


def mapping_from(guesses: Sequence[Guess]) -> ImportMapping:
    """Mapping of the logs of an import, each with the name of its file."""
    return mapping_of("mapping", [(Path(guess.table.path).stem, guess) for guess in guesses])


def runs_of(
    guesses: Sequence[Guess],
    mapping: ImportMapping | None = None,
    *,
    masses: Sequence[str | None] = (),
    join: bool = False,
    lag: float | None = None,
) -> Imported:
    """Runs of all files; those without a motor angle are joined to the one that has it.

    Raises UsageError where the file of the angle is not known; RunError with every fault of every
    file.
    """
    parts = [streams_of(guess) for guess in guesses]
    if not any(has_angle(part) for part in parts):
        parts = [with_angle(part) for part in parts]
    angles = [index for index, part in enumerate(parts) if has_angle(part)]
    others = [index for index in range(len(parts)) if index not in angles]
    if others and len(angles) > 1 and not join:
        names = ", ".join(parts[index].path for index in others)
        raise UsageError(
            f"{names}: no motor angle; import each with the one file that it belongs to, by --join"
        )
    is_joined = len(parts) > 1 and (join or bool(others and angles))
    loads = masses or [None] * len(parts)
    identity = mapping_id(mapping or mapping_from(guesses))
    if not is_joined:
        return _alone(guesses, parts, identity, loads)
    order = [*angles[:1], *(index for index in range(len(parts)) if index not in angles[:1])]
    whole, joints = joined([parts[index] for index in order], lag)
    texts = _metadata([guesses[index] for index in order], identity, loads[order[0]])
    texts["joined"] = "; ".join(joint.text.replace(":", " ") for joint in joints)
    found, torn = _pieces(whole, texts)
    return Imported(tuple((order[0], run) for run in found), joints, tuple(torn))


def _alone(
    guesses: Sequence[Guess], parts: Sequence[Streams], identity: str, loads: Sequence[str | None]
) -> Imported:
    """Runs of files of which none is joined to another; all faults of all files at once."""

    def pieces(index: int) -> tuple[list[Run], list[Fault]]:
        return _pieces(parts[index], _metadata([guesses[index]], identity, loads[index]))

    found = of_each(pieces, range(len(parts)), RunError)
    runs = tuple((index, run) for index, (own, _) in enumerate(found) for run in own)
    return Imported(runs, (), tuple(fault for _, torn in found for fault in torn))


def _metadata(guesses: Sequence[Guess], identity: str, mass: str | None) -> dict[str, str]:
    """Metadata of the run of one file, or of several that were joined."""
    merged: dict[str, str] = {}
    for guess in guesses:
        for key, value in metadata_of(guess, {"imported_mapping": identity}).items():
            if key in {"imported_from", "imported_format"} and key in merged:
                merged[key] += f" + {value}"
            else:
                merged.setdefault(key, value)
    return merged if mass is None else {**merged, "load_mass": mass}


def _pieces(streams: Streams, metadata: Mapping[str, str]) -> tuple[list[Run], list[Fault]]:
    """The run of a file, or those before and after every jump of its motor angle, and the jumps."""
    jumps = jumps_of(streams)
    pieces = pieces_of(streams, jumps)
    text = "; the pieces before and after it are runs of their own"
    faults = [Fault(f"{jump.text}{text}", streams.path) for jump in jumps]
    if len(pieces) == 1:
        return [run_of(pieces[0], metadata)], faults
    numbered = enumerate(pieces, start=1)
    return [
        run_of(piece, {**metadata, "piece": f"{number} of {len(pieces)}"})
        for number, piece in numbered
    ], faults

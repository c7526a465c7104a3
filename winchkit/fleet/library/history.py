"""History of a library: one set of effects fitted to every session, and what changed since when."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.arguments import ProgressCallback, no_progress
from winchkit.errors import FileError, RunError, UsageError, suggest
from winchkit.fleet.library.index import indexed, profile_of_runs, profile_path
from winchkit.fleet.library.partitions import Partitions
from winchkit.fleet.library.sessions import WinchSession, run_faults, winch_sessions

if TYPE_CHECKING:
    from winchkit.effects.catalogue import Catalogue
    from winchkit.effects.term import Term
    from winchkit.fleet.diagnosis.history import FleetHistory
    from winchkit.fleet.diagnosis.sessions import SessionEstimate
    from winchkit.fleet.diagnosis.swapped_profiles import Swap
    from winchkit.schema.profiles.winch import WinchProfile


@dataclass(frozen=True)
class LibraryHistory:
    """What changed in the runs of a library."""

    effects: tuple[str, ...]
    """The set that was fitted to every session."""
    sessions: int
    """Number of sessions that were fitted."""
    history: FleetHistory
    """Every parameter over winches and time."""
    failures: Mapping[str, str]
    """``winch session`` to the reason why it was not fitted."""
    faults: Mapping[str, str]
    """Files whose runs are lost, unreadable or cut short, with the reason."""
    outdated: int = 0
    """Number of sessions whose diagnosis is by another profile, which says nothing here."""
    swapped: tuple[Swap, ...] = ()
    """Winches that have each other's profiles, where each has its own."""

    @property
    def left_out(self) -> tuple[str, ...]:
        """One sentence per session without a fit, per run with a fault, and on old diagnoses."""
        out = [f"session {name}: {reason}" for name, reason in self.failures.items()]
        out += [f"run {path}: {fault}" for path, fault in self.faults.items()]
        if self.outdated:
            out.append(
                f"diagnoses by another profile: {self.outdated}; their effects are not followed; "
                "run 'winchkit fleet diagnose' again"
            )
        return tuple(out)


def common_effects(sets: Iterable[Sequence[str]]) -> tuple[str, ...]:
    """Choose one effect for every set of effects that the sessions cannot distinguish: the one in
    most sets, then that in most of the others, and so on, of equal ones that which most diagnoses
    named. The name of a cause is then the same in all sessions."""
    left = [tuple(one) for one in sets if one]
    chosen: list[str] = []
    while left:
        counts = Counter(effect for one in left for effect in set(one))
        named = Counter(one[0] for one in left)
        best = min(counts, key=lambda effect: (-counts[effect], -named[effect], effect))
        chosen.append(best)
        left = [one for one in left if best not in one]
    return tuple(chosen)


def library_history(
    folder: str | Path,
    profile: str | Path,
    *,
    effects: Sequence[str] = (),
    effect_files: Sequence[str | Path] = (),
    limits: Mapping[tuple[str, str], float] | None = None,
    progress: ProgressCallback = no_progress,
) -> LibraryHistory:
    """Fit one set of effects to every session of a library, and test each for changes.

    Parameters
    ----------
    folder : str or Path
        Folder of the runs, which was indexed.
    profile : str or Path
        Profile of all winches, or a folder with ``WINCH.toml`` for each (``/`` as ``-``).
    effects : sequence of str, optional
        Effects to follow; by default those that ``winchkit fleet diagnose`` named, and those of the
        profiles.
    effect_files : sequence of str or Path, optional
        Files of user effects.
    limits : mapping, optional
        (effect, parameter) to the value that must not be reached, SI, not zero.
    progress : callable, optional
        Called with a text and the share of the work done.

    Returns
    -------
    LibraryHistory
        Changes with dates, odd winches, exchanged profiles, costs and dates of limits; sessions
        and runs that are left out.

    Raises
    ------
    FileError
        For a folder without an index, or a profile that is wrong.
    UsageError
        For an unknown effect, and where no effect was named yet.
    """
    from winchkit.effects.bind import terms_of
    from winchkit.effects.catalogue import load_catalogue
    from winchkit.fleet.diagnosis.history import fleet_history
    from winchkit.fleet.diagnosis.sessions import null_term
    from winchkit.fleet.diagnosis.swapped_profiles import swapped_by_radius

    tables = indexed(folder)
    catalogue = load_catalogue(effect_files)
    sessions = winch_sessions(tables)
    profiles, faults = _profiles(profile, {session.winch for session in sessions})
    own = {t.effect.id for known in profiles.values() for t in terms_of(known, catalogue)}
    hashes = {winch: profile_of_runs(profile_path(profile, winch)).hash for winch in profiles}
    chosen = tuple(effects) or _followed(tables, sorted(own), hashes)
    for name in chosen:
        if name not in catalogue:
            known = [effect.id for effect in catalogue]
            raise UsageError(f"there is no effect '{name}'{suggest(name, known)}")
    terms = [null_term(catalogue[name]) for name in chosen]
    estimates: list[SessionEstimate] = []
    failures: dict[str, str] = {}
    for number, session in enumerate(sessions):
        progress(f"{session.winch} {session.session}", number / len(sessions))
        name = f"{session.winch} {session.session}"
        if session.winch in faults:
            failures[name] = str(faults[session.winch])
            continue
        try:
            estimates += _fitted(tables, session, profiles[session.winch], terms, catalogue)
        except (FileError, RunError) as error:
            failures[name] = str(error)
    fitted = len(sessions) - len(failures)
    history = fleet_history(estimates, limits)
    swapped = swapped_by_radius(history.parameters, profiles, catalogue)
    outdated = 0 if effects else _outdated(tables, hashes)
    return LibraryHistory(chosen, fitted, history, failures, run_faults(tables), outdated, swapped)


def _profiles(
    profile: str | Path, winches: Iterable[str]
) -> tuple[dict[str, WinchProfile], dict[str, FileError]]:
    """Profile of every winch, and the faults of the others; raises FileError where none is left."""
    from winchkit.schema.read import read_profile

    profiles: dict[str, WinchProfile] = {}
    faults: dict[str, FileError] = {}
    for winch in winches:
        try:
            profiles[winch] = read_profile(profile_path(profile, winch))
        except FileError as error:
            faults[winch] = error
    if faults and not profiles:
        raise next(iter(faults.values()))
    return profiles, faults


def _outdated(tables: Partitions, hashes: Mapping[str, str]) -> int:
    """Number of diagnoses by other profiles than the winches' own; hash of the profile by winch."""
    rows = tables.read("diagnoses", ("winch", "profile")).to_pylist()
    return sum(hashes.get(row["winch"], row["profile"]) != row["profile"] for row in rows)


def _followed(tables: Partitions, own: Sequence[str], hashes: Mapping[str, str]) -> tuple[str, ...]:
    """Effects that the diagnoses named, and those of the profiles; raises UsageError for none."""
    if not tables.files("diagnoses"):
        raise UsageError(
            f"{tables.runs}: has no diagnoses; run 'winchkit fleet diagnose' first, or name the "
            "effects to follow (--effect)"
        )
    chosen = common_effects([*_named_sets(tables, hashes), *([effect] for effect in own)])
    if not chosen and (outdated := _outdated(tables, hashes)):
        raise UsageError(
            f"{tables.runs}: its {outdated} diagnoses are by other profiles; run 'winchkit fleet "
            "diagnose' again, or name the effects to follow (--effect)"
        )
    if not chosen:
        raise UsageError(
            f"{tables.runs}: its diagnoses name no effect and its profiles have none; name the "
            "effects to follow (--effect)"
        )
    return chosen


def _named_sets(tables: Partitions, hashes: Mapping[str, str]) -> list[Sequence[str]]:
    """Effects of every step: the certain one, or all of its set and of the others at its place, by
    diagnoses beside the winches' present profiles."""
    columns = ("key", "winch", "kind", "effect", "set", "certain", "place", "profile")
    rows = tables.read("estimates", columns).to_pylist()
    rows = [row for row in rows if row["profile"] == hashes.get(row["winch"], row["profile"])]
    steps = {(row["key"], row["effect"]): row for row in rows if row["kind"] == "model"}
    ordered = [steps[key] for key in sorted(steps)]
    there: dict[str, dict[str, None]] = {}
    for row in ordered:
        if row["place"] is not None and not row["certain"]:
            there.setdefault(row["place"], {}).update(dict.fromkeys(row["set"]))
    return [
        [row["effect"]] if row["certain"] else list(there.get(row["place"], row["set"]))
        for row in ordered
    ]


def _fitted(
    tables: Partitions,
    session: WinchSession,
    profile: WinchProfile,
    terms: Sequence[Term],
    catalogue: Catalogue,
) -> tuple[SessionEstimate, ...]:
    from winchkit.fleet.diagnosis.sessions import fit_session

    library = tables.runs.resolve()
    return fit_session(
        [run.read(library) for run in session.runs],
        profile,
        terms,
        winch=session.winch,
        time=session.time.timestamp(),
        catalogue=catalogue,
    )

"""Writes the result of ``add`` or ``remove`` into a copy of a profile, with its origin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

from winchkit.arguments import path_of, require_type, require_types
from winchkit.diagnosis.add import Addition, Removal
from winchkit.diagnosis.results import Estimate, OutputFit
from winchkit.effects.series import single_orders
from winchkit.effects.term import Term
from winchkit.profile_edit.fitted import FittedTerm, write_fitted, write_without
from winchkit.profile_edit.ledger import Judged


def write_addition(
    source: str | Path,
    addition: Addition,
    runs: Sequence[str],
    path: str | Path,
    *,
    replace: bool = False,
) -> None:
    """Write a fitted addition into a copy of a profile, and an entry into its ledger.

    Parameters
    ----------
    source, path : str or Path
        The profile file, and its copy.
    addition : Addition
        Result of ``add``.
    runs : sequence of str
        Names of the runs that it was fitted to.
    replace : bool
        Write over another profile that exists; over ``source`` always.

    Raises
    ------
    FileError
        Where a file cannot be read or written.
    UsageError
        For a file that is not to be replaced.
    """
    require_type(addition, Addition, "addition")
    require_types(runs, str, "runs")
    fitted, judged = _provenance(addition.terms, addition.outputs, runs)
    write_fitted(path_of(source, "source"), fitted, path_of(path), judged, replace=replace)


def write_removal(
    source: str | Path,
    effect: str,
    removal: Removal | None,
    runs: Sequence[str],
    path: str | Path,
    *,
    replace: bool = False,
) -> None:
    """Write a profile without an effect, with the others refitted where there were runs.

    Parameters
    ----------
    source, path : str or Path
        The profile file, and its copy.
    effect : str
        Name of the effect.
    removal : Removal or None
        Result of ``remove``; None without runs.
    runs : sequence of str
        Names of the runs that the others were refitted to.
    replace : bool
        Write over another profile that exists; over ``source`` always.

    Raises
    ------
    FileError
        Where a file cannot be read or written.
    UsageError
        For a file that is not to be replaced.
    """
    if removal is not None:
        require_type(removal, Removal, "removal")
    require_types(runs, str, "runs")
    terms, outputs = (removal.terms, removal.outputs) if removal is not None else ((), {})
    fitted, judged = _provenance(terms, outputs, runs)
    write_without(path_of(source, "source"), effect, fitted, path_of(path), judged, replace=replace)


def _provenance(
    terms: Sequence[tuple[Term, Mapping[str, Estimate]]],
    outputs: Mapping[str, OutputFit],
    runs: Sequence[str],
) -> tuple[list[FittedTerm], Judged]:
    """Fitted terms and the ledger's figures, dated today."""
    today = datetime.now(UTC).date()
    fitted = [
        FittedTerm(single, std, runs, today)
        for term, values in terms
        for single, std in single_orders(term, {n: e.std for n, e in values.items()})
    ]
    judged = Judged(
        today,
        runs,
        {name: o.unit for name, o in outputs.items()},
        {name: o.heldout_rms_before for name, o in outputs.items()},
        {name: o.heldout_rms_after for name, o in outputs.items()},
        {name: o.noise_rms for name, o in outputs.items() if o.noise_rms is not None},
    )
    return fitted, judged

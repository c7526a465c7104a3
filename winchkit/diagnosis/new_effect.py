"""A user effect that starts from the residual that no effect of the catalogue explains."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from winchkit.arguments import ProgressCallback, no_progress, path_of, require_type, require_types
from winchkit.diagnosis.add import add
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect_template import check_own, write_own, write_wave_on_drum
from winchkit.effects.empirical import EMPIRICAL, LINEAR_IDS
from winchkit.errors import UsageError, suggest
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile


def new_effect(
    path: str | Path,
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    curve: str | None = None,
    effect_id: str = "",
    progress: ProgressCallback = no_progress,
) -> str:
    """Write a Python file with an effect that has the shape of the unexplained residual.

    Parameters
    ----------
    path : str or Path
        File to write.
    runs : sequence of Run
        Runs that no effect explains.
    profile : WinchProfile
        The winch.
    catalogue : Catalogue, optional
        Effects; by default all that are installed.
    band : float, optional
        Cut-off frequency of the torque's low-pass filter, Hz.
    curve : str, optional
        Empirical effect to begin from; by default that of the largest share.
    effect_id : str, optional
        Id of the new effect; by default the name of the file.
    progress : callable, optional
        Called with the present step and the share of the work done, 0 to 1.

    Returns
    -------
    str
        What the initial values are from, in words.

    Raises
    ------
    UsageError
        For an id that is taken, an unknown curve, or where nothing is unexplained.
    RunError
        With every fault of every run.
    """
    require_types(runs, Run, "runs")
    require_type(profile, WinchProfile, "profile")
    catalogue, file = catalogue or load_catalogue(), path_of(path)
    name = effect_id or file.stem.replace("_", "-")
    check_own(name, file, catalogue)
    if curve is None:
        found = diagnose(runs, profile, catalogue, band, progress=progress).diagnosis
        if not found.empirical:
            raise UsageError(
                f"the verdict is '{found.verdict}' and nothing unexplained was located; name the "
                "curve to begin from with --curve, e.g. empirical-motor-torque-speed"
            )
        order = order_of_drum(found)
        if order is not None:
            write_wave_on_drum(order, name, file)
            return f"a wave of {order} periods per drum turn"
        curve = found.empirical[0]
    curve = LINEAR_IDS.get(curve, curve)
    if curve not in EMPIRICAL:
        raise UsageError(f"'{curve}' is no empirical effect{suggest(curve, list(EMPIRICAL))}")
    progress(f"fitting {curve}", 1.0)
    term, _ = add(curve, runs, profile, catalogue, band).added
    write_own(term, name, file)
    return curve


def order_of_drum(found: Diagnosis) -> int | None:
    """Order per drum turn that several outputs share: then the drum's own path has it."""
    orders = [w.order for w in found.where if w.variable == "drum_angle" and w.order is not None]
    return next((order for order in orders if orders.count(order) > 1), None)

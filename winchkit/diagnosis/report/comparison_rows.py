"""A comparison's figures in words, the same at the terminal and on the page."""

from __future__ import annotations

from winchkit.diagnosis.report.phrases import OUTPUT_NAMES, VARIABLE_NAMES, listed
from winchkit.diagnosis.report.wording import percent, quantity, scale_for
from winchkit.diagnosis.result import Comparison, OutputError

__all__ = ["HEAD", "followed", "offset_text", "size_rows"]

HEAD = ("error", "rms", "bias", "largest", "noise", "measured, rms")
_FOLLOWED = 3


def size_rows(comparison: Comparison) -> list[list[str]]:
    """Per output its name and the figures under :data:`HEAD`."""
    rows = []
    for name, error in comparison.outputs.items():
        scale = scale_for(error.rms, error.unit)
        noise = "unknown" if error.noise_rms is None else scale.text(error.noise_rms)
        sizes = [scale.text(v) for v in (error.rms, _noticeable(error.bias, error.rms), error.max)]
        signal = quantity(error.signal_rms, error.unit)
        rows.append([OUTPUT_NAMES.get(name, name), *sizes, noise, signal])
    return rows


def followed(error: OutputError) -> str:
    """``load 82 % and time 10 %``."""
    shares = [
        f"{VARIABLE_NAMES.get(variable, variable)} {percent(share)}"
        for variable, share in error.follows[:_FOLLOWED]
    ]
    return listed(shares) if shares else "nothing that was measured"


def offset_text(offset: float) -> str:
    """The one value that a comparison fits."""
    return f"offset of the length instrument, fitted: {quantity(offset, 'm')}"


def _noticeable(bias: float, rms: float) -> float:
    """A bias, zero where it is only what rounding leaves of a fitted offset."""
    return 0.0 if abs(bias) < 1e-6 * rms else bias

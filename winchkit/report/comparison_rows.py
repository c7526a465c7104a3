"""Figures of a comparison as text, the same at the terminal and on the page."""

from __future__ import annotations

from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.quantity_text import percent, quantity, scale_for
from winchkit.report.figures.maps import largest_text, map_text, signed
from winchkit.report.words.headline import at_noise, worst_outputs
from winchkit.report.words.sentence import CLEAR_ORDER, often_per_turn
from winchkit.report.words.vocabulary import listed, output_name, variable_name

HEAD = ("error", "rms", "bias", "largest", "noise", "measured, rms")
_FOLLOWED = 3
"""Variables of an attribution that a row has room for; ``--json`` has all."""
_FAILING = 3
"""Outputs that the short text says where they fail."""
_BIASED = 0.1
"""Share of the mean square of an error from which its mean is said."""
_CONSTANT = 0.95
"""Share of what a variable explains from which its mean alone explains it."""
_SMALL = 0.1
"""Share of the variance up to which a trend is not said beside an order within a turn."""
_LENGTHS = ("cable_length", "platform_position")


def size_rows(comparison: Comparison) -> list[list[str]]:
    """Per output its name and the figures under :data:`HEAD`."""
    rows = []
    for name, error in comparison.outputs.items():
        scale = scale_for(error.rms, error.unit)
        noise = "unknown" if error.noise_rms is None else scale.text(error.noise_rms)
        sizes = [scale.text(v) for v in (error.rms, _noticeable(error.bias, error.rms), error.max)]
        signal = quantity(error.signal_rms, error.unit)
        rows.append([output_name(name), *sizes, noise, signal])
    return rows


def short_rows(comparison: Comparison) -> list[list[str]]:
    """Per output its error and noise, and, but of a length, the share of what the output varies."""
    rows = [["error, rms", "", "noise", "of its variation"]]
    for name in worst_outputs(comparison.outputs):
        error = comparison.outputs[name]
        scale = scale_for(error.rms, error.unit)
        noise = "unknown" if error.noise_rms is None else scale.text(error.noise_rms)
        is_known = name not in _LENGTHS and error.variation > 0.0
        share = percent(error.rms / error.variation) if is_known else ""
        rows.append([output_name(name), scale.text(error.rms), noise, share])
    return rows


def failing(comparison: Comparison) -> list[str]:
    """At most three outputs above their noise: ``tension: 80 % follows the load; mean +3.9 N; up to
    +4.2 N at free length 3 m, load 196 N``. A small share beside a clear order is left out.
    """
    drawn = {one.output: one for one in reversed(comparison.maps)}
    lines = []
    for name in worst_outputs(comparison.outputs):
        error = comparison.outputs[name]
        if at_noise(error):
            continue
        scale = scale_for(3 * error.rms, error.unit)
        orders = [f"{percent(s)} has {often_per_turn(a, order)}" for a, order, s in _clear(error)]
        constant = (error.bias / error.rms) ** 2 if error.rms else 0.0
        trends = [
            f"{percent(constant)} is constant"
            if constant > _CONSTANT * share
            else f"{percent(share)} follows the {variable_name(v)}"
            for v, share in error.follows[:1]
            if share > _SMALL or not orders
        ]
        shares = trends + orders
        parts = [", ".join(shares) or "no measured variable explains it"]
        if error.bias**2 > _BIASED * error.rms**2:
            parts.append(f"mean {signed(error.bias, scale)}")
        if name in drawn:
            parts.append(largest_text(drawn[name], scale, named=True))
        lines.append(f"{output_name(name)}: {'; '.join(parts)}")
    return lines[:_FAILING]


def followed(error: OutputError, most: int = _FOLLOWED) -> str:
    """``load 82 % and time 10 %; 5 periods per drum turn 47 %``; ``most`` variables."""
    shares = [
        f"{variable_name(variable)} {percent(share)}" for variable, share in error.follows[:most]
    ]
    texts = [listed(shares)] if shares else []
    texts += [f"{often_per_turn(a, order)} {percent(s)}" for a, order, s in _clear(error)]
    return "; ".join(texts) or "no measured variable"


def map_lines(comparison: Comparison) -> list[str]:
    """Per output its residual map with the largest share of variance, in a line."""
    out: dict[str, str] = {}
    for drawn in comparison.maps:
        error = comparison.outputs[drawn.output]
        name = output_name(drawn.output)
        text = map_text(drawn, scale_for(3 * error.rms, error.unit))
        out.setdefault(drawn.output, f"{name} {text}")
    return list(out.values())


def offset_text(offset: float) -> str:
    """The only value that a comparison fits."""
    return f"offset of the length instrument, fitted: {quantity(offset, 'm')}"


def _noticeable(bias: float, rms: float) -> float:
    """A bias; zero where it is the rounding error of a fitted offset."""
    return 0.0 if abs(bias) < 1e-6 * rms else bias


def _clear(error: OutputError) -> list[tuple[str, int, float]]:
    """The strongest order within a turn, unless a trend explains more than twice its share."""
    trend = max((share for _, share in error.follows), default=0.0)
    orders = [o for o in error.orders if o[2] > CLEAR_ORDER and trend <= 2 * o[2]]
    return sorted(orders, key=lambda o: -o[2])[:1]

"""Residual maps and the charts that they are drawn in."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from report_answers import recorded
from report_parsed import Page
from winchkit.catalog import find
from winchkit.diagnosis.compare import Compared, compared
from winchkit.diagnosis.residuals.attribution import attributions
from winchkit.diagnosis.residuals.maps import ResidualMap, residual_maps, same_cells
from winchkit.quantity_text import PrintScale
from winchkit.report.figures.axes import Range, range_of, reading
from winchkit.report.figures.figure import FigureAxis
from winchkit.report.figures.maps import map_text
from winchkit.report.pages.pages import comparison_html
from winchkit.report.text import compare_text
from winchkit.schema.read import read_profile

PROFILE = read_profile(find("profiles", "bench-spiral"))


def held(bench: str) -> Compared:
    return compared(recorded(bench), PROFILE)


def map_over(known: Compared, output: str, over: tuple[str, str]) -> ResidualMap:
    maps = known.comparison.maps
    return next(m for m in maps if m.output == output and m.over == over)


def test_an_elastic_cable_is_drawn_by_length_and_load() -> None:
    drawn = map_over(held("demo-elastic-rope"), "cable_length", ("cable_length", "load"))
    length, load = (edges[:-1] + np.diff(edges) / 2 for edges in drawn.edges)
    dead = PROFILE.cable.dead_length
    # The bench hides 300 kN (sim/demo-elastic-rope.toml); Hooke: the free length grows by
    # (length + dead length) times tension over it, up to the offset, which was fitted.
    stretch = np.outer(length + dead, load) / 300e3
    there = drawn.count > 30
    left = (drawn.mean - stretch)[there]
    assert np.std(left) < 0.15 * np.std(stretch[there])


def test_two_variables_take_more_than_either() -> None:
    known = held("demo-elastic-rope")
    share = map_over(known, "cable_length", ("cable_length", "load")).share
    singles = dict(known.comparison.outputs["cable_length"].follows)
    assert share > max(singles["load"], singles.get("cable_length", 0.0)) + 0.05


def test_noise_follows_no_pair() -> None:
    known = held("demo-elastic-rope")
    noise = np.random.default_rng(7).standard_normal(known.regression.n_rows)
    assert residual_maps(known.regression, noise) == []
    assert attributions(known.regression, noise) == []


def test_the_largest_cell_is_reported() -> None:
    drawn = map_over(held("demo-elastic-rope"), "cable_length", ("cable_length", "load"))
    mean = np.full(drawn.mean.shape, 1e-4)
    mean[3, 2] = -2e-3
    planted = replace(drawn, mean=mean, share=0.5)
    assert planted.largest == (3, 2)
    text = map_text(planted, PrintScale("mm", 1e-3))
    assert text.startswith("over free length and load 50 %, up to −2.0 mm at ")


def test_another_residual_is_drawn_in_the_same_cells() -> None:
    known = held("demo-elastic-rope")
    drawn = map_over(known, "cable_length", ("cable_length", "load"))
    again = same_cells(known.regression, 2 * known.residual, drawn)
    np.testing.assert_array_equal(again.edges[0], drawn.edges[0])
    np.testing.assert_allclose(again.mean, 2 * drawn.mean, equal_nan=True)


def test_the_maps_are_in_the_text_the_json_and_the_page() -> None:
    known = held("demo-elastic-rope")
    assert "cable length over free length and load" in compare_text(known.comparison, verbose=True)
    first = known.comparison.to_json()["maps"][0]
    assert first["over"] == ["cable_length", "load"]
    assert first["units"] == ["m", "N"]
    rows, columns = (len(edges) - 1 for edges in first["edges"])
    assert (len(first["mean"]), len(first["mean"][0])) == (rows, columns)
    page = Page(comparison_html(known, "x"))
    assert "Mean residual of the cable length over free length and load" in page.text
    assert page.count("svg") >= 3
    charts = [a for tag, a in page.elements if tag == "svg" and "role" in a]
    assert "map-cable_length-1" in page.figures
    assert all(a["role"] == "img" and a["aria-label"] for a in charts)


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(2, 6))
def test_ticks_are_round_even_and_few(low: float, span: float, count: int) -> None:
    axis = Range(low, low + max(span, 1e-6 * abs(low)))
    ticks = [value for value, _ in axis.ticks(count)]
    assert 3 <= len(ticks) <= max(count + 2, 7)
    room = 1e-6 * (axis.high - axis.low)
    assert all(axis.low - room <= tick <= axis.high + room for tick in ticks)
    steps = [b - a for a, b in pairwise(ticks)]
    assert np.ptp(steps or [1.0]) <= 1e-6 * max(steps or [1.0])
    texts = [text for _, text in axis.ticks(count)]
    assert len(set(texts)) == len(texts), "no two ticks have one text"
    assert not any("e" in text or "-" in text for text in texts)


def test_a_logarithmic_axis_has_powers_of_ten() -> None:
    axis = range_of(FigureAxis("distance", "m", logarithmic=True), [1e-5, 2.0])
    ticks = [value for value, _ in axis.ticks(5)]
    assert ticks == pytest.approx([1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0])
    assert axis.share(1e-3) == pytest.approx(
        axis.share(1e-5) + 2 * (axis.share(0.1) - axis.share(0.01))
    )


def test_variables_are_read_in_their_units() -> None:
    assert reading("drum_angle", within_turn=True).shown(np.pi) == pytest.approx(180.0)
    assert reading("drum_angle").shown(4 * np.pi) == pytest.approx(2.0)
    assert reading("reversal_distance").shown(-3.0) == pytest.approx(1e-3)
    assert reading("temperature").label == "temperature [°C]"

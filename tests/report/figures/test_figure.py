"""A figure's files against its data, read by an own reader of SVG and by the csv module."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from figure_drawn import across, down, drawn, polylines
from report_answers import AT_NOISE, ELASTIC, FRICTIONAL, NOISY, diagnosis_of
from report_parsed import HOSTILE, Page
from winchkit.fleet.report.comparison import shared_effects_html
from winchkit.report.figures.error_ratios import error_ratios, fleet_error_ratios
from winchkit.report.figures.export import png, write_figures
from winchkit.report.figures.figure import (
    Figure,
    FigureAxis,
    FigureSeries,
    GridCells,
    Panel,
    RunMark,
)
from winchkit.report.figures.layout import NARROW, WIDE, density_levels, scene_of, signed_levels
from winchkit.report.figures.reduction import bin_means, decimated, filled_edges
from winchkit.report.figures.tokens import DARK, LIGHT, STYLES, style_sheet
from winchkit.report.html.page import figure_block
from winchkit.report.html.svg import file_svg
from winchkit.report.words.headline import worst_outputs
from winchkit.report.words.sentence import headline


def over_time(seed: int, count: int, size: float, gap: bool = False) -> Figure:
    random = np.random.default_rng(seed)
    x = np.arange(float(count)) * 0.1
    measured, residual = (
        size * random.normal(size=count) + 3 * size,
        size * random.normal(size=count),
    )
    if gap:
        residual[count // 5 : count // 3] = np.nan
    signals = (
        FigureSeries("measured", "measured", x, measured),
        FigureSeries("predicted", "today", x, measured - residual),
    )
    errors = (FigureSeries("residual", "today", x, residual),)
    return Figure(
        "time-tension",
        "Tension over time",
        "words",
        FigureAxis("time", "s", limits=(0.0, 0.1 * count)),
        (
            Panel(FigureAxis("measured and predicted", "N"), signals),
            Panel(FigureAxis("residual", "N", zero=True), errors, band=0.5 * size),
        ),
        (RunMark(0.0, "a", "demo 10 kg"), RunMark(0.05 * count, "b", "demo 20 kg")),
        zoom=True,
        source="profile p",
    )


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(20, 300), st.floats(1e-6, 1e6))
def test_the_svg_draws_the_data(seed: int, count: int, size: float) -> None:
    figure = over_time(seed, count, size)
    read = drawn(file_svg(figure))
    a, b = across(read)
    lines = [(s, d) for s, d in read.paths if s["stroke"] == LIGHT["today"]]
    for (_, data), panel, series in zip(
        lines, (0, 1), (figure.panels[0].series[1], figure.panels[1].series[0]), strict=True
    ):
        parts = polylines(data)
        assert len(parts) == 2, "a line per run"
        points = np.concatenate(parts)
        c, d = down(read, panel)
        # Half of the last digit of a place, 0.1 px, in the unit of the axis.
        assert points[:, 0] * a + b == pytest.approx(series.x, abs=0.2 * abs(a))
        assert points[:, 1] * c + d == pytest.approx(series.y, abs=0.2 * abs(c))


def test_the_band_is_the_noise_and_lies_around_zero() -> None:
    figure = over_time(1, 100, 1.0)
    read = drawn(file_svg(figure))
    c, d = down(read, 1)
    (data,) = [d for s, d in read.paths if s["fill"] == LIGHT["band"]]
    ys = polylines(data)[0][:, 1] * c + d
    assert (ys.min(), ys.max()) == pytest.approx((-0.5, 0.5), abs=0.2 * abs(c))


def test_a_gap_is_no_line() -> None:
    figure = over_time(2, 90, 1.0, gap=True)
    read = drawn(file_svg(figure))
    line = [d for s, d in read.paths if s["stroke"] == LIGHT["today"]][1]
    missing = int(np.isnan(figure.panels[1].series[0].y).sum())
    parts = polylines(line)
    assert sum(map(len, parts)) == 90 - missing
    assert len(parts) == 3


@given(st.integers(0, 2**32 - 1), st.integers(2, 60))
def test_the_csv_is_the_data(seed: int, count: int) -> None:
    figure = over_time(seed, count, 1e-3, gap=True)
    rows = list(csv.DictReader(io.StringIO(figure.table().csv())))
    assert list(rows[0]) == ["run", "time [s]", "measured [N]", "predicted [N]", "residual [N]"]
    assert len(rows) == count
    for name, series in (
        ("measured [N]", figure.panels[0].series[0]),
        ("residual [N]", figure.panels[1].series[0]),
    ):
        read = [float(row[name]) if row[name] else np.nan for row in rows]
        assert read == pytest.approx(series.y, rel=1e-6, nan_ok=True)
    second = [row["run"] for row in rows if float(row["time [s]"]) >= 0.05 * count]
    assert set(second) <= {"b"}


def test_hostile_names_are_text_in_every_file() -> None:
    plain = over_time(3, 30, 1.0)
    figure = Figure(
        plain.id,
        HOSTILE,
        HOSTILE,
        FigureAxis(HOSTILE, "s"),
        plain.panels,
        (RunMark(0.0, HOSTILE, HOSTILE), RunMark(1.5, "=HYPERLINK(1)", "x")),
        source=HOSTILE,
    )
    svg = file_svg(figure)
    read = drawn(svg)
    assert "<script" not in svg
    assert any(t.startswith("</script>") for _, _, t, _ in read.texts)
    rows = list(csv.reader(io.StringIO(figure.table().csv())))
    assert rows[1][0] == HOSTILE
    assert rows[-1][0] == "'=HYPERLINK(1)", "no formula for a spreadsheet"
    page = Page(figure_block(figure))
    assert page.count("script") == page.count("img") == 0
    assert not any(key.startswith("on") for _, own in page.elements for key in own)
    assert png(figure).startswith(b"\x89PNG")


def test_a_density_counts_every_sample_and_has_a_scale_with_numbers() -> None:
    values = np.full((3, 2), np.nan)
    values[0, 0], values[2, 1] = 120.0, 1.0
    levels = density_levels(120)
    cells = GridCells("samples per cell", "", np.arange(4.0), np.arange(3.0), values, levels)
    figure = Figure(
        "over",
        "t",
        "c",
        FigureAxis("load", "N"),
        (Panel(FigureAxis("residual", "N"), cells=cells),),
    )
    rows = list(csv.DictReader(io.StringIO(figure.table().csv())))
    assert [float(row["samples per cell"]) for row in rows] == [120.0, 1.0]
    assert (rows[0]["load, from [N]"], rows[0]["load, to [N]"]) == ("0", "1")
    read = drawn(file_svg(figure))
    assert [t for _, _, t, a in read.texts if t in {"1", "3", "10", "30", "100"} and a == "start"]
    filled = [s for s, _ in read.paths if s["fill"] == LIGHT["today"]]
    assert len(filled) == 2, "a class of colour each"
    assert len({s.get("opacity") for s in filled}) == 2


@given(st.integers(1, 10**9))
def test_levels_of_a_density_are_few_and_reach_most_counts(most: int) -> None:
    levels = density_levels(most)
    assert 1 <= len(levels) <= 5
    assert levels[0] == 1
    assert levels[-1] <= most
    assert list(levels) == sorted(levels)


@given(st.floats(1e-9, 1e9))
def test_levels_of_a_map_are_even_and_below_the_peak(peak: float) -> None:
    one, two, three = signed_levels(peak)
    assert (two, three) == pytest.approx((2 * one, 3 * one))
    assert 0.6 * peak <= three <= 1.01 * peak


@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_texts_lie_inside_of_the_picture(width: int) -> None:
    scene = scene_of(over_time(4, 50, 1e-3), width)
    for text in scene.texts:
        assert 0 <= text.x <= width
        assert 0 < text.y <= scene.height
        if text.anchor == "start":
            assert text.x + 6.6 * len(text.text) < width + 20
    sizes = [STYLES[text.style].size for text in scene.texts]
    assert min(sizes) >= 12


def test_all_files_are_written(tmp_path: pytest.TempPathFactory) -> None:
    folder = tmp_path / "figures"  # type: ignore[operator]
    figure = over_time(5, 40, 1.0)
    paths = write_figures([figure], folder, "H-")
    assert [p.name for p in paths] == [f"H-time-tension.{s}" for s in ("svg", "png", "csv")]
    raw = paths[1].read_bytes()
    width = int.from_bytes(raw[16:20], "big")
    assert width == 2 * (WIDE + 24), "twice the dots of a screen"
    assert paths[2].read_text() == figure.table().csv()


def test_colours_are_distinct_in_luminance_and_all_declared() -> None:
    def luminance(colour: str) -> float:
        parts = [int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    def contrast(one: str, other: str) -> float:
        high, low = sorted([luminance(one), luminance(other)], reverse=True)
        return (high + 0.05) / (low + 0.05)

    assert LIGHT.keys() == DARK.keys()
    for theme in (LIGHT, DARK):
        assert contrast(theme["today"], theme["with"]) > 1.5, "distinct in grey"
        for token in ("ink", "ink2", "muted", "today", "with", "above", "below"):
            assert contrast(theme[token], theme["surface"]) >= 4.5
    used = {t for s in STYLES.values() for t in (s.stroke, s.fill) if t}
    assert used <= LIGHT.keys()
    assert all(f".f-{name}{{" in style_sheet() for name in STYLES)


OUTPUTS = {"tension": AT_NOISE, "cable_length": NOISY, "motor_torque": FRICTIONAL}


def test_the_figure_has_the_ratios_and_the_worst_first() -> None:
    drawn = error_ratios(OUTPUTS, extended=True, changed="with x")
    rows = list(csv.DictReader(io.StringIO(drawn.table().csv())))
    assert [row["output"] for row in rows] == ["motor torque", "cable length", "tension"]
    for row, output in zip(rows, (FRICTIONAL, NOISY, AT_NOISE), strict=True):
        noise = output.noise_rms
        assert noise is not None
        for column, error in (
            ("error ÷ noise, today", output.heldout_rms_before),
            ("error ÷ noise, with x", output.heldout_rms_after),
        ):
            assert float(row[column]) == pytest.approx(error / noise, rel=1e-6)


def test_without_noise_there_is_no_figure_and_errors_are_compared_with_signals() -> None:
    outputs = {name: replace(one, noise_rms=None) for name, one in OUTPUTS.items()}
    assert error_ratios(outputs) is None
    assert worst_outputs(outputs)[0] == "motor_torque"


def test_the_page_over_all_winches_draws_each_and_keeps_names_as_text() -> None:
    found = {"A": diagnosis_of("explained", ELASTIC), HOSTILE: diagnosis_of("adequate")}
    pages = dict.fromkeys(found, "own.html")
    page = Page(shared_effects_html(found, [], {}, "x", pages))
    assert set(page.shown) == page.figures.keys() == {"errors-cable_length", "errors-tension"}
    assert page.figures["errors-cable_length"]["words"] == ["A", HOSTILE]
    assert page.count("img") == 0
    assert page.count("script") == 2
    (first, second) = page.figures["errors-cable_length"]["columns"][2]
    assert first == pytest.approx(0.36 / 0.30)
    assert second is None, "no effect was named there"
    assert next(f.id for f in fleet_error_ratios(found)) == "errors-cable_length"


def test_headlines_are_short() -> None:
    assert headline(diagnosis_of("explained", ELASTIC)) == "The cable is elastic"
    assert headline(diagnosis_of("adequate")) == "No effect is missing"
    assert headline(diagnosis_of("unknown")) == "No known effect explains the cable length error"
    two = headline(diagnosis_of("explained", ELASTIC, ELASTIC))
    assert two == "2 effects are missing; first, the cable is elastic"


@given(st.integers(1, 5000), st.integers(5, 100), st.integers(0, 2**32 - 1))
def test_every_extreme_stays_and_the_length_is_kept(count: int, intervals: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    series = [random.normal(size=count), random.standard_cauchy(size=count)]
    series[1][random.uniform(size=count) < 0.1] = np.nan
    rows = decimated(series, intervals)
    assert len(rows) <= max(count if count <= 4 * intervals else 0, 4 * intervals + 2)
    assert np.all(np.diff(rows) > 0)
    assert (rows[0], rows[-1]) == (0, count - 1)
    for values in series:
        if np.isfinite(values).any():
            assert np.nanmin(values[rows]) == np.nanmin(values)
            assert np.nanmax(values[rows]) == np.nanmax(values)


@given(st.integers(200, 5000), st.integers(0, 2**32 - 1))
def test_the_extremes_of_every_interval_stay(count: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=count)
    kept = np.isin(np.arange(count), decimated([values], 20))
    for part, there in zip(
        np.split(values, np.linspace(0, count, 21).astype(int)[1:-1]),
        np.split(kept, np.linspace(0, count, 21).astype(int)[1:-1]),
        strict=True,
    ):
        assert {part.min(), part.max()} <= set(part[there])


def test_a_gap_stays_a_gap() -> None:
    values = np.ones(1000)
    values[400:600] = np.nan
    short = values[decimated([values], 50)]
    assert np.count_nonzero(np.isnan(short)) == pytest.approx(10, abs=2)


def test_a_single_spike_is_drawn() -> None:
    values = np.zeros(100_000)
    values[54_321] = 7.0
    rows = decimated([values], 1000)
    assert 54_321 in rows
    assert len(rows) <= 2002


def test_bins_recover_a_line_through_noise() -> None:
    random = np.random.default_rng(1)
    x = random.uniform(0, 10, 20_000)
    y = 3 * x - 1 + random.normal(size=len(x))
    centres, (means,) = bin_means(x, [y], filled_edges(x, 20))
    assert len(centres) == 20
    assert means == pytest.approx(3 * centres - 1, abs=0.15)


def test_few_values_are_bins_of_their_own() -> None:
    x = np.array([-1.0, 0.0, 1.0, 1.0, -1.0])
    centres, (means,) = bin_means(x, [10 * x + 1], filled_edges(x, 20))
    assert centres.tolist() == [-1.0, 0.0, 1.0]
    assert means.tolist() == [-9.0, 1.0, 11.0]


def test_empty_bins_are_left_out() -> None:
    x = np.array([1.0, 2.0, 355.0])
    centres, _ = bin_means(x, [x], np.linspace(0, 360, 37)[1:-1])
    assert centres == pytest.approx([1.5, 355.0])

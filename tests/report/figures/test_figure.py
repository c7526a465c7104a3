"""A figure's files against its data, read by an own reader of SVG and by the csv module."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from figure_drawn import across, down, drawn, polylines
from report_parsed import HOSTILE, Page
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
from winchkit.report.figures.tokens import DARK, LIGHT, STYLES, style_sheet
from winchkit.report.html.page import figure_block
from winchkit.report.html.svg import file_svg


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

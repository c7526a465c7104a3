"""``--html`` and ``--figures``: a page and pictures beside the answer, never instead of it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from click.testing import Result

from command_line import done, invoke
from model_files import write_runs
from report_answers import recorded
from report_parsed import Page

COMMANDS = ["compare", "diagnose", "add"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return write_runs(tmp_path_factory.mktemp("runs"), recorded("demo-elastic-rope")[:2])


def asked(command: str, runs: list[Path], html: Path, *more: str) -> Result:
    words = [command, *runs, "--profile", "bench-spiral"]
    if command == "add":
        better = str(html.parent / "better.toml")
        words = ["add", "cable-elongation-linear", "--fit", *runs, "-p", "bench-spiral"]
        words += ["-o", better if html.parent.is_dir() else str(Path(runs[0]).parent / "b.toml")]
    return invoke(*words, "--html", html, *more)


@dataclass(frozen=True)
class Written:
    """A command's answer, its page in a new folder, and its figures."""

    result: Result
    html: Path
    figures: Path


@pytest.fixture(scope="module", params=COMMANDS)
def written(
    request: pytest.FixtureRequest, runs: list[Path], tmp_path_factory: pytest.TempPathFactory
) -> Written:
    folder = tmp_path_factory.mktemp(request.param)
    html, figures = folder / "new" / "page.html", folder / "figures"
    result = asked(request.param, runs, html, "--json", "--figures", str(figures))
    assert result.exit_code == 0, result.output
    return Written(result, html, figures)


@pytest.mark.slow
def test_the_page_is_written_into_a_new_folder(written: Written, runs: list[Path]) -> None:
    result, html = written.result, written.html
    assert f"report: {html}" in result.stderr.splitlines()
    page = Page(html.read_text(encoding="utf-8"))
    raw = next(word for word in page.words if word.startswith("{"))
    printed = json.loads(result.stdout)
    assert json.loads(raw).keys() == printed.keys()
    assert json.loads(raw)["outputs"] == printed["outputs"]
    assert " ".join(map(str, runs)) in page.text


@pytest.mark.parametrize("command", COMMANDS)
def test_a_page_that_cannot_be_written_is_refused_before_the_work(
    command: str, runs: list[Path], tmp_path: Path
) -> None:
    html = tmp_path / "no" / "such" / "page.html"
    result = asked(command, runs, html)
    assert result.exit_code == 3
    assert result.stderr.splitlines()[-1] == (
        f"{html.parent}: cannot be written: there is no folder '{tmp_path / 'no'}'; make it first"
    )
    assert not result.stdout
    assert not html.parent.exists()


def test_a_folder_is_no_page(runs: list[Path], tmp_path: Path) -> None:
    result = asked("compare", runs, tmp_path)
    assert result.exit_code == 3
    assert "it is a folder; name a file" in result.stderr


def test_a_run_named_by_mistake_stays_what_it_is(runs: list[Path]) -> None:
    taken = Path(runs[0])
    held = taken.read_bytes()
    result = asked("compare", runs, taken)
    assert result.exit_code == 3
    assert "holds something else than a page and was left alone" in result.stderr
    assert taken.read_bytes() == held


def test_a_page_replaces_an_earlier_page(runs: list[Path], tmp_path: Path) -> None:
    html = tmp_path / "page.html"
    html.touch()
    assert asked("compare", runs, html).exit_code == 0
    earlier = html.read_text(encoding="utf-8")
    assert asked("compare", runs[:1], html).exit_code == 0
    assert html.read_text(encoding="utf-8") != earlier


def test_the_page_repeats_the_options_that_it_was_asked_with(
    runs: list[Path], tmp_path: Path
) -> None:
    html = tmp_path / "page.html"
    assert asked("compare", runs, html, "--band", "7.5").exit_code == 0
    page = Page(html.read_text(encoding="utf-8"))
    assert "--profile bench-spiral --band 7.5 --html report.html" in page.text


def test_every_figure_of_the_page_is_written_as_png_svg_and_csv(written: Written) -> None:
    folder = written.figures
    shown = Page(written.html.read_text(encoding="utf-8")).shown
    assert f"figures: {folder} ({len(shown)} as PNG, SVG and CSV)" in written.result.stderr
    expected = {f"{name}.{suffix}" for name in shown for suffix in ("png", "svg", "csv")}
    assert {path.name for path in folder.iterdir()} == expected
    assert all(path.stat().st_size > 50 for path in folder.iterdir())
    assert "bench-spiral" in (folder / f"{shown[0]}.svg").read_text(encoding="utf-8")


def test_figures_need_a_folder_whose_parent_exists(runs: list[Path], tmp_path: Path) -> None:
    words = ["compare", runs[0], "-p", "bench-spiral", "--figures", str(tmp_path / "no" / "such")]
    result = done(*words, code=3)
    assert "the figures cannot be written" in result.stderr
    assert "cable length" in result.stdout

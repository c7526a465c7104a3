"""The notebooks of docs/notebooks run from top to bottom, and their last cell holds."""

from __future__ import annotations

import ast
import os
import re
import sys
from pathlib import Path

import pytest

from command_line import own_process
from snippets import ROOT

FOLDER = ROOT / "docs/notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.py"))
EMPS = "WINCHKIT_EMPS"
CELLS = re.compile(r"^# %%", re.MULTILINE)


def emps() -> Path | None:
    """Folder of the EMPS data, which are not part of the project."""
    beside = [parent / "shared" / "data" / "emps" for parent in ROOT.parents]
    given = os.environ.get(EMPS)
    for folder in [Path(given)] if given else beside:
        if any((folder / name).is_file() for name in ("DATA_EMPS.mat", "train.csv")):
            return folder
    return None


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_its_claims_hold(path: Path, tmp_path: Path) -> None:
    for package in ("matplotlib", "pandas", "pyarrow"):
        pytest.importorskip(package)
    environment = {**os.environ, "MPLBACKEND": "agg"}
    if EMPS in path.read_text(encoding="utf-8"):
        folder = emps()
        if folder is None:
            pytest.skip(f"the EMPS data are not here; {EMPS} names the folder that has them")
        environment[EMPS] = str(folder)
    own_process(
        sys.executable, "-W", "error", str(shown(path, tmp_path)), cwd=tmp_path, env=environment
    )


def shown(path: Path, folder: Path) -> Path:
    """The notebook with the last expression of every cell shown as a notebook shows it."""
    source = path.read_text(encoding="utf-8")
    lines = ["def _shown(value):", "    print(repr(value)[:2000])"]
    lines += ["    html = getattr(value, '_repr_html_', None)", "    html and html()"]
    for cell in CELLS.split(source):
        if cell.startswith(" [markdown]") or not cell.strip():
            continue
        body = ast.parse(cell).body
        if body and isinstance(body[-1], ast.Expr):
            start = body[-1].lineno - 1
            whole = cell.split("\n")
            cell = "\n".join(whole[:start]) + f"\n_shown({ast.unparse(body[-1].value)})"  # noqa: PLW2901
        lines.append(cell)
    script = folder / path.name
    script.write_text("\n".join(lines), encoding="utf-8")
    return script


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_cells_a_title_and_a_check_at_its_end(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    cells = CELLS.split(source)[1:]
    assert cells[0].startswith(" [markdown]\n# # ")
    assert cells[-1].strip().startswith(("named", "assert", "before"))
    assert "assert " in cells[-1]
    assert len([cell for cell in cells if cell.startswith(" [markdown]")]) > 3


def test_there_are_the_three_that_the_page_lists() -> None:
    text = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert [path.name for path in NOTEBOOKS if f"({path.name})" not in text] == []
    assert len(NOTEBOOKS) == 3

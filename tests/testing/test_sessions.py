"""Sessions of pytest as users start them: parallel workers, the example, the page."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from command_line import own_process

ROOT = Path(__file__).parents[2]


def run_pytest(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """A session of its own, as a user starts one."""
    environment = {key: text for key, text in os.environ.items() if "PYTEST" not in key}
    return own_process(
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-W",
        "error",
        *options,
        code=None,
        cwd=folder,
        env=environment,
    )


def test_parallel_workers_do_not_clash(tmp_path: Path) -> None:
    """Two workers, the same bench in each test, and each sees its own motion only."""
    (tmp_path / "test_own.py").write_text(
        "import pytest\n"
        "@pytest.mark.parametrize('way, sign', [('wind_in', -1), ('pay_out', 1)])\n"
        "def test_own(sim_bench, way, sign):\n"
        "    sim = sim_bench('spiral-bench')\n"
        "    sim.bench.winch['A'].move_by(**{way: 0.04}, speed=0.2)\n"
        "    sim.assert_moved('A', sign * 0.04, 2e-3)\n",
        encoding="utf-8",
    )
    done = run_pytest(tmp_path, "-n", "2")
    assert done.returncode == 0, done.stdout
    assert "2 passed" in done.stdout


@pytest.mark.realtime
def test_the_example_passes_its_own_tests() -> None:
    """Its last test moves a bench in another process, in real time: a stall stops that, rightly."""
    done = run_pytest(ROOT / "examples" / "control_loop")
    assert done.returncode == 0, done.stdout
    assert "skipped" not in done.stdout or "multicast" in done.stdout


def test_the_page_is_a_file_of_tests(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "howto" / "ci.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    (tmp_path / "test_page.py").write_text(block, encoding="utf-8")
    done = run_pytest(tmp_path)
    assert done.returncode == 0, done.stdout
    assert f"{block.count('def test_')} passed" in done.stdout

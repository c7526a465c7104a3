"""Columns by arithmetic on the command line: values, units, and what is refused or asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit import import_runs
from winchkit.errors import UsageError

TIME = np.arange(60) / 100
COLUMNS = {
    "time [s]": TIME,
    "q [rad]": np.sin(7 * TIME),
    "tau1 [mN m]": 900 + 100 * np.cos(TIME),
    "tau2 [N m]": 0.3 * np.sin(3 * TIME),
    "Iq [A]": 2 + TIME,
    "tau-x [N m]": 5 - TIME,
    "n/min [rpm]": 40 * TIME,
    "u": 3 * TIME + 1,
}
ONE, TWO, CURRENT, OTHER, PLAIN = (
    np.round(COLUMNS[name], 9)
    for name in ("tau1 [mN m]", "tau2 [N m]", "Iq [A]", "tau-x [N m]", "u")
)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "a.csv"
    rows = zip(*COLUMNS.values(), strict=True)
    lines = [",".join(COLUMNS), *(",".join(f"{x:.9f}" for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("(tau1-tau2)/2", (ONE / 1000 - TWO) / 2),
        ("-(tau1-tau2)/2", -(ONE / 1000 - TWO) / 2),
        ("((tau1-tau2)*2+tau2)/2", (2 * (ONE / 1000 - TWO) + TWO) / 2),
        ("Iq*0.12/1.5", CURRENT * 0.08),
        ("-Iq*(0.12/1.5)", -CURRENT * 0.08),
        ("0,12*Iq/1,5", CURRENT * 0.08),
        ("Iq*u/2 [N m]", CURRENT * PLAIN / 2),
        ("tau-x", OTHER),
        ("tau-x-tau2", OTHER - TWO),
        ("(tau1)", ONE / 1000),
        ("tau1*2/3 [mN m]", ONE / 1500),
        ("tau2/2", TWO / 2),
    ],
)
def test_arithmetic_of_columns(log: Path, column: str, expected: np.ndarray) -> None:
    [run] = import_runs(log, columns=[f"motor_torque={column}"])
    np.testing.assert_allclose(run["motor_torque"], expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("column", "told"),
    [
        ("tau1-Iq", r"a sum of \[mN m\] and \[A\] has no unit"),
        ("tau1/0", "it divides by 0"),
        ("(tau1-tau2", "a bracket is not closed"),
        ("tau1-tau2)", "is left over"),
        ("tau1//tau2", "a column or a number is missing"),
        ("(" * 60 + "tau1" + ")" * 60, "brackets in each other"),
        ("nix/2", "there is no column 'nix' for 'nix/2'"),
        ("tau1/tau2", "has no unit"),
        ("tau1*2", "'tau1' is in mN m: in which unit is it times 2"),
        ("tau1*2/3", "'tau1' is in mN m: in which unit is it times 0.6666"),
    ],
)
def test_what_no_arithmetic_is_or_has_no_unit_is_asked(log: Path, column: str, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        import_runs(log, columns=[f"motor_torque={column}"])

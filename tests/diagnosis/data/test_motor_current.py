"""A motor current is compared as a torque, by the torque constant of the profile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit import compare, read_run
from winchkit.errors import RunError
from winchkit.schema.read import read_profile

CONSTANT = 0.125
AXIS = """schema = 1
kind = "axis"
name = "motor"
[motor]
{constant}
[gearbox]
ratio = 1
"""


def axis(folder: Path, constant: str) -> Path:
    path = folder / "axis.toml"
    path.write_text(AXIS.format(constant=constant))
    return path


def recorded(folder: Path, column: str, factor: float) -> Path:
    """A turning motor with friction and cogging; the column is its torque times a factor."""
    time = 0.01 * np.arange(1500)
    angle = 6 * np.sin(0.8 * time)
    torque = 0.2 * np.tanh(6 * 0.8 * np.cos(0.8 * time) / 0.5) + 0.02 * np.sin(7 * angle)
    path = folder / f"{column.split(maxsplit=1)[0]}.csv"
    rows = np.column_stack([time, angle, factor * torque])
    head = f"time [s],motor_angle [rad],{column}"
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=head, comments="")
    return path


def test_a_current_is_compared_as_its_torque(tmp_path: Path) -> None:
    profile = read_profile(axis(tmp_path, f'torque_constant = "{CONSTANT} N m/A"'))
    torque = compare([read_run(recorded(tmp_path, "motor_torque [N m]", 1.0))], profile)
    current = compare([read_run(recorded(tmp_path, "motor_current [mA]", 1e3 / CONSTANT))], profile)
    assert list(current.outputs) == ["motor_torque"]
    assert current.outputs["motor_torque"].rms == pytest.approx(
        torque.outputs["motor_torque"].rms, rel=1e-6
    )


def test_without_a_torque_constant_the_message_names_the_key(tmp_path: Path) -> None:
    profile = read_profile(axis(tmp_path, ""))
    run = read_run(recorded(tmp_path, "motor_current [A]", 1 / CONSTANT))
    with pytest.raises(RunError, match=r"give motor\.torque_constant in the profile"):
        compare([run], profile)


def test_a_recorded_torque_comes_first(tmp_path: Path) -> None:
    profile = read_profile(axis(tmp_path, f'torque_constant = "{CONSTANT} N m/A"'))
    path = recorded(tmp_path, "motor_torque [N m]", 1.0)
    lines = path.read_text().splitlines()
    both = [
        f"{lines[0]},motor_current [A]",
        *(f"{line},{k % 3}" for k, line in enumerate(lines[1:])),
    ]
    path.write_text("\n".join(both) + "\n")
    own = compare([read_run(path)], profile).outputs["motor_torque"]
    assert own.rms == pytest.approx(np.sqrt(np.mean(own.signal_rms**2)), rel=0.05)

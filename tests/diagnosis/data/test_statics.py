"""A load cell at rest: its effects are named and fitted as numpy fits them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis_runs import GROOVED, made, with_channel
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.statics import is_at_rest
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs import read_run
from winchkit.runs.run import Channel, Run
from winchkit.runs.writer import write_run

WEIGHTS = (0.0, 2.0, 5.0, 10.0, 15.0, 20.0, 15.0, 10.0, 5.0, 2.0, 0.0)
GRAVITY = 9.80665
NOISE = 0.05


def weighed(seed: int, *, gain: float = 0.0, drift: float = 0.0, thermal: float = 0.0) -> Run:
    """Weights up and down, 40 s each, and a cell with errors that are written out here."""
    random = np.random.default_rng(seed)
    load = np.repeat(GRAVITY * np.array(WEIGHTS), 400)
    time = np.arange(len(load)) / 10
    warm = 20 + 3 * np.sin(2 * np.pi * time / 290)
    tension = load * (1 + gain) + drift * time + thermal * (warm - 20)
    channels = {
        "tension": Channel(tension + random.normal(0, NOISE, len(time)), "N"),
        "load": Channel(load, "N"),
        "temperature": Channel(warm + random.normal(0, 0.02, len(time)), "degC"),
    }
    return Run(f"rest-{seed}", time, channels)


def values_of(diagnosis: Diagnosis) -> Mapping[str, float]:
    named = [step.parameters[step.effects[0]] for step in diagnosis.steps]
    return {name: value.value for values in named for name, value in values.items()}


def test_a_perfect_cell_is_adequate() -> None:
    said = diagnose([weighed(1), weighed(2)], GROOVED).diagnosis
    assert (said.verdict, said.steps) == ("adequate", ())
    assert list(said.outputs) == ["tension"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("errors", "parameters"),
    [
        ({"gain": 0.02}, {"gain_error": 0.02}),
        ({"drift": 2e-3}, {"drift": 2e-3}),
        ({"thermal": 0.2}, {"sensitivity": 0.2}),
        ({"gain": 0.01, "drift": 2e-3}, {"gain_error": 0.01, "drift": 2e-3}),
    ],
    ids=["span", "drift", "temperature", "span and drift"],
)
def test_effects_of_the_cell_agree_with_least_squares(
    errors: dict[str, float], parameters: dict[str, float]
) -> None:
    runs = [weighed(seed, **errors) for seed in (1, 2)]
    said = diagnose(runs, GROOVED).diagnosis
    assert said.verdict == "explained"
    columns = {
        "gain_error": lambda r: r["load"],
        "drift": lambda r: r.time,
        "sensitivity": lambda r: r["temperature"] - 20,
    }
    matrix = np.column_stack([np.concatenate([columns[p](r) for r in runs]) for p in parameters])
    error = np.concatenate([r["tension"] - r["load"] for r in runs])
    fitted = np.linalg.lstsq(matrix, error, rcond=None)[0]
    assert values_of(said) == pytest.approx(dict(zip(parameters, fitted, strict=True)), rel=5e-3)
    assert values_of(said) == pytest.approx(parameters, rel=0.02)


def test_a_known_mass_is_enough_for_a_drift() -> None:
    runs = []
    for seed, mass in ((1, 5.0), (2, 15.0)):
        run = weighed(seed)
        tension = GRAVITY * mass + run["tension"] - run["load"] + 2e-3 * run.time
        channels = {"tension": Channel(tension, "N")}
        runs.append(replace(run, channels=channels, metadata={"load_mass": f"{mass} kg"}))
    said = diagnose(runs, GROOVED).diagnosis
    assert values_of(said)["drift"] == pytest.approx(2e-3, rel=0.02)


def test_a_file_without_a_motor_angle_is_read_and_compared(tmp_path: Path) -> None:
    path = tmp_path / "rest.csv"
    write_run(weighed(1, gain=0.02), path)
    error = compare([read_run(path)], GROOVED).outputs["tension"]
    load = weighed(1)["load"]
    assert error.rms == pytest.approx(np.sqrt(np.mean((0.02 * load) ** 2)), rel=0.01)


def test_jitter_of_an_encoder_is_rest_and_a_slow_motion_is_none() -> None:
    jitter = 1e-4 * np.random.default_rng(1).integers(-2, 3, 4400)
    still = with_channel(weighed(1), "motor_angle", 7.0 + jitter, "rad")
    assert is_at_rest(still, GROOVED)
    (recording,) = prepare([still], GROOVED).recordings
    assert set(recording.measured) == {"tension"}
    assert not np.ptp(recording.signals.motor_angle)
    assert not is_at_rest(made(1), GROOVED)
    dead = with_channel(made(1), "motor_angle", np.zeros(400), "rad")
    assert not is_at_rest(dead, GROOVED)
    alone = replace(still, channels={k: v for k, v in still.channels.items() if k != "load"})
    assert not is_at_rest(alone, GROOVED)

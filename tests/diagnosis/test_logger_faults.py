"""Cases of the campaign with faults of loggers: what a fault does, and what the files identify."""

import json
from dataclasses import asdict, replace
from functools import cache
from math import log
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from campaign.answers import keep, kept, scores_of
from campaign.bench import Bench, draw_bench
from campaign.identifiable import RATIO, gram, identity, least_along, without
from campaign.logger_case import LoggerPlan, answer, make_logger_case
from campaign.logger_score import LoggerScore, clopper_pearson, logger_summary
from campaign.loggers import FAULTS, MISREAD, Fault, fault_of
from campaign.record import AR, Recording, recordings
from campaign.score import Interval, Score
from campaign.several_score import SeveralScore
from campaign.truth import OUTPUTS, Hidden, Situation, show
from winchkit.arrays import Array
from winchkit.runs.read import read_run


def _start(run: Situation, seconds: float) -> Situation:
    """The first seconds of a run."""
    rows = run.time - run.time[0] < seconds
    arrays = ("time", "motor_angle", "temperature", "wander")
    return replace(run, **{name: getattr(run, name)[rows] for name in arrays})


@cache
def bench() -> Bench:
    """A grooved drum, known load, white noise, 50 Hz."""
    for seed in range(10_000):
        drawn = draw_bench(np.random.default_rng(seed), repeats=True, small=True)
        time = drawn.situations[0].time[:: drawn.situations[0].every]
        if (drawn.winch.kind, drawn.load, round(1 / (time[1] - time[0]))) == (
            "grooved",
            "load",
            50,
        ):
            winch = replace(drawn.winch, ratio=10.0)
            # Two loads, each twice, 15 s.
            situations = tuple(_start(run, 15.0) for run in drawn.situations[:4])
            programmes = drawn.programmes[:4]
            return replace(drawn, winch=winch, situations=situations, programmes=programmes)
    raise AssertionError


@cache
def recorded() -> tuple[Recording, ...]:
    return tuple(recordings(np.random.default_rng(1), {"": bench()}, {"": {}}))


def faulty(name: str, seed: int = 3) -> Fault:
    found = fault_of(name, np.random.default_rng(seed), bench(), recorded())
    assert found is not None
    return found


def test_products_are_those_of_the_dense_covariance_also_with_lost_samples() -> None:
    random = np.random.default_rng(0)
    rows = np.flatnonzero(random.random(90) < 0.7)
    columns = random.normal(size=(len(rows), 3))
    white, coloured = 0.7, 0.4
    apart = np.abs(rows[:, None] - rows[None, :])
    covariance = white * np.eye(len(rows)) + coloured * AR**apart
    expected = columns.T @ np.linalg.solve(covariance, columns)
    np.testing.assert_allclose(gram(columns, rows, white, coloured), expected, rtol=1e-10)


def test_noise_of_the_generator_has_the_covariance_of_its_likelihood() -> None:
    own = bench()
    noisy = replace(own, colour=0.6)
    plain = [show(own.winch, run, {}) for run in own.situations]
    squares, count = 0.0, 0
    for seed in range(4):
        for run, true in zip(
            recordings(np.random.default_rng(seed), {"": noisy}, {"": {}}), plain, strict=True
        ):
            values = run.channels["tension"]
            noise = (values - true.tension[: len(values)])[:, None]
            power = own.noise["tension"] ** 2
            rows = np.arange(len(values))
            squares += float(gram(noise, rows, 0.4 * power, 0.6 * power)[0, 0])
            count += len(values)
    # χ² of as many degrees of freedom as samples: five standard deviations.
    assert squares == pytest.approx(count, abs=5 * np.sqrt(2 * count))


def test_nuisance_is_fitted_by_least_squares() -> None:
    columns = np.random.default_rng(1).normal(size=(40, 5))
    beside = columns[:, 3:]
    left = columns - beside @ np.linalg.lstsq(beside, columns, rcond=None)[0]
    np.testing.assert_allclose(
        without(columns.T @ columns, [3, 4]), left.T @ left, rtol=1e-9, atol=1e-9
    )


def test_least_square_along_a_broken_line() -> None:
    goal, first, second = np.random.default_rng(2).normal(size=(3, 12))
    columns = np.column_stack([goal, first, second])
    line = [p * first for p in np.linspace(0, 1, 2001)]
    line += [first + p * (second - first) for p in np.linspace(0, 1, 2001)]
    expected = min(float(np.sum((goal - d) ** 2)) for d in line)
    assert least_along(columns.T @ columns, 0, [1, 2]) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(("hits", "cases"), [(0, 30), (30, 30), (3, 200), (597, 600)])
def test_intervals_are_exact(hits: int, cases: int) -> None:
    exact = binomtest(hits, cases).proportion_ci(0.95, method="exact")
    assert clopper_pearson(hits, cases) == pytest.approx((exact.low, exact.high), rel=1e-9)


@pytest.mark.parametrize("name", [f for f in FAULTS if f not in MISREAD])
def test_files_have_what_the_instruments_showed_but_for_the_fault(name: str) -> None:
    fault = faulty(name)
    lost, off = 0, 0.0
    for file in fault.files:
        before = recorded()[file.run].channels
        for channel in OUTPUTS:
            values, shown = file.recording.channels[channel], before[channel][file.rows]
            allowed = fault.steps.get(channel, 0.0) / 2 + 1e-12
            if file.copy:
                allowed += bench().noise[channel] / 8
            if channel in fault.zeroed:
                shown = shown + float(np.mean(values - shown))
                off = max(off, float(np.max(np.abs(values - before[channel][file.rows]))))
            wrong = np.abs(values - shown) > allowed
            spikes = file.spikes.get(channel, np.zeros(len(values), dtype=bool))
            assert not np.any(wrong & ~spikes)
        lost += len(before["time"]) - len(file.rows)
        assert np.all(np.diff(file.recording.channels["time"]) > 0)
    expected = {"gappy", "20-Hz"}
    assert (lost > 0) == (name in expected) or name == "excerpts"
    assert (off > 0) == (name == "zeroed-anew")
    assert len(fault.files) == (2 if name == "no-repeats" else 4)
    assert any(file.copy for file in fault.files) == (name == "excerpts")


@pytest.mark.parametrize("name", MISREAD)
def test_a_wrong_sign_or_unit_is_one_factor_of_one_channel(name: str) -> None:
    fault = faulty(name)
    for file, before in zip(fault.files, recorded(), strict=True):
        for channel, values in file.recording.channels.items():
            true = before.channels[channel]
            factor = float(values @ true / (true @ true))
            np.testing.assert_allclose(values, factor * true, rtol=1e-12)
            if channel != fault.channel:
                assert factor == pytest.approx(1.0, rel=1e-12)
            elif name == "inverted-sign":
                assert factor == pytest.approx(-1.0, rel=1e-12)
            else:
                assert factor > 1.8 or 0 < factor < 1 / 1.8


def hidden_in_files(hidden: Hidden, fault: str = "none") -> tuple[Hidden, Fault]:
    runs = recordings(np.random.default_rng(5), {"": bench()}, {"": hidden})
    found = fault_of(fault, np.random.default_rng(5), bench(), runs)
    assert found is not None
    return hidden, found


def test_a_ratio_does_what_a_radius_does_on_a_grooved_drum() -> None:
    hidden, fault = hidden_in_files({"drum-radius": {"radius_error": 1e-3}})
    known = identity(bench(), hidden, fault)
    assert known.rival in {"gear-ratio", "guide-offset"}
    assert known.log_ratio < log(RATIO)
    assert not known.identifiable


def test_nothing_is_a_rival_too() -> None:
    hidden, fault = hidden_in_files({"cell-drift": {"drift": 0.2}})
    own = replace(bench(), colour=0.0)
    known = identity(own, hidden, fault)
    residuals: dict[str, list[Array]] = {"true": [], "plain": []}
    for file in fault.files:
        for name, what in (("true", hidden), ("plain", {})):
            ideal = show(own.winch, own.situations[file.run], what)
            for output in OUTPUTS:
                values = file.recording.channels[output]
                left = (values - getattr(ideal, output)[: len(values)]) / own.noise[output]
                residuals[name].append(left - left.mean() if output == "cable_length" else left)
    true, plain = (float(np.sum(np.concatenate(residuals[n]) ** 2)) for n in ("true", "plain"))
    assert 0 < known.log_ratio <= (plain - true) / 2
    assert known.identifiable


def test_an_effect_far_below_the_noise_is_not_identifiable() -> None:
    hidden, fault = hidden_in_files({"motor-viscous": {"viscosity": 1e-9}})
    assert not identity(bench(), hidden, fault).identifiable


@pytest.mark.slow
def test_a_zero_of_every_run_hides_what_only_an_offset_shows() -> None:
    hidden: Hidden = {"frame-compliance": {"stiffness": 1e5}}
    once = identity(bench(), *hidden_in_files(hidden))
    random = np.random.default_rng(5)
    runs = recordings(random, {"": bench()}, {"": hidden})
    files = fault_of("none", random, bench(), runs)
    assert files is not None
    anew = identity(bench(), hidden, replace(files, zeroed=frozenset({"cable_length"})))
    assert anew.log_ratio < once.log_ratio


def test_a_seed_means_a_case(tmp_path: Path) -> None:
    plan = LoggerPlan(0.0, "", "gappy", small=True)
    first, second = (make_logger_case(8, plan, tmp_path / name) for name in "ab")
    assert first is not None
    assert second is not None
    assert first.fault.words == second.fault.words
    for one, other in zip(first.runs, second.runs, strict=True):
        assert one.read_bytes() == other.read_bytes()
    run = read_run(first.runs[0])
    assert np.max(np.diff(run.time)) > 5 * np.median(np.diff(run.time))


def scored(seed: int, **changed: object) -> LoggerScore:
    told: dict[str, object] = {
        "seed": seed, "snr": 3.0, "hidden": {"cell-gain": {"gain_error": 0.01}}, "fault": "none",
        "detail": "", "channel": "", "rival": "cell-offset", "log_ratio": 9.0,
        "identifiable": True, "verdict": "explained", "steps": (("cell-gain",),), "certain": (),
        "caveats": (), "findings": (), "refusal": "", "seconds": 1.0, "scene": "",
    }  # fmt: skip
    return LoggerScore.read(told | changed)


def test_an_answer_is_right_or_wrong() -> None:
    assert scored(1).ok
    assert not scored(1, steps=(("cell-offset",),)).ok
    assert not scored(1, certain=("cell-offset",)).ok
    assert not scored(1, verdict="unknown", steps=()).ok
    assert scored(1, verdict="unknown", steps=(), identifiable=False).ok
    assert not scored(1, hidden={}, verdict="unknown", steps=()).ok
    turned = {"fault": "inverted-sign", "channel": "tension", "steps": (), "verdict": "unknown"}
    assert not scored(1, **turned).ok
    found = {"caveats": ("inverted-sign",), "findings": (("inverted-sign", "tension"),)}
    assert scored(1, **turned, **found).ok
    assert not scored(1, **{**turned, "channel": "load"}, **found).ok
    words = "inverted sign of 'cable_length' or 'motor_angle'"
    refused = {"channel": "motor_angle", "verdict": "refused", "refusal": words}
    assert scored(1, **{**turned, **refused}).ok


def test_a_campaign_goes_on_where_its_log_ends(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_text(json.dumps(asdict(scored(700_000))) + "\n")
    asked = []

    def one(seed: int, _plan: LoggerPlan, _folder: Path) -> LoggerScore:
        asked.append(seed)
        return scored(seed)

    got = scores_of(one, 7, [LoggerPlan(3.0)] * 3, LoggerScore.read, log=path)
    assert asked == [700_001, 700_002]
    assert got == [scored(700_000 + k) for k in range(3)]
    figures = logger_summary(got)["figures"]
    assert figures["truth_in_first"]["hits"] == figures["truth_in_first"]["cases"] == 3


def test_scores_of_every_campaign_are_read_from_their_log(tmp_path: Path) -> None:
    path = tmp_path / "log"
    interval = Interval("cell-gain", "gain_error", 0.02, 0.021, 0.02, 0.022, 1.0)
    score = Score(
        seed=3, kind="single", snr=1.0, hidden={"cell-gain": {"gain_error": 0.02}},
        truth=("cell-gain",), verdict="explained", steps=(("cell-gain", "cell-crosstalk"),),
        share=0.0, p_value=0.5, truth_in_first=True, wrong_single_names=(), found=1,
        heldout_over_noise=1.0, intervals=(interval,), seconds=1.0, scene="spiral",
    )  # fmt: skip
    several = SeveralScore(
        seed=4, extent="one", snr=1.0, truth={"A": ("cell-gain",), "B": ()},
        verdicts={"A": "explained", "B": "adequate"}, steps={"A": (("cell-gain",),), "B": ()},
        shared=({"winches": ["A"]},), seconds=1.0, scene="spiral",
    )  # fmt: skip
    keep(score, path)
    assert kept(path, Score.read) == {3: score}
    path.unlink()
    keep(several, path)
    assert kept(path, SeveralScore.read) == {4: several}


@pytest.mark.slow
@pytest.mark.campaign
def test_a_ripple_that_is_sampled_a_few_times_per_period_keeps_its_name(tmp_path: Path) -> None:
    """Two fast runs: the derivatives of the effect are too small there, which is known."""
    case = make_logger_case(26112700321, LoggerPlan(1.0), tmp_path)
    assert case is not None
    assert list(case.hidden) == ["gear-transmission-error"]
    found = answer(case)
    assert (found.verdict, found.steps) == ("explained", (("gear-transmission-error",),))

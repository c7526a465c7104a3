"""A bench: a winch with its instruments' noise, its programmes and its loads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from campaign.sizes import Scene
from campaign.truth import Situation
from campaign.winch import Winch, draw_winch, turns_for
from winchkit.arrays import Array


def programme(
    random: np.random.Generator, rate: float, seconds: float, stroke: float
) -> tuple[Array, Array]:
    """Time (s) and cable wound in since the start (m, roughly; it begins at zero), both (n,).

    Moves between random places of a ``stroke`` (m) below the start, at speeds from creep to
    fast, each with a smooth rise of the speed.
    """
    step = 1 / rate
    count = round(seconds * rate)
    speed = np.zeros(count)
    at, place = int(rate * random.uniform(0.5, 3)), 0.0
    speeds = np.geomspace(max(0.02, 0.4 * stroke / seconds), min(0.6, 8 * stroke / seconds), 4)
    while at < count:
        goal = -stroke * random.uniform(0, 1)
        if abs(goal - place) < 0.25 * stroke:
            goal = -stroke if place > -stroke / 2 else 0.0
        fast = float(random.choice(speeds))
        length = max(2, round(abs(goal - place) / fast * rate))
        speed[at : at + length] = np.sign(goal - place) * fast
        place += float(np.sum(speed[at : at + length])) * step
        at += length + round(rate * random.choice([0.4, 1.0, 3.0, 6.0]))
    rise = max(3, round(random.uniform(0.25, 0.6) * rate))
    bell = np.hanning(rise + 2)
    smooth = np.convolve(speed, bell / bell.sum(), mode="same")
    wound = np.concatenate([[0.0], np.cumsum((smooth[1:] + smooth[:-1]) / 2)]) * step
    return np.arange(count) * step, wound


Random = np.random.Generator
_FINE = 200.0
"""Steps of a fine physics, Hz."""


@dataclass(frozen=True)
class Bench:
    """A winch and all its runs, SI."""

    winch: Winch
    situations: tuple[Situation, ...]
    programmes: tuple[int, ...]
    """Which programme each run follows."""
    scene: Scene
    load: str
    """How the load is given: ``load`` (a channel), ``mass`` (metadata) or ``cell`` (not at all)."""
    repeats: str
    """``perfect``, ``imperfect`` (another clock, length and temperature) or ``none``."""
    warms: bool
    measures_temperature: bool
    noise: dict[str, float]
    """Rms per channel."""
    colour: float
    """Share of the noise's power that is AR(1)."""

    @property
    def words(self) -> str:
        """The bench in a line."""
        w, first = self.winch, self.situations[0]
        return (
            f"{w.kind} dir {w.direction} ratio {w.ratio} pulleys {len(w.wraps)} {self.load} "
            f"{len(self.situations)} runs {len(first.time)} steps of 1/{first.every} samples "
            f"masses {self.scene.masses} warms {self.warms} colour {self.colour} "
            f"repeats {self.repeats}"
        )


def draw_bench(random: Random, repeats: bool, small: bool, finely: bool = False) -> Bench:
    """Any bench; with ``repeats`` every run is recorded twice, perfectly or imperfectly.

    Its physics has finer steps than the samples, or steps as coarse as they are; ``finely``: steps
    of 5 ms, whose differences are nearly derivatives.
    """
    winch = draw_winch(random)
    every, sampled = int(random.choice([1, 4])), float(random.choice([20.0, 25.0, 50.0]))
    rate = _FINE if finely else every * sampled
    every = round(rate / sampled)
    seconds = float(random.uniform(60, 100 if small else 200))
    stroke = float(random.uniform(0.5, 5))
    # The cable stays on the drum and its first layer.
    stroke = min(stroke, 0.8 * 2 * np.pi * winch.wound_turns * winch.radius)
    heaviest = float(random.uniform(15, 60))
    masses = tuple(
        round(heaviest * part, 2) for part in (1.0, 0.35, 0.6)[: int(random.integers(2, 4))]
    )
    load = str(random.choice(["load", "mass", "load", "mass", "cell"]))
    late = repeats and str(random.choice(["perfect", "imperfect"])) == "imperfect"
    warms = bool(random.random() < 0.5)
    moves = [programme(random, rate, seconds, stroke) for _ in range(int(random.integers(1, 3)))]
    wander = _slow_curve(random, len(moves[0][0]))
    situations, programmes = [], []
    for index, (time, wound) in enumerate(moves):
        angle = turns_for(winch, 1.0) * wound
        motor = winch.motor_reference + winch.direction * winch.ratio * angle
        for mass in masses if index == 0 else masses[:2]:
            whole = Situation(time, motor, mass, np.zeros_like(time), wander, every)
            for again in range(2 if repeats else 1):
                situations.append(_one_run(random, whole, rate, warms, bool(again and late)))
                programmes.append(index)
    return Bench(
        winch=winch,
        situations=tuple(situations),
        programmes=tuple(programmes),
        scene=Scene(seconds, stroke, masses),
        load=load,
        repeats="none" if not repeats else "imperfect" if late else "perfect",
        warms=warms,
        measures_temperature=bool(warms or random.random() < 0.3),
        noise=_noise_of_instruments(random, 9.8 * heaviest * winch.radius / winch.ratio),
        colour=float(random.choice([0.0, 0.3, 0.6])),
    )


def draw_beside(random: Random, bench: Bench) -> Bench:
    """Another winch of the same make in the same recordings, which moves in its own way."""
    winch, whole = bench.winch, max(len(s.time) for s in bench.situations)
    first = bench.situations[0]
    rate = 1 / float(first.time[1] - first.time[0])
    moves = {
        number: programme(random, rate, whole / rate, bench.scene.stroke)[1]
        for number in dict.fromkeys(bench.programmes)
    }
    turns = winch.direction * winch.ratio * turns_for(winch, 1.0)
    situations = [
        replace(s, motor_angle=winch.motor_reference + turns * moves[number][: len(s.time)])
        for s, number in zip(bench.situations, bench.programmes, strict=True)
    ]
    return replace(bench, situations=tuple(situations))


def _one_run(random: Random, whole: Situation, rate: float, warms: bool, late: bool) -> Situation:
    """A run of a programme; a ``late`` one has another clock, length and temperature."""
    every = whole.every
    drop = every * int(random.integers(0, rate / every)) if late else 0
    start = float(random.uniform(0, 9)) if late else 0.0
    kept = slice(0, len(whole.time) - drop)
    warm = _temperature(random, whole.time, warms, late)
    return Situation(
        time=whole.time[kept] + start,
        motor_angle=whole.motor_angle[kept],
        mass=whole.mass,
        temperature=warm[kept],
        wander=whole.wander[kept],
        every=every,
    )


def _noise_of_instruments(random: Random, torque: float) -> dict[str, float]:
    """Rms per channel; ``torque`` is the largest, N m."""
    return {
        "cable_length": float(random.uniform(5e-5, 3e-4)),
        "tension": float(random.uniform(0.2, 1.5)),
        "motor_torque": float(random.uniform(0.003, 0.01) * torque),
        "load": float(random.uniform(0.1, 1.0)),
    }


def _slow_curve(random: Random, count: int) -> Array:
    knots = np.cumsum(random.normal(size=7))
    curve = np.interp(np.linspace(0, 6, count), np.arange(7), knots)
    width = count // 8
    padded = np.pad(curve, width, mode="edge")
    curve = np.convolve(padded, np.hanning(width) / np.hanning(width).sum(), mode="same")
    curve = curve[width:-width] - curve.mean()
    return np.asarray(curve / np.std(curve))


def _temperature(random: Random, time: Array, warms: bool, late: bool) -> Array:
    level = 20.0 + (random.uniform(-3, 6) if late else random.uniform(0, 1))
    if not warms:
        return np.full_like(time, level)
    span = random.uniform(4, 12)
    return np.asarray(level + span * np.sin(np.pi * time / time[-1] * random.uniform(0.8, 1.7)))

"""Recordings that say nothing, or nothing for a part, of what a profile predicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from campaign.family.case import ATTEMPTS, OUTPUT, Case, Truth, shown_by
from campaign.family.instruments import Chain, runs_of
from campaign.family.machine import Friction, Machine, draw_friction, draw_machine
from campaign.record import Recording
from campaign.truth import OUTPUTS, TURN, Shown
from winchkit.arrays import Array

Random = np.random.Generator
SLACK = 0.02
"""Force of a cable whose load stands on the ground, over the load's weight."""
SOFT = 0.05
"""Way over which a load is put down, m."""


def _numbers(random: Random, time: Array, size: float) -> Array:
    """White noise about any level."""
    level, spread = size * random.uniform(-1, 1), size * random.uniform(0.2, 1)
    return np.asarray(random.normal(level, spread, len(time)))


def _walk(random: Random, time: Array, size: float) -> Array:
    """A random walk from any level."""
    walk = np.cumsum(random.normal(size=len(time)))
    return np.asarray(size * (random.uniform(-1, 1) + walk / np.ptp(walk)))


def _sines(random: Random, time: Array, size: float) -> Array:
    """Three sines of periods from 0.5 s to half the recording, drawn for each file."""
    out = np.full_like(time, size * random.uniform(-1, 1))
    for _ in range(3):
        period = np.exp(random.uniform(np.log(0.5), np.log(time[-1] / 2)))
        phase = random.uniform(0, TURN)
        out += size * random.uniform(0.2, 0.7) * np.sin(TURN * time / period + phase)
    return out


def _replaced(
    make: Callable[[Random, Array, float], Array],
) -> Callable[[Random, Machine, Sequence[Recording], Sequence[str]], list[Recording]]:
    def of_runs(
        random: Random, _: Machine, runs: Sequence[Recording], names: Sequence[str]
    ) -> list[Recording]:
        sizes = {name: _largest(runs, name) for name in names}
        return [
            _changed(run, {n: make(random, run.channels["time"], sizes[n]) for n in names})
            for run in runs
        ]

    return of_runs


def _constants(
    random: Random, _: Machine, runs: Sequence[Recording], names: Sequence[str]
) -> list[Recording]:
    """One value of every channel in all files: zero, the first value, or any; some with noise."""
    how = str(random.choice(["zero", "first", "any", "noisy"]))
    levels = {}
    for name in names:
        drawn = {"zero": 0.0, "first": float(runs[0].channels[name][0])}
        levels[name] = drawn.get(how, _largest(runs, name) * random.uniform(-1, 1))
    spread = 0.01 if how == "noisy" else 0.0
    return [
        _changed(
            run,
            {
                name: level * (1 + spread * random.normal(size=len(run.channels["time"])))
                for name, level in levels.items()
            },
        )
        for run in runs
    ]


def _another(
    random: Random, machine: Machine, runs: Sequence[Recording], names: Sequence[str]
) -> list[Recording]:
    """Outputs of another machine, in its own motion with friction, scaled to these."""
    while True:
        other = replace(draw_machine(random, "motor"), rate=machine.rate)
        friction = draw_friction(random, other, "motor", "sharp")
        if friction is not None:
            break
    chain = Chain()
    others = runs_of(random, other, chain, shown_by(other, [friction]), 1)
    scales = {n: _largest(runs, n) / _largest(others, n) for n in names}
    out = []
    for index, run in enumerate(runs):
        strange = others[index % len(others)].channels
        count = min(len(strange["time"]), len(run.channels["time"]))
        cut = replace(run, channels={n: x[:count] for n, x in run.channels.items()})
        noise = {n: machine.noise[n] * random.normal(size=count) for n in names}
        out.append(_changed(cut, {n: scales[n] * strange[n][:count] + noise[n] for n in names}))
    return out


def _largest(runs: Sequence[Recording], name: str) -> float:
    return max(float(np.abs(run.channels[name]).max()) for run in runs)


def _changed(run: Recording, channels: dict[str, Array]) -> Recording:
    return replace(run, channels={**run.channels, **channels})


GARBAGE = {
    "numbers": _replaced(_numbers),
    "walk": _replaced(_walk),
    "sines": _replaced(_sines),
    "another": _another,
    "constant": _constants,
}
KINDS = (*GARBAGE, "grounded")


def draw_garbage(random: Random, index: int) -> Case:
    """Garbage of every kind in turn, in every output or in one, recorded once or twice."""
    kind = KINDS[index % len(KINDS)]
    repeats = int(random.choice([1, 2]))
    if kind == "grounded":
        return _grounded(random, repeats)
    machine = draw_machine(random)
    names = OUTPUTS if random.random() < 0.5 else (str(random.choice(OUTPUTS[1:])),)
    if machine.load == "cell":
        # The tension is then the load.
        machine = replace(machine, load="mass")
    runs = runs_of(random, machine, Chain(), shown_by(machine, []), repeats)
    strange = GARBAGE[kind](random, machine, runs, names)
    words = f"{kind} for {', '.join(names)}, {repeats} recorded"
    detail = {"garbage": kind, "outputs": list(names), "repeats": repeats}
    return Case("garbage", machine.winch, strange, Truth(words, detail=detail), machine.words)


def _grounded(random: Random, repeats: int) -> Case:
    """A load on the ground in 15 to 40 % of the stroke; friction of the motor or none."""
    for _ in range(ATTEMPTS):
        machine = replace(draw_machine(random, "motor"), load="mass")
        friction = draw_friction(random, machine, "motor", "sharp")
        if friction is not None:
            break
    hidden = [friction] if friction is not None and random.random() < 0.5 else []
    shown = shown_by(machine, [])
    ends = [float(s.cable_length.max()) for s in shown.values()]
    starts = [float(s.cable_length.min()) for s in shown.values()]
    ground = max(ends) - random.uniform(0.15, 0.4) * (max(ends) - min(starts))
    put = {key: _put_down(s, ground) for key, s in shown.items()}
    if hidden:
        more = shown_by(machine, hidden)
        put = {
            key: replace(
                s, motor_torque=s.motor_torque + more[key].motor_torque - shown[key].motor_torque
            )
            for key, s in put.items()
        }
    runs = runs_of(random, machine, Chain(), put, repeats)
    truth = Truth(
        f"grounded, {'friction of the motor' if hidden else 'nothing'} hidden, {repeats} recorded",
        (("motor", OUTPUT["motor"]),) if hidden else (),
        frozenset(name for one in hidden for name in _names_of(one)),
        detail={"garbage": "grounded", "hidden": bool(hidden), "repeats": repeats},
    )
    return Case("garbage", machine.winch, runs, truth, machine.words)


def _names_of(friction: Friction) -> tuple[str, ...]:
    return ("motor-coulomb", "motor-viscous") if friction.viscosity else ("motor-coulomb",)


def _put_down(shown: Shown, ground: float) -> Shown:
    """Cable forces less where more cable is paid out than down to the ground."""
    share = np.clip((shown.cable_length - ground) / SOFT, 0.0, 1.0) * (1 - SLACK)
    return replace(
        shown,
        tension=shown.tension * (1 - share),
        motor_torque=shown.motor_torque * (1 - share),
        load=shown.load * (1 - share),
    )

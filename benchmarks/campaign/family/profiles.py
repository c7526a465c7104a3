"""Profiles whose own numbers are wrong: of an effect that they have, or of drum and gear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from campaign.bench import Bench, draw_bench
from campaign.case import ATTEMPTS, Plan, size_effects
from campaign.family.case import Case, Truth
from campaign.record import recordings
from campaign.sizes import allowed
from campaign.truth import Hidden
from campaign.winch import Winch

Random = np.random.Generator
UNITS = {
    "cable-elongation-linear": ("axial_stiffness", "N", "cable", "cable_length"),
    "frame-compliance": ("stiffness", "N/m", "frame", "cable_length"),
    "rotor-inertia": ("inertia", "kg m^2", "motor", "motor_torque"),
    "motor-viscous": ("viscosity", "N m s", "motor", "motor_torque"),
    "motor-coulomb": ("torque", "N m", "motor", "motor_torque"),
    "gear-efficiency": ("efficiency", "", "gear", "motor_torque"),
    "pulley-coulomb": ("friction", "", "pulley", "tension"),
    "pulley-viscous": ("viscosity", "N s/m", "pulley", "tension"),
    "cable-weight": ("mass_per_length", "kg/m", "cable", "tension"),
    "cell-gain": ("gain_error", "", "cell", "tension"),
}
"""Effect that a profile has: its number, that one's unit, its part, its output."""
WRONG = (*UNITS, "drum-radius", "gear-ratio")
COARSE = 0.02
"""Longest interval of samples from which an acceleration is known, s."""
SIZES = (10.0, 30.0)
"""Of the true effect over the noise: 3 to 60 times the noise is then wrong."""


def draw_wrong_profile(random: Random, index: int) -> Case:
    """A number in turn, wrong by 1.3 to 3 times; radius and ratio by 0.5 to 3 %."""
    name = WRONG[index % len(WRONG)]
    for _ in range(ATTEMPTS):
        repeats = bool(random.random() < 0.5)
        bench = draw_bench(random, repeats, small=True, finely=True)
        known, loads = bench.load != "cell", len(bench.scene.masses)
        if name in UNITS:
            if not allowed(name, bench.winch, known, False, loads):
                continue
            if name == "rotor-inertia" and _interval(bench) > COARSE:
                continue
            size = float(np.exp(random.uniform(*np.log(SIZES))))
            hidden = size_effects(random, Plan("single", size), bench, (name,))
            if hidden is not None:
                return _wrong_value(random, bench, name, hidden, repeats)
        elif name == "drum-radius" or bench.winch.ratio > 1:
            return _wrong_drive(random, bench, name, repeats)
    raise AssertionError(f"no bench can have {name}")


def _interval(bench: Bench) -> float:
    """Of the samples, s."""
    first = bench.situations[0]
    return first.every * float(first.time[1] - first.time[0])


def _times(random: Random) -> float:
    return float(random.uniform(1.3, 3.0)) ** float(random.choice([-1.0, 1.0]))


def _wrong_value(random: Random, bench: Bench, name: str, hidden: Hidden, repeats: bool) -> Case:
    parameter, unit, part, output = UNITS[name]
    true, times = float(hidden[name][parameter]), _times(random)
    said = true * times
    if name == "gear-efficiency":
        # Its loss is wrong.
        said = max(1 - (1 - true) * times, 0.25)
    quantity = f'"{said!r} {unit}"' if unit else repr(said)
    text = f'[[effect]]\nid = "{name}"\n{parameter} = {quantity}\n'
    runs = recordings(random, {"": bench}, {"": hidden})
    truth = Truth(
        f"{name} {said:.4g} in the profile, {true:.4g} true",
        ((part, output),),
        frozenset({name}),
        detail={"wrong": name, "true": true, "said": said, "repeats": repeats},
    )
    return Case("profiles", bench.winch, runs, truth, bench.words, text)


def _wrong_drive(random: Random, bench: Bench, name: str, repeats: bool) -> Case:
    share = float(random.uniform(0.005, 0.03) * random.choice([-1, 1]))
    true: Winch = bench.winch
    key, part = {"drum-radius": ("radius", "drum"), "gear-ratio": ("ratio", "gear")}[name]
    wrong = replace(true, **{key: round(getattr(true, key) * (1 + share), 6)})
    runs = recordings(random, {"": bench}, {"": {}})
    both = ("drum-radius", "gear-ratio")
    truth = Truth(
        f"{key} {getattr(wrong, key):.5g} in the profile, {getattr(true, key):.5g} true",
        ((part, "cable_length"),),
        frozenset(both),
        detail={"wrong": name, "share": share, "repeats": repeats},
    )
    return Case("profiles", wrong, runs, truth, bench.words)

"""What remembers: play, Dahl friction and lags, step by step in plain loops."""

from __future__ import annotations

from math import exp

import numpy as np

from winchkit.arrays import Array


def play(x: Array, gap: float) -> Array:
    """Follow ``x`` through a play of ``gap`` that begins in the middle; shape (n,)."""
    half, y, out = gap / 2, float(x[0]), []
    for value in x.tolist():
        y = min(max(y, value - half), value + half)
        out.append(y)
    return np.array(out)


def dahl(x: Array, limit: Array, stiffness: Array) -> Array:
    """Dahl friction with dF/dx = σ(1 − s F/F_c) from zero force; all shapes (n,)."""
    force, out = 0.0, [0.0]
    steps = np.diff(x).tolist()
    for dx, most, sigma in zip(steps, limit[1:].tolist(), stiffness[1:].tolist(), strict=True):
        if most > 0 and dx:
            end = most if dx > 0 else -most
            force = end + (force - end) * exp(-sigma * abs(dx) / most)
        out.append(force)
    return np.array(out)


def lag(x: Array, time: Array, constant: float, start: float) -> Array:
    """First-order lag of an input that is straight between samples; shape (n,)."""
    y, out = start, [start]
    steps = np.diff(time).tolist()
    values = x.tolist()
    for h, now, then in zip(steps, values, values[1:], strict=False):
        fall = exp(-h / constant)
        rate = (then - now) / h
        # The particular answer to a ramp trails it by the time constant.
        y = (then - constant * rate) + (y - now + constant * rate) * fall
        out.append(y)
    return np.array(out)


def stack(wound: Array, strain: Array) -> Array:
    """Length by which cable wound in at ``strain`` is longer than cable at rest, while on the drum.

    ``wound`` in m since the reference; pieces are laid on a stack and taken off again in reverse
    order. What was there at the start, as far as the reference, has the run's mean strain.
    """
    before = float(np.mean(strain))
    pieces: list[tuple[float, float]] = []
    held = before * float(wound[0])
    out = [held]
    for step, now in zip(np.diff(wound).tolist(), strain[1:].tolist(), strict=True):
        if step > 0:
            pieces.append((step, now))
            held += step * now
        left = -step
        while left > 0:
            if not pieces:
                held -= left * before
                break
            size, there = pieces.pop()
            taken = min(size, left)
            held -= taken * there
            if size > taken:
                pieces.append((size - taken, there))
            left -= taken
        out.append(held)
    return np.array(out)

"""Writes docs/effects.md from the catalogue: ``python docs/make_effects.py``."""

from __future__ import annotations

from pathlib import Path

from winchkit.effects import Catalogue, load_catalogue
from winchkit.effects.card import card

PAGE = Path(__file__).with_name("effects.md")
_BEGIN = """\
# The catalogue of effects

Written by `python docs/make_effects.py` from the effects themselves; do not edit it by hand.
`winchkit effects` lists them, `winchkit effects ID` shows a card with the effect's signature drawn,
and `--html FILE` makes a page of one card, or without ID of all, with the signatures as pictures.

Symbols: θ motor angle, φ drum angle since the reference, Φ total wound angle, ℓ unstrained free
length, ℓ_s = ℓ + dead length, T tension in the rope, v its winding-in speed, s = sgn v (smooth at
standstill). Each term vanishes exactly at its null; stiffnesses are fitted as compliances.

## Effects of your own are code

An effect of your own is a Python file. It is executed with your rights, in two cases only: you
name it with `--effects FILE.py` (in Python `effects=[...]`), or you open a bench whose bench file
names it under `effects`, to move it, log it or watch it. Open a bench file of somebody else only
where you would run a program of theirs. Nothing that a file names is executed by what only reads:
`check`, `info`, `scan`, `busload`, `compare`, `diagnose`, `log info` and `export`. `check
bench.toml` warns of each such file, and does not check the effects that stand in it; `check
bench.toml --effects FILE.py` does.
"""
_OUTPUTS = ("cable_length", "tension", "motor_torque")


def page(catalogue: Catalogue) -> str:
    """The page: effects by the first output that they change, each with its card."""
    parts = [_BEGIN]
    for output in (*_OUTPUTS, ""):
        own = sorted(e.id for e in catalogue if ("" if e.of_robots else e.outputs[0]) == output)
        heading = f"On the way to {output}" if output else "On a robot"
        parts.append(f"## {heading}\n\n{', '.join(f'[{i}](#{i})' for i in own)}\n")
        for name in own:
            text, _, _ = card(catalogue[name]).partition("\n\nSignature over")
            body = text.removeprefix(name).strip()
            parts.append(f"### {name}\n\n```text\n{body}\n```\n")
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(load_catalogue()), encoding="utf-8")

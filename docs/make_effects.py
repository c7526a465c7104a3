"""Writes docs/effects.md from the catalogue: ``python docs/make_effects.py``."""

from __future__ import annotations

from pathlib import Path

from winchkit import load_catalogue
from winchkit.effects import Catalogue
from winchkit.effects.card import card

PAGE = Path(__file__).with_name("effects.md")
_BEGIN = """\
# The catalogue of effects

Written by `python docs/make_effects.py` from the effects themselves; do not edit it by hand.
`winchkit effects` lists them, `winchkit effects ID` shows a card with the effect's signature drawn,
and `--html FILE` makes a page of one card, or without ID of all, with the signatures as pictures.

Symbols: θ motor angle, φ drum angle since the reference, Φ total wound angle, ℓ unstrained free
length, ℓ_s = ℓ + dead length, T tension in the cable, v its winding-in speed, s = sgn v (smooth at
standstill). Each term vanishes exactly at its null value; stiffnesses are fitted as compliances.

## User effects are code

A user effect is a Python file. It is executed with your rights, in two cases only: you name it with
`--effects FILE.py` (in Python `effects=[...]`), or you open a bench whose bench file names it under
`effects`, to move it, log it or monitor it. Open a bench file of another person only if you would
run a program of that person. Commands that only read do not execute files that a bench file names:
`check`, `info`, `scan`, `busload`, `compare`, `diagnose`, `log info` and `export`. `check
bench.toml` warns of each such file and does not check its effects; `check bench.toml --effects
FILE.py` does.
"""
_OUTPUTS = ("cable_length", "tension", "motor_torque")


def page(catalogue: Catalogue) -> str:
    """The page: effects by the first output that they change, each with its card."""
    parts = [_BEGIN]
    for output in (*_OUTPUTS, ""):
        own = sorted(e.id for e in catalogue if ("" if e.of_robots else e.outputs[0]) == output)
        heading = f"Effects on {output}" if output else "Effects on a robot"
        parts.append(f"## {heading}\n\n{', '.join(f'[{i}](#{i})' for i in own)}\n")
        for name in own:
            text, _, _ = card(catalogue[name]).partition("\n\nSignature over")
            body = text.removeprefix(name).strip()
            parts.append(f"### {name}\n\n```text\n{body}\n```\n")
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(load_catalogue()), encoding="utf-8")

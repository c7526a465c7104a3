"""Whether ``winchkit calibrate`` names the mistakes in a table of poses, and none where none is.

    python benchmarks/robot_mistakes.py --cases 500 --clean 500 --seed S [--json]

A case is a shipped robot with a geometry, drums, a tracker's frame and noise drawn at random
(``robot_poses/mistaken.py``, which shares no code with winchkit's geometry), whose table has one
mistake or two. It is right where the command ends with an error, writes no profile, and names what
was done, or something that gives the same data. A clean case is right where a profile is written.
Exits 1 where fewer than 99 % are named, more than one clean one of 500 is refused, or any command
ends with an internal error.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from click.testing import CliRunner

from robot_poses.mistaken import Mistake, Scene, mistaken, profile_text, scenes
from winchkit.arrays import Array
from winchkit.cli import main

_NAMED, _FALSE = 0.99, 1 / 500
_INTERNAL = 70
_MOST_NAMED = 6
"""Explanations of one mistake in an answer: with more it names nothing."""
_FACTOR = {
    "deg": np.pi / 180, "turns": 2 * np.pi, "rad for deg": 180 / np.pi,
    "rad for turns": 1 / (2 * np.pi), "all": -1.0,
}  # fmt: skip


def played(scene: Scene, folder: Path) -> dict[str, Any]:
    """What the command does with a scene."""
    table, made = mistaken(scene)
    run, profile, new = folder / "poses.csv", folder / "robot.toml", folder / "new.toml"
    run.write_text(table.csv())
    profile.write_text(profile_text(scene.robot, known_frame=scene.known_frame))
    begin = process_time()
    arguments = ("calibrate", str(profile), str(run), "-o", str(new), "--json")
    result = CliRunner().invoke(main, arguments)
    seconds = process_time() - begin
    told = named(result.output if result.exit_code else "", str(run))
    lines = table.motor.shape[1]
    if made:
        right = bool(result.exit_code) and not new.exists() and is_named(made, told, lines)
    else:
        right = result.exit_code == 0 and new.exists()
    return {
        **asdict(scene),
        "true": [sorted(mistake.codes) for mistake in made],
        "told": told,
        "exit": result.exit_code,
        "right": right,
        "seconds": seconds,
        "answer": result.output[-400:] if result.exit_code else "",
    }


def named(output: str, run: str) -> list[list[list[str]]]:
    """Per line of the answer the sets of codes that it names."""
    out = []
    for line in output.splitlines():
        if line.startswith(f"{run}: "):
            codes = line[len(run) + 2 :].split(": ")[0]
            out.append([one.split(" + ") for one in codes.split(" | ")])
    return out


def is_named(made: Sequence[Mistake], told: list[list[list[str]]], lines: int) -> bool:
    """Whether the answer has the mistakes that were made, or ones with the same motor angles."""
    true = [mistake.codes for mistake in made]
    motors = [next(iter(codes)) for codes in true if is_motor(codes)]
    others = [codes for codes in true if not is_motor(codes)]
    sets = [one for line in told for one in line]
    if not all(len(line) <= _MOST_NAMED for line in told):
        return False
    every = {code for one in sets for code in one}
    if not all(codes & every for codes in others):
        return False
    wanted = motor_matrix(reversed(motors), lines)
    # Of several sets one has to be right; a set about rotations has no motor angles.
    found = [motor_matrix(filter(_of_motor, one), lines) for one in sets]
    extra = [c for one in sets[:1] for c in one if not _of_motor(c)]
    few = len(extra) <= len(others)
    return few and (not motors or any(np.allclose(m, wanted) for m in found))


def is_motor(codes: Iterable[str]) -> bool:
    """Whether a mistake is one of the motor angles."""
    return any(_of_motor(code) for code in codes)


def _of_motor(code: str) -> bool:
    return code.startswith("motor-")


def motor_matrix(codes: Iterable[str], lines: int) -> Array:
    """What mends the motor angles, as a matrix (n, n)."""
    out = np.eye(lines)
    for code in codes:
        what, _, which = code.partition(":")
        one = np.eye(lines)
        if what == "motor-columns":
            i, j = (int(name) - 1 for name in which.split("-"))
            one[[i, j]] = one[[j, i]]
        elif which in _FACTOR:
            one *= _FACTOR[which]
        elif what == "motor-sign":
            one[int(which) - 1, int(which) - 1] = -1.0
        out = out @ one
    return out


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Counts over all cases."""
    cases = [row for row in rows if row["mistakes"]]
    clean = [row for row in rows if not row["mistakes"]]
    return {
        "named": sum(row["right"] for row in cases),
        "cases": len(cases),
        "false_alarms": sum(not row["right"] for row in clean),
        "clean": len(clean),
        "internal_errors": sum(row["exit"] == _INTERNAL for row in rows),
        "seconds_median": float(np.median([row["seconds"] for row in rows])),
        "seconds_largest": max(row["seconds"] for row in rows),
    }


def run(cases: int, clean: int, seed: int, *, tell: bool = False) -> list[dict[str, Any]]:
    """Cases with one and two mistakes in turn, then clean ones."""
    rows = []
    for scene in (*scenes(cases, seed, (1, 2)), *scenes(clean, seed + 1, (0,))):
        with TemporaryDirectory() as folder:
            rows.append(played(scene, Path(folder)))
        if tell and not rows[-1]["right"]:
            print(json.dumps(rows[-1]), flush=True)
    return rows


def main_of(arguments: Sequence[str]) -> int:
    """Run the cases, print the wrong ones and the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--clean", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true", help="on one line")
    options = parser.parse_args(arguments)
    found = summary(run(options.cases, options.clean, options.seed, tell=not options.json))
    print(json.dumps(found, indent=None if options.json else 2))
    wrong = found["named"] < _NAMED * found["cases"]
    wrong |= found["false_alarms"] > max(1.0, _FALSE * found["clean"])
    return 1 if wrong or found["internal_errors"] else 0


if __name__ == "__main__":
    sys.exit(main_of(sys.argv[1:]))

"""What winchkit says of a tracker that was set up anew, alone and beside a real effect.

    python benchmarks/robot_metrology.py [--cases N] [--seed S] [--json]
    python benchmarks/robot_metrology.py --random N [--seed S] [--json]

Each case has a frame, a reflector's offset or a scale drawn at random, alone or beside an effect of
one line (home length, exit point, winding radius), and poses by robot_poses, which shares no code
with winchkit. ``diagnose`` gets the true robot; ``calibrate`` gets the CABTIVE robot's nominal
numbers and the raw file, without any declaration. ``--random`` calibrates with frames and offsets
of all sizes and counts crashes, refusals and the largest error of what is called calibrated.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from click.testing import CliRunner, Result

from robot_poses.cases import CASES
from robot_poses.hidden import BASE, Case, profile_text
from robot_poses.station import Station, about, observed
from robot_poses.truth import Noise, Vector, csv, poses
from summaries import print_cases
from winchkit.cli import main

_REAL = ("none", "home length", "exit point", "drum radius")
_BY_NAME = {case.name: case for case in CASES}
_EFFECT = {"frame": "tracker-frame", "reflector": "reflector-offset", "scale": "tracker-scale"}
_LIMIT_M, _LIMIT_RAD = 4e-5, float(np.radians(0.03))


@dataclass(frozen=True)
class Hidden:
    """A case: what the instrument and the robot hide."""

    instrument: str
    station: Station
    case: Case
    angles: bool
    seed: int


def drawn(count: int, seed: int) -> Iterator[Hidden]:
    """Cases in turn over instruments and real effects, with sizes at random."""
    rng = np.random.default_rng(seed)
    for n in range(count):
        instrument = ("frame", "reflector", "scale")[n % 3]
        real = _REAL[(n // 3) % len(_REAL)]
        if instrument == "frame":
            angle = float(rng.choice([0.02, 0.2, 1.0, 37.0])) * float(rng.uniform(0.7, 1.3))
            shift = rng.normal(size=3) * float(rng.choice([5e-4, 5e-3, 0.2]))
            station = replace(about(angle, axis=_vector(rng.normal(size=3))), shift=_vector(shift))
        elif instrument == "reflector":
            size = float(rng.choice([1e-3, 0.01, 0.05]))
            station = Station(reflector=_vector(rng.normal(size=3) * size))
        else:
            station = Station(ppm=float(rng.choice([-1, 1]) * rng.uniform(200, 2000)))
        yield Hidden(instrument, station, _BY_NAME[real], bool(rng.random() < 0.5), seed + n)


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def diagnosed(hidden: Hidden, folder: Path) -> dict[str, Any]:
    """Answer of ``diagnose`` to one case, as the command prints it."""
    run, profile = folder / "poses.csv", folder / "robot.toml"
    run.write_text(observed(hidden.case, hidden.station, seed=hidden.seed, angles=hidden.angles))
    profile.write_text(profile_text())
    answer = _called("diagnose", run, "--profile", profile, "--json").stdout
    return json.loads(answer)  # type: ignore[no-any-return]


def judged(hidden: Hidden, folder: Path) -> dict[str, Any]:
    """Answers of ``diagnose`` and ``calibrate`` to one case."""
    found = diagnosed(hidden, folder)
    sets = [_members(step) for step in found["steps"]]
    first = {name for own in sets for name in own}
    true = {_EFFECT[hidden.instrument], *hidden.case.answers}
    wrong = [own for own in sets if not set(own) & true]
    return {
        "instrument": hidden.instrument,
        "real": hidden.case.name,
        "seed": hidden.seed,
        "verdict": found["verdict"],
        "named": ["|".join(own) for own in sets],
        "right": _EFFECT[hidden.instrument] in first
        and (not hidden.case.answers or bool(first & set(hidden.case.answers))),
        "wrong_line": [own[0] for own in wrong if len(own) == 1 and "/" in own[0]],
        "wrong": ["|".join(own) for own in wrong],
        "calibrated": _calibration(hidden, folder),
    }


def _calibration(hidden: Hidden, folder: Path) -> dict[str, Any]:
    """Raw poses of the robot alone, ninety of them, and exact ones of the same set-up held out."""
    run, held, new = (folder / name for name in ("fit.csv", "held.csv", "new.toml"))
    session = "# session: one\n"
    fit = hidden.station.show(poses(BASE, 90, hidden.seed), hidden.seed)
    run.write_text(session + csv(fit, angles=hidden.angles))
    exact = replace(hidden.station, tracker=0.0, imu=0.0)
    silent = Noise(0, 0, 0, 0, 0, 0, 0)
    rows = exact.show(poses(BASE, 30, hidden.seed + 10_000, noise=silent), hidden.seed)
    held.write_text(session + csv(rows, angles=hidden.angles))
    result = _run("calibrate", "cabtive", run, "--validate", held, "-o", new, "--json")
    if result.exit_code != 0:
        return {"exit": result.exit_code, "right": False}
    told = json.loads(result.stdout)
    place = told["validation"]["rms_after"]
    turned = told["validation"]["rotation_rms_after"]
    return {
        "exit": 0,
        "held_out_mm": place * 1e3,
        "held_out_deg": None if turned is None else float(np.degrees(turned)),
        "right": place <= _LIMIT_M and (turned is None or turned <= _LIMIT_RAD),
    }


def random_frames(count: int, seed: int) -> dict[str, Any]:
    """Calibrations with frames and offsets of all sizes."""
    rng, made = np.random.default_rng(seed), poses(BASE, 40, seed)
    crashed, refused, largest = 0, 0, 0.0
    with TemporaryDirectory() as name:
        run, new = Path(name) / "poses.csv", Path(name) / "new.toml"
        for _ in range(count):
            station = Station(
                float(10 ** rng.uniform(-2, 2.25)),
                _vector(rng.normal(size=3)),
                _vector(rng.normal(size=3) * 10 ** rng.uniform(-4, 0)),
                _vector(rng.normal(size=3) * 10 ** rng.uniform(-3, -0.8)),
                turns_rotation=bool(rng.random() < 0.5),
            )
            run.write_text(csv(station.show(made, 1), angles=bool(rng.random() < 0.5)))
            result = _run("calibrate", "cabtive", run, "-o", new, "--json")
            if result.exception is not None and not isinstance(result.exception, SystemExit):
                crashed += 1
            elif result.exit_code:
                refused += 1
            else:
                error = json.loads(result.stdout)["validation"]["rms_after"]
                largest = max(largest, error)
    return {"crashed": crashed, "refused": refused, "of": count, "largest_error_mm": largest * 1e3}


def _members(step: dict[str, Any]) -> list[str]:
    if step["whole"]:
        return ["whole geometry"]
    return [
        effect + (f"/{line}" if line else "")
        for effect, lines in step["lines"].items()
        for line in lines
    ]


def _run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def _called(*arguments: object) -> Result:
    result = _run(*arguments)
    if result.exit_code:
        raise SystemExit(f"winchkit {' '.join(map(str, arguments))}: {result.output}")
    return result


def summary(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Counts over all cases."""
    fits = [row["calibrated"] for row in rows]
    return {
        "instrument and effect in the first set": _share([row["right"] for row in rows]),
        "a wrong line named alone": _share([bool(row["wrong_line"]) for row in rows]),
        "another effect named": _share([bool(row["wrong"]) for row in rows]),
        "raw files within 0.04 mm and 0.03 deg": _share([fit["right"] for fit in fits]),
    }


def _share(values: list[bool]) -> str:
    return f"{sum(values)} of {len(values)}"


def main_of(arguments: list[str]) -> None:
    """Run the cases and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--random", type=int, metavar="N", help="calibrations with random frames")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    if options.random:
        print(json.dumps({"schema": 1, **random_frames(options.random, options.seed)}))
        return
    rows = []
    for hidden in drawn(options.cases, options.seed):
        with TemporaryDirectory() as folder:
            rows.append(judged(hidden, Path(folder)))
        if not options.json:
            print(_text(rows[-1]), flush=True)
    print_cases(summary(rows), rows, as_json=options.json)


def _text(row: dict[str, Any]) -> str:
    fit = row["calibrated"]
    turned = fit.get("held_out_deg")
    return (
        f"{'' if row['right'] and not row['wrong'] else '! '}{row['instrument']:10}{row['real']:12}"
        f"{row['seed']:5}  {row['verdict']:9} {' + '.join(row['named']) or '-':60} "
        f"{'' if fit['right'] else '! '}{fit.get('held_out_mm', float('nan')):.4f} mm"
        + ("" if turned is None else f" {turned:.4f} deg")
    )


if __name__ == "__main__":
    main_of(sys.argv[1:])

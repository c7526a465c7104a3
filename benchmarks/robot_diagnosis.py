"""What ``winchkit diagnose`` says of robots with one thing hidden (or two, or none, or unknown).

    python benchmarks/robot_diagnosis.py [--seeds N] [--case NAME] [--json]

Poses are made by robot_poses, which shares no code with winchkit. The profile has the true
geometry; "calibrated" cases give the CABTIVE robot's nominal numbers to ``winchkit calibrate``
first, as a user would, with the elasticity hidden from it.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from click.testing import CliRunner
from robot_poses.hidden import CASES, Case, profile_text, record

from winchkit.cli import main

__all__ = ["answer", "calibrated"]


def answer(case: Case, seed: int, folder: Path) -> dict[str, Any]:
    """The diagnosis of one case, as the command prints it."""
    profile = folder / "robot.toml"
    profile.write_text(profile_text())
    run = record(case, folder, "poses.csv", seed=seed)
    return _diagnosed(run, profile)


def calibrated(case: Case, seed: int, folder: Path) -> dict[str, Any]:
    """Calibrate the nominal robot on the poses first, then diagnose on the same."""
    run = record(case, folder, "poses.csv", count=90, seed=seed)
    profile = folder / "calibrated.toml"
    _called(["calibrate", "cabtive", str(run), "-o", str(profile), "--json"])
    return _diagnosed(run, profile)


def _diagnosed(run: Path, profile: Path) -> dict[str, Any]:
    return json.loads(_called(["diagnose", str(run), "--profile", str(profile), "--json"]))  # type: ignore[no-any-return]


def _called(arguments: list[str]) -> str:
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    if result.exit_code:
        raise SystemExit(f"winchkit {' '.join(arguments)}: {result.output}")
    return result.stdout


def named(found: dict[str, Any]) -> list[str]:
    """Effects with their lines, a set of them that the data cannot tell apart joined by |."""
    return [
        "|".join(
            effect + (f"/{line}" if line else "")
            for effect, lines in step["lines"].items()
            for line in lines
        )
        for step in found["steps"]
    ]


def main_of(arguments: list[str]) -> None:
    """Run the cases and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--case", action="append")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    rows = []
    for case in CASES:
        for flow in (answer, calibrated) if case.name == "elastic ropes" else (answer,):
            if options.case and case.name not in options.case:
                continue
            for seed in range(1, options.seeds + 1):
                with TemporaryDirectory() as folder:
                    start = process_time()
                    found = flow(case, seed, Path(folder))
                rows.append(_row(case, flow.__name__, seed, found, process_time() - start))
                if not options.json:
                    print(_text(rows[-1]), flush=True)
    if options.json:
        print(json.dumps({"schema": 1, "cases": rows}, indent=1))


def _row(case: Case, flow: str, seed: int, found: dict[str, Any], seconds: float) -> dict[str, Any]:
    place = found["outputs"]["platform_position"]
    return {
        "case": case.name,
        "flow": flow,
        "seed": seed,
        "hidden": list(case.answers),
        "verdict": found["verdict"],
        "named": named(found),
        "held_out_mm": [place[f"heldout_rms_{when}"] * 1e3 for when in ("before", "after")],
        "noise_mm": place["noise_rms"] * 1e3,
        "cpu_seconds": seconds,
    }


def _text(row: dict[str, Any]) -> str:
    before, after = row["held_out_mm"]
    return (
        f"{row['case']:22} {row['flow']:10} {row['seed']:2}  {row['verdict']:9} "
        f"{' + '.join(row['named']) or '-':60} {before:.3f} -> {after:.3f} mm "
        f"(noise {row['noise_mm']:.3f})  {row['cpu_seconds']:.0f} s"
    )


if __name__ == "__main__":
    main_of(sys.argv[1:])

"""What ``winchkit diagnose`` says of robots with one thing hidden (or two, or none, or unknown).

    python benchmarks/robot_diagnosis.py [--seeds N] [--first SEED] [--case NAME] [--json]
    python benchmarks/robot_diagnosis.py --intervals [--seeds N] [--case NAME] [--json]

Poses are made by robot_poses, which shares no code with winchkit. The profile has the true
geometry; "calibrated" cases give the CABTIVE robot's nominal numbers to ``winchkit calibrate``
first, as a user would, with the elasticity hidden from it. At the end: how often the answer was
right, how often a wrong effect was certain, and how often 95 % intervals held the truth.
``--intervals`` asks the latter alone, quicker: ``winchkit add`` gets what is hidden.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

from click.testing import CliRunner

from robot_poses.cases import CASES
from robot_poses.hidden import Case, profile_text, record
from summaries import print_cases
from winchkit.cli import main

CALIBRATED = ("elastic ropes", "none")


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


def added(case: Case, seed: int, folder: Path) -> dict[str, bool]:
    """For every hidden number whether the interval of ``winchkit add`` holds it."""
    profile = folder / "robot.toml"
    profile.write_text(profile_text())
    run = record(case, folder, "poses.csv", seed=seed)
    out = folder / "better.toml"
    told = ["--fit", str(run), "--profile", str(profile), "-o", str(out), "--json"]
    found = json.loads(_called(["add", case.answers[0], *told]))
    return {
        f"{effect}.{name}": estimate["interval"][0] <= truth <= estimate["interval"][1]
        for effect, values in found["parameters"].items()
        for name, estimate in values.items()
        if (truth := case.values.get(f"{effect}.{name}")) is not None
    }


def _diagnosed(run: Path, profile: Path) -> dict[str, Any]:
    return json.loads(_called(["diagnose", str(run), "--profile", str(profile), "--json"]))  # type: ignore[no-any-return]


def _called(arguments: list[str]) -> str:
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    if result.exit_code:
        raise SystemExit(f"winchkit {' '.join(arguments)}: {result.output}")
    return result.stdout


def named(found: dict[str, Any]) -> list[str]:
    """Effects with their lines, a set of them that the data cannot distinguish joined by |."""
    return ["|".join(_members(step)) for step in found["steps"]]


def _members(step: dict[str, Any]) -> list[str]:
    return [
        effect + (f"/{line}" if line else "")
        for effect, lines in step["lines"].items()
        for line in lines
    ]


def wrong(case: Case, found: dict[str, Any]) -> list[str]:
    """Certain effects that are not hidden."""
    steps = [step for step in found["steps"] if step["certain"] and not step["whole"]]
    return [own[0] for own in map(_members, steps) if not set(own) & set(case.answers)]


def right(case: Case, found: dict[str, Any]) -> bool:
    """Whether all that is hidden is in a set and nothing else is named.

    Outside the catalogue nothing is certain, and the verdict says that something is missing, that
    it is the geometry as a whole, or without repeats that it cannot be excluded.
    """
    steps = found["steps"]
    sets = [_members(step) for step in steps]
    if case.outside:
        told = found["verdict"] in ("unknown", "partly", "undecided") or (
            not case.repeats and any("cannot be excluded" in note for note in found["notes"])
        )
        whole = case.as_geometry and bool(steps) and bool(steps[0]["whole"])
        return (told or whole) and not any(step["certain"] for step in steps)
    if not case.answers:
        return found["verdict"] == "adequate"
    hit = {answer for own in sets for answer in own if answer in case.answers}
    spare = [own for own in sets if not set(own) & set(case.answers)]
    alike = "drum-radius" in case.answers[0]
    return not spare and (bool(hit) if alike else hit == set(case.answers))


def covered(case: Case, found: dict[str, Any]) -> dict[str, bool]:
    """For every hidden number that was fitted whether its 95 % interval holds it."""
    out = {}
    for step in found["steps"]:
        members = _members(step)
        for effect, values in step["parameters"].items():
            placed = next((m for m in members if m.partition("/")[0] == effect), effect)
            for name, estimate in values.items():
                truth, ends = case.values.get(f"{placed}.{name}"), estimate["interval"]
                if truth is not None and ends is not None:
                    out[f"{placed}.{name}"] = ends[0] <= truth <= ends[1]
    return out


def main_of(arguments: list[str]) -> None:
    """Run the cases and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--case", action="append")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--intervals", action="store_true", help="coverage alone")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.seeds)
    cases = [case for case in CASES if not options.case or case.name in options.case]
    if options.intervals:
        _intervals([case for case in cases if case.values and _alone(case)], seeds, options.json)
        return
    rows = []
    for case in cases:
        for flow in (answer, calibrated) if case.name in CALIBRATED else (answer,):
            for seed in seeds:
                with TemporaryDirectory() as folder:
                    start = process_time()
                    found = flow(case, seed, Path(folder))
                rows.append(_row(case, flow.__name__, seed, found, process_time() - start))
                if not options.json:
                    print(_text(rows[-1]), flush=True)
    print_cases(summary(rows), rows, as_json=options.json)


def _alone(case: Case) -> bool:
    """Whether one effect alone is hidden, by whatever name."""
    return len({name.partition("/")[2] for name in case.answers}) == 1 and "," not in case.name


def _intervals(cases: Sequence[Case], seeds: range, as_json: bool) -> None:
    """How often the intervals of every case held the truth."""
    rows: dict[str, list[bool]] = {}
    for case in cases:
        for seed in seeds:
            with TemporaryDirectory() as folder:
                for name, held in added(case, seed, Path(folder)).items():
                    rows.setdefault(name, []).append(held)
        if not as_json:
            told = {n: rows[n] for n in case.values if n in rows}
            print("\n".join(f"{n}: {_share(held)}" for n, held in told.items()), flush=True)
    every = [held for own in rows.values() for held in own]
    if as_json:
        counts = {name: {"held": sum(own), "of": len(own)} for name, own in rows.items()}
        print(json.dumps({"schema": 1, "intervals": counts}, indent=1))
    else:
        print(f"all: {_share(every)}")


def _share(held: Sequence[bool]) -> str:
    return f"{sum(held)} of {len(held)}, {100 * sum(held) / max(len(held), 1):.1f} %"


def summary(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Counts over all cases."""
    kinds = {
        "adequate where nothing is hidden": [r for r in rows if r["kind"] == "none"],
        "named rightly": [r for r in rows if r["kind"] == "catalogue"],
        "nothing certain and no adequate model, outside the catalogue": [
            r for r in rows if r["kind"] == "outside"
        ],
    }
    out = {k: f"{sum(r['right'] for r in v)} of {len(v)}" for k, v in kinds.items()}
    out["a wrong effect is certain"] = f"{sum(bool(r['wrong']) for r in rows)} of {len(rows)}"
    held = [inside for r in rows for inside in r["covered"].values()]
    out["95 % intervals that hold the truth"] = _share(held)
    return out


def _row(case: Case, flow: str, seed: int, found: dict[str, Any], seconds: float) -> dict[str, Any]:
    place = found["outputs"]["platform_position"]
    return {
        "case": case.name,
        "kind": "outside" if case.outside else "catalogue" if case.answers else "none",
        "flow": flow,
        "seed": seed,
        "hidden": list(case.answers),
        "verdict": found["verdict"],
        "named": named(found),
        "right": right(case, found),
        "wrong": wrong(case, found),
        "covered": covered(case, found),
        "held_out_mm": [place[f"heldout_rms_{when}"] * 1e3 for when in ("before", "after")],
        "noise_mm": place["noise_rms"] * 1e3,
        "cpu_seconds": seconds,
    }


def _text(row: dict[str, Any]) -> str:
    before, after = row["held_out_mm"]
    missed = [name for name, inside in row["covered"].items() if not inside]
    return (
        f"{'' if row['right'] else '! '}{row['case']:28} {row['flow']:10} {row['seed']:2}  "
        f"{row['verdict']:9} "
        f"{' + '.join(row['named']) or '-':48} {before:.3f} -> {after:.3f} mm "
        f"(noise {row['noise_mm']:.3f})  {row['cpu_seconds']:.0f} s"
        + (f"  95 % missed: {', '.join(missed)}" if missed else "")
    )


if __name__ == "__main__":
    main_of(sys.argv[1:])

"""Time of one tick of an exported robot: ``winchkit export-model ROBOT --to c``, compiled.

    python benchmarks/export_tick.py [--robot ipanema3] [--json]

Of all lines at one pose, in double and in float, with one compiler and its flags: lengths with the
structure matrix, the weight, the closed-form forces, the motor angles under them, and all of it;
also one step of each line's winch. Each is the fastest of many batches, since other processes only
add time, and is printed beside eight calls of the C library's ``atan2`` (``--lines`` of them), the
one slow function that a line cannot do without: the ratio does not depend on the computer. Promised
is 1 us for all of it; exits with 1 where it takes longer.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from winchkit import export_model, find
from winchkit.dynamics.c_code import identifier
from winchkit.robot import robot_of
from winchkit.schema.read import read_robot

FLAGS = ("-std=c99", "-O2", "-D_POSIX_C_SOURCE=199309L")
LIMIT = 1e-6
PARTS = {
    "atan2 of each line": "for (int i = 0; i < LINES; ++i) length[i] = F(atan2)(force[i], one);",
    "lengths and structure matrix": "NAME_lengths(&pose[k], length, structure);",
    "weight": "NAME_weight(&pose[k], wrench);",
    "forces": "wrench[0] = k; NAME_forces(structure, wrench, low, high, force);",
    "motor angles": "length[0] += 1e-9; NAME_motor_angles(length, force, angle);",
}
WHOLE = "all of it"
STEPS = "a step of each winch"
MAIN = """\
#include "robot.h"
#include <stdio.h>
#include <time.h>
#define LINES NAME_LINES
#define F PREFIX_F

/* Global, so that the compiler must write every one of them in every round. */
NAME_pose pose[64];
NAME_real length[LINES], structure[6 * LINES], wrench[6], force[LINES], angle[LINES];
NAME_real low[LINES], high[LINES], one = 1;
STATES
static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(void)
{
    enum { POSES = 64, ROUNDS = 100, BATCHES = 60 };
STARTS    for (int i = 0; i < LINES; ++i) {
        low[i] = 1;
        high[i] = 1e4;
        force[i] = 100 + i;
        length[i] = 5;
    }
    for (int k = 0; k < POSES; ++k) {
        const NAME_real at[3] = PLACE, turned[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        for (int i = 0; i < 3; ++i)
            pose[k].position[i] = at[i] + (NAME_real)0.001 * k * (i + 1);
        for (int i = 0; i < 9; ++i)
            pose[k].rotation[i] = turned[i];
    }
BODIES    return 0;
}
"""
BATCH = """\
    double least{n} = 1;
    for (int b = 0; b < BATCHES; ++b) {{
        const double begun = now();
        for (int round = 0; round < ROUNDS; ++round)
            for (int k = 0; k < POSES; ++k) {{
                {body}
                __asm__ volatile("" ::: "memory");
            }}
        const double took = (now() - begun) / (ROUNDS * POSES);
        least{n} = took < least{n} ? took : least{n};
    }}
    printf("%.4e\\n", least{n});
"""


def program(robot: str) -> tuple[str, str, list[str]]:
    """Header and main file of a robot, and the names of what is timed."""
    profile = read_robot(find("profiles", robot))
    name, own = identifier(profile.name), robot_of(profile)
    winches = [identifier(f"{profile.name}-{line}") for line in own.names]
    states = "".join(
        f"{w}_state s{i}; {w}_input in{i}; {w}_output out{i};\n" for i, w in enumerate(winches)
    )
    starts = "".join(f"    {w}_start(&s{i});\n" for i, w in enumerate(winches))
    steps = "".join(
        f"in{i}.time += 1; in{i}.motor_angle += 1; {w}_step(&s{i}, &in{i}, &out{i});"
        for i, w in enumerate(winches)
    )
    bodies = {**PARTS, WHOLE: "".join(list(PARTS.values())[1:]), STEPS: steps}
    batches = "".join(BATCH.format(n=n, body=body) for n, body in enumerate(bodies.values()))
    place = "{" + ", ".join(map(repr, own.home.position[0].tolist())) + "}"
    text = (
        MAIN.replace("BODIES", batches)
        .replace("STATES", states)
        .replace("STARTS", starts)
        .replace("PLACE", place)
    )
    text = text.replace("NAME_LINES", f"{name.upper()}_LINES").replace("PREFIX", name.upper())
    return export_model(profile, "c").text, text.replace("NAME", name), list(bodies)


def measured(robot: str, real: str) -> dict[str, float]:
    """Seconds of each part."""
    header, main, names = program(robot)
    with TemporaryDirectory() as folder:
        (Path(folder) / "robot.h").write_text(header)
        (Path(folder) / "main.c").write_text(main)
        defined = ["-DWINCHKIT_FLOAT"] * (real == "float")
        command = ["gcc", *FLAGS, *defined, "main.c", "-lm", "-o", "tick"]
        subprocess.run(command, cwd=folder, check=True)
        found = subprocess.run([Path(folder) / "tick"], capture_output=True, check=True, text=True)
    return dict(zip(names, map(float, found.stdout.split()), strict=True))


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", default="ipanema3")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    found = {real: measured(asked.robot, real) for real in ("double", "float")}
    if asked.json:
        print(json.dumps({"flags": FLAGS, **found}))
    else:
        for real, times in found.items():
            yardstick = next(iter(times.values()))
            for name, seconds in times.items():
                ratio = seconds / yardstick
                print(f"{real:7} {name:30} {seconds * 1e6:6.3f} us {ratio:6.2f} times atan2")
    return int(max(times[WHOLE] for times in found.values()) > LIMIT)


if __name__ == "__main__":
    sys.exit(main())

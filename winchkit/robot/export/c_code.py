"""A robot as one header in C99: kinematics, force distribution, and the winch of each line.

Length and structure matrix are the Python functions of the model, recorded while these run once on
symbols; the closed-form force distribution solves the same least-norm problem by Gram-Schmidt
orthogonalization, repeated once, in place of a singular value decomposition.

References
----------
Pott, A., Bruckmann, T., Mikelsons, L. (2009). Closed-form force distribution for parallel wire
robots. Computational Kinematics, 25-34.
Giraud, L., Langou, J., Rozložník, M. (2005). On the loss of orthogonality in the Gram-Schmidt
orthogonalization process. Computers & Mathematics with Applications 50, 1069-1075.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.dynamics.c_code import c_body, c_header, c_literal, identifier, in_comment
from winchkit.dynamics.expression import Expression, symbol
from winchkit.dynamics.tracing import expression, traced
from winchkit.robot.export.lines import RobotLine
from winchkit.robot.geometry.kinematics import Geometry, linearised
from winchkit.robot.geometry.robot import Robot
from winchkit.units import GRAVITY

_HEAD = """\
/* {name}: written by winchkit export-model.

   C99, no library but math.h, no allocation; SI units. Define WINCHKIT_FLOAT before this header for
   float in place of double. The lines are {names}, in this order; each is a winch with
   functions of its own below. */
"""
_ROBOT = """\

#ifndef {P}_H
#define {P}_H
#define {P}_LINES {count}
#define {P}_FREE {free}

#ifdef WINCHKIT_FLOAT
typedef float {p}_real;
#define {P}_F(name) name##f
#else
typedef double {p}_real;
#define {P}_F(name) name
#endif

typedef struct {{
    {p}_real position[3]; /* m, of the platform's origin in the base frame */
    {p}_real rotation[9]; /* from platform to base axes, row by row */
}} {p}_pose;

/* Exit point in the base frame, anchor point in the platform frame, unit swivel axis, swivel
   radius; m. */
static const {p}_real {p}_geometry[{P}_LINES][10] = {{
{geometry}}};
/* Degrees of freedom of the platform: coordinates that cables balance. */
static const int {p}_free[{P}_FREE] = {{{rows}}};

/* Length of a cable with the arc on its pulley, m, and its column of the structure matrix. */
static inline void {p}_cable(const {p}_pose *pose, const {p}_real *at, {p}_real *length,
                            {p}_real *column)
{{
{cable}}}

/* Lengths, m, and the structure matrix, six numbers for each line: its product with the cable
   forces is the wrench on the platform about its origin, in base axes. NAN where an anchor point
   lies inside its pulley. */
static inline void {p}_lengths(const {p}_pose *pose, {p}_real *length, {p}_real *structure)
{{
    for (int i = 0; i < {P}_LINES; ++i)
        {p}_cable(pose, {p}_geometry[i], &length[i], &structure[6 * i]);
}}

/* Wrench of the platform's weight, N and N m. */
static inline void {p}_weight(const {p}_pose *pose, {p}_real *wrench)
{{
    const {p}_real weight[6] = {{
        0, 0, {weight},
        {weight} * (pose->rotation[3] * {x} + pose->rotation[4] * {y} + pose->rotation[5] * {z}),
        -{weight} * (pose->rotation[0] * {x} + pose->rotation[1] * {y} + pose->rotation[2] * {z}),
        0,
    }};
    for (int j = 0; j < 6; ++j)
        wrench[j] = 0;
    for (int j = 0; j < {P}_FREE; ++j)
        wrench[{p}_free[j]] = weight[{p}_free[j]];
}}

/* Motor angles, rad, at cable lengths, m, under cable forces, N, at rest. */
static inline void {p}_motor_angles(const {p}_real *length, const {p}_real *force,
                                   {p}_real *angle)
{{
{angles}}}
"""
_FORCES = """\

static inline {p}_real {p}_dot(const {p}_real *a, const {p}_real *b)
{{
    {p}_real even = 0, odd = 0; /* Two sums: a processor adds them at the same time. */
    for (int i = 0; i + 1 < {P}_LINES; i += 2) {{
        even += a[i] * b[i];
        odd += a[i + 1] * b[i + 1];
    }}
    if ({P}_LINES % 2)
        even += a[{P}_LINES - 1] * b[{P}_LINES - 1];
    return even + odd;
}}

/* Cable forces, N, that balance a wrench and are nearest to the middle of their limits (closed
   form). Returns 1 where they are within the limits, else 0; NAN in a singular pose. */
static inline int {p}_forces(const {p}_real *structure, const {p}_real *wrench,
                            const {p}_real *low, const {p}_real *high, {p}_real *force)
{{
    {p}_real q[{P}_FREE][{P}_LINES], r[{P}_FREE][{P}_FREE], missing[{P}_FREE];
    int within = 1;
    for (int i = 0; i < {P}_LINES; ++i)
        force[i] = (low[i] + high[i]) / 2;
    for (int j = 0; j < {P}_FREE; ++j) {{
        {p}_real whole, left, inverse;
        for (int i = 0; i < {P}_LINES; ++i)
            q[j][i] = structure[6 * i + {p}_free[j]];
        missing[j] = wrench[{p}_free[j]] + {p}_dot(q[j], force);
        whole = left = {p}_dot(q[j], q[j]);
        for (int k = 0; k < j; ++k)
            r[j][k] = 0;
        for (int pass = 0; pass < 2 && j; ++pass) {{
            const {p}_real before = left;
            {p}_real along[{P}_FREE];
            for (int k = 0; k < j; ++k)
                r[j][k] += along[k] = {p}_dot(q[k], q[j]);
            for (int k = 0; k < j; ++k)
                for (int i = 0; i < {P}_LINES; ++i)
                    q[j][i] -= along[k] * q[k][i];
            left = {p}_dot(q[j], q[j]);
            if (4 * left > before) /* Little was taken away: little of it was rounding. */
                break;
        }}
        if (!(left > ({p}_real){rank} * whole)) {{
            for (int i = 0; i < {P}_LINES; ++i)
                force[i] = NAN;
            return 0;
        }}
        r[j][j] = {P}_F(sqrt)(left);
        inverse = 1 / r[j][j];
        for (int i = 0; i < {P}_LINES; ++i)
            q[j][i] *= inverse;
    }}
    for (int j = 0; j < {P}_FREE; ++j) {{
        for (int k = 0; k < j; ++k)
            missing[j] -= r[j][k] * missing[k];
        missing[j] /= r[j][j];
        for (int i = 0; i < {P}_LINES; ++i)
            force[i] -= q[j][i] * missing[j];
    }}
    for (int i = 0; i < {P}_LINES; ++i)
        within = within && force[i] >= low[i] && force[i] <= high[i];
    return within;
}}
"""
_RANK = 1e-12
"""Square of what is left of a row beside the others, as a share: float has rounding of 1e-14 in it,
and a pose that can be controlled 1e-6."""


def robot_header(robot: Robot, lines: Sequence[RobotLine]) -> tuple[str, list[str]]:
    """The header of a robot, and what it lacks; UsageError as
    :func:`~winchkit.dynamics.step.step_of`."""
    p, place = identifier(robot.profile.name), robot.geometry
    rows = np.flatnonzero(place.free).tolist()
    mass, centre = robot.platform.mass, robot.platform.center_of_mass
    x, y, z = (c_literal(float(one), p) for one in centre)
    angles = "".join(
        f"    angle[{i}] = {identifier(line.winch.name)}_motor_angle(length[{i}], force[{i}]);\n"
        for i, line in enumerate(lines)
    )
    fields = {
        "p": p,
        "P": p.upper(),
        "name": in_comment(robot.profile.name),
        "names": in_comment(", ".join(robot.names)),
        "count": len(lines),
        "free": len(rows),
        "rows": ", ".join(map(str, rows)),
        "geometry": "".join(
            f"    {{{', '.join(map(repr, row))}}}, /* line {in_comment(name)} */\n"
            for row, name in zip(line_numbers(place), robot.names, strict=True)
        ),
        "cable": _cable(p, place.free),
        "weight": c_literal(-mass * GRAVITY, p),
        "x": x, "y": y, "z": z,
        "angles": angles,
        "rank": _RANK,
    }  # fmt: skip
    text = _HEAD.format(**fields)
    text += "\n".join(c_header(line.winch, line.terms) for line in lines)
    text += _ROBOT.format(**fields)
    missing = []
    if len(lines) >= len(rows):
        text += _FORCES.format(**fields)
    else:
        missing.append(
            f"force distribution: {len(lines)} cables do not balance a platform of {len(rows)} "
            "degrees of freedom by themselves"
        )
    return text + "\n#endif\n", missing


def cable_formulas(free: Array) -> tuple[list[Expression], dict[str, str]]:
    """Length and column of the structure matrix of one cable, recorded on symbols, and the place of
    each symbol: numbers of the line ``at[…]``, of the pose ``position[…]`` and ``rotation[…]``."""
    names: dict[str, str] = {}

    def symbols(of: str, count: int) -> list[Expression]:
        names.update((f"{of}{k}", f"{of}[{k}]") for k in range(count))
        return [symbol(f"{of}{k}") for k in range(count)]

    at, position, turned = symbols("at", 10), symbols("position", 3), symbols("rotation", 9)
    geometry = Geometry(
        traced([at[:3]]), traced([at[3:6]]), traced([at[9]]), traced([at[6:9]]), free
    )
    rotation: Any = traced(turned).reshape(1, 3, 3)
    length, by = linearised(geometry, traced([position]), rotation)
    parts = [length, *(-part[0, 0, k] for part in (by.position, by.rotation) for k in range(3))]
    return [expression(one) for one in parts], names


def _cable(p: str, free: Array) -> str:
    """The formulas of one cable in C."""
    roots, names = cable_formulas(free)
    of_pose = {
        n: place if place.startswith("at") else f"pose->{place}" for n, place in names.items()
    }
    return c_body(p, roots, ["*length", *(f"column[{j}]" for j in range(6))], of_pose)


def line_numbers(place: Geometry) -> list[list[float]]:
    """Numbers of each line: exit point, anchor point, swivel axis, swivel radius."""
    parts = [place.exit_point, place.anchor_point, place.swivel_axis, place.swivel_radius[:, None]]
    numbers: list[list[float]] = np.hstack(parts).tolist()
    return numbers

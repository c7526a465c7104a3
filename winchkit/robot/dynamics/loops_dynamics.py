"""Dynamics of one pose in loops that numba compiles unchanged.

The body is ten floats: mass, centre of mass (3) and moments of inertia (3) in platform axes, and
gravity (3) in base axes.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor, pi
from typing import Any

Function = Callable[..., Any]
_TURN = 2.0 * pi


def wrench(body: Any, pose: Any, velocity: Any, acceleration: Any, out: Any) -> None:
    """Weight and inertial forces about the platform's origin (winchkit.robot.dynamics.dynamics)."""
    mass, sx, sy, sz = body[0], body[1], body[2], body[3]
    jx, jy, jz, gx, gy, gz = body[4], body[5], body[6], body[7], body[8], body[9]
    xx, xy, xz, yx, yy, yz = pose[3], pose[4], pose[5], pose[6], pose[7], pose[8]
    zx, zy, zz = pose[9], pose[10], pose[11]
    ox, oy, oz = velocity[3], velocity[4], velocity[5]
    ax, ay, az = acceleration[3], acceleration[4], acceleration[5]
    cx, cy, cz = (
        xx * sx + xy * sy + xz * sz,
        yx * sx + yy * sy + yz * sz,
        zx * sx + zy * sy + zz * sz,
    )
    tx, ty, tz = oy * cz - oz * cy, oz * cx - ox * cz, ox * cy - oy * cx
    fx = mass * (gx - acceleration[0] - (ay * cz - az * cy) - (oy * tz - oz * ty))
    fy = mass * (gy - acceleration[1] - (az * cx - ax * cz) - (oz * tx - ox * tz))
    fz = mass * (gz - acceleration[2] - (ax * cy - ay * cx) - (ox * ty - oy * tx))
    # Euler's equations in platform axes, where the moment of inertia is diagonal.
    px = xx * ox + yx * oy + zx * oz
    py = xy * ox + yy * oy + zy * oz
    pz = xz * ox + yz * oy + zz * oz
    mx = jx * (xx * ax + yx * ay + zx * az) + (jz - jy) * py * pz
    my = jy * (xy * ax + yy * ay + zy * az) + (jx - jz) * pz * px
    mz = jz * (xz * ax + yz * ay + zz * az) + (jy - jx) * px * py
    out[0], out[1], out[2] = fx, fy, fz
    out[3] = cy * fz - cz * fy - (xx * mx + xy * my + xz * mz)
    out[4] = cz * fx - cx * fz - (yx * mx + yy * my + yz * mz)
    out[5] = cx * fy - cy * fx - (zx * mx + zy * my + zz * mz)


def winches_loop(wound_angle: Function) -> Function:
    """Loop of motor angles and torques from the lengths and gradients of the cables."""

    def winches(  # noqa: PLR0917 - numba takes no keywords
        lines: Any,
        rows: Any,
        strains: Any,
        forces: Any,
        velocity: Any,
        inertia: Any,
        period: float,
        rates: Any,
        angles: Any,
        out: Any,
    ) -> None:
        """Torques f r/i + J dφ'/dt; replaces the motor speeds ``rates`` of the last cycle. A period
        of zero, as in the first cycle, leaves the inertia out."""
        vx, vy, vz = velocity[0], velocity[1], velocity[2]
        ox, oy, oz = velocity[3], velocity[4], velocity[5]
        for i in range(len(lines)):
            line, g = lines[i], 7 * i
            length = rows[g]
            slack = length - strains[i] * (length + line.dead_length)
            turned = wound_angle(line, line.home_wound + line.home_length - slack)
            angles[i] = line.motor_angle + line.ratio * (turned - line.home_angle)
            turns = turned / _TURN
            if line.stepped != 0.0 and turns > 0.0:
                turns = float(floor(turns))
            arm = (line.winding + line.growth * max(turns, 0.0)) / line.ratio
            speed = rows[g + 1] * vx + rows[g + 2] * vy + rows[g + 3] * vz
            speed += rows[g + 4] * ox + rows[g + 5] * oy + rows[g + 6] * oz
            rate = -speed / arm
            torque = forces[i] * arm
            if period > 0.0:
                torque += inertia[i] * (rate - rates[i]) / period
            out[i] = torque
            rates[i] = rate

    return winches

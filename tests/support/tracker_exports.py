"""Poses of a platform in the layouts of trackers' exports, with numbers of our own."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from winchkit.arrays import Array

COUNT = 60


@cache
def poses() -> tuple[Array, Array, Array, Array]:
    """Times, s; positions (n, 3), m; yaw, rad; quaternions w, x, y, z."""
    t = np.arange(COUNT) / 100
    position = np.stack([1 + 0.1 * np.cos(t), 2 + 0.05 * t, 0.5 + 0.2 * np.sin(2 * t)], axis=1)
    yaw = 0.4 * np.sin(3 * t) + 0.1
    zero = np.zeros(COUNT)
    return t, position, yaw, np.stack([np.cos(yaw / 2), zero, zero, np.sin(yaw / 2)], axis=1)


def optitrack(
    path: Path, bodies: tuple[str, ...] = ("Platform",), *, with_markers: bool = True
) -> None:
    """Motive 1.2: a line of settings, five rows of labels; every body with a marker of its own."""
    t, position, _, q = poses()
    settings = (
        "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,100.000000,Export Frame Rate,"
        "100.000000,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global"
    )
    labels = [["", "Type"], ["", "Name"], ["", "ID"], ["", ""], ["Frame", "Time (Seconds)"]]
    for body in bodies:
        columns = [("Rigid Body", body, "Rotation", axis) for axis in "XYZW"]
        columns += [("Rigid Body", body, "Position", axis) for axis in "XYZ"]
        columns += [("Rigid Body", body, "Mean Marker Error", "")]
        if with_markers:
            marker = ("Rigid Body Marker", f"{body}:Marker1", "Position")
            columns += [(*marker, axis) for axis in "XYZ"]
        for kind, name, quantity, axis in columns:
            for row, text in zip(
                labels, (kind, name, "A1B2C3D4E5F60718", quantity, axis), strict=True
            ):
                row.append(text)
    lines = [settings, "", *(",".join(row) for row in labels)]
    for k in range(COUNT):
        cells = [str(k), f"{t[k]:.6f}"]
        for _ in bodies:
            cells += [f"{q[k, n]:.9f}" for n in (1, 2, 3, 0)]
            cells += [*(f"{1e3 * v:.6f}" for v in position[k]), "0.0002"]
            cells += [f"{1e3 * v + 25:.6f}" for v in position[k]] if with_markers else []
        lines.append(",".join(cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def optitrack_body(path: Path) -> None:
    """The same without markers: as many columns of a rotation as of all else."""
    optitrack(path, with_markers=False)


def vicon(path: Path) -> None:
    """Nexus: title, rate, marker, axes, units; no times."""
    _, position, _, _ = poses()
    lines = ["Trajectories", "100", ",,Robot:P1,,", "Frame,Sub Frame,X,Y,Z", ",,mm,mm,mm"]
    lines += [f"{k + 1},0," + ",".join(f"{1e3 * v:.6f}" for v in p) for k, p in enumerate(position)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def vicon_objects(path: Path, kind: str = "Quaternion") -> None:
    """Tracker: a name of the object's convention, no times, no unit of its quaternion."""
    _, position, yaw, q = poses()
    zero = np.zeros(COUNT)
    turned = q[:, [1, 2, 3, 0]] if kind == "Quaternion" else np.stack([zero, zero, yaw], axis=1)
    names = ["RX", "RY", "RZ", "RW"][: turned.shape[1]]
    units = [""] * 4 if kind == "Quaternion" else ["rad"] * 3
    label = ["", "", f"Global Angle ({kind}) plat:plat", *[""] * (len(names) + 2)]
    lines = [
        "Objects",
        "100",
        ",".join(label),
        ",".join(["Frame", "Sub Frame", *names, "TX,TY,TZ"]),
    ]
    lines.append(",".join(["", "", *units, "mm,mm,mm"]))
    for k, row in enumerate(np.concatenate([turned, 1e3 * position], axis=1)):
        lines.append(f"{k + 1},0," + ",".join(f"{v:.9f}" for v in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def vicon_helical(path: Path) -> None:
    """The same with rotation vectors."""
    vicon_objects(path, "Helical")


def aruco(path: Path) -> None:
    """Rotation and translation vectors of OpenCV."""
    t, position, yaw, _ = poses()
    lines = ["timestamp,marker_id,tvec_x [m],tvec_y [m],tvec_z [m],rvec_x,rvec_y,rvec_z"]
    for k, p in enumerate(position):
        lines.append(f"{t[k]:.3f},7," + ",".join(f"{v:.9f}" for v in (*p, 0.0, 0.0, yaw[k])))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def spatial_analyzer(path: Path) -> None:
    """Comments with the units, blanks between the columns, fixed angles."""
    _, position, yaw, _ = poses()
    lines = ["// SpatialAnalyzer export of frames", "// Units: Millimeters Degrees", ""]
    lines.append("Name X Y Z Rx Ry Rz")
    for k, p in enumerate(position):
        cells = " ".join(f"{1e3 * v:.6f}" for v in p)
        lines.append(f"P{k} {cells} 0.0 0.0 {math.degrees(yaw[k]):.9f}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def leica(path: Path) -> None:
    """Semicolons, decimal commas, quaternion."""
    _, position, _, q = poses()
    lines = ["Punkt;X [mm];Y [mm];Z [mm];qw;qx;qy;qz"]
    for k, p in enumerate(position):
        numbers = [*(f"{1e3 * v:.6f}" for v in p), *(f"{v:.12f}" for v in q[k])]
        lines.append(";".join([f"P{k}", *(n.replace(".", ",") for n in numbers)]))
    path.write_text("\r\n".join(lines) + "\r\n", encoding="cp1252")


def matrix(path: Path) -> None:
    """Homogeneous matrices, row by row, in metres."""
    _, position, yaw, _ = poses()
    names = [f"T{row}{column}" for row in "123" for column in "1234"]
    lines = ["Length units: m", ",".join(names)]
    for p, angle in zip(position, yaw, strict=True):
        c, s = math.cos(angle), math.sin(angle)
        rows = [(c, -s, 0.0, p[0]), (s, c, 0.0, p[1]), (0.0, 0.0, 1.0, p[2])]
        lines.append(",".join(f"{v:.12f}" for row in rows for v in row))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def numbered_quaternion(path: Path) -> None:
    """q0 to q3, w first, of an API."""
    _, position, _, q = poses()
    lines = ["x_mm y_mm z_mm q0 q1 q2 q3"]
    for k, p in enumerate(position):
        lines.append(" ".join([*(f"{1e3 * v:.6f}" for v in p), *(f"{v:.12f}" for v in q[k])]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")

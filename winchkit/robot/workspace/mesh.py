"""Surface of a workspace as a closed mesh of quadrilaterals (surface nets), in PLY or OBJ.

Each cube between eight neighbouring cells that the surface crosses has one vertex, the mean of the
points where the level, interpolated linearly, is zero on the cube's edges. Beyond the grid the
level is that of the nearest cell with the opposite sign, so that the surface closes at its box; the
workspace of a planar platform is a plate of one cell's thickness.

References
----------
S. Gibson, *Constrained elastic surface nets*, 1998.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arguments import path_of
from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.regular_file import refuse_existing
from winchkit.robot.workspace.workspace import Grid, Workspace

_STEEP = 20.0
"""Levels beyond this multiple of the median are cut, so that −inf beyond a singular pose does not
move the surface to the last cell (rule of thumb)."""


@dataclass(frozen=True)
class Mesh:
    """A closed surface."""

    vertex: Array
    """(v, 3), m."""
    face: NDArray[np.intp]
    """Vertices of each quadrilateral, (f, 4), counter-clockwise from outside."""

    @property
    def volume(self) -> float:
        """Enclosed volume, m³ (theorem of Gauss); of a planar platform that of the plate.

        Returns
        -------
        float
            m³.
        """
        a, b, c, d = (self.vertex[self.face[:, k]] for k in range(4))
        return float(np.sum(a * (np.cross(b, c) + np.cross(c, d)))) / 6


def mesh_of(found: Workspace, condition: str) -> Mesh:
    """Surface on which the level of a condition is zero.

    Parameters
    ----------
    found : Workspace
        Levels on a grid.
    condition : str
        One of them.

    Returns
    -------
    Mesh
        Closed; several parts where the workspace has.

    Raises
    ------
    UsageError
        Where the condition holds nowhere on the grid.
    """
    level, grid = found.levels[condition], found.grid
    if not np.any(level > 0):
        raise UsageError(f"no cell of the grid is {condition}: there is no surface to write")
    usual = _STEEP * float(np.median(np.abs(level[np.isfinite(level)])))
    level = np.clip(level, -usual, usual)
    padded = np.pad(level, 1, mode="edge")
    beyond = np.pad(np.zeros(level.shape, dtype=bool), 1, constant_values=True)
    padded[beyond] = -np.abs(padded[beyond])
    inside = padded > 0
    number, vertex = _vertices(padded, inside)
    return Mesh(_placed(vertex, grid), _faces(inside, number))


def _vertices(level: Array, inside: NDArray[np.bool_]) -> tuple[NDArray[np.intp], Array]:
    """Number of the vertex of each cube, and the vertices in cells of the padded grid."""
    cubes = tuple(n - 1 for n in level.shape)
    total, count = np.zeros((*cubes, 3)), np.zeros(cubes)

    def part(values: NDArray[Any], corner: tuple[int, ...]) -> NDArray[Any]:
        return values[tuple(slice(c, c + n) for c, n in zip(corner, cubes, strict=True))]

    for axis in range(3):
        for corner in product((0, 1), repeat=3):
            if corner[axis]:
                continue
            end = tuple(c + (k == axis) for k, c in enumerate(corner))
            first, last = part(level, corner), part(level, end)
            crossed = part(inside, corner) != part(inside, end)
            share = np.where(crossed, first / np.where(crossed, first - last, 1.0), 0.0)
            for k in range(3):
                total[..., k] += crossed * (corner[k] + share * (k == axis))
            count += crossed
    used = count > 0
    number = np.full(cubes, -1)
    number[used] = np.arange(np.count_nonzero(used))
    return number, np.argwhere(used) + total[used] / count[used][:, None]


def _faces(inside: NDArray[np.bool_], number: NDArray[np.intp]) -> NDArray[np.intp]:
    """One quadrilateral around each edge of the grid that the surface crosses."""
    out = []
    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        first, last = (
            np.moveaxis(inside, axis, 0)[part] for part in (slice(None, -1), slice(1, None))
        )
        at = np.argwhere(first != last)
        leaving = first[tuple(at.T)]
        place = np.empty_like(at)
        rest = [k for k in range(3) if k != axis]
        place[:, [axis, *rest]] = at
        ring = []
        for a, b in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
            cube = place.copy()
            cube[:, one] += a
            cube[:, two] += b
            ring.append(number[tuple(cube.T)])
        face = np.stack(ring, axis=1)
        out.append(np.where(leaving[:, None], face, face[:, ::-1]))
    return np.concatenate(out)


def _placed(vertex: Array, grid: Grid) -> Array:
    """Vertices in cells of the padded grid as places, m."""
    first = np.array([axis[0] for axis in grid.axes])
    return np.asarray(first + (vertex - 1) * grid.step)


def write_mesh(mesh: Mesh, path: str | Path, *, replace: bool = False) -> None:
    """Write a mesh as text, by the file's suffix ``.ply`` or ``.obj``.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    path : str or Path
        Of the new file; coordinates are in m.
    replace : bool
        Write over an existing file.

    Raises
    ------
    UsageError
        For another suffix, and where the file exists and is not to be replaced.
    """
    path = path_of(path)
    refuse_existing(path, replace)
    places = "\n".join(f"{{}}{x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.vertex.tolist())
    if path.suffix == ".ply":
        head = (
            "ply\nformat ascii 1.0\ncomment metres\n"
            f"element vertex {len(mesh.vertex)}\nproperty float x\nproperty float y\n"
            f"property float z\nelement face {len(mesh.face)}\n"
            "property list uchar int vertex_indices\nend_header\n"
        )
        faces = "\n".join(f"4 {a} {b} {c} {d}" for a, b, c, d in mesh.face.tolist())
        text = f"{head}{places.replace('{}', '')}\n{faces}\n"
    elif path.suffix == ".obj":
        faces = "\n".join(f"f {a} {b} {c} {d}" for a, b, c, d in (mesh.face + 1).tolist())
        text = f"# metres\n{places.replace('{}', 'v ')}\n{faces}\n"
    else:
        raise UsageError(f"'{path.name}': a mesh is written as .ply or .obj")
    path.write_text(text, encoding="ascii")

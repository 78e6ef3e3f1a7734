"""Kernel of `dark_edges.dark_edges`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Bools, Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.surfaces.dark_edges import EdgeCrossings
from voxdisplay.voxelization.surfaces.lit_mask import LitMask
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.snapped_mesh import SHIFT


def dark_edges(mask: LitMask, topology: Topology) -> list[EdgeCrossings]:
    """See `dark_edges.dark_edges`."""
    mesh = topology.mesh
    faces = np.ascontiguousarray(mesh.faces)
    size = 1024
    while True:
        found = np.empty((4, size), dtype=np.int64)
        count = _dark(
            mesh.points, faces, np.array(mesh.sides), topology.has_inside, SHIFT,
            *mask.storage(), found,
        )  # fmt: skip
        if count <= size:
            break
        size = count
    axis, triangle, corner, plane = found[:, :count]
    return [
        EdgeCrossings(triangle[axis == k], corner[axis == k], plane[axis == k]) for k in range(3)
    ]


@jit
def _dark(
    points: NDArray[np.int32],
    faces: Ints,
    sides: Ints,
    ascending: bool,
    shift: int,
    digits: int,
    cells: Ints,
    stored: NDArray[np.int32],
    lit: Bools,
    found: Ints,
) -> int:
    """Write axis, triangle, corner and plane, as many as there is room for; return how many."""
    unit, half = 1 << shift, 1 << (shift - 1)
    count = 0
    strides = np.array((1, sides[0], sides[0] * sides[1]))
    at = np.empty((3, 3), dtype=np.int64)  # by axis and corner
    for t in range(len(faces)):
        for axis in range(3):
            for corner in range(3):
                at[axis, corner] = points[axis, faces[t, corner]]
        for axis in range(3):
            lowest = min(at[axis, 0], at[axis, 1], at[axis, 2]) + unit - 1 - half
            if lowest >> shift > (max(at[axis, 0], at[axis, 1], at[axis, 2]) - half) >> shift:
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for corner in range(3):
                after = (corner + 1) % 3
                start, end = at[axis, corner], at[axis, after]
                if start == end or (ascending and start > end):
                    continue
                first = int(max((min(start, end) + unit - 1 - half) >> shift, 0))
                last = int(min((max(start, end) - half) >> shift, sides[axis] - 1))
                if first > last:
                    continue
                rise = float(end - start) * unit
                slope_u = float(at[u, after] - at[u, corner]) / rise
                slope_v = float(at[v, after] - at[v, corner]) / rise
                base_u = float(at[u, corner] - half) / unit
                base_v = float(at[v, corner] - half) / unit
                for plane in range(first, last + 1):
                    run = float((plane << shift) + half - start)
                    p, q = run * slope_u + base_u, run * slope_v + base_v
                    i, j = int(np.floor(p + 0.5)), int(np.floor(q + 0.5))
                    # Nearly always lit: asked here, without a call.
                    inside = digits == 0 and 0 <= i < sides[u] and 0 <= j < sides[v]
                    if inside and lit[plane * strides[axis] + i * strides[u] + j * strides[v]]:
                        continue
                    if _near_lit(p, q, plane, axis, sides, digits, cells, stored, lit):
                        continue
                    if count < found.shape[1]:
                        found[0, count], found[1, count] = axis, t
                        found[2, count], found[3, count] = corner, plane
                    count += 1
    return count


@jit
def _near_lit(
    u: float,
    v: float,
    plane: int,
    axis: int,
    sides: Ints,
    digits: int,
    cells: Ints,
    stored: NDArray[np.int32],
    lit: Bools,
) -> bool:
    """Return whether a corner of the dual face around a point is lit, the nearest first."""
    i, j = int(np.floor(u)), int(np.floor(v))
    s, t = u - i, v - j
    up_u, up_v = int(s > 0.5), int(t > 0.5)
    nu, nv = sides[(axis + 1) % 3], sides[(axis + 2) % 3]
    for k in range(4):
        right, above = up_u ^ (k & 1), up_v ^ (k >> 1)
        # Corners beyond an edge on which the point may be do not count.
        if (k & 1 and min(s, 1 - s) < 1e-6) or (k >> 1 and min(t, 1 - t) < 1e-6):
            continue
        p, q = i + right, j + above
        if not (0 <= p < nu and 0 <= q < nv):
            continue
        x, y, z = plane, p, q
        if axis == 1:
            x, y, z = q, plane, p
        elif axis == 2:
            x, y, z = p, q, plane
        if digits == 0:
            if lit[x + sides[0] * (y + sides[1] * z)]:
                return True
        else:
            inner = (1 << digits) - 1
            brick = (x >> digits) + cells[0] * ((y >> digits) + cells[1] * (z >> digits))
            place = (x & inner) + ((y & inner) << digits) + ((z & inner) << (2 * digits))
            row = np.int64(stored[brick])
            if row >= 0 and lit[(row << (3 * digits)) + place]:
                return True
    return False

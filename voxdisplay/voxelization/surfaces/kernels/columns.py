"""Kernel of `mesh_solid.column_crossings`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.surfaces.column_crossings import ColumnCrossings
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.midline_crossings import NEAR_FACE
from voxdisplay.voxelization.surfaces.projected_triangles import SLACK
from voxdisplay.voxelization.surfaces.snapped_mesh import SHIFT


def column_crossings(topology: Topology, axis: int) -> ColumnCrossings:
    """See `column_crossings.column_crossings`."""
    mesh = topology.mesh
    faces = np.ascontiguousarray(mesh.faces)
    constants = np.array((SLACK, NEAR_FACE))
    size = len(faces) + 1024
    while True:
        found = np.empty((4, size), dtype=np.int64)
        count = _crossings(mesh.points, faces, np.array(mesh.sides), axis, SHIFT, constants, found)
        if count <= size:
            break
        size = count
    i, j, level, step = found[:, :count]
    return ColumnCrossings(axis, i, j, level, step.astype(np.int8))


@jit
def _crossings(
    points: NDArray[np.int32],
    faces: Ints,
    sides: Ints,
    axis: int,
    shift: int,
    constants: NDArray[np.float64],
    found: Ints,
) -> int:
    """Write i, j, level and step of crossings, as many as there is room for; return how many."""
    slack, near_face = constants
    unit, half = 1 << shift, 1 << (shift - 1)
    per_voxel = 1 / unit
    u, v = (axis + 1) % 3, (axis + 2) % 3
    count = 0
    for t in range(len(faces)):
        p, q, r = faces[t, 0], faces[t, 1], faces[t, 2]
        u0, u1, u2 = int(points[u, p]), int(points[u, q]), int(points[u, r])
        v0, v1, v2 = int(points[v, p]), int(points[v, q]), int(points[v, r])
        low_u = max((min(u0, u1, u2) + unit - 1 - half) >> shift, 0)
        high_u = min((max(u0, u1, u2) - half) >> shift, sides[u] - 1)
        low_v = max((min(v0, v1, v2) + unit - 1 - half) >> shift, 0)
        high_v = min((max(v0, v1, v2) - half) >> shift, sides[v] - 1)
        if low_u > high_u or low_v > high_v:
            continue
        u0, u1, u2, v0, v1, v2 = u0 - half, u1 - half, u2 - half, v0 - half, v1 - half, v2 - half
        area = (u1 - u0) * (v2 - v0) - (u2 - u0) * (v1 - v0)
        if area == 0:
            continue
        w0, w1, w2 = (
            np.int64(points[axis, p]),
            np.int64(points[axis, q]),
            np.int64(points[axis, r]),
        )
        turned = area < 0
        if turned:
            u1, u2, v1, v2, w1, w2, area = u2, u1, v2, v1, w2, w1, -area
        d0, d1, d2 = v2 - v1, v0 - v2, v1 - v0
        # Top-left rule: edges that are not a triangle's own are left out.
        bias0 = 0 if d0 < 0 or (d0 == 0 and u2 > u1) else 1
        bias1 = 0 if d1 < 0 or (d1 == 0 and u0 > u2) else 1
        bias2 = 0 if d2 < 0 or (d2 == 0 and u1 > u0) else 1
        for j in range(low_v, high_v + 1):
            y = j << shift
            e0 = (u2 - u1) * (y - v1) + d0 * u1
            e1 = (u0 - u2) * (y - v2) + d1 * u2
            first, last = low_u, high_u
            if high_u - low_u > 2:
                e2 = (u1 - u0) * (y - v0) + d2 * u0
                for d, e in ((d0, e0), (d1, e1), (d2, e2)):
                    if d > 0:
                        last = min(last, int(np.floor(e / (d * float(unit)) + slack)))
                    elif d < 0:
                        first = max(first, int(np.ceil(e / (d * float(unit)) - slack)))
            for i in range(first, last + 1):
                a = e0 - d0 * (i << shift)
                b = e1 - d1 * (i << shift)
                c = area - a - b
                if ((a - bias0) | (b - bias1) | (c - bias2)) < 0:
                    continue
                depth = float(a) * float(w0)
                depth += float(b) * float(w1)
                depth += float(c) * float(w2)
                depth /= float(area)
                depth *= per_voxel
                depth -= 0.5
                nearest = np.rint(depth)
                level = int(np.ceil(depth))
                if abs(depth - nearest) < near_face:
                    level = int(nearest)
                    center = (level << shift) + half
                    side = a * (w0 - center) + b * (w1 - center) + c * (w2 - center)
                    level += int(side > 0)
                if count < found.shape[1]:
                    found[0, count], found[1, count] = i, j
                    found[2, count] = min(max(level, 0), sides[axis])
                    found[3, count] = 1 if turned else -1
                count += 1
    return count

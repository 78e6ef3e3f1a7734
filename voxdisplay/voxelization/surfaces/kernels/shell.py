"""Kernel of `mesh_shell.mark_shell`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import jit
from voxdisplay.voxelization.surfaces.lit_mask import LitMask
from voxdisplay.voxelization.surfaces.mesh_topology import Topology
from voxdisplay.voxelization.surfaces.midline_crossings import NEAR_FACE
from voxdisplay.voxelization.surfaces.projected_triangles import SLACK
from voxdisplay.voxelization.surfaces.snapped_mesh import SHIFT
from voxdisplay.voxelization.voxel_box import Triple

_UNKNOWN = 2  # which side is outside, while no crossing has asked
_TRIANGLES_PER_BLOCK = 1 << 16


def mark_shell(mask: LitMask, topology: Topology, walls: Triple) -> bool:
    """See `mesh_shell.mark_shell`."""
    mesh = topology.mesh
    whole = True
    constants = np.array((SLACK, NEAR_FACE))
    outward = _UNKNOWN
    for begin in range(0, len(mesh.faces), _TRIANGLES_PER_BLOCK):
        faces = np.ascontiguousarray(mesh.faces[begin : begin + _TRIANGLES_PER_BLOCK])
        size = 4 * len(faces) + 1024
        while True:
            voxels = np.empty((3, size), dtype=np.int64)
            count, asked, inside = _lit_voxels(
                mesh.points, faces, np.array(mesh.sides), np.array(walls), outward, SHIFT,
                constants, voxels,
            )  # fmt: skip
            if asked and outward == _UNKNOWN:
                outward = topology.outward
            elif count > size:
                size = count
            else:
                break
        x, y, z = voxels[:, :count]
        mask.mark(mask.locate(0, y, z, x))
        whole &= inside
    return whole


@jit
def _lit_voxels(
    points: NDArray[np.int32],
    faces: Ints,
    sides: Ints,
    walls: Ints,
    outward: int,
    shift: int,
    constants: NDArray[np.float64],
    voxels: Ints,
) -> tuple[int, bool, bool]:
    """Write the voxels that triangles light, as many as there is room for.

    Returns their number, whether `outward` would have to be known, and whether all are in the box.
    """
    slack, near_face = constants
    unit, half = 1 << shift, 1 << (shift - 1)
    per_voxel = 1 / unit
    count, whole = 0, True
    low, high = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for t in range(len(faces)):
        p, q, r = faces[t, 0], faces[t, 1], faces[t, 2]
        meets = 0
        for axis in range(3):
            first, second, third = int(points[axis, p]), int(points[axis, q]), int(points[axis, r])
            low[axis] = max((min(first, second, third) + unit - 1 - half) >> shift, 0)
            high[axis] = min((max(first, second, third) - half) >> shift, sides[axis] - 1)
            meets += low[axis] <= high[axis]
        if meets < 2:
            continue
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            if low[u] > high[u] or low[v] > high[v]:
                continue
            u0, u1, u2 = (
                np.int64(points[u, p]) - half,
                np.int64(points[u, q]) - half,
                np.int64(points[u, r]) - half,
            )
            v0, v1, v2 = (
                np.int64(points[v, p]) - half,
                np.int64(points[v, q]) - half,
                np.int64(points[v, r]) - half,
            )
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
            wide = high[u] - low[u] > 2
            for j in range(int(low[v]), int(high[v]) + 1):
                y = j << shift
                # Edge functions are e - d * x along the row.
                d0, d1 = v2 - v1, v0 - v2
                e0 = (u2 - u1) * (y - v1) + d0 * u1
                e1 = (u0 - u2) * (y - v2) + d1 * u2
                first, last = low[u], high[u]
                if wide:
                    d2 = v1 - v0
                    e2 = (u1 - u0) * (y - v0) + d2 * u0
                    for d, e in ((d0, e0), (d1, e1), (d2, e2)):
                        if d > 0:
                            last = min(last, int(np.floor(e / (d * float(unit)) + slack)))
                        elif d < 0:
                            first = max(first, int(np.ceil(e / (d * float(unit)) - slack)))
                for i in range(int(first), int(last) + 1):
                    a = e0 - d0 * (i << shift)
                    b = e1 - d1 * (i << shift)
                    c = area - a - b
                    if (a | b | c) < 0:
                        continue
                    depth = float(a) * float(w0)
                    depth += float(b) * float(w1)
                    depth += float(c) * float(w2)
                    depth /= float(area)
                    depth *= per_voxel
                    nearest = np.rint(depth)
                    if abs(depth - nearest) < near_face:
                        level = int(nearest)
                        face = level << shift
                        side = a * (w0 - face) + b * (w1 - face) + c * (w2 - face)
                        if side == 0 and outward == 2:
                            return 0, True, True
                        if side == 0 and outward:
                            side = np.int64(-1 if turned == (outward < 0) else 1)
                        elif side == 0:
                            side = np.int64(-1 if level == walls[axis] else 1)
                        level -= int(side < 0)
                    else:
                        level = int(np.floor(depth))
                    if 0 <= level < sides[axis]:
                        if count < voxels.shape[1]:
                            voxels[axis, count], voxels[u, count], voxels[v, count] = level, i, j
                        count += 1
                    else:
                        whole = False
    return count, False, whole

"""Voxelisation of quadric patches in closed form.

Along each mid-line (the line of voxel centres along one axis) the quadric is a quadratic; its
roots that no clip removes are hits, and the voxel that holds a hit is lit: it is the nearest one.
Every lit voxel is within 1/2 of the surface, and no 6-connected path passes through it. A hit on
the face between two voxels belongs to the inner one of a closed body, else to the upper one, and
at the upper wall of the box to the last. Must not know bodies by name.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from voxdisplay.voxelization.surfaces.wire_cover import cover_wires, distinct
from voxdisplay.voxelization.voxel_set import VoxelSet

if TYPE_CHECKING:
    from voxdisplay.bodies.body import Body
    from voxdisplay.bodies.quadrics import Quadric, QuadricPatch, QuadricPatches
    from voxdisplay.compute.array_types import Bools, Floats, Ints
    from voxdisplay.voxelization.voxel_box import VoxelBox

TIE = 1e-9
"""Hits so near to a face between voxels, in voxels, are decided by the sign of q on it."""
_ZERO = 4e-15  # of the sum of magnitudes that q is made of: what rounding leaves of a zero


def voxelize_quadrics(
    geometry: QuadricPatches,
    box: VoxelBox,
    body: Body,
    *,
    certified: bool = False,
) -> VoxelSet:
    """Return the voxels of quadric patches inside a box, as a shell or filled."""
    fill = _solid if geometry.closed and body.kind == "solid" else _shell
    if not geometry.wires:
        return VoxelSet(box, fill(geometry, box, box), body.kind, certified=certified)

    def inside(points: Floats) -> Bools:
        if not geometry.closed:
            return np.zeros(len(points), dtype=bool)
        negative = np.stack([patch.surface(points) < 0 for patch in geometry.patches])
        return np.asarray(negative.all(axis=0))

    # What a wire needs depends on voxels just outside of the box.
    wide = box.expanded(1)
    index = cover_wires(fill(geometry, wide, box), wide, geometry.wires, inside)
    voxels = wide.voxels_at(index)
    index = box.index_of(voxels[box.inside(voxels)])
    return VoxelSet(box, index, body.kind, certified=certified)


def _shell(geometry: QuadricPatches, box: VoxelBox, wall: VoxelBox) -> Ints:
    found = [
        _index_of_hits(hits, box, wall, closed=geometry.closed)
        for patch in geometry.patches
        for axis in range(3)
        for hits in _hits(patch, axis, box)
    ]
    return distinct(found)


class _Hits:
    """Hits of one root of a patch's quadric with the mid-lines along one axis.

    Attributes
    ----------
    axis : int
        w; the other two are u, v = w + 1, w + 2, cyclically.
    u, v : (n,) int64 arrays
        Voxel coordinates of the mid-lines, each pair at most once.
    w : (n,) float64 array
        Where they are hit.

    """

    def __init__(self, patch: QuadricPatch, axis: int, u: Ints, v: Ints, w: Floats) -> None:
        self.patch = patch
        self.axis = axis
        self.u = u
        self.v = v
        self.w = w


def _hits(patch: QuadricPatch, axis: int, box: VoxelBox) -> Iterator[_Hits]:
    """Yield the hits of a patch along one axis, root by root; w may be outside of the box."""
    other = (axis + 1) % 3, (axis + 2) % 3
    lines = [_mid_lines(patch, each, box) for each in other]
    if any(first > last for first, last in lines):
        return
    low_w, high_w = patch.bounds[0][axis] - 1, patch.bounds[1][axis] + 1
    (u, v), origin = (np.arange(first, last + 1) for first, last in lines), patch.surface.origin
    a, h, k = _quadratic(
        patch.surface, axis, u + 0.5 - origin[other[0]], v + 0.5 - origin[other[1]]
    )
    with np.errstate(all="ignore"):
        if a == 0 and np.ndim(h) == 0:
            at = [np.broadcast_to(k * (-0.5 / h), (u.size, v.size))] if h else []
            where = np.nonzero(np.ones((u.size, v.size), dtype=bool)) if h else ()
            roots = [root[where] for root in at]
        else:
            square = h * h - a * k
            where = np.nonzero(square >= 0)
            root = np.sqrt(square[where])
            b = np.broadcast_to(h, square.shape)[where] if np.ndim(h) else h
            # The sum of equal signs loses no digits; the other root is by the product of both.
            far = -(b + np.copysign(root, b))
            roots = [far / a, k[where] / far]
            if np.ndim(h) == 0 and h == 0:
                roots = [root / a, -root / a]
    for root in roots:
        w = root + origin[axis]
        keep = (w >= low_w) & (w <= high_w)
        hits = _Hits(patch, axis, u[where[0][keep]], v[where[1][keep]], w[keep])
        yield _clipped(hits)


def _mid_lines(patch: QuadricPatch, axis: int, box: VoxelBox) -> tuple[int, int]:
    """Return the first and the last voxel of a box along an axis whose mid-lines may be hit."""
    low = max(patch.bounds[0][axis] - TIE, box.low[axis])
    high = min(patch.bounds[1][axis] + TIE, box.high[axis])
    if not low <= high:
        return 0, -1
    return (
        max(int(np.ceil(low - 0.5)), box.low[axis]),
        min(int(np.floor(high - 0.5)), box.high[axis] - 1),
    )


def _quadratic(q: Quadric, axis: int, u: Floats, v: Floats) -> tuple[float, Floats, Floats]:
    """Return a, h, k of q = a w**2 + 2 h w + k on the lines at u, (n,), and v, (m,).

    h is a number if it is the same everywhere; k is (n, m).
    """
    i, j = (axis + 1) % 3, (axis + 2) % 3
    m, b = q.matrix, q.vector
    u, v = u[:, None], v[None, :]
    h: Floats = np.asarray(b[axis])
    if m[axis, i] != 0 or m[axis, j] != 0:
        h = m[axis, i] * u + (m[axis, j] * v + b[axis])
    k = (m[i, i] * u * u + 2 * b[i] * u) + (m[j, j] * v * v + 2 * b[j] * v + q.constant)
    if m[i, j] != 0:
        k += (2 * m[i, j] * u) * v
    return float(m[axis, axis]), h, k


def _clipped(hits: _Hits) -> _Hits:
    for clip in hits.patch.clips:
        # Where patches meet at an edge, both keep a hit on it, however it was rounded.
        inside = _at_hits(clip, hits) <= _tolerance(clip, hits)
        if not inside.all():
            hits = _Hits(hits.patch, hits.axis, hits.u[inside], hits.v[inside], hits.w[inside])
    return hits


def _at_hits(q: Quadric, hits: _Hits) -> Floats:
    """Return q at hits; terms that are not there take no time."""
    d: list[Floats] = [np.empty(0)] * 3
    for axis, at in zip((0, 1, 2), (hits.w, hits.u + 0.5, hits.v + 0.5), strict=True):
        own = (hits.axis + axis) % 3
        d[own] = at - q.origin[own]
    total = np.full(hits.w.size, q.constant)
    for i in range(3):
        factor: Floats | float = 2 * q.vector[i]
        for j in range(i, 3):
            if q.matrix[i, j] != 0:
                factor = factor + q.matrix[i, j] * (1 + (i != j)) * d[j]
        if np.ndim(factor) or factor:
            total += factor * d[i]
    return total


def _tolerance(q: Quadric, hits: _Hits) -> float:
    """Return the change of q over a distance of TIE at the hits."""
    if not hits.w.size:
        return 0.0
    reach = np.abs(hits.w - q.origin[hits.axis]).max() + max(
        np.abs(each + 0.5 - q.origin[(hits.axis + step) % 3]).max()
        for step, each in ((1, hits.u), (2, hits.v))
    )
    return float(2 * TIE * (np.abs(q.matrix).max() * reach + np.linalg.norm(q.vector)))


def _index_of_hits(hits: _Hits, box: VoxelBox, wall: VoxelBox, *, closed: bool) -> Ints:
    """Return the scan-order indices of the voxels that hold hits."""
    voxel = np.floor(hits.w)
    face = np.rint(hits.w)
    near = np.flatnonzero(np.abs(hits.w - face) < TIE)
    if near.size:
        voxel[near] = _beside_face(hits, near, face[near], wall.high[hits.axis], closed=closed)
    axes = hits.axis, (hits.axis + 1) % 3, (hits.axis + 2) % 3
    nx, ny, _ = box.sides
    stride = (1, nx, nx * ny)
    w = voxel - box.low[hits.axis]
    inside = (w >= 0) & (w < box.sides[hits.axis])
    index = w[inside].astype(np.int64) * stride[axes[0]]
    for axis, at in zip(axes[1:], (hits.u, hits.v), strict=True):
        index += (at[inside] - box.low[axis]) * stride[axis]
    return np.asarray(index)


def _beside_face(hits: _Hits, near: Ints, face: Floats, wall: int, *, closed: bool) -> Floats:
    """Return the voxel along the hits' axis of hits on, or next to, a face between two voxels."""
    q, axis = hits.patch.surface, hits.axis
    i, j = (axis + 1) % 3, (axis + 2) % 3
    u, v = hits.u[near] + 0.5 - q.origin[i], hits.v[near] + 0.5 - q.origin[j]
    w = face - q.origin[axis]
    a = q.matrix[axis, axis]
    h = q.matrix[axis, i] * u + q.matrix[axis, j] * v + q.vector[axis]
    k = (
        (q.matrix[i, i] * u * u + 2 * q.vector[i] * u)
        + (q.matrix[j, j] * v * v + 2 * q.vector[j] * v + q.constant)
        + 2 * q.matrix[i, j] * u * v
    )
    value = a * w * w + 2 * h * w + k
    size = np.abs(a * w * w) + np.abs(2 * h * w) + np.abs(k) + np.abs(q.constant)
    value = np.where(np.abs(value) <= _ZERO * size, 0.0, value)
    rises = a * w + h > 0
    inner: Bools = np.where(rises, value < 0, value >= 0)  # the root is above the face
    if closed:
        return np.where(inner, face, face - 1)
    above = np.where(value == 0, True, np.where(rises, value < 0, value > 0))
    return np.where(above & ((face < wall) | (value != 0)), face, face - 1)


# ---------------------------------------------------------------------------- solids


def _solid(geometry: QuadricPatches, box: VoxelBox, _wall: VoxelBox) -> Ints:
    """Return the voxels whose centres are inside, by columns along z: half-open, as meshes are.

    A convex solid is one stretch of each column, from its first hit to its last. A centre on the
    surface belongs to what is above it.
    """
    nx, ny, nz = box.sides
    enter, leave = np.full((ny, nx), np.inf), np.full((ny, nx), -np.inf)
    for patch in geometry.patches:
        for hits in _hits(patch, 2, box):
            column = hits.v - box.low[1], hits.u - box.low[0]
            enter[column] = np.minimum(enter[column], hits.w)
            leave[column] = np.maximum(leave[column], hits.w)
    first = np.clip(_first_centre(enter) - box.low[2], 0, nz).astype(np.int64)
    end = np.clip(_first_centre(leave) - box.low[2], 0, nz).astype(np.int64)
    filled = end > first
    rows, columns = (np.flatnonzero(filled.any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return np.empty(0, dtype=np.int64)
    part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    dtype = np.int16 if nz < 1 << 15 else np.int64  # compared plane by plane: short ones are faster
    first, end = first[part].astype(dtype), np.where(filled, end, 0)[part].astype(dtype)
    index = (np.arange(ny)[:, None] * nx + np.arange(nx))[part]
    slices = [
        index[(first <= z) & (end > z)] + z * nx * ny
        for z in range(int(first[end > first].min()), int(end.max()))
    ]
    return np.concatenate(slices)


def _first_centre(at: Floats) -> Floats:
    """Return the first voxel along an axis whose centre is not below a coordinate."""
    nearest = np.rint(at - 0.5)
    with np.errstate(invalid="ignore"):  # infinite where there is no hit
        tie = np.abs(at - 0.5 - nearest) < TIE
    return np.where(tie, nearest, np.ceil(at - 0.5))

"""Guarantees of every sequence, and random curves of many kinds to check them with."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from space_curves import Function, chain, fourier_curve

from voxdisplay import voxelization
from voxdisplay.curves import Bezier, Curve, Lissajous, Polyline, TorusKnot
from voxdisplay.voxelization import measure

Floats = NDArray[np.float64]

# Interior voxels; the first and the last, which hold the curve's ends; the curve from the voxels.
ERROR, END_ERROR, COVERAGE = 0.7072, 0.8661, 2.5
# A closed curve without a corner at its first point may begin with either voxel of a face it is on.
ON_FACE = 1e-6


def check(sequence: voxelization.Sequence, curve: Curve) -> None:
    """Assert the guarantees for a curve without jumps."""
    voxels = sequence.voxels
    start, end = curve.position(np.array(curve.t_range)).T
    ends = np.floor((start, end))
    held = (voxels[0] <= start + ON_FACE) & (start - ON_FACE <= voxels[0] + 1)
    assert np.array_equal(voxels[0], ends[0]) or (sequence.closed and held.all())
    ends_there = np.array_equal(voxels[-1], ends[1])
    assert ends_there or sequence.closed
    assert sequence.starts.tolist() == [0]
    assert measure.gaps(voxels, closed=sequence.closed).size == 0
    assert not (np.diff(voxels, axis=0) == 0).all(axis=1).any()
    assert np.all(np.diff(sequence.t) >= 0)
    distance = sequence.distances
    assert distance.max() <= END_ERROR
    inner = distance[1:-1] if ends_there else distance[1:]
    if sequence.closed and curve.breaks.size:  # it could begin at any of its corners
        corners = set(map(tuple, np.floor(curve.position(curve.breaks)).T.tolist()))
        at_corner = np.array([tuple(voxel) in corners for voxel in voxels.tolist()])
        inner = distance[1:][~at_corner[1:]]
    assert inner.max(initial=0.0) <= ERROR
    assert measure.coverage(voxels, curve) <= COVERAGE
    violations = measure.neighbour_violations(voxels, closed=sequence.closed)
    listed = sequence.contact_pairs
    assert set(violations) <= set(listed.reshape(-1))
    apart = np.abs(voxels[listed[:, 0]] - voxels[listed[:, 1]])
    assert apart.max(initial=0) <= 1


def _fourier(kind: str, *, closed: bool) -> Callable[[int], Curve]:
    return lambda seed: fourier_curve(seed, kind, closed=closed)


def _bezier(seed: int) -> Curve:
    """Return a cubic that is short and likely to turn back on itself."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(40, 216, 3)
    return Bezier(start + np.cumsum(rng.uniform(-1, 1, (4, 3)) * rng.uniform(2, 15), axis=0))


def _hairpin(seed: int) -> Curve:
    """Return legs that lie within two voxels of each other."""
    rng = np.random.default_rng(seed)
    there = rng.normal(size=3) * 20
    middle = there + rng.normal(size=(2, 3)) * 2
    points = np.concatenate((np.zeros((1, 3)), middle, rng.normal(size=(1, 3)) * 2))
    return Bezier(points + rng.uniform(40, 216, 3), closed=False)


def _cusp(seed: int) -> Curve:
    """Return powers of t, in any direction: cusps, corners, and infinite slopes at t = 0."""
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.5, 25, 3)
    even, odd = rng.choice([0.5, 2 / 3, 1, 2, 3]), rng.choice([1 / 3, 1, 2, 3, 5])
    middle = rng.uniform(-50, 200, 3)

    def function(t: Floats) -> tuple[Floats, Floats, Floats]:
        size = np.abs(t)
        local = np.stack((size**even, np.sign(t) * size**odd, 0.2 * t))
        x, y, z = middle[:, None] + axes @ local
        return x, y, z

    return Function(function, -1.0, 1.0)


def _crossing(seed: int) -> Curve:
    """Return a curve that crosses itself, or all but does."""
    rng = np.random.default_rng(seed)
    centre = rng.uniform(60, 70, 3)
    if seed % 2:
        counts = rng.integers(1, 6, 3)
        return Lissajous(centre, rng.uniform(1, 40, 3), counts, rng.uniform(0, 2, 3))
    return TorusKnot(*[(2, 3), (3, 2), (3, 4), (5, 2)][seed % 4], centre, 20, rng.uniform(0.2, 12))


def _curls(seed: int) -> Curve:
    """Return a line with many loops, from smaller than a voxel to a few voxels wide."""
    rng = np.random.default_rng(seed)
    size, turns = rng.uniform(0.2, 4), rng.uniform(20, 300)
    along, start = rng.normal(size=3) * 25, rng.uniform(0, 100, 3)

    def function(t: Floats) -> tuple[Floats, Floats, Floats]:
        x, y, z = start[:, None] + along[:, None] * t
        return x + size * np.cos(turns * t), y + size * np.sin(turns * t), z

    return Function(function)


def _crossing_borders(seed: int) -> Curve:
    """Return a curve that leaves a volume of 256 voxels on all sides."""
    rng = np.random.default_rng(seed)
    return Bezier(rng.uniform(-300, 556, (5, 3)))


def _polyline(seed: int) -> Curve:
    """Return straight lines between corners, faces and centres of voxels: every tie there is."""
    rng = np.random.default_rng(seed)
    return chain(rng.integers(-20, 20, (rng.integers(2, 7), 3)) / 2)


def _polygon(seed: int) -> Curve:
    """Return a polygon, every other one with corners on corners, faces and centres of voxels."""
    rng = np.random.default_rng(seed)
    size, count = rng.uniform(3, 40), rng.integers(3, 8)
    corners = rng.uniform(-size, size, (count, 3))
    return Polyline(np.round(2 * corners) / 2 if seed % 2 else corners, closed=True)


KINDS: dict[str, Callable[[int], Curve]] = {
    "smooth": _fourier("smooth", closed=False),
    "smooth, closed": _fourier("smooth", closed=True),
    "rough": _fourier("rough", closed=False),
    "rough, closed": _fourier("rough", closed=True),
    "tiny": _fourier("tiny", closed=False),
    "tiny, closed": _fourier("tiny", closed=True),
    "bezier": _bezier,
    "hairpin": _hairpin,
    "cusp": _cusp,
    "crossing": _crossing,
    "curls": _curls,
    "crossing borders": _crossing_borders,
    "polyline": _polyline,
    "polygon": _polygon,
}


def profile(kind: str, count: int) -> Sequence[Curve]:
    """Return the first so many curves of a kind, the same ones always."""
    return [KINDS[kind](seed) for seed in range(count)]

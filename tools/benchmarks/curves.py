"""Benchmark of curve voxelisation: this package beside other ways, with their guarantees judged.

The other methods return voxel lists without any guarantee: points sampled densely along the curve,
rounded down, without repeats, in numpy; the same through trimesh; line segments between points of
the curve by scikit-image's line_nd. Points are spaced evenly in t, twenty to a voxel of length
(segments: one to four voxels); the time to find the length is not counted. All methods take the
positions of many curves at once from the same code. Those not installed are left out.
"""

from __future__ import annotations

import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from paper_tables import paper_curve

import voxdisplay as vd
from voxdisplay.compute import kernel_backend
from voxdisplay.curves import Bezier, Curve, Lissajous, TorusKnot
from voxdisplay.curves.batch_evaluation import BatchEvaluator
from voxdisplay.voxelization import measure

Voxels = NDArray[np.int32]
Points = NDArray[np.float64]

SEED = 21
PER_VOXEL = 20
VOXELS_PER_LINE = 4
# Curves of which points are held at once.
TOGETHER = 1000
# Points rounded at once.
ROUNDED = 1 << 18
# Time enough to repeat what is slow, for each line of the table.
PATIENCE_S = 6.0
# What is fast is repeated for so long: a few runs of some milliseconds say little.
ENOUGH_S = 0.2


@dataclass(frozen=True)
class Job:
    """Curves to voxelise, and the curves, or part of them, whose voxels are judged."""

    name: str
    curves: Sequence[Curve]
    judged: Sequence[Curve]


def beziers(count: int, spread: float) -> list[Curve]:
    """Return random cubic Bezier curves, control points at most ``spread`` apart on each axis."""
    rng = np.random.default_rng(SEED)
    start = rng.uniform(40, 216, (count, 1, 3))
    steps = rng.uniform(-spread, spread, (count, 4, 3))
    return [Bezier(points) for points in start + np.cumsum(steps, axis=1)]


def jobs(*, quick: bool) -> Iterator[Job]:
    """Return the benchmark curves; only a few if ``quick``."""
    sizes = [(40, 2)] if quick else [(40, 2), (80, 2), (40, 4), (80, 4)]
    for radius, w in sizes:
        curve = paper_curve(radius, w)
        yield Job(f"paper R={radius} w={w}", [curve], [curve])
    knot = TorusKnot(5, 8, (64.5, 64.5, 64.5), 40, 18)
    yield Job("torus knot (5, 8)", [knot], [knot])
    wave = Lissajous((64.5, 64.5, 64.5), (50, 50, 50), (3, 4, 5), (0.3, 0, 0.9))
    yield Job("Lissajous 3:4:5", [wave], [wave])
    short = beziers(30 if quick else 100_000, 12.5)
    yield Job(f"{len(short)} cubic Beziers, short", short, short[:200])
    longer = beziers(10 if quick else 1000, 36)
    yield Job(f"{len(longer)} cubic Beziers, longer", longer, longer[:200])
    if not quick:
        text = [f"0.5 + 61000*{f}" for f in ("cos(t)", "sin(t)", "(1 - cos(4*t))")]
        whole = vd.Parametric(*text, t=("-170*deg", "170*deg"))
        part = vd.Parametric(*text, t=("30*deg", "36*deg"))
        yield Job("paper R=61000 w=4", [whole], [part])


# ------------------------------------------------------------------------------------ the tools


def grid_plane(curves: Sequence[Curve], _: list[int]) -> list[Voxels]:
    """Voxelise with this engine, in numpy."""
    kernel_backend.set_enabled(False)
    return [sequence.voxels for sequence in vd.voxelize_many(curves)]


def fast(curves: Sequence[Curve], _: list[int]) -> list[Voxels]:
    """Voxelise with this engine, compiled (extra ``fast``)."""
    kernel_backend.set_enabled(True)
    return [sequence.voxels for sequence in vd.voxelize_many(curves)]


def certified(curves: Sequence[Curve], _: list[int]) -> list[Voxels]:
    """Voxelise with this engine, in numpy, certified."""
    kernel_backend.set_enabled(False)
    return [sequence.voxels for sequence in vd.voxelize_many(curves, certified=True)]


def dense(curves: Sequence[Curve], lengths: list[int]) -> list[Voxels]:
    """Voxelise by dense points, in numpy."""
    return from_points(curves, lengths, np.floor)


def trimesh(curves: Sequence[Curve], lengths: list[int]) -> list[Voxels]:
    """Voxelise by dense points, in trimesh."""
    from trimesh.voxel.ops import points_to_indices  # noqa: PLC0415 - need not be installed

    return from_points(
        curves, lengths, lambda points: points_to_indices(points.T, pitch=1.0, origin=[0.5] * 3).T
    )


def line_nd(curves: Sequence[Curve], lengths: list[int]) -> list[Voxels]:
    """Voxelise by lines between points, in scikit-image."""
    from skimage.draw import line_nd as draw  # noqa: PLC0415 - need not be installed

    found = []
    for of, points in sampled(curves, [max(1, n // VOXELS_PER_LINE) for n in lengths]):
        corners = (points - 0.5).T  # it has its voxels around whole numbers
        for own in np.split(corners, np.flatnonzero(np.diff(of)) + 1):
            lines = [np.stack(draw(one, other, endpoint=True)) for one, other in pairwise(own)]
            found.append(without_repeats(np.concatenate(lines, axis=1)).T)
    return found


TOOLS = {
    "this engine": grid_plane,
    "certified": certified,
    "extra fast": fast,
    "numpy": dense,
    "line_nd": line_nd,
    "trimesh": trimesh,
}
NEEDS = {
    "extra fast": ("numba", "numba"),
    "line_nd": ("skimage", "scikit-image"),
    "trimesh": ("trimesh", "trimesh"),
}


def sampled(
    curves: Sequence[Curve], parts: list[int]
) -> Iterator[tuple[NDArray[np.int64], Points]]:
    """Sample curves evenly in t, in so many parts each: indices (n,), points (3, n), in batches."""
    for start in range(0, len(curves), TOGETHER):
        some = curves[start : start + TOGETHER]
        count = np.array(parts[start : start + TOGETHER]) + 1
        of = np.repeat(np.arange(len(some)), count)
        nth = np.arange(of.size) - np.repeat(np.cumsum(count) - count, count)
        low, high = np.array([curve.t_range for curve in some]).T
        t = low[of] + (high - low)[of] * (nth / (count - 1)[of])
        yield of, BatchEvaluator(some).positions(of, t)


def from_points(
    curves: Sequence[Curve], lengths: list[int], to_voxels: Callable[[Points], Points]
) -> list[Voxels]:
    """Round dense points to voxels, and leave out repeats."""
    found = []
    for of, points in sampled(curves, [PER_VOXEL * n for n in lengths]):
        parts = np.array_split(points, points.shape[1] // ROUNDED + 1, axis=1)
        voxels = np.concatenate([to_voxels(part).astype(np.int32) for part in parts], axis=1)
        fresh = np.append(True, (np.diff(of) != 0) | np.diff(voxels, axis=1).any(axis=0))
        found += np.split(voxels[:, fresh].T, np.flatnonzero(np.diff(of[fresh])) + 1)
    return found


def without_repeats(voxels: Voxels) -> Voxels:
    """Return voxels, (3, n), without those equal to their predecessor."""
    return voxels[:, np.append(True, np.diff(voxels, axis=1).any(axis=0))]


# ----------------------------------------------------------------------------------- the table


@dataclass(frozen=True)
class Verdict:
    """Quality of the voxels of some curves: sums, and maxima of distances."""

    voxels: int
    e_max: float
    e_av: float
    not2: int
    coverage: float


def judge(curves: Sequence[Curve], voxels: Sequence[Voxels], closed: Sequence[bool]) -> Verdict:
    """Return the quality of voxels against their curves."""
    rings = [opened(*each) for each in zip(voxels, closed, strict=True)]
    apart = [measure.distances(ring, curve) for ring, curve in zip(rings, curves, strict=True)]
    apart_all = np.concatenate(apart)
    return Verdict(
        voxels=apart_all.size,
        e_max=float(apart_all.max()),
        e_av=float(apart_all.mean()),
        not2=sum(
            len(measure.neighbour_violations(ring, closed=closes))
            for ring, closes in zip(rings, closed, strict=True)
        ),
        coverage=max(
            measure.coverage(ring, curve) for ring, curve in zip(rings, curves, strict=True)
        ),
    )


def opened(voxels: Voxels, closed: bool) -> Voxels:
    """Return voxels without the last one if it repeats the first of a loop."""
    repeats = closed and len(voxels) > 1 and (voxels[0] == voxels[-1]).all()
    return voxels[:-1] if repeats else voxels


def timed(function: Callable[[], object], repeats: int) -> tuple[float, int]:
    """Return the median time of some runs after a warm-up, in seconds, and their number."""
    seconds: list[float] = []
    first_s = stopwatch(function)
    while (len(seconds) < repeats or sum(seconds) < ENOUGH_S) and (
        (len(seconds) + 1) * first_s < PATIENCE_S
    ):
        seconds.append(stopwatch(function))
    return statistics.median(seconds or [first_s]), max(len(seconds), 1)


def stopwatch(function: Callable[[], object]) -> float:
    """Return the time of a call in seconds."""
    began_s = time.perf_counter()
    function()
    return time.perf_counter() - began_s


def bench_job(job: Job, tools: Sequence[str], repeats: int) -> None:
    """Print a line for each tool."""
    sequences = vd.voxelize_many(job.curves)
    lengths = [len(sequence) for sequence in sequences]
    judged = vd.voxelize_many(job.judged)
    judged_lengths = [len(sequence) for sequence in judged]
    closed = [sequence.closed for sequence in judged]
    engine_s = 0.0
    for name in tools:
        if name == "certified" and len(job.curves) > 1:
            continue  # each is proven by itself: thousands take minutes
        tool = TOOLS[name]
        voxels = tool(job.curves, lengths)
        gaps = sum(
            len(measure.gaps(own, closed=sequence.closed))
            for own, sequence in zip(voxels, sequences, strict=True)
        )
        count = sum(map(len, voxels))
        del voxels
        verdict = judge(job.judged, tool(job.judged, judged_lengths), closed)
        seconds, runs = timed(lambda: tool(job.curves, lengths), repeats)  # noqa: B023 - at once
        engine_s = engine_s or seconds
        print(
            f"{job.name if name == tools[0] else '':<29}{name:<12}{count:>9}{gaps:>6}"
            f"{verdict.voxels:>8}{verdict.e_max:>7.3f}{verdict.e_av:>7.3f}{verdict.not2:>7}"
            f"{verdict.coverage:>6.2f}{seconds * 1000:>10.2f}{runs:>5}{seconds / engine_s:>8.2f}"
            f"{count / seconds / 1e6:>8.2f}",
            flush=True,
        )


def memory(curve: Curve) -> None:
    """Print how much memory this engine takes."""
    kernel_backend.set_enabled(False)
    tracemalloc.start()
    sequence = vd.voxelize(curve)
    kept, peak = (size / len(sequence) for size in tracemalloc.get_traced_memory())
    tracemalloc.stop()
    print(f"memory, {len(sequence)} voxels: {peak:.0f} bytes a voxel at most, {kept:.0f} kept")


def bench_curves(repeats: int, *, quick: bool = False) -> None:
    """Print the table."""
    tools = [name for name in TOOLS if name not in NEEDS or find_spec(NEEDS[name][0])]
    for name in [name for name in NEEDS if name not in tools]:
        extra = "fast" if name == "extra fast" else "bench"
        print(f"{name} is left out: pip install {NEEDS[name][1]}, or the extra `{extra}`")
    print(
        f"{'curves':<29}{'tool':<12}{'N':>9}{'gaps':>6}{'judged':>8}{'e_max':>7}{'e_av':>7}"
        f"{'not2':>7}{'cover':>6}{'ms':>10}{'runs':>5}{'ratio':>8}{'Mvox/s':>8}"
    )
    for job in jobs(quick=quick):
        bench_job(job, tools, repeats)
    print(
        "N and gaps are of all curves; e_max, e_av, not2, cover of as many voxels as were judged:\n"
        "those of the first 200 curves of many, and of 6 of the 340 degrees of the longest curve.\n"
        "ms: median of the runs, warm; ratio: to this engine."
    )
    memory(job.curves[0])

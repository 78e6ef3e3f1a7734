"""Section 7.3: LINE, BOX and DOTS."""

from __future__ import annotations

import itertools

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced import Said
from voxdisplay.conformance.catalogue import check, feature, seen, voxels
from voxdisplay.conformance.checks.drawing import long_axis
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.reference_decoder import Place
from voxdisplay.wire import spec

_SIDE = 12  # of the part of the grid in which boxes are drawn


def two_axes(said: Said) -> str:
    """Need an axis of three voxels, and another one of two."""
    a, b, _ = sorted(said.grid, reverse=True)
    return "" if a > 2 and b > 1 else "no axis of three voxels beside one of two"


def corners(said: Said) -> list[Place]:
    """Give the corners of the grid."""
    xs, ys, zs = (sorted({0, side - 1}) for side in said.grid)
    return [(x, y, z) for z in zs for y in ys for x in xs]


@check(
    "7.3",
    "lines",
    "LINE draws the straight line, both ends included",
    feature("LINE"),
    seen,
    long_axis,
)
def lines(probe: Probe) -> None:
    said, rng = probe.said, probe.rng
    for begin in corners(said):
        probe.show(ops.line(said, begin, ops.some_place(said, rng)))
    for _ in range(6):
        probe.show(ops.line(said, ops.some_place(said, rng), ops.some_place(said, rng)))
    probe.show(ops.line(said, (0, 0, 0), corners(said)[-1]))


@check(
    "7.3",
    "line-ties",
    "LINE rounds up from the middle, in both directions",
    feature("LINE"),
    seen,
    two_axes,
)
def line_ties(probe: Probe) -> None:
    said = probe.said
    for main, other in itertools.permutations(range(3), 2):
        if said.grid[main] < 3 or said.grid[other] < 2:
            continue
        length = 4 if said.grid[main] > 4 and said.grid[other] > 2 else 2
        ends = []
        for way in (0, 1):
            place = [0, 0, 0]
            place[main] = length * way
            place[other] = length // 2 * way
            ends.append((place[0], place[1], place[2]))
        mirrored = [list(end) for end in ends]
        for end in mirrored:
            end[other] = length // 2 - end[other]
        for a, b in (ends, [(e[0], e[1], e[2]) for e in mirrored]):
            probe.show(ops.line(said, a, b))
            probe.show(ops.line(said, b, a))


@check("7.3", "line-of-one", "a LINE to its own place is one voxel", feature("LINE"), seen)
def line_of_one(probe: Probe) -> None:
    place = ops.some_place(probe.said, probe.rng)
    probe.show(ops.line(probe.said, place, place))


@check(
    "7.3", "shape-cursor", "after LINE and BOX the cursor is at the voxel named", seen, long_axis
)
def shape_cursor(probe: Probe) -> None:
    said = probe.said
    end = tuple(min(side - 1, 4) for side in said.grid)
    erase = ops.pen(said, 0) + ops.run()
    for name, make in (("LINE", ops.line), ("BOX", ops.box)):
        if said.has(name):
            probe.show(make(said, (0, 0, 0), (end[0], end[1], end[2])) + erase)
            probe.show(make(said, (end[0], end[1], end[2]), (0, 0, 0)) + erase)


@check(
    "7.3",
    "boxes",
    "BOX has all voxels between two corners, whichever is larger",
    feature("BOX"),
    seen,
)
def boxes(probe: Probe) -> None:
    said, rng = probe.said, probe.rng
    base = ops.some_place(said, rng)
    for _ in range(10):
        probe.show(ops.box(said, base, ops.near(said, rng, base, _SIDE)))
    place = ops.some_place(said, rng)
    probe.show(ops.box(said, place, place))
    low = tuple(max(side - _SIDE, 0) for side in said.grid)
    probe.show(ops.box(said, corners(said)[-1], (low[0], low[1], low[2])))


@check("7.3", "dots", "DOTS draws the 1 to 256 voxels that it names", feature("DOTS"), seen)
def dots(probe: Probe) -> None:
    said, rng = probe.said, probe.rng
    room = (said.max_payload - 2) // (3 * said.coordinate_bytes)
    for n in sorted({1, 2, 255, 256, min(room, spec.LIMIT_MAX_DOTS)}):
        if n <= min(room, spec.LIMIT_MAX_DOTS):
            probe.show(ops.dots(said, [ops.some_place(said, rng) for _ in range(n)]))


@check(
    "7.3",
    "dots-cursor",
    "after DOTS the cursor is at its last voxel",
    feature("DOTS"),
    seen,
    voxels(2),
)
def dots_cursor(probe: Probe) -> None:
    said = probe.said
    places = [said.place(0), said.place(said.voxels - 1), said.place(1)]
    probe.show(ops.dots(said, places) + ops.pen(said, 0) + ops.run())
    probe.show(ops.skip(said.voxels) + ops.dots(said, places))

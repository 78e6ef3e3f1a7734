"""Checks of section 7.3: LINE, BOX and DOTS."""

from __future__ import annotations

import itertools

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.catalogue import check, feature, min_voxels, readable_display
from voxdisplay.conformance.checks.drawing import axis_of_two
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

_MAX_BOX_SIDE = 12


def axes_of_three_and_two(device: AnnouncedDevice) -> str:
    """Require an axis of at least three voxels, and another one of two."""
    a, b, _ = sorted(device.grid, reverse=True)
    return "" if a > 2 and b > 1 else "no axis of three voxels beside one of two"


def corners(device: AnnouncedDevice) -> list[Voxel]:
    """Return the corners of the grid."""
    xs, ys, zs = (sorted({0, side - 1}) for side in device.grid)
    return [(x, y, z) for z in zs for y in ys for x in xs]


@check(
    "7.3",
    "lines",
    "LINE draws the straight line, both ends included",
    feature("LINE"),
    readable_display,
    axis_of_two,
)
def lines(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for begin in corners(device):
        probe.show(ops.line(device, begin, ops.random_voxel(device, rng)))
    for _ in range(6):
        probe.show(ops.line(device, ops.random_voxel(device, rng), ops.random_voxel(device, rng)))
    probe.show(ops.line(device, (0, 0, 0), corners(device)[-1]))


@check(
    "7.3",
    "line-ties",
    "LINE rounds ties up, in both directions",
    feature("LINE"),
    readable_display,
    axes_of_three_and_two,
)
def line_ties(probe: Probe) -> None:
    device = probe.device
    for main, other in itertools.permutations(range(3), 2):
        if device.grid[main] < 3 or device.grid[other] < 2:
            continue
        length = 4 if device.grid[main] > 4 and device.grid[other] > 2 else 2
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
            probe.show(ops.line(device, a, b))
            probe.show(ops.line(device, b, a))


@check(
    "7.3",
    "line-of-one",
    "a LINE from a voxel to itself is one voxel",
    feature("LINE"),
    readable_display,
)
def line_of_one(probe: Probe) -> None:
    place = ops.random_voxel(probe.device, probe.rng)
    probe.show(ops.line(probe.device, place, place))


@check(
    "7.3",
    "shape-cursor",
    "after LINE and BOX the cursor is at the voxel that they name",
    readable_display,
    axis_of_two,
)
def shape_cursor(probe: Probe) -> None:
    device = probe.device
    end = tuple(min(side - 1, 4) for side in device.grid)
    erase = ops.pen(device, 0) + ops.run()
    for name, make in (("LINE", ops.line), ("BOX", ops.box)):
        if device.has(name):
            probe.show(make(device, (0, 0, 0), (end[0], end[1], end[2])) + erase)
            probe.show(make(device, (end[0], end[1], end[2]), (0, 0, 0)) + erase)


@check(
    "7.3",
    "boxes",
    "BOX fills the box between two corners, in either order",
    feature("BOX"),
    readable_display,
)
def boxes(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    base = ops.random_voxel(device, rng)
    for _ in range(10):
        probe.show(ops.box(device, base, ops.random_voxel_near(device, rng, base, _MAX_BOX_SIDE)))
    place = ops.random_voxel(device, rng)
    probe.show(ops.box(device, place, place))
    low = tuple(max(side - _MAX_BOX_SIDE, 0) for side in device.grid)
    probe.show(ops.box(device, corners(device)[-1], (low[0], low[1], low[2])))


@check("7.3", "dots", "DOTS writes 1 to 256 single voxels", feature("DOTS"), readable_display)
def dots(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    room = (device.max_payload - 2) // (3 * device.coordinate_bytes)
    for n in sorted({1, 2, 255, 256, min(room, spec.LIMIT_MAX_DOTS)}):
        if n <= min(room, spec.LIMIT_MAX_DOTS):
            probe.show(ops.dots(device, [ops.random_voxel(device, rng) for _ in range(n)]))


@check(
    "7.3",
    "dots-cursor",
    "after DOTS the cursor is at its last voxel",
    feature("DOTS"),
    readable_display,
    min_voxels(2),
)
def dots_cursor(probe: Probe) -> None:
    device = probe.device
    places = [device.voxel_at(0), device.voxel_at(device.voxel_count - 1), device.voxel_at(1)]
    probe.show(ops.dots(device, places) + ops.pen(device, 0) + ops.run())
    probe.show(ops.skip(device.voxel_count) + ops.dots(device, places))

"""Checks of section 7.11: range-coded slabs (op SLABS)."""

from __future__ import annotations

import random
from itertools import product
from math import prod

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.catalogue import check, feature, readable_display
from voxdisplay.conformance.checks.range_coded_chains import refusal_of
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.range_coded_slabs import Box, encode
from voxdisplay.wire import spec

_CELL = spec.SLABS_CELL
_MANY_CELLS = 1 << 16
_WIDEST = 1 << spec.SLABS_SIDE_BITS


def cells_of(device: AnnouncedDevice) -> list[int]:
    """Return the cells along each axis of the grid."""
    return [-(-side // _CELL) for side in device.grid]


def few_cells(device: AnnouncedDevice) -> str:
    """Require a grid of which a packet may name all cells."""
    x, y, z = cells_of(device)
    return "" if x * y * z <= _MANY_CELLS else f"more than {_MANY_CELLS} cells"


def random_box(device: AnnouncedDevice, rng: random.Random, widest: int = 4, slabs: int = 3) -> Box:
    """Return a box of random size within the grid's cells."""
    cells = cells_of(device)
    size = [
        rng.randint(1, min(most, n)) for most, n in zip((widest, widest, slabs), cells, strict=True)
    ]
    x, y, z = (rng.randint(0, n - own) for n, own in zip(cells, size, strict=True))
    return Box((x, y, z), *size)


def ball_in(device: AnnouncedDevice, box: Box, rng: random.Random, *, hollow: bool) -> set[Voxel]:
    """Return the voxels of a ball, or its shell, in a box, and some of noise."""
    sizes = (_CELL * box.w, _CELL * box.h, _CELL * box.slabs)
    begin = [_CELL * cell for cell in box.cell]
    center = [low + rng.uniform(0.3, 0.7) * size for low, size in zip(begin, sizes, strict=True)]
    radius = rng.uniform(0.3, 0.8) * max(sizes)
    found = set()
    ranges = [
        range(low, min(low + size, side))
        for low, size, side in zip(begin, sizes, device.grid, strict=True)
    ]
    for voxel in product(*ranges):
        far = sum((a - b) ** 2 for a, b in zip(voxel, center, strict=True)) ** 0.5
        if (abs(far - radius) < 0.7 if hollow else far < radius) != (rng.random() < 0.02):
            found.add((voxel[0], voxel[1], voxel[2]))
    return found


def random_boxes(device: AnnouncedDevice, rng: random.Random, slabs: int) -> list[Box]:
    """Return up to three random boxes that together have no more cells than the grid."""
    boxes = [random_box(device, rng, 2, slabs) for _ in range(3)]
    while sum(box.w * box.h * box.slabs for box in boxes) > prod(cells_of(device)):
        boxes.pop()
    return boxes


def wide_box(device: AnnouncedDevice, widest: int) -> Box:
    """Return a box of one slab on the last one of the grid, as wide as it may be."""
    cells = cells_of(device)
    total = prod(cells)
    w = min(widest, total)
    return Box((0, 0, cells[2] - 1), w, max(1, min(widest, total // w)), 1)


def fewer_cells(boxes: list[Box]) -> list[Box]:
    """Return boxes without the last slab, or without the last box, or half as wide a one."""
    *rest, last = boxes
    if last.slabs > 1:
        return [*rest, Box(last.cell, last.w, last.h, last.slabs - 1)]
    return rest or [Box(last.cell, max(1, last.w // 2), max(1, last.h // 2), 1)]


def encode_fitting(device: AnnouncedDevice, voxels: set[Voxel], boxes: list[Box]) -> bytes:
    """Return a SLABS of the first of these boxes, or of fewer slabs, so that it fits a packet."""
    while True:
        op = encode(device, voxels, boxes)
        if len(op) <= device.max_payload - 8:
            return op
        boxes = fewer_cells(boxes)


@check(
    "7.11",
    "slabs-dot",
    "a SLABS of one lit voxel writes it with the pen",
    feature("SLABS"),
    readable_display,
)
def slabs_dot(probe: Probe) -> None:
    device = probe.device
    for _ in range(4):
        place = ops.random_voxel(device, probe.rng)
        cell = (place[0] // _CELL, place[1] // _CELL, place[2] // _CELL)
        pen = ops.pen(device, ops.random_pixel(device, probe.rng))
        probe.show(pen + encode(device, {place}, [Box(cell, 1, 1, 1)]))


@check(
    "7.11",
    "slabs-empty",
    "a SLABS without a box, or of a blank one, draws nothing",
    feature("SLABS"),
    readable_display,
)
def slabs_empty(probe: Probe) -> None:
    probe.show(ops.run() + encode(probe.device, set(), []))
    probe.show(ops.run() + encode(probe.device, set(), [Box((0, 0, 0), 1, 1, 1)]))


@check(
    "7.11",
    "slabs-surfaces",
    "a SLABS draws shells of one and of several slabs",
    feature("SLABS"),
    readable_display,
)
def slabs_surfaces(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for _ in range(16):
        box = random_box(device, rng)
        voxels = ball_in(device, box, rng, hollow=True)
        probe.show(encode_fitting(device, voxels, [box]))


@check(
    "7.11",
    "slabs-solids",
    "a SLABS draws solids, whose cells may be full",
    feature("SLABS"),
    readable_display,
)
def slabs_solids(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for _ in range(8):
        box = random_box(device, rng)
        voxels = ball_in(device, box, rng, hollow=False)
        probe.show(encode_fitting(device, voxels, [box]))
    every = ball_in(device, Box((0, 0, 0), 1, 1, 2), random.Random(1), hollow=False)
    probe.show(encode_fitting(device, every, [Box((0, 0, 0), 1, 1, min(2, cells_of(device)[2]))]))


@check(
    "7.11",
    "slabs-boxes",
    "what other boxes or ops have written does not count in a box",
    feature("SLABS"),
    readable_display,
)
def slabs_boxes(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for _ in range(4):
        boxes = random_boxes(device, rng, 2)
        voxels = set().union(*(ball_in(device, box, rng, hollow=True) for box in boxes))
        probe.show(ops.run(min(7, device.voxel_count)) + encode_fitting(device, voxels, boxes))
    sides = cells_of(device)
    cells = list(product(*(range(min(2, n)) for n in sides)))[:2]
    boxes = [Box((x, y, z), 1, 1, 1) for x, y, z in cells]
    voxels = {place for box in boxes for place in ball_in(device, box, rng, hollow=False)}
    voxels = {place for place in voxels if sum(place) % 3}
    probe.show(encode_fitting(device, voxels, boxes))


@check(
    "7.11",
    "slabs-wide",
    "a SLABS may have boxes of 16 x 16 cells, also beyond the grid",
    feature("SLABS"),
    readable_display,
)
def slabs_wide(probe: Probe) -> None:
    device = probe.device
    box = wide_box(device, _WIDEST)
    lit = {place for place in ball_in(device, box, probe.rng, hollow=True) if sum(place) % 3}
    probe.show(encode_fitting(device, lit, [box]))


@check(
    "7.11",
    "slabs-cut",
    "a truncated SLABS is refused: TRUNCATED",
    feature("SLABS"),
)
def slabs_cut(probe: Probe) -> None:
    device = probe.device
    box = random_box(device, probe.rng)
    op = encode_fitting(device, ball_in(device, box, probe.rng, hollow=True), [box])
    for size in (1, 2, len(op) - 1):
        if size < len(op):
            refused = refusal_of(device, op[:size])
            if refused and refused.code == spec.CODE_TRUNCATED:
                probe.require_ops_refused(ops.run() + op[:size], refused.code, 1)


@check(
    "7.11",
    "slabs-too-many-bytes",
    "a SLABS with an extra byte is refused: PADDING",
    feature("SLABS"),
)
def slabs_too_many_bytes(probe: Probe) -> None:
    device = probe.device
    box = random_box(device, probe.rng)
    op = encode_fitting(device, ball_in(device, box, probe.rng, hollow=True), [box])
    probe.require_ops_refused(ops.run() + op + b"\0", spec.CODE_PADDING, 1)


@check(
    "7.11",
    "slabs-too-many-cells",
    "a SLABS with more cells than the grid has is refused: OUTSIDE",
    feature("SLABS"),
    few_cells,
)
def slabs_too_many_cells(probe: Probe) -> None:
    device = probe.device
    cells = cells_of(device)
    w, h = (min(_WIDEST, n) for n in cells[:2])
    most = cells[0] * cells[1] * cells[2] // (w * h)
    if device.is_readable:
        probe.show(ops.run() + encode(device, set(), [Box((0, 0, 0), w, h, most)]))
    probe.require_ops_refused(
        encode(device, set(), [Box((0, 0, 0), w, h, most + 1)]), spec.CODE_OUTSIDE
    )
    boxes = [Box((0, 0, 0), w, h, 1)] * (most + 1)
    op = encode(device, set(), boxes)
    if len(op) <= device.max_payload:
        probe.require_ops_refused(op, spec.CODE_OUTSIDE)


@check(
    "7.11",
    "slabs-off-the-grid",
    "a lit voxel of a SLABS off the grid is refused: OUTSIDE",
    feature("SLABS"),
)
def slabs_off_the_grid(probe: Probe) -> None:
    device = probe.device
    cells = cells_of(device)
    for axis, side in enumerate(device.grid):
        off = [0, 0, 0]
        off[axis] = side
        cell = [0, 0, 0]
        cell[axis] = side // _CELL
        fits = side // _CELL < 1 << (cells[axis] - 1).bit_length()
        if fits:
            voxels = {(off[0], off[1], off[2])}
            op = encode(device, voxels, [Box((cell[0], cell[1], cell[2]), 1, 1, 1)])
            probe.require_ops_refused(op, spec.CODE_OUTSIDE)
        elif axis == 2:
            voxels = {(0, 0, side)}
            box = Box((0, 0, cells[2] - 1), 1, 1, 2)
            if cells[0] * cells[1] * cells[2] > 1:
                op = encode(device, voxels, [box])
                probe.require_ops_refused(op, spec.CODE_OUTSIDE)

"""Checks of section 7.13: range-coded pixels (op VALUES)."""

from __future__ import annotations

import random

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.catalogue import check, feature, readable_display
from voxdisplay.conformance.checks.range_coded_chains import refusal_of
from voxdisplay.conformance.checks.range_coded_slabs import (
    ball_in,
    cells_of,
    few_cells,
    fewer_cells,
    random_box,
    random_boxes,
    wide_box,
)
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.range_coded_slabs import Box
from voxdisplay.conformance.range_coded_values import Pixels, Switches, encode, levels_of, tops
from voxdisplay.wire import spec

_CELL = spec.SLABS_CELL
_WIDEST = 1 << spec.VALUES_SIDE_BITS
_PLAIN = Switches()
_WEIGHTS = (58, 58, 58, -53, -52, -53, 47)  # those of a smooth volume


def gradient(
    device: AnnouncedDevice, voxels: set[Voxel], rng: random.Random, *, step: float, noise: int = 0
) -> Pixels:
    """Return the pixels of voxels by a gradient with so much noise, none of them dark."""
    top = tops(device)
    slopes = [[rng.uniform(-step, step) for _ in range(3)] for _ in top]
    base = [rng.randint(0, level) for level in top]
    pixels: Pixels = {}
    for voxel in sorted(voxels):
        levels = [
            start + int(sum(a * b for a, b in zip(slope, voxel, strict=True)))
            for start, slope in zip(base, slopes, strict=True)
        ]
        levels = [level + rng.randint(-noise, noise) for level in levels]
        pixel = tuple(min(max(a, 0), most) for a, most in zip(levels, top, strict=True))
        pixels[voxel] = pixel if any(pixel) else top
    return pixels


def encode_fitting(
    device: AnnouncedDevice, pixels: Pixels, boxes: list[Box], switches: Switches = _PLAIN
) -> bytes:
    """Return a VALUES of these boxes, or of fewer or smaller ones, so that it fits a packet."""
    while True:
        op = encode(device, pixels, boxes, switches)
        if len(op) <= device.max_payload - 8:
            return op
        fewer = fewer_cells(boxes)
        if fewer == boxes:  # one cell
            pixels = dict(list(pixels.items())[: len(pixels) // 2])
        boxes = fewer


def show_bodies(
    probe: Probe, switches: Switches, *, step: float, noise: int = 0, times: int = 4
) -> None:
    """Show shells and solids with pixels by gradients."""
    device, rng = probe.device, probe.rng
    for number in range(times):
        box = random_box(device, rng, 3, 2)
        voxels = ball_in(device, box, rng, hollow=number % 2 == 0)
        pixels = gradient(device, voxels, rng, step=step, noise=noise)
        probe.show(encode_fitting(device, pixels, [box], switches))


@check(
    "7.13",
    "values-dot",
    "a VALUES of one lit voxel writes its pixel",
    feature("VALUES"),
    readable_display,
)
def values_dot(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for switches in (Switches(), Switches(copies=1), Switches(weights=_WEIGHTS)):
        place = ops.random_voxel(device, rng)
        cell = (place[0] // _CELL, place[1] // _CELL, place[2] // _CELL)
        pixel = levels_of(device, rng.randint(1, device.full_pixel))
        probe.show(encode(device, {place: pixel}, [Box(cell, 1, 1, 1)], switches))


@check(
    "7.13",
    "values-empty",
    "a VALUES without a box draws nothing",
    feature("VALUES"),
    readable_display,
)
def values_empty(probe: Probe) -> None:
    for switches in (Switches(), Switches(1, _WEIGHTS)):
        probe.show(ops.run() + encode(probe.device, {}, [], switches))


@check(
    "7.13",
    "values-smooth",
    "a VALUES draws bodies whose pixels change slowly",
    feature("VALUES"),
    readable_display,
)
def values_smooth(probe: Probe) -> None:
    show_bodies(probe, Switches(), step=1.5, noise=1)


@check(
    "7.13",
    "values-rough",
    "a VALUES draws bodies whose pixels differ much, by residuals of any size",
    feature("VALUES"),
    readable_display,
)
def values_rough(probe: Probe) -> None:
    show_bodies(probe, Switches(), step=40, noise=9)
    show_bodies(probe, Switches(), step=0, noise=255, times=2)


@check(
    "7.13",
    "values-copies",
    "a VALUES with copies draws bodies of few colours",
    feature("VALUES"),
    readable_display,
)
def values_copies(probe: Probe) -> None:
    show_bodies(probe, Switches(copies=1), step=0.3)
    show_bodies(probe, Switches(copies=1), step=3, noise=1, times=2)


@check(
    "7.13",
    "values-weighted",
    "a VALUES with weights predicts by seven neighbours",
    feature("VALUES"),
    readable_display,
)
def values_weighted(probe: Probe) -> None:
    show_bodies(probe, Switches(weights=_WEIGHTS), step=2)
    weights = tuple(probe.rng.randint(-64, 63) for _ in _WEIGHTS)
    show_bodies(probe, Switches(copies=1, weights=weights), step=2, noise=3, times=2)


@check(
    "7.13",
    "values-boxes",
    "what is remembered of pixels is forgotten with each box",
    feature("VALUES"),
    readable_display,
)
def values_boxes(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for switches in (Switches(), Switches(copies=1), Switches(weights=_WEIGHTS)):
        boxes = random_boxes(device, rng, 1)
        voxels = set().union(*(ball_in(device, box, rng, hollow=False) for box in boxes))
        pixels = gradient(device, voxels, rng, step=2, noise=2)
        probe.show(
            ops.run(min(7, device.voxel_count)) + encode_fitting(device, pixels, boxes, switches)
        )


@check(
    "7.13",
    "values-wide",
    "a VALUES may have boxes of 8 x 8 cells, also beyond the grid",
    feature("VALUES"),
    readable_display,
)
def values_wide(probe: Probe) -> None:
    device = probe.device
    box = wide_box(device, _WIDEST)
    lit = {place for place in ball_in(device, box, probe.rng, hollow=True) if sum(place) % 3}
    pixels = gradient(device, lit, probe.rng, step=0.5)
    op = encode(device, pixels, [box], Switches(copies=1))
    if len(op) <= device.max_payload:
        probe.show(op)


@check(
    "7.13",
    "values-cut",
    "a truncated VALUES is refused: TRUNCATED",
    feature("VALUES"),
)
def values_cut(probe: Probe) -> None:
    device = probe.device
    box = random_box(device, probe.rng, 2, 1)
    voxels = ball_in(device, box, probe.rng, hollow=True)
    op = encode_fitting(device, gradient(device, voxels, probe.rng, step=3), [box])
    for size in (1, 2, len(op) - 1):
        refused = refusal_of(device, op[:size]) if size < len(op) else None
        if refused and refused.code == spec.CODE_TRUNCATED:
            probe.require_ops_refused(ops.run() + op[:size], refused.code, 1)


@check(
    "7.13",
    "values-too-many-bytes",
    "a VALUES with an extra byte is refused: PADDING",
    feature("VALUES"),
)
def values_too_many_bytes(probe: Probe) -> None:
    device = probe.device
    box = random_box(device, probe.rng, 2, 1)
    voxels = ball_in(device, box, probe.rng, hollow=True)
    op = encode_fitting(device, gradient(device, voxels, probe.rng, step=3), [box])
    probe.require_ops_refused(ops.run() + op + b"\0", spec.CODE_PADDING, 1)


@check(
    "7.13",
    "values-too-many-cells",
    "a VALUES with more cells than the grid has is refused: OUTSIDE",
    feature("VALUES"),
    few_cells,
)
def values_too_many_cells(probe: Probe) -> None:
    device = probe.device
    cells = cells_of(device)
    w, h = (min(_WIDEST, n) for n in cells[:2])
    most = cells[0] * cells[1] * cells[2] // (w * h)
    blank = [Box((0, 0, 0), w, h, count) for count in (most, most + 1)]
    if device.is_readable:
        probe.show(ops.run() + encode(device, {}, blank[:1], Switches()))
    op = encode(device, {}, blank[1:], Switches())
    probe.require_ops_refused(op, spec.CODE_OUTSIDE)


@check(
    "7.13",
    "values-off-the-grid",
    "a lit voxel of a VALUES off the grid is refused: OUTSIDE, before any pixel of its slab",
    feature("VALUES"),
)
def values_off_the_grid(probe: Probe) -> None:
    device = probe.device
    nz = device.nz
    if nz % _CELL:
        cell = (0, 0, nz // _CELL)
        dark = tuple(0 for _ in tops(device))
        pixels = {(0, 0, nz // _CELL * _CELL): dark, (0, 0, nz): tops(device)}
        op = encode(device, pixels, [Box(cell, 1, 1, 1)], Switches())
        probe.require_ops_refused(op, spec.CODE_OUTSIDE)
    elif cells_of(device)[0] * cells_of(device)[1] * (nz // _CELL) > 1:
        op = encode(
            device, {(0, 0, nz): tops(device)}, [Box((0, 0, nz // _CELL - 1), 1, 1, 2)], Switches()
        )
        probe.require_ops_refused(op, spec.CODE_OUTSIDE)


@check(
    "7.13",
    "values-no-pixel",
    "a level above the highest, or below 0, and a dark pixel are refused: PIXEL",
    feature("VALUES"),
)
def values_no_pixel(probe: Probe) -> None:
    device = probe.device
    top = tops(device)
    wrong = [tuple(0 for _ in top)]
    for channel, level in enumerate(top):
        wrong += [
            tuple(beyond if n == channel else most for n, most in enumerate(top))
            for beyond in (level + 1, -1)
        ]
    for pixel in wrong:
        op = encode(device, {(0, 0, 0): pixel}, [Box((0, 0, 0), 1, 1, 1)], Switches())
        probe.require_ops_refused(ops.run() + op, spec.CODE_PIXEL, 1)


@check(
    "7.13",
    "values-levels",
    "a VALUES reaches the lowest and the highest level of each channel",
    feature("VALUES"),
    readable_display,
)
def values_levels(probe: Probe) -> None:
    device = probe.device
    top = tops(device)
    nx, ny, _ = device.grid
    voxels = [(x, y, 0) for y in range(min(ny, _CELL)) for x in range(min(nx, _CELL))]
    extremes = [
        top,
        *(tuple(most if n == k else 0 for n, most in enumerate(top)) for k in range(len(top))),
    ]
    if len(top) == 1:
        extremes.append((1,))
    pixels = {voxel: probe.rng.choice(extremes) for voxel in voxels}
    for switches in (Switches(), Switches(weights=_WEIGHTS)):
        probe.show(encode_fitting(device, pixels, [Box((0, 0, 0), 1, 1, 1)], switches))

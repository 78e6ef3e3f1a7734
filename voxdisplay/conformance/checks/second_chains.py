"""Checks of section 7.10: range-coded chains with fades and near starts (op ARC2)."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.catalogue import check, feature, min_voxels, readable_display
from voxdisplay.conformance.checks.drawing import axis_of_two
from voxdisplay.conformance.checks.range_coded_chains import random_walk
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.range_coded_chains import Encoder, number
from voxdisplay.conformance.second_chains import FadeInk, InkedPiece, encode, morton
from voxdisplay.wire import spec


def colored(device: AnnouncedDevice) -> str:
    """Require a format that has fades."""
    return "" if device.format != spec.FORMAT_MONO1 else "mono1 has no fades"


def near_grid(device: AnnouncedDevice) -> str:
    """Require a grid that has Morton indices."""
    return "" if max(device.grid) <= spec.ARC2_MAX_SIDE else "the grid has a side above 1024"


def fitting(device: AnnouncedDevice, pieces: list[InkedPiece]) -> bytes:
    """Return an ARC2 of as many of these pieces as fit a packet behind a few bytes."""
    while True:
        op = encode(device, pieces)
        if len(op) <= device.max_payload - 24 or len(pieces) == 1:
            return op
        pieces = pieces[:-1]


@check(
    "7.10",
    "arc2-starts",
    "pieces of an ARC2 begin near the one before in Morton order, or anywhere",
    feature("ARC2"),
    readable_display,
    axis_of_two,
)
def arc2_starts(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for near in (True, False):
        for _ in range(4):
            walks = [tuple(random_walk(device, rng, rng.randint(0, 4), 0.8)) for _ in range(6)]
            if near:
                walks.sort(key=lambda walk: morton(walk[0]))
            probe.show(ops.run() + fitting(device, [InkedPiece(walk) for walk in walks]))


@check(
    "7.10",
    "arc2-pens",
    "pieces of an ARC2 have pens of their own, or that of the piece before",
    feature("ARC2"),
    readable_display,
    axis_of_two,
)
def arc2_pens(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for _ in range(4):
        walk = random_walk(device, rng, 9, 0.7)
        value = ops.random_pixel(device, rng)
        pieces = [
            InkedPiece(tuple(walk[:4])),
            InkedPiece(tuple(walk[4:7]), value, jump=False),
            InkedPiece(tuple(walk[7:])),
        ]
        probe.show(ops.pen(device, 1) + fitting(device, pieces))


@check(
    "7.10",
    "arc2-fades",
    "each voxel of an ARC2 has the pen of its place in a fade, over all its pieces",
    feature("ARC2"),
    readable_display,
    colored,
    axis_of_two,
)
def arc2_fades(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for _ in range(6):
        walk = random_walk(device, rng, 9, 0.7)
        count = rng.choice([3, 9, 40])
        ink = FadeInk(ops.random_stops(rng)[:3], count, rng.randrange(count))
        pieces = [
            InkedPiece(tuple(walk[:4]), ink),
            InkedPiece(tuple(walk[4:7]), jump=False),
            InkedPiece(tuple(walk[7:])),
            InkedPiece((ops.random_voxel(device, rng),), ops.random_pixel(device, rng)),
        ]
        probe.show(fitting(device, pieces))


@check(
    "7.10",
    "arc2-fade-before",
    "a FADE goes on in the ARC2 behind it",
    feature("ARC2"),
    feature("FADE"),
    readable_display,
    axis_of_two,
)
def arc2_fade_before(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    walk = tuple(random_walk(device, rng, 5, 0.7))
    fade = ops.fade(device, [b"\xff\2\7", b"\0\xfa\x40"], 9, 2)
    probe.show(fade + fitting(device, [InkedPiece(walk)]))


@check(
    "7.10",
    "arc2-refused",
    "an ARC2 that is truncated or has an extra byte is refused",
    feature("ARC2"),
    min_voxels(2),
)
def arc2_refused(probe: Probe) -> None:
    device = probe.device
    op = encode(device, [InkedPiece((ops.random_voxel(device, probe.rng),)) for _ in range(3)])
    probe.require_ops_refused(ops.run() + op + b"\0", spec.CODE_PADDING, 1)
    probe.require_ops_refused(ops.run() + op[:1], spec.CODE_TRUNCATED, 1)


@check(
    "7.10",
    "arc2-fade-refused",
    "an ARC2 with a fade that begins behind its end is refused: COUNT",
    feature("ARC2"),
    colored,
)
def arc2_fade_refused(probe: Probe) -> None:
    place = ops.random_voxel(probe.device, probe.rng)
    op = encode(probe.device, [InkedPiece((place,), FadeInk([b"\1\2\3"], 5, 5))])
    probe.require_ops_refused(op, spec.CODE_COUNT)


@check(
    "7.10",
    "arc2-outside",
    "an ARC2 whose start is beyond all grids that have Morton indices is refused: OUTSIDE",
    feature("ARC2"),
    near_grid,
)
def arc2_outside(probe: Probe) -> None:
    coder = Encoder()
    for model, bit in ((spec.ARC_MORE, 1), (spec.ARC_INK, 0)):
        coder.bit(model, want=bit)
    for side in probe.device.grid:
        coder.plain((side - 1).bit_length(), side - 1)
    number(coder)
    for model, bit in (
        (spec.ARC_MORE, 1),
        (spec.ARC_JUMP, 1),
        (spec.ARC_INK, 0),
        (spec.ARC2_NEAR, 1),
    ):
        coder.bit(model, want=bit)
    number(coder, 1 << 30, spec.ARC2_DELTA, spec.ARC2_MAX_DELTA)
    number(coder)
    coder.bit(spec.ARC_MORE)
    probe.require_ops_refused(bytes((spec.OP_ARC2,)) + coder.end(), spec.CODE_OUTSIDE)

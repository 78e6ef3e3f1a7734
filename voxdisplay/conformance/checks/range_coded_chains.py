"""Checks of section 7.7: range-coded chains (op ARC)."""

from __future__ import annotations

import random

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.catalogue import check, feature, readable_display
from voxdisplay.conformance.checks.drawing import axis_of_two
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.range_coded_chains import Piece, encode
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec


def random_walk(
    device: AnnouncedDevice, rng: random.Random, steps: int, steady: float
) -> list[Voxel]:
    """Return a random 26-connected walk; ``steady`` is the chance that an axis keeps its step."""
    at = list(ops.random_voxel(device, rng))
    way = [rng.choice((-1, 0, 1)) for _ in range(3)]
    places = [(at[0], at[1], at[2])]
    while len(places) <= steps:
        for axis, side in enumerate(device.grid):
            if rng.random() > steady:
                way[axis] = rng.choice((-1, 0, 1))
            if not 0 <= at[axis] + way[axis] < side:
                way[axis] = -way[axis] if side > 1 else 0
        if not any(way):
            movable = [axis for axis, side in enumerate(device.grid) if side > 1]
            axis = rng.choice(movable)
            way[axis] = 1 if at[axis] + 1 < device.grid[axis] else -1
        at = [a + d for a, d in zip(at, way, strict=True)]
        places.append((at[0], at[1], at[2]))
    return places


def refusal_of(device: AnnouncedDevice, op: bytes) -> Refused | None:
    """Return the refusal of an op by the reference decoder; None if it is valid."""
    try:
        ReferenceDecoder(device, Page()).draw(op)
    except Refused as refused:
        return refused
    return None


def encode_fitting(device: AnnouncedDevice, places: list[Voxel], pen: int | None = None) -> bytes:
    """Return an ARC of the first of these voxels, as many as fit a packet."""
    while True:
        op = encode(device, [Piece(tuple(places), pen)])
        if len(op) <= device.max_payload:
            return op
        places = places[: len(places) * 3 // 4]


@check(
    "7.7",
    "arc-dot",
    "an ARC of one piece without steps is one voxel",
    feature("ARC"),
    readable_display,
)
def arc_dot(probe: Probe) -> None:
    for _ in range(4):
        probe.show(encode(probe.device, [Piece((ops.random_voxel(probe.device, probe.rng),))]))


@check("7.7", "arc-empty", "an ARC without a piece draws nothing", feature("ARC"), readable_display)
def arc_empty(probe: Probe) -> None:
    probe.show(ops.run() + encode(probe.device, []))


@check(
    "7.7",
    "arc-curves",
    "an ARC draws curves of few and many turns",
    feature("ARC"),
    readable_display,
    axis_of_two,
)
def arc_curves(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for steady in (1.0, 0.95, 0.8, 0.5, 0.0):
        for steps in (1, 5, 60, 700):
            pen = rng.choice([None, ops.random_pixel(device, rng)])
            probe.show(encode_fitting(device, random_walk(device, rng, steps, steady), pen))


@check(
    "7.7",
    "arc-pieces",
    "pieces of an ARC jump or continue, each with its own pen",
    feature("ARC"),
    readable_display,
    axis_of_two,
)
def arc_pieces(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    for _ in range(6):
        places = random_walk(device, rng, 24, 0.8)
        value = ops.random_pixel(device, rng)
        pieces = [
            Piece(tuple(places[:9])),
            Piece(tuple(places[9:15]), value, jump=False),
            Piece(tuple(random_walk(device, rng, 6, 0.9))),
            Piece((ops.random_voxel(device, rng),), 1),
        ]
        op = encode(device, pieces)
        while len(op) > device.max_payload - 4:
            pieces.pop()
            op = encode(device, pieces)
        probe.show(ops.pen(device, 1) + op)


@check(
    "7.7",
    "arc-behind-ops",
    "other ops may come before an ARC, which keeps their pen",
    feature("ARC"),
    readable_display,
)
def arc_behind_ops(probe: Probe) -> None:
    device = probe.device
    place = ops.random_voxel(device, probe.rng)
    value = ops.random_pixel(device, probe.rng)
    probe.show(
        ops.pen(device, value) + ops.skip(device.voxel_count) + encode(device, [Piece((place,))])
    )


@check(
    "7.7",
    "arc-long",
    "run lengths and models of an ARC saturate as specified",
    feature("ARC"),
    readable_display,
    axis_of_two,
)
def arc_long(probe: Probe) -> None:
    device = probe.device
    main, other, _ = sorted(range(3), key=lambda axis: -device.grid[axis])
    at = [0, 0, 0]
    way, places = 1, [(0, 0, 0)]
    for step in range(1, 1700):
        if not 0 <= at[main] + way < device.grid[main]:
            way = -way
        at[main] += way
        if step % 280 == 0 and device.grid[other] > 1:  # longer than the longest run that counts
            at[other] ^= 1
        places.append((at[0], at[1], at[2]))
    probe.show(encode_fitting(device, places))


@check(
    "7.7",
    "arc-cut",
    "a truncated ARC is refused: TRUNCATED",
    feature("ARC"),
    axis_of_two,
)
def arc_cut(probe: Probe) -> None:
    device = probe.device
    op = encode_fitting(device, random_walk(device, probe.rng, 60, 0.6))
    for size in (1, 2, len(op) - 1):
        if size < len(op):
            refused = refusal_of(device, op[:size])
            if refused:
                probe.require_ops_refused(ops.run() + op[:size], refused.code, 1)


@check(
    "7.7",
    "arc-too-many",
    "an ARC with an extra byte is refused: PADDING",
    feature("ARC"),
    axis_of_two,
)
def arc_too_many(probe: Probe) -> None:
    device = probe.device
    op = encode_fitting(device, random_walk(device, probe.rng, 30, 0.6))[: device.max_payload - 2]
    probe.require_ops_refused(ops.run() + op + b"\0", spec.CODE_PADDING, 1)


@check(
    "7.7",
    "arc-off-the-grid",
    "an ARC that starts or leads off the grid is refused: OUTSIDE",
    feature("ARC"),
)
def arc_off_the_grid(probe: Probe) -> None:
    device = probe.device
    for axis, side in enumerate(device.grid):
        place = [0, 0, 0]
        place[axis] = side
        if side < 1 << (side - 1).bit_length():
            op = encode(device, [Piece(((place[0], place[1], place[2]),))])
            probe.require_ops_refused(op, spec.CODE_OUTSIDE)
        place[axis] = side - 1
        off = list(place)
        off[axis] = side
        places = ((place[0], place[1], place[2]), (off[0], off[1], off[2]))
        probe.require_ops_refused(encode(device, [Piece(places)]), spec.CODE_OUTSIDE)
        off[axis], place[axis] = -1, 0
        places = ((place[0], place[1], place[2]), (off[0], off[1], off[2]))
        probe.require_ops_refused(encode(device, [Piece(places)]), spec.CODE_OUTSIDE)

"""Section 7.7: ARC, range-coded chains."""

from __future__ import annotations

import random

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced import Said
from voxdisplay.conformance.catalogue import check, feature, seen
from voxdisplay.conformance.checks.drawing import long_axis
from voxdisplay.conformance.probe import Probe
from voxdisplay.conformance.range_coded_chains import Piece, encode
from voxdisplay.conformance.reference_decoder import Decoder, Place, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec


def walk(said: Said, rng: random.Random, steps: int, steady: float) -> list[Place]:
    """Give places side by side: the steadier, the seldomer they turn."""
    at = list(ops.some_place(said, rng))
    way = [rng.choice((-1, 0, 1)) for _ in range(3)]
    places = [(at[0], at[1], at[2])]
    while len(places) <= steps:
        for axis, side in enumerate(said.grid):
            if rng.random() > steady:
                way[axis] = rng.choice((-1, 0, 1))
            if not 0 <= at[axis] + way[axis] < side:
                way[axis] = -way[axis] if side > 1 else 0
        if not any(way):
            movable = [axis for axis, side in enumerate(said.grid) if side > 1]
            axis = rng.choice(movable)
            way[axis] = 1 if at[axis] + 1 < said.grid[axis] else -1
        at = [a + d for a, d in zip(at, way, strict=True)]
        places.append((at[0], at[1], at[2]))
    return places


def verdict(said: Said, op: bytes) -> Refused | None:
    """Say why an op is refused, if it is."""
    try:
        Decoder(said, Page()).draw(op)
    except Refused as refused:
        return refused
    return None


def fitting(said: Said, places: list[Place], pen: int | None = None) -> bytes:
    """Give an ARC of as many of the places as fit a packet."""
    while True:
        op = encode(said, [Piece(tuple(places), pen)])
        if len(op) <= said.max_payload:
            return op
        places = places[: len(places) * 3 // 4]


@check("7.7", "arc-dot", "an ARC of one piece without steps is one voxel", feature("ARC"), seen)
def arc_dot(probe: Probe) -> None:
    for _ in range(4):
        probe.show(encode(probe.said, [Piece((ops.some_place(probe.said, probe.rng),))]))


@check("7.7", "arc-empty", "an ARC without a piece draws nothing", feature("ARC"), seen)
def arc_empty(probe: Probe) -> None:
    probe.show(ops.run() + encode(probe.said, []))


@check("7.7", "arc-curves", "an ARC draws the steps of its piece", feature("ARC"), seen, long_axis)
def arc_curves(probe: Probe) -> None:
    said, rng = probe.said, probe.rng
    for steady in (1.0, 0.95, 0.8, 0.5, 0.0):
        for steps in (1, 5, 60, 700):
            pen = rng.choice([None, ops.some_value(said, rng)])
            probe.show(fitting(said, walk(said, rng, steps, steady), pen))


@check(
    "7.7", "arc-pieces", "pieces jump or go on, each with its pen", feature("ARC"), seen, long_axis
)
def arc_pieces(probe: Probe) -> None:
    said, rng = probe.said, probe.rng
    for _ in range(6):
        places = walk(said, rng, 24, 0.8)
        value = ops.some_value(said, rng)
        pieces = [
            Piece(tuple(places[:9])),
            Piece(tuple(places[9:15]), value, jump=False),
            Piece(tuple(walk(said, rng, 6, 0.9))),
            Piece((ops.some_place(said, rng),), 1),
        ]
        op = encode(said, pieces)
        while len(op) > said.max_payload - 4:
            pieces.pop()
            op = encode(said, pieces)
        probe.show(ops.pen(said, 1) + op)


@check(
    "7.7",
    "arc-behind-ops",
    "other ops may come before it, and their pen holds",
    feature("ARC"),
    seen,
)
def arc_behind_ops(probe: Probe) -> None:
    said = probe.said
    place = ops.some_place(said, probe.rng)
    value = ops.some_value(said, probe.rng)
    probe.show(ops.pen(said, value) + ops.skip(said.voxels) + encode(said, [Piece((place,))]))


@check(
    "7.7", "arc-long", "memory and models hold out over long runs", feature("ARC"), seen, long_axis
)
def arc_long(probe: Probe) -> None:
    said = probe.said
    main, other, _ = sorted(range(3), key=lambda axis: -said.grid[axis])
    at = [0, 0, 0]
    way, places = 1, [(0, 0, 0)]
    for step in range(1, 1700):
        if not 0 <= at[main] + way < said.grid[main]:
            way = -way
        at[main] += way
        if step % 280 == 0 and said.grid[other] > 1:  # longer than the longest run that counts
            at[other] ^= 1
        places.append((at[0], at[1], at[2]))
    probe.show(fitting(said, places))


@check(
    "7.7",
    "arc-cut",
    "an ARC that needs more bytes is refused: TRUNCATED",
    feature("ARC"),
    long_axis,
)
def arc_cut(probe: Probe) -> None:
    said = probe.said
    op = fitting(said, walk(said, probe.rng, 60, 0.6))
    for size in (1, 2, len(op) - 1):
        if size < len(op):
            refused = verdict(said, op[:size])
            if refused:
                probe.refuse_ops(ops.run() + op[:size], refused.code, 1)


@check(
    "7.7",
    "arc-too-many",
    "an ARC with a byte too many is refused: PADDING",
    feature("ARC"),
    long_axis,
)
def arc_too_many(probe: Probe) -> None:
    said = probe.said
    op = fitting(said, walk(said, probe.rng, 30, 0.6))[: said.max_payload - 2]
    probe.refuse_ops(ops.run() + op + b"\0", spec.CODE_PADDING, 1)


@check(
    "7.7", "arc-off-the-grid", "an ARC that begins or leads off the grid is refused", feature("ARC")
)
def arc_off_the_grid(probe: Probe) -> None:
    said = probe.said
    for axis, side in enumerate(said.grid):
        place = [0, 0, 0]
        place[axis] = side
        if side < 1 << (side - 1).bit_length():
            op = encode(said, [Piece(((place[0], place[1], place[2]),))])
            probe.refuse_ops(op, spec.CODE_OUTSIDE)
        place[axis] = side - 1
        off = list(place)
        off[axis] = side
        places = ((place[0], place[1], place[2]), (off[0], off[1], off[2]))
        probe.refuse_ops(encode(said, [Piece(places)]), spec.CODE_OUTSIDE)
        off[axis], place[axis] = -1, 0
        places = ((place[0], place[1], place[2]), (off[0], off[1], off[2]))
        probe.refuse_ops(encode(said, [Piece(places)]), spec.CODE_OUTSIDE)

"""Section 2 and sections 7 to 7.2: the ops that every device has."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced import Said
from voxdisplay.conformance.catalogue import check, formats, seen, voxels
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

# Around every place where a count takes one more byte.
_COUNTS = (1, 2, 30, 31, 32, 33, 34, 95, 96, 159, 160, 161, 287, 288, 16415, 16416, 16417)
_COLORED = (spec.FORMAT_INDEX8, spec.FORMAT_RGB565, spec.FORMAT_RGB888)


def long_axis(said: Said) -> str:
    """Need an axis of two voxels at least."""
    return "" if max(said.grid) > 1 else "no axis has more than one voxel"


@check(
    "2",
    "scan-order",
    "x runs fastest, then y, then z; coordinates come as x, y, z",
    seen,
    voxels(2),
)
def scan_order(probe: Probe) -> None:
    said = probe.said
    ends = [(said.nx - 1, 0, 0), (0, said.ny - 1, 0), (0, 0, said.nz - 1)]
    probe.show(b"".join(ops.move(said, place) + ops.run() for place in ends))
    for end in ends:
        probe.show(ops.move(said, end) + ops.run())
    far = [side - 1 for side in said.grid]
    for axis in range(3):
        place = list(far)
        place[axis] = said.grid[axis] // 2
        probe.show(ops.move(said, place) + ops.run())


@check(
    "2.1",
    "pixels",
    "a pixel's bytes come lowest first, and all its bits count",
    seen,
    formats(*_COLORED),
)
def pixels(probe: Probe) -> None:
    said = probe.said
    for bit in range(8 * said.pixel_bytes):
        probe.show(ops.pen(said, 1 << bit) + ops.run())
    probe.show(ops.pen(said, int.from_bytes(bytes(range(1, 1 + said.pixel_bytes)))) + ops.run())
    probe.show(ops.literal(said, [said.full - 1]))


@check("7", "begins-at-0", "at the start of a packet the cursor is 0 and the pen is full", seen)
def begins_at_0(probe: Probe) -> None:
    probe.show(ops.run())


@check("7", "each-packet-anew", "a packet depends on none before it", seen, voxels(3))
def each_packet_anew(probe: Probe) -> None:
    said = probe.said
    probe.show(ops.skip(2) + ops.pen(said, 1) + ops.run(), ops.run())
    probe.show(ops.run() + ops.literal(said, [0]), ops.run(3))


@check("7", "pen", "PEN sets the pen, to dark too", seen, voxels(3))
def pen(probe: Probe) -> None:
    said = probe.said
    values = [ops.some_value(said, probe.rng) for _ in range(3)]
    probe.show(b"".join(ops.pen(said, value) + ops.run() for value in values))
    probe.show(ops.skip(1) + ops.pen(said, 0) + ops.run(), clear=False)


@check("7", "move", "MOVE sets the cursor", seen)
def move(probe: Probe) -> None:
    said = probe.said
    places = [ops.some_place(said, probe.rng) for _ in range(12)]
    places += [(0, 0, 0), (said.nx - 1, said.ny - 1, said.nz - 1)]
    drawn = [
        ops.move(said, place) + ops.pen(said, ops.some_value(said, probe.rng)) + ops.run()
        for place in places
    ]
    probe.show(*ops.cut(said, drawn))


@check("7", "end", "END ends the ops; what follows is 00", seen)
def end(probe: Probe) -> None:
    probe.show(ops.run() + ops.END)
    probe.show(ops.run() + ops.END + bytes(7))
    probe.show(ops.END)


@check("7", "later-counts", "within one packet the later write counts", seen)
def later_counts(probe: Probe) -> None:
    said = probe.said
    back = ops.move(said, (0, 0, 0))
    probe.show(ops.run() + back + ops.pen(said, 1) + ops.run())
    probe.show(ops.run() + back + ops.pen(said, 0) + ops.run())


@check(
    "7.1", "octants", "each of the 24 octants has its main axis and its directions", seen, long_axis
)
def octants(probe: Probe) -> None:
    said = probe.said
    for octant in range(spec.LIMIT_MAX_OCTANT + 1):
        found = ops.some_chain(said, probe.rng, octant)
        if found:
            start, crumbs = found
            probe.show(ops.move(said, start) + ops.chain(said, octant, crumbs))


@check("7.1", "from", "FROM is MOVE and STEP in one", seen, long_axis)
def from_(probe: Probe) -> None:
    said = probe.said
    drawn = []
    for octant in range(spec.LIMIT_MAX_OCTANT + 1):
        found = ops.some_chain(said, probe.rng, octant, 12)
        if found:
            drawn.append(ops.chain(said, octant, found[1], found[0]))
    probe.show(*ops.cut(said, drawn))


@check("7.1", "chain-lengths", "a chain has 1 to 256 steps, four to a byte", seen, long_axis)
def chain_lengths(probe: Probe) -> None:
    said = probe.said
    main = said.grid.index(max(said.grid))
    room = (said.max_payload - 20) * 4
    longest = min(said.grid[main] - 1, spec.LIMIT_MAX_STEPS, room)
    for steps in sorted({1, 2, 3, 4, 5, 7, 8, 9, longest - 1, longest}):
        if 1 <= steps <= longest:
            probe.show(ops.chain(said, 8 * main, [0] * steps))


@check("7.1", "chain-cursor", "after a chain the cursor is at its last voxel", seen, long_axis)
def chain_cursor(probe: Probe) -> None:
    said = probe.said
    main = said.grid.index(max(said.grid))
    steps = min(5, said.grid[main] - 1)
    erase = ops.pen(said, 0) + ops.run()
    probe.show(ops.chain(said, 8 * main, [0] * steps) + erase)
    probe.show(ops.chain(said, 8 * main, [0] * steps, (0, 0, 0)) + erase)
    back = 8 * main + (1 << main)
    probe.show(ops.chain(said, 8 * main, [0] * steps) + ops.chain(said, back, [0] * steps) + erase)


@check("7.2", "counts", "a count is c + 1, and from 32 on 32 + LEB128", seen)
def counts(probe: Probe) -> None:
    said = probe.said
    for n in _COUNTS:
        if n <= said.voxels:
            probe.show(ops.run(n))
    for n in _COUNTS:
        if n < said.voxels:
            probe.show(ops.skip(n) + ops.run())
    for n in _COUNTS:
        lit = ops.literal(said, [1] * n) if n < said.max_payload else b""
        if lit and n < said.voxels and len(lit) < said.max_payload:
            probe.show(lit + ops.pen(said, 0) + ops.skip(0) + ops.run())


@check(
    "7.2", "to-the-end", "SKIP, RUN and LIT may go to the last voxel: the cursor is V then", seen
)
def to_the_end(probe: Probe) -> None:
    said = probe.said
    tail = min(said.voxels, 40)
    before = ops.skip(said.voxels - tail)
    probe.show(before + ops.run(tail))
    probe.show(before + ops.run(tail) + ops.move(said, (0, 0, 0)) + ops.pen(said, 0) + ops.run())
    if said.voxels > 1:
        probe.show(ops.skip(said.voxels - 1) + ops.literal(said, [1]))
    probe.show(ops.run() + (ops.skip(said.voxels - 1)))
    if said.voxels <= ops.MANY:
        probe.show(ops.run(said.voxels))


@check("7.2", "literal", "LIT writes its pixels in their order", seen)
def literal(probe: Probe) -> None:
    said, rng = probe.said, probe.rng
    most = min(said.voxels, 200, (said.max_payload - 10) // said.pixel_bytes)
    for n in sorted({1, 2, 7, 8, 9, 15, 16, 17, most}):
        if n <= most:
            values = [ops.some_value(said, rng) * rng.randrange(2) for _ in range(n)]
            probe.show(ops.literal(said, values))


@check("7.2", "literal-pen", "after LIT the pen is its last pixel", seen, voxels(3))
def literal_pen(probe: Probe) -> None:
    said = probe.said
    probe.show(ops.literal(said, [1, 0]) + ops.run(said.voxels - 2 if said.voxels < 99 else 9))
    value = ops.some_value(said, probe.rng)
    probe.show(ops.pen(said, 0) + ops.literal(said, [0, value]) + ops.run())


@check("7", "anything", "any ops that follow each other draw what section 7 says", seen)
def anything(probe: Probe) -> None:
    said = probe.said
    for number in range(12):
        size = min(said.max_payload, 400)
        probe.show(
            *(ops.program(said, probe.rng, size) for _ in range(number % 3 + 1)), clear=number < 8
        )

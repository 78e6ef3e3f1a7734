"""Checks of sections 2 and 7 to 7.2: the ops that every device has."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.announced_device import AnnouncedDevice
from voxdisplay.conformance.catalogue import check, min_voxels, pixel_formats, readable_display
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec

# Around every count from which the encoding needs one more byte.
_COUNTS = (1, 2, 30, 31, 32, 33, 34, 95, 96, 159, 160, 161, 287, 288, 16415, 16416, 16417)
_COLORED = (spec.FORMAT_INDEX8, spec.FORMAT_RGB565, spec.FORMAT_RGB888)


def axis_of_two(device: AnnouncedDevice) -> str:
    """Require an axis of at least two voxels."""
    return "" if max(device.grid) > 1 else "no axis has more than one voxel"


@check(
    "2",
    "scan-order",
    "x runs fastest, then y, then z; coordinates come as x, y, z",
    readable_display,
    min_voxels(2),
)
def scan_order(probe: Probe) -> None:
    device = probe.device
    ends = [(device.nx - 1, 0, 0), (0, device.ny - 1, 0), (0, 0, device.nz - 1)]
    probe.show(b"".join(ops.move(device, place) + ops.run() for place in ends))
    for end in ends:
        probe.show(ops.move(device, end) + ops.run())
    far = [side - 1 for side in device.grid]
    for axis in range(3):
        place = list(far)
        place[axis] = device.grid[axis] // 2
        probe.show(ops.move(device, place) + ops.run())


@check(
    "2.1",
    "pixels",
    "the bytes of a pixel come lowest first, and all bits count",
    readable_display,
    pixel_formats(*_COLORED),
)
def pixels(probe: Probe) -> None:
    device = probe.device
    for bit in range(8 * device.pixel_bytes):
        probe.show(ops.pen(device, 1 << bit) + ops.run())
    probe.show(ops.pen(device, int.from_bytes(bytes(range(1, 1 + device.pixel_bytes)))) + ops.run())
    probe.show(ops.literal(device, [device.full_pixel - 1]))


@check(
    "7",
    "begins-at-0",
    "at the start of a packet the cursor is 0 and the pen is the full pixel",
    readable_display,
)
def begins_at_0(probe: Probe) -> None:
    probe.show(ops.run())


@check(
    "7",
    "each-packet-anew",
    "cursor and pen do not carry over from the packet before",
    readable_display,
    min_voxels(3),
)
def each_packet_anew(probe: Probe) -> None:
    device = probe.device
    probe.show(ops.skip(2) + ops.pen(device, 1) + ops.run(), ops.run())
    probe.show(ops.run() + ops.literal(device, [0]), ops.run(3))


@check("7", "pen", "PEN sets the pen, to pixel 0 too", readable_display, min_voxels(3))
def pen(probe: Probe) -> None:
    device = probe.device
    values = [ops.random_pixel(device, probe.rng) for _ in range(3)]
    probe.show(b"".join(ops.pen(device, value) + ops.run() for value in values))
    probe.show(ops.skip(1) + ops.pen(device, 0) + ops.run(), clear=False)


@check("7", "move", "MOVE sets the cursor", readable_display)
def move(probe: Probe) -> None:
    device = probe.device
    places = [ops.random_voxel(device, probe.rng) for _ in range(12)]
    places += [(0, 0, 0), (device.nx - 1, device.ny - 1, device.nz - 1)]
    drawn = [
        ops.move(device, place) + ops.pen(device, ops.random_pixel(device, probe.rng)) + ops.run()
        for place in places
    ]
    probe.show(*ops.split_payloads(device, drawn))


@check("7", "end", "END ends the ops; only 00 may follow", readable_display)
def end(probe: Probe) -> None:
    probe.show(ops.run() + ops.END)
    probe.show(ops.run() + ops.END + bytes(7))
    probe.show(ops.END)


@check("7", "later-counts", "within one packet the last write to a voxel counts", readable_display)
def later_counts(probe: Probe) -> None:
    device = probe.device
    back = ops.move(device, (0, 0, 0))
    probe.show(ops.run() + back + ops.pen(device, 1) + ops.run())
    probe.show(ops.run() + back + ops.pen(device, 0) + ops.run())


@check(
    "7.1",
    "octants",
    "each of the 24 octants has its main axis and its directions",
    readable_display,
    axis_of_two,
)
def octants(probe: Probe) -> None:
    device = probe.device
    for octant in range(spec.LIMIT_MAX_OCTANT + 1):
        found = ops.random_chain(device, probe.rng, octant)
        if found:
            start, crumbs = found
            probe.show(ops.move(device, start) + ops.chain(device, octant, crumbs))


@check("7.1", "from", "FROM is MOVE and STEP in one", readable_display, axis_of_two)
def from_(probe: Probe) -> None:
    device = probe.device
    drawn = []
    for octant in range(spec.LIMIT_MAX_OCTANT + 1):
        found = ops.random_chain(device, probe.rng, octant, 12)
        if found:
            drawn.append(ops.chain(device, octant, found[1], found[0]))
    probe.show(*ops.split_payloads(device, drawn))


@check(
    "7.1",
    "chain-lengths",
    "a chain has 1 to 256 steps, four to a byte",
    readable_display,
    axis_of_two,
)
def chain_lengths(probe: Probe) -> None:
    device = probe.device
    main = device.grid.index(max(device.grid))
    room = (device.max_payload - 20) * 4
    longest = min(device.grid[main] - 1, spec.LIMIT_MAX_STEPS, room)
    for steps in sorted({1, 2, 3, 4, 5, 7, 8, 9, longest - 1, longest}):
        if 1 <= steps <= longest:
            probe.show(ops.chain(device, 8 * main, [0] * steps))


@check(
    "7.1",
    "chain-cursor",
    "after a chain the cursor is at its last voxel",
    readable_display,
    axis_of_two,
)
def chain_cursor(probe: Probe) -> None:
    device = probe.device
    main = device.grid.index(max(device.grid))
    steps = min(5, device.grid[main] - 1)
    erase = ops.pen(device, 0) + ops.run()
    probe.show(ops.chain(device, 8 * main, [0] * steps) + erase)
    probe.show(ops.chain(device, 8 * main, [0] * steps, (0, 0, 0)) + erase)
    back = 8 * main + (1 << main)
    probe.show(
        ops.chain(device, 8 * main, [0] * steps) + ops.chain(device, back, [0] * steps) + erase
    )


@check("7.2", "counts", "a count is c + 1 up to 31, then 32 + LEB128", readable_display)
def counts(probe: Probe) -> None:
    device = probe.device
    for n in _COUNTS:
        if n <= device.voxel_count:
            probe.show(ops.run(n))
    for n in _COUNTS:
        if n < device.voxel_count:
            probe.show(ops.skip(n) + ops.run())
    for n in _COUNTS:
        lit = ops.literal(device, [1] * n) if n < device.max_payload else b""
        if lit and n < device.voxel_count and len(lit) < device.max_payload:
            probe.show(lit + ops.pen(device, 0) + ops.skip(0) + ops.run())


@check(
    "7.2",
    "to-the-end",
    "SKIP, RUN and LIT may go to the last voxel: the cursor is V then",
    readable_display,
)
def to_the_end(probe: Probe) -> None:
    device = probe.device
    tail = min(device.voxel_count, 40)
    before = ops.skip(device.voxel_count - tail)
    probe.show(before + ops.run(tail))
    probe.show(
        before + ops.run(tail) + ops.move(device, (0, 0, 0)) + ops.pen(device, 0) + ops.run()
    )
    if device.voxel_count > 1:
        probe.show(ops.skip(device.voxel_count - 1) + ops.literal(device, [1]))
    probe.show(ops.run() + (ops.skip(device.voxel_count - 1)))
    if device.voxel_count <= ops.MAX_VOXELS:
        probe.show(ops.run(device.voxel_count))


@check("7.2", "literal", "LIT writes its pixels in their order", readable_display)
def literal(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    most = min(device.voxel_count, 200, (device.max_payload - 10) // device.pixel_bytes)
    for n in sorted({1, 2, 7, 8, 9, 15, 16, 17, most}):
        if n <= most:
            values = [ops.random_pixel(device, rng) * rng.randrange(2) for _ in range(n)]
            probe.show(ops.literal(device, values))


@check("7.2", "literal-pen", "after LIT the pen is its last pixel", readable_display, min_voxels(3))
def literal_pen(probe: Probe) -> None:
    device = probe.device
    probe.show(
        ops.literal(device, [1, 0])
        + ops.run(device.voxel_count - 2 if device.voxel_count < 99 else 9)
    )
    value = ops.random_pixel(device, probe.rng)
    probe.show(ops.pen(device, 0) + ops.literal(device, [0, value]) + ops.run())


@check("7", "random-ops", "random valid ops draw what section 7 says", readable_display)
def random_ops(probe: Probe) -> None:
    device = probe.device
    for number in range(12):
        size = min(device.max_payload, 400)
        probe.show(
            *(ops.random_ops(device, probe.rng, size) for _ in range(number % 3 + 1)),
            clear=number < 8,
        )

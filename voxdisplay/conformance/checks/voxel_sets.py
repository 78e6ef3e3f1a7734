"""Checks of sections 7.4 to 7.6: OCT, DIFF and COLORS."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, feature, min_voxels, readable_display
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec


def _payload(probe: Probe, level: int, density: float) -> bytes:
    """Return a random brick that fits a packet."""
    while True:
        op = ops.random_brick(probe.device, probe.rng, level, density)
        if len(op) <= probe.device.max_payload:
            return op
        density /= 2


@check(
    "7.4",
    "levels",
    "OCT draws a brick of each level, from its masks",
    feature("OCT"),
    readable_display,
)
def levels(probe: Probe) -> None:
    for level in range(spec.LIMIT_MAX_LEVEL + 1):
        for density in (0.05, 0.5):
            probe.show(_payload(probe, level, density))


@check(
    "7.4",
    "children",
    "bit c = cx + 2 cy + 4 cz of a mask is the child at (cx, cy, cz)",
    feature("OCT"),
    readable_display,
)
def children(probe: Probe) -> None:
    for level in (1, 2, 3, 4):
        side = 1 << level - 1
        for bit in range(8):
            child = (side * (bit & 1), side * (bit >> 1 & 1), side * (bit >> 2))
            if all(at < n for at, n in zip(child, probe.device.grid, strict=True)):
                probe.show(ops.brick(probe.device, level, (0, 0, 0), [child]))


@check(
    "7.4",
    "full-nodes",
    "the mask 00 stands for a node whose voxels are all written",
    feature("OCT"),
    readable_display,
)
def full_nodes(probe: Probe) -> None:
    device = probe.device
    for level in range(1, spec.LIMIT_MAX_LEVEL + 1):
        if 1 << level <= min(device.grid):
            probe.show(bytes((spec.OP_OCT | level,)) + ops.xyz(device, (0, 0, 0)) + b"\0")
        probe.show(_payload(probe, level, 1.0))


@check(
    "7.4",
    "brick-cursor",
    "OCT leaves cursor and pen unchanged",
    feature("OCT"),
    readable_display,
    min_voxels(2),
)
def brick_cursor(probe: Probe) -> None:
    device = probe.device
    brick = ops.brick(device, 0, (0, 0, 0), [])
    probe.show(ops.skip(device.voxel_count - 1) + ops.pen(device, 1) + brick + ops.run())
    probe.show(ops.skip(device.voxel_count) + brick)


@check(
    "7.5",
    "differences",
    "DIFF adds -8 to 7 to the pen, modulo 256",
    feature("DIFF"),
    readable_display,
)
def differences(probe: Probe) -> None:
    device, rng = probe.device, probe.rng
    most = min(device.voxel_count, 200, 2 * (device.max_payload - 8))
    for n in sorted({1, 2, 3, 31, 32, 33, most - 1, most}):
        if 0 < n <= most:
            values = [rng.randint(-8, 7) for _ in range(n)]
            probe.show(ops.pen(device, rng.randrange(256)) + ops.differences(values))
    up = min(most, 40)
    probe.show(ops.pen(device, 250) + ops.differences([7] * up))
    probe.show(ops.pen(device, 5) + ops.differences([-8] * up))


@check(
    "7.5",
    "difference-pen",
    "after DIFF the pen is the last pixel",
    feature("DIFF"),
    readable_display,
    min_voxels(4),
)
def difference_pen(probe: Probe) -> None:
    device = probe.device
    probe.show(ops.pen(device, 9) + ops.differences([3, -1]) + ops.run(2))
    probe.show(ops.literal(device, [20]) + ops.differences([1, 2, 3]))


@check(
    "7.6",
    "colors",
    "COLORS sets entries of the page's palette",
    feature("PALETTE"),
    feature("DIGEST"),
)
def colors(probe: Probe) -> None:
    rng = probe.rng
    for first, n in (
        (0, 1),
        (255, 1),
        (7, 3),
        (250, 6),
        (0, min(256, probe.device.max_payload // 3 - 1)),
    ):
        values = [(rng.randrange(256), rng.randrange(256), rng.randrange(256)) for _ in range(n)]
        probe.show(ops.colors(first, values) + ops.run(), exactly=True)


@check(
    "7.6",
    "palette-of-a-page",
    "with CLEAR a page has the default palette, otherwise a copy of the front page's",
    feature("PALETTE"),
    feature("DIGEST"),
)
def palette_of_a_page(probe: Probe) -> None:
    probe.show(ops.colors(2, [(1, 2, 3)]) + ops.run(), exactly=True)
    probe.show(ops.colors(4, [(4, 5, 6)]), clear=False, exactly=True)
    probe.show(b"", clear=False, exactly=True)
    probe.show(ops.run(), exactly=True)
    probe.show(ops.colors(2, [(1, 2, 3)]), clear=False, exactly=True)

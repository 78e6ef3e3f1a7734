"""Checks of section 7.8: ops that leave the grid or the palette are refused."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, feature
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec


def require_refused_anywhere(probe: Probe, ops_: bytes, code: int) -> None:
    """Require that ops are refused as the first ones, and behind another op."""
    probe.require_ops_refused(ops_, code)
    before = ops.pen(probe.device, 1)
    probe.require_ops_refused(before + ops_, code, len(before))


@check("7.8", "move-outside", "a MOVE or FROM off the grid is refused: OUTSIDE")
def move_outside(probe: Probe) -> None:
    device = probe.device
    top = (1 << 8 * device.coordinate_bytes) - 1
    for axis, side in enumerate(device.grid):
        for at in {side, top}:
            place = [0, 0, 0]
            place[axis] = at
            if side <= at <= top:
                require_refused_anywhere(probe, ops.move(device, place), spec.CODE_OUTSIDE)
                require_refused_anywhere(
                    probe,
                    bytes((spec.OP_FROM,)) + ops.xyz(device, place) + b"\0\0",
                    spec.CODE_OUTSIDE,
                )


@check(
    "7.8", "step-outside", "a step off the grid is refused, even if its index would exist: OUTSIDE"
)
def step_outside(probe: Probe) -> None:
    device = probe.device
    for octant in range(spec.LIMIT_MAX_OCTANT + 1):
        main = octant >> 3
        for bit in (None, 0, 1):
            axis = main if bit is None else (main + 1 + bit) % 3
            at = [side // 2 for side in device.grid]
            at[main] = device.grid[main] - 1 if octant >> main & 1 else 0
            at[axis] = 0 if octant >> axis & 1 else device.grid[axis] - 1
            crumb = 0 if bit is None else 1 << bit
            start = ops.move(device, at)
            probe.require_ops_refused(
                start + bytes((spec.OP_STEP | octant, 0, crumb)), spec.CODE_OUTSIDE, len(start)
            )


@check("7.8", "behind-the-end", "at the cursor V any chain, shape or count is refused: OUTSIDE")
def behind_the_end(probe: Probe) -> None:
    device = probe.device
    end = ops.skip(device.voxel_count)
    place = ops.xyz(device, (0, 0, 0))
    tries = {
        "": [ops.run(), ops.skip(1), ops.literal(device, [1]), bytes((spec.OP_STEP, 0, 0))],
        "LINE": [bytes((spec.OP_LINE,)) + place],
        "BOX": [bytes((spec.OP_BOX,)) + place],
        "DIFF": [ops.differences([1])],
    }
    for name, several in tries.items():
        for op in several if not name or device.has(name) else []:
            probe.require_ops_refused(end + op, spec.CODE_OUTSIDE, len(end))


@check("7.8", "past-the-end", "SKIP, RUN, LIT and DIFF beyond the last voxel are refused: OUTSIDE")
def past_the_end(probe: Probe) -> None:
    device = probe.device
    begin = ops.skip(device.voxel_count - 1)
    at = len(begin)
    for op in (ops.run(2), ops.skip(2), ops.literal(device, [1, 1]), ops.run((1 << 32) - 1)):
        probe.require_ops_refused(begin + op, spec.CODE_OUTSIDE, at)
    probe.require_ops_refused(ops.run(device.voxel_count + 1), spec.CODE_OUTSIDE)
    probe.require_ops_refused(ops.skip(device.voxel_count + 1), spec.CODE_OUTSIDE)
    if device.has("DIFF"):
        probe.require_ops_refused(begin + ops.differences([1, 1]), spec.CODE_OUTSIDE, at)


@check("7.8", "shapes-outside", "LINE, BOX and DOTS off the grid are refused: OUTSIDE")
def shapes_outside(probe: Probe) -> None:
    device = probe.device
    for axis, side in enumerate(device.grid):
        place = [0, 0, 0]
        place[axis] = side
        if side >= 1 << 8 * device.coordinate_bytes:
            continue
        named = ops.xyz(device, place)
        if device.has("LINE"):
            require_refused_anywhere(probe, bytes((spec.OP_LINE,)) + named, spec.CODE_OUTSIDE)
        if device.has("BOX"):
            require_refused_anywhere(probe, bytes((spec.OP_BOX,)) + named, spec.CODE_OUTSIDE)
        if device.has("DOTS"):
            dots = bytes((spec.OP_DOTS, 1)) + ops.xyz(device, (0, 0, 0)) + named
            require_refused_anywhere(probe, dots, spec.CODE_OUTSIDE)


@check(
    "7.8", "bricks-outside", "a brick that writes off the grid is refused: OUTSIDE", feature("OCT")
)
def bricks_outside(probe: Probe) -> None:
    device = probe.device
    top = (1 << 8 * device.coordinate_bytes) - 1
    for axis, side in enumerate(device.grid):
        for level in range(spec.LIMIT_MAX_LEVEL + 1):
            place = [0, 0, 0]
            place[axis] = -(-side >> level)
            head = bytes((spec.OP_OCT | level,)) + ops.xyz(device, place)
            if place[axis] <= top:
                require_refused_anywhere(probe, head + (b"\0" if level else b""), spec.CODE_OUTSIDE)
            place[axis] = (side - 1) >> level
            head = bytes((spec.OP_OCT | level,)) + ops.xyz(device, place)
            if side % (1 << level):
                require_refused_anywhere(probe, head + b"\0", spec.CODE_OUTSIDE)


@check(
    "7.8",
    "colors-outside",
    "COLORS beyond the end of the palette is refused: OUTSIDE",
    feature("PALETTE"),
)
def colors_outside(probe: Probe) -> None:
    require_refused_anywhere(probe, ops.colors(255, [(1, 2, 3), (1, 2, 3)]), spec.CODE_OUTSIDE)
    require_refused_anywhere(probe, ops.colors(240, [(1, 2, 3)] * 17), spec.CODE_OUTSIDE)

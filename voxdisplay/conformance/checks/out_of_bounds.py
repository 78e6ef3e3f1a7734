"""Section 7.8: what an op must not do, and that it is refused wherever it stands."""

from __future__ import annotations

from voxdisplay.conformance import ops
from voxdisplay.conformance.catalogue import check, feature
from voxdisplay.conformance.probe import Probe
from voxdisplay.wire import spec


def prefixed(probe: Probe, ops_: bytes, code: int) -> None:
    """Demand a refusal, at the first op and behind another one."""
    probe.refuse_ops(ops_, code)
    before = ops.pen(probe.said, 1)
    probe.refuse_ops(before + ops_, code, len(before))


@check("7.8", "move-outside", "the target of a MOVE is on the grid: OUTSIDE")
def move_outside(probe: Probe) -> None:
    said = probe.said
    top = (1 << 8 * said.coordinate_bytes) - 1
    for axis, side in enumerate(said.grid):
        for at in {side, top}:
            place = [0, 0, 0]
            place[axis] = at
            if side <= at <= top:
                prefixed(probe, ops.move(said, place), spec.CODE_OUTSIDE)
                prefixed(
                    probe,
                    bytes((spec.OP_FROM,)) + ops.xyz(said, place) + b"\0\0",
                    spec.CODE_OUTSIDE,
                )


@check(
    "7.8", "step-outside", "a step that leaves the grid on any axis is outside, whatever its index"
)
def step_outside(probe: Probe) -> None:
    said = probe.said
    for octant in range(spec.LIMIT_MAX_OCTANT + 1):
        main = octant >> 3
        for bit in (None, 0, 1):
            axis = main if bit is None else (main + 1 + bit) % 3
            at = [side // 2 for side in said.grid]
            at[main] = said.grid[main] - 1 if octant >> main & 1 else 0
            at[axis] = 0 if octant >> axis & 1 else said.grid[axis] - 1
            crumb = 0 if bit is None else 1 << bit
            start = ops.move(said, at)
            probe.refuse_ops(
                start + bytes((spec.OP_STEP | octant, 0, crumb)), spec.CODE_OUTSIDE, len(start)
            )


@check(
    "7.8", "behind-the-end", "a cursor of V is no voxel: a chain, and any count, is outside there"
)
def behind_the_end(probe: Probe) -> None:
    said = probe.said
    end = ops.skip(said.voxels)
    place = ops.xyz(said, (0, 0, 0))
    tries = {
        "": [ops.run(), ops.skip(1), ops.literal(said, [1]), bytes((spec.OP_STEP, 0, 0))],
        "LINE": [bytes((spec.OP_LINE,)) + place],
        "BOX": [bytes((spec.OP_BOX,)) + place],
        "DIFF": [ops.differences([1])],
    }
    for name, several in tries.items():
        for op in several if not name or said.has(name) else []:
            probe.refuse_ops(end + op, spec.CODE_OUTSIDE, len(end))


@check("7.8", "past-the-end", "nothing goes past the last voxel")
def past_the_end(probe: Probe) -> None:
    said = probe.said
    begin = ops.skip(said.voxels - 1)
    at = len(begin)
    for op in (ops.run(2), ops.skip(2), ops.literal(said, [1, 1]), ops.run((1 << 32) - 1)):
        probe.refuse_ops(begin + op, spec.CODE_OUTSIDE, at)
    probe.refuse_ops(ops.run(said.voxels + 1), spec.CODE_OUTSIDE)
    probe.refuse_ops(ops.skip(said.voxels + 1), spec.CODE_OUTSIDE)
    if said.has("DIFF"):
        probe.refuse_ops(begin + ops.differences([1, 1]), spec.CODE_OUTSIDE, at)


@check("7.8", "shapes-outside", "LINE, BOX and DOTS stay on the grid")
def shapes_outside(probe: Probe) -> None:
    said = probe.said
    for axis, side in enumerate(said.grid):
        place = [0, 0, 0]
        place[axis] = side
        if side >= 1 << 8 * said.coordinate_bytes:
            continue
        named = ops.xyz(said, place)
        if said.has("LINE"):
            prefixed(probe, bytes((spec.OP_LINE,)) + named, spec.CODE_OUTSIDE)
        if said.has("BOX"):
            prefixed(probe, bytes((spec.OP_BOX,)) + named, spec.CODE_OUTSIDE)
        if said.has("DOTS"):
            dots = bytes((spec.OP_DOTS, 1)) + ops.xyz(said, (0, 0, 0)) + named
            prefixed(probe, dots, spec.CODE_OUTSIDE)


@check("7.8", "bricks-outside", "what a brick writes is on the grid", feature("OCT"))
def bricks_outside(probe: Probe) -> None:
    said = probe.said
    top = (1 << 8 * said.coordinate_bytes) - 1
    for axis, side in enumerate(said.grid):
        for level in range(spec.LIMIT_MAX_LEVEL + 1):
            place = [0, 0, 0]
            place[axis] = -(-side >> level)
            head = bytes((spec.OP_OCT | level,)) + ops.xyz(said, place)
            if place[axis] <= top:
                prefixed(probe, head + (b"\0" if level else b""), spec.CODE_OUTSIDE)
            place[axis] = (side - 1) >> level
            head = bytes((spec.OP_OCT | level,)) + ops.xyz(said, place)
            if side % (1 << level):
                prefixed(probe, head + b"\0", spec.CODE_OUTSIDE)


@check("7.8", "colors-outside", "entries behind the palette are outside", feature("PALETTE"))
def colors_outside(probe: Probe) -> None:
    prefixed(probe, ops.colors(255, [(1, 2, 3), (1, 2, 3)]), spec.CODE_OUTSIDE)
    prefixed(probe, ops.colors(240, [(1, 2, 3)] * 17), spec.CODE_OUTSIDE)

"""Single ops as bytes, and pictures made of them that fit any grid and any format.

No coder: each function writes just the op that it is asked for (section 7 of protocol.md).
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from voxdisplay.conformance.announced import Said
from voxdisplay.conformance.reference_decoder import Decoder, Place, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

END = bytes((spec.OP_END,))
MANY = 1 << 16  # voxels that the kit draws at a time, at most


def leb128(k: int) -> bytes:
    """Give k as LEB128 in its shortest form."""
    out = bytearray()
    while k > 127:
        out.append(k & 127 | 128)
        k >>= 7
    return bytes((*out, k))


def counted(op: int, n: int) -> bytes:
    """Give the op byte, and what follows it, of SKIP, RUN, LIT or DIFF with a count."""
    return bytes((op | n - 1,)) if n < 32 else bytes((op | 31,)) + leb128(n - 32)


def skip(n: int) -> bytes:
    """Give SKIP; nothing for n = 0."""
    return counted(spec.OP_SKIP, n) if n else b""


def run(n: int = 1) -> bytes:
    """Give RUN."""
    return counted(spec.OP_RUN, n)


def pixel(said: Said, value: int) -> bytes:
    """Give a pixel's bytes."""
    return value.to_bytes(said.pixel_bytes, "little")


def pen(said: Said, value: int) -> bytes:
    """Give PEN."""
    return bytes((spec.OP_PEN,)) + pixel(said, value)


def xyz(said: Said, place: Sequence[int]) -> bytes:
    """Give three coordinates."""
    return b"".join(at.to_bytes(said.coordinate_bytes, "little") for at in place)


def move(said: Said, place: Sequence[int]) -> bytes:
    """Give MOVE."""
    return bytes((spec.OP_MOVE,)) + xyz(said, place)


def parts(values: Sequence[int], bits: int) -> bytes:
    """Pack small numbers, the first in the lowest bits."""
    whole = sum(value << bits * i for i, value in enumerate(values))
    return whole.to_bytes(-(-len(values) * bits // 8), "little")


def literal(said: Said, values: Sequence[int]) -> bytes:
    """Give LIT."""
    if said.format == spec.FORMAT_MONO1:
        pixels = parts(values, 1)
    else:
        pixels = b"".join(pixel(said, value) for value in values)
    return counted(spec.OP_LIT, len(values)) + pixels


def chain(said: Said, octant: int, crumbs: Sequence[int], start: Place | None = None) -> bytes:
    """Give STEP, or FROM if a start is given."""
    op = spec.OP_STEP if start is None else spec.OP_FROM
    head = bytes((op | octant,)) + (b"" if start is None else xyz(said, start))
    return head + bytes((len(crumbs) - 1,)) + parts(crumbs, 2)


def line(said: Said, begin: Place, end: Place) -> bytes:
    """Give MOVE and LINE."""
    return move(said, begin) + bytes((spec.OP_LINE,)) + xyz(said, end)


def box(said: Said, begin: Place, end: Place) -> bytes:
    """Give MOVE and BOX."""
    return move(said, begin) + bytes((spec.OP_BOX,)) + xyz(said, end)


def dots(said: Said, places: Sequence[Place]) -> bytes:
    """Give DOTS."""
    named = b"".join(xyz(said, place) for place in places)
    return bytes((spec.OP_DOTS, len(places) - 1)) + named


def brick(said: Said, level: int, at: Place, voxels: Iterable[Place]) -> bytes:
    """Give OCT for voxels of a brick; a node of which all are written has the mask 00."""
    inside = {tuple(v - (a << level) for v, a in zip(voxel, at, strict=True)) for voxel in voxels}
    out = bytes((spec.OP_OCT | level,)) + xyz(said, at)
    nodes = [(0, 0, 0)]
    for size in reversed(range(level)):  # children of a node have the side 2 ** size
        written = Counter((x >> size, y >> size, z >> size) for x, y, z in inside)
        children = []
        for x, y, z in nodes:
            named = [(2 * x + (c & 1), 2 * y + (c >> 1 & 1), 2 * z + (c >> 2)) for c in range(8)]
            if all(written[child] == 8**size for child in named):
                out += b"\0"
                continue
            out += bytes((sum(1 << c for c, child in enumerate(named) if written[child]),))
            children += [child for child in named if written[child]]
        nodes = children
    return out


def differences(values: Sequence[int]) -> bytes:
    """Give DIFF for nibbles from -8 to 7."""
    return counted(spec.OP_DIFF, len(values)) + parts([value & 15 for value in values], 4)


def colors(first: int, values: Sequence[tuple[int, int, int]]) -> bytes:
    """Give COLORS."""
    return bytes((spec.OP_COLORS, first, len(values) - 1)) + b"".join(map(bytes, values))


def dot(said: Said, index: int, value: int | None = None) -> bytes:
    """Give ops that write one voxel."""
    return skip(index) + (b"" if value is None else pen(said, value)) + run()


# -- whatever fits


def some_value(said: Said, rng: random.Random) -> int:
    """Give a pixel that is not dark, with differing bytes where the format has several."""
    return 1 if said.format == spec.FORMAT_MONO1 else rng.randint(1, said.full)


def some_place(said: Said, rng: random.Random) -> Place:
    """Give a place on the grid."""
    return rng.randrange(said.nx), rng.randrange(said.ny), rng.randrange(said.nz)


def some_chain(
    said: Said, rng: random.Random, octant: int, longest: int = 40
) -> tuple[Place, list[int]] | None:
    """Give a start, and crumbs that stay on the grid; None if the main axis has one voxel."""
    main = octant >> 3
    if said.grid[main] == 1:
        return None
    steps = rng.randint(1, min(longest, spec.LIMIT_MAX_STEPS, said.grid[main] - 1))
    at = [0, 0, 0]
    for axis, side in enumerate(said.grid):
        room = steps if axis == main else min(steps, side - 1)
        low = rng.randrange(side - room)
        at[axis] = low + room if octant >> axis & 1 else low
    start = (at[0], at[1], at[2])
    left = [at[a] if octant >> a & 1 else side - 1 - at[a] for a, side in enumerate(said.grid)]
    crumbs = []
    for _ in range(steps):
        crumb = 0
        for bit in (0, 1):
            axis = (main + 1 + bit) % 3
            if left[axis] and rng.random() < 0.5:
                left[axis] -= 1
                crumb |= 1 << bit
        crumbs.append(crumb)
    return start, crumbs


def some_op(said: Said, rng: random.Random) -> bytes:
    """Give one op of those that the device has; it may lead off the grid."""
    makers: list[Callable[[], bytes]] = [
        lambda: pen(said, some_value(said, rng)),
        lambda: pen(said, 0) + run(rng.randint(1, 3)),
        lambda: move(said, some_place(said, rng)),
        lambda: skip(rng.choice([1, 3, 31, 32, 40, 200])),
        lambda: run(rng.choice([1, 2, 31, 32, 33, 160])),
        lambda: literal(
            said, [rng.choice([0, some_value(said, rng)]) for _ in range(rng.randint(1, 40))]
        ),
        lambda: _some_chain(said, rng),
    ]
    if said.has("LINE"):
        makers.append(lambda: line(said, some_place(said, rng), some_place(said, rng)))
    if said.has("BOX"):
        makers.append(
            lambda: box(said, (place := some_place(said, rng)), near(said, rng, place, 4))
        )
    if said.has("DOTS"):
        makers.append(lambda: dots(said, [some_place(said, rng) for _ in range(rng.randint(1, 9))]))
    if said.has("OCT"):
        makers.append(lambda: some_brick(said, rng, rng.randrange(5), rng.random() ** 8))
    if said.has("DIFF"):
        makers.append(lambda: differences([rng.randint(-8, 7) for _ in range(rng.randint(1, 70))]))
    if said.has("PALETTE"):
        makers.append(
            lambda: colors(
                rng.randrange(250), [(rng.randrange(256), 7, 99) for _ in range(rng.randint(1, 6))]
            )
        )
    return rng.choice(makers)()


def _some_chain(said: Said, rng: random.Random) -> bytes:
    octant = rng.randrange(spec.LIMIT_MAX_OCTANT + 1)
    found = some_chain(said, rng, octant)
    if found is None:
        return run()
    start, crumbs = found
    if rng.random() < 0.5:
        return chain(said, octant, crumbs, start)
    return move(said, start) + chain(said, octant, crumbs)


def near(said: Said, rng: random.Random, place: Place, far: int) -> Place:
    """Give a place on the grid that is not far from another on each axis."""
    x, y, z = (
        min(max(a + rng.randint(-far, far), 0), side - 1)
        for a, side in zip(place, said.grid, strict=True)
    )
    return x, y, z


def some_brick(said: Said, rng: random.Random, level: int, density: float) -> bytes:
    """Give OCT for about so many of a brick's voxels that are on the grid."""
    at = tuple(rng.randrange(-(-side >> level)) for side in said.grid)
    spans = [
        range(a << level, min(a + 1 << level, side)) for a, side in zip(at, said.grid, strict=True)
    ]
    if density == 1:
        chosen = [(x, y, z) for z in spans[2] for y in spans[1] for x in spans[0]]
    else:
        count = max(1, int(density * 8**level))
        chosen = [
            (rng.choice(spans[0]), rng.choice(spans[1]), rng.choice(spans[2])) for _ in range(count)
        ]
    return brick(said, level, (at[0], at[1], at[2]), chosen)


def program(said: Said, rng: random.Random, size: int) -> bytes:
    """Give ops of at most ``size`` bytes that no device refuses."""
    payload = run()
    decoder = Decoder(said, Page())
    decoder.draw(payload)
    for _ in range(60):
        op = some_op(said, rng)
        before = decoder.cursor, decoder.pen
        try:
            if len(payload) + len(op) <= size:
                decoder.go_on(op)
                payload += op
        except Refused:
            decoder.cursor, decoder.pen = before
    return payload


def cut(said: Said, ops: Iterable[bytes]) -> list[bytes]:
    """Put ops that do not depend on each other into as few payloads as they fit."""
    payloads = [b""]
    for op in ops:
        if len(payloads[-1]) + len(op) > said.max_payload:
            payloads.append(b"")
        payloads[-1] += op
    return payloads

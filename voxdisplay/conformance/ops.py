"""Byte forms of single ops (section 7 of protocol.md), and random ops for any grid and format.

No encoder: each function writes exactly the op that it is asked for.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.fades import color_bytes
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page
from voxdisplay.wire import spec

END = bytes((spec.OP_END,))
MAX_VOXELS = 1 << 16  # most voxels that the kit draws with one op


def leb128(k: int) -> bytes:
    """Return k as LEB128 in its shortest form."""
    out = bytearray()
    while k > 127:
        out.append(k & 127 | 128)
        k >>= 7
    return bytes((*out, k))


def counted(op: int, n: int) -> bytes:
    """Return op byte and count of SKIP, RUN, LIT or DIFF."""
    return bytes((op | n - 1,)) if n < 32 else bytes((op | 31,)) + leb128(n - 32)


def skip(n: int) -> bytes:
    """Return SKIP; nothing for n = 0."""
    return counted(spec.OP_SKIP, n) if n else b""


def run(n: int = 1) -> bytes:
    """Return RUN."""
    return counted(spec.OP_RUN, n)


def pixel(device: AnnouncedDevice, value: int) -> bytes:
    """Return the bytes of a pixel value."""
    return value.to_bytes(device.pixel_bytes, "little")


def pen(device: AnnouncedDevice, value: int) -> bytes:
    """Return PEN."""
    return bytes((spec.OP_PEN,)) + pixel(device, value)


def xyz(device: AnnouncedDevice, place: Sequence[int]) -> bytes:
    """Return three coordinates."""
    return b"".join(at.to_bytes(device.coordinate_bytes, "little") for at in place)


def move(device: AnnouncedDevice, place: Sequence[int]) -> bytes:
    """Return MOVE."""
    return bytes((spec.OP_MOVE,)) + xyz(device, place)


def pack_bits(values: Sequence[int], bits: int) -> bytes:
    """Pack numbers of some bits each, the first in the lowest bits."""
    whole = sum(value << bits * i for i, value in enumerate(values))
    return whole.to_bytes(-(-len(values) * bits // 8), "little")


def literal(device: AnnouncedDevice, values: Sequence[int]) -> bytes:
    """Return LIT."""
    if device.format == spec.FORMAT_MONO1:
        pixels = pack_bits(values, 1)
    else:
        pixels = b"".join(pixel(device, value) for value in values)
    return counted(spec.OP_LIT, len(values)) + pixels


def chain(
    device: AnnouncedDevice, octant: int, crumbs: Sequence[int], start: Voxel | None = None
) -> bytes:
    """Return STEP, or FROM if a start is given."""
    op = spec.OP_STEP if start is None else spec.OP_FROM
    head = bytes((op | octant,)) + (b"" if start is None else xyz(device, start))
    return head + bytes((len(crumbs) - 1,)) + pack_bits(crumbs, 2)


def line(device: AnnouncedDevice, begin: Voxel, end: Voxel) -> bytes:
    """Return MOVE and LINE."""
    return move(device, begin) + bytes((spec.OP_LINE,)) + xyz(device, end)


def box(device: AnnouncedDevice, begin: Voxel, end: Voxel) -> bytes:
    """Return MOVE and BOX."""
    return move(device, begin) + bytes((spec.OP_BOX,)) + xyz(device, end)


def dots(device: AnnouncedDevice, places: Sequence[Voxel]) -> bytes:
    """Return DOTS."""
    named = b"".join(xyz(device, place) for place in places)
    return bytes((spec.OP_DOTS, len(places) - 1)) + named


def brick(device: AnnouncedDevice, level: int, at: Voxel, voxels: Iterable[Voxel]) -> bytes:
    """Return OCT for voxels of a brick; a node whose voxels are all written has the mask 00."""
    inside = {tuple(v - (a << level) for v, a in zip(voxel, at, strict=True)) for voxel in voxels}
    out = bytes((spec.OP_OCT | level,)) + xyz(device, at)
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
    """Return DIFF for nibbles from -8 to 7."""
    return counted(spec.OP_DIFF, len(values)) + pack_bits([value & 15 for value in values], 4)


def colors(first: int, values: Sequence[tuple[int, int, int]]) -> bytes:
    """Return COLORS."""
    return bytes((spec.OP_COLORS, first, len(values) - 1)) + b"".join(map(bytes, values))


def fade(device: AnnouncedDevice, stops: Sequence[Sequence[int]], count: int, at: int) -> bytes:
    """Return FADE of colours over ``count`` voxels, from voxel ``at`` on."""
    head = bytes((spec.OP_FADE, len(stops) - 1)) + leb128(count - 1) + leb128(at)
    return head + b"".join(bytes(stop[: color_bytes(device)]) for stop in stops)


def hold(ticks: int) -> bytes:
    """Return HOLD."""
    return bytes((spec.OP_HOLD, ticks))


def ramp(first: int, count: int, stops: Sequence[Sequence[int]]) -> bytes:
    """Return RAMP of colours over ``count`` entries."""
    head = bytes((spec.OP_RAMP, first, count - 1, len(stops) - 1))
    return head + b"".join(map(bytes, stops))


def random_stops(rng: random.Random) -> list[bytes]:
    """Return one to five random colours."""
    return [rng.randbytes(3) for _ in range(rng.randint(1, 5))]


def random_fade(device: AnnouncedDevice, rng: random.Random) -> bytes:
    """Return a random FADE."""
    count = rng.choice([1, 2, 5, 30, 200, 100_000])
    return fade(device, random_stops(rng), count, rng.choice([0, count - 1, rng.randrange(count)]))


def single_voxel(device: AnnouncedDevice, index: int, value: int | None = None) -> bytes:
    """Return ops that write the voxel with an index."""
    return skip(index) + (b"" if value is None else pen(device, value)) + run()


# -- random ops that fit a device


def random_pixel(device: AnnouncedDevice, rng: random.Random) -> int:
    """Return a random pixel value that is not dark."""
    return 1 if device.format == spec.FORMAT_MONO1 else rng.randint(1, device.full_pixel)


def random_voxel(device: AnnouncedDevice, rng: random.Random) -> Voxel:
    """Return a random voxel of the grid."""
    return rng.randrange(device.nx), rng.randrange(device.ny), rng.randrange(device.nz)


def random_chain(
    device: AnnouncedDevice, rng: random.Random, octant: int, longest: int = 40
) -> tuple[Voxel, list[int]] | None:
    """Return a start, and crumbs that stay on the grid; None if the main axis has one voxel."""
    main = octant >> 3
    if device.grid[main] == 1:
        return None
    steps = rng.randint(1, min(longest, spec.LIMIT_MAX_STEPS, device.grid[main] - 1))
    at = [0, 0, 0]
    for axis, side in enumerate(device.grid):
        room = steps if axis == main else min(steps, side - 1)
        low = rng.randrange(side - room)
        at[axis] = low + room if octant >> axis & 1 else low
    start = (at[0], at[1], at[2])
    left = [at[a] if octant >> a & 1 else side - 1 - at[a] for a, side in enumerate(device.grid)]
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


def random_op(device: AnnouncedDevice, rng: random.Random) -> bytes:
    """Return a random op that the device has; it may lead off the grid."""
    makers: list[Callable[[], bytes]] = [
        lambda: pen(device, random_pixel(device, rng)),
        lambda: pen(device, 0) + run(rng.randint(1, 3)),
        lambda: move(device, random_voxel(device, rng)),
        lambda: skip(rng.choice([1, 3, 31, 32, 40, 200])),
        lambda: run(rng.choice([1, 2, 31, 32, 33, 160])),
        lambda: literal(
            device, [rng.choice([0, random_pixel(device, rng)]) for _ in range(rng.randint(1, 40))]
        ),
        lambda: _random_chain_op(device, rng),
    ]
    if device.has("LINE"):
        makers.append(lambda: line(device, random_voxel(device, rng), random_voxel(device, rng)))
    if device.has("BOX"):
        makers.append(
            lambda: box(
                device,
                (place := random_voxel(device, rng)),
                random_voxel_near(device, rng, place, 4),
            )
        )
    if device.has("DOTS"):
        makers.append(
            lambda: dots(device, [random_voxel(device, rng) for _ in range(rng.randint(1, 9))])
        )
    if device.has("OCT"):
        makers.append(lambda: random_brick(device, rng, rng.randrange(5), rng.random() ** 8))
    if device.has("DIFF"):
        makers.append(lambda: differences([rng.randint(-8, 7) for _ in range(rng.randint(1, 70))]))
    if device.has("FADE"):
        makers.append(lambda: random_fade(device, rng))
    if device.has("RAMP"):
        makers.append(lambda: ramp(rng.randrange(250), rng.randint(1, 6), random_stops(rng)))
    if device.has("PALETTE"):
        makers.append(
            lambda: colors(
                rng.randrange(250), [(rng.randrange(256), 7, 99) for _ in range(rng.randint(1, 6))]
            )
        )
    return rng.choice(makers)()


def _random_chain_op(device: AnnouncedDevice, rng: random.Random) -> bytes:
    octant = rng.randrange(spec.LIMIT_MAX_OCTANT + 1)
    found = random_chain(device, rng, octant)
    if found is None:
        return run()
    start, crumbs = found
    if rng.random() < 0.5:
        return chain(device, octant, crumbs, start)
    return move(device, start) + chain(device, octant, crumbs)


def random_voxel_near(device: AnnouncedDevice, rng: random.Random, place: Voxel, far: int) -> Voxel:
    """Return a voxel of the grid within ``far`` of another one on each axis."""
    x, y, z = (
        min(max(a + rng.randint(-far, far), 0), side - 1)
        for a, side in zip(place, device.grid, strict=True)
    )
    return x, y, z


def random_brick(device: AnnouncedDevice, rng: random.Random, level: int, density: float) -> bytes:
    """Return OCT for a random part of a brick's voxels, all on the grid."""
    at = tuple(rng.randrange(-(-side >> level)) for side in device.grid)
    spans = [
        range(a << level, min(a + 1 << level, side))
        for a, side in zip(at, device.grid, strict=True)
    ]
    if density == 1:
        chosen = [(x, y, z) for z in spans[2] for y in spans[1] for x in spans[0]]
    else:
        count = max(1, int(density * 8**level))
        chosen = [
            (rng.choice(spans[0]), rng.choice(spans[1]), rng.choice(spans[2])) for _ in range(count)
        ]
    return brick(device, level, (at[0], at[1], at[2]), chosen)


def random_ops(device: AnnouncedDevice, rng: random.Random, size: int) -> bytes:
    """Return random valid ops of at most ``size`` bytes."""
    payload = run()
    decoder = ReferenceDecoder(device, Page())
    decoder.draw(payload)
    for _ in range(60):
        op = random_op(device, rng)
        before = decoder.cursor, decoder.pen
        try:
            if len(payload) + len(op) <= size:
                decoder.draw_more(op)
                payload += op
        except Refused:
            decoder.cursor, decoder.pen = before
    return payload


def split_payloads(device: AnnouncedDevice, ops: Iterable[bytes]) -> list[bytes]:
    """Pack independent ops, in order, into as few payloads as possible."""
    payloads = [b""]
    for op in ops:
        if len(payloads[-1]) + len(op) > device.max_payload:
            payloads.append(b"")
        payloads[-1] += op
    return payloads

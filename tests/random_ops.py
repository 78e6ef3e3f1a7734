"""Random valid ops, and a voxelwise decoder that tracks what they draw (protocol.md, section 7)."""

import random
from collections.abc import Sequence
from itertools import product

from firmware_sim.memory import DEFAULT_PALETTE, FORMATS


class VoxelwiseDecoder:
    """Decoder of section 7, voxel by voxel."""

    def __init__(self, grid: tuple[int, int, int], name: str) -> None:
        self.grid = grid
        self.volume = grid[0] * grid[1] * grid[2]
        self.size = FORMATS[name].size
        self.mono = name == "mono1"
        self.voxels = {}
        self.palette = bytearray(DEFAULT_PALETTE)
        self.pen = 1 if self.mono else 256**self.size - 1
        self.cursor = 0

    def write(self) -> None:
        self.voxels[self.cursor] = self.pen
        self.cursor += 1

    def chain(self, octant: int, crumbs: list[int]) -> None:
        nx, ny, _ = self.grid
        place = [self.cursor % nx, self.cursor // nx % ny, self.cursor // nx // ny]
        self.voxels[self.cursor] = self.pen
        main = octant // 8
        for crumb in crumbs:
            for axis, moves in (
                (main, 1),
                ((main + 1) % 3, crumb & 1),
                ((main + 2) % 3, crumb >> 1),
            ):
                if moves:
                    place[axis] += -1 if octant % 8 >> axis & 1 else 1
            assert all(0 <= place[k] < self.grid[k] for k in range(3))
            self.cursor = place[0] + nx * (place[1] + ny * place[2])
            self.voxels[self.cursor] = self.pen

    def at(self, index: int) -> tuple[int, int, int]:
        nx, ny, _ = self.grid
        return index % nx, index // nx % ny, index // nx // ny

    def index(self, place: Sequence[int]) -> int:
        x, y, z = place
        assert all(0 <= a < side for a, side in zip(place, self.grid, strict=True))
        return x + self.grid[0] * (y + self.grid[1] * z)

    def line(self, target: tuple[int, int, int]) -> None:
        p = self.at(self.cursor)
        d = [b - a for a, b in zip(p, target, strict=True)]
        length = max(map(abs, d))
        for k in range(length + 1):
            voxel = [
                a + (2 * k * da + length) // (2 * length) if length else a
                for a, da in zip(p, d, strict=True)
            ]
            self.voxels[self.index(voxel)] = self.pen
        self.cursor = self.index(target)

    def box(self, target: tuple[int, int, int]) -> None:
        (x, u), (y, v), (z, w) = (
            sorted(pair) for pair in zip(self.at(self.cursor), target, strict=True)
        )
        for k, j, i in product(range(z, w + 1), range(y, v + 1), range(x, u + 1)):
            self.voxels[self.index((i, j, k))] = self.pen
        self.cursor = self.index(target)

    def pixels(self) -> bytes:
        return b"".join(
            self.voxels.get(i, 0).to_bytes(self.size, "little") for i in range(self.volume)
        )


def counted_op(op: int, count: int) -> bytes:
    if count < 32:
        return bytes((op | count - 1,))
    out = [op | 31]
    count -= 32
    while True:
        out.append(count % 128 | (128 if count >= 128 else 0))
        count //= 128
        if not count:
            return bytes(out)


def random_ops(rng: random.Random, plain: VoxelwiseDecoder, name: str) -> bytes:
    """Return random ops, and draw them by a voxelwise decoder."""
    out = b""
    for _ in range(rng.randrange(1, 12)):
        room = plain.volume - plain.cursor
        count = min(rng.choice((1, rng.randrange(1, 40), 32, 160)), room)
        kinds = ["pen", "move", "step", "from", "skip", "run", "lit", "line", "box", "dots", "oct"]
        kind = rng.choice(kinds + ["diff", "colors"] * (name == "index8"))
        if kind == "colors":
            first = rng.randrange(256)
            colors = rng.randbytes(3 * rng.randrange(1, min(5, 257 - first)))
            plain.palette[3 * first : 3 * first + len(colors)] = colors
            out += bytes((6, first, len(colors) // 3 - 1)) + colors
        elif kind == "dots":
            places = [random_dot(rng, plain) for _ in range(rng.choice((1, 2, 256)))]
            out += bytes((5, len(places) - 1)) + b"".join(places)
        elif kind == "oct":
            out += random_oct(rng, plain)
        elif kind in ("line", "box") and count:
            target = plain.at(rng.randrange(plain.volume))
            (plain.line if kind == "line" else plain.box)(target)
            out += bytes((3 if kind == "line" else 4,)) + coordinates(plain, target)
        elif kind == "pen":
            plain.pen = random_pixel(rng, plain)
            out += b"\x01" + plain.pen.to_bytes(plain.size, "little")
        elif not count or kind in ("move", "from"):
            place = random_place(rng, plain)
            chain = random_chain(rng, plain) if kind == "from" else None
            out += bytes((0x40 | chain[0],)) + place + chain[1] if chain else b"\x02" + place
        elif kind == "step":
            chain = random_chain(rng, plain)
            out += bytes((0x20 | chain[0],)) + chain[1] if chain else b""
        else:
            out += random_run(rng, plain, kind, count)
    return out + rng.choice((b"", b"\0", b"\0\0\0"))


def random_pixel(rng: random.Random, plain: VoxelwiseDecoder) -> int:
    return rng.randrange(2 if plain.mono else 256**plain.size)


def random_place(rng: random.Random, plain: VoxelwiseDecoder) -> bytes:
    plain.cursor = rng.randrange(plain.volume)
    return coordinates(plain, plain.at(plain.cursor))


def random_dot(rng: random.Random, plain: VoxelwiseDecoder) -> bytes:
    place = random_place(rng, plain)
    plain.voxels[plain.cursor] = plain.pen
    return place


def coordinates(plain: VoxelwiseDecoder, place: Sequence[int]) -> bytes:
    width = 1 if max(plain.grid) <= 256 else 2
    return b"".join(axis.to_bytes(width, "little") for axis in place)


def random_oct(rng: random.Random, plain: VoxelwiseDecoder) -> bytes:
    """Return a random OCT with at least one voxel on the grid, node by node."""
    level = rng.randrange(5)
    seed = plain.at(rng.randrange(plain.volume))
    origin = [axis >> level << level for axis in seed]
    out = bytes((0x60 | level,)) + coordinates(plain, [axis >> level for axis in seed])
    nodes = [origin]
    chance = rng.random()
    for j in range(level, 0, -1):
        half = 1 << j - 1
        following = []
        for node in nodes:
            end = [a + 2 * half <= side for a, side in zip(node, plain.grid, strict=True)]
            if all(end) and rng.random() < 0.2:
                out += b"\0"
                for k, b, a in product(range(2 * half), repeat=3):
                    plain.voxels[plain.index((node[0] + a, node[1] + b, node[2] + k))] = plain.pen
                continue
            children = []
            for c in range(8):
                child = [a + half * (c >> k & 1) for k, a in enumerate(node)]
                seeded = all(a <= s < a + half for a, s in zip(child, seed, strict=True))
                on_grid = all(a < side for a, side in zip(child, plain.grid, strict=True))
                if on_grid and (seeded or rng.random() < chance):
                    children.append((c, child))
            if not children:  # the node's first child is on the grid, for the node is
                children = [(0, node)]
            out += bytes((sum(1 << c for c, _ in children),))
            following += [child for _, child in children]
        nodes = following
    for voxel in nodes:
        plain.voxels[plain.index(voxel)] = plain.pen
    return out


def random_run(rng: random.Random, plain: VoxelwiseDecoder, kind: str, count: int) -> bytes:
    if kind == "skip":
        plain.cursor += count
        return counted_op(0x80, count)
    if kind == "run":
        for _ in range(count):
            plain.write()
        return counted_op(0xA0, count)
    if kind == "diff":
        steps = [rng.randrange(-8, 8) for _ in range(count)]
        for step in steps:
            plain.pen = (plain.pen + step) % 256
            plain.write()
        nibbles = sum((step & 15) << 4 * k for k, step in enumerate(steps))
        return counted_op(0xE0, count) + nibbles.to_bytes((count + 1) // 2, "little")
    values = [random_pixel(rng, plain) for _ in range(count)]
    for plain.pen in values:
        plain.write()
    if plain.mono:
        bits = sum(value << k for k, value in enumerate(values))
        return counted_op(0xC0, count) + bits.to_bytes((count + 7) // 8, "little")
    return counted_op(0xC0, count) + b"".join(v.to_bytes(plain.size, "little") for v in values)


def random_chain(rng: random.Random, plain: VoxelwiseDecoder) -> tuple[int, bytes] | None:
    nx, ny, _ = plain.grid
    place = [plain.cursor % nx, plain.cursor // nx % ny, plain.cursor // nx // ny]
    octant = rng.randrange(24)
    main = octant // 8
    room = [place[k] if octant % 8 >> k & 1 else plain.grid[k] - 1 - place[k] for k in range(3)]
    count = min(room[main], rng.randrange(1, 257))
    if not count:
        return None
    crumbs = []
    for _ in range(count):
        crumb = 0
        for bit in (0, 1):
            axis = (main + 1 + bit) % 3
            if room[axis] and rng.random() < 0.5:
                room[axis] -= 1
                crumb |= 1 << bit
        crumbs.append(crumb)
    plain.chain(octant, crumbs)
    packed = sum(crumb << 2 * k for k, crumb in enumerate(crumbs))
    return octant, bytes((count - 1,)) + packed.to_bytes((count + 3) // 4, "little")

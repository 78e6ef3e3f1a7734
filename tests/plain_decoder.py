"""Plain decoder of ops, transcribed from protocol.md, section 7, for valid input.

Independent of the emulator: two readings of one document.
"""

from __future__ import annotations

import itertools

OCT_CHILDREN = [(c & 1, c >> 1 & 1, c >> 2) for c in range(8)]


class PlainDecoder:
    """A page to which payloads are applied; records the ops and the voxels written."""

    def __init__(self, grid, pixel_bytes, full, *, mono=False, page=None):
        self.grid, self.pixel_bytes, self.full, self.mono = tuple(grid), pixel_bytes, full, mono
        nx, ny, nz = self.grid
        self.page = list(page) if page is not None else [0] * (nx * ny * nz)
        self.palette = {}  # entries that were set
        self.ops = []  # names of all ops
        self.wrote = {}  # index -> pixels of the payload before
        self.two_pixels = set()  # voxels that got two pixels in two payloads

    def draw(self, payload):
        """Apply the ops of one payload."""
        self.data, self.at, self.cursor, self.pen = payload, 0, 0, self.full
        self.fading, self.again = None, False
        self.now = {}
        while self.at < len(payload):
            self.op()
        assert self.at == len(payload), "the last op is cut off"
        for index, pixel in self.now.items():
            if self.wrote.setdefault(index, pixel) != pixel:
                self.two_pixels.add(index)

    # -- operands

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def take(self, count):
        self.at += count
        assert self.at <= len(self.data), "an op is cut off"
        return self.data[self.at - count : self.at]

    def pixel(self):
        return int.from_bytes(self.take(self.pixel_bytes), "little")

    def xyz(self):
        size = 1 if max(self.grid) <= 256 else 2
        return tuple(int.from_bytes(self.take(size), "little") for _ in range(3))

    def count(self, op):
        if op & 31 < 31:
            return (op & 31) + 1
        rest, shift = 0, 0
        while True:
            byte = self.byte()
            rest |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                assert byte or shift == 7, "not the shortest"
                return 32 + rest

    # -- places

    def index(self, place):
        assert all(0 <= c < side for c, side in zip(place, self.grid, strict=True)), "outside"
        x, y, z = place
        nx, ny, _ = self.grid
        return x + nx * (y + ny * z)

    def place(self):
        nx, ny, nz = self.grid
        assert self.cursor < nx * ny * nz, "behind the end"
        return self.cursor % nx, self.cursor // nx % ny, self.cursor // nx // ny

    def write(self, index, pixel):
        assert not self.mono or pixel in (0, 1)
        self.page[index] = pixel
        self.now[index] = pixel

    # -- ops

    def op(self):
        op = self.byte()
        group = op & 0xE0
        names = {0x20: "STEP", 0x40: "FROM", 0x60: "OCT", 0x80: "SKIP", 0xA0: "RUN", 0xC0: "LIT",
                 0xE0: "DIFF"}  # fmt: skip
        low = ["END", "PEN", "MOVE", "LINE", "BOX", "DOTS", "COLORS", "HOLD", "FADE", "RAMP"]
        name = names[group] if group else low[op]
        self.ops.append(name)
        methods = {"PEN": self.set_pen, "FROM": self.go_from}
        methods.get(name, getattr(self, name.lower(), None))(op)
        if name in {"PEN", "LIT", "DIFF"}:
            self.fading = None
        if name not in {"OCT", "COLORS", "RAMP", "PEN", "HOLD"}:
            self.again = self.fading is not None and name in {"STEP", "FROM", "LINE", "DOTS"}

    def hold(self, _op):
        self.byte()

    # -- fades: [number of voxels, colours, place]

    def leb128(self):
        number, shift = 0, 0
        while True:
            byte = self.byte()
            number |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                assert byte or shift == 7, "not the shortest"
                return number

    def blend(self, n, colors, j):
        m = max(n - 1, 1)
        s, r = divmod(j * (len(colors) - 1), m)
        pairs = zip(colors[s], colors[min(s + 1, len(colors) - 1)], strict=True)
        return [a + (2 * r * (b - a) + m) // (2 * m) for a, b in pairs]

    def fade(self, _op):
        k, n, i = self.byte() + 1, self.leb128() + 1, self.leb128()
        size = 1 if self.pixel_bytes == 1 else 3
        colors = [self.take(size) for _ in range(k)]
        assert i < n <= 1 << 20
        assert not self.mono
        self.fading = [n, colors, i]
        self.pen = self.pen_at(i)

    def pen_at(self, place):
        n, colors, _ = self.fading
        channels = self.blend(n, colors, min(place, n - 1))
        if self.pixel_bytes == 2:
            r, g, b = (
                (2 * t * c + 255) // 510 for t, c in zip((31, 63, 31), channels, strict=True)
            )
            return r << 11 | g << 5 | b
        return sum(channel << 8 * at for at, channel in enumerate(channels))

    def write_next(self, index, *, again=False):
        """Write a voxel that a fade counts."""
        if self.fading is None:
            self.write(index, self.pen)
            return
        n, _, place = self.fading
        self.write(index, self.pen_at(place - again))
        self.fading[2] = place if again else min(place + 1, n)
        self.pen = self.pen_at(self.fading[2])

    def ramp(self, _op):
        first, m, k = self.byte(), self.byte() + 1, self.byte() + 1
        colors = [self.take(3) for _ in range(k)]
        assert first + m <= 256
        for j in range(m):
            self.palette[first + j] = tuple(self.blend(m, colors, j))

    def end(self, _op):
        assert not any(self.take(len(self.data) - self.at))

    def set_pen(self, _op):
        self.pen = self.pixel()

    def move(self, _op):
        self.cursor = self.index(self.xyz())

    def line(self, _op):
        p, q = self.place(), self.xyz()
        d = [b - a for a, b in zip(p, q, strict=True)]
        length = max(map(abs, d))
        for k in range(length + 1):
            at = [a + (2 * k * e + length) // (2 * length) if length else a
                  for a, e in zip(p, d, strict=True)]  # fmt: skip
            self.write_next(self.index(at), again=self.again and not k)
        self.cursor = self.index(q)

    def box(self, _op):
        p, q = self.place(), self.xyz()
        sides = [range(min(a, b), max(a, b) + 1) for a, b in zip(p, q, strict=True)]
        for at in itertools.product(*sides):
            self.write(self.index(at), self.pen)
        self.cursor = self.index(q)

    def dots(self, _op):
        for _ in range(self.byte() + 1):
            self.cursor = self.index(self.xyz())
            self.write_next(self.cursor)

    def colors(self, _op):
        first, count = self.byte(), self.byte() + 1
        assert first + count <= 256
        for entry in range(first, first + count):
            self.palette[entry] = tuple(self.take(3))

    def step(self, op):
        octant = op & 31
        assert octant < 24
        main = octant >> 3
        sign = [-1 if octant >> axis & 1 else 1 for axis in range(3)]
        at = list(self.place())
        steps = self.byte() + 1
        crumbs = self.take(-(-steps // 4))
        self.write_next(self.index(at), again=self.again)
        for k in range(4 * len(crumbs)):
            crumb = crumbs[k // 4] >> 2 * (k % 4) & 3
            if k >= steps:
                assert crumb == 0, "padding"
                continue
            at[main] += sign[main]
            for bit, axis in enumerate(((main + 1) % 3, (main + 2) % 3)):
                at[axis] += sign[axis] * (crumb >> bit & 1)
            self.write_next(self.index(at))
        self.cursor = self.index(at)

    def go_from(self, op):
        self.move(op)
        self.again = False
        self.step(op)

    def oct(self, op):
        level = op & 31
        assert level <= 4
        nodes = [tuple(c << level for c in self.xyz())]
        while level:
            children = []
            for node in nodes:
                mask = self.byte()
                half = 1 << level - 1
                if mask == 0:
                    for at in itertools.product(range(2 * half), repeat=3):
                        self.write(self.index([a + b for a, b in zip(node, at, strict=True)]),
                                   self.pen)  # fmt: skip
                children += [
                    tuple(a + half * b for a, b in zip(node, child, strict=True))
                    for c, child in enumerate(OCT_CHILDREN)
                    if mask >> c & 1
                ]
            nodes, level = children, level - 1
        for node in nodes:
            self.write(self.index(node), self.pen)

    def skip(self, op):
        self.cursor += self.count(op)
        assert self.cursor <= len(self.page)

    def run(self, op):
        for _ in range(self.count(op)):
            self.write(self.cursor, self.pen)
            self.cursor += 1

    def lit(self, op):
        n = self.count(op)
        if self.mono:
            bits = int.from_bytes(self.take(-(-n // 8)), "little")
            assert bits >> n == 0, "padding"
            pixels = [bits >> k & 1 for k in range(n)]
        else:
            pixels = [self.pixel() for _ in range(n)]
        for self.pen in pixels:
            self.write(self.cursor, self.pen)
            self.cursor += 1

    def diff(self, op):
        n = self.count(op)
        data = self.take(-(-n // 2))
        nibbles = [nibble for byte in data for nibble in (byte & 15, byte >> 4)]
        assert not any(nibbles[n:]), "padding"
        for nibble in nibbles[:n]:
            self.pen = (self.pen + (nibble ^ 8) - 8) % 256
            self.write(self.cursor, self.pen)
            self.cursor += 1

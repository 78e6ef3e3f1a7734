"""Range-coded slabs (op SLABS, section 7.11 of protocol.md), in their simplest form.

The model of boxes, cells and voxels is written once for both directions, as in
`range_coded_chains`: a coder takes the value to encode and returns the value coded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.range_coded_chains import Coder, Decoder, Encoder, Models
from voxdisplay.wire import spec

_CELL = spec.SLABS_CELL
_BLANK, _MIXED, _FULL = 0, 1, 2
Cell = tuple[int, int]  # x, y of a cell within its slab
Place = tuple[int, int]  # x, y of a voxel within its slice


def slabs_models() -> Models:
    """Return the models of an op, as it begins."""
    return Models(spec.SLABS_MODELS, spec.SLABS_PACE, spec.SLABS_ENOUGH)


@dataclass(slots=True)
class Slab:
    """What a slab lights: its cells by state, and its voxels by slice.

    Whatever is not named is blank and dark.
    """

    cells: dict[Cell, int] = field(default_factory=dict)
    slices: list[set[Place]] = field(default_factory=lambda: [set() for _ in range(_CELL)])

    @classmethod
    def of(cls, voxels: set[Voxel], corner: Voxel, w: int, h: int) -> Slab:
        """Return the slab of a box whose first voxel is at ``corner``, of a set of voxels."""
        slab = cls()
        for x in range(_CELL * w):
            for y in range(_CELL * h):
                for a in range(_CELL):
                    if (corner[0] + x, corner[1] + y, corner[2] + a) in voxels:
                        slab.slices[a].add((x, y))
        for i in range(w):
            for j in range(h):
                lit = sum(place in part for part in slab.slices for place in _places(i, j))
                if lit:
                    slab.cells[i, j] = _FULL if lit == _CELL**3 else _MIXED
        return slab


def _places(i: int, j: int) -> list[Place]:
    """Return the places of a cell in a slice."""
    return [(_CELL * i + x, _CELL * j + y) for y in range(_CELL) for x in range(_CELL)]


def _bits(facts: list[bool]) -> int:
    """Return the number that has these facts as its bits, the first in bit 0."""
    return sum(int(fact) << n for n, fact in enumerate(facts))


def flag_context(i: int, j: int, now: dict[Cell, int], before: Slab) -> int:
    """Return c of FLAG."""
    base = before.slices[-1]
    beside = [(i - 1, j), (i, j - 1), (i - 1, j - 1), (i + 1, j - 1)]
    under = [(i, j), (i + 1, j), (i, j + 1)]
    return _bits(
        [now.get(cell, _BLANK) != _BLANK for cell in beside]
        + [any(place in base for place in _places(*cell)) for cell in under]
        + [before.cells.get((i, j), _BLANK) != _BLANK]
    )


def full_context(i: int, j: int, now: dict[Cell, int], before: Slab) -> int:
    """Return e of FULL."""
    base = before.slices[-1]
    under = [(i, j), (i + 1, j), (i, j + 1)]
    return _bits(
        [now.get(cell) == _FULL for cell in ((i - 1, j), (i, j - 1))]
        + [all(place in base for place in _places(*cell)) for cell in under]
        + [now.get((i + 1, j - 1)) == _FULL]
    )


def surroundings(x0: int, y: int, now: set[Place], below: set[Place]) -> list[bool]:
    """Return which of the 25 voxels around a group are lit."""
    span = range(x0 - 1, x0 + _CELL + 1)
    return (
        [(x, y - 1) in now for x in span]
        + [(x, row) in below for row in (y - 1, y, y + 1) for x in span]
        + [(x0 - 1, y) in now]
    )


def shape_context(x: int, y: int, now: set[Place], below: set[Place]) -> int:
    """Return c of SHAPE."""
    return _bits(
        [(x + dx, y - 1) in now for dx in (-1, 0, 1)]
        + [(x + dx, y) in below for dx in (-1, 0, 1)]
        + [(x + dx, y + 1) in below for dx in (-1, 0, 1)]
        + [(x, y - 1) in below, (x - 1, y) in now]
    )


def _code_cells(coder: Coder, size: tuple[int, int], slab: Slab, before: Slab, want: Slab) -> None:
    w, h = size
    for j in range(h):
        for i in range(w):
            state = want.cells.get((i, j), _BLANK)
            c = flag_context(i, j, slab.cells, before)
            if coder.bit(spec.SLABS_FLAG + c, want=int(state != _BLANK)):
                e = full_context(i, j, slab.cells, before)
                full = coder.bit(spec.SLABS_FULL + e, want=int(state == _FULL))
                slab.cells[i, j] = _FULL if full else _MIXED


def code_slab(
    coder: Coder, w: int, h: int, before: Slab, want: Slab
) -> Iterator[tuple[int, Place, Slab]]:
    """Code a slab; yield a, (x, y) of each lit voxel and the slab so far, after its group."""
    slab = Slab()
    _code_cells(coder, (w, h), slab, before, want)
    for a in range(_CELL):
        now, below = slab.slices[a], slab.slices[a - 1] if a else before.slices[-1]
        for y in range(_CELL * h):
            for i in range(w):
                state = slab.cells.get((i, y // _CELL), _BLANK)
                group = [(_CELL * i + x, y) for x in range(_CELL)]
                if state == _FULL:
                    now.update(group)
                elif state == _MIXED:
                    east = slab.cells.get((i + 1, y // _CELL), _BLANK) != _BLANK
                    _code_group(coder, group, (now, below), y % 4 + 4 * a + 32 * east, want, a)
                for place in group:
                    if place in now:
                        yield a, place, slab
    # A slab without a lit voxel says so, too.
    yield -1, (0, 0), slab


def _code_group(
    coder: Coder,
    group: list[Place],
    slices: tuple[set[Place], set[Place]],
    model: int,
    want: Slab,
    a: int,
) -> None:
    now, below = slices
    around = surroundings(*group[0], now, below)
    wanted = [place in want.slices[a] for place in group]
    if all(around) or not any(around):
        q = all(around)
        differs = any(lit != q for lit in wanted)
        if not coder.bit(spec.SLABS_GROUP + model + 16 * q, want=int(differs)):
            if q:
                now.update(group)
            return
    for place, lit in zip(group, wanted, strict=True):
        if coder.bit(spec.SLABS_SHAPE + shape_context(*place, now, below), want=int(lit)):
            now.add(place)


def _cells_of(device: AnnouncedDevice) -> list[int]:
    return [-(-side // _CELL) for side in device.grid]


@dataclass(frozen=True, slots=True)
class PlacedSlab:
    """A slab as it was decoded: x, y, z of its first voxel, and whether a box begins with it."""

    corner: Voxel
    first: bool
    slab: Slab

    def voxels(self) -> Iterator[Voxel]:
        """Yield its lit voxels: slice by slice, row by row."""
        x, y, z = self.corner
        for a, part in enumerate(self.slab.slices):
            for j, i in sorted((j, i) for i, j in part):
                yield x + i, y + j, z + a


def decode(
    data: bytes, device: AnnouncedDevice, refusal: Callable[[int], Exception]
) -> Iterator[Voxel]:
    """Yield the voxels of a SLABS.

    Parameters
    ----------
    data : bytes
        The bytes behind the op byte.
    device : AnnouncedDevice
    refusal : callable
        Takes a code of section 11 and returns the exception to raise.
    """
    coder = Decoder(data, refusal, slabs_models())
    for placed in decode_boxes(coder, device, refusal, spec.SLABS_SIDE_BITS):
        yield from placed.voxels()


def decode_boxes(
    coder: Decoder, device: AnnouncedDevice, refusal: Callable[[int], Exception], side_bits: int
) -> Iterator[PlacedSlab]:
    """Yield the slabs of all boxes to the end of an op; all of their voxels are on the grid."""
    cells = _cells_of(device)
    left = cells[0] * cells[1] * cells[2]
    while coder.bit(spec.SLABS_MORE):
        i, j, k = (coder.plain((count - 1).bit_length()) for count in cells)
        w, h = (1 + coder.plain(side_bits) for _ in range(2))
        slab, first, following = Slab(), True, 1
        while following:
            left -= w * h
            if left < 0:
                raise refusal(spec.CODE_OUTSIDE)
            corner = (_CELL * i, _CELL * j, _CELL * k)
            for a, (x, y), now in code_slab(coder, w, h, slab, Slab()):
                if a < 0:
                    slab = now
                elif not device.contains(corner[0] + x, corner[1] + y, corner[2] + a):
                    raise refusal(spec.CODE_OUTSIDE)
            yield PlacedSlab(corner, first, slab)
            k, first = k + 1, False
            following = coder.bit(spec.SLABS_NEXT)
    coder.end()


@dataclass(frozen=True, slots=True)
class Box:
    """A box to encode: cells of its corner, cells in x and y, slabs."""

    cell: Voxel
    w: int
    h: int
    slabs: int


def encode(device: AnnouncedDevice, voxels: set[Voxel], boxes: list[Box]) -> bytes:
    """Return the op SLABS that draws the voxels that are in boxes."""
    coder = Encoder(slabs_models())
    for _ in encode_boxes(coder, device, voxels, boxes, spec.SLABS_SIDE_BITS):
        pass
    return bytes((spec.OP_SLABS,)) + coder.end()


def encode_boxes(
    coder: Encoder,
    device: AnnouncedDevice,
    voxels: set[Voxel],
    boxes: list[Box],
    side_bits: int,
) -> Iterator[PlacedSlab]:
    """Encode the voxels that are in boxes; yield each slab, after which more may be encoded."""
    for box in boxes:
        coder.bit(spec.SLABS_MORE, want=1)
        for place, count in zip(box.cell, _cells_of(device), strict=True):
            coder.plain((count - 1).bit_length(), place)
        for side in (box.w, box.h):
            coder.plain(side_bits, side - 1)
        i, j, k = box.cell
        before = Slab()
        for number in range(box.slabs):
            if number:
                coder.bit(spec.SLABS_NEXT, want=1)
            corner = (_CELL * i, _CELL * j, _CELL * (k + number))
            want = Slab.of(voxels, corner, box.w, box.h)
            for _ in code_slab(coder, box.w, box.h, before, want):
                pass
            yield PlacedSlab(corner, not number, want)
            before = want
        coder.bit(spec.SLABS_NEXT)
    coder.bit(spec.SLABS_MORE)

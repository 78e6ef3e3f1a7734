"""Typical bugs of devices, as decoders: each misreads one rule of section 7.

When a picture is wrong, the same ops are drawn by each of these. The decoder whose picture equals
the device's names the likely cause, by its docstring. Nothing here decides whether a check holds.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from voxdisplay.conformance.announced_device import AnnouncedDevice, Voxel
from voxdisplay.conformance.reference_decoder import ReferenceDecoder, Refused
from voxdisplay.conformance.reference_page import Page, mix
from voxdisplay.wire import spec


class XandYSwapped(ReferenceDecoder):
    """The axes x and y are swapped."""

    def coordinates(self, a: int, b: int, c: int) -> Voxel:
        return b, a, c


class YandZSwapped(ReferenceDecoder):
    """The axes y and z are swapped."""

    def coordinates(self, a: int, b: int, c: int) -> Voxel:
        return a, c, b


class XandZSwapped(ReferenceDecoder):
    """The axes x and z are swapped."""

    def coordinates(self, a: int, b: int, c: int) -> Voxel:
        return c, b, a


class PenNotReset(ReferenceDecoder):
    """The pen is not reset to the full pixel at the start of a packet."""

    def begin_packet(self) -> None:
        self.cursor = 0


class CursorNotReset(ReferenceDecoder):
    """The cursor is not reset to 0 at the start of a packet."""

    def begin_packet(self) -> None:
        self.pen = self.device.full_pixel


class OctantSigns(ReferenceDecoder):
    """The octant's bits 0..2 mean that an axis falls: here they were taken for rising."""

    def axes_of(self, octant: int) -> tuple[int, tuple[int, int, int]]:
        return super().axes_of(octant ^ 7)


class OctantBitsReversed(ReferenceDecoder):
    """The octant's bit 0 is for x and bit 2 for z: here it was the other way round."""

    def axes_of(self, octant: int) -> tuple[int, tuple[int, int, int]]:
        main, (x, y, z) = super().axes_of(octant)
        return main, (z, y, x)


class MainAxisReversed(ReferenceDecoder):
    """The main axis is octant div 8 = 0, 1, 2 for x, y, z: here it was z, y, x."""

    def axes_of(self, octant: int) -> tuple[int, tuple[int, int, int]]:
        main, signs = super().axes_of(octant)
        return 2 - main, signs


class CrumbBitsSwapped(ReferenceDecoder):
    """A crumb's bit 0 is for axis main + 1 and bit 1 for axis main + 2: here they were swapped."""

    def chain_axes(self, crumb: int, main: int) -> set[int]:
        return super().chain_axes(crumb >> 1 | (crumb & 1) << 1, main)


class CrumbsNotCyclic(ReferenceDecoder):
    """A crumb's axes are main + 1 and main + 2 modulo 3, not the other two in the order x, y, z."""

    def chain_axes(self, crumb: int, main: int) -> set[int]:
        others = [axis for axis in range(3) if axis != main]
        return {main} | {others[bit] for bit in (0, 1) if crumb >> bit & 1}


class HighPartsFirst(ReferenceDecoder):
    """Crumbs, nibbles and MONO1 pixels begin in a byte's lowest bits: here in its highest."""

    def unpack_bits(self, raw: bytes, count: int, bits: int) -> list[int]:
        per_byte = 8 // bits
        whole = super().unpack_bits(raw, len(raw) * per_byte, bits)
        return [whole[i // per_byte * per_byte + per_byte - 1 - i % per_byte] for i in range(count)]


class StepTooFew(ReferenceDecoder):
    """A chain's byte is n - 1: here it was taken for n, and the last step is missing."""

    def steps_of(self, byte: int) -> int:
        return byte


class ChainStartLeftOut(ReferenceDecoder):
    """A chain writes the voxel at the cursor too, before its first step."""

    def chain_start(self, at: Voxel) -> list[Voxel]:
        del at
        return []


class ChainCursorStays(ReferenceDecoder):
    """After a chain the cursor is at its last voxel: here it stayed at the first."""

    def after_chain(self, begin: Voxel, end: Voxel) -> Voxel:
        del end
        return begin


class ShapeCursorStays(ReferenceDecoder):
    """After LINE, BOX and DOTS the cursor is at the voxel named last: here it stayed."""

    def after_shape(self, begin: Voxel, end: Voxel) -> Voxel:
        del end
        return begin


class BrickMovesCursor(ReferenceDecoder):
    """OCT leaves the cursor where it is: here it moved to the brick."""

    def after_brick(self, cursor: int, corner: int) -> int:
        del cursor
        return corner


class CountTooSmall(ReferenceDecoder):
    """The count is n = c + 1 and n = 32 + k: here it was taken one too small."""

    def count_of(self, low: int) -> int:
        return super().count_of(low) - 1


class LongCountFrom31(ReferenceDecoder):
    """A count with LEB128 is n = 32 + k: here it was 31 + k."""

    def count_of(self, low: int) -> int:
        return super().count_of(low) - (low == 31)


class LiteralLeavesPen(ReferenceDecoder):
    """After LIT the pen is the last of its pixels: here it was left as it was."""

    def after_literal(self, before: int, last: int) -> int:
        del last
        return before


class PixelsBigEndian(ReferenceDecoder):
    """A pixel's bytes come lowest first: here they were taken highest first."""

    def pixel_of(self, raw: bytes) -> int:
        return int.from_bytes(raw, "big")


class LineTiesDown(ReferenceDecoder):
    """LINE rounds up from the middle: here it rounded down."""

    def rounded(self, k: int, d: int, length: int) -> int:
        return -super().rounded(k, -d, length)


class LineTiesAwayFromZero(ReferenceDecoder):
    """LINE rounds up from the middle, also for a negative d: here it rounded away from 0."""

    def rounded(self, k: int, d: int, length: int) -> int:
        value = super().rounded(k, abs(d), length)
        return value if d > 0 else -value


class LineTruncates(ReferenceDecoder):
    """LINE divides by floor, towards minus infinity: here the division cut towards 0."""

    def rounded(self, k: int, d: int, length: int) -> int:
        top = 2 * k * d + length
        return (abs(top) // (2 * length) * (1 if top > 0 else -1)) if length else 0


class BoxHalfOpen(ReferenceDecoder):
    """BOX includes the larger coordinate on each axis: here it was left out."""

    def span(self, a: int, b: int) -> range:
        low, high = sorted((a, b))
        return range(low, max(low + 1, high))


class ChildrenReversed(ReferenceDecoder):
    """A brick's child bit is c = cx + 2 cy + 4 cz: here x and z were swapped."""

    def child(self, bit: int) -> Voxel:
        x, y, z = super().child(bit)
        return z, y, x


class DifferenceUnsigned(ReferenceDecoder):
    """A DIFF's nibble is -8 to 7, in two's complement: here it was 0 to 15."""

    def difference(self, nibble: int) -> int:
        return nibble


DEVICE_BUGS: tuple[type[ReferenceDecoder], ...] = tuple(
    sorted(
        (cls for cls in ReferenceDecoder.__subclasses__() if cls.__module__ == __name__),
        key=lambda cls: list(globals()).index(cls.__name__),
    )
)


def pages_by_bug(
    device: AnnouncedDevice, base: Page, payloads: list[bytes]
) -> Iterator[tuple[str, Page]]:
    """Yield the description of each bug, and the page that it makes of some payloads."""
    for bug in DEVICE_BUGS:
        decoder = bug(device, base.copy())
        try:
            for payload in payloads:
                decoder.draw(payload)
        except Exception:  # noqa: BLE001, S112 - what a bug makes of the ops may fail anyhow
            continue
        yield (bug.__doc__ or "").strip(), decoder.page


def refusals_by_bug(device: AnnouncedDevice, payload: bytes) -> Iterator[tuple[str, int, int]]:
    """Yield the bugs that refuse a payload: description, error code and offset of the refusal."""
    for bug in DEVICE_BUGS:
        try:
            bug(device, Page()).draw(payload)
        except Refused as refused:
            yield (bug.__doc__ or "").strip(), refused.code, refused.at
        except Exception:  # noqa: BLE001, S112 - what a bug makes of the ops may fail anyhow
            continue


def pages_by_scan_order(device: AnnouncedDevice, page: Page) -> Iterator[tuple[str, Page]]:
    """Yield each wrong scan order, and the page that it makes of the right one."""
    names = "xyz"
    for order in itertools.permutations(range(3)):
        if order == (0, 1, 2):
            continue
        a, b, c = order
        pixels = {}
        for index, value in page.pixels.items():
            at = device.voxel_at(index)
            pixels[at[a] + device.grid[a] * (at[b] + device.grid[b] * at[c])] = value
        runs = f"{names[a]} runs fastest, then {names[b]}, then {names[c]}"
        yield f"scan order is x fastest, then y, then z: here {runs}", Page(pixels)


def digests_by_bug(device: AnnouncedDevice, page: Page, before: Page) -> Iterator[tuple[int, str]]:
    """Yield wrong digests of a page, each with the bug that computes it."""
    right = page.digest(device)
    old = before.digest(device)
    if device.has("PALETTE"):
        without = Page(page.pixels)
        yield without.digest(device), "the palette is not in the digest"
        whole = sum(mix(device.voxel_count + i, 0x1000000 + c) for i, c in enumerate(page.palette))
        yield (
            (without.digest(device) + whole) & 0xFFFFFFFF,
            "entries of the default palette count too",
        )
    if device.voxel_count <= 1 << 20:
        dark = sum(mix(i, 0) for i in range(device.voxel_count) if i not in page.pixels)
        yield (
            (right + dark) & 0xFFFFFFFF,
            "the digest adds dark voxels: only lit ones count",
        )
    yield (
        old,
        "this is the digest of the picture before: it must be that of the page shown by the swap",
    )
    yield (right + old) & 0xFFFFFFFF, "the terms of the picture before are still in the digest"
    yield ~right & 0xFFFFFFFF, "the digest is inverted"
    places = {i: device.voxel_at(i) for i in page.pixels}
    _, ny, nz = device.grid
    zyx = sum(mix(z + nz * (y + ny * x), page.pixels[i]) for i, (x, y, z) in places.items())
    yield zyx & 0xFFFFFFFF, "the index runs along z first: it must run along x, then y, then z"
    if device.pixel_bytes > 1:
        size = device.pixel_bytes
        big = sum(
            mix(i, int.from_bytes(v.to_bytes(size, "little"), "big"))
            for i, v in page.pixels.items()
        )
        yield big & 0xFFFFFFFF, "the digest takes a pixel's bytes highest first"
    h = [i * spec.DIGEST_MUL_INDEX + v * spec.DIGEST_MUL_VALUE for i, v in page.pixels.items()]
    yield sum(h) & 0xFFFFFFFF, "the digest uses only the first step of mix"
    lit = [mix(i, value) for i, value in page.pixels.items()]
    exclusive = 0
    for term in lit:
        exclusive ^= term
    if len(lit) > 1:
        yield (
            exclusive,
            "the terms are combined by exclusive or: the digest is their sum modulo 2^32",
        )

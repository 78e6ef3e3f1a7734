"""Reader of operands: coordinates, counts, crumbs, masks (7).

Refuses operands that are truncated or not in the specified form; knows nothing of what the ops do.
"""

from typing import Final

from firmware_sim import spec
from firmware_sim.packet_error import PacketError

OPERAND_MASK: Final = 0x1F  # the low five bits of an op byte
_COUNT_BYTES: Final = 5  # section 7.2: the longest LEB128
_COUNT_LIMIT: Final = 1 << 32  # section 7.2: n MUST be below


class Operands:
    """Read position in a packet.

    Parameters
    ----------
    packet
        Header and payload of a DATA packet.
    coordinate_size
        Number of bytes of a coordinate, 1 or 2.
    """

    def __init__(self, packet: bytes, coordinate_size: int) -> None:
        self._packet = packet
        self._coordinate_size = coordinate_size
        self._at = self._op_at = len(spec.LAYOUT_HEADER)  # its three fields have a byte each

    def op(self) -> int | None:
        """Return the next op byte; None at the end of the packet."""
        self._op_at = self._at
        if self._at >= len(self._packet):
            return None
        self._at += 1
        return self._packet[self._op_at]

    def error(self, code: int, text: str) -> PacketError:
        """Return an error at the offset of the current op."""
        return PacketError(code, self._op_at, text)

    def take(self, size: int) -> bytes:
        """Return the next ``size`` bytes."""
        start = self._at
        self._at += size
        if self._at > len(self._packet):
            raise self.error(spec.CODE_TRUNCATED, "the payload ends inside the op")
        return self._packet[start : self._at]

    def remaining(self) -> bytes:
        """Return the rest of the packet."""
        return self.take(len(self._packet) - self._at)

    def byte(self) -> int:
        """Return a u8."""
        return self.take(1)[0]

    def coordinates(self) -> tuple[int, int, int]:
        """Return the coordinates x, y, z of a voxel or brick (2)."""
        size = self._coordinate_size
        raw = self.take(3 * size)
        if size == 1:
            return raw[0], raw[1], raw[2]
        return raw[0] | raw[1] << 8, raw[2] | raw[3] << 8, raw[4] | raw[5] << 8

    def coordinate_lists(self, count: int) -> tuple[list[int], list[int], list[int]]:
        """Return the coordinates of ``count`` voxels: all x, all y, all z."""
        size = self._coordinate_size
        raw = self.take(3 * size * count)
        axes = list(raw)
        if size > 1:
            axes = [low | high << 8 for low, high in zip(raw[::2], raw[1::2], strict=True)]
        return axes[::3], axes[1::3], axes[2::3]

    def count(self, operand: int) -> int:
        """Return a count whose first part is in the op byte (7.2)."""
        if operand < OPERAND_MASK:
            return operand + 1
        count = self.leb128() + OPERAND_MASK + 1
        if count >= _COUNT_LIMIT:
            raise self.error(spec.CODE_COUNT, "the count is 2^32 or more")
        return count

    def leb128(self) -> int:
        """Return a number in the form of LEB128 (7.2)."""
        count = 0
        for k in range(_COUNT_BYTES):
            byte = self.byte()
            count |= (byte & 0x7F) << 7 * k
            if byte < 0x80:
                break
        else:
            raise self.error(spec.CODE_COUNT, "the count has more than 5 bytes")
        if k and not byte:
            raise self.error(spec.CODE_COUNT, "the count is not in its shortest form")
        return count

    def packed(self, count: int, bits: int) -> bytes:
        """Return the bytes of ``count`` numbers of 1, 2 or 4 bits; check that spare bits are 0."""
        raw = self.take((count * bits + 7) // 8)
        used = count * bits % 8
        if used and raw[-1] >> used:
            raise self.error(spec.CODE_PADDING, f"unused bits of {raw[-1]:02X} are not 0")
        return raw

"""What all coders of ops share: how coordinates, counts and ragged rows become bytes.

This is protocol.md, sections 2 and 7.2. Nothing here knows what an op draws, or where it ends up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Counts above this need a LEB128 behind the op byte (section 7.2).
SHORT_COUNT = 31
# From these counts on, the LEB128 has one byte more.
_LONGER_FROM = [SHORT_COUNT + 1 + (1 << bits if bits else 0) for bits in range(0, 35, 7)]


@dataclass(frozen=True)
class EncoderConfig:
    """What the bytes of ops depend on: the display's grid and format, and what else it announced.

    Attributes
    ----------
    grid : Grid
    format : PixelFormat
    max_payload : int
        Bytes of the longest payload.
    features : int
        The bits of INFO: bit i is feature i. No op of another feature is ever made.
    bytes_per_s : float
        What the line carries; 0 for a slow one. What takes longer to find out than it saves there
        is left undone.

    """

    grid: Grid
    format: PixelFormat
    max_payload: int
    features: int = 0
    bytes_per_s: float = 0.0

    def has(self, feature: int) -> bool:
        """Tell whether the device announced a feature, ``spec.FEATURE_...``."""
        return bool(self.features >> feature & 1)

    @property
    def coordinate_bytes(self) -> int:
        """Bytes of one coordinate (section 2)."""
        return 1 if max(self.grid) <= 256 else 2

    @property
    def position_bytes(self) -> int:
        """Bytes of the three coordinates of a MOVE or FROM."""
        return 3 * self.coordinate_bytes

    @property
    def pen_bytes(self) -> int:
        """Bytes of a PEN op."""
        return 1 + self.format.bytes

    @property
    def max_block_bytes(self) -> int:
        """Bytes of a payload that are left when its pen is set and its cursor has moved."""
        return self.max_payload - self.pen_bytes - 1 - self.position_bytes


def little_endian(values: NDArray[np.integer], size: int) -> Bytes:
    """Give values, (n,), as an (n, size) array of bytes, lowest first."""
    shifts = np.arange(size, dtype=np.uint64) * np.uint64(8)
    return (values.astype(np.uint64)[:, None] >> shifts).astype(np.uint8)


def encode_positions(voxels: NDArray[np.integer], config: EncoderConfig) -> Bytes:
    """Return coordinates of voxels, (n, 3), as (n, `EncoderConfig.position_bytes`) bytes."""
    if config.coordinate_bytes == 1:
        return voxels.astype(np.uint8)
    return little_endian(voxels.reshape(-1), 2).reshape(-1, config.position_bytes)


def counted_op_bytes(counts: NDArray[np.integer]) -> Ints:
    """Give the bytes of ops that carry counts, 1 <= count < 2**32, op byte included."""
    size = np.ones(counts.shape, dtype=np.int64)
    most = counts.max(initial=0)
    for longer in _LONGER_FROM:
        if most < longer:
            break
        size += counts >= longer
    return size


def counted_ops(op: int | Ints, counts: Ints) -> tuple[Bytes, Ints]:
    """Give ops that carry counts: an (n, 6) array of bytes, and how many of each row count."""
    size = counted_op_bytes(counts)
    out = np.empty((len(counts), 6), dtype=np.uint8)
    out[:, 0] = op | np.minimum(counts - 1, SHORT_COUNT)
    rest = np.maximum(counts - 1 - SHORT_COUNT, 0)
    for k in range(1, 6):
        out[:, k] = rest & 0x7F | (size > k + 1) << 7
        rest >>= 7
    return out, size


def concat_ranges(start: Ints, length: Ints) -> Ints:
    """Give the whole numbers of ranges, one range after another."""
    ends = np.cumsum(length)
    total = int(ends[-1]) if len(ends) else 0
    return np.asarray(np.arange(total) + np.repeat(start - (ends - length), length))

"""Encoding of operands: coordinates, counts and pixels as bytes (protocol.md, sections 2 and 7.2).

Shared by all encoders of ops. Must not know what an op draws, nor in which payload it ends up.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import whole_number
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import spec
from voxdisplay.wire.features import feature_bits

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Counts above this need a LEB128 after the op byte (section 7.2).
SHORT_COUNT = 31
# Counts from which the LEB128 is one byte longer.
_LONGER_FROM = [SHORT_COUNT + 1 + (1 << bits if bits else 0) for bits in range(0, 35, 7)]


@dataclass(frozen=True)
class EncoderConfig:
    """Properties of device and line that determine the encoding.

    Attributes
    ----------
    grid : Grid
    format : PixelFormat
    max_payload : int
        Bytes of the longest payload.
    features : int
        The bits of INFO: bit i is feature i. Ops of other features are never used.
    bytes_per_s : float
        Rate of the line; 0 for a slow one. Searches that take longer than they save on it are
        skipped.

    """

    grid: Grid
    format: PixelFormat
    max_payload: int
    features: int = 0
    bytes_per_s: float = 0.0

    @classmethod
    def of_device(
        cls,
        grid: Grid,
        format: PixelFormat,  # noqa: A002 - as the attribute
        max_payload: int,
        features: Collection[str],
        bytes_per_s: float = 0.0,
    ) -> EncoderConfig:
        """Return the properties of a device whose features are names; raise if one is none."""
        whole_number("max_payload", max_payload, spec.LIMIT_MIN_PAYLOAD, spec.LIMIT_MAX_PAYLOAD)
        return cls(grid, format, max_payload, feature_bits(features), bytes_per_s)

    def has(self, feature: int) -> bool:
        """Return whether the device announced a feature, ``spec.FEATURE_...``."""
        return bool(self.features >> feature & 1)

    @property
    def coordinate_bytes(self) -> int:
        """Bytes of one coordinate (section 2)."""
        return 1 if max(self.grid) <= 256 else 2

    @property
    def position_bytes(self) -> int:
        """Bytes of three coordinates, as of a MOVE or FROM."""
        return 3 * self.coordinate_bytes

    @property
    def pen_bytes(self) -> int:
        """Bytes of a PEN op."""
        return 1 + self.format.bytes

    @property
    def max_block_bytes(self) -> int:
        """Bytes left in a payload after a PEN and a MOVE: the limit of one op block."""
        return self.max_payload - self.pen_bytes - 1 - self.position_bytes


def little_endian(values: NDArray[np.integer], size: int) -> Bytes:
    """Return values, (n,), as an (n, size) array of bytes, least significant first."""
    shifts = np.arange(size, dtype=np.uint64) * np.uint64(8)
    return (values.astype(np.uint64)[:, None] >> shifts).astype(np.uint8)


def encode_positions(voxels: NDArray[np.integer], config: EncoderConfig) -> Bytes:
    """Return coordinates of voxels, (n, 3), as (n, `EncoderConfig.position_bytes`) bytes."""
    if config.coordinate_bytes == 1:
        return voxels.astype(np.uint8)
    return little_endian(voxels.reshape(-1), 2).reshape(-1, config.position_bytes)


def counted_op_bytes(counts: NDArray[np.integer]) -> Ints:
    """Return the bytes of ops with counts, 1 <= count < 2**32, op byte included."""
    size = np.ones(counts.shape, dtype=np.int64)
    most = counts.max(initial=0)
    for longer in _LONGER_FROM:
        if most < longer:
            break
        size += counts >= longer
    return size


def counted_ops(op: int | Ints, counts: Ints) -> tuple[Bytes, Ints]:
    """Return ops with counts as an (n, 6) array of bytes, and how many of each row are used."""
    size = counted_op_bytes(counts)
    out = np.empty((len(counts), 6), dtype=np.uint8)
    out[:, 0] = op | np.minimum(counts - 1, SHORT_COUNT)
    rest = np.maximum(counts - 1 - SHORT_COUNT, 0)
    for k in range(1, 6):
        out[:, k] = rest & 0x7F | (size > k + 1) << 7
        rest >>= 7
    return out, size


def concat_ranges(start: Ints, length: Ints) -> Ints:
    """Return the integers of ranges [start, start + length), concatenated."""
    ends = np.cumsum(length)
    total = int(ends[-1]) if len(ends) else 0
    return np.asarray(np.arange(total) + np.repeat(start - (ends - length), length))

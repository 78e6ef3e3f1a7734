"""Digest (8): the function mix, for many voxels at a time.

The voxels of a block are lanes of 64 bits in one large integer. No product of 32 by 32 bits
overflows its lane, and a mask removes what a shift brings in from the next one, so a few operations
on large integers compute mix for all voxels of a block.

Knows nothing of pages.
"""

from array import array
from collections.abc import Sequence

from firmware_sim import spec

_BLOCK = 256  # voxels at a time
_LANE = 64  # bits
_LOW = 0xFFFFFFFF
_SUM = (1 << _LANE) - 1  # modulo this, an integer is the sum of its lanes
_ONES = int.from_bytes(array("Q", [1]) * _BLOCK, "little")
_RAMP = int.from_bytes(array("Q", range(_BLOCK)), "little")


def mix_sum(indices: Sequence[int], pixels: bytes | bytearray, pixel_size: int) -> int:
    """Return the sum of mix(index, value) over the voxels that are not dark.

    Parameters
    ----------
    indices
        An index below 2^31 + 256 for each voxel, as an array of type ``"Q"`` or a range.
    pixels
        Their pixels, concatenated.
    pixel_size
        Number of bytes of a pixel, 1 to 4.

    Returns
    -------
    int
        The sum modulo 2^32.
    """
    total = 0
    for start in range(0, len(indices), _BLOCK):
        block = pixels[start * pixel_size : (start + _BLOCK) * pixel_size]
        if block.count(0) < len(block):
            total += _block_sum(indices[start : start + _BLOCK], block, pixel_size)
    return total & _LOW


def _block_sum(indices: Sequence[int], pixels: bytes | bytearray, pixel_size: int) -> int:
    ones = _ones(len(indices))
    low = ones * _LOW
    spread = bytearray(len(indices) * _LANE // 8)
    for k in range(pixel_size):
        spread[k :: _LANE // 8] = pixels[k::pixel_size]
    value = int.from_bytes(spread, "little")
    h = (_lanes(indices) * spec.DIGEST_MUL_INDEX + value * spec.DIGEST_MUL_VALUE) & low
    h ^= (h >> spec.DIGEST_SHIFT_1) & low
    h = (h * spec.DIGEST_MUL_1) & low
    h ^= (h >> spec.DIGEST_SHIFT_2) & low
    h = (h * spec.DIGEST_MUL_2) & low
    h ^= (h >> spec.DIGEST_SHIFT_3) & low
    lit = ((value + low) >> 32) & ones  # the carry out of the low half: 1 if value is not 0
    return (h & lit * _LOW) % _SUM


def _ones(count: int) -> int:
    return _ONES >> _LANE * (_BLOCK - count)


def _lanes(indices: Sequence[int]) -> int:
    if isinstance(indices, range) and indices.step == 1:
        count = len(indices)
        ramp = _RAMP if count == _BLOCK else _RAMP & (1 << _LANE * count) - 1
        return ramp + _ones(count) * indices.start
    return int.from_bytes(array("Q", indices), "little")

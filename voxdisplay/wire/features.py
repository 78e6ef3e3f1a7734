"""What of all that a device announces is worth using on a line.

Knows lines only as bytes per second, and features by their names.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

# Range coding saves about a bit a voxel and takes some 5 us for it: it pays below this.
SLOW_BYTES_PER_S: Final = 25_000
# What a line is taken for that nobody knows: it has work soon, as what is large is coded in parts,
# and no bytes are spent to save time.
UNKNOWN_BYTES_PER_S: Final = 200_000


def select_features(features: Collection[str], bytes_per_s: float) -> tuple[str, ...]:
    """Leave out ARC on a line that is faster than its coder.

    Parameters
    ----------
    features : collection of str
        As in `DeviceInfo.features`.
    bytes_per_s : float
        What the line carries.

    """
    if bytes_per_s < SLOW_BYTES_PER_S:
        return tuple(features)
    return tuple(name for name in features if name != "arc")

"""Selection of coding features by line rate.

Must not know links: a line is a number of bytes per second, a feature a name.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

# Range coding saves about one bit a voxel and takes some 5 us for it: it pays below this rate.
SLOW_BYTES_PER_S: Final = 25_000
# Assumed for a line of unknown rate: large frames are encoded in parts, so that the line has work
# soon, and no bytes are spent to save time.
UNKNOWN_BYTES_PER_S: Final = 200_000


def select_features(features: Collection[str], bytes_per_s: float) -> tuple[str, ...]:
    """Return the features to use on a line: all but ARC where the line outpaces its coder.

    Parameters
    ----------
    features : collection of str
        As in `DeviceInfo.features`.
    bytes_per_s : float
        Rate of the line.

    """
    if bytes_per_s < SLOW_BYTES_PER_S:
        return tuple(features)
    return tuple(name for name in features if name != "arc")

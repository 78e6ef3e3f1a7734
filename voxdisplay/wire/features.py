"""Selection of coding features by line rate.

Must not know links: a line is a number of bytes per second, a feature a name.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from voxdisplay.argument_checks import choice, wrong_kind
from voxdisplay.wire import spec

RANGE_CODED: Final = ("arc", "arc2", "slabs", "values")
# Range-coded chains save about one bit a voxel and take some 5 us for it, slabs save three bits and
# take 23 us on a Cortex-M0+: both pay below this rate.
SLOW_BYTES_PER_S: Final = 25_000
# Assumed for a line of unknown rate: large frames are encoded in parts, so that the line has work
# soon, and no bytes are spent to save time.
UNKNOWN_BYTES_PER_S: Final = 200_000

_BITS: Final[dict[str, int]] = {
    name.removeprefix("FEATURE_").lower(): bit
    for name, bit in vars(spec).items()
    if name.startswith("FEATURE_")
}


def feature_bits(features: Collection[str]) -> int:
    """Return the bits of INFO of features, given by their names; raise if one is unknown."""
    if not isinstance(features, tuple | list | set | frozenset | dict):
        raise wrong_kind("features", "a collection of names", features)
    for name in features:
        choice("features", name, tuple(_BITS))
    return sum(1 << _BITS[name] for name in set(features))


def select_features(features: Collection[str], bytes_per_s: float) -> tuple[str, ...]:
    """Return the features to use on a line: without range coding where the line outpaces it.

    Parameters
    ----------
    features : collection of str
        As in `DeviceInfo.features`.
    bytes_per_s : float
        Rate of the line.

    """
    if bytes_per_s < SLOW_BYTES_PER_S:
        return tuple(features)
    return tuple(name for name in features if name not in RANGE_CODED)

"""Colour maps: 256 colours from the lowest value to the highest, by name or by a list of colours.

Some are built in, as colours between which sRGB is interpolated; those of perceptually uniform
maps are within one level in the mean, and six at most, of the maps of that name. The names of
others are those of the optional library cmap. Must not know what is coloured.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import islice
from typing import Final

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import described, wrong_kind
from voxdisplay.errors import MissingExtra, did_you_mean
from voxdisplay.raster.color import Color, as_colors, interpolate_colors

ENTRIES: Final = 256
_MAX_NAME: Final = 64
_MAX_COMPARED: Final = 20_000

# Least-squares anchors at equal distances. The first of a map that begins in black is black: it is
# the pixel that is not lit.
_ANCHORS: Final = {
    "gray": "000000 ffffff",
    "hot": "000000 550000 aa0000 ff0000 ff5500 ffaa00 ffff00 ffff80 ffffff",
    "magma": "000002 0e0c2c 2c1162 51117e 712081 932b81 b6367a d8446c f25f5b fc875f feaf77 fed698 "
    "fcfdbf",
    "inferno": "000001 0f0b30 330961 570f6f 781d6e 9a2865 bb3655 d84b3f ee6826 fa8d06 fdb515 "
    "f3df51 f7ffa5",
    "plasma": "100788 3c049b 5d00a6 7e01a9 9c179f b62f8c cb4778 de5f65 ed7853 f89441 feb32e "
    "fcd424 f0f926",
    "viridis": "450155 491f72 453a84 3b528c 30688e 287c8e 20908d 1ea487 33b779 5cc963 8ed745 "
    "c7e01d fee71d",
    "coolwarm": "3b4cc0 6f92f3 aac7fd dddcdc f7b89c e7745b b40426",
    "rainbow": "0000ff 0080ff 00ffff 00ff80 00ff00 80ff00 ffff00 ff8000 ff0000",
    "phase": "ff0000 ffff00 00ff00 00ffff 0000ff ff00ff ff0000",
}
BUILT_IN: Final = tuple(_ANCHORS)
"""Names of the colour maps that need no other library."""


def color_map(map: str | Color) -> NDArray[np.uint8]:  # noqa: A002 - the word of scene files
    """Return the colours of a colour map.

    Parameters
    ----------
    map : str or list of colours
        One of `BUILT_IN`, with ``_r`` behind it for the reverse; another name that the library
        cmap knows; or colours that are spread evenly.

    Returns
    -------
    (256, 3) uint8 array

    Raises
    ------
    ValueError
        If no colour map has this name.
    MissingExtra
        If it may be one of the library cmap, which is not installed.

    """
    if not isinstance(map, str):
        if not hasattr(map, "__len__"):
            raise wrong_kind("map", "the name of a colour map or a list of colours", map)
        return spread_evenly(as_colors(map))
    return _named(map.strip().lower()[:_MAX_NAME])


def spread_evenly(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return 256 colours, (256, 3), interpolated in sRGB between (k, 3) at equal distances."""
    return np.array(interpolate_colors(colors, ENTRIES))


@lru_cache(maxsize=32)
def _named(name: str) -> NDArray[np.uint8]:
    base = name.removesuffix("_r").replace("grey", "gray")
    anchors = _ANCHORS.get(base)
    if anchors is None:
        return _read_only(_of_library(name))
    colors = np.array([list(bytes.fromhex(one)) for one in anchors.split()], dtype=np.uint8)
    return _read_only(spread_evenly(colors[::-1] if name.endswith("_r") else colors))


def _read_only(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    colors.flags.writeable = False
    return colors


def _of_library(name: str) -> NDArray[np.uint8]:
    """Return a colour map of the library cmap."""
    hint = did_you_mean(name, BUILT_IN)
    unknown = f"there is no colour map {described(name)}"
    built_in = f"{', '.join(BUILT_IN)} are built in"
    try:
        import cmap  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        if hint:
            raise ValueError(f"{unknown}: {hint}") from None
        more = "pip install 'voxdisplay[maps]' brings those of the library cmap"
        raise MissingExtra(f"{unknown} built in", hint=f"{built_in}; {more}") from None
    try:
        exact = np.asarray(cmap.Colormap(name)(np.linspace(0, 1, ENTRIES)), dtype=np.float64)
    except (ValueError, TypeError, KeyError, AttributeError, OSError):
        known = (str(key) for key in cmap.Catalog().short_keys())
        near = hint or did_you_mean(name, islice(known, _MAX_COMPARED)) or built_in
        raise ValueError(f"{unknown}: {near}") from None
    return np.rint(exact[:, :3] * 255).astype(np.uint8)

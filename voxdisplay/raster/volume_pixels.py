"""Pixels of volumes: arrays of any real numbers become memory of a display's format.

Values are resampled first and mapped then: colours are never averaged. Must not know files and
frames.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.argument_checks import choice, flag, number, wrong_kind
from voxdisplay.raster.area_means import Placement, area_means, nearest_samples
from voxdisplay.raster.array_arguments import as_array, is_array_like
from voxdisplay.raster.color import Color
from voxdisplay.raster.color_map import ENTRIES, color_map
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat, Pixels

_PERCENTILES = (1, 99)
# A histogram of so many values tells percentiles well enough.
_SAMPLED = 1 << 20


class Window(NamedTuple):
    """Values that a colour map spans: the first colour is for `low`, the last for `high`."""

    low: float
    high: float


def volume_pixels(
    array: Any,
    *,
    window: tuple[float, float] | None = None,
    threshold: float | None = None,
    map: str | Color = "gray",  # noqa: A002 - the word of scene files
    grid: tuple[int, int, int] | None = None,
    spacing: tuple[float, float, float] = (1, 1, 1),
    format: PixelFormat | str = "rgb888",  # noqa: A002 - the word of the wire
    labels: bool = False,
    dither: Literal["none", "ordered"] = "none",
) -> Pixels:
    """Return the pixels of a volume, for `Frame.set`.

    Parameters
    ----------
    array : (nz, ny, nx) array
        Real numbers of any type, indexed [z, y, x]. Those that are not finite are dark.
    window : (low, high), optional
        Values that the colour map spans; what is beyond takes its first or last colour. Default:
        from the 1st to the 99th percentile.
    threshold : float, optional
        Lowest value that is lit. Default: whatever is above `low` is; with mono1, what is at least
        in the middle of the window.
    map : str or list of colours
        Colour map: ``"gray"``, ``"magma"``, ... as of `color_map`.
    grid : (nx, ny, nz), optional
        Size of the display, in which the volume is fitted, undistorted and centred. Default: as
        many voxels as there are samples.
    spacing : (sx, sy, sz)
        Distances of the samples along x, y and z, in any unit; for `grid`.
    format : PixelFormat or str
        That of the display.
    labels : bool
        Whether values are numbers of parts, which have no mean: each voxel takes the nearest.
    dither : {"none", "ordered"}
        ``"ordered"`` shows mono1, index8 and rgb565 displays with more shades than they have, by
        voxels of their nearest ones in a fixed pattern; ``threshold`` is then ``low`` for mono1,
        too. Pixels of index8 are those of the default palette.

    Returns
    -------
    ndarray
        Indexed [z, y, x], of the format's type and shape.

    Examples
    --------
    >>> import numpy as np
    >>> import voxdisplay as vd
    >>> ct = np.random.default_rng(1).normal(700, 300, size=(5, 7, 3))
    >>> frame = vd.Frame((3, 7, 5))
    >>> frame.set(vd.volume_pixels(ct, window=(0, 1500), map="magma"))

    """
    values = as_volume("array", array)
    colors = color_map(map)
    kind = PixelFormat.of(format)
    chosen = None if window is None else as_window("window", window)
    least = None if threshold is None else number("threshold", threshold)
    if least is not None and np.isnan(least):
        raise ValueError("threshold: expected a number, found nan")
    present = None
    if grid is not None:
        values, present = resample(values, Grid.of(grid), as_spacing("spacing", spacing),
                                   nearest=flag("labels", labels))  # fmt: skip
    elif as_spacing("spacing", spacing) != (1, 1, 1):
        raise ValueError("spacing: without a grid the samples are the voxels; name the grid")
    if chosen is None:
        chosen = label_window(values) if flag("labels", labels) else default_window(values)
    choice("dither", dither, ("none", "ordered"))
    dithers = dither == "ordered" and kind is not PixelFormat.RGB888
    if least is None and kind is PixelFormat.MONO1 and not dithers:
        least = (chosen.low + chosen.high) / 2
    entries, lit = map_entries(values, chosen, least)
    if present is not None:
        lit &= present
    if dithers:
        from voxdisplay.raster.dither import dithered_pixels  # noqa: PLC0415 - few want it

        shown: Pixels = dithered_pixels(entries, colors, kind)
        shown[~lit] = 0
        return shown
    pixels = kind.pixels(kind.nearest(colors))
    if kind is PixelFormat.MONO1:
        pixels[:] = 1
    # What is lit stays so: the first entry of a map may be black.
    pixels[0] = pixels[1] if not pixels[0].any() else pixels[0]
    found = pixels[entries]
    found[~lit] = 0
    return found


def as_volume(name: str, value: object) -> NDArray[Any]:
    """Return a value as a (nz, ny, nx) array of real numbers, none of its sides 0.

    Raises
    ------
    TypeError, ValueError
        If it is none.

    """
    if not is_array_like(value):
        raise wrong_kind(name, "an array indexed [z, y, x]", value)
    found = as_array(name, value)
    if found.dtype.kind not in "fiub":
        raise ValueError(f"{name}: expected real numbers, found {found.dtype}")
    if found.ndim != 3 or not found.size:
        shape = " x ".join(map(str, found.shape)) or "a single number"
        raise ValueError(f"{name}: a volume has three axes, indexed [z, y, x]; this is {shape}")
    if found.dtype.kind == "f" and found.dtype.itemsize not in (4, 8):  # half and long double
        return found.astype(np.float32 if found.dtype.itemsize == 2 else np.float64)
    return found


def as_spacing(name: str, value: Any) -> tuple[float, float, float]:
    """Return three distances above 0; raise `TypeError` or `ValueError` otherwise."""
    x, y, z = _numbers(name, value, 3, "three distances (sx, sy, sz)")
    if not all(0 < each < np.inf for each in (x, y, z)):
        raise ValueError(f"{name}: distances are above 0; these are {x:g}, {y:g}, {z:g}")
    if max(x, y, z) > 1e6 * min(x, y, z):
        raise ValueError(f"{name}: {x:g}, {y:g} and {z:g} are too different to be of one volume")
    return x, y, z


def as_window(name: str, value: Any) -> Window:
    """Return two numbers as a window; raise `TypeError` or `ValueError` if they are none."""
    low, high = _numbers(name, value, 2, "two numbers (low, high)")
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ValueError(f"{name}: the first number must be the lower one, found {low:g}, {high:g}")
    return Window(low, high)


def default_window(values: NDArray[Any]) -> Window:
    """Return the window from the 1st to the 99th percentile of the finite values.

    Where these are equal, as in a small object before an even background, it is the range of all
    values; where all are equal, it ends at them, so that they are lit if they are above 0.
    """
    flat = values.reshape(-1)
    if flat.dtype.kind == "b":
        return Window(0.0, 1.0)
    sampled = flat[:: max(1, flat.size // _SAMPLED)]
    for some in (sampled, flat):
        finite = some[np.isfinite(some)]
        if finite.size:
            low, high = (float(each) for each in np.percentile(finite, _PERCENTILES))
            if low < high:
                return Window(low, high)
            low, high = float(finite.min()), float(finite.max())
            if low < high and some is flat:
                return Window(low, high)
    finite = flat[np.isfinite(flat)]
    level = float(finite[0]) if finite.size else 0.0
    return Window(level - 1, level) if level < 0 else Window(0.0, level or 1.0)


def _numbers(name: str, value: Any, count: int, wanted: str) -> list[float]:
    """Return a list, tuple or vector of so many numbers as floats."""
    if isinstance(value, np.ndarray) and value.ndim == 1:
        value = value.tolist()
    if not isinstance(value, list | tuple) or len(value) != count:
        raise wrong_kind(name, wanted, value)
    return [number(name, each) for each in value]


def label_window(values: NDArray[Any]) -> Window:
    """Return the window from 0, which is no part, to the largest number of a part."""
    finite = values[np.isfinite(values)]
    return Window(0.0, max(1.0, float(finite.max(initial=0))))


def map_entries(
    values: NDArray[Any], window: Window, threshold: float | None
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return the entry of a colour map for each value, and whether it is lit.

    Parameters
    ----------
    values : array
        Of any shape.
    window : Window
    threshold : float or None
        Lowest value that is lit; None: whatever is above the window's low end.

    Returns
    -------
    entries : uint8 array
        0 for `low` and what is below, 255 for `high` and above.
    lit : bool array

    """
    narrow = values.dtype.itemsize <= 2 or values.dtype == np.float32
    kind: np.dtype[np.floating] = np.dtype(np.float32 if narrow else np.float64)
    with np.errstate(all="ignore"):
        finite = np.isfinite(values)
        lit = finite & (values > window.low if threshold is None else values >= threshold)
        # Halved, so that the difference of the largest numbers is one too.
        part = values.astype(kind)
        part *= 0.5
        part -= window.low / 2
        part /= max(window.high / 2 - window.low / 2, float(np.finfo(kind).tiny))
        part = np.where(finite, part, 0).clip(0, 1)
    return (part * (ENTRIES - 1) + 0.5).astype(np.uint8), lit


def resample(
    values: NDArray[Any],
    grid: tuple[int, int, int],
    spacing: tuple[float, float, float],
    *,
    nearest: bool,
) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Fit a volume into a grid.

    Parameters
    ----------
    values : (nz, ny, nx) array
    grid : (nx, ny, nz)
    spacing : tuple of float
        Along x, y, z.
    nearest : bool
        Whether each voxel takes the sample at its centre, instead of the mean.

    Returns
    -------
    values : array
        Indexed [z, y, x].
    present : bool array
        Whether samples cover at least half of the voxel.

    """
    samples = (values.shape[2], values.shape[1], values.shape[0])
    placement = Placement.contained(samples, grid, spacing)
    if nearest:
        (x, y, z), (has_x, has_y, has_z) = nearest_samples(samples, grid, placement)
        present = has_z[:, None, None] & has_y[:, None] & has_x
        return values[np.ix_(z, y, x)], present
    mean, cover = area_means(values, grid, placement)
    return mean, cover >= 0.5 - 1e-9

"""Volumes and voxel models: bodies of samples and of ready voxels, under affine maps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from voxdisplay.argument_checks import flag, number
from voxdisplay.bodies.body import Body, Kind, invertible, transform_bounds
from voxdisplay.bodies.geometry import Bounds, LitVoxels
from voxdisplay.curves import arguments
from voxdisplay.curves.arguments import ArgumentError
from voxdisplay.errors import BodyError
from voxdisplay.raster.area_means import Placement, area_means, nearest_samples
from voxdisplay.raster.array_arguments import as_voxels
from voxdisplay.raster.color import Color
from voxdisplay.raster.color_map import color_map
from voxdisplay.raster.volume_pixels import (
    Window,
    as_spacing,
    as_volume,
    as_window,
    default_window,
    label_window,
    map_entries,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from voxdisplay.compute.array_types import Bools, Floats, Ints

# Voxels that are computed at once, so that a display of any size takes bounded memory.
_BLOCK = 1 << 22
_MAX_COORDINATE = 1 << 24
_EVEN = 1e-9  # a scale this near to 1 is 1


class AffineSamples(Body):
    """Base class of bodies that are samples on a lattice, and an affine map of it.

    Attributes
    ----------
    matrix : (3, 3) float64 array
        From sample indices x, y, z to voxels.
    offset : (3,) float64 array
        Where the corner of the first sample lies.

    """

    matrix: Floats
    offset: Floats
    _low: Floats
    _high: Floats

    def bounds(self) -> Bounds:
        """Return a box that holds all samples: `Body.bounds`."""
        return transform_bounds((self._low, self._high), self.matrix, self.offset)

    def transformed(self, matrix: ArrayLike, offset: ArrayLike = (0, 0, 0)) -> Body:
        """Return the same samples under one more map: `Body.transformed`."""
        by = invertible("matrix", matrix)
        twin = type(self).__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin.matrix = invertible("matrix", by @ self.matrix)
        twin.offset = by @ self.offset + arguments.vector("offset", offset)
        twin._arguments = {  # noqa: SLF001 - of its own kind
            **self._arguments,
            "matrix": twin.matrix,
            "offset": twin.offset,
        }
        return twin

    def _axes(self) -> list[int] | None:
        """Return which sample axis runs along x, y and z; None if an axis is oblique."""
        used = self.matrix != 0
        if (used.sum(axis=0) != 1).any() or (used.sum(axis=1) != 1).any():
            return None
        return [int(np.flatnonzero(row)[0]) for row in used]

    def _slabs(self, bounds: Bounds) -> Iterator[tuple[Ints, Ints]]:
        """Yield low and high corners of boxes of voxels that hold the body within bounds."""
        own = self.bounds()
        low, high = np.maximum(own[0], bounds[0]), np.minimum(own[1], bounds[1])
        if not (low < high).all():
            return
        first, last = np.floor(low).astype(np.int64), np.ceil(high).astype(np.int64)
        area = int((last[0] - first[0]) * (last[1] - first[1]))
        step = max(1, _BLOCK // area)
        for z in range(int(first[2]), int(last[2]), step):
            top = np.array([last[0], last[1], min(z + step, int(last[2]))])
            yield np.array([first[0], first[1], z]), top

    def _sample_places(self, low: Ints, high: Ints) -> Floats:
        """Return the place of each voxel's centre among the samples, (n, 3), in scan order."""
        z, y, x = np.indices([int(side) for side in (high - low)[::-1]]).reshape(3, -1)
        centers = np.stack((x, y, z), axis=1) + low + 0.5
        inverse = np.linalg.inv(self.matrix)
        return np.asarray((centers - self.offset) @ inverse.T, dtype=np.float64)


class Volume(AffineSamples):
    """Samples of real numbers, shown by a colour map.

    Each voxel takes the mean of the samples that it covers; under maps that turn it, the samples
    are thinned to the size of voxels and interpolated. Values are mapped after that.

    Parameters
    ----------
    array : (nz, ny, nx) array
        Real numbers, indexed [z, y, x]. Those that are not finite are dark.
    window : (low, high), optional
        Values that the colour map spans. Default: from the 1st to the 99th percentile.
    threshold : float, optional
        Lowest value that is lit. Default: whatever is above `low`.
    map : str or list of colours
        Colour map: ``"gray"``, ``"magma"``, ...
    spacing : (sx, sy, sz)
        Size of a sample in voxels.
    offset : (3,) array
        Where the corner of the first sample lies, in voxels.
    labels : bool
        Whether values are numbers of parts, which have no mean: each voxel takes the nearest.

    """

    def __init__(
        self,
        array: Any,
        *,
        window: tuple[float, float] | None = None,
        threshold: float | None = None,
        map: str | Color = "gray",  # noqa: A002 - the word of scene files
        spacing: tuple[float, float, float] = (1, 1, 1),
        offset: ArrayLike = (0, 0, 0),
        labels: bool = False,
    ) -> None:
        self.labels = flag("labels", labels)
        try:
            self.array = as_volume("array", array)
            sizes = as_spacing("spacing", spacing)
            chosen = None if window is None else as_window("window", window)
            self.colors = color_map(map)
        except ValueError as error:
            raise BodyError(str(error)) from None
        if chosen is None:
            chosen = (label_window if self.labels else default_window)(self.array)
        self.window = chosen
        self.threshold = None if threshold is None else number("threshold", threshold)
        if self.threshold is not None and np.isnan(self.threshold):
            raise ArgumentError("threshold", "is not a number")
        self.matrix = np.diag(sizes)
        self.offset = arguments.vector("offset", offset)
        self._low = np.zeros(3)
        self._high = np.array(self.array.shape[::-1], dtype=np.float64)
        self._arguments = {
            "array": self.array,
            "window": tuple(self.window),
            "threshold": self.threshold,
            "map": map,
            "spacing": spacing,
            "offset": self.offset,
            "labels": self.labels or None,
        }

    @property
    def kind(self) -> Kind:
        """``"volume"``."""
        return "volume"

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> LitVoxels:  # noqa: ARG002 - exact anyway
        """Return the lit voxels within a box, with the parameter ``value``: `Body.geometry`."""
        axes = self._axes()
        source: Volume = self if axes is not None or self.labels else self._thinned()
        found = [
            source._lit(low, *(source._straight if axes is not None else source._turned)(low, high))
            for low, high in self._slabs(bounds)
        ]
        voxels, entries, values = (
            (np.concatenate(parts) for parts in zip(*found, strict=True))
            if found
            else (np.empty((0, 3), np.int64), np.empty(0, np.uint8), np.empty(0))
        )
        return LitVoxels(voxels, self.colors[entries], {"value": values})

    def _lit(
        self, low: Ints, values: NDArray[Any], present: Bools
    ) -> tuple[Ints, NDArray[np.uint8], Floats]:
        """Return the lit voxels of a box, their entries of the colour map, and their values."""
        entries, lit = map_entries(values, Window(*self.window), self.threshold)
        lit &= present
        found = np.argwhere(lit)[:, ::-1] + low
        entry = entries[lit]
        if not self.colors[0].any():  # what is lit stays so in a map that begins in black
            entry = entry.clip(min=1)
        return found, entry, values[lit].astype(np.float64)

    def _straight(self, low: Ints, high: Ints) -> tuple[NDArray[Any], Bools]:
        """Return values, and where there are any, of a box whose axes are those of the samples."""
        axes = self._axes()
        assert axes is not None  # noqa: S101 - the caller knows
        # From [z, y, x] of the samples to [z, y, x] of voxels.
        values = self.array.transpose([2 - axes[2], 2 - axes[1], 2 - axes[0]])
        scale = np.array([self.matrix[axis, axes[axis]] for axis in range(3)])
        samples = np.array(values.shape[::-1])
        start = self.offset - low
        values = values[tuple(slice(None, None, -1 if step < 0 else 1) for step in scale[::-1])]
        start = np.where(scale < 0, start + scale * samples, start)
        place = Placement(_vector(np.abs(scale)), _vector(start))
        nx, ny, nz = (int(side) for side in high - low)
        if self.labels:
            sides = (values.shape[2], values.shape[1], values.shape[0])
            (x, y, z), (in_x, in_y, in_z) = nearest_samples(sides, (nx, ny, nz), place)
            return values[np.ix_(z, y, x)], in_z[:, None, None] & in_y[:, None] & in_x
        mean, cover = area_means(values, (nx, ny, nz), place)
        return mean, cover >= 0.5 - 1e-9

    def _thinned(self) -> Volume:
        """Return the volume with samples that are no smaller than voxels."""
        size = np.linalg.norm(self.matrix, axis=0)
        samples = np.array(self.array.shape[::-1])
        count = np.minimum(samples, np.maximum(1, np.ceil(samples * size - 1e-9))).astype(int)
        if (count == samples).all():
            return self
        nx, ny, nz = (int(side) for side in count)
        scale = count / samples
        mean, cover = area_means(self.array, (nx, ny, nz), Placement(_vector(scale), (0, 0, 0)))
        mean[cover < 0.5] = np.nan
        twin = type(self).__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin.array, twin.matrix = mean, self.matrix / scale
        twin._high = count.astype(np.float64)  # noqa: SLF001 - of its own kind
        return twin

    def _turned(self, low: Ints, high: Ints) -> tuple[NDArray[Any], Bools]:
        """Return values, and where there are any, at the centres of voxels, interpolated."""
        places = self._sample_places(low, high)
        samples = np.array(self.array.shape[::-1])
        inside = ((places >= 0) & (places < samples)).all(axis=1)
        values = np.zeros(len(places))
        at = places[inside]
        if self.labels:
            x, y, z = np.floor(at).astype(np.int64).T
            values[inside] = self.array[z, y, x]
        else:
            values[inside] = _interpolated(self.array, at - 0.5)
        shape = (high - low)[::-1]
        return values.reshape(shape), inside.reshape(shape)


class VoxelModel(AffineSamples):
    """Voxels with colours of their own, as of a voxel editor.

    Enlarged, each voxel becomes a box; reduced, voxels that fall into one take the colour of that
    nearest to its centre, and nothing vanishes.

    Parameters
    ----------
    voxels : (N, 3) integer array
        Columns x, y, z.
    colors : (N, 3) uint8 array, optional
    offset : (3,) array
        Added to the voxels' coordinates.

    """

    def __init__(
        self,
        voxels: ArrayLike,
        colors: ArrayLike | None = None,
        *,
        offset: ArrayLike = (0, 0, 0),
    ) -> None:
        self.voxels = as_voxels("voxels", voxels)
        if not len(self.voxels):
            raise ArgumentError("voxels", "has none")
        self._low = self.voxels.min(axis=0).astype(np.float64)
        self._high = self.voxels.max(axis=0) + 1.0
        if max(-self._low.min(), self._high.max()) > _MAX_COORDINATE:
            raise ArgumentError("voxels", f"are further away than {_MAX_COORDINATE}")
        self.colors = None
        if isinstance(colors, np.ndarray) and colors.dtype == np.uint8:
            if colors.shape != (len(self.voxels), 3):
                raise ArgumentError("colors", f"have the shape {colors.shape}, not a row a voxel")
            self.colors = colors.copy()
        elif colors is not None:
            given = arguments.array("colors", colors, (len(self.voxels), 3))
            if not ((given >= 0) & (given <= 255) & (given == np.rint(given))).all():
                raise ArgumentError("colors", "are whole numbers, 0 to 255")
            self.colors = given.astype(np.uint8)
        self.matrix = np.eye(3)
        self.offset = arguments.vector("offset", offset)
        self._arguments = {"voxels": self.voxels, "colors": self.colors, "offset": self.offset}

    @property
    def kind(self) -> Kind:
        """``"points"``."""
        return "points"

    def geometry(self, bounds: Bounds, *, certified: bool = False) -> LitVoxels:  # noqa: ARG002 - exact anyway
        """Return the voxels within a box: `Body.geometry`."""
        if (self.matrix == np.eye(3)).all():  # no two fall into one
            moved = self.voxels + np.floor(self.offset + 0.5).astype(self.voxels.dtype)
            kept = ((moved >= np.floor(bounds[0])) & (moved < bounds[1])).all(axis=1)
            if np.all(kept):
                return LitVoxels(moved, self.colors)
            return LitVoxels(moved[kept], None if self.colors is None else self.colors[kept])
        axes = self._axes()
        sizes = np.linalg.norm(self.matrix, axis=0)
        found, rows = [], []
        enlarged = bool((sizes > 1 + _EVEN).any())
        if axes is None or not enlarged or (sizes < 1 - _EVEN).any():
            # Each voxel lights that which holds its centre; of several, the nearest comes last.
            centers = (self.voxels + 0.5) @ self.matrix.T + self.offset
            held = np.floor(centers)
            inside = ((held + 1 > bounds[0]) & (held < bounds[1])).all(axis=1)
            distance = ((centers - held - 0.5) ** 2).sum(axis=1)
            order = np.argsort(-distance[inside], kind="stable")
            rows.append(np.flatnonzero(inside)[order])
            found.append(held[rows[-1]].astype(np.int64))
        if axes is None or enlarged:
            # Each voxel whose centre is in a box of the model.
            lookup = _Lookup(self.voxels)
            for low, high in self._slabs(bounds):
                row = lookup.rows(np.floor(self._sample_places(low, high)).astype(np.int64))
                hit = np.flatnonzero(row >= 0)
                z, y, x = np.unravel_index(hit, (high - low)[::-1])
                found.append(np.stack((x, y, z), axis=1) + low)
                rows.append(row[hit])
        voxels = np.concatenate([*found, np.empty((0, 3), np.int64)])
        row = np.concatenate([*rows, np.empty(0, np.int64)])
        return LitVoxels(voxels, None if self.colors is None else self.colors[row])


class _Lookup:
    """Rows of voxels by their coordinates; of equal ones the last."""

    def __init__(self, voxels: Ints) -> None:
        self._low = voxels.min(axis=0)
        self._sides = voxels.max(axis=0) - self._low + 1
        keys = self._keys(voxels)
        order = np.argsort(keys, kind="stable")
        last = np.append(np.diff(keys[order]) != 0, True)
        self._rows = order[last]
        self._sorted = keys[self._rows]

    def _keys(self, voxels: Ints) -> Ints:
        x, y, z = (voxels - self._low).T
        return np.asarray((z * self._sides[1] + y) * self._sides[0] + x)

    def rows(self, voxels: Ints) -> Ints:
        """Return the row of each voxel, (n,); -1 where there is none."""
        inside = ((voxels >= self._low) & (voxels < self._low + self._sides)).all(axis=1)
        keys = self._keys(voxels[inside])
        at = np.searchsorted(self._sorted, keys).clip(max=len(self._sorted) - 1)
        found = np.full(len(voxels), -1, dtype=np.int64)
        found[inside] = np.where(self._sorted[at] == keys, self._rows[at], -1)
        return found


def _vector(values: Floats) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _interpolated(values: NDArray[Any], at: Floats) -> Floats:
    """Return values interpolated linearly between samples at whole numbers, (n,).

    Beyond the outer samples their values go on.
    """
    samples = np.array(values.shape[::-1])
    at = at.clip(0, samples - 1)
    first = np.floor(at).astype(np.int64).clip(0, np.maximum(samples - 2, 0))
    part = at - first
    total = np.zeros(len(at))
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, part, 1 - part), axis=1)
        x, y, z = np.minimum(first + corner, samples - 1).T
        found = values[z, y, x].astype(np.float64)
        total += np.where(weight > 0, weight * np.where(weight > 0, found, 0), 0)
    return total

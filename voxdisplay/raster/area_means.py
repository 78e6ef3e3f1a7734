"""Resampling of volumes by area means: each voxel takes the mean of the samples that it covers.

A sample is a box of constant value. The weights of the three axes are independent, so the mean is
three passes, each over one axis. Must not know what the values mean, and where they came from.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]


class _Taps(NamedTuple):
    """Samples that each voxel of one axis covers: (voxels, taps) indices and weights."""

    sample: NDArray[np.intp]
    weight: NDArray[np.floating]


class Placement(NamedTuple):
    """Place of the samples of a volume on a grid, by axis, in the order x, y, z.

    Attributes
    ----------
    scale : tuple of float
        Size of a sample in voxels, above 0.
    offset : tuple of float
        Where the first sample begins.

    """

    scale: Vector
    offset: Vector

    @classmethod
    def contained(
        cls,
        samples: tuple[int, int, int],
        room: tuple[float, float, float],
        spacing: Vector = (1.0, 1.0, 1.0),
        start: Vector = (0.0, 0.0, 0.0),
    ) -> Placement:
        """Return the largest undistorted and centred placement in a box.

        Parameters
        ----------
        samples : (nx, ny, nz)
        room : tuple of float
            Sides of the box in voxels.
        spacing : tuple of float
            Distance of samples by axis, in any unit.
        start : tuple of float
            Lowest corner of the box.

        """
        size = np.array(samples) * np.array(spacing)
        factor = float((np.array(room) / size).min())
        offset = np.array(start) + (np.array(room) - factor * size) / 2
        x, y, z = (factor * np.array(spacing)).tolist()
        return cls((x, y, z), (float(offset[0]), float(offset[1]), float(offset[2])))


def axis_taps(
    samples: int, voxels: int, scale: float, offset: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the samples within each voxel of one axis, and the length of each within it.

    Parameters
    ----------
    samples, voxels : int
        Numbers of both.
    scale, offset : float
        Of `Placement`, for this axis.

    Returns
    -------
    index : (voxels, k) intp array
        Consecutive samples, clipped to those that there are.
    length : (voxels, k) float64 array
        In voxels; 0 where there is no sample. Rows sum to the covered part of the voxel, 0 to 1.

    """
    at = np.arange(voxels)[:, None]
    first = np.floor((at - offset) / scale).clip(0, samples - 1)
    last = np.ceil((at + 1 - offset) / scale).clip(1, samples)
    index = first + np.arange(max(1, int((last - first).max())))
    low = offset + scale * index
    length = np.minimum(low + scale, at + 1.0) - np.maximum(low, at)
    length[index >= samples] = 0
    return index.clip(max=samples - 1).astype(np.intp), length.clip(min=0)


@np.errstate(all="ignore")  # sums of the largest numbers may be infinite: then dark
def area_means(
    values: NDArray[np.generic], grid: tuple[int, int, int], placement: Placement
) -> tuple[NDArray[np.floating], NDArray[np.float64]]:
    """Return the mean of a volume over each voxel of a grid.

    The sum of mean times cover is that of the samples times their volume in voxels, to 1e-6 of the
    sum of magnitudes.

    Parameters
    ----------
    values : (nz, ny, nx) array
        Real numbers, indexed [z, y, x]; those that are not finite count as missing.
    grid : (nx, ny, nz)
        Size of the result in voxels.
    placement : Placement

    Returns
    -------
    mean : array
        Indexed [z, y, x], float32, or float64 where the values need it: the mean over the covered
        part of the voxel, 0 where nothing covers it.
    cover : float64 array
        Of the same shape: which part of the voxel the samples cover, 0 to 1.

    """
    taps = [
        axis_taps(values.shape[2 - axis], grid[axis], *(part[axis] for part in placement))
        for axis in range(3)
    ]
    x, y, z = (length.sum(axis=1) for _, length in taps)
    cover = z[:, None, None] * y[:, None] * x
    narrow = values.dtype.kind == "f" and values.dtype.itemsize <= 4
    small = values.dtype.kind in "iub" and values.dtype.itemsize <= 2
    kind: np.dtype[np.floating] = np.dtype(np.float32 if narrow or small else np.float64)
    complete = values.dtype.kind != "f" or _all_finite(values)
    total = _weighted_sums(values, taps, kind, missing=None if complete else "zero")
    if not complete:
        cover = _weighted_sums(values, taps, np.dtype(np.float64), missing="count")
        cover[cover < 1e-9] = 0  # rounding
    mean = np.where(cover > 0, total / cover.astype(kind), 0)
    return mean.astype(kind, copy=False), cover


def nearest_samples(
    samples: tuple[int, int, int], grid: tuple[int, int, int], placement: Placement
) -> tuple[list[NDArray[np.intp]], list[NDArray[np.bool_]]]:
    """Return, for each axis x, y, z, the sample at each voxel's centre, and whether there is one.

    Without a sample the index is that of the nearest one.
    """
    index, found = [], []
    for axis in range(3):
        place = (np.arange(grid[axis]) + 0.5 - placement.offset[axis]) / placement.scale[axis]
        at = np.floor(place)
        found.append((at >= 0) & (at < samples[axis]))
        index.append(at.clip(0, samples[axis] - 1).astype(np.intp))
    return index, found


def _all_finite(values: NDArray[np.generic]) -> bool:
    return all(bool(np.isfinite(plane).all()) for plane in values)  # without a mask of all of it


def _weighted_sums(
    values: NDArray[np.generic],
    taps: list[tuple[NDArray[np.intp], NDArray[np.float64]]],
    kind: np.dtype[np.floating],
    missing: str | None,
) -> NDArray[np.floating]:
    """Return the sums of values times weights over all samples of each voxel.

    Parameters
    ----------
    values : (nz, ny, nx) array
    taps : list of (index, length)
        For x, y, z.
    kind : dtype
        In which it is computed.
    missing : {None, "zero", "count"}
        What stands for values that are not finite: None if there are none; else 0 for each, or 0
        for each and 1 for all others.

    """
    along_x, along_y, along_z = (_Taps(index, length.astype(kind)) for index, length in taps)

    def plane(z: int) -> NDArray[np.floating]:
        found: NDArray[Any] = values[z]
        if missing:
            finite = np.isfinite(found)
            found = finite if missing == "count" else np.where(finite, found, 0)
        return found.astype(kind)

    def across(one: NDArray[np.floating]) -> NDArray[np.floating]:
        return _sum_columns(_sum_rows(one, along_y), along_x)

    sums = np.zeros((len(along_z.sample), len(along_y.sample), len(along_x.sample)), dtype=kind)
    # The axis that shrinks most should be first; of the others a plane at a time is held.
    if len(sums) > len(values):
        shrunk = {z: across(plane(z)) for z in np.unique(along_z.sample[along_z.weight > 0])}
        for target, index, weight in zip(sums, *along_z, strict=True):
            for z, part in zip(index[weight > 0], weight[weight > 0], strict=True):
                target[:] += part * shrunk[z]
        return sums
    for target, index, weight in zip(sums, *along_z, strict=True):
        used = weight > 0
        total = sum(part * plane(z) for z, part in zip(index[used], weight[used], strict=True))
        if used.any():
            target[:] = across(np.asarray(total))
    return sums


def _sum_rows(plane: NDArray[np.floating], taps: _Taps) -> NDArray[np.floating]:
    """Return weighted sums of the rows of a plane."""
    sums = np.zeros((len(taps.sample), plane.shape[1]), dtype=plane.dtype)
    for index, weight in zip(taps.sample.T, taps.weight.T, strict=True):
        sums += weight[:, None] * plane[index]
    return sums


def _sum_columns(plane: NDArray[np.floating], taps: _Taps) -> NDArray[np.floating]:
    """Return weighted sums of the columns of a plane."""
    return _sum_rows(np.ascontiguousarray(plane.T), taps).T

"""Reader of DICOM images: series of slices, or one file of many frames, by pydicom.

By the standard: rescale slope first, then the window; slices are sorted by their positions, not by
their names; axes are left, posterior, superior.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files.contents import MAX_SAMPLES, VolumeSamples
from voxdisplay.files.guarded_calls import guarded
from voxdisplay.files.volume_axes import to_canonical

MAX_SLICES = 1 << 13
_UNEVEN = 0.05  # part of the distance of slices by which distances may differ

_DEFLATED = b"1.2.840.10008.1.2.1.99"

Directions = NDArray[np.float64]


class _Slice(NamedTuple):
    """One file: its series, frames as [frame, row, column], place and spacing."""

    name: str
    series: str
    frames: NDArray[Any]
    position: NDArray[np.float64] | None
    rows: Directions  # unit steps from column to column and from row to row, (2, 3), LPS
    spacing: tuple[float, float, float]  # along columns, rows, slices
    window: tuple[float, float] | None


def read_dicom(files: Iterable[tuple[str, bytes]], place: str = "the folder") -> VolumeSamples:
    """Read the slices of one series; of several series, that of the first file.

    Parameters
    ----------
    files : iterable of (str, bytes)
        Names and contents. Of several files those of other series, and those that are no images,
        are left out.
    place : str
        Where they are, for errors.

    Raises
    ------
    BodyError
        If there is no image, or slices differ in size or direction.
    MissingExtra
        Without pydicom.

    """
    slices: list[_Slice] = []
    others: set[str] = set()
    unread = samples = 0
    for name, data in files:
        try:
            found = _read_slice(name, data, MAX_SAMPLES - samples)
        except BodyError:
            if not slices:
                raise  # that is the file that was asked for
            unread += 1
            continue
        if slices and found.series != slices[0].series:
            others.add(found.series)
            continue
        samples += found.frames.size
        slices.append(found)
    notes = [f"{len(others)} other series in the folder left out"] if others else []
    if unread:
        notes.append(f"{unread} other files in the folder left out")
    if not slices:
        raise BodyError(f"{place} is a directory without a DICOM image")
    return _stacked(slices, notes)


def _read_slice(name: str, data: bytes, most: int) -> _Slice:
    try:
        import pydicom  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        hint = "pip install 'voxdisplay[volume]'"
        raise MissingExtra(f"{name}: DICOM files need pydicom", hint=hint) from None
    if data[128:132] != b"DICM":
        raise BodyError(f"{name} is not a DICOM file")
    if _DEFLATED in data[: 1 << 12]:  # the library would unpack it whatever its size
        raise BodyError(f"{name} is deflated as a whole, which is not read")
    dataset: Any = guarded(name, "its header", lambda: pydicom.dcmread(io.BytesIO(data)))
    found: _Slice = guarded(name, "its image", lambda: _slice_of(name, dataset, most))
    return found


def _slice_of(name: str, dataset: Any, most: int) -> _Slice:
    if "PixelData" not in dataset:
        raise BodyError(f"{name} holds no image")
    count = int(dataset.get("NumberOfFrames") or 1)
    rows, columns = int(dataset.Rows), int(dataset.Columns)
    planes = int(dataset.get("SamplesPerPixel", 1))
    if min(count, rows, columns, planes) < 1 or count * rows * columns * planes > most:
        raise BodyError(f"{name} claims {count} frames of {columns} x {rows}: more than are read")
    pixels = np.asarray(dataset.pixel_array)
    if planes > 1:
        pixels = pixels.mean(axis=-1)
    frames = pixels.reshape(-1, rows, columns)
    slope = float(dataset.get("RescaleSlope", 1) or 1)
    shift = float(dataset.get("RescaleIntercept", 0) or 0)
    if (slope, shift) != (1.0, 0.0):
        frames = frames.astype(np.float32) * np.float32(slope) + np.float32(shift)
    if str(dataset.get("PhotometricInterpretation", "")) == "MONOCHROME1":
        frames = -frames.astype(np.float32)  # its low values are the bright ones
    direction = np.array(dataset.get("ImageOrientationPatient") or [1, 0, 0, 0, 1, 0], dtype=float)
    place = dataset.get("ImagePositionPatient")
    down, across = (float(each) for each in dataset.get("PixelSpacing") or (1, 1))
    apart = float(dataset.get("SpacingBetweenSlices") or dataset.get("SliceThickness") or 1)
    return _Slice(
        name,
        str(dataset.get("SeriesInstanceUID", "")),
        frames,
        None if place is None else np.array(place, dtype=float).reshape(3),
        direction.reshape(2, 3),
        (across, down, apart),
        _window(dataset),
    )


def _window(dataset: Any) -> tuple[float, float] | None:
    """Return the first window, as PS3.3, section C.11.2.1.2 defines it."""
    center, width = dataset.get("WindowCenter"), dataset.get("WindowWidth")
    if center is None or width is None:
        return None
    middle, span = (float(np.ravel(np.array(each, dtype=float))[0]) for each in (center, width))
    if str(dataset.get("PhotometricInterpretation", "")) == "MONOCHROME1":
        middle = -middle
    low, high = middle - 0.5 - (span - 1) / 2, middle - 0.5 + (span - 1) / 2
    return (low, high) if low < high else None


def _stacked(slices: list[_Slice], notes: list[str]) -> VolumeSamples:
    first = slices[0]
    normal = np.cross(*first.rows)
    for other in slices[1:]:
        if other.frames.shape != first.frames.shape:
            raise BodyError(f"{other.name}: its image is of another size than that of {first.name}")
        if not np.allclose(other.rows, first.rows, atol=1e-3):
            raise BodyError(f"{other.name}: its slice is turned against that of {first.name}")
    across, down, apart = first.spacing
    if len(slices) > 1 and all(one.position is not None for one in slices):
        heights = np.array([float(normal @ one.position) for one in slices])
        order = np.argsort(heights, kind="stable")
        steps = np.diff(heights[order])
        kept = np.append(True, steps > _UNEVEN * (np.median(steps) or 1))
        if not kept.all():
            notes.append(f"{int((~kept).sum())} slices at places where there is one already "
                         "are left out")  # fmt: skip
        slices = [slices[i] for i in order[kept]]
        steps = np.diff(heights[order][kept])
        apart = float(np.median(steps)) if len(steps) else apart
        if len(steps) and np.abs(steps - apart).max() > _UNEVEN * apart:
            notes.append(f"slices are {steps.min():g} to {steps.max():g} apart: taken as even")
    elif len(slices) > 1:
        notes.append("slices have no positions: taken in the order of their names")
    frames = np.concatenate([one.frames for one in slices])
    lps = np.stack((first.rows[0] * across, first.rows[1] * down, normal * apart), axis=1)
    turned, spacing, note = guarded(
        first.name,
        "its orientation",
        lambda: to_canonical(frames.transpose(2, 1, 0), lps * np.array([[-1], [-1], [1]])),
    )
    return VolumeSamples(turned, spacing, first.window, tuple(notes + ([note] if note else [])))

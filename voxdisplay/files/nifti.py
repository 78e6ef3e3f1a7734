"""Reader of NIfTI files (.nii, .nii.gz): header by nibabel, samples unpacked here."""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files.bounded_unpacking import check_ratio, gunzip
from voxdisplay.files.contents import MAX_SAMPLES, VolumeSamples
from voxdisplay.files.guarded_calls import guarded
from voxdisplay.files.volume_axes import to_canonical

_MAX_HEADER = 1 << 20


def read_nifti(name: str, data: bytes) -> VolumeSamples:
    """Read a NIfTI file, .nii or .nii.gz: its axes are turned to right, anterior, superior.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.

    Raises
    ------
    BodyError
        If it is none; the message names file and reason.
    MissingExtra
        Without nibabel.

    """
    try:
        import nibabel  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        raise MissingExtra(
            f"{name}: NIfTI files need nibabel", hint="pip install 'voxdisplay[volume]'"
        ) from None
    packed = data[:2] == b"\x1f\x8b"
    head = gunzip(name, data, 1024) if packed else data[:1024]
    second = head[4:8] in {b"n+2\0", b"ni2\0"}
    image = nibabel.Nifti2Image if second else nibabel.Nifti1Image

    def header_of(content: bytes) -> Any:
        return image.header_class.from_fileobj(io.BytesIO(content))

    header = guarded(name, "its header", lambda: header_of(head))
    shape = tuple(int(side) for side in header.get_data_shape())
    kind = header.get_data_dtype()
    if len(shape) < 3 or min(shape) < 1 or math.prod(shape) > MAX_SAMPLES:
        raise BodyError(f"{name} claims {' x '.join(map(str, shape)) or 'no'} samples")
    if kind.kind not in "fiu" or kind.itemsize > 8:
        raise BodyError(f"{name} has samples of the type {kind}: real numbers are read")
    offset = guarded(name, "its header", lambda: int(header.get_data_offset()))
    volume = math.prod(shape[:3])
    if not 0 < offset <= _MAX_HEADER:
        raise BodyError(f"{name}: its samples begin at byte {offset}")
    wanted = offset + volume * kind.itemsize  # of several volumes the first
    if packed:
        check_ratio(name, wanted, len(data))
    content = gunzip(name, data, wanted) if packed else data
    if len(content) < wanted:
        raise BodyError(f"{name} is cut off: {len(content)} of {wanted} bytes")
    raw: NDArray[Any] = np.frombuffer(content, kind, volume, offset).reshape(shape[:3], order="F")
    slope, shift = guarded(name, "its scale", header.get_slope_inter)
    if slope not in {None, 1.0} or shift not in {None, 0.0}:
        raw = raw.astype(np.float32 if kind.itemsize <= 2 else np.float64)
        with np.errstate(over="ignore", invalid="ignore"):
            raw *= float(slope or 1)
            raw += float(shift or 0)
    # Without a code the axes are of no known orientation: as they are.
    known = int(header["sform_code"]) or int(header["qform_code"])
    sides = np.diag([*(float(side) or 1.0 for side in header.get_zooms()[:3]), 1.0])
    affine = (
        guarded(name, "its orientation", lambda: np.asarray(header.get_best_affine()))
        if known
        else sides
    )
    turned, spacing, note = guarded(name, "its orientation",
                                    lambda: to_canonical(raw, affine[:3, :3]))  # fmt: skip
    notes = [note] if note else []
    if volume != math.prod(shape):
        notes.append(f"{math.prod(shape) // volume} volumes: the first is shown")
    return VolumeSamples(turned, spacing, None, tuple(notes))

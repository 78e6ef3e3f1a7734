"""Reader of NRRD files: header by pynrrd, samples unpacked here.

Lengths are checked before anything is allocated.
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import BodyError, MissingExtra
from voxdisplay.files.bounded_unpacking import bunzip, check_ratio, gunzip
from voxdisplay.files.contained_files import read_inside, short_name
from voxdisplay.files.contents import MAX_SAMPLES, VolumeSamples
from voxdisplay.files.guarded_calls import guarded
from voxdisplay.files.volume_axes import to_canonical

_MAX_HEADER = 1 << 20

# To right, anterior, superior, by the names of NRRD.
_SPACES = {
    "right-anterior-superior": (1, 1, 1),
    "ras": (1, 1, 1),
    "left-anterior-superior": (-1, 1, 1),
    "las": (-1, 1, 1),
    "left-posterior-superior": (-1, -1, 1),
    "lps": (-1, -1, 1),
}


def read_nrrd(name: str, data: bytes, folder: Path | None = None) -> VolumeSamples:
    """Read an NRRD file, or the header of one whose samples are in a file beside it.

    Parameters
    ----------
    name : str
        Of the file, for errors.
    data : bytes
        What is in it.
    folder : Path, optional
        Where that file is; without a folder, samples must be in the file itself.

    Raises
    ------
    BodyError
        If it is none; the message names file and reason.
    MissingExtra
        Without pynrrd.

    """
    try:
        import nrrd  # noqa: PLC0415 - an extra
    except ModuleNotFoundError:
        raise MissingExtra(
            f"{name}: NRRD files need pynrrd", hint="pip install 'voxdisplay[volume]'"
        ) from None
    if data[:4] != b"NRRD":
        raise BodyError(f"{name} is not an NRRD file")
    file = io.BytesIO(data[:_MAX_HEADER])
    header: dict[str, Any] = guarded(name, "its header", lambda: dict(nrrd.read_header(file)))
    at = file.tell()
    sizes, kind = _nrrd_layout(name, header)
    other = header.get("data file", header.get("datafile"))
    if other is not None:
        if not isinstance(other, str) or "%" in other or other.startswith("LIST") or not folder:
            raise BodyError(f"{name}: its samples are in several files, which are not read")
        data, at, name = read_inside(folder, other), 0, short_name(other)
    wanted = math.prod(sizes) * kind.itemsize
    numbers = _nrrd_numbers(name, header, data[at:], wanted, kind)
    values = numbers.reshape(sizes, order="F")
    return _nrrd_volume(name, values, header)


def _nrrd_layout(name: str, header: dict[str, Any]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    sizes = tuple(int(size) for size in np.ravel(header.get("sizes", ())))
    kind = _NRRD_TYPES.get(str(header.get("type", "")).strip().lower())
    if kind is None:
        raise BodyError(f"{name} has samples of the type {str(header.get('type'))[:40]!r}")
    if not sizes or min(sizes) < 1 or math.prod(sizes) > MAX_SAMPLES:
        sides = " x ".join(map(str, sizes[:8]))
        raise BodyError(f"{name} claims {sides} samples, of which at most {MAX_SAMPLES} are read")
    return sizes, np.dtype(f"{'>' if header.get('endian') == 'big' else '<'}{kind}")


_NRRD_TYPES = {
    word: kind
    for kind, words in {
        "i1": "signed char|int8|int8_t",
        "u1": "uchar|unsigned char|uint8|uint8_t",
        "i2": "short|short int|signed short|signed short int|int16|int16_t",
        "u2": "ushort|unsigned short|unsigned short int|uint16|uint16_t",
        "i4": "int|signed int|int32|int32_t",
        "u4": "uint|unsigned int|uint32|uint32_t",
        "i8": "longlong|long long|long long int|signed long long|signed long long int|int64"
        "|int64_t",
        "u8": "ulonglong|unsigned long long|unsigned long long int|uint64|uint64_t",
        "f4": "float",
        "f8": "double",
    }.items()
    for word in words.split("|")
}


def _nrrd_numbers(
    name: str, header: dict[str, Any], data: bytes, wanted: int, kind: np.dtype[Any]
) -> NDArray[Any]:
    """Return the samples, flat."""
    encoding = str(header.get("encoding", "")).lower()
    lines = int(header.get("line skip", header.get("lineskip", 0)) or 0)
    skip = int(header.get("byte skip", header.get("byteskip", 0)) or 0)
    for _ in range(min(max(lines, 0), len(data))):
        data = data.partition(b"\n")[2]
    if encoding in {"gz", "gzip", "bz2", "bzip2"}:
        check_ratio(name, wanted, len(data))
    if encoding in {"ascii", "text", "txt"}:
        words = data.split(maxsplit=wanted // kind.itemsize)[: wanted // kind.itemsize]
        found = guarded(name, "its samples", lambda: np.array(words, dtype=np.float64))
        with np.errstate(invalid="ignore"):
            data = found.astype(kind).tobytes()
    elif encoding in {"gz", "gzip"}:
        data = gunzip(name, data, wanted + max(skip, 0))
    elif encoding in {"bz2", "bzip2"}:
        data = bunzip(name, data, wanted + max(skip, 0))
    elif encoding == "hex":
        data = guarded(name, "its samples", lambda: bytes.fromhex(data.decode("ascii")))
    elif encoding != "raw":
        raise BodyError(f"{name}: its encoding is {encoding[:40]!r}")
    start = max(0, len(data) - wanted) if skip == -1 else max(skip, 0)
    if len(data) - start < wanted:
        raise BodyError(f"{name} is cut off: {len(data) - start} of {wanted} bytes of samples")
    return np.frombuffer(data, kind, wanted // kind.itemsize, start)


def _nrrd_volume(name: str, values: NDArray[Any], header: dict[str, Any]) -> VolumeSamples:
    notes: list[str] = []
    steps = header.get("space directions")
    rows = np.full((values.ndim, 3), np.nan)
    if steps is not None:
        rows = guarded(name, "its space directions", lambda: _rows(steps, values.ndim))
    spatial = np.flatnonzero(np.isfinite(rows).all(axis=1))
    if len(spatial) != 3:  # none, or in another space: by the axes' spacings
        rows, spatial = _by_spacings(name, values, header)
    for axis in reversed([axis for axis in range(values.ndim) if axis not in spatial]):
        count = values.shape[axis]
        if count > 1:
            notes.append(f"{count} values at each sample: their mean is shown")
        values = values.mean(axis=axis) if count > 1 else values.take(0, axis=axis)
    signs = _SPACES.get(str(header.get("space", "")).lower(), (1, 1, 1))
    directions = rows[spatial].T * np.array(signs)[:, None]
    turned, spacing, note = guarded(name, "its axes", lambda: to_canonical(values, directions))
    return VolumeSamples(turned, spacing, None, tuple(notes + ([note] if note else [])))


def _rows(steps: Any, count: int) -> NDArray[np.float64]:
    """Return the directions of axes, (count, 3), NaN for an axis that is none of space."""
    rows = [[math.nan] * 3 if step is None else list(step) for step in list(steps)]
    found = np.array(rows, dtype=np.float64)
    if found.shape != (count, 3):
        raise ValueError(f"they have the shape {found.shape}")
    return found


def _by_spacings(
    name: str, values: NDArray[Any], header: dict[str, Any]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return directions of axes by their spacings, and which axes are those of space."""
    spacings = np.ones(values.ndim)
    if (given := header.get("spacings")) is not None:
        spacings = guarded(name, "its spacings", lambda: np.array(given, dtype=np.float64).ravel())
    spacings = spacings if spacings.shape == (values.ndim,) else np.ones(values.ndim)
    kinds = [str(kind).lower() for kind in header.get("kinds", [])]
    spatial = np.arange(values.ndim)
    if values.ndim == 4:
        known = [axis for axis, kind in enumerate(kinds[:4]) if kind in {"domain", "space"}]
        spatial = np.array(known if len(known) == 3 else [1, 2, 3])
    if len(spatial) != 3:
        raise BodyError(f"{name} has {values.ndim} axes; a volume has three")
    sound = np.isfinite(spacings) & (spacings > 0)
    rows = np.zeros((values.ndim, 3))
    rows[spatial] = np.diag(np.where(sound, spacings, 1.0)[spatial])
    return rows, spatial

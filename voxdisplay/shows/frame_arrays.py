"""Frames of a show as one numpy array in an .npz file, read and written frame by frame.

The file holds ``frames``, (n, nz, ny, nx) or (n, nz, ny, nx, 3) as of `Frame.array`; ``fps``;
``format``; and for index8 with an own palette ``palette``, (256, 3). Must not know recordings.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from voxdisplay.errors import RecordingError
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.shows.fixed_format_show import FixedFormatShow
from voxdisplay.shows.show import Show
from voxdisplay.shows.zip_archives import ARCHIVE_DAMAGE

_FRAMES = "frames.npy"
_DEFAULT_FPS = 30.0
_SMALL_BYTES = 1 << 16  # of entries that are no frames
_ENTRY_HINT = "write it by numpy.savez_compressed(path, frames=frames, fps=fps, format=format)"


def write_frames(show: Show, path: Path) -> int:
    """Write all frames of a show; return how many.

    Raises
    ------
    RecordingError
        If the file cannot be written, or palettes of frames differ.

    """
    first = show.frame(0)
    array = first.array()
    header = {
        "descr": np.lib.format.dtype_to_descr(array.dtype),
        "fortran_order": False,
        "shape": (show.frame_count, *array.shape),
    }
    part = path.with_name(path.name + ".part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            with archive.open(_FRAMES, "w", force_zip64=True) as entry:
                np.lib.format.write_array_header_1_0(entry, header)
                for number in range(show.frame_count):
                    frame = show.frame(number)
                    if not np.array_equal(frame.palette, first.palette):  # type: ignore[arg-type]  # None for both
                        raise RecordingError(
                            f"frame {number} has another palette than frame 0: an array has one",
                            hint="record it as rgb888",
                        )
                    entry.write(frame.array().tobytes())
            _write_entry(archive, "fps", np.array(show.fps))
            _write_entry(archive, "format", np.array(first.format.value))
            if first.has_own_palette and first.palette is not None:
                _write_entry(archive, "palette", first.palette)
        part.replace(path)
    except OSError as error:
        raise RecordingError(f"cannot write {path}: {error.strerror}") from error
    finally:
        part.unlink(missing_ok=True)
    return show.frame_count


def _write_entry(archive: zipfile.ZipFile, name: str, array: NDArray[Any]) -> None:
    with archive.open(f"{name}.npy", "w") as entry:
        np.lib.format.write_array(entry, array, allow_pickle=False)


class FrameArrays(FixedFormatShow):
    """Frames of an .npz file: a show whose frames are best read in their order.

    Parameters
    ----------
    path : path
    fps : float, optional
        If not as in the file.

    Raises
    ------
    RecordingError
        If the file does not hold frames.
    OSError
        If it cannot be read.

    """

    def __init__(self, path: Path, fps: float | None = None) -> None:
        self._path = path
        self._entry: IO[bytes] | None = None  # at frame `_next`
        self._next = 0
        with path.open("rb") as file:
            try:
                with zipfile.ZipFile(file) as archive:
                    small = self._read_head(archive)
            except RecordingError:
                raise
            except ARCHIVE_DAMAGE as error:
                raise RecordingError(f"{path.name} is no .npz file: {error}") from error
        self.pixel_format = self._format(small.get("format"))
        wanted = self.pixel_format.shape(self._shape[1:4])
        if self._shape[1:] != wanted or self._dtype != np.dtype(self.pixel_format.dtype):
            raise RecordingError(
                f"{path.name}: frames are {self._shape} {self._dtype}, no memory of a display",
                hint="(n, nz, ny, nx) uint8 for mono1 and index8, uint16 for rgb565; "
                "(n, nz, ny, nx, 3) uint8 for rgb888",
            )
        try:
            self.grid = Grid.of(self._shape[3:0:-1])
        except (TypeError, ValueError) as error:
            raise RecordingError(f"{path.name}: {error}") from error
        self._palette = small.get("palette")
        stated = small.get("fps")
        self.fps = fps or (
            float(stated) if stated is not None and stated.size == 1 else _DEFAULT_FPS
        )
        if not 0 < self.fps < np.inf:
            raise RecordingError(f"{path.name}: its fps are {self.fps}")
        self.frame_count = int(self._shape[0])

    def _read_head(self, archive: zipfile.ZipFile) -> dict[str, NDArray[Any]]:
        """Read shape and type of the frames; return the other arrays."""
        names = archive.namelist()
        if _FRAMES not in names:
            raise RecordingError(f"{self._path.name} has no array frames", hint=_ENTRY_HINT)
        with archive.open(_FRAMES) as entry:
            self._shape, self._dtype = _header(entry, self._path)
        return {
            name: self._small(archive, f"{name}.npy")
            for name in ("fps", "format", "palette")
            if f"{name}.npy" in names
        }

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._path, self.fps)

    def frame(self, number: int) -> Frame:
        """Return a frame: see `Show.frame`. One before the last that was read takes long.

        Raises
        ------
        RecordingError
            If the file is damaged, or a pixel is none of the format.

        """
        if not 0 <= number < self.frame_count:
            raise IndexError(f"number is {number}: there are frames 0 to {self.frame_count - 1}")
        palette = None if self._palette is None else self._palette.astype(np.uint8)
        size = int(np.prod(self._shape[1:])) * self._dtype.itemsize
        try:
            if self._entry is None or number < self._next:
                self._entry, self._next = self._open(), 0
            while self._next < number:
                self._entry.read(size)
                self._next += 1
            raw = self._entry.read(size)
            self._next += 1
            frame = Frame(self.grid, self.pixel_format, palette=palette)
            frame.set(np.frombuffer(raw, dtype=self._dtype).reshape(self._shape[1:]))
        except RecordingError:
            raise
        except ARCHIVE_DAMAGE as error:
            self._entry = None
            raise RecordingError(f"{self._path.name}: frame {number}: {error}") from error
        if number == self.frame_count - 1:
            self._entry = None
        return frame

    def _open(self) -> IO[bytes]:
        """Return the frames' entry, behind its header."""
        with zipfile.ZipFile(self._path) as archive:
            entry = archive.open(_FRAMES)  # it keeps the file open
        _header(entry, self._path)
        return entry

    def _format(self, stated: NDArray[Any] | None) -> PixelFormat:
        if stated is not None:
            try:
                return PixelFormat(str(stated))
            except ValueError as error:
                raise RecordingError(f"{self._path.name}: format: {error}") from error
        if self._dtype == np.uint16:
            return PixelFormat.RGB565
        return PixelFormat.RGB888 if len(self._shape) == 5 else PixelFormat.INDEX8

    def _small(self, archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
        if archive.getinfo(name).file_size > _SMALL_BYTES:
            raise RecordingError(f"{self._path.name}: its {name} is too large")
        with archive.open(name) as entry:
            try:
                array: NDArray[Any] = np.lib.format.read_array(entry, allow_pickle=False)
            except ValueError as error:
                raise RecordingError(f"{self._path.name}: {name}: {error}") from error
        return array


def _header(entry: IO[bytes], path: Path) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Read the header of an array."""
    try:
        version = np.lib.format.read_magic(entry)
        read = (
            np.lib.format.read_array_header_1_0
            if version == (1, 0)
            else np.lib.format.read_array_header_2_0
        )
        shape, fortran, dtype = read(entry)
    except ValueError as error:
        raise RecordingError(f"{path.name}: frames: {error}") from error
    if fortran or dtype.hasobject or len(shape) not in {4, 5} or not all(shape):
        raise RecordingError(f"{path.name}: frames are no array of frames", hint=_ENTRY_HINT)
    return shape, dtype

"""Reader of baked LED cube animations (.lcanimraw), version 1, after the published description.

A ZIP archive of ``manifest.json`` and ``frames.bin``, a pool of frames in scan order, which the
manifest's key frames put in their places in time. Its values are linear light; those of displays
are sRGB. Must not know displays.
"""

from __future__ import annotations

import json
import zipfile
from bisect import bisect
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from voxdisplay.errors import RecordingError
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.shows.fixed_format_show import FixedFormatShow
from voxdisplay.shows.zip_archives import ARCHIVE_DAMAGE

_VERSION = 1
_MAX_MANIFEST_BYTES = 1 << 24
_MAX_POOL_BYTES = 1 << 28
_MAX_FRAMES = 10_000_000  # as of scenes
_MAX_FRAME_US = 0xFFFF_FFFF
_CHANNELS = {"Binary": 0, "Grayscale": 1, "Rgb": 3}

_LINEAR = np.arange(256) / 255
# IEC 61966-2-1, with its linear part near black.
_SRGB = np.rint(
    255 * np.where(_LINEAR <= 0.0031308, 12.92 * _LINEAR, 1.055 * _LINEAR ** (1 / 2.4) - 0.055)
).astype(np.uint8)


class LedCubeAnimation(FixedFormatShow):
    """An animation in a file: a show of rgb888, or of mono1 where it has one bit for each LED.

    Parameters
    ----------
    path : path

    Raises
    ------
    RecordingError
        If the file is none, or one of a later version.
    OSError
        If it cannot be read.

    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with path.open("rb") as file:
            try:
                with zipfile.ZipFile(file) as archive:
                    data = self._entry(archive, "manifest.json", _MAX_MANIFEST_BYTES)
                    manifest = self._manifest(data)
                    pool = self._entry(archive, "frames.bin", _MAX_POOL_BYTES)
            except RecordingError:
                raise
            except ARCHIVE_DAMAGE as error:
                self._refuse(f"it is damaged, or no .lcanimraw file: {error}")
        self._read_manifest(manifest, pool)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._path,)

    def _refuse(self, problem: str) -> NoReturn:
        raise RecordingError(f"{self._path.name}: {problem}")

    def _entry(self, archive: zipfile.ZipFile, name: str, most: int) -> bytes:
        try:
            size = archive.getinfo(name).file_size
        except KeyError:
            self._refuse(f"it has no {name}: it is no .lcanimraw file")
        if size > most:
            self._refuse(f"its {name} is {size} bytes long, more than {most}")
        with archive.open(name) as entry:
            return entry.read(most + 1)

    def _manifest(self, data: bytes) -> dict[str, Any]:
        try:
            manifest = json.loads(data)
        except (ValueError, RecursionError) as error:
            self._refuse(f"manifest.json is no JSON: {error}")
        if not isinstance(manifest, dict):
            self._refuse("manifest.json is no object")
        return manifest

    def _read_manifest(self, manifest: dict[str, Any], pool: bytes) -> None:
        version = self._number(manifest, "formatVersion", 0, 1 << 31)
        if version != _VERSION:
            self._refuse(f"it is of version {version}, not {_VERSION}")
        sides = manifest.get("size")
        if not isinstance(sides, dict):
            self._refuse("size is no object of x, y and z")
        try:
            self.grid = Grid.of([self._number(sides, axis, 1, 1 << 31) for axis in "xyz"])
        except (TypeError, ValueError) as error:
            self._refuse(f"size: {error}")
        kind = manifest.get("ledFormat")
        if not isinstance(kind, str) or kind not in _CHANNELS:
            self._refuse(f"ledFormat is {_text(kind)}, none of {', '.join(_CHANNELS)}")
        self._channels = _CHANNELS[kind]
        self.pixel_format = PixelFormat.RGB888 if self._channels else PixelFormat.MONO1
        self.frame_count = self._number(manifest, "frameCount", 1, _MAX_FRAMES)
        self.fps = 1e6 / self._number(manifest, "frameTimeUs", 1, _MAX_FRAME_US)
        self.loop = manifest.get("loop") is True
        voxels = self.grid.voxels
        stride = voxels * self._channels if self._channels else -(-voxels // 8)
        if not pool or len(pool) % stride:
            self._refuse(
                f"frames.bin is {len(pool)} bytes long: frames of {self.grid} {kind} are {stride}"
            )
        self._pool = np.frombuffer(pool, np.uint8).reshape(-1, stride)
        self._read_keyframes(manifest)

    def _read_keyframes(self, manifest: dict[str, Any]) -> None:
        keys = manifest.get("keyframes")
        if not isinstance(keys, list) or not keys:
            self._refuse("keyframes is no list of key frames")
        self._starts: list[int] = []
        self._ids: list[int] = []
        for place, key in enumerate(keys):
            where = f"keyframes[{place}]"
            if not isinstance(key, dict):
                self._refuse(f"{where} is no object")
            at = self._number(key, "at", 0, self.frame_count - 1, where)
            wanted = "0, the first" if place == 0 else f"above {self._starts[-1]}, that before it"
            if at != 0 if place == 0 else at <= self._starts[-1]:
                self._refuse(f"{where}: at is {at}, must be {wanted}")
            self._starts.append(at)
            self._ids.append(self._number(key, "id", 0, len(self._pool) - 1, where))

    def _number(
        self, values: dict[str, Any], key: str, least: int, most: int, where: str = ""
    ) -> int:
        value = values.get(key)
        if type(value) is not int or not least <= value <= most:
            name = f"{where}: {key}" if where else key
            self._refuse(f"{name} is {_text(value)}, no whole number from {least} to {most}")
        return value

    def frame(self, number: int) -> Frame:
        """Return a frame: see `Show.frame`."""
        if not 0 <= number < self.frame_count:
            raise IndexError(f"number is {number}: there are frames 0 to {self.frame_count - 1}")
        data = self._pool[self._ids[bisect(self._starts, number) - 1]]
        frame = Frame(self.grid, self.pixel_format)
        if not self._channels:
            lit = np.flatnonzero(np.unpackbits(data, count=self.grid.voxels, bitorder="little"))
            frame.set_voxels(lit, np.ones(len(lit), dtype=np.uint32))
            return frame
        light = data.reshape(-1, self._channels)
        lit = np.flatnonzero(light.any(axis=1))
        colors = np.broadcast_to(_SRGB[light[lit]], (len(lit), 3))
        frame.set_voxels(lit, self.pixel_format.nearest(colors))
        return frame


def _text(value: object) -> str:
    return repr(value)[:40]

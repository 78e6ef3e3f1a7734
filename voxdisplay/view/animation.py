"""Writers of animations, GIF and MP4, and the turntable film of a page.

A film has one exposure, and a GIF one palette, so that nothing flickers. Knows no file suffixes.
"""

from __future__ import annotations

import itertools
import math
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, overload

import numpy as np

from voxdisplay.errors import MissingExtra
from voxdisplay.printable_text import printable_lines
from voxdisplay.raster.grid import Grid
from voxdisplay.view.axes_and_grid import AXIS_COLORS
from voxdisplay.view.glow import accumulate_light
from voxdisplay.view.lit_voxels import LitVoxels
from voxdisplay.view.picture import RenderOptions, auto_exposure, render_voxels
from voxdisplay.view.pillow import Image

# Number of pictures that the palette is made from, spread over the film; weight of a colour's
# frequency in it: 0 none, 1 proportional.
_PALETTE_SAMPLES, _FREQUENCY_EXPONENT = 4, 0.4


class Turntable(Sequence[Image.Image]):
    """The pictures of one full turn, rendered when they are accessed.

    Parameters
    ----------
    lit : Lit
    grid : Grid
    options : Look
        Its camera is that of the first picture.
    count : int
        Number of pictures.
    progress : callable, optional
        Called with (pictures rendered, pictures in all).

    """

    def __init__(
        self,
        lit: LitVoxels,
        grid: Grid,
        options: RenderOptions,
        count: int,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        self._lit, self._grid, self._options, self._count = lit, grid, options, count
        self._progress = progress
        light = accumulate_light(lit, grid, options.camera, options.size).light
        self._exposure = auto_exposure(light) if light.size else 1.0

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, number: int) -> Image.Image: ...
    @overload
    def __getitem__(self, number: slice) -> list[Image.Image]: ...
    def __getitem__(self, number: int | slice) -> Image.Image | list[Image.Image]:
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(self._count))]
        if not -self._count <= number < self._count:
            raise IndexError(number)
        if self._progress:
            self._progress(number % self._count + 1, self._count)
        camera = self._options.camera.turned(2 * math.pi * number / self._count)
        return render_voxels(
            self._lit, self._grid, replace(self._options, camera=camera), self._exposure
        )


def save_gif(path: Path, pictures: Sequence[Image.Image], fps: float) -> None:
    """Write an animated GIF that repeats without end.

    GIF counts time in hundredths of a second: each picture's start is rounded to that, so that the
    whole film has its length.
    """
    samples = {
        n: pictures[n]
        for n in {i * len(pictures) // _PALETTE_SAMPLES for i in range(_PALETTE_SAMPLES)}
    }
    palette = _palette([*samples.values()])
    quantised = (
        (samples.pop(number, None) or pictures[number]).quantize(
            palette=palette, dither=Image.Dither.NONE
        )
        for number in range(len(pictures))
    )
    ticks = [round(100 * i / fps) for i in range(len(pictures) + 1)]
    next(quantised).save(
        path,
        format="GIF",
        save_all=True,
        append_images=quantised,
        duration=[10 * (after - at) for at, after in itertools.pairwise(ticks)],
        loop=0,
        palette=bytes(palette.getpalette() or b""),  # or else each picture has a copy
        optimize=False,  # True gives pictures palettes of their own
        disposal=1,
    )


def _palette(samples: Sequence[Image.Image]) -> Image.Image:
    """Return an image with a palette of 256 colours for all pictures, found from some of them.

    Rare colours count nearly as much as common ones: the background is most of a picture, and
    least of what matters.
    """
    colors = np.concatenate([np.asarray(one)[::3, ::3].reshape(-1, 3) for one in samples])
    red, green, blue = (colors >> 1).astype(np.int32).T
    counts = np.bincount(red << 14 | green << 7 | blue)
    distinct = np.flatnonzero(counts)
    repeated = np.repeat(
        distinct, np.ceil(counts[distinct] ** _FREQUENCY_EXPONENT).astype(np.int64)
    )
    rgb = np.stack([repeated >> 14, repeated >> 7 & 127, repeated & 127], axis=1).astype(np.uint8)
    rgb <<= 1
    count = 256 - len(AXIS_COLORS)  # thin lines, which averaging would lose
    found = Image.fromarray(rgb[None]).quantize(count, method=Image.Quantize.MEDIANCUT)
    palette = Image.new("P", (1, 1))
    palette.putpalette([*(found.getpalette() or [])[: 3 * count], *np.ravel(AXIS_COLORS).tolist()])
    return palette


def save_mp4(path: Path, pictures: Sequence[Image.Image], fps: float) -> None:
    """Write H.264 in an MP4 file, by PyAV or by an ``ffmpeg`` on the PATH.

    Raises
    ------
    MissingExtra
        If there is neither.
    OSError
        If the encoder fails.

    """
    width, height = (side & ~1 for side in pictures[0].size)  # chroma has half the resolution
    frames = (picture.crop((0, 0, width, height)) for picture in pictures)
    try:
        import av  # noqa: F401, PLC0415 - an extra, and 120 MB
    except ModuleNotFoundError:
        if (ffmpeg := shutil.which("ffmpeg")) is None:
            raise MissingExtra(
                "MP4 films need PyAV or ffmpeg, and neither is installed",
                hint="pip install 'voxdisplay[mp4]', or install ffmpeg, or write a .gif",
            ) from None
        _encode_by_ffmpeg(ffmpeg, path, frames, (width, height), fps)
    else:
        _encode_by_pyav(path, frames, (width, height), fps)


def _encode_by_pyav(
    path: Path, frames: Iterator[Image.Image], size: tuple[int, int], fps: float
) -> None:
    import av  # noqa: PLC0415

    video_frame: Any = av.VideoFrame  # PyAV has no types for it
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as film:
        stream = film.add_stream("libx264", rate=Fraction(fps).limit_denominator(1001))
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": "18", "preset": "veryfast"}
        stream.width, stream.height = size
        for picture in frames:
            film.mux(stream.encode(video_frame.from_image(picture)))
        film.mux(stream.encode(None))


def _encode_by_ffmpeg(
    ffmpeg: str, path: Path, frames: Iterator[Image.Image], size: tuple[int, int], fps: float
) -> None:
    command = [ffmpeg, "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{size[0]}x{size[1]}", "-r", f"{fps:g}", "-i", "-"]
    command += ["-c:v", "libx264", "-crf", "18", "-preset", "veryfast", "-pix_fmt", "yuv420p"]
    command += ["-movflags", "+faststart", "-f", "mp4", "-y", str(path.resolve())]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as encoder:  # noqa: S603 - no shell
        assert encoder.stdin and encoder.stderr  # noqa: S101, PT018 - they are pipes
        try:
            for picture in frames:
                encoder.stdin.write(picture.tobytes())
            encoder.stdin.close()
        except BrokenPipeError:
            pass  # its message follows
        message = printable_lines(encoder.stderr.read().decode(errors="replace").strip())
    if encoder.returncode:
        raise OSError(
            0, f"ffmpeg failed: {message.splitlines()[-1][:200] if message else ''}", str(path)
        )

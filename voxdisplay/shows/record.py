"""Recording of shows: chunks are rendered by an engine, kept, and written in order.

A recording that was interrupted goes on where it ended. Must not know how frames are rendered.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

from voxdisplay.errors import RecordingError
from voxdisplay.shows.recording import Recording
from voxdisplay.shows.recording_writer import RecordingWriter
from voxdisplay.shows.render_engines import Chunk, Engine, serial
from voxdisplay.shows.rendering import Rendering
from voxdisplay.shows.show import EncodedFrame

Progress = Callable[[int, int], object]
"""Called with the number of frames rendered, and of all."""

# Some seconds of work for a large scene, and one lost at most; numbers of a moving scene are
# computed for 64 frames together, which no more than two chunks should have to do.
_CHUNK_FRAMES = 32


def record(
    rendering: Rendering,
    path: str | os.PathLike[str],
    *,
    engine: Engine = serial,
    chunk_frames: int = _CHUNK_FRAMES,
    progress: Progress | None = None,
) -> int:
    """Record a show.

    Parameters
    ----------
    rendering : Rendering
    path : path
        Of the recording. Chunks are kept beside it, in ``NAME.parts``, until it is complete.
    engine : Engine
        Renders the chunks: see `render_engines`.
    chunk_frames : int
        Frames of a chunk, at least 1.
    progress : callable, optional

    Returns
    -------
    int
        Number of frames.

    Raises
    ------
    RecordingError
        If the file cannot be written, or the show has no frame.

    """
    path = Path(path)
    total = rendering.show.frame_count
    if total < 1:
        raise RecordingError("the show has no frames")
    chunks = [(first, min(chunk_frames, total - first)) for first in range(0, total, chunk_frames)]
    kept = _KeptChunks(path.with_name(path.name + ".parts"), rendering)
    missing = [chunk for chunk in chunks if not kept.has(chunk)]
    done = total - sum(count for _, count in missing)
    if progress:
        progress(done, total)
    for chunk, frames in engine(rendering, missing):
        kept.keep(chunk, frames)
        done += chunk[1]
        if progress:
            progress(done, total)
    with RecordingWriter(path, rendering.format) as writer:
        for chunk in chunks:
            for frame in kept.frames(chunk):
                writer.append(frame)
    kept.remove()
    return total


def check(rendering: Rendering, path: str | os.PathLike[str], count: int) -> int:
    """Render some frames of a recording again, in this process, and compare them.

    Parameters
    ----------
    rendering : Rendering
    path : path
        Of the recording.
    count : int
        How many frames, spread evenly.

    Returns
    -------
    int
        Number of frames compared.

    Raises
    ------
    RecordingError
        If one differs.

    """
    recording = Recording(path)
    total = recording.frame_count
    numbers = sorted({round(at * (total - 1) / max(count - 1, 1)) for at in range(count)})
    for number in numbers:
        (again,) = rendering.render(number, 1)
        found = recording.recorded_frame(number)
        if (found.payloads, found.header.digest) != (again.payloads or (b"",), again.digest):
            raise RecordingError(
                f"{recording.path.name}: frame {number} differs from what this machine renders",
                hint="machines with other versions of numpy, or other processors, may differ where "
                "a curve grazes a voxel: record it on machines that are alike",
            )
    return len(numbers)


class _KeptChunks:
    """Folder of the chunks that are rendered, each a recording of its own.

    Chunks of another rendering are removed.
    """

    def __init__(self, folder: Path, rendering: Rendering) -> None:
        self._folder = folder
        self._format = rendering.format
        fingerprint = rendering.fingerprint()
        label = folder / "rendering"
        try:
            if folder.is_dir() and not (label.is_file() and label.read_text() == fingerprint):
                shutil.rmtree(folder)
            folder.mkdir(exist_ok=True)
            label.write_text(fingerprint)
        except OSError as error:
            raise RecordingError(
                f"cannot write {folder}: {error.strerror}", hint="choose another place with -o"
            ) from error

    def _path(self, chunk: Chunk) -> Path:
        return self._folder / f"{chunk[0]}-{chunk[1]}.vxs"

    def has(self, chunk: Chunk) -> bool:
        """Return whether a chunk is there and whole."""
        try:
            kept = Recording(self._path(chunk))
        except (OSError, RecordingError):
            return False
        return kept.whole and kept.frame_count == chunk[1]

    def keep(self, chunk: Chunk, frames: list[EncodedFrame]) -> None:
        """Keep a chunk."""
        with RecordingWriter(self._path(chunk), self._format) as writer:
            for frame in frames:
                writer.append(frame)

    def frames(self, chunk: Chunk) -> Iterator[EncodedFrame]:
        """Yield the frames of a chunk."""
        kept = Recording(self._path(chunk))
        for number in range(chunk[1]):
            found = kept.recorded_frame(number)
            yield EncodedFrame(found.payloads, found.header.digest)

    def remove(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self._folder, ignore_errors=True)

"""Repair of recordings: all whole frames of a file into a whole one (recording.md, section 5).

Must not know what frames draw.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from voxdisplay.errors import RecordingError
from voxdisplay.shows.recording import Recording
from voxdisplay.shows.recording_writer import RecordingWriter
from voxdisplay.shows.show import EncodedFrame


@dataclass(frozen=True, slots=True)
class Repaired:
    """Result of a repair.

    Attributes
    ----------
    frames : int
        Number of frames that were written.
    lost : int
        Number of frames that are damaged: where one is missing between others, that before it is
        written once more, so that all others keep their time.

    """

    frames: int
    lost: int


def copy_whole_frames(recording: Recording, path: str | os.PathLike[str]) -> Repaired:
    """Write all whole frames of a recording, and packets of unknown types, into another.

    Parameters
    ----------
    recording : Recording
    path : path
        Of the new file.

    Raises
    ------
    RecordingError
        If no frame is whole, or the file cannot be written.

    """
    target = Path(path)
    if target.exists() and target.samefile(recording.path):
        raise RecordingError(
            f"{target.name} would be replaced by its repair", hint="choose another name with -o"
        )
    lost = 0
    before: tuple[int, EncodedFrame] | None = None
    with RecordingWriter(target, recording.format) as writer:
        for number in range(recording.frame_count):
            try:
                found = recording.recorded_frame(number)
            except RecordingError:
                lost += 1
                if before:
                    writer.append(before[1])
                continue
            again = before is not None and before[0] == found.offset
            lost += again
            before = found.offset, EncodedFrame(found.payloads, found.header.digest)
            writer.append(before[1], others=() if again else found.others)
        if not writer.frame_count:
            raise RecordingError(f"{recording.path.name}: no frame is whole")
    return Repaired(writer.frame_count, lost)

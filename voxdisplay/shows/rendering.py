"""Rendering of shows to encoded frames: a pure function of show, format and frame numbers.

The same arguments give the same bytes in every process. Must not know files or processes.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from voxdisplay.errors import RecordingError
from voxdisplay.frame import Fit, Frame
from voxdisplay.shows.recording_writer import RecordingFormat
from voxdisplay.shows.show import EncodedFrame, EncodedShow, Show, ShowSource


@dataclass(frozen=True)
class Rendering:
    """Arguments of a rendering: the show, and the device for which.

    Attributes
    ----------
    source : Show or ShowSource
        A scene, for example.
    format : RecordingFormat
    own_palette : bool
        For index8: colours that the default palette lacks get entries of their own.
    fit : {"contain", "none", "content"}
        As of `Frame.draw`.

    """

    source: Show | ShowSource
    format: RecordingFormat
    own_palette: bool = False
    fit: Fit = "contain"

    @cached_property
    def show(self) -> Show:
        """The show on the device."""
        if isinstance(self.source, ShowSource):
            blank = Frame(self.format.grid, self.format.format, own_palette=self.own_palette)
            return self.source.show_on(blank, fit=self.fit)
        return self.source

    def __getstate__(self) -> dict[str, object]:
        # The show is made again where it is needed: it may be much larger than its source.
        names = ("source", "format", "own_palette", "fit")
        return {name: getattr(self, name) for name in names}

    def render(self, first: int, count: int) -> Iterator[EncodedFrame]:
        """Yield frames, encoded.

        Parameters
        ----------
        first, count : int
            Number of the first frame, and how many.

        Raises
        ------
        RecordingError
            If a frame is of another display.

        """
        show, wanted = self.show, self.format
        for number in range(first, first + count):
            if isinstance(show, EncodedShow):
                ready = show.encoded_frame(number, wanted.max_payload, wanted.features)
                if ready:
                    yield ready
                    continue
            frame = show.frame(number)
            if (frame.grid, frame.format) != (wanted.grid, wanted.format):
                raise RecordingError(
                    f"frame {number} is of {frame.grid} {frame.format.value}, the recording of "
                    f"{wanted.grid} {wanted.format.value}"
                )
            payloads = frame.payloads(wanted.max_payload, wanted.features)
            yield EncodedFrame(tuple(payloads), frame.digest())

    def fingerprint(self) -> str:
        """Return the SHA-256 of the arguments: equal ones render equal bytes."""
        return hashlib.sha256(
            pickle.dumps((self.source, self.format, self.own_palette, self.fit))
        ).hexdigest()

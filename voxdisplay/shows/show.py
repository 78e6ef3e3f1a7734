"""`Show`: the interface of everything that can be played.

A frame is a pure function of show and number. Must not know where a show comes from.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from voxdisplay.frame import Fit, Frame


@runtime_checkable
class Show(Protocol):
    """A moving picture for displays of one grid and pixel format.

    Frame ``number`` is due ``number / fps`` seconds after the beginning. Calls with the same number
    return equal frames, in whatever order they come. To be prepared in another process, a show must
    pickle.

    Attributes
    ----------
    duration : float
        Seconds; 0 for a still picture, which has one frame.
    fps : float
        Frames per second.
    loop : bool
        Whether it is meant to start again at its end.
    frame_count : int
        Number of frames, at least 1.

    """

    @property
    def duration(self) -> float: ...  # noqa: D102 - see Attributes
    @property
    def fps(self) -> float: ...  # noqa: D102
    @property
    def loop(self) -> bool: ...  # noqa: D102
    @property
    def frame_count(self) -> int: ...  # noqa: D102

    def frame(self, number: int) -> Frame:
        """Return a frame; ``number`` is from 0 to ``frame_count - 1``."""


@runtime_checkable
class ShowSource(Protocol):
    """Something that becomes a show when the display is known, such as a scene."""

    def show_on(self, blank: Frame, *, fit: Fit = "contain") -> Show:
        """Return the show as frames of the kind of a blank one.

        Parameters
        ----------
        blank : Frame
            A blank frame of the display: copies of it are drawn on.
        fit : {"contain", "none", "content"}
            As of `Frame.draw`.

        """


@dataclass(frozen=True, slots=True)
class EncodedFrame:
    """Frame that is encoded already, to be drawn from the dark.

    Attributes
    ----------
    payloads : tuple of bytes
        Ops, one packet each.
    digest : int
        That which a display reports when it shows the frame (protocol.md, section 8).
    note : str
        What a current limit has done to it; empty if nothing.

    """

    payloads: tuple[bytes, ...]
    digest: int
    note: str = ""


@runtime_checkable
class EncodedShow(Show, Protocol):
    """A show whose frames may be encoded already, such as a recording."""

    def encoded_frame(
        self, number: int, max_payload: int, features: Collection[str]
    ) -> EncodedFrame | None:
        """Return a frame ready to be sent; None if it must be encoded for this device.

        Parameters
        ----------
        number : int
            As of `Show.frame`.
        max_payload : int
            Bytes of the longest payload that the device takes.
        features : collection of str
            Features that the device has announced.

        """

"""Requests to a link: frames to show, and ranges of voxels to read.

Must not know when they are sent.
"""

from __future__ import annotations

from collections.abc import Callable

from voxdisplay.link.outgoing_frames import OutgoingFrames, PictureId
from voxdisplay.link.readback import ReadRequests


class LinkRequests:
    """Requests of a link's caller, which `Link` carries out."""

    def __init__(self) -> None:
        self._frames = OutgoingFrames()
        self._reads = ReadRequests()

    @property
    def backlog(self) -> int:
        """Number of frames that are queued and not displayed yet."""
        return len(self._frames)

    @property
    def payload_count(self) -> int:
        """Number of payloads of all frames in the backlog, as far as they are encoded."""
        return self._frames.payload_count

    def present(self, payloads: list[bytes], *, clear: bool = True) -> int:
        """Queue a frame and return its ticket, which `FrameShown` carries.

        See `OutgoingFrames.present`.
        """
        return self._frames.present(payloads, clear=clear)

    def open_frame(self) -> int:
        """Queue a frame that is still being encoded: see `OutgoingFrames.open_frame`."""
        return self._frames.open_frame()

    def append_payloads(self, ticket: int, payloads: list[bytes], *, last: bool) -> None:
        """Append payloads to an open frame: see `OutgoingFrames.append_payloads`."""
        self._frames.append_payloads(ticket, payloads, last=last)

    def hold(self, ticks: int) -> None:
        """Have the frame queued last stay behind the one before it for some refresh ticks.

        Without the feature HOLD it has no effect; nor has a hold of more than a second, which is
        shortened (protocol.md, section 7.12).
        """
        self._frames.hold(ticks)

    def abandon_open_frame(self) -> None:
        """Abandon a frame that is still being encoded: see `OutgoingFrames.abandon_open_frame`."""
        self._frames.abandon_open_frame()

    def present_difference(
        self,
        base: PictureId,
        payloads: list[bytes],
        whole: Callable[[], list[bytes]],
        *,
        held: bool = False,
    ) -> int:
        """Queue a difference from the displayed picture: see `OutgoingFrames`."""
        return self._frames.present_difference(base, payloads, whole, held=held)

    def read(self, start: int, count: int, *, back: bool = False) -> None:
        """Request a range of voxels; `PageReceived` brings it, or its beginning."""
        self._reads.add(start, count, back=back)

    def cancel_reads(self) -> None:
        """Cancel all requests for voxels."""
        self._reads.clear()

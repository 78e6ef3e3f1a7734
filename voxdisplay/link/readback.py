"""Outstanding READ requests and their PAGE answers (protocol.md, section 10).

Must not know the meaning of pixels, nor credit: packets are tags and ordinals here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

MAX_IN_FLIGHT = 64  # far below the number of tags, so that none is used again before its answer


@dataclass(slots=True, eq=False)
class ReadRequest:
    """READ that waits for its PAGE.

    Attributes
    ----------
    start, count : int
        Range of voxels.
    back : bool
        The back page instead of the front page.
    tag : int
        Of its latest transmission.
    ordinal : int
        Of that; 0 while it is not in flight.

    """

    start: int
    count: int
    back: bool
    tag: int = -1
    ordinal: int = 0

    def packet(self, tag: int) -> packets.Read:
        """Return the READ packet with a tag, which is remembered."""
        self.tag = tag
        flags = spec.READ_FLAG_BACK * self.back
        return packets.Read(seq=tag, flags=flags, start=self.start, count=self.count)


class ReadRequests:
    """Read requests of one link, the oldest first."""

    def __init__(self) -> None:
        self._requests: list[ReadRequest] = []

    def __len__(self) -> int:
        return len(self._requests)

    def add(self, start: int, count: int, *, back: bool) -> None:
        """Request a range of voxels."""
        self._requests.append(ReadRequest(start, count, back))

    def clear(self) -> None:
        """Cancel all requests."""
        self._requests.clear()

    @property
    def sendable(self) -> Iterator[ReadRequest]:
        """Requests that may be sent now."""
        unsent = (request for request in self._requests if not request.ordinal)
        return islice(unsent, max(0, MAX_IN_FLIGHT - self.in_flight))

    @property
    def in_flight(self) -> int:
        """Number of requests that were sent and wait for an answer."""
        return sum(request.ordinal > 0 for request in self._requests)

    def mark_lost(self, taken: int) -> None:
        """Have those sent again that were sent before ordinal ``taken`` and are not answered.

        Parameters
        ----------
        taken : int
            The highest ordinal that the device has taken.

        """
        for request in self._requests:
            if request.ordinal < taken:
                request.ordinal = 0

    def reset(self) -> None:
        """Have all requests sent again, in a new session."""
        for request in self._requests:
            request.ordinal = 0

    def take_answered(self, page: packets.Page) -> bool:
        """Remove the request that a PAGE answers; return whether there was one.

        Raises
        ------
        RemoteProtocolError
            If the page has other voxels than were requested.

        """
        request = next((r for r in self._requests if r.ordinal and r.tag == page.seq), None)
        if request is None:
            return False
        if page.start != request.start or not 1 <= page.count <= request.count:
            raise RemoteProtocolError(
                f"PAGE covers {page.count} voxels from {page.start}; "
                f"requested were {request.count} from {request.start}",
                section="10",
                offset=4,
            )
        self._requests.remove(request)
        self.mark_lost(request.ordinal)  # answers keep their order
        return True

"""What has been asked of the device's memory and has not come yet (section 10).

Knows packets only as tags and ordinals; what the pixels mean, and when a READ may go out, is the
business of others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from voxdisplay.errors import RemoteProtocolError
from voxdisplay.wire import packet as packets
from voxdisplay.wire import spec

MAX_IN_FLIGHT = 64  # far fewer than there are tags: none comes round before its answer


@dataclass(slots=True, eq=False)
class ReadRequest:
    """A READ that waits for its PAGE."""

    start: int
    count: int
    back: bool
    tag: int = -1
    ordinal: int = 0  # 0: to be sent

    def packet(self, tag: int) -> packets.Read:
        """Give the READ, under a tag."""
        self.tag = tag
        flags = spec.READ_FLAG_BACK * self.back
        return packets.Read(seq=tag, flags=flags, start=self.start, count=self.count)


class ReadRequests:
    """The requests of one link, the oldest first."""

    def __init__(self) -> None:
        self._requests: list[ReadRequest] = []

    def __len__(self) -> int:
        return len(self._requests)

    def add(self, start: int, count: int, *, back: bool) -> None:
        """Want pixels."""
        self._requests.append(ReadRequest(start, count, back))

    def clear(self) -> None:
        """Want nothing any more."""
        self._requests.clear()

    @property
    def sendable(self) -> Iterator[ReadRequest]:
        """Requests that are not on their way, and may be."""
        unsent = (request for request in self._requests if not request.ordinal)
        return islice(unsent, max(0, MAX_IN_FLIGHT - self.in_flight))

    @property
    def in_flight(self) -> int:
        """How many have been sent, and wait for an answer."""
        return sum(request.ordinal > 0 for request in self._requests)

    def mark_lost(self, taken: int) -> None:
        """Send those again whose PAGE did not come before the answer to something later.

        Parameters
        ----------
        taken : int
            The newest ordinal that the device has taken.

        """
        for request in self._requests:
            if request.ordinal < taken:
                request.ordinal = 0

    def reset(self) -> None:
        """Begin a session: all are to be sent again."""
        for request in self._requests:
            request.ordinal = 0

    def take_answered(self, page: packets.Page) -> bool:
        """Take out what a PAGE answers; tell whether that was anything.

        Raises
        ------
        RemoteProtocolError
            If the page brings other pixels than were asked for.

        """
        request = next((r for r in self._requests if r.ordinal and r.tag == page.seq), None)
        if request is None:
            return False
        if page.start != request.start or not 1 <= page.count <= request.count:
            raise RemoteProtocolError(
                f"PAGE covers {page.count} voxels from {page.start}; "
                f"asked were {request.count} from {request.start}",
                section="10",
                offset=4,
            )
        self._requests.remove(request)
        self.mark_lost(request.ordinal)  # answers keep their order
        return True

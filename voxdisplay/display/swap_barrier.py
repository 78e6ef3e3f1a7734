"""Barrier at which the parts of a display wait until all of them hold a frame.

Must not know frames.
"""

from __future__ import annotations

import threading
from collections.abc import Collection
from typing import Final, Protocol

from voxdisplay.display.handshake import closed_meanwhile

_POLL_S: Final = 0.02  # after which a part that went away is noticed


class Member(Protocol):
    """A part that waits, as the barrier sees it."""

    @property
    def is_present(self) -> bool:
        """False while its device is gone, and for ever if it is not waited for."""

    @property
    def is_cancelled(self) -> bool:
        """True when it must not wait any longer."""


class SwapBarrier:
    """Barrier for one frame: opens once, when all members that are present have arrived.

    Parameters
    ----------
    members : collection of Member
        Those that are waited for. One that goes away meanwhile is not.

    """

    def __init__(self, members: Collection[Member]) -> None:
        self._changed = threading.Condition()
        self._awaited = list(members)
        self._is_open = False

    def wait(self, member: Member) -> None:
        """Arrive, and wait until it is open.

        Raises
        ------
        LocalProtocolError
            If the member was cancelled.

        """
        self.leave(member)
        with self._changed:
            while not self._is_open:
                if member.is_cancelled:
                    raise closed_meanwhile()
                if any(other.is_present for other in self._awaited):
                    self._changed.wait(_POLL_S)
                else:
                    self._open()

    def leave(self, member: Member) -> None:
        """Be waited for no longer: it has arrived, or will not."""
        with self._changed:
            self._awaited = [other for other in self._awaited if other is not member]
            if not self._awaited:
                self._open()

    def _open(self) -> None:
        self._is_open = True
        self._changed.notify_all()

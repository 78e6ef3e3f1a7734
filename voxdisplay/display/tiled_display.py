"""`TiledDisplay`: the user's handle of several displays that are one.

One scene is cut, sent to all parts in parallel, and shown together. Must not know how a part sends.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from voxdisplay.display.display import Display
from voxdisplay.display.display_operations import DisplayOperations
from voxdisplay.display.fair_lock import FairLock
from voxdisplay.display.part_layout import PartLayout
from voxdisplay.display.profile import DisplayProfile
from voxdisplay.display.tiled_connection import PartOpener, TiledConnection
from voxdisplay.display.tiled_operations import TiledOperations
from voxdisplay.display.tiled_receipt import PartState

if TYPE_CHECKING:
    from voxdisplay.display.connection import Clock, Connection


class TiledDisplay(Display):
    """Several open displays as one. It is used like any `Display`.

    `present` returns a `voxdisplay.display.tiled_receipt.TiledReceipt`: its digest is None unless
    all parts have proved their shares. A part that is lost is noted, and left out from then on; the
    others go on. With `vd.open`'s ``reconnect_s`` it is waited for, and gets its picture when it is
    back.

    Parameters
    ----------
    layout : PartLayout
    opener : callable
        As of `TiledConnection`.
    note : callable, optional
        Called with a line of text about what happens to parts, and as of `Display`.
    clock : callable
        Returns seconds.

    """

    def __init__(
        self,
        layout: PartLayout,
        opener: PartOpener,
        *,
        note: Callable[[str], None] | None = None,
        clock: Clock = time.monotonic,
    ) -> None:
        self._note = note
        self._clock = clock
        self._lock = FairLock()
        self._tiles = TiledConnection(layout, opener, note or _ignore, clock)
        # The two below have all that a display and a player use of those that they stand in for; a
        # test holds that.
        self._connection = cast("Connection", self._tiles)
        self._operations = cast(DisplayOperations, TiledOperations(self._tiles, clock))
        self.answers = all(worker.display.answers for worker in self._tiles.workers)

    @property
    def parts(self) -> tuple[PartState, ...]:  # type: ignore[override]
        """State of each part, in the order of the profile."""
        return tuple(
            PartState(
                profile=worker.part,
                port=worker.display.port,
                serial=worker.display.info.serial,
                state="lost" if worker.lost else "open" if worker.is_present else "away",
                reason=None if worker.lost is None else str(worker.lost),
                reconnects=worker.reconnects,
            )
            for worker in self._tiles.workers
        )


def open_tiled(
    profile: DisplayProfile,
    opener: PartOpener,
    note: Callable[[str], None] | None,
    clock: Clock,
) -> TiledDisplay:
    """Open a display that is made of parts; note where they overlap or leave a hole.

    Parameters
    ----------
    profile : DisplayProfile
        It has parts.
    opener : callable
        As of `TiledConnection`.
    note, clock
        As of `TiledDisplay`.

    """
    layout = PartLayout(profile.parts)
    if note is not None and not layout.is_whole:
        for fault in layout.faults():
            note(fault)
        note(layout.drawing())
    return TiledDisplay(layout, opener, note=note, clock=clock)


def part_display_profile(profile: DisplayProfile, number: int) -> DisplayProfile:
    """Return the profile by which a part is opened; what light it gives is the whole's matter."""
    part = profile.parts[number]
    return replace(
        DisplayProfile(), serial=part.serial, axes=part.axes, sink=part.sink, source=profile.source
    )


def _ignore(text: str) -> None:
    del text

"""Pacing of a caller who presents frames: waiting for moments, and the times of frames.

Must not know frames.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from voxdisplay.argument_checks import duration, finite, positive
from voxdisplay.display.playback_counts import Playback
from voxdisplay.display.shared_display import SharedDisplay

_MAX_TURN_S = 0.02  # of a wait: other threads may use the display in between


class PacedDisplay(SharedDisplay):
    """An open connection that goes on sending while its user waits."""

    @property
    def playback(self) -> Playback:
        """Counts of frames presented, shown and dropped, since `clock` began or it was opened."""
        return self._operations.queue.playback.reading()

    def wait_until(self, when: float) -> None:
        """Wait for a moment, and send and receive meanwhile.

        Unlike `time.sleep`, it lets frames of ``present(wait=False)`` go on their way. Other
        threads have their turns.

        Parameters
        ----------
        when : float
            Seconds on the clock of the display: ``time.monotonic``, unless it was opened with
            another.

        """
        when = finite("when", when)
        while True:
            with self._turn() as operations:
                left_s = when - self._clock()
                operations.pump(wait=left_s > 0, within_s=min(left_s, _MAX_TURN_S))
            if left_s <= 0:
                return

    def clock(self, *, fps: float, seconds: float | None = None) -> Iterator[float]:
        """Yield the times of frames, each when it is due, and send and receive while it waits.

        Frame n is due n / fps seconds after the first. If the caller is late, frames are left out:
        the next is always the newest that is due. `playback` counts anew.

        Parameters
        ----------
        fps : float
            Frames per second.
        seconds : float, optional
            How long it goes on; without, it does not end.

        Yields
        ------
        float
            Seconds since the first frame.

        Raises
        ------
        TransportError, DeviceError, DesyncError
            As of `present`.

        """
        fps = positive("fps", fps)
        length_s = math.inf if seconds is None else duration("seconds", seconds)
        return self._frame_times(fps, length_s)

    def _frame_times(self, fps: float, length_s: float) -> Iterator[float]:
        with self._turn() as operations:
            operations.queue.restart_playback()
        began_s, number = self._clock(), 0
        while number / fps < length_s:
            self.wait_until(began_s + number / fps)
            yield number / fps
            number = max(number + 1, math.floor((self._clock() - began_s) * fps))
        self.wait_until(began_s + length_s)

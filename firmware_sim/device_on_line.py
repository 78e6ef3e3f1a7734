"""Device on a line: refresh ticks by a clock, and the faults of the line.

Events are processed in the order of their times, however rarely a method is called. Knows nothing
of the carrier.
"""

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from firmware_sim.device import Device
from firmware_sim.fault_types import Event
from firmware_sim.faults import FaultSpec, FaultyLine

if TYPE_CHECKING:
    from firmware_sim.card_player import CardPlayer

_MAX_BACKLOG_BYTES: Final = 65_536  # on the line; with more, a direction takes no bytes
_MAX_WAIT_S: Final = 3600.0  # longest wait to ask callers for


class DeviceOnLine:
    """A device, its refresh ticks, and a line with faults in front of it.

    Parameters
    ----------
    device
        The device.
    faults
        Faults of the line, as from `parse_faults`.
    seed
        Seed of their random numbers.
    clock
        Monotonic seconds.
    player
        Plays a recording on the device until a host opens a session.

    Attributes
    ----------
    device : Device
        The device.

    Raises
    ------
    ConnectionError
        From every method but `disconnect`, once the device is unplugged.
    """

    def __init__(
        self,
        device: Device,
        faults: tuple[FaultSpec, ...] = (),
        seed: int = 0,
        clock: Callable[[], float] = time.monotonic,
        player: "CardPlayer | None" = None,
    ) -> None:
        self.device = device
        self._player = player
        self._unplugged = False
        self._down = FaultyLine(faults, seed, "down")
        self._up = FaultyLine(faults, seed, "up")
        self._clock = clock
        self._epoch = clock()
        self._swap_tick: int | None = None  # number of the tick that a swap waits for
        self._last_tick = 0  # number of the last tick that the device was told of

    def receive(self, data: bytes) -> None:
        """Carry bytes from the host to the device."""
        now = self._clock()
        self._run_until(now)
        self._down.send(now, data)
        self._run_until(now)

    def transmit(self) -> bytes:
        """Return bytes from the device for the host: as many as arrive together."""
        now = self._clock()
        self._run_until(now)
        while self._up.due <= now:
            come = self._up.take(now)
            if isinstance(come, bytes):
                self._collect_output(now)
                return come
            self._apply_event(come, now)
        return b""

    def accepts_data(self) -> bool:
        """Return whether the line takes bytes from the host: not while it is full."""
        self.advance()
        return self._down.backlog < _MAX_BACKLOG_BYTES

    def advance(self) -> None:
        """Process the events that are due."""
        self._run_until(self._clock())

    def next_event_s(self) -> float | None:
        """Return the seconds until the next event; None if none is scheduled.

        An event is a tick that swaps, the arrival of bytes that the line has delayed, or a frame of
        the player. It is 0 if the device has sent something during this call, by a tick just come.
        """
        now = self._clock()
        left = self._up.due <= now  # output that was there before this call
        self._run_until(now)
        if self._up.due <= now and not left:
            return 0.0
        up = self._up.due if self._up.due > now else math.inf
        at = min(self._swap_time(), self._feed_time(), self._down.due, up)
        return min(at - now, _MAX_WAIT_S) if at < math.inf else None

    def disconnect(self) -> None:
        """End the connection: the session ends, and bytes on the line are lost."""
        self.device.disconnect()
        self._down.connect()
        self._up.connect()
        self._swap_tick = None
        self._unplugged = False

    def _swap_time(self) -> float:
        """Return the time of the tick that a swap waits for; infinity if none does.

        Ticks are counted from the start, so that they do not drift. The device is told of those
        between two swaps together.
        """
        if self._swap_tick is None:
            return math.inf
        return self._epoch + self._swap_tick * 1000 / self.device.config.refresh

    def _feed_time(self) -> float:
        """Return the time of the tick after which the player feeds the device; else infinity."""
        player = self._player
        if player is None or player.due is None:
            return math.inf
        return self._epoch + player.due * 1000 / player.rate

    def _run_until(self, now: float) -> None:
        while True:
            self._check_plugged()
            tick, comes, feeds = self._swap_time(), self._down.due, self._feed_time()
            if min(tick, comes, feeds) > now:
                return
            if self._player and self._player.due is not None and feeds < min(tick, comes):
                passed = self._player.due
                self._player.feed(passed)
                self._collect_output(feeds, passed + 1)
                continue
            if self._swap_tick is not None and tick <= comes:
                count, self._last_tick = self._swap_tick - self._last_tick, self._swap_tick
                self.device.tick(count)
                self._collect_output(tick, self._last_tick + 1)
                continue
            come = self._down.take(comes)
            if isinstance(come, bytes):
                self.device.receive(come)
                self._collect_output(comes)
            else:
                self._apply_event(come, comes)

    def _apply_event(self, event: Event, at: float) -> None:
        if event is Event.REBOOT:
            self.device.power_cycle()
            self._collect_output(at)
        elif event is Event.UNPLUG:
            self._unplugged = True
            self._check_plugged()

    def _check_plugged(self) -> None:
        if self._unplugged:
            raise ConnectionError("the device is unplugged")

    def _collect_output(self, at: float, next_tick: int | None = None) -> None:
        """Put the device's output on the line, and schedule the tick of a pending swap.

        Parameters
        ----------
        at
            The time.
        next_tick
            Number of the tick that is next, if it is known better than by the time.
        """
        if self._player and self._player.active:
            self.device.transmit()  # no host has asked
        while self._up.backlog < _MAX_BACKLOG_BYTES and (data := self.device.transmit()):
            self._up.send(at, data)
        if not self.device.pending:
            self._swap_tick = None
            return
        if next_tick is None:
            next_tick = int((at - self._epoch) * self.device.config.refresh / 1000) + 1
        self._swap_tick = max(next_tick, self._last_tick + self.device.ticks_left)

"""One device behind a pipe: a `Link` pumped over a `Transport`, through loss and return.

It writes only what the device has room for, so that writing cannot block against the device's
answers. It knows when to wait, and who is there; it knows no pictures, and what is to be sent or
sent again is the business of others.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TextIO, TypeAlias

from voxdisplay.display.device_info import DeviceInfo, check_same, device_info
from voxdisplay.display.handshake import new_session, said_before
from voxdisplay.display.reconnect import Reconnect
from voxdisplay.errors import IncompatibleDevice, TransportClosed, TransportError, TransportTimeout
from voxdisplay.link import Event, Link, PageRead, Ready, Shown
from voxdisplay.transport import Transport
from voxdisplay.transport.capture import Capture

_LONGEST_WAIT_S = 0.5

Clock: TypeAlias = Callable[[], float]


@dataclass(frozen=True, slots=True)
class Renewed:
    """The device was gone; it is back, behind a new pipe, and may have forgotten its picture."""


class Connection:
    """A session with a device, open.

    Parameters
    ----------
    transport : Transport
        An open pipe to the device.
    timeout_s : float
        How long the device may be silent.
    reconnect : Reconnect or None
        Who waits for a device that has gone away, and finds it again.
    capture : text file or None
        Gets all bytes to and from the device.
    clock : callable
        Gives seconds, on any steady clock.

    Attributes
    ----------
    port : str
        The name the pipe was opened by.
    link : Link
    info : DeviceInfo
        What the device said of itself.
    renewals : int
        How often the device was gone and has come back.
    closed : bool

    """

    def __init__(
        self,
        transport: Transport,
        *,
        timeout_s: float,
        reconnect: Reconnect | None,
        capture: TextIO | None,
        clock: Clock,
    ) -> None:
        self.port = transport.port
        self.renewals = 0
        self.closed = False
        self._clock = clock
        self._timeout_s = timeout_s
        self._capture = capture
        self._transport = self._captured(transport)
        self._reconnect: Reconnect | None = None  # not before the device is known
        self._events: deque[Event | Renewed] = deque()
        self.link = self._new_link()
        self.info = self._greet()
        self._reconnect = reconnect

    def _captured(self, transport: Transport) -> Transport:
        return Capture(transport, self._capture) if self._capture else transport

    def _new_link(self) -> Link:
        return Link(new_session(), self._clock(), patience_s=self._timeout_s)

    def _greet(self) -> DeviceInfo:
        try:
            while not self.link.ready:
                self._exchange(wait=True)
        except TransportTimeout as error:
            raise TransportTimeout(f"{self.port}: {error}", hint=error.hint) from error
        except TransportClosed as error:
            raise said_before(error, self.link.stream.noise) from error
        assert self.link.info is not None  # noqa: S101 - ready
        return device_info(self.link.info)

    @property
    def bytes_per_s(self) -> float | None:
        """What the line carries: as it was seen, or else as its pipe says; None if neither."""
        return self.link.bytes_per_s or getattr(self._transport, "bytes_per_s", None)

    def turn(self, *, wait: bool) -> None:
        """Write what may be written, wait for an answer or the time to ask, take what comes."""
        try:
            self._exchange(wait=wait)
        except (TransportClosed, TransportTimeout) as error:
            self._renew(error)

    def _exchange(self, *, wait: bool) -> None:
        if not wait:  # the caller was away: what has come since is not to count as newer than this
            self._hear(0.0)
        if out := self.link.transmit(self._clock()):
            self._transport.write(out, self._timeout_s)
        if wait:
            wait_s = self.link.next_timeout(self._clock())
            self._hear(_LONGEST_WAIT_S if wait_s is None else min(wait_s, _LONGEST_WAIT_S))

    def _hear(self, wait_s: float) -> None:
        data = self._transport.read(wait_s)
        self._events += self.link.receive(data, self._clock())

    def _renew(self, error: TransportError) -> None:
        """Wait for the device to come back."""
        if self._reconnect is None:
            raise error
        self._transport.close()
        self._transport = self._captured(self._reconnect.wait(error, self.info.serial))
        self.port = self._transport.port
        self.renewals += 1
        self.link.renew(self._clock())
        self._events.append(Renewed())

    def events(self) -> Iterator[Event | Renewed]:
        """Give what has happened, each thing once; what is not taken is kept.

        Raises
        ------
        IncompatibleDevice
            If another device is behind the port now: what waits to be sent is not for it.

        """
        while self._events:
            event = self._events.popleft()
            if self._reconnect and isinstance(event, Shown | PageRead):
                self._reconnect.settled()
            if isinstance(event, Ready) and self.link.counters.sessions > 1:
                self._check_same(event)
            yield event

    def _check_same(self, ready: Ready) -> None:
        try:
            now = device_info(ready.info)
            check_same(self.info, now)
        except IncompatibleDevice:
            self.close()
            raise
        self.info = now

    def begin_again(self, within_s: float) -> None:
        """Open a new session at once, with all that is on its way dropped.

        The device is not waited for any more if it goes away, and if it is silent, no longer than
        so many seconds.
        """
        self._reconnect = None
        self._timeout_s = min(self._timeout_s, within_s)
        self._events.clear()
        self.link = self._new_link()
        self._greet()

    def close(self) -> None:
        """Close the pipe. Twice is fine."""
        if not self.closed:
            self.closed = True
            self._transport.close()

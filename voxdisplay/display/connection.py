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

from voxdisplay.display.device_info import DeviceInfo, check_compatible, device_info
from voxdisplay.display.handshake import closed_before_info, random_session
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.errors import IncompatibleDevice, TransportClosed, TransportError, TransportTimeout
from voxdisplay.link import Event, FrameShown, Link, PageReceived, SessionOpened
from voxdisplay.transport import Transport
from voxdisplay.transport.capture import Capture

_LONGEST_WAIT_S = 0.5

Clock: TypeAlias = Callable[[], float]


@dataclass(frozen=True, slots=True)
class Reconnected:
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
        reconnect: Reconnector | None,
        capture: TextIO | None,
        clock: Clock,
    ) -> None:
        self.port = transport.port
        self.reconnects = 0
        self.closed = False
        self._clock = clock
        self._timeout_s = timeout_s
        self._capture = capture
        self._transport = self._with_capture(transport)
        self._reconnector: Reconnector | None = None  # not before the device is known
        self._events: deque[Event | Reconnected] = deque()
        self.link = self._new_link()
        self.info = self._open_session()
        self._reconnector = reconnect

    def _with_capture(self, transport: Transport) -> Transport:
        return Capture(transport, self._capture) if self._capture else transport

    def _new_link(self) -> Link:
        return Link(random_session(), self._clock(), timeout_s=self._timeout_s)

    def _open_session(self) -> DeviceInfo:
        try:
            while not self.link.ready:
                self._exchange(wait=True)
        except TransportTimeout as error:
            raise TransportTimeout(f"{self.port}: {error}", hint=error.hint) from error
        except TransportClosed as error:
            raise closed_before_info(error, self.link.stream.noise) from error
        assert self.link.info is not None  # noqa: S101 - ready
        return device_info(self.link.info)

    @property
    def bytes_per_s(self) -> float | None:
        """What the line carries: as it was seen, or else as its pipe says; None if neither."""
        return self.link.bytes_per_s or getattr(self._transport, "bytes_per_s", None)

    def pump(self, *, wait: bool) -> None:
        """Write what may be written, wait for an answer or the time to ask, take what comes."""
        try:
            self._exchange(wait=wait)
        except (TransportClosed, TransportTimeout) as error:
            self._wait_for_device(error)

    def _exchange(self, *, wait: bool) -> None:
        if not wait:  # the caller was away: what has come since is not to count as newer than this
            self._receive(0.0)
        if out := self.link.transmit(self._clock()):
            self._transport.write(out, self._timeout_s)
        if wait:
            wait_s = self.link.next_timeout(self._clock())
            self._receive(_LONGEST_WAIT_S if wait_s is None else min(wait_s, _LONGEST_WAIT_S))

    def _receive(self, wait_s: float) -> None:
        data = self._transport.read(wait_s)
        self._events += self.link.receive(data, self._clock())

    def _wait_for_device(self, error: TransportError) -> None:
        """Wait for the device to come back."""
        if self._reconnector is None:
            raise error
        self._transport.close()
        self._transport = self._with_capture(
            self._reconnector.wait_for_device(error, self.info.serial)
        )
        self.port = self._transport.port
        self.reconnects += 1
        self.link.resume(self._clock())
        self._events.append(Reconnected())

    def events(self) -> Iterator[Event | Reconnected]:
        """Give what has happened, each thing once; what is not taken is kept.

        Raises
        ------
        IncompatibleDevice
            If another device is behind the port now: what waits to be sent is not for it.

        """
        while self._events:
            event = self._events.popleft()
            if self._reconnector and isinstance(event, FrameShown | PageReceived):
                self._reconnector.reset_deadline()
            if isinstance(event, SessionOpened) and self.link.counters.sessions > 1:
                self._check_same(event)
            yield event

    def _check_same(self, ready: SessionOpened) -> None:
        try:
            now = device_info(ready.info)
            check_compatible(self.info, now)
        except IncompatibleDevice:
            self.close()
            raise
        self.info = now

    def restart(self, within_s: float) -> None:
        """Open a new session at once, with all that is on its way dropped.

        The device is not waited for any more if it goes away, and if it is silent, no longer than
        so many seconds.
        """
        self._reconnector = None
        self._timeout_s = min(self._timeout_s, within_s)
        self._events.clear()
        self.link = self._new_link()
        self._open_session()

    def close(self) -> None:
        """Close the pipe. Twice is fine."""
        if not self.closed:
            self.closed = True
            self._transport.close()

"""Session with one device behind a pipe: a `Link` pumped over a `Transport`, through reconnects.

It writes only what the device has room for, so that a write cannot deadlock against the device's
answers. Must not know pictures; what is to be sent is decided elsewhere.
"""

from __future__ import annotations

import contextlib
import os
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, TextIO, TypeAlias

from voxdisplay.display.device_info import (
    DeviceInfo,
    check_compatible,
    check_serial,
    device_info,
)
from voxdisplay.display.handshake import closed_before_info, closed_meanwhile, random_session
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.errors import IncompatibleDevice, TransportClosed, TransportError, TransportTimeout
from voxdisplay.link import Event, FrameShown, Link, PageReceived, SessionOpened
from voxdisplay.link.session_opening import HELLO_INTERVAL_S
from voxdisplay.transport import Transport
from voxdisplay.transport.capture import Capture

MAX_WAIT_S: Final = 0.5  # of one exchange
_WRITE_NOW_S: Final = 0.1
# Assumed of a line without a known rate before the first ACK: what the handshake showed, from that
# of 300 Bd, for a device may have had to start first, to that of 9600 Bd.
_LEAST_BYTES_PER_S, _MOST_BYTES_PER_S = 30.0, 960.0
_MAX_DRAIN_S = 60.0

Clock: TypeAlias = Callable[[], float]


@dataclass(frozen=True, slots=True)
class Reconnected:
    """The device is back behind a new pipe, and may have lost its picture."""


class Connection:
    """Open session with a device.

    Parameters
    ----------
    transport : Transport
        An open pipe to the device.
    timeout_s : float
        How long the device may be silent.
    reconnector : Reconnector or None
        Finds a device again that has gone away.
    capture : text file or None
        Receives all bytes to and from the device.
    clock : callable
        Returns seconds, on any monotonic clock.

    Attributes
    ----------
    port : str
        The name the pipe was opened by.
    link : Link
    info : DeviceInfo
    reconnects : int
        How often the device was gone and has come back.
    is_away : bool
        Whether it is gone, and waited for.
    closed : bool
    serial : str or None
        Serial number without which a device that comes back is another.

    """

    serial: str | None = None

    def __init__(
        self,
        transport: Transport,
        *,
        timeout_s: float,
        reconnector: Reconnector | None,
        capture: TextIO | None,
        clock: Clock,
    ) -> None:
        self.port = transport.port
        self.reconnects = 0
        self.is_away = False
        self.closed = False
        self._owner_pid = os.getpid()
        self._cancelled = False
        self._clock = clock
        self._timeout_s = timeout_s
        self._capture = capture
        self._pipe = transport
        self._transport = self._with_capture(transport)
        self._reconnector: Reconnector | None = None  # none before the device is known
        self._events: deque[Event | Reconnected] = deque()
        self.link = self._new_link(timeout_s)
        self.info = self._open_session()
        self._reconnector = reconnector

    def _with_capture(self, transport: Transport) -> Transport:
        return Capture(transport, self._capture) if self._capture else transport

    def _new_link(self, timeout_s: float, hello_interval_s: float = HELLO_INTERVAL_S) -> Link:
        return Link(
            random_session(),
            self._clock(),
            timeout_s=timeout_s,
            hello_interval_s=hello_interval_s,
        )

    def _open_session(self) -> DeviceInfo:
        began_s, received = self._clock(), self.link.counters.received_bytes
        try:
            while not self.link.ready:
                self._exchange(wait=True)
        except TransportTimeout as error:
            raise TransportTimeout(f"{self.port}: {error}", hint=error.hint) from error
        except TransportClosed as error:
            raise closed_before_info(error, self.link) from error
        assert self.link.info is not None  # noqa: S101 - ready
        received = self.link.counters.received_bytes - received
        self._handshake_bytes_per_s = received / max(self._clock() - began_s, 1e-6)
        return device_info(self.link.info)

    @property
    def bytes_per_s(self) -> float | None:
        """Rate of the line: as measured, else as its pipe knows it; None if neither."""
        return self.link.bytes_per_s or getattr(self._pipe, "bytes_per_s", None)

    @property
    def is_inherited(self) -> bool:
        """True in a process that was forked off the one that opened the connection."""
        return os.getpid() != self._owner_pid

    def cancel(self) -> None:
        """Have `pump` raise `LocalProtocolError` in whichever thread it runs, soon."""
        self._cancelled = True

    def pump(self, *, wait: bool, within_s: float = MAX_WAIT_S) -> None:
        """Write what may be written, and read what has come.

        Parameters
        ----------
        wait : bool
            Whether to wait for an answer, until something is to be sent again.
        within_s : float
            How long to wait at most.

        Raises
        ------
        TransportError
            If the pipe fails and the device is not waited for, or does not come back.
        LocalProtocolError
            If the connection was cancelled.

        """
        if self._not_wanted:
            raise closed_meanwhile()
        try:
            self._exchange(wait=wait, within_s=within_s)
        except (TransportClosed, TransportTimeout) as error:
            if self.closed:  # by a signal handler, in the middle of the exchange
                raise closed_meanwhile() from error
            self._wait_for_device(error)

    def write_now(self) -> None:
        """Write what may be written, in any thread while that of the connection does nothing.

        It is meant for a packet on an idle line, and takes no longer than for that. What fails is
        left to `pump`, which will meet it, too.
        """
        with contextlib.suppress(TransportError):
            if out := self.link.transmit(self._clock()):
                self._transport.write(out, min(self._timeout_s, _WRITE_NOW_S))

    @property
    def _not_wanted(self) -> bool:
        return self._cancelled or self.closed

    def _exchange(self, *, wait: bool, within_s: float = MAX_WAIT_S) -> None:
        if not wait:  # bytes that came while the caller was away must not count as newer than now
            self._receive(0.0)
        if out := self.link.transmit(self._clock()):
            self._transport.write(out, self._timeout_s)
        if wait:
            wait_s = self.link.next_timeout(self._clock())
            self._receive(within_s if wait_s is None else min(wait_s, within_s))

    def _receive(self, wait_s: float) -> None:
        data = self._transport.read(wait_s)
        self._events += self.link.receive(data, self._clock())

    def _wait_for_device(self, error: TransportError) -> None:
        if self._reconnector is None:
            raise error
        self._transport.close()
        self.is_away = True
        self._pipe = self._reconnector.wait_for_device(
            error, self.info.serial, lambda: self._not_wanted
        )
        self.is_away = False
        self._transport = self._with_capture(self._pipe)
        self.port = self._transport.port
        self.reconnects += 1
        self.link.resume(self._clock())
        self._events.append(Reconnected())

    def events(self) -> Iterator[Event | Reconnected]:
        """Yield the events since the last call; those that are not consumed are kept.

        Raises
        ------
        IncompatibleDevice
            If another device is behind the port now, for which the queued frames are not meant.

        """
        while self._events:
            event = self._events.popleft()
            if self._reconnector and isinstance(event, FrameShown | PageReceived):
                self._reconnector.reset_deadline()
            if isinstance(event, SessionOpened) and self.link.counters.sessions > 1:
                self._check_compatible(event)
            yield event

    def _check_compatible(self, opened: SessionOpened) -> None:
        try:
            now = device_info(opened.info)
            check_compatible(self.info, now)
            check_serial(now, self.serial)
        except IncompatibleDevice:
            self.close()
            raise
        self.info = now

    def restart(self, within_s: float) -> None:
        """Open a new session, and drop all queued frames.

        What the system has not put on the line yet is dropped, too. HELLO waits behind what is on
        the line already: the device is given the time for that, and longer while it answers that.

        Parameters
        ----------
        within_s : float
            How long the device may be silent besides, and later. It is not waited for any more if
            it goes away.

        """
        self._reconnector = None
        self._cancelled = False
        self._timeout_s = min(self._timeout_s, within_s)
        handshake = max(_LEAST_BYTES_PER_S, min(self._handshake_bytes_per_s, _MOST_BYTES_PER_S))
        bytes_per_s = self.bytes_per_s or self.link.delivery_rate.min_bytes_per_s or handshake
        drain_s = min(self.link.in_flight_bytes / bytes_per_s, _MAX_DRAIN_S)
        if discard := getattr(self._pipe, "discard_output", None):
            discard()
        self._events.clear()
        # On a slow line each HELLO is queued, and answered: the answers must not fill the line.
        self.link = self._new_link(self._timeout_s + drain_s, max(HELLO_INTERVAL_S, drain_s / 2))
        deadline_s = self._clock() + _MAX_DRAIN_S
        received = 0
        while True:
            try:
                self.info = self._open_session()
            except TransportTimeout:
                # Answers of the old session show that the line is only slower than it seemed.
                before, received = received, self.link.counters.received_bytes
                if received == before or self._clock() >= deadline_s:
                    raise
                self.link.extend_timeout(self._timeout_s + drain_s)
            else:
                return

    def close(self) -> None:
        """Close the pipe. Twice is fine."""
        if not self.closed:
            self.closed = True
            self._transport.close()

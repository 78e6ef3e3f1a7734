"""Ways out for packets: UDP datagrams, a TCP stream, a serial line.

Must not know what the packets mean.
"""

from __future__ import annotations

import contextlib
import errno
import socket
import time
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.sinks.hosts import BROADCAST_HINT, check_receiver, resolve_host
from voxdisplay.transport.diagnosis import network_hint
from voxdisplay.transport.library_errors import LIBRARY_ERRORS, message_of
from voxdisplay.transport.serial import SerialTransport

# A receiver takes datagrams one by one, and some have room for few: they are sent in bursts.
_BURST: Final = 32
_BURST_PAUSE_S: Final = 0.001
_REFUSAL_S: Final = 0.05  # within which a host says that nothing listens
_LINGER_S: Final = 0.05
_FULL: Final = {errno.ENOBUFS, errno.EAGAIN, errno.EWOULDBLOCK}
_GREETING_S: Final = 2.0  # a board that restarts when its port is opened is back by then
_SPARE_S: Final = 5.0


class Output(Protocol):
    """A way out for packets."""

    def send(self, packets: Sequence[memoryview]) -> None:
        """Send the packets of one frame, in their order.

        Raises
        ------
        TransportError
            If the receiver is known not to take them.

        """

    def close(self) -> None:
        """Close it. Twice is fine."""


class UdpOutput:
    """Datagrams to one receiver, or to one multicast group for each packet.

    Parameters
    ----------
    port : str
        As the user named it, for errors.
    host : str
    number : int
        UDP port.
    broadcast : bool
        Whether broadcast and multicast addresses are allowed.
    groups : sequence of str, optional
        Multicast groups of the packets, if the host is a multicast address.
    timeout_s : float
    sleep : callable
        Waits for some seconds.

    Raises
    ------
    OpenError
        If there is no such host, or it is no single receiver.

    """

    def __init__(
        self,
        port: str,
        host: str,
        number: int,
        *,
        broadcast: bool,
        timeout_s: float,
        groups: Sequence[str] = (),
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._port, self._timeout_s, self._sleep = port, timeout_s, sleep
        family, address = resolve_host(port, host, number, socket.SOCK_DGRAM, timeout_s)
        multicast = check_receiver(port, address, broadcast=broadcast)
        self._groups = []
        if multicast and family == socket.AF_INET:
            self._groups = [(group, number) for group in groups]
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._is_first = not multicast
        try:
            self._socket.settimeout(timeout_s)
            if broadcast:
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            if not self._groups:
                self._socket.connect(address)
        except OSError as error:
            self._socket.close()
            # Only the system knows which addresses are broadcast addresses of its networks.
            refused = isinstance(error, PermissionError) and not broadcast
            raise OpenError(
                f"{port}: {address[0]} is a broadcast address"
                if refused
                else f"{port} cannot be opened: {message_of(error)}",
                port=port,
                hint=BROADCAST_HINT if refused else network_hint(error),
            ) from error

    def send(self, packets: Sequence[memoryview]) -> None:
        """See `Output.send`."""
        deadline_s = time.monotonic() + self._timeout_s
        try:
            for number, packet in enumerate(packets):
                if number and number % _BURST == 0:
                    self._sleep(_BURST_PAUSE_S)
                self._send_one(number, packet, deadline_s)
            if self._is_first:
                self._is_first = False
                self._raise_refusal()
        except TimeoutError as error:
            raise TransportTimeout(
                f"{self._port}: the network took no more datagrams in {self._timeout_s:g} s"
            ) from error
        except LIBRARY_ERRORS as error:
            nobody = isinstance(error, ConnectionRefusedError)
            reason = "nothing listens there" if nobody else message_of(error)
            raise TransportClosed(f"{self._port}: {reason}", hint=network_hint(error)) from error

    def _send_one(self, number: int, packet: memoryview, deadline_s: float) -> None:
        while True:
            try:
                if self._groups:
                    self._socket.sendto(packet, self._groups[number])
                else:
                    self._socket.send(packet)
            except OSError as error:
                if error.errno not in _FULL:
                    raise
                if time.monotonic() >= deadline_s:
                    raise TimeoutError from error
                self._sleep(_BURST_PAUSE_S)
            else:
                return

    def _raise_refusal(self) -> None:
        """Wait a moment for a host's report that nothing listens, which `recv` then raises."""
        self._socket.settimeout(_REFUSAL_S)
        with contextlib.suppress(TimeoutError):
            self._socket.recv(1)  # what a receiver tells is of no use here
        self._socket.settimeout(self._timeout_s)

    def close(self) -> None:
        """See `Output.close`."""
        self._socket.close()


class TcpOutput:
    """A TCP connection to one receiver.

    Parameters
    ----------
    port : str
        As the user named it, for errors.
    host : str
    number : int
        TCP port.
    timeout_s : float
        How long connecting and each frame may take.
    sleep : callable
        Waits for some seconds.

    Raises
    ------
    OpenError
        If there is no such host, or nothing accepts the connection.

    """

    def __init__(
        self,
        port: str,
        host: str,
        number: int,
        *,
        timeout_s: float,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._port, self._timeout_s, self._sleep = port, timeout_s, sleep
        self._is_fresh = False  # whether a frame was sent that may not have been read
        family, address = resolve_host(port, host, number, socket.SOCK_STREAM, timeout_s)
        check_receiver(port, address, broadcast=False)
        self._socket = socket.socket(family, socket.SOCK_STREAM)
        try:
            self._socket.settimeout(timeout_s)
            self._socket.connect(address)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            self._socket.close()
            raise OpenError(
                f"{port} cannot be opened: {message_of(error)}", port=port, hint=network_hint(error)
            ) from error

    def send(self, packets: Sequence[memoryview]) -> None:
        """See `Output.send`. After a timeout the stream is closed: half a message was sent."""
        deadline_s = time.monotonic() + self._timeout_s
        try:
            self._raise_if_closed()
            for number, packet in enumerate(packets):
                if number:
                    # Some receivers lose a message that arrives together with another.
                    self._sleep(_BURST_PAUSE_S)
                self._socket.settimeout(max(deadline_s - time.monotonic(), _BURST_PAUSE_S))
                self._socket.sendall(packet)
            self._is_fresh = True
        except TimeoutError as error:
            self._is_fresh = False
            self.close()
            raise TransportTimeout(
                f"{self._port} did not take a frame in {self._timeout_s:g} s"
            ) from error
        except LIBRARY_ERRORS as error:
            raise TransportClosed(f"{self._port} is gone: {message_of(error)}") from error

    def _raise_if_closed(self) -> None:
        """Raise if the receiver has closed the connection, which sending reveals too late."""
        self._socket.settimeout(0)
        with contextlib.suppress(BlockingIOError):
            while self._socket.recv(4096):
                continue
            raise ConnectionResetError("the receiver has closed the connection")

    def close(self) -> None:
        """See `Output.close`. Some receivers drop what they have not read when it ends."""
        if self._is_fresh:
            self._is_fresh = False
            self._sleep(_LINGER_S)
        self._socket.close()


class SerialOutput:
    """A serial line to one board.

    Parameters
    ----------
    device : str
        A serial port.
    baud : int
    reset : bool
        As of `SerialTransport`.
    timeout_s : float
        How long a frame may take beyond the time that the line needs.
    greeting : bytes
        What the board sends when it has started: it is waited for, two seconds at most.

    """

    def __init__(
        self, device: str, *, baud: int, reset: bool, timeout_s: float, greeting: bytes
    ) -> None:
        self._pipe = SerialTransport(device, baud=baud, reset=reset)
        self._baud, self._timeout_s = baud, timeout_s
        try:
            self._await_greeting(greeting)
        except BaseException:
            self._pipe.close()
            raise

    def _await_greeting(self, greeting: bytes) -> None:
        deadline_s = time.monotonic() + _GREETING_S
        received = b""
        while greeting not in received and (left_s := deadline_s - time.monotonic()) > 0:
            received = (received + self._pipe.read(left_s))[-1024:]

    def send(self, packets: Sequence[memoryview]) -> None:
        """See `Output.send`. Returns when the system has taken all bytes."""
        for packet in packets:
            line_s = 10 * len(packet) / self._baud
            self._pipe.write(bytes(packet), line_s + self._timeout_s)

    def close(self) -> None:
        """See `Output.close`. Bytes that the system still has are sent first."""
        self._pipe.drain(_SPARE_S)
        self._pipe.close()

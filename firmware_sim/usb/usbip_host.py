"""USB/IP client: a host for the devices of a server, without a kernel.

For tests, and for machines on which no device may be attached. Moves transfers; knows nothing of
their data.
"""

import contextlib
import errno
import socket
import threading
import time
from typing import Final

from firmware_sim.readiness import wait_ready
from firmware_sim.usb import usbip
from firmware_sim.usb.descriptors import IN
from firmware_sim.usb.device import ECONNRESET, ESHUTDOWN, Urb
from firmware_sim.usb.host import SET_CONFIGURATION, PluggedDevice

DEFAULT_PORT: Final = 3240
_REPLY_TIMEOUT_S: Final = 5.0  # to connect, and for replies that come at once
_CHUNK: Final = 1 << 18
_MAX_DEVICES: Final = 256


class UsbIpHost:
    """Host for the devices that a USB/IP server exports.

    Parameters
    ----------
    host, port
        Address of the server.
    """

    def __init__(self, host: str, port: int = DEFAULT_PORT) -> None:
        self._address = host, port

    def plugged(self) -> list[PluggedDevice]:
        """See `Host.plugged`."""
        found = []
        with self._connected() as sock:
            sock.sendall(usbip.OPERATION.pack(usbip.VERSION, usbip.REQUEST_LIST, 0))
            _check_reply(sock, usbip.REPLY_LIST)
            (count,) = usbip.COUNT.unpack(_read(sock, usbip.COUNT.size))
            for _ in range(min(count, _MAX_DEVICES)):
                about = usbip.DEVICE.unpack(_read(sock, usbip.DEVICE.size))
                _read(sock, about[-1] * usbip.INTERFACE.size)
                found.append(self._plugged(*about[1:4]))
        return found

    def _plugged(self, name: bytes, bus: int, number: int) -> PluggedDevice:
        return PluggedDevice(bus, number, lambda: self._import(name))

    def _connected(self) -> socket.socket:
        sock = socket.create_connection(self._address, timeout=_REPLY_TIMEOUT_S)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return sock

    def _import(self, name: bytes) -> "_ImportedDevice":
        sock = self._connected()
        try:
            request = usbip.OPERATION.pack(usbip.VERSION, usbip.REQUEST_IMPORT, 0)
            sock.sendall(request + usbip.BUS_ID_FIELD.pack(name))
            _check_reply(sock, usbip.REPLY_IMPORT)
            about = usbip.DEVICE.unpack(_read(sock, usbip.DEVICE.size))
            imported = _ImportedDevice(sock, about[2] << 16 | about[3])
            imported.transfer(Urb(0, setup=SET_CONFIGURATION), _REPLY_TIMEOUT_S)
        except BaseException:
            sock.close()
            raise
        return imported


def _check_reply(sock: socket.socket, code: int) -> None:
    version, got, status = usbip.OPERATION.unpack(_read(sock, usbip.OPERATION.size))
    if (version, got) != (usbip.VERSION, code):
        raise ConnectionError("this is no USB/IP server")
    if status:
        number = errno.EBUSY if status == usbip.BUSY else errno.ENODEV
        raise OSError(number, f"the server refused, with status {status}")


def _read(sock: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        more = sock.recv(size - len(data))
        if not more:
            raise ConnectionError("the server closed the connection")
        data += more
    return data


class _ImportedDevice:
    """Connection to an imported device.

    Threads may transfer at the same time: one of those that wait reads for all.
    """

    def __init__(self, sock: socket.socket, devid: int) -> None:
        self._socket = sock
        self._devid = devid
        self._seqnum = 0
        self._urbs: dict[int, Urb] = {}
        self._unlinks: dict[int, int] = {}  # number of an unlink -> that of its transfer
        self._in = bytearray()
        self._changed = threading.Condition()
        self._reading = False
        self._lost = False

    def transfer(self, urb: Urb, timeout_s: float | None) -> None:
        """See `Connection.transfer`."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        with self._changed:
            if self._lost:
                raise ConnectionError("it is not plugged in")
            is_in = bool(urb.endpoint & IN or (urb.setup and urb.setup[0] & IN))
            length = urb.length if is_in else len(urb.data)
            seqnum = self._next()
            self._urbs[seqnum] = urb
            message = usbip.Submit(
                *(seqnum, self._devid, urb.endpoint & 15, is_in, length), urb.setup.ljust(8, b"\0")
            )
            self._send(message.pack() + urb.data)
            if self._wait(urb, deadline):
                return
            unlink = self._next()
            self._unlinks[unlink] = seqnum
            self._send(usbip.Unlink(unlink, self._devid, seqnum).pack())
            if not self._wait(urb, time.monotonic() + _REPLY_TIMEOUT_S, unlink):
                self._fail_all()

    def _next(self) -> int:
        self._seqnum += 1
        return self._seqnum

    def _send(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError:
            self._fail_all()

    def _fail_all(self) -> None:
        """Fail all pending transfers: the device is gone."""
        self._lost = True
        for urb in self._urbs.values():
            urb.status = ESHUTDOWN
        self._urbs.clear()
        self._unlinks.clear()
        self._changed.notify_all()

    def _wait(self, urb: Urb, deadline: float | None, unlink: int = 0) -> bool:
        """Wait until a transfer is done and the reply to its cancellation has come."""
        while urb.status is None or unlink in self._unlinks:
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left <= 0:
                return False
            if self._reading:
                self._changed.wait(left)
            else:
                self._read_some(left)
        return True

    def _read_some(self, timeout_s: float | None) -> None:
        """Read for all threads that wait, with the lock released so that they can send."""
        self._reading = True
        self._changed.release()
        try:
            ready, _ = wait_ready([self._socket], timeout_s=timeout_s)
            data = self._socket.recv(_CHUNK) if ready else None
        except (OSError, ValueError):  # closed, by the other side or another thread
            data = b""
        finally:
            self._changed.acquire()
            self._reading = False
            self._changed.notify_all()
        if data:
            self._in += data
            while self._parse_message():
                pass
        elif data is not None:
            self._fail_all()

    def _parse_message(self) -> bool:
        """Process a message if a whole one has been read; return whether one was."""
        if len(self._in) < usbip.MESSAGE_BYTES:
            return False
        try:
            message = usbip.parse_message(bytes(self._in[: usbip.MESSAGE_BYTES]))
        except ValueError:
            message = None
        end = usbip.MESSAGE_BYTES
        if isinstance(message, usbip.SubmitReply):
            urb = self._urbs.get(message.seqnum)
            if urb is None or not 0 <= message.actual <= max(len(urb.data), urb.length):
                self._fail_all()
                return False
            end += message.actual if urb.length else 0
            if len(self._in) < end:
                return False
            urb.received += self._in[usbip.MESSAGE_BYTES : end]
            urb.actual = message.actual
            del self._urbs[message.seqnum]
            urb.status = -message.status
        elif isinstance(message, usbip.UnlinkReply):
            given_up = self._urbs.pop(self._unlinks.pop(message.seqnum, 0), None)
            if given_up:
                given_up.status = ECONNRESET
        else:
            self._fail_all()
            return False
        del self._in[:end]
        return True

    def close(self) -> None:
        """See `Connection.close`."""
        with self._changed:
            self._fail_all()
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # wakes who reads
        self._socket.close()

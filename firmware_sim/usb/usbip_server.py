"""USB/IP server of one device, which a Linux kernel attaches like one that is plugged in.

One host owns the device at a time; others may list it. Moves messages and transfers and knows
nothing of their data. A transfer that the device answers with NAK is completed later, which is how
the device slows its host down.
"""

import contextlib
import socket
from typing import Final

from firmware_sim.readiness import wait_ready
from firmware_sim.serve import accept
from firmware_sim.usb import usbip
from firmware_sim.usb.descriptors import IN
from firmware_sim.usb.device import DONE, ECONNRESET, EPIPE, Urb, UsbDevice

_CHUNK: Final = 1 << 18
MAX_PENDING_BYTES: Final = 16 << 20  # of submitted transfers: Linux's own limit for programs
MAX_UNREAD_BYTES: Final = 1 << 20  # of output that a host has not read
_MAX_CONNECTIONS: Final = 16


class Connection:
    """Protocol state of one connection: bytes in, bytes out, no socket.

    Parameters
    ----------
    server
        The server, which has the device.

    Attributes
    ----------
    out : bytearray
        Bytes to be sent.
    closing : bool
        True if the host broke the protocol, or has its reply: close when `out` is sent.
    """

    def __init__(self, server: "Server") -> None:
        self.out = bytearray()
        self.closing = False
        self._server = server
        self._in = bytearray()
        self._urbs: dict[int, Urb] = {}

    def receive(self, data: bytes) -> None:
        """Take bytes from the host."""
        self._in += data
        self.process()

    def process(self) -> None:
        """Process what the host has sent, as long as it reads the replies."""
        while not self.closing and len(self.out) < MAX_UNREAD_BYTES:
            if not (self._message() if self.imported else self._operation()):
                return

    @property
    def imported(self) -> bool:
        """True if this host owns the device."""
        return self._server.owner is self

    # Before the import

    def _operation(self) -> bool:
        if len(self._in) < usbip.OPERATION.size:
            return False
        version, code, _ = usbip.OPERATION.unpack_from(self._in)
        if version != usbip.VERSION:
            self.closing = True
        elif code == usbip.REQUEST_LIST:
            del self._in[: usbip.OPERATION.size]
            self._list()
        elif code == usbip.REQUEST_IMPORT:
            end = usbip.OPERATION.size + usbip.BUS_ID_FIELD.size
            if len(self._in) < end:
                return False
            (name,) = usbip.BUS_ID_FIELD.unpack_from(self._in, usbip.OPERATION.size)
            del self._in[:end]
            self._import(name.rstrip(b"\0"))
        else:
            self.closing = True
        return True

    def _list(self) -> None:
        device = self._server.device
        about = device.function.descriptors
        self.out += usbip.OPERATION.pack(usbip.VERSION, usbip.REPLY_LIST, usbip.OK)
        self.out += usbip.COUNT.pack(device.plugged)
        if device.plugged:
            self.out += usbip.pack_device(about, device.number, device.configuration)
            for interface in about.interfaces:
                self.out += usbip.INTERFACE.pack(*interface.triple)
        self.closing = True

    def _import(self, name: bytes) -> None:
        server = self._server
        device = server.device
        status = usbip.OK
        if name != usbip.BUS_ID.encode() or not device.plugged:
            status = usbip.NOT_AVAILABLE
        elif server.owner:
            status = usbip.BUSY
        self.out += usbip.OPERATION.pack(usbip.VERSION, usbip.REPLY_IMPORT, status)
        if status == usbip.OK:
            about = device.function.descriptors
            self.out += usbip.pack_device(about, device.number, device.configuration)
            server.owner = self
        else:
            self.closing = True

    # After it

    def _message(self) -> bool:
        if len(self._in) < usbip.MESSAGE_BYTES:
            return False
        try:
            message = usbip.parse_message(bytes(self._in[: usbip.MESSAGE_BYTES]))
        except ValueError:
            self.closing = True
            return False
        if isinstance(message, usbip.Submit):
            return self._submit(message)
        del self._in[: usbip.MESSAGE_BYTES]
        if isinstance(message, usbip.Unlink):
            self._unlink(message)
        else:
            self.closing = True
        return True

    def _submit(self, message: usbip.Submit) -> bool:
        under_way = sum(max(len(urb.data), urb.length) for urb in self._urbs.values())
        if not 0 <= message.length <= MAX_PENDING_BYTES - under_way:
            self.closing = True
            return False
        end = usbip.MESSAGE_BYTES + (0 if message.is_in else message.length)
        if len(self._in) < end:
            return False
        data = bytes(self._in[usbip.MESSAGE_BYTES : end])
        del self._in[:end]
        address = message.endpoint | (IN if message.is_in and message.endpoint else 0)
        urb = Urb(address, data, message.length if message.is_in else 0, message.setup)
        self._urbs[message.seqnum] = urb
        if message.packets not in {0, usbip.NOT_ISOCHRONOUS}:
            urb.status = EPIPE  # isochronous: there is no such endpoint
        else:
            self._server.device.submit(urb)
        self.complete()
        return True

    def _unlink(self, message: usbip.Unlink) -> None:
        """Cancel a transfer. If a part was moved, it ends as a short one: nothing is lost."""
        urb = self._urbs.get(message.target)
        status = DONE
        if urb:
            self._server.device.unlink(urb)
            if not urb.actual:
                del self._urbs[message.target]
                status = ECONNRESET
        self.complete()
        self.out += usbip.UnlinkReply(message.seqnum, -status).pack()

    def complete(self) -> None:
        """Send the replies of the transfers that are done."""
        for seqnum, urb in list(self._urbs.items()):
            if urb.status is not None:
                del self._urbs[seqnum]
                status = DONE if urb.status == ECONNRESET else urb.status
                self.out += usbip.SubmitReply(seqnum, -status, urb.actual).pack() + urb.received


class Server:
    """Server of one device.

    Parameters
    ----------
    device
        The device.

    Attributes
    ----------
    device : UsbDevice
        The device.
    owner : Connection or None
        The connection that has imported it.
    """

    def __init__(self, device: UsbDevice) -> None:
        self.device = device
        self.owner: Connection | None = None
        self._connections: dict[socket.socket, Connection] = {}

    def serve(self, listener: socket.socket, stop: int) -> None:
        """Serve until ``stop`` becomes readable.

        Parameters
        ----------
        listener
            A listening socket.
        stop
            File descriptor that becomes readable when it is time to stop.
        """
        with contextlib.ExitStack() as stack:
            stack.callback(self._close_all)
            while True:
                taking = [s for s, c in self._connections.items() if len(c.out) < MAX_UNREAD_BYTES]
                sending = [s for s, c in self._connections.items() if c.out]
                readers: list[socket.socket | int] = [listener, stop, *taking]
                ready, _ = wait_ready(readers, sending, self.device.next_event_s())
                if stop in ready:
                    return
                if listener in ready:
                    self._accept(listener, stop)
                for sock in taking:
                    if sock in ready:
                        self._read(sock)
                self.device.advance()
                if self.owner and self.device.plugged:
                    self.owner.complete()
                elif self.owner:  # unplugged: the end of the connection tells the host
                    self.owner.out.clear()
                    self.owner.closing = True
                for sock in list(self._connections):
                    self._write(sock)

    def _accept(self, listener: socket.socket, stop: int) -> None:
        sock = accept(listener, stop)
        if sock is None:
            return
        if len(self._connections) >= _MAX_CONNECTIONS:
            sock.close()
            return
        self._connections[sock] = Connection(self)

    def _read(self, sock: socket.socket) -> None:
        try:
            data = sock.recv(_CHUNK)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._connections[sock].receive(data)
        else:
            self._close(sock)

    def _write(self, sock: socket.socket) -> None:
        connection = self._connections[sock]
        try:
            if connection.out:
                del connection.out[: sock.send(connection.out)]
                connection.process()
        except BlockingIOError:
            return
        except OSError:
            connection.closing = True
            connection.out.clear()
        if connection.closing and not connection.out:
            self._close(sock)

    def _close(self, sock: socket.socket) -> None:
        """Close a connection; if it owned the device, the device is unplugged."""
        connection = self._connections.pop(sock)
        sock.close()
        if self.owner is connection:
            self.owner = None
            self.device.reset()

    def _close_all(self) -> None:
        for sock in list(self._connections):
            self._close(sock)


def serve_usbip(device: UsbDevice, listener: socket.socket, stop: int) -> None:
    """Serve a device; see `Server.serve`."""
    Server(device).serve(listener, stop)

"""USB/IP client, with the emulator's server and with other servers."""

import contextlib
import errno
import socket
import struct
import threading

import pytest
import usb.core
import usb.util
from usb_gadget import IN, OUT

from firmware_sim.usb import open_usbip, usbip, usbip_host
from firmware_sim.usb.device import Urb
from firmware_sim.usb.usbip_host import UsbIpHost

WAIT_S = 20


def found(backend):
    return usb.core.find(idVendor=0x1209, backend=backend)


@contextlib.contextmanager
def bad_server(*replies):
    """Answer each connection with the next of some bytes, and close it."""
    done = []
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve():
            for reply in replies:
                connection, _ = listener.accept()
                with connection:
                    connection.settimeout(WAIT_S)
                    for part in reply:
                        if part:
                            connection.sendall(part)
                        else:
                            connection.recv(4096)
            done.append(True)

        thread = threading.Thread(target=serve)
        thread.start()
        yield UsbIpHost(*listener.getsockname()[:2])
        thread.join(WAIT_S)
        assert done


GOOD_IMPORT = (None, bytes.fromhex("0111 0003 00000000") + bytes(usbip.DEVICE.size), None)


def test_something_else_answers():
    reply = (None, b"HTTP/1.1 400 Bad Request\r\n\r\n")
    with bad_server(reply) as host, pytest.raises(ConnectionError, match="no USB/IP server"):
        host.plugged()


def test_it_closes_at_once():
    reply = (None, b"\x01\x11")
    with bad_server(reply) as host, pytest.raises(ConnectionError, match="closed the connection"):
        host.plugged()


@pytest.mark.parametrize(("status", "number"), [(1, errno.ENODEV), (2, errno.EBUSY)])
def test_it_refuses(status, number):
    with bad_server((None, bytes.fromhex(f"0111 0003 {status:08x}"))) as host:
        with pytest.raises(OSError, match="status") as error:
            host._import(b"1-1")
        assert error.value.errno == number


@pytest.mark.parametrize(
    "answer",
    [
        bytes(48),
        usbip.Unlink(1, 1, 1).pack(),
        usbip.SubmitReply(77, 0, 0).pack(),
        usbip.SubmitReply(1, 0, 1 << 20).pack(),
    ],
)
def test_nonsense_loses_the_device(answer):
    with bad_server((*GOOD_IMPORT, answer)) as host:
        # to configure it fails: not by an error of that transfer, but it is no more there
        connection = host._import(b"1-1")
        with pytest.raises(ConnectionError):
            connection.transfer(Urb(IN, length=8), 1)
        connection.close()


def test_an_unlink_that_is_never_answered_loses_the_device(monkeypatch):
    monkeypatch.setattr(usbip_host, "_REPLY_TIMEOUT_S", 0.1)
    answer = usbip.SubmitReply(1, 0, 0).pack()
    with bad_server((*GOOD_IMPORT, answer, None, None, None)) as host:
        connection = host._import(b"1-1")
        urb = Urb(IN, length=8)
        connection.transfer(urb, 0.01)
        assert urb.status == 108
        connection.close()


def test_data_in_pieces_and_a_late_word_of_what_is_done():
    configured = usbip.SubmitReply(1, 0, 0).pack()
    answer = usbip.UnlinkReply(99, -104).pack() + usbip.SubmitReply(2, 0, 4).pack() + b"da"
    rest = b"ta" + usbip.UnlinkReply(3, 0).pack()
    with bad_server((*GOOD_IMPORT, configured, None, answer, None, rest)) as host:
        connection = host._import(b"1-1")
        urb = Urb(IN, length=8)
        connection.transfer(urb, 0.05)
        assert (urb.status, urb.received) == (0, b"data")
        connection.close()


def test_a_server_that_went_away_while_we_send():
    with bad_server((*GOOD_IMPORT, usbip.SubmitReply(1, 0, 0).pack())) as host:
        connection = host._import(b"1-1")
        connection._socket.shutdown(socket.SHUT_WR)
        urb = Urb(OUT, b"x")
        connection.transfer(urb, 1)
        assert urb.status == 108
        connection.close()


def test_a_server_that_crashes_while_we_wait():
    at_once = struct.pack("ii", 1, 0)  # how a connection is reset, not ended
    with socket.create_server(("127.0.0.1", 0)) as listener:
        connection = usbip_host._ImportedDevice(socket.create_connection(listener.getsockname()), 1)
        server, _ = listener.accept()

        def crash():
            server.recv(usbip.MESSAGE_BYTES, socket.MSG_WAITALL)
            server.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, at_once)
            server.close()

        thread = threading.Thread(target=crash)
        thread.start()
        urb = Urb(IN, length=8)
        connection.transfer(urb, WAIT_S)
        thread.join(WAIT_S)
        assert urb.status == 108
        connection.close()


def test_nobody_there():
    with pytest.raises(usb.core.USBError) as error:
        found(open_usbip("usbip://127.0.0.1:1"))
    assert error.value.errno == errno.ECONNREFUSED


@pytest.mark.parametrize(
    "url", ["usbip:", "usbip://", "usbip://x:0", "usbip://x:99999", "usbip://x:y", "usbip://x/1-1"]
)
def test_a_bad_url_is_refused_with_the_remedy(url):
    with pytest.raises(ValueError, match="write usbip://HOST:PORT"):
        open_usbip(url)


def test_good_urls():
    for url, address in [
        ("usbip://127.0.0.1", ("127.0.0.1", 3240)),
        ("usbip://host.example:99", ("host.example", 99)),
        ("usbip://[::1]:5", ("::1", 5)),
    ]:
        assert open_usbip(url).host._address == address

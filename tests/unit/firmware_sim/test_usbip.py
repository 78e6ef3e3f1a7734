"""USB/IP messages and server."""

import contextlib
import errno
import os
import select
import socket
import struct
import threading

import pytest
import usb.core
import usb.util
from device_packets import INFO, hello, parse_responses
from usb_gadget import IN, NUMBER, OUT, PACKET, GadgetDevice, pattern

from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.serve import listen_tcp
from firmware_sim.usb import open_usbip, usbip, usbip_server
from firmware_sim.usb.device import Urb, UsbDevice
from firmware_sim.usb.function import DisplayFunction
from firmware_sim.usb.usbip_host import UsbIpHost
from firmware_sim.usb.usbip_server import Connection, Server, serve_usbip

WAIT_S = 20

LIST = usbip.OPERATION.pack(usbip.VERSION, usbip.REQUEST_LIST, 0)

IMPORT = usbip.OPERATION.pack(usbip.VERSION, usbip.REQUEST_IMPORT, 0) + b"1-1".ljust(32, b"\0")

CONFIGURE = bytes((0, 9, 1, 0, 0, 0, 0, 0))

NO_SETUP = bytes(8)


def submit(seqnum, endpoint, data=b"", *, read=0, setup=NO_SETUP, packets=usbip.NOT_ISOCHRONOUS):
    is_in = bool(read) or bool(setup[0] & 0x80)
    length = read or len(data)
    return usbip.Submit(seqnum, 0x10001, endpoint & 15, is_in, length, setup, packets).pack() + data


def messages(out):
    """Take the messages that were sent, with their data."""
    taken = []
    while out:
        message = usbip.parse_message(bytes(out[:48]))
        size = len(out) if isinstance(message, usbip.SubmitReply) and message.seqnum >= 100 else 48
        size = 48 + message.actual if size > 48 else 48
        taken.append((message, bytes(out[48:size])))
        del out[:size]
    return taken


@pytest.fixture
def server():
    return Server(GadgetDevice())


@pytest.fixture
def host(server):
    """A connection that has imported the gadget, and configured it."""
    connection = Connection(server)
    connection.receive(IMPORT + submit(1, 0, setup=CONFIGURE))
    assert len(connection.out) == usbip.OPERATION.size + usbip.DEVICE.size + 48
    connection.out.clear()
    return connection


@pytest.mark.parametrize(
    ("message", "raw"),
    [
        (
            usbip.Submit(7, 0x10001, 3, False, 300, b"12345678"),
            """00000001 00000007 00010001 00000000 00000003
            00000000 0000012c 00000000 ffffffff 00000000 3132333435363738""",
        ),
        (
            usbip.Unlink(8, 0x10001, 7),
            "00000002 00000008 00010001 00000000 00000000 00000007" + " 00000000" * 6,
        ),
        (
            usbip.SubmitReply(7, -32, 12),
            """00000003 00000007 00000000 00000000 00000000
            ffffffe0 0000000c 00000000 ffffffff 00000000 00000000 00000000""",
        ),
        (
            usbip.UnlinkReply(8, -104),
            "00000004 00000008 00000000 00000000 00000000 ffffff98" + " 00000000" * 6,
        ),
    ],
)
def test_messages_are_the_documents(message, raw):
    """Field by field from the kernel's Documentation/usb/usbip_protocol.rst."""
    assert message.pack() == bytes.fromhex(raw)
    assert usbip.parse_message(bytes.fromhex(raw)) == message


def test_there_is_no_other_message():
    with pytest.raises(ValueError, match="no USB/IP message 5"):
        usbip.parse_message(struct.pack(">5I28x", 5, 0, 0, 0, 0))


def test_the_list(server):
    connection = Connection(server)
    for byte in LIST:
        connection.receive(bytes((byte,)))
    out = connection.out
    assert out[:12] == bytes.fromhex("0111 0005 00000000 00000001")
    about = usbip.DEVICE.unpack_from(out, 12)
    assert about[1].rstrip(b"\0") == b"1-1"
    assert about[2:] == (1, 1, 3, 0x1209, 1, 0x100, 0, 0, 0, 0, 1, 2)
    assert out[12 + usbip.DEVICE.size :] == bytes.fromhex("ff000000 ff565800")
    assert connection.closing


def test_an_empty_list(server):
    server.device.unplug()
    connection = Connection(server)
    connection.receive(LIST)
    assert connection.out == bytes.fromhex("0111 0005 00000000 00000000")


def test_one_host_has_the_device(server, host):
    assert host.imported
    second = Connection(server)
    second.receive(IMPORT[:20])
    assert not second.out
    second.receive(IMPORT[20:])
    assert second.out == bytes.fromhex("0111 0003 00000002")
    assert second.closing


def test_another_device_than_there_is(server):
    connection = Connection(server)
    connection.receive(IMPORT.replace(b"1-1", b"1-2"))
    assert connection.out == bytes.fromhex("0111 0003 00000001")


@pytest.mark.parametrize("raw", ["0106 8005 00000000", "0111 8099 00000000"])
def test_other_versions_and_operations_are_not_talked_to(server, raw):
    connection = Connection(server)
    connection.receive(bytes.fromhex(raw))
    assert connection.closing
    assert not connection.out


def test_transfers(server, host):
    host.receive(submit(100, IN, read=4096))
    assert not host.out
    server.device.do("send", 700, False)
    host.complete()
    assert messages(host.out) == [(usbip.SubmitReply(100, 0, 700), pattern(700))]
    raw = submit(2, OUT, pattern(600))
    host.receive(raw[:100])
    host.receive(raw[100:])
    assert messages(host.out) == [(usbip.SubmitReply(2, 0, 600), b"")]
    assert server.device.do("taken")[0] == [512, 88]
    host.receive(submit(100, 0, read=9, setup=bytes((0xC0, 2, 0, 0, 0, 0, 9, 0))))
    assert messages(host.out) == [(usbip.SubmitReply(100, 0, 9), pattern(9))]


def test_stalls_and_what_there_is_not(server, host):
    server.device.do("halt", IN)
    host.receive(submit(100, IN, read=512))
    host.receive(submit(101, 0x87, read=512))
    host.receive(submit(102, IN, read=512, packets=3))
    statuses = [message.status for message, _ in messages(host.out)]
    assert statuses == [-32, -32, -32]


def test_what_is_given_up_with_nothing_moved(server, host):
    host.receive(submit(100, IN, read=512) + usbip.Unlink(3, 0x10001, 100).pack())
    assert messages(host.out) == [(usbip.UnlinkReply(3, -104), b"")]
    server.device.do("send", 5, False)
    host.complete()
    assert not host.out


def test_what_is_given_up_with_a_part_moved_ends_as_a_short_one(server, host):
    server.device.do("send", 512, False)
    host.receive(submit(100, IN, read=4096) + usbip.Unlink(3, 0x10001, 100).pack())
    assert messages(host.out) == [
        (usbip.SubmitReply(100, 0, 512), pattern(512)),
        (usbip.UnlinkReply(3, 0), b""),
    ]


def test_what_is_given_up_too_late(host):
    host.receive(submit(2, OUT, b"x") + usbip.Unlink(3, 0x10001, 2).pack())
    assert messages(host.out) == [(usbip.SubmitReply(2, 0, 1), b""), (usbip.UnlinkReply(3, 0), b"")]


@pytest.mark.parametrize(
    "raw",
    [
        usbip.SubmitReply(1, 0, 0).pack(),
        bytes(48),
        submit(2, OUT)[:24] + struct.pack(">i", -1) + submit(2, OUT)[28:],
        submit(2, IN, read=usbip_server.MAX_PENDING_BYTES + 1),
    ],
)
def test_who_breaks_the_protocol_is_cut_off(host, raw):
    host.receive(raw + submit(9, OUT, b"x"))
    assert host.closing


def test_who_asks_for_too_much_is_cut_off(host):
    for number in range(16):
        host.receive(submit(100 + number, IN, read=1 << 20))
    assert not host.closing
    host.receive(submit(200, IN, read=1))
    assert host.closing


@contextlib.contextmanager
def serving(device):
    stop, stopper = os.pipe()
    with listen_tcp("127.0.0.1", 0) as listener:
        thread = threading.Thread(target=serve_usbip, args=(device, listener, stop))
        thread.start()
        try:
            yield listener.getsockname()[:2]
        finally:
            os.write(stopper, b"\0")
            thread.join(WAIT_S)
            assert not thread.is_alive()
            os.close(stop)
            os.close(stopper)


def found(backend):
    return usb.core.find(idVendor=0x1209, backend=backend)


def test_a_display():
    device = UsbDevice(DisplayFunction(DeviceOnLine(Device(Config((3, 5, 7), serial="A1")))))
    with serving(device) as (host, port):
        display = found(open_usbip(f"usbip://{host}:{port}/"))
        assert (display.address, display.serial_number) == (1, "A1")
        display.write(0x01, b"\0" + hello())
        assert parse_responses(bytes(display.read(0x81, 4096)))[0].kind == INFO
        usb.util.dispose_resources(display)


def test_a_second_host_is_told_that_the_device_is_busy():
    with serving(GadgetDevice()) as address:
        first = found(usbip_backend(address))
        usb.util.claim_interface(first, NUMBER)
        with pytest.raises(usb.core.USBError) as error:
            found(usbip_backend(address))
        assert error.value.errno == errno.EBUSY
        usb.util.dispose_resources(first)
        again = found(usbip_backend(address))
        assert again.product == "gadget"
        usb.util.dispose_resources(again)


def usbip_backend(address):
    return open_usbip("usbip://{}:{}".format(*address))


def test_threads_transfer_at_the_same_time():
    device = GadgetDevice()
    device.function.echoes = True
    device.function.next_event_s = lambda: 0.005
    with serving(device) as address:
        gadget = found(usbip_backend(address))
        usb.util.claim_interface(gadget, NUMBER)
        got = []
        readers = [
            threading.Thread(target=lambda: got.append(bytes(gadget.read(IN, PACKET, 20_000))))
            for _ in range(4)
        ]
        for reader in readers:
            reader.start()
        for number in range(4):
            gadget.write(OUT, bytes((number,)) * 9)
        for reader in readers:
            reader.join(WAIT_S)
        assert sorted(got) == [bytes((number,)) * 9 for number in range(4)]
        usb.util.dispose_resources(gadget)


def test_a_device_that_is_pulled_out_ends_the_connection():
    device = GadgetDevice()
    device.unplug_at = 1
    with serving(device) as address:
        gadget = found(usbip_backend(address))
        usb.util.claim_interface(gadget, NUMBER)
        with pytest.raises(usb.core.USBError) as error:
            gadget.write(OUT, bytes(2048))
        assert error.value.errno == errno.EIO
        assert found(usbip_backend(address)) is None
        usb.util.dispose_resources(gadget)


def test_closing_wakes_who_waits():
    with serving(GadgetDevice()) as address:
        (plugged,) = UsbIpHost(*address).plugged()
        connection = plugged.connect()
        urb = Urb(IN, length=512)
        reader = threading.Thread(target=connection.transfer, args=(urb, None))
        reader.start()
        connection.close()
        reader.join(WAIT_S)
        assert not reader.is_alive()
        with pytest.raises(ConnectionError):
            connection.transfer(Urb(IN, length=512), None)


def test_one_connection_too_many_is_cut_and_others_may_go_as_they_like(monkeypatch):
    monkeypatch.setattr(usbip_server, "_MAX_CONNECTIONS", 3)
    with serving(GadgetDevice()) as address, contextlib.ExitStack() as stack:
        socks = [stack.enter_context(socket.create_connection(address)) for _ in range(4)]
        cut, _, _ = select.select(socks, [], [], WAIT_S)
        assert cut[0].recv(1) == b""
        cut[0].close()
        rest = [sock for sock in socks if sock is not cut[0]]
        rest[0].close()
        rest[1].setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        rest[1].close()  # by a reset
        rest[2].sendall(LIST)
        rest[2].settimeout(WAIT_S)
        assert rest[2].recv(4) == bytes.fromhex("01110005")


def test_who_does_not_read_is_not_read():
    ask = submit(100, 0, read=255, setup=bytes((0x80, 6, 0, 2, 0, 0, 255, 0))) * 1000
    with serving(GadgetDevice()) as address, socket.create_connection(address) as sock:
        sock.sendall(IMPORT + submit(1, 0, setup=CONFIGURE))
        sock.setblocking(False)
        sent, stuck = 0, 0
        while stuck < 20:
            try:
                sent += sock.send(ask)
                stuck = 0
            except BlockingIOError:
                stuck += 1
                select.select([], [sock], [], 0.01)
            assert sent < 1 << 28
        sock.setblocking(True)
        sock.settimeout(WAIT_S)
        assert sock.recv(1 << 16, socket.MSG_WAITALL)[:4] == bytes.fromhex("01110003")


def test_sockets_that_are_not_ready_or_broken(server):
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    server._connections[ours] = connection = Connection(server)
    server._read(ours)
    connection.out += bytes(1 << 24)
    while connection.out:
        before = len(connection.out)
        server._write(ours)
        if len(connection.out) == before:
            break
    assert ours in server._connections
    theirs.close()
    server._write(ours)
    assert not server._connections


def test_processing_resumes_after_a_clog(host, monkeypatch):
    monkeypatch.setattr(usbip_server, "MAX_UNREAD_BYTES", 60)
    host.receive(submit(2, OUT, b"x") * 5)
    assert len(host.out) == 96
    host.out.clear()
    host.process()
    assert len(host.out) == 96

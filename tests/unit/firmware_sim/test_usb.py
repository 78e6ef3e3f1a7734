"""USB function, descriptors, transfers, and a host in the same process."""

import errno
import struct
import threading

import document
import pytest
import usb.core
import usb.util
from device_packets import (
    ACK,
    CLEAR,
    COMMIT,
    DOT,
    INFO,
    PENDING,
    SHOWN,
    data,
    hello,
    parse_responses,
    status,
)
from usb_gadget import NUMBER, GadgetDevice

from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.usb import open_in_process
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.descriptors import read_configuration
from firmware_sim.usb.device import (
    DONE,
    ECONNRESET,
    EOVERFLOW,
    EPIPE,
    ESHUTDOWN,
    Urb,
    UsbDevice,
)
from firmware_sim.usb.function import DisplayFunction, PacketStream, SerialFunction
from firmware_sim.usb.host import SET_CONFIGURATION, Bus

OUT, IN = 0x01, 0x81


def made(function=DisplayFunction, packet=512, **config):
    """A configured device, and its wire."""
    config = {"grid": (3, 5, 7), "refresh": 0, "serial": "A1"} | config
    wire = DeviceOnLine(Device(Config(**config)), clock=lambda: 0.0)
    device = UsbDevice(function(wire, packet))
    assert control(device, SET_CONFIGURATION).status == DONE
    return device, wire


def control(device, setup, data=b""):
    (length,) = struct.unpack_from("<H", setup, 6)
    urb = Urb(0, data, length if setup[0] & 0x80 else 0, setup)
    device.submit(urb)
    return urb


def setup(kind, request, value=0, index=0, length=0):
    return struct.pack("<BBHHH", kind, request, value, index, length)


def out(device, data):
    urb = Urb(OUT, data)
    device.submit(urb)
    return urb


def into(device, length=4096):
    urb = Urb(IN, length=length)
    device.submit(urb)
    return urb


# What it says of itself


def test_the_interface_is_the_documents():
    device, _ = made()
    told = control(device, setup(0x80, 6, 0x0200, length=255)).received
    wanted = {
        name: document.literals()[f"USB_{name}"] for name in ("CLASS", "SUBCLASS", "PROTOCOL")
    }
    configuration, ((interface, ends),) = read_configuration(bytes(told))
    assert configuration.wTotalLength == len(told)
    assert interface.bInterfaceClass == wanted["CLASS"]
    assert interface.bInterfaceSubClass == wanted["SUBCLASS"]
    assert interface.bInterfaceProtocol == wanted["PROTOCOL"]
    assert [(e.bEndpointAddress & 0x80, e.bmAttributes) for e in ends] == [(0, 2), (0x80, 2)]


def test_its_ids_are_the_test_pair_and_its_texts_those_of_info():
    device, _ = made(name="a cube", serial="")
    told = bytes(control(device, setup(0x80, 6, 0x0100, length=18)).received)
    assert told == bytes.fromhex("12 01 00 02 00 00 00 40 09 12 01 00 00 01 01 02 00 01")
    product = control(device, setup(0x80, 6, 0x0302, 0x0409, 255)).received
    assert product[2:].decode("utf-16-le") == "a cube"
    assert control(device, setup(0x80, 6, 0x0300, 0, 255)).received == b"\x04\x03\x09\x04"


@pytest.mark.parametrize("value", [0x0101, 0x0201, 0x0304, 0x0600, 0x0F00])
def test_what_it_does_not_say_stalls(value):
    device, _ = made()
    assert control(device, setup(0x80, 6, value, length=9)).status == EPIPE


def test_a_configuration_that_is_none_is_refused():
    with pytest.raises(ValueError, match="descriptor of 0 bytes"):
        read_configuration(b"\x09\x02\x0b\x00\x00\x01\x00\xc0\x00\x00\x00")
    with pytest.raises(ValueError, match="descriptor of 9 bytes where 2 are left"):
        read_configuration(b"\x09\x02\x0b\x00\x00\x01\x00\xc0\x00\x09\x04")


def test_an_endpoint_before_any_interface_is_kept_as_something_else():
    raw = b"\x09\x02\x10\x00\x00\x01\x00\xc0\x00" + b"\x07\x05\x81\x02\x00\x02\x00"
    configuration, interfaces = read_configuration(raw)
    assert interfaces == []
    assert bytes(configuration.extra_descriptors) == raw[9:]


# Control requests


def test_configurations():
    device, _ = made()
    assert control(device, setup(0x80, 8, length=1)).received == b"\x01"
    assert control(device, setup(0x00, 9, 2)).status == EPIPE
    assert control(device, setup(0x00, 9, 0)).status == DONE
    assert control(device, setup(0x80, 8, length=1)).received == b"\x00"
    assert out(device, b"x").status == EPIPE
    assert control(device, setup(0x81, 10, length=1)).status == EPIPE
    assert control(device, setup(0x01, 11)).status == EPIPE


def test_interfaces_have_one_setting():
    device, _ = made()
    assert control(device, setup(0x81, 10, length=1)).received == b"\x00"
    assert control(device, setup(0x01, 11, 0)).status == DONE
    assert control(device, setup(0x01, 11, 1)).status == EPIPE


def test_halts():
    device, _ = made()
    assert control(device, setup(0x02, 3, 0, IN)).status == DONE
    assert control(device, setup(0x82, 0, 0, IN, 2)).received == b"\x01\x00"
    assert control(device, setup(0x82, 0, 0, OUT, 2)).received == b"\x00\x00"
    assert control(device, setup(0x80, 0, length=2)).received == b"\x00\x00"
    assert into(device).status == EPIPE
    assert control(device, setup(0x02, 1, 0, IN)).status == DONE
    assert into(device).status is None
    assert control(device, setup(0x02, 3, 0, 0x85)).status == EPIPE
    assert control(device, setup(0x02, 3, 1, IN)).status == EPIPE
    assert control(device, setup(0x00, 1, 1)).status == EPIPE


def test_requests_of_the_protocol_there_are_none():
    device, _ = made()
    assert control(device, setup(0x41, 1)).status == EPIPE
    assert control(device, setup(0xC1, 1, length=3)).status == EPIPE


# Transfers


def test_a_packet_of_the_protocol_goes_in_and_its_answer_comes_out():
    device, _ = made()
    waits = into(device)
    assert waits.status is None
    assert out(device, b"\0" + hello()).status == DONE
    assert waits.status == DONE
    (info,) = parse_responses(waits.received)
    assert (info.kind, info.nx) == (INFO, 3)


@pytest.mark.parametrize("packet", [64, 512])
def test_long_answers_are_cut_into_packets_and_ended(packet):
    function_sees = []
    device, wire = made(packet=packet)
    wire._up.send(0.0, bytes(range(256)) * (packet // 64))
    function = device.function
    while (piece := function.next_packet(IN)) is not None:
        function_sees.append(len(piece))
    assert function_sees == [packet] * 4 + [0]


def test_the_stream_ends_a_full_packet_once():
    stream = PacketStream(4)
    assert stream.next_packet() is None
    stream.put(b"12345678")
    stream.put(b"")
    assert [stream.next_packet() for _ in range(4)] == [b"1234", b"5678", b"", None]
    stream.put(b"1234")
    assert stream.next_packet() == b"1234"
    stream.put(b"5")
    assert [stream.next_packet(), stream.next_packet()] == [b"5", None]


def test_what_does_not_fit_into_the_read_is_lost():
    device, _ = made()
    out(device, b"\0" + hello())
    assert into(device, 10).status == EOVERFLOW
    assert into(device, 10).status is None


def test_a_device_that_waits_for_its_tick_holds_the_host_back():
    """Section 6, point 6, on USB: no credit is overrun, the packets are NAKed."""
    clock = [0.0]
    wire = DeviceOnLine(
        Device(Config((3, 5, 7), refresh=1000, max_payload=64, rx_buffer=600)),
        clock=lambda: clock[0],
    )
    device = UsbDevice(DisplayFunction(wire))
    control(device, SET_CONFIGURATION)
    out(device, hello())
    out(device, data(0, 0, DOT, CLEAR | COMMIT) + data(1, 1, DOT, CLEAR | COMMIT))
    waits = out(device, status() * 150)
    assert waits.status is None
    assert 0 < waits.actual < len(waits.data)
    assert device.next_event_s() == pytest.approx(1.0)
    clock[0] = 2.0
    reads = [into(device)]
    while waits.status is None or reads[-1].status == DONE:
        device.advance()
        reads.append(into(device))
    said = parse_responses(b"".join(urb.received for urb in reads))
    kinds = [(a.kind, a.flags & (PENDING | SHOWN)) for a in said]
    assert waits.status == DONE
    assert wire.device.errors_by_code == {}
    assert (ACK, PENDING) in kinds
    assert kinds[-1] == (ACK, SHOWN)


def test_a_packet_longer_than_the_whole_ring_is_not_waited_for():
    device, _ = made(max_payload=64, rx_buffer=150)
    assert device.function.accepts(OUT, 512)


def test_given_up():
    device, _ = made()
    waits = into(device)
    device.unlink(waits)
    assert waits.status == ECONNRESET
    device.unlink(waits)
    out(device, hello())
    assert into(device).status == DONE


def test_unplugged_and_plugged_in_again():
    device, wire = made()
    waits = into(device)
    out(device, hello())
    assert waits.status == DONE
    waits = into(device)
    device.unplug()
    assert waits.status == ESHUTDOWN
    assert wire.device.session is None
    assert out(device, b"x").status == ESHUTDOWN
    device.plug()
    assert (device.number, device.configuration) == (2, 0)


def test_unplugged_after_so_many_packets():
    device, _ = made()
    device.unplug_at = 2
    assert out(device, hello()).status == DONE
    urb = out(device, bytes(2000))
    assert (urb.status, urb.actual) == (ESHUTDOWN, 512)


# As a serial port


def test_a_serial_port():
    device, wire = made(SerialFunction)
    told = bytes(control(device, setup(0x80, 6, 0x0200, length=255)).received)
    _, ((calls, (notify,)), (line, ends)) = read_configuration(told)
    triples = [
        (i.bInterfaceClass, i.bInterfaceSubClass, i.bInterfaceProtocol) for i in (calls, line)
    ]
    assert triples == [(2, 2, 0), (10, 0, 0)]
    assert bytes(calls.extra_descriptors).hex(" ") == (
        "05 24 00 10 01 05 24 01 00 01 04 24 02 02 05 24 06 00 01"
    )
    assert (notify.bEndpointAddress, notify.bmAttributes) == (0x82, 3)
    assert [e.bEndpointAddress for e in ends] == [OUT, IN]
    assert control(device, setup(0x80, 6, 0x0100, length=18)).received[4] == 2

    notified = Urb(0x82, length=16)
    device.submit(notified)
    rate = struct.pack("<IBBB", 9600, 0, 0, 8)
    assert control(device, setup(0x21, 0x20, 0, 0, 7), rate).status == DONE
    assert control(device, setup(0xA1, 0x21, 0, 0, 7)).received == rate
    assert control(device, setup(0x21, 0x20, 0, 0, 3), b"123").status == EPIPE
    assert control(device, setup(0x21, 0x23)).status == DONE
    assert control(device, setup(0x21, 0x77)).status == EPIPE

    assert control(device, setup(0x21, 0x22, 3)).status == DONE
    out(device, hello())
    assert parse_responses(into(device).received)[0].kind == INFO
    assert wire.device.session
    assert control(device, setup(0x21, 0x22, 0)).status == DONE
    assert wire.device.session is None
    assert notified.status is None


# A host in the same process, seen through pyusb


@pytest.fixture
def backend():
    return open_in_process("sim-usb:?size=3x5x7&refresh=0&serial=A1")


def found(backend):
    return usb.core.find(idVendor=0x1209, backend=backend)


def test_through_pyusb(backend):
    device = found(backend)
    assert (device.product, device.serial_number) == ("voxdisplay emulator", "A1")
    assert (device.bus, device.address, device.port_numbers) == (1, 1, (1,))
    assert device.parent is None
    (interface,) = device.get_active_configuration()
    write, read = interface
    assert write.write(b"\0" + hello()) == 15
    assert parse_responses(bytes(read.read(4096)))[0].kind == INFO
    with pytest.raises(usb.core.USBTimeoutError):
        read.read(4096, timeout=1)
    device.reset()
    interface.set_altsetting()
    usb.util.dispose_resources(device)


def test_nobody_waits_for_ever_without_a_timeout(backend):
    device = found(backend)
    got = []
    reader = threading.Thread(target=lambda: got.append(device.read(IN, 4096, 0)))
    usb.util.claim_interface(device, 0)
    reader.start()
    device.write(OUT, hello())
    reader.join(20)
    assert parse_responses(bytes(got[0]))[0].kind == INFO


def test_a_tick_wakes_who_waits():
    backend = open_in_process("sim-usb:?size=3x5x7&refresh=50")
    device = found(backend)
    device.write(OUT, hello() + data(0, 0, DOT, CLEAR | COMMIT))
    heard = []
    while not any(a.kind == ACK and a.flags & SHOWN for a in heard):
        heard += parse_responses(bytes(device.read(IN, 4096, 20_000)))


def test_what_is_not_there(backend):
    device = found(backend)
    with pytest.raises(IndexError):
        device[1]
    with pytest.raises(IndexError):
        backend.get_interface_descriptor(device._ctx.dev, 0, 1, 0)
    with pytest.raises(usb.core.USBError) as error:
        usb.util.claim_interface(device, 7)
    assert error.value.errno == errno.ENOENT
    handle = device._ctx.managed_open()
    with pytest.raises(usb.core.USBError):
        backend.release_interface(handle, 0)
    with pytest.raises(usb.core.USBError):
        device.detach_kernel_driver(0)


def test_drivers_of_the_system(backend):
    device = found(backend)
    backend.host.drivers.add(0)
    assert device.is_kernel_driver_active(0)
    with pytest.raises(usb.core.USBError) as error:
        usb.util.claim_interface(device, 0)
    assert error.value.errno == errno.EBUSY
    device.detach_kernel_driver(0)
    usb.util.claim_interface(device, 0)
    with pytest.raises(usb.core.USBError):
        device.attach_kernel_driver(0)
    usb.util.release_interface(device, 0)
    device.attach_kernel_driver(0)
    assert backend.host.drivers == {0}


def test_forbidden(backend):
    backend.host.forbidden = True
    with pytest.raises(usb.core.USBError) as error:
        found(backend)
    assert error.value.errno == errno.EACCES


def test_a_handle_is_of_one_plugging_in(backend):
    device = found(backend)
    device.get_active_configuration()
    backend.host.unplug()
    assert found(backend) is None
    backend.host.plug()
    with pytest.raises(usb.core.USBError) as error:
        device.write(OUT, b"x")
    assert error.value.errno == errno.ENODEV
    assert found(backend).address == 2


def test_closing_gives_back_what_was_claimed():
    backend = Backend(Bus(GadgetDevice()))
    (node,) = backend.enumerate_devices()
    first, second = backend.open_device(node), backend.open_device(node)
    backend.claim_interface(first, 0)
    backend.claim_interface(second, NUMBER)
    backend.close_device(first)
    backend.claim_interface(second, 0)
    backend.close_device(second)


def test_a_device_whose_words_make_no_sense():
    device = GadgetDevice()
    backend = Backend(Bus(device))
    described = device.function.descriptors.get
    whole = described(2, 0)
    broken = whole[:2] + struct.pack("<H", len(whole) + 1) + whole[4:] + b"\0"
    object.__setattr__(
        device.function.descriptors, "get", lambda *a: broken if a[0] == 2 else described(*a)
    )
    with pytest.raises(usb.core.USBError) as error:
        found(backend)
    assert error.value.errno == errno.EIO


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("sim-usb", "write sim-usb:"),
        ("sim:", "write sim-usb:"),
        ("sim-usb:?unplug=soon", "whole number"),
        ("sim-usb:?unplugg=3", "did you mean unplug"),
    ],
)
def test_a_bad_url_is_refused_with_the_remedy(url, message):
    with pytest.raises(ValueError, match=message):
        open_in_process(url)

"""Behaviour of USB that the driver relies on, tested alike at three depths.

In process and over USB/IP the emulator's backend is between; in a real Linux kernel, libusb is. A
behaviour that the three have in common is one that the driver may be tested against.
"""

import contextlib
import threading
import time

import pytest
import usb.core
import usb.util
from usb_gadget import IN, NUMBER, OUT, PACKET, pattern
from usb_lab import in_kernel, lab, until

from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.transport.usb import UsbTransport

LONG = 20_000  # milliseconds that no test waits for
SHORT = 60
EPIPE, EBUSY, EIO, ENODEV, EOVERFLOW, ETIMEDOUT = 32, 16, 5, 19, 75, 110
DEPTHS = ["in process", "usbip", pytest.param("kernel", marks=pytest.mark.kernel)]


@pytest.fixture(scope="module", params=DEPTHS)
def place(request):
    if request.param == "kernel" and not in_kernel():
        pytest.skip("this kernel has no vhci_hcd: tools/kernel_lab.py brings one that has")
    with lab(request.param) as made:
        yield made


@pytest.fixture
def gadget(place):
    """The lab, with its gadget plugged in and as new."""
    if place.find() is None:
        place.plug()
    place.tell("take", None)
    place.tell("echo", False)
    yield place
    if place.find() is not None:
        device = place.find()
        usb.util.claim_interface(device, NUMBER)  # or else Linux does, and keeps it
        for address in (IN, OUT):
            with contextlib.suppress(usb.core.USBError):
                device.clear_halt(address)
        usb.util.release_interface(device, NUMBER)
        device.set_configuration()
        place.tell("taken")
        usb.util.dispose_resources(device)


@pytest.fixture
def device(gadget):
    device = gadget.find()
    usb.util.claim_interface(device, NUMBER)
    yield device
    usb.util.dispose_resources(device)


@contextlib.contextmanager
def failing(number):
    with pytest.raises(usb.core.USBError) as caught:
        yield caught
    assert caught.value.errno == number


@contextlib.contextmanager
def blocked(function, *arguments):
    """Run something in a thread; yield where its result will be."""
    result = []

    def run():
        try:
            result.append(function(*arguments))
        except Exception as error:  # noqa: BLE001 - it is the result
            result.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield result
    finally:
        thread.join(LONG / 1000)
        assert not thread.is_alive()


# What USB does


def test_descriptors(device):
    assert (device.idVendor, device.idProduct) == (0x1209, 0x0001)
    assert (device.manufacturer, device.product) == ("tests", "gadget")
    assert device.serial_number == "GADGET"
    configuration = device.get_active_configuration()
    assert configuration.bConfigurationValue == 1
    empty, interface = configuration
    assert empty.bNumEndpoints == 0
    triple = (interface.bInterfaceClass, interface.bInterfaceSubClass, interface.bInterfaceProtocol)
    assert triple == (0xFF, 0x56, 0x58)
    ends = {end.bEndpointAddress: (end.bmAttributes, end.wMaxPacketSize) for end in interface}
    assert ends == {0x81: (3, 16), IN: (2, PACKET), OUT: (2, PACKET)}
    assert "ENDPOINT 0x3: Bulk OUT" in str(device)


def test_a_control_transfer_each_way(device):
    assert device.ctrl_transfer(0x40, 1, data_or_wLength=b"good") == 4
    assert device.ctrl_transfer(0xC0, 2, data_or_wLength=300).tobytes() == pattern(300)


def test_a_request_that_there_is_not_stalls_and_the_next_works(device):
    with failing(EPIPE):
        device.ctrl_transfer(0x40, 1, data_or_wLength=b"evil")
    with failing(EPIPE):
        device.ctrl_transfer(0xC0, 77, data_or_wLength=4)
    assert device.ctrl_transfer(0xC0, 2, data_or_wLength=3).tobytes() == pattern(3)


def test_nothing_comes_and_the_read_times_out(device):
    with pytest.raises(usb.core.USBTimeoutError) as caught:
        device.read(IN, PACKET, SHORT)
    assert caught.value.errno == ETIMEDOUT


def test_a_short_packet_ends_a_read(gadget, device):
    gadget.tell("send", 300, False)
    assert device.read(IN, 4096, LONG).tobytes() == pattern(300)
    gadget.tell("send", PACKET + 1, False)
    assert device.read(IN, 4096, LONG).tobytes() == pattern(PACKET + 1)


def test_full_packets_alone_end_no_read_and_nothing_is_lost(gadget, device):
    """A read of more waits until its time is over, and gives what came."""
    gadget.tell("send", 2 * PACKET, False)
    began_s = time.monotonic()
    assert device.read(IN, 4096, 200).tobytes() == pattern(2 * PACKET)
    assert time.monotonic() - began_s >= 0.19
    gadget.tell("send", 5, False)
    assert device.read(IN, 4096, LONG).tobytes() == pattern(5)


def test_an_empty_packet_ends_a_read(gadget, device):
    gadget.tell("send", 2 * PACKET, True)
    assert device.read(IN, 4096, LONG).tobytes() == pattern(2 * PACKET)


def test_a_read_of_just_as_much_is_over_at_once_and_the_empty_packet_comes_next(gadget, device):
    gadget.tell("send", 2 * PACKET, True)
    assert device.read(IN, 2 * PACKET, LONG).tobytes() == pattern(2 * PACKET)
    assert len(device.read(IN, PACKET, LONG)) == 0


def test_a_packet_that_is_too_long_is_lost(gadget, device):
    gadget.tell("send", 300, False)
    with failing(EOVERFLOW):
        device.read(IN, 100, LONG)
    gadget.tell("send", 7, False)
    assert device.read(IN, PACKET, LONG).tobytes() == pattern(7)


def test_a_read_waits_for_the_device(gadget, device):
    with blocked(device.read, IN, PACKET, LONG) as result:
        gadget.tell("send", 9, False)
    assert result[0].tobytes() == pattern(9)


def test_writes_arrive_as_packets(gadget, device):
    assert device.write(OUT, pattern(1300), LONG) == 1300
    assert gadget.tell("taken") == [[512, 512, 276], pattern(1300).hex()]


def test_a_write_of_full_packets_has_no_empty_one(gadget, device):
    assert device.write(OUT, pattern(1024), LONG) == 1024
    assert gadget.tell("taken")[0] == [512, 512]
    assert device.write(OUT, b"", LONG) == 0
    assert gadget.tell("taken")[0] == [0]


def test_a_write_of_which_a_part_is_taken_gives_the_count(gadget, device):
    gadget.tell("take", 1)
    assert device.write(OUT, pattern(2048), SHORT) == 512
    gadget.tell("take", None)
    assert device.write(OUT, pattern(2048)[512:], LONG) == 2048 - 512
    assert gadget.tell("taken")[1] == pattern(2048).hex()


def test_a_write_of_which_nothing_is_taken_times_out(gadget, device):
    gadget.tell("take", 0)
    with pytest.raises(usb.core.USBTimeoutError):
        device.write(OUT, pattern(2048), SHORT)
    gadget.tell("take", None)
    assert gadget.tell("taken")[0] == []
    assert device.write(OUT, b"again", LONG) == 5
    assert gadget.tell("taken")[0] == [5]


def test_a_write_waits_for_the_device(gadget, device):
    gadget.tell("take", 2)
    with blocked(device.write, OUT, pattern(4096), LONG) as result:
        until(lambda: gadget.tell("taken")[0], "the first packets")
        gadget.tell("take", None)
    assert result == [4096]


def test_both_ways_at_once(gadget, device):
    with blocked(device.read, IN, PACKET, LONG) as result:
        assert device.write(OUT, pattern(700), LONG) == 700
        assert device.ctrl_transfer(0xC0, 2, data_or_wLength=3).tobytes() == pattern(3)
        gadget.tell("send", 11, False)
    assert result[0].tobytes() == pattern(11)


@pytest.mark.parametrize("way", [IN, OUT])
def test_a_halted_endpoint_stalls_until_it_is_cleared(gadget, device, way):
    gadget.tell("halt", way)
    for _ in range(2):
        with failing(EPIPE):
            if way == IN:
                device.read(IN, PACKET, LONG)
            else:
                device.write(OUT, b"stalled", LONG)
    device.clear_halt(way)
    assert device.write(OUT, b"cleared", LONG) == 7
    gadget.tell("send", 4, False)
    assert device.read(IN, PACKET, LONG).tobytes() == pattern(4)
    assert gadget.tell("taken") == [[7], b"cleared".hex()]


def test_a_halt_ends_what_waits(gadget, device):
    with blocked(device.read, IN, PACKET, LONG) as result:
        time.sleep(0.05)
        gadget.tell("halt", IN)
    assert result[0].errno == EPIPE


def test_who_claims_second_is_told_that_it_is_busy(gadget, device):
    second = gadget.find()
    with failing(EBUSY):
        usb.util.claim_interface(second, NUMBER)
    usb.util.release_interface(device, NUMBER)
    usb.util.claim_interface(second, NUMBER)
    usb.util.dispose_resources(second)


def test_the_same_configuration_again_resets_the_device(gadget, device):
    with failing(EBUSY):
        device.set_configuration()
    usb.util.release_interface(device, NUMBER)
    before = gadget.tell("resets")
    device.set_configuration()
    assert gadget.tell("resets") > before


def test_a_large_transfer(gadget, device):
    data = pattern(1 << 20)
    with blocked(device.write, OUT, data, LONG) as result:
        pass
    assert result == [len(data)]
    sizes, got = gadget.tell("taken")
    assert sizes == [PACKET] * (len(data) // PACKET)
    assert bytes.fromhex(got) == data
    gadget.tell("send", 1 << 18, True)
    assert device.read(IN, 1 << 19, LONG).tobytes() == pattern(1 << 18)


def test_unplugged_while_a_read_waits(gadget, device):
    with blocked(device.read, IN, PACKET, LONG) as result:
        time.sleep(0.05)
        gadget.unplug()
    assert result[0].errno in {EIO, ENODEV}
    with failing(ENODEV):
        device.read(IN, PACKET, LONG)
    with failing(ENODEV):
        device.write(OUT, b"gone", LONG)
    assert gadget.find() is None
    usb.util.dispose_resources(device)
    gadget.plug()
    again = gadget.find()
    usb.util.claim_interface(again, NUMBER)
    gadget.tell("send", 3, False)
    assert again.read(IN, PACKET, LONG).tobytes() == pattern(3)
    usb.util.dispose_resources(again)


# What the driver makes of it


@pytest.fixture
def pipe(gadget):
    pipe = UsbTransport("usb:test", backend=gadget.backend)
    yield pipe
    pipe.close()


def everything(pipe, size):
    """Read so much, without ever waiting until the time is over."""
    data = b""
    while len(data) < size:
        began_s = time.monotonic()
        more = pipe.read(LONG / 1000)
        assert more
        assert time.monotonic() - began_s < LONG / 2000, "it waited for more than there was"
        data += more
    return data


def test_it_finds_its_interface_and_endpoints(gadget, pipe):
    pipe.write(b"to the display", 1)
    assert gadget.tell("taken") == [[14], b"to the display".hex()]


def test_it_leaves_the_configuration_alone(gadget):
    before = gadget.tell("resets")
    UsbTransport("usb:test", backend=gadget.backend).close()
    expected = {"InProcess": 0, "OverUsbIp": 1, "InKernel": 0}  # over USB/IP, to close is to unplug
    assert gadget.tell("resets") - before <= 2 * expected[type(gadget).__name__]


def test_it_ends_full_packets_with_an_empty_one(gadget, pipe):
    pipe.write(pattern(1024), 1)
    assert gadget.tell("taken")[0] == [512, 512, 0]
    pipe.write(pattern(1025), 1)
    assert gadget.tell("taken")[0] == [512, 512, 1]


@pytest.mark.parametrize("end", [False, True])
@pytest.mark.parametrize("size", [1, 511, 512, 513, 1024, 16384, 16896, 20000])
def test_it_reads_everything_whether_or_not_it_is_ended(gadget, pipe, size, end):
    gadget.tell("send", size, end)
    assert everything(pipe, size) == pattern(size)


def test_what_it_reads_after_an_empty_packet_is_no_end(gadget, pipe):
    gadget.tell("send", 512, True)
    assert everything(pipe, 512) == pattern(512)
    gadget.tell("send", 0, True)
    gadget.tell("send", 5, False)
    assert everything(pipe, 5) == pattern(5)


def test_it_waits_no_longer_than_told(pipe):
    assert pipe.read(0) == b""
    assert pipe.read(0.03) == b""


def test_it_goes_on_with_a_write_of_which_a_part_was_taken(gadget, pipe):
    gadget.tell("take", 1)
    with blocked(pipe.write, pattern(4096), LONG / 1000) as result:
        time.sleep(0.05)
        gadget.tell("take", None)
    assert result == [None]
    assert gadget.tell("taken")[1] == pattern(4096).hex()


def test_it_says_when_the_device_takes_nothing(gadget, pipe):
    gadget.tell("take", 1)
    with pytest.raises(TransportTimeout, match="took only 512 of 2048 bytes"):
        pipe.write(pattern(2048), 0.1)
    gadget.tell("take", None)
    pipe.write(b"again", 1)
    assert gadget.tell("taken") == [[512, 5], (pattern(512) + b"again").hex()]


@pytest.mark.parametrize("way", [IN, OUT])
def test_it_clears_a_stall(gadget, pipe, way):
    gadget.tell("halt", way)
    pipe.write(b"hello", 1)
    gadget.tell("send", 6, False)
    assert everything(pipe, 6) == pattern(6)
    assert gadget.tell("taken")[1] == b"hello".hex()


def test_it_tells_a_second_one_that_it_is_busy(gadget, pipe):
    pipe.read(0)
    with pytest.raises(OpenError, match="usb:second is busy"):
        UsbTransport("usb:second", backend=gadget.backend)
    pipe.close()
    UsbTransport("usb:second", backend=gadget.backend).close()


def test_it_says_that_the_device_is_gone(gadget, pipe):
    with blocked(pipe.read, LONG / 1000) as result:
        time.sleep(0.05)
        gadget.unplug()
    assert isinstance(result[0], TransportClosed)
    for call in (lambda: pipe.read(0), lambda: pipe.write(b"x", 1)):
        with pytest.raises(TransportClosed, match="gone"):
            call()
    pipe.close()
    pipe.close()
    with pytest.raises(OpenError, match="no such display"):
        UsbTransport("usb:test", backend=gadget.backend)
    gadget.plug()
    with contextlib.closing(UsbTransport("usb:test", backend=gadget.backend)) as again:
        again.write(b"back", 1)
    assert gadget.tell("taken")[1].endswith(b"back".hex())

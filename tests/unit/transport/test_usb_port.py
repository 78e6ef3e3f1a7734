"""``usb:`` ports: selection of a display, and errors when it cannot be opened."""

import errno
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
import usb.backend.libusb1
import usb.core
import usb.util
from usb_gadget import NUMBER, GadgetDevice

from firmware_sim.usb.backend import Backend
from firmware_sim.usb.descriptors import BULK, Descriptors, Endpoint, Interface
from firmware_sim.usb.host import Bus
from voxdisplay.errors import OpenError, TransportClosed, TransportTimeout
from voxdisplay.transport import open_transport, usb_access
from voxdisplay.transport import usb as port_module
from voxdisplay.transport.discovery import all_ports
from voxdisplay.transport.usb import UsbTransport, usb_ports

ROOT = Path(__file__).parents[3]


class Buses:
    """A host with several buses, each with a device."""

    def __init__(self, *devices):
        self.buses = [Bus(device) for device in devices]
        for number, device in enumerate(devices, 1):
            device.number = number

    def plugged(self):
        return [each for bus in self.buses for each in bus.plugged()]


@pytest.fixture
def plug(monkeypatch):
    """Plug devices into the bus that ``usb:`` ports are on."""

    def plug(*devices):
        backend = Backend(Buses(*devices))
        for module in (port_module, usb_access):
            monkeypatch.setattr(module, "find_backend", lambda port: backend)  # noqa: ARG005
        return backend.host.buses

    return plug


def refused(port):
    with pytest.raises(OpenError) as error:
        open_transport(port)
    assert error.value.port == port
    assert str(error.value).startswith(port)
    return str(error.value), error.value.hint


def printer():
    """A device with another interface, of the same vendor and product."""
    device = GadgetDevice("PRINTER")
    ends = (Endpoint(1, BULK, 512), Endpoint(0x81, BULK, 512))
    device.function.descriptors = Descriptors(
        0x1209, 0x0001, "", "printer", "PRINTER", (Interface(0, (7, 1, 2), ends),)
    )
    return device


def test_the_only_display_is_found_by_its_class(plug):
    plug(printer(), GadgetDevice("A"))
    transport = open_transport("usb:")
    assert transport.port == "usb:"
    transport.close()


@pytest.mark.parametrize("name", ["usb:1209:0001:B", "usb:1209:1:B"])
def test_one_of_several_by_its_serial_number(plug, name):
    first, second = plug(GadgetDevice("A"), GadgetDevice("B"))
    transport = open_transport(name)
    transport.write(b"to B", 1)
    transport.close()
    assert second.device.do("taken")[1] == b"to B".hex()
    assert first.device.do("taken")[1] == ""


@pytest.mark.parametrize("name", ["usb:", "usb:1209:0001"])
def test_several_are_named(plug, name):
    plug(GadgetDevice("A"), GadgetDevice("B"), GadgetDevice(""))
    message, hint = refused(name)
    assert "there are 3 displays" in message
    assert hint == "choose one of usb:1209:0001:A, usb:1209:0001:B, usb:1209:0001"


@pytest.mark.parametrize("name", ["usb:1209:0002", "usb:1208:0001", "usb:1209:0001:C"])
def test_others_than_there_are(plug, name):
    plug(GadgetDevice("A"))
    message, hint = refused(name)
    assert "no such display" in message
    assert hint == "there is usb:1209:0001:A"


def test_none(plug):
    plug(printer())
    assert refused("usb:") == (
        "usb:: there is no such display on USB", "is it plugged in, and switched on?"
    )  # fmt: skip
    assert "no such display" in refused("usb:1209:0001")[0]


@pytest.mark.parametrize("name", ["usb:x", "usb:1209", "usb:1209:", "usb:1209:1:", "usb:12099:1"])
def test_names_that_are_none(name):
    message, hint = refused(name)
    assert "is not a USB port" in message
    assert "usb:1209:0001" in hint


def test_it_is_listed(plug):
    plug(GadgetDevice("B\x1b[2J"), GadgetDevice("A"), printer())
    first, second = usb_ports()
    assert (first.port, first.description) == ("usb:1209:0001:A", "gadget")
    assert (first.vid, first.pid, first.serial_number) == (0x1209, 1, "A")
    assert "\x1b" not in second.port
    assert {first, second} <= set(all_ports())


def test_the_rule_that_is_shown_is_the_one_that_is_brought():
    said = usb_access.permission_error("usb:")
    assert str(said) == "usb: may not be opened"
    (rule,) = re.findall("echo '(.*)' [|] sudo tee", said.hint)
    assert rule in (ROOT / "tools/udev/70-voxdisplay.rules").read_text().splitlines()
    assert "udevadm control --reload" in said.hint


class Linux(Backend):
    """A kernel that tells what a device says of itself, and lets nobody open it."""

    closed_to = True

    def open_device(self, dev):
        if self.closed_to:
            raise usb.core.USBError("Access denied", -3, errno.EACCES)
        return super().open_device(dev)


@pytest.mark.parametrize("name", ["usb:", "usb:1209:0001", "usb:1209:0001:A"])
def test_a_display_that_may_not_be_opened(monkeypatch, name):
    backend = Linux(Bus(GadgetDevice("A")))
    monkeypatch.setattr(port_module, "find_backend", lambda port: backend)  # noqa: ARG005
    message, hint = refused(name)
    assert message == f"{name} may not be opened"
    assert "uaccess" in hint
    (listed,) = usb_ports()
    assert listed.port == "usb:1209:0001"
    assert listed.serial_number is None


def test_elsewhere_the_way_to_be_allowed_is_not_known(monkeypatch):
    monkeypatch.setattr(sys, "platform", "darwin")
    assert "udev" not in usb_access.permission_error("usb:").hint


def test_a_system_without_a_driver_for_it(monkeypatch):
    backend = Backend(Bus(GadgetDevice("A")))

    def open_device(dev):
        raise NotImplementedError("Operation not supported or unimplemented on this platform")

    backend.open_device = open_device
    monkeypatch.setattr(port_module, "find_backend", lambda port: backend)  # noqa: ARG005
    message, hint = refused("usb:")
    assert "not supported" in message
    assert "WinUSB" in hint


def test_a_device_that_cannot_be_looked_at_is_passed_over(monkeypatch):
    backend = Backend(Buses(GadgetDevice("A"), GadgetDevice("B")))
    look = backend.get_configuration_descriptor

    def refuse(dev, config):
        if dev.plugged.number == 1:
            raise usb.core.USBError("Entity not found", -5, errno.ENOENT)
        return look(dev, config)

    backend.get_configuration_descriptor = refuse
    monkeypatch.setattr(port_module, "find_backend", lambda port: backend)  # noqa: ARG005
    assert [port.port for port in usb_ports()] == ["usb:1209:0001:B"]


def test_it_gives_the_configuration_that_is_missing(plug):
    (bus,) = plug(GadgetDevice())
    bus.device.configuration = 0
    transport = open_transport("usb:")
    assert bus.device.configuration == 1
    transport.write(b"x", 1)
    resets = bus.device.do("resets")
    transport.close()
    open_transport("usb:").close()
    assert bus.device.do("resets") == resets, "what has its configuration is left alone"


def test_a_driver_of_the_system_gets_its_interface_back(plug):
    (bus,) = plug(GadgetDevice())
    bus.drivers.add(NUMBER)
    transport = open_transport("usb:")
    assert not bus.drivers
    transport.close()
    assert bus.drivers == {NUMBER}


def test_a_system_that_knows_no_such_drivers():
    backend = Backend(Bus(GadgetDevice()))

    def unknown(dev_handle, intf):
        raise NotImplementedError

    backend.is_kernel_driver_active = unknown
    UsbTransport("usb:x", backend=backend).close()


def test_busy_and_by_whom(plug, monkeypatch, tmp_path):
    plug(GadgetDevice())
    transport = open_transport("usb:")
    assert refused("usb:")[0] == "usb: is busy"
    node = tmp_path / "001" / "001"
    node.parent.mkdir()
    master, slave = os.openpty()  # a device that only the other process has open
    node.symlink_to(os.ttyname(slave))
    monkeypatch.setattr(usb_access, "_NODES", tmp_path)
    command = [sys.executable, "-c", "input()"]
    with (
        subprocess.Popen(command, stdin=subprocess.PIPE, stderr=slave, text=True) as holder,
    ):
        os.close(slave)
        message = refused("usb:")[0]
        holder.communicate("\n")
    assert message.startswith("usb: is busy: ")
    os.close(master)
    assert f"(process {holder.pid})" in message
    transport.close()


def test_gone_between_finding_and_opening(monkeypatch):
    backend = Backend(Bus(GadgetDevice()))
    ask = backend.get_configuration

    def pulled_out(dev_handle):
        backend.host.unplug()
        return ask(dev_handle)

    monkeypatch.setattr(backend, "get_configuration", pulled_out)
    monkeypatch.setattr(port_module, "find_backend", lambda port: backend)  # noqa: ARG005
    assert refused("usb:")[0] == "usb: went away while it was opened"


@pytest.mark.parametrize("way", [0x82, 0x03])
def test_a_stall_that_does_not_end_is_given_up(monkeypatch, way):
    backend = Backend(Bus(GadgetDevice()))
    device = backend.host.device
    transport = UsbTransport("usb:x", backend=backend)
    clear = backend.clear_halt
    cleared = []

    def in_vain(dev_handle, ep):
        cleared.append(ep)
        clear(dev_handle, ep)
        device.do("halt", ep)

    monkeypatch.setattr(backend, "clear_halt", in_vain)
    device.do("halt", way)
    with pytest.raises(TransportClosed, match="does not work any more"):
        transport.read(20) if way == 0x82 else transport.write(b"x", 20)
    assert cleared == [way] * 8
    transport.close()


def test_gone_while_a_stall_is_cleared(monkeypatch):
    backend = Backend(Bus(GadgetDevice()))
    transport = UsbTransport("usb:x", backend=backend)
    clear = backend.clear_halt
    monkeypatch.setattr(backend, "clear_halt", lambda *_: backend.host.unplug() or clear(*_))
    backend.host.device.do("halt", 0x82)
    with pytest.raises(TransportClosed, match="gone"):
        transport.read(1)
    transport.close()


def test_a_packet_that_is_too_long_is_passed_over():
    """A device whose packets are longer than its descriptor says."""
    backend = Backend(Bus(GadgetDevice()))
    transport = UsbTransport("usb:x", backend=backend)
    backend.host.device.function.sending += [bytes(600), b"next"]
    assert transport.read(1) == b"next"
    transport.close()


def test_a_device_that_takes_its_bytes_too_slowly():
    backend = Backend(Bus(GadgetDevice()))
    function = backend.host.device.function
    next_s = [0.0]

    def accepts(endpoint, size):
        del endpoint, size
        if time.monotonic() < next_s[0]:
            return False
        next_s[0] = time.monotonic() + 0.002
        return True

    function.accepts = accepts
    function.next_event_s = lambda: max(0.0, next_s[0] - time.monotonic())
    transport = UsbTransport("usb:x", backend=backend)
    with pytest.raises(TransportTimeout, match=r"took only [0-9]+ of 1048576 bytes in time"):
        transport.write(bytes(1 << 20), 0.1)
    transport.close()


def test_a_closed_port_is_not_opened_again():
    transport = UsbTransport("usb:x", backend=Backend(Bus(GadgetDevice())))
    transport.close()
    transport.close()
    for use in (lambda: transport.read(0), lambda: transport.write(b"x", 1)):
        with pytest.raises(TransportClosed, match="closed"):
            use()


def test_without_libusb(monkeypatch):
    monkeypatch.setitem(sys.modules, "libusb_package", None)
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda: None)
    message, hint = refused("usb:")
    assert "no libusb" in message
    assert "pip install 'voxdisplay[usb]'" in hint
    assert usb_ports() == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="has no folder of USB buses")
@pytest.mark.parametrize("given", [True, False])
def test_a_machine_without_usb(monkeypatch, tmp_path, given):
    monkeypatch.setitem(sys.modules, "libusb_package", None)
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda: None)
    monkeypatch.setattr(usb_access, "_NODES", tmp_path if given else tmp_path / "usb")
    assert ("pass it on" in refused("usb:")[1]) == (not given)


def test_the_systems_libusb_where_there_is_no_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "libusb_package", None)
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda: "the system's")
    assert usb_access.find_backend("usb:") == "the system's"


def test_nothing_of_usb_is_loaded_for_other_ports():
    script = (
        "import sys, voxdisplay as vd\n"
        "with vd.open('sim:?size=3x5x7') as display: display.clear()\n"
        "print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert not {"usb", "libusb_package", "firmware_sim.usb"} & set(done.stdout.split())

"""Errors that pyserial, pyusb and the system raise and do not document, all turned into ours."""

import re
import struct
import sys
import threading
from types import SimpleNamespace

import pytest
import serial
import usb.core
from pluggable_pty import Plug
from usb_gadget import GadgetDevice

from firmware_sim.usb.backend import Backend
from firmware_sim.usb.host import Bus
from voxdisplay import transport as transport_module
from voxdisplay.cli.main import main
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.errors import OpenError, TransportClosed, TransportError
from voxdisplay.transport import discovery, open_transport, usb_access
from voxdisplay.transport import usb as usb_module
from voxdisplay.transport.discovery import all_ports, find_port, serial_ports
from voxdisplay.transport.library_errors import LIBRARY_ERRORS, message_of
from voxdisplay.transport.usb import UsbTransport, usb_ports

UNDOCUMENTED = [
    TypeError("int() can't convert non-string with explicit base"),
    AttributeError("'NoneType' object has no attribute 'value'"),
    ValueError("invalid literal for int() with base 16: ''"),
    UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
    KeyError("usb_device"),
    IndexError("list index out of range"),
    OSError(19, "No such device"),
    PermissionError(13, "Permission denied"),
    serial.SerialException("could not list"),
    usb.core.USBError("Pipe error", -9, 32),
    usb.core.NoBackendError("No backend available"),
    NotImplementedError("not on this platform"),
    RuntimeError("can't start new thread"),
    OverflowError("Python int too large to convert to C long"),
    struct.error("unpack requires a buffer of 4 bytes"),
    re.error("unterminated character set"),
    ImportError("libudev.so.1: cannot open shared object file"),
    AssertionError(),  # pyusb's libusb0: assert ret == 1
]
each_error = pytest.mark.parametrize("error", UNDOCUMENTED, ids=lambda e: type(e).__name__)


def raising(error):
    def fail(*_arguments, **_named):
        raise error

    return fail


def test_a_fault_of_ours_is_not_in_the_table():
    """What no library raises for a port still ends in a report."""
    for error in (NameError, MemoryError, SyntaxError):
        assert not issubclass(error, LIBRARY_ERRORS)


def test_every_error_says_something():
    assert message_of(TimeoutError()) == "TimeoutError"
    assert message_of(OSError(5, "no")) == "[Errno 5] no"


# -- listing


@each_error
def test_a_list_of_ports_that_fails(monkeypatch, capsys, error):
    monkeypatch.setattr("serial.tools.list_ports.comports", raising(error))
    assert main(["ports"]) == 0
    assert "sim:" in capsys.readouterr().out
    assert main(["info", "--port", "/dev/ttyNOWHERE"]) == 3
    assert "/dev/ttyNOWHERE does not exist" in capsys.readouterr().err
    assert find_port("/dev/ttyNOWHERE") is None


def test_a_list_that_fails_once_is_asked_for_again(monkeypatch):
    """A device that comes while the system is looked through is there a moment later."""
    answers = [TypeError("coming"), KeyError("coming")]

    def comports():
        if answers:
            raise answers.pop()
        return [SimpleNamespace(device="/dev/ttyUSB7", description="d", vid=1, pid=2,
                                serial_number="A", product="p")]  # fmt: skip

    monkeypatch.setattr("serial.tools.list_ports.comports", comports)
    assert [port.port for port in serial_ports()] == ["/dev/ttyUSB7"]


def test_what_a_list_has_of_the_wrong_type_is_left_out(monkeypatch):
    """Of a device that goes away, pyserial has None for texts and numbers, or half of them."""
    odd = SimpleNamespace(
        device="/dev/ttyUSB7", description=None, vid="0x1", pid=None, serial_number=5, product=b"p"
    )
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [odd])
    (port,) = serial_ports()
    assert (port.port, port.description) == ("/dev/ttyUSB7", "")
    assert (port.vid, port.pid, port.serial_number, port.product) == (None,) * 4
    assert main(["ports"]) == 0


def test_ports_are_named_where_their_details_cannot_be_read(monkeypatch, tmp_path):
    (tmp_path / "ttyACM3").touch()
    (tmp_path / "ttyS0").touch()
    monkeypatch.setattr("serial.tools.list_ports.comports", raising(TypeError("going")))
    monkeypatch.setattr(discovery, "_DEV", tmp_path)
    (port,) = serial_ports()
    assert port.port == str(tmp_path / "ttyACM3")
    assert "no details" in port.description


@each_error
def test_a_finder_that_fails_keeps_no_other(monkeypatch, error):
    finder = SimpleNamespace(usb_ports=raising(error))
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    monkeypatch.setitem(sys.modules, "voxdisplay.transport.usb", finder)
    assert [port.port for port in all_ports()] == ["sim:"]


@each_error
def test_waiting_for_a_device_goes_on(monkeypatch, tmp_path, error):
    """It is plugged in again while the system's list of ports cannot be read."""
    port = tmp_path / "ttyUSB0"
    with Plug(port) as plug:
        plug.plug(serial="A1")
        monkeypatch.setattr("serial.tools.list_ports.comports", raising(error))
        reconnect = Reconnector(str(port), 20)
        plug.unplug()
        later = threading.Timer(0.1, plug.plug)
        later.start()
        reconnect.wait_for_device(TransportClosed("gone"), "A1").close()
        later.join()


def test_a_device_known_by_its_number_is_waited_for_while_the_list_fails(monkeypatch, tmp_path):
    """The list works at first, fails for a while, and has the device at another name then."""
    first, second = tmp_path / "ttyUSB0", tmp_path / "ttyUSB1"
    first.touch()

    def entry(path):
        return SimpleNamespace(device=str(path), description="", vid=1, pid=2,
                               serial_number="A1", product="p")  # fmt: skip

    state = {"ports": [entry(first)], "left": 12}

    def comports():
        if state["ports"] or state["left"] == 0:
            return state["ports"] or [entry(second)]
        state["left"] -= 1
        raise TypeError("going")

    monkeypatch.setattr("serial.tools.list_ports.comports", comports)
    with Plug(second) as plug:
        plug.plug(serial="A1")
        reconnect = Reconnector(str(first), 20)
        state["ports"] = []
        transport = reconnect.wait_for_device(TransportClosed("gone"), "A1")
        transport.close()
    assert transport.port == str(second)
    assert state["left"] == 0


# -- opening and using


@pytest.mark.parametrize(
    "port",
    [
        "hwgrep://[", "hwgrep://nothing-like-it", "loop://?logging=loud", "alt:///dev/null?class=no",
        "spy:///dev/ttyNOWHERE?file=/nowhere/x", "socket://h:1?logging=loud", "cp2110://x",
        "rfc2217://h", "rfc2217://h:99999", "socket://h:x?logging=info", "tcp://[::1:5", "\0",
        "a\0b",
    ],
)  # fmt: skip
def test_names_that_the_libraries_stumble_over(port):
    with pytest.raises(OpenError) as refused:
        open_transport(port)
    assert refused.value.port == port


def test_the_file_that_spy_cannot_write_is_named(tmp_path):
    """It is not the port that is missing."""
    with Plug(tmp_path / "port") as plug:
        plug.plug()
        port = f"spy://{plug.path}?file={tmp_path}/none/traffic.txt"
        with pytest.raises(OpenError, match=r"none/traffic\.txt cannot be written: No such file"):
            open_transport(port)
        with pytest.raises(OpenError, match="cannot be written: Is a directory") as refused:
            open_transport(f"spy://{plug.path}?file={tmp_path}")
    assert refused.value.hint == "take another path behind file="
    with pytest.raises(OpenError, match="does not exist"):
        open_transport(f"spy://{plug.path}-none?file={tmp_path}/traffic.txt")


@pytest.mark.parametrize("port", ["rfc2217://", "rfc2217://h", "rfc2217://h:x", "rfc2217://:4000"])
def test_a_url_without_host_or_port(port):
    with pytest.raises(OpenError, match="does not name a host and a port") as refused:
        open_transport(port)
    assert "rfc2217://127.0.0.1:4000" in refused.value.hint


@each_error
@pytest.mark.parametrize("call", ["open", "read", "write"])
def test_a_serial_port_that_fails(monkeypatch, tmp_path, error, call):
    with Plug(tmp_path / "tty") as plug:
        plug.plug()
        if call == "open":
            monkeypatch.setattr(serial.Serial, "open", raising(error))
            with pytest.raises(OpenError):
                open_transport(str(plug.path))
            return
        transport = open_transport(str(plug.path))
        transport._serial.read = transport._serial.write = raising(error)
        transport._serial.close = transport._serial.reset_output_buffer = raising(error)
        transport._readable.readable = lambda _timeout_s: True
        use = (
            transport.read if call == "read" else lambda timeout_s: transport.write(b"x", timeout_s)
        )
        with pytest.raises(TransportClosed, match="is gone"):
            use(1.0)
        serial.Serial.close(transport._serial)
        transport.close()


@each_error
@pytest.mark.parametrize(
    "call", ["enumerate_devices", "get_device_descriptor", "get_configuration_descriptor"]
)
def test_a_bus_that_cannot_be_looked_through(monkeypatch, error, call):
    backend = Backend(Bus(GadgetDevice("A")))
    setattr(backend, call, raising(error))
    monkeypatch.setattr(usb_module, "find_backend", lambda port: backend)  # noqa: ARG005
    assert usb_ports() == []
    with pytest.raises(OpenError):
        open_transport("usb:")


@each_error
@pytest.mark.parametrize(
    "call", ["bulk_read", "bulk_write", "claim_interface", "release_interface"]
)
def test_a_usb_device_that_fails(error, call):
    backend = Backend(Bus(GadgetDevice("A")))
    original = getattr(backend, call)
    setattr(backend, call, raising(error))

    def use():
        transport = UsbTransport("usb:x", backend=backend)
        transport.read(0.01)
        transport.write(b"x", 0.1)
        transport.close()

    if call == "release_interface":
        use()
    else:
        with pytest.raises(TransportError, match=r"^usb:x"):
            use()
    setattr(backend, call, original)


@each_error
def test_a_libusb_that_cannot_be_loaded(monkeypatch, error):
    broken = SimpleNamespace(get_libusb1_backend=raising(error))
    monkeypatch.setitem(sys.modules, "libusb_package", broken)
    monkeypatch.setattr("usb.backend.libusb1.get_backend", raising(error))
    with pytest.raises(OpenError, match="no libusb"):
        usb_access.find_backend("usb:")
    assert usb_ports() == []


class DamagedEntry:
    """An entry point of a package that fails when it is imported, or later."""

    value = "package.module:opener"

    def __init__(self, error, *, when):
        self.error, self.when = error, when

    def load(self):
        if self.when == "load":
            raise self.error
        return self.opener

    def opener(self, _port):
        if self.when == "open":
            raise self.error
        return self

    def read(self, _timeout_s):
        raise self.error

    def write(self, _data, _timeout_s):
        raise self.error

    def close(self):
        raise self.error


@pytest.mark.parametrize("error", [*UNDOCUMENTED, ImportError("no"), EOFError()], ids=repr)
def test_another_packages_port_that_fails(error, monkeypatch):
    """Whatever it raises, callers see errors of this package."""
    for when in ("load", "open"):
        entry = DamagedEntry(error, when=when)
        monkeypatch.setattr(transport_module, "entry_points", lambda entry=entry, **_: [entry])
        with pytest.raises(OpenError, match=r"^foo:bar"):
            open_transport("foo:bar")
    entry = DamagedEntry(error, when="use")
    monkeypatch.setattr(transport_module, "entry_points", lambda **_: [entry])
    transport = open_transport("foo:bar")
    with pytest.raises(TransportClosed, match="foo:bar is gone"):
        transport.read(0.1)
    with pytest.raises(TransportError, match=r"^foo:bar"):
        transport.write(b"a", 0.1)
    transport.close()


@pytest.mark.parametrize("error", [SyntaxError("x"), NameError("y"), AssertionError()], ids=repr)
def test_a_package_that_cannot_be_imported_is_named(error, monkeypatch):
    entry = DamagedEntry(error, when="load")
    monkeypatch.setattr(transport_module, "entry_points", lambda **_: [entry])
    with pytest.raises(OpenError, match=r"loading package\.module:opener failed") as refused:
        open_transport("foo:bar")
    assert "reinstall" in refused.value.hint

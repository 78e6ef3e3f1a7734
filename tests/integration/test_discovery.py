"""Listing and probing of ports; devices recognised by their serial number."""

import json
import os
import sys
import threading
import tty
from types import SimpleNamespace

import pytest
from pluggable_pty import Plug

from voxdisplay.cli import main
from voxdisplay.display import baud, scan
from voxdisplay.display.reconnect import Reconnector
from voxdisplay.display.scan import probe_ports
from voxdisplay.transport import discovery
from voxdisplay.transport.discovery import FoundPort, all_ports, find_port, serial_ports


@pytest.fixture
def known(monkeypatch):
    """Have the system know these serial ports."""

    def know(*ports):
        monkeypatch.setattr("serial.tools.list_ports.comports", lambda: list(ports))

    return know


def usb_serial(device, number, **more):
    facts = {"vid": 0x0403, "pid": 0x6001, "serial_number": number, "product": "FT232R"}
    return SimpleNamespace(device=device, description="FT232R - USB UART", **facts | more)


def test_serial_ports_are_listed_by_name_with_what_is_known_of_them(known):
    known(usb_serial("/dev/ttyUSB1", "A2"), usb_serial("/dev/ttyUSB0", "", product=None))
    assert serial_ports() == [
        FoundPort("/dev/ttyUSB0", "FT232R - USB UART", 0x0403, 0x6001, None, None),
        FoundPort("/dev/ttyUSB1", "FT232R - USB UART", 0x0403, 0x6001, "A2", "FT232R"),
    ]


def test_each_kind_of_port_has_a_finder(known, monkeypatch):
    known()
    display = FoundPort("usb:1209:0001:7", "display", 0x1209, 1, "7")
    usb = SimpleNamespace(usb_ports=lambda: [display])
    monkeypatch.setitem(sys.modules, "voxdisplay.transport.usb", usb)
    assert [(port.port, port.kind) for port in all_ports()] == [
        ("sim:", "emulator"),
        ("usb:1209:0001:7", "usb"),
    ]
    monkeypatch.setattr(discovery, "_FINDERS", (("voxdisplay.transport.nowhere", "found"),))
    assert [port.port for port in all_ports()] == ["sim:"]


def test_a_port_is_found_by_a_link_to_it(known, tmp_path):
    known(usb_serial(str(tmp_path / "ttyUSB3"), "A2"))
    (tmp_path / "ttyUSB3").touch()
    (tmp_path / "by-id").symlink_to(tmp_path / "ttyUSB3")
    assert find_port(str(tmp_path / "by-id")).serial_number == "A2"
    assert find_port(str(tmp_path / "ttyUSB3")).serial_number == "A2"
    assert find_port("COM3") is None
    assert find_port("/dev/\0") is None


def test_a_device_is_the_same_by_its_number_only():
    one = FoundPort("/dev/ttyUSB0", "", 1, 2, "A1")
    assert one.is_same_device(FoundPort("/dev/ttyUSB7", "another", 1, 2, "A1"))
    assert not one.is_same_device(FoundPort("/dev/ttyUSB0", "", 1, 2, "A2"))
    nameless = FoundPort("/dev/ttyUSB0", "", 1, 2)
    assert not nameless.is_same_device(nameless)


def test_a_device_that_comes_back_at_another_port_is_found_there(known, tmp_path):
    first, second = tmp_path / "ttyUSB0", tmp_path / "ttyUSB1"
    first.touch()
    known(usb_serial(str(first), "A1"))
    with Plug(second) as plug:
        notes = []
        reconnect = Reconnector(str(first), 20, note=notes.append)
        plug.plug(serial="X")
        known(usb_serial(str(first), "other"), usb_serial(str(second), "A1"))
        transport = reconnect.wait_for_device(OSError("gone"), "X")
        transport.close()
        assert transport.port == str(second)
        assert f"{second} is back" in notes[-1]


# -- who answers


@pytest.fixture
def there(monkeypatch, tmp_path):
    """A display, a line with nobody at its end, and a port that is not there."""
    master, slave = os.openpty()
    tty.setraw(slave)
    with Plug(tmp_path / "display") as plug:
        plug.plug(serial="A1", name="cube", firmware="7.2")
        names = ["sim:?size=3x5x7", str(plug.path), os.ttyname(slave), "/dev/ttyNOWHERE"]
        monkeypatch.setattr(discovery, "all_ports", lambda: [FoundPort(n, "a port") for n in names])
        yield names
    os.close(master)
    os.close(slave)


@pytest.mark.usefixtures("there")
def test_probe_tells_who_answers(capsys):
    assert main(["ports", "--probe", "--timeout", "0.3"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert "DISPLAY: voxdisplay emulator 1.0, 3x5x7 rgb888" in said[1]
    assert "DISPLAY: cube 7.2, 17x9x5 index8, serial A1" in said[3]
    assert "no display: nothing answered HELLO" in said[5]
    assert "no display: /dev/ttyNOWHERE does not exist" in said[7]


def test_probe_for_a_script(there, capsys):
    assert main(["ports", "--probe", "--timeout", "0.3", "--json"]) == 0
    ports = json.loads(capsys.readouterr().out)["ports"]
    assert [port["port"] for port in ports] == there
    assert [port["answers"] for port in ports] == [True, True, False, False]
    assert ports[1]["device"] == {
        "name": "cube", "size": [17, 9, 5], "format": "index8", "protocol": "1.1",
        "firmware": "7.2", "serial": "A1",
    }  # fmt: skip
    assert "does not exist" in ports[3]["trouble"]


@pytest.mark.usefixtures("there")
def test_probe_at_any_rate(capsys, monkeypatch):
    monkeypatch.setattr(baud, "RATES", (230_400, 115_200))
    assert main(["ports", "--probe", "--timeout", "0.1", "--baud", "auto"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert "DISPLAY: cube 7.2" in said[3]


@pytest.mark.usefixtures("there")
def test_without_probe_nothing_is_opened(capsys, monkeypatch):
    monkeypatch.setattr(scan, "probe_ports", None)
    assert main(["ports", "--json"]) == 0
    ports = json.loads(capsys.readouterr().out)["ports"]
    assert "answers" not in ports[0]


def test_a_port_that_hangs_when_it_is_opened_does_not_keep_the_rest(monkeypatch, there):
    never, opened = threading.Event(), baud.open_transport
    monkeypatch.setattr(
        baud,
        "open_transport",
        lambda port, **rate: opened("" if port == "hangs" and never.wait(60) else port, **rate),
    )
    answers = probe_ports(["hangs", there[0]], baud=115200, timeout_s=0.2, slack_s=0.1)
    assert answers["hangs"] == "it could not be opened in time"
    assert answers[there[0]].grid == (3, 5, 7)
    never.set()

"""Emulator attached to a real Linux kernel, used by the commands.

``tools/kernel_lab.py`` builds a kernel and runs these tests in it.
"""

import json
import os
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from usb_lab import attach, in_kernel, until

import voxdisplay as vd

pytestmark = [
    pytest.mark.kernel,
    pytest.mark.skipif(not in_kernel(), reason="this kernel has no vhci_hcd: tools/kernel_lab.py"),
]
PAPER = "examples/paper-curve.json"
TTY = Path("/dev/ttyACM0")


@pytest.fixture
def plugged(emulator):
    """Start an emulator on USB, and plug it in."""

    def start(*arguments):
        device = emulator("--usbip", "127.0.0.1:0", *arguments)
        url = urlsplit(device.port)
        attach((url.hostname, url.port))
        return device

    return start


def listed(run):
    found = json.loads(run("ports", "--json").stdout)["ports"]
    return [port for port in found if (port["vid"], port["pid"]) == (0x1209, 0x0001)]


def clear_on(display):
    for _ in range(100):
        display.clear()


def test_push_through_libusb(plugged, run, tmp_path):
    dump = tmp_path / "front.npy"
    device = plugged("--dump", dump, "--size", "17x64x40")
    (port,) = until(lambda: listed(run), "the display to be listed")
    assert (port["port"], port["description"]) == ("usb:1209:0001", "voxdisplay emulator")
    for name in ("usb:", "usb:1209:0001"):
        done = run("push", PAPER, "--port", name, "--verify", "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["verified"] is True
    device.stop()
    until(lambda: not listed(run), "the display to be gone")
    done = run("push", PAPER, "--port", "usb:")
    assert done.returncode == 3
    assert "no such display" in done.stderr


def test_a_second_program_is_told_who_has_the_display(plugged, run):
    plugged("--size", "17x64x40")
    until(lambda: listed(run), "the display to be listed")
    with vd.open("usb:") as display:
        done = run("push", PAPER, "--port", "usb:")
        assert done.returncode == 3
        assert f"is busy: python (process {os.getpid()}) has it open" in done.stderr
        display.clear()


def test_unplugged_under_an_open_display(plugged, run):
    device = plugged("--size", "17x64x40")
    until(lambda: listed(run), "the display to be listed")
    with vd.open("usb:") as display:
        device.process.kill()
        device.process.wait()
        with pytest.raises(vd.TransportClosed):
            clear_on(display)


def test_push_through_a_serial_port(plugged, run, tmp_path):
    dump = tmp_path / "front.npy"
    device = plugged("--usb-class", "cdc-acm", "--dump", dump, "--size", "17x64x40")
    until(TTY.exists, TTY)
    (port,) = listed(run)
    assert port["port"] == str(TTY)
    for _ in range(2):
        done = run("push", PAPER, "--port", TTY, "--verify", "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["verified"] is True
    with vd.open(str(TTY)) as display:
        device.process.kill()
        device.process.wait()
        with pytest.raises(vd.TransportClosed):
            clear_on(display)
    until(lambda: not TTY.exists(), "the tty to be gone")

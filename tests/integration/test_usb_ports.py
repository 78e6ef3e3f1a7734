"""Display on USB in real use: pushed to, unplugged, plugged in again."""

import contextlib
import json
import os
import random
import threading
import time

import numpy as np
import pytest
from usb_lab import until

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.serve import listen_tcp
from firmware_sim.usb import open_usbip
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.device import UsbDevice
from firmware_sim.usb.function import DisplayFunction
from firmware_sim.usb.host import Bus
from firmware_sim.usb.usbip_server import Server
from voxdisplay.cli.main import main
from voxdisplay.transport import usb as port_module

PAPER = "examples/paper-curve.json"
WAIT_S = 20  # for what hangs; nothing is measured by it
ROUNDS = [
    pytest.param(30, id="some"),
    pytest.param(1000, id="1000", marks=pytest.mark.slow),
]


def test_push_over_usbip_to_another_process(emulator, run, tmp_path):
    dump, read = tmp_path / "front.npy", tmp_path / "read.npy"
    device = emulator("--usbip", "127.0.0.1:0", "--size", "17x64x40", "--dump", dump)
    assert device.port.startswith("usbip://127.0.0.1:")
    done = run("push", PAPER, "--port", device.port, "--verify", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert (result["verified"], result["port"]) == (True, device.port)
    assert run("read", "--port", device.port, "-o", read).returncode == 0
    assert np.array_equal(np.load(read), np.load(dump))
    assert np.load(read).any()
    assert device.stop() == 0
    done = run("push", PAPER, "--port", device.port)
    assert done.returncode == 3
    assert f"{device.port} cannot be opened" in done.stderr


def test_push_over_usb_in_this_process(capsys):
    port = "sim-usb:?size=17x64x40&format=index8"
    assert main(["push", PAPER, "--port", port, "--verify", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verified"] is True
    assert main(["push", PAPER, "--port", "sim-usb:x"]) == 3
    assert "write sim-usb:" in capsys.readouterr().err


def test_pulled_out_in_mid_push(run):
    done = run("push", PAPER, "--port", "sim-usb:?size=17x64x40&unplug=2", "--verify")
    assert done.returncode == 3
    assert "is gone: it was unplugged" in done.stderr
    assert "Traceback" not in done.stderr


# Pulled out at any moment


class Emulated:
    """A display that can be pulled out, and a way to it."""

    def __init__(self):
        wire = DeviceOnLine(Device(Config((17, 64, 40), refresh=0, pixel_format="index8")))
        self.device = UsbDevice(DisplayFunction(wire))

    def idle(self):
        return True


class InProcess(Emulated):
    def __init__(self):
        super().__init__()
        self.bus = Bus(self.device)
        self.backend = Backend(self.bus)
        self.pull, self.plug = self.bus.unplug, self.bus.plug


@contextlib.contextmanager
def over_usbip():
    emulated = Emulated()
    device = emulated.device
    pulled = threading.Event()
    next_event_s = device.function.next_event_s

    def next_event_or_pulled():  # in the server's own thread
        if pulled.is_set() and device.plugged:
            device.unplug()
        due = next_event_s()
        return 0.002 if due is None else min(due, 0.002)

    device.function.next_event_s = next_event_or_pulled

    def plug():
        pulled.clear()
        device.plug()

    emulated.pull, emulated.plug = pulled.set, plug
    stop, stopper = os.pipe()
    with listen_tcp("127.0.0.1", 0) as listener:
        server = Server(device)
        emulated.idle = lambda: not server._connections
        thread = threading.Thread(target=server.serve, args=(listener, stop))
        thread.start()
        try:
            emulated.backend = open_usbip(f"usbip://127.0.0.1:{listener.getsockname()[1]}")
            yield emulated
        finally:
            os.write(stopper, b"\0")
            thread.join(WAIT_S)
            os.close(stop)
            os.close(stopper)


@contextlib.contextmanager
def in_process():
    yield InProcess()


def held():
    """Descriptors and threads of this process."""
    return len(os.listdir("/proc/self/fd")), threading.active_count()  # noqa: PTH208


def test_it_comes_back_and_shows_its_picture_again(monkeypatch):
    emulated = InProcess()
    memory = emulated.device.function.wire.device.memory
    monkeypatch.setattr(port_module, "find_backend", lambda port: emulated.backend)  # noqa: ARG005
    with vd.open("usb:", reconnect_s=WAIT_S) as display:
        frame = display.frame()
        frame.set(np.full((40, 64, 17), 7, np.uint8))
        emulated.pull()
        back = threading.Timer(0.05, emulated.plug)
        back.start()
        display.present(frame)
        back.join()
    assert set(memory.front.pixels) == {7}


@pytest.mark.parametrize("rounds", ROUNDS)
@pytest.mark.parametrize("carrier", [in_process, over_usbip], ids=["usb", "usbip"])
def test_pulled_out_at_any_moment(monkeypatch, capsys, carrier, rounds):
    """An error in time, of the right kind; nothing is left over, and the next push works."""
    chance = random.Random(rounds)
    with carrier() as emulated:
        backend = emulated.backend
        monkeypatch.setattr(port_module, "find_backend", lambda port: backend)  # noqa: ARG005

        def push():
            began_s = time.monotonic()
            code = main(["push", PAPER, "--port", "usb:", "--verify", "--timeout", "60"])
            assert time.monotonic() - began_s < WAIT_S, "it took until the end of its patience"
            said = capsys.readouterr()
            assert "Traceback" not in said.err
            until(emulated.idle, "the server to close its end")
            return code, said.err

        device = emulated.device
        assert push()[0] == 0  # all that is loaded once is loaded
        before, packets, began_s = held(), device.packets, time.monotonic()
        assert push()[0] == 0
        packets, seconds = device.packets - packets, time.monotonic() - began_s
        gone = 0
        for number in range(rounds):
            if number % 2:
                device.unplug_at = device.packets + chance.randint(1, packets)
                code, said = push()
            else:
                timer = threading.Timer(chance.uniform(0, seconds), emulated.pull)
                timer.start()
                code, said = push()
                timer.join()
            device.unplug_at = None
            if code:
                gone += 1
                assert code == 3
                assert "is gone" in said or "no such display" in said or "went away" in said, said
            if number % 2 == 0:
                until(lambda: not device.plugged, "it to be out")  # maybe after all was done
            if not device.plugged:
                emulated.plug()
            assert push()[0] == 0
            assert held() == before
        assert gone > rounds // 4

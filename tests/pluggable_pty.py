"""Emulated device on a pty that can be unplugged and plugged in again, at a path that stays."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import tty
from pathlib import Path

import numpy as np

from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.serve import serve_wire

WAIT_S = 20
ROOT = Path(__file__).parents[1]
SCENE = "examples/trefoil.json"


class Plug:
    """Cable to an emulated device, which is found at ``path`` while it is plugged in."""

    def __init__(self, path):
        self.path = path
        self._thread = None
        self.device = None
        self.held = []  # bytes that the device did not take

    def plug(self, device=None, **config):
        """Plug in the same device again, the given one, or a new one."""
        config = {"grid": (17, 9, 5), "pixel_format": "index8", "refresh": 0, **config}
        self.device = device or self.device or Device(Config(**config))
        self.device.disconnect()
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._stop, self._stopper = os.pipe()
        beside = self.path.with_suffix(".new")
        beside.symlink_to(os.ttyname(self._slave))
        beside.replace(self.path)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        return self

    def _run(self):
        """Serve until it is unplugged. Closing descriptors here, none that is reused is closed."""
        serve_wire(DeviceOnLine(self.device), self._master, self._stop)
        for descriptor in (self._master, self._slave):
            os.close(descriptor)
        os.close(self._stop)

    def unplug(self):
        """Unplug the device. Twice is fine."""
        if self._thread is None:
            return
        with contextlib.suppress(FileNotFoundError):
            self.path.unlink()
        os.write(self._stopper, b"\0")
        self._thread.join(WAIT_S)
        assert not self._thread.is_alive()
        os.close(self._stopper)
        self._thread = None

    def hold(self):
        """Have the device ignore all that comes once a session is open."""
        device = self.device
        take, held = device.receive, self.held
        device.receive = lambda data: held.append(data) if device.session else take(data)

    def release(self):
        """Have it go on; what came in between is lost."""
        del self.device.receive

    def snapshot(self):
        return Bench(self.device).snapshot()

    def shows(self, frame):
        return self.snapshot().pixels == frame.array().tobytes()

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.unplug()


def open_descriptors():
    """Return the descriptors of this process, to compare with those afterwards."""
    return sorted(path.name for path in Path("/proc/self/fd").iterdir())


def noise_frame(display, seed=0):
    frame = display.frame()
    array = frame.array()
    frame.set(np.random.default_rng(seed).integers(0, 256, array.shape).astype(array.dtype))
    return frame


def start_push(port, *arguments, **options):
    """Start ``voxdisplay push`` as a process of its own."""
    command = [sys.executable, "-m", "voxdisplay", "push", SCENE, "--port", str(port), *arguments]
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "cwd": ROOT, **options}
    return subprocess.Popen(command, text=True, **options)

"""An emulated device on a pty that can be pulled out and plugged in again, at a path that stays."""

from __future__ import annotations

import contextlib
import os
import threading
import tty
from pathlib import Path

from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.device_on_line import DeviceOnLine
from firmware_sim.serve import serve_wire

WAIT_S = 20


class Plug:
    """A cable. ``path`` is where the device is found while it is plugged in."""

    def __init__(self, path):
        self.path = path
        self._thread = None
        self.device = None
        self.held = []  # what was not taken

    def plug(self, device=None, **config):
        """Plug a device in: the one from before, another, or a new one."""
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
        """Serve until it is pulled out; the pump itself lets go, so that nobody else's file is."""
        serve_wire(DeviceOnLine(self.device), self._master, self._stop)
        for descriptor in (self._master, self._slave):
            os.close(descriptor)
        os.close(self._stop)

    def unplug(self):
        """Pull it out, now; once more does no harm."""
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
        """Once a session is open, have the device take nothing more, and answer nothing."""
        device = self.device
        take, held = device.receive, self.held
        device.receive = lambda data: held.append(data) if device.session else take(data)

    def release(self):
        """Have it go on; what came meanwhile is lost."""
        del self.device.receive

    def snapshot(self):
        return Bench(self.device).snapshot()

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.unplug()


def open_descriptors():
    """What this process has open: to be the same afterwards."""
    return sorted(path.name for path in Path("/proc/self/fd").iterdir())

"""An emulated device on a pty that can be pulled out and plugged in again, at a path that stays."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import tty
from pathlib import Path

from firmware_sim.bench import Bench
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.pace import paced
from firmware_sim.serve import serve_wire
from firmware_sim.wire import Wire

WAIT_S = 20


class Plug:
    """A cable. ``path`` is where the device is found while it is plugged in."""

    def __init__(self, path, *, baud=0):
        self.path = path
        self._baud = baud
        self._thread = None
        self.device = None

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
        wire = paced(Wire(self.device), self._baud)
        self._thread = threading.Thread(target=self._run, args=(wire,))
        self._thread.start()
        return self

    def _run(self, wire):
        """Serve until it is pulled out; the pump itself lets go, so that nobody else's file is."""
        serve_wire(wire, self._master, self._stop)
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

    def snapshot(self):
        return Bench(self.device).snapshot()

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.unplug()


def open_descriptors():
    """What this process has open: to be the same afterwards."""
    return sorted(path.name for path in Path("/proc/self/fd").iterdir())


def readable(descriptor, seconds):
    return bool(select.select([descriptor], [], [], seconds)[0])

"""The reference device on a bare Cortex-M, as qemu emulates it, and a line to it that has faults.

Knows neither the driver nor the emulator of displays.
"""

from __future__ import annotations

import os
import random
import re
import select
import shutil
import subprocess
import threading
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Self

from c_device import FIRMWARE, FORMATS, Grid

BOARDS = ("emcraft-sf2", "mps2-an385")
MAKE, COMPILER, EMULATOR = map(shutil.which, ("make", "arm-none-eabi-gcc", "qemu-system-arm"))
MISSING = None in (MAKE, COMPILER, EMULATOR)


class EmulatedBoard:
    """A board that runs the device; ``port`` is its UART."""

    def __init__(self, name: str, grid: Grid, pixel_format: str, build: Path) -> None:
        options = [f"-DVXD_N{axis}={side}" for axis, side in zip("XYZ", grid, strict=True)]
        options += [f"-DVXD_FORMAT={FORMATS.index(pixel_format) + 1}"]
        options += ["-DVXD_MAX_PAYLOAD=1024", "-DVXD_RING=16384"]
        program = build / f"{name}.elf"
        make = [str(MAKE), "-s", "-C", str(FIRMWARE), str(program), f"BUILD={build}"]
        subprocess.run([*make, f"OPTIONS={' '.join(options)}"], check=True)
        machine = [str(EMULATOR), "-M", name, "-nographic", "-monitor", "stdio"]
        self._process = subprocess.Popen(
            [*machine, "-serial", "pty", "-kernel", program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        found = None
        while found is None:
            line = self._process.stdout.readline()
            assert line, "qemu has ended"
            found = re.search(r"redirected to (\S+)", line)
        self.port = found[1]

    def restart(self) -> None:
        """Switch the board off and on again."""
        assert self._process.stdin is not None
        self._process.stdin.write("system_reset\n")
        self._process.stdin.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        ended = self._process.poll()
        self._process.kill()
        self._process.communicate()
        assert ended is None or any(error), "qemu has ended"


class FaultyLine:
    """A line between ``port``, a pseudo-terminal, and the port of a device.

    Parameters
    ----------
    far_port
        Path of the device's own pseudo-terminal.
    seed, error_rate
        Bytes are inverted in one bit, or lost, at the same places of a run each time; on average
        one of 1 / ``error_rate`` bytes of each direction.
    when_sent
        A number of bytes, and what is called once when so many have gone to the device.
    """

    def __init__(
        self,
        far_port: str,
        *,
        seed: int = 0,
        error_rate: float = 0.0,
        when_sent: tuple[int, Callable[[], None]] | None = None,
    ) -> None:
        self.faults = 0
        self._error_rate = error_rate
        self._when_sent = when_sent
        self._sent = 0
        self._near, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._far = os.open(far_port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._far)
        self._random = {each: random.Random(f"{seed} {each}") for each in ("to", "from")}
        self._stop, self._stopper = os.pipe()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while True:
            ready, _, _ = select.select([self._near, self._far, self._stop], [], [])
            if self._stop in ready:
                return
            if self._near in ready:
                data = os.read(self._near, 512)
                self._write(self._far, self._damaged(data, "to"))
                self._sent += len(data)
                if self._when_sent is not None and self._sent >= self._when_sent[0]:
                    self._when_sent[1]()
                    self._when_sent = None
            if self._far in ready:
                self._write(self._near, self._damaged(os.read(self._far, 512), "from"))

    def _damaged(self, data: bytes, direction: str) -> bytes:
        chance = self._random[direction]
        out = bytearray()
        for byte in data:
            if chance.random() >= self._error_rate:
                out.append(byte)
                continue
            self.faults += 1
            if chance.random() < 0.5:
                out.append(byte ^ (1 << chance.randrange(8)))
        return bytes(out)

    @staticmethod
    def _write(file: int, data: bytes) -> None:
        while data:
            data = data[os.write(file, data) :]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.write(self._stopper, b"\0")
        self._thread.join()
        for file in (self._near, self._slave, self._far, self._stop, self._stopper):
            os.close(file)

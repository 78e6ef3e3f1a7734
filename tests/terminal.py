"""Pseudo-terminal with a program on it, for tests of keys, screen and terminal modes."""

from __future__ import annotations

import codecs
import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
DEADLINE_S = 60


class Terminal:
    """A program in a terminal of 60 columns and 20 rows.

    The slave of the pty is its stdin, stdout, stderr and controlling terminal.
    """

    def __init__(self, arguments, *, code=None, stdin=None, **environment):
        self.screen, self._slave = pty.openpty()
        self.resize(20, 60)
        self.mode = termios.tcgetattr(self._slave)
        self.text = ""
        self._decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
        command = ["-c", code] if code else ["-m", "voxdisplay"]
        variables = {**os.environ, "TERM": "xterm-256color", "COLORTERM": "truecolor"}
        variables.pop("NO_COLOR", None)
        variables.pop("VOXDISPLAY_PORT", None)
        self.process = subprocess.Popen(
            [sys.executable, *command, *map(str, arguments)],
            stdin=self._slave if stdin is None else stdin,
            stdout=self._slave,
            stderr=self._slave,
            cwd=ROOT,
            env={**variables, "PYTHONUTF8": "1", **environment},
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(1, termios.TIOCSCTTY, 0),  # noqa: PLW1509 - no threads
        )

    def resize(self, rows, columns):
        fcntl.ioctl(self.screen, termios.TIOCSWINSZ, struct.pack("4H", rows, columns, 0, 0))

    def press(self, keys):
        os.write(self.screen, keys.encode())

    def read_until(self, done):
        """Read the screen until a condition holds for what was read; return what was read."""
        text, deadline_s = "", time.monotonic() + DEADLINE_S
        while not done(text):
            if not select.select([self.screen], [], [], deadline_s - time.monotonic())[0]:
                raise TimeoutError(self.text[-2000:])
            text += self._read()
        return text

    def _read(self):
        try:
            data = self._decoder.decode(os.read(self.screen, 65536))  # a character may be split
        except OSError:  # the slave is closed
            data = ""
        self.text += data
        return data

    def finish(self):
        """Wait for the program to end; return its exit code and all that it wrote."""
        deadline_s = time.monotonic() + DEADLINE_S
        while self.process.poll() is None and time.monotonic() < deadline_s:
            if select.select([self.screen], [], [], 0.05)[0]:
                self._read()
        while select.select([self.screen], [], [], 0)[0] and self._read():
            pass
        return self.process.wait(0), self.text

    @property
    def modes_restored(self):
        """True if the terminal's modes are those of the beginning."""
        return termios.tcgetattr(self._slave) == self.mode

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self.screen)
        os.close(self._slave)

"""Shows for the tests of the process that prepares frames; it imports them by this name."""

import os
import sys
import time
from pathlib import Path

import voxdisplay as vd


class SlowShow:
    """A show whose frames take processor time; the voxel of each says which process drew it."""

    loop = False
    fps = 30.0

    def __init__(self, frame_count=60, work_s=0.02, fails_at=None, log=None):
        self.frame_count, self.duration = frame_count, frame_count / self.fps
        self._work_s, self._fails_at, self._log = work_s, fails_at, log

    def frame(self, number):
        began_s = time.thread_time()
        while time.thread_time() - began_s < self._work_s:
            pass
        if self._log is not None:
            with Path(self._log).open("a", encoding="utf-8") as log:
                log.write(f"{os.getpid()} {number}\n")
        if number == self._fails_at:
            raise vd.CurveError("this frame fails")
        sys.stdout.write("shows may print")
        frame = vd.Frame((16, 16, 16))
        frame.draw([(number % 16, number // 16 % 16, 3), (0, 0, 0)], "red")
        return frame

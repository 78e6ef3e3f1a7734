"""Recordings made for tests."""

from __future__ import annotations

import os
from pathlib import Path

import voxdisplay as vd
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.shows.recording_writer import RecordingFormat, RecordingWriter
from voxdisplay.shows.rendering import Rendering

FEATURES = ("line", "box", "dots", "oct")


class Spin:
    """A show: a circle that turns, on a display of 12x10x9."""

    fps = 25.0
    loop = True

    def __init__(self, frame_count=40, format_="rgb888", dies_once=None):
        self.frame_count = frame_count
        self.format = format_
        self._dies_once = dies_once  # a file that says that it has happened

    @property
    def duration(self):
        return self.frame_count / self.fps

    def frame(self, number):
        if self._dies_once and number == self.frame_count // 2:
            path = Path(self._dies_once)
            if not path.exists():
                path.write_text("died")
                os._exit(9)
        frame = vd.Frame((12, 10, 9), self.format)
        angle = number * 0.3
        normal = (1, 0.2 * number, 2)
        frame.draw(
            vd.Circle(center=(6, 5, 4.5), radius=3 + 0.02 * angle, normal=normal),
            color=["red", "lime"],
        )
        return frame


def recording_format(show, **changes):
    """Return the format of a recording of `Spin`."""
    keys = {"features": FEATURES, "max_payload": 64, "loop": show.loop, "meta": {"name": "spin"}}
    keys.update(changes)
    millihertz = round(show.fps * 1000)
    return RecordingFormat(Grid(12, 10, 9), PixelFormat(show.format), millihertz, **keys)


def write_recording(path, show, **changes):
    """Record a show, and return its frames."""
    wanted = recording_format(show, **changes)
    with RecordingWriter(path, wanted) as writer:
        for frame in Rendering(show, wanted).render(0, show.frame_count):
            writer.append(frame)
    return [show.frame(number) for number in range(show.frame_count)]

"""The source of pictures that follow each other in time."""

from __future__ import annotations

import threading

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.errors import TransportClosed
from voxdisplay.raster.pixel_map import PixelMap
from voxdisplay.view.live.moving_source import MovingSource
from voxdisplay.view.live.snapshot_message import Snapshot


def picture(number):
    page = PixelMap(np.array([number]), np.array([0xFF], dtype=np.uint32))
    return Snapshot(page, vd.Grid(3, 5, 7), vd.PixelFormat.RGB888, number + 1, "a")


class Steps:
    """A clock that goes on by a step with each question."""

    def __init__(self, step_s):
        self.now, self._step_s = 100.0, step_s

    def __call__(self):
        self.now += self._step_s
        return self.now


def numbers(source, count):
    return [source.next()[1].number for _ in range(count)]


def test_each_picture_has_its_time_and_the_first_follows_the_last():
    source = MovingSource(4, 1000, picture, "a", Steps(0.0003))
    assert numbers(source, 9) == [1, 2, 3, 4, 1, 2, 3, 4, 1]


def test_pictures_whose_time_is_over_are_left_out():
    source = MovingSource(10, 10, picture, "a", Steps(0.25))
    assert numbers(source, 4) == [3, 6, 8, 1]


def test_keys_are_those_of_the_time_not_of_the_picture():
    source = MovingSource(1, 1000, picture, "a", Steps(0.001))
    assert len({source.next()[0] for _ in range(5)}) == 5


def test_it_begins_when_it_is_first_watched_and_can_send_again():
    clock = Steps(0.0)
    source = MovingSource(5, 1.0, picture, "a", clock)
    source.check_alive()
    clock.now = 500.0
    assert source.next()[1].number == 1
    source.resend()
    assert source.next()[1].number == 1


def test_closing_ends_the_wait():
    source = MovingSource(5, 1e-6, picture, "a film", Steps(0.0))
    source.next()
    closing = threading.Timer(0.05, source.close)
    closing.start()
    with pytest.raises(TransportClosed, match="a film is closed"):
        source.next()
    closing.join()

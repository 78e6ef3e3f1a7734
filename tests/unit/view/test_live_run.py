"""Main loop of a live view: how signals end it."""

from __future__ import annotations

import asyncio
import signal

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.view.live.run import run
from voxdisplay.view.live.snapshot_message import Snapshot
from voxdisplay.view.live.sources import StaticSource


class Ended(BaseException):
    """What a handler raises, such as SystemExit."""


@pytest.fixture
def source():
    page = np.zeros((7, 5, 3), np.uint8)
    return StaticSource(Snapshot(page, vd.Grid(3, 5, 7), vd.PixelFormat.INDEX8, 1, "still"))


@pytest.fixture
def handler():
    """A handler of SIGTERM that raises, and notes whether that would hit a task of a loop."""

    def end(_number, _frame):
        with_loop.append(asyncio.events._get_running_loop() is not None)
        raise Ended

    with_loop = []
    before = signal.signal(signal.SIGTERM, end)
    yield end, with_loop
    signal.signal(signal.SIGTERM, before)


def test_a_handler_that_raises_is_called_when_the_loop_has_ended(source, handler):
    end, with_loop = handler
    with pytest.raises(Ended):
        run(source, "127.0.0.1", 0, lambda _url: signal.raise_signal(signal.SIGTERM))
    assert with_loop == [False]
    assert source._closing.is_set()
    assert signal.getsignal(signal.SIGTERM) is end


def test_a_signal_that_nobody_handles_is_left_alone(source):
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    seen = []

    def look(_url):
        seen.append(signal.getsignal(signal.SIGHUP))
        raise Ended

    try:
        with pytest.raises(Ended):
            run(source, "127.0.0.1", 0, look)
    finally:
        signal.signal(signal.SIGHUP, before)
    assert seen == [signal.SIG_DFL]

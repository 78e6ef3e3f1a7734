"""Preparing frames: what is requested of another process, and what becomes of it."""

from __future__ import annotations

import pytest

import voxdisplay as vd
from voxdisplay.frame.output_transform import OutputTransform
from voxdisplay.raster.light import CurrentLimit
from voxdisplay.shows import preparing
from voxdisplay.shows.frame_schedule import Slot
from voxdisplay.shows.preparing import PREFETCH, FrameSource
from voxdisplay.shows.show import EncodedFrame
from voxdisplay.shows.worker_process import encode_frame

ENCODING = (1024, (), 1e6)


class Dots:
    """A show that is nothing."""

    fps, loop, frame_count, duration = 30.0, False, 10_000, 10_000 / 30

    def frame(self, number):
        del number
        return vd.Frame((3, 5, 7))


class Worker:
    """A process that answers when it is told to."""

    def __init__(self):
        self.ready, self.ended = True, False
        self.asked, self._answered = [], []
        self.notes = []

    def request(self, key, show, number, encoding):
        assert (show, encoding) == (0, ENCODING)
        assert key == number
        self.asked.append(key)

    def answer(self, note=""):
        """Answer the oldest request."""
        key = self.asked[len(self._done)]
        self._done.append(key)
        self._answered.append((key, EncodedFrame((b"",), key, note), 0.01))
        return key

    @property
    def _done(self):
        return self.__dict__.setdefault("_answers", [])

    @property
    def unanswered(self):
        return len(self.asked) - len(self._done)

    def results(self):
        while self._answered:
            yield self._answered.pop(0)

    def close(self):
        self.ended = True


@pytest.fixture
def source(monkeypatch):
    """A source that has found its frames slow, and its process."""
    worker = Worker()
    monkeypatch.setattr(preparing, "_WORKER_SHARE", 0.0)
    monkeypatch.setattr(preparing.WorkerProcess, "start", lambda _shows: worker)
    source = FrameSource([Dots()], note=worker.notes.append)
    for ordinal in range(6):
        request(source, ordinal)
    assert source.uses_worker
    assert source.newest(-1, 4)[0].ordinal == 4
    source.clear()
    worker.answer()
    assert source.pending(-1) == []
    return source, worker


def request(source, ordinal):
    source.request(Slot(ordinal, 0, ordinal, ordinal / 30, (ordinal + 1) / 30), ENCODING, 1 / 30)


def test_seeking_again_and_again_asks_for_no_more_than_are_answered(source):
    """An arrow that is held down: each step forgets what was requested, and wants others."""
    source, worker = source
    for step in range(100):
        source.clear()
        for ahead in range(3):
            request(source, 100 * step + 100 + ahead)
        assert worker.unanswered <= PREFETCH
    assert worker.unanswered == PREFETCH, "and it is kept busy"
    for _ in range(PREFETCH):
        worker.answer()
    last = 100 * 99 + 100
    assert source.newest(last - 1, last + 2) is None, "what it had to do first is not wanted"
    request(source, last)
    assert worker.answer() == last
    assert source.newest(last - 1, last)[0].ordinal == last


def test_a_frame_that_is_wanted_again_is_not_requested_twice(source):
    source, worker = source
    request(source, 50)
    source.clear()
    request(source, 50)
    request(source, 50)
    assert worker.asked[1:] == [50]
    worker.answer()
    assert source.newest(49, 50)[0].ordinal == 50


def test_an_answer_that_is_not_wanted_any_more_is_dropped(source):
    source, worker = source
    request(source, 50)
    source.clear()
    worker.answer()
    assert source.newest(0, 60) is None
    assert not source.busy


def test_when_the_process_has_ended_frames_are_prepared_here(source):
    source, worker = source
    for ordinal in (50, 51, 52):
        request(source, ordinal)
    worker.ended = True
    assert source.pending(49) == []
    request(source, 53)
    assert source.newest(49, 53)[0].ordinal == 53
    assert not source.uses_worker


def test_what_a_limit_did_to_frames_of_the_process_is_noted(source):
    source, worker = source
    request(source, 20)
    worker.answer(note="dimmed")
    source.pending(-1)
    assert worker.notes == ["dimmed"]


def test_a_frame_that_is_encoded_says_what_a_limit_did():
    frame = vd.Frame((3, 5, 7))
    frame.draw([[0, 1, 2]], "white")
    assert encode_frame(frame, ENCODING).note == ""
    limited = frame.with_output(OutputTransform(limit=CurrentLimit(0.03, 20)))
    encoded = encode_frame(limited, ENCODING)
    assert encoded.note.startswith("this picture takes 0.06 A, the limit is 0.03 A: shown with 50")
    assert encoded.digest == limited.digest() != frame.digest()

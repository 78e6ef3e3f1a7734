"""Recording of shows: equal bytes from every engine, continued runs, workers that die."""

from __future__ import annotations

import multiprocessing
import os
import sys

import pytest
from recordings import Spin, recording_format, write_recording

from voxdisplay.errors import RecordingError
from voxdisplay.shows.record import check, record
from voxdisplay.shows.recording import Recording
from voxdisplay.shows.render_engines import process_pool, serial
from voxdisplay.shows.rendering import Rendering


def rendering(show):
    return Rendering(show, recording_format(show))


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    path = tmp_path_factory.mktemp("expected") / "a.vxs"
    write_recording(path, Spin())
    return path.read_bytes()


@pytest.mark.parametrize("chunk_frames", [1, 7, 60])
def test_chunks_of_any_size_give_the_same_bytes(expected, tmp_path, chunk_frames):
    seen = []
    path = tmp_path / "a.vxs"
    show = Spin()
    count = record(
        rendering(show), path, chunk_frames=chunk_frames, progress=lambda *at: seen.append(at)
    )
    assert count == 40
    assert path.read_bytes() == expected
    assert not (tmp_path / "a.vxs.parts").exists()
    assert seen[0] == (0, 40)
    assert seen[-1] == (40, 40)


@pytest.mark.parametrize("jobs", [1, 2, 4])
def test_processes_give_the_same_bytes(expected, tmp_path, jobs):
    path = tmp_path / "a.vxs"
    record(rendering(Spin()), path, engine=process_pool(jobs), chunk_frames=9)
    assert path.read_bytes() == expected


class Parents:
    """A rendering of no frames but its worker's parent, and a module that is there already."""

    def render(self, first, count):
        del first, count
        yield os.getppid(), "voxdisplay.scene.model" in sys.modules


@pytest.mark.skipif(
    "forkserver" not in multiprocessing.get_all_start_methods(), reason="needs a fork server"
)
def test_workers_are_forked_from_a_server_that_has_imported_what_they_need():
    rendered = process_pool(2)(Parents(), [(0, 1), (1, 1)])
    ((parent, preloaded),) = {found for _, (found,) in rendered}
    assert parent != os.getpid()
    assert preloaded


def test_a_worker_that_dies_costs_nothing_but_its_chunks(expected, tmp_path):
    path = tmp_path / "a.vxs"
    show = Spin(dies_once=str(tmp_path / "died"))
    record(rendering(show), path, engine=process_pool(2), chunk_frames=9)
    assert (tmp_path / "died").exists()
    assert path.read_bytes() == expected


class Deadly(Spin):
    """A show whose frame 20 ends each worker."""

    def frame(self, number):
        if number == 20:
            os._exit(9)
        return super().frame(number)


def test_a_chunk_that_kills_each_worker_is_named(tmp_path):
    path = tmp_path / "a.vxs"
    with pytest.raises(RecordingError, match="frames 18 to 26: the worker process died 3 times"):
        record(rendering(Deadly()), path, engine=process_pool(1), chunk_frames=9)
    assert not path.exists()


class Counted(Spin):
    """A show that counts how often each frame is drawn, and fails at one."""

    drawn: list[int] = []  # noqa: RUF012 - of all of them
    fails_at = None

    def frame(self, number):
        if number == type(self).fails_at:
            raise RecordingError("the scene has no value there")
        self.drawn.append(number)
        return super().frame(number)


def test_a_second_run_goes_on_where_the_first_ended(expected, tmp_path):
    path = tmp_path / "a.vxs"
    Counted.drawn.clear()
    Counted.fails_at = 25
    with pytest.raises(RecordingError, match="no value there"):
        record(rendering(Counted()), path, chunk_frames=10)
    Counted.fails_at = None
    assert not path.exists()
    Counted.drawn.clear()
    record(rendering(Counted()), path, chunk_frames=10)
    assert Counted.drawn == list(range(20, 40))
    assert path.read_bytes() == expected


def test_chunks_of_another_show_or_damaged_ones_are_not_used(expected, tmp_path):
    path = tmp_path / "a.vxs"
    Counted.fails_at = 25
    with pytest.raises(RecordingError):
        record(rendering(Counted(frame_count=30)), path, chunk_frames=10)
    Counted.fails_at = 25
    with pytest.raises(RecordingError):
        record(rendering(Counted()), path, chunk_frames=10)
    Counted.fails_at = None
    kept = tmp_path / "a.vxs.parts" / "10-10.vxs"
    kept.write_bytes(kept.read_bytes()[:-9])
    Counted.drawn.clear()
    record(rendering(Counted()), path, chunk_frames=10)
    assert Counted.drawn == list(range(10, 40))
    assert path.read_bytes() == expected


def test_check_renders_again(expected, tmp_path):
    path = tmp_path / "a.vxs"
    path.write_bytes(expected)
    assert check(rendering(Spin()), path, 5) == 5
    assert check(rendering(Spin()), path, 1) == 1
    with pytest.raises(RecordingError, match="frame 0 differs"):
        check(rendering(Spin(format_="rgb888", frame_count=41)), _shifted(tmp_path), 2)


def _shifted(tmp_path):
    """Record a show without its first frame."""

    class Shifted(Spin):
        def frame(self, number):
            return super().frame(number + 1)

    path = tmp_path / "shifted.vxs"
    write_recording(path, Shifted())
    return path


def test_a_recording_is_rendered_as_it_is(expected, tmp_path):
    source = tmp_path / "a.vxs"
    source.write_bytes(expected)
    recording = Recording(source)
    again = Rendering(recording, recording.format)
    record(again, tmp_path / "b.vxs", engine=serial)
    assert (tmp_path / "b.vxs").read_bytes() == expected


def test_shows_of_another_display(tmp_path):
    show = Spin()
    wanted = recording_format(Spin(format_="mono1"))
    with pytest.raises(RecordingError, match="12x10x9 rgb888, the recording of 12x10x9 mono1"):
        record(Rendering(show, wanted), tmp_path / "a.vxs")


def test_a_show_without_frames(tmp_path):
    with pytest.raises(RecordingError, match="no frames"):
        record(rendering(Spin(0)), tmp_path / "a.vxs")

"""Pictures of an open display as a source: what it shows, until it is closed or forgotten."""

import gc
import weakref

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.display.shown_pictures import ShownPictures
from voxdisplay.errors import TransportClosed

GRID = (3, 5, 7)
SHOW = """{"size": [3, 5, 7], "duration": 0.2, "fps": 10,
 "objects": [{"type": "scatter", "points": [[1.5, 2.5, "1.5 + floor(time * 10)"]]}]}"""


def source_of(display):
    return ShownPictures(display.port, weakref.WeakMethod(display._shown))


def frame_of(display, *voxels):
    frame = display.frame()
    frame.draw(np.array(voxels), "#ff8000")
    return frame


def lit(snapshot):
    return snapshot.grid.voxels_at(snapshot.page.index).tolist()


@pytest.mark.parametrize("format_", ["mono1", "index8", "rgb565", "rgb888"])
def test_what_is_presented_is_shown(format_):
    with vd.open(f"sim:?size=3x5x7&format={format_}") as display:
        source = source_of(display)
        display.present(frame_of(display, (1, 2, 3)))
        number, snapshot = source.next()
        assert (number, snapshot.number, snapshot.title) == (1, 1, display.port)
        assert lit(snapshot) == [[1, 2, 3]]
        display.present(frame_of(display, (2, 2, 3)), wait=False)
        display.flush()
        number, snapshot = source.next()
        assert (number, lit(snapshot)) == (2, [[2, 2, 3]])


def test_a_source_that_sends_again_shows_the_same():
    with vd.open("sim:?size=3x5x7") as display:
        source = source_of(display)
        display.present(frame_of(display, (1, 2, 3)))
        source.next()
        source.resend()
        assert lit(source.next()[1]) == [[1, 2, 3]]


@pytest.mark.parametrize("format_", ["index8", "rgb888"])
def test_a_recording_that_is_played_is_decoded(format_, tmp_path, run):
    scene = tmp_path / "a.json"
    scene.write_text(SHOW, encoding="utf-8")
    recording = tmp_path / "a.vxs"
    done = run("record", scene, "-o", recording, "--format", format_)
    assert done.returncode == 0, done.stderr
    with vd.open(f"sim:?size=3x5x7&format={format_}") as display:
        source = source_of(display)
        display.play(vd.load_show(recording))
        _, snapshot = source.next()
        assert lit(snapshot) == [[1, 2, 2]]
        assert snapshot.format is vd.PixelFormat(format_)


def test_it_ends_with_the_display_behind_the_last_picture():
    with vd.open("sim:?size=3x5x7") as display:
        source = source_of(display)
        display.present(frame_of(display, (1, 2, 3)), wait=False)
    assert lit(source.next()[1]) == [[1, 2, 3]]
    with pytest.raises(TransportClosed, match="is closed: last picture"):
        source.next()


def test_it_does_not_keep_the_display():
    display = vd.open("sim:?size=3x5x7")
    source = source_of(display)
    display.present(frame_of(display, (1, 2, 3)))
    source.next()
    connection = display._connection
    del display
    gc.collect()
    with pytest.raises(TransportClosed, match="is closed"):
        source.next()
    connection.close()


def test_it_can_be_closed():
    with vd.open("sim:?size=3x5x7") as display:
        source = source_of(display)
        source.check_alive()
        source.close()
        with pytest.raises(TransportClosed, match="not viewed"):
            source.next()


def test_outside_a_notebook_the_picture_is_shown(monkeypatch):
    shown = []
    monkeypatch.setattr(vd.Frame, "show", lambda frame: shown.append(frame.lit()[0].tolist()))
    with vd.open("sim:?size=3x5x7") as display:
        display.show()
        display.present(frame_of(display, (1, 2, 3)))
        display.show()
        assert shown == [[], [1 + 3 * (2 + 5 * 3)]]
    with pytest.raises(vd.LocalProtocolError, match="closed"):
        display.show()

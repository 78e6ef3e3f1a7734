"""Several displays as one, on emulators in this process: cutting, orientation, colours, ends."""

import threading
from itertools import product

import numpy as np
import pytest
from stand_ins import missing_attributes

import voxdisplay as vd
from voxdisplay.raster.orientation import Orientation

WHOLE = (8, 5, 7)


def wall(format_="rgb888", axes="x,y,z", refresh=0, **keys):
    memory = Orientation.of(axes).memory_grid(vd.Grid(5, 5, 7))
    end = f"&format={format_}&refresh={refresh}"
    return {
        "parts": [
            {"name": "a", "port": f"sim:?size=3x5x7{end}", "size": [3, 5, 7]},
            {"name": "b", "port": f"sim:?size={memory}{end}", "size": [5, 5, 7], "at": [3, 0, 0],
             "axes": axes},
        ],
        **keys,
    }  # fmt: skip


def drawn(frame):
    frame.draw(vd.Segment((0, 0, 0), (7.9, 4.9, 6.9)), color=["red", "lime", "blue"])
    frame.draw(vd.Sphere((4, 2.5, 3.5), 2), color="gold")
    return frame


@pytest.mark.parametrize(
    ("format_", "axes"),
    list(product(["mono1", "index8", "rgb565", "rgb888"], ["x,y,z", "-z,x,-y", "y,-x,z"])),
)
def test_what_is_shown_is_what_was_drawn(format_, axes):
    with vd.open(display=wall(format_, axes)) as shown:
        assert shown.info.grid == WHOLE
        frame = drawn(shown.frame())
        receipt = shown.present(frame)
        assert receipt.digest == frame.digest() == shown.digest()
        assert np.array_equal(shown.read(), frame.array())
        assert np.array_equal(shown.verify(frame), frame.array())
        # As its difference, and from what is on display.
        frame = shown.frame(keep=True)
        frame.draw([[2, 0, 0], [3, 0, 0]], "white")
        assert shown.present(frame).digest == frame.digest()
        assert np.array_equal(shown.verify(frame), frame.array())
        pixels = np.random.default_rng(1).integers(0, 2, frame.array().shape)
        frame.set(pixels.astype(frame.array().dtype))
        shown.present(frame)
        assert np.array_equal(shown.read(), frame.array())
        assert shown.clear().digest == 0


def test_brightness_and_limit_are_of_the_whole():
    notes = []
    keys = {"brightness": 0.5, "limit": {"amps": 0.1, "ma_per_channel": 20}}
    with vd.open(display=wall(axes="-x,-y,z", **keys), note=notes.append) as shown:
        frame = shown.frame()
        frame.set(np.full((7, 5, 8, 3), 255, dtype=np.uint8))
        receipt = shown.present(frame)
        page = shown.read()
        assert len({tuple(pixel) for pixel in page.reshape(-1, 3)}) == 1
        assert 0 < page.max() < 128
        assert np.array_equal(page, shown.verify(frame))
        assert receipt.digest is not None
    assert any("the limit is 0.1 A" in note for note in notes)


def test_unwaited_frames_are_shown_and_the_last_one_stays():
    with vd.open(display=wall(refresh=120)) as shown:
        for frame_time in shown.clock(fps=40, seconds=0.3):
            frame = shown.frame()
            frame.draw([[round(20 * frame_time), 1, 2]], "red")
            shown.present(frame, wait=False)
        shown.flush()
        playback = shown.playback
        assert playback.presented == playback.shown + playback.dropped
        assert playback.shown > 3
        assert playback.wrong == 0
        assert shown.digest() == frame.digest()
        assert np.array_equal(shown.read(), frame.array())


def test_a_frame_is_encoded_while_the_one_before_it_is_on_its_way():
    with vd.open(display=wall(refresh=120)) as shown:
        operations = shown._tiles.workers[1].display._operations
        start, encoded_before = operations.start_held, []

        def start_held(frame, payloads, work):
            encoded_before.append(payloads is not None)
            ticket = start(frame, payloads, work)
            while work():  # to the last payload, so that one that is left out would be missed
                pass
            return ticket

        operations.start_held = start_held
        for number in range(300):
            frame = drawn(shown.frame())
            frame.draw([[number % 8, 4, 2]], "white")
            shown.present(frame, wait=False)
            shown.wait_until(shown._clock() + 0.002)
            if any(encoded_before):
                break
        assert any(encoded_before)
        shown.flush()
        assert shown.playback.wrong == 0
        assert np.array_equal(shown.verify(frame), frame.array())


def test_a_show_is_played():
    scene = vd.read_scene(
        '{"size": [8, 5, 7], "duration": 0.2, "fps": 20, "objects": [{"type": "segment", '
        '"from": [0, 0, 0], "to": [7, 4, "6*time"]}]}'
    )
    with vd.open(display=wall()) as shown:
        report = shown.play(scene)
        assert report.frames == report.shown + report.dropped == 4
        assert report.wrong == 0


def test_a_hole_is_dark_and_the_digest_is_of_what_is_shown():
    keys = wall()
    keys["parts"][1]["at"] = [4, 0, 0]
    notes = []
    with vd.open(display=keys, note=notes.append) as shown:
        assert shown.info.grid == (9, 5, 7)
        frame = shown.frame()
        frame.draw([[2, 1, 1], [3, 1, 1], [4, 1, 1]], "red")
        receipt = shown.present(frame)
        covered = shown.frame()
        covered.draw([[2, 1, 1], [4, 1, 1]], "red")
        assert receipt.digest == covered.digest() == shown.digest()
        assert np.array_equal(shown.verify(frame), covered.array())
    assert notes[0].startswith("no part lies at x 3, ")


def test_another_picture_than_was_shown_has_no_digest():
    with vd.open(display=wall()) as shown:
        assert shown.digest() is None
        shown.present(drawn(shown.frame()))
        assert shown.digest() is not None


def test_its_parts_are_told():
    with vd.open(display=wall(axes="-x,-y,z")) as shown:
        assert [part.state for part in shown.parts] == ["open", "open"]
        assert shown.parts[1].as_json()["axes"] == ["-x", "-y", "z"]
        assert "sim:?size=3x5x7" in repr(shown)
        receipt = shown.present(shown.frame())
        assert receipt.lost == ()
        assert "a: <Receipt" in repr(receipt.parts)
    with vd.open("sim:?size=3x5x7") as alone:
        assert alone.parts == ()


def test_a_part_behind_whose_port_another_device_comes_back_is_lost(monkeypatch):
    notes = []
    with vd.open(display=wall(), note=notes.append) as shown:
        worker = shown._tiles.workers[1]

        def another(*_arguments):
            worker.display._connection.close()  # as a connection does that finds it
            raise vd.IncompatibleDevice("the device came back as another")

        monkeypatch.setattr(worker.display._operations, "show", another)
        receipt = shown.present(drawn(shown.frame()))
        assert receipt.lost == ("b",)
        assert receipt.digest is None
        assert receipt.parts[0].receipt.digest is not None
    assert notes == ["b is lost: the device came back as another; the others go on"]


def test_a_part_that_shows_something_else_is_an_error_that_names_it(monkeypatch):
    with vd.open(display=wall()) as shown:
        worker = shown._tiles.workers[1]

        def wrong(*_arguments):
            raise vd.DesyncError("the display's digest is 1, the frame's 2")

        monkeypatch.setattr(worker.display._operations, "show", wrong)
        with pytest.raises(vd.DesyncError, match=r"b \(sim:.*\): the display's digest is 1"):
            shown.present(drawn(shown.frame()))
        monkeypatch.undo()
        frame = drawn(shown.frame())
        assert shown.present(frame).digest == frame.digest()


def test_closing_twice_and_dark():
    shown = vd.open(display=wall())
    shown.present(drawn(shown.frame()))
    shown.close(blank=True)
    shown.close()
    with pytest.raises(vd.LocalProtocolError, match="closed"):
        shown.clear()
    assert not [each for each in threading.enumerate() if each.name == "voxdisplay a"]


def test_closing_ends_a_call_of_another_thread():
    keys = wall()
    keys["parts"][0]["port"] = "sim:?size=3x5x7&refresh=0.1"  # one swap in ten seconds
    shown = vd.open(display=keys)
    errors = []

    def present():
        try:
            for _ in range(3):
                shown.present(drawn(shown.frame()))
        except vd.VoxDisplayError as error:
            errors.append(error)

    thread = threading.Thread(target=present)
    thread.start()
    thread.join(0.5)
    shown.close(flush=False)
    thread.join(30)
    assert not thread.is_alive()
    assert isinstance(errors[0], vd.LocalProtocolError)


def test_the_stand_ins_have_all_that_displays_and_players_use():
    with vd.open(display=wall()) as shown:
        operations, connection = shown._operations, shown._connection
        stand_ins = {
            ("operations", "_operations"): operations,
            ("queue",): operations.queue,
            ("connection", "_connection"): connection,
        }
        assert missing_attributes(stand_ins) == set()

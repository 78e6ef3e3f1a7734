"""Displays that stand otherwise than their memory, and profiles on an open display."""

import itertools
import os
from dataclasses import replace

import numpy as np
import pytest
from memory_pipe import GRID, Pipe, assert_shows, random_frame
from recordings import Spin, write_recording

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from voxdisplay.display.device_info import check_serial
from voxdisplay.frame.output_transform import OutputTransform
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.orientation import Orientation

USER = Grid(3, 5, 7)
ALL = [
    ",".join(sign + axis for sign, axis in zip(signs, axes, strict=True))
    for axes in itertools.permutations("xyz")
    for signs in itertools.product(("", "-"), repeat=3)
]
FORMATS = ["mono1", "index8", "rgb565", "rgb888"]


def port_of(axes, format_="rgb888", size=USER, more=""):
    memory = Orientation.of(axes).memory_grid(size)
    return f"sim:?size={memory}&format={format_}&refresh=0{more}"


def draw(frame):
    """Draw what looks different from every side: a curve with a gradient, voxels, a solid."""
    frame.draw(vd.Segment((0.5, 0.5, 0.5), (2.5, 4.5, 6.5)), ["red", "blue"])
    frame.draw(vd.Box((0, 3, 0), (2, 5, 2), fill="solid"), "teal")
    frame.draw([[2, 0, 1], [2, 4, 6], [0, 0, 6]], "lime")
    return frame


@pytest.mark.parametrize("format_", FORMATS)
def test_every_orientation_shows_and_reads_what_an_upright_display_does(format_):
    with vd.open(port_of("x,y,z", format_)) as upright:
        frame = draw(upright.frame())
        assert upright.present(frame)
        wanted = upright.verify(frame)
        picture = frame._repr_png_()
    for axes in ALL:
        with vd.open(port_of(axes, format_), display={"axes": axes}) as display:
            assert display.info.grid == USER
            turned = draw(display.frame())
            receipt = display.present(turned)
            assert receipt.digest == turned.digest() == display.digest()
            np.testing.assert_array_equal(display.verify(turned), wanted)
            assert turned == frame
            # Its memory holds the same voxels, turned.
            memory = Orientation.of(axes).to_memory(wanted)
            np.testing.assert_array_equal(turned.memory.array(), memory)
            # An array that is set goes there, too, with what is drawn over it.
            turned.set(wanted[:, ::-1])
            turned.draw([[1, 0, 0]], "white")
            np.testing.assert_array_equal(
                turned.memory.array(), Orientation.of(axes).to_memory(turned.array())
            )
            display.present(turned)
            np.testing.assert_array_equal(display.verify(turned), turned.array())
            turned = draw(display.frame())
    assert turned._repr_png_() == picture


@pytest.mark.parametrize("axes", ["x,y,z", "-y,z,x", "x,-z,-y"])
def test_memory_holds_what_the_axes_say(axes):
    port = port_of(axes)
    with vd.open(port, display={"axes": axes}) as display:
        frame = display.frame()
        frame.draw([[0, 1, 0]], "white")
        display.present(frame)
        memory = frame.memory.array()
        np.testing.assert_array_equal(display.read(), frame.array())
    where = dict(zip("zyx", np.argwhere(memory.any(axis=-1))[0].tolist(), strict=True))
    for at, side, name in zip((0, 1, 0), USER, axes.split(","), strict=True):
        assert where[name[-1]] == (side - 1 - at if name.startswith("-") else at)


def test_frames_made_elsewhere_are_turned_as_well():
    axes = "z,-x,y"
    with vd.open(port_of(axes), display={"axes": axes}) as display:
        frame = draw(vd.Frame(USER))
        display.present(frame)
        np.testing.assert_array_equal(display.verify(frame), frame.array())
        display.present(frame, wait=False)
        display.flush()
        assert display.digest() == frame.with_output(display.frame().output).digest()
        assert frame.output is None
        assert display.clear().voxels == 0
        assert not display.read().any()


def test_what_is_on_display_is_kept_in_the_users_orientation():
    axes = "-z,x,y"
    port = port_of(axes)
    with vd.open(port, display={"axes": axes}) as display:
        display.present(draw(display.frame()))
        again = display.frame(keep=True)
        assert again == draw(vd.Frame(USER))
        again.draw([[1, 1, 1]], "white")  # sent as a difference
        assert display.present(again).wire_bytes < 60
        np.testing.assert_array_equal(display.verify(again), again.array())
        display._operations.queue.forget_displayed()
        assert display.frame(keep=True) == again  # read back


def test_dimmed_memory_is_no_picture_to_go_on_with():
    with vd.open(port_of("x,y,z"), display={"brightness": 0.5}) as display:
        frame = draw(display.frame())
        display.present(frame)
        assert display.frame(keep=True) == frame  # from memory of this process
        display._operations.queue.forget_displayed()
        with pytest.raises(vd.IncompatibleDevice, match="its memory holds dimmed light"):
            display.frame(keep=True)


def test_verify_compares_dimmed_light_and_reads_it():
    with vd.open(port_of("y,x,z"), display={"axes": "y,x,z", "brightness": 0.5}) as display:
        frame = draw(display.frame())
        page = display.verify(frame) if display.present(frame) else None
        np.testing.assert_array_equal(page, frame.readback())
        assert page.max() == 188
        other = frame.copy()
        other.draw([[2, 4, 0]], "white")
        with pytest.raises(vd.DesyncError, match=r"\(2, 4, 0\)"):
            display.verify(other)


def test_the_limit_is_noted_once_when_it_bites():
    notes = []
    limit = {"amps": 0.1, "ma_per_channel": 20}
    with vd.open(port_of("x,y,z"), display={"limit": limit}, note=notes.append) as display:
        frame = display.frame()
        frame.draw([[0, 0, 0]], "white")
        display.present(frame)
        assert notes == []
        for color in ("white", "yellow"):
            frame.draw(vd.Box((0, 0, 0), (3, 3, 3), fill="solid"), color)
            display.present(frame)
            display.verify(frame)
    assert len(notes) == 1
    assert "takes 1.62 A, the limit is 0.1 A: shown with 6.2" in notes[0]


def test_mirrors_and_brightness_without_effect_are_noted():
    notes = []
    keys = {"axes": "-x,y,z", "brightness": 0.5}
    vd.open(port_of("x,y,z", "mono1"), display=keys, note=notes.append).close()
    assert ["mirror" in notes[0], "mono1" in notes[1]] == [True, True]


def test_another_device_is_refused():
    message = r"this device has no serial number, the display's profile wants 'A1'"
    with pytest.raises(vd.IncompatibleDevice, match=message):
        vd.open("sim:?size=3x5x7", display={"serial": "A1"})


def test_a_serial_number_is_compared():
    with vd.open("sim:?size=3x5x7") as display:
        other = replace(display.info, serial="B2")
    check_serial(other, "B2")
    check_serial(other, None)
    with pytest.raises(vd.IncompatibleDevice, match=r"the serial number 'B2', .* wants 'A1'"):
        check_serial(other, "A1")


def test_moving_scenes_are_played_turned():
    scene = vd.read_scene(
        '{"size": [3, 5, 7], "duration": 0.1, "fps": 30, "objects": [{"type": "segment", '
        '"from": [0, 0, 0], "to": [2.5, 4.5, "1 + 50*time"], "color": ["red", "lime"]}]}'
    )
    axes = "-z,x,-y"
    with vd.open(port_of(axes), display={"axes": axes}) as display:
        report = display.play(scene, late="delay")
        assert (report.shown, report.wrong) == (3, 0)
        last = vd.Frame(USER)
        last.draw(scene.at_frame(2))
        np.testing.assert_array_equal(display.read(), last.array())


def test_recordings_are_coded_again_for_a_turned_display(tmp_path):
    file = tmp_path / "spin.vxs"
    show = Spin(3)
    write_recording(file, show)
    last = show.frame(2)
    axes = "y,-z,x"
    port = port_of(axes, last.format.value, last.grid)
    with vd.open(port, display={"axes": axes}) as display:
        report = display.play(vd.load_show(os.fspath(file)), late="delay", loop=False)
        assert (report.shown, report.wrong) == (3, 0)
        np.testing.assert_array_equal(display.read(), last.array())


def test_round_stays_round_on_voxels_that_are_no_cubes():
    scene = vd.read_scene(
        '{"size": [40, 40, 40], "objects": [{"type": "sphere", "center": [20, 20, 20], '
        '"radius": 19}]}'
    )
    with vd.open("sim:?size=40x40x40&refresh=0", display={"pitch_mm": [5, 5, 10]}) as display:
        frame = display.frame()
        frame.draw(scene)
        where = np.argwhere(frame.array().any(axis=-1))[:, ::-1]
        assert np.ptp(where, axis=0).tolist() == [37, 37, 19]
        frame.clear()
        frame.draw(scene, fit="none")
        assert np.ptp(np.argwhere(frame.array().any(axis=-1)), axis=0).tolist() == [37, 37, 37]
        frame.clear()
        frame.draw(scene, fit="content")
        assert np.ptp(np.argwhere(frame.array().any(axis=-1)), axis=0).tolist() == [19, 39, 39]


def test_pitch_is_that_of_the_users_axes():
    keys = {"axes": "x,z,y", "pitch_mm": [5, 5, 8]}
    with vd.open("sim:?size=3x7x5", display=keys) as display:
        assert display.info.grid == USER
        assert display.frame().pitch == (5, 5, 8)


def open_pipe(**keys):
    pipe = Pipe(serial="A1")
    display = vd.open(pipe, display=keys, timeout_s=2.0, clock=lambda: pipe.now)
    return display, pipe


def test_a_device_that_restarts_gets_its_picture_turned_again():
    display, pipe = open_pipe(serial="A1", axes="z,x,-y", brightness=0.5)
    frame = random_frame(display)
    display.present(frame)
    pipe.bench.power_cycle()
    display.present(frame)
    assert_shows(pipe, frame.memory)
    np.testing.assert_array_equal(display.verify(frame), frame.readback())


def test_another_device_that_comes_back_is_refused():
    display, pipe = open_pipe(serial="A1")
    display.clear()
    pipe.device = Device(
        Config(grid=GRID, pixel_format="rgb888", max_payload=128, rx_buffer=512, serial="B2")
    )
    with pytest.raises(vd.IncompatibleDevice, match=r"'B2', the display's profile wants 'A1'"):
        display.present(random_frame(display))
    assert pipe.closed == 1


def test_what_differs_is_said_in_the_users_coordinates():
    display, _ = open_pipe(axes="z,x,-y")
    frame = random_frame(display)
    display.present(frame)
    other = frame.copy()
    x, _, z = (side - 1 for side in display.info.grid)
    other.draw([[x, 0, z]], "white")
    with pytest.raises(vd.DesyncError, match=rf"\({x}, 0, {z}\)"):
        display.verify(other)


def test_what_was_shown_before_it_was_turned_is_not_kept():
    with vd.open(port_of("x,y,z")) as display:
        frame = draw(display.frame())
        display.present(frame)
        display.set_output(OutputTransform(Orientation.of("x,y,-z")))
        with pytest.raises(vd.IncompatibleDevice, match="before it was set how the display stands"):
            display.frame(keep=True)
        display.present(frame)
        assert display.frame(keep=True) == frame
        np.testing.assert_array_equal(display.verify(frame), frame.array())

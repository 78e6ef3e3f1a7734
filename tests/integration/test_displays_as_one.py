"""Several displays as one: four emulators in four processes, one of which goes away and is back."""

import threading
from itertools import product

import numpy as np
import pytest

import voxdisplay as vd

SIDE = 12
CORNERS = [(x, y, 0) for y, x in product((0, SIDE), repeat=2)]
AXES = ["x,y,z", "-x,-y,z", "y,-x,z", "z,x,y"]


class Wall:
    """Four emulators on ptys that keep their names, and the profile that makes them one."""

    def __init__(self, start, folder, *options, count=4):
        self.start, self.folder, self.options = start, folder, options
        self.emulators = [self.started(number) for number in range(count)]
        self.profile = {
            "parts": [
                {
                    "name": f"tile {number}",
                    "port": str(folder / f"tty{number}"),
                    "at": list(corner),
                    "size": [SIDE, SIDE, SIDE],
                    "axes": axes,
                }
                for number, (corner, axes) in enumerate(
                    list(zip(CORNERS, AXES, strict=True))[:count]
                )
            ]
        }

    def started(self, number):
        return self.start(
            "--pty", "--link", self.folder / f"tty{number}", "--size", f"{SIDE}x{SIDE}x{SIDE}",
            *self.options,
        )  # fmt: skip

    def kill(self, number):
        self.emulators[number].process.kill()
        self.emulators[number].process.wait()
        (self.folder / f"tty{number}").unlink(missing_ok=True)

    def restart(self, number):
        self.emulators[number] = self.started(number)


@pytest.fixture
def wall(emulator, tmp_path):
    return lambda *options, **settings: Wall(emulator, tmp_path, *options, **settings)


def noise(frame, seed=1):
    """Draw a picture that takes many bytes."""
    frame.set(np.random.default_rng(seed).integers(0, 256, frame.array().shape, dtype=np.uint8))
    return frame


def test_one_scene_is_cut_shown_together_and_read_back(wall):
    tiles = wall("--baud", "115200")
    with vd.open(display=tiles.profile) as display:
        assert display.info.grid == (2 * SIDE, 2 * SIDE, SIDE)
        frame = noise(display.frame())
        receipt = display.present(frame)
        assert receipt.digest == frame.digest() == display.digest()
        assert [part.receipt.digest for part in receipt.parts].count(None) == 0
        assert np.array_equal(display.read(), frame.array())
        assert np.array_equal(display.verify(frame), frame.array())
        # No part swaps before all hold the frame: those that get little wait for the one that gets
        # most, though without waiting they would be done in a tenth of the time.
        pixels = np.zeros_like(frame.array())
        pixels[:, :SIDE, :SIDE] = noise(display.frame(), 2).array()[:, :SIDE, :SIDE]
        pixels[0, SIDE:, :] = 255
        last = display.frame()
        last.set(pixels)
        heavy, *light = [part.receipt for part in display.present(last).parts]
        assert heavy.wire_bytes > 10 * max(each.wire_bytes for each in light)
        assert min(each.elapsed_s for each in light) > 0.5 * heavy.elapsed_s
    # Each of them holds its own share, turned as it stands.
    for number, (x, y, _) in enumerate(CORNERS):
        share = last.array()[:, y : y + SIDE, x : x + SIDE]
        part = tiles.profile["parts"][number]
        with vd.open(part["port"], display={"axes": part["axes"]}) as alone:
            assert np.array_equal(alone.read(), share)


def test_one_that_is_killed_in_mid_frame_stops_no_other_and_comes_back(wall):
    tiles = wall("--baud", "57600")
    notes, steps = [], []
    with vd.open(display=tiles.profile, reconnect_s=60, note=notes.append) as display:
        frame = noise(display.frame())

        def progress(done, total):
            steps.append(done)
            if done > total / 4 and not killed.is_set():
                killed.set()
                tiles.kill(2)
                tiles.restart(2)  # other threads go on meanwhile

        killed = threading.Event()
        receipt = display.present(frame, progress=progress)
        assert killed.is_set()
        assert receipt.digest == frame.digest()
        assert [part.reconnects for part in display.parts] == [0, 0, 1, 0]
        assert np.array_equal(display.read(), frame.array())
    assert [note for note in notes if note.startswith("tile 2: ") and "is back after" in note]


def test_one_that_stays_away_is_named_and_nothing_is_called_proved(wall):
    tiles = wall("--baud", "115200", count=2)
    notes = []
    with vd.open(display=tiles.profile, note=notes.append) as display:
        frame = noise(display.frame())

        def progress(done, total):
            if done > total / 4:
                tiles.kill(1)

        receipt = display.present(frame, progress=progress)
        assert receipt.digest is None
        assert receipt.lost == ("tile 1",)
        assert [part.state for part in display.parts] == ["open", "lost"]
        assert display.frame().grid == frame.grid
        with pytest.raises(vd.TransportError, match=r"tile 1 .* is lost"):
            display.verify(frame)
        # And the next frame goes to those that are left.
        again = display.present(noise(display.frame(), 2))
        assert [part.receipt is None for part in again.parts] == [False, True]
        assert again.digest is None
    assert len([note for note in notes if "tile 1 is lost" in note]) == 1
    with vd.open(str(tiles.folder / "tty0")) as alone:
        assert alone.read().any()


def test_a_loop_goes_on_while_one_is_away_and_takes_it_back(wall):
    tiles = wall(count=2)
    notes = []
    with vd.open(display=tiles.profile, reconnect_s=60, note=notes.append) as display:
        shown = []

        def loop(count):
            for number in range(count):
                frame = display.frame()
                frame.draw(vd.Segment((0, 0, number % SIDE), (23.9, 11.9, number % SIDE)))
                display.present(frame, wait=False)
                display.wait_until(display._clock() + 0.03)
                shown.append(display.playback.shown)
            return frame

        loop(5)
        tiles.kill(1)
        loop(10)
        assert display.parts[1].state == "away"
        assert shown[-1] > shown[4] + 3
        tiles.restart(1)
        while display.parts[1].state == "away":
            loop(5)
        last = loop(5)
        display.flush()
        assert np.array_equal(display.read(), last.array())
    assert any("tile 1: " in note and "is back after" in note for note in notes)

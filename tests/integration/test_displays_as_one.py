"""Several displays as one: four emulators in four processes, one of which goes away and is back."""

import json
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

    def __init__(self, start, folder, *options):
        self.start, self.folder, self.options = start, folder, options
        self.emulators = [self.started(number) for number in range(4)]
        self.profile = {
            "parts": [
                {
                    "name": f"tile {number}",
                    "port": str(folder / f"tty{number}"),
                    "at": list(corner),
                    "size": [SIDE, SIDE, SIDE],
                    "axes": axes,
                }
                for number, (corner, axes) in enumerate(zip(CORNERS, AXES, strict=True))
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
    return lambda *options: Wall(emulator, tmp_path, *options)


def noise(frame, seed=1):
    """Draw a picture that takes many bytes."""
    frame.set(np.random.default_rng(seed).integers(0, 256, frame.array().shape, dtype=np.uint8))
    return frame


def test_one_scene_is_cut_shown_together_and_read_back(wall):
    tiles = wall()
    with vd.open(display=tiles.profile) as display:
        assert display.info.grid == (2 * SIDE, 2 * SIDE, SIDE)
        frame = noise(display.frame())
        receipt = display.present(frame)
        assert receipt.digest == frame.digest() == display.digest()
        assert [part.receipt.digest for part in receipt.parts].count(None) == 0
        assert np.array_equal(display.read(), frame.array())
        assert np.array_equal(display.verify(frame), frame.array())
    # Each of them holds its own share, turned as it stands.
    for number, (x, y, _) in enumerate(CORNERS):
        share = frame.array()[:, y : y + SIDE, x : x + SIDE]
        part = tiles.profile["parts"][number]
        with vd.open(part["port"], display={"axes": part["axes"]}) as alone:
            assert np.array_equal(alone.read(), share)


def test_no_part_swaps_before_all_hold_the_frame(wall):
    tiles = wall("--baud", "57600")
    with vd.open(display=tiles.profile) as display:
        # One part gets far more than the others, which wait for it.
        frame = display.frame()
        pixels = frame.array()
        pixels[:, :SIDE, :SIDE] = noise(vd.Frame((SIDE, SIDE, SIDE))).array()
        pixels[0, SIDE:, :] = 255
        frame.set(pixels)
        receipt = display.present(frame)
        heavy, *light = [part.receipt for part in receipt.parts]
        assert heavy.wire_bytes > 10 * max(each.wire_bytes for each in light)
        # Without waiting, they would have been done in a tenth of the time.
        assert min(each.elapsed_s for each in light) > 0.5 * heavy.elapsed_s


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
        # The others did not wait for it.
        times = [part.receipt.elapsed_s for part in receipt.parts]
        assert max(times[:2] + times[3:]) < times[2]
    assert [note for note in notes if note.startswith("tile 2: ") and "is back after" in note]


def test_one_that_stays_away_is_named_and_nothing_is_called_proved(wall):
    tiles = wall("--baud", "57600")
    notes = []
    with vd.open(display=tiles.profile, note=notes.append) as display:
        frame = noise(display.frame())

        def progress(done, total):
            if done > total / 4:
                tiles.kill(1)

        receipt = display.present(frame, progress=progress)
        assert receipt.digest is None
        assert receipt.lost == ("tile 1",)
        assert [part.state for part in display.parts] == ["open", "lost", "open", "open"]
        assert display.frame().grid == frame.grid
        with pytest.raises(vd.TransportError, match="tile 1 .* is lost"):
            display.verify(frame)
        # And the next frame goes to those that are left.
        again = display.present(noise(display.frame(), 2))
        assert [part.receipt is None for part in again.parts] == [False, True, False, False]
        assert again.digest is None
    assert len([note for note in notes if "tile 1 is lost" in note]) == 1
    for number in (0, 2, 3):
        with vd.open(str(tiles.folder / f"tty{number}")) as alone:
            assert alone.read().any()


def test_a_loop_goes_on_while_one_is_away_and_takes_it_back(wall):
    tiles = wall()
    notes = []
    with vd.open(display=tiles.profile, reconnect_s=60, note=notes.append) as display:
        shown = []

        def loop(count):
            for number in range(count):
                frame = display.frame()
                frame.draw(vd.Segment((0, 0, number % SIDE), (23.9, 23.9, number % SIDE)))
                display.present(frame, wait=False)
                display.wait_until(display._clock() + 0.03)
                shown.append(display.playback.shown)
            return frame

        loop(5)
        tiles.kill(3)
        loop(20)
        assert display.parts[3].state == "away"
        while_away = shown[-1]
        assert while_away > 15
        tiles.restart(3)
        while display.parts[3].state == "away":
            loop(5)
        last = loop(5)
        display.flush()
        assert np.array_equal(display.read(), last.array())
    assert any("tile 3: " in note and "is back after" in note for note in notes)


def test_commands_on_a_display_of_four(wall, run, tmp_path):
    tiles = wall()
    lines = []
    for part in tiles.profile["parts"]:
        lines += ["[[parts]]", *(f"{key} = {json.dumps(value)}" for key, value in part.items())]
    profile = tmp_path / "wall.toml"
    profile.write_text("\n".join(lines))
    scene = tmp_path / "spin.json"
    scene.write_text(
        '{"size": [24, 24, 12], "duration": 0.5, "fps": 20, "objects": [{"type": "sphere", '
        '"center": [12, "12 + time", 6], "radius": 5, "color": "teal"}]}'
    )
    pushed = run("push", scene, "--display", profile, "--verify", "--json")
    assert pushed.returncode == 0, pushed.stderr
    told = json.loads(pushed.stdout)
    assert told["verified"]
    assert told["device"]["size"] == [24, 24, 12]
    assert [part["shown"] for part in told["parts"]] == [True] * 4
    assert told["wire_bytes"] == sum(part["wire_bytes"] for part in told["parts"])
    played = run("play", scene, "--display", profile, "--json")
    assert played.returncode == 0, played.stderr
    told = json.loads(played.stdout)
    assert told["wrong"] == 0
    assert told["shown"] > 0
    assert [part["state"] for part in told["parts"]] == ["open"] * 4
    assert run("test-pattern", "--check", "--display", profile).returncode == 0
    read = run("read", "-o", tmp_path / "page.npy", "--display", profile, "--json")
    assert len(json.loads(read.stdout)["parts"]) == 4
    assert np.load(tmp_path / "page.npy").shape == (12, 24, 24, 3)
    tiles.kill(0)
    failed = run("clear", "--display", profile)
    assert failed.returncode == 3
    assert "tile 0" in failed.stderr

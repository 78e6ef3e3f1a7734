"""Playing on real ptys: a process that prepares frames, the command, its keys, and how it ends."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from carriers import eventually
from conftest import DEADLINE_S, ROOT
from slow_shows import SlowShow

import voxdisplay as vd

SPIN = {
    "size": [16, 16, 16], "duration": 2, "fps": 30, "params": {"a": "tau*time/duration"},
    "objects": [{"type": "segment", "from": [8, 8, 2], "to": ["8 + 6*cos(a)", "8 + 6*sin(a)", 12]}],
}  # fmt: skip


def processes_of(log):
    """Processes that have drawn a frame, in the order in which they began."""
    lines = log.read_text(encoding="utf-8").split("\n") if log.exists() else []
    return list(dict.fromkeys(int(line.split()[0]) for line in lines if line))


def is_running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.fixture
def display(emulator):
    with vd.open(emulator("--pty", "--size", "16x16x16", "--refresh", 60).port) as display:
        yield display


@pytest.mark.parametrize("clock", ["device", "host"])
def test_slow_frames_are_prepared_by_another_process_which_ends(display, tmp_path, clock):
    log = tmp_path / "log"
    show = SlowShow(log=log)

    def until_worker(player):
        if len(processes_of(log)) > 1 and player.shown > 30:
            player.stop()

    report = display.play(show, clock=clock, loop=True, observer=until_worker)
    me, worker = processes_of(log)
    assert me == os.getpid()
    assert report.wrong == 0
    assert report.shown > 30
    assert not is_running(worker)


def test_an_error_in_that_process_reaches_the_caller_and_it_ends(display, tmp_path):
    log = tmp_path / "log"
    show = SlowShow(1000, fails_at=500, log=log)

    skipped = []

    def skip(player):
        if len(processes_of(log)) > 1 and not skipped:
            skipped.append(player.shown)
            player.seek(499 / 30 - player.position_s)

    with pytest.raises(vd.CurveError, match="this frame fails"):
        display.play(show, observer=skip)
    assert [is_running(pid) for pid in processes_of(log)] == [True, False]
    frame = display.frame()
    assert display.present(frame).digest == frame.digest()


def test_when_that_process_is_killed_the_player_goes_on_itself(display, tmp_path):
    log = tmp_path / "log"
    killed = []

    def kill(player):
        pids = processes_of(log)
        if len(pids) > 1 and not killed:
            os.kill(pids[1], signal.SIGKILL)
            killed.append(player.shown)
        lines = log.read_text(encoding="utf-8").split("\n") if killed else []
        if killed and lines[-2].split()[0] == str(os.getpid()) and player.shown > killed[0] + 5:
            player.stop()

    report = display.play(SlowShow(log=log), loop=True, observer=kill)
    assert killed
    assert report.wrong == 0


def test_a_show_that_cannot_be_sent_is_prepared_by_the_player(display):
    show = SlowShow(20, work_s=0.01)
    show.key = lambda: 0  # does not pickle
    report = display.play(show)
    assert report.shown + report.dropped == 20


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux")
def test_that_process_ends_when_the_player_is_killed(emulator, tmp_path):
    port, log = emulator("--pty", "--size", "16x16x16").port, tmp_path / "log"
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT / 'tests')!r})\n"
        "import slow_shows, voxdisplay as vd\n"
        f"vd.open({port!r}).play(slow_shows.SlowShow(log={str(log)!r}), loop=True)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code]) as player:
        eventually(lambda: len(processes_of(log)) == 2, "a process beside the player")
        player.kill()
    worker = processes_of(log)[1]

    def has_ended():
        try:
            return Path(f"/proc/{worker}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        except (FileNotFoundError, ProcessLookupError):
            return True

    eventually(has_ended, "the end of the process beside it")


# -- the command


def start_play(port, *arguments):
    command = [sys.executable, "-m", "voxdisplay", "play", *map(str, arguments), "--port", port]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    )


def test_a_moving_scene_is_played_and_its_last_frame_stays(emulator, run, scene, tmp_path):
    dump = tmp_path / "front.npy"
    port = emulator("--pty", "--size", "16x16x16", "--refresh", 60, "--dump", dump).port
    path = scene(SPIN)
    done = run("play", path, "--port", port, "--json", "--clock", "host")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert set(report) == {
        "frames", "shown", "dropped", "fps", "late_ms", "gap_ms", "ticks", "wrong", "repaired",
        "wire_bytes", "seconds",
    }  # fmt: skip
    assert set(report["late_ms"]) == {"p50", "p95", "max"}
    assert set(report["gap_ms"]) == {"p5", "p50", "p95", "max"}
    assert report["frames"] == 60 == report["shown"] + report["dropped"]
    assert report["wrong"] == 0
    frame = vd.Frame((16, 16, 16))
    show = vd.load_show(path).show_on(frame)
    eventually(lambda: np.array_equal(np.load(dump), show.frame(59).array()), "the last frame")
    said = run("play", path, "--port", port, "--speed", "4", "--from", "1", "--until", "1.5")
    assert "of 15 shown in" in said.stdout


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_ends_it_and_the_process_beside_it(emulator, scene, tmp_path, name):
    dump = tmp_path / "front.npy"
    port = emulator("--pty", "--size", "16x16x16", "--dump", dump).port
    with start_play(port, scene(SPIN), "--loop", "--on-exit", "blank") as play:
        eventually(lambda: dump.exists() and np.load(dump).any(), "a frame")
        play.send_signal(getattr(signal, name))
        _, text = play.communicate(timeout=DEADLINE_S)
    assert "the display is dark" in text
    assert "Traceback" not in text
    assert play.returncode == {"SIGINT": 130, "SIGTERM": 143}[name]
    eventually(lambda: not np.load(dump).any(), "darkness")


def test_a_display_that_is_unplugged_is_an_error_without_reconnect(emulator, scene):
    device = emulator("--pty", "--size", "16x16x16")
    with start_play(device.port, scene(SPIN), "--loop") as play:
        time.sleep(1)
        device.process.kill()
        _, text = play.communicate(timeout=DEADLINE_S)
    assert play.returncode == 3
    assert "Traceback" not in text


def test_a_display_that_comes_back_goes_on(plug, scene):
    path = scene(SPIN)
    plug.plug(grid=(16, 16, 16), pixel_format="rgb888")
    arguments = (path, "--loop", "--reconnect", DEADLINE_S, "--json")
    with start_play(str(plug.path), *arguments) as play:
        eventually(lambda: plug.device.swaps > 3, "frames")
        plug.unplug()
        before = plug.device.swaps
        plug.plug()
        eventually(lambda: plug.device.swaps > before + 10, "more frames")
        play.send_signal(signal.SIGINT)
        _, text = play.communicate(timeout=DEADLINE_S)
    assert "is back" in text


class Numbered:
    """A show whose frames tell their numbers."""

    fps, loop, frame_count = 30.0, False, 17 * 9 * 5 - 1

    @property
    def duration(self):
        return self.frame_count / self.fps

    def frame(self, number):
        frame = vd.Frame((17, 9, 5), "index8")
        index = number + 1
        frame.draw([(index % 17, index // 17 % 9, index // 153)], "white")
        return frame


def number_shown(plug):
    (index,) = np.flatnonzero(np.frombuffer(bytes(plug.snapshot().pixels), np.uint8))
    return int(index) - 1


@pytest.mark.parametrize("refresh", [0, 60_000])
def test_a_display_that_comes_back_goes_on_at_the_right_time(plug, refresh):
    """Bounds follow from the order of what happens: no time is assumed."""
    plug.plug(refresh=refresh)
    back_s, first_s, shown = [], [], []

    def plug_in():
        back_s.append(time.monotonic())
        plug.plug()

    timer = threading.Timer(0.5, plug_in)

    def observe(player):
        if not first_s:
            first_s.append(time.monotonic())
        elif not shown and player.shown > 5:
            plug.unplug()
            shown.append(player.shown)
            timer.start()
        elif back_s and player.shown > shown[0] + 5:
            number = number_shown(plug)
            latest = (time.monotonic() - before_s) * 30
            assert (back_s[0] - first_s[0]) * 30 - 1 <= number <= latest
            player.stop()

    with vd.open(str(plug.path), reconnect_s=DEADLINE_S) as display:
        before_s = time.monotonic()
        report = display.play(Numbered(), observer=observe)
    timer.join()
    assert back_s, "it was away"
    assert report.frames == report.shown + report.dropped
    assert report.wrong == 0


def test_a_player_that_seeks_with_every_turn_shows_what_is_there(emulator, tmp_path):
    """An arrow that is held down, where another process prepares the frames; then a pause."""
    log, frames = tmp_path / "log", 3000
    port = emulator("--pty", "--size", "16x16x16", "--refresh", 60).port
    show = SlowShow(frames, log=log)
    seeks, paused = [], []

    def observe(player):
        if len(processes_of(log)) < 2:
            return
        if len(seeks) < 150:
            player.seek(0.4)
            seeks.append(player.shown)
        elif not paused:
            player.pause()
            paused.append((player.position_s, player.shown))
        elif player.paused and player.shown > paused[0][1]:
            assert player.position_s == paused[0][0]
            player.pause()
        elif not player.paused and player.shown > paused[0][1] + 5:
            assert player.position_s > paused[0][0] >= 0.4 * 150
            player.stop()

    with vd.open(port) as display:
        report = display.play(show, observer=observe)
        assert report.wrong == 0
        final = display.read()
    drawn = {int(line.split()[1]) for line in log.read_text(encoding="utf-8").splitlines() if line}
    assert any(np.array_equal(final, show.frame(n).array()) for n in drawn if n > 0.4 * 150 * 30)


# -- keys


def test_keys_pause_seek_and_leave(emulator, scene):
    terminal = pytest.importorskip("terminal")
    port = emulator("--pty", "--size", "16x16x16").port
    screen = terminal.Terminal(["play", scene(SPIN), "--loop", "--port", port])
    screen.read_until(lambda text: "30 fps asked" in text and "shown" in text)
    screen.press(" ")
    screen.read_until(lambda text: "paused" in text)
    screen.press("\x1b[C")
    screen.press(" ")
    screen.read_until(lambda text: "shown" in text)
    screen.press("q")
    screen.read_until(lambda text: "shown in" in text)
    assert screen.process.wait(DEADLINE_S) == 0
    screen.close()


# -- loops of one's own


@pytest.mark.parametrize("baud", [115_200, 12_000_000])
def test_a_plain_loop_that_sleeps_accounts_for_every_frame(emulator, baud):
    port = emulator("--pty", "--size", "16x16x16", "--refresh", 60, "--baud", baud).port
    with vd.open(port) as display:
        for number in range(30):
            frame = display.frame()
            frame.draw([(number % 16, 1, 2)])
            display.present(frame, wait=False)
            time.sleep(1 / 30)
        display.flush(DEADLINE_S)
        counts = display.playback
        assert counts.presented == 30 == counts.shown + counts.dropped
        assert counts.shown > 15, "a stalled loop shows six a second"
        display.verify(frame)


def test_ctrl_c_ends_a_loop_at_once(emulator):
    port = emulator("--pty", "--size", "16x16x16").port
    code = (
        "import voxdisplay as vd\n"
        f"with vd.open({port!r}) as display:\n"
        "    for time in display.clock(fps=0.001):\n"
        "        print('waiting', flush=True)\n"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as loop:
        assert loop.stdout.readline() == "waiting\n"
        loop.send_signal(signal.SIGINT)
        _, text = loop.communicate(timeout=DEADLINE_S)
    assert text.rstrip().endswith("KeyboardInterrupt")


# -- what is wrong with the command line


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["gone.json"], "no such file"),
        (["{scene}", "--from", "9"], "the show ends at 2 s"),
        (["{scene}", "--until", "0"], "until"),
        (["{scene}", "--speed", "0"], "out of range"),
        (["{scene}", "--clock", "sun"], "--clock"),
        (["{scene}", "gone.json"], "no such file"),
        ([], "SHOW..."),
    ],
)
def test_bad_arguments_are_named(run, scene, arguments, message):
    path = scene(SPIN)
    done = run("play", *[each.format(scene=path) for each in arguments], "--port", "sim:")
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_shows_are_played_in_turn_and_what_is_missing_is_named(run, scene):
    still = scene({"type": "segment", "from": [1, 1, 1], "to": [9, 9, 9]}, "still.json")
    playlist = scene({"playlist": [{"show": "still.json", "until": 0.1}, "gone.json"]}, "list.json")
    done = run("play", still, playlist, "--port", "sim:?size=16x16x16", "--json")
    assert done.returncode == 0, done.stderr
    assert "left out of the playlist" in done.stderr
    assert json.loads(done.stdout)["shown"] == 2

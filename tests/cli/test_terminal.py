"""Terminal view and thumbnail on a pseudo-terminal, whose modes are restored in the end."""

import os
import re
import signal

import pytest
from terminal import Terminal

from voxdisplay.cli.thumbnail import _room

HALF = "\N{UPPER HALF BLOCK}"
ENTER, LEAVE, SHOWN = "\x1b[?1049h", "\x1b[?25h\x1b[?1049l", "\x1b[?2026l"
SMALL = "sim:?size=24x16x12"
TREFOIL = "examples/trefoil.json"
WITHOUT_PILLOW = """
import sys
sys.modules["PIL"] = None
from voxdisplay.cli import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture
def terminal():
    opened = []

    def start(*arguments, **how):
        opened.append(Terminal(arguments, **how))
        return opened[-1]

    yield start
    for each in opened:
        each.close()


def drawn(came):
    return SHOWN in came


def plain(text):
    """Return the text without escape sequences."""
    return re.sub(r"\x1b\[[?\d;]*[A-Za-z]", "", text)


def test_keys_turn_and_zoom_and_end_it(terminal):
    view = terminal("view", "--terminal", "examples/house.json")
    pictures = [view.read_until(drawn)]
    assert ENTER in pictures[0]
    assert HALF in pictures[0]
    assert "house.json" in plain(pictures[0])
    for key in ("\x1b[C", "\x1bOA", "+", "-", "l", "0"):
        view.press(key)
        pictures.append(view.read_until(drawn))
    bodies = [picture[picture.index("\x1b[H") :] for picture in pictures]
    assert bodies[3] != bodies[4], "+ and - differ"
    assert len(set(bodies)) == 5
    assert bodies[2] == bodies[4], "zooming in and out again"
    assert bodies[0] == bodies[6], "as at first"
    view.press("xyzq")
    code, text = view.finish()
    assert code == 0
    assert text.endswith(LEAVE)
    assert view.modes_restored


def test_it_spins_and_follows_the_window(terminal):
    view = terminal("view", "--terminal", TREFOIL)
    first = view.read_until(drawn)
    view.press(" ")
    view.read_until(lambda came: came.count(SHOWN) >= 3)
    view.press(" ")
    view.resize(12, 30)
    came = view.read_until(lambda came: drawn(came.split("\x1b[?2026h")[-1]) and came.count("\n"))
    view.press("q")
    assert view.finish()[0] == 0
    last = view.text.split("\x1b[?2026h")[-1].split(SHOWN)[0]
    assert last.count("\r\n") == 11
    assert first.count("\r\n") == 19
    assert came


@pytest.mark.parametrize("how", ["ctrl-c", "sigint", "sigterm", "sighup"])
def test_however_it_is_ended_the_terminal_is_restored(terminal, how):
    view = terminal("view", "--terminal", TREFOIL)
    view.read_until(drawn)
    if how == "ctrl-c":
        view.press("\x03")
    else:
        os.kill(view.process.pid, getattr(signal, how.upper()))
    code, text = view.finish()
    assert code == 130
    assert LEAVE in text
    assert text.index(LEAVE) < text.index("interrupted"), "messages are printed on the old screen"
    assert view.modes_restored


def test_a_display_that_goes_away(terminal, emulator):
    running = emulator("--tcp", "127.0.0.1:0", "--size", "24x16x12")
    view = terminal("view", "--terminal", "--port", running.port, "--timeout", "1")
    view.read_until(drawn)
    running.stop()
    code, text = view.finish()
    assert code == 3
    assert "Traceback" not in text
    assert view.modes_restored
    assert text.index(LEAVE) < text.rindex("voxdisplay:")


def test_it_shows_what_the_display_shows_and_follows_it(terminal, emulator, run):
    running = emulator("--pty", "--size", "24x16x12", "--format", "mono1")
    assert run("push", TREFOIL, "--port", running.port).returncode == 0
    view = terminal("view", "--terminal", "--port", running.port)
    (voxels,) = re.findall(r" (\d+) voxels", plain(view.read_until(drawn)))
    assert int(voxels) > 20
    view.press("q")
    assert view.finish()[0] == 0


def test_a_scene_that_moves_is_played(terminal):
    view = terminal("view", "--terminal", "examples/growing-helix.json")
    view.read_until(lambda came: len(set(re.findall(r" (\d+) voxels", plain(came)))) >= 3)
    view.press("q")
    assert view.finish()[0] == 0


def test_a_scene_from_a_pipe_leaves_the_keyboard_to_the_terminal(terminal):
    ours, theirs = os.pipe()
    view = terminal("view", "--terminal", "-", stdin=ours)
    os.close(ours)
    os.write(theirs, b'{"type": "segment", "from": [1, 1, 1], "to": [9, 9, 9]}')
    os.close(theirs)
    view.read_until(drawn)
    view.press("q")
    assert view.finish()[0] == 0
    assert view.modes_restored


def test_without_a_terminal_it_is_an_error(run):
    done = run("view", "--terminal", TREFOIL)
    assert done.returncode == 2
    assert "no terminal" in done.stderr
    assert done.stdout == ""


def test_256_colours_unless_the_terminal_says_more(terminal):
    view = terminal("view", "--terminal", TREFOIL, COLORTERM="")
    came = view.read_until(drawn)
    assert "\x1b[48;5;" in came
    assert ";2;" not in came
    view.press("q")
    view.finish()


def test_push_ends_with_a_picture_of_what_was_read_back(terminal):
    code, text = terminal("push", TREFOIL, "--port", SMALL).finish()
    assert code == 0
    assert text.index("proved") < text.index(HALF)
    assert "read back from the display" in text
    assert max(len(line) for line in plain(text).splitlines() if HALF in line) <= 59


def test_a_picture_on_a_line_whose_rate_was_asked_for(terminal):
    for command in (["test-pattern"], ["push", TREFOIL]):
        code, text = terminal(*command, "--port", SMALL, "--baud", "auto").finish()
        assert code == 0, text
        assert HALF in text


@pytest.mark.parametrize(
    ("size", "picture"),
    [((40, 110), (34, 85)), ((20, 60), (14, 35)), ((30, 24), (11, 23)), ((90, 400), (44, 110))],
)
def test_the_picture_uses_the_room_that_is_there(size, picture):
    rows, columns = size
    assert _room(os.terminal_size((columns, rows))) == picture[::-1]


@pytest.mark.parametrize("size", [(11, 80), (40, 12)])
def test_a_terminal_that_is_too_small_gets_no_picture(size):
    assert _room(os.terminal_size(size[::-1])) is None


@pytest.mark.parametrize(
    ("more", "how"),
    [
        (["--quiet"], {}),
        (["--json"], {}),
        ([], {"NO_COLOR": "1"}),
        ([], {"TERM": "dumb"}),
        ([], {"code": WITHOUT_PILLOW}),
    ],
)
def test_where_push_draws_nothing(terminal, more, how):
    code, text = terminal("push", TREFOIL, "--port", SMALL, *more, **how).finish()
    assert code == 0
    assert "proved" in text or '"digest"' in text
    assert HALF not in text
    assert "Pillow" not in text


def test_what_is_not_read_back_is_not_said_to_be(terminal):
    # A dense scene at 115200 baud: reading it back would take longer than anybody waits.
    code, text = terminal("push", "examples/sphere.json", "--port", "sim:").finish()
    assert code == 0
    assert HALF in text
    assert "what was sent, not read back" in text

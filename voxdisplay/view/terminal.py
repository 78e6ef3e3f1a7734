"""Interactive view in a terminal, turned by keys; it works over ssh.

Redraws on changes only, and restores the terminal however it ends. Needs a Unix terminal. Knows no
source of pages.
"""

from __future__ import annotations

import contextlib
import os
import re
import selectors
import signal
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn

from voxdisplay.printable_text import printable
from voxdisplay.raster.grid import Grid
from voxdisplay.view.camera import Camera
from voxdisplay.view.half_blocks import CAMERA, half_blocks, has_true_color
from voxdisplay.view.lit_voxels import LitVoxels

# Longest wait for a key: for a changed window size to be seen, and between steps of spinning.
_IDLE_WAIT_S, _SPIN_WAIT_S = 0.25, 0.05
_KEY_STEP, _SPIN_STEP, _KEY_ZOOM = 0.1, 0.03, 1.1
_READ_INTERVAL_FACTOR = 5.0  # reading takes a fifth of the time at most

# Takes descriptors above 1023, unlike select, and waits on /dev/tty, unlike epoll and kqueue.
_SELECTOR = getattr(selectors, "PollSelector", selectors.SelectSelector)

_ENTER_SCREEN = "\x1b[?1049h\x1b[?25l\x1b[2J"
_LEAVE_SCREEN = "\x1b[0m\x1b[?25h\x1b[?1049l"
# Synchronized update: terminals that know it show what is between the two at once.
_BEGIN_UPDATE, _END_UPDATE = "\x1b[?2026h\x1b[H", "\x1b[?2026l"
_KEY = re.compile(rb"\x1b[\[O][A-D]|[^\x1b]")
_CAMERA_KEYS: dict[bytes, Callable[[Camera], Camera]] = {
    **dict.fromkeys((b"D", b"h"), lambda camera: camera.turned(-_KEY_STEP)),
    **dict.fromkeys((b"C", b"l"), lambda camera: camera.turned(_KEY_STEP)),
    **dict.fromkeys((b"A", b"k"), lambda camera: camera.turned(0, _KEY_STEP)),
    **dict.fromkeys((b"B", b"j"), lambda camera: camera.turned(0, -_KEY_STEP)),
    **dict.fromkeys((b"+", b"="), lambda camera: camera.zoomed(_KEY_ZOOM)),
    **dict.fromkeys((b"-", b"_"), lambda camera: camera.zoomed(1 / _KEY_ZOOM)),
    b"0": lambda _: CAMERA,
}
_QUIT_KEYS = (b"q", b"\x03", b"\x04")
_HELP = "arrows turn  + - zoom  space spins  0 resets  q quits"


@dataclass
class TerminalView:
    """State of the view: voxels, camera and keys.

    Attributes
    ----------
    grid : Grid
    title : str
        Shown first in the status line.
    read : callable
        Returns the lit voxels.
    changes : bool
        True to read again from time to time.
    read_interval_s : float
        How often, at most.
    remark : str
        Shown in the place of the status line, until it is empty.

    """

    grid: Grid
    title: str
    read: Callable[[], LitVoxels]
    changes: bool
    read_interval_s: float = 1.0
    camera: Camera = CAMERA
    spins: bool = False
    done: bool = False
    remark: str = ""
    _lit: LitVoxels = field(init=False)
    _next_read_s: float = 0.0

    def __post_init__(self) -> None:
        self.read_page()

    @property
    def lit(self) -> LitVoxels:
        """The voxels that are shown."""
        return self._lit

    def read_page(self) -> None:
        """Read the voxels, and schedule the next reading."""
        began_s = time.monotonic()
        self._lit = self.read()
        took_s = time.monotonic() - began_s
        self._next_read_s = time.monotonic() + max(
            self.read_interval_s, _READ_INTERVAL_FACTOR * took_s
        )

    @property
    def read_due(self) -> bool:
        """True if it is time to read again."""
        return self.changes and time.monotonic() >= self._next_read_s

    @property
    def read_wait_s(self) -> float:
        """Seconds until it is time to read again."""
        return max(0.0, self._next_read_s - time.monotonic())

    def handle_keys(self, keys: bytes) -> None:
        """Apply the keys in some input; other bytes do nothing."""
        for found in _KEY.findall(keys):
            key = found[-1:] if len(found) > 1 else found.lower()
            if key in _CAMERA_KEYS:
                self.camera = _CAMERA_KEYS[key](self.camera)
            elif key == b" ":
                self.spins = not self.spins
            elif key in _QUIT_KEYS:
                self.done = True

    def lines(self, columns: int, rows: int, *, full: bool) -> list[str]:
        """Return the picture as lines of text, the last one a status line with the keys."""
        picture = half_blocks(
            self._lit, self.grid, columns, max(1, rows - 1), camera=self.camera, full=full
        )
        words = f" {printable(self.title)}  {len(self._lit.positions)} voxels  {_HELP}"
        if self.remark:
            words = f" {printable(self.remark)}"
        return [*picture, words[: columns - 1]] if rows > 1 else picture


def run(view: TerminalView) -> None:
    """Show a view until the user quits.

    Raises
    ------
    ValueError
        If there is no terminal, or its encoding is not UTF-8.
    KeyboardInterrupt
        On Ctrl-C, SIGTERM and SIGHUP; the terminal has been restored.

    """
    if not sys.stdout.isatty():
        raise ValueError("standard output is no terminal")
    if "utf" not in (sys.stdout.encoding or "").lower():
        raise ValueError(f"the terminal's encoding is {sys.stdout.encoding}, not UTF-8")
    with _cbreak_keyboard() as keyboard, _alternate_screen():
        _event_loop(view, keyboard)


def _event_loop(view: TerminalView, keyboard: int) -> None:
    full = has_true_color()
    drawn: object = None
    keys_ready = _SELECTOR()
    keys_ready.register(keyboard, selectors.EVENT_READ)
    while not view.done:
        size = os.get_terminal_size(sys.stdout.fileno())
        shown = size, view.camera, id(view.lit), view.remark
        if shown != drawn and min(size) > 0:
            lines = view.lines(size.columns, size.lines, full=full)
            _write(_BEGIN_UPDATE + "\x1b[K\n".join(lines) + "\x1b[K\x1b[J" + _END_UPDATE)
            drawn = shown
        wait_s = _SPIN_WAIT_S if view.spins else _IDLE_WAIT_S
        if view.changes:
            wait_s = min(wait_s, view.read_wait_s)
        if keys_ready.select(wait_s):
            keys = os.read(keyboard, 1024)
            if not keys:
                return  # the terminal is gone
            view.handle_keys(keys)
        elif view.spins:
            view.camera = view.camera.turned(_SPIN_STEP)
        if view.read_due:
            view.read_page()


def _write(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()


@contextlib.contextmanager
def _cbreak_keyboard() -> Iterator[int]:
    """Yield the descriptor of a keyboard in cbreak mode, without echo; restore it."""
    try:
        import termios  # noqa: PLC0415 - not on every system
        import tty  # noqa: PLC0415
    except ModuleNotFoundError:
        raise ValueError("this system has no Unix terminal") from None
    opened_here = not sys.stdin.isatty()  # the scene may come from stdin
    try:
        keyboard = os.open("/dev/tty", os.O_RDONLY) if opened_here else sys.stdin.fileno()
    except OSError as error:
        raise ValueError(f"there is no keyboard: {error.strerror}") from error
    before = None
    try:
        try:
            before = termios.tcgetattr(keyboard)
            tty.setcbreak(keyboard)
            mode = termios.tcgetattr(keyboard)
            mode[6][termios.VSUSP] = b"\0"  # Ctrl-Z would leave the screen as it is
            termios.tcsetattr(keyboard, termios.TCSADRAIN, mode)
        except termios.error as error:  # not an OSError
            raise ValueError(f"the keyboard cannot be read key by key: {error.args[-1]}") from error
        yield keyboard
    finally:
        if before is not None:
            with contextlib.suppress(termios.error):  # when the terminal is gone
                termios.tcsetattr(keyboard, termios.TCSAFLUSH, before)
        if opened_here:
            os.close(keyboard)


@contextlib.contextmanager
def _alternate_screen() -> Iterator[None]:
    """Switch to the terminal's alternate screen; switch back, on signals, too."""
    before = {
        number: signal.signal(number, _raise_interrupt)
        for number in (signal.SIGTERM, signal.SIGHUP)
    }
    try:
        _write(_ENTER_SCREEN)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        with contextlib.suppress(OSError):
            _write(_LEAVE_SCREEN)


def _raise_interrupt(number: int, frame: Any) -> NoReturn:
    del number, frame
    raise KeyboardInterrupt

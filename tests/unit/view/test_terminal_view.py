"""Terminal view where the system fails: the modes of the keyboard cannot be set."""

import os
import sys

import pytest

from voxdisplay.view import terminal

termios = pytest.importorskip("termios")


@pytest.fixture
def keyboard(monkeypatch):
    """Make stdin the slave of a pty; return its descriptor."""
    master, slave = os.openpty()
    with os.fdopen(slave, closefd=False) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        yield slave
    os.close(slave)
    os.close(master)


@pytest.mark.parametrize("call", ["tcgetattr", "tcsetattr"])
def test_modes_that_cannot_be_set(call, keyboard, monkeypatch):
    calls, function = [], getattr(termios, call)

    def fail(*arguments):
        calls.append(arguments)
        if len(calls) == 1:
            raise termios.error(5, "Input/output error")
        return function(*arguments)

    before = termios.tcgetattr(keyboard)
    monkeypatch.setattr(termios, call, fail)
    with (
        pytest.raises(ValueError, match="keyboard cannot be read key by key: Input/output error"),
        terminal._cbreak_keyboard(),
    ):
        pass
    monkeypatch.undo()
    assert termios.tcgetattr(keyboard) == before


def test_no_keyboard_at_all(monkeypatch, tmp_path):
    def fail(path, *_arguments):
        raise OSError(6, "No such device or address", path)

    (tmp_path / "scene.json").touch()
    with (tmp_path / "scene.json").open(encoding="utf-8") as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        monkeypatch.setattr(os, "open", fail)
        with (
            pytest.raises(ValueError, match="there is no keyboard: No such device"),
            terminal._cbreak_keyboard(),
        ):
            pass
        monkeypatch.undo()

"""Commands that are ended by Ctrl-C, SIGTERM or a closed terminal in mid-push."""

import os
import pty
import signal
import subprocess
import sys

import pytest
from carriers import eventually
from conftest import DEADLINE_S, ROOT
from pluggable_pty import SCENE, noise_frame, start_push

import voxdisplay as vd

EXIT_CODES = {"SIGINT": 130, "SIGTERM": 143, "SIGHUP": 129}


@pytest.mark.parametrize("on_exit", ["keep", "blank"])
@pytest.mark.parametrize("name", EXIT_CODES)
def test_ended_in_mid_push(plug, name, on_exit):
    plug.plug()
    with vd.open(str(plug.path)) as display:
        before = noise_frame(display)
        display.present(before)
    plug.device.disconnect()
    plug.hold()
    with start_push(plug.path, "--on-exit", on_exit) as push:
        eventually(lambda: plug.held, "a frame on its way")
        plug.release()
        push.send_signal(getattr(signal, name))
        out, text = push.communicate(timeout=DEADLINE_S)
    assert push.returncode == EXIT_CODES[name], text
    assert "Traceback" not in text
    assert out == ""
    if on_exit == "blank":
        assert "the display is dark" in text
        assert not any(plug.snapshot().pixels)
    else:
        assert "keeps its last whole picture" in text
        assert plug.shows(before)
    vd.open(str(plug.path)).close()  # the port is free


def test_a_display_that_cannot_be_made_dark(plug):
    plug.plug().hold()
    with start_push(plug.path, "--on-exit", "blank") as push:
        eventually(lambda: plug.held, "a frame on its way")
        push.send_signal(signal.SIGTERM)
        _, text = push.communicate(timeout=DEADLINE_S)
    plug.release()
    assert push.returncode == 143
    assert "could not be made dark" in text


def test_interrupted_while_the_command_line_is_imported(tmp_path):
    """No handler but the entry point's is there yet, which ends the process at once."""
    waiting = "import sys, time; print('importing', file=sys.stderr, flush=True); time.sleep(60)"
    tmp_path.joinpath("click.py").write_text(waiting, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-m", "voxdisplay", "push", SCENE]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, cwd=ROOT, env=environment
    ) as push:
        assert push.stderr.readline() == "importing\n"
        push.send_signal(signal.SIGINT)
        _, text = push.communicate(timeout=DEADLINE_S)
    assert (push.returncode, text) == (130, "interrupted\n")


def test_interrupted_while_a_command_is_imported():
    """Nothing is open yet; there is a word and the exit code, and no traceback."""
    command = [sys.executable, "-X", "importtime", "-m", "voxdisplay", "push", SCENE]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT) as push:
        assert any("numpy" in line for line in iter(push.stderr.readline, ""))
        push.send_signal(signal.SIGINT)
        _, text = push.communicate(timeout=DEADLINE_S)
    assert push.returncode == 130
    assert "Traceback" not in text
    assert text.endswith("interrupted\n")


def test_under_nohup_a_closed_terminal_changes_nothing(plug):
    plug.plug().hold()
    ignore = lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)  # noqa: E731
    with start_push(plug.path, preexec_fn=ignore) as push:
        eventually(lambda: plug.held, "a frame on its way")
        push.send_signal(signal.SIGHUP)
        plug.release()
        _, text = push.communicate(timeout=DEADLINE_S)
    assert push.returncode == 0, text


def test_a_terminal_that_is_closed(plug):
    """The real thing: with the terminal goes everything that could be text there."""
    plug.plug().hold()
    arguments = ["-m", "voxdisplay", "push", SCENE, "--port", str(plug.path), "--on-exit", "blank"]
    pid, terminal = pty.fork()
    if pid == 0:
        os.chdir(ROOT)
        os.execv(sys.executable, [sys.executable, *arguments])  # noqa: S606
    eventually(lambda: plug.held, "a frame on its way")
    plug.release()
    os.close(terminal)
    _, status = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(status) == 129
    assert not any(plug.snapshot().pixels)
    vd.open(str(plug.path)).close()  # the port is free

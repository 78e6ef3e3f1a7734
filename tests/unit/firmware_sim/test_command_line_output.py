"""``voxdisplay-sim``: output and files that cannot be written."""

import errno
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from device_packets import (
    CLEAR,
    COMMIT,
    DOT,
    data,
    hello,
)
from emulator_program import ROOT, WAIT, exit_code

from firmware_sim import command_line, npy, serve
from firmware_sim.config import Config
from firmware_sim.device import Device


def run_with(redirection: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the program in a shell with some redirection; its own dump ends it by SIGTERM."""
    script = f"exec {sys.executable} -c '{ENDS_ITSELF}' {' '.join(arguments)} {redirection}"
    return subprocess.run(
        ["/bin/sh", "-c", script],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        timeout=WAIT,
    )


ENDS_ITSELF = """
import os, signal, sys
from firmware_sim import command_line
from firmware_sim.__main__ import main
announce = command_line._announce
def announce_and_end(place):
    announce(place)
    os.kill(os.getpid(), signal.SIGTERM)
command_line._announce = announce_and_end
sys.exit(main())
"""


@pytest.mark.parametrize("redirection", [">&-", ">&- 2>&-", "<&- >&- 2>&-", "2>&-"])
def test_closed_output_does_not_stop_the_program(redirection: str) -> None:
    done = run_with(redirection, "--size", "3x5x7")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--nosuch\x1b[2J\x07"], 2, "unrecognized arguments: --nosuch\\x1b[2J\\x07"),
        (["--link", "/nowhere/\x1b[2J\nx"], 2, "link /nowhere/\\x1b[2J\n"),
        (["--dump", "/nowhere/\x9b2J\u202e"], 2, "/nowhere/\\x9b2J\\u202e cannot be written"),
        (["--size", "\x1b]0;title\x07"], 2, "\\x1b]0;title"),
        (["--tcp", "\x1b[2J:99"], 2, "x1b[2J"),
    ],
)
def test_words_of_the_command_line_steer_no_terminal(
    words: list[str], code: int, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert exit_code(words) == code
    told = capfd.readouterr().err
    assert said in told
    assert all(c.isprintable() or c == "\n" for c in told)


class Pipe(io.StringIO):
    """An output that takes nothing."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error = error

    def flush(self) -> None:
        raise self.error


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), 2, "No space left on device"),
        (ValueError("I/O operation on closed file"), 2, "I/O operation on closed file"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), 0, ""),
    ],
)
def test_help_that_cannot_be_written(
    error: Exception,
    code: int,
    said: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "stdout", Pipe(error))
    assert exit_code(["--help"]) == code
    told = capsys.readouterr().err
    assert (f"the help cannot be written: {said}" in told) if said else not told


def test_help_without_an_output(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    assert exit_code(["--help"]) == 0


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="no /dev/full here")
def test_help_to_a_full_disk_fails() -> None:
    done = run_with(">/dev/full", "--help")
    assert done.returncode == 2
    assert done.stderr.endswith("the help cannot be written: No space left on device\n")
    assert "Exception ignored" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="no /dev/full here")
@pytest.mark.parametrize("redirection", [">/dev/full", ">/dev/full 2>/dev/full"])
def test_output_to_a_full_disk_does_not_stop_the_program(redirection: str) -> None:
    done = run_with(redirection, "--size", "3x5x7", "--tcp", "127.0.0.1:0")
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    if "2>" not in redirection:
        assert "No space left on device" in done.stderr
        assert '"port": "tcp://127.0.0.1:' in done.stderr, "the port is told all the same"


def test_a_dump_that_fails_with_stderr_closed_does_not_stop_the_device(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = Device(Config((3, 5, 7), refresh=0))
    command_line._dump_swaps(device, tmp_path / "front.npy")
    monkeypatch.setattr(command_line, "write_npy", _fail)
    monkeypatch.setattr(sys, "stderr", None)
    device.receive(hello() + data(0, 0, DOT, CLEAR | COMMIT))
    assert device.swaps == 1


def _fail(*_: object) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("locale", ["C", "en_US.ISO-8859-1", "tr_TR.UTF-8"])
def test_any_locale_and_any_path(locale: str, tmp_path: Path) -> None:
    dump = os.fsencode(tmp_path) + b"/\xc4\x9f\xff.npy"  # no text in any locale
    environment = {**os.environ, "LC_ALL": locale, "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}
    command = [sys.executable, "-c", ENDS_ITSELF, "--size", "3x5x7", "--dump", dump]
    for arguments, code in ((command, 0), ([*command, "--link", dump], 2)):
        done = subprocess.run(
            arguments, env=environment, capture_output=True, check=False, cwd=ROOT, timeout=WAIT
        )
        assert done.returncode == code, done.stderr
        assert b"Traceback" not in done.stderr
    assert [os.fsencode(path) for path in tmp_path.iterdir()] == [dump]


# Files


def test_only_files_are_replaced_by_a_dump(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program of root must not replace /dev/null."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    for name in ("pipe", "link", ""):
        assert exit_code(["--dump", str(tmp_path / name)]) == 2
        assert "exists and is no regular file" in capsys.readouterr().err
    assert (tmp_path / "pipe").is_fifo()


def test_nothing_is_written_through_a_link_laid_beside_the_dump(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(npy.secrets, "token_hex", lambda _: "guessed")
    (tmp_path / "victim").write_text("precious")
    (tmp_path / ".front.npy.guessed.tmp").symlink_to(tmp_path / "victim")
    with pytest.raises(OSError, match=r"front\.npy cannot be written"):
        command_line._dump_swaps(Device(Config((3, 5, 7))), tmp_path / "front.npy")
    assert (tmp_path / "victim").read_text() == "precious"


def test_a_full_disk_leaves_no_half_of_a_dump(tmp_path: Path) -> None:
    done = subprocess.run(
        ["/bin/sh", "-c", f"ulimit -f 1; exec {sys.executable} -m firmware_sim --dump front.npy"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=WAIT,
    )
    assert done.returncode == 2
    assert "front.npy cannot be written: File too large" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_link_that_another_program_took_over_stays(tmp_path: Path) -> None:
    link = tmp_path / "port"
    with serve.symbolic_link(link, "/dev/one"):
        with serve.symbolic_link(link, "/dev/two"):
            assert str(link.readlink()) == "/dev/two"
        with serve.symbolic_link(link, "/dev/three"):
            link.unlink()
        link.symlink_to("/dev/four")
    assert str(link.readlink()) == "/dev/four"

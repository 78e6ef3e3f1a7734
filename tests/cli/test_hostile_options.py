"""Hostile values for every option and argument of every command: errors or results, no fault."""

import io

import click
import numpy as np
import pytest
from recordings import Spin, write_recording

from voxdisplay.cli import bench_measurements
from voxdisplay.cli.command_table import ENTRIES
from voxdisplay.cli.main import cli, main

PORT = ["--port", "sim:?size=3x5x7&refresh=0"]
SCENE = '{"type": "segment", "from": [0, 0, 0], "to": [2.5, 4.5, 6.5]}'
# A command line of each command that works. What reads a file has its name first.
WORKING = {
    "push": ["scene.json", *PORT],
    "test-pattern": PORT,
    "clear": PORT,
    "ports": [],
    "displays": [],
    "info": PORT,
    "read": [*PORT, "-o", "page.npy"],
    "view": ["scene.json", "--no-open"],
    "voxelize": ["scene.json"],
    "preview": ["scene.json", "-o", "x.png", "--pixels", "40x30"],
    "plan": ["scene.json"],
    "convert": ["volume.npy", "-o", "out.npz", "--size", "3x5x7"],
    "play": ["scene.json", *PORT, "--until", "0.05"],
    "record": ["scene.json", "-o", "out.vxs", "--size", "3x5x7"],
    "show": ["info", "show.vxs"],
    "conformance": [*PORT, "--only", "7.1/*", "--list"],
    "annotate": ["capture.jsonl"],
    "bench": PORT,
    "protocol": [],
    "schema": [],
}
HOSTILE = [
    "", " ", "-", "--", "nan", "inf", "-1", "0", "1e309", "9" * 400, "\udcff", "куб", "../../x",
    "/", "/dev/null", "/dev/full", "a" * 5000, "0x0x0", "1x1x1", "99999x99999x99999", "1x2x3x4",
    "16x16",
    "\u0663x\u0663x\u0663", "0.5", "*", "[", "%s", "{0}", "line,,", "x.html", "nodir/x.png", ":",
    "127.0.0.1:", "127.0.0.1:99999", "[::1", "tcp://", "tcp://[", "tcp://127.0.0.1:1", "socket://",
    "rfc2217://127.0.0.1:x", "usb:zz", "usb:0:0", "usbip://", "sim:?", "sim:?size=1",
    "sim:?refresh=nan", "sim-usb:?", "hwgrep://[", "nothing://", "COM3", "page.npy", "+5", "0x10",
]  # fmt: skip
CODES = {0, 1, 2, 3, 4}
ENDLESS = {"--loop", "--watch"}  # a key or a signal ends it


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Work in a folder with a scene and a capture; measure and serve nothing."""
    (tmp_path / "scene.json").write_text(SCENE)
    write_recording(tmp_path / "show.vxs", Spin(2))
    np.save(tmp_path / "volume.npy", np.arange(105.0).reshape(7, 5, 3))
    (tmp_path / "capture.jsonl").write_text('{"voxdisplay_capture": 1, "port": "x"}\n')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO()))
    monkeypatch.delenv("VOXDISPLAY_PORT", raising=False)
    monkeypatch.setattr("voxdisplay.view.live.run.run", lambda *_: None)
    for name in ("_BUDGET_S", "_RAW_BUDGET_S", "_NOISE_BUDGET_S"):
        monkeypatch.setattr(bench_measurements, name, 0.01)


def command_lines(name):
    """Working command lines of a command with one value exchanged or one option more."""
    working = WORKING[name]
    for parameter in cli.get_command(click.Context(cli), name).params:
        if isinstance(parameter, click.Argument):
            yield from ([value, *working[1:]] for value in HOSTILE)
        elif parameter.opts[0] in ENDLESS:
            continue
        elif parameter.is_flag:
            yield [*working, parameter.opts[0]]
        else:
            yield from ([*working, parameter.opts[0], value] for value in HOSTILE)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("name", ENTRIES)
def test_no_value_of_an_option_is_a_fault_of_the_program(capfd, name):
    options = [option.opts[0] for option in cli.get_command(click.Context(cli), name).params]
    for words in command_lines(name):
        line = [name, *words]
        if "--timeout" in options and "--timeout" not in words:
            line += ["--timeout", "0.1"]
        code = main(line)
        printed = capfd.readouterr()
        assert code in CODES, (line, printed.err)
        assert "Traceback" not in printed.err, line
        if code == 2:
            assert printed.err.strip(), line


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("name", ENTRIES)
def test_the_working_command_line_works(name):
    assert main([name, *WORKING[name]]) == 0

"""Foreign text in terminals, pages and logs: every source of it, cleaned by one function."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from usb_gadget import GadgetDevice

import voxdisplay as vd
from firmware_sim.config import Config
from firmware_sim.device import Device
from firmware_sim.usb.backend import Backend
from firmware_sim.usb.host import Bus
from voxdisplay.cli.main import main
from voxdisplay.cli.output import note
from voxdisplay.display.device_info import device_error
from voxdisplay.printable_text import printable, printable_lines
from voxdisplay.transport import diagnosis, usb
from voxdisplay.transport.discovery import FoundPort, serial_ports
from voxdisplay.view.html_export import save_html
from voxdisplay.view.lit_voxels import lit_voxels
from voxdisplay.view.live.snapshot_message import Snapshot, encode
from voxdisplay.view.terminal import TerminalView
from voxdisplay.wire.packet import Error

ROOT = Path(__file__).parents[2]
# ESC, BEL, line breaks, C1's CSI, right-to-left override, zero width space, line separator, DEL,
# a lone surrogate.
EVIL = "a\x1b[2J\x07\r\nb\x9b1m\u202ec\u200bd\u2028e\x7ff\udcffg"
CLEAN = "a\ufffd[2J\ufffd\ufffd\ufffdb\ufffd1m\ufffdc\ufffdd\ufffde\ufffdf\ufffdg"
GRID = vd.Grid(3, 5, 7)
DARK = np.zeros(GRID.array_shape, np.uint8)


def test_what_is_not_printable_is_replaced_one_for_one():
    assert printable(EVIL) == CLEAN
    assert printable("Würfel 3 x 5 x 7, куб 立方体 ✓") == "Würfel 3 x 5 x 7, куб 立方体 ✓"
    assert printable("") == ""


def test_only_line_feeds_stay_in_several_lines():
    assert printable_lines("one\ntwo\r\n\x1b[31m") == "one\ntwo\ufffd\n\ufffd[31m"


def test_there_is_one_place_that_cleans():
    """No other module of the driver replaces characters by whether they are printable."""
    package = Path(vd.__file__).parent
    cleaners = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and "\N{REPLACEMENT CHARACTER}" in node.value
    }
    assert cleaners == {"printable_text.py"}


@pytest.mark.parametrize(
    "error",
    [
        vd.OpenError(EVIL, port=EVIL, hint=EVIL),
        vd.TransportClosed(EVIL, hint=EVIL),
        vd.RemoteProtocolError(EVIL, section="1"),
        vd.DeviceError(EVIL, hint=EVIL),
        vd.SceneError(EVIL, path="$." + EVIL, hint=EVIL),
    ],
)
def test_errors_are_clean(error):
    allowed = CLEAN.replace("\ufffd\ufffd\ufffdb", "\ufffd\ufffd\nb")  # a line feed may be ours
    assert allowed in str(error)
    assert error.hint in {None, allowed}


def test_a_device_that_refuses_has_its_text_on_one_line():
    error = device_error(Error(code=1, session=1, offset=0, text=EVIL))
    assert f": {CLEAN}" in str(error)


def test_a_port_that_the_system_lists(monkeypatch, capsys):
    port = SimpleNamespace(
        device="/dev/tty" + EVIL, description=EVIL, vid=1, pid=2, serial_number=EVIL, product=EVIL
    )
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [port])
    (found,) = serial_ports()
    assert found == FoundPort("/dev/tty" + CLEAN, CLEAN, 1, 2, CLEAN, CLEAN)
    assert main(["ports"]) == 0
    out = capsys.readouterr().out
    assert "\x1b" not in out
    assert len(out.splitlines()) == 2 + ("usb:" in out)
    with pytest.raises(vd.OpenError) as refused:
        vd.open("/dev/ttyNOWHERE")
    assert CLEAN in refused.value.hint


def test_a_device_on_usb(monkeypatch):
    device = GadgetDevice(EVIL[:-2])
    backend = Backend(Bus(device))
    monkeypatch.setattr(usb, "find_backend", lambda port: backend)  # noqa: ARG005
    (found,) = usb.usb_ports()
    assert found.serial_number == CLEAN[:-2]
    assert found.port == "usb:1209:0001:" + CLEAN[:-2]
    usb.UsbTransport(found.port, backend=backend).close()
    with pytest.raises(vd.OpenError) as refused:
        vd.open("usb:1209:0002")
    assert refused.value.hint == f"there is {found.port}"


def test_a_program_that_holds_a_port():
    command = [sys.executable, "-c", "open('/proc/self/comm', 'w').write('\\x1b[2Jx'); input()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, text=True) as program:
        name = Path(f"/proc/{program.pid}/comm")
        while "\x1b" not in name.read_text():
            pass
        assert diagnosis._process_name(program.pid) == "\ufffd[2Jx"
        program.communicate("\n")


def test_titles(tmp_path):
    message = encode(Snapshot(DARK, GRID, vd.PixelFormat.INDEX8, 1, EVIL))
    assert json.loads(message[4 : int.from_bytes(message[:4], "little")])["title"] == CLEAN
    save_html(tmp_path / "x.html", [DARK], GRID, vd.PixelFormat.INDEX8, title=EVIL)
    assert f"<title>{CLEAN}</title>" in (tmp_path / "x.html").read_text(encoding="utf-8")
    lit = lit_voxels(DARK, GRID, vd.PixelFormat.INDEX8)
    view = TerminalView(GRID, EVIL, lambda: lit, changes=False)
    assert view.lines(80, 3, full=True)[-1].startswith(f" {CLEAN}  0 voxels")


def test_notes_on_stderr(capsys):
    note(EVIL)
    assert capsys.readouterr().err.encode("utf-8").count(b"\x1b") == 0


def test_an_emulator_that_is_called_names(monkeypatch, capsys):
    """The whole way: a device's INFO to the lines of a command."""
    config = Config(GRID, "index8", refresh=0, name="x\x1b]0;owned\x07", serial="\x9b2J\n1")
    device = Device(config)
    monkeypatch.setattr("firmware_sim.in_process.Device", lambda *_, **__: device)
    assert main(["info", "--port", "sim:"]) == 0
    out = capsys.readouterr().out
    assert "x\ufffd]0;owned\ufffd" in out
    assert "\ufffd2J\ufffd1" in out
    assert not set("\x1b\x07\x9b") & set(out)
    assert os.linesep + "1" not in out

"""Arguments of `vd.open`, and the `repr` of displays and receipts."""

import io
import pathlib
import re
import types

import numpy as np
import pytest
import serial
from memory_pipe import Pipe, open_display, random_frame

import voxdisplay as vd
from voxdisplay.display import baud
from voxdisplay.transport.discovery import FoundPort

SIM = "sim:?size=3x5x7"


def test_without_a_port_it_is_the_emulator(monkeypatch):
    monkeypatch.delenv("VOXDISPLAY_PORT", raising=False)
    with vd.open() as display:
        assert display.port == "sim:"


@pytest.mark.parametrize(("value", "port"), [(SIM, SIM), ("", "sim:")])
def test_without_a_port_it_is_that_of_the_environment(monkeypatch, value, port):
    monkeypatch.setenv("VOXDISPLAY_PORT", value)
    with vd.open() as display:
        assert display.port == port


@pytest.mark.parametrize(
    "port",
    [
        SIM,
        pathlib.PurePosixPath(SIM),
        FoundPort(SIM, "an entry of our list"),
        types.SimpleNamespace(device=SIM, name="an entry of pyserial's list"),
    ],
)
def test_what_names_a_port(port):
    with vd.open(port) as display:
        assert display.info.grid == (3, 5, 7)


def test_an_open_pipe_is_taken_and_closed():
    pipe = Pipe()
    with vd.open(pipe, clock=lambda: pipe.now) as display:
        display.clear()
    assert pipe.closed == 1


@pytest.mark.parametrize("port", [3, b"sim:", ["sim:"], object(), serial.Serial(), 1.5])
def test_what_is_no_port(port):
    with pytest.raises(TypeError, match=f"port is a {type(port).__name__}: name it by text"):
        vd.open(port)


@pytest.mark.parametrize("name", ["present", "unwaited", "verify"])
@pytest.mark.parametrize("wrong", [np.zeros((7, 5, 3), np.uint8), [(1, 2, 3)], None, "red"])
def test_what_is_no_frame(name, wrong):
    display, pipe = open_display()
    calls = {
        "present": display.present,
        "unwaited": lambda frame: display.present(frame, wait=False),
        "verify": display.verify,
    }
    before = dict(pipe.device.taken_by_type)
    with pytest.raises(TypeError, match=f"frame is a {type(wrong).__name__}"):
        calls[name](wrong)
    assert dict(pipe.device.taken_by_type) == before, "nothing was sent"


@pytest.mark.parametrize("rate", [9600, "auto"])
@pytest.mark.parametrize("no_reset", [True, False])
def test_the_modem_lines_are_left_alone_on_request(monkeypatch, rate, no_reset):
    options = []

    def open_transport(port, **given):
        options.append(given)
        raise vd.OpenError("not there", port=port)

    monkeypatch.setattr(baud, "open_transport", open_transport)
    with pytest.raises(vd.OpenError):
        vd.open("/dev/ttyUSB0", baud=rate, no_reset=no_reset)
    assert [given["reset"] for given in options] == [not no_reset]


# -- what they print


def test_a_display_prints_in_a_line():
    display, _ = open_display(name="cube\x1b[2J")
    display.present(random_frame(display))
    text = repr(display)
    assert text == "<Display pipe: 'cube\N{REPLACEMENT CHARACTER}[2J' 17x9x5 rgb888, 1 frame shown>"
    display.clear()
    assert "2 frames shown" in repr(display)
    display.close()
    assert repr(display).endswith("rgb888, closed>")


@pytest.mark.parametrize("has_digest", [True, False])
def test_a_receipt_prints_in_a_line(has_digest):
    features = {"features": frozenset()} if not has_digest else {}
    display, _ = open_display(**features)
    frame = random_frame(display)
    text = repr(display.present(frame))
    digest = f"digest {frame.digest():08x}" if has_digest else "no digest"
    assert re.fullmatch(
        rf"<Receipt of frame 1: \d+ voxels, \d+ bytes in \d+ packets, \d+\.\d ms, {digest}>", text
    )


def test_a_receipt_prints_what_went_wrong():
    receipt = vd.Receipt(
        frame=3, voxels=1, packets=1, wire_bytes=30, retransmitted=2, elapsed_s=0.5, digest=1,
        repaired="1 voxels differ",
    )  # fmt: skip
    assert repr(receipt) == (
        "<Receipt of frame 3: 1 voxel, 30 bytes in 1 packet, 500.0 ms, 2 retransmitted, "
        "digest 00000001, repaired>"
    )


@pytest.mark.parametrize("argument", [{"clock": 3}, {"capture": io.BytesIO()}])
def test_arguments_that_would_fail_later_are_refused_at_once(argument):
    (name,) = argument
    with pytest.raises(TypeError, match=f"^{name}: expected a "):
        vd.open("sim:?size=8x8x8", **argument)

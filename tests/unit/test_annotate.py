"""``voxdisplay annotate``: a good capture has no violation, a tampered one names its own."""

import json
import subprocess
import sys
from pathlib import Path

import document
import pytest
from conftest import ROOT

from voxdisplay.annotation.capture_file import DEVICE, HOST
from voxdisplay.annotation.line_monitor import LineMonitor

SCENE = {"type": "segment", "from": [0.5, 0.5, 0.5], "to": [2.5, 4.5, 6.5], "color": "red"}
# ACK: kind, next, frame, last, session, boot, received, credit, digest, damaged
DIGEST_AT = 16


def annotate(file, *options):
    command = [sys.executable, "-m", "voxdisplay", "annotate", file, *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)


@pytest.fixture(scope="module")
def captured(tmp_path_factory):
    """The lines of a capture of a push that reads back."""
    folder = tmp_path_factory.mktemp("capture")
    scene, file = folder / "scene.json", folder / "capture.jsonl"
    scene.write_text(json.dumps(SCENE))
    command = [sys.executable, "-m", "voxdisplay", "push", scene, "--verify", "--capture", file]
    command += ["--port", "sim:?size=3x5x7&format=index8&features=read,digest"]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    return file.read_text().splitlines()


def tampered(lines, kind, change):
    """The capture with the first packet of a type changed: header and payload, as a bytearray."""
    out, done = [], False
    for line in lines:
        entry = json.loads(line)
        if "hex" in entry and not done:
            data = bytes.fromhex(entry["hex"])
            pieces = []
            for segment in data.split(b"\0")[:-1]:
                body = bytearray(document.cobs_decode(segment)[:-4])
                if body and body[0] >> 4 == kind and not done:
                    done = True
                    change(body)
                pieces.append(document.on_wire(bytes(body)) if body else b"\0")
            entry["hex"] = b"".join(pieces).hex()
        out.append(json.dumps(entry))
    assert done
    return out


def explained(tmp_path, lines, *options):
    file = tmp_path / "capture.jsonl"
    file.write_text("\n".join(lines))
    return annotate(file, *options)


def test_every_packet_and_op_is_explained(tmp_path, captured):
    printed = explained(tmp_path, captured)
    assert printed.returncode == 0, printed.stdout + printed.stderr
    for word in ("HELLO", "INFO", "DATA CLEAR|COMMIT", "ACK", "SHOWN", "READ", "PAGE", "3x5x7"):
        assert word in printed.stdout
    assert "is on display: 7 voxels lit" in printed.stdout
    assert "the pixels are those of the frame on display" in printed.stdout
    assert "nothing violates protocol.md" in printed.stdout


def test_for_scripts(tmp_path, captured):
    result = json.loads(explained(tmp_path, captured, "--json").stdout)
    rows = result["segments"]
    assert result["violations"] == 0
    assert result["packets"] == len(rows)
    assert {row["to"] for row in rows} == {"host", "device"}
    assert all(note["section"] is None for row in rows for note in row["notes"])
    assert sum(row["wire_bytes"] for row in rows if row["to"] == "device") > 30


def test_a_bad_line_breaks_nothing(tmp_path):
    file = tmp_path / "capture.jsonl"
    command = [
        sys.executable,
        "-m",
        "voxdisplay",
        "push",
        "examples/trefoil.json",
        "--capture",
        file,
    ]
    command += ["--port", "sim:?fault=flip:3e-3&seed=2&max_payload=64"]
    subprocess.run(command, check=True, capture_output=True, cwd=ROOT)
    printed = annotate(file)
    assert printed.returncode == 0, printed.stdout
    assert "retransmitted" in printed.stdout
    assert "damaged segment" in printed.stdout


def set_byte(at, value):
    return lambda body: body.__setitem__(at, value)


def flip(at):
    return lambda body: body.__setitem__(at, body[at] ^ 1)


@pytest.mark.parametrize(
    ("kind", "change", "section", "text"),
    [
        (1, set_byte(1, 3), "9.1", "out of order"),
        (1, set_byte(2, 5), "6", "frame 5 follows"),
        (1, set_byte(3, 0x07), "11", "must be refused: OP"),
        (3, lambda body: body.__setitem__(slice(4, 6), bytes(2)), "5", "session 0"),
        (5, set_byte(3, 1), "10", "reserved bits"),
        (8, set_byte(1, 9), "9", "never sent"),
        (10, set_byte(8, 200), "10", "covers 200 voxels"),
        (10, flip(13), "10", "shown was"),
    ],
)
def test_a_violation_names_its_section(tmp_path, captured, kind, change, section, text):
    printed = explained(tmp_path, tampered(captured, kind, change), "--violations")
    assert printed.returncode == 1, printed.stdout
    assert f"section {section}:" in printed.stdout
    assert text in printed.stdout


def test_a_digest_is_computed_again(tmp_path, captured):
    printed = explained(
        tmp_path, tampered(only_shown(captured), 8, flip(DIGEST_AT)), "--violations"
    )
    assert "section 8: the digest is" in printed.stdout


def only_shown(lines):
    """Drop the ACKs before the swap."""
    out = []
    for line in lines:
        entry = json.loads(line)
        if entry.get("to") == "host":
            kept = []
            for segment in bytes.fromhex(entry["hex"]).split(b"\0")[:-1]:
                body = document.cobs_decode(segment)[:-4]
                if body and not (body[0] >> 4 == 8 and not body[0] & 1):
                    kept.append(document.on_wire(body))
            entry["hex"] = b"".join(kept).hex()
        out.append(json.dumps(entry))
    return out


def test_credit_is_counted(tmp_path, captured):
    """INFO with a small buffer: what the host then sends is too much for it."""

    def small(body):
        body[20:24] = (70).to_bytes(4, "little")

    printed = explained(tmp_path, tampered(captured, 9, small), "--violations")
    assert "section 9.2: credit is exceeded" in printed.stdout


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[1]",
        "7",
        "[" * 100_000,
        '{"voxdisplay_capture": 9}',
        '{"voxdisplay_capture": 1}\n{"s": 0}',
        '{"voxdisplay_capture": 1}\n{"s": "1", "to": ["host"], "hex": "00"}',
        "\xff\xfe",
    ],
)
def test_what_is_no_capture(tmp_path, text):
    file = tmp_path / "no.jsonl"
    file.write_text(text, encoding="latin-1")
    printed = annotate(file)
    assert printed.returncode == 2
    assert "no.jsonl" in printed.stderr
    assert "fault of this program" not in printed.stderr
    assert "Traceback" not in printed.stderr


def test_a_file_that_is_not_there(tmp_path):
    for path in (tmp_path / "none.jsonl", tmp_path):
        printed = annotate(path)
        assert printed.returncode == 2
        assert str(path) in printed.stderr


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no /dev/zero")
def test_a_line_without_an_end_is_refused():
    """More than the longest line is not read: memory would be filled by it."""
    printed = annotate("/dev/zero")
    assert printed.returncode == 2
    assert "/dev/zero, line 1" in printed.stderr


def test_text_of_a_device_does_not_steer_the_terminal(tmp_path, captured):
    """The name in INFO: a length and its bytes behind the fixed fields."""

    def named(body):
        at = bytes(body).index(b"voxdisplay emulator")
        body[at : at + 4] = b"\x1b[2J"

    printed = explained(tmp_path, tampered(captured, 9, named))
    assert "\x1b" not in printed.stdout
    assert "[2Jisplay emulator" in printed.stdout


@pytest.mark.parametrize(("ticks", "too_long"), [(10, False), (11, True)])
def test_frames_that_are_held_for_more_than_a_second_together(ticks, too_long):
    monitor = LineMonitor()
    texts = {"features": "READ|DIGEST|HOLD", "refresh": "20000"}
    (dialogue,) = (v for v in document.vectors("dialogue") if v.name == "held-for-three-ticks")
    assert dict(dialogue.lines).items() >= texts.items()
    hello, info = [
        bytes.fromhex(text) for key, text in dialogue.lines if key in {"host", "device"}
    ][:2]
    for to, body in ((DEVICE, hello), (HOST, info)):
        monitor.delimiter(to)
        monitor.packet(to, body, len(body) + 6)
    dropped = bytes((0x11, 0, 0, 7, 9))
    packets = [dropped, bytes((0x15, 1, 1, 7, 10, 7, 3)), bytes((0x15, 2, 2, 7, ticks))]
    remarks = [remark for body in packets for remark in monitor.packet(DEVICE, body, 20)]
    assert any("HOLD" in remark.text and "10 ticks" in remark.text for remark in remarks)
    assert any(remark.section == "7.12" for remark in remarks) == too_long

"""Frames through ``vd.open`` and the commands to receivers of every protocol on 127.0.0.1."""

import itertools
import json
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import ROOT
from light_receivers import (
    TcpReceiver,
    UdpReceiver,
    art_dmx,
    ddp_bytes,
    dnrgb_bytes,
    opc_messages,
    sacn_data,
)

import voxdisplay as vd

SIZE = "5x7x11"  # 385 LEDs: three universes
VOXELS = 5 * 7 * 11
LAYOUT = f"size={SIZE}&order=grb&wiring=serpentine&panels=yzx&start=1,0,1&gamma=2"


def picture(seed=3):
    rng = np.random.default_rng(seed)
    return rng.integers(0, 256, (11, 7, 5, 3), dtype=np.uint8)


def along_the_wire(rgb):
    """Bytes of LAYOUT, one LED after the other."""
    found = []
    for x in range(4, -1, -1):
        for row, z in enumerate(range(10, -1, -1)):
            for y in range(6, -1, -1) if row % 2 else range(7):
                red, green, blue = rgb[z, y, x].tolist()
                found += [round(value * value / 255) for value in (green, red, blue)]
    return bytes(found)


@pytest.fixture
def udp():
    receiver = UdpReceiver()
    yield receiver
    receiver.close()


@pytest.fixture
def tcp():
    receiver = TcpReceiver()
    yield receiver
    receiver.close()


def present(port, *pictures):
    with vd.open(port) as display:
        frame = display.frame()
        for rgb in pictures:
            frame.set(rgb)
            receipt = display.present(frame)
    return receipt


def test_artnet(udp):
    rgb = picture()
    receipt = present(f"artnet://127.0.0.1:{udp.number}?{LAYOUT}&universe=15", rgb)
    datagrams = udp.await_count(4)
    assert (receipt.packets, receipt.wire_bytes) == (4, sum(map(len, datagrams)))
    assert receipt.digest is None
    found = [art_dmx(datagram) for datagram in datagrams]
    assert [universe for universe, _ in found[:3]] == [15, 16, 17]
    assert b"".join(slots for _, slots in found[:3])[: 3 * VOXELS] == along_the_wire(rgb)
    assert found[3] is None, "the ArtSync is last"


def test_sacn(udp):
    rgb = picture()
    present(f"sacn://127.0.0.1:{udp.number}?{LAYOUT}&universe=9,4-5", rgb)
    found = [sacn_data(datagram) for datagram in udp.await_count(4)]
    assert [universe for universe, _ in found[:3]] == [9, 4, 5]
    assert b"".join(slots for _, slots in found[:3]) == along_the_wire(rgb)
    assert found[3] is None


@pytest.mark.parametrize(("scheme", "at"), [("artnet", 12), ("sacn", 111)])
def test_sequence_numbers_go_on_from_program_to_program(udp, scheme, at):
    port = f"{scheme}://127.0.0.1:{udp.number}?size=3x5x7"
    for _ in range(3):
        present(port, *[np.zeros((7, 5, 3, 3), dtype=np.uint8)] * 2)
    numbers = [datagram[at] for datagram in udp.await_count(6)]
    steps = [(later - earlier) % 256 for earlier, later in itertools.pairwise(numbers)]
    # E1.31, section 6.7.2: a packet is dropped if its number is that or up to 19 less.
    assert all(0 < step < 236 for step in steps)


def test_ddp(udp):
    rgb = picture()
    present(f"ddp://127.0.0.1:{udp.number}?{LAYOUT}", rgb)
    assert ddp_bytes(udp.await_count(1)) == (along_the_wire(rgb), True)


def test_wled(udp):
    rgb = picture()
    present(f"wled://127.0.0.1:{udp.number}?{LAYOUT}", rgb)
    assert dnrgb_bytes(udp.await_count(1)) == along_the_wire(rgb)


def test_opc(tcp):
    rgb, more = picture(), picture(4)
    port = f"opc://127.0.0.1:{tcp.number}?{LAYOUT}&pixels=200&channel=7"
    present(port, rgb, more)
    messages = opc_messages(tcp.await_bytes(2 * (3 * VOXELS + 8)))
    assert [channel for channel, _ in messages] == [7, 8, 7, 8]
    assert messages[0][1] + messages[1][1] == along_the_wire(rgb)
    assert messages[2][1] + messages[3][1] == along_the_wire(more)


@pytest.mark.skipif(os.name != "posix", reason="there are no ptys")
def test_adalight():
    rgb = picture()
    import tty  # noqa: PLC0415 - of POSIX systems alone

    board, line = os.openpty()
    tty.setraw(board)
    tty.setraw(line)
    os.write(board, b"Ada\n")
    received = bytearray()
    whole = threading.Event()

    def read():
        while len(received) < 6 + 3 * VOXELS:
            received.extend(os.read(board, 4096))
        whole.set()

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    with vd.open(f"adalight:{os.ttyname(line)}?{LAYOUT}", baud=1_000_000) as display:
        frame = display.frame()
        frame.set(rgb)
        display.present(frame)
        assert whole.wait(20)
    count = VOXELS - 1
    header = bytes([count >> 8, count & 0xFF, count >> 8 ^ count & 0xFF ^ 0x55])
    assert received == b"Ada" + header + along_the_wire(rgb)
    os.close(board)
    os.close(line)


@pytest.mark.parametrize("scheme", ["artnet", "sacn", "ddp", "wled"])
def test_a_cube_of_32_arrives_whole(udp, scheme):
    rgb = np.random.default_rng(1).integers(0, 256, (32, 32, 32, 3), dtype=np.uint8)
    receipt = present(f"{scheme}://127.0.0.1:{udp.number}?size=32x32x32", rgb)
    datagrams = udp.await_count(receipt.packets)
    parts = {
        "artnet": lambda: b"".join(art_dmx(each)[1] for each in datagrams[:-1]),
        "sacn": lambda: b"".join(sacn_data(each)[1] for each in datagrams[:-1]),
        "ddp": lambda: ddp_bytes(datagrams)[0],
        "wled": lambda: dnrgb_bytes(datagrams),
    }
    assert parts[scheme]() == rgb.tobytes()
    assert receipt.packets == {"artnet": 194, "sacn": 194, "ddp": 69, "wled": 68}[scheme]


# -- profiles


PROFILE = {
    "axes": "-z,x,y",
    "brightness": 0.5,
    "sink": {"size": [5, 7, 11], "wiring": "serpentine", "order": "bgr"},
}


def test_a_profile_turns_dims_and_wires(udp):
    """Its user's x, y, z run along -z, x and y of the cube's 5x7x11: 11 by 5 by 7 for the user."""
    with vd.open(f"ddp://127.0.0.1:{udp.number}?order=rgb", display=PROFILE) as display:
        frame = display.frame()
        assert tuple(frame.grid) == (11, 5, 7)
        frame.draw(np.array([[1, 2, 3]]), (255, 255, 255))
        display.present(frame)
        assert display.frame(keep=True) == frame
    data, _ = ddp_bytes(udp.await_count(1))
    # Voxel (2, 3, 9) of the cube, whose rows of odd y run back: the key of the name wins.
    led = 9 * 35 + 3 * 5 + (4 - 2)
    assert np.flatnonzero(np.frombuffer(data, dtype=np.uint8)).tolist() == [
        3 * led, 3 * led + 1, 3 * led + 2,
    ]  # fmt: skip
    assert data[3 * led] == 188, "half the light, in sRGB"


def test_a_moving_scene_is_turned_too(udp):
    voxel = {"type": "points", "points": [[1.5, 2.5, 3.5]], "color": "white"}
    scene = {"size": [11, 5, 7], "duration": 0.2, "fps": 10, "objects": [voxel]}
    with vd.open(f"ddp://127.0.0.1:{udp.number}", display=PROFILE) as display:
        assert display.play(vd.read_scene(json.dumps(scene))).shown == 2
    led = 9 * 35 + 3 * 5 + (4 - 2)
    assert ddp_bytes(udp.await_count(2)[1:])[0][3 * led] == 188


def test_a_profile_with_a_serial_number_is_for_none_of_them(udp):
    with pytest.raises(vd.IncompatibleDevice, match="no serial number"):
        vd.open(f"ddp://127.0.0.1:{udp.number}", display=PROFILE | {"serial": "A1"})


def test_sinks_of_profiles_that_are_wrong(udp):
    port = f"ddp://127.0.0.1:{udp.number}"
    with pytest.raises(vd.OpenError, match="unknown key 'wirring'; did you mean 'wiring'"):
        vd.open(port, display={"sink": {"size": "3x5x7", "wirring": "straight"}})
    with pytest.raises(vd.VoxDisplayError, match="sink: expected a table"):
        vd.open(port, display={"sink": "3x5x7"})


def test_a_sink_of_a_profile_does_nothing_on_other_ports():
    notes = []
    with vd.open("sim:?size=3x5x7", display={"sink": {"order": "grb"}}, note=notes.append):
        assert "sink does nothing" in notes[0]


# -- the commands


LINE = {"size": [5, 7, 11], "objects": [{"type": "segment", "from": [0.5] * 3, "to": [4, 6, 10]}]}


def test_push_says_that_nothing_is_proved(run, udp, scene):
    path = scene(LINE)
    port = f"ddp://127.0.0.1:{udp.number}?size={SIZE}"
    pushed = run("push", path, "--port", port)
    assert pushed.returncode == 0, pushed.stderr
    assert "voxels sent: 1 packet" in pushed.stdout
    assert "not proved: nothing answers on this port" in pushed.stdout
    assert "proved: the display's" not in pushed.stdout
    data, _ = ddp_bytes(udp.await_count(1))
    frame = vd.Frame((5, 7, 11))
    frame.draw(vd.load_scene(path))
    assert data == frame.rgb().tobytes()


def test_push_as_json(run, udp, scene):
    port = f"artnet://127.0.0.1:{udp.number}?size={SIZE}"
    result = json.loads(run("push", scene(LINE), "--port", port, "--json").stdout)
    assert result["digest"] is result["verified"] is None
    assert result["device"] == {
        "size": [5, 7, 11], "format": "rgb888", "protocol": "Art-Net", "firmware": "",
    }  # fmt: skip
    assert (result["packets"], result["retransmitted"]) == (4, 0)


@pytest.mark.parametrize("option", ["--verify", "--preview=shown.png"])
def test_what_must_be_read_back_is_refused(run, udp, scene, option, tmp_path):
    port = f"ddp://127.0.0.1:{udp.number}?size={SIZE}"
    pushed = run("push", scene(LINE), "--port", port, option, cwd=tmp_path)
    assert pushed.returncode == 1
    assert "nothing answers on this port" in pushed.stderr
    assert "Traceback" not in pushed.stderr


def test_clear(run, udp):
    cleared = run("clear", "--port", f"ddp://127.0.0.1:{udp.number}?size={SIZE}")
    assert "not proved" in cleared.stdout
    assert ddp_bytes(udp.await_count(1))[0] == bytes(3 * VOXELS)


def test_the_test_pattern(run, udp):
    shown = run("test-pattern", "--port", f"ddp://127.0.0.1:{udp.number}?size={SIZE}")
    assert shown.returncode == 0, shown.stderr
    data, _ = ddp_bytes(udp.await_count(1))
    assert data[:3] == b"\xff\xff\xff", "the axes meet in white"
    checked = run("test-pattern", "--check", "--port", f"ddp://127.0.0.1:{udp.number}?size={SIZE}")
    assert checked.returncode == 1
    assert "nothing answers" in checked.stderr


def test_play(run, udp, scene):
    moving = scene(
        {"size": [5, 7, 11], "duration": 0.5, "fps": 10, "objects": [
            {"type": "points", "points": [[0.5, 0.5, "0.5 + 20*time"]], "color": "lime"}]}
    )  # fmt: skip
    played = run("play", moving, "--port", f"ddp://127.0.0.1:{udp.number}?size={SIZE}", "--json")
    assert played.returncode == 0, played.stderr
    report = json.loads(played.stdout)
    assert report["frames"] == 5
    assert report["wrong"] == 0
    pictures = [ddp_bytes([each])[0] for each in udp.await_count(report["shown"])]
    last = np.frombuffer(pictures[-1], dtype=np.uint8).reshape(11, 7, 5, 3)
    assert last[8, 0, 0].tolist() == [0, 255, 0]
    assert report["wire_bytes"] == report["shown"] * (10 + 3 * VOXELS)


def test_play_says_that_nothing_is_proved(run, udp, scene):
    moving = scene(LINE | {"duration": 0.2, "fps": 10})
    played = run("play", moving, "--port", f"ddp://127.0.0.1:{udp.number}?size={SIZE}")
    assert "2 frames of 2 sent in" in played.stdout
    assert "not proved: nothing answers on this port" in played.stdout


def test_info(run, udp):
    printed = run("info", "--port", f"sacn://127.0.0.1:{udp.number}?size={SIZE}")
    assert printed.returncode == 0, printed.stderr
    assert SIZE in printed.stdout


@pytest.mark.parametrize(
    ("port", "complaint"),
    [
        ("artnet://?size=3x5x7", "names no receiver"),
        ("artnet:127.0.0.1?size=3x5x7", "names no receiver"),
        ("artnet://127.0.0.1:99999?size=3x5x7", "Port out of range"),
        ("artnet://127.0.0.1/cube?size=3x5x7", "names no receiver"),
        ("artnet://127.0.0.1", "the size is missing"),
        ("artnet://127.0.0.1?size=3x5x7&size=3x5x7", "named twice"),
        ("artnet://127.0.0.1?size=3x5x7&hold=3", "unknown key 'hold'"),
        ("artnet://127.0.0.1?size=3x5x7&universe", "bad query"),
        ("artnet://127.0.0.1?size=3x5x7&universe=99999999", "universe"),
        ("sacn://127.0.0.1?size=3x5x7&universe=0", "not from 1 to 63999"),
        ("ddp://255.255.255.255?size=3x5x7", "broadcast address"),
        ("sacn://239.255.0.1?size=3x5x7", "multicast address"),
        ("wled://127.0.0.1?size=41x41x41", "DNRGB ends at 65535"),
        ("opc://127.0.0.1?size=3x5x7&channel=300", "from 0 to 255"),
        ("opc://127.0.0.1:1?size=3x5x7", "cannot be opened"),
        ("adalight:?size=3x5x7", "names no serial port"),
        ("adalight:/dev/none?size=3x5x7", "does not exist"),
        ("adalight:/dev/none", "the size is missing"),
    ],
)
def test_ports_that_are_wrong(run, port, complaint):
    cleared = run("clear", "--port", port)
    assert cleared.returncode == 3, cleared.stderr
    assert complaint in cleared.stderr
    assert "Traceback" not in cleared.stderr
    assert len(cleared.stderr.splitlines()) <= 2


def test_a_rate_cannot_be_found_out(run):
    cleared = run("clear", "--port", "adalight:/dev/none?size=3x5x7", "--baud", "auto")
    assert cleared.returncode == 3
    assert "nothing answers" in cleared.stderr


@pytest.mark.parametrize("command", [["bench"], ["conformance"], ["read", "-o", "page.npy"]])
def test_commands_that_need_answers_say_so(run, udp, tmp_path, command):
    port = f"ddp://127.0.0.1:{udp.number}?size={SIZE}"
    refused = run(*command, "--port", port, cwd=tmp_path)
    assert refused.returncode in {1, 3}
    assert "nothing answers" in refused.stderr
    assert not udp.datagrams


def test_there_is_no_capture(run, udp, scene, tmp_path):
    port = f"ddp://127.0.0.1:{udp.number}?size={SIZE}"
    pushed = run("push", scene(LINE), "--port", port, "--capture", tmp_path / "capture.txt")
    assert pushed.returncode == 3
    assert "a capture holds packets of protocol.md" in pushed.stderr


def test_nothing_of_it_is_imported_by_a_push_to_another_port(scene):
    script = (
        "import sys; from voxdisplay.__main__ import main; sys.argv[0] = 'voxdisplay'; main();"
        "print(*[name for name in sys.modules if 'sink' in name])"
    )
    found = subprocess.run(
        [sys.executable, "-c", script, "push", scene(LINE), "--port", "sim:?size=3x5x7"],
        capture_output=True, text=True, check=True, cwd=ROOT,
    )  # fmt: skip
    assert found.stdout.splitlines()[-1] == "voxdisplay.display.sink_ports"


def test_a_receiver_that_comes_later_is_waited_for():
    placeholder = TcpReceiver()
    number = placeholder.number
    placeholder.close()
    receivers = []

    def start_later():
        time.sleep(0.3)
        receivers.append(TcpReceiver(number))

    thread = threading.Thread(target=start_later)
    thread.start()
    notes = []
    with vd.open(
        f"opc://127.0.0.1:{number}?size=3x5x7", reconnect_s=20, note=notes.append
    ) as display:
        display.clear()
    thread.join()
    assert len(receivers[0].await_bytes(4 + 315)) == 4 + 315
    assert "waiting 20 s" in notes[0]
    receivers[0].close()

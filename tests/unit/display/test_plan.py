"""Plans against the bytes that are sent in the end."""

import json

import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.cli import main
from voxdisplay.cli.param_types import FeaturesType
from voxdisplay.display.plan import COMMON_LINES, EVERY_FEATURE, USB_LINES, Line, Receiver, plan
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.op_listing import list_ops

FORMATS = ["mono1", "index8", "rgb565", "rgb888"]
DRAWING = [name for name in EVERY_FEATURE if name != "hold"]


def curves(grid, format_):
    frame = vd.Frame(grid, format_)
    draw_curves(frame)
    return frame


def draw_curves(frame):
    frame.draw(vd.Circle(center=(20, 9, 9), radius=8), "orange")
    frame.draw(vd.Segment((0, 0, 0), (30, 18, 18)), ["red", "lime"])
    frame.draw([(1, 2, 3), (9, 9, 9)], "white")


def memory(grid, format_, density):
    frame = vd.Frame(grid, format_)
    array = frame.array()
    chance = np.random.default_rng(7)
    top = 2 if format_ == "mono1" else np.iinfo(array.dtype).max
    lit = chance.random(array.shape) < density
    lit[5:12] = True
    frame.set((lit * chance.integers(1, top, array.shape)).astype(array.dtype))
    return frame


@pytest.mark.parametrize("grid", [(31, 20, 19), (300, 20, 19)])
@pytest.mark.parametrize("format_", FORMATS)
@pytest.mark.parametrize("density", [None, 0.0, 0.02, 0.9])
def test_the_ops_are_all_that_is_in_a_payload(grid, format_, density):
    frame = curves(grid, format_) if density is None else memory(grid, format_, density)
    for longest in (64, 1024):
        config = EncoderConfig(frame.grid, frame.format, longest)
        every = {"line", "box", "dots", "oct"} | ({"diff"} if format_ == "index8" else set())
        for payload in frame.payloads(longest) + frame.payloads(longest, every):
            ops = list(list_ops(payload, config))
            assert sum(size for _, size in ops) == len(payload)
            assert {name for name, _ in ops} <= set(plan_names())


def plan_names():
    return [name.removeprefix("OP_") for name in vars(spec) if name.startswith("OP_")]


@pytest.mark.parametrize(
    ("payload", "ops"),
    [
        ("", []),
        ("01 34 12 02 01 02 03 A3 81 C2 78 56 BC 9A F0 DE A0",
         [("PEN", 3), ("MOVE", 4), ("RUN", 1), ("SKIP", 1), ("LIT", 7), ("RUN", 1)]),
        ("9F 01 BF 80 01 DF 00", [("SKIP", 2), ("RUN", 3), ("?", 2)]),
        ("03 01 02 03 04 01 02 03 05 01 01 02 03 01 02 04",
         [("LINE", 4), ("BOX", 4), ("DOTS", 8)]),
        ("64 00 00 00 01 01 81 FF 01 60 01 02 03 61 01 02 03 00 E2 11 01",
         [("OCT", 9), ("OCT", 4), ("OCT", 5), ("DIFF", 3)]),
        ("A0 0A 01", [("RUN", 1), ("?", 2)]),
        ("06 02 01 0A 0B 0C 0D 0E 0F 58 01 02", [("COLORS", 9), ("ARC", 3)]),
        ("4A 03 3C 07 04 E4 01 31 01 0B", [("FROM", 7), ("STEP", 3)]),
        ("A0 00 00 00", [("RUN", 1), ("END", 3)]),
        ("A0 60 01 02", [("RUN", 1), ("?", 3)]),
        ("07 03 A0", [("HOLD", 2), ("RUN", 1)]),
        ("02 01", [("?", 2)]),
        ("20", [("?", 1)]),
        ("9F 80", [("?", 2)]),
    ],
)  # fmt: skip
def test_ops_by_hand(payload, ops):
    config = EncoderConfig(vd.Grid(17, 64, 40), vd.PixelFormat.RGB565, 64)
    assert list(list_ops(bytes.fromhex(payload), config)) == ops


def test_pixels_of_one_bit():
    config = EncoderConfig(vd.Grid(5, 3, 7), vd.PixelFormat.MONO1, 64)
    assert list(list_ops(bytes.fromhex("C9 A5 02 A0"), config)) == [("LIT", 3), ("RUN", 1)]


@pytest.mark.parametrize("density", [None, 0.0, 0.3])
@pytest.mark.parametrize("line", [Line.of_baud(9600), Line.of_baud(1_000_000), USB_LINES[1]])
@pytest.mark.parametrize("features", [",".join(DRAWING), "digest", "line,palette"])
def test_it_is_what_it_then_costs(density, line, features):
    port = f"sim:?size=31x20x19&format=index8&refresh=0&max_payload=200&features={features}"
    with vd.open(port) as display:
        display._connection._transport.bytes_per_s = line.bytes_per_s
        frame = display.frame()
        if density is None:
            draw_curves(frame)
        else:
            frame = memory(frame.grid, "index8", density)
        cost = plan(frame, line, Receiver.of_device(display.info))
        receipt = display.present(frame)
    assert receipt.retransmitted == 0
    assert (cost.packets, cost.wire_bytes) == (receipt.packets, receipt.wire_bytes)
    assert cost.voxels == receipt.voxels
    assert sum(op.bytes for op in cost.ops.values()) == cost.op_bytes


def test_payloads_are_as_long_as_the_link_makes_them():
    for longest, buffer in [(64, 200), (200, 16_384), (4096, 1 << 16), (4096, 4200)]:
        with vd.open(f"sim:?size=3x5x7&max_payload={longest}&rx_buffer={buffer}") as display:
            assert (
                Receiver.of_device(display.info).payload_bytes
                == display._connection.link.payload_bytes
            )


def test_fast_lines_get_the_ops_that_are_found_soon():
    frame = vd.Frame((31, 20, 19))
    frame.draw(vd.Circle(center=(20, 9, 9), radius=8), "orange")
    slow, fast = (plan(frame, Line.of_baud(baud)) for baud in (9600, 921_600))
    assert "ARC" in slow.ops
    assert "ARC" not in fast.ops
    assert slow.wire_bytes < fast.wire_bytes
    bare = plan(frame, Line.of_baud(9600), Receiver(features=()))
    assert bare.op_bytes == sum(map(len, frame.payloads(1024)))


def test_a_dark_frame_costs_a_packet():
    line = Line.of_baud(1000)
    cost = plan(vd.Frame((3, 5, 7)), line)
    assert (cost.packets, cost.op_bytes, cost.ops) == (1, 0, {})
    assert cost.wire_bytes == 9
    assert line.bytes_per_s == 100
    assert cost.seconds == cost.answer_bytes / 100, "its answers are longer"
    assert cost.frames_per_s == pytest.approx(100 / cost.answer_bytes)
    assert plan(vd.Frame((3, 5, 7)), line, Receiver(refresh_hz=1.5)).frames_per_s == 1.5


def test_the_command_for_a_script(capsys):
    assert main(["plan", "examples/paper-curve.json", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    sizes = {"packets", "op_bytes", "wire_bytes", "answer_bytes"}
    assert set(said) == sizes | {
        "size", "format", "features", "max_payload_bytes", "refresh_hz", "voxels", "line", "ops",
        "lines",
    }  # fmt: skip
    assert said["size"] == [128, 128, 128]
    assert said["features"] == list(EVERY_FEATURE)
    assert said["wire_bytes"] == said["op_bytes"] + 9
    assert [line["line"] for line in said["lines"]] == [line.name for line in COMMON_LINES]
    slow, fast = said["lines"][0], said["lines"][-1]
    assert said["line"] == slow["line"]
    assert {name: said[name] for name in sizes} == {name: slow[name] for name in sizes}
    assert slow["frame_s"] == said["wire_bytes"] / 11_520
    assert slow["frames_per_s"] == pytest.approx(1 / slow["frame_s"])
    assert fast["wire_bytes"] > slow["wire_bytes"]


def test_the_command_asks_a_port(capsys):
    port = "sim:?size=40x40x40&format=mono1&refresh=25&max_payload=100&features=line,arc"
    scene = ["plan", "examples/trefoil.json", "--port", port]
    assert main([*scene, "--baud", "9600", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["size"], said["format"]) == ([40, 40, 40], "mono1")
    assert (said["max_payload_bytes"], said["refresh_hz"]) == (100, 25)
    assert said["features"] == ["line", "arc"]
    assert [line["line"] for line in said["lines"]] == ["9600 Bd"]
    assert main([*scene, "--baud", "auto", "--features", "none"]) == 0
    said = capsys.readouterr().out
    assert "as fast as it is refreshed" in said
    assert "mono1, features: none" in said
    assert "over 115200 Bd" in said, "it has no rate that could be found"


def test_the_command_for_people(capsys):
    assert main(["plan", "examples/sphere.json", "--size", "64x64x64", "--format", "rgb565"]) == 0
    said = capsys.readouterr()
    assert "on a display of 64x64x64 rgb565, with all features" in said.out
    assert "scaled" in said.err
    for word in ("ARC", "packing", "115200 Bd", "USB high speed", " ms"):
        assert word in said.out


def test_the_command_takes_features(capsys):
    scene = ["plan", "examples/paper-curve.json", "--features"]
    assert main([*scene, "box, LINE", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["features"] == ["line", "box"]
    assert main([*scene, " none ", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["features"] == []
    assert main([*scene, "line,bix"]) == 2
    assert "'bix' is not a feature: take of line, box" in capsys.readouterr().err
    offered = [item.value for item in FeaturesType().shell_complete(None, None, "line,o")]
    assert offered == ["line,oct"]
    offered = [item.value for item in FeaturesType().shell_complete(None, None, "")]
    assert offered == ["all", "none", *EVERY_FEATURE]


def test_a_rate_is_found_only_at_a_port(capsys):
    assert main(["plan", "examples/paper-curve.json", "--baud", "auto"]) == 2
    assert "name its --port" in capsys.readouterr().err

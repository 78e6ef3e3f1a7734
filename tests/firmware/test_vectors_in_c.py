"""All vectors of protocol.md on the reference device in C."""

from __future__ import annotations

import c_device
import document
import pytest
from c_device import HELLO, ScriptedDevice, all_features, build, device_of

pytestmark = pytest.mark.skipif(c_device.COMPILER is None, reason="no C compiler (cc)")

LITERALS = document.literals()


def each(kind: str) -> pytest.MarkDecorator:
    vectors = [vector for vector in document.vectors(kind) if not needs_values(vector)]
    return pytest.mark.parametrize("vector", vectors, ids=str)


def needs_values(vector: document.Vector) -> bool:
    """Return whether a device has VALUES, which the reference device does not have."""
    return "VALUES" in dict(vector.lines).get("features", "").split("|")


@each("ops")
def test_ops(vector: document.Vector) -> None:
    with device_of(vector) as device:
        (info,) = device.send(HELLO)
        assert info[0] == 0x90
        (answer,) = device.send(bytes((0x15, 0, 0)) + vector.hex("ops"))
        assert answer[0] == 0x81, answer.hex(" ")
        assert device.lit_voxels(vector.grid, vector["format"].lower()) == vector.voxels()
        assert int.from_bytes(answer[16:20], "little") == vector.integer("digest")


@each("refused")
def test_refused_ops(vector: document.Vector) -> None:
    with device_of(vector) as device:
        device.send(HELLO)
        (answer,) = device.send(bytes((0x15, 0, 0)) + vector.hex("ops"))
        assert answer[0] == 0xB0, answer.hex(" ")
        assert answer[3] == LITERALS[f"CODE_{vector['code']}"]
        assert int.from_bytes(answer[6:8], "little") == vector.integer("offset")
        assert device.lit_voxels(vector.grid, vector["format"].lower()) == {}
        (after,) = device.send(bytes((0x40, 9, 0)))
        assert after[3] == LITERALS["CODE_NO_SESSION"]


@each("dialogue")
def test_dialogues(vector: document.Vector) -> None:
    with device_of(vector) as device:
        document.hold_dialogue(vector.lines, device)


SAMPLE = ((3, 5, 7), "index8")


@pytest.mark.parametrize(
    "vector", [v for v in document.vectors("packet") if v["type"] in {"HELLO", "STATUS"}], ids=str
)
def test_packets_of_the_host(vector: document.Vector) -> None:
    with ScriptedDevice(build(*SAMPLE, all_features("index8"))) as device:
        device.send(HELLO)
        (answer,) = device.send_raw(vector.hex("wire"))
        assert answer[0] >> 4 == {"HELLO": 9, "STATUS": 8}[vector["type"]]


@pytest.mark.parametrize(
    "vector",
    [v for v in document.vectors("packet") if v["type"] == "INFO" and v["name"] == '"cube"'],
    ids=str,
)
def test_info(vector: document.Vector) -> None:
    """The whole of INFO, byte for byte, its COBS included."""
    with device_of_info(vector) as device:
        (answer,) = device.send(HELLO)
        assert answer == vector.hex("packet")[:-4]


def device_of_info(vector: document.Vector) -> ScriptedDevice:
    facts = dict(vector.lines)
    grid = (int(facts["nx"]), int(facts["ny"]), int(facts["nz"]))
    program = build(
        grid,
        facts["format"].lower(),
        frozenset(facts["features"].lower().split("|")),
        max_payload=int(facts["max_payload"]),
        ring=int(facts["rx_buffer"]),
    )
    words = {key: facts[key].strip('"') for key in ("name", "firmware", "serial")}
    return ScriptedDevice(
        program, boot=facts["boot"], refresh=int(facts["refresh"]) / 1000, **words
    )


@each("cobs")
def test_delimiting(vector: document.Vector) -> None:
    """A segment that decodes to no packet is damaged, whatever is in it; short ones are nothing."""
    with ScriptedDevice(build(*SAMPLE, all_features("index8")), refresh=0) as device:
        device.send(HELLO)
        answers = device.send_raw(vector.hex("encoded") + b"\0")
        if len(vector.hex("encoded")) < LITERALS["LIMIT_MIN_SEGMENT"]:
            assert answers == []
        else:
            (ack,) = answers
            assert ack[0] == 0x80
            assert ack[20:22] == b"\1\0"

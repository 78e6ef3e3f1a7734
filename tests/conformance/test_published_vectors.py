"""vectors.json: current, and what protocol.md says, read by another parser."""

import json
import runpy

import document
import pytest
from conftest import ROOT
from vector_device import VectorDevice, features_of

PUBLISHED = json.loads((ROOT / "vectors.json").read_text(encoding="utf-8"))
KINDS = ("cobs", "crc", "packet", "ops", "refused", "dialogue")
VECTORS = [vector for kind in KINDS for vector in document.vectors(kind)]
BY_NAME = {(vector["kind"], vector["vector"]): vector for vector in PUBLISHED["vectors"]}


def test_the_file_is_current():
    tool = runpy.run_path(str(ROOT / "tools" / "vectors_json.py"))
    made = tool["as_text"](tool["collect"](document.TEXT))
    assert made == (ROOT / "vectors.json").read_text(encoding="utf-8"), (
        "run python tools/vectors_json.py"
    )


def test_all_vectors_are_published():
    assert BY_NAME.keys() == {(vector.kind, vector.name) for vector in VECTORS}
    assert len(BY_NAME) == len(PUBLISHED["vectors"])


@pytest.mark.parametrize("vector", VECTORS, ids=str)
def test_a_vector_is_the_documents(vector):
    published = BY_NAME[vector.kind, vector.name]
    keys = {key for key, _ in vector.lines} - {"host", "raw", "tick", "device", "page"}
    for key in keys & {"decoded", "encoded", "bytes", "crc", "packet", "wire", "ops"}:
        assert bytes.fromhex(published[key]) == vector.hex(key)
    for key in keys & {"digest", "offset", "refresh", "seq", "frame", "rx_buffer"}:
        assert published[key] == vector.integer(key)
    if "grid" in keys:
        assert tuple(published["grid"]) == vector.grid
        otherwise = {"READ", "DIGEST"} if vector.kind == "dialogue" else None
        features = {name.lower() for name in published["features"]}
        assert features == features_of(vector, otherwise)
    if "voxels" in keys:
        voxels = {(x, y, z): bytes.fromhex(pixel) for x, y, z, pixel in published["voxels"]}
        assert voxels == vector.voxels()


@pytest.mark.parametrize("vector", document.vectors("dialogue"), ids=str)
def test_a_published_dialogue_is_held(vector):
    """A reader of the JSON alone: the emulator answers it step by step."""
    published = BY_NAME["dialogue", vector.name]
    names = ("boot", "max_payload", "rx_buffer", "refresh", "name", "firmware", "serial")
    device = VectorDevice(
        tuple(published["grid"]),
        published["format"],
        features=frozenset(name.lower() for name in published["features"]),
        **{name: published[name] for name in names},
    )
    answers = []
    for step in published["steps"]:
        if "device" in step or "page" in step:
            answer = answers.pop(0).hex()
            start = step.get("device", step.get("page"))
            assert answer[: len(start)] == start
            assert "more" in step or "page" in step or answer == start
            continue
        assert answers == []
        if "host" in step:
            answers = device.send(bytes.fromhex(step["host"]))
        elif "raw" in step:
            answers = device.send_raw(bytes.fromhex(step["raw"]))
        else:
            assert step == {"tick": True}
            answers = device.tick()
    assert answers == []

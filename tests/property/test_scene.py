"""Arbitrary scene files: each is a scene or a SceneError that fits its place."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from voxdisplay.curves import Curve
from voxdisplay.errors import SceneError
from voxdisplay.scene import read_scene
from voxdisplay.scene.objects import TYPES, Object, SceneFile
from voxdisplay.scene.schema import schema
from voxdisplay.scene.type_mismatch import find_mismatch

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = [json.loads(path.read_text()) for path in sorted(FOLDER.glob("*.json"))]
KEYS = sorted(
    {key for scene_object in TYPES.values() for key in scene_object.__struct_fields__}
    | {"from", "to"}
)

SCHEMA = jsonschema.Draft202012Validator(schema())

values = st.recursive(
    st.none()
    | st.booleans()
    | st.floats()
    | st.integers()
    | st.text(max_size=9)
    | st.sampled_from(["t", "1e308*10", "2*pi", "red", "sphere.csv", "../examples/sphere.csv"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(KEYS), inner),
    max_leaves=8,
)


def read(data: str | bytes) -> None:
    try:
        scene = read_scene(data, folder=FOLDER)
    except SceneError as error:
        message = f"{error} {error.hint} {error.path}"
        assert len(message.encode()) < 2000
    else:
        for item in scene.items:
            if not isinstance(item.shape, Curve):
                continue
            t = np.linspace(*item.curve.t_range, 3)
            with np.errstate(all="ignore"):
                assert item.curve.position(t).shape == (3, 3)


@settings(deadline=None)
@given(st.binary() | st.text())
def test_any_bytes(data: bytes | str) -> None:
    read(data)


@settings(deadline=None)
@given(st.sampled_from(sorted(TYPES)), st.dictionaries(st.sampled_from(KEYS), values))
def test_any_keys_and_values(kind: str, content: dict[str, Any]) -> None:
    read(json.dumps(content | {"type": kind}))
    read(json.dumps({"objects": [content | {"type": kind}]}))


@settings(deadline=None)
@given(
    st.sampled_from(sorted(TYPES)) | st.none() | st.text(max_size=3),
    st.dictionaries(st.sampled_from([*KEYS, "size", "params", "objects"]), values),
)
def test_mismatches_are_those_that_msgspec_refuses(kind: str | None, keys: dict[str, Any]) -> None:
    for value, annotation in (
        (keys | {"type": kind}, Object),
        ({"objects": [keys | {"type": kind}]}, SceneFile),
        (keys | {"objects": []}, SceneFile),
    ):
        try:
            msgspec.convert(value, annotation)
            fits = True
        except msgspec.ValidationError:
            fits = False
        assert (find_mismatch(value, annotation) is None) == fits
        if "color" not in keys:  # there, 1.0 is no whole number to msgspec
            assert SCHEMA.is_valid(value) == fits or (annotation is Object and "objects" in keys)


@settings(deadline=None)
@given(st.binary(max_size=30), st.integers(0, 10**6))
def test_damaged_examples(noise: bytes, seed: int) -> None:
    rng = random.Random(seed)
    data = bytearray(json.dumps(rng.choice(EXAMPLES), indent=1).encode())
    at = rng.randrange(len(data))
    data[at : at + rng.randrange(4)] = noise[: rng.randrange(1, 5)]
    lines = bytes(data).decode("utf-8", "replace").split("\n")
    found = None
    try:
        read_scene(bytes(data), folder=FOLDER)
    except SceneError as error:
        found = error
    if found is not None and found.line is not None and found.column is not None:
        assert 1 <= found.column <= len(lines[found.line - 1]) + 1


@settings(deadline=None)
@given(st.data())
def test_examples_with_a_part_replaced(data: st.DataObject) -> None:
    scene = json.loads(json.dumps(data.draw(st.sampled_from(EXAMPLES))))
    part, depth = scene, data.draw(st.integers(0, 4))
    while True:
        keys = list(part) if isinstance(part, dict) else list(range(len(part)))
        key = data.draw(st.sampled_from(keys))
        if depth == 0 or not isinstance(part[key], dict | list) or not part[key]:
            break
        part, depth = part[key], depth - 1
    part[key] = data.draw(values)
    read(json.dumps(scene))

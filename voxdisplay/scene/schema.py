"""The JSON Schema of scene files, derived from `objects`.

It is published as ``voxdisplay/scene.schema.json``, for editors; reading a scene does not use it.
``python -m voxdisplay.scene.schema > voxdisplay/scene.schema.json`` renews it.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import msgspec

from voxdisplay.scene.objects import Color, Formula, Number, Object, SceneFile, Vector

# Parts that recur, and are written once.
_SHARED = {
    f"#/$defs/{name}": msgspec.json.schema(kind)
    for name, kind in (
        ("Number", Number),
        ("Vector", Vector),
        ("Formula", Formula),
        ("Color", Color),
    )
}


def schema() -> dict[str, Any]:
    """Give the JSON Schema: a scene, if there is the key ``objects``, or else one object."""
    (scene, thing), things = msgspec.json.schema_components((SceneFile, Object))
    shared = {name.rpartition("/")[2]: part for name, part in _SHARED.items()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "voxdisplay scene",
        "type": "object",
        # Not anyOf, which would answer a mistake with the complaints of every type.
        "if": {"required": ["objects"]},
        "then": scene,
        "else": thing,
        "$defs": {
            name: {key: _referring(value) for key, value in part.items()}
            for name, part in (shared | things).items()
        },
    }


def _referring(part: Any) -> Any:
    """Replace shared parts by references to them."""
    if isinstance(part, list):
        return [_referring(each) for each in part]
    if not isinstance(part, dict):
        return part
    bare = {key: value for key, value in part.items() if key != "default"}
    for name, shared in _SHARED.items():
        if bare == shared:
            kept = {"default": part["default"]} if "default" in part else {}
            return {"$ref": name} | kept
    return {key: _referring(value) for key, value in part.items()}


def text() -> str:
    """Give the text of the published schema."""
    return json.dumps(schema(), indent=1) + "\n"


if __name__ == "__main__":
    sys.stdout.write(text())

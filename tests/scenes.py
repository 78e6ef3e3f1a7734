"""Scenes of one object of each type of curve, read from JSON text."""

from __future__ import annotations

import json
from typing import Any

import pytest

from voxdisplay.errors import SceneError
from voxdisplay.scene import Scene, read_scene

SEGMENT = {"type": "segment", "from": [1, 2, 3], "to": [4, 5, 6]}
PARAMETRIC = {"type": "parametric", "x": "t", "y": 0, "z": 0, "t": [0, 1]}
POINTS = [[1, 2, 3], [4, 2, 1], [4, 6, 1], [0, 6, 5]]

ONE_OF_EACH: list[dict[str, Any]] = [
    PARAMETRIC | {"dx": 1, "dy": "0", "dz": "0*t"},
    SEGMENT,
    {"type": "polyline", "points": POINTS},
    {"type": "arc", "center": [1, 2, 3], "radius": 2, "start": 0, "end": "90*deg"},
    {"type": "circle", "center": [1, 2, 3], "radius": 2, "normal": [1, 0, 0]},
    {"type": "ellipse", "center": [1, 2, 3], "axes": [[1, 0, 0], [0, 2, 0]]},
    {"type": "helix", "center": [1, 2, 3], "radius": 2, "pitch": 1, "turns": 2, "start": "pi"},
    {"type": "lissajous", "center": [1, 2, 3], "amplitude": [1, 2, 3], "frequency": [3, 4, 5]},
    {"type": "torus_knot", "p": 2, "q": 3, "center": [1, 2, 3], "major": 3, "minor": 1},
    {"type": "bezier", "points": POINTS},
    {"type": "bspline", "points": POINTS, "degree": 2, "weights": [1, 2, 2, 1]},
    {"type": "catmull_rom", "points": POINTS, "closed": True},
    {"type": "points", "points": POINTS},
]


def scene_of(*objects: dict[str, Any], **more: Any) -> Scene:
    return read_scene(json.dumps({"objects": objects} | more))


def refused(data: object, **options: Any) -> SceneError:
    """Read a scene that must be refused, in few words."""
    text = data if isinstance(data, str | bytes) else json.dumps(data)
    with pytest.raises(SceneError) as caught:
        read_scene(text, **options)
    assert len(str(caught.value)) < 400
    str(caught.value).encode()
    return caught.value

"""Colour maps by a value: every type of object takes the names that it has, and no other."""

import json
from pathlib import Path

import pytest
from scenes import ONE_OF_EACH

import voxdisplay as vd

SIZE = [17, 18, 19]
CURVE = {"t", "s"}
SURFACE = {"u", "v"}
C = [8, 9, 10]
LINE = {"type": "segment", "from": [4, 4, 4], "to": [9, 9, 9]}
CORNERS = [[1.5, 1.5, 1.5], [7.5, 1.5, 1.5], [1.5, 7.5, 1.5], [1.5, 1.5, 7.5]]
# Each body with the names that its surface has besides x, y and z.
BODIES = [
    ({"type": "surface", "x": "8 + 4*cos(u)", "y": "8 + 4*sin(u)", "z": "v", "u": [0, 6],
      "v": [3, 9]}, SURFACE),
    ({"type": "height_field", "z": "x + y/2", "x": [0, 9], "y": [0, 5]}, set()),
    ({"type": "implicit", "f": "(x-8)**2 + (y-8)**2 + (z-8)**2 - 36"}, set()),
    ({"type": "plane", "point": C, "normal": [1, 1, 1]}, SURFACE),
    ({"type": "disc", "center": C, "radius": 5, "normal": [1, 1, 1]}, SURFACE),
    ({"type": "triangle", "points": [CORNERS[0], CORNERS[1], [1.5, 7.5, 9.5]]}, set()),
    ({"type": "polygon", "points": [[1, 1, 1], [9, 1, 1], [9, 9, 9], [1, 9, 9]]}, set()),
    ({"type": "sphere", "center": C, "radius": 5}, SURFACE),
    ({"type": "ellipsoid", "center": C, "radii": [5, 4, 3]}, SURFACE),
    ({"type": "spherical_triangle", "center": C, "radius": 6,
      "corners": [[9, 9, 10], [8, 10, 10], [8, 9, 11]]}, SURFACE),
    ({"type": "box", "from": [1, 2, 3], "to": [7, 8, 9]}, set()),
    ({"type": "cylinder", "from": [4, 4, 2], "to": [4, 4, 9], "radius": 3}, SURFACE),
    ({"type": "cone", "from": [4, 4, 2], "to": [4, 4, 9], "radius": 3}, SURFACE),
    ({"type": "torus", "center": C, "major": 5, "minor": 2, "normal": [0, 1, 1]}, SURFACE),
    ({"type": "tube", "along": LINE, "radius": 2}, CURVE),
    ({"type": "scatter", "points": [[1, 2, 3], [4, 5, 6]]}, set()),
    ({"type": "mesh", "vertices": CORNERS, "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]},
     set()),
    ({"type": "text", "text": "Ab", "at": [1, 2, 3], "height": 8, "up": [0, 0, 1]}, set()),
    ({"type": "group", "objects": [LINE]}, set()),
]  # fmt: skip
CASES = [(each, CURVE) for each in ONE_OF_EACH] + BODIES


def colors_by(item, by):
    """How many colours a thing has that is coloured by a name."""
    colored = item | {"color": {"map": ["#010101", "#ffffff"], "by": by}}
    scene = vd.read_scene(json.dumps({"size": SIZE, "objects": [colored]}))
    frame = vd.Frame(tuple(SIZE))
    frame.draw(scene)
    return len({tuple(color) for color in frame.lit_rgb().tolist()})


@pytest.mark.parametrize(("item", "own"), CASES, ids=[item["type"] for item, _ in CASES])
def test_a_map_takes_the_names_of_its_object_alone(item, own):
    assert colors_by(item, "x + 2*y + 3*z") > 1
    for by in sorted(CURVE | SURFACE | {"value"}):
        if by in own:
            assert colors_by(item, by) > 1, by
        else:
            with pytest.raises(vd.SceneError) as caught:
                colors_by(item, by)
            assert "color.by" in str(caught.value)
            assert repr(by) in str(caught.value)


def test_no_type_is_missing():
    schema = json.loads(Path(vd.__file__).with_name("scene.schema.json").read_text())
    types = set()

    def collect(node):
        if isinstance(node, dict):
            constant = node.get("properties", {}).get("type", {})
            types.update(constant.get("enum", [constant["const"]] if "const" in constant else []))
            for child in node.values():
                collect(child)
        elif isinstance(node, list):
            for child in node:
                collect(child)

    collect(schema)
    # A volume is coloured by its values: tests/unit/scene/test_body_objects.py.
    assert types - {"volume"} == {item["type"] for item, _ in CASES}

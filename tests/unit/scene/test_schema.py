"""The published schema of scene files."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from scenes import ONE_OF_EACH, SEGMENT, refused, scene_of

from voxdisplay import curves
from voxdisplay.scene import load_scene, schema

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.json"))


class TestSchema:
    PUBLISHED = resources.files("voxdisplay").joinpath("scene.schema.json").read_text("utf-8")
    VALIDATOR = jsonschema.Draft202012Validator(json.loads(PUBLISHED))

    def test_it_is_current(self) -> None:
        assert schema.text() == self.PUBLISHED, schema.__doc__

    def test_it_is_a_schema(self) -> None:
        jsonschema.Draft202012Validator.check_schema(self.VALIDATOR.schema)

    @pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
    def test_examples_are_valid_and_can_be_drawn(self, path: Path) -> None:
        self.VALIDATOR.validate(json.loads(path.read_text()))
        scene = load_scene(path)
        assert scene.size
        assert scene.items
        for item in scene.items:
            if not isinstance(item.shape, curves.Curve):
                continue
            t = np.linspace(*item.curve.t_range, 1000)
            points = item.curve.position(t)
            assert (points >= 0).all()
            # The paper's own curve sticks out of the top, by two voxels.
            assert (points < np.array(scene.size)[:, None] + 2 * ("paper" in path.name)).all()

    @pytest.mark.parametrize(
        "scene_object", ONE_OF_EACH, ids=lambda scene_object: scene_object["type"]
    )
    def test_every_type_is_valid(self, scene_object: dict[str, Any]) -> None:
        self.VALIDATOR.validate(scene_object)
        self.VALIDATOR.validate({"objects": [scene_object], "params": {"a": 1, "b": "a"}})

    @pytest.mark.parametrize(
        "data",
        [
            {},
            [],
            {"objects": [], "sise": [1, 2, 3]},
            {"objects": [SEGMENT | {"colour": "red"}]},
            SEGMENT | {"colour": "red"},
            SEGMENT | {"type": "cube"},
            SEGMENT | {"to": [1, 2]},
            SEGMENT | {"to": [1, 2, None]},
            {"objects": [], "size": [1, 2, 0]},
        ],
    )
    def test_what_is_refused_is_invalid(self, data: Any) -> None:
        assert not self.VALIDATOR.is_valid(data)
        refused(data)

    @pytest.mark.parametrize(
        ("data", "path", "message"),
        [
            (SEGMENT | {"colour": "red"}, "$", "'colour' was unexpected"),
            (
                {"objects": [SEGMENT, SEGMENT | {"colr": 1}]},
                "$.objects[1]",
                "'colr' was unexpected",
            ),
            (SEGMENT | {"to": [1, 2, True]}, "$.to[2]", "True is not of type 'number', 'string'"),
            (SEGMENT | {"to": [1, 2]}, "$.to", "[1, 2] is too short"),
            (SEGMENT | {"closed": 1}, "$.closed", "1 is not of type 'boolean', 'null'"),
            (SEGMENT | {"color": ["red", [1, 2]]}, "$.color[1]", "[1, 2] is too short"),
            (SEGMENT | {"type": "segmnt"}, "$.type", "'segmnt' is not one of ['parametric'"),
            ({"objects": [{"type": "cube"}]}, "$.objects[0].type", "'cube' is not one of"),
            ({"objects": [{"from": [1, 2, 3]}]}, "$.objects[0]", "'type' is a required property"),
            ({"type": "segment", "from": [1, 2, 3]}, "$", "'to' is a required property"),
            ({"type": "points", "gaps": "x"}, "$.gaps", "'x' is not one of ['split'"),
            ({"objects": [], "size": 64}, "$.size", "64 is not of type 'array', 'null'"),
            ({"objects": [], "size": [1, 2, 0.5]}, "$.size[2]", "0.5"),
            ({}, "$", "'objects' is a required property"),
            ([], "$", "[] is not of type 'object'"),
            ({"objects": [SEGMENT | {"$schema": "s"}]}, "$.objects[0]", "does not allow 's'"),
        ],
    )
    def test_a_validator_reports_the_mistake_itself(
        self, data: Any, path: str, message: str
    ) -> None:
        error = jsonschema.exceptions.best_match(self.VALIDATOR.iter_errors(data))
        assert error is not None
        assert error.json_path == path
        assert message in error.message

    def test_no_part_has_alternatives(self) -> None:
        assert not any(f'"{word}"' in self.PUBLISHED for word in ("anyOf", "oneOf"))

    def test_every_type_and_key_has_a_title_and_a_description(self) -> None:
        published = json.loads(self.PUBLISHED)
        assert published["$id"]
        for name, part in published["$defs"].items():
            assert part["title"], name
            assert part["description"], name
            for key, value in part.get("properties", {}).items():
                found = value
                while "$ref" in found:
                    assert set(found) <= {"$ref", "default"}, "editors overlook other text"
                    found = published["$defs"][found["$ref"].rpartition("/")[2]]
                assert found["title"], (name, key)
                assert found["description"], (name, key)

    def test_files_of_one_object_may_name_the_schema(self) -> None:
        self.VALIDATOR.validate(SEGMENT | {"$schema": "scene.schema.json"})

    def test_every_curve_has_a_type(self) -> None:
        kinds = {type(scene_of(scene_object).items[0].curve) for scene_object in ONE_OF_EACH}
        public = {getattr(curves, name) for name in curves.__all__}
        assert public - kinds == {curves.Curve, curves.Transformed}


def test_importing_is_light() -> None:
    code = "import voxdisplay.scene, sys; print('jsonschema' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"

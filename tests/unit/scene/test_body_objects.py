"""Bodies in scene files: their keys, files and colours, and what is drawn of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import voxdisplay as vd
from voxdisplay.bodies import Body
from voxdisplay.errors import SceneError
from voxdisplay.scene import Scene, load_scene, read_scene, reader, schema

C = [8, 9, 10]
CORNERS = [[1.5, 1.5, 1.5], [7.5, 1.5, 1.5], [1.5, 7.5, 1.5], [1.5, 1.5, 7.5]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]

LINE = {"type": "segment", "from": [4, 4, 4], "to": [9, 4, 4]}

BODIES: list[dict[str, Any]] = [
    {"type": "surface", "x": "8 + 4*cos(u)", "y": "8 + 4*sin(u)", "z": "v", "u": [0, 6],
     "v": [3, 9]},
    {"type": "height_field", "z": "x + y/2", "x": [0, 9], "y": [0, 5]},
    {"type": "implicit", "f": "(x-8)**2 + (y-8)**2 + (z-8)**2 - 36"},
    {"type": "plane", "point": C, "normal": [1, 1, 0]},
    {"type": "disc", "center": C, "radius": 5},
    {"type": "triangle", "points": CORNERS[:3]},
    {"type": "polygon", "points": [[1, 1, 1], [9, 1, 1], [9, 9, 1], [5, 5, 1]]},
    {"type": "sphere", "center": C, "radius": 5, "fill": "solid"},
    {"type": "ellipsoid", "center": C, "radii": [5, 4, 3]},
    {"type": "spherical_triangle", "center": C, "radius": 6,
     "corners": [[9, 9, 10], [8, 10, 10], [8, 9, 11]]},
    {"type": "box", "from": [1, 2, 3], "to": [7, 8, 9]},
    {"type": "cylinder", "from": [4, 4, 2], "to": [4, 4, 9], "radius": 3},
    {"type": "cone", "from": [4, 4, 2], "to": [4, 4, 9], "radius": 3},
    {"type": "torus", "center": C, "major": 5, "minor": 2, "normal": [0, 1, 1]},
    {"type": "tube", "along": {"type": "segment", "from": [4, 4, 4], "to": [9, 9, 9]},
     "radius": "2 + t"},
    {"type": "scatter", "points": [[1, 2, 3], [4, 5, 6]]},
    {"type": "mesh", "vertices": CORNERS, "faces": FACES},
    {"type": "text", "text": "Ab", "at": [1, 2, 3], "height": 8},
]  # fmt: skip
FROM_FILES = {"volume"}


def scene_of(*objects: dict[str, Any], **more: Any) -> Scene:
    return read_scene(json.dumps({"size": [17, 18, 19], "objects": objects} | more))


def voxels_of(*objects: dict[str, Any], **more: Any) -> list[list[int]]:
    (found,) = scene_of(*objects, **more).voxelize(clip=(17, 18, 19))
    return sorted(found.voxels.tolist())


def refused(*objects: dict[str, Any], **more: Any) -> SceneError:
    with pytest.raises(SceneError) as caught:
        scene_of(*objects, **more).voxelize()
    assert len(str(caught.value)) < 400
    return caught.value


@pytest.mark.parametrize("scene_object", BODIES, ids=lambda each: each["type"])
class TestEveryType:
    def test_it_is_drawn(self, scene_object: dict[str, Any]) -> None:
        scene = scene_of(scene_object)
        (item,) = scene.items
        assert item.type == scene_object["type"]
        assert isinstance(item.shape, Body)
        frame = vd.Frame((17, 18, 19))
        assert frame.draw(scene).voxels > 0
        with pytest.raises(TypeError, match="no curve"):
            item.curve  # noqa: B018

    def test_it_is_valid(self, scene_object: dict[str, Any]) -> None:
        validator = jsonschema.Draft202012Validator(schema.schema())
        validator.validate(scene_object)
        assert not validator.is_valid(scene_object | {"qqq": 1})

    def test_every_number_may_be_an_expression(self, scene_object: dict[str, Any]) -> None:
        def expressed(value: Any) -> Any:
            if isinstance(value, list):
                return [expressed(each) for each in value]
            return f"one*{value}" if isinstance(value, int | float) else value

        written = {key: expressed(value) for key, value in scene_object.items()}
        assert voxels_of(written, params={"one": "2 - 1"}) == voxels_of(scene_object)

    def test_it_can_be_moved_turned_and_scaled(self, scene_object: dict[str, Any]) -> None:
        if scene_object["type"] in {"plane", "implicit"}:
            pytest.skip("has no end in the volume")
        moved = voxels_of(scene_object | {"transform": [{"translate": [2, 1, 3]}]})
        assert moved == [[x + 2, y + 1, z + 3] for x, y, z in voxels_of(scene_object)]
        turn = {"rotate": [0, 0, 1], "angle": "0.3", "about": C}
        turned = voxels_of(scene_object | {"transform": [turn, {"scale": 0.9, "about": C}]})
        assert len(turned) > 1

    def test_it_follows_a_display(self, scene_object: dict[str, Any]) -> None:
        frame = vd.Frame((34, 36, 38))
        assert frame.draw(scene_of(scene_object)).voxels >= len(voxels_of(scene_object))


def test_a_thick_curve_is_a_solid_tube() -> None:
    tube = {"type": "tube", "along": LINE, "radius": 2, "fill": "solid"}
    assert voxels_of(LINE | {"thickness": "2*2"}) == voxels_of(tube)
    (item,) = scene_of(LINE | {"thickness": 4}).items
    assert item.type == "segment"


def test_the_curve_in_a_tube_may_be_turned() -> None:
    turned = LINE | {"transform": [{"translate": [1, 2, 3]}]}
    moved = {"type": "tube", "along": LINE, "radius": 2, "transform": turned["transform"]}
    assert voxels_of({"type": "tube", "along": turned, "radius": 2}) == voxels_of(moved)


def test_every_type_is_tried() -> None:
    curves = {name for name, kind in reader.TYPES.items() if "closed" in kind.__struct_fields__}
    tried = {each["type"] for each in BODIES} | FROM_FILES | {"group"} | curves
    assert tried == set(reader.TYPES)


class TestMistakes:
    @pytest.mark.parametrize(
        ("scene_object", "path", "message"),
        [
            ({"type": "sphere", "center": C, "radius": 0}, ".radius", "must be positive"),
            ({"type": "sphere", "center": C, "radius": 1, "fill": "full"}, ".fill", "'full'"),
            ({"type": "ellipsoid", "center": C}, "", "either the key 'radii' or 'radius'"),
            ({"type": "ellipsoid", "center": C, "radii": [1, 2, 0]}, ".radii[2]", "positive"),
            ({"type": "plane", "point": C, "normal": [0, 0, 0]}, ".normal", "normal"),
            (
                {"type": "surface", "x": "u", "y": "v", "z": "t", "u": [0, 1], "v": [0, 1]},
                ".z",
                "'t'",
            ),
            (
                {"type": "surface", "x": "u", "y": "v", "z": 1, "u": [1, 0], "v": [0, 1]},
                ".u",
                "backwards",
            ),
            ({"type": "implicit", "f": "x + q"}, ".f", "unknown name 'q'"),
            ({"type": "implicit", "f": "t"}, ".f", "'t'"),
            ({"type": "height_field", "z": "z", "x": [0, 1], "y": [0, 1]}, ".z", "'z'"),
            ({"type": "height_field", "z": "x", "x": [1, 0], "y": [0, 1]}, ".x", "backwards"),
            ({"type": "triangle", "points": CORNERS}, ".points", "three points"),
            ({"type": "polygon", "points": CORNERS}, ".points[", "away from the plane"),
            ({"type": "torus", "center": C, "major": 5, "minor": 0}, ".minor", "positive"),
            ({"type": "tube", "along": {"type": "sphere"}, "radius": 1}, ".along.type", "'sphere'"),
            (
                {"type": "tube", "along": LINE | {"color": "red"}, "radius": 1},
                ".along.color",
                "tube",
            ),
            (
                {"type": "tube", "along": LINE | {"to": [1, 2, "q"]}, "radius": 1},
                ".along.to[2]",
                "'q'",
            ),
            ({"type": "tube", "along": LINE, "radius": "u"}, ".radius", "'u'"),
            ({"type": "tube", "along": LINE, "radius": -1}, ".radius", "positive"),
            (LINE | {"thickness": 0}, ".thickness", "positive"),
            ({"type": "scatter"}, "", "either the key 'points' or the key 'file'"),
            ({"type": "scatter", "points": [[1, 2, 3]], "gaps": "split"}, "", "'gaps'"),
            ({"type": "mesh"}, "", "needs the key 'file', or both"),
            ({"type": "mesh", "file": "a.obj", "faces": []}, "", "either the key 'file'"),
            ({"type": "mesh", "file": "a.obj"}, ".file", "no folder"),
            ({"type": "mesh", "vertices": CORNERS, "faces": [[0, 1]]}, ".faces[0]", "at least 3"),
            (
                {"type": "mesh", "vertices": CORNERS, "faces": [[0, 1, 4]]},
                ".faces[0][2]",
                "from 0 to 3",
            ),
            ({"type": "mesh", "vertices": CORNERS, "faces": []}, ".faces", "no triangle"),
            ({"type": "volume", "file": "a.npy"}, ".file", "no folder"),
            ({"type": "text", "text": "", "at": C, "height": 3}, ".text", "no letters"),
            ({"type": "text", "text": "a", "at": C, "height": 0}, ".height", "above 0"),
            ({"type": "text", "text": "a", "at": C, "height": 3, "font": "a"}, ".font", "folder"),
        ],
        ids=str,
    )
    def test_where_and_what(self, scene_object: dict[str, Any], path: str, message: str) -> None:
        error = refused(scene_object)
        assert error.path.startswith(f"$.objects[0]{path}")
        assert message in str(error)
        assert error.line


class TestFiles:
    @pytest.fixture
    def folder(self, tmp_path: Path) -> Path:
        folder = tmp_path / "scene"
        folder.mkdir()
        np.save(folder / "v.npy", np.arange(3 * 5 * 7, dtype=np.float32).reshape(3, 5, 7))
        lines = [f"v {x} {y} {z}" for x, y, z in CORNERS]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]
        (folder / "m.obj").write_text("\n".join(lines))
        (folder / "p.csv").write_text("heat [C],x,y,z\n5,1,2,3\n9,4,5,6\n,7,8,9\n")
        (tmp_path / "outside.obj").write_text("v 0 0 0")
        return folder

    def load(self, folder: Path, *objects: dict[str, Any], **more: Any) -> Scene:
        path = folder / "scene.json"
        path.write_text(json.dumps({"objects": objects} | more))
        return load_scene(path)

    def test_a_mesh_fills_the_volume_less_a_margin(self, folder: Path) -> None:
        scene = self.load(folder, {"type": "mesh", "file": "m.obj"}, size=[17, 18, 19])
        (found,) = scene.voxelize()
        low, high = found.voxels.min(axis=0).tolist(), found.voxels.max(axis=0).tolist()
        assert min(low) in {0, 1}
        assert np.abs(np.add(low, high) - [16, 17, 18]).max() <= 2
        assert max(np.subtract(high, low).tolist()) in {14, 15, 16}

    def test_without_a_size_the_volume_is_the_default_one(self, folder: Path) -> None:
        scene = self.load(folder, {"type": "mesh", "file": "m.obj"})
        assert scene.size == (128, 128, 128)
        assert self.load(folder, {"type": "sphere", "center": C, "radius": 2}).size is None

    def test_into_a_box(self, folder: Path) -> None:
        box = [[2.5, 3.5, 4.5], [8.5, 9.5, 10.5]]
        scene = self.load(folder, {"type": "mesh", "file": "m.obj", "into": box}, size=[17, 18, 19])
        (found,) = scene.voxelize()
        assert (found.voxels >= [2, 3, 4]).all()
        assert (found.voxels <= [8, 9, 10]).all()

    def test_a_volume_has_values(self, folder: Path) -> None:
        scene = self.load(
            folder,
            {"type": "volume", "file": "v.npy", "into": [[0, 0, 0], [7, 5, 3]], "threshold": 10,
             "color": {"map": ["black", "white"], "by": "value", "range": [0, 255]}},
            size=[7, 5, 3],
        )  # fmt: skip
        frame = vd.Frame((7, 5, 3))
        frame.draw(scene)
        values = np.arange(105).reshape(3, 5, 7)
        lit = frame.array()[..., 0]
        assert (lit[values >= 10] == values[values >= 10]).all()
        assert not lit[values < 10].any()

    @pytest.mark.parametrize("name", ["../outside.obj", "/etc/passwd", "no.obj", "m.xyz"])
    def test_other_files_are_refused(self, folder: Path, name: str) -> None:
        with pytest.raises(SceneError) as caught:
            self.load(folder, {"type": "mesh", "file": name})
        assert caught.value.path == "$.objects[0].file"

    @pytest.mark.parametrize("kind", ["points", "scatter"])
    def test_columns_colour_points(self, folder: Path, kind: str) -> None:
        color = {"map": ["black", "white"], "by": "heat", "range": [0, 255]}
        scene = self.load(folder, {"type": kind, "file": "p.csv", "color": color}, size=[9, 9, 11])
        frame = vd.Frame((9, 9, 11))
        frame.draw(scene)
        reds = [int(frame.array()[z, y, x, 0]) for x, y, z in ([1, 2, 3], [4, 5, 6], [7, 8, 9])]
        assert reds == [5, 9, 0]

    def test_columns_in_a_moving_scene(self, folder: Path) -> None:
        color = {"map": ["black", "white"], "by": "heat*(1 + time)", "range": [0, 255]}
        points = {"type": "points", "file": "p.csv", "color": color}
        scene = self.load(folder, points, size=[9, 9, 11], duration=2)
        show = scene.show_on(vd.Frame((9, 9, 11)))
        assert [show.frame(n).array()[3, 2, 1, 0] for n in (0, 30, 59)] == [5, 10, 15]

    def test_a_column_that_is_not_there(self, folder: Path) -> None:
        color = {"map": "gray", "by": "hat"}
        with pytest.raises(SceneError, match="unknown name 'hat'") as caught:
            self.load(folder, {"type": "scatter", "file": "p.csv", "color": color})
        assert caught.value.path == "$.objects[0].color.by"


class TestColors:
    def drawn(self, *objects: dict[str, Any], **more: Any) -> np.ndarray[Any, Any]:
        frame = vd.Frame((17, 18, 19))
        frame.draw(scene_of(*objects, **more))
        array: np.ndarray[Any, Any] = frame.array()
        return array

    def test_several_run_from_the_lowest_voxel_to_the_highest(self) -> None:
        box = {"type": "box", "from": [1, 2, 3], "to": [7, 8, 7.5]}
        box["color"] = ["#000", "#fff"]
        pixels = self.drawn(box)
        assert pixels[3:8, 2, 1, 0].tolist() == [0, 64, 128, 191, 255]

    def test_as_many_as_points_colour_those(self) -> None:
        points = [[1, 2, 9], [4, 5, 6], [7, 8, 3]]
        scatter = {"type": "scatter", "points": points, "color": ["red", "lime", "blue"]}
        pixels = self.drawn(scatter)
        colors = [pixels[z, y, x].tolist() for x, y, z in points]
        assert colors == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]

    def test_coordinates_are_those_of_the_scene(self) -> None:
        color = {"map": ["#000", "#fff"], "by": "z", "range": [0, 19]}
        scene = scene_of({"type": "box", "from": [0, 0, 0], "to": [17, 18, 19], "color": color})
        frame = vd.Frame((34, 36, 38))
        frame.draw(scene)
        column = frame.array()[:, 0, 0, 0].astype(int)
        expected = np.floor(np.round(np.arange(0.25, 19, 0.5) / 19 * 255) + 0.0)
        assert np.abs(column - expected).max() <= 1

    def test_a_map_by_the_parameter_of_a_curve(self) -> None:
        line = {"type": "segment", "from": [0.5, 3.5, 3.5], "to": [10.5, 3.5, 3.5]}
        for by in ("t", "s", "(x - 0.5)/10", "k*0 + s"):
            color = {"map": ["#000", "#c8c8c8"], "by": by, "range": [0, 1]}
            pixels = self.drawn(line | {"color": color, "repeat": {"k": 1}})
            assert np.abs(pixels[3, 3, :11, 0].astype(int) - 20 * np.arange(11)).max() <= 1

    def test_without_a_range_the_values_of_the_object_decide(self) -> None:
        ball = {"type": "sphere", "center": C, "radius": 5}
        pixels = self.drawn(ball | {"color": {"map": ["#010101", "#fff"], "by": "z"}})
        lit = pixels[pixels.any(axis=-1)]
        assert (lit.min(), lit.max()) == (1, 255)

    @pytest.mark.parametrize(
        ("color", "path", "message"),
        [
            ({"map": "viridi", "by": "z"}, ".color.map", "viridi"),
            ({"map": "viridis", "by": "q"}, ".color.by", "unknown name 'q'"),
            ({"map": "viridis", "by": "t"}, ".color.by", "'t'"),
            ({"map": "viridis"}, ".color", "the key 'by' is missing"),
            ({"map": "viridis", "by": "z", "range": [0]}, ".color.range", "two numbers"),
            ({"map": "viridis", "by": "z", "rang": [0, 1]}, ".color", "unknown key 'rang'"),
        ],
        ids=str,
    )
    def test_mistakes(self, color: dict[str, Any], path: str, message: str) -> None:
        error = refused({"type": "sphere", "center": C, "radius": 5, "color": color})
        assert error.path == f"$.objects[0]{path}"
        assert message in str(error)


class TestColoursByParameters:
    """Angles and shares of primitives, and of tubes along their curves."""

    SIZE = (17, 18, 19)

    def colors_of(self, scene_object: dict[str, Any], by: str) -> tuple[np.ndarray, np.ndarray]:
        coloring = {"map": "gray", "by": by, "range": [0, 1]}
        scene = scene_of(scene_object | {"color": coloring})
        (found,) = scene.voxelize(clip=self.SIZE)
        frame = vd.Frame(self.SIZE)
        frame.draw(scene)
        x, y, z = found.voxels.T
        return found.voxels + 0.5, frame.array()[z, y, x, 0] / 255

    @pytest.mark.parametrize(
        ("scene_object", "by", "expected"),
        [
            (BODIES[7], "u/tau", lambda p: np.arctan2(*(p - C)[:, 1::-1].T) / (2 * np.pi) % 1),
            (
                BODIES[8],
                "v/pi + 1/2",
                lambda p: (
                    0.5
                    + np.arctan2((p - C)[:, 2] / 3, np.hypot((p - C)[:, 0] / 5, (p - C)[:, 1] / 4))
                    / np.pi
                ),
            ),
            (BODIES[4], "v", lambda p: np.linalg.norm((p - C)[:, :2], axis=1) / 5),
            (BODIES[11], "v", lambda p: (p[:, 2] - 2) / 7),
            (BODIES[12], "1 - v", lambda p: 1 - (p[:, 2] - 2) / 7),
            (
                {"type": "plane", "point": C, "normal": [0, 0, 2]},
                "u/20 + 1/2",
                lambda p: (p[:, 0] - 8) / 20 + 0.5,
            ),
            (
                {"type": "torus", "center": C, "major": 5, "minor": 2, "fill": "solid"},
                "v/tau",
                lambda p: (
                    np.arctan2(p[:, 2] - 10, np.linalg.norm((p - C)[:, :2], axis=1) - 5)
                    / (2 * np.pi)
                    % 1
                ),
            ),
            (
                {"type": "tube", "along": LINE, "radius": 2, "fill": "solid"},
                "t",
                lambda p: np.clip((p[:, 0] - 4) / 5, 0, 1),
            ),
            (LINE | {"thickness": 4}, "s", lambda p: np.clip((p[:, 0] - 4) / 5, 0, 1)),
        ],
        ids=lambda each: each.get("type") if isinstance(each, dict) else None,
    )
    def test_values(self, scene_object: dict[str, Any], by: str, expected: Any) -> None:
        centres, shown = self.colors_of(scene_object, by)
        wanted = np.clip(expected(centres), 0, 1)
        assert np.abs(shown - wanted).max() < 0.02
        assert np.ptp(wanted) > 0.2

    def test_they_turn_with_the_body(self) -> None:
        turn = [{"rotate": [0, 1, 0], "angle": "90*deg", "about": C}]  # z becomes x
        axis = {"type": "cylinder", "from": [8, 9, 5], "to": [8, 9, 15], "radius": 4}
        centres, shown = self.colors_of(axis | {"transform": turn}, "v")
        assert np.abs(shown - np.clip((centres[:, 0] - 3) / 10, 0, 1)).max() < 0.02

    def test_a_thick_line_through_points_has_their_columns(self, tmp_path: Path) -> None:
        (tmp_path / "p.csv").write_text("x,y,z,heat\n3,9,9,0\n13,9,9,1\n")
        points = {"type": "points", "file": "p.csv", "thickness": 4}
        coloring = {"map": "gray", "by": "heat", "range": [0, 1]}
        (tmp_path / "s.json").write_text(json.dumps({"size": [17, 18, 19], "objects": [
            points | {"color": coloring}]}))  # fmt: skip
        frame = vd.Frame(self.SIZE)
        frame.draw(load_scene(tmp_path / "s.json"))
        assert np.abs(frame.array()[9, 9, 3:13, 0] / 255 - np.arange(10) / 10).max() < 0.06

    def test_several_colours_run_along_a_thick_curve(self) -> None:
        scene = scene_of(LINE | {"thickness": 3, "color": ["#ff0000", "#0000ff"]})
        frame = vd.Frame(self.SIZE)
        frame.draw(scene)
        row = frame.array()[4, 4]
        assert row[3, 0] > 200
        assert row[9, 0] < 100
        assert row[9, 2] > 200

    @pytest.mark.parametrize("number", [2, 5, 6, 10, 15, 16, 17])
    def test_bodies_without_parameters_say_so(self, number: int) -> None:
        error = refused(BODIES[number] | {"color": {"map": "gray", "by": "u"}})
        assert error.path == "$.objects[0].color.by"
        assert "unknown name 'u'" in str(error)
        assert "x, y, z" in str(error.hint)

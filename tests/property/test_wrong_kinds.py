"""Arguments of a wrong kind: refused by an error of this package's own, never by one from inside.

Every public function, class and method is called with every argument in turn replaced by values of
other kinds. Such a call may succeed; if it raises, then by a ``raise`` statement of the package.
"""

import enum
import inspect
import itertools

import numpy as np
import pytest
from wrong_kinds import WRONG, assert_raised_on_purpose

import voxdisplay as vd

POINTS = [(1, 1, 1), (5, 2, 3), (4, 5, 6), (7, 7, 7)]
SCENE = """{"size": [9, 9, 9], "objects": [
 {"type": "segment", "from": [1, 1, 1], "to": [5, 5, 5]}]}"""
# Arguments of a call that succeeds, by the name of what is called.
CALLS = {
    "Tube": {"along": vd.Circle((5, 5, 5), 3), "radius": "r + t/9", "fill": "solid",
             "params": {"r": 1}},
    "Torus": {"center": (5, 5, 5), "major": 3, "minor": 1, "normal": (0, 0, 1), "fill": "shell"},
    "Surface": {"x": "u + k", "y": "v", "z": 3, "u": (1, 4), "v": (2, 5), "fill": "shell",
                "params": {"k": 1}},
    "Implicit": {"f": "x - k", "box": [(1, 1, 1), (4, 5, 6)], "fill": "shell", "params": {"k": 6}},
    "HeightField": {"z": "k + x", "x": (1, 4), "y": (2, 5), "params": {"k": 1}},
    "Cone": {"start": (2, 2, 2), "end": (5, 6, 7), "radius": 2, "fill": "shell"},
    "Cylinder": {"start": (2, 2, 2), "end": (5, 6, 7), "radius": 2, "fill": "shell"},
    "Triangle": {"points": POINTS[:3]},
    "Polygon": {"points": [(1, 1, 1), (5, 1, 1), (5, 5, 1), (3, 2, 1), (1, 5, 1)]},
    "SphericalTriangle": {"center": (5, 5, 5), "radius": 3, "corners": POINTS[1:]},
    "Ellipsoid": {"center": (5, 5, 5), "radii": (3, 2, 1), "fill": "solid"},
    "Sphere": {"center": (5, 5, 5), "radius": 3, "fill": "solid"},
    "Disc": {"center": (5, 5, 5), "radius": 3, "normal": (0, 0, 1)},
    "Plane": {"point": (1, 2, 3), "normal": (0, 1, 1)},
    "Scatter": {"points": [[1, 2, 3]]},
    "Box": {"start": (1, 1, 1), "end": (4, 5, 6), "fill": "solid"},
    "Mesh": {"vertices": POINTS, "faces": [(0, 1, 2)], "fill": "shell", "vertex_colors": None,
             "face_colors": [(1, 2, 3)], "uv": [(0, 0)] * 4,
             "texture": np.zeros((2, 2, 3), dtype=np.uint8), "face_textures": None,
             "parameters": {"u": [1, 2, 3, 4]}},
    "Arc": {"center": (5, 5, 5), "radius": 3, "start": 0, "end": 1, "normal": (0, 0, 1)},
    "BSpline": {"points": POINTS, "degree": 2, "knots": None, "weights": [1, 2, 2, 1]},
    "Bezier": {"points": POINTS},
    "CatmullRom": {"points": POINTS},
    "Circle": {"center": (5, 5, 5), "radius": 3, "normal": (0, 0, 1)},
    "Ellipse": {"center": (5, 5, 5), "axes": [(3, 0, 0), (0, 2, 0)]},
    "Helix": {"center": (5, 5, 1), "radius": 3, "pitch": 2, "turns": 2, "axis": (0, 0, 1)},
    "Lissajous": {"center": (5, 5, 5), "amplitude": (3, 2, 1), "frequency": (1, 2, 3)},
    "Parametric": {"x": "5 + r*t", "y": "t", "z": 3, "t": (0, 3), "params": {"r": 1}, "dx": "r"},
    "Points": {"points": POINTS},
    "Polyline": {"points": POINTS},
    "Segment": {},
    "TorusKnot": {"p": 2, "q": 3, "center": (5, 5, 5), "major": 3, "minor": 1},
    "Frame": {"grid": (3, 5, 7), "format": "index8", "palette": None, "own_palette": False},
    "load_scene": {"path": "nowhere.json"},
    "load_show": {"path": "nowhere.json"},
    "read_scene": {"data": SCENE, "folder": None},
    "volume_pixels": {"array": np.ones((3, 5, 7)), "window": (0, 1), "threshold": 0.5,
                      "map": "magma", "grid": (3, 5, 7), "spacing": (1, 1, 2),
                      "format": "rgb888", "labels": False, "dither": "none"},
    "voxelize": {"curve": WRONG["curve"], "method": "grid-plane", "variant": 3, "tangent": None,
                 "pitch": None, "reach": None, "certified": False, "clip": None},
    "voxelize_many": {"curves": [WRONG["curve"]], "method": "march", "variant": 3},
    "open": {"port": "sim:?size=8x8x8", "baud": 115200, "timeout_s": 1.0, "reconnect_s": 0.0,
             "display": {"axes": "x,-z,y", "brightness": 0.5}, "no_reset": False, "note": None,
             "capture": None},
    "BodyError": {"message": "what", "hint": "do"},
    "CurveError": {"message": "what", "axis": "x", "hint": "do"},
    "DesyncError": {"message": "what", "hint": "do"},
    "DeviceError": {"message": "what", "code": 7, "hint": "do"},
    "IncompatibleDevice": {"message": "what", "code": 7, "hint": "do"},
    "LocalProtocolError": {"message": "what", "hint": "do"},
    "MissingExtra": {"message": "what", "hint": "do"},
    "OpenError": {"message": "what", "port": "/dev/x", "hint": "do"},
    "ProtocolError": {"message": "what", "hint": "do"},
    "RemoteProtocolError": {"message": "what", "section": "7", "offset": 3, "raw": b""},
    "ProfileError": {"message": "what", "hint": "do"},
    "RecordingError": {"message": "what", "hint": "do"},
    "SceneError": {"message": "what", "path": "$.x", "hint": "do"},
    "TransportClosed": {"message": "what", "hint": "do"},
    "TransportError": {"message": "what", "hint": "do"},
    "TransportTimeout": {"message": "what", "hint": "do"},
    "Text": {"text": "Ab", "at": (1, 2, 3), "height": 9, "direction": (1, 0, 0), "up": (0, 0, 1),
             "font": None, "depth": 2, "fill": "shell"},
    "Volume": {"array": np.ones((3, 5, 7)), "window": (0, 1), "threshold": 0.5, "map": "magma",
               "spacing": (1, 1, 2), "offset": (1, 2, 3), "labels": False},
    "VoxelModel": {"voxels": [(1, 2, 3), (4, 5, 6)], "colors": [(1, 2, 3), (4, 5, 6)],
                   "offset": (1, 2, 3)},
    "VoxDisplayError": {"message": "what", "hint": "do"},
}  # fmt: skip
# Made by the package, plain records, an enumeration, or abstract: users do not call them.
RECORDS = {"Body", "Curve", "DeviceInfo", "Display", "Drawing", "Grid", "PixelFormat", "PlayReport",
           "Receipt", "Recording", "Report", "Scene", "Sequence", "VoxelSet"}  # fmt: skip
CALLS["Segment"] = dict(zip(inspect.signature(vd.Segment).parameters, POINTS, strict=False))

# Keys of a profile, each of which may be of a wrong kind.
PROFILE = {"port": "sim:?size=3x5x7", "axes": ["x", "z", "y"], "pitch_mm": [1, 1, 2],
           "brightness": 0.5, "limit": {"amps": 1, "ma_per_channel": 20}, "dither": "ordered",
           "fit": "none"}  # fmt: skip


def test_every_public_name_is_called():
    assert set(CALLS) | RECORDS == set(vd.__all__)


def call(what, function, arguments):
    try:
        result = function(**arguments)
    except Exception as error:  # noqa: BLE001 - any is judged
        assert_raised_on_purpose(error, what)
        return None
    return result


def replaced(arguments):
    """The arguments with each in turn of every wrong kind."""
    for name, kind in itertools.product(arguments, WRONG):
        yield f"{name} = {kind}", arguments | {name: WRONG[kind]}


@pytest.mark.parametrize("name", CALLS)
def test_functions_and_classes(name):
    function = getattr(vd, name)
    for what, arguments in replaced(CALLS[name]):
        result = call(f"{name}({what})", function, arguments)
        if isinstance(result, vd.Display):
            result.close()
        elif isinstance(result, vd.Body | vd.Curve | vd.Frame | vd.Scene | vd.VoxDisplayError):
            assert isinstance(repr(result), str)


def test_keys_of_a_profile():
    for what, keys in itertools.chain(
        replaced(PROFILE),
        ((f"serial = {kind}", {"serial": wrong}) for kind, wrong in WRONG.items()),
        ((f"limit.{what}", {"limit": limit}) for what, limit in replaced(PROFILE["limit"])),
    ):
        display = call(f"open(display: {what})", vd.open, {"display": keys})
        if display is not None:
            display.close()


def drawn_frame():
    frame = vd.Frame((3, 5, 7), "rgb888")
    frame.draw([(1, 2, 3), (1, 3, 4)], "red")
    return frame


METHODS = {
    "Frame.draw": {"drawable": [(1, 2, 3)], "color": "red", "fit": "contain"},
    "Frame.draw_all": {"items": [(WRONG["curve"], "red")]},
    "Frame.set": {"array": np.zeros((7, 5, 3, 3), dtype=np.uint8)},
    "Frame.save": {"path": "x.html"},
    "Frame.payloads": {"max_payload": 64, "features": ()},
    "Frame.difference": {"base": vd.Frame((3, 5, 7)), "max_payload": 64, "features": ()},
    "Frame.changed_indices": {"base": vd.Frame((3, 5, 7))},
    "Frame.with_output": {"output": None},
    "Grid.parse": {"text": "3x5x7"},
    "Grid.of": {"sides": (3, 5, 7)},
    "Scene.fitted": {"grid": (3, 5, 7), "mode": "contain", "pitch": (1, 1, 2)},
    "Scene.draw_on": {"frame": vd.Frame((3, 5, 7)), "fit": "contain"},
}


@pytest.mark.parametrize("name", METHODS)
def test_methods(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    owner, method = name.split(".")
    for what, arguments in replaced(METHODS[name]):
        values = {"Frame": drawn_frame(), "Grid": vd.Grid, "Scene": vd.read_scene(SCENE)}
        call(f"{name}({what})", getattr(values[owner], method), arguments)


def test_methods_of_a_display():
    with vd.open("sim:?size=3x5x7") as display:
        frame = display.frame()
        for function, arguments in {
            display.frame: {"keep": False, "palette": None},
            display.present: {"frame": frame, "wait": True, "progress": None},
            display.read: {"back": False, "progress": None},
            display.verify: {"frame": frame, "progress": None},
        }.items():
            for what, wrong in replaced(arguments):
                if callable(wrong.get("progress")):
                    continue  # its errors are the caller's
                call(f"{function.__qualname__}({what})", function, wrong)
        frame.draw([(1, 2, 3)])
        display.present(frame)
        assert np.array_equal(display.read(), frame.array())


def test_closing_a_display():
    for what, arguments in replaced({"blank": False, "flush": True, "flush_timeout_s": 1.0}):
        with vd.open("sim:?size=3x5x7") as display:
            display.present(display.frame(), wait=False)
            call(f"close({what})", display.close, arguments)


def test_numbers_and_texts_of_numpy_and_of_enumerations_choose():
    names = enum.StrEnum("Names", {"MARCH": "march", "CONTAIN": "contain"})
    numbers = enum.IntEnum("Numbers", {"ONE": 1})
    expected = vd.voxelize(WRONG["curve"], method="march", variant=1).voxels.tolist()
    for method, variant in (np.str_("march"), np.int64(1)), (names.MARCH, numbers.ONE):
        sequence = vd.voxelize(WRONG["curve"], method=method, variant=variant)
        assert sequence.voxels.tolist() == expected
    vd.Frame((3, 5, 7)).draw(vd.read_scene(SCENE), fit=names.CONTAIN)

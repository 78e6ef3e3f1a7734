"""Public exceptions and values in other processes: pickled, copied and sent to a spawned worker."""

import atexit
import copy
import dataclasses
import inspect
import multiprocessing
import pickle
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from recordings import Spin, write_recording

import voxdisplay as vd
from voxdisplay.curves.arguments import ArgumentError

CURVES = {
    "Arc": vd.Arc((5, 5, 5), 3, 0, 1),
    "BSpline": vd.BSpline([(1, 1, 1), (1, 2, 3), (4, 5, 6), (7, 7, 7)], weights=[1, 2, 3, 1]),
    "Bezier": vd.Bezier([(1, 1, 1), (5, 2, 3), (4, 5, 6)]),
    "CatmullRom": vd.CatmullRom([(1, 1, 1), (5, 2, 3), (4, 5, 6)]),
    "Circle": vd.Circle((5, 5, 5), 3),
    "Ellipse": vd.Ellipse((5, 5, 5), [(3, 0, 0), (0, 2, 0)]),
    "Helix": vd.Helix((5, 5, 1), 3, 2, 2),
    "Lissajous": vd.Lissajous((5, 5, 5), (3, 2, 1), (1, 2, 3)),
    "Parametric": vd.Parametric("5 + r*sin(t)/t", "5 + t", "5", t=(-3, 3), params={"r": 2}),
    "Points": vd.Points([(1, 1, 1), (5, 2, 3)]),
    "Polyline": vd.Polyline([(1, 1, 1), (5, 2, 3), (4, 5, 6)]),
    "Segment": vd.Segment((1, 1, 1), (5, 2, 3)),
    "TorusKnot": vd.TorusKnot(2, 3, (5, 5, 5), 3, 1),
}
BODIES = {
    "Tube": vd.Tube(vd.Circle((5, 5, 5), 3), "1 + t/9"),
    "Torus": vd.Torus((5, 5, 5), 3, 1, (1, 2, 3)),
    "Surface": vd.Surface("u", "v", "5 + sin(u)*k", u=(1, 6), v=(2, 5), params={"k": 2}),
    "Implicit": vd.Implicit(
        "hypot(x - 5, y - 5, z - r) - 3", box=[(1, 1, 1), (9, 9, 9)], params={"r": 4}
    ),
    "HeightField": vd.HeightField("3 + sin(x)*k", x=(1, 6), y=(2, 5), params={"k": 2}),
    "Cone": vd.Cone((2, 2, 2), (5, 6, 7), 2),
    "Cylinder": vd.Cylinder((2, 2, 2), (5, 6, 7), 2),
    "Triangle": vd.Triangle([(1, 1, 1), (5, 2, 3), (4, 5, 6)]),
    "Polygon": vd.Polygon([(1, 1, 1), (5, 1, 1), (5, 5, 1), (3, 2, 1), (1, 5, 1)]),
    "SphericalTriangle": vd.SphericalTriangle((5, 5, 5), 3, [(9, 5, 5), (5, 9, 5), (5, 5, 9)]),
    "Ellipsoid": vd.Ellipsoid((5, 5, 5), (3, 2, 1)),
    "Sphere": vd.Sphere((5, 5, 5), 3, fill="solid"),
    "Disc": vd.Disc((5, 5, 5), 3, (1, 2, 3)),
    "Plane": vd.Plane((1, 2, 3), (0, 0, 1)),
    "Scatter": vd.Scatter([[1, 2, 3], [4, 5, 6]], {"value": [1, 2]}),
    "Box": vd.Box((1, 1, 1), (4, 5, 6), fill="solid"),
    "Text": vd.Text("Ab", (1, 2, 3), 9, depth=2),
    "Volume": vd.Volume(np.arange(105.0).reshape(7, 5, 3), map="magma", spacing=(1, 1, 2)),
    "VoxelModel": vd.VoxelModel([(1, 2, 3), (4, 5, 6)], [(255, 0, 0), (0, 255, 0)]),
    "Mesh": vd.Mesh(
        [(1, 1, 1), (5, 2, 3), (4, 5, 6)],
        [(0, 1, 2)],
        vertex_colors=[(255, 0, 0), (0, 255, 0), (0, 0, 255)],
        parameters={"u": [0, 0.5, 1]},
    ),
}
# (n,) -> (3, n), by what every process can import.
BY_FUNCTION = vd.Parametric(partial(np.multiply.outer, np.array([1.0, 2.0, 3.0])), t=(1, 3))
ERRORS = {
    "BodyError": vd.BodyError("what", hint="do"),
    "CurveError": vd.CurveError("what", axis="x", hint="do"),
    "DesyncError": vd.DesyncError("what", hint="do"),
    "DeviceError": vd.DeviceError("what", code=7, hint="do"),
    "IncompatibleDevice": vd.IncompatibleDevice("what", code=7),
    "LocalProtocolError": vd.LocalProtocolError("what"),
    "MissingExtra": vd.MissingExtra("what", hint="do"),
    "OpenError": vd.OpenError("what", port="/dev/x", hint="do"),
    "ProfileError": vd.ProfileError("what", hint="do"),
    "RecordingError": vd.RecordingError("what", hint="do"),
    "RemoteProtocolError": vd.RemoteProtocolError("what", section="7", offset=3, raw=b"\0"),
    "SceneError": vd.SceneError("what", path="$.x", hint="do"),
    "TransportClosed": vd.TransportClosed("what"),
    "TransportError": vd.TransportError("what"),
    "TransportTimeout": vd.TransportTimeout("what"),
    "VoxDisplayError": vd.VoxDisplayError("what", hint="do"),
}
TWO = """{"size": [9, 9, 9], "objects": [
 {"type": "segment", "from": [1, 1, 1], "to": [8, 8, 8], "color": ["red", "blue"]},
 {"type": "parametric", "x": "t", "y": "t**2/9", "z": "5", "t": [0, 9]}]}"""


def recording():
    with tempfile.NamedTemporaryFile(suffix=".vxs", delete=False) as file:
        path = Path(file.name)
    write_recording(path, Spin(2))
    atexit.register(path.unlink)
    return vd.Recording(path)


def values():
    frame = vd.Frame((9, 9, 9), "index8", own_palette=True)
    drawing = frame.draw(vd.Circle((5, 5, 5), 3), "#010203")
    sequence = vd.voxelize(vd.Circle((5, 5, 5), 3), certified=True)
    with vd.open("sim:?size=9x9x9&format=index8") as display:
        info, receipt = display.info, display.present(frame)
        report = display.play(frame, until=0.01)
    return {
        "DeviceInfo": info,
        "Drawing": drawing,
        "Frame": frame,
        "Grid": vd.Grid(3, 5, 7),
        "PixelFormat": vd.PixelFormat.RGB565,
        "PlayReport": report,
        "Receipt": receipt,
        "Recording": recording(),
        "Report": sequence.report,
        "Scene": vd.read_scene(TWO),
        "Sequence": sequence,
        "VoxelSet": vd.voxelize(BODIES["Mesh"], clip=(9, 9, 9)),
    }


SAMPLES = CURVES | BODIES | ERRORS | values()
# Abstract, or, as an open display, of one process alone.
BAD = '{"type": "circle", "center": [1, 1, 1], "radius": "q"}'
PALETTE = ("palette",)
NO_VALUES = {"Body", "Curve", "ProtocolError", "Display"}
COPIES = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),  # noqa: S301 - our own
    "oldest pickle": lambda value: pickle.loads(pickle.dumps(value, 2)),  # noqa: S301
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


def test_every_public_class_has_a_sample():
    classes = {name for name in vd.__all__ if inspect.isclass(getattr(vd, name))}
    assert set(SAMPLES) == classes - NO_VALUES
    for name, sample in SAMPLES.items():
        assert type(sample) is getattr(vd, name)


def described(value):
    """All that distinguishes a value from others of its class, of plain types that compare."""
    if isinstance(value, vd.VoxDisplayError):
        return str(value), repr(value), value.args, vars(value), getattr(value, "errno", None)
    if isinstance(value, vd.Curve):
        t = np.linspace(*value.t_range, 50)
        slope = value.derivative(t)
        return (
            repr(value), value.t_range, value.closed, value.family, value.degree,
            value.position(t).tolist(), slope is not None and slope.tolist(),
            value.breaks.tolist(), vd.voxelize(value).voxels.tolist(),
        )  # fmt: skip
    if isinstance(value, vd.Sequence):
        arrays = value.voxels, value.t, value.starts
        return (
            [array.tolist() for array in arrays],
            [array.flags.writeable for array in arrays],
            value.closed, value.report, repr(value.proof), described(value.curve),
        )  # fmt: skip
    if isinstance(value, vd.Body):
        low, high = value.bounds()
        return (
            repr(value),
            low.tolist(),
            high.tolist(),
            described(vd.voxelize(value, clip=(9, 9, 9))),
        )
    if isinstance(value, vd.VoxelSet):
        return (
            repr(value), value.box, value.kind, value.notes, value.voxels.tolist(),
            value.colors is not None and value.colors.tolist(),
            {name: numbers.tolist() for name, numbers in value.parameters.items()},
            value.index.flags.writeable, value.voxels.flags.writeable,
        )  # fmt: skip
    if isinstance(value, vd.Scene):
        return value.size, [
            (item.type, item.path, item.color.tolist(), described(item.curve))
            for item in value.items
        ]
    if isinstance(value, vd.Frame):
        return (
            repr(value),
            value.array().tolist(),
            value.palette.tolist(),
            value.payloads(64, PALETTE),
        )
    return value, repr(value), dataclasses.is_dataclass(value) and dataclasses.asdict(value)


def assert_same(value, other):
    assert type(other) is type(value)
    np.testing.assert_equal(described(other), described(value))


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("name", SAMPLES)
def test_a_copy_is_the_same(name, how):
    assert_same(SAMPLES[name], COPIES[how](SAMPLES[name]))


@pytest.mark.parametrize("how", COPIES)
def test_a_copy_of_a_copy_is_the_same(how):
    """Nothing is added to a message each time."""
    for name in ("SceneError", "RemoteProtocolError", "Frame"):
        again = COPIES[how](COPIES[how](SAMPLES[name]))
        assert_same(SAMPLES[name], again)


@pytest.mark.parametrize("how", COPIES)
def test_drawing_on_a_copy_leaves_the_frame(how):
    frame = vd.Frame((3, 5, 7))
    twin = COPIES[how](frame)
    twin.draw([(1, 1, 1)])
    assert not frame.array().any()
    frame.draw([(2, 2, 2)])
    assert twin.array()[2, 2, 2].tolist() == [0, 0, 0]


class NamedFrame(vd.Frame):
    def __init__(self, name):
        super().__init__((3, 5, 7))
        self.name = name


@pytest.mark.parametrize("how", COPIES)
def test_a_copy_of_a_users_frame_is_of_its_class(how):
    twin = COPIES[how](NamedFrame("one"))
    assert type(twin) is NamedFrame
    assert twin.name == "one"


@pytest.mark.parametrize("how", COPIES)
def test_what_a_sequence_has_measured_stays_read_only(how):
    sequence = vd.voxelize(vd.Circle((5, 5, 5), 3))
    assert len(sequence.contact_pairs) == sequence.report.contacts
    for each in (sequence, COPIES[how](sequence)):
        for array in (each.distances, each.contact_pairs):
            with pytest.raises(ValueError, match="read-only"):
                array[:1] = 0


def test_errors_of_the_curves_arguments():
    error = ArgumentError("radius", "must be positive")
    for how in COPIES.values():
        assert_same(error, how(error))


def test_notes_of_an_error_stay():
    error = vd.OpenError("what", port="p")
    error.add_note("while reading frames")
    assert COPIES["pickle"](error).__notes__ == ["while reading frames"]


def test_a_curve_by_a_callable_is_as_picklable_as_the_callable():
    for how in COPIES.values():
        assert_same(BY_FUNCTION, how(BY_FUNCTION))
    curve = vd.Parametric(lambda t: np.stack((t, t, t)), t=(0, 9))
    assert_same(curve, copy.deepcopy(curve))
    with pytest.raises((pickle.PicklingError, AttributeError), match="lambda"):
        pickle.dumps(curve)


def test_a_display_says_that_it_stays_here():
    with vd.open("sim:?size=8x8x8") as display:
        for how in COPIES.values():
            with pytest.raises(TypeError, match="pass its port"):
                how(display)


@pytest.fixture(scope="module")
def worker():
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        yield pool


@pytest.mark.parametrize("name", SAMPLES)
def test_a_spawned_worker_returns_it_unchanged(worker, name):
    assert_same(SAMPLES[name], worker.submit(copy.copy, SAMPLES[name]).result(60))


def test_a_spawned_worker_draws_a_curve_by_a_callable(worker):
    here, there = vd.voxelize(BY_FUNCTION), worker.submit(vd.voxelize, BY_FUNCTION).result(60)
    assert there.voxels.tolist() == here.voxels.tolist()
    assert_same(BY_FUNCTION, there.curve)


def test_the_error_of_a_worker_reaches_the_caller(worker):
    with pytest.raises(vd.OpenError, match="ttyUSB77") as caught:
        worker.submit(vd.open, "/dev/ttyUSB77").result(60)
    assert caught.value.port == "/dev/ttyUSB77"
    with pytest.raises(vd.SceneError, match=r"\$\.radius") as caught:
        worker.submit(
            vd.read_scene, '{"type": "circle", "center": [1, 1, 1], "radius": "q"}'
        ).result(60)
    assert str(caught.value).count("$.radius") == 1

"""Frames: drawing order, arrays, comparison, and the page that the emulator makes of them."""

import numpy as np
import pytest
from drawing import page_after, values_of

from voxdisplay import Circle, CurveError, Parametric, Points, Scene, Segment, read_scene, voxelize
from voxdisplay.frame import Frame
from voxdisplay.raster import display_list
from voxdisplay.raster.pixel_format import PixelFormat

GRID = (17, 64, 40)
FORMATS = pytest.mark.parametrize("format_", PixelFormat)


def shown(frame, max_payload=64, seed=0):
    """The frame's payloads, drawn by the emulator in any order, are the frame."""
    payloads = frame.payloads(max_payload)
    assert all(0 < len(payload) <= max_payload for payload in payloads)
    order = np.random.default_rng(seed).permutation(len(payloads))
    page = page_after([payloads[k] for k in order], frame.grid, frame.format)
    assert values_of(page, frame.format).tolist() == frame.format.values(frame.array()).tolist()
    assert page.digest == frame.digest()
    return frame.array()


def walk(rng, steps, low=-3):
    """A 26-connected walk that leaves the grid now and then."""
    start = rng.integers(0, GRID)
    return np.clip(start + np.cumsum(rng.integers(-1, 2, (steps, 3)), axis=0), low, 70)


@FORMATS
def test_a_blank_frame(format_):
    frame = Frame((3, 5, 7), format_)
    assert frame.payloads(64) == []
    assert frame.digest() == 0
    assert not shown(frame).any()


@FORMATS
@pytest.mark.parametrize("seed", range(4))
def test_the_later_item_covers_the_earlier(format_, seed):
    rng = np.random.default_rng(seed)
    frame = Frame(GRID, format_)
    meant = {}
    for color in ("red", "#123456", "black", "white", "red"):
        walked = walk(rng, 400)
        frame.draw(walked, color)
        (value,) = frame.format.nearest(np.array([voxdisplay_color(color)], dtype=np.uint8))
        meant |= {tuple(v): int(value) for v in walked.tolist() if inside(v)}
    shown(frame, seed=seed)
    values = frame.format.values(frame.array()).reshape(frame.grid.array_shape)
    assert {v: int(values[v[::-1]]) for v in meant} == meant
    assert np.count_nonzero(values) == sum(value != 0 for value in meant.values())
    index, lit = frame.lit()
    assert index.tolist() == np.flatnonzero(values).tolist()
    assert lit.tolist() == values.reshape(-1)[index].tolist()


def voxdisplay_color(text):
    return {"red": (255, 0, 0), "#123456": (0x12, 0x34, 0x56), "black": (0, 0, 0),
            "white": (255, 255, 255)}[text]  # fmt: skip


def inside(voxel):
    return all(0 <= place < side for place, side in zip(voxel, GRID, strict=True))


def test_what_is_outside_is_clipped_and_counted():
    frame = Frame((3, 5, 7), "index8")
    drawing = frame.draw([(-1, 0, 0), (0, 0, 0), (2, 4, 6), (3, 4, 6), (2, 5, 6), (2, 4, 7)])
    assert (drawing.voxels, drawing.clipped, drawing.exact_color) == (6, 4, True)
    assert np.argwhere(shown(frame)).tolist() == [[0, 0, 0], [6, 4, 2]]
    assert frame.draw(np.empty((0, 3), dtype=int)).voxels == 0
    assert frame.draw([(9, 9, 9)]).clipped == 1
    shown(frame)


def test_x_y_z_are_not_exchanged():
    frame = Frame((3, 5, 7), "index8")
    frame.draw([(2, 4, 6)])
    assert frame.array().shape == (7, 5, 3)
    assert frame.array()[6, 4, 2] == 255


def test_a_curve_and_its_sequence_and_its_voxels_are_the_same():
    curve = Segment((1.5, 2.5, 3.5), (15.5, 60.5, 30.5))
    frames = [Frame(GRID) for _ in range(4)]
    frames[0].draw(curve, "orange")
    frames[1].draw(voxelize(curve), "orange")
    frames[2].draw(voxelize(curve).voxels, "orange")
    assert len(frames[3].draw_all([(curve, "orange")])) == 1
    assert len({frame.digest() for frame in frames}) == 1
    assert shown(frames[0]).any()
    assert frames[0].draw_all([]) == []


def test_colours_are_spread_evenly_and_both_ends_are_met():
    frame = Frame((5, 1, 1))
    drawing = frame.draw([(x, 0, 0) for x in range(5)], ["black", "white"])
    assert frame.array()[0, 0, :, 0].tolist() == [0, 64, 128, 191, 255]
    assert drawing.exact_color
    assert not Frame((5, 1, 1), "index8").draw([(0, 0, 0)], "#808080").exact_color
    frame.draw([(4, 0, 0)], ["red", "lime"])
    assert frame.array()[0, 0, 4].tolist() == [255, 0, 0]
    frame.draw([(x, 0, 0) for x in range(3)], np.array([[9, 8, 7], [9, 8, 9]]))
    assert frame.array()[0, 0, :3].tolist() == [[9, 8, 7], [9, 8, 8], [9, 8, 9]]


@pytest.mark.parametrize(
    "colors",
    [np.zeros((0, 3)), np.zeros(3), np.zeros((2, 4)), np.array([[0.5, 1, 0]]),
     np.array([[256, 0, 0]]), np.array([[-1, 0, 0]])],
)  # fmt: skip
def test_an_array_that_is_no_colours(colors):
    with pytest.raises(ValueError, match="colours are"):
        Frame((3, 5, 7)).draw([(0, 0, 0)], colors)


@pytest.mark.parametrize(
    "voxels", [[], [1, 2, 3], [[1, 2]], [[1.0, 2.0, 3.0]], [[True, False, True]]]
)
def test_what_is_no_voxels(voxels):
    with pytest.raises(ValueError, match="columns x, y, z"):
        Frame((3, 5, 7)).draw(voxels)


@FORMATS
def test_set_makes_it_an_array_and_drawing_goes_on_from_there(format_):
    rng = np.random.default_rng(1)
    frame = Frame(GRID, format_)
    frame.draw(walk(rng, 50), "red")
    array = frame.array()
    array[...] = rng.integers(0, min(format_.full, 255), array.shape, endpoint=True)
    frame.set(array)
    assert (shown(frame) == array).all()
    frame.draw(walk(rng, 500), "black")
    frame.draw(walk(rng, 500), "red")
    shown(frame)
    array[...] = 0
    assert frame.array().any(), "it keeps no hold of the caller's array"
    frame.clear()
    assert not shown(frame).any()
    frame.draw(walk(rng, 50), "red")
    shown(frame)


@pytest.mark.parametrize(
    "array", [np.zeros((3, 5, 7), np.uint8), np.zeros((7, 5, 3), int), np.full((7, 5, 3), 1.0)]
)
def test_set_refuses_what_is_no_memory_and_changes_nothing(array):
    frame = Frame((3, 5, 7), "index8")
    frame.draw([(0, 0, 0)])
    with pytest.raises(ValueError, match="the array"):
        frame.set(array)
    assert np.count_nonzero(frame.array()) == 1


def test_a_colour_may_be_three_numbers():
    """As libraries for LEDs take it."""
    frame = Frame((8, 8, 8))
    assert frame.draw(Circle((4, 4, 4), 3), color=(255, 128, 0)).exact_color
    colors = frame.rgb().reshape(-1, 3)
    assert np.unique(colors[colors.any(axis=1)], axis=0).tolist() == [[255, 128, 0]]


def test_the_default_colour_is_white():
    frame = Frame((3, 5, 7))
    frame.draw([(1, 2, 3)])
    assert frame.rgb()[3, 2, 1].tolist() == [255, 255, 255]


@pytest.mark.parametrize(
    "what",
    ["curve.json", b"xyz", 7, 1.5, None, {}, {1}, object(), len, lambda t: t, Circle, Scene,
     Frame((3, 5, 7)), iter([(1, 2, 3)])],
    ids=lambda what: type(what).__name__,
)  # fmt: skip
def test_draw_names_what_it_takes(what):
    with pytest.raises(
        TypeError, match=r"drawable: expected a curve, a body, a sequence, an .* or a scene, found"
    ):
        Frame((3, 5, 7)).draw(what)


def test_draw_refuses_rows_of_different_lengths():
    with pytest.raises(ValueError, match="drawable: its rows have different lengths"):
        Frame((3, 5, 7)).draw([[1, 2, 3], [1, 2]])


TWO = """{"size": [10, 10, 10], "objects": [
 {"type": "segment", "from": [1, 1, 1], "to": [9, 9, 9], "color": "red"},
 {"type": "segment", "from": [1, 1, 1], "to": [9, 1, 1], "color": [0, 255, 0]}]}"""


def test_a_scene_is_drawn_like_anything_else():
    scene, frame, expected = read_scene(TWO), Frame((10, 10, 10)), Frame((10, 10, 10))
    drawing = frame.draw(scene)
    alone = [expected.draw(item.curve, item.color) for item in scene.items]
    assert frame == expected
    assert drawing.voxels == sum(each.voxels for each in alone)
    assert (drawing.clipped, drawing.exact_color) == (0, True)
    assert not Frame((10, 10, 10), "mono1").draw(scene).exact_color


def test_repr_of_a_scene_names_size_and_objects():
    assert repr(read_scene(TWO)) == "<Scene 10x10x10: 2 objects (segment, segment)>"
    one = '{"type": "segment", "from": [1, 1, 1], "to": [9, 9, 9]}'
    assert repr(read_scene(one)) == "<Scene: 1 object (segment)>"
    many = f'{{"objects": [{", ".join([one] * 9)}]}}'
    assert repr(read_scene(many)) == (
        "<Scene: 9 objects (segment, segment, segment, segment, segment, ...)>"
    )


def test_a_scene_of_another_size_is_fitted_or_kept():
    scene, fitted, kept = read_scene(TWO), Frame((20, 20, 5)), Frame((20, 20, 5))
    assert fitted.draw(scene).clipped == 0
    assert kept.draw(scene, fit="none").clipped > 0
    with pytest.raises(ValueError, match="fit: expected one of 'contain', 'none'"):
        kept.draw(scene, fit="cover")


def test_a_scene_has_its_own_colours():
    frame = Frame((10, 10, 10))
    with pytest.raises(TypeError, match="color: a scene has colours of its own"):
        frame.draw(read_scene(TWO), color="red")
    assert not frame.array().any()


@FORMATS
def test_frames_that_look_alike_are_equal(format_):
    frames = [Frame(GRID, format_) for _ in range(3)]
    for frame in frames[:2]:
        frame.draw(Segment((1, 1, 1), (9, 9, 9)), "red")
    assert frames[0] == frames[1] == frames[0].copy()
    assert frames[0] != frames[2]
    frames[2].set(frames[0])
    assert frames[0] == frames[2], "however it was drawn"
    frames[2].clear()
    assert frames[2] == Frame(GRID, format_)
    assert Frame(GRID, format_) != Frame(GRID[::-1], format_)
    assert frames[0] != "frame"


def test_frames_of_other_formats_or_palettes_differ():
    assert Frame((3, 5, 7), "mono1") != Frame((3, 5, 7), "index8")
    palette = Frame((3, 5, 7), "index8").palette
    same = Frame((3, 5, 7), "index8", palette=palette)
    assert same == Frame((3, 5, 7), "index8")
    palette[9] = 1, 2, 3
    assert Frame((3, 5, 7), "index8", palette=palette) != same


def test_a_difference_is_that_to_a_frame_of_the_same_kind():
    frame = Frame((3, 5, 7))
    for base in (Frame((3, 5, 8)), Frame((3, 5, 7), "mono1")):
        with pytest.raises(ValueError, match="base: expected a frame of 3x5x7 rgb888, found"):
            frame.difference(base, 64)


def test_a_frame_is_not_hashable():
    with pytest.raises(TypeError, match="unhashable"):
        hash(Frame((3, 5, 7)))


@FORMATS
def test_a_frame_is_an_array_to_numpy(format_):
    frame = Frame((3, 5, 7), format_)
    frame.draw([(2, 4, 6)])
    assert np.array_equal(frame, frame.array())
    copy = np.asarray(frame)
    assert copy.dtype == format_.dtype
    copy[...] = 0
    assert frame.array().any(), "the caller's array is a copy"
    assert np.asarray(frame, dtype=np.float32).dtype == np.float32
    assert frame.__array__().dtype == format_.dtype
    assert frame.__array__(float, copy=True).dtype == float
    with pytest.raises(ValueError, match="copy"):
        frame.__array__(copy=False)
    assert (np.asarray(frame) == frame.array()).all()


def test_repr_names_grid_format_and_voxels():
    frame = Frame((3, 5, 7), "index8", own_palette=True)
    assert repr(frame) == "<Frame 3x5x7 index8, 0 voxels lit>"
    frame.draw([(1, 1, 1), (1, 2, 1)], "#010203")
    assert repr(frame) == "<Frame 3x5x7 index8, 2 voxels lit, own palette>"
    assert repr(frame.grid) == "Grid(nx=3, ny=5, nz=7)"


@pytest.mark.parametrize("grid", [(3, 5), (3, 5, 7, 9), "3x5x7", 3, None, (3, 5, 7.0), ("3", 5, 7)])
def test_what_is_no_grid(grid):
    with pytest.raises(TypeError, match=r"grid: expected three whole numbers \(nx, ny, nz\)"):
        Frame(grid)


@pytest.mark.parametrize("grid", [(0, 5, 7), (3, -5, 7), (3, 5, 65536), (65535, 65535, 65535)])
def test_a_grid_that_no_display_has(grid):
    with pytest.raises(ValueError, match="grid: "):
        Frame(grid)


@pytest.mark.parametrize("format_", ["rgb", "", None, 3, b"mono1"])
def test_what_is_no_format(format_):
    kind = ValueError if isinstance(format_, str) else TypeError
    with pytest.raises(
        kind, match=r"format: expected one of .*mono1.*index8.*rgb565.*rgb888, found"
    ):
        Frame((3, 5, 7), format_)


def test_masked_arrays_are_refused():
    mask = np.zeros((7, 5, 3, 3), dtype=bool)
    pixels = np.ma.masked_array(np.ones((7, 5, 3, 3), dtype=np.uint8), mask=mask)
    frame = Frame((3, 5, 7))
    frame.set(pixels)
    assert frame.array().all()
    pixels[1, 2, 1] = np.ma.masked
    voxels = np.ma.masked_array([(1, 1, 1), (2, 2, 2)], mask=[(0, 0, 0), (1, 1, 1)])
    for call in (
        lambda: frame.set(pixels),
        lambda: frame.draw(voxels),
        lambda: frame.draw([(1, 1, 1)], voxels),
        lambda: Frame((3, 5, 7), "index8", palette=np.ma.masked_all((256, 3), np.uint8)),
    ):
        with pytest.raises(ValueError, match=r"^\w+: some of it is masked: .*filled"):
            call()
    assert frame.array().all()


@pytest.mark.parametrize("pixels", ["mono1", "index8", "rgb565", "rgb888", "own palette"])
def test_many_curves_drawn_together_are_as_one_by_one(
    pixels: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(4)
    colors = ["red", "#123456", ["red", "lime", "blue"], (1, 2, 3), "black", ["gold"] * 5]
    curves = [Circle(rng.uniform(-2, 9, 3), rng.uniform(0.2, 4)) for _ in range(30)]
    curves += [Points(rng.uniform(-2, 9, (5, 3))) for _ in range(6)]
    order = rng.permutation(len(curves))
    items = [(curves[k], colors[n % len(colors)]) for n, k in enumerate(order)]
    own = pixels == "own palette"
    blank = Frame((3, 5, 7), "index8" if own else pixels, own_palette=own)
    together, single = blank.copy(), blank.copy()
    drawings = together.draw_all(items)
    assert drawings == [single.draw(curve, color) for curve, color in items]
    assert any(each.clipped for each in drawings)
    single.lit()
    monkeypatch.setattr(display_list, "_BLOCK_ROWS", 7)
    assert together == single
    features = ["palette"]
    assert together.payloads(1024, features) == single.payloads(1024, features)


def test_nothing_is_drawn_of_curves_one_of_which_fails() -> None:
    frame = Frame((3, 5, 7))
    good, bad = Circle((1, 2, 3), 2), Parametric("1", "2", "1/(t-1)", t=(0, 2))
    with pytest.raises(CurveError, match="curve 40"):
        frame.draw_all([*[(good, "red")] * 40, (bad, "red")])
    assert not len(frame.lit()[0])

"""Encoding of frames: right pixels, by announced features only, in the fewest bytes."""

from itertools import chain

import numpy as np
import pytest
from drawing import decode_plainly
from hypothesis import given, settings
from hypothesis import strategies as st

import voxdisplay as vd
from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import page_update, range_coded_chains, raw_pixels, sorted_chains
from voxdisplay.wire.chains import encode_chains
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.spans import encode_spans
from voxdisplay.wire.voxel_sets import encode_set_payloads

GRIDS = [Grid(17, 12, 20), Grid(3, 5, 7), Grid(300, 4, 3), Grid(1, 1, 1)]
# What a feature adds to the ops that every device has.
BASE = {"END", "PEN", "MOVE", "STEP", "FROM", "SKIP", "RUN", "LIT"}
OPS_OF = {"line": "LINE", "box": "BOX", "dots": "DOTS", "oct": "OCT", "diff": "DIFF",
          "palette": "COLORS", "read": "READ", "digest": "DIGEST"}  # fmt: skip
COLORS = ["red", "#123456", "black", "white", ["red", "lime", "blue"], ["#101010", "white"]]

seeds = st.integers(0, 2**32 - 1)


@st.composite
def devices(draw):
    """Grid, format, longest payload, and features that the format allows."""
    format_ = draw(st.sampled_from(PixelFormat))
    index8 = format_ is PixelFormat.INDEX8
    allowed = [name for name in OPS_OF if index8 or name not in {"diff", "palette"}]
    features = draw(st.sets(st.sampled_from(allowed)))
    most = draw(st.sampled_from([64, 65, 100, 1024]))
    return draw(st.sampled_from(GRIDS)), format_, most, frozenset(features)


def line(start, end):
    """The digital straight line of protocol.md, 7.3."""
    way = end - start
    length = int(np.abs(way).max())
    k = np.arange(length + 1)[:, None]
    return start + (2 * k * way + length) // (2 * max(1, length))


def draw_random(rng, frame, times):
    """Draw curves, lines, solids, dots and noise at random, some of it off the grid."""
    grid = np.array(frame.grid)
    for _ in range(times):
        color = COLORS[rng.integers(len(COLORS))]
        start = rng.integers(-2, grid + 2)
        kind = rng.integers(6)
        if kind == 0:
            count = rng.integers(1, 200)
            steps = np.repeat(rng.integers(-1, 2, (20, 3)), rng.integers(1, 20, 20), axis=0)
            frame.draw(start + np.cumsum(steps, axis=0)[:count], color)
        elif kind == 1:
            frame.draw(line(start, rng.integers(-2, grid + 2)), color)
        elif kind == 2:
            frame.draw(start + np.argwhere(np.ones(rng.integers(1, 9, 3))), color)
        elif kind == 3:
            frame.draw(rng.integers(0, grid, (rng.integers(1, 40), 3)), color)
        elif kind == 4:
            frame.clear()
        else:
            array = frame.array()
            smooth = np.cumsum(rng.integers(-1, 2, array.shape), axis=2)
            array[...] = smooth % 2 if frame.format.value == "mono1" else smooth % 256
            array[rng.random(array.shape[:3]) < rng.choice([0.5, 0.99])] = 0
            frame.set(array)


def random_frame(rng, device):
    grid, format_, _, features = device
    frame = Frame(grid, format_, own_palette="palette" in features)
    draw_random(rng, frame, rng.integers(0, 4))
    return frame


def assert_draws(payloads, frame, base=None):
    """The payloads, in any order on the base, make the frame; no voxel gets two pixels."""
    *_, most, features = frame.device
    assert all(0 < len(payload) <= most for payload in payloads)
    shuffled = [payloads[k] for k in np.random.default_rng(0).permutation(len(payloads))]
    values = None if base is None else base.format.values(base.array())
    drawn = decode_plainly(shuffled, frame.grid, frame.format, values)
    assert drawn.page == frame.format.values(frame.array()).tolist()
    assert not drawn.two_pixels
    assert set(drawn.ops) <= BASE | {OPS_OF[name] for name in features}
    palette = Frame(frame.grid, "index8").palette if base is None else base.palette
    if "palette" in features and palette is not None:
        for entry, color in drawn.palette.items():
            palette[entry] = color
        assert (palette == frame.palette).all()
    return drawn.ops


@settings(max_examples=250, deadline=None, derandomize=True)
@given(devices(), seeds)
def test_a_frame_is_drawn_with_what_was_announced(device, seed):
    """5: "A host MUST NOT send what the device has not announced"."""
    frame = random_frame(np.random.default_rng(seed), device)
    frame.device = device
    assert_draws(frame.payloads(*device[2:]), frame)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(devices(), seeds, st.sampled_from([0.0, 0.3e6, 1.2e6, 1e9]))
def test_whatever_the_line_carries_and_wherever_it_is_cut(device, seed, bytes_per_s):
    frame = random_frame(np.random.default_rng(seed), device)
    frame.device = device
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page_update, "_LARGE_SET", 100)
        patch.setattr(page_update, "_SLAB_VOXELS", 1)
        patch.setattr(page_update, "_PARSED_VOXELS", 150)
        patch.setattr(page_update, "_HUGE_SET", 300)
        patch.setattr(page_update, "_CHAINED_VOXELS", 50)
        patch.setattr(raw_pixels, "_SLAB_VOXELS", 160)
        portions = list(frame.iter_payloads(*device[2:], bytes_per_s))
    assert_draws([payload for portion in portions for payload in portion], frame)


def test_what_is_dense_comes_in_slabs_and_noise_in_portions():
    rng = np.random.default_rng(1)
    frame = Frame((128, 128, 32), "index8")
    frame.set(rng.integers(1, 256, (32, 128, 128), dtype=np.uint8))
    voxels = frame.grid.voxels

    def portions(rate: float) -> int:
        return len(list(filter(None, frame.iter_payloads(1024, (), rate))))

    assert portions(11_520) == 1, "in one piece it is shorter, and the line is busy for seconds"
    assert portions(1.2e6) == voxels // page_update._PARSED_VOXELS
    assert portions(1e9) == voxels // raw_pixels._SLAB_VOXELS
    solid = Frame((128, 128, 32), "index8")
    solid.set(np.full((32, 128, 128), 7, dtype=np.uint8))
    assert (
        len(list(filter(None, solid.iter_payloads(1024, (), 1e9))))
        == voxels // page_update._SLAB_VOXELS
    )
    solid.draw([(1, 2, 3)], "red")
    solid.device = (solid.grid, solid.format, 1024, frozenset())
    assert_draws(list(chain.from_iterable(solid.iter_payloads(1024, (), 1e9))), solid)
    half = solid.array()
    half[16:] = 0
    solid.set(half)
    assert len(list(filter(None, solid.iter_payloads(1024, (), 1e9)))) == 1, (
        "the dark slab costs nothing"
    )


SETS = ("box", "oct", "dots", "line")


def size_of(frame, features=SETS, bytes_per_s=0.0):
    """Bytes of all payloads of a frame."""
    return sum(map(len, chain.from_iterable(frame.iter_payloads(1024, features, bytes_per_s))))


def test_a_curve_on_a_fast_line_goes_as_its_chain():
    """Also those that fill a solid: nobody waits for a search of a shorter encoding."""
    frame = Frame(GRIDS[0], "mono1")
    for y, z in np.argwhere(np.ones((9, 9))) + 0.5:
        frame.draw(vd.Segment((0.5, y, z), (8.5, y, z)))
    assert len(frame.lit()[0]) == 729
    features = ("box", "oct", "dots")
    assert size_of(frame, features) < 20 < size_of(frame, features, 1.2e6)


@pytest.mark.parametrize("rate", [0.0, 24_000.0, 0.3e6, 1.2e6, 1e9])
@pytest.mark.parametrize("order", ["scan", "shuffled", "sampled", "colours"])
def test_an_array_of_a_surface_is_a_set_on_every_line(order, rate):
    place = np.argwhere(np.ones((40, 40, 40)))[:, ::-1]
    distance = np.linalg.norm(place - 19.5, axis=1)
    shell = place[np.abs(distance - 15) < 0.6]
    rng = np.random.default_rng(3)
    if order == "shuffled":
        shell = rng.permutation(shell)
    elif order == "sampled":
        shell = shell[np.lexsort(np.arctan2(*(shell[:, :2] - 19.5).T).round(1)[None])]
    colors = rng.choice(["red", "lime"], len(shell)).tolist() if order == "colours" else "red"
    as_array, as_set = Frame((40, 40, 40), "rgb565"), Frame((40, 40, 40), "rgb565")
    as_array.draw(shell, colors)
    as_set.set(as_array.array())
    with pytest.MonkeyPatch.context() as patch:
        # The set is so much shorter that range coding need not be tried.
        for module in (range_coded_chains, sorted_chains):
            patch.delattr(module, "encode_range_coded", raising=False)
        size = size_of(as_array, (*SETS, "arc"), rate)
    assert size == size_of(as_set, SETS, rate)


@pytest.mark.parametrize("rate", [0.0, 0.3e6, 1.2e6, 1e9])
def test_an_array_that_follows_a_curve_is_a_chain_on_every_line(rate):
    drawn = vd.voxelize(vd.TorusKnot(3, 5, (64, 64, 64), 36, 18))
    by_curve, by_array = Frame((128,) * 3, "mono1"), Frame((128,) * 3, "mono1")
    by_curve.draw(drawn)
    by_array.draw(drawn.voxels)
    assert size_of(by_array, SETS, rate) == size_of(by_curve, SETS, rate)


def test_a_set_and_an_array_of_it_that_share_voxels_send_them_once():
    solid = np.argwhere(np.ones((20, 20, 20)))
    frame = Frame((40, 33, 50), "mono1")
    frame.draw(vd.Segment((0.5, 5.5, 5.5), (30.5, 5.5, 5.5)))
    frame.draw(solid)
    frame._add_set(solid + 3, np.full((1, 3), 255, dtype=np.uint8))
    for rate in (0.0, 1e9):
        frame.device = (frame.grid, frame.format, 1024, set(SETS))
        assert_draws(list(chain.from_iterable(frame.iter_payloads(1024, SETS, rate))), frame)


def test_isolated_voxels_are_no_chain_on_any_line():
    features = ("box", "oct", "dots")
    dots = Frame(GRIDS[0], "mono1")
    dots.draw(np.argwhere(np.ones((4, 4, 4))) * 3, "white")
    portions = dots.iter_payloads(1024, features, 1.2e6)
    assert list(chain.from_iterable(portions)) == dots.payloads(1024, features)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(devices(), seeds)
def test_a_difference_makes_one_frame_of_another(device, seed):
    rng = np.random.default_rng(seed)
    base = random_frame(rng, device)
    frame = base.copy() if rng.random() < 0.7 else random_frame(rng, device)
    before = base.array()
    draw_random(rng, frame, rng.integers(0, 3))
    assert (base.array() == before).all(), "a copy is drawn on for itself"
    frame.device = device
    assert_draws(frame.difference(base, *device[2:]), frame, base)
    changed = frame.changed_indices(base)
    differs = frame.format.values(frame.array()) != base.format.values(before)
    assert changed.tolist() == np.flatnonzero(differs).tolist()


@settings(max_examples=200, deadline=None, derandomize=True)
@given(devices(), seeds)
def test_no_coder_alone_takes_fewer_bytes(device, seed):
    grid, format_, most, features = device
    rng = np.random.default_rng(seed)
    features = features - {"palette"}
    frame = random_frame(rng, (grid, format_, most, features))
    size = sum(map(len, frame.payloads(most, features)))
    config = frame._encoder_config(most, features)
    values = format_.values(frame.array())
    assert size <= sum(map(len, encode_spans(values, config)))
    items = frame._raster.ordered
    if not frame._raster.page and items:
        items = items.select(items.values != 0)
        voxels = grid.voxels_at(items.index)
        plain_coding = EncoderConfig(grid, format_, most)
        for each in (config, plain_coding):
            chains = encode_chains(voxels, items.values, each)
            assert size <= sum(map(len, chains))


@pytest.mark.parametrize("format_", PixelFormat)
@pytest.mark.parametrize(
    ("what", "features", "least"),
    [
        ("line", {"line"}, {"LINE"}),
        ("corner", {"line"}, {"LINE"}),
        ("solid", {"oct", "dots", "box"}, {"BOX"}),
        ("ball", {"oct", "dots", "box"}, {"OCT"}),
        ("ball", set(), {"RUN"}),
        ("dots", {"oct", "dots"}, {"DOTS"}),
        ("curve", {"line", "oct", "dots", "box"}, {"FROM"}),
    ],
)
def test_what_is_taken_for_what(format_, what, features, least):
    frame = Frame((40, 33, 50), format_)
    place = np.argwhere(np.ones((40, 33, 50)))
    drawn = {
        "line": line(np.array([1, 2, 3]), np.array([30, 9, 47])),
        "corner": np.concatenate(
            (line(np.array([1, 2, 3]), np.array([38, 9, 20])),
             line(np.array([38, 10, 21]), np.array([39, 30, 48])))
        ),
        "solid": place[((place > (4, 3, 2)) & (place < (30, 30, 30))).all(axis=1)],
        "ball": place[np.linalg.norm(place - (19, 16, 25), axis=1) < 13],
        "dots": place[::1999],
        "curve": vd.voxelize(vd.Helix((20, 16, 3), 12, 20, 2)).voxels,
    }  # fmt: skip
    frame.draw(drawn[what], "red")
    frame.device = ((40, 33, 50), format_, 1024, features)
    ops = assert_draws(frame.payloads(1024, features), frame)
    assert least <= set(ops)


def test_a_polyline_is_cut_where_its_corners_are():
    """Two lines of one octant, which together are none."""
    frame = Frame((128, 128, 128), "mono1")
    frame.draw(vd.Polyline([(0.5, 0.5, 0.5), (60.5, 10.5, 0.5), (70.5, 70.5, 60.5)]))
    frame.device = (frame.grid, frame.format, 1024, {"line"})
    ops = assert_draws(frame.payloads(1024, {"line"}), frame)
    assert ops.count("LINE") >= 1


def test_erasing_is_drawing_the_dark():
    frame = Frame((17, 12, 20), "rgb565")
    frame.draw(np.argwhere(np.ones((17, 12, 20))), "red")
    base = frame.copy()
    frame.draw([(3, 4, 5)], "black")
    (payload,) = frame.difference(base, 1024)
    assert len(payload) <= 9
    assert decode_plainly(
        [payload], frame.grid, frame.format, base.format.values(base.array())
    ).page == (frame.format.values(frame.array()).tolist())
    assert base.difference(base, 1024) == []


def test_bricks_alone_are_not_better_for_a_surface():
    place = np.argwhere(np.ones((40, 33, 50)))
    shell = place[np.abs(np.linalg.norm(place - (19, 16, 25), axis=1) - 13) < 0.5]
    frame = Frame((40, 33, 50), "mono1")
    frame.draw(shell)
    features = {"oct", "dots", "line"}
    size = sum(map(len, frame.payloads(1024, features)))
    config = frame._encoder_config(1024, features)
    index = np.sort(frame.grid.index_of(shell))
    assert size <= sum(map(len, encode_set_payloads(index, np.ones(len(index), dtype=int), config)))


@pytest.mark.slow
@settings(max_examples=3000, deadline=None, derandomize=True)
@given(devices(), seeds)
def test_many_more_frames(device, seed):
    test_a_frame_is_drawn_with_what_was_announced.hypothesis.inner_test(device, seed)
    test_a_difference_makes_one_frame_of_another.hypothesis.inner_test(device, seed)
    test_no_coder_alone_takes_fewer_bytes.hypothesis.inner_test(device, seed)

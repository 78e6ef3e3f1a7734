"""Partition of large updates: whole, in order, by what is lit, and drawn rightly part by part."""

from itertools import chain, pairwise

import numpy as np
import pytest
from drawing import decode_plainly

import voxdisplay as vd
from voxdisplay.frame import Frame
from voxdisplay.raster.display_list import DrawnVoxels, Kind
from voxdisplay.wire import page_update
from voxdisplay.wire.op_encoding import EncoderConfig
from voxdisplay.wire.page_update import PageUpdate, partition

GRID = vd.Grid(16, 16, 96)
FAST, SLOW = 1e6, 0.0


def parts_of(update, rate=FAST):
    return list(partition(update, EncoderConfig(GRID, vd.PixelFormat.MONO1, 1024, 0, rate)))


def ones(index):
    return np.ones(len(index), dtype=np.uint32)


def chain_of(count):
    index = np.arange(count)
    return DrawnVoxels.of_item(index, ones(index), np.zeros(count, dtype=bool), Kind.CURVE)


@pytest.fixture
def small(monkeypatch):
    """Limits that a small grid exceeds."""
    monkeypatch.setattr(page_update, "_LARGE_SET", 100)
    monkeypatch.setattr(page_update, "_HUGE_SET", 1000)
    monkeypatch.setattr(page_update, "_SLAB_VOXELS", 4096)
    monkeypatch.setattr(page_update, "_CHAINED_VOXELS", 50)


def test_what_is_not_large_is_one_part():
    update = PageUpdate(chain_of(300), np.arange(500, 900), ones)
    (part,) = parts_of(update)
    assert part is update


@pytest.mark.parametrize("every", [1, 2])
def test_isolated_voxels_are_cut_sooner_on_a_slow_line(monkeypatch, every):
    monkeypatch.setattr(page_update, "_ISOLATED_SET", 2000)
    monkeypatch.setattr(page_update, "_ISOLATED_SLAB", 1000)
    index = np.arange(0, GRID.voxels, every)
    parts = [part.unordered for part in parts_of(PageUpdate(None, index, ones), SLOW)]
    assert np.array_equal(np.concatenate(parts), index)
    assert [len(part) for part in parts] == ([len(index)] if every == 1 else [2048] * 6)


@pytest.mark.usefixtures("small")
def test_a_long_chain_is_cut_into_pieces():
    for count in (101, 150, 260):
        parts = parts_of(PageUpdate(chain_of(count), np.arange(500, 520), ones))
        lengths = [len(part.ordered) for part in parts]
        assert lengths == [50] * ((count - 1) // 50) + [count - (count - 1) // 50 * 50]
        assert np.array_equal(
            np.concatenate([part.ordered.index for part in parts]), np.arange(count)
        )
        assert [len(part.unordered) for part in parts] == [0] * (len(parts) - 1) + [20]


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("ordered", [None, chain_of(40)])
def test_a_large_set_is_cut_between_bricks_where_enough_is_lit(ordered):
    whole = np.arange(GRID.voxels)
    *slabs, last = parts_of(PageUpdate(ordered, whole, ones))
    slabs += [last] if ordered is None else []
    assert [len(part.unordered) for part in slabs] == [4096] * 6
    assert ordered is None or (last.ordered is ordered and not len(last.unordered))
    # One voxel in ten: as many slabs would have 410 voxels each, less than an eighth of one.
    for rate, most in ((FAST, 2 * 512), (SLOW, 4096)):
        parts = [part.unordered for part in parts_of(PageUpdate(None, whole[::10], ones), rate)]
        assert np.array_equal(np.concatenate(parts), whole[::10])
        assert all(len(part) <= most for part in parts)
        assert all(int(part[-1]) // 4096 < int(after[0]) // 4096
                   for part, after in pairwise(parts))  # fmt: skip
        assert len(parts) == (3 if rate else 1)


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("rate", [SLOW, FAST])
@pytest.mark.parametrize("features", [(), ("oct", "dots", "line", "box")])
def test_parts_together_are_the_frame(features, rate):
    frame = Frame(GRID, "rgb565")
    frame.draw(vd.TorusKnot(2, 5, (8, 8, 48), 5, 2.5), "red")
    frame._add_set(np.argwhere(np.ones((16, 16, 30))), np.array([(0, 0, 255)], dtype=np.uint8))
    frame.draw(vd.Helix((8, 8, 20), 6, 60, 5), ["lime", "white"])
    payloads = list(chain.from_iterable(frame.iter_payloads(256, features, rate)))
    drawn = decode_plainly(payloads, frame.grid, frame.format)
    assert drawn.page == frame.format.values(frame.array()).tolist()
    assert not drawn.two_pixels


@pytest.mark.parametrize("low", [0, 16, 33])
def test_bricks_of_a_dense_set_are_found_wherever_it_is(low):
    """By a page of its layers alone, or by sorting: the same bytes."""
    place = np.argwhere(np.ones((16, 16, 20)))[:, ::-1]
    place = place[np.linalg.norm(place - 8, axis=1) < 7.3][:, ::-1] + [0, 0, low]
    frame = Frame(GRID, "mono1")
    frame._add_set(place, np.array([(255, 255, 255)], dtype=np.uint8))
    features = ("oct", "dots")
    found = frame.payloads(1024, features)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("voxdisplay.wire.octree._DENSE_RATIO", 0)
        assert frame.payloads(1024, features) == found
    drawn = decode_plainly(found, frame.grid, frame.format)
    assert drawn.page == frame.format.values(frame.array()).tolist()

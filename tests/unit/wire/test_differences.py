"""Differences between frames: what changed, by chains where it has an order, not whole items."""

import numpy as np
import pytest
from drawing import decode_plainly

import voxdisplay as vd
from voxdisplay.frame import Frame

GRID = (64, 64, 64)
FEATURES = ("line", "box", "dots", "oct")
KNOT = vd.voxelize(vd.TorusKnot(2, 3, (32, 32, 32), 20, 9)).voxels
STRAIGHT = np.arange(3, 60)[:, None] + np.array([0, 1, 2])


def frame_of(*items):
    """A frame of voxels and colours."""
    frame = Frame(GRID, "rgb888")
    for voxels, color in items:
        frame.draw(voxels, color)
    return frame


def decoded(base, frame, features=FEATURES):
    """Ops and bytes of a difference that has been found right."""
    payloads = frame.difference(base, 1024, features)
    values = base.format.values(base.array())
    drawn = decode_plainly(payloads, frame.grid, frame.format, values)
    assert drawn.page == frame.format.values(frame.array()).tolist()
    assert not drawn.two_pixels
    return drawn.ops, sum(map(len, payloads))


def test_a_growing_curve_sends_its_new_voxels():
    for more, most in ((1, 8), (20, 16)):
        _, size = decoded(frame_of((KNOT[:100], "red")), frame_of((KNOT[: 100 + more], "red")))
        assert size <= most


def test_what_vanishes_goes_as_the_chain_that_it_was():
    base, frame = frame_of((KNOT[:150], "red")), frame_of((KNOT[60:150], "red"))
    ops, size = decoded(base, frame)
    as_set = Frame(GRID, "rgb888")
    as_set.set(frame.array())
    plain_base = Frame(GRID, "rgb888")
    plain_base.set(base.array())
    _, size_as_set = decoded(plain_base, as_set)
    assert {"FROM", "STEP"} & set(ops)
    assert size < size_as_set / 2


@pytest.mark.parametrize("features", [(), ("oct", "dots"), ("line",)])
def test_short_gaps_between_changes_are_drawn_again(features):
    """Every third voxel: to start again costs more than to go on."""
    base, frame = frame_of((KNOT, "red"), (KNOT[:120:3], "lime")), frame_of((KNOT, "red"))
    _, size = decoded(base, frame, features)
    assert size <= 4 + sum(map(len, frame_of((KNOT[:120], "red")).payloads(1024, features)))


def test_no_gap_is_drawn_across_another_colour_or_item():
    base = frame_of((KNOT[:40], "red"), (KNOT[20:60], "lime"))
    frame = frame_of((KNOT[:20], "blue"), (KNOT[20:60], "lime"))
    frame.draw(KNOT[30:31], "white")
    decoded(base, frame)
    frame.draw(KNOT[8:9], "red")
    decoded(base, frame)
    decoded(frame, base)


def test_a_straight_line_is_drawn_again_as_a_whole():
    """One LINE for many changes far from each other."""
    base = frame_of((STRAIGHT, "red"), (STRAIGHT[::18], "lime"))
    ops, size = decoded(base, frame_of((STRAIGHT, "red")), ("line",))
    assert ops.count("LINE") == 1
    assert size <= 12


def test_sets_and_pages_have_no_order():
    base = Frame(GRID, "rgb888")
    base.set(frame_of((KNOT, "red")).array())
    frame = base.copy()
    frame._add_set(KNOT[::2] + 1, np.array([(0, 255, 0)], dtype=np.uint8))
    decoded(base, frame)
    decoded(frame, base)
    decoded(base, Frame(GRID, "rgb888"))
    decoded(frame, frame_of((KNOT[:20], "red")))


def test_no_change_sends_nothing_but_the_palette():
    base = Frame(GRID, "index8", own_palette=True)
    frame = base.copy()
    assert frame.difference(base, 1024, ("palette",)) == []
    frame.draw([(1, 2, 3)], "#123456")
    frame.draw([(1, 2, 3)], "black")
    ops, _ = decoded(base, frame, ("palette",))
    assert set(ops) == {"COLORS"}

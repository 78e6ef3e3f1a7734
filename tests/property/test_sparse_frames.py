"""Sparse frames beside dense models: the same pixels after any sequence of changes."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from drawing import decode_plainly
from hypothesis import given, settings
from hypothesis import strategies as st

from voxdisplay.frame import Frame
from voxdisplay.raster.grid import Grid
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire.digest import page_digest

GRIDS = [Grid(3, 5, 7), Grid(1, 1, 1), Grid(17, 4, 3)]
ACTIONS = ["draw", "draw", "draw", "draw one", "draw all", "set", "clear", "copy", "swap", "look"]
COLORS = np.array([(255, 0, 0), (0, 0, 0), (0, 255, 0), (255, 255, 255)], dtype=np.uint8)

seeds = st.integers(0, 2**32 - 1)


@dataclass
class Model:
    """A frame and the dense array that it should be."""

    frame: Frame
    array: np.ndarray
    done: list = field(default_factory=list)

    @classmethod
    def blank(cls, grid, format_):
        frame = Frame(grid, format_)
        return cls(frame, np.zeros(format_.shape(grid.array_shape), dtype=format_.dtype))

    def draw(self, voxels, rng):
        """Draw in one colour, or in one for each voxel, as an array or as a set."""
        inside = self.frame.grid.inside(voxels)
        count = len(voxels) if rng.random() < 0.5 else 1
        colors = COLORS[rng.integers(0, len(COLORS), count)]
        draw = self.frame.draw if rng.random() < 0.5 else self.frame._add_set
        drawing = draw(voxels, colors) if len(colors) else draw(voxels, COLORS[:1])
        assert (drawing.voxels, drawing.clipped) == (len(voxels), np.count_nonzero(~inside))
        pixels = self.frame.format.pixels(self.frame.format.nearest(colors))
        for number, (x, y, z) in enumerate(voxels.tolist()):
            if inside[number]:
                self.array[z, y, x] = pixels[number % len(pixels)]

    def change(self, action, rng):
        """Do something to both."""
        self.done.append(action)
        grid, format_ = np.array(self.frame.grid), self.frame.format
        if action == "draw":
            self.draw(rng.integers(-1, grid + 1, (rng.integers(0, 9), 3)), rng)
        elif action == "draw one":
            self.draw(rng.integers(0, grid, (1, 3)), rng)
        elif action == "draw all":
            self.draw(np.argwhere(np.ones(grid)), rng)
        elif action == "set":
            top = 2 if format_ is PixelFormat.MONO1 else 1 << 8 * np.dtype(format_.dtype).itemsize
            self.array = rng.integers(0, top, self.array.shape).astype(format_.dtype)
            self.array[rng.random(self.array.shape[:3]) < 0.7] = 0
            given_ = self.array.copy()
            self.frame.set(given_)
            given_[...] = 1
        elif action == "clear":
            self.array = np.zeros_like(self.array)
            self.frame.clear()

    def check(self):
        """Compare all that can be asked for with the array."""
        frame, format_ = self.frame, self.frame.format
        values = format_.values(self.array)
        index, lit = frame.lit()
        assert index.tolist() == np.flatnonzero(values).tolist(), self.done
        assert lit.tolist() == values[index].tolist(), self.done
        assert frame.array().tolist() == self.array.tolist(), self.done
        flat = self.array.reshape(format_.shape((frame.grid.voxels,)))
        assert frame.digest() == page_digest(flat, format_), self.done
        assert (frame.rgb().reshape(-1, 3) == format_.rgb(values)).all(), self.done
        whole = decode_plainly(frame.payloads(64), frame.grid, format_)
        assert whole.page == values.tolist(), self.done

    def check_against(self, other):
        """Compare two frames as their arrays."""
        mine, others = (m.frame.format.values(m.array) for m in (self, other))
        changed = self.frame.changed_indices(other.frame)
        assert changed.tolist() == np.flatnonzero(mine != others).tolist(), (self.done, other.done)
        assert (self.frame == other.frame) == (len(changed) == 0)
        payloads = self.frame.difference(other.frame, 64, ("oct", "dots", "line", "box"))
        drawn = decode_plainly(payloads, self.frame.grid, self.frame.format, others)
        assert drawn.page == mine.tolist(), (self.done, other.done)
        assert not drawn.two_pixels


@settings(max_examples=250, deadline=None, derandomize=True)
@given(
    st.sampled_from(GRIDS),
    st.sampled_from(PixelFormat),
    st.lists(st.sampled_from(ACTIONS), max_size=9),
    seeds,
)
def test_a_sparse_frame_is_a_dense_array(grid, format_, actions, seed):
    rng = np.random.default_rng(seed)
    model, other = Model.blank(grid, format_), Model.blank(grid, format_)
    for action in actions:
        if action == "copy":
            other = Model(model.frame.copy(), model.array.copy(), [*model.done, "copied"])
        elif action == "swap":
            model, other = other, model
        elif action == "look":
            model.frame.lit()
        else:
            model.change(action, rng)
    model.check()
    other.check()
    model.check_against(other)
    other.check_against(model)


@pytest.mark.parametrize("format_", PixelFormat)
def test_what_is_drawn_again_and_again_is_kept_once_by_a_copy(format_):
    frame = Frame((3, 5, 7), format_)
    for _ in range(9):
        frame.draw(np.argwhere(np.ones((3, 5, 7))), "red")
    copy = frame.copy()
    assert len(copy._raster._drawn) == len(frame._raster._drawn) == 105
    assert copy == frame
    assert copy.array().any(axis=-1).all()

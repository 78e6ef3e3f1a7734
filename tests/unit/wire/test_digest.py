"""Digest of pages (protocol.md, section 8)."""

import document
import numpy as np
import pytest

from firmware_sim.memory import Page
from voxdisplay.raster.pixel_format import PixelFormat
from voxdisplay.wire import digest as digests
from voxdisplay.wire.digest import digest

D = document.literals()


def mix(index, value):
    """The document's six lines, one voxel at a time."""
    low = 0xFFFFFFFF
    h = (index * D["DIGEST_MUL_INDEX"] + value * D["DIGEST_MUL_VALUE"]) & low
    h ^= h >> D["DIGEST_SHIFT_1"]
    h = h * D["DIGEST_MUL_1"] & low
    h ^= h >> D["DIGEST_SHIFT_2"]
    h = h * D["DIGEST_MUL_2"] & low
    return h ^ (h >> D["DIGEST_SHIFT_3"])


def voxels(count, seed=3):
    rng = np.random.default_rng(seed)
    index = rng.choice(2**31 - 1, count, replace=False)
    return index, rng.integers(0, 2**24, count) * (rng.random(count) < 0.8)


@pytest.mark.parametrize("count", [0, 1, 2, 1000])
def test_it_is_the_sum_of_the_mixes_of_what_is_lit(count):
    index, value = voxels(count)
    pairs = zip(index.tolist(), value.tolist(), strict=True)
    assert digest(index, value) == sum(mix(i, v) for i, v in pairs if v) % 2**32


def test_a_dark_page_has_the_digest_0():
    assert digest(np.arange(105), np.zeros(105, dtype=int)) == 0


def test_the_order_does_not_count():
    index, value = voxels(100)
    order = np.random.default_rng(1).permutation(100)
    assert digest(index[order], value[order]) == digest(index, value)


def test_every_voxel_that_is_moved_or_recoloured_changes_it():
    """8: "one displaced or recoloured voxel always changes it"."""
    index, value = np.arange(105), np.arange(1, 106)
    seen = {digest(index, value)}
    for k in range(105):
        for where, what in ((index, 200), (value, 255), (value, 0)):
            changed = where.copy()
            changed[k] = what
            pair = (changed, value) if where is index else (index, changed)
            seen.add(digest(*pair))
    assert len(seen) == 1 + 3 * 105


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32, np.int64])
def test_the_type_of_the_numbers_does_not_count(dtype):
    index, value = np.arange(100), np.arange(100)
    assert digest(index.astype(dtype), value.astype(dtype)) == digest(index, value)


def test_the_device_agrees_after_many_writes():
    rng = np.random.default_rng(2)
    page = Page(300, 3)
    for _ in range(50):
        start = int(rng.integers(0, 280))
        page.put(start, rng.integers(0, 256, 3 * 20, dtype=np.uint8).tobytes())
    raw = np.frombuffer(page.pixels, dtype=np.uint8).reshape(-1, 3).astype(int)
    assert page.digest == digest(np.arange(300), raw @ [1, 256, 65536])


@pytest.mark.parametrize("format_", PixelFormat)
@pytest.mark.parametrize("block", [7, 1 << 14])
def test_a_page_has_the_digest_of_its_voxels(format_, block, monkeypatch):
    monkeypatch.setattr(digests, "_BLOCK", block)
    rng = np.random.default_rng(3)
    values = rng.integers(1, format_.full + 1, 3 * 5 * 7)
    values[rng.random(values.size) < 0.3] = 0
    values[:20] = 0
    index = np.flatnonzero(values)
    page = format_.pixels(values)
    assert digests.page_digest(page, format_) == digests.digest(index, values[index])
    assert digests.page_digest(page * 0, format_) == 0

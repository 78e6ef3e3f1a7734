"""Index arithmetic and the search for shortcuts, against their definitions."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from voxdisplay.voxelization.index_ranges import (
    distinct,
    expand_ranges,
    insert_columns,
    split_blocks,
)
from voxdisplay.voxelization.thinning import WINDOW, find_shortcuts

LENGTHS = st.lists(st.integers(1, 40), min_size=1, max_size=12)
UNIT = st.integers(-1, 1)
# In a plane they come back to where they were more often.
STEPS = st.lists(st.tuples(UNIT, UNIT, st.just(0)), min_size=8, max_size=40) | st.lists(
    st.tuples(UNIT, UNIT, UNIT), min_size=8, max_size=40
)


@given(LENGTHS, st.integers(1, 50))
def test_blocks_cut_where_curves_begin_or_in_long_ones(lengths: list[int], size: int) -> None:
    ends = np.cumsum(lengths)
    starts, stop = ends - lengths, int(ends[-1])
    found = list(split_blocks(starts, stop, size))
    assert [low for low, _ in found] + [stop] == [0] + [high for _, high in found]
    for low, high in found:
        assert high - low <= size
        if high < stop and high not in starts:  # inside a curve that begins no later
            own = starts[starts <= high].max()
            assert own <= low
            assert high - low == size
        following = ends[ends > high]
        if high in starts and following.size:  # another curve would have been too much
            assert following[0] - low > size


@given(st.lists(st.integers(-5, 5)))
def test_distinct_numbers_are_in_order(numbers: list[int]) -> None:
    assert distinct(np.array(numbers, dtype=np.int64)).tolist() == sorted(set(numbers))


@given(LENGTHS)
def test_a_curve_is_cut_in_the_same_places_whatever_comes_before_it(lengths: list[int]) -> None:
    own, before = 45, int(np.sum(lengths))
    starts = np.append(np.cumsum(lengths) - lengths, before)
    alone = [high for _, high in split_blocks(np.array([0]), own, 10)]
    cuts = [high - before for _, high in split_blocks(starts, before + own, 10)]
    assert [cut for cut in cuts if cut > 0] == alone


@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(0, 5)), max_size=9))
def test_ranges_are_written_out(ranges: list[tuple[int, int]]) -> None:
    low, count = np.array(ranges, dtype=np.int64).reshape(-1, 2).T
    expected = [i for begin, n in ranges for i in range(begin, begin + n)]
    assert expand_ranges(low, count).tolist() == expected


@given(st.lists(st.integers(0, 6), max_size=9).map(sorted))
def test_columns_are_put_before_others(places: list[int]) -> None:
    at, line = np.array(places, dtype=np.int64), np.arange(6)
    rows = np.arange(18).reshape(3, 6)
    fresh = -1 - np.arange(at.size), -1 - np.arange(3 * at.size).reshape(3, -1)
    one, three = insert_columns(at, (line, rows), fresh)
    assert one.tolist() == np.insert(line, at, fresh[0]).tolist()
    assert three.tolist() == np.insert(rows, at, fresh[1], axis=1).tolist()


@given(STEPS, st.data())
def test_all_shortcuts_are_found(steps: list[tuple[int, int, int]], data: st.DataObject) -> None:
    voxels = np.cumsum(steps, axis=0).astype(np.int32).T
    size = voxels.shape[1]
    cuts = data.draw(st.lists(st.integers(0, size - 1), max_size=2))
    stretch = np.searchsorted(sorted(cuts), np.arange(size), side="right")

    def touch(i: int, j: int) -> bool:
        return bool(stretch[i] == stretch[j] and np.abs(voxels[:, i] - voxels[:, j]).max() <= 1)

    def leads(i: int, j: int) -> bool:
        between = range(i + 1, j)
        ways = [
            all(touch(i, k) for k in between if k < m)
            and all(touch(k, j) for k in between if k >= m)
            for m in range(i + 1, j + 1)
        ]
        return touch(i, j) and any(ways)

    expected = [
        (i, i + w)
        for i in range(size)
        for w in range(2, WINDOW + 1)
        if i + w < size and leads(i, i + w)
    ]
    starts, stops = find_shortcuts(voxels, stretch)
    assert list(zip(starts.tolist(), stops.tolist(), strict=True)) == expected

"""Layouts of parts: the grid of the whole, holes, overlaps, the drawing."""

import numpy as np
import pytest

from voxdisplay.display.part_layout import PartLayout
from voxdisplay.display.part_profile import MAX_PARTS, read_parts


def layout(*boxes):
    return PartLayout(
        read_parts(
            [
                {"name": f"n{number}", "port": f"p{number}", "at": list(at), "size": list(size)}
                for number, (at, size) in enumerate(boxes)
            ]
        )
    )


def counted(found):
    """How many parts each voxel lies in, [z, y, x], voxel by voxel."""
    counts = np.zeros(found.grid.array_shape, dtype=int)
    for part in found.parts:
        counts[part.box] += 1
    return counts


@pytest.mark.parametrize("seed", range(20))
def test_holes_and_overlaps_are_those_counted_voxel_by_voxel(seed):
    rng = np.random.default_rng(seed)
    boxes = [
        (rng.integers(0, 5, 3).tolist(), rng.integers(1, 5, 3).tolist())
        for _ in range(rng.integers(1, 6))
    ]
    found = layout(*boxes)
    counts = counted(found)
    assert found.grid == tuple(np.max([np.add(*box) for box in boxes], axis=0))
    assert found.hole_voxels == (counts == 0).sum()
    assert found.overlap_voxels == (counts > 1).sum()
    assert found.is_whole == (counts == 1).all()
    assert (found.covered(np.arange(counts.size)) == (counts > 0).ravel()).all()
    assert bool(found.faults()) != found.is_whole


def test_a_whole_layout_is_drawn_from_above():
    found = layout(((0, 0, 0), (3, 5, 7)), ((3, 0, 0), (2, 5, 7)))
    assert found.faults() == []
    assert found.drawing().splitlines() == [
        "A n0, B n1; . no part, # several",
        "z 0-6:",
        "  y 0-4  A B",
        "  columns: x 0-2, 3-4",
    ]


def test_only_layers_with_faults_are_drawn():
    found = layout(((0, 0, 0), (3, 3, 2)), ((0, 0, 2), (2, 3, 2)))
    (fault,) = found.faults()
    assert fault == "no part lies at x 2, y 0 to 2, z 2 to 3: what is drawn there is not shown"
    assert "z 2-3:" in found.drawing()
    assert "z 0-1:" not in found.drawing()


def test_three_that_overlap_are_all_named():
    found = layout(((0, 0, 0), (2, 2, 2)), ((0, 0, 0), (2, 2, 2)), ((1, 0, 0), (1, 2, 2)))
    assert [line.partition(":")[0] for line in found.faults()] == [
        "n0 and n1 overlap at x 0, y 0 to 1, z 0 to 1",
        "n0, n1 and n2 overlap at x 1, y 0 to 1, z 0 to 1",
    ]


def test_many_parts_with_many_faults_are_described_in_few_lines():
    found = layout(*(((17 * n, 17 * n, 17 * n), (9, 9, 9)) for n in range(MAX_PARTS)))
    assert len(found.faults()) == 5
    assert found.faults()[-1].startswith("and so at ")
    assert len(found.drawing().splitlines()) < 4 * MAX_PARTS * 3

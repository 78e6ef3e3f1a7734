"""Detours at joints of loops: against plain enumeration, alone and together."""

from itertools import product

import numpy as np
import pytest

from voxdisplay.voxelization import loop_detours, thinning
from voxdisplay.voxelization.loop_detours import MAX_DETOUR, MAX_REPLACED, Joints, cheapest_detours

STEPS = [step for step in product((-1, 0, 1), repeat=3) if any(step)]


def touch(a, b):
    return max(abs(p - q) for p, q in zip(a, b, strict=True)) <= 1


def square(voxel, points):
    """Return the squared distance of a voxel from a polyline, (3, n)."""
    begin, along = points[:, :-1], np.diff(points, axis=1)
    offset = np.array(voxel)[:, None] + 0.5 - begin
    length = np.maximum((along * along).sum(axis=0), thinning.TINY)
    offset = offset - np.clip((offset * along).sum(axis=0) / length, 0, 1) * along
    return (offset * offset).sum(axis=0).min()


def cost(voxel, points):
    """Return the cost of a voxel, as of `thinning`."""
    least = min(square(voxel, points), thinning.FAR) + thinning.VOXEL_COST
    return int(np.floor(least * thinning.COST_UNITS + 0.5))


def paths(start, side, usable, points):
    """Return chordless paths from a voxel to a side: cost, voxels and where they join."""
    found, open_ = [], [()]
    while open_:
        nodes = open_.pop()
        way = (start, *nodes)
        join = max([k for k, voxel in enumerate(side) if touch(way[-1], voxel)], default=None)
        passed = product(way[:-1], side[join:])
        if join is not None and not any(touch(a, b) for a, b in passed):
            spent = sum(cost(voxel, points) for voxel in (*nodes, *side[join:]))
            found.append((spent, nodes, join))
        if len(nodes) < MAX_DETOUR:
            ahead = {tuple(a + b for a, b in zip(way[-1], step, strict=True)) for step in STEPS}
            open_ += [
                (*nodes, voxel)
                for voxel in ahead & usable
                if not any(touch(voxel, other) for other in way[:-1])
            ]
    return found


def plain_detour(start, after, before, points):
    """Return the voxels of the best detour, from the side before to the side after, and joins."""
    cells = {tuple(cell) for cell in np.floor(points - 0.5).astype(int).T.tolist()}
    near = {
        tuple(a + b for a, b in zip(cell, corner, strict=True))
        for cell in cells
        for corner in product((0, 1), repeat=3)
    } | {*after, *before}
    usable = {
        voxel
        for voxel in near
        if max(abs(a - b) for a, b in zip(voxel, start, strict=True)) <= MAX_DETOUR
        and voxel != start
        and square(voxel, points) <= loop_detours.MAX_SQUARE
    }

    ways = [paths(start, side, usable, points) for side in (after, before)]
    best = None
    for (one, out, j), (other, back, i) in product(*ways):
        ends, others = [*out, after[j]], [*back, *before[i:]]
        if any(touch(a, b) for a, b in product(ends, others)):
            continue
        if any(touch(a, b) for a, b in product([*back, before[i]], after[j:])):
            continue
        way = [*back[::-1], start, *out]
        centres = np.array([*way, *after[j:], *before[i:]]).T + 0.5
        apart = ((centres[:, :, None] - points[:, None]) ** 2).sum(axis=0).min(axis=0)
        if (apart > thinning.MAX_UNCOVERED**2).any():
            continue
        found = (one + other, min(way, way[::-1])), (list(out), list(back), j, i)
        if best is None or found[0] < best[0]:
            best = found
    return best and best[1]


def joint(seed):
    """Return a joint of a small loop, which often has a chord there."""
    rng = np.random.default_rng(seed)
    turn, tilt = rng.uniform(0, 2 * np.pi), rng.normal(size=(3, 2))
    radius = rng.uniform(0.8, 4.0)
    angle = np.linspace(0, 2 * np.pi, 400) + turn
    curve = (
        10 + rng.uniform(0, 1, (3, 1)) + radius * tilt @ np.stack((np.cos(angle), np.sin(angle)))
    )
    loop = list(dict.fromkeys(map(tuple, np.floor(curve).astype(int).T.tolist())))
    reach = max(min(MAX_REPLACED, len(loop) // 2 - 1), 1)
    points = np.concatenate((curve[:, -60:], curve[:, :60]), axis=1)
    return loop[0], loop[1 : 1 + reach], loop[: -1 - reach : -1], points


def joints_of(several):
    sides = np.zeros((2, len(several), MAX_REPLACED, 3), dtype=np.int64)
    for nth, (_, *both, _) in enumerate(several):
        for side, voxels in zip(sides, both, strict=True):
            side[nth, : len(voxels)] = np.reshape(voxels, (-1, 3))
    counts = np.array([[len(each[side]) for each in several] for side in (1, 2)])
    starts = np.array([each[0] for each in several])
    return Joints(starts, sides, counts, np.stack([each[3] for each in several]))


@pytest.mark.parametrize("ways", [1, 2, 12])
def test_many_joints_at_once_have_the_detours_of_plain_enumeration(ways: int) -> None:
    several = [joint(seed) for seed in range(60)]
    found = cheapest_detours(joints_of(several), ways)
    wanted = [plain_detour(*each) for each in several]
    assert 10 < sum(each is not None for each in wanted) < 60
    for nth, each in enumerate(wanted):
        assert found.found[nth] == (each is not None)
        if each:
            out, back = (
                list(map(tuple, found.voxels[side, nth, : found.counts[side, nth]].tolist()))
                for side in (0, 1)
            )
            assert (out, back, *found.join[:, nth].tolist()) == each


def test_a_joint_without_sides_has_no_detour() -> None:
    start, after, before, points = joint(1)
    alone = joints_of([(start, after, [], points), (start, [], before, points)])
    assert cheapest_detours(alone).found.tolist() == [False, False]

"""Context modelling of slabs: the decisions that code an occupancy (protocol.md, section 7.11).

All contexts follow from voxels alone, so that those of many slabs are found at once. Must not know
a coder, nor payloads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.kernel_backend import with_kernel
from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import Bools, Bytes, Ints

CELL = spec.SLABS_CELL
Models = NDArray[np.int16]


@with_kernel
def slab_decisions(voxels: Bools, bases: tuple[int, int, int, int]) -> tuple[Models, Bytes, Ints]:
    """Return the decisions that code the slabs of a box, in order, without NEXT.

    Parameters
    ----------
    voxels : (4 (d + 1), 4 h, 4 w) bool array
        Axes z, y, x. The first four slices are the slab before, dark if there is none.
    bases : (int, int, int, int)
        `MODEL_BASES`; an argument, since it must not be compiled in.

    Returns
    -------
    models : (n,) int16 array
    bits : (n,) uint8 array
    ends : (d,) int64 array
        Number of decisions up to the end of each slab.

    """
    flag, full_flag, group, shape = bases
    depth, height, width = (side // CELL for side in voxels.shape)
    depth -= 1
    cells = voxels.reshape(depth + 1, CELL, height, CELL, width, CELL)
    count = cells.sum(axis=(1, 3, 5), dtype=np.uint8)
    lit, full = count > 0, count == CELL**3
    flag_models, flag_bits, flag_count = _flag_decisions(cells, lit, full, flag, full_flag)
    mixed = lit[1:] & ~full[1:]
    group_models, group_bits, group_count = _group_decisions(voxels, lit[1:], mixed, group, shape)
    ends = np.cumsum(flag_count + group_count)
    models = np.empty(int(ends[-1]), dtype=np.int16)
    bits = np.empty(len(models), dtype=np.uint8)
    starts = ends - flag_count - group_count
    for some, values, counts, begin in (
        (flag_models, flag_bits, flag_count, starts),
        (group_models, group_bits, group_count, starts + flag_count),
    ):
        place = np.arange(len(some)) + np.repeat(begin - np.cumsum(counts) + counts, counts)
        models[place], bits[place] = some, values
    return models, bits, ends


MODEL_BASES = (spec.SLABS_FLAG, spec.SLABS_FULL, spec.SLABS_GROUP, spec.SLABS_SHAPE)


def _flag_decisions(
    cells: Bools, lit: Bools, full: Bools, flag: int, full_flag: int
) -> tuple[Models, Bytes, Ints]:
    """Return models, bits, and their number by slab, of the states of cells."""
    depth, height, width = lit.shape[0] - 1, *lit.shape[1:]
    base = cells[:-1, -1]
    around = np.zeros((depth, height + 1, width + 2), dtype=np.int16)
    filled, under, under_all = around.copy(), around.copy(), around.copy()
    around[:, 1:, 1:-1], filled[:, 1:, 1:-1] = lit[1:], full[1:]
    under[:, :-1, 1:-1], under_all[:, :-1, 1:-1] = base.any(axis=(2, 4)), base.all(axis=(2, 4))
    models = np.empty((depth, height, width, 2), dtype=np.int16)
    models[..., 0] = flag + (
        around[:, 1:, :-2]
        | around[:, :-1, 1:-1] << 1
        | around[:, :-1, :-2] << 2
        | around[:, :-1, 2:] << 3
        | under[:, :-1, 1:-1] << 4
        | under[:, :-1, 2:] << 5
        | under[:, 1:, 1:-1] << 6
        | lit[:-1].astype(np.int16) << 7
    )
    models[..., 1] = full_flag + (
        filled[:, 1:, :-2]
        | filled[:, :-1, 1:-1] << 1
        | under_all[:, :-1, 1:-1] << 2
        | under_all[:, :-1, 2:] << 3
        | under_all[:, 1:, 1:-1] << 4
        | filled[:, :-1, 2:] << 5
    )
    bits = np.stack((lit[1:], full[1:]), axis=-1)
    used = np.stack((np.ones_like(lit[1:]), lit[1:]), axis=-1)
    counts = used.sum(axis=(1, 2, 3), dtype=np.int64)
    return models[used], bits[used].astype(np.uint8), counts


def _group_decisions(
    voxels: Bools, lit: Bools, mixed: Bools, group: int, shape: int
) -> tuple[Models, Bytes, Ints]:
    """Return models, bits, and their number by slab, of the voxels of mixed cells."""
    depth, height, width = mixed.shape
    rows = np.broadcast_to(mixed[:, None, :, None, :], (depth, CELL, height, CELL, width))
    slab, a, cell_y, row, cell_x = np.nonzero(rows)
    # Voxels with a dark rim, and of each the three around it in x as bits.
    framed = np.zeros((len(voxels), CELL * height + 2, CELL * width + 2), dtype=np.uint8)
    framed[:, 1:-1, 1:-1] = voxels
    three = np.zeros_like(framed)
    three[..., 1:-1] = framed[..., :-2] | framed[..., 1:-1] << 1 | framed[..., 2:] << 2
    across, layer = framed.shape[2], framed.shape[1] * framed.shape[2]
    first = (slab * CELL + a + CELL) * layer + (cell_y * CELL + row + 1) * across
    first += cell_x * CELL + 1
    at = first[:, None] + np.arange(CELL)
    three, framed = three.reshape(-1), framed.reshape(-1)
    north, under, south = three[at - across], three[at - layer], three[at - layer + across]
    under_north, west, bits = three[at - layer - across], framed[at - 1], framed[at]
    ends = [0, CELL - 1]  # the triples of the first and the last voxel span all six
    rim = np.concatenate(
        (north[:, ends], under[:, ends], south[:, ends], under_north[:, ends]), axis=1
    )
    some = (rim.any(axis=1)) | (west[:, 0] > 0)
    every = (rim == 7).all(axis=1) & (west[:, 0] > 0)
    uniform = every | ~some
    differs = (bits != every[:, None]).any(axis=1)
    east = np.zeros((depth, height, width), dtype=np.int16)
    east[:, :, :-1] = lit[:, :, 1:]
    models = np.empty((len(first), 1 + CELL), dtype=np.int16)
    models[:, 0] = group + row + CELL * a + 16 * every + 32 * east[slab, cell_y, cell_x]
    models[:, 1:] = shape + (
        north.astype(np.int16)
        | under.astype(np.int16) << 3
        | south.astype(np.int16) << 6
        | (under_north.astype(np.int16) >> 1 & 1) << 9
        | west.astype(np.int16) << 10
    )
    values = np.concatenate((differs[:, None], bits), axis=1).astype(np.uint8)
    used = np.repeat((differs | ~uniform)[:, None], 1 + CELL, axis=1)
    used[:, 0] = uniform
    counts = np.bincount(slab, weights=used.sum(axis=1), minlength=depth).astype(np.int64)
    return models[used], values[used], counts

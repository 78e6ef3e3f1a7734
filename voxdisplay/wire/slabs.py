"""Encoder of voxel sets as range-coded slabs: SLABS and VALUES (protocol.md, 7.11 and 7.13).

Must not know what the voxels are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig, Ints, little_endian
from voxdisplay.wire.slab_boxes import Coding, column_numbers, encode_boxes, plain_decisions
from voxdisplay.wire.slab_values import ValueMode
from voxdisplay.wire.value_weights import fitted_weights

# Cells along the sides of a column: local statistics are worth more than long boxes. A slab of many
# values is long, and columns of half the side fill a payload better.
_COLUMN_CELLS = 1 << spec.SLABS_SIDE_BITS
_WIDE, _NARROW = 1 << spec.VALUES_SIDE_BITS, 1 << spec.VALUES_SIDE_BITS - 1
# With more cells than this for each voxel, to code them takes longer than what they save takes on
# the line. A few cells are always tried.
_SPARSE_CELLS, _FEW_CELLS = 64, 1 << 15
_ZERO_WEIGHT = 1 << spec.VALUES_WEIGHT_BITS - 1
# A mode is chosen by all of so few voxels, or by so many blocks of such a side.
_SMALL, _BLOCKS, _BLOCK = 20_000, 5, 16
# Sampled bytes above those of other ops from which on a set is not coded whole.
_HOPELESS = 1.1


def encode_slabs(index: Ints, pen: int, config: EncoderConfig) -> list[bytes]:
    """Return the payloads that draw a set of voxels with one pen; each ends with one SLABS.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once.
    pen : int
        Pixel value.
    config : EncoderConfig

    Returns
    -------
    list of bytes
        At most ``config.max_payload`` bytes each.

    """
    full = pen == config.format.full
    pixel = little_endian(np.array([pen]), config.format.bytes).tobytes()
    head = (b"" if full else bytes((spec.OP_PEN,)) + pixel) + bytes((spec.OP_SLABS,))
    coding = Coding(head, spec.SLABS_SIDE_BITS)
    return encode_boxes(index, None, _COLUMN_CELLS, coding, config)


def are_too_sparse(index: Ints, config: EncoderConfig) -> bool:
    """Return whether nearly all cells around a set are dark, which takes long to code.

    Parameters
    ----------
    index : (n,) int64 array
        As of `encode_slabs`.
    config : EncoderConfig

    """
    column, order = column_numbers(index, _COLUMN_CELLS, config)
    first = np.flatnonzero(np.diff(column, prepend=-1))
    cells = np.ones(len(first), dtype=np.int64)
    for axis in config.grid.voxels_at(index).T:
        place = (axis // spec.SLABS_CELL)[order]
        cells *= np.maximum.reduceat(place, first) - np.minimum.reduceat(place, first) + 1
    return int(cells.sum()) > max(_SPARSE_CELLS * len(index), _FEW_CELLS)


def encode_values(
    index: Ints, values: NDArray[np.integer], mode: ValueMode, cells: int, config: EncoderConfig
) -> list[bytes]:
    """Return the payloads that draw a set of voxels of many values; each is one VALUES.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once.
    values : (n,) integer array
        Pixel values, none of them 0.
    mode : ValueMode
    cells : int
        Cells along the sides of the columns into which the page is cut.
    config : EncoderConfig

    """
    numbers = [(int(mode.copies), 1), (int(mode.weights is not None), 1)]
    numbers += [(weight + _ZERO_WEIGHT, spec.VALUES_WEIGHT_BITS) for weight in mode.weights or ()]
    head = bytes((spec.OP_VALUES,))
    coding = Coding(head, spec.VALUES_SIDE_BITS, plain_decisions(numbers), mode)
    return encode_boxes(index, values, cells, coding, config)


def encode_values_best(
    index: Ints, values: NDArray[np.integer], most_bytes: float, config: EncoderConfig
) -> list[bytes]:
    """Return the payloads that draw a set of voxels of many values in the mode that suits them.

    A sample decides about the mode.

    Parameters
    ----------
    index, values, config
        As of `encode_values`, n >= 1.
    most_bytes : float
        What other ops take: if the sample says that VALUES takes more, the result is empty.

    """
    rows = _sample(index, config)
    some, of_some = index[rows], values[rows]
    modes = [(ValueMode(copies=True), _WIDE), (ValueMode(), _NARROW)]
    weights = fitted_weights(some, of_some, config)
    if weights is not None:
        modes.append((ValueMode(weights=weights), _NARROW))
    sizes = [sum(map(len, encode_values(some, of_some, *mode, config))) for mode in modes]
    best = sizes.index(min(sizes))
    if sizes[best] * (len(index) / len(some)) > _HOPELESS * most_bytes:
        return []
    return encode_values(index, values, *modes[best], config)


def _sample(index: Ints, config: EncoderConfig) -> Ints:
    """Return the rows of a few blocks of voxels that lie apart; all rows of a small set."""
    if len(index) <= _SMALL:
        return np.arange(len(index))
    x, y, z = (config.grid.voxels_at(index) // _BLOCK).T.astype(np.int64)
    across, deep = (-(-side // _BLOCK) for side in config.grid[:2])
    block = x + across * (y + deep * z)
    by_block = np.sort(block)
    chosen = by_block[(np.arange(_BLOCKS) * 2 + 1) * len(index) // (2 * _BLOCKS)]
    return np.flatnonzero(np.isin(block, chosen))

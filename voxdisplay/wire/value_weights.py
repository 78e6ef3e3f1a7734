"""Least-squares weights of a voxel's neighbours, which predict its value (protocol.md, 7.13).

Must not know how values are coded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.wire import spec
from voxdisplay.wire.op_encoding import EncoderConfig, Ints
from voxdisplay.wire.slab_values import WEIGHTS, split_channels

_LARGEST = 1 << spec.VALUES_WEIGHT_BITS - 1
_PARTS = 64  # weights are multiples of 1/64
_FEWEST = 64  # equations


def fitted_weights(
    index: Ints, values: NDArray[np.integer], config: EncoderConfig
) -> tuple[int, ...] | None:
    """Return the weights, in 64ths, that predict values best; None if too few have neighbours.

    Least squares, then once more with large errors weighted down, since a small error of many
    voxels costs more than a large one of few.

    Parameters
    ----------
    index : (n,) int64 array
        Scan-order indices, ascending, each once.
    values : (n,) integer array
        Pixel values.
    config : EncoderConfig

    """
    nx, ny, _ = config.grid
    x = index % nx
    steps = np.array([1, nx, nx * ny])
    steps = np.append(steps, (steps[0] + steps[1], steps[0] + steps[2], steps[1:].sum()))
    steps = np.append(steps, steps[:3].sum())
    wanted = index[:, None] - steps
    rows = np.searchsorted(index, wanted).clip(max=len(index) - 1)
    whole = (index[rows] == wanted).all(axis=1) & (x > 0) & (index // nx % ny > 0)
    if np.count_nonzero(whole) < _FEWEST:
        return None
    channels = split_channels(values, config.format).astype(np.float64)
    known = channels[rows[whole]].transpose(0, 2, 1).reshape(-1, WEIGHTS)
    own = channels[whole].reshape(-1)
    found = _least_squares(known, own)
    scale = 1 / np.maximum(1, np.abs(known @ found - own))
    found = _least_squares(known * scale[:, None], own * scale)
    return tuple(np.rint(found * _PARTS).clip(-_LARGEST, _LARGEST - 1).astype(int).tolist())


def _least_squares(known: NDArray[np.float64], own: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the solution of the normal equations, of the least norm."""
    return np.asarray(np.linalg.pinv(known.T @ known) @ (known.T @ own))

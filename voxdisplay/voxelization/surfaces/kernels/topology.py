"""Kernels of `mesh_topology`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from voxdisplay.compute.array_types import Ints
from voxdisplay.compute.kernel_backend import jit

Hashes = NDArray[np.uint64]


def chain_and_doubles(faces: Ints, one: Hashes, two: Hashes) -> tuple[bool, bool]:
    """See `mesh_topology.chain_and_doubles`."""
    table = np.zeros(1 << (2 * len(faces) + 1).bit_length(), dtype=np.uint32)
    total, doubled = _chain_and_doubles(np.ascontiguousarray(faces), one, two, table)
    return bool(total == 0), bool(doubled)


@jit
def _chain_and_doubles(
    faces: Ints, one: Hashes, two: Hashes, table: NDArray[np.uint32]
) -> tuple[np.uint64, bool]:
    total = np.uint64(0)
    doubled = False
    last = np.uint64(len(table) - 1)
    for k in range(len(faces)):
        a, b, c = faces[k, 0], faces[k, 1], faces[k, 2]
        x, p, q = one[a], one[b], one[c]
        total += (p - x) * (two[c] - two[a]) - (q - x) * (two[b] - two[a])
        # A table with linear probing, in which 0 is no number. Halves of hashes save memory; the
        # few that agree by chance are found not to be doubles later.
        if not doubled:
            whole = x + p + q
            key, at = max(np.uint32(whole >> np.uint64(32)), np.uint32(1)), whole & last
            while table[at] != 0 and table[at] != key:
                at = (at + np.uint64(1)) & last
            doubled = table[at] == key
            table[at] = key
    return total, doubled


def vertex_hashes(points: NDArray[np.int32]) -> tuple[Hashes, Hashes]:
    """See `mesh_topology.vertex_hashes`."""
    hashes: tuple[Hashes, Hashes] = _vertex_hashes(points.view(np.uint32))
    return hashes


@jit
def _scrambled(value: np.uint64) -> np.uint64:
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


@jit
def _vertex_hashes(points: NDArray[np.uint32]) -> tuple[Hashes, Hashes]:
    size = points.shape[1]
    one, two = np.empty(size, dtype=np.uint64), np.empty(size, dtype=np.uint64)
    # Constants of `mesh_topology`.
    first, second = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xB7E151628AED2A6B)
    third = np.uint64(0x243F6A8885A308D3)
    for k in range(size):
        base = np.uint64(points[0, k]) | (np.uint64(points[1, k]) << np.uint64(32))
        one[k] = _scrambled(_scrambled(base * first) + np.uint64(points[2, k]) * second)
        two[k] = _scrambled(one[k] * third + first)
    return one, two

"""Guarantees for fixed random curves of many kinds."""

import pytest
from guarantees import KINDS, check, profile

from voxdisplay.voxelization import voxelize_many

# The judge needs fifty times as long for a rough curve as for others.
FEW = {kind: 8 if kind.startswith("rough") else 80 for kind in KINDS}
MANY = 800


@pytest.mark.parametrize("kind", KINDS)
def test_guarantees(kind: str) -> None:
    curves = profile(kind, FEW[kind])
    for curve, sequence in zip(curves, voxelize_many(curves), strict=True):
        check(sequence, curve)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_guarantees_of_ten_thousand(kind: str) -> None:
    curves = profile(kind, MANY)
    for curve, sequence in zip(curves, voxelize_many(curves), strict=True):
        check(sequence, curve)

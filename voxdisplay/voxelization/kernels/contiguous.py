"""Contiguous arrays, as kernels take them."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.int8]
Pieces = NDArray[np.int32]
Rows = TypeVar("Rows", bound=NDArray[Any])


def packed(rows: Rows) -> Rows:
    """Return rows as a C-contiguous array, so that there is one kernel to compile."""
    array: Rows = np.ascontiguousarray(rows)  # type: ignore[assignment]
    return array

"""Type aliases of arrays, and of functions over them. Knows only numpy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Evaluate = Callable[[Ints, Floats], Floats]
"""Evaluation of several functions at once: which, (n,) ascending; at t, (n,) -> values."""

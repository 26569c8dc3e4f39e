"""Types of arrays; docstrings give shapes and units."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import NDArray

__all__ = ["ZERO", "Array", "Complexes", "Indices", "Integers", "Mask"]

Array = NDArray[np.float64]
"""Real numbers."""

Complexes = NDArray[np.complex128]
"""Complex numbers."""

Integers = NDArray[np.int64]
"""Counts, signs and status codes."""

Indices = NDArray[np.intp]
"""Positions in another array."""

Mask = NDArray[np.bool_]
"""Which entries of another array."""

ZERO = cast(int, np.int64(0))
"""Zero of a count that is handed to a kernel: for a literal numba would compile the kernel once more."""

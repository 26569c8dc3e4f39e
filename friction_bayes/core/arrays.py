"""Types of arrays; docstrings give shapes and units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Indices", "Integers", "Mask"]

Array = NDArray[np.float64]
"""Real numbers."""

Integers = NDArray[np.int64]
"""Counts, signs and status codes."""

Indices = NDArray[np.intp]
"""Positions in another array."""

Mask = NDArray[np.bool_]
"""Which entries of another array."""

"""Strict JSON: plain values only, and null where a number does not exist."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, overload

import numpy as np

__all__ = ["plain", "strict_json"]


@overload
def plain(value: Mapping[str, Any]) -> dict[str, Any]: ...
@overload
def plain(value: Any) -> Any: ...
def plain(value: Any) -> Any:
    """Turn NumPy values, tuples, sets and paths into what JSON can hold, non-finite numbers into None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    return value


def strict_json(value: Mapping[str, Any] | Sequence[Any], *, indent: int | None = 2) -> str:
    """Return ``value`` as JSON without NaN or infinities, which become null."""
    return json.dumps(plain(value), indent=indent, allow_nan=False, ensure_ascii=False)

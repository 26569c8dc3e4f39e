"""A record: an ``xarray.DataArray`` over ``time`` that says what was measured, in which unit."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.quantities import Quantity, quantity_named, to_si

__all__ = ["make_record", "record_name", "record_quantity"]


def make_record(
    time: ArrayLike,
    values: ArrayLike,
    quantity: str,
    *,
    unit: str | None = None,
    name: str = "record",
    **attrs: Any,
) -> xr.DataArray:
    """Build a record, in SI units.

    Parameters
    ----------
    time : array_like, shape (n,)
        Sample times [s].
    values : array_like, shape (n,)
        The signal, in ``unit``.
    quantity : str
        One of :data:`friction_bayes.quantities.QUANTITIES`.
    unit : str, optional
        Unit of ``values``; SI when left out. Other known units are converted, uncalibrated ones kept.
    name : str
        What messages and figures call it.
    **attrs
        Further attributes, such as ``synthetic=True``.

    Returns
    -------
    xarray.DataArray
        Dimension ``time`` (attribute ``units`` "s"); attributes ``quantity``, ``units``, ``name``.
    """
    kind = quantity_named(quantity)
    factor, si_unit = to_si(kind, kind.unit if unit is None else unit)
    clock = xr.Variable("time", np.asarray(time, dtype=float), {"units": "s", "standard_name": "time"})
    return xr.DataArray(
        np.asarray(values, dtype=float) * factor,
        dims=("time",),
        coords={"time": clock},
        name=kind.name,
        attrs={"quantity": kind.name, "units": si_unit, "name": name, **attrs},
    )


def record_quantity(record: xr.DataArray) -> Quantity:
    """Return the :class:`~friction_bayes.quantities.Quantity` a record holds."""
    return quantity_named(record.attrs.get("quantity", ""), place=f"{record_name(record)}: attribute quantity")


def record_name(record: xr.DataArray) -> str:
    """Return what messages call the record."""
    return str(record.attrs.get("name", "record"))

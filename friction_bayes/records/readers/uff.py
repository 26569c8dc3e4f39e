"""Universal file format, data set 58: functions at nodal degrees of freedom."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_uff"]

TIME_RESPONSE = 1
"""Function type of a data set 58 over time."""

ORDINATES = {8: "displacement", 11: "velocity", 12: "acceleration"}
"""Ordinate data types of a data set 58."""


def read_uff(path: Path) -> Table:
    """Read the time responses of a universal file as columns "0", "1", ... in their order.

    Parameters
    ----------
    path : Path
        The file.
    """
    pyuff = optional_package("pyuff", path)
    try:
        file = pyuff.UFF(str(path))
        sets = [file.read_sets(k) for k, kind in enumerate(file.get_set_types()) if int(kind) == 58]
    except Exception as error:  # pyuff raises bare Exception
        raise InputError(
            str(path), f"this is not a universal file ({error})", "give the suffix of its format"
        ) from None
    responses = [content for content in sets if content["func_type"] == TIME_RESPONSE]
    return Table(
        {
            str(k): Column(
                partial(np.asarray, content["data"]),
                quantity=ORDINATES.get(content["ordinate_spec_data_type"]),
                unit=content["ordinate_axis_units_lab"].strip() or None,
                clock=partial(np.asarray, content["x"]),
            )
            for k, content in enumerate(responses)
        }
    )

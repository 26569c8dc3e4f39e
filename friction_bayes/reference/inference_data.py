"""What was sampled, as the installed ArviZ reads it."""

from __future__ import annotations

import warnings
from types import ModuleType
from typing import Any

import xarray as xr

from friction_bayes.core.optional import package_of_extra

__all__ = ["load_arviz", "to_inference_data"]


def load_arviz(purpose: str) -> ModuleType:
    """Import ArviZ, of either generation.

    Parameters
    ----------
    purpose : str
        What for, as in "drawing ranks".

    Raises
    ------
    InputError
        If it is not installed.
    """
    with warnings.catch_warnings():
        # 0.2x announces 1.x whenever it is loaded
        warnings.simplefilter("ignore", FutureWarning)
        return package_of_extra("arviz", place="draws of the sampler", purpose=purpose, extra="arviz")


def to_inference_data(tree: xr.DataTree) -> Any:
    """Return draws as the functions of the installed ArviZ read them.

    ArviZ 1.x reads trees as they are; ArviZ 0.2x, the newest for Python 3.11, has a class of its own.

    Parameters
    ----------
    tree : xarray.DataTree
        From :func:`friction_bayes.sample_reference`, ``posterior`` of a loop's report, or a file of draws
        that a command wrote, opened with ``xarray.open_datatree``; also a group of these that has groups
        itself, such as ``tree["other_part"]``.

    Returns
    -------
    xarray.DataTree or arviz.InferenceData
        ``tree`` itself with ArviZ 1.x; with 0.2x its groups, without those that have groups themselves.

    Raises
    ------
    InputError
        If ArviZ is not installed.
    """
    arviz = load_arviz("making them ready for ArviZ")
    if not arviz.__version__.startswith("0."):
        return tree
    groups = {name: node.to_dataset() for name, node in tree.children.items() if not node.children}
    return arviz.InferenceData(attrs=dict(tree.attrs), **groups)

"""Friction from free decay: closed-form Bayesian estimators checked against MCMC.

Every public name is loaded at its first use, so that ``import friction_bayes`` stays light and
nothing but a reference run or a figure ever loads emcee, ArviZ or matplotlib.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from friction_bayes.batch import estimate_batch
    from friction_bayes.conjugate.gamma_exponential import GammaExponential
    from friction_bayes.conjugate.normal_gamma import NormalGamma
    from friction_bayes.conjugate.regression import NormalInverseGamma
    from friction_bayes.datasets import dataset_record, list_datasets
    from friction_bayes.errors import FrictionBayesError, InputError, NotConvergedWarning, RecordWarning
    from friction_bayes.estimation import estimate
    from friction_bayes.forces import Estimate
    from friction_bayes.loop import LoopReport, close_loop
    from friction_bayes.mechanics.oscillator import Oscillator, Pendulum
    from friction_bayes.mechanics.testbed import simulate
    from friction_bayes.monitor import MonitorReport, monitor_fleet, monitor_records
    from friction_bayes.readers import read_record
    from friction_bayes.record import make_record
    from friction_bayes.reference import sample_reference
    from friction_bayes.writers import write_record

_HOME = {
    "Estimate": "forces",
    "FrictionBayesError": "errors",
    "GammaExponential": "conjugate.gamma_exponential",
    "InputError": "errors",
    "LoopReport": "loop",
    "MonitorReport": "monitor",
    "NormalGamma": "conjugate.normal_gamma",
    "NormalInverseGamma": "conjugate.regression",
    "NotConvergedWarning": "errors",
    "Oscillator": "mechanics.oscillator",
    "Pendulum": "mechanics.oscillator",
    "RecordWarning": "errors",
    "close_loop": "loop",
    "dataset_record": "datasets",
    "estimate": "estimation",
    "estimate_batch": "batch",
    "list_datasets": "datasets",
    "make_record": "record",
    "monitor_fleet": "monitor",
    "monitor_records": "monitor",
    "read_record": "readers",
    "sample_reference": "reference",
    "simulate": "mechanics.testbed",
    "write_record": "writers",
}

__version__ = version("friction-bayes")

__all__ = [
    "Estimate",
    "FrictionBayesError",
    "GammaExponential",
    "InputError",
    "LoopReport",
    "MonitorReport",
    "NormalGamma",
    "NormalInverseGamma",
    "NotConvergedWarning",
    "Oscillator",
    "Pendulum",
    "RecordWarning",
    "__version__",
    "close_loop",
    "dataset_record",
    "estimate",
    "estimate_batch",
    "list_datasets",
    "make_record",
    "monitor_fleet",
    "monitor_records",
    "read_record",
    "sample_reference",
    "simulate",
    "write_record",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

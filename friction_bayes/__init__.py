"""Friction from free decay: closed-form Bayesian estimators checked against MCMC.

Every public name is loaded at its first use, so that ``import friction_bayes`` stays light and
nothing but a reference run or a figure ever loads emcee, ArviZ or matplotlib.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from friction_bayes.conjugate.gamma_exponential import GammaExponential
    from friction_bayes.conjugate.normal_gamma import NormalGamma
    from friction_bayes.conjugate.regression import NormalInverseGamma
    from friction_bayes.core.errors import FrictionBayesError, InputError, NotConvergedWarning, RecordWarning
    from friction_bayes.core.system import Oscillator, Pendulum
    from friction_bayes.decay.several_decays import split_decays
    from friction_bayes.estimators.batch import estimate_batch
    from friction_bayes.estimators.estimate import estimate
    from friction_bayes.estimators.result import Estimate
    from friction_bayes.loop import LoopReport, close_loop
    from friction_bayes.mechanics.simulate import simulate
    from friction_bayes.monitor import MonitorReport, monitor_fleet, monitor_records
    from friction_bayes.records.datasets import dataset_record, list_datasets
    from friction_bayes.records.readers import read_record
    from friction_bayes.records.record import make_record
    from friction_bayes.records.writers import write_record
    from friction_bayes.reference import sample_reference, to_inference_data

_HOME = {
    "Estimate": "estimators.result",
    "FrictionBayesError": "core.errors",
    "GammaExponential": "conjugate.gamma_exponential",
    "InputError": "core.errors",
    "LoopReport": "loop",
    "MonitorReport": "monitor",
    "NormalGamma": "conjugate.normal_gamma",
    "NormalInverseGamma": "conjugate.regression",
    "NotConvergedWarning": "core.errors",
    "Oscillator": "core.system",
    "Pendulum": "core.system",
    "RecordWarning": "core.errors",
    "close_loop": "loop",
    "dataset_record": "records.datasets",
    "estimate": "estimators.estimate",
    "estimate_batch": "estimators.batch",
    "list_datasets": "records.datasets",
    "make_record": "records.record",
    "monitor_fleet": "monitor",
    "monitor_records": "monitor",
    "read_record": "records.readers",
    "sample_reference": "reference",
    "simulate": "mechanics.simulate",
    "split_decays": "decay.several_decays",
    "to_inference_data": "reference.inference_data",
    "write_record": "records.writers",
}

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
    "split_decays",
    "to_inference_data",
    "write_record",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        value = import_module("importlib.metadata").version("friction-bayes")
    elif name in _HOME:
        value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__.copy()

"""The gain from modelling heavy tails: expected deviances of Gaussian and contaminated-Gaussian noise."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

__all__ = ["deviance_of_outliers", "deviance_with_outliers"]

_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(12)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
_SAMPLES = 400  # of a misfit that fills the record: enough to separate a loss of 10 from one of hundreds


def _log_contaminated(
    z: NDArray[np.float64], fraction: float, scale: float, sd: float
) -> NDArray[np.float64]:
    """Log density, without the constant, of ``(1-fraction) N(0, sd^2) + fraction N(0, (scale sd)^2)``."""
    core = math.log1p(-fraction) - math.log(sd) - 0.5 * (z / sd) ** 2
    tail = math.log(fraction) - math.log(scale * sd) - 0.5 * (z / (scale * sd)) ** 2
    return np.logaddexp(core, tail)


def deviance_of_outliers(n: int, fraction: float, scale: float) -> float:
    """Expected deviance that Gaussian noise loses to the true contaminated noise.

    ``2 n KL``, the Gaussian with the mixture's own variance; the integral by quadrature.

    Parameters
    ----------
    n : int
        Samples.
    fraction, scale : float
        Of the contamination.
    """
    variance = 1.0 - fraction + fraction * scale**2
    divergence = 0.0
    for weight, width in ((1.0 - fraction, 1.0), (fraction, scale)):
        # dense in the core also under the wide component, where the two densities part
        z = np.linspace(-9.0 * width, 9.0 * width, 20001)
        density = np.exp(-0.5 * (z / width) ** 2) / (width * math.sqrt(2.0 * math.pi))
        ratio = _log_contaminated(z, fraction, scale, 1.0) + 0.5 * math.log(variance) + 0.5 * z**2 / variance
        divergence += weight * float(np.trapezoid(density * ratio, z))
    return 2.0 * n * divergence


def deviance_with_outliers(misfit: NDArray[np.float64], weight: float) -> float:
    """Expected deviance that contaminated noise around a wrong motion loses to the truth with Gaussian noise.

    Parameters
    ----------
    misfit : ndarray, shape (n,)
        Wrong motion minus the true one, in noise standard deviations.
    weight : float
        Samples that each one represents.

    Returns
    -------
    float
        At the best fraction, scale and standard deviation.
    """
    stride = max(misfit.size // _SAMPLES, 1)
    misfit, weight = misfit[::stride], weight * misfit.size / misfit[::stride].size
    z = misfit[:, None] + _NODES
    truth = -0.5 * float(_WEIGHTS @ _NODES**2) * misfit.size

    def deviance(q: NDArray[np.float64]) -> float:
        fraction = 0.5 / (1.0 + math.exp(-q[0]))
        log_density = _log_contaminated(z, fraction, 1.0 + math.exp(q[1]), math.exp(q[2]))
        return 2.0 * weight * (truth - float((log_density @ _WEIGHTS).sum()))

    start = np.array([-3.0, 1.0, 0.0])
    best = minimize(
        deviance, start, method="Nelder-Mead", options={"maxiter": 120, "fatol": 0.1, "xatol": 1e-2}
    )
    return float(best.fun)

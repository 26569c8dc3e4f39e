"""Area of the joint 90 % region of friction and precision, which the paper compares before and after."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from friction_bayes.conjugate.normal_gamma import NormalGamma

__all__ = ["credible_area"]


def credible_area(pair: NormalGamma, p: float = 0.9) -> float:
    r"""Area of the region of highest density of mass ``p`` [unit of r times unit of s].

    At a precision ``s`` the region reaches ``sqrt(2 (g(s) - level) / (lam s))`` to either side of ``mu``,
    with ``g`` the log-density on the ridge ``r = mu``. Its area goes as ``1 / sqrt(lam beta)`` and else
    depends on ``alpha`` alone.

    Parameters
    ----------
    pair : NormalGamma
        Proper.
    p : float
        Mass of the region.
    """
    return _unit_area(pair.alpha, p) / math.sqrt(pair.lam * pair.beta)


@lru_cache(maxsize=4096)
def _unit_area(alpha: float, p: float) -> float:
    unit = NormalGamma(mu=0.0, lam=1.0, alpha=alpha, beta=1.0)
    level = unit.credible_level(p)

    def above(log_s: float) -> float:
        return float(unit.logpdf(0.0, math.exp(log_s))) - level

    mode = math.log(alpha - 0.5) if alpha > 0.5 else -700.0
    top = brentq(above, max(mode, -700.0), math.log(alpha + 50.0 + 20.0 * math.sqrt(alpha)))
    bottom = brentq(above, -700.0, mode) if alpha > 0.5 and above(-700.0) < 0.0 else -700.0
    # the integrand ends as a square root at either side: midpoints in the sine of an angle
    angle = (np.arange(4000) + 0.5) / 4000 * math.pi
    log_s = 0.5 * (bottom + top) - 0.5 * (top - bottom) * np.cos(angle)
    height = np.maximum(unit.logpdf(0.0, np.exp(log_s)) - level, 0.0)
    density = 2.0 * np.sqrt(2.0 * height * np.exp(log_s))
    return float(np.sum(density * np.sin(angle)) * 0.5 * (top - bottom) * math.pi / 4000)

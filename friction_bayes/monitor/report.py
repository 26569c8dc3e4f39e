"""What monitoring says, ordered by the blocks of ISO 13374: acquisition to advice."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.core.checks import positive
from friction_bayes.core.displays import Shown
from friction_bayes.core.summary import Summary
from friction_bayes.monitor.laws import WearLaws, fit_laws
from friction_bayes.monitor.points import DetectionPoints, per
from friction_bayes.monitor.remaining_life import RemainingLife
from friction_bayes.monitor.tracking import Track, choose_discount, track

__all__ = ["MonitorReport", "follow"]

QUANTILES = (0.05, 0.5, 0.95)
"""Of the remaining life."""
_FAR = 3.0
"""A remaining life of more spans of the detection points than this is called an extrapolation."""
_HORIZON = 10.0
"""Spans of the detection points ahead for which the probability not to reach the threshold is reported."""
_SURE = 0.95
"""Probability from which a record is said to have been above the threshold, or below it again."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MonitorReport(Shown):
    """Friction of one machine followed over its detection points.

    Attributes
    ----------
    points : DetectionPoints
        The estimates.
    plain, forgetting : Track
        f(r|Ti) with the whole posterior as the next prior, and with the discount the forecasts chose.
    wear : WearLaws
        Laws of wear with their probabilities; drift, diffusion, scatter and friction at Tn.
    threshold : float or None
        Friction at which the machine fails.
    life : RemainingLife or None
        f(dt|Tn); None without a threshold.
    acquisition, manipulation : tuple of dict
        What is known of each record and of its estimate.
    times_from : str
        What said when the records were taken.
    """

    points: DetectionPoints
    plain: Track
    forgetting: Track
    wear: WearLaws
    threshold: float | None
    life: RemainingLife | None
    acquisition: tuple[Mapping[str, Any], ...] = ()
    manipulation: tuple[Mapping[str, Any], ...] = ()
    times_from: str = ""

    @property
    def names(self) -> list[str]:
        """T1, T2, ... Tn."""
        return [f"T{i + 1}" for i in range(self.points.times.size)]

    def density(self, point: int, *, forgetting: bool = True) -> Any:
        """f(r|Ti) as a frozen normal, the uncertainty of mass and stiffness in it; ``point`` from zero."""
        followed = self.forgetting if forgetting else self.plain
        return self._normal(float(followed.mean[point]), float(followed.sd[point]))

    def _normal(self, mean: float, sd: float) -> Any:
        return stats.norm(mean, math.hypot(sd, mean * self.points.relative_sd))

    def _friction(self, mean: float, sd: float) -> dict[str, Any]:
        return Summary.of_distribution(self._normal(mean, sd), self.points.unit).to_dict()

    def _moments(self, name: str, unit: str) -> dict[str, Any]:
        mean, sd = self.wear.moments(name)
        return {"mean": mean, "sd": sd, "unit": unit}

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers and words, for JSON; infinite times become null there."""
        points, unit = self.points, self.points.unit
        n = points.times.size
        rate = per(unit, points.time_unit)
        level, level_sd = self.wear.moments("level")
        return {
            "data_acquisition": {
                "points": [
                    {"point": name, "time": float(time)} | dict(known)
                    for name, time, known in zip(self.names, points.times, self.acquisition, strict=True)
                ],
                "time_unit": points.time_unit,
                "times_from": self.times_from,
            },
            "data_manipulation": {
                "method": "waveform",
                "points": [
                    {"point": name} | dict(known)
                    for name, known in zip(self.names, self.manipulation, strict=True)
                ],
            },
            "state_detection": {
                "forgetting": self._track(self.forgetting)
                | {"rule": "power prior; the discount with the best one-step forecasts of all points"},
                "plain": self._track(self.plain) | {"rule": "the posterior is the next prior"},
                "lag_of_plain": {"mean": float(points.friction[-1] - self.plain.mean[-1]), "unit": unit},
            },
            "health_assessment": {
                "friction": self._friction(level, level_sd),
                "threshold": self.threshold,
                "probability_above_threshold": None if self.life is None else self.life.already,
                "drift": self._moments("drift", rate),
                "diffusion": self._moments("wander", f"{unit}/sqrt({points.time_unit})"),
                "scatter": self._moments("scatter", unit),
                "includes_system_uncertainty": points.relative_sd > 0.0,
                "detection_points": n,
            },
            "prognostic_assessment": self._prognosis(),
            "advisory_generation": self.advice(),
        }

    def _track(self, followed: Track) -> dict[str, Any]:
        return {
            "discount": followed.discount,
            "log_predictive": followed.log_predictive,
            "friction": [
                self._friction(float(mean), float(sd))
                for mean, sd in zip(followed.mean, followed.sd, strict=True)
            ],
        }

    def _prognosis(self) -> dict[str, Any] | None:
        if self.life is None:
            return None
        low, middle, high = (self.life.ppf(q) for q in QUANTILES)
        return {
            "remaining_life": {"median": middle, "interval90": [low, high], "unit": self.points.time_unit},
            "probability_reached_already": self.life.already,
            "probability_never_reached": self.life.never,
            "not_reached_within_horizon": {
                "horizon": self.horizon,
                "unit": self.points.time_unit,
                "probability": 1.0 - float(self.life.cdf(self.horizon)),
            },
            "laws_of_wear": self.wear.probabilities,
            "repaired_crossings": self.repaired_crossings,
            "model": (
                "Wiener process with drift on the clocks of the laws of wear, averaged by evidence; "
                "first passage of the threshold, in closed form"
            ),
        }

    @property
    def horizon(self) -> float:
        """Time ahead for which the probability not to reach the threshold is reported: ten spans."""
        return _HORIZON * self.points.span

    @property
    def repaired_crossings(self) -> list[str]:
        """Detection points whose record was above the threshold while a later one is below it again."""
        if self.threshold is None:
            return []
        above = np.asarray(stats.norm.sf(self.threshold, self.points.friction, self.points.sd))
        below_again = np.flatnonzero(above <= 1.0 - _SURE)
        last = below_again[-1] if below_again.size else 0
        return [self.names[i] for i in np.flatnonzero(above[:last] >= _SURE)]

    def _repaired(self) -> str:
        crossed = self.repaired_crossings
        if not crossed:
            return ""
        some = f"{crossed[0]} to {crossed[-1]}" if len(crossed) > 1 else crossed[0]
        return (
            f"; friction was above the threshold at {some} and has fallen below it again, as after a repair: "
            "for the wear since then give the records since then alone"
        )

    def advice(self) -> dict[str, str]:
        """Say in one sentence what follows, and in one word which case it is."""
        if self.life is None or self.threshold is None:
            return {"case": "no_threshold", "text": "no threshold was given, so there is no remaining life"}
        unit, what = self.points.time_unit, f"{self.threshold:g} {self.points.unit}"
        low, middle, high = (self.life.ppf(q) for q in QUANTILES)
        if self.life.already >= 0.5:
            text = f"friction is at or above {what} with probability {self.life.already:.2g}: act now"
            text += self._repaired()
            return {"case": "threshold_passed", "text": text}
        if not math.isfinite(middle):
            text = (
                f"friction is not approaching {what}: the probability that it never reaches it is "
                f"{self.life.never:.2g}"
            )
            if math.isfinite(low):
                text += f"; it may as early as {low:.4g} {unit} from now (5 %)"
            text += self._repaired()
            return {"case": "not_approaching", "text": text}
        end = f"{high:.4g}" if math.isfinite(high) else "never"
        text = f"friction reaches {what} in {middle:.4g} {unit} (90 %: {low:.4g} .. {end})"
        if low > 0.0:
            text += f"; up to {low:.4g} {unit} from now the probability is below 5 %"
        if middle > _FAR * self.points.span:
            text += f"; this is {middle / self.points.span:.2g} times the time observed so far"
        if not math.isfinite(high):
            text += f"; it may never reach it, with probability {self.life.never:.2g}"
        text += self._repaired()
        return {"case": "approaching", "text": text}

    def to_dataset(self) -> xr.Dataset:
        """Return estimates, tracks and, with a threshold, the remaining life as arrays with units."""
        points, unit = self.points, self.points.unit
        columns = {
            "estimate_mean": (points.friction, "estimate from the record alone"),
            "estimate_sd": (points.sd, "its standard deviation, mass and stiffness exact"),
            "friction_mean": (self.forgetting.mean, "f(r|Ti) with forgetting"),
            "friction_sd": (self.forgetting.sd, "its standard deviation, mass and stiffness exact"),
            "plain_mean": (self.plain.mean, "f(r|Ti) without forgetting"),
            "plain_sd": (self.plain.sd, "its standard deviation, mass and stiffness exact"),
        }
        dataset = xr.Dataset(
            {
                name: ("point", values, {"units": unit, "long_name": text})
                for name, (values, text) in columns.items()
            },
            coords={
                "point": self.names,
                "detection_time": ("point", points.times, {"units": points.time_unit}),
            },
            attrs={"discount": self.forgetting.discount, "relative_sd_of_factor": points.relative_sd},
        )
        if self.life is None or self.threshold is None:
            return dataset
        life = xr.Dataset(
            {
                "remaining_life_density": ("remaining", self.life.density),
                "remaining_life_cdf": ("remaining", self.life.cumulative),
            },
            coords={"remaining": ("remaining", self.life.time, {"units": points.time_unit})},
        )
        return dataset.merge(life).assign_attrs(
            threshold=self.threshold,
            probability_reached_already=self.life.already,
            probability_never_reached=self.life.never,
        )


@single_threaded_blas()
def follow(
    points: DetectionPoints,
    threshold: float | None,
    *,
    acquisition: Sequence[Mapping[str, Any]] = (),
    manipulation: Sequence[Mapping[str, Any]] = (),
    times_from: str = "",
) -> MonitorReport:
    """Follow the friction of one machine over at least two detection points.

    Parameters
    ----------
    points : DetectionPoints
    threshold : float, optional
        Friction at which the machine fails, positive.
    acquisition, manipulation, times_from
        Kept for the report.

    Raises
    ------
    InputError
        If the threshold is not a positive number.
    """
    if threshold is not None:
        positive("threshold", threshold)
    wear = fit_laws(points.times, points.friction, points.sd)
    life = None
    nothing: list[Mapping[str, Any]] = [{}] * points.times.size
    if threshold is not None:
        life = wear.remaining_life(threshold, relative_sd=points.relative_sd)
    return MonitorReport(
        points=points,
        plain=track(points.friction, points.sd),
        forgetting=track(points.friction, points.sd, choose_discount(points.friction, points.sd)),
        wear=wear,
        threshold=threshold,
        life=life,
        acquisition=tuple(acquisition or nothing),
        manipulation=tuple(manipulation or nothing),
        times_from=times_from,
    )

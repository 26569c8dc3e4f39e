"""The report of a closed loop: plain fields for ``report.json``, and arrays to draw."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.displays import Shown
from friction_bayes.core.strict_json import plain
from friction_bayes.core.summary import summary_arrays, summary_table
from friction_bayes.core.text import interval90, number, set_words
from friction_bayes.loop.data.prepared_record import Segment

__all__ = ["FluctuationTrace", "Forecast", "LoopReport", "RecordTrace"]


@dataclass(frozen=True, kw_only=True, eq=False)
class FluctuationTrace:
    """The force that the law of a record does not explain, along its smoothed motion.

    Attributes
    ----------
    force, sd : ndarray, shape (n,)
        Smoothed random force and its standard deviation, in ``unit``.
    displacement, velocity : ndarray, shape (n,)
        Of the smoothed motion [m and m/s, or rad and rad/s].
    friction : float
        Sliding friction, in ``unit``.
    unit : str
    knocks : tuple of (float, float)
        Start and end of each knock, seconds in the record.
    fluctuates : bool
        Whether it acts in addition to the knocks.
    """

    force: Array
    sd: Array
    displacement: Array
    velocity: Array
    friction: float
    unit: str
    knocks: tuple[tuple[float, float], ...] = ()
    fluctuates: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Forecast:
    """The last part of a moving record, measured and predicted from the first part.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds in the record.
    signal : ndarray, shape (n,)
        Measured.
    mean, sd : ndarray, shape (n,)
        Of the predictive distribution of the signal, noise of the sensor included.
    free : ndarray of bool, shape (n,)
        Samples that are not clipped: they are compared.
    monte_carlo : float
        Variance, to first order, of the sum of squared errors over the draws that the mean is of.
    """

    time: Array
    signal: Array
    mean: Array
    sd: Array
    free: Mask
    monte_carlo: float = 0.0

    @classmethod
    def of(cls, segment: Segment, head: int, mean: Array, sd: Array, draws: Array | None = None) -> Forecast:
        """Of the moving samples after the first ``head``; ``draws``, shape (k, n), have that mean."""
        rest = slice(head, segment.moving)
        time = segment.decay.start_time + segment.time[rest]
        found = cls(time=time, signal=segment.values[rest], mean=mean, sd=sd, free=segment.free[rest])
        if draws is None or len(draws) < 2:
            return found
        along_error = (draws - mean)[:, found.free] @ found.error
        return replace(found, monte_carlo=4.0 * float(along_error.var(ddof=1)) / len(draws))

    @property
    def error(self) -> Array:
        """Measured minus predicted, of the samples that are compared."""
        return np.asarray((self.signal - self.mean)[self.free])


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordTrace:
    """One record, and what was made of it.

    Attributes
    ----------
    name, unit, quantity : str
    time : ndarray, shape (n,)
        Seconds in the record.
    signal, before, after : ndarray, shape (n,)
        Measured, and predicted by the Coulomb model alone and by the final one.
    sides : ndarray, shape (n,)
        1 and -1 where a sample is clipped.
    phase : ndarray, shape (n,)
        Phase of the final model's motion [half cycles], zero at its first turning point.
    turning_times_before, turning_points_before : ndarray
        When the motion turns, and at which displacement, by the Coulomb model alone.
    turning_times, turning_points : ndarray
        The same by the final model.
    forces : tuple of ndarray or None
        Resisting force as measured, by the Coulomb model alone and by the final one, shape (n,) each, where
        a measured force was given.
    fluctuation : FluctuationTrace or None
        The random force, where there is one.
    forecasts : tuple of Forecast or None
        Of the part held out, by the Coulomb model alone and by all laws; None where either could not be
        fitted to the part before.
    """

    name: str
    unit: str
    quantity: str
    time: Array
    signal: Array
    before: Array
    after: Array
    sides: Array
    phase: Array
    turning_times_before: Array
    turning_points_before: Array
    turning_times: Array
    turning_points: Array
    forces: tuple[Array, ...] | None = None
    fluctuation: FluctuationTrace | None = None
    forecasts: tuple[Forecast, Forecast] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopReport(Shown):
    """What closing the loop found; ``to_dict`` is ``report.json``.

    Attributes
    ----------
    verdict : str
        ``adequate``, ``explained``, ``ambiguous`` or ``unexplained``.
    because : tuple of str
        What speaks against the number: see :func:`friction_bayes.loop.build_report.reasons_against`. With
        a forecast alone that is worse than Coulomb friction's the record is ambiguous, with any other
        unexplained.
    effects : list of dict
        Of the most probable candidate: ``name``, ``probability``, ``parameters``, and ``lines``: of what is
        lines in the spectrum each with the number of its ``record``, ``frequency``, ``decay_time`` (None of
        one that lasts) and ``amplitude`` at the start, where ``parameters`` are the strongest's; else empty.
    candidates : list of dict
        Effects and probability, most probable first.
    friction_before, friction_after : dict
        Mean, sd, 90 % interval, unit.
    friction_range : dict or None
        Where the record is unexplained: the ``readings`` of friction, each with ``what`` it is and its
        summary, ``low`` and ``high``, between which their means lie, and ``unit``; None otherwise.
    friction_agreed : bool
        Whether the candidates that hold 95 % agree on friction, each by itself, and dry friction matters with
        a probability of 95 %; False where the record is unexplained.
    dry_friction : dict
        Whether dry friction matters: ``probability`` that it takes more than the tolerance's share of the
        loss of amplitude, ``upper95``, its 95 % upper limit if there is any, and ``unit``.
    prior_sensitivity : dict
        By how many of its sd the mean of friction after would move were the priors of all effects ``0.1`` or
        ``10`` times as wide, and were each effect half or twice as probable before the record
        (``inclusion_halved``, ``inclusion_doubled``); None where it cannot be computed from these draws.
    held_out_error, residual, noise, paper_procedure : dict
    frequency : dict
        Mean and sd of what was found, ``declared`` sqrt(k/m), unit; where they differ ``from_stiffness`` and
        ``from_mass``, the friction after that each of the declared values gives, else None;
        ``trusted``, the one that friction is computed with, None where its interval spans both.
    random_force : dict or None
        ``probability`` of a force that fluctuates, and given that there is one its ``sd``,
        ``share_of_friction`` (None without friction) and ``correlation_time_s``;
        None where none was evaluated.
    witnesses : dict or None
        Friction by the ``loss`` of amplitude and by the ``shape`` within a cycle, and whether they ``agree``;
        None where the most probable candidate was not evaluated along the measured motion, and of several
        records.
    left : dict
        What the law leaves that depends on the motion, of the ``record`` where that could do most:
        ``structured_rms`` in the signal, its ``unit`` and ``share_of_amplitude``, how far
        ``friction_could_shift_by`` it, what it ``depends_on``, and the ``shape`` that describes that best
        with the ``share`` of it that it takes.
    fitted : dict
        The part of the first record that was fitted: ``from_s``, ``to_s``, ``samples`` as recorded,
        ``half_cycles`` and how many samples were ``set_aside``.
    friction_between_records : dict or None
        Where several records were fitted together: ``probability`` that friction differs between them, its
        ``spread`` given that, ``share_of_friction``, ``reduced_chi_square`` of the frictions that each has by
        itself, and ``records`` with ``name`` and ``friction`` of each.
    notes : tuple of str
        What was done to the records before any model, and which effects were asked for and not evaluated.
    next_experiment : str or None
    reference_check : dict or None
        Of the sampler, or against a reference friction.
    elapsed_s : float
    seed : int
    trail : list of str
        The steps that led to the candidates.
    traces : tuple of RecordTrace
        The records.
    posterior : xarray.DataTree
        Draws: ``posterior`` of the most probable candidate, ``mixture`` of friction over all; under
        ``reference`` what :func:`friction_bayes.reference.sample_target` returned, where it was sampled.
    """

    verdict: str
    because: tuple[str, ...] = ()
    effects: list[dict[str, Any]]
    candidates: list[dict[str, Any]]
    friction_before: dict[str, Any]
    friction_after: dict[str, Any]
    dry_friction: dict[str, Any]
    prior_sensitivity: dict[str, float | None]
    held_out_error: dict[str, Any]
    residual: dict[str, Any]
    noise: dict[str, Any]
    paper_procedure: dict[str, Any]
    frequency: dict[str, Any]
    random_force: dict[str, Any] | None
    witnesses: dict[str, Any] | None
    left: dict[str, Any]
    fitted: dict[str, Any]
    next_experiment: str | None
    reference_check: dict[str, Any] | None
    elapsed_s: float
    seed: int
    trail: list[str]
    traces: tuple[RecordTrace, ...]
    posterior: xr.DataTree
    friction_between_records: dict[str, Any] | None = None
    friction_range: dict[str, Any] | None = None
    notes: tuple[str, ...] = ()
    friction_agreed: bool = False

    def __repr__(self) -> str:
        friction, closest = self.friction_after, set_words(self.candidates[0]["effects"])
        return (
            f"LoopReport({self.verdict}, closest: {closest}; friction {number(friction['mean'])} "
            f"{friction['unit']}, 90 %: {interval90(friction)})"
        )

    def summary(self) -> Any:
        """Return the numbers as a table, as ``arviz.summary`` lays them out.

        Returns
        -------
        pandas.DataFrame
            As :func:`friction_bayes.core.summary.summary_table` describes: friction before and after, the
            parameters of each effect of the most probable candidate as ``EFFECT.PARAMETER``, the frequency,
            and the noise of the sensor.
        """
        return summary_table(self._summaries())

    def _summaries(self) -> dict[str, Any]:
        rows: dict[str, Any] = {
            "friction_before": self.friction_before,
            "friction_after": self.friction_after,
        }
        for effect in self.effects:
            for name, parameter in effect["parameters"].items():
                rows[f"{effect['name']}.{name}"] = parameter
        noise = {"mean": self.noise["sd"], "unit": self.held_out_error["unit"]}
        return rows | {"frequency": self.frequency, "noise_sd": noise}

    def to_dict(self) -> dict[str, Any]:
        """Fields of ``report.json``; numbers that are not finite are None."""
        names = (field.name for field in fields(self) if field.name not in ("traces", "posterior"))
        return {name: plain(getattr(self, name)) for name in names}

    def to_xarray(self) -> xr.Dataset:
        """Return the numbers of :meth:`summary` as arrays.

        Returns
        -------
        xarray.Dataset
            As :func:`friction_bayes.core.summary.summary_arrays` describes. Records differ in length and
            draws in shape: :meth:`to_datatree` has these.
        """
        return summary_arrays(self._summaries())

    def to_datatree(self) -> xr.DataTree:
        """Return the draws, the numbers, and each record with both predictions.

        Returns
        -------
        xarray.DataTree
            The groups of ``posterior``, ``summary`` as :meth:`to_xarray` has it, and ``records`` with one
            group each, named by its number: ``signal``, ``before`` and ``after`` over ``time`` [s].
        """
        groups = {path.strip("/"): node.to_dataset() for path, node in self.posterior.subtree_with_keys}
        groups["summary"] = self.to_xarray()
        for i, trace in enumerate(self.traces):
            values = {"signal": trace.signal, "before": trace.before, "after": trace.after}
            groups[f"records/{i}"] = xr.Dataset(
                {name: ("time", each) for name, each in values.items()},
                coords={"time": ("time", trace.time, {"units": "s"})},
                attrs={"name": trace.name, "quantity": trace.quantity},
            )
        return xr.DataTree.from_dict({path or "/": group for path, group in groups.items()})

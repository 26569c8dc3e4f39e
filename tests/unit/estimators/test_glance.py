"""A glance passes what the longer looks pass, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from decays import SYSTEM, long_decay
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.decay.location import locate_free_decays
from friction_bayes.estimators.base import FreeDecays
from friction_bayes.estimators.envelope.loss_of_amplitude import uneven_loss
from friction_bayes.estimators.noise.force_screen import force_table, probability_of_none
from friction_bayes.estimators.noise.noise_level import compared_forces, looks_white
from friction_bayes.estimators.registry import estimator_named
from friction_bayes.estimators.waveform.glance import RATHER_EVEN
from friction_bayes.statespace.kalman import Clock, sensor_row, whiten
from friction_bayes.statespace.response import at_sensor
from friction_bayes.statespace.transition import initial_response

RATE = 60.0


@pytest.mark.parametrize(("samples", "longest"), [(70, 90), (400, 400), (400, 500)])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_filters_of_a_table_are_those_of_every_record(
    order: int, samples: int, longest: int, rng: np.random.Generator
) -> None:
    """Of fewer samples than the table has, too, and of more than it takes the gains to settle."""
    step, row, forces = 0.9, sensor_row(order), compared_forces()
    phase = step * np.arange(samples)
    residual = rng.standard_normal(samples) + 0.3 * np.sin(1.01 * phase + 1.0)
    columns = np.column_stack([at_sensor(initial_response(phase), row), np.ones(samples), residual])
    log_weights = []
    for ratio, tau, log_prior in zip(*forces, strict=True):
        found = whiten(columns, Clock.of(phase), row, float(ratio), float(tau))
        gram = found.gram
        beta = np.linalg.solve(gram[:3, :3], gram[:3, 3])
        rest = gram[3, 3] - gram[3, :3] @ beta
        determinant = np.linalg.slogdet(gram[:3, :3])[1] + found.log_determinant
        log_weights.append(log_prior - 0.5 * ((samples - 3) * np.log(rest) + determinant))
    weight = np.exp(np.array(log_weights) - max(log_weights))
    expected = weight[0] / weight.sum()
    assert 1e-5 < expected < 1.0 - 1e-5
    table = force_table(step, longest, row, order, forces)
    # those of a velocity, which sees a force less, settle later
    assert order == 1 or (table.settled < longest) == (longest > 90)
    none = probability_of_none(residual, row, forces, table)
    assert none == pytest.approx(expected, rel=1e-9)


def test_a_glance_passes_what_the_longer_looks_pass(rng: np.random.Generator) -> None:
    """White noise, little and much of a colour, little and much damping, in turn."""
    rows = []
    for k in range(24):
        damping = {"viscous_damping.damping_ratio": 0.0008 * (k % 4)} if k % 2 else None
        signal = long_decay(noise_sd=0.0, seed=k, effects=damping).values
        noise = rng.standard_normal(signal.size + 1)
        # so little of it that even losses show, but not so little that slight damping is not white
        size = 5e-4 if damping else 2e-5
        rows.append(signal + size * (noise[1:] + 0.08 * (k % 3) * noise[:-1]))
    values = np.array(rows)
    located = locate_free_decays(values, 1.0 / RATE, SYSTEM.natural_frequency, 0)
    decays = FreeDecays(
        values=values,
        located=located,
        step=1.0 / RATE,
        system=SYSTEM,
        quantity=QUANTITIES["displacement"],
        unit="m",
    )
    waveform = estimator_named("waveform")
    fits = waveform.fit_many(decays, waveform.default_prior(decays), peaks="highest")
    assert fits.glance is not None
    assert fits.residual is not None
    white, straight = fits.glance()
    longer = np.array(
        [looks_white(fits.residual(k), fits.frequency[k] * decays.decay(k).time, 0, 5) for k in range(24)]
    )
    slower = np.array([uneven_loss(decays.decay(k)).probability < RATHER_EVEN for k in range(24)])
    assert not np.any(white & ~longer)
    assert not np.any(straight & ~slower)
    # of a glance that passed nothing all of this would be true
    assert white[::3].mean() > 0.7
    assert straight[::2].mean() > 0.9
    assert not longer.all()
    assert not slower.all()

"""The figures of the paper on any data: axes in, axes out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.core.errors import InputError
from friction_bayes.monitor.points import DetectionPoints
from friction_bayes.monitor.report import follow
from friction_bayes.plotting import paper

PRIOR = {"mu": 0.5, "lam": 0.05, "alpha": 1.0, "beta": 0.02}


@pytest.fixture(scope="module")
def found() -> fb.Estimate:
    return fb.estimate(short_decay(), SYSTEM, method="normal-gamma", prior=PRIOR)


RECORD = short_decay()
FORCE = 0.5 * np.sign(np.sin(10.0 * RECORD["time"].values))
DRAWN: dict[str, tuple[int, Callable[[fb.Estimate, Any], Any]]] = {
    "prior and posterior": (2, lambda e, axes: paper.prior_and_posterior(e, e, truth=0.5, axes=axes)),
    "samples used": (2, lambda e, axes: paper.samples_used(e, axes=axes)),
    "force": (1, lambda e, axes: paper.force(RECORD["time"], FORCE, 0.5, axes=axes)),
    "response": (2, lambda e, axes: paper.response(RECORD, RECORD, frequency=e.frequency, axes=axes)),
    "part": (2, lambda e, axes: paper.part(RECORD, RECORD[300:], axes=axes)),
    "rates": (3, lambda e, axes: paper.rates(RECORD, RECORD[::2], RECORD[::4], axes=axes)),
}


@pytest.mark.parametrize("name", DRAWN)
def test_axes_come_back(name: str, found: fb.Estimate) -> None:
    count, draw = DRAWN[name]
    given = Figure().subplots(count, 1, squeeze=False)
    drawn = draw(found, given)
    assert np.ravel(drawn).tolist() == given.ravel().tolist()
    assert all(axes.has_data() and axes.get_ylabel() for axes in given.ravel())
    assert np.ravel(draw(found, None))[0].figure is not given[0, 0].figure
    with pytest.raises(InputError, match=f"axes: {count + 1} given; give {count}"):
        draw(found, Figure().subplots(count + 1, 1))


def test_the_end_of_the_samples_is_the_estimate(found: fb.Estimate) -> None:
    friction, precision = paper.samples_used(found)
    assert friction.lines[0].get_ydata()[-1] == pytest.approx(float(found.friction.mean()))
    assert precision.lines[0].get_ydata()[-1] == pytest.approx(float(found.precision.mean()))


def test_detection_points_on_given_axes() -> None:
    times, friction = np.array([0.0, 1.0, 3.0]), np.array([0.30, 0.34, 0.43])
    points = DetectionPoints(
        times=times, time_unit="h", friction=friction, sd=np.full(3, 0.01), unit="N", relative_sd=0.0
    )
    axes = Figure().add_subplot()
    assert paper.detection_points(follow(points, 0.8), axes=axes) is axes
    assert axes.get_ylabel() == "friction [N]"
    assert "threshold" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_pairs_are_not_mixed(found: fb.Estimate) -> None:
    rate = fb.estimate(short_decay(), SYSTEM, method="gamma-exponential", prior={"alpha": 1.0, "kappa": 0.2})
    _, posterior = paper.prior_and_posterior(rate)
    assert "a rate [1/N]" in posterior.get_xlabel()
    with pytest.raises(InputError, match="by normal-gamma, gamma-exponential; give all by"):
        paper.prior_and_posterior(found, rate)
    with pytest.raises(InputError, match="by none"):
        paper.prior_and_posterior()
    with pytest.raises(InputError, match="gamma-exponential takes no friction samples one by one"):
        paper.samples_used(rate)

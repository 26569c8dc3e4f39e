"""The settings that are chosen without a set-up, and what they score on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
import xarray as xr

from experiments.loop_left_out import (
    EXPERIMENT,
    NUMBERS,
    TEXTS,
    Config,
    assemble,
    cells,
    chosen,
    details,
    log_ratios,
    rows,
)
from experiments.runner import Cell
from friction_bayes.loop import settings

VARIANTS = (("", 1.0, 0), ("force_share", 0.5, 0), ("force_share", 2.0, 0), ("", 1.0, 1))
NAMES = ("as they are", "force_share halved", "force_share doubled", "as they are, another seed (1)")


def made_up(ratios: Mapping[str, Sequence[float | None]], **texts: str) -> xr.Dataset:
    """Results with these ratios by record, in the order of the variants."""
    every: list[Cell] = [
        {"record": record, "setting": setting, "factor": factor, "again": again}
        for record in ratios
        for setting, factor, again in VARIANTS
    ]
    reported = dict.fromkeys(NUMBERS, 1.0) | dict.fromkeys(TEXTS, "explained") | texts
    return assemble(every, [reported | {"held_out_after": each} for row in ratios.values() for each in row])


@pytest.fixture
def three() -> xr.Dataset:
    """Halving helps the first set-up a lot and harms the others; doubling helps the third a little."""
    return made_up(
        {
            "first/1": [0.4, 0.02, 0.4, 0.01],
            "first/2": [0.1, 0.005, 0.1, 0.01],
            "second/1": [0.5, 0.6, 0.5, 0.01],
            "third/1": [0.3, 0.4, 0.2, 0.01],
        }
    )


def test_records_of_a_set_up_count_as_one(three: xr.Dataset) -> None:
    scores = log_ratios(three)
    assert scores["set_up"].values.tolist() == ["first", "second", "third"]
    # the geometric mean of 0.4 and 0.1
    assert np.exp(scores.sel(set_up="first", variant="as they are").item()) == pytest.approx(0.2)


def test_the_set_up_that_is_scored_has_no_say(three: xr.Dataset) -> None:
    candidates = log_ratios(three.isel(variant=[0, 1, 2]))
    assert candidates.mean("set_up").idxmin("variant").item() == "force_share halved"
    assert chosen(candidates) == {
        "first": "force_share doubled",
        "second": "force_share halved",
        "third": "force_share halved",
    }


def test_nothing_is_varied_where_nothing_is_gained() -> None:
    alike = made_up({f"{name}/1": [0.3, 0.3, 0.3, 0.3] for name in ("first", "second")})
    assert set(chosen(log_ratios(alike)).values()) == {"as they are"}


def test_what_is_chosen_stands_beside_the_settings_as_they_are(three: xr.Dataset) -> None:
    first, second, third, together, chance = rows(three)
    assert first.what == "first, 2 records"
    assert first.ours == first.paper == "0.2; 0 of 2 unexplained; > 99.9 % in the band"
    assert first.remark == "the others choose: force_share doubled"
    assert (second.ours.split(";")[0], second.paper.split(";")[0]) == ("0.6", "0.5")
    assert (third.ours.split(";")[0], third.paper.split(";")[0]) == ("0.4", "0.3")
    # geometric means of 0.2, 0.6 and 0.4, and of 0.2, 0.5 and 0.3
    assert (together.ours.split(";")[0], together.paper.split(";")[0]) == ("0.363", "0.311")
    assert together.remark == "settings as they are chosen for 0 of 3; 0 records without a forecast"
    # another seed is no setting to choose, however well it scores
    assert chance.ours.startswith("0.01;")


def test_every_variant_is_scored_on_the_same_records() -> None:
    ratios = {
        "first/1": [0.4, None, 0.4, 0.4],
        "first/2": [0.1, 0.2, 0.1, 0.1],
        "second/1": [0.5, None, 0.5, 0.5],
    }
    dataset = made_up(ratios, verdict="unexplained")
    scores = np.exp(log_ratios(dataset))
    np.testing.assert_allclose(scores.sel(set_up="first"), [0.1, 0.2, 0.1, 0.1])
    assert np.isnan(scores.sel(set_up="second")).all()
    _, second, together, _ = rows(dataset)
    assert second.ours == "no forecast; 1 of 1 unexplained; > 99.9 % in the band"
    assert together.ours == "0.1; 3 of 3 unexplained; > 99.9 % in the band"
    assert together.remark.endswith("; 2 records without a forecast")
    assert [line["without a forecast"] for line in details(dataset)] == ["0", "2", "0", "0"]


def test_every_variant_is_reported(three: xr.Dataset) -> None:
    lines = details(three)
    assert [line["variant"] for line in lines] == list(NAMES)
    varied = [settings.SETTINGS.force_share * factor for factor in (0.5, 2.0)]
    assert [line["value"] for line in lines] == ["", *(f"{value:.3g}" for value in varied), ""]
    assert lines[0]["over that as they are"] == ""
    assert lines[2]["over that as they are"].endswith("smaller in 1, larger in 0")


def test_four_records_of_a_set_up_of_both_kinds() -> None:
    every = cells(Config(), full=False)
    records = list(dict.fromkeys(cell["record"] for cell in every))
    assert len(every) == len(records) * (1 + 2 * len(Config().settings) + Config().other_seeds)
    pasco = [record for record in records if record.startswith("pasco-oscillator/")]
    assert len(pasco) == 4
    assert sum("no-magnet" in record for record in pasco) == 2


def test_the_same_noise_for_every_variant_but_another_seed() -> None:
    assert {*EXPERIMENT.paired, "record", "again"} == set(cells(Config(), full=False)[0])

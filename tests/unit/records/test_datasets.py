"""The registry of measured sets: provenance, digests, failure messages, and every set on this machine."""

from __future__ import annotations

import hashlib
import math
import os
from pathlib import Path

import numpy as np
import pytest

from data_sets import PAGE, page
from friction_bayes.core.errors import InputError
from friction_bayes.records import datasets
from friction_bayes.records.clipping import clipped_fraction
from friction_bayes.records.clock import sampling_interval
from friction_bayes.records.datasets import (
    DATASETS,
    LOCAL_FOLDER,
    dataset_record,
    fetch_dataset,
    list_datasets,
)
from friction_bayes.records.record import validate_record

PARTS = [f"{entry.name}/{part}" for entry in list_datasets() for part in entry.parts]

# samples, samples per second, and the period seen in the record [s]
EXPECTED = {
    "map-single-pendulum/identification-1": (9167, 1000.0, 0.88),
    "map-single-pendulum/identification-2": (9167, 1000.0, 0.83),
    "map-single-pendulum/identification-3": (9167, 1000.0, 0.81),
    "map-single-pendulum/identification-4": (9167, 1000.0, 0.80),
    "map-single-pendulum/validation-1": (9167, 1000.0, 0.79),
    "map-single-pendulum/validation-2": (9166, 1000.0, 0.79),
    "map-single-pendulum/small-swing": (231757, 10000.0, 0.785),
    "rotary-pendulum/1": (4280, 1000.0, 0.63),
    "rotary-pendulum/2": (4866, 1000.0, 0.66),
    "string-pendulum/1": (2330, 20.007, 1.65),
    "bicycle-fork/1": (30000, 1000.0, 1.59),
    "bicycle-wheel/1": (1001, 500.0, 0.421),
    **{
        f"pasco-oscillator/{kind}-{run}": (samples, 20.0, 1.40)
        for kind, sizes in {
            "no-magnet": (213, 192, 211, 176, 171, 173, 240, 262, 277, 262),
            "magnet": (273, 295, 294, 295, 305, 307, 293, 260, 286, 297),
        }.items()
        for run, samples in enumerate(sizes, start=1)
    },
    "spring-with-dampers/free": (3806, 100.0, 0.654),
    "spring-with-dampers/cardboard": (3616, 100.0, 0.699),
    "spring-with-dampers/rubbing": (13700, 1000.0, 0.677),
    "video-pendulum/1": (4502, 11.9961, 2.11),
}

REGISTRY = """
[swing]
title = "A made-up swing"
citation = "nobody"
licence = "none"
repository = "someone/something"
commit = "abc"
quantity = "angle"
default = "late"
authors_assume = "nothing"
note = "Made up."

[swing.system]
pendulum = true
inertia = 2.0
stiffness = 8.0
stiffness_sd = 0.5
assumed = true
source = "we say so"

[swing.files."swing.txt"]
path = "data/swing.txt"
sha256 = "{digest}"

[swing.parts.all]
file = "swing.txt"
signal_column = "0"
sampling_rate = 50.0
unit = "deg"
skip_rows = 2

[swing.parts.late]
file = "swing.txt"
signal_column = "0"
sampling_rate = 50.0
unit = "deg"
skip_rows = 2
zero = 0.25
start = 1.0
note = "Held before."
"""

RUNS = """
[runs]
title = "Made-up runs side by side"
citation = "nobody"
licence = "none"
repository = "someone/something"
commit = "abc"
quantity = "displacement"
default = "heavy"
authors_assume = "nothing"
note = "Made up."

[runs.system]
pendulum = false
mass = 1.0
stiffness = 8.0
assumed = true
source = "we say so"

[runs.files."runs.csv"]
path = "runs.csv"
sha256 = "{digest}"

[runs.parts.heavy]
file = "runs.csv"
run = 2
time_column = "Time (s)"
signal_column = "Position (x)"
unit = "a.u."
mass = 3.0
"""


@pytest.fixture
def swing(tmp_path, monkeypatch) -> Path:
    """A made-up data set in a local folder; returns its file."""
    angle = 20.0 * np.cos(2.0 * np.arange(500) / 50.0) + 14.0
    file = tmp_path / "data" / "swing" / "swing.txt"
    file.parent.mkdir(parents=True)
    file.write_text("trigger, rate\n90, 50\n" + "\n".join(map(repr, angle.tolist())))
    registry = tmp_path / "registry.toml"
    registry.write_text(REGISTRY.format(digest=hashlib.sha256(file.read_bytes()).hexdigest()))
    monkeypatch.setattr(datasets, "DATASETS", datasets.load_registry(registry))
    monkeypatch.setenv(LOCAL_FOLDER, str(tmp_path / "data"))
    return file


def test_a_local_file_is_read_as_registered(swing) -> None:
    record, system = dataset_record("swing/all")
    angle = np.radians(20.0 * np.cos(2.0 * np.arange(500) / 50.0) + 14.0)
    np.testing.assert_allclose(record.values, angle, rtol=1e-14)
    assert record.attrs["name"] == "swing/all"
    assert record.attrs["units"] == "rad"
    assert system.pendulum
    assert (system.inertia, system.stiffness, system.stiffness_sd) == (2.0, 8.0, 0.5)
    assert fetch_dataset("swing") == (swing,)


def test_the_default_part_is_cut_shifted_and_annotated(swing) -> None:
    whole, _ = dataset_record("swing/all")
    late, _ = dataset_record("swing")
    np.testing.assert_allclose(late.values, whole.values[50:] - 0.25, rtol=1e-14)
    assert float(late["time"][0]) == pytest.approx(1.0)
    assert late.attrs["note"] == "Made up. Held before."
    assert late.attrs["system_source"] == "assumed: we say so"


def test_a_part_may_be_a_run_of_another_mass_that_lost_a_frame(tmp_path, monkeypatch) -> None:
    rows = [f"{k / 50};{k % 7};{k / 50};{k % 5}" for k in range(100) if k != 40]
    file = tmp_path / "runs" / "runs.csv"
    file.parent.mkdir()
    names = [f'"{name} Run #{run}"' for run in (1, 2) for name in ("Time (s)", "Position (x)")]
    file.write_text("\n".join([";".join(names), *rows]))
    registry = tmp_path / "registry.toml"
    registry.write_text(RUNS.format(digest=hashlib.sha256(file.read_bytes()).hexdigest()))
    monkeypatch.setattr(datasets, "DATASETS", datasets.load_registry(registry))
    monkeypatch.setenv(LOCAL_FOLDER, str(tmp_path))
    record, system = dataset_record("runs")
    assert record.size == 99
    assert record.attrs["units"] == "a.u."
    assert record.values[7] == pytest.approx(2.0)
    assert (system.mass, system.stiffness) == (3.0, 8.0)


def test_a_wrong_digest_is_refused(swing) -> None:
    swing.write_text(swing.read_text() + "\n")
    with pytest.raises(InputError, match=r"swing.txt: sha256 is \w{64}, not \w{64}; replace it"):
        dataset_record("swing")


def test_unknown_names_list_the_known(swing) -> None:
    with pytest.raises(InputError, match="dataset:sway: unknown data set 'sway'; give swing"):
        dataset_record("sway")
    with pytest.raises(InputError, match="unknown part 'early'; give one of all, late"):
        dataset_record("swing/early")


def test_a_local_folder_that_is_none_is_refused(swing, monkeypatch) -> None:
    monkeypatch.setenv(LOCAL_FOLDER, str(swing))
    with pytest.raises(InputError, match=f"{LOCAL_FOLDER}: .* is not a folder"):
        dataset_record("swing")


@pytest.mark.parametrize("local", [True, False])
def test_what_is_not_local_is_downloaded_and_pinned(swing, monkeypatch, tmp_path, local) -> None:
    asked = []

    def retrieve(url, known_hash, path, fname):
        asked.append((url, known_hash, path.name, fname))
        return str(elsewhere)

    elsewhere = tmp_path / "cached.txt"
    swing.rename(elsewhere)
    if not local:
        monkeypatch.delenv(LOCAL_FOLDER)
    monkeypatch.setattr("pooch.retrieve", retrieve)
    record, _ = dataset_record("swing/all")
    assert record.size == 500
    url = "https://raw.githubusercontent.com/someone/something/abc/data/swing.txt"
    assert asked == [
        (url, f"sha256:{datasets.DATASETS['swing'].files['swing.txt'].sha256}", "swing", "swing.txt")
    ]


@pytest.mark.parametrize(
    ("failure", "message"),
    [
        (ConnectionError("no route"), rf"dataset:swing: cannot download .*; name by {LOCAL_FOLDER} a folder"),
        (ValueError("SHA256 hash ... does not match"), "the download is not the pinned file"),
    ],
)
def test_a_failed_download_is_one_clear_error(swing, monkeypatch, failure, message) -> None:
    def retrieve(*_args, **_options):
        raise failure

    swing.unlink()
    monkeypatch.setattr("pooch.retrieve", retrieve)
    with pytest.raises(InputError, match=message):
        dataset_record("swing")


@pytest.mark.parametrize("entry", list_datasets(), ids=lambda entry: entry.name)
def test_every_entry_is_pinned_and_complete(entry) -> None:
    assert entry.default in entry.parts
    assert len(entry.commit) == 40
    for file in entry.files.values():
        assert len(file.sha256) == 64
        assert Path(file.path).name == file.name
        assert file.url == f"https://raw.githubusercontent.com/{entry.repository}/{entry.commit}/{file.path}"
    for part in entry.parts.values():
        assert part.file in entry.files
        assert (part.time_column is None) != (part.sampling_rate is None)
    assert all((entry.citation, entry.licence, entry.system_source, entry.authors_assume))


def test_the_page_of_the_data_sets_is_that_of_the_registry() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "write it by python tests/data_sets.py"


def test_declared_systems_follow_from_the_published_numbers() -> None:
    arm, mass, inertia, gravity = 0.147754901, 0.147584572, 1.09118505e-4, 9.81001310
    swing = DATASETS["map-single-pendulum"].system
    assert swing.inertia == pytest.approx(inertia + mass * arm**2, rel=1e-12)
    assert swing.stiffness == pytest.approx(mass * gravity * arm, rel=1e-12)
    rod = DATASETS["rotary-pendulum"].system
    assert rod.inertia == pytest.approx(0.01225 * 0.124**2 / 3.0, rel=1e-9)
    assert rod.stiffness == pytest.approx(0.01225 * 9.80665 * 0.062, rel=1e-9)
    bob = DATASETS["string-pendulum"].system
    assert bob.stiffness == pytest.approx(0.04152 * 9.80665 * 0.65, rel=1e-9)
    assert bob.stiffness_sd / bob.stiffness == pytest.approx(0.01 / 0.65, rel=1e-6)
    assert bob.inertia_sd / bob.inertia == pytest.approx(0.02 / 0.65, rel=1e-4)
    wheel = DATASETS["bicycle-wheel"].system
    assert wheel.stiffness == pytest.approx(77e9 * math.pi * 0.00635**4 / 32.0 / 1.05, rel=1e-4)
    for name, period in (
        ("pasco-oscillator", 1.40),
        ("spring-with-dampers", 0.6544),
        ("video-pendulum", 2.0665),
    ):
        assert DATASETS[name].system.natural_frequency == pytest.approx(2.0 * math.pi / period, rel=1e-6)
    springs = DATASETS["spring-with-dampers"].parts
    assert springs["cardboard"].mass == pytest.approx((0.6997 / 0.6544) ** 2, rel=1e-5)
    assert springs["rubbing"].mass == pytest.approx((0.6760 / 0.6544) ** 2, rel=1e-5)


def test_the_fork_hangs_where_its_plumb_lines_cross() -> None:
    """Least squares through the three plumb lines of the source; its period gives the inertia."""
    angles, distances = np.radians([346.7, 28.1, 287.0]), np.array([0.474, 0.383, 0.215])
    design = np.column_stack([np.cos(angles), np.sin(angles)])
    centre = np.linalg.lstsq(design, distances, rcond=None)[0]
    fork = DATASETS["bicycle-fork"].system
    assert fork.stiffness == pytest.approx(3.22 * 9.81 * np.hypot(*centre), rel=1e-3)
    assert 2.0 * math.pi / fork.natural_frequency == pytest.approx(1.60185, rel=1e-4)


@pytest.mark.skipif(LOCAL_FOLDER not in os.environ, reason=f"{LOCAL_FOLDER} names no folder of measured sets")
@pytest.mark.parametrize("name", PARTS)
def test_every_measured_set_loads(name) -> None:
    record, system = dataset_record(name)
    validate_record(record)
    samples, rate, period = EXPECTED[name]
    assert record.size == samples
    assert 1.0 / sampling_interval(record) == pytest.approx(rate, rel=1e-4)
    assert clipped_fraction(record.values) == (0.0, None)
    values = record.values - np.median(record.values)
    spectrum = np.abs(np.fft.rfft(values * np.hanning(values.size), 1 << 20))
    frequency = np.argmax(spectrum) / (1 << 20) * rate
    assert 1.0 / frequency == pytest.approx(period, rel=0.02)
    # large swings are slower than the declared small ones, never much faster
    assert 0.75 < frequency * 2.0 * math.pi / system.natural_frequency < 1.05

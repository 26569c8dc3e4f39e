"""The archive of results: the pages are made of it again, word for word, and it has no measured record."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from experiments import __main__ as all_of_them
from experiments.archive import archived, keep
from experiments.sources import ARCHIVE, ROOT
from friction_bayes import InputError

MOST_BYTES = 20_000_000


def test_pages_are_made_of_the_archive_word_for_word(tmp_path: Path) -> None:
    names = archived(ARCHIVE)
    assert {"data_used", "reduced_data_set"} <= set(names)
    pages = {page.name: page.read_text(encoding="utf-8") for page in (ROOT / "docs").glob("*.md")}
    for name in names:
        assert any(f"<!-- results: {name} -->" in text for text in pages.values()), name
        record = json.loads((ARCHIVE / f"{name}.json").read_text(encoding="utf-8"))
        assert record["seed"] == 20210607
        assert {"numpy", "scipy", "emcee", "friction-bayes"} <= set(record["versions"])
        assert len(record["commit"].removesuffix("-dirty")) == 40
        assert len(record["sources"]) == 64
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("figures"))
    all_of_them.main(["--from-archive", "--docs", str(tmp_path / "docs")])
    again = {page.name: page.read_text(encoding="utf-8") for page in (tmp_path / "docs").glob("*.md")}
    assert again == pages
    assert sum(path.stat().st_size for path in ARCHIVE.iterdir()) < MOST_BYTES


@pytest.mark.parametrize("method", ["waveform", "envelope", "normal-gamma"])
def test_the_readme_says_what_the_archive_says(method: str) -> None:
    found = xr.load_dataset(ARCHIVE / "noise_sweep.nc", engine="h5netcdf").sel(snr_db=21.59)
    one = found.sel({"method": f"{method}, highest" if method == "normal-gamma" else method})
    (row,) = (
        line
        for line in (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
        if f"| `{method}`" in line
    )
    error = 100.0 * float(np.sqrt((one["error"] ** 2).mean()))
    width, covers = 100.0 * float(one["width"].median()), 100.0 * float(one["covers"].mean())
    assert f"| {error:.2g} % | {width:#.2g} % wide, covers {covers:.0f} %".replace(". %", " %") in row


def test_another_number_is_another_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for path in ARCHIVE.glob("data_used.*"):
        shutil.copy(path, tmp_path)
    stored = tmp_path / "data_used.nc"
    dataset = xr.load_dataset(stored, engine="h5netcdf")
    (dataset * 1.01).to_netcdf(stored, engine="h5netcdf")
    all_of_them.main(["--from-archive", str(tmp_path)])
    page = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")
    assert capsys.readouterr().out.removeprefix("## data_used\n").strip() not in page
    with pytest.raises(InputError, match="no result of noise_sweep; it has data_used"):
        all_of_them.main(["noise_sweep", "--from-archive", str(tmp_path)])


def test_samples_of_measured_records_stay_out(tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    dataset = xr.Dataset({"friction": ("case", [0.1]), "signal": (("case", "sample"), np.zeros((1, 5)))})
    dataset.to_netcdf(tmp_path / "results" / "measured_estimates.nc", engine="h5netcdf")
    (tmp_path / "results" / "measured_estimates.json").write_text("{}", encoding="utf-8")
    keep(all_of_them.all_experiments()["measured_estimates"], tmp_path / "results", tmp_path / "archive")
    kept = xr.load_dataset(tmp_path / "archive" / "measured_estimates.nc", engine="h5netcdf")
    assert list(kept) == ["friction"]

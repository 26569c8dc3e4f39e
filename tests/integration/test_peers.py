"""Comparisons with other packages: what needs none of them everywhere, the rest where one is installed."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.peers import (
    conjugate_updates,
    linear_filter,
    missing_term,
    plain_decay,
    samplers,
    whole_signal,
)
from benchmarks.peers.__main__ import SECTIONS, main
from benchmarks.peers.errors import ERRORS, TIMES, errors_and_times
from benchmarks.peers.measuring import first_run, table
from benchmarks.peers.weak_form import LAW, WeakForm, weak_form
from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import find_free_decay

PAGE = Path(__file__).parents[2] / "docs" / "peers.md"
PEERS = pytest.mark.filterwarnings("ignore")
"""What other packages warn of is theirs."""


def cells(lines: Sequence[str]) -> list[list[str]]:
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize("name", SECTIONS)
def test_what_is_missing_is_named_and_nothing_is_measured(name, monkeypatch) -> None:
    module = import_module(f"benchmarks.peers.{name}")
    monkeypatch.setattr(module, "PACKAGES", ("numpy", "no-such-package"))
    monkeypatch.setattr(module, "compare", lambda: pytest.fail("measured"))
    with pytest.raises(SystemExit, match=f"{name}: no-such-package not installed"):
        main([name])


def test_a_section_is_written_into_its_place_of_the_page(monkeypatch, tmp_path, capsys) -> None:
    page = tmp_path / "peers.md"
    page.write_text(PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    for name in SECTIONS:
        module = import_module(f"benchmarks.peers.{name}")
        monkeypatch.setattr(module, "PACKAGES", ("numpy",))
        monkeypatch.setattr(module, "compare", lambda name=name: table(("what",), [(f"row of {name}",)]))
    main(["--page", str(page)])
    text = page.read_text(encoding="utf-8")
    for name in SECTIONS:
        _, _, rest = text.partition(f"<!-- results: peers {name} -->")
        body, _, _ = rest.partition("<!-- end -->")
        assert f"| row of {name} |" in body
        assert f"numpy {np.__version__}" in body
    printed = capsys.readouterr().out
    assert all(f"| row of {name} |" in printed for name in SECTIONS)


def test_an_unknown_section_is_refused(capsys) -> None:
    with pytest.raises(SystemExit):
        main(["whole_signals"])
    assert "no section whole_signals; there are friction_samples" in capsys.readouterr().err


def test_bold_is_what_does_better_and_a_refusal_is_an_infinite_error() -> None:
    errors = {
        "ours": [0.01, -0.02, 0.2],
        "quick": [0.5, -0.5, np.inf],
        "good": [0.001, 0.001, 0.05],
        "own": [0.0] * 3,
    }
    times = {"ours": [1.0, 1.0, 3.0], "quick": [0.1, 0.2, 0.3], "good": [2.0, 2.0, 6.0], "own": [0.5] * 3}
    texts = errors_and_times(errors, times, ["ours", "own"])
    assert texts["ours"] == ["2 %", "20 %", "67 %", "1000", "1"]
    assert texts["quick"] == ["50 %", "inf %", "0 %", "**200**", "**0.1**"]
    assert texts["good"] == ["**0.1 %**", "**5 %**", "**100 %**", "2000", "2"]
    assert texts["own"] == ["0 %", "0 %", "100 %", "500", "0.5"]
    head, rule, *rows = cells(table(("method", *ERRORS, *TIMES), [[k, *v] for k, v in texts.items()]))
    assert {len(head), *map(len, rows)} == {6}
    assert set(rule) == {"---"}


def standardised_points() -> Array:
    """Where densities are compared: about the closed form's sd away, and several."""
    return np.random.default_rng(4).standard_normal((5, whole_signal.density().target.centre.size))


def reference_density(z: Array) -> Array:
    density = whole_signal.density()
    return density.target.log_prob(np.array([density.coordinates(each, np) for each in z]))


def same_but_for_a_constant(found: Sequence[float], expected: Array) -> bool:
    # the reference expands the misfit about its optimum
    return bool(np.ptp(np.asarray(found) - expected) < 1e-3 < 1.0 < np.ptp(expected))


def test_the_density_of_the_whole_signal_is_that_of_the_reference() -> None:
    density, z = whole_signal.density(), standardised_points()
    found = [density.log_density(density.coordinates(each, np), np) for each in z]
    assert same_but_for_a_constant(found, reference_density(z))


@PEERS
def test_pymc_is_given_the_same_density() -> None:
    pytest.importorskip("pymc")
    z = standardised_points()
    log_density = whole_signal.posterior().pymc_model().compile_logp()
    assert same_but_for_a_constant([float(log_density({"z": each})) for each in z], reference_density(z))


@PEERS
def test_numpyro_is_given_the_same_density() -> None:
    numpyro = pytest.importorskip("numpyro")
    numpyro.enable_x64()
    z = standardised_points()
    model = whole_signal.posterior().numpyro_model
    found = [float(numpyro.infer.util.log_density(model, (), {}, {"z": each})[0]) for each in z]
    assert same_but_for_a_constant(found, reference_density(z))


def test_effective_draws_are_those_of_the_worst_parameter() -> None:
    rng = np.random.default_rng(3)
    slow = np.repeat(rng.standard_normal((4, 100)), 10, axis=1)
    both = {"friction": rng.standard_normal((4, 1000)), "noise": slow}
    assert samplers.effective(both) == samplers.effective({"noise": slow}) < 1000.0


@pytest.mark.parametrize("load", conjugate_updates.LOADS)
@pytest.mark.parametrize("pair", list(conjugate_updates.PAIRS))
def test_our_update_keeps_its_digits_under_a_load(pair, load) -> None:
    samples = conjugate_updates.SAMPLES + load
    assert conjugate_updates.error(pair, conjugate_updates.OURS, samples) < 1e-14


@PEERS
def test_conjugate_models_are_given_the_same_prior_and_samples() -> None:
    pytest.importorskip("conjugate")
    ours, peer = conjugate_updates.PAIRS[conjugate_updates.NORMAL].values()
    found, expected = (each.interval(each.update(conjugate_updates.SAMPLES)) for each in (peer, ours))
    assert found == pytest.approx(expected, rel=1e-9)


@PEERS
@pytest.mark.parametrize(("name", "package"), [("statsmodels", "statsmodels"), ("dynamax", "dynamax")])
def test_filters_give_one_likelihood(name, package) -> None:
    pytest.importorskip(package)
    assert linear_filter.FILTERS[name]() == pytest.approx(linear_filter.ours(), rel=1e-9)


def test_a_first_run_of_a_peer_is_timed_from_its_data_on_and_ours_from_the_start() -> None:
    ours, found = first_run(linear_filter, linear_filter.OURS)
    assert found == linear_filter.ours()
    peer = SimpleNamespace(OURS="ours", summary=float, prepared=lambda name: lambda: 3.0)
    spent, found = first_run(peer, "peer")
    assert found == 3.0
    assert 0.0 <= spent < ours


def test_our_filter_is_given_the_model_of_the_others() -> None:
    transition, added, start = linear_filter._matrices()
    n = 40
    state = np.zeros((n, 3, 3))
    state[0] = start
    for i in range(1, n):
        state[i] = transition @ state[i - 1] @ transition.T + added
    covariance = np.empty((n, n))
    for i in range(n):
        ahead = state[i]
        for j in range(i, n):
            covariance[i, j] = covariance[j, i] = ahead[0, 0]
            ahead = transition @ ahead
    covariance += linear_filter.NOISE**2 * np.eye(n)
    y = linear_filter.data()[:n]
    dense = np.linalg.slogdet(2.0 * np.pi * covariance)[1] + y @ np.linalg.solve(covariance, y)
    assert linear_filter.ours(n) == pytest.approx(-0.5 * dense, rel=1e-9)


def form_of(columns: dict[str, Array], acceleration: Array) -> WeakForm:
    return WeakForm(tuple(columns), np.column_stack(list(columns.values())), acceleration, 2.0, 50.0)


def some_form() -> WeakForm:
    rng = np.random.default_rng(5)
    columns = {name: rng.standard_normal(300) for name in missing_term.LIBRARY}
    noise = 1e-3 * rng.standard_normal(300)
    return form_of(columns, -columns["x"] - 0.02 * columns[LAW[1]] - 0.03 * columns["v|v|"] + noise)


def test_the_best_subset_is_the_law_that_made_the_data() -> None:
    form = some_form()
    found = form.best_subset()
    assert set(found) == {*LAW, "v|v|"}
    assert missing_term.effects_of(found) == "quadratic_drag"
    assert form.friction(found) == pytest.approx(0.04, rel=0.02)


@PEERS
def test_the_threshold_is_the_one_of_the_best_criterion() -> None:
    pytest.importorskip("pysindy")
    assert set(some_form().thresholded()) == {*LAW, "v|v|"}


@PEERS
def test_the_weak_form_finds_friction_without_noise() -> None:
    pytest.importorskip("pysindy")
    data, friction = plain_decay.record(1, 1e-7)
    form = weak_form(find_free_decay(data, plain_decay.PAPER_SYSTEM), plain_decay.TERMS)
    for pick in plain_decay.PICKS.values():
        assert form.friction(pick(form)) == pytest.approx(friction, rel=0.02)


def test_sealed_records_are_displacements_under_effects_of_the_library(monkeypatch) -> None:
    monkeypatch.setattr(missing_term, "EACH", 1)
    known = {*missing_term.EFFECTS.values()}
    kinds = []
    for sealed in missing_term.records():
        assert sealed.truth.quantity in ("displacement", "angle")
        assert set(sealed.truth.effects) <= known
        kinds.append(sealed.truth.kind)
    assert kinds == list(missing_term.KINDS)

"""Own coefficients of several records are integrated out as dense Gaussian algebra has it."""

import numpy as np
import pytest

from friction_bayes.statespace.own_columns import OwnColumns, eliminate

RECORDS, SAMPLES, OWN, SHARED = 3, 30, 2, 3
SCALE = np.array([1.0, 0.3, 1.0, 1.0, 1.0])
"""The second own column is a deviation of the last shared one."""
COLUMNS = np.array([0, 3, 1, 2, 3])


def records(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns and records, and what goes back into each of a column that is neither own nor shared."""
    columns = rng.standard_normal((RECORDS, SAMPLES, 5))
    back = np.zeros((RECORDS, 5))
    back[:, 4] = rng.standard_normal(RECORDS)
    return columns, rng.standard_normal((RECORDS, SAMPLES)), back


def sums(columns: np.ndarray, record: np.ndarray) -> np.ndarray:
    every = np.concatenate([columns, record[:, :, None]], axis=2)
    return every.transpose(0, 2, 1) @ every


@pytest.mark.parametrize("lam", [0.0, 0.7])
def test_shared_sums_and_own_coefficients(lam: float, rng: np.random.Generator) -> None:
    columns, record, back = records(rng)
    centre = rng.standard_normal((RECORDS, OWN)) if lam > 0.0 else np.zeros((RECORDS, OWN))
    found = eliminate(sums(columns, record), OwnColumns(COLUMNS, SCALE, centre, back), lam)
    y = record + np.einsum("rnp,rp->rn", columns, back)
    taken = columns[:, :, COLUMNS] * SCALE
    own, shared = taken[:, :, :OWN], taken[:, :, OWN:]
    law = rng.standard_normal(SHARED)
    square, log_determinant, coefficients = 0.0, 0.0, []
    for o, s, each, middle in zip(own, shared, y, centre, strict=True):
        precision = o.T @ o + lam * np.eye(OWN)
        left = each - s @ law
        away = np.linalg.solve(precision, o.T @ left - lam * middle)
        coefficients.append(away)
        square += float(np.sum((left - o @ away) ** 2) + lam * np.sum((away + middle) ** 2))
        log_determinant += np.linalg.slogdet(precision)[1] - (OWN * np.log(lam) if lam > 0.0 else 0.0)
    last = np.append(-law, 1.0)
    np.testing.assert_allclose(last @ found.gram @ last, square, rtol=1e-8)
    np.testing.assert_allclose(found.log_determinant, log_determinant, rtol=1e-8)
    np.testing.assert_allclose(found.own(law[None])[:, 0], coefficients, rtol=1e-7)

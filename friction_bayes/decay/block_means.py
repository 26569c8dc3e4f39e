"""Means of blocks of samples, where a period holds far more samples than its shape has detail.

Two hundred values a period keep the amplitude to 4e-5 and all that white noise leaves to be known; the steps
of an encoder average out. What the average takes from the amplitude, those 4e-5, is known and given back.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.records.clock import LONGEST_BRIDGED_GAP

__all__ = [
    "about_mean",
    "amplitude_kept",
    "block_means",
    "fill_block_means",
    "less",
    "samples_in_block",
    "torn_blocks",
    "variance_by_share",
]

_KEPT_SAMPLES = 200.0
"""Least number of values a period that averaging leaves."""


@njit(**KERNEL)
def samples_in_block(samples_per_period: float) -> int:
    """How many samples may be averaged into one; 1 where they had better be kept as they are."""
    return max(int(samples_per_period / _KEPT_SAMPLES), 1)


def block_means(values: Array, block: int) -> Array:
    """Means of successive blocks, shape (n // block,), of ``values``, shape (n,); an odd end is left out."""
    n = values.size // block * block
    return np.asarray(values[:n].reshape(-1, block).mean(axis=1))


def variance_by_share(share: Array) -> Array:
    """Noise variance of means of a share of a block each, over that of a whole one; infinite of none."""
    return np.divide(1.0, share, out=np.full(share.size, np.inf), where=share > 0.0)


@njit(**INNER, fastmath={"reassoc"})
def fill_block_means(values: Array, block: int, offset: float, means: Array) -> None:
    """The same less ``offset`` in ``means``, shape (blocks,); several samples at a time, in any order.

    Four blocks go on side by side, as each is too short to keep a processor busy.
    """
    weight, whole = 1.0 / block, means.size // 4 * 4
    for k in range(0, whole, 4):
        part = values[k * block : (k + 4) * block]
        a, b, c, d = part[:block], part[block:], part[2 * block :], part[3 * block :]
        sum_a = sum_b = sum_c = sum_d = 0.0
        for i in range(a.size):
            sum_a, sum_b, sum_c, sum_d = sum_a + a[i], sum_b + b[i], sum_c + c[i], sum_d + d[i]
        means[k], means[k + 1] = sum_a * weight - offset, sum_b * weight - offset
        means[k + 2], means[k + 3] = sum_c * weight - offset, sum_d * weight - offset
    for k in range(whole, means.size):
        total = 0.0
        for i in range(k * block, (k + 1) * block):
            total += values[i]
        means[k] = total * weight - offset


@njit(**INNER)
def less(values: Array, constant: float) -> Array:
    """Values less a constant; numba takes four times as long to compile the expression."""
    rest = np.empty(values.size)
    for i in range(values.size):
        rest[i] = values[i] - constant
    return rest


@njit(**KERNEL, fastmath={"reassoc"})
def about_mean(values: Array) -> tuple[Array, float]:
    """Values, shape (n,), less their mean, and that."""
    total = 0.0
    for i in range(values.size):
        total += values[i]
    mean = total / max(values.size, 1)
    return less(values, mean), mean


def torn_blocks(time: Array, block: int) -> Mask:
    """Which blocks, shape (n // block,), have a gap of the times, shape (n,), inside: of no one time."""
    n = time.size // block * block
    if block == 1:
        return np.zeros(n, dtype=np.bool_)
    inside = np.diff(time[:n].reshape(-1, block), axis=1)
    return np.asarray(inside.max(axis=1) > LONGEST_BRIDGED_GAP * float(np.median(inside)))


@njit(**KERNEL)
def amplitude_kept(samples_per_period: float, block: int) -> float:
    """Amplitude of the block means of a sinusoid over its own."""
    half_step = math.pi / samples_per_period
    return math.sin(block * half_step) / (block * math.sin(half_step))

"""Independent emcee ensembles on one target, each with its own seeded state."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from typing import Any

import emcee
import numpy as np
from scipy.linalg import cholesky, solve_triangular

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError

__all__ = ["OVERDISPERSION", "Ensembles"]

Progress = Callable[[int, int], None]

OVERDISPERSION = 2.5
"""Ensembles start from a normal distribution this many times as wide as the closed form."""


_TAILS = 5.0
_WIDTH = 1.2
"""Degrees of freedom and scale of the Student t proposed from: wider than any posterior here."""


def _moves(centres: Array, roots: Array) -> list[tuple[emcee.moves.Move, float]]:
    """Moves about humps of equal weight, centres of shape (k, d) and lower roots of shape (k, d, d)."""
    count, size = centres.shape
    log_volumes = np.log(np.diagonal(roots, axis1=1, axis2=2)).sum(axis=1)

    def log_density(z: Array) -> Array:
        away = (z - centres[:, None, :]).mT
        distance2 = (np.linalg.solve(roots, away) ** 2).sum(axis=1)
        each = -0.5 * (_TAILS + size) * np.log1p(distance2 / (_TAILS * _WIDTH**2)) - log_volumes[:, None]
        # of few numbers: SciPy's spends a third of the sampler's time on its arguments
        return np.asarray(np.logaddexp.reduce(each, axis=0))

    def propose(z: Array, random: np.random.RandomState) -> tuple[Array, Array]:
        mixture = np.sqrt(random.chisquare(_TAILS, size=(len(z), 1)) / _TAILS)
        drawn = _WIDTH * random.standard_normal(z.shape) / mixture
        hump = random.randint(count, size=len(z)) if count > 1 else np.zeros(len(z), dtype=np.intp)
        new = centres[hump] + np.einsum("wij,wj->wi", roots[hump], drawn)
        return new, log_density(z) - log_density(new)

    return [
        (emcee.moves.MHMove(propose, ndim=size), 0.5),
        (emcee.moves.DEMove(), 0.45),
        # the full difference of two walkers leads from one mode to another
        (emcee.moves.DEMove(gamma0=1.0), 0.05),
    ]


class _Sampler(emcee.EnsembleSampler):
    """emcee without what takes a third of its steps: copies of its generator's state, values one by one."""

    @property
    def random_state(self) -> Any:
        """None: the generator goes on where it is."""
        return None

    @random_state.setter
    def random_state(self, state: Any) -> None:
        if state is not None:
            self._random.set_state(state)

    def compute_log_prob(self, coords: Array) -> tuple[Array, None]:
        """Log-probabilities of walkers, shape (walkers, d), and no blobs."""
        found = self.log_prob_fn(coords)
        if np.isnan(found).any():
            raise ValueError("the log-probability is nan")
        return found, None


class Ensembles:
    """Ensembles of walkers that are run on as needed.

    Parameters
    ----------
    target : Target
        What to sample.
    seed : int
        Ensembles get streams spawned from it and a digest of the data; one more is left in :attr:`rng`.
    ensembles, walkers : int
        How many, and how large; ``walkers`` None is 32 or four times the number of parameters.

    Raises
    ------
    InputError
        If there are fewer than 4 ensembles, too few walkers, or the log-probability is not finite at the
        centre.

    Notes
    -----
    Walkers move in coordinates in which the closed form has mean zero and unit covariance. Half of the
    moves are proposed from a wide Student t about the closed form (about its humps, if it has several), half
    by differential evolution, which knows only the walkers. A proposal decides how fast a posterior is found,
    not which: where the closed form is right the autocorrelation time is 3 to 4 steps (normal, 2 to 6
    parameters), against 8 to 20 by differential evolution alone and 35 to 70 by the stretch move; where it is
    wrong by a factor of two in width or an sd in place, it is that of differential evolution.
    """

    def __init__(self, target: Target, *, seed: int, ensembles: int, walkers: int | None) -> None:
        size = len(target.names)
        if ensembles < 4:
            raise InputError("ensembles", f"{ensembles} cannot show convergence", "give at least 4")
        self.walkers = max(32, 4 * size) if walkers is None else walkers
        if self.walkers < max(2 * size, 8) or self.walkers % 2:
            raise InputError(
                "walkers",
                f"{self.walkers} for {size} parameters",
                f"give an even number, at least {max(2 * size, 8)}",
            )
        if not np.isfinite(target.log_prob(target.centre[None, :])[0]):
            raise InputError(
                "target", f"log-probability is not finite at its centre {target.centre}", "start where it is"
            )
        self._target = target
        self._root = cholesky(target.covariance, lower=True)
        centres, roots = self._humps()
        # The coordinates are standardised: without the data in it one seed would make the same walk in every
        # posterior of one shape, and an unlucky one a false alarm on every record.
        data = zlib.crc32(np.ascontiguousarray(target.observed).tobytes())
        *streams, last = np.random.SeedSequence([seed, data]).spawn(ensembles + 1)
        self.rng = np.random.default_rng(last)
        self._states = [self._start(stream) for stream in streams]
        self._samplers = [
            _Sampler(
                self.walkers,
                size,
                lambda z: target.log_prob(self._natural_scale(z)),
                moves=_moves(centres, roots),
                vectorize=True,
            )
            for _ in streams
        ]

    @property
    def steps(self) -> int:
        """Steps made by each ensemble."""
        return int(self._samplers[0].iteration)

    @property
    def chains(self) -> int:
        """Walkers of all ensembles."""
        return self.walkers * len(self._samplers)

    @property
    def acceptance_fraction(self) -> float:
        """Mean share of accepted proposals."""
        return float(np.mean([sampler.acceptance_fraction for sampler in self._samplers]))

    def advance(self, steps: int, progress: Progress | None = None) -> None:
        """Run every ensemble on by ``steps``, calling ``progress`` with the walks done and due here."""
        for i, sampler in enumerate(self._samplers):
            # emcee has no seed argument: the state carries the generator's
            self._states[i] = sampler.run_mcmc(self._states[i], steps)
            if progress is not None:
                progress(i + 1, len(self._samplers))

    def coordinates(self, burn_in: int, thinning: int = 1) -> Array:
        """Draws after burn-in in the target's coordinates, shape (chains, draws, d)."""
        return self._natural_scale(self._stack("chain", burn_in, thinning))

    def scores(self, burn_in: int) -> Array:
        """Draws after burn-in in standardised coordinates, shape (d, ensembles, walkers, draws)."""
        chains = self._stack("chain", burn_in, 1)
        return np.moveaxis(chains.reshape(-1, self.walkers, *chains.shape[1:]), -1, 0)

    def log_prob(self, burn_in: int, thinning: int = 1) -> Array:
        """Log-probability of the draws, shape (chains, draws)."""
        return self._stack("log_prob", burn_in, thinning)

    def _stack(self, name: str, burn_in: int, thinning: int) -> Array:
        parts = [s.get_value(name, discard=burn_in, thin=thinning) for s in self._samplers]
        return np.concatenate([np.swapaxes(part, 0, 1) for part in parts])

    def _humps(self) -> tuple[Array, Array]:
        """Centres and lower roots of the humps, in standardised coordinates."""
        if not self._target.humps:
            size = len(self._root)
            return np.zeros((1, size)), np.eye(size)[None]
        centres, covariances = zip(*self._target.humps, strict=True)
        away = np.array(centres) - self._target.centre
        return solve_triangular(self._root, away.T, lower=True).T, np.array(
            [solve_triangular(self._root, cholesky(each, lower=True), lower=True) for each in covariances]
        )

    def _natural_scale(self, z: Array) -> Array:
        return np.asarray(self._target.centre + z @ self._root.T)

    def _start(self, stream: np.random.SeedSequence) -> emcee.State:
        """Place the walkers wide around the centre, pulling those of no probability towards it."""
        place, move = stream.spawn(2)
        z = OVERDISPERSION * np.random.default_rng(place).standard_normal((self.walkers, self._root.shape[0]))
        for _ in range(60):
            outside = ~np.isfinite(self._target.log_prob(self._natural_scale(z)))
            if not outside.any():
                generator = np.random.RandomState(np.random.MT19937(move))
                return emcee.State(z, random_state=generator.get_state())
            z[outside] *= 1.0 / math.sqrt(2.0)
        raise InputError(
            "target",
            f"log-probability is not finite around its centre {self._target.centre}",
            "start where it is",
        )

"""Moving-block bootstrap of quantities that follow from sums over the samples of a log."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

REPEATS = 1000
"""Bootstrap samples."""

BLOCKS = 10
"""Blocks of a log at least, where blocks of `SHORTEST_BLOCK` allow it."""

SHORTEST_BLOCK, LONGEST_BLOCK = 0.25, 2.0
"""Bounds of a block's length [s]."""

SEED = 0
"""Seed: the same log gives the same intervals."""


class BlockBootstrap:
    """Blocks of neighbouring samples, drawn with replacement; errors within one may correlate.

    Blocks wrap from the end of the log to its beginning, so that all samples count alike. As there
    are few blocks, an interval has the width that Student's t gives the bootstrap's standard
    deviation. Source: Politis and Romano, "A circular block-resampling procedure for stationary
    data", 1992.

    Args:
        time: Times of the N samples [s], shape (N,).
    """

    def __init__(self, time: Float[np.ndarray, " time"]) -> None:
        duration = float(time[-1] - time[0])
        block = min(max(duration / BLOCKS, SHORTEST_BLOCK), LONGEST_BLOCK)
        self.count = max(2, round(duration / block))
        self._length = max(1, len(time) // self.count)
        rng = np.random.default_rng(SEED)
        self._starts = rng.integers(len(time), size=(REPEATS, self.count))

    def sums(self, terms: Float[np.ndarray, "time terms"]) -> Float[np.ndarray, "repeats terms"]:
        """Return the sums of terms over each bootstrap sample."""
        wrapped = np.concatenate([terms, terms[: self._length]])
        total = np.concatenate([np.zeros((1, terms.shape[1])), wrapped.cumsum(axis=0)])
        drawn = total[self._starts + self._length] - total[self._starts]
        return np.asarray(drawn.sum(axis=1))

    def estimate(
        self,
        terms: Float[np.ndarray, "time terms"],
        function: Callable[[np.ndarray], np.ndarray],
    ) -> tuple[Float[np.ndarray, " values"], Float[np.ndarray, " values"]]:
        """Return values that follow from the sums of terms, and half their 95 % intervals.

        Args:
            terms: Terms of each sample.
            function: Returns the values, shape (..., V), of sums of shape (..., terms).
        """
        from scipy.special import stdtrit

        value = function(terms.sum(axis=0))
        spread = function(self.sums(terms)).std(axis=0, ddof=1)
        return value, float(stdtrit(self.count - 1, 0.975)) * spread

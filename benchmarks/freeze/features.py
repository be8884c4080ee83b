"""Features of a landscape, from its values on one sample of the unit cube.

[1] O. Mersmann et al., "Exploratory landscape analysis", GECCO 2011: distribution of values, fits of simple models.
[2] P. Kerschke et al., "Detecting funnel structures by means of exploratory landscape analysis", GECCO 2015: nearest
    better neighbours.
[3] M. Lunacek and D. Whitley, "The dispersion metric and the CMA evolution strategy", GECCO 2006.
[4] M. A. Muñoz, M. Kirley and S. K. Halgamuge, "Exploratory landscape analysis of continuous space optimization
    problems using information content", IEEE Transactions on Evolutionary Computation 19(1), 2015.

Values count from their least to their largest, so that features do not change where values are scaled or shifted.
Interactions and squares are fitted by one decomposition of the sample, which all functions of a dimension share.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations

import numpy as np
from scipy.spatial.distance import cdist
from scipy.stats import kurtosis, qmc, rankdata, skew

from tpbso_casadi.suite.kernels import FloatArray

POINTS = 50  # of the sample, for each variable
SEED = 1  # of the sample
MODELS = ("linear", "quadratic", "full quadratic")
BEST = (0.02, 0.1, 0.25)  # shares of the sample, of which the dispersion is told
SENSITIVITIES = np.concatenate([[0.0], np.logspace(-6.0, 4.0, 201)])  # epsilon of [4]
SETTLED = 0.05  # information content below which a sequence is nearly constant [4]
FEATURES = (
    *("skewness", "kurtosis"),
    *(f"R2 {model}{of}" for of in ("", ", ranks") for model in MODELS),
    *("better sd", "better mean", "better correlation", "better variation", "better in-degree"),
    *(f"dispersion {share:.0%}" for share in BEST),
    *("information content", "settling sensitivity", "partial information"),
)


@dataclass(frozen=True, eq=False)
class Sample:
    """Points of the unit cube, and what they have in common for all functions.

    Attributes:
        points: (n, d).
    """

    points: FloatArray

    @cached_property
    def distances(self) -> FloatArray:
        """Of any two points, (n, n); infinite from a point to itself."""
        found = cdist(self.points, self.points)
        np.fill_diagonal(found, np.inf)
        return found

    @cached_property
    def tour(self) -> tuple[FloatArray, FloatArray]:
        """From the first point always to the nearest that is left: indices (n,), and lengths of the steps (n - 1,)."""
        order, left = [0], np.ones(len(self.points), dtype=bool)
        left[0] = False
        for _ in range(len(self.points) - 1):
            order.append(int(np.where(left, self.distances[order[-1]], np.inf).argmin()))
            left[order[-1]] = False
        return np.array(order), self.distances[order[:-1], order[1:]]

    @cached_property
    def terms(self) -> FloatArray:
        """An orthonormal basis (n, p): of a constant, then variables, squares, products."""
        x = self.points
        products = [x[:, i] * x[:, j] for i, j in combinations(range(x.shape[1]), 2)]
        return np.linalg.qr(np.column_stack([np.ones(len(x)), x, x**2, *products])).Q


@lru_cache(maxsize=1)
def sample_of(dimension: int) -> Sample:
    """The sample of all functions of a dimension: a Latin hypercube of 50 points for each variable."""
    return Sample(qmc.LatinHypercube(dimension, rng=SEED).random(POINTS * dimension))


def features(sample: Sample, values: FloatArray) -> FloatArray:
    """The features, in the order of ``FEATURES``.

    Args:
        sample: of the unit cube, n points.
        values: at the points, (n,), finite.

    Raises:
        ValueError: all values are the same.
    """
    low, high = values.min(), values.max()
    if not low < high:
        raise ValueError("all values are the same: a landscape without features")
    scaled = (values - low) / (high - low)
    found = [
        *_distribution(scaled),
        *_fits(sample, scaled),
        *_fits(sample, rankdata(scaled)),
        *_nearest_better(sample, scaled),
        *_dispersions(sample, scaled),
        *_information(sample, scaled),
    ]
    return np.array(found)


def _distribution(values: FloatArray) -> Iterator[float]:
    """Skewness and kurtosis [1]; as logarithms beyond about 1, as penalties make them as large as one likes."""
    yield from np.arcsinh([skew(values), kurtosis(values)]).tolist()


def _fits(sample: Sample, values: FloatArray) -> Iterator[float]:
    """Adjusted R2 of the models [1]: what a model explains is the squared components along its terms."""
    (n, d), explained = sample.points.shape, np.cumsum((values @ sample.terms)[1:] ** 2)
    total = ((values - values.mean()) ** 2).sum()
    for p in (d, 2 * d, explained.size):
        yield float(1.0 - (1.0 - explained[p - 1] / total) * (n - 1) / (n - p - 1))


def _nearest_better(sample: Sample, values: FloatArray) -> Iterator[float]:
    """Distances to the nearest point against those to the nearest better one, and how often a point is that [2]."""
    apart = np.where(values[None, :] < values[:, None], sample.distances, np.inf)
    better, to_any = apart.min(axis=1), sample.distances.min(axis=1)
    has_better = np.isfinite(better)
    to_better = np.where(has_better, better, to_any)
    degrees = np.bincount(apart.argmin(axis=1)[has_better], minlength=values.size)
    ratio = to_any / to_better
    yield float(to_any.std(ddof=1) / to_better.std(ddof=1))
    yield float(to_any.mean() / to_better.mean())
    yield float(np.corrcoef(to_any, to_better)[0, 1])
    yield float(ratio.std(ddof=1) / ratio.mean())
    yield float(np.corrcoef(degrees, values)[0, 1])


def _dispersions(sample: Sample, values: FloatArray) -> Iterator[float]:
    """Mean distances of the best points, over those of all [3]."""
    n = values.size
    distances = np.where(np.isfinite(sample.distances), sample.distances, 0.0)
    for share in BEST:
        best = np.flatnonzero(values <= np.quantile(values, share))
        pairs = best.size * (best.size - 1) / (n * (n - 1))
        yield float(distances[np.ix_(best, best)].sum() / distances.sum() / pairs)


def _information(sample: Sample, values: FloatArray) -> Iterator[float]:
    """The largest information content, the sensitivity (log10) at which it is nearly none, the share of turns [4]."""
    order, steps = sample.tour
    slopes = np.diff(values[order]) / steps
    contents = np.array([_content(np.where(np.abs(slopes) > e, np.sign(slopes), 0.0)) for e in SENSITIVITIES])
    yield float(contents.max())
    yield float(np.log10(SENSITIVITIES[1:][contents[1:] < SETTLED][0]))
    turning = np.sign(slopes)[slopes != 0.0]
    yield (1 + int((np.diff(turning) != 0.0).sum())) / slopes.size


def _content(symbols: FloatArray) -> float:
    """Entropy of pairs of different symbols -1, 0, 1 in a sequence, to base 6."""
    pairs = np.bincount((3.0 * symbols[:-1] + symbols[1:] + 4.0).astype(int), minlength=9) / (symbols.size - 1)
    unlike = pairs[[1, 2, 3, 5, 6, 7]]
    unlike = unlike[unlike > 0.0]
    return float(-(unlike * np.log(unlike)).sum() / np.log(6.0))


def standardised(table: FloatArray) -> FloatArray:
    """Rows of features (m, k) with columns of mean 0 and deviation 1; a column in which all are equal is 0."""
    deviations = table.std(axis=0)
    return np.asarray((table - table.mean(axis=0)) / np.where(deviations > 0.0, deviations, 1.0))


def alike_part(table: FloatArray, size: int) -> list[int]:
    """The rows of a table (m, k), ``size`` of them, that differ least from the others: by the energy distance."""
    apart, everything = cdist(table, table), range(len(table))

    def energy(part: tuple[int, ...]) -> float:
        rest = [row for row in everything if row not in part]
        within = apart[np.ix_(part, part)].mean() + apart[np.ix_(rest, rest)].mean()
        return float(2.0 * apart[np.ix_(part, rest)].mean() - within)

    part = min(combinations(everything, size), key=energy)
    return list(part)

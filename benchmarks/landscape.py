"""The landscapes of ``arm-motions-1`` beside those of BBOB: features of both, a map of them, what they have in common.

    python -m benchmarks.landscape --out docs/images     # features into runs/landscape.csv, the map, tables in Markdown
    python -m benchmarks.landscape --read runs/landscape.csv --out docs/images     # the same of features that are there

Features (:mod:`benchmarks.freeze.features`) are of the merit, of two objectives of the first one, on the sample that
the suite's instances were chosen by. BBOB is that of ioh, which has it for any number of variables, so that each
landscape is compared with BBOB's of as many: 0 is their mean of a feature, 1 their deviation.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from benchmarks.freeze.features import FEATURES, features, sample_of
from problems.base import FloatArray
from tpbso_casadi.suite import suite

BBOB = "bbob"
INSTANCES = (1, 2, 3)  # of BBOB
FARTHEST = 10.0  # deviations: what is farther off counts as that
TUNED = 5  # instances 1 to 5 of the suite
GROUPS = {1: "separable", 6: "moderate", 10: "ill-conditioned", 15: "multi-modal", 20: "weakly structured"}  # from f


@dataclass(frozen=True)
class Landscape:
    """An instance of a function of the suite or of BBOB: the share of the sample that is feasible, and its features."""

    collection: str
    group: str
    function: str
    instance: int
    dimension: int
    feasible: float
    features: tuple[float, ...]


def of_suite(dimension: int) -> Iterator[Landscape]:
    sample = sample_of(dimension)
    for problem in suite():
        if problem.dimension == dimension:
            lower, upper = problem.bounds
            merits = problem.merit(lower + sample.points * (upper - lower)).reshape(len(sample.points), -1)[:, 0]
            feasible, found = float(np.mean(merits <= problem.feasible_merit)), tuple(features(sample, merits).tolist())
            name = problem.function.name
            yield Landscape(problem.suite, problem.group, name, problem.instance, dimension, feasible, found)


def of_bbob(dimension: int) -> Iterator[Landscape]:
    import ioh  # noqa: PLC0415 (an extra)

    sample = sample_of(dimension)
    for function in range(1, 25):
        group = GROUPS[max(first for first in GROUPS if first <= function)]
        for instance in INSTANCES:
            problem = ioh.get_problem(function, instance, dimension, ioh.ProblemClass.BBOB)
            found = tuple(features(sample, np.array(problem(-5.0 + 10.0 * sample.points))).tolist())
            yield Landscape(BBOB, group, f"f{function}", instance, dimension, 1.0, found)


def computed() -> Iterator[Landscape]:
    for dimension in sorted({function.dimension for function in suite().functions}):
        yield from of_suite(dimension)
        yield from of_bbob(dimension)


@dataclass(frozen=True, eq=False)
class Map:
    """All landscapes, standardised, and their principal components."""

    landscapes: list[Landscape]

    @cached_property
    def table(self) -> FloatArray:
        """Features, (n, k), in deviations of BBOB's of the same dimension from their mean."""
        raw = np.array([each.features for each in self.landscapes])
        found = np.empty_like(raw)
        for rows in self.dimensions.values():
            others = raw[rows[self.is_bbob[rows]]]
            found[rows] = (raw[rows] - others.mean(axis=0)) / others.std(axis=0)
        return np.clip(found, -FARTHEST, FARTHEST)

    @cached_property
    def dimensions(self) -> dict[int, NDArray[np.intp]]:
        """The rows of each."""
        sizes = np.array([each.dimension for each in self.landscapes])
        return {int(size): np.flatnonzero(sizes == size) for size in np.unique(sizes)}

    @cached_property
    def components(self) -> tuple[FloatArray, FloatArray]:
        """Shares of the variance (k,), and the components (k, k), one a row; both collections have half a weight."""
        weights = np.where(self.is_bbob, 0.5 / self.is_bbob.sum(), 0.5 / (~self.is_bbob).sum())
        centred = self.table - weights @ self.table
        _, values, rows = np.linalg.svd(np.sqrt(weights)[:, None] * centred, full_matrices=False)
        return values**2 / (values**2).sum(), rows

    @cached_property
    def places(self) -> FloatArray:
        """Of landscapes on the map, (n, 2)."""
        return self.table @ self.components[1][:2].T

    @cached_property
    def is_bbob(self) -> NDArray[np.bool_]:
        """Of each landscape, (n,)."""
        return np.array([each.collection == BBOB for each in self.landscapes])

    @cached_property
    def functions(self) -> dict[str, NDArray[np.intp]]:
        """By name, the rows of its instances, whatever their dimension: the suite's by groups, then BBOB's."""
        names = np.array([each.function for each in self.landscapes])
        ours = sorted((each for each in self.landscapes if each.collection != BBOB), key=lambda each: each.group)
        order = dict.fromkeys([*(each.function for each in ours), *names.tolist()])
        return {name: np.flatnonzero(names == name) for name in order}

    @cached_property
    def centres(self) -> FloatArray:
        """Mean features of each function."""
        return np.array([self.table[rows].mean(axis=0) for rows in self.functions.values()])

    @cached_property
    def to_bbob(self) -> tuple[FloatArray, NDArray[np.intp]]:
        """Of each landscape the distance and the row of BBOB's nearest one, of that dimension and another function."""
        distances, nearest = np.empty(len(self.landscapes)), np.empty(len(self.landscapes), dtype=np.intp)
        names = np.array([each.function for each in self.landscapes])
        for rows in self.dimensions.values():
            others = rows[self.is_bbob[rows]]
            apart = cdist(self.table[rows], self.table[others])
            apart[names[rows][:, None] == names[others]] = np.inf
            distances[rows], nearest[rows] = apart.min(axis=1), others[apart.argmin(axis=1)]
        return distances, nearest

    def spread(self, rows: NDArray[np.intp]) -> float:
        """Mean distance of any two landscapes."""
        apart = cdist(self.table[rows], self.table[rows])
        return float(apart.sum() / (len(rows) * (len(rows) - 1)))


def told(found: Map) -> Iterator[str]:
    """Tables and sentences in Markdown."""
    shares, rows = found.components
    yield f"{len(found.landscapes)} landscapes, {found.is_bbob.sum()} of BBOB"
    yield f"components: {', '.join(f'{100.0 * share:.0f} %' for share in shares[:6])}"
    for k in range(2):
        order = np.argsort(-np.abs(rows[k]))[:6]
        yield f"component {k + 1}: " + ", ".join(f"{FEATURES[j]} {rows[k, j]:+.2f}" for j in order)
    yield f"{(np.abs(found.table) >= FARTHEST).mean():.1%} of the numbers are {FARTHEST:g} deviations off and more"
    yield from _features_told(found)
    yield from _neighbours_told(found)
    yield from _spreads_told(found)
    yield from _correlations_told(found)


def _features_told(found: Map) -> Iterator[str]:
    yield "\n| feature | the suite: 10 %, median, 90 % | BBOB: 10 %, median, 90 % | deviations between the means |"
    yield "|---|---|---|---|"
    raw = np.array([each.features for each in found.landscapes])
    for name, column, standard in zip(FEATURES, raw.T, found.table.T, strict=True):
        ours, theirs = (
            ", ".join(f"{value:.2f}" for value in np.quantile(column[mask], (0.1, 0.5, 0.9)))
            for mask in (~found.is_bbob, found.is_bbob)
        )
        yield f"| {name} | {ours} | {theirs} | {standard[~found.is_bbob].mean():+.1f} |"


def _neighbours_told(found: Map) -> Iterator[str]:
    distances, nearest = found.to_bbob
    yield "\ndistance to BBOB's nearest landscape of another function, of as many variables:"
    for name, mask in (("the suite's", ~found.is_bbob), ("BBOB's own", found.is_bbob)):
        low, middle, high = np.quantile(distances[mask], (0.1, 0.5, 0.9))
        yield f"{name}: {middle:.2f} in the median, 10 % below {low:.2f}, 10 % above {high:.2f}"
    usual = float(np.quantile(distances[found.is_bbob], 0.9))
    yield f"the suite's within {usual:.2f}: {(distances[~found.is_bbob] <= usual).mean():.0%}"
    yield "\n| function | variables | feasible | BBOB's nearest | distance | spread of its instances |"
    yield "|---|---|---|---|---|---|"
    for name, rows in found.functions.items():
        if not found.is_bbob[rows[0]]:
            names = [found.landscapes[row].function for row in nearest[rows]]
            most, size = max(dict.fromkeys(names), key=names.count), found.landscapes[rows[0]].dimension
            feasible = np.mean([found.landscapes[row].feasible for row in rows])
            yield (
                f"| `{name}` | {size} | {feasible:.1%} | {most} ({names.count(most)} of {len(rows)}) | "
                f"{np.median(distances[rows]):.1f} | {found.spread(rows):.1f} |"
            )


def _spreads_told(found: Map) -> Iterator[str]:
    ours = [rows for rows in found.functions.values() if not found.is_bbob[rows[0]]]
    parts: tuple[list[float], list[float]] = ([], [])
    for rows in ours:
        numbers = np.array([found.landscapes[row].instance for row in rows])
        for part, chosen in zip(parts, (numbers <= TUNED, numbers > TUNED), strict=True):
            part.append(found.spread(rows[chosen]))
    within = [
        found.spread(np.intersect1d(rows, same))
        for rows in found.functions.values()
        if found.is_bbob[rows[0]]
        for same in found.dimensions.values()
    ]
    yield f"\nmean distance of two instances of a function: {np.mean([found.spread(rows) for rows in ours]):.2f};"
    yield f"of instances 1 to {TUNED} {np.mean(parts[0]):.2f}, of the others {np.mean(parts[1]):.2f};"
    yield f"of BBOB's of one function and dimension {np.mean(within):.2f}"


def _correlations_told(found: Map) -> Iterator[str]:
    """Of the mean features of functions."""
    table = np.corrcoef(found.centres)
    ours = np.array([not found.is_bbob[rows[0]] for rows in found.functions.values()])
    names = np.array(list(found.functions))
    for title, block in (
        ("of two of the suite", table[np.ix_(ours, ours)][np.triu_indices(ours.sum(), 1)]),
        ("of two of BBOB", table[np.ix_(~ours, ~ours)][np.triu_indices((~ours).sum(), 1)]),
        ("of one each", table[np.ix_(ours, ~ours)].ravel()),
    ):
        low, middle, high = np.quantile(block, (0.1, 0.5, 0.9))
        yield f"correlation of functions, {title}: median {middle:.2f}, 10 % below {low:.2f}, 10 % above {high:.2f}"
    alike = [
        (table[i, j], names[i], names[j])
        for i, j in zip(*np.triu_indices(len(names), 1), strict=True)
        if ours[i] and ours[j]
    ]
    for value, one, other in sorted(alike, reverse=True)[:12]:
        yield f"  {one}, {other}: {value:.3f}"


def draw(found: Map, path: Path) -> None:
    """The map, and the correlations of functions."""
    import matplotlib as mpl  # noqa: PLC0415 (slow to load)

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, (left, right) = plt.subplots(1, 2, figsize=(15, 7), width_ratios=(1.15, 1), layout="constrained")
    _draw_places(found, left)
    _draw_correlations(found, right, figure)
    figure.savefig(path, dpi=90, bbox_inches="tight")


def _draw_places(found: Map, axes: object) -> None:
    shares, _ = found.components
    groups = [
        (name, [k for k, each in enumerate(found.landscapes) if each.collection == BBOB and each.group == name])
        for name in GROUPS.values()
    ]
    for (name, rows), marker in zip(groups, "v^<>D", strict=True):
        axes.scatter(*found.places[rows].T, s=14, marker=marker, c="0.65", linewidths=0, label=f"BBOB, {name}")
    ours = dict.fromkeys(each.group for each in found.landscapes if each.collection != BBOB)
    for number, name in enumerate(ours):
        rows = [k for k, each in enumerate(found.landscapes) if each.group == name]
        axes.scatter(*found.places[rows].T, s=16, color=f"C{number}", alpha=0.8, linewidths=0, label=name)
    axes.set_xlabel(f"component 1 ({shares[0]:.0%} of the variance)")
    axes.set_ylabel(f"component 2 ({shares[1]:.0%})")
    axes.legend(fontsize=8, markerscale=1.5, loc="best")


def _draw_correlations(found: Map, axes: object, figure: object) -> None:
    names = list(found.functions)
    picture = axes.imshow(np.corrcoef(found.centres), cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=6)
    axes.set_yticks(range(len(names)), names, fontsize=6)
    axes.set_title("correlation of the mean features of functions", fontsize=10)
    figure.colorbar(picture, ax=axes, shrink=0.8)


def write(landscapes: list[Landscape], path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        names = [field.name for field in fields(Landscape)][:-1]
        writer.writerow([*names, *FEATURES])
        for each in landscapes:
            writer.writerow([*(getattr(each, name) for name in names), *each.features])


def read(path: Path) -> list[Landscape]:
    with path.open(newline="") as file:
        _, *rows = csv.reader(file)
    return [
        Landscape(c, g, f, int(i), int(d), float(share), tuple(map(float, values)))
        for c, g, f, i, d, share, *values in rows
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs"), help="folder of the picture")
    parser.add_argument("--read", type=Path, help="features that were written before")
    options = parser.parse_args()
    landscapes = read(options.read) if options.read else [*computed()]
    if not options.read:
        write(landscapes, Path("runs/landscape.csv"))
    found = Map(landscapes)
    print("\n".join(told(found)))
    draw(found, options.out / "landscape.png")


if __name__ == "__main__":
    main()

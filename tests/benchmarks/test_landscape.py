"""The map of landscapes, of a few made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.freeze.features import FEATURES
from benchmarks.landscape import BBOB, FARTHEST, Landscape, Map

HALF = len(FEATURES) // 2


def made() -> list[Landscape]:
    """Two functions of BBOB in two dimensions, and two of the suite: one like BBOB's f1, one far from all."""
    rng = np.random.default_rng(0)
    found = []
    for dimension, offset in ((5, 0.0), (9, 100.0)):
        for name, middle in (("f1", -1.0), ("f2", 1.0)):
            for instance in (1, 2, 3):
                row = offset + middle + 0.1 * rng.normal(size=len(FEATURES))
                found.append(Landscape(BBOB, "separable", name, instance, dimension, 0.5, tuple(row.tolist())))
    for name, dimension, middle in (("near", 5, -1.0), ("far", 9, 130.0)):
        for instance in range(1, 16):
            row = middle + 0.1 * rng.normal(size=len(FEATURES))
            row[HALF:] -= 30.0 * (name == "far")
            found.append(Landscape("arm-motions-1", "spline", name, instance, dimension, 0.5, tuple(row.tolist())))
    return found


def test_features_are_measured_by_bbob_of_the_same_dimension() -> None:
    found = Map(made())
    for rows in found.dimensions.values():
        others = found.table[rows[found.is_bbob[rows]]]
        assert others.mean(axis=0) == pytest.approx(np.zeros(len(FEATURES)), abs=1e-9)
        assert others.std(axis=0) == pytest.approx(np.ones(len(FEATURES)))
    assert found.table[found.functions["near"]].mean() == pytest.approx(-1.0, abs=0.1)
    assert (found.table[found.functions["far"], :HALF] == FARTHEST).all()


def test_the_nearest_is_of_another_function() -> None:
    found = Map(made())
    distances, nearest = found.to_bbob
    names = np.array([each.function for each in found.landscapes])
    sizes = np.array([each.dimension for each in found.landscapes])
    assert (names[nearest] != names).all() and (sizes[nearest] == sizes).all() and found.is_bbob[nearest].all()
    assert (names[nearest[found.functions["near"]]] == "f1").all()
    assert distances[found.functions["near"]].max() < 2.0 < distances[found.functions["far"]].min()
    assert 0.0 < found.spread(found.functions["far"]) < found.spread(found.functions["near"])

"""Programs to test evaluation with, and the plainest way to run one."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base import FloatArray
from problems.evaluation import Loop, Program, Step


def sym(**sizes: int) -> dict[str, ca.SX]:
    """Symbols by name."""
    return {name: ca.SX.sym(name, size) for name, size in sizes.items()}


def typical(samples: int = 7, scale: float = 1.0, seed: int = 0) -> Program:
    """Prepare, a loop with a window and accumulators, finish; ``p`` and rows as in a scene of size ``scale``."""
    generator = np.random.default_rng(seed)
    first = sym(x=4, p=2)
    x, p = first.values()
    prepare = Step.of(
        "prepare",
        first,
        {"blocks": ca.vertcat(x * p[0], ca.sin(x)), "shared": x[0] + x[1], "total": ca.SX(0), "previous": x[:2]},
    )
    second = sym(p=2, shared=1, window=3, row=3, total=1, previous=2)
    p, shared, window, row, total, previous = second.values()
    here = ca.vertcat(ca.cos(window[0] * row[0]) + p[1] * row[1], window[1] * row[2] + shared * ca.sin(row[0] * p[0]))
    here = here + window[2]
    sample = Step.of(
        "sample",
        second,
        {"total": total + ca.norm_2(here - previous) + ca.if_else(here[0] > p[1], here[0], 0), "previous": here},
        Loop(rows=generator.normal(size=(samples, 3)), window="blocks", starts=generator.integers(0, 6, samples)),
    )
    third = sym(x=4, p=2, shared=1, total=1)
    x, p, shared, total = third.values()
    finish = Step.of("finish", third, {"cost": total * p[1] + shared * x[3]})
    return Program(steps=(prepare, sample, finish), parameters=scale * np.array([0.7, 0.3]))


def with_stacks(rows: int = 4) -> Program:
    """A loop that keeps two outputs row after row, steps that read them whole, by a window, and as they were last."""
    x, row = ca.SX.sym("x", 2), ca.SX.sym("row", 1)
    knots = Step.of(
        "knots",
        {"x": x, "row": row},
        {"theta": ca.vertcat(row * x[0], x[1] - row, x[0] * x[1]), "reach": row + x[0], "last": x * row},
        Loop(rows=np.linspace(0.0, 1.0, rows)[:, None]),
        stacked=("theta", "reach"),
    )
    theta, reach, last = sym(theta=3 * rows, reach=rows, last=2).values()
    spline = Step.of(
        "spline",
        {"theta": theta, "reach": reach, "last": last},
        {"coefficients": theta[::-1] * ca.sum1(reach), "sums": last},
    )
    window, sums = sym(window=4, sums=2).values()
    swap = Step.of(
        "swap",
        {"window": window, "sums": sums},
        {"sums": ca.vertcat(sums[1], sums[0] + ca.dot(window, window))},
        Loop(rows=np.empty((3, 0)), window="coefficients", starts=np.array([0, 3 * rows - 4, 2])),
    )
    finish = Step.of("finish", {"sums": sums}, {"cost": sums[0] - 2.0 * sums[1]})
    return Program(steps=(knots, spline, swap, finish))


def interpreted(program: Program, candidates: FloatArray) -> FloatArray:
    """The costs (m,) of candidates (m, d), one numeric call of a function after the other."""
    return np.array([_cost(program, x) for x in candidates])


def _cost(program: Program, x: FloatArray) -> float:
    vectors = {"x": x, "p": program.parameters}
    for step in program.steps:
        stacks: dict[str, list[FloatArray]] = {name: [] for name in step.stacked}
        for i in range(1 if step.loop is None else len(step.loop.rows)):
            given = dict(vectors)
            if step.loop is not None:
                given["row"] = step.loop.rows[i]
                if step.loop.starts is not None:
                    start = step.loop.starts[i]
                    given["window"] = vectors[step.loop.window][start : start + step.function.size1_in("window")]
            results = step.function.call([ca.DM(given[name]) for name in step.function.name_in()])
            for name, result in zip(step.function.name_out(), results, strict=True):
                if name in stacks:
                    stacks[name].append(result.full().ravel())
                else:
                    vectors[name] = result.full().ravel()
        vectors |= {name: np.concatenate(stack) for name, stack in stacks.items()}
    return float(vectors["cost"][0])

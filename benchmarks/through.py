"""The fastest motions through given postures against nonlinear programs: durations and processor seconds.

Each program has so many cells of constant jerk in every segment, free durations of segments, and states at all knots;
IPOPT begins at a motion that stops at every posture. The cases are three of the literature and random ones: 2 to 10
joints, 1 to 12 postures on the way, short and long ramps of acceleration, some without limits of jerk, some between
ends that move.

    python -m benchmarks.through --random 60 --cells 32
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np

from problems.base import FloatArray
from problems.robots import JointLimits
from problems.timing import fastest_through, peak_shares, rest_to_rest

ITERATIONS = 600
SPEED_SHARES = (0.25, 0.5, 0.75)  # of a cell where programs bound speeds, besides its ends
LIN = {
    "speed": (100, 95, 100, 150, 130, 110),
    "acceleration": (45, 40, 75, 70, 90, 80),
    "jerk": (60, 60, 55, 70, 75, 70),
}


@dataclass(frozen=True)
class Case:
    """Postures to pass and limits.

    Attributes:
        name: of the case.
        postures: both ends included, (n, k), rad.
        limits: of the joints.
        rates: velocities and accelerations at both ends, (2 ends, 2, k), rad/s and rad/s^2; at rest where None.
    """

    name: str
    postures: FloatArray
    limits: JointLimits
    rates: FloatArray | None = None


def published() -> Iterator[Case]:
    """Three cases of the literature, from degrees.

    [1] C.-S. Lin, P.-R. Chang, J. Luh, "Formulation and optimization of cubic polynomial joint trajectories for
        industrial robots", IEEE Trans. Automatic Control 28, 1983, 1066-1074
    [2] Y. Yu et al., Control Engineering Practice 154, 2025, 106154, tables 4 and 6
    [3] J. Zhao, X. Zhu, T. Song, IEEE Access 10, 2022, 6592-6604, tables 7 to 10
    """
    cases: dict[str, tuple[list[list[float]], dict[str, tuple[float, ...]]]] = {
        "Lin 1983 [1]": (
            [
                [10, 15, 45, 5, 10, 6],
                [60, 25, 180, 20, 30, 40],
                [75, 30, 200, 60, -40, 80],
                [130, -45, 120, 110, -60, 70],
                [110, -55, 15, 20, 10, -10],
                [100, -70, -10, 60, 50, 10],
                [-10, -10, 100, -100, -40, 30],
                [-50, 10, 50, -30, 10, 20],
            ],
            LIN,
        ),
        "Piazzi and Visioli, after [2]": (
            [
                [-10, 20, 15, 150, 30, 120],
                [60, 50, 100, 100, 110, 60],
                [20, 120, -10, 40, 90, 100],
                [55, 35, 30, 10, 70, 25],
            ],
            {**LIN, "acceleration": (60, 60, 75, 70, 90, 80), "jerk": (60, 66, 85, 70, 75, 70)},
        ),
        "Zhao 2022 [3]": (
            [
                [120.34, 41.07, 31.09, 31.59, -74.67, -9.23],
                [109.33, -13.10, 26.96, 57.58, -24.00, -55.12],
                [65.74, -8.27, 39.03, -41.48, -38.38, 34.56],
                [42.78, 16.91, 34.61, -53.98, -64.94, 29.89],
                [30.35, 29.49, 5.08, -72.08, -66.00, 51.75],
                [29.13, 38.64, -30.00, 85.31, -61.55, 80.48],
            ],
            {
                "speed": (100, 95, 100, 150, 130, 140),
                "acceleration": (45, 40, 50, 70, 50, 80),
                "jerk": (60, 60, 55, 70, 75, 60),
            },
        ),
    }
    for name, (postures, limits) in cases.items():
        radians = {key: tuple(np.radians(values).tolist()) for key, values in limits.items()}
        yield Case(name, np.radians(postures), JointLimits(**radians))


def random_cases(rng: np.random.Generator) -> Iterator[Case]:
    """One case after another: three kinds in turn."""
    while True:
        for kind in ("jerk limits", "no jerk limits", "moving ends"):
            joints, places = int(rng.integers(2, 11)), int(rng.integers(3, 15))
            speed = rng.uniform(0.5, 3.0, joints)
            acceleration = speed * rng.uniform(1.0, 8.0, joints)
            jerk = acceleration * rng.uniform(1.0, 15.0, joints)
            limits = JointLimits(
                speed=tuple(speed),
                acceleration=tuple(acceleration),
                jerk=None if kind == "no jerk limits" else tuple(jerk),
            )
            velocities = rng.uniform(-0.3, 0.3, (2, joints)) * speed
            moving = np.stack([velocities, 0.0 * velocities], axis=1) if kind == "moving ends" else None
            yield Case(kind, rng.uniform(-2.0, 2.0, (places, joints)), limits, moving)


def by_nonlinear_program(case: Case, cells: int) -> float:
    """The duration that IPOPT finds, s; NaN where it does not converge.

    Args:
        case: to be solved.
        cells: of constant jerk in each segment, or of constant acceleration where jerks are not limited.
    """
    postures, (segments, joints) = case.postures, np.array(case.postures.shape) - (1, 0)
    orders, bounds = len(case.limits.by_order), [ca.DM(bound) for bound in case.limits.by_order]
    ends = np.zeros((2, orders - 1, joints))
    if case.rates is not None:
        ends[:] = case.rates[:, : orders - 1]
    opti = ca.Opti()
    durations, total = opti.variable(segments), segments * cells + 1
    states = [opti.variable(joints, total) for _ in range(orders)]
    tops = opti.variable(joints, total - 1)
    opti.minimize(ca.sum1(durations))
    opti.subject_to(durations >= 1e-3)
    for place, posture in enumerate(postures):
        opti.subject_to(states[0][:, place * cells] == posture)
    for order in range(1, orders):
        for end, column in ((0, 0), (1, total - 1)):
            opti.subject_to(states[order][:, column] == ends[end, order - 1])
    steps = ca.repmat(ca.vec(ca.repmat(durations.T / cells, cells, 1)).T, joints, 1)
    for order in range(orders):
        opti.subject_to(states[order][:, 1:] == _later([*states[order:], tops], steps))
    for order in range(1, orders):
        opti.subject_to(opti.bounded(-1.0, states[order] / ca.repmat(bounds[order - 1], 1, total), 1.0))
    opti.subject_to(opti.bounded(-1.0, tops / ca.repmat(bounds[-1], 1, total - 1), 1.0))
    if case.limits.position is not None:
        low, high = (ca.repmat(ca.DM(side), 1, total) for side in np.array(case.limits.position).T)
        opti.subject_to(opti.bounded(low, states[0], high))
    for share in SPEED_SHARES if orders == 3 else ():
        between = _later([*states[1:], tops], share * steps) / ca.repmat(bounds[0], 1, total - 1)
        opti.subject_to(opti.bounded(-1.0, between, 1.0))
    stops = [rest_to_rest(one, other, case.limits) for one, other in pairwise(postures)]
    opti.set_initial(durations, [stop.duration for stop in stops])
    for order in range(orders):
        values = [stop.at(np.linspace(0.0, stop.duration, cells + 1)[:-1], order) for stop in stops]
        opti.set_initial(states[order], np.concatenate([*values, stops[-1].value_at_end(order)[None]]).T)
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": ITERATIONS}
    opti.solver("ipopt", {**quiet, "expand": True})
    try:
        return float(np.sum(opti.solve().value(durations)))
    except RuntimeError:
        return float("nan")


def _later(states: list[ca.MX], steps: ca.MX) -> ca.MX:
    """A value after steps in s, by its derivatives before, the last of which is constant."""
    found, factor = 0.0, 1.0
    for order, state in enumerate(states):
        factor = factor * steps / order if order else 1.0
        found = found + state[:, : steps.shape[1]] * factor
    return found


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--random", type=int, default=60)
    parser.add_argument("--cells", type=int, default=32)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    drawn = random_cases(np.random.default_rng(given.seed))
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for case in (*published(), *(next(drawn) for _ in range(given.random))):
        began = time.process_time()
        found = fastest_through(case.postures, case.limits, case.rates)
        taken, began = time.process_time() - began, time.process_time()
        reference = by_nonlinear_program(case, given.cells)
        other = time.process_time() - began
        assert found is None or max(peak_shares(found, case.limits)) <= 1.0 + 1e-9
        duration = np.nan if found is None else found.duration
        rows.setdefault(case.name, []).append((duration / reference, taken, other))
        print(f"{case.name}: {duration:.4f} s, {duration / reference:.5f} of {reference:.4f} s", flush=True)
    print("kind: how many, those that IPOPT solved; ratio median/90 %/worst; CPU s median/90 %/worst; IPOPT's")
    for name, values in rows.items():
        ratios, own, others = np.array(values).T
        known = ratios[np.isfinite(ratios)]
        quantiles = ("/".join(f"{each:.4g}" for each in np.percentile(part, (50, 90, 100))) for part in (own, others))
        ratio = "/".join(f"{each:.4f}" for each in np.percentile(known, (50, 90, 100))) if known.size else "none"
        print(f"{name}: {len(values)}, {known.size}; {ratio}; {'; '.join(quantiles)}")


if __name__ == "__main__":
    main()

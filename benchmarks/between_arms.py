"""Are arms that are proven apart so? Proofs between the arms of a cell against samples, and plans against meshes.

Proofs are of random motions, each scaled so that the arms come to within 1e-6 to 1e-2 m of what they must keep, on
either side; pairs of links are those between the arms alone. A proof is false when samples, and closer ones around the
least of them, find less room than it calls kept. The room at the least of them is computed anew, of all balls.
Plans are those of the problems; Pinocchio and coal (extra ``oracles``) look for contacts of the arms' own meshes with
boxes and with each other.

    python -m benchmarks.between_arms proofs CELLS.json --count 2000 --workers 2
    python -m benchmarks.between_arms meshes CELLS.json --count 20 --workers 2
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import islice, pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.distance import cdist

import tpbso_casadi as tp
from benchmarks.arms import PinocchioReferee, contacts
from benchmarks.off_the_shelf import ROBOTS, print_rows
from benchmarks.two_arms import cells_of
from problems.base import FloatArray
from problems.core import CompiledWorld, Separation
from problems.motions import Trajectory
from problems.robots import SpatialArm

SAMPLES = 100_000
COARSE, CLOSER = 300, 2  # samples, and how often closer ones are taken, before motions are scaled
FAR = 0.05  # m: more room than that is not told apart
TIMES = 20_000  # at which meshes are looked at
BISECTED = 22  # times, for the scale of a motion
ROUNDING = 1e-9  # m
NEAR = (-6.0, -2.0)  # exponents of the room that a motion is scaled to
OFTEN = (0.1, 0.5, 0.9)  # quantiles
PROOFS = ("arms", "proven", "broken", "open", "false", "room um: 10 % / median / 90 %", "anew, nm", "CPU ms: median")
MESHES = ("arms", "plans", "certified", "times with a contact")


@dataclass(frozen=True)
class Checked:
    """A proof between arms.

    Attributes:
        robot: name of the arm that is there twice.
        status: None where it is left open.
        least: room that samples find, m.
        off: of that room from the one of all balls by NumPy and SciPy, m.
        is_false: whether the samples, or what is said to be broken, disagree.
        milliseconds: CPU time.
    """

    robot: str
    status: bool | None
    least: float
    off: float
    is_false: bool
    milliseconds: float


@cache
def arms_of(file: Path) -> tuple[tuple[str, SpatialArm], ...]:
    """The first cell of each arm, of whose pairs of links those between the arms are left."""
    found: dict[str, SpatialArm] = {}
    with TemporaryDirectory() as folder:
        for cell in cells_of(file, Path(folder)):
            if cell.name not in found:
                arm = cell.robot.model
                assert isinstance(arm, SpatialArm) and arm.cover is not None
                sides = [link.name.partition("_")[0] for link in arm.cover.links]
                pairs = tuple(pair for pair in arm.cover.pairs if sides[pair[0]] != sides[pair[1]])
                found[cell.name] = replace(arm, cover=replace(arm.cover, pairs=pairs), self_collision=True)
    return tuple(found.items())


def world_of(arm: SpatialArm) -> CompiledWorld:
    """The arm alone, as the core sees it."""
    world = CompiledWorld.of(arm, ())
    assert world is not None
    return world


def least_room(world: CompiledWorld, motion: Trajectory, count: int, most: float = FAR) -> tuple[float, float]:
    """The least room among so many samples and closer ones around the three least, at most so much, m; its time."""

    def rooms(times: FloatArray) -> FloatArray:
        return world.clearance_margins(motion.at(times), most, Separation.FROM_EACH_OTHER)

    times, step = np.linspace(0.0, motion.duration, count), motion.duration / (count - 1)
    found = rooms(times)
    for _ in range(CLOSER):
        around = times[np.argsort(found)[:3], None] + step * np.linspace(-1.0, 1.0, 31)
        near = np.clip(around.ravel(), 0.0, motion.duration)
        times, found, step = np.append(times, near), np.append(found, rooms(near)), step / 15.0
    at = int(np.argmin(found))
    return float(found[at]), float(times[at])


def random_motion(world: CompiledWorld, arm: SpatialArm, rng: np.random.Generator) -> Trajectory:
    """A motion of polynomials, scaled about its start until the least room is close to zero."""
    low, high = np.array(arm.position_limits).T
    postures = rng.uniform(low, high, (600, arm.dof))
    margins = world.clearance_margins(postures, which=Separation.FROM_EACH_OTHER)
    order, degree = np.argsort(margins), int(rng.choice([1, 3, 5]))
    stops = postures[[order[-int(rng.integers(1, 300))], *rng.choice(order[:30], int(rng.integers(1, 4)))]]
    pieces = []
    for start, end in pairwise(stops):
        powers = 0.3 * rng.normal(size=(degree, arm.dof)) * np.abs(end - start)
        pieces.append(np.concatenate([start[None], powers + (end - start - powers.sum(axis=0)) / degree]))
    whole = Trajectory.from_pieces(rng.uniform(0.2, 2.0, len(pieces)).tolist(), pieces)
    target, shares = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(*NEAR)), [0.0, 1.0]
    for _ in range(BISECTED):
        middle = sum(shares) / 2.0
        near = least_room(world, scaled(whole, stops[0], middle), COARSE)[0] < target
        shares[near] = middle
    return scaled(whole, stops[0], shares[0])


def scaled(motion: Trajectory, start: FloatArray, share: float) -> Trajectory:
    """A motion that goes a share of the way from its start."""
    coefficients = share * motion.coefficients
    coefficients[-1] += (1.0 - share) * start
    return Trajectory(motion.breakpoints, coefficients)


def room_anew(arm: SpatialArm, posture: FloatArray) -> float:
    """Room between the arms of one posture, every ball with every other, m."""
    assert arm.cover is not None
    frames = arm.body_frames(posture[None])[0]
    centers = [frames[link.body, 0] + link.balls.centers @ frames[link.body, 1:] for link in arm.cover.links]
    radii = [link.balls.radii for link in arm.cover.links]
    least = np.inf
    for one, two in arm.cover.pairs:
        apart = cdist(centers[one], centers[two])
        least = min(least, float((apart - radii[one][:, None] - radii[two]).min()))
    return least - arm.self_margin


def check(seed: int, file: Path, samples: int) -> Checked:
    """The proof of one random motion."""
    arms = arms_of(file)
    name, arm = arms[seed % len(arms)]
    world = world_of(arm)
    motion = random_motion(world, arm, np.random.default_rng(seed))
    began = time.process_time()
    proof = world.prove(motion, Separation.FROM_EACH_OTHER)
    milliseconds = (time.process_time() - began) * 1e3
    known, at = least_room(world, motion, COARSE)
    least, dense = least_room(world, motion, samples, known)  # no more is asked for: the far ones cost little
    at = dense if least < known else at
    anew = room_anew(arm, motion.at(np.array([at]))[0])
    broken = proof.status is False and room_anew(arm, motion.at(np.array([proof.time]))[0]) > ROUNDING
    is_false = broken or (proof.status is True and min(least, anew) < -ROUNDING)
    return Checked(name, proof.status, least, abs(min(anew, FAR) - least), is_false, milliseconds)


def print_proofs(file: Path, count: int, samples: int, workers: int) -> None:
    """A row for each robot."""
    with ProcessPoolExecutor(workers) as pool:
        every = list(pool.map(partial(check, file=file, samples=samples), range(count), chunksize=20))
    rows = []
    for name in dict.fromkeys(each.robot for each in every):
        own = [each for each in every if each.robot == name]
        counts = [sum(each.status is status for each in own) for status in (True, False, None)]
        near = " / ".join(f"{1e6 * room:.1f}" for room in np.quantile([abs(each.least) for each in own], OFTEN))
        off, cost = max(each.off for each in own), np.median([each.milliseconds for each in own])
        counts.append(sum(each.is_false for each in own))
        rows.append([f"two {name}", *map(str, counts), near, f"{1e9 * off:.2g}", f"{cost:.1f}"])
    print_rows(PROOFS, rows)


def met(number: int, file: Path) -> tuple[str, str, int]:
    """Of one problem: the arms, the status of its plan, at how many times meshes touch."""
    with TemporaryDirectory() as folder:
        cell = next(islice(cells_of(file, Path(folder)), number, None))
        plan = tp.plan(cell.robot, start=cell.start, goal=cell.goal, obstacles=cell.boxes)
        places, sizes = (np.array([box[key] for box in cell.boxes]) for key in ("center", "size"))
        arm = plan.planned.criteria.robot
        assert isinstance(arm, SpatialArm)
        referee = PinocchioReferee(cell.urdf, arm, places, sizes, (str(ROBOTS.parents[1]),))
        return cell.name, str(plan.status), contacts(referee, plan.trajectory, TIMES)


def print_meshes(file: Path, count: int, workers: int) -> None:
    """A row for each robot."""
    total = len(json.loads(file.read_text())["problems"])
    numbers = np.linspace(0, total - 1, count).round().astype(int).tolist()
    with ProcessPoolExecutor(workers) as pool:
        every = list(pool.map(partial(met, file=file), numbers))
    rows = []
    for name in dict.fromkeys(row[0] for row in every):
        own = [row for row in every if row[0] == name]
        counts = len(own), sum(status == "certified" for _, status, _ in own), sum(touched for *_, touched in own)
        rows.append([f"two {name}", *map(str, counts)])
    print_rows(MESHES, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("proofs", "meshes"))
    parser.add_argument("problems", type=Path)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    if options.what == "proofs":
        print_proofs(options.problems, options.count, options.samples, options.workers)
    else:
        print_meshes(options.problems, options.count, options.workers)


if __name__ == "__main__":
    main()

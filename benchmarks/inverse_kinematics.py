"""How many of an arm's postures ``arm.inverse`` finds, against a closed form and other libraries.

The closed form is that of the tests (``tests/oracles/universal_robots.py``), in NumPy from Denavit-Hartenberg numbers.
All run on one core, in one process; times are of the CPU, and hold what Python does between calls. Libraries that are
not installed are left out with a line.

    pip install pin ikpy roboticstoolbox-python pytracik eaik ur-analytic-ik

    python -m benchmarks.inverse_kinematics
    python -m benchmarks.inverse_kinematics --poses 50
"""

from __future__ import annotations

import argparse
import os
import time
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

import problems.robots
import tpbso_casadi as tp
from benchmarks.off_the_shelf import print_rows
from benchmarks.peers.inverse import PEERS, TOLERANCE, AskedArm, Peer, Solve, Truths, chain_alone
from problems.base import FloatArray
from tests.oracles.universal_robots import apart, forward, inverse

ROBOTS = ("ur5e", "panda")
STARTS = (16, 64, 400)
ASKED = 64  # times, of libraries that give one posture, until all are counted
ALIKE = 1e-3  # rad, of two postures that are one
TURN = 25  # poses that a library is asked for before the next one is
CALLS = 5  # of which the median is taken
REACH = 1.0  # m around the base, of poses drawn in space
Installed: TypeAlias = list[tuple[Peer, str, Solve]]  # with versions


def ours(arm: AskedArm, starts: int) -> Solve:
    """The product, a pose at a time, whatever postures touch: other libraries do not ask."""
    robot = tp.robot(arm.name)
    return lambda pose, _: np.asarray(robot.inverse(pose, touching=True, starts=starts))


OURS = tuple(
    Peer(f"arm.inverse, {starts} starts", "tpbso-casadi", partial(ours, starts=starts), closed=True)
    for starts in STARTS
)


def asked_arm(name: str, folder: Path) -> AskedArm:
    """A built-in robot, as other libraries are given it."""
    models, robot = Path(problems.robots.__file__).parent / "models", tp.robot(name)
    tip = tomllib.loads((models / f"{name}.toml").read_text())["tip_link"]
    text, base = chain_alone((models / f"{name}.urdf").read_text(), tip)
    (folder / f"{name}.urdf").write_text(text)
    low, high = np.array(robot.model.position_limits).T
    return AskedArm(name, folder / f"{name}.urdf", base, tip, low, high, robot.forward(np.zeros(len(low))))


def is_among(postures: FloatArray, others: FloatArray) -> Truths:
    """Whether each of postures (n, dof) is one of others (m, dof), up to whole turns."""
    return np.asarray((apart(postures, others) < ALIKE).any(axis=1))


def at_pose(robot: tp.StatedRobot, theta: FloatArray, pose: FloatArray) -> Truths:
    """Whether postures (n, dof) have the tool at a pose."""
    poses = robot.forward(theta)
    away = np.linalg.norm(poses[:, :3, 3] - pose[:3, 3], axis=1)
    turned = np.linalg.norm(poses[:, :3, :3] - pose[:3, :3], axis=(1, 2)) / np.sqrt(2.0)  # its angle, where it is small
    return np.asarray((away <= TOLERANCE) & (turned <= TOLERANCE))


def drawn_in_space(count: int, rng: np.random.Generator) -> FloatArray:
    """Poses (n, 4, 4) in a cube around the base, turned in any way."""
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 3], poses[:, :3, :3] = rng.uniform(-REACH, REACH, (count, 3)), Rotation.random(count, rng).as_matrix()
    return poses


def against_closed_form(reachable: int, in_space: int) -> Iterator[list[str]]:
    """A row for poses of random postures and one for poses in space, for each number of starts."""
    robot, rng = tp.robot("ur5e"), np.random.default_rng(0)
    kinds = {
        "of random postures": forward(rng.uniform(-np.pi, np.pi, (reachable, 6))),
        "drawn in space": drawn_in_space(in_space, rng),
    }
    for kind, poses in kinds.items():
        known = inverse(poses)
        for starts in STARTS:
            found = robot.inverse(poses, touching=True, starts=starts)
            pairs = list(zip(known, found, strict=True))
            missed = np.array([np.sum(~is_among(each, others)) for each, others in pairs])
            invented = sum(int(np.sum(~is_among(others, each))) for each, others in pairs)
            solvable, solved = (sum(len(each) > 0 for each in postures) for postures in (known, found))
            whole = [str(len(poses)), str(solvable), str(solved), str(sum(map(len, known)))]
            off = max(apart(others, each).min(axis=1).max() for each, others in pairs if len(each) and len(others))
            yield [kind, str(starts), *whole, str(missed.sum()), str((missed > 0).sum()), str(invented), f"{off:.0e}"]


@dataclass(frozen=True)
class Answers:
    """What a library answered.

    Attributes:
        postures: of each pose, (n, dof).
        seconds: of the CPU, of each pose.
    """

    postures: list[FloatArray]
    seconds: FloatArray

    def spent(self, unit: float, digits: int) -> list[str]:
        """Median and 95 % of the time of a pose."""
        return [f"{np.quantile(self.seconds, share) / unit:,.{digits}f}" for share in (0.5, 0.95)]

    def share_of(self, known: list[FloatArray]) -> str:
        """The share of known postures that were found."""
        found = [is_among(each, others) for each, others in zip(known, self.postures, strict=True)]
        return f"{np.concatenate(found).mean():.2%}"


def asked(solves: Sequence[Solve], poses: FloatArray, times: int = 1) -> list[Answers]:
    """What each solver answers to each pose so many times; they take turns, so that slow moments hit all of them."""
    rngs = [np.random.default_rng(0) for _ in solves]
    postures: list[list[FloatArray]] = [[] for _ in solves]
    seconds: list[list[float]] = [[] for _ in solves]
    for first in range(0, len(poses), TURN):
        for solve, rng, found, spent in zip(solves, rngs, postures, seconds, strict=True):
            solve(poses[first], rng)  # warm
            for pose in poses[first : first + TURN]:
                began = time.process_time()
                answers = [solve(pose, rng) for _ in range(times)]
                spent.append(time.process_time() - began)
                found.append(np.concatenate(answers))
    return [Answers(found, np.array(spent)) for found, spent in zip(postures, seconds, strict=True)]


def installed_peers() -> list[Peer]:
    """Ours, and those of the others that are there; a line for each package that is not."""
    missing = {package for package in {peer.package for peer in PEERS} if installed_version(package) is None}
    for package in sorted(missing):
        print(f"{package} is not installed, and left out\n")
    return [peer for peer in (*OURS, *PEERS) if peer.package not in missing]


def installed_version(package: str) -> str | None:
    """The version of an installed package, or None."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def together(robot: tp.StatedRobot, poses: FloatArray) -> Answers:
    """Ours with the starts of the default, all poses in one call: the median of some."""
    seconds = []
    for _ in range(CALLS):
        began = time.process_time()
        postures = robot.inverse(poses, touching=True)
        seconds.append((time.process_time() - began) / len(poses))
    return Answers(list(postures), np.full(len(poses), np.median(seconds)))


def judged(arm: AskedArm, answers: Answers, poses: FloatArray) -> list[str]:
    """The cells of a row: share solved, time, answers that are off or out of limits, and share of all postures."""
    robot = tp.robot(arm.name)
    right = [at_pose(robot, theta, pose) for theta, pose in zip(answers.postures, poses, strict=True)]
    kept = [arm.keeps(theta) for theta in answers.postures]
    solved = np.mean([np.any(reached & inside) for reached, inside in zip(right, kept, strict=True)])
    wrong, out = (str(np.sum(~np.concatenate(each))) for each in (right, kept))
    found = answers.share_of(inverse(poses)) if arm.name == "ur5e" else ""
    return [f"{solved:.1%}", *answers.spent(1e-6, 0), wrong, out, found]


def single_answers(arm: AskedArm, installed: Installed, poses: FloatArray) -> Iterator[list[str]]:
    """A row for each library: what it answers when it is asked once."""
    whole = together(tp.robot(arm.name), poses)
    yield [arm.name, "arm.inverse, all poses in one call", tp.__version__, *judged(arm, whole, poses)]
    every = asked([solve for *_, solve in installed], poses)
    for (peer, number, _), answers in zip(installed, every, strict=True):
        yield [arm.name, peer.title, number, *judged(arm, answers, poses)]


def all_answers(installed: Installed, poses: FloatArray) -> Iterator[list[str]]:
    """A row for each library: how many of a UR5e's postures it finds when it is asked often."""
    known = inverse(poses)
    for times, closed in ((1, True), (ASKED, False)):
        those = [(peer, solve) for peer, _, solve in installed if peer.closed == closed]
        every = asked([solve for _, solve in those], poses, times)
        for (peer, _), answers in zip(those, every, strict=True):
            complete = [is_among(each, others).all() for each, others in zip(known, answers.postures, strict=True)]
            found = [answers.share_of(known), f"{np.mean(complete):.1%}"]
            yield [peer.title, str(times), *found, *answers.spent(1e-3, 2)]


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.inverse_kinematics")
    parser.add_argument("--poses", type=int, default=500, help="of random postures, that all libraries are asked for")
    count = parser.parse_args().poses
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    asked_for = "poses", "starts", "count", "with a posture", "solved"
    print_rows(
        (*asked_for, "postures", "missed", "poses with one", "not there", "off by, rad"),
        against_closed_form(2 * count, 3 * count // 5),
    )
    with threadpool_limits(1), TemporaryDirectory() as folder:
        arms, rng = [asked_arm(name, Path(folder)) for name in ROBOTS], np.random.default_rng(1)
        poses = [tp.robot(arm.name).forward([arm.start(rng) for _ in range(count)]) for arm in arms]
        print()
        peers = installed_peers()
        installed = [
            [(each, version(each.package), each.make(arm)) for each in peers if arm.name in (each.arms or ROBOTS)]
            for arm in arms
        ]
        columns = "solved", "us: median", "95 %", "not at the pose", "out of limits", "postures found"
        rows = (row for each in zip(arms, installed, poses, strict=True) for row in single_answers(*each))
        print_rows(("robot", "library", "version", *columns), rows)
        print()
        all_columns = "library", "asked", "postures found", "poses with all", "ms: median", "95 %"
        print_rows(all_columns, all_answers(installed[0], poses[0][: count // 10]))


if __name__ == "__main__":
    main()

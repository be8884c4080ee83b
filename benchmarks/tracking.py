"""Simulated joint controllers on our plans: does a bound fitted on half of their logs keep the others clear?

Each controller is drawn: a delay, a PD law on a joint with its own natural frequency and damping, feed-forward of speed
and acceleration that is not complete, viscous and Coulomb friction, and a constant acceleration that is not known, as
of gravity. Half of the robots follow half of the plans; the least tracking error that bounds their logs, with a margin,
is stated, and plans are made anew. All robots follow all of these; how near they come is computed by NumPy alone.

    python -m benchmarks.tracking --scenes 12 --robots 143
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.moving_scenes.scenes import Scene, random_scenes
from problems import Trajectory
from problems.base import FloatArray
from problems.robots import TrackingError, least_tracking_error
from tpbso_casadi import read_scenario
from tpbso_casadi.cli.commands.tracking import toml_line
from tpbso_casadi.planning import PlannedMotion, plan
from tpbso_casadi.scenario import TrackingLog

STEP = 1e-3  # s, of the simulation
EVERY = 4  # steps from one look at distances to the next
DOF = 7
MARGIN = 1.2


@dataclass(frozen=True, eq=False)
class Controllers:
    """Of all joints of some robots, each (robots, joints).

    Attributes:
        delay: steps by which commands are late.
        frequency: natural, rad/s.
        damping: ratio.
        speed_share: of the commanded speed that is fed forward.
        acceleration_share: likewise.
        viscous: 1/s.
        coulomb: rad/s^2.
        unknown: rad/s^2.
    """

    delay: np.ndarray[tuple[int, ...], np.dtype[np.int_]]
    frequency: FloatArray
    damping: FloatArray
    speed_share: FloatArray
    acceleration_share: FloatArray
    viscous: FloatArray
    coulomb: FloatArray
    unknown: FloatArray

    @classmethod
    def drawn(cls, robots: int, rng: np.random.Generator) -> Controllers:
        """So many robots."""
        ranges = ((60.0, 150.0), (0.7, 1.2), (0.9, 1.0), (0.0, 1.0), (0.0, 2.0), (0.0, 2.0), (-1.0, 1.0))
        delay = rng.integers(0, 5, (robots, DOF))
        return cls(delay, *(rng.uniform(low, high, (robots, DOF)) for low, high in ranges))

    def followed(self, trajectory: Trajectory) -> tuple[FloatArray, FloatArray]:
        """Times (n,), s, and where the joints then are, (n, robots, joints), rad."""
        times = np.arange(0.0, trajectory.duration, STEP)
        commanded = [trajectory.at(times, order) for order in range(3)]
        joint = np.arange(DOF)
        place, speed = np.tile(commanded[0][0], (len(self.delay), 1)), np.zeros(self.delay.shape)
        found = np.empty((times.size, *self.delay.shape))
        stiffness, damper = self.frequency**2, 2.0 * self.damping * self.frequency
        for number in range(times.size):
            found[number] = place
            late = np.maximum(number - self.delay, 0)
            q, v, a = (part[late, joint] for part in commanded)
            force = stiffness * (q - place) + damper * (self.speed_share * v - speed) + self.acceleration_share * a
            friction = self.viscous * speed + self.coulomb * np.tanh(speed / 0.01)
            speed = speed + STEP * (force - friction + self.unknown)
            place = place + STEP * speed
        return times, found


def planned(scene: Scene, seed: int, tracking: TrackingError | None) -> PlannedMotion:
    """The plan of a scene."""
    text = scene.scenario(6000, seed, "direct")
    if tracking is not None:
        text = text.replace('model = "panda"\n', f'model = "panda"\n{toml_line(tracking)}\n', 1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(text)
        return plan(read_scenario(path))


def rooms(scene: Scene, times: FloatArray, theta: FloatArray) -> FloatArray:
    """The least room of each robot, (robots,), m, at times (n,) in postures (n, robots, joints)."""
    looked, postures = times[::EVERY], theta[::EVERY]
    each = [scene.arm.room(postures[:, robot], looked, scene.things).min() for robot in range(theta.shape[1])]
    return np.array(each)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=12, help="random scenes of a Panda")
    parser.add_argument("--robots", type=int, default=143, help="of seven simulated joints each")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    robots = Controllers.drawn(options.robots, np.random.default_rng(options.seed))
    scenes = list(random_scenes(3, options.scenes, options.seed, straight=1.0))
    plain = [planned(scene, options.seed, None) for scene in scenes]
    logs = []
    for found in plain[::2]:
        times, theta = robots.followed(found.trajectory)
        commanded = found.trajectory.at(times)
        logs += [TrackingLog.of(times, commanded, theta[:, robot]) for robot in range(0, options.robots, 2)]
    log = TrackingLog.joined(logs)
    bound = least_tracking_error(log.errors, log.speed, log.acceleration, margin=MARGIN)
    print(f"{len(logs)} logs, {len(log.errors)} rows, largest error {1e3 * np.abs(log.errors).max():.2f} mrad")
    print(toml_line(bound))
    print("| plans | certified | motions | with contact | errors beyond the bound | least room, mm | T, median, s |")
    print("|---|---|---|---|---|---|---|")
    for name, plans in (("exact", plain), ("with the bound", [planned(s, options.seed, bound) for s in scenes])):
        certified = [(scene, found) for scene, found in zip(scenes, plans, strict=True) if found.feasible]
        least, beyond = [], 0
        for scene, found in certified:
            times, theta = robots.followed(found.trajectory)
            least.append(rooms(scene, times, theta))
            allowed = bound.at(found.trajectory.at(times, 1), found.trajectory.at(times, 2))
            errors = np.abs(theta - found.trajectory.at(times)[:, None])
            beyond += int((errors > allowed[:, None]).any(axis=(0, 2)).sum())
        found_rooms = np.concatenate(least)
        duration = float(np.median([found.trajectory.duration for _, found in certified]))
        cells = (
            name, f"{len(certified)} of {len(plans)}", found_rooms.size, int((found_rooms < 0.0).sum()), beyond,
            f"{1e3 * found_rooms.min():.1f}", f"{duration:.3f}",
        )  # fmt: skip
        print(f"| {' | '.join(map(str, cells))} |", flush=True)


if __name__ == "__main__":
    main()

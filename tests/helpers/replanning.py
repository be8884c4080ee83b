"""A planar arm among ellipses that move, and a simulation of both."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from problems import Ellipse
from problems.base import FloatArray
from problems.scene.moving import ConstantVelocity, MovingObstacle
from tpbso_casadi.replanning import Replanner, Step
from tpbso_casadi.replanning.candidates import remaining
from tpbso_casadi.scenario import Scenario, parse_scenario

LENGTHS = [0.7, 0.7, 0.6]
START, GOAL = [-0.8, 0.3, 0.3], [1.4, 0.5, 0.2]
AXES = (0.12, 0.2)
EVERY = 0.1
FINE = 20  # steps of the simulation in each of the planner's


def scenario(start: list[float] = START, goal: list[float] = GOAL) -> Scenario:
    """Three links, joints given, nothing in the way."""
    return parse_scenario(
        {
            "arm": {"link_lengths": LENGTHS, "max_speed": 3.0, "max_acceleration": 15.0},
            "task": {"kind": "point-to-point", "start": {"joints": start}, "goal": {"joints": goal}},
        }
    )


def crossing(place: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0)) -> MovingObstacle:
    """An ellipse that is at a place, m, and has a velocity, m/s."""
    return MovingObstacle(Ellipse((0.0, 0.0), AXES), ConstantVelocity(velocity, place))


def touches(theta: FloatArray, place: FloatArray) -> bool:
    """Whether a posture (3,), rad, has a point in the ellipse at a place: by points along the links."""
    turns = np.cumsum(theta)
    joints = np.cumsum(np.stack([np.cos(turns), np.sin(turns)], axis=1) * np.array(LENGTHS)[:, None], axis=0)
    joints = np.vstack([np.zeros(2), joints])
    shares = np.linspace(0.0, 1.0, 200)[:, None]
    points = np.vstack([(1.0 - shares) * first + shares * last for first, last in pairwise(joints)])
    return bool((((points - place) / np.array(AXES)) ** 2).sum(axis=1).min() < 1.0)


@dataclass
class Erratic:
    """An ellipse that changes its course at random, by no more than twice ``deviation`` m/s at once.

    Attributes:
        rng: decides when and how.
        deviation: from a velocity that does not change, m/s.
    """

    rng: np.random.Generator
    deviation: float
    place: FloatArray = field(init=False)
    mean: FloatArray = field(init=False)
    velocity: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self.place = np.array([self.rng.uniform(1.2, 2.2), self.rng.uniform(0.3, 1.6)])
        self.mean = self.rng.uniform(-0.6, 0.6, 2)
        self.turn()

    def turn(self) -> None:
        """Take another course."""
        angle = self.rng.uniform(0.0, 2.0 * np.pi)
        self.velocity = self.mean + self.deviation * np.array([np.cos(angle), np.sin(angle)])

    def move(self, seconds: float) -> None:
        """Go on, maybe on another course."""
        if self.rng.random() < 0.3:
            self.turn()
        self.place = self.place + seconds * self.velocity

    @property
    def seen(self) -> list[MovingObstacle]:
        """What the planner is told: where it is, and that it goes straight on."""
        return [crossing((float(self.place[0]), float(self.place[1])), tuple(self.velocity.tolist()))]


@dataclass
class Simulation:
    """Planner and obstacle, step after step.

    Attributes:
        steps: of the planner.
        touched: times at which the arm moved and was touched, s.
        moved: times at which it moved, s.
    """

    steps: list[Step] = field(default_factory=list)
    touched: list[float] = field(default_factory=list)
    moved: list[float] = field(default_factory=list)

    def run(self, replanner: Replanner, obstacle: Erratic, count: int) -> Simulation:
        """So many steps."""
        step = replanner.first(obstacles=obstacle.seen)
        for number in range(count):
            self.steps.append(step)
            for fine in range(1, FINE + 1):
                obstacle.move(EVERY / FINE)
                self._look(step, obstacle.place, fine * EVERY / FINE, number * EVERY)
            step = replanner.replan(remaining(step.trajectory, EVERY, EVERY), obstacle.seen)
        return self

    def _look(self, step: Step, place: FloatArray, time: float, began: float) -> None:
        at = np.array([min(time, step.trajectory.duration)])
        if np.abs(step.trajectory.at(at, 1)).max() > 1e-6:
            self.moved.append(began + time)
            if touches(step.trajectory.at(at)[0], place):
                self.touched.append(began + time)

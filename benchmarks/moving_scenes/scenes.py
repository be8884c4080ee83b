"""Random scenes that are hard and fair by construction.

Hard: on the straight line in joint space, run as fast as speed and acceleration allow, the arm meets an obstacle that
moves. Fair: the start is clear from t = 0 on while the arm may have to wait, and after waiting at most ``MOST_WAIT`` s
the same straight line is clear all the way to the goal, which stays clear for ``ARRIVED`` s: a solution is known.
What stands still is near the line but does not touch it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.moving_scenes.arms import Arm, Thing, arm_of
from benchmarks.moving_scenes.courses import STRAIGHT, random_course
from benchmarks.moving_scenes.shapes import random_planar, random_solid
from problems.base import FloatArray

CLEAR = 0.02  # m: what the known solution keeps
NEARBY = 0.3  # m: no farther from the line is what stands still
MOST_WAIT, ARRIVED = 3.0, 1.0  # s
WAITS = np.arange(0.25, MOST_WAIT + 0.01, 0.25)
LEAST_WAY, MOST_WAY = 0.8, 2.4  # rad: of the joint that moves most
TIMES = 120  # at which a straight line is looked at
SPEEDS = {2: (0.3, 1.5), 3: (0.2, 0.8)}  # of obstacles, m/s
STANDING, MOVING = (0, 2), (1, 3)  # how many, besides the table in space
TRIES = 60  # of one obstacle
TABLE = """[[obstacles]]
shape = "box"
center = [0.55, 0.0, -0.06]
size = [0.9, 1.2, 0.02]
"""  # below what the arm reaches for, so that it is no part of what makes scenes hard


@dataclass(frozen=True)
class Scene:
    """A random scene.

    Attributes:
        name: in tables.
        dim: 2 or 3.
        start: joint angles, (k,), rad.
        goal: likewise.
        things: obstacles.
    """

    name: str
    dim: int
    start: FloatArray
    goal: FloatArray
    things: tuple[Thing, ...]

    @property
    def arm(self) -> Arm:
        """The arm."""
        return arm_of(self.dim)

    def stopped(self) -> Scene:
        """The same, all obstacles standing where they are at t = 0."""
        return replace(self, things=tuple(Thing(thing.shape, thing.course.stopped()) for thing in self.things))

    def scenario(self, evaluations: int, seed: int, solver: str | None = None) -> str:
        """The scenario file."""
        ends = f"start = {{ joints = {self.start.tolist()} }}\ngoal = {{ joints = {self.goal.tolist()} }}\n"
        named = "" if solver is None else f'name = "{solver}"\n'
        stated = f"[solver]\n{named}evaluations = {evaluations}\nseed = {seed}\n"
        table = TABLE if self.dim == 3 else ""
        things = "".join(thing.toml for thing in self.things)
        return f'{self.arm.toml}[task]\nkind = "point-to-point"\n{ends}{stated}{table}{things}'

    def line(self, waited: float) -> tuple[FloatArray, FloatArray]:
        """Times (n,) and postures (n, k) of the straight line after waiting, from t = 0 to a while after arrival."""
        duration = line_time(self.arm, self.start, self.goal)
        times = np.linspace(0.0, waited + duration + ARRIVED, TIMES)
        s = np.clip((times - waited) / duration, 0.0, 1.0)[:, None]
        return times, self.start + s**3 * (10.0 - 15.0 * s + 6.0 * s**2) * (self.goal - self.start)

    def room(self, waited: float, things: tuple[Thing, ...]) -> float:
        """The least room on that line, m."""
        times, theta = self.line(waited)
        return float(self.arm.room(theta, times, things).min())


def line_time(arm: Arm, start: FloatArray, goal: FloatArray) -> float:
    """How long a quintic in time takes from rest to rest, s."""
    way = np.abs(goal - start)
    return float(max((1.875 * way / arm.speed).max(), np.sqrt((5.7735 * way / arm.acceleration).max())))


def random_scenes(dim: int, count: int, seed: int, straight: float = STRAIGHT) -> Iterator[Scene]:
    """So many scenes, the same for the same seed; a share of what moves does so at a constant velocity."""
    for number in range(count):
        rng = np.random.default_rng([seed, dim, number])
        scene = None
        while scene is None:
            scene = _tried(rng, dim, f"{'plane' if dim == 2 else 'space'} {number + 1}", straight)
        yield scene


def _tried(rng: np.random.Generator, dim: int, name: str, straight: float) -> Scene | None:
    arm = arm_of(dim)
    start = rng.uniform(arm.lower, arm.upper)
    way = rng.uniform(-1.0, 1.0, len(start))
    goal = start + rng.uniform(LEAST_WAY, MOST_WAY) * way / np.abs(way).max()
    if (goal < arm.lower).any() or (goal > arm.upper).any():
        return None
    if not arm.fits(start + np.linspace(0.0, 1.0, 40)[:, None] * (goal - start)):
        return None
    scene: Scene | None = Scene(name, dim, start, goal, ())
    for moves, (least, most) in ((False, STANDING), (True, MOVING)):
        for _ in range(int(rng.integers(least, most + 1))):
            scene = _with_another(rng, scene, moves, straight) if scene is not None else None
    if scene is None or _known_wait(scene) is None:
        return None
    return scene


def _with_another(rng: np.random.Generator, scene: Scene, moves: bool, straight: float) -> Scene | None:
    """The scene with one more obstacle, clear at the start at t = 0; None where none is found."""
    for _ in range(TRIES):
        thing = _random_thing(rng, scene, moves, straight)
        at_start = scene.arm.room(scene.start[None], np.zeros(1), (thing,))[0]
        if at_start < 2.0 * CLEAR:
            continue
        room = scene.room(0.0, (thing,))
        if (room < 0.0) if moves else (CLEAR < room < NEARBY):
            return replace(scene, things=(*scene.things, thing))
    return None


def _random_thing(rng: np.random.Generator, scene: Scene, moves: bool, straight: float) -> Thing:
    """Through, or near, a point of the outer half of the arm on its straight line."""
    shape = random_planar(rng) if scene.dim == 2 else random_solid(rng)
    duration = line_time(scene.arm, scene.start, scene.goal)
    time = float(rng.uniform(0.2, 0.9) * duration)
    times, theta = scene.line(0.0)
    points = scene.arm.points(theta[[int(np.searchsorted(times, time))]])[0]
    point = points[int(rng.integers(len(points) // 2, len(points)))]
    if moves:
        speed = float(rng.uniform(*SPEEDS[scene.dim]))
        return Thing(shape, random_course(rng, point, time, speed, straight))
    beside = point + rng.normal(size=scene.dim) * 0.3
    course = random_course(rng, beside, 0.0, 1.0, straight)
    return Thing(shape, course.stopped())


def _known_wait(scene: Scene) -> float | None:
    """For how long waiting at the start makes the straight line a solution, s."""
    return next((float(wait) for wait in WAITS if scene.room(float(wait), scene.things) >= CLEAR), None)

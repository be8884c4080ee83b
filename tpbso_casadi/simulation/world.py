"""The simulated world: actors, their courses, what is known of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from problems import ConstantVelocity, MovingObstacle, Obstacle, Tabulated
from problems.base import FloatArray
from problems.scene import LEAST_STEP
from tpbso_casadi.scenario import ObstacleSection, ScenarioError, SimulationSection


@dataclass(frozen=True, kw_only=True)
class Wandering:
    """Straight lines between changes of course, at times that have nothing to do with those of the planner.

    Every velocity lies in a ball, so that no two of them differ by more than its diameter.

    Attributes:
        velocity: at t = 0, (dim,), m/s, in the ball.
        center: of the ball, (dim,), m/s; zero where there are walls.
        radius: of the ball, m/s.
        changes_every: mean time between two changes, which are independent of each other, s; infinite for none.
        room: the least and the largest displacement in every coordinate, (2, dim), m; infinite without walls.
    """

    velocity: FloatArray
    center: FloatArray
    radius: float
    changes_every: float
    room: FloatArray

    def course(self, seconds: float, generator: np.random.Generator) -> Tabulated:
        """The displacement from 0 to ``seconds``, exact."""
        time, place, velocity = 0.0, np.zeros_like(self.velocity), self.velocity
        times, places = [time], [place]
        change = self._wait(generator)
        while time < seconds:
            wall, axis = self._next_wall(place, velocity)
            after = min(time + wall, change, seconds)
            place = np.clip(place + (after - time) * velocity, *self.room)
            if after == change:
                velocity, change = self._drawn(generator), change + self._wait(generator)
            elif after < seconds:
                velocity = np.where(np.arange(velocity.size) == axis, -velocity, velocity)
            time = after
            if after == seconds and len(times) > 1 and after - times[-1] < LEAST_STEP:
                times.pop()
                places.pop()
            if after - times[-1] >= LEAST_STEP:  # else two changes are one
                times.append(after)
                places.append(place)
        return Tabulated.along_lines(times, np.array(places))

    def _wait(self, generator: np.random.Generator) -> float:
        return float(generator.exponential(self.changes_every)) if np.isfinite(self.changes_every) else np.inf

    def _drawn(self, generator: np.random.Generator) -> FloatArray:
        """Any velocity of the ball, all alike."""
        direction = generator.normal(size=self.center.size)
        size = self.radius * generator.random() ** (1.0 / self.center.size)
        return np.asarray(self.center + size * direction / np.linalg.norm(direction))

    def _next_wall(self, place: FloatArray, velocity: FloatArray) -> tuple[float, int]:
        """Time until a wall is met, s, and its axis."""
        ahead = np.where(velocity > 0.0, self.room[1], self.room[0]) - place
        with np.errstate(divide="ignore", invalid="ignore"):
            waits = np.where(velocity == 0.0, np.inf, ahead / velocity)
        axis = int(np.argmin(waits))
        return max(float(waits[axis]), 0.0), axis


MOST_TURNS = 10_000  # of an obstacle: changes of course on average, and meetings with walls


class Actor(ABC):
    """An obstacle in the scene."""

    @property
    @abstractmethod
    def true(self) -> Obstacle:
        """The obstacle with its true motion, on the simulation's clock."""

    @abstractmethod
    def observed(self, time: float) -> Obstacle:
        """The obstacle as the planner sees and predicts it at a time in s, on a clock that starts then."""


@dataclass(frozen=True)
class KnownActor(Actor):
    """An obstacle of which all is known: it stands still, or keeps to its table or to its velocity."""

    obstacle: Obstacle

    @property
    def true(self) -> Obstacle:
        return self.obstacle

    def observed(self, time: float) -> Obstacle:
        return self.obstacle.later(time)


@dataclass(frozen=True)
class Wanderer(Actor):
    """An obstacle that changes course: the planner sees where it is and how fast, and predicts that it goes on so.

    Args:
        still: the obstacle at t = 0.
        course: its true displacement.
        margin_rate: what a prediction of it loses in a second, as the scenario says, m/s.
    """

    still: Obstacle
    course: Tabulated
    margin_rate: float

    @property
    def true(self) -> Obstacle:
        return MovingObstacle(self.still, self.course)

    def observed(self, time: float) -> Obstacle:
        piece = min(int(np.searchsorted(self.course.breaks, time, side="right")), len(self.course.breaks) - 1) - 1
        velocity = tuple(rows[piece][-2] for rows in self.course.pieces)
        origin = tuple(self.course.placed(np.zeros((1, self.still.dim)), time)[0].tolist())
        return MovingObstacle(self.still, ConstantVelocity(velocity, origin), self.margin_rate)


@dataclass(frozen=True)
class SimulatedWorld:
    """All obstacles of a simulation."""

    actors: tuple[Actor, ...]

    @classmethod
    def of(
        cls,
        tables: Sequence[ObstacleSection],
        settings: SimulationSection,
        seed: int,
    ) -> Self:
        """The scene from its first moment to its last; the same for the same seed, whatever the planner does.

        Args:
            tables: that state the obstacles, with their motions.
            settings: how long, and how they change course.
            seed: of the changes.

        Raises:
            ScenarioError: an obstacle is too fast for the changes of course that are allowed, or does not fit into the
                region.
        """
        actors: list[Actor] = []
        for number, table in enumerate(tables):
            obstacles = table.built(number + 1)
            changes = settings.changes_every is not None or settings.region is not None
            if table.velocity is None or not changes:
                actors += map(KnownActor, obstacles)
                continue
            still = [obstacle.unmoved for obstacle in obstacles]
            wandering = _wandering(f"obstacles.{number}", still, table.velocity, settings)
            course = wandering.course(settings.seconds, np.random.default_rng([seed, number]))
            actors += (Wanderer(part, course, table.margin_rate) for part in still)
        return cls(tuple(actors))

    @property
    def true(self) -> tuple[Obstacle, ...]:
        """The obstacles with their true motions."""
        return tuple(actor.true for actor in self.actors)

    def observed(self, time: float) -> tuple[Obstacle, ...]:
        """The scene that the planner sees at a time in s."""
        return tuple(actor.observed(time) for actor in self.actors)


def _wandering(key: str, still: Sequence[Obstacle], stated: Sequence[float], settings: SimulationSection) -> Wandering:
    """How an obstacle of some parts changes course that has a velocity."""
    velocity, radius = np.array(stated), settings.course_rate / 2.0
    has_walls = settings.region is not None
    if has_walls and np.linalg.norm(velocity) > radius:
        raise ScenarioError(
            f"{key}.velocity: {np.linalg.norm(velocity):g} m/s; turning around takes twice that, more than "
            f"simulation.course_rate allows, {settings.course_rate:g} m/s"
        )
    room = _room(key, still, settings.region) if settings.region is not None else _EVERYWHERE * np.ones(len(stated))
    if settings.changes_every is not None and settings.seconds / settings.changes_every > MOST_TURNS:
        raise ScenarioError(f"simulation.changes_every: more than {MOST_TURNS} changes of course are not simulated")
    if (radius * settings.seconds > MOST_TURNS * np.ptp(room, axis=0)).any():
        raise ScenarioError(f"{key}: fits the simulation.region so closely that it turns around all the time")
    return Wandering(
        velocity=velocity,
        center=np.zeros(len(stated)) if has_walls else velocity,
        radius=radius,
        changes_every=np.inf if settings.changes_every is None else settings.changes_every,
        room=room,
    )


_EVERYWHERE = np.array([[-np.inf], [np.inf]])


def _room(key: str, still: Sequence[Obstacle], region: Sequence[Sequence[float]]) -> FloatArray:
    """How far an obstacle can be displaced within a region, (2, dim), m."""
    if len(region[0]) != still[0].dim:
        raise ScenarioError(f"simulation.region: {len(region[0])} coordinates where obstacles have {still[0].dim}")
    boxes = np.array([part.bounding_box() for part in still])
    room = np.array(region) - np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    if (room[0] > 0.0).any() or (room[1] < 0.0).any():
        raise ScenarioError(f"{key}: is not within the simulation.region")
    return np.asarray(room)

"""``tp.reach``: a map of what an arm reaches."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from problems.evaluation import processors
from tpbso_casadi.facade.arguments import in_words_of_python, several, whole
from tpbso_casadi.facade.robots import AnyRobot
from tpbso_casadi.facade.surroundings import changed, in_scene, surroundings
from tpbso_casadi.reaching import STARTS, ArmAmong, Reach, evenly_turned, grid_around, reach_of
from tpbso_casadi.scenario import Scenario

SPACING, ORIENTATIONS = 0.1, 32  # of the usual grid, m, and ways to turn the tool


def reach(
    robot: AnyRobot,
    points: ArrayLike | None = None,
    rotations: ArrayLike | None = None,
    obstacles: Sequence[Any] = (),
    *,
    tip: str | None = None,
    starts: int = STARTS,
    workers: int | None = None,
) -> Reach:
    """A map of what an arm reaches: each point with the tool turned in each of several ways.

    Args:
        robot: as of :func:`robot`, or a TOML file that states one and what is around it.
        points: (n, 3), m; by default a grid of 0.1 m through the base, as far as the arm reaches.
        rotations: of the tool, (r, 3, 3); by default 32 that are spread evenly.
        obstacles: objects or tables, in place of those of the robot's file; they stand still.
        tip: whose tool, of a cell or of a robot of several tips.
        starts: of Newton steps for each pose: 16 find that an arm of six joints reaches whatever 1,024 find.
        workers: threads, which change the time and not the map; one for each processor by default.

    Raises:
        ScenarioError: naming what is wrong.
    """
    with in_words_of_python():
        threads = processors() if workers is None else whole("workers", workers)
        known = surroundings(robot, None)
        listed = several("obstacles", obstacles, "obstacles")
        among = _among(changed(known, tables={"obstacles": listed}) if listed else known, tip)
        places = grid_around(among.arm, SPACING) if points is None else points
        turned = evenly_turned(ORIENTATIONS) if rotations is None else rotations
        return reach_of(among, places, turned, starts, threads)


def mapped(robot: AnyRobot, spacing: float, orientations: int, *, tip: str | None, starts: int) -> Reach:
    """The map of a grid of points with a spacing, m, in so many orientations; otherwise as :func:`reach`.

    Raises:
        InvalidProblem: a number is wrong, or there is no such tip.
        ScenarioError: the robot cannot be.
    """
    among = arm_among(robot, None, tip)
    places, turned = grid_around(among.arm, spacing), evenly_turned(orientations)
    return reach_of(among, places, turned, starts, processors())


def arm_among(robot: AnyRobot, scene: Path | None, tip: str | None) -> ArmAmong:
    """An arm among what is around it.

    Args:
        robot: as of :func:`reach`.
        scene: file of obstacles in place of those of the robot's file.
        tip: as of :func:`reach`.

    Raises:
        InvalidProblem: the robot is in the plane, has no such tip, or an obstacle moves.
        ScenarioError: the robot cannot be, or a file.
    """
    return _among(surroundings(robot, None) if scene is None else in_scene(scene, None, robot), tip)


def _among(known: Scenario, tip: str | None) -> ArmAmong:
    built = known.built()
    return ArmAmong.of(built.robot, built.obstacles, tip)

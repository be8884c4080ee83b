"""RRT-Connect, shortcuts and TOPP-RA of roboplan, as its examples chain them, in a scene of its own."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import numpy as np
from roboplan.core import (
    Box,
    Cylinder,
    JointConfiguration,
    JointPath,
    JointTrajectory,
    PathShortcutter,
    PathShortcuttingOptions,
    Scene,
    loadJointLimitsConfig,
    loadUrdfSceneDescriptionFromXml,
)
from roboplan.rrt import RRT, RRTOptions
from roboplan.toppra import PathParameterizerTOPPRA, SplineFittingMode, TOPPRAOptions
from scipy.interpolate import CubicHermiteSpline

from benchmarks.motion_bench_maker.collision import Checker
from benchmarks.motion_bench_maker.problem_file import MotionProblem, Obstacle
from benchmarks.motion_bench_maker.setting import Setting
from benchmarks.peers.space.urdf import links_of_bodies, locked
from problems import Trajectory
from problems.base import FloatArray

GROUP, WORLD = "planned", "universe"  # the group of joints; Pinocchio's name of the world's frame
GREY = np.array([0.5, 0.5, 0.5, 1.0])


@dataclass(frozen=True)
class RoboplanOptions:
    """How a search and the timing of its path are set.

    Attributes:
        search: of the search, besides those that every search here has.
        shortcuts: of shortening its path.
        timings: of timing it, by their names; the quickest motion is taken.
    """

    search: Mapping[str, Any]
    shortcuts: Mapping[str, Any]
    timings: Mapping[str, TOPPRAOptions]


DEFAULTS = RoboplanOptions({}, {}, {"default": TOPPRAOptions()})
STEP = 0.01  # rad along an edge between postures that are checked: as OMPL's here; by default 0.05
SAMPLED = {"dt": 0.001, "max_adaptive_step_size": STEP}  # s between the samples of a motion; by default 0.01
CAREFUL = RoboplanOptions(
    # a tree is extended by as much as OMPL's here, by default by 3.0, with which motions are longer; time ends searches
    {"max_nodes": 1_000_000, "max_connection_distance": 0.5, "collision_check_step_size": STEP},
    {"max_step_size": STEP},
    {"adaptive": TOPPRAOptions(mode=SplineFittingMode.Adaptive, **SAMPLED)}
    | {
        f"blends of {deviation:g} rad": TOPPRAOptions(
            mode=SplineFittingMode.LinearBlend, max_blend_deviation=deviation, **SAMPLED
        )
        for deviation in (0.1, 0.03, 0.01)  # rad, by which a blend may leave a corner; by default 0.01
    },
)


@dataclass(frozen=True)
class Sampled:
    """A motion as roboplan returns it.

    Attributes:
        times: (n,), s.
        angles: (n, k), rad.
        speeds: (n, k), rad/s.
        accelerations: (n, k), rad/s^2.
        mode: of fitting a spline to the path.
    """

    times: FloatArray
    angles: FloatArray
    speeds: FloatArray
    accelerations: FloatArray
    mode: str

    @property
    def trajectory(self) -> Trajectory:
        """The cubic spline with these angles and speeds."""
        spline = CubicHermiteSpline(self.times, self.angles, self.speeds)
        return Trajectory(spline.x, spline.c)


@dataclass(frozen=True)
class Found:
    """The motion, None where there is none, and then why; waypoints (n, k), rad; CPU seconds."""

    motion: Sampled | None
    waypoints: FloatArray
    seconds: float
    error: str = ""


def find_motion(
    setting: Setting,
    problem: MotionProblem,
    checker: Checker,
    margin: float,
    seed: int,
    seconds: float,
    options: RoboplanOptions = CAREFUL,
) -> Found:
    """Find a path, shorten it, and time it.

    Args:
        setting: robot and limits; of jerk roboplan's TOPP-RA knows nothing.
        problem: start, goal and obstacles.
        checker: says which of the robot's own pairs have to keep apart.
        margin: by which the robot's spheres are enlarged, m.
        seed: of the search and of the shortcuts.
        seconds: for the search, by the clock on the wall, which is the one that roboplan looks at.
        options: of search and timing.
    """
    scene = scene_of(setting, problem, checker, margin)
    began = time.process_time()
    try:
        path = _path(scene, setting.kinematics.names, problem, seed, seconds, options)
        motion = _timed(scene, path, options)
    except RuntimeError as error:
        return Found(None, np.empty((0, len(problem.start))), time.process_time() - began, f"roboplan: {error}")
    return Found(motion, np.array(path.positions), time.process_time() - began)


def _path(
    scene: Scene,
    names: tuple[str, ...],
    problem: MotionProblem,
    seed: int,
    seconds: float,
    options: RoboplanOptions,
) -> JointPath:
    given = {"group_name": GROUP, "max_planning_time": seconds, "rrt_connect": True}
    search = RRT(scene, RRTOptions(**given, **options.search))
    search.setRngSeed(seed)
    start, goal = (JointConfiguration(list(names), np.array(end)) for end in (problem.start, problem.goal))
    path = search.plan(start, goal)
    shortcuts = PathShortcuttingOptions(group_name=GROUP, seed=seed, **options.shortcuts)
    return PathShortcutter(scene, shortcuts).shortcut(path)


def _timed(scene: Scene, path: JointPath, options: RoboplanOptions) -> Sampled:
    parameterizer = PathParameterizerTOPPRA(scene, GROUP)
    found = [(parameterizer.generate(path, option), mode) for mode, option in options.timings.items()]
    return _sampled(*min(found, key=lambda one: one[0].times[-1]))


def _sampled(motion: JointTrajectory, mode: str) -> Sampled:
    times = np.array(motion.times)
    kept = np.append(True, np.diff(times) > 0.0)  # the end is there twice where it falls on a sample
    parts = (np.array(part)[kept] for part in (motion.positions, motion.velocities, motion.accelerations))
    return Sampled(times[kept], *parts, mode)


def scene_of(setting: Setting, problem: MotionProblem, checker: Checker, margin: float) -> Scene:
    """The robot's spheres and the obstacles; of the robot's own pairs only those that the checker has.

    Each sphere is a link of its own, as roboplan disables pairs of links, and nothing smaller.
    """
    description = loadUrdfSceneDescriptionFromXml(_of_spheres(setting, margin))
    scene = Scene(problem.name, description)
    scene.addGroup(GROUP, list(setting.kinematics.names))
    _limit_accelerations(scene, setting)
    count = len(setting.spheres.radii)
    pairs = {(one, two) for two in range(count) for one in range(two)} - set(map(tuple, checker.own.tolist()))
    of_one_body = setting.spheres.bodies[:, None] == setting.spheres.bodies  # Pinocchio has no such pairs
    unchecked = [(_sphere(one), _sphere(two)) for one, two in sorted(pairs) if not of_one_body[one, two]]
    scene.setCollisions(unchecked, False)
    for number, obstacle in enumerate(problem.obstacles):
        _add(scene, obstacle, f"obstacle{number}")
    among = [(f"obstacle{one}", f"obstacle{two}") for two in range(len(problem.obstacles)) for one in range(two)]
    scene.setCollisions(among, False)
    return scene


def _of_spheres(setting: Setting, margin: float) -> str:
    """The URDF with a link for each sphere as its only collision geometry."""
    root, links, spheres = locked(setting), links_of_bodies(setting.kinematics), setting.spheres
    for link in root.iter("link"):
        for element in [*link.findall("collision"), *link.findall("visual")]:
            link.remove(element)
    for number, (body, center, radius) in enumerate(
        zip(spheres.bodies, spheres.centers.tolist(), spheres.radii.tolist(), strict=True)
    ):
        link = ElementTree.SubElement(root, "link", name=_sphere(number))
        geometry = ElementTree.SubElement(ElementTree.SubElement(link, "collision"), "geometry")
        ElementTree.SubElement(geometry, "sphere", radius=repr(radius + margin))
        joint = ElementTree.SubElement(root, "joint", name=f"hold{number}", type="fixed")
        ElementTree.SubElement(joint, "parent", link=links[int(body)])
        ElementTree.SubElement(joint, "child", link=_sphere(number))
        ElementTree.SubElement(joint, "origin", xyz=" ".join(map(repr, center)))
    return ElementTree.tostring(root, encoding="unicode")


def _sphere(number: int) -> str:
    return f"sphere{number}"


def _limit_accelerations(scene: Scene, setting: Setting) -> None:
    """A URDF has none; roboplan reads them from a file of its own."""
    limits = zip(setting.kinematics.names, setting.limits.acceleration, strict=True)
    lines = ["joint_limits:", *(f"  {name}: {{max_acceleration: [{value!r}]}}" for name, value in limits)]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "limits.yaml"
        file.write_text("\n".join(lines) + "\n")
        scene.importJointLimitsFromConfig(loadJointLimitsConfig(file))


def _add(scene: Scene, obstacle: Obstacle, name: str) -> None:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = obstacle.rotation, obstacle.position
    pose = np.asfortranarray(pose)
    if obstacle.shape == "box":
        scene.addBoxGeometry(name, WORLD, Box(*obstacle.size), pose, GREY)
    else:
        scene.addCylinderGeometry(name, WORLD, Cylinder(obstacle.size[0] / 2.0, obstacle.size[2]), pose, GREY)

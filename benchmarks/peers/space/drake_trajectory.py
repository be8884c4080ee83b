"""Drake's KinematicTrajectoryOptimization, as its examples use it: first without obstacles, from there with them."""

from __future__ import annotations

import time
from dataclasses import dataclass
from math import factorial
from xml.etree import ElementTree

import numpy as np
from pydrake.geometry import Box, CollisionFilterDeclaration, Cylinder, GeometrySet, Sphere
from pydrake.math import BsplineBasis, RigidTransform, RotationMatrix
from pydrake.multibody.inverse_kinematics import MinimumDistanceLowerBoundConstraint
from pydrake.multibody.optimization import CalcGridPointsOptions, Toppra
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from pydrake.planning import KinematicTrajectoryOptimization
from pydrake.solvers import MathematicalProgramResult, SnoptSolver, SolverOptions
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.trajectories import BsplineTrajectory, PathParameterizedTrajectory
from scipy.interpolate import BSpline

from benchmarks.motion_bench_maker.collision import Checker
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.setting import Setting
from benchmarks.peers.space.urdf import links_of_bodies, locked
from problems import Trajectory
from problems.base import FloatArray

CONTROL_POINTS, ORDER = 10, 6  # of the B-spline; degree 5
COLLISION_SAMPLES = 25  # as its examples
DISTANCE, INFLUENCE = 0.001, 0.05  # m, at the samples; from where on an obstacle matters
SHORTEST, LONGEST = 0.2, 20.0  # s
FRICTION = CoulombFriction(0.9, 0.9)


@dataclass(frozen=True)
class Optimized:
    """A B-spline over time, s, with control points (n, k), rad; whether its solver calls it a solution."""

    knots: FloatArray
    control_points: FloatArray
    success: bool
    status: str
    seconds: float

    @property
    def trajectory(self) -> Trajectory:
        """As polynomials."""
        spline, breakpoints = BSpline(self.knots, self.control_points, ORDER - 1), np.unique(self.knots)
        powers = range(ORDER - 1, -1, -1)
        coefficients = np.stack([spline(breakpoints[:-1], power) / factorial(power) for power in powers])
        return Trajectory(breakpoints - breakpoints[0], coefficients)


def optimize(setting: Setting, problem: MotionProblem, checker: Checker, seconds: float) -> Optimized:
    """Least time between the ends of a problem, within the limits, clear of obstacles at samples."""
    diagram, plant = _scene(setting, problem, checker)
    context = diagram.CreateDefaultContext()
    began = time.process_time()
    program = KinematicTrajectoryOptimization(plant.num_positions(), CONTROL_POINTS, ORDER)
    _add_limits(program, setting, problem)
    program.SetInitialGuess(_straight(program, problem, setting.bound(problem)))
    free = _solve(program, seconds / 3.0)
    program.SetInitialGuess(program.ReconstructTrajectory(free))
    away = MinimumDistanceLowerBoundConstraint(
        plant, DISTANCE, plant.GetMyContextFromRoot(context), influence_distance_offset=INFLUENCE
    )
    for s in np.linspace(0.0, 1.0, COLLISION_SAMPLES):
        program.AddPathPositionConstraint(away, s)
    solution = _solve(program, seconds - (time.process_time() - began))
    motion = program.ReconstructTrajectory(solution)
    points = np.array(motion.control_points()).reshape(CONTROL_POINTS, -1)
    return Optimized(
        np.array(motion.basis().knots()),
        points,
        solution.is_success(),
        solution.get_solution_result().name,
        time.process_time() - began,
    )


def retimed(
    setting: Setting, problem: MotionProblem, knots: FloatArray, control_points: FloatArray
) -> PathParameterizedTrajectory | None:
    """The path of a B-spline in the least time that Toppra finds on Drake's own grid; None where it fails."""
    _, plant = _scene(setting, problem, setting.checker(problem))
    path = BsplineTrajectory(BsplineBasis(ORDER, list(knots)), np.transpose(control_points))
    toppra = Toppra(path, plant, Toppra.CalcGridPoints(path, CalcGridPointsOptions()))
    speed, acceleration = np.array(setting.limits.speed), np.array(setting.limits.acceleration)
    toppra.AddJointVelocityLimit(-speed, speed)
    toppra.AddJointAccelerationLimit(-acceleration, acceleration)
    law = toppra.SolvePathParameterization()
    return None if law is None else PathParameterizedTrajectory(path, law)


def _add_limits(program: KinematicTrajectoryOptimization, setting: Setting, problem: MotionProblem) -> None:
    limits, rest = setting.limits, np.zeros(len(problem.start))
    low, high = np.array(limits.position).T
    program.AddDurationCost(1.0)
    program.AddPositionBounds(low, high)
    program.AddVelocityBounds(-np.array(limits.speed), np.array(limits.speed))
    program.AddAccelerationBounds(-np.array(limits.acceleration), np.array(limits.acceleration))
    if limits.jerk is not None:
        program.AddJerkBounds(-np.array(limits.jerk), np.array(limits.jerk))
    program.AddDurationConstraint(SHORTEST, LONGEST)
    for end, angles in ((0.0, problem.start), (1.0, problem.goal)):
        program.AddPathPositionConstraint(np.array(angles), np.array(angles), end)
        program.AddPathVelocityConstraint(rest, rest, end)


def _straight(program: KinematicTrajectoryOptimization, problem: MotionProblem, bound: float) -> BsplineTrajectory:
    """A straight line, in twice the least time that it can take."""
    share = np.linspace(0.0, 1.0, CONTROL_POINTS)[:, None]
    points = (1.0 - share) * np.array(problem.start) + share * np.array(problem.goal)
    knots = 2.0 * bound * np.array(program.basis().knots())
    return BsplineTrajectory(BsplineBasis(ORDER, list(knots)), points.T)


def _solve(program: KinematicTrajectoryOptimization, seconds: float) -> MathematicalProgramResult:
    options = SolverOptions()
    options.SetOption(SnoptSolver.id(), "Time limit", max(seconds, 0.1))
    return SnoptSolver().Solve(program.prog(), None, options)


def _scene(setting: Setting, problem: MotionProblem, checker: Checker) -> tuple[Diagram, MultibodyPlant]:
    """The robot's spheres and the obstacles; of the robot's own pairs only those that the checker has."""
    builder = DiagramBuilder()
    plant, graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    Parser(plant).AddModelsFromString(ElementTree.tostring(locked(setting), encoding="unicode"), "urdf")
    root = next(link for link, (body, _) in setting.kinematics.bodies.items() if body == 0)
    if root != "world":
        plant.WeldFrames(plant.world_frame(), plant.GetBodyByName(root).body_frame())
    spheres = []
    links = links_of_bodies(setting.kinematics)
    for number, (body, center, radius) in enumerate(
        zip(setting.spheres.bodies, setting.spheres.centers, setting.spheres.radii, strict=True)
    ):
        frame = plant.GetBodyByName(links[int(body)]) if body else plant.world_body()
        spheres.append(
            plant.RegisterCollisionGeometry(frame, RigidTransform(center), Sphere(radius), f"sphere{number}", FRICTION)
        )
    for number, obstacle in enumerate(problem.obstacles):
        shape = Box(*obstacle.size) if obstacle.shape == "box" else Cylinder(obstacle.size[0] / 2.0, obstacle.size[2])
        pose = RigidTransform(RotationMatrix(obstacle.rotation), np.array(obstacle.position))
        plant.RegisterCollisionGeometry(plant.world_body(), pose, shape, f"obstacle{number}", FRICTION)
    plant.Finalize()
    filters = graph.collision_filter_manager()
    filters.Apply(CollisionFilterDeclaration().ExcludeWithin(GeometrySet(spheres)))
    for one, two in checker.own:
        pair = GeometrySet(spheres[one]), GeometrySet(spheres[two])
        filters.Apply(CollisionFilterDeclaration().AllowBetween(*pair))
    return builder.Build(), plant

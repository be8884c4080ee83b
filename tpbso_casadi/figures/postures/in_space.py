"""The figure of a path in space.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from matplotlib.figure import Figure

from tpbso_casadi.figures.captions import headline
from tpbso_casadi.figures.courses import courses_of
from tpbso_casadi.figures.postures.fan import legend_of, snapshots, times_of
from tpbso_casadi.figures.postures.nearest import nearest_of
from tpbso_casadi.figures.postures.passed import Points, passed_by
from tpbso_casadi.figures.space.panels import Posture, Way, space_figure
from tpbso_casadi.figures.space.scene import Scene
from tpbso_casadi.planning.planned_motion import PlannedMotion


def path_in_space(plan: PlannedMotion) -> Figure:
    """Three views of the tool's path, a fan of postures, obstacles and the closest approach; and a picture of it."""
    problem, motion = plan.criteria, plan.motion
    shown, nearest = snapshots(motion), nearest_of(motion)
    labels = {"": "", "start": "first posture", "end": legend_of(motion), "closest": "posture at the closest approach"}
    postures = [
        Posture(labels[snapshot.label], snapshot.colour, theta, snapshot.time, snapshot.opacity, bool(snapshot.label))
        for snapshot, theta in zip(shown, motion.trajectory.at(times_of(shown)), strict=True)
    ]
    tool = motion.joint_positions(plan.times)[:, -1]
    way = Way(
        path=Points("path of the tool", tool),
        passed=tuple(passed_by(motion)),
        named=(Points("start", tool[:1]), Points("goal", tool[-1:]), *passed_by(motion)),
        nearest=None if nearest is None else Points(nearest.label, nearest.points),
    )
    scene = Scene(problem.robot, problem.obstacles, problem.markers(), courses_of(problem.obstacles, plan.times))
    figure = space_figure(scene, postures, way, motion.trajectory.at(plan.times))
    figure.suptitle(headline(plan).replace("\n", ", "))
    return figure

"""Two arms that hold a bar of 0.6 m: motions that keep their relative pose, measured by Pinocchio's kinematics.

Two UR5 stand 1.1 m apart and hold the bar 30 mm below their flanges. Starts and goals are drawn: its middle, its turn
about the vertical, and how it leans; both arms can hold it there without contact. A third of the problems have a box
in the middle of the way. Each motion keeps the right tool where it is at the start, as seen from the left one, within
1 mm and 0.01 rad. Needs the extra ``oracles``.

    python -m benchmarks.held_together --count 20
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from benchmarks.off_the_shelf import ROBOTS, print_rows
from benchmarks.two_arms import FILES, twice
from problems.base import FloatArray
from problems.robots import SpatialArm
from problems.tasks import AtTips, Surroundings
from problems.timing import least_durations

LENGTH, BELOW, THICK = 0.6, 0.03, 0.03  # m, of the bar: between the tools, below them, and its width
APART = 1.1  # m, of the bases
ACCURACY, TOLERANCE = 1e-3, 0.01  # m, rad
KEYS = {"max_acceleration": 8.0, "max_jerk": 80.0}
MIDDLE = np.array([[0.45, 0.2, 0.15], [0.65, 0.5, 0.6]])  # m, of the bar
TURNS = np.array([0.5, 0.3, 0.4])  # rad: about the vertical, of one end up, about the bar
HOME = [0.9, -1.7, 1.9, -1.77, -1.57, 0.0]
OVER = 0.05  # m: by so much boxes are higher than the middle of the way
WITHIN = 30.0  # s
TIMES = 20_000
BAR = {
    "shape": "box",
    "name": "bar",
    "arm": "left",
    "center": [LENGTH / 2.0, 0.0, BELOW],
    "size": [LENGTH + 2.0 * THICK, THICK, THICK],
    "mass": 1.0,
}
HEADER = ("problems", "plans", "certified", "ratio: median / most", "CPU s: median / most", "off mm: most", "rad: most")


@dataclass(frozen=True)
class Problem:
    """Joints at both ends, (12,) each, rad, and boxes."""

    start: FloatArray
    goal: FloatArray
    boxes: list[tp.Box]


def cell() -> tp.StatedRobot:
    """Two UR5 face to face."""
    file, packages = ROBOTS / FILES["ur5"][0], {each.name: str(each) for each in ROBOTS.iterdir() if each.is_dir()}
    packages["example-robot-data"] = str(ROBOTS.parent)
    bases = {"left": {}, "right": {"position": [APART, 0.0, 0.0], "quaternion": [0.0, 0.0, 1.0, 0.0]}}
    keys = {"tip_link": FILES["ur5"][1], "packages": packages, **KEYS}
    return tp.cell({side: tp.robot(file, base=base, **keys) for side, base in bases.items()})


def place(rng: np.random.Generator) -> AtTips:
    """Where both tools hold the bar."""
    middle, turns = rng.uniform(*MIDDLE), rng.uniform(-TURNS, TURNS)
    whole = Rotation.from_euler("zyx", turns)
    tool = whole * Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
    ends = [middle + whole.apply([side * LENGTH / 2.0, 0.0, 0.0]) for side in (-1.0, 1.0)]
    quaternions = (tool.as_quat(), (tool * Rotation.from_euler("z", np.pi)).as_quat())
    poses = [tp.Pose(tuple(end.tolist()), tuple(turn.tolist())) for end, turn in zip(ends, quaternions, strict=True)]
    return AtTips(("left", "right"), tuple(poses))


def problems(arm: SpatialArm, count: int) -> list[Problem]:
    """Problems whose ends are clear; every third has a box in the middle of the way."""
    rng, found, home = np.random.default_rng(7), list[Problem](), np.array([*HOME, *HOME])
    while len(found) < count:
        one, other = place(rng), place(rng)
        try:
            start = np.array(one.branches(arm, (), home, "start")[0].branch_angles)
        except tp.InvalidProblem:
            continue
        goal, reached = other.near(arm, start)
        if not reached or np.abs(goal - start).max() > 2.0:
            continue
        points = [pose.point for end in (one, other) for pose in end.places if isinstance(pose, tp.Pose)]
        x, y, z = np.mean(points, axis=0).tolist()
        height = z + OVER
        box = tp.Box(center=(x, y, height / 2.0), size=(0.05, 0.05, height))
        boxes = [box] if len(found) % 3 == 2 else []
        if Surroundings(arm, tuple(boxes)).clear(np.stack([start, goal]), np.zeros(2)).all():
            found.append(Problem(start, goal, boxes))
    return found


def planned(robot: tp.StatedRobot, problem: Problem) -> tuple[tp.Plan | None, float]:
    """The plan, and the CPU time that it took, s; None where there is none."""
    held = tp.RelativePose(of="right", to="left", accuracy=ACCURACY, tolerance=TOLERANCE)
    began = time.process_time()
    try:
        plan = tp.plan(
            robot,
            start=problem.start.tolist(),
            goal=problem.goal.tolist(),
            obstacles=problem.boxes,
            carried=[BAR],
            constraints=[held],
            within=WITHIN,
        )
    except tp.ScenarioError as error:
        print(error)
        plan = None
    return plan, time.process_time() - began


def measured(urdf: Path, plan: tp.Plan) -> tuple[float, float]:
    """How far the right tool is from where it is at the start, as seen from the left one, m and rad, at most."""
    import pinocchio as pin  # noqa: PLC0415 (an extra)

    model = pin.buildModelFromUrdf(str(urdf))
    data = model.createData()
    frames = [model.getFrameId(f"{side}_{FILES['ur5'][1]}") for side in ("left", "right")]
    first, far, turned = None, 0.0, 0.0
    for theta in plan.trajectory(np.linspace(0.0, plan.duration, TIMES)):
        pin.framesForwardKinematics(model, data, theta)
        left, right = (data.oMf[frame] for frame in frames)
        seen = left.inverse() * right
        first = seen if first is None else first
        far = max(far, float(np.linalg.norm(seen.translation - first.translation)))
        turned = max(turned, float(np.linalg.norm(pin.log3(first.rotation.T @ seen.rotation))))
    return far, turned


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    options = parser.parse_args()
    robot = cell()
    arm = tp.scenario_of(robot, start=[*HOME, *HOME], goal=[*HOME, *HOME], carried=[BAR]).built().robot
    arm = replace(arm, self_collision=True)
    assert isinstance(arm, SpatialArm)
    rows, bound = [], []
    with TemporaryDirectory() as folder:
        urdf = Path(folder, "cell.urdf")
        bases = {
            "left_base": {"position": [0.0] * 3, "yaw": 0.0},
            "right_base": {"position": [APART, 0, 0], "yaw": np.pi},
        }
        urdf.write_text(twice(ROBOTS / FILES["ur5"][0], bases))
        for number, problem in enumerate(problems(arm, options.count)):
            plan, seconds = planned(robot, problem)
            least = float(least_durations((problem.goal - problem.start)[None], arm.limits).max())
            if plan is None:
                print(f"{number}: refused")
                continue
            far, turned = measured(urdf, plan)
            bound.append((str(plan.status), plan.duration / least, seconds, far, turned))
            print(f"{number}: {bound[-1]}", flush=True)
    status, ratios, seconds, far, turned = zip(*bound, strict=True)
    rows.append(
        [
            str(options.count),
            str(len(bound)),
            str(status.count("certified")),
            f"{np.median(ratios):.3f} / {max(ratios):.3f}",
            f"{np.median(seconds):.2f} / {max(seconds):.2f}",
            f"{1e3 * max(far):.3f}",
            f"{max(turned):.5f}",
        ]
    )
    print_rows(HEADER, rows)


if __name__ == "__main__":
    main()

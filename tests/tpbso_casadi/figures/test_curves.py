"""Joints, limits and costs over time: what stands beside the lines, and where a limit binds, by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.massive import lifted_motion
from helpers.space_plans import space_plan
from matplotlib.figure import Figure

import tpbso_casadi as tp
from problems import PlanarArm, Trajectory
from problems.assembly import Criteria, joint_following
from problems.motions import JointPath
from problems.tasks import JointFollowing
from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.figures.curves import Row, convergence_figure, draw_limits, joints_figure, limit_labels, ranges_of
from tpbso_casadi.figures.limits import STYLES, limits_figure, spans, structure_figure
from tpbso_casadi.figures.palette import line_of
from tpbso_casadi.planning import PlannedMotion, alternatives, convergence, plan, shares_of_limits
from tpbso_casadi.planning.motion import QUANTITIES


@cache
def searched(name: str = "bso") -> PlannedMotion:
    content = builtin("rotation-3").table()
    content["model"]["retime"] = False
    content["solver"] |= {"name": name} | ({"iterations": 2} if name == "ipopt" else {"evaluations": 600})
    return plan(parse_scenario(content))


def test_labels_name_joints_by_ranges_and_limits_and_units_once_each() -> None:
    ranges = {(0,): "a", (0, 1): "a\nto b", (0, 1, 2, 4): "a\nto c, e", (1, 3, 5, 6): "b, d, f\nto g"}
    assert [ranges_of("abcdefg", np.array(joints)) for joints in ranges] == list(ranges.values())
    assert limit_labels(np.array([4.0, 4.0]), "ab") == [(4.0, "± 4")]
    assert limit_labels(np.array([87.0, 12.0, 87.0]), "abc") == [(12.0, "± 12, b"), (87.0, "± 87, a, c")]
    assert alternatives(("N m", "N", "N m")) == "N m or N"
    assert alternatives(("rad", "rad")) == "rad"
    assert spans(np.array([True, True, False, True, False, False, True])) == [(0, 1), (3, 3), (6, 6)]
    assert spans(np.array([False, False])) == []


def test_a_limit_far_away_does_not_stretch_the_axis() -> None:
    axes = Figure().subplots()
    axes.set_xlim(0.0, 1.0)
    draw_limits(axes, Row("speed", np.zeros((2, 2)), np.array([2.0, 90.0])), ("joint 1", "joint 2"), largest=1.0)
    assert axes.get_ylim() == pytest.approx((-2.16, 2.16))
    assert [line.get_ydata()[0] for line in axes.lines] == [-2.0, 2.0]
    assert [text.get_text() for text in axes.texts] == ["± 2, joint 1", "± 90, joint 2"]


def test_every_joint_has_its_line_and_its_label() -> None:
    figure = joints_figure(space_plan())
    labels = [text.get_text() for text in figure.axes[0].texts]
    assert labels == [f"joint_{joint}" for joint in range(4)]  # as the robot calls them
    for axes in figure.axes:
        curves = [line for line in axes.lines if str(line.get_label()).startswith("joint")]
        assert [line.get_color() for line in curves] == [line_of(joint)["color"] for joint in range(4)]
        assert len({line.get_linestyle() for line in curves}) > 1
    assert figure.axes[-1].get_xlabel() == "time [s]"


def test_every_kind_of_limit_is_named_at_its_line() -> None:
    above, below = limits_figure(space_plan()).axes
    assert [text.get_text() for text in above.texts] == ["speed", "acceleration", "jerk"]
    assert [label.get_text() for label in below.get_yticklabels()] == [f"joint_{joint}" for joint in range(4)]
    assert set(STYLES) == set(QUANTITIES)
    assert len({style[1:] for style in STYLES.values()}) == len(STYLES)  # apart without colour
    labels = [axes.get_ylabel() for axes in joints_figure(space_plan()).axes]  # an arm without masses
    assert labels == ["angle [rad]", "speed [rad/s]", "acceleration [rad/s²]", "jerk [rad/s³]"]


@pytest.mark.parametrize("name", ["bso", "ipopt"])
def test_convergence_says_what_was_reached(name: str) -> None:
    solution = searched(name)
    [axes] = convergence_figure(solution).axes
    _, cost = convergence(solution.search)
    assert f"{cost[-1]:.4g}" in [text.get_text() for text in axes.texts]
    assert axes.get_title().endswith(f": {solution.search.evaluations} evaluations")
    assert axes.get_ylabel() == "best rotation so far [rad]"
    assert axes.get_yscale() == "linear"


def test_convergence_over_decades_is_logarithmic_and_without_a_plan_of_penalties() -> None:
    solution = searched()
    history = solution.search.history
    drawn = []
    for costs in (np.geomspace(1e3, 1e-1, history.cost.size), np.full(history.cost.size, 1e12)):
        search = replace(solution.search, history=replace(history, cost=costs))
        drawn.append(convergence_figure(replace(solution, search=search)).axes[0])
    falling, none = drawn
    assert falling.get_yscale() == "log"
    assert none.get_title().endswith(": no feasible candidate")
    assert none.get_ylabel() == "penalised cost"


def test_the_structure_covers_each_nonzero_once() -> None:
    figure = structure_figure(builtin("obstacle-3"))
    search, program = figure.subfigs
    for half in (search, program):
        said = int(half.get_suptitle().split("\n")[1].split()[0])
        boxes = [path.get_extents() for axes in half.axes for path in axes.collections[0].get_paths()]
        assert round(sum(box.width * box.height for box in boxes)) == said


def bang_bang() -> Trajectory:
    """q = t^2 for 1 s, then braking likewise, of both joints: speed 2 at the middle, acceleration 2 throughout."""
    coefficients = np.array([[[1.0], [-1.0]], [[0.0], [2.0]], [[0.0], [1.0]]])
    return Trajectory(np.array([0.0, 1.0, 2.0]), np.repeat(coefficients, 2, axis=2))


def run_by(robot: PlanarArm) -> Criteria:
    return joint_following(JointFollowing(robot, JointPath.of(bang_bang())))


def test_shares_of_a_bang_bang_move() -> None:
    robot = PlanarArm(link_lengths=(1.0, 1.0), max_speed=(4.0, 8.0), max_acceleration=(2.0, 4.0))
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    shares = dict(shares_of_limits(run_by(robot), bang_bang(), times))
    assert list(shares) == ["speed", "acceleration"]
    sizes = np.outer([1.0, 1.0, -1.0, -1.0, -1.0], [1.0, 0.5])
    np.testing.assert_allclose(shares["acceleration"], sizes)
    np.testing.assert_allclose(shares["speed"], np.outer([0.0, 0.25, 0.5, 0.25, 0.0], [1.0, 0.5]))


def test_shares_of_torques_held_upright() -> None:
    # no gravity; point masses of 1 kg at the ends of both links: at zero, tau_1 = 5 a_1 + 2 a_2 ... by hand
    robot = PlanarArm(
        link_lengths=(1.0, 1.0), max_speed=(4.0, 4.0), max_acceleration=(9.0, 9.0), gravity=(0.0, 0.0),
        link_masses=(1.0, 1.0), link_centers=(1.0, 1.0), link_inertias=(0.0, 0.0), max_torque=(32.0, 12.0),
    )  # fmt: skip
    shares = dict(shares_of_limits(run_by(robot), bang_bang(), np.array([0.0])))
    # M = [[1 + 4, 2], [2, 1]] stretched, a = (2, 2), at rest: tau = (14, 6)
    np.testing.assert_allclose(shares["torque"], [[14.0 / 32.0, 6.0 / 12.0]])


@pytest.mark.parametrize("limited", [True, False])
def test_the_joints_figure_has_a_panel_of_torques(limited: bool) -> None:
    motion = lifted_motion(limited)
    axes = joints_figure(PlannedMotion(scenario=None, motion=motion)).axes[-1]  # type: ignore[arg-type]
    assert axes.get_ylabel() == "torque [N m or N]"
    drawn = [line for line in axes.lines if len(line.get_xdata()) > 2]
    np.testing.assert_allclose([line.get_ydata() for line in drawn], motion.torques(motion.times).T)
    level = {line.get_ydata()[0] for line in axes.lines if len(line.get_xdata()) == 2}
    assert level == ({120.0, 40.0, 20.0, 10.0, -120.0, -40.0, -20.0, -10.0} if limited else set())


def test_stages_are_named_above_the_curves() -> None:
    arm, start = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0)), tp.Joints((0.1, 0.5))
    stages = [tp.MoveTo(tp.Joints((0.9, 0.5))), tp.Output("gripper"), tp.Wait(0.3), tp.MoveTo(start)]
    plan = tp.sequence(arm, start=start, stages=stages, solver="direct")
    names = [text.get_text() for text in plan.plot("joints").axes[0].texts]
    assert [name for name in names if "\n" in name] == ["1\nmove", "3\nwait", "4\nmove"]
    many = tp.sequence(arm, start=start, stages=[*stages[:1], *[tp.Wait(0.1)] * 12], solver="direct")
    assert "13" in [text.get_text() for text in many.plot("joints").axes[0].texts]

"""``tpbso robots inverse``: the postures of a robot with its tool at a pose."""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from problems import InvalidProblem
from problems.base import FloatArray
from problems.tasks import Pose
from tpbso_casadi.cli.command import Exit
from tpbso_casadi.cli.options import (
    ROBOT_AND_SURROUNDINGS,
    add_descents,
    add_json,
    add_quiet,
    add_tip,
    defaulting,
    finite,
    output_group,
    path,
    problem_group,
)
from tpbso_casadi.display.console import OutputConsole, number, table_of
from tpbso_casadi.facade.reaching import arm_among
from tpbso_casadi.plain import as_json
from tpbso_casadi.reaching import POSE_STARTS, ArmAmong
from tpbso_casadi.scenario import ScenarioError
from tpbso_casadi.storage import check_file, check_writable, write_csv, writing

OPTIONS = {"arm": "--tip", "pose": "--quaternion", "postures": "--near", "starts": "--descents"}  # by refused fields
COLUMN = 9  # characters of a number, at most


def add_inverse(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("robot", metavar="NAME|FILE", help=ROBOT_AND_SURROUNDINGS)
    problem = problem_group(parser)
    problem.add_argument(
        "--position", type=finite, nargs=3, required=True, metavar=("X", "Y", "Z"), help="of the tool, m"
    )
    problem.add_argument(
        "--quaternion",
        type=finite,
        nargs=4,
        metavar=("X", "Y", "Z", "W"),
        help=defaulting("how the tool is turned, of length 1", "in any way"),
    )
    problem.add_argument(
        "--clear-of",
        type=path,
        metavar="FILE",
        help=defaulting("obstacles, of a TOML file or a scene of MoveIt", "those of the robot's file"),
    )
    problem.add_argument(
        "--near",
        type=finite,
        nargs="+",
        metavar="Q",
        help=defaulting(
            "a posture, rad or m: the nearest to it come first, in the turns nearest to it", "the middle of the ranges"
        ),
    )
    problem.add_argument("--turns", action="store_true", help="each posture in all turns within the joints' ranges")
    add_descents(problem, POSE_STARTS)
    add_tip(problem)
    output = output_group(parser)
    output.add_argument("--csv", type=path, metavar="FILE", help=defaulting("write the postures there", "nowhere"))
    add_json(output)
    add_quiet(output)


@dataclass(frozen=True, eq=False)
class Postures:
    """The postures of an arm with its tool at a pose.

    Attributes:
        among: the arm and what is around it.
        pose: of the tool.
        theta: the postures, (n, dof), rad or m.
    """

    among: ArmAmong
    pose: Pose
    theta: FloatArray

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the joints."""
        return self.among.arm.joints.names

    @property
    def header(self) -> list[str]:
        """The names of the columns: the joints', and of what follows them."""
        return [*self.joints, "manipulability", "clearance"]

    @cached_property
    def rows(self) -> list[list[float | None]]:
        """Joints, manipulability and clearance of each posture; None where nothing could come near."""
        numbers = np.column_stack(
            [self.theta, self.among.manipulability(self.theta), self.among.clearance(self.theta)]
        ).tolist()
        return [[value if np.isfinite(value) else None for value in row] for row in numbers]

    @property
    def content(self) -> dict[str, Any]:
        """The postures for machines."""
        each = [dict(zip(("joints", *self.header[-2:]), (row[:-2], *row[-2:]), strict=True)) for row in self.rows]
        return {"joint_names": list(self.joints), "postures": each}

    def why_none(self, starts: int) -> str:
        """A line that says what is missing where there is none."""
        touching = self.among.inverse(self.pose, touching=True, starts=starts)
        assert isinstance(touching, np.ndarray)
        if len(touching):
            short = -float(self.among.clearance(touching).max())
            return f"no posture is clear: of {len(touching)} that reach it the best lacks {short:.3g} m"
        frame = self.among.forward(self.among.nearest(self.pose, starts=starts))
        far = f"{np.linalg.norm(frame[:3, 3] - self.pose.point):.3g} m"
        if self.pose.rotation is not None:
            turned = np.trace(frame[:3, :3].T @ self.pose.rotation)
            far += f" and {np.arccos(np.clip((turned - 1.0) / 2.0, -1.0, 1.0)):.3g} rad"
        return f"no posture reaches it: the nearest that was found is {far} away"


def inverse(options: argparse.Namespace) -> int:
    """Look for postures, print and write them; returns the exit status: 1 where there is none."""
    if options.csv is not None:
        check_file(options.csv)
        check_writable(options.csv.parent)
    found = found_postures(options)
    if options.csv is not None:
        with writing(options.csv.parent):
            write_csv(options.csv, found.header, found.rows)
    if options.json:
        sys.stdout.write(as_json(found.content))
    elif not options.quiet:
        print_postures(found, options.descents)
    return Exit.FEASIBLE if len(found.theta) else Exit.INFEASIBLE


def found_postures(options: argparse.Namespace) -> Postures:
    """The postures that the options ask for.

    Raises:
        ScenarioError: the robot or its surroundings cannot be, or an option is wrong.
    """
    pose = Pose(tuple(options.position), None if options.quaternion is None else tuple(options.quaternion))
    try:
        among = arm_among(options.robot, options.clear_of, options.tip)
        theta = among.inverse(pose, near=options.near, turns=options.turns, starts=options.descents)
    except InvalidProblem as error:
        if error.field in OPTIONS:
            raise ScenarioError(f"{OPTIONS[error.field]}: {error.reason}") from error
        raise ScenarioError(f"{options.clear_of or options.robot}: {error}") from error
    assert isinstance(theta, np.ndarray)
    return Postures(among, pose, theta)


def print_postures(found: Postures, starts: int) -> None:
    """Print the postures, as wide as they are, or why there is none."""
    if not len(found.theta):
        OutputConsole().say(found.why_none(starts))
        return
    numbered = [f"q{place}" for place, _ in enumerate(found.joints, start=1)]
    table = table_of(*(number(name) for name in (*numbered, "manipulability", "clearance [m]")))
    for row in found.rows:
        measures = ("-" if value is None else f"{value:.4f}" for value in row[-2:])
        table.add_row(*(f"{value:.3f}" for value in row[:-2]), *measures)
    named = ", ".join(f"{short} {name}" for short, name in zip(numbered, found.joints, strict=True))
    count = "1 posture" if len(found.theta) == 1 else f"{len(found.theta)} postures"
    console = OutputConsole(width=max(OutputConsole().width, COLUMN * (len(numbered) + 4)))
    console.print_table(f"{count}, rad, of joints that slide m: {named}", table)

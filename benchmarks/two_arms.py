"""Two arms planned together: cells of two arms that face each other, and a Baxter that reaches into a shelf.

A cell's URDF is made of the file of one arm, twice, under prefixed names. Problems state joints at both ends, in the
order left, right, and boxes or other solids. The ratio is to the bound of the slowest joint alone; of a Baxter the
robot's effort limits refuse goals that its motors cannot hold.

    python -m benchmarks.two_arms cells CELLS.json
    python -m benchmarks.two_arms baxter PROBLEMS.jsonl --urdf baxter.urdf --spheres spheres.toml --srdf baxter.srdf
"""

from __future__ import annotations

import argparse
import json
import time
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import tpbso_casadi as tp
from benchmarks.off_the_shelf import ROBOTS, print_rows
from problems.timing import least_durations

FILES = {
    "panda": ("panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "tool0"),
}
SIDES = ("left", "right")
BAXTER = {"tips": {"left": "left_gripper", "right": "right_gripper"}, "max_acceleration": 8.0, "max_jerk": 80.0}
REFUSALS = {"to hold the arm": "an end cannot be held", "clearance": "an end is in contact"}  # by parts of messages
AT_THE_BOUND = 1.001
WITHIN = 6.0  # s, unless another time is asked for
HEADER = (
    "set",
    "problems",
    "certified",
    "others",
    "at the bound",
    "ratio: median / most",
    "CPU s: median / 90 % / most",
)


@dataclass(frozen=True)
class Outcome:
    """What came of a problem: its set, a status or a reason, the ratio to the bound, CPU seconds."""

    name: str
    status: str
    ratio: float
    seconds: float


def planned(
    name: str, arms: Any, start: list[float], goal: list[float], obstacles: list[dict[str, Any]], within: float
) -> Outcome:
    """The outcome of one problem."""
    began = time.process_time()
    try:
        plan = tp.plan(arms, start=start, goal=goal, obstacles=obstacles, within=within)
    except tp.ScenarioError as error:
        reason = next((said for part, said in REFUSALS.items() if part in str(error)), "refused")
        return Outcome(name, reason, np.nan, 0.0)
    seconds = time.process_time() - began
    bound = float(least_durations((np.array(goal) - start)[None], arms.model.limits).max())
    return Outcome(name, str(plan.status), plan.duration / bound, seconds)


def twice(file: Path, bases: dict[str, Any]) -> str:
    """A URDF of the arm of a file on two bases, its names prefixed by their sides."""
    cell = ET.Element("robot", name="cell")
    ET.SubElement(cell, "link", name="world")
    for side in SIDES:
        arm = ET.parse(file).getroot()
        carried = {joint.find("child").get("link") for joint in arm.findall("joint")}  # type: ignore[union-attr]
        (root,) = (link.get("name") for link in arm.findall("link") if link.get("name") not in carried)
        for element in [*arm.findall("link"), *arm.findall("joint")]:
            element.set("name", f"{side}_{element.get('name')}")
            for part, key in (("parent", "link"), ("child", "link"), ("mimic", "joint")):
                if (named := element.find(part)) is not None:
                    named.set(key, f"{side}_{named.get(key)}")
            cell.append(element)
        base, at = ET.SubElement(cell, "joint", name=f"{side}_base", type="fixed"), bases[f"{side}_base"]
        ET.SubElement(base, "parent", link="world")
        ET.SubElement(base, "child", link=f"{side}_{root}")
        ET.SubElement(base, "origin", xyz=" ".join(map(str, at["position"])), rpy=f"0 0 {at['yaw']}")
    return ET.tostring(cell, encoding="unicode")


@dataclass(frozen=True)
class Cell:
    """A problem of two arms: their name, URDF and robot, joints at both ends, tables of boxes."""

    name: str
    urdf: Path
    robot: tp.StatedRobot
    start: list[float]
    goal: list[float]
    boxes: list[dict[str, Any]]


def cells_of(file: Path, folder: Path) -> Iterator[Cell]:
    """Cells of two arms, with their limits in the file; URDFs are written into a folder."""
    content, known = json.loads(file.read_text()), dict[str, tuple[Path, tp.StatedRobot]]()
    packages = {each.name: str(each) for each in ROBOTS.iterdir() if each.is_dir()}
    packages["example-robot-data"] = str(ROBOTS.parent)
    for problem in content["problems"]:
        name = problem["robot"]
        path, tip = FILES[name]
        text = twice(ROBOTS / path, problem)
        if text not in known:
            urdf = folder / f"{len(known)}.urdf"
            urdf.write_text(text)
            limits = {key: value for key, value in content["limits"][name].items() if key != "joint_names"}
            tips = {side: f"{side}_{tip}" for side in SIDES}
            known[text] = urdf, tp.robot(urdf, tips=tips, packages=packages, **limits)
        boxes = [{"shape": "box", **box} for box in problem["boxes"]]
        yield Cell(name, *known[text], problem["start"], problem["goal"], boxes)


def cells(file: Path, within: float) -> Iterator[Outcome]:
    """The outcomes of cells of two arms."""
    with TemporaryDirectory() as folder:
        for cell in cells_of(file, Path(folder)):
            yield planned(f"two {cell.name}", cell.robot, cell.start, cell.goal, cell.boxes, within)


def baxter(file: Path, keys: dict[str, str], within: float) -> Iterator[Outcome]:
    """The outcomes of a Baxter's problems."""
    arms = tp.robot(keys.pop("urdf"), **BAXTER, **keys)
    for problem in map(json.loads, file.read_text().splitlines()):
        solids = [_solid(each) for each in problem["obstacles"]]
        yield planned(problem["set"], arms, problem["start"], problem["goal"], solids, within)


def _solid(stated: dict[str, Any]) -> dict[str, Any]:
    """The table of an obstacle."""
    table = {"shape": stated["shape"], "center": stated["position"], "quaternion": stated["quaternion"]}
    sizes = stated["dimensions"]
    if stated["shape"] == "box":
        return table | {"size": sizes}
    return table | {"length": sizes[0], "radius": sizes[1]}


def print_outcomes(outcomes: list[Outcome]) -> None:
    """A row for each set."""
    rows = []
    for name in dict.fromkeys(outcome.name for outcome in outcomes):
        own = [outcome for outcome in outcomes if outcome.name == name]
        good = [outcome for outcome in own if outcome.status == "certified"]
        others = Counter(outcome.status for outcome in own if outcome.status != "certified")
        listed = ", ".join(f"{count} {status}" for status, count in others.most_common())
        ratios, seconds = (np.array([getattr(each, key) for each in good]) for key in ("ratio", "seconds"))
        figures = (
            " / ".join(f"{value:.4f}" for value in np.quantile(ratios, [0.5, 1.0])),
            " / ".join(f"{value:.2f}" for value in np.quantile(seconds, [0.5, 0.9, 1.0])),
        )
        at = int((ratios < AT_THE_BOUND).sum())
        rows.append([name, str(len(own)), str(len(good)), listed, str(at), *figures])
    print_rows(HEADER, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("cells", "baxter"))
    parser.add_argument("problems", type=Path)
    parser.add_argument("--urdf")
    parser.add_argument("--spheres")
    parser.add_argument("--srdf")
    parser.add_argument("--within", type=float, default=WITHIN, help="seconds of a plan, %(default)g by default")
    options = parser.parse_args()
    keys = {key: getattr(options, key) for key in ("urdf", "spheres", "srdf")}
    found = (
        cells(options.problems, options.within)
        if options.what == "cells"
        else baxter(options.problems, keys, options.within)
    )
    print_outcomes(list(found))


if __name__ == "__main__":
    main()

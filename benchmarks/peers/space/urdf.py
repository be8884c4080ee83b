"""The robot of a setting as a URDF for other libraries."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from benchmarks.motion_bench_maker.kinematics import Kinematics
from benchmarks.motion_bench_maker.setting import Setting


def locked(setting: Setting) -> ElementTree.Element:
    """The robot with all joints fixed that are not planned."""
    root = ElementTree.parse(setting.urdf).getroot()
    for joint in root.iter("joint"):
        if joint.get("type") not in (None, "fixed") and joint.get("name") not in setting.kinematics.names:
            joint.set("type", "fixed")
            for tag in ("limit", "mimic", "axis"):
                for element in joint.findall(tag):
                    joint.remove(element)
    return root


def links_of_bodies(kinematics: Kinematics) -> dict[int, str]:
    """A link by the number of its body, for those whose frame is the body's."""
    return {body: link for link, (body, place) in kinematics.bodies.items() if np.allclose(place, np.eye(4))}

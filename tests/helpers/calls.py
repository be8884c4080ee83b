"""A scenario as its file states it, from the arguments of a call."""

from __future__ import annotations

from typing import Any

import tpbso_casadi as tp


def in_python(content: dict[str, Any]) -> tp.Scenario:
    """The scenario of a file's tables, from the arguments of a call."""
    given = content["task"] | content.get("model", {}) | {"name": "bso"} | content.get("solver", {})
    renamed = {"points": "path", "name": "solver", "polish_starts": "polish"}
    keys = {renamed.get(key, key): value for key, value in given.items() if key != "kind"}
    keys |= {key: content[key] for key in ("carried", "may_touch") if key in content}
    robot = dict(content["arm"] if "arm" in content else content["robot"])
    name = next(key for key in ("link_lengths", "model", "urdf") if key in robot)
    arm = tp.robot(robot.pop(name), **robot)
    if content["task"]["kind"] == "joint-path":
        return tp.retime(keys["joints"], arm).scenario
    return tp.scenario_of(arm, obstacles=content.get("obstacles", []), **keys)

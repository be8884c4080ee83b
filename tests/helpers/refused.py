"""What is refused of a scenario, as (changes of a base, the line): one table for scenario files and calls in Python."""

from __future__ import annotations

from datetime import date
from math import inf, nan
from typing import Any

from helpers.running import REMOVED

SHORT = """<robot name="short">
<link name="foot"/><link name="upper"/><link name="lower"/><link name="hand"/>
<joint name="turn" type="revolute"><parent link="foot"/><child link="upper"/><origin xyz="0 0 0.3"/>
 <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1.5" effort="10"/></joint>
<joint name="lift" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.1"/>
 <axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="2.5" effort="10"/></joint>
<joint name="grip" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0.5 0 0"/></joint>
</robot>
"""
BALLS = """[[spheres]]
link = "hand"
center = [0.0, 0.0, 0.0]
radius = 0.05
[[spheres]]
link = "foot"
center = [0.0, 0.0, 0.1]
radius = 0.1
"""
MESH = '<link name="lower"><collision><geometry><mesh filename="lower.stl"/></geometry></collision></link>'
FILES = {"short.urdf": SHORT, "balls.toml": BALLS, "mesh.urdf": SHORT.replace('<link name="lower"/>', MESH)}
ARM = {"link_lengths": [0.5, 0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
TWO = {"link_lengths": [0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
THREE = {"link_lengths": [0.6, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
MOVE = {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5]}
OVAL = {"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}
BOX = {"shape": "box", "center": [-0.5, 1.0], "size": [0.2, 0.1], "angle": 0.2}
POLYGON = {"shape": "polygon", "points": [[1.6, -0.5], [1.6, 0.6], [1.5, 0.6], [1.5, -0.4], [1.0, -0.4], [1.0, -0.5]]}
LINE = [[1.0, 0.0], [1.0, 0.5], [0.5, 1.0]]
POSTURES = {"kind": "point-to-point", "start": {"joints": [0.1, 0.2, 0.3]}, "goal": {"joints": [0.5, 0.2, 0.1]}}
BENT = {
    "start": {"joints": [0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0]},
    "goal": {"joints": [0.3, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0]},
}
MASSES: dict[str, Any] = {"link_masses": [2.0, 1.0], "max_torque": [50.0, 20.0], "link_inertias": [0.05, 0.04]}
HALF = {"shape": "half-space", "center": [0.3, 0.1, 0.5]}
CENTER, TURN = [0.3, 0.1, 0.5], [0.0, 0.0, 0.6, 0.8]
PART = {"shape": "box", "center": [0.0, 0.0, 0.1], "size": [0.06, 0.06, 0.2], "mass": 0.5, "name": "part"}
TABLE = {"shape": "box", "center": [0.45, 0.2, 0.2], "size": [0.5, 0.8, 0.1], "name": "table"}
BIN = {"shape": "sphere", "center": [0.0, 0.9, 0.9], "radius": 0.1, "name": "bin"}
BASES: dict[str, dict[str, Any]] = {
    "point": {"arm": ARM, "task": MOVE, "obstacles": [OVAL]},
    "path": {"arm": ARM, "task": {"kind": "path", "accuracy": 0.05, "points": LINE}},
    "star": {"arm": ARM, "task": {"kind": "path", "accuracy": 0.05, "shape": "pentagram", "radius": 0.9}},
    "joints": {"arm": THREE, "task": POSTURES},
    "scene": {
        "arm": THREE | {"link_radius": [0.04, 0.03, 0.02], "base": [0.1, -0.2, 0.3], "tool": [0.1, 0.05]},
        "task": {"kind": "point-to-point", "start": [1.2, 0.0], "goal": [0.2, 1.2], "elbow": "up"},
        "obstacles": [{"center": [1.3, 1.2], "semi_axes": [0.2, 0.1]}, BOX, POLYGON],
        "model": {"margin": 0.02, "self_collision": True},
    },
    "masses": {"arm": TWO | MASSES, "task": MOVE | {"start": {"joints": [-1.5, 0.0]}, "goal": {"joints": [-1.0, 0.2]}}},
    "settings": {
        "robot": {"model": "planar", "settings": TWO | MASSES},
        "task": MOVE | {"start": {"joints": [-1.5, 0.0]}, "goal": {"joints": [-1.0, 0.2]}},
    },
    "panda": {"robot": {"model": "panda"}, "task": MOVE | BENT, "carried": [PART], "obstacles": [TABLE]},
    "traced": {
        "robot": {"model": "panda"},
        "task": {"kind": "path", "points": [[0.4, 0.0, 0.5], [0.4, 0.1, 0.5]], "accuracy": 0.005},
    },
    "urdf": {
        "robot": {"urdf": "short.urdf", "spheres": "balls.toml", "max_acceleration": 5.0},
        "task": MOVE | {"start": {"joints": [0.0, 0.0]}, "goal": {"joints": [1.0, 0.5]}},
    },
}
WITH_FILES = ("urdf",)  # of files beside a scenario
NO_CALL = ("settings", "star")  # no keyword states a class of robot with its settings, or a shape
NO_MASSES = "torques are not known: no masses are stated for upper, lower"
UNREAD = "; state spheres for it, or leave it out of every verdict: ignore_geometry = ['lower']"
UPRIGHT, SPEED = {"kind": "upright", "tolerance": 0.1}, {"kind": "tool speed", "max": 0.8}


def nested(depth: int) -> Any:
    """A list in a list in a list."""
    value: Any = []
    for _ in range(depth):
        value = [value]
    return value


SPLINE, PAPER, TIMED = {"model.motion": "spline"}, {"model.motion": "paper"}, {"model.motion": "time-spline"}
HOLLOW: dict[str, Any] = {"arm.link_lengths": [1.5, 0.3, 0.2], "obstacles": []}
VIA = {"task.via": [{"joints": [0.1, 0.2, 0.3]}]}
REFUSED: dict[str, list[tuple[dict[str, Any], str]]] = {
    "point": [
        ({"task.goal": REMOVED}, "task.goal: missing"),
        ({"task.objective": "a{b}:c"}, "task.objective: cannot load objective 'a{b}:c'"),
        ({"task.objective": "a" * 5000}, "task.objective: a shorter word is needed, not 'aaa"),
        ({"task.objective": "tim"}, "task.objective: input should be 'time', ... did you mean time?"),
        ({"task.objective": {}}, "task.objective: an objective with its weight is needed, such as { time = 1.0, en"),
        ({"task.objective": {"tme": 1.0}}, "task.objective.tme: input should be 'time', ... not 'tme'"),
        ({"task.objective": {"time": -1.0}}, "task.objective.time: input should be greater than 0, not -1.0"),
        ({"task.start": {}}, "task.start: [x, y], { joints"),
        ({"task.start": {"joint": [1.0]}}, "task.start: [x, y], { joints"),
        ({"task.start": {"joints": [0.0], "position": [1.0, 0.0]}}, "task.start: [x, y], { joints"),
        ({"task.start": {"joints": [0.0, "x"]}}, "task.start.joints.1: a number is needed, not 'x'"),
        ({"task.start": {"joints": [0.0, 0.0]}}, "task.start: 2 joints for a robot of 4"),
        ({"task.start": {"position": [9.0, 0.0]}}, "task.start: (9.0, 0.0) is 9 m from the base, out of reach"),
        ({"task.start": [0.8, 0.8]}, "task.start: (0.8, 0.8) lies inside the obstacle"),
        (HOLLOW | {"task.start": [0.5, 0.5]}, "task.start: (0.5, 0.5) ... too close: the arm reaches from 1 m on"),
        ({"task.goal": [3.0, 0.0]}, "task.goal: (3.0, 0.0) is 3 m from the base, out of reach ... 2 m"),
        ({"task.goal": [[0.5, 1.0], [9.0, 0.0]]}, "task.goal: goal[1]: (9.0, 0.0)"),
        ({"task.goal": [[0.5, 1.0], {"joints": ["x"]}]}, "task.goal.1.joints.0: a number is needed"),
        ({"task.goal": [[0.5, 1.0]] * 101}, "task.goal: 101 places; at most 100"),
        ({"task.via": []}, "task.via: a list of [x, y], { joints"),
        ({"task.start_velocity": [0.1, 0.0]}, "task.start_velocity: 2 values for 4 joints"),
        ({"task.start_velocity": [9.0, 0.0, 0.0, 0.0]}, "task.start_velocity: joint 1: "),
        ({"arm.max_speed": [1.0, 2.0]}, "arm.max_speed: 2 values for 4 links"),
        ({"arm.max_speed": 5e-324}, "arm.max_speed: 4.94066e-324 is below the smallest positive number, 1e-12"),
        ({"arm.joint_limits": [[0.0, 1.0]] * 3}, "arm.joint_limits: 3 values for 4 links"),
        ({"arm.joint_limits": [[1.0, 0.0]] * 4}, "arm.joint_limits: joint 1"),
        ({"task.elbow": "up", "arm.joint_limits": [[-1.0, -0.5]] * 4}, "arm.joint_limits: joint 2: with the elbow up"),
        ({"obstacles.0.center": [0.1, 0.0]}, "obstacles: the base lies inside"),
        ({"obstacles": [OVAL] * 1001}, "obstacles: at most 1000 items"),
        ({"arm.link_lengths": [0.02] * 100, "model.samples": 1000}, "model.samples: ... at most 500"),
        (VIA | PAPER, "task.via: needs motion = 'spline' in [model]"),
        (VIA | {"model.formulation": "paper"}, "task.via: needs motion = 'spline' in [model]"),
        ({"task.start": {"joints": [0.0] * 4}} | PAPER, "task.start: needs motion = 'spline'"),
        ({"task.goal": [[0.5, 1.0], [0.6, 1.0]]} | PAPER, "task.goal: needs motion = 'spline'"),
        ({"task.goal_velocity": [0.1, 0.0, 0.0, 0.0]} | PAPER, "task.goal_velocity: needs motion"),
        ({"task.total_time": [0.1, 2.0]} | PAPER, "task.total_time: needs motion"),
        ({"task.segment_time": [0.1, 2.0]} | SPLINE, "task.segment_time: needs motion = 'paper'"),
        ({"model.formulation": "paper"} | SPLINE, "model.formulation: 'paper' needs motion = 'paper'"),
        ({"model.knots": 5} | SPLINE, "model.knots: needs motion = 'paper'"),
        ({"model.pieces": 5} | PAPER, "model.pieces: needs motion = 'spline'"),
        ({"model.motion": "splin"}, "model.motion: input should be ... did you mean spline?"),
        (TIMED, "task.start: motion 'time-spline' needs joint angles there"),
        ({"obstacles": [BIN]}, "obstacles: obstacle 1, Ball at ... it has 3 dimensions, the robot 2"),
        ({"carried": [PART]}, "carried: of robots in space alone"),
        ({"may_touch": [["link 1", "link 3"]]}, "may_touch: two bodies of the robot itself"),
        ({"task.objective": {"time": 1.0, "energy": 1.0}}, "task.objective: 'energy' needs masses, and those of this"),
        ({"solver.name": "bos"}, "solver.name: no solver 'bos'; did you mean bso?"),
        ({"solver.settings": {"lamda_": 0.5}}, "solver.settings.lamda_: bso has no such setting; did you mean lam"),
        ({"solver.settings": {"lambda_": 1.5}}, "solver.settings: lambda_ = 1.5 is not in [0, 1]"),
        ({"solver.settings": {"c1": "much"}}, "solver.settings.c1: a number is needed, not 'much'"),
        ({"solver.settings": {"c1": 1e308}}, "solver.settings.c1: 1e+308 is not zero, nor between 1e-12 and 1e+12"),
        ({"solver.settings": {"antenna_sign": 1}}, "solver.settings.antenna_sign: a word is needed, not 1"),
        ({"solver.settings": {"population": 10**30}}, "solver.settings.population: 1000"),
        ({"solver.name": "ga", "solver.settings": {"tournament": 2.5}}, "solver.settings.tournament: a whole number"),
        ({"solver.name": "lshade", "solver.settings": {"memory_size": 10**9}}, "solver.settings.memory_size: 1000000"),
        ({"solver.population": 1}, "solver.settings: BSO needs a population of at least 2, not 1"),
        ({"solver.name": "ipopt", "solver.population": 20}, "solver.settings.population: ipopt has no such setting"),
        ({"solver.name": "ipopt", "solver.polish_starts": 2}, "solver.polish_starts: ipopt has nothing to polish"),
        ({"solver.name": "ipopt", "solver.settings": {"tolerance": 0.0}}, "solver.settings: tolerances are positive"),
    ],
    "path": [
        ({"task.points": [[1.0, 0.001 * i] for i in range(1001)]}, "task.count: a path of 1001 points ... at most"),
        ({"task.points": [[1.0, 0.0]]}, "task.points: ... at least 2 points"),
        ({"task.points": [[1.0, 0.0], [1.0, 0.0]]}, "task.points: points[0] and points[1] are the same"),
        ({"task.points": [[1.0, 0.0], [3.0, 0.0]]}, "task.points: points[1] ... 3 m from the base ... 2 m"),
        ({"task.accuracy": REMOVED}, "task.accuracy: missing"),
        ({"arm.link_lengths": [1.0, 1.0]} | PAPER, "arm.link_lengths: ... at least 3 links"),
        ({"model.pieces": 5} | SPLINE, "model.pieces: the points of a path decide about its pieces"),
        (TIMED, "model.motion: kind = 'path' is planned with"),
        *(({"task.angular_accuracy": 0.1} | motion, "task.angular_accuracy: this robot's tool has no orientation")
          for motion in (PAPER, SPLINE)),
    ],
    "joints": [
        *(({f"task.{end}_acceleration": [value, *others]} | motion, f"task.{end}_acceleration: {reason}")
          for end in ("start", "goal")
          for value, others, motion, reason in (
              (1.0, [], {}, "1 values for 3 joints"), (21.0, [0.0] * 2, {}, "joint 1: 21 is not within"),
              (1.0, [0.0] * 2, SPLINE, "needs motion = 'time"), (1.0, [0.0] * 2, PAPER, "needs motion = 'time"),
          )),
        ({"model.retime": True} | TIMED, "model.retime: motion = 'time-spline' keeps the timing"),
        ({"model.knots": 4} | TIMED, "model.knots: needs motion = 'paper' in [model]"),
        ({"model.formulation": "paper"} | TIMED, "model.formulation: 'paper' needs motion"),
        (VIA | TIMED, "task.via: needs motion = 'spline' in [model]"),
    ],
    "scene": [
        ({"arm.link_radius": [0.1]}, "arm.link_radius: 1 values for 3 links"),
        ({"arm.max_jerk": [1.0]}, "arm.max_jerk: 1 values for 3 links"),
        ({"arm.base": [0.0, 0.0, 1e9]}, "arm.base: 1e+09 is not within -1e+06 and 1e+06 rad"),
        ({"arm.base": [9.0, 9.0]}, "task.start: (1.2, 0.0) is 11.9097 m from the base, out of reach"),
        ({"arm.tool": [-0.5, 0.0]}, "arm.tool: the tool lies on the last joint"),
        ({"arm.tool": [-0.7, 0.01]}, "model.self_collision: link 2 and tool cannot keep 0.07 m: what joins them"),
        ({"model.margin": 0.5}, "model.self_collision: link 1 and link 3 cannot keep 0.56 m: what joins them"),
        ({"obstacles.0.shape": "elipse"}, "obstacles.0.shape: input should be 'ellipse', 'box', 'polygon', 'sphere', "),
        ({"obstacles.0.shape": "box"}, "obstacles.0.size: missing key"),
        ({"obstacles.0.shape": "nothing:Here"}, "obstacles.0.shape: "),
        ({"obstacles.1.sise": 1.0}, "obstacles.1.sise: unknown key; did you mean size?"),
        ({"obstacles.1.center": [0.1, -0.3]}, "obstacles: the base is 0.0"),
        ({"obstacles.1.center": [1.2, 0.07]}, "task.start: (1.2, 0.0) is 0.01"),
        ({"obstacles.1.velocity": [1.0, 2.0, 3.0]}, "obstacles.1.velocity: 3 numbers of an obstacle in 2 dimensions"),
        ({"obstacles.1.velocity": [1e9, 0.0]}, "obstacles.1.velocity: 1e+09 is not within -1e+08 and 1e+08 m/s"),
        ({"obstacles.1.margin_rate": 0.1}, "obstacles.1.margin_rate: the obstacle stands still"),
        ({"obstacles.1": BOX | {"velocity": [1, 0], "motion_rows": [[0] * 3, [1] * 3]}}, "obstacles.1.velocity: the"),
        ({"obstacles.1.motion_rows": []}, "obstacles.1.motion: rows of t,x,y or t,x,y,angle are needed"),
        ({"obstacles.1.motion_rows": [[0.0, 0.0, 0.0], [1.0]]}, "obstacles.1.motion: rows of t,x,y or t,x,y,angle are"),
        ({"obstacles.1.motion_rows": [[0.0] * 3] * 2}, "obstacles.1.motion: row 2: times have to increase"),
        ({"obstacles.2.points": [[0, 0], [1, 1], [1, 0], [0, 1]]}, "obstacles.2.points: the sides from points 1 and 3"),
        ({"task.angular_accuracy": 0.1}, "task.angular_accuracy: "),
        *(({"obstacles.1.velocity": [1, 0], "obstacles.1.margin_rate": rate}, "obstacles.1.margin_rate: ")
          for rate in (-0.1, 1e9)),
    ],
    "masses": [
        ({"task.objective": {"energy": 1.0, "problems.objectives:Energy": 2.0}}, "task.objective: the same ... twice"),
        ({"arm.max_torque": [1.0]}, "arm.max_torque: 1 values for 2 links"),
        ({"arm.link_masses": [1.0, 2.0, 3.0]}, "arm.link_masses: 3 values for 2 links"),
        ({"arm.payload": {"center": [0.0, 0.0]}}, "arm.payload.mass: missing key"),
        ({"arm.payload": {"mass": 1e10}}, "arm.payload.mass: 1e+10 is not within 0 and 1e+09 kg"),
        ({"arm.payload": {"mass": 1.0, "weight": 2.0}}, "arm.payload.weight: unknown key"),
        ({"arm.gravity": [0.0, -1e8]}, "arm.gravity: -1e+08 is not within"),
        *(
            ({"arm.link_masses": REMOVED, "arm.max_torque": REMOVED, "arm.link_inertias": REMOVED, f"arm.{key}": 1.0},
            f"arm.{key}: link_masses are needed with it")
            for key in ("max_torque", "link_centers", "link_inertias", "viscous_friction", "coulomb_friction")
        ),
    ],
    "settings": [
        ({"robot.settings.payload": {"mass": "1 kg"}}, "robot.settings.payload.mass: a number is needed, not '1 kg'"),
        ({"robot.settings.link_masses": [1.0]}, "robot.settings.link_masses: 1 values for 2 links"),
    ],
    "panda": [
        ({"robot.max_torque": [5.0, 5.0]}, "robot.max_torque: 2 values for 7 joints"),
        ({"robot.viscous_friction": [0.1]}, "robot.viscous_friction: 1 values for 7 joints"),
        ({"robot.payload": {"mass": 1.0, "inertia": 0.1}}, "robot.payload.inertia: "),
        ({"robot.payload": {"mass": 1.0, "inertia": [[1, 0, 0], [0, 1, 0], [0, 0, 3]]}}, "robot.payload.inertia: prin"),
        ({"robot.payload": {"mass": 100.0}}, "task.start: panda_joint6 needs "),
        ({"robot.tracking_error": 0.0}, "robot.tracking_error: ... zero everywhere"),
        ({"robot.tracking_error": 0.3}, "robot.tracking_error: ... more than 1 rad"),
        ({"robot.tracking_error": [0.01, 0.01]}, "robot.tracking_error: ... 2 values for 7 joints"),
        ({"robot.tracking_error": {"sped": 1.0}}, "robot.tracking_error.sped: unknown key; did you mean speed?"),
        ({"carried": [PART, PART]}, "carried.1.name: 'part' is there twice"),
        ({"carried.0.name": "panda_link5"}, "carried: the robot has a link 'panda_link5'"),
        ({"carried.0.velocity": [0.1, 0.0, 0.0]}, "carried.0.velocity: what is carried moves with"),
        ({"carried.0.margin_rate": 0.1}, "carried.0.margin_rate: what is carried is"),
        ({"carried.0.sise": 1.0}, "carried.0.sise: unknown key; did you mean size"),
        ({"carried": [{"shape": "half-space", "center": [0, 0, 0]}]}, "carried.0.shape: HalfSpace cannot be"),
        ({"carried": [{"center": [0, 0], "semi_axes": [1, 1]}]}, "carried.0.shape: Ellipse is in the plane"),
        ({"carried": [{"shape": "mesh"}]}, "carried.0.file: missing key"),
        ({"may_touch": [["panda_hand", "tabel"]]}, "may_touch.0: nothing is called 'tabel'; did"),
        ({"may_touch": [["table", "bin"]], "obstacles": [TABLE, BIN]}, "may_touch.0: both are obstacles"),
        ({"may_touch": [["panda_hand", "part"]], "obstacles.0.name": "part"}, "may_touch.0: an obstacle and a body"),
        ({"may_touch": [["panda_hand", "panda_hand"]]}, "may_touch.0: 'panda_hand' twice; a pair is of two"),
        ({"obstacles.0": {"shape": "box", "center": CENTER, "size": [0.2, 0.1]}}, "obstacles.0.size.2: missing key"),
        ({"obstacles.0": {"shape": "box", "center": [0, 0], "size": [0.2] * 3}}, "obstacles.0.center.2: missing key"),
        ({"obstacles.0.angle": 0.1}, "obstacles.0.angle: unknown key"),
        ({"obstacles.0": {"shape": "sphere", "center": [0, 0], "radius": 1.0}}, "obstacles.0.center.2: missing key"),
        ({"obstacles.0": BIN | {"quaternion": TURN}}, "obstacles.0.quaternion: unknown key"),
        ({"obstacles.0": {"shape": "spere", "center": CENTER}}, "obstacles.0.shape: ... 'spere'; did you mean sphere?"),
        ({"obstacles.0": HALF | {"center": [0.0, 0.0, 1e9]}}, "obstacles.0.center: 1e+09 is not within"),
        ({"obstacles.0": HALF | {"quaternion": [0, 0, 0, 2]}}, "obstacles.0.quaternion: ... length 1"),
        ({"obstacles.0": HALF | {"normal": [0, 0, 0]}}, "obstacles.0.normal: a vector of no length"),
        ({"obstacles.0": HALF | {"normal": [0, 0, 1], "quaternion": TURN}}, "obstacles.0.normal: the qu"),
        ({"obstacles.0": {"shape": "points", "file": "cloud.npy"}}, "obstacles.0.radius: missing key"),
        ({"obstacles.0": {"shape": "mesh", "name": "two\nlines"}}, "obstacles.0.name: a name of one line is needed"),
        ({"obstacles.0": {"shape": "polytope", "points": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}},
            "obstacles.0.points: ... in one plane"),
    ],
    "traced": [
        ({"task.points": [[0.4, 0.0, 0.5], [0.4, 0.1]]}, "task.points: points[1] has 2 numbers, points[0] has 3"),
        ({"task.points": [[0.4, 0.0, 0.5, 1.0]]}, "task.points.0: two numbers x,y are needed, three in space"),
        ({"task.angular_accuracy": 0.1}, "task.angular_accuracy: the path gives no orientations"),
        ({"task.elbow": "up"}, "task.elbow: of an arm in space the search chooses among all postures"),
        ({"task.points": [[1.0, 0.0, 0.0], [0.5, 0.0, 0.0]]}, "task.points: points[0]: inverse kinematics finds no"),
        (PAPER, "model.motion: a path in space is traced, with motion = \"spline\""),
    ],
    "urdf": [
        ({"robot.urdf": "none.urdf"}, "robot.urdf: "),
        ({"robot.urdf": "balls.toml"}, "robot.urdf: "),
        ({"robot.spheres": "short.urdf"}, "robot.spheres: "),
        ({"robot.srdf": "short.urdf"}, "robot.srdf: states nothing: no <group>, <group_state>, "),
        ({"task.start": "ready"}, "task.start: no posture 'ready': an srdf, a moveit_config or an MJCF names postures"),
        ({"robot.srdf": "balls.toml"}, "robot.srdf: no XML: "),
        ({"robot.tip_link": "elbow"}, "robot.tip_link: "),
        ({"robot.base_link": "elbow"}, "robot.base_link: "),
        ({"robot.max_acceleration": REMOVED}, "robot.max_acceleration: missing: none is known for joint 'turn'"),
        ({"robot.max_speed": [1.0]}, "robot.max_speed: 1 values for 2 joints"),
        ({"robot.joint_limits": [[0.0, 1.0]]}, "robot.joint_limits: 1 ranges for 2 joints"),
        ({"robot.joint_limits": [[1.0, 0.0], [0.0, 1.0]]}, "robot.joint_limits: "),
        ({"robot.base": {"quaternion": [0.0, 0.0, 0.0, 0.5]}}, "robot.base.quaternion: [0.0, 0.0, 0.0, 0.5] is not of"),
        ({"robot.tool": {"positon": [0.0, 0.0, 0.0]}}, "robot.tool.positon: unknown key"),
        ({"robot.base": {"position": [1e9, 0.0, 0.0]}}, "robot.base: 1e+09 is not within -1e+08 and 1e+08 m"),
        ({"robot.kept_pairs": [["foot", "head"]]}, "robot.kept_pairs: no spheres on link 'head'"),
        ({"robot.kept_pairs": [["foot", "foot"]]}, "robot.kept_pairs: 'foot' and 'foot' are one body: no joint is"),
        ({"robot.disabled_pairs": [["foot", "head"]]}, "robot.disabled_pairs: no spheres on link 'head'"),
        ({"robot.max_torque": 5.0}, f"robot.max_torque: {NO_MASSES}"),
        ({"robot.payload": {"mass": 1.0}}, f"robot.payload: {NO_MASSES}"),
        ({"robot.viscous_friction": 0.1}, f"robot.viscous_friction: {NO_MASSES}"),
        ({"robot.urdf": "mesh.urdf"}, f"robot.urdf: link 'lower': its mesh lower.stl is not read{UNREAD}"),
        ({"robot.urdf": "mesh.urdf", "robot.spheres": REMOVED},
            f"robot.urdf: link 'lower': its mesh lower.stl: there is no such file{UNREAD}"),
        ({"robot.urdf": "mesh.urdf", "robot.ignore_geometry": ["sail"]}, "robot.ignore_geometry: no link 'sail' in the "
            "chain; there are foot, "),
        ({"robot.spheres": REMOVED, "obstacles": [BIN]}, "obstacles: no collision geometry of a link that moves is"),
    ],
}  # fmt: skip
IN_FILES: dict[str, list[tuple[dict[str, Any], str]]] = {  # of keys and forms that calls in Python have not
    "point": [
        ({"model": 3}, "model"),
        ({"arm.max_sped": 1.0}, "arm.max_sped: unknown key; did you mean max_speed?"),
        ({"robbot": {}}, "robbot: unknown key; did you mean robot?"),
        ({"arm": REMOVED}, "arm: missing key"),
        ({"task.objective": ""}, "task.objective: input should be 'time', ... not ''"),
        ({"task.elbow": nested(5000)}, "task.elbow: input should be 'up', 'down' or 'free', not [["),
        ({"arm": REMOVED, "robot": {"model": 3, "max_speed": 1.0}}, "robot.model: a word is needed, not 3"),
        ({"task.kind": REMOVED}, "task: needs kind"),
        ({"task.kind": "dance"}, "task: needs kind"),
        ({"task.kind": "a{b}:c"}, "task: cannot load task 'a{b}:c'"),
        ({"task": 3}, "task: needs kind"),
        ({"task.radius": 1.0}, "task.radius: unknown key"),
        ({"task.start": [date(1979, 5, 27), 0.0]}, "task.start.0: a number is needed, not 1979-05-27"),
        ({"task.start": nested(5000)}, "task.start.1: missing key"),
        ({"task.start": "home"}, "task.start: no posture 'home': an srdf, a moveit_config or"),
        ({"task.goal": []}, "task.goal"),
        ({"task.goal": [[0.5, 1.0], 3]}, "task.goal.1: [x, y], { joints"),
        ({"task.via": [1.0, 0.5]}, "task.via.0: [x, y], { joints"),
        ({"obstacles.0.motion": "cart.csv"}, "obstacles.0.motion: 'cart.csv' has not been read; only a scenario"),
        ({"arm": REMOVED, "robot": {"urdf": "short.urdf"}}, "robot.urdf: 'short.urdf' has not been read; only a"),
    ],
    "panda": [
        ({"robot.link_masses": 1.0}, "robot.link_masses: unknown key"),
    ],
    "path": [
        ({"task.points": "letter.csv"}, "task.points: ... has not been read"),
        ({"task.shape": "heart"}, "task: needs kind"),
    ],
    "urdf": [
        ({"robot.urdf": REMOVED}, "robot.model: one of model, moveit_config and urdf is needed"),
        ({"robot.model": "panda"}, "robot.model: one of model, moveit_config and urdf is needed, and no m"),
        ({"robot": {"model": "pandda"}}, "robot.model: no robot 'pandda'; did you mean panda?"),
        ({"robot.urdf": "../short.urdf"}, "robot.urdf: "),
        ({"task.start": [0.4, 0.0, 0.4]}, "task.start: a point in space is { position = [x, y, z] }, not"),
    ],
    "joints": [  # of both tables of constraints
        *(({key: [table]}, f"{key}.0.{said}") for key in ("constraints", "model.constraints") for table, said in (
            ({"kind": "uprigt"}, "kind: ... 'upright', ... , not 'uprigt'; did you mean upright?"),
            (UPRIGHT | {"axes": [1, 0]}, "axes: unknown key; did you mean axis?"),
            (UPRIGHT | {"axis": [1]}, "axis: ... at least 2 items"),
            ({"kind": "tool region", "size": [1, 0]}, "size.1: ... greater than 0, not 0"),
            (SPEED | {"name": "a:b"}, "name: a name in printable characters"),
            ({"name": "own"}, "expression: missing key"),
        )),
        *(({"constraints": [table]}, f"model.constraints.0.{said}") for table, said in (
            (UPRIGHT | {"axis": [1, 0], "toward": [0, 1], "tolerance": 30.0}, "tolerance: 30 is not within"),  # rad
            (SPEED | {"max": 1e7}, "max: 1e+07 is not within"),
            ({"kind": "tool region"}, "center: say a box"),
            ({"kind": "tool region", "center": [0, 0]}, "size: missing beside center"),
        )),
        ({"constraints": [UPRIGHT]}, "model.constraints: 'upright': axis has 3 coordinates, for a robot in 2 dim"),
        ({"constraints": [SPEED, SPEED | {"max": 0.5}]}, "... 'tool speed' is there twice; give each a name of"),
        ({"constraints": [SPEED], "model.constraints": [SPEED]}, "... 'tool speed' is there twice"),
    ],
    "star": [
        ({"task.radius": REMOVED}, "task.radius: missing"),
        ({"task.waves": 3}, "task.waves: unknown key"),
    ],
}  # fmt: skip
OUT_OF_BOUNDS: dict[str, dict[str, list[Any]]] = {
    "point": {
        "arm.link_lengths": [[1.0], [0.5] * 3000, [0.5, 0.0, 0.5], [0.5, nan]],
        "arm.max_speed": [0.0, inf, 1e308, True],
        "task.start": [[1e300, 0.0], [10**400, 0.0], [10**5000, 0.0], [nested(150), 0.0]],
        "task.elbow": ["left", "\udcff"],
        "task.segment_time": [[1.0, 0.5]],
        "obstacles.0.semi_axes": [[0.0, 1.0]],
        "model.samples": [1, 10_001, 50.5],
        "model.formulation": ["poem"],
        "solver.seed": [-1, 2**63],
        "solver.population": [10**30],
        "solver.polish_starts": [10**30],
        "solver.evaluations": [0, 10**10],
        "solver.time_limit": [0.0, 1e308],
    },
    "path": {
        "task.accuracy": [0.0],
        "task.count": [1],
        "task.points": [[[1.0, 0.0], [1.0]]],
        "model.knots": [1],
        "model.redundancy_values": [101],
        "model.knot_redundancy": ["some"],
    },
    "star": {"task.radius": [-1.0], "task.count": [3, 1001]},
    "scene": {
        "arm.link_radius": [-0.1],
        "arm.max_jerk": [0.0],
        "arm.base": [[1.0], [0.0, "up"]],
        "arm.tool": [[0.1]],
        "model.margin": [-0.1],
        "model.self_collision": [1],
        "obstacles.1.size": [[0.1, 0.0]],
        "obstacles.1.velocity": [[1.0], [1.0] * 4, [inf, 0.0], [1e13, 0.0]],
        "obstacles.1.motion": [3, ""],
        "obstacles.2.points": [[[0.0, 0.0], [1.0, 0.0]], [[1.0, "x"]] * 3],
    },
    "masses": {
        "arm.max_torque": [0.0],
        "arm.link_masses": [-1.0, [1.0, 0.0]],
        "arm.link_inertias": [[0.1, -0.1]],
        "arm.viscous_friction": [-0.1],
        "arm.payload": [{"mass": -1.0}, {"mass": 1.0, "center": [0.0, 0.0, 0.1]}, 3.0],
        "arm.gravity": [[0.0, 0.0, -9.81]],
    },
    "panda": {
        "robot.max_torque": [-5.0],
        "robot.coulomb_friction": [-0.1],
        "robot.gravity": [[0.0, -9.81]],
        "robot.tracking_error": [-0.1, {"speed": "x"}],
        "carried.0.mass": [-1.0],
        "may_touch": [[["panda_hand"]]],
    },
}

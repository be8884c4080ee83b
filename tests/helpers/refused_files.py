"""What is refused of a file that a scenario or a call names, as (its text, the line): of each kind of file."""

from __future__ import annotations

from typing import Any

PLANE = {"link_lengths": [1.0, 1.0, 1.0], "max_speed": 4.0, "max_acceleration": 20.0}
MOVE = {"kind": "point-to-point", "start": [1.6, -0.6], "goal": [0.6, 1.6]}
READY = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
IN_SPACE = {"kind": "point-to-point", "start": {"joints": READY}, "goal": {"joints": [1.2, *READY[1:]]}}
CART = {"shape": "box", "center": [2.5, 0.5], "size": [0.2, 0.4], "motion": "named.csv"}
CRATE = {"shape": "box", "center": [0.0, 0.0, 0.0], "size": [0.2, 0.1, 0.2], "motion": "named.csv"}
NAMING = {  # the key that the line names
    "points": "task.points",
    "poses": "task.",
    "joints": "task.joints",
    "motion": "obstacles.0.motion",
    "motion in space": "obstacles.0.motion",
}
SCENES: dict[str, dict[str, Any]] = {  # each names named.csv
    "points": {"arm": PLANE, "task": {"kind": "path", "accuracy": 0.05, "points": "named.csv"}},
    "poses": {"robot": {"model": "panda"}, "task": {"kind": "path", "accuracy": 0.005, "points": "named.csv"}},
    "joints": {"arm": PLANE | {"link_lengths": [1.0, 1.0]}, "task": {"kind": "joint-path", "joints": "named.csv"}},
    "motion": {"arm": PLANE, "task": MOVE, "obstacles": [CART]},
    "motion in space": {"robot": {"model": "panda"}, "task": IN_SPACE, "obstacles": [CRATE]},
}
REFUSED_FILES: dict[str, list[tuple[str, str]]] = {
    "points": [
        ("1,0\none,1\n", "named.csv line 2: two numbers x,y are needed"),
        ("1,0\n1\n", "named.csv line 2: two numbers x,y are needed"),
        ("1,0\n1,2,3\n", "named.csv line 2: two numbers x,y are needed"),
        ("1,0\n1,nan\n", "named.csv line 2: a number is not finite, or larger than 1e+12"),
        ("1,0\n1,1e13\n", "larger than 1e+12"),
        ("", "at least 2 points"),
        ("1,0\n1,1\n3,1\n", "points[2] = (3.0, 1.0) is 3.16228 m from the base, out of reach: the arm reaches 3 m"),
    ],
    "poses": [
        ("x,y,z\n0.4,0,0.5\n0.4,1_0,0.5\n", "named.csv line 3: three numbers x,y,z are needed"),
        ("x,y,z\n0.4,0,0.5\n0.4,0.1\n", "named.csv line 3: three numbers x,y,z are needed"),
        ("0.4,0,0.5,1\n", "named.csv line 1: two numbers x,y are needed, three in space, seven of a pose"),
        ("0.4,0,0.5,1,0,0,0\n0.4,0.1,0.5,1,0,0,one\n", "named.csv line 2: seven numbers x,y,z,qx,qy,qz,qw are needed"),
        ("0.4,0,0.5,1,0,0,0\n0.4,0.1,0.5,1,0,0,0.5\n", "task.points: points[1]: its quaternion"),
        ("0.4,0,0.5,1,0,0,0\n0.4,0.1,0.5,0,1,0,0\n", "task.points: points[0] and points[1]: the tool turns by"),
        ("0.4,0,0.5,1,0,0,0\n0.4,0.1,0.5,1,0,0,0\n", "task.angular_accuracy: missing: the path gives poses"),
        ("0.4,0\n0.4,0.1\n", "task.points: points[0] has 2 coordinates; the robot is in 3 dimensions"),
        ("0.4,0,0.5\n0.4,0,9\n", "task.points: points[1] = (0.4, 0.0, 9.0) is 9.00888 m from the base, out of reach"),
    ],
    "joints": [
        ("", "named.csv: is empty; the header"),
        ("0,1\n1,2\n", "named.csv: line 1: the header q1,q2,... or t,q1,q2,... is needed"),
        ("q1,q3\n0,1\n", "named.csv: line 1: the columns of all joints are needed; q of 2 is missing"),
        ("q1,Q2\n0,1\n", "named.csv: line 1: 'Q2' is no column of "),
        ("q1,q2,t\n0,1,2\n", "named.csv: line 1: 't' is no column of "),
        ("t\n0\n", "named.csv: line 1: the header"),
        ("q1,q2\n0,1\n", "named.csv: 1 row; a motion needs two at least"),
        ("q1,q2\n", "named.csv: 0 rows"),
        ("q1,q2\n0,1\n\n0,1,2\n", "named.csv: line 4: 3 numbers where the header has 2 names"),
        ("q1,q2\n0,1\n0\n", "named.csv: line 3: 1 numbers where the header has 2 names"),
        ("q1,q2\n0,1\n0,x\n", "named.csv: line 3: a number is needed in column 'q2'"),
        ("q1,q2\n0,1\n0,1_0\n", "named.csv: line 3: a number is needed in column 'q2'"),
        ("q1,q2\n0,1\n0,nan\n", "named.csv: line 3: a number is not finite"),
        ("q1,q2\n0,1\n0,1e7\n", "named.csv: an angle is larger than 1e+06"),
        ("q1,q2\n0,1\n0,1\n1,1\n", "named.csv: row 2: the same joint angles as in the row before"),
        ("t,q1\n0,1\n0,2\n", "named.csv: row 2: times have to increase"),
        ("t,q1\n0,1\nnan,2\n", "named.csv: line 3: "),
        ("t,q1\n0,1\n1,1\n", "named.csv: 1 row of different"),
    ],
    "motion": [
        ("", "named.csv: is empty; the header t,x,y or t,x,y,angle is needed"),
        ("\n \n", "named.csv: is empty"),
        (
            "x,y\n0,1\n1,1\n",
            "named.csv line 1: the header t,x,y or t,x,y,angle is needed of an obstacle in 2 dimensions",
        ),
        ("\nt,x,y,z\n0,1,1,1\n1,1,1,1\n", "named.csv line 2: the header"),
        ("t,x,y\n", "named.csv: 0 rows; a motion needs two at least"),
        ("t,x,y\n0,0,0\n", "named.csv: 1 rows; a motion needs two at least"),
        ("t,x,y\n0,0,0\n1,0\n", "named.csv line 3: 2 numbers where the header has 3 names"),
        ("t,x,y\n0,0,0\n1,0,zero\n", "named.csv line 3: 3 numbers are needed"),
        ("t,x,y\n0,0,0\n1,0,1_0\n", "named.csv line 3: 3 numbers are needed"),
        ("t,x,y\n0,0,0\n1,0,nan\n", "named.csv line 3: a number is not finite"),
        ("t,x,y\n0,0,0\n1,0,inf\n", "named.csv line 3: a number is not finite"),
        ("t,x,y\n0,0,0\n1,0,1e9\n", "named.csv line 3: 1e+09 is not within -1e+08 and 1e+08 m"),
        ("t,x,y\n0,0,0\n1e10,0,0\n", "named.csv line 3: t = 1e+10 s is not within -1e+09 and 1e+09 s"),
        ("t,x,y\n0,0,0\n\n1,0,0\n1,0,0\n", "named.csv line 5: times have to increase, by 1e-06 s at least"),
        ("t,x,y\n1,0,0\n0,0,0\n", "named.csv line 3: times have to increase"),
        ("t,x,y,angle\n0,0,0,0\n1,0,0,1e7\n", "named.csv line 3: 1e+07 is not within -1e+06 and 1e+06 rad"),
        ("t,x,y\n0,0,0\n1e-6,1e7,0\n", "named.csv: row 2: faster than 1e+08 m/s or rad/s"),
    ],
    "motion in space": [
        (
            "t,x,y,z,qx,qy,qz,qw\n0,0.5,0.5,0.5,0,0,0,1\n1,0.5,0.5,0.5,0,0,0.5,0.5",
            "named.csv line 3: quaternion of length 0.707107, not 1",
        ),
        (
            "t,x,y,z,qx,qy,qz,qw\n0,0.5,0.5,0.5,0,0,0,0\n1,0.5,0.5,0.5,0,0,0,1",
            "named.csv line 2: quaternion of length 0, not 1",
        ),
        (
            "t,x,y,z,qx,qy,qz,qw\n0,0.5,0.5,0.5,0,0,0,1\n1,0.5,0.5,0.5,1,0,0,0",
            "named.csv line 3: turned by more than 90 degrees from the row before",
        ),
    ],
}

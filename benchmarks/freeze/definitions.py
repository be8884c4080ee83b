"""The functions of the suites: how the scenario of an instance is drawn.

A function is a kind of task for a kind of robot; its instances differ in robots, postures and obstacles, never in the
structure of the model. Obstacles are drawn where the arm passes on the straight line between the postures at the ends,
clear of both. What is drawn here is tables of scenario files; :mod:`benchmarks.freeze.freezing` keeps those that can
be done.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np

from tpbso_casadi.suite import SUITES
from tpbso_casadi.suite.kernels import FloatArray

Tables = dict[str, Any]
Draw = Callable[[np.random.Generator], Tables]
Form = Literal["penalised", "constrained", "two objectives"]

NEWEST = SUITES[-1]  # the suite that is made now
MENDED = ("energy-3", "time-energy-3")  # functions that are others in the newest suite than in the one before
INSTANCES = 15  # of each function
REACH = 2.0  # m, of planar arms, about
DECIMALS = 4  # of what is drawn
TRIES = 1000  # of a place for an obstacle
ROOM = 0.05  # m between an obstacle and the arm at both ends, at least


class NoPlace(Exception):
    """No place was found for an obstacle; the instance is drawn again."""


@dataclass(frozen=True, kw_only=True)
class Definition:
    """A function.

    Attributes:
        name: of it.
        group: of functions that are judged together.
        title: what it is.
        draw: the tables of one instance's scenario.
        form: how constraints and objectives are seen by a solver.
        fine: of a coarse function the one whose instances it has, with fewer samples.
        samples: of a coarse one.
    """

    name: str
    group: str
    title: str
    draw: Draw
    form: Form = "penalised"
    fine: str = ""
    samples: int = 0


def rounded(values: FloatArray | float) -> Any:
    """Numbers as a file states them."""
    return np.round(values, DECIMALS).tolist()


def arm(rng: np.random.Generator, links: int, spread: float = 0.25, **further: Any) -> Tables:
    """A planar arm that reaches about 2 m, in links whose lengths differ by so much."""
    return {
        "link_lengths": rounded(REACH / links * rng.uniform(1.0 - spread, 1.0 + spread, links)),
        "max_speed": rounded(rng.uniform(2.5, 5.0, links)),
        "max_acceleration": rounded(rng.uniform(12.0, 30.0, links)),
        **further,
    }


def heavy_arm(rng: np.random.Generator, links: int, **further: Any) -> Tables:
    """The same with masses: uniform rods of 2 kg/m, less towards the tool."""
    stated = arm(rng, links, **further)
    lengths = np.array(stated["link_lengths"])
    return {**stated, "link_masses": rounded(2.0 * lengths * np.linspace(1.0, 0.5, links))}


def motors(stated: Tables, payload: float, spare: float = 1.6) -> Tables:
    """The arm with a payload and motors that hold it stretched out, ``spare`` times."""
    lengths, masses = np.array(stated["link_lengths"]), np.array(stated["link_masses"])
    ends = np.cumsum(lengths)
    before = ends - lengths
    moments = [
        sum(masses[k:] * ((ends + before)[k:] / 2.0 - before[k])) + payload * (ends[-1] - before[k])
        for k in range(len(lengths))
    ]
    torques = rounded(spare * 9.81 * np.array(moments))
    return {**stated, "payload": {"mass": payload}, "max_torque": torques}


def ends_of(rng: np.random.Generator, links: int) -> tuple[FloatArray, FloatArray]:
    """Two postures of a planar arm, (links,) each, rad: one and a half radians apart in the first joint, about."""
    start = rng.uniform(-1.2, 1.2, links)
    start[0] = rng.uniform(-np.pi, np.pi)
    change = rng.choice([-1.0, 1.0]) * np.concatenate([[1.6], rng.uniform(-0.9, 0.9, links - 1)])
    return start, start + change * rng.uniform(0.8, 1.2, links)


def skeleton(stated: Tables, theta: FloatArray) -> FloatArray:
    """Base, joints and tip at a posture (k,): (k + 1, 2), m."""
    psi = np.cumsum(theta)
    steps = np.array(stated["link_lengths"])[:, None] * np.column_stack([np.cos(psi), np.sin(psi)])
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def distance(points: FloatArray, centre: FloatArray) -> float:
    """Of a polyline (n, 2) from a point (2,), m."""
    first, along = points[:-1], np.diff(points, axis=0)
    share = ((centre - first) * along).sum(axis=1) / (along**2).sum(axis=1)
    nearest = first + np.clip(share, 0.0, 1.0)[:, None] * along
    return float(np.linalg.norm(nearest - centre, axis=1).min())


def ellipse_in_the_way(
    rng: np.random.Generator, stated: Tables, ends: tuple[FloatArray, FloatArray], size: tuple[float, float]
) -> Tables:
    """An ellipse on the outer half of the arm somewhere on the straight line between two postures."""
    return ellipse_at(
        rng,
        stated,
        ends,
        size,
        lambda: _outer_point(rng, skeleton(stated, ends[0] + rng.uniform(0.3, 0.7) * (ends[1] - ends[0]))),
    )


def _outer_point(rng: np.random.Generator, points: FloatArray) -> FloatArray:
    place = rng.uniform(0.6, 1.0) * (len(points) - 1)
    below = min(int(place), len(points) - 2)
    return np.asarray(points[below] + (place - below) * (points[below + 1] - points[below]))


def ellipse_around(
    rng: np.random.Generator, stated: Tables, ends: tuple[FloatArray, FloatArray], size: tuple[float, float]
) -> Tables:
    """An ellipse somewhere on a ring at half the reach: the same links come near it in every instance."""

    def place() -> FloatArray:
        radius, angle = REACH / 2.0 * rng.uniform(1.0, 1.12), rng.uniform(-np.pi, np.pi)
        return np.array([radius * np.cos(angle), radius * np.sin(angle)])

    return ellipse_at(rng, stated, ends, size, place)


def ellipse_at(
    rng: np.random.Generator,
    stated: Tables,
    ends: tuple[FloatArray, FloatArray],
    size: tuple[float, float],
    place: Callable[[], FloatArray],
) -> Tables:
    """An ellipse at a drawn place that is clear of the arm at both ends.

    Raises:
        NoPlace: there is none.
    """
    for _ in range(TRIES):
        centre, axes = place(), rng.uniform(*size, 2)
        if all(distance(skeleton(stated, theta), centre) > axes.max() + ROOM for theta in ends):
            return {"center": rounded(centre), "semi_axes": rounded(axes), "angle": rounded(rng.uniform(0.0, np.pi))}
    raise NoPlace


def slot(stated: Tables, goal: FloatArray, gap: float) -> list[Tables]:
    """Two boxes along both sides of the last link at the goal."""
    *_, joint, tip = skeleton(stated, goal)
    along = (tip - joint) / np.linalg.norm(tip - joint)
    normal = np.array([-along[1], along[0]])
    length, width = 0.5 * float(np.linalg.norm(tip - joint)), 0.08
    middle = tip - 0.3 * length * along
    return [
        {
            "shape": "box",
            "center": rounded(middle + side * (gap + width) / 2.0 * normal),
            "size": rounded(np.array([length, width])),
            "angle": rounded(np.arctan2(along[1], along[0])),
        }
        for side in (-1.0, 1.0)
    ]


def joints(theta: FloatArray) -> Tables:
    """A place that is a posture."""
    return {"joints": rounded(theta)}


def paper(rng: np.random.Generator, links: int, objective: str, formulation: str, obstacles: int = 0) -> Tables:
    """The paper's point-to-point case: two points of the tool, a quartic and a quintic."""
    stated, ends = arm(rng, links), ends_of(rng, links)
    points = [rounded(skeleton(stated, theta)[-1]) for theta in ends]
    task = {"kind": "point-to-point", "start": points[0], "goal": points[1], "objective": objective, "elbow": "up"}
    placed = [ellipse_in_the_way(rng, stated, ends, (0.05, 0.15)) for _ in range(obstacles)]
    model = {"motion": "paper", "formulation": formulation}
    return {"arm": stated, "task": task, "obstacles": placed, "model": model}


def path(rng: np.random.Generator, shape: Tables, objective: str, formulation: str) -> Tables:
    """The paper's path case: three links along a closed curve around the base."""
    lengths = rounded(rng.uniform(0.9, 1.15, 3))
    stated = {"link_lengths": lengths, "max_speed": 100.0, "max_acceleration": 3000.0}
    size = {"radius": rounded(np.array(shape["radius"] * rng.uniform(0.85, 1.1)))}
    centre = rounded(rng.uniform(-0.15, 0.15, 2))
    task = {"kind": "path", "objective": objective, "elbow": "up", "accuracy": 0.1, **shape, **size, "center": centre}
    return {"arm": stated, "task": task, "model": {"motion": "paper", "formulation": formulation}}


STAR = {"shape": "pentagram", "radius": 0.9}
CURVE = {"shape": "closed-curve", "radius": 1.4, "waves": 6, "depth": -0.3}


def spline(
    rng: np.random.Generator,
    links: int,
    few: int = 0,
    many: int = 0,
    motion: str = "spline",
    objective: Any = "time",
    make: Callable[..., Tables] = arm,
    **further: Any,
) -> Tables:
    """From posture to posture among ellipses: ``few`` in the way, ``many`` small ones around the base."""
    stated, ends = make(rng, links, **further), ends_of(rng, links)
    placed = [ellipse_in_the_way(rng, stated, ends, (0.05, 0.16)) for _ in range(few)]
    placed += [ellipse_around(rng, stated, ends, (0.04, 0.1)) for _ in range(many)]
    return move(stated, ends, placed, motion, objective)


def move(
    robot: Tables,
    ends: tuple[FloatArray, FloatArray],
    obstacles: list[Tables],
    motion: str = "spline",
    objective: Any = "time",
) -> Tables:
    """The scenario of a move from posture to posture."""
    task = {"kind": "point-to-point", "start": joints(ends[0]), "goal": joints(ends[1]), "objective": objective}
    table = "robot" if "model" in robot else "arm"
    return {table: robot, "task": task, "obstacles": obstacles, "model": {"motion": motion}}


def lifting(rng: np.random.Generator, links: int, motion: str = "spline") -> Tables:
    """With a payload and motors that can just hold it, around an ellipse."""
    stated, ends = motors(heavy_arm(rng, links), payload=rounded(rng.uniform(0.5, 2.0))), ends_of(rng, links)
    return move(stated, ends, [ellipse_in_the_way(rng, stated, ends, (0.05, 0.15))], motion)


def narrow(rng: np.random.Generator, links: int) -> Tables:
    """Into a slot little wider than what has to go in, past an ellipse."""
    stated, ends = arm(rng, links, link_radius=0.02), ends_of(rng, links)
    boxes = slot(stated, ends[1], gap=float(rng.uniform(0.1, 0.16)))
    return move(stated, ends, [*boxes, ellipse_in_the_way(rng, stated, ends, (0.05, 0.1))])


def crossing(rng: np.random.Generator, links: int, count: int) -> Tables:
    """Past ellipses that cross the way about when the arm would."""
    stated, ends = arm(rng, links), ends_of(rng, links)
    obstacles = []
    for _ in range(count):
        placed = ellipse_in_the_way(rng, stated, ends, (0.06, 0.15))
        speed, angle, when = rng.uniform(0.3, 1.2), rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 0.9)
        velocity = speed * np.array([np.cos(angle), np.sin(angle)])
        first = np.array(placed["center"]) - when * velocity
        obstacles.append({**placed, "center": rounded(first), "velocity": rounded(velocity)})
    return move(stated, ends, obstacles)


HOME = {
    "panda": np.array([0.0, 0.3, 0.0, -1.9, 0.0, 2.2, 0.785]),
    "ur5e": np.array([0.0, -1.5, 1.5, -1.5, -1.57, 0.0]),
}


def in_space(rng: np.random.Generator, model: str, boxes: int, motion: str = "spline", **further: Any) -> Tables:
    """An arm in space swings around its base; boxes stand where its hand would pass, and around."""
    home, half = HOME[model], rng.uniform(0.5, 0.8)
    ends = tuple(home + rng.uniform(-0.2, 0.2, home.size) * (np.arange(home.size) > 0) for _ in range(2))
    for theta, side in zip(ends, (-1.0, 1.0), strict=True):
        theta[0] = side * half
    placed = []
    for number in range(boxes):
        angle = rng.uniform(-0.15, 0.15) if number == 0 else rng.uniform(-np.pi, np.pi)
        radius, height = (rng.uniform(0.4, 0.6), rng.uniform(0.4, 0.8)) if number == 0 else rng.uniform(0.3, 0.8, 2)
        size = np.array([*rng.uniform(0.1, 0.25, 2), height])
        centre = np.array([radius * np.cos(angle), radius * np.sin(angle), height / 2.0])
        placed.append({"shape": "box", "center": rounded(centre), "size": rounded(size)})
    return move({"model": model, **further}, (ends[0], ends[1]), placed, motion)


ENERGY = {"time": 1.0, "energy": 0.002}
TIME_PAPER = partial(paper, objective="time", formulation="paper")
TIME_REDUCED = partial(paper, objective="time", formulation="reduced")
LENGTH = partial(paper, objective="length", obstacles=1)
ENERGETIC = partial(spline, few=1, make=heavy_arm, objective=ENERGY)
CLUTTER = partial(spline, few=1, many=8, spread=0.15)
FUNCTIONS: dict[str, dict[str, tuple[str, Draw]]] = {
    "paper": {
        "paper-time-3": ("least time, 3 links, as printed", partial(TIME_PAPER, links=3)),
        "paper-time-5": ("least time, 5 links, as printed", partial(TIME_PAPER, links=5)),
        "paper-rotation-4": (
            "least joint rotation, 4 links, as printed",
            partial(paper, links=4, objective="rotation", formulation="paper"),
        ),
        "paper-obstacle-4": (
            "shortest way around an ellipse, 4 links, as printed",
            partial(LENGTH, links=4, formulation="paper"),
        ),
        "reduced-time-3": ("least time, 3 links, time scaled", partial(TIME_REDUCED, links=3)),
        "reduced-time-5": ("least time, 5 links, time scaled", partial(TIME_REDUCED, links=5)),
        "reduced-rotation-4": (
            "least joint rotation, 4 links, time scaled",
            partial(paper, links=4, objective="rotation", formulation="reduced"),
        ),
        "reduced-obstacle-4": (
            "shortest way around an ellipse, 4 links, time scaled",
            partial(LENGTH, links=4, formulation="reduced"),
        ),
    },
    "path": {
        "star-time": (
            "along a star in least time, as printed",
            partial(path, shape=STAR, objective="time", formulation="paper"),
        ),
        "star-rotation": (
            "along a star with least joint rotation, time scaled",
            partial(path, shape=STAR, objective="rotation", formulation="reduced"),
        ),
        "curve-time": (
            "along a closed curve in least time, time scaled",
            partial(path, shape=CURVE, objective="time", formulation="reduced"),
        ),
        "curve-rotation": (
            "along a closed curve with least joint rotation, as printed",
            partial(path, shape=CURVE, objective="rotation", formulation="paper"),
        ),
    },
    "spline": {
        "spline-2": ("2 links around an ellipse", partial(spline, links=2, few=1)),
        "spline-3": ("3 links around 2 ellipses", partial(spline, links=3, few=2)),
        "spline-5": ("5 links around 2 ellipses", partial(spline, links=5, few=2)),
        "spline-7": ("7 links around 2 ellipses", partial(spline, links=7, few=2)),
        "clutter-3": ("3 links among 9 ellipses", partial(CLUTTER, links=3)),
        "clutter-5": ("5 links among 9 ellipses", partial(CLUTTER, links=5)),
        "rotation-5": (
            "least joint rotation, 5 links around 2 ellipses",
            partial(spline, links=5, few=2, objective="rotation"),
        ),
    },
    "narrow": {
        "narrow-3": ("3 links into a slot", partial(narrow, links=3)),
        "narrow-5": ("5 links into a slot", partial(narrow, links=5)),
    },
    "dynamics": {
        "jerk-3": (
            "3 links with limits of the jerk",
            partial(spline, links=3, few=1, motion="time-spline", max_jerk=250.0),
        ),
        "torque-3": ("3 links lift a payload", partial(lifting, links=3)),
        "energy-3": ("time and energy in one sum, 3 links", partial(ENERGETIC, links=3)),
    },
    "moving": {
        "moving-3": ("3 links past 2 ellipses that move", partial(crossing, links=3, count=2)),
        "moving-5": ("5 links past 3 ellipses that move", partial(crossing, links=5, count=3)),
    },
    "space": {
        "ur5e-box": ("a UR5e around a box", partial(in_space, model="ur5e", boxes=1)),
        "panda-boxes": ("a Panda among 3 boxes", partial(in_space, model="panda", boxes=3)),
        "panda-payload": (
            "a Panda lifts 3 kg over a box",
            partial(in_space, model="panda", boxes=1, payload={"mass": 3.0}),
        ),
    },
    "constrained": {
        "constrained-3": (
            "3 links around an ellipse, all limits constraints",
            partial(spline, links=3, few=1, motion="time-spline"),
        ),
        "constrained-5": (
            "5 links around 2 ellipses, all limits constraints",
            partial(spline, links=5, few=2, motion="time-spline"),
        ),
        "constrained-torque-3": (
            "3 links lift a payload, all limits constraints",
            partial(lifting, links=3, motion="time-spline"),
        ),
    },
    "two objectives": {
        "time-energy-3": ("time against energy, 3 links around an ellipse", partial(ENERGETIC, links=3)),
        "time-length-4": (
            "time against the way of the tool, 4 links around an ellipse",
            partial(spline, links=4, few=1, objective={"time": 1.0, "length": 0.5}),
        ),
    },
}
FORMS: dict[str, Form] = {"constrained": "constrained", "two objectives": "two objectives"}  # of groups; else penalised
COARSE = {"reduced-obstacle-4": 12, "ur5e-box": 30}  # samples, where the fine function has 50 and 60


def definitions() -> Iterator[Definition]:
    """All functions, the coarse ones last."""
    for group, functions in FUNCTIONS.items():
        for name, (title, draw) in functions.items():
            yield Definition(name=name, group=group, title=title, draw=draw, form=FORMS.get(group, "penalised"))
    for group, functions in FUNCTIONS.items():
        for name, (title, draw) in functions.items():
            if name in COARSE:
                coarse = f"{title}, fewer samples"
                yield Definition(
                    name=f"{name}-coarse", group=group, title=coarse, draw=draw, fine=name, samples=COARSE[name]
                )


DEFINITIONS = tuple(definitions())

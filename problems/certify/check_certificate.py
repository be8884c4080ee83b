"""Check a certificate of a robot's motion: python check_certificate.py FILE. Needs NumPy, and nothing else.

Exit status 0: everything that the file claims is proven for all t. 1: something is not; the first is named. 2: no
certificate. What is claimed follows from the numbers of robot, obstacles and motion alone; the file only adds into
which cells of time, and balls around balls, a proof is divided. docs/reference/certificate.md has the format,
docs/explanation/proof.md the lemmas that are referred to here.

Of rounding: a value computed with no more than N roundings on the way from any number that it depends on is within
2 N u of the sum of the sizes of its terms, u = 2^-53 (lemma 1). SLACK is that for N = 2048. A comparison that decides
is written so that what is no number fails.
"""

import gzip
import json
import sys
import zlib
from collections.abc import Sequence
from math import comb, inf, perm
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Whole: TypeAlias = NDArray[np.intp]

FORMAT, VERSION = "tpbso-casadi certificate", 1
U, SLACK, TINY = 2.0**-53, 2.0**-41, 1e-300
LARGEST, HUGE, MOST_BYTES, MOST_DEGREE = (
    1e6,
    1e200,
    1 << 30,
    24,
)  # of a number in the file, of the file, of a polynomial
UNIT = 1e-9  # how far a matrix may be from a rotation, and an axis from length 1
HALVINGS, AT_ONCE, DEGREE = 48, 5_000, 3
RATES = ("speed", "acceleration", "jerk", "torque")
MOST = {"limits": 1e-6, "position": 1e-6, "speed": 1e-4, "acceleration": 1e-1}  # tolerances that a file may state
SIZES = {"ball": 1, "box": 3, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "half-space": 0, "polytope": 0}
ASSUMED = """the robot, the scene and the motion are those in the file: compare its numbers with what you have
bodies are rigid, and the balls of a link hold it
the robot follows the motion, every joint to its tracking_error"""

# The form of a file: objects, [lists], lines of text, whole numbers, and arrays: (None, 3) are any number of rows of 3.
VECTOR, MATRIX, POINTS, SOME, PAIRS = (3,), (9,), (None, 3), (None,), (None, 2)
OPTIONAL = {"range", *RATES, "dynamics"}  # of a joint or of the robot: may be null
JOINT = {"name": str, "turns": bool, "rotation": MATRIX, "translation": VECTOR, "axis": VECTOR, "range": (2,)}
JOINT |= dict.fromkeys(RATES, ())
DYNAMICS = {"gravity": VECTOR, "damping": SOME, "friction": SOME, "bodies": (None, 14)}
ROBOT = {"name": str, "base": {"rotation": MATRIX, "translation": VECTOR}, "dynamics": DYNAMICS, "own_pairs": PAIRS}
ROBOT |= {"joints": [JOINT], "links": [{"name": str, "body": int, "balls": (None, 5)}]}
ROBOT |= {"tracking_error": SOME, "margin": (), "own_margin": ()}
OBSTACLE = {"name": str, "shape": str, "sizes": SOME, "rotation": MATRIX, "center": VECTOR, "velocity": VECTOR}
OBSTACLE |= {"growth": (), "points": POINTS, "normals": POINTS, "edges": PAIRS}
MOTION = {"breakpoints": SOME, "coefficients": (None, None, None)}
ENDS = dict.fromkeys(("start", "goal"), dict.fromkeys(("position", "velocity", "acceleration"), SOME))
PROOF = {"cells": POINTS, "torque": POINTS, **{key: [[int, int, SOME]] for key in ("obstacles", "own")}}
FILE = {"format": str, "version": int, "robot": ROBOT, "obstacles": [OBSTACLE], "may_touch": PAIRS, "motion": MOTION}
FILE |= {"ends": ENDS, "tolerances": dict.fromkeys(MOST, ()), "not_covered": [str], "proof": PROOF}


class NoCertificateError(Exception):
    """The file is none; the message names the key."""


class RefusedError(Exception):
    """A claim is not proven; the message names it."""


def read(path: Path) -> Any:
    """The content of a file, zipped or not, in which no key is there twice and all numbers are finite."""
    with path.open("rb") as raw:
        zipped = raw.read(2) == b"\x1f\x8b"
    with gzip.open(path) if zipped else path.open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise NoCertificateError("larger than 1 GiB")
    return json.loads(data.decode("utf-8"), object_pairs_hook=_unique, parse_constant=_no_number)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    need(len(dict(pairs)) == len(pairs), ", ".join(key for key, _ in pairs), "every key once")
    return dict(pairs)


def _no_number(found: str) -> NoReturn:
    raise NoCertificateError(f"{found} is no number")


def need(holds: Any, where: str, what: str) -> None:
    """Raise where something does not hold that has to hold of every certificate."""
    if not holds:
        raise NoCertificateError(f"{where}: {what} is needed")


def formed(value: Any, form: Any, where: str) -> Any:
    """A part of a file that has a form, arrays being arrays."""
    if isinstance(form, dict):
        need(isinstance(value, dict) and set(value) == set(form), where, f"an object with the keys {', '.join(form)}")
        optional = OPTIONAL if form in (JOINT, ROBOT) else ()
        given = {key: part for key, part in value.items() if not (part is None and key in optional)}
        return value | {key: formed(part, form[key], f"{where}.{key}") for key, part in given.items()}
    if isinstance(form, list):
        need(isinstance(value, list) and len(form) in (1, len(value)), where, "a list")
        parts = enumerate(zip(value, form * len(value) if len(form) == 1 else form, strict=True))
        return [formed(part, own, f"{where}[{k}]") for k, (part, own) in parts]
    if isinstance(form, tuple):
        return _array(value, form, where)
    need(type(value) is form, where, f"a value of type {form.__name__}")
    need(form is not str or (value.isprintable() and len(value) < 500), where, "one line of text")
    need(form is not int or abs(value) <= LARGEST, where, f"a whole number up to {LARGEST:g} in size")
    return value


def _array(value: Any, shape: tuple[int | None, ...], where: str) -> Array:
    def leaf(entry: Any, depth: int) -> Any:
        if depth == len(shape):
            most = LARGEST if len(shape) < 3 else HUGE  # coefficients of short pieces
            need(type(entry) in (int, float) and abs(entry) <= most, where, f"a number up to {most:g} in size")
            return float(entry)
        need(isinstance(entry, list) and shape[depth] in (None, len(entry)), where, f"a list of {shape[depth]}")
        return [leaf(part, depth + 1) for part in entry]

    try:
        found = np.array(leaf(value, 0), dtype=np.float64)
    except ValueError:
        raise NoCertificateError(f"{where}: rows of one length are needed") from None
    return found if found.size else found.reshape([n or 0 for n in shape])


def whole(values: Any, below: int, where: str) -> Whole:
    """Whole numbers from 0 on, as numbers of something."""
    found = np.asarray(values, dtype=np.float64)
    need(((found >= 0) & (found < below) & (found == np.floor(found))).all(), where, "a whole number of what is there")
    return found.astype(np.intp)


def rotations(matrices: Sequence[Array], where: str) -> tuple[Array, float]:
    """Matrices, and no less than how far any is from the nearest rotation (Frobenius)."""
    found = np.array(matrices).reshape(-1, 3, 3)
    off = np.linalg.norm(found.swapaxes(1, 2) @ found - np.eye(3), axis=(1, 2)) + 64.0 * U
    need(((off <= UNIT) & (np.linalg.det(found) > 0.0)).all(), where, "a rotation")
    return found, float(off.max())


def farthest(points: Array) -> float:
    """The length of the longest of some vectors."""
    return float(np.linalg.norm(points, axis=-1).max(initial=0.0))


class Robot:
    """Joints with their limits, and the balls of the links, every link's tree in one list of nodes."""

    def __init__(self, given: dict[str, Any]) -> None:
        joints, links, k = given["joints"], given["links"], len(given["joints"])
        need(k, "robot.joints", "one")
        self.dof, self.name, self.joints = k, given["name"], [joint["name"] for joint in joints]
        self.turns = np.array([joint["turns"] for joint in joints])
        frames = [given["base"]["rotation"], *(joint["rotation"] for joint in joints)]
        (self.base, *self.at), off = rotations(frames, "rotation of base and joints")
        self.place = given["base"]["translation"]
        self.shift, self.axis = (np.array([joint[key] for joint in joints]) for key in ("translation", "axis"))
        wrong = float(np.abs(np.linalg.norm(self.axis, axis=1) - 1.0).max())
        need(wrong <= UNIT, "robot.joints: axis", "a vector of length 1")
        self.off, free = off + 5.0 * wrong, np.array([-inf, inf])
        self.ranges = np.array([free if joint["range"] is None else joint["range"] for joint in joints])
        self.bounds = np.array([[inf if joint[key] is None else joint[key] for key in RATES] for joint in joints])
        self.tracking, self.margins = given["tracking_error"], [float(given["margin"]), float(given["own_margin"])]
        self.links, lengths = [link["name"] for link in links], [len(link["balls"]) for link in links]
        starts = np.cumsum([0, *lengths])
        self.roots, nodes = starts[:-1], np.concatenate([np.empty((0, 5)), *(link["balls"] for link in links)])
        body = whole([link["body"] for link in links], k + 1, "robot.links: body")
        self.link, self.centers, self.radii = np.repeat(np.arange(len(links)), lengths), nodes[:, :3], nodes[:, 3]
        self.body, self.counts = body[self.link], whole(nodes[:, 4], 1 << 30, "robot.links: children")
        known = [self.bounds, self.tracking, np.array(self.margins), self.radii - TINY]
        need(all((part >= 0.0).all() for part in known), "robot", "no negative limit, error, margin or radius")
        need(len(self.tracking) == k, "robot.tracking_error", "one of each joint")
        numbers = np.arange(len(nodes))
        before = np.cumsum(self.counts) - self.counts - (starts - np.arange(len(starts)))[self.link]
        self.firsts = (
            self.roots[self.link] + 1 + before
        )  # breadth first: all but the first are children, in their order
        ends = np.append(self.firsts + self.counts, 0)[starts[1:] - 1]
        tree = (self.firsts > numbers) | (self.counts == 0)
        need(min(lengths, default=1) and (ends == starts[1:]).all() and tree.all(), "robot.links: balls", "a tree")
        pairs = whole(given["own_pairs"], len(nodes), "robot.own_pairs")
        bodies = self.body[pairs]
        need((bodies[:, 0] != bodies[:, 1]).all(), "robot.own_pairs", "a joint between two balls")
        pairs = np.where(bodies[:, :1] > bodies[:, 1:], pairs, pairs[:, ::-1])  # what more joints move comes first
        self.own_pairs = [(one, two) for one, two in pairs.tolist()]
        self.size = farthest(self.place) + float(np.linalg.norm(self.shift, axis=1).sum()) + farthest(self.centers)
        self.size += float(self.radii.max(initial=0.0))
        self.has_torques, dynamics = bool(np.isfinite(self.bounds[:, 3]).any()), given["dynamics"]
        need(dynamics is not None or not self.has_torques, "robot.dynamics", "a table, where torques are limited,")
        if dynamics is not None:
            self.gravity, self.damping, self.friction = (dynamics[key] for key in ("gravity", "damping", "friction"))
            self.masses, self.carrier = dynamics["bodies"], whole(dynamics["bodies"][:, 0], k, "robot.dynamics.bodies")
            each = (self.damping, self.friction)
            need(all(len(f) == k and (f >= 0.0).all() for f in each), "robot.dynamics", "friction of each joint, >= 0,")

    def check_trees(self) -> None:
        """Every ball of the cover lies in all nodes above it (lemma 4)."""
        above = np.full(len(self.counts), -1)
        for k in np.flatnonzero(self.counts):
            above[self.firsts[k] : self.firsts[k] + self.counts[k]] = k
        leaf: Whole = np.flatnonzero(self.counts == 0)
        node: Whole = above[leaf]
        while len(leaf := leaf[node >= 0]):
            node = node[node >= 0]
            far = np.linalg.norm(self.centers[leaf] - self.centers[node], axis=1) + self.radii[leaf]
            outside = np.flatnonzero(~(far <= self.radii[node] + 64.0 * U * self.size))
            if outside.size:
                k, name = outside[0], self.links[self.link[leaf[outside[0]]]]
                start = self.roots[self.link[leaf[k]]]
                raise RefusedError(f"ball {leaf[k] - start} of {name} is not within ball {node[k] - start} above it")
            node = above[node]

    def parts(self, node: int, other: int, own: bool) -> list[tuple[int, int]]:
        """What a pair is divided into: the larger of two that have children, the first of equal ones; none of balls."""
        one, two = (float(self.radii[k]) if self.counts[k] else 0.0 for k in (node, other if own else node))
        if own and two > one:
            return [(node, int(self.firsts[other]) + k) for k in range(self.counts[other])]
        return [(int(self.firsts[node]) + k, other) for k in range(self.counts[node])]


class Obstacle:
    """A convex solid that moves at a constant velocity and does not turn."""

    def __init__(self, given: dict[str, Any], where: str) -> None:
        self.name, self.shape, self.sizes = given["name"], given["shape"], given["sizes"]
        need(self.shape in SIZES, f"{where}.shape", f"one of {', '.join(SIZES)}")
        need(len(self.sizes) == SIZES[self.shape] and (self.sizes > 1e-9).all(), f"{where}.sizes", "what the shape has")
        (self.rotation,), self.off = rotations([given["rotation"]], f"{where}.rotation")
        self.center, self.velocity, self.growth = given["center"], given["velocity"], float(given["growth"])
        need(self.growth >= 0.0, f"{where}.growth", "no negative number")
        self.pace = (farthest(self.velocity) + self.growth) * (1.0 + 16.0 * U)
        self.points, self.normals = given["points"], given["normals"]
        need(len(self.points) or self.shape != "polytope", f"{where}.points", "one")
        self.edges = whole(given["edges"], len(self.points), f"{where}.edges")
        self.size = farthest(self.center) + float(self.sizes.sum()) + farthest(self.points)

    def distances(self, places: Array, times: Array) -> Array:
        """No more than how far points (n, 3) are from it at times (n,); of its inside 0 or less (lemma 5)."""
        p, s = (places - self.center - times[:, None] * self.velocity) @ self.rotation, self.sizes
        along, around = np.maximum(np.abs(p) - s[-1:].sum(), 0.0)[:, 2], np.hypot(p[:, 0], p[:, 1])
        form = {
            "ball": lambda: np.linalg.norm(p, axis=1) - s[0],
            "box": lambda: np.linalg.norm(np.maximum(np.abs(p) - s, 0.0), axis=1),
            "capsule": lambda: np.hypot(around, along) - s[0],
            "cylinder": lambda: np.hypot(np.maximum(around - s[0], 0.0), along),
            "ellipsoid": lambda: self._beyond_ellipsoid(p),
            "half-space": lambda: p[:, 2],
            "polytope": lambda: self._beyond_polytope(p),
        }
        found: Array = form[self.shape]()  # type: ignore[no-untyped-call]
        return found

    def _beyond_ellipsoid(self, p: Array) -> Array:
        """Beyond the tangent plane whose normal Newton's method finds; with any other the bound is as true."""
        squares = self.sizes**2
        t = np.maximum((self.sizes * np.abs(p) - squares).max(axis=1), 0.0)
        for _ in range(20):
            w = self.sizes * p / (t[:, None] + squares)
            slope = (w * w / (t[:, None] + squares)).sum(axis=1)
            t = np.maximum(t + ((w * w).sum(axis=1) - 1.0) / np.maximum(2.0 * slope, TINY), 0.0)
        n = unit(p / (t[:, None] + squares))
        return np.asarray((n * p).sum(axis=1) - np.linalg.norm(n * self.sizes, axis=1))

    def _beyond_polytope(self, p: Array) -> Array:
        """Beyond planes with the normals in the file, and the one across the way to the nearest edge."""
        normals, found, near, least = unit(self.normals), np.full(len(p), -inf), np.zeros_like(p), np.full(len(p), inf)
        if len(normals):
            found = (p @ normals.T - (self.points @ normals.T).max(axis=0)).max(axis=1)
        for start, end in self.points[self.edges]:
            way = end - start
            foot = start + np.clip((p - start) @ way / max(float(way @ way), TINY), 0.0, 1.0)[:, None] * way
            far = np.linalg.norm(p - foot, axis=1)
            near, least = np.where((far < least)[:, None], foot, near), np.minimum(far, least)
        n = unit(p - near)
        beyond: Array = np.maximum(found, (n * p).sum(axis=1) - (n @ self.points.T).max(axis=1))
        return beyond


def unit(vectors: Array) -> Array:
    """Vectors (n, 3) at length 1."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1), TINY)[:, None])


class Motion:
    """Polynomials of the time since their piece began, lowest power first: (pieces, dof, degree + 1)."""

    def __init__(self, given: dict[str, Any], dof: int) -> None:
        self.breaks, local = given["breakpoints"], given["coefficients"]
        self.pieces = len(self.breaks) - 1
        rising = self.pieces > 0 and self.breaks[0] == 0.0 and (np.diff(self.breaks) > 0.0).all()
        need(rising, "motion.breakpoints", "a list that begins with 0 and rises")
        need(local.shape[:2] == (self.pieces, dof), "motion.coefficients", "a list of each joint in each piece")
        need(0 < local.shape[2] <= MOST_DEGREE + 1, "motion.coefficients", f"a degree up to {MOST_DEGREE}")
        factors = [[float(perm(d, n)) for d in range(local.shape[2])] for n in range(4)]
        self.derivatives = [(local * factors[n])[:, :, min(n, local.shape[2] - 1) :] for n in range(4)]
        self.lengths = np.nextafter(np.diff(self.breaks), inf)  # no less than they are

    def around(self, piece: Whole, middle: Array, order: int) -> tuple[Array, Array]:
        """Taylor coefficients of a derivative around times of pieces, (n, dof, degree + 1), and sums of term sizes."""
        local = self.derivatives[order][piece]
        powers = middle[:, None, None] ** np.arange(local.shape[2])
        found, sizes = np.zeros_like(local), np.zeros_like(local)
        for d in range(local.shape[2]):
            for k in range(d, local.shape[2]):
                term = comb(k, d) * local[:, :, k] * powers[:, :, k - d]
                found[:, :, d] += term
                sizes[:, :, d] += np.abs(term)
        return found, sizes

    def ends(self, order: int) -> tuple[Array, Array, Array]:
        """A derivative at the start and at the end of each piece, and how far computed values are from it at most."""
        local = self.derivatives[order]
        terms = local * self.lengths[:, None, None] ** np.arange(local.shape[2])
        return local[:, :, 0], terms.sum(axis=2), SLACK * np.abs(terms).sum(axis=2)

    def check_within(self, name: str, order: int, low: Array, high: Array, joints: list[str]) -> None:
        """Bernstein coefficients, of halves again and again, lie within bounds (dof,) (lemma 2)."""
        local = self.derivatives[order]
        n = local.shape[2] - 1
        matrix = np.array([[comb(i, j) / comb(n, j) for i in range(n + 1)] for j in range(n + 1)])
        half = np.array([[comb(i, j) / 2.0**i for i in range(n + 1)] for j in range(n + 1)])
        scaled = local * self.lengths[:, None, None] ** np.arange(n + 1)
        piece, joint = (part.ravel() for part in np.indices(local.shape[:2]))
        curves, error = (scaled @ matrix).reshape(-1, n + 1), SLACK * (np.abs(scaled) @ matrix).max(axis=2)
        start, width = np.zeros(len(curves)), np.ones(len(curves))
        for level in range(HALVINGS):
            spare = error[piece, joint]
            room = np.minimum(curves.min(axis=1) - low[joint], high[joint] - curves.max(axis=1)) - spare
            left, ends = ~(room >= 0.0), curves[:, [0, -1]]
            out = left & ~((ends >= low[joint, None]) & (ends <= high[joint, None])).all(axis=1)
            if out.any() or (left.any() and level == HALVINGS - 1):
                k = int(np.argmax(out if out.any() else left))
                begin, length = self.breaks[piece[k]] + start[k] * self.lengths[piece[k]], self.lengths[piece[k]]
                raise RefusedError(
                    f"{name} of {joints[joint[k]]}, t = {begin:.9g} to {begin + width[k] * length:.9g} s"
                )
            piece, joint, start, width, curves = piece[left], joint[left], start[left], width[left] / 2.0, curves[left]
            curves = np.concatenate([curves @ half, (curves[:, ::-1] @ half)[:, ::-1]])
            start = np.concatenate([start, start + width])
            piece, joint, width = (np.tile(part, 2) for part in (piece, joint, width))


class Cells:
    """Cells of time, each within a piece."""

    def __init__(self, motion: Motion, piece: Whole, start: Array, end: Array) -> None:
        self.motion, self.piece, self.start, self.end = motion, piece, start, end
        self.middle = start + (end - start) / 2.0
        self.half = np.maximum(end - self.middle, self.middle - start) * (1.0 + 4.0 * U)
        self.times = motion.breaks[piece] + self.middle

    @classmethod
    def of(cls, rows: Array, motion: Motion, where: str) -> "Cells":
        """Rows of piece, start and end."""
        cells = cls(motion, whole(rows[:, 0], motion.pieces, where), rows[:, 1], rows[:, 2])
        inside = (cells.start >= 0.0) & (cells.start < cells.end) & (cells.end <= motion.lengths[cells.piece])
        need(inside.all(), where, "a cell that begins before it ends, within its piece,")
        return cells

    def during(self, k: int) -> str:
        """The k-th one in words."""
        begin, end = (self.motion.breaks[self.piece[k]] + part[k] for part in (self.start, self.end))
        return f"t = {begin:.9g} to {end:.9g} s (cell {k})"

    def enclosed(self, order: int) -> tuple[Array, Array]:
        """A derivative as a polynomial of s from -1 to 1, (degree + 1, n, dof), and how far from it (lemma 3)."""
        local, sizes = self.motion.around(self.piece, self.middle, order)
        powers = self.half[:, None, None] ** np.arange(local.shape[2])
        return np.moveaxis(local * powers, 2, 0), SLACK * (sizes * powers).sum(axis=2)

    def masks(self) -> tuple[list[int], int, list[tuple[int, float]]]:
        """Of each the elementary intervals of time that it holds, as bits; those that there are; where each begins."""
        begins: list[tuple[int, float]] = []
        places: list[dict[float, int]] = []
        for p, length in enumerate(self.motion.lengths.tolist()):
            own = self.piece == p
            edges = np.unique(np.concatenate([[0.0, length], self.start[own], self.end[own]])).tolist()
            places.append({edge: len(begins) + k for k, edge in enumerate(edges)})
            begins += [(p, edge) for edge in edges[:-1]]
        each = zip(self.piece.tolist(), self.start.tolist(), self.end.tolist(), strict=True)
        masks = [(1 << places[p][end]) - (1 << places[p][start]) for p, start, end in each]
        return masks, (1 << len(begins)) - 1, begins

    def first_of(self, missing: int, begins: list[tuple[int, float]]) -> float:
        """When the first of some elementary intervals begins, s."""
        piece, begin = begins[(missing & -missing).bit_length() - 1]
        return float(self.motion.breaks[piece] + begin)


class Scene:
    """A robot among obstacles in cells of time."""

    def __init__(self, robot: Robot, obstacles: "list[Obstacle]", cells: Cells) -> None:
        self.robot, self.obstacles, self.cells = robot, obstacles, cells
        terms, error = cells.enclosed(0)
        posture = terms[0]
        self.away = np.abs(terms[1:]).sum(axis=0) * (1.0 + SLACK) + error + robot.tracking  # of joints in a cell
        sliding = np.abs(posture[:, ~np.array(robot.turns)]).sum(axis=1).max(initial=0.0)
        last = float(cells.motion.breaks[-1])
        size = robot.size + float(sliding) + max((o.size + o.pace * last for o in obstacles), default=0.0)
        off = max([robot.off, *(obstacle.off for obstacle in obstacles)])
        self.rounding = 8.0 * (robot.dof + 4) * (off + 64.0 * U) * size  # lemma 7
        frames, places, axes = (
            [np.tile(robot.base, (len(posture), 1, 1))],
            [np.tile(robot.place, (len(posture), 1))],
            [],
        )
        for j in range(robot.dof):
            turned, a, value = frames[-1] @ robot.at[j], robot.axis[j], posture[:, j, None]
            places.append(places[-1] + frames[-1] @ robot.shift[j])
            axes.append(turned @ a)
            if robot.turns[j]:
                still, cosine, sine = turning(a)
                turned = turned @ (still + np.cos(value)[:, :, None] * cosine + np.sin(value)[:, :, None] * sine)
            else:
                places[-1] = places[-1] + axes[-1] * value
            frames.append(turned)
        self.frames, self.places, self.axes = (np.stack(part, axis=1) for part in (frames, places, axes))

    def at(self, node: Whole, cell: Whole) -> Array:
        """Centres of nodes in the middles of cells, (m, 3)."""
        body = self.robot.body[node]
        turned = np.einsum("mij,mj->mi", self.frames[cell, body], self.robot.centers[node])
        return np.asarray(turned + self.places[cell, body])

    def travel(self, node: Whole, center: Array, cell: Whole, seen_from: Whole) -> Array:
        """How far centres move in cells at most, as seen from other bodies (lemma 3)."""
        body, moved = self.robot.body[node], np.zeros(len(node))
        for j in range(self.robot.dof):
            by = np.flatnonzero((body > j) & (seen_from <= j))
            arm = center[by] - self.places[cell[by], j + 1]
            lever = np.linalg.norm(np.cross(self.axes[cell[by], j], arm), axis=1) + self.rounding
            moved[by] += self.away[cell[by], j] * (lever if self.robot.turns[j] else 1.0)
        return moved * (1.0 + SLACK)

    def spare(self, node: Whole, other: Whole, cell: Whole, own: bool) -> tuple[Array, Array]:
        """What is left, all through cells, of the room that nodes keep of obstacles or of each other; their travel."""
        robot, center = self.robot, self.at(node, cell)
        if own:
            apart = np.linalg.norm(center - self.at(other, cell), axis=1)
            travel = self.travel(node, center, cell, robot.body[other])
            return apart - robot.radii[node] - robot.radii[other] - robot.margins[1] - travel - self.rounding, travel
        travel, room = self.travel(node, center, cell, np.zeros_like(node)), np.full(len(node), -inf)
        for k in np.unique(other):
            obstacle, among = self.obstacles[k], np.flatnonzero(other == k)
            times, kept = self.cells.times[cell[among]], robot.radii[node[among]] + robot.margins[0]
            room[among] = obstacle.distances(center[among], times) - kept - obstacle.growth * times
            travel[among] += obstacle.pace * self.cells.half[cell[among]] * (1.0 + SLACK)
        return room - travel - self.rounding, travel


def turning(a: Array) -> tuple[Array, Array, Array]:
    """What of the rotation about an axis does not change, goes with the cosine, and goes with the sine of the angle."""
    cross = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    return np.outer(a, a), np.eye(3) - np.outer(a, a), cross


class Taylor:
    """Functions of s from -1 to 1: cubic polynomials (4, ...), and how far from them at most (...) (lemma 6)."""

    def __init__(self, terms: Array, rest: Any = 0.0) -> None:
        self.terms, self.size = terms, np.abs(terms).sum(axis=0)
        self.rest = rest * (1.0 + 64.0 * U) + 16.0 * U * self.size

    @classmethod
    def of(cls, terms: Array, rest: Any = 0.0) -> "Taylor":
        """A polynomial of any degree."""
        low = np.zeros((DEGREE + 1, *terms.shape[1:]))
        low[: len(terms)] = terms[: DEGREE + 1]
        return cls(low, rest + np.abs(terms[DEGREE + 1 :]).sum(axis=0) * (1.0 + SLACK))

    def __add__(self, other: "Taylor") -> "Taylor":
        return Taylor(self.terms + other.terms, self.rest + other.rest)

    def __mul__(self, other: "Taylor") -> "Taylor":
        terms, rest = np.zeros((DEGREE + 1, *np.broadcast_shapes(self.size.shape, other.size.shape))), 0.0
        for i in range(DEGREE + 1):
            for j in range(DEGREE + 1):
                product = self.terms[i] * other.terms[j]
                rest = rest + np.abs(product) if i + j > DEGREE else rest
                terms[min(i + j, DEGREE)] += product if i + j <= DEGREE else 0.0
        sizes = self.size * other.rest + self.rest * (other.size + other.rest)
        return Taylor(terms, rest + sizes + 32.0 * U * self.size * other.size)

    def __getitem__(self, index: Any) -> "Taylor":
        return Taylor(self.terms[(slice(None), *index)], self.rest[index])

    def sum(self) -> "Taylor":
        """Over the last axis, of three."""
        return Taylor(self.terms.sum(axis=-1), self.rest.sum(axis=-1) + 8.0 * U * self.size.sum(axis=-1))

    def under(self, matrix: "Taylor") -> "Taylor":
        """A matrix (n, 3, 3) times this, (n, 3)."""
        return (matrix * self[:, None, :]).sum()

    def cross(self, other: "Taylor") -> "Taylor":
        """The cross product of vectors (n, 3)."""
        ahead, behind = np.array([1, 2, 0]), np.array([2, 0, 1])
        one, two = self[:, ahead] * other[:, behind], self[:, behind] * other[:, ahead]
        return one + Taylor(-two.terms, two.rest)

    def waves(self) -> "tuple[Taylor, Taylor]":
        """Sine and cosine: of y = x - x0 within |y|^5 / 120 of y - y^3 / 6 and |y|^4 / 24 of 1 - y^2 / 2."""
        x0, one, terms = self.terms[0], np.zeros_like(self.terms), self.terms.copy()
        terms[0], one[0] = 0.0, 1.0
        y = Taylor(terms, self.rest)
        square, most = y * y, y.size + y.rest
        sine, cosine = y + square * y * Taylor(-one / 6.0), Taylor(one) + square * Taylor(-one / 2.0)
        sine, cosine = (
            Taylor(sine.terms, sine.rest + most**5 / 120.0),
            Taylor(cosine.terms, cosine.rest + most**4 / 24.0),
        )
        s, c, minus = Taylor(one * np.sin(x0), 8.0 * U), Taylor(one * np.cos(x0), 8.0 * U), Taylor(-one)
        return s * cosine + c * sine, c * cosine + minus * s * sine

    def range(self) -> tuple[Array, Array]:
        """Bounds from Bernstein coefficients."""
        a, b, c, d = self.terms
        corners = np.stack([a - b + c - d, a - (b + c) / 3.0 + d, a + (b - c) / 3.0 - d, a + b + c + d])
        return corners.min(axis=0) - self.rest, corners.max(axis=0) + self.rest


def fixed(value: Array, off: float = 0.0) -> Taylor:
    """What is the same in all cells, every entry to ``off``."""
    return Taylor.of(value[None, None], off)


def torques(robot: Robot, cells: Cells) -> tuple[Array, Array]:
    """Bounds of what the motors give in cells, (n, dof) each: Newton and Euler from the base on and back (lemma 6)."""
    q, v, a = (Taylor.of(*cells.enclosed(order)) for order in range(3))
    rate = spin = fixed(np.zeros(3))
    pull = fixed(-robot.gravity @ robot.base, robot.off * farthest(robot.gravity))
    links: list[tuple[Taylor, Taylor, Taylor, list[tuple[Taylor, Taylor]]]] = []
    for j in range(robot.dof):
        turns, still, (value, speed, quicker) = robot.turns[j], robot.at[j], (part[:, j, None] for part in (q, v, a))
        arm, axis, off = fixed(robot.shift[j]), fixed(robot.axis[j]), 4.0 * robot.off + 32.0 * U
        parts = [still @ part for part in turning(robot.axis[j])] if turns else []
        frame = fixed(still, off)
        if turns:
            s, c = (wave[:, :, None] for wave in value.waves())
            frame = fixed(parts[0], off) + fixed(parts[1], off) * c + fixed(parts[2], off) * s
        else:
            arm = arm + (axis * value).under(frame)
        back = Taylor(frame.terms.swapaxes(-1, -2), frame.rest.swapaxes(-1, -2))
        pull = (pull + spin.cross(arm) + rate.cross(rate.cross(arm))).under(back)
        rate, spin, along = rate.under(back), spin.under(back), axis * speed
        twist = rate.cross(along)
        if turns:
            rate, spin = rate + along, spin + twist + axis * quicker
        else:
            pull = pull + twist + twist + axis * quicker
        own = [wrench(mass, rate, spin, pull) for mass in robot.masses[robot.carrier == j]]
        links.append((frame, arm, axis, own))
    force = moment = fixed(np.zeros(3))
    found = []
    for j in range(robot.dof - 1, -1, -1):
        frame, arm, axis, own = links[j]
        for own_force, own_moment in own:
            force, moment = force + own_force, moment + own_moment
        viscous = fixed(robot.damping[j : j + 1]) * v[:, j, None]
        found.append((((moment if robot.turns[j] else force) * axis).sum() + viscous[:, 0]).range())
        force, moment = force.under(frame), moment.under(frame)
        moment = moment + arm.cross(force)
    low, high = (np.stack(part[::-1], axis=1) for part in zip(*found, strict=True))
    slowest, fastest = v.range()
    low = low + np.where(slowest > 0.0, 1.0, -1.0) * robot.friction
    high = high + np.where(fastest < 0.0, -1.0, 1.0) * robot.friction
    return np.nextafter(low, -inf), np.nextafter(high, inf)


def wrench(mass: Array, rate: Taylor, spin: Taylor, pull: Taylor) -> tuple[Taylor, Taylor]:
    """Force and moment about the origin of its frame that move a body so."""
    center, inertia = fixed(mass[2:5]), fixed(mass[5:].reshape(3, 3))
    force = (pull + spin.cross(center) + rate.cross(rate.cross(center))) * fixed(mass[1:2])
    return force, spin.under(inertia) + rate.cross(rate.under(inertia)) + center.cross(force)


class Certificate:
    """A file, read."""

    def __init__(self, content: Any) -> None:
        given = formed(content, FILE, "file")
        need((given["format"], given["version"]) == (FORMAT, VERSION), "format", f"{FORMAT}, version {VERSION},")
        self.robot = robot = Robot(given["robot"])
        self.obstacles = [Obstacle(part, f"obstacles[{i}]") for i, part in enumerate(given["obstacles"])]
        self.motion = Motion(given["motion"], robot.dof)
        counts = (len(robot.links), len(self.obstacles))
        allowed = [whole(part, n, "may_touch").tolist() for part, n in zip(given["may_touch"].T, counts, strict=True)]
        self.may_touch = set(zip(*allowed, strict=True))
        self.is_smooth = bool(np.isfinite(robot.bounds[:, 2]).any())
        self.ends = [[given["ends"][end][key] for key in ENDS["start"]] for end in ENDS]
        need(all(len(part) == robot.dof for end in self.ends for part in end), "ends", "one number of each joint")
        self.limits, *self.tolerances = (float(given["tolerances"][key]) for key in MOST)
        near = (0.0 <= given["tolerances"][key] <= most for key, most in MOST.items())
        need(all(near), "tolerances", f"no more than {MOST}")
        self.not_covered, proof = given["not_covered"], given["proof"]
        self.cells, self.torque_cells = (
            Cells.of(proof[key], self.motion, f"proof.{key}") for key in ("cells", "torque")
        )
        self.items = [self._items(proof[key], f"proof.{key}") for key in ("obstacles", "own")]

    def _items(self, rows: list[Any], where: str) -> tuple[Whole, Whole, Whole]:
        """Balls, what each is kept from, and in which cell."""
        counts, balls = [len(row[2]) for row in rows], len(self.robot.radii)
        node = whole([row[0] for row in rows], balls, where)
        other = whole([row[1] for row in rows], balls if where == "proof.own" else len(self.obstacles), where)
        cell = whole(np.concatenate([[], *(row[2] for row in rows)]), len(self.cells.piece), where)
        return np.repeat(node, counts), np.repeat(other, counts), cell

    def check_motion(self) -> None:
        """Ends, continuity, and the limits of the joints one by one."""
        robot, motion, stated = self.robot, self.motion, self.limits
        for order, (kind, tolerance) in enumerate(zip(list(MOST)[1:], self.tolerances, strict=True)):
            start, end, error = motion.ends(order)
            if order == 2 and not self.is_smooth:
                break
            for name, value, off, state in (
                ("start", start[0], error[0], self.ends[0]),
                ("goal", end[-1], error[-1], self.ends[1]),
            ):
                if not (np.abs(value - state[order]) + off <= tolerance).all():
                    raise RefusedError(f"{kind} at the {name}: {np.abs(value - state[order]).max():.3g} beside it")
            jumps = (np.abs(start[1:] - end[:-1]) + error[1:] + error[:-1]).max(axis=1, initial=0.0)
            if not (jumps <= tolerance).all():
                k = int(np.argmax(jumps))
                raise RefusedError(f"{kind} jumps by {jumps[k]:.3g} at t = {motion.breaks[k + 1]:.9g} s")
        low, high = robot.ranges.T
        spare = np.where(np.isfinite(high - low), stated * (high - low), 0.0) - robot.tracking
        motion.check_within("joint range", 0, low - spare, high + spare, robot.joints)
        for order, name in enumerate(RATES[:3], start=1):
            bound = robot.bounds[:, order - 1] * (1.0 + stated)
            motion.check_within(name, order, -bound, bound, robot.joints)

    def check_torques(self) -> None:
        """Every motor gives what it can, in all cells, and these hold all the time."""
        if not np.isfinite(self.robot.bounds[:, 3]).any():
            return
        wrong = self.exceeding(self.torque_cells)
        if wrong.any():
            k, joint = np.argwhere(wrong)[0]
            raise RefusedError(f"torque of {self.robot.joints[joint]}, {self.torque_cells.during(k)}")
        masks, missing, begins = self.torque_cells.masks()
        for mask in masks:
            missing &= ~mask
        if missing:
            raise RefusedError(f"torque: no cell holds t = {self.torque_cells.first_of(missing, begins):.9g} s")

    def exceeding(self, cells: Cells) -> NDArray[np.bool_]:
        """Where torques are not proven to be within limits: (n, dof)."""
        low, high = torques(self.robot, cells)
        bound = self.robot.bounds[:, 3] * (1.0 + self.limits)
        return ~((low >= -bound) & (high <= bound))

    def roots(self, own: bool) -> list[tuple[int, int]]:
        """What is to be kept clear of what, all balls in a node meant."""
        links = enumerate(self.robot.roots.tolist())
        among = range(len(self.obstacles))
        kept = [(root, j) for i, root in links for j in among if (i, j) not in self.may_touch]
        return self.robot.own_pairs if own else kept

    def check_clearance(self, name: str, own: bool) -> None:
        """All that must be clear is, all the time: in every cell and ball of the proof, and these hold everything."""
        node, other, cell = self.items[own]
        scene = Scene(self.robot, self.obstacles, self.cells)
        for first in range(0, len(node), AT_ONCE):
            part = slice(first, first + AT_ONCE)
            spare, _ = scene.spare(node[part], other[part], cell[part], own)
            wrong = np.flatnonzero(~(spare >= 0.0))
            if wrong.size:
                k, short = first + wrong[0], -spare[wrong[0]]
                where = self.described(int(node[k]), int(other[k]), own)
                raise RefusedError(f"{name} of {where}, {self.cells.during(cell[k])}: {short:.3g} m short")
        masks, everything, begins = self.cells.masks()
        proven: dict[tuple[int, int], int] = {}
        for one, two, k in zip(node.tolist(), other.tolist(), cell.tolist(), strict=True):
            proven[one, two] = proven.get((one, two), 0) | masks[k]
        left = [(pair, everything) for pair in self.roots(own)]
        while left:
            pair, missing = left.pop()
            missing &= ~proven.get(pair, 0)
            parts = self.robot.parts(*pair, own) if missing else []
            if missing and not parts:
                time = self.cells.first_of(missing, begins)
                raise RefusedError(f"{name} of {self.described(*pair, own)}: no cell holds t = {time:.9g} s")
            left += [(part, missing) for part in parts]

    def described(self, node: int, other: int, own: bool) -> str:
        """Names of what should be clear."""
        links, link = self.robot.links, self.robot.link
        return f"{links[link[node]]} from {links[link[other]] if own else self.obstacles[other].name}"

    def say(self) -> None:
        """What it is about, what is proven, and what is not."""
        robot, motion = self.robot, self.motion
        balls, names = int((robot.counts == 0).sum()), ", ".join(obstacle.name for obstacle in self.obstacles)
        near = sorted({f"{robot.links[i]} and {self.obstacles[j].name}" for i, j in self.may_touch})
        own = sorted({self.described(*pair, True) for pair in robot.own_pairs})
        free = [[n for n, bound in zip(robot.joints, bounds, strict=True) if bound == inf] for bounds in robot.bounds.T]
        print(f"motion of {robot.name}: {robot.dof} joints, {motion.pieces} pieces, T = {motion.breaks[-1]:.9g} s")
        print(f"links: {', '.join(robot.links) or 'none'}, in {balls} balls; obstacles: {names or 'none'}")
        print("proven: start and goal, continuity, and for all t joint ranges, where they are stated, and")
        for name, joints in zip(RATES, free, strict=True):
            print(f"  {name} within limits" + (f"; none is stated for {', '.join(joints)}" if joints else ""))
        print(f"  clearance of {robot.margins[0]:g} m from obstacles; not of {', '.join(near) or 'none'}")
        print(f"  self clearance of {robot.margins[1]:g} m: {', '.join(own) or 'of nothing'}")
        print("\n".join(f"assumed: {line}" for line in ASSUMED.splitlines()))
        print("\n".join(f"not in this certificate: {line}" for line in self.not_covered) or "nothing is left out")
        print("accepted: all that is claimed is proven")


def check(content: Any) -> Certificate:
    """The certificate that a file holds; raises where it is none, or not all that it claims is proven."""
    with np.errstate(all="ignore"):  # what comes of it is no number, or infinite, and proves nothing
        certificate = Certificate(content)
        certificate.robot.check_trees()
        certificate.check_motion()
        certificate.check_torques()
        certificate.check_clearance("clearance", own=False)
        certificate.check_clearance("self clearance", own=True)
        return certificate


def main(arguments: Sequence[str]) -> int:
    """Check a file; returns the exit status."""
    if len(arguments) != 1:
        print("usage: python check_certificate.py FILE", file=sys.stderr)
        return 2
    try:
        check(read(Path(arguments[0]))).say()
    except (NoCertificateError, OSError, EOFError, ValueError, ArithmeticError, RecursionError, zlib.error) as error:
        print(f"{arguments[0]}: no certificate: {error}", file=sys.stderr)
        return 2
    except RefusedError as error:
        print(f"refused: {error}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

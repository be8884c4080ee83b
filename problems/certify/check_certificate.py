"""Check a certificate of a robot's motion: python check_certificate.py FILE. Needs NumPy, and nothing else.

Exit status 0: all that the file claims is proven for all t; 1: something is not, the first is named; 2: no certificate.
The claims follow from the numbers of robot, obstacles and motion; the file only adds how a proof is divided, and planes
to try. docs/reference/certificate.md has the format, docs/explanation/proof.md the lemmas. What is no number fails.
"""

import gzip
import json
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations_with_replacement, pairwise
from math import comb, inf, perm
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Whole: TypeAlias = NDArray[np.intp]
FORMAT, VERSION = "tpbso-casadi certificate", 2
U, SLACK, TINY, OFF = 2.0**-53, 2.0**-41, 1e-100, 1e-14  # 2048 roundings (lemma 1); rotations and axes are off by OFF
LARGEST_FILE, MOST_PIECES, MOST_PARTS, MOST_POWERS, MOST_LEVELS = 1 << 30, 1 << 20, 1 << 24, 25, 40
MOST_TOLERANCES = np.array([1e-6, 1e-6, 1e-4, 1e-1])  # of limits, relative, and of the STATE at ends and breakpoints
ORDERS = np.array([[float(i + j == k) for i in range(4) for j in range(4)] for k in range(7)])  # of products of terms
STATE = ("position", "velocity", "acceleration")
LIMITS, TORQUE = ("joint range", "speed", "acceleration", "jerk", "torque"), 4
SHAPES: dict[str, tuple[int, Callable[[Array, Array, Array], Any]]] = {  # how many sizes s, max n . y of its points y
    "ball": (1, lambda n, s, _: s[0] * norm(n, axis=1)),
    "box": (3, lambda n, s, _: np.abs(n) @ s),
    "capsule": (2, lambda n, s, _: s[0] * norm(n, axis=1) + s[1] * np.abs(n[:, 2])),
    "cylinder": (2, lambda n, s, _: s[0] * norm(n[:, :2], axis=1) + s[1] * np.abs(n[:, 2])),
    "ellipsoid": (3, lambda n, s, _: norm(n * s, axis=1)),
    "half-space": (0, lambda n, s, _: np.where((n[:, :2] == 0.0).all(axis=1) & (n[:, 2] > 0.0), 0.0, inf)),
    "polytope": (0, lambda n, s, points: (n @ points.T).max(axis=1)),
}
# The forms of a file: objects, [lists], texts, digits, and arrays: their sizes, numbers or named after what came first;
# after |: + not negative, ~ up to 1e200 (else 1e6), R rotations, ? null for no limit, < whole numbers of what is named.
FORM = """FILE is format: word; version: ; robot: text; stages: [STAGE].
STAGE is name: text; robot: ROBOT; obstacles: [OBSTACLE]; may_touch: TOUCH; margins: 2 | +; pause: | +;
breakpoints: times; coefficients: pieces joints powers | ~; start: 3 joints; goal: 3 joints; tolerances: 4 | +;
places: [PLACE]; not_covered: [text]; planes: planes 3; proof: PROOF.
ROBOT is joints: [text]; parents: joints | <joints; turns: joints | <2; axes: joints 3; rotations: joints 3 3 | R;
translations: joints 3; base_rotation: 3 3 | R; base_translation: 3; ranges: joints 2 | ?; limits: joints 4 | ?+;
friction: 2 joints | +; tracking_error: 3 joints | +; gravity: 3; masses: masses 13; carriers: masses | <joints; links:
[text]; link_bodies: links | <100; balls: balls 4; ball_parents: balls | <balls; long_balls: long | <balls; far_ends:
long 3; own_pairs: pairs 2 | <balls. TOUCH is links: near | <links; obstacles: near | <obstacles.
PLACE is at_goal: | <2; carrier: | <joints; points: m 3; places: m 3; within: | +.
OBSTACLE is name: text; shape: word; sizes: n | +; rotation: 3 3 | R; center: 3; velocity: 3; growth: | +; points: m 3.
PROOF is limits: [digits]; obstacles: [digits]; own: [digits]"""
FORMS = dict(form.split(" is ") for form in FORM.replace("\n", " ").split(". "))
CHAIN = ("joints", "parents", "turns", "axes", "rotations", "translations", "base_rotation", "base_translation")
ACCEPTED = """assumed: numbers of robot, obstacles and motion, some of them above, are true; all is rigid; balls hold
links; joints keep to tracking errors; places, speeds, accelerations and torques are the motion's; nothing else moves;
what is taken or put down lies where the next stage has it\naccepted: all that is claimed is proven, for all t"""


class RefusedError(Exception):
    """A claim is not proven; the message names it."""


def need(holds: Any, where: str, what: str) -> None:
    """Raise where something does not hold that has to hold of every certificate: the file is none."""
    if not holds:
        raise ValueError(f"{where}: {what} is needed")


def read(path: Path) -> Any:
    """The content of a file, zipped where its name ends with .gz, in which no key is there twice."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        need(len(dict(pairs)) == len(pairs), ascii([key for key, _ in pairs]), "every key once")
        return dict(pairs)

    with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
        return json.loads(file.read(LARGEST_FILE).decode("utf-8"), object_pairs_hook=unique)


def formed(value: Any, form: str, where: str, sizes: dict[str, int]) -> Any:
    """A part of a file that has a form: objects with attributes, lists, texts, and arrays of numbers or digits."""
    if form in FORMS:
        forms = dict(part.split(": ") for part in FORMS[form].split("; "))
        need(isinstance(value, dict) and set(value) == set(forms), where, f"an object with the keys {', '.join(forms)}")
        return SimpleNamespace(**{key: formed(value[key], forms[key], f"{where}.{key}", sizes) for key in forms})
    if form.startswith("["):
        need(isinstance(value, list), where, "a list")
        sizes[where.rpartition(".")[2]] = len(value)
        parts = [formed(part, form[1:-1], f"{where}[{k}]", dict(sizes)) for k, part in enumerate(value)]
        names = parts if form == "[text]" else [part.name for part in parts if form == "[OBSTACLE]"]
        need(len(set(names)) == len(names), where, "every name once")
        return parts
    if form in ("word", "text", "digits"):  # texts are quoted where they are printed
        need(isinstance(value, str) and (form != "digits" or set(value) <= set("012")), where, f"{form} in quotes")
        digits = np.frombuffer(value.encode() if form == "digits" else b"", dtype=np.uint8) - ord("0")
        return {"word": value, "text": ascii(value), "digits": digits}[form]
    (dims, _, flags), flat, shape = form.partition("|"), [value], []
    for dim in dims.split():
        need(all(isinstance(part, list) for part in flat), where, "a list")
        shape.append(int(dim) if dim.isdecimal() else sizes.setdefault(dim, len(flat[0]) if flat else 0))
        need(all(len(part) == shape[-1] for part in flat), where, f"a list of {shape[-1]}")
        flat = [entry for part in flat for entry in part]
    most, below = 1e200 if "~" in flags else 1e6, flags.partition("<")[2]
    least = 0.0 if "+" in flags or below else -most
    sound = (type(x) in (int, float) and least <= x <= most for x in flat if x is not None or "?" not in flags)
    need(all(sound), where, f"a number from {least:g} to {most:g}")
    found = np.array([inf if x is None else x for x in flat], dtype=np.float64).reshape(shape)
    if "R" in flags:
        off = norm(found.swapaxes(-1, -2) @ found - np.eye(3), axis=(-1, -2))
        need(((off <= OFF) & (np.linalg.det(found) > 0.0)).all(), where, "a rotation")
    last = int(below) if below.isdecimal() else sizes.get(below, 0)
    need(not below or ((found < last) & (found == np.floor(found))).all(), where, f"a whole number below {last}")
    return found.astype(np.intp) if below else found


class Robot:
    """Joints on each other, and the balls of their links: of each link a tree of balls around balls."""

    def __init__(self, given: Any, where: str) -> None:
        self.given, self.dof, numbers = given, len(given.joints), np.arange(len(given.balls))
        need((np.abs(norm(given.axes, axis=1) - 1.0) <= OFF).all(), f"{where}.axes", "a vector of length 1")
        need((given.parents <= np.arange(self.dof)).all(), f"{where}.parents", "0, the base, or a joint before")
        self.moves = np.eye(self.dof, self.dof + 1, 1, dtype=bool)  # which joint moves which body
        for j, on in enumerate(given.parents):
            self.moves[:, j + 1] |= self.moves[:, on]
        known = len(given.masses) or np.isinf(given.limits[:, TORQUE - 1]).all()
        need(known and (given.masses[:, 0] >= 0.0).all(), f"{where}.masses", "what the motors move, none below 0,")
        need((given.link_bodies <= self.dof).all(), f"{where}.link_bodies", "a joint, from 1 on, or 0")
        parent, above, radii = given.ball_parents, numbers, given.balls[:, 3]
        roots, below = np.flatnonzero(parent == numbers), np.flatnonzero(parent != numbers)
        sound = (parent <= numbers).all() and len(roots) == len(given.links) and (radii >= 0.0).all()
        need(sound, f"{where}.ball_parents", "of each link one ball around its others, which follow, radii from 0,")
        self.ends = np.stack([given.balls[:, :3]] * (1 + (len(given.long_balls) > 0)))  # a ball is the hull of both
        self.ends[-1, given.long_balls] = given.far_ends
        self.size = OFF + float(norm(given.base_translation) + norm(given.translations, axis=1).sum())
        self.size += float((norm(self.ends, axis=2) + radii).max(initial=0.0))
        self.counts = np.bincount(parent[below], minlength=len(numbers))
        self.children = np.split(below[np.argsort(parent[below], kind="stable")], np.cumsum(self.counts)[:-1])
        self.radii = np.where(self.counts > 0, 0.0, radii)
        while len(deep := below[(self.counts[below] == 0) & (parent[above[below]] != above[below])]):
            above = parent[above]
            far = norm(self.ends[:, deep] - self.ends[0, above[deep]], axis=2).max(axis=0) + radii[deep]
            np.maximum.at(self.radii, above[deep], far + 64.0 * U * self.size)  # as large as it has to be (lemma 4)
        self.divisible = np.append(np.where(self.counts > 0, self.radii, 0.0), 0.0)  # and of what is no ball
        self.roots, link = roots, np.searchsorted(roots, above)
        self.links, self.body = np.array(given.links)[link], given.link_bodies[link]
        pairs = self.body[given.own_pairs]
        need((pairs[:, 0] > pairs[:, 1]).all(), f"{where}.own_pairs", "a joint between two balls, the far one first,")


class Cells:
    """Cells of time: number c P + p is node c of the tree of piece p of P; 1 is all of it, 2 c and 2 c + 1 halve c."""

    def __init__(self, motion: "Stage", of_pairs: Whole) -> None:
        numbers, self.of = np.unique(of_pairs, return_inverse=True)
        self.motion, (node, self.piece) = motion, np.divmod(numbers, motion.pieces)
        parts, length = 2.0 ** (np.frexp(node.astype(np.float64))[1] - 1), motion.lengths[self.piece]
        self.start, self.end = length * (node - parts) / parts, length * (node - parts + 1.0) / parts
        self.middle = self.start + (self.end - self.start) / 2.0
        self.half = np.maximum(self.end - self.middle, self.middle - self.start) * (1.0 + 4.0 * U)
        self.times = motion.breaks[self.piece] + self.middle

    def state(self, order: int) -> "Taylor":
        """A derivative of all joints, (n, dof)."""
        local = np.moveaxis(self.motion.derivatives[order][self.piece], 2, 0)
        found, sizes = np.zeros_like(local), np.zeros_like(local[0])
        for d, k in combinations_with_replacement(range(len(local)), 2):
            term = local[k] * (comb(k, d) * self.middle ** (k - d) * self.half**d)[:, None]
            found[d], sizes = found[d] + term, sizes + np.abs(term)
        return Taylor(found, SLACK * sizes)

    def torques(self, given: Any) -> tuple[Array, Array]:
        """Bounds of what the motors give, (n, dof) each: Newton and Euler from the base on and back (lemma 6)."""
        place, speed, quicker = ([self.state(d)[:, j, None, None] for j in range(len(given.joints))] for d in range(3))
        arm, wrenches, zero = Arm(given, place, fixed, Taylor.waves), [], fixed(np.zeros((3, 1)))
        twists, felt = [(zero, zero, fixed(-given.gravity[:, None]))], [(zero, zero)] * (len(speed) + 1)
        for j, on in enumerate(given.parents):
            rate, spin, pull = twists[on]
            frame, axis, lever = arm.frames[j + 1], arm.axes[j], arm.arms[j]
            pull = pull + spin.cross(lever) + rate.cross(rate.cross(lever))
            along = axis * speed[j]
            twist = rate.cross(along)
            if given.turns[j]:
                rate, spin = rate + along, spin + twist + axis * quicker[j]
            else:
                pull = pull + twist + twist + axis * quicker[j]
            twists, force, moment = [*twists, (rate, spin, pull)], zero, zero
            for mass in given.masses[given.carriers == j]:
                center = frame @ fixed(mass[1:4, None])
                inertia = frame @ fixed(mass[4:].reshape(3, 3)) @ frame.T
                push = (pull + spin.cross(center) + rate.cross(rate.cross(center))) * fixed(mass[0])
                force, moment = force + push, moment + center.cross(push) + inertia @ spin + rate.cross(inertia @ rate)
            wrenches.append((force, moment))
        low, high = np.empty((2, len(self.half), len(speed)))
        for j, on in reversed(list(enumerate(given.parents))):
            force, moment = (own + passed for own, passed in zip(wrenches[j], felt[j + 1], strict=True))
            along, friction = moment if given.turns[j] else force, given.friction[:, j]
            motor = arm.axes[j].T @ along + speed[j] * fixed(friction[0])
            (least, most), (slowest, fastest) = ([part[:, 0, 0] for part in of.range()] for of in (motor, speed[j]))
            low[:, j] = least + np.where(slowest > 0.0, 1.0, -1.0) * friction[1]
            high[:, j] = most + np.where(fastest < 0.0, -1.0, 1.0) * friction[1]
            felt[on] = felt[on][0] + force, felt[on][1] + moment + arm.arms[j].cross(force)
        return np.nextafter(low, -inf), np.nextafter(high, inf)


class Taylor:
    """Arrays of functions of s from -1 to 1: cubic polynomials (4, ...), and how far from them at most (lemma 6)."""

    def __init__(self, terms: Array, off: Any = 0.0) -> None:
        self.terms = np.concatenate([terms[:4], np.zeros((max(0, 4 - len(terms)), *terms.shape[1:]))])
        self.size = np.abs(self.terms).sum(axis=0)
        self.off = (off + np.abs(terms[4:]).sum(axis=0)) * (1.0 + SLACK) + 64.0 * U * self.size

    def __getitem__(self, index: Any) -> "Taylor":
        return Taylor(self.terms[:, *index], self.off[index])

    def __add__(self, other: "Taylor") -> "Taylor":
        return Taylor(self.terms + other.terms, self.off + other.off)

    def __sub__(self, other: "Taylor") -> "Taylor":
        return Taylor(self.terms - other.terms, self.off + other.off)

    def __mul__(self, other: "Taylor") -> "Taylor":
        pairs = self.terms[:, None] * other.terms
        orders = (ORDERS @ pairs.reshape(16, -1)).reshape(7, *pairs.shape[2:])
        off = self.size * other.off + self.off * (other.size + other.off) + 64.0 * U * self.size * other.size
        return Taylor(orders, off)

    def __matmul__(self, other: "Taylor") -> "Taylor":
        product = self[..., None] * other[..., None, :, :]  # of matrices (n, i, j, 1) and (n, 1, j, k)
        return Taylor(product.terms.sum(axis=-2), product.off.sum(axis=-2))

    T = property(lambda self: Taylor(self.terms.swapaxes(-1, -2), self.off.swapaxes(-1, -2)))  # of matrices, as columns

    def cross(self, other: "Taylor") -> "Taylor":
        """The cross product of columns."""
        one, two = (slice(None), [1, 2, 0]), (slice(None), [2, 0, 1])
        return self[one] * other[two] - self[two] * other[one]

    def waves(self) -> "tuple[Taylor, Taylor]":
        """Cosine and sine: of y = x - x0 within |y|^4 / 24 of 1 - y^2 / 2, and |y|^5 / 120 of y - y^3 / 6."""
        x0, terms = self.terms[0], np.concatenate([np.zeros_like(self.terms[:1]), self.terms[1:]])
        y, most = Taylor(terms, self.off), np.abs(terms).sum(axis=0) + self.off
        even, odd = fixed(1.0) - y * y * fixed(0.5), y - y * y * y * fixed(1.0 / 6.0)
        even, odd = Taylor(even.terms, even.off + most**4 / 24.0), Taylor(odd.terms, odd.off + most**5 / 120.0)
        c, s = (Taylor(part[None], 8.0 * U) for part in (np.cos(x0), np.sin(x0)))
        return c * even - s * odd, s * even + c * odd

    def range(self) -> tuple[Array, Array]:
        """Bounds: Bernstein coefficients (lemma 2)."""
        a, b, c, d = self.terms
        values = np.stack([a - b + c - d, a - (b + c) / 3.0 + d, a + (b - c) / 3.0 - d, a + b + c + d])
        return values.min(axis=0) - self.off, values.max(axis=0) + self.off


def fixed(value: Any) -> Taylor:
    """What is the same in all cells, but for OFF of matrices and axes."""
    return Taylor(np.atleast_2d(value)[None, None], 4.0 * OFF * np.abs(value).sum())


class Arm:
    """Frames, places and axes of bodies, the base's first, at values (n, 1, 1) of the joints: arrays, or functions."""

    def __init__(self, given: Any, values: Any, kept: Callable[[Any], Any], waves: Callable[[Any], Any]) -> None:
        self.frames, self.places = [kept(given.base_rotation)], [kept(given.base_translation[:, None])]
        self.axes, self.arms = list[Any](), list[Any]()
        for j, (on, value) in enumerate(zip(given.parents, values, strict=True)):
            a, frame = given.axes[j], self.frames[on]
            arm = frame @ kept(given.translations[j][:, None])
            frame, along = frame @ kept(given.rotations[j]), np.outer(a, a)
            axis = frame @ kept(a[:, None])
            if given.turns[j]:
                c, s = waves(value)
                frame = frame @ (kept(along) + c * kept(np.eye(3) - along) + s * kept(np.cross(np.eye(3), a)))
            else:
                arm = arm + axis * value
            self.frames, self.places = [*self.frames, frame], [*self.places, self.places[on] + arm]
            self.axes, self.arms = [*self.axes, axis], [*self.arms, arm]


class Scene:
    """A robot in cells: where it is in their middles, and how far from there it may be, its tracking error included."""

    def __init__(self, stage: "Stage", cells: Cells) -> None:
        self.robot, self.cell, given, place = stage.robot, cells.of, stage.given.robot, cells.state(0)
        (constant, *shares), rates = given.tracking_error, [cells.state(order) for order in (1, 2)]
        error = sum((share * (rate.size + rate.off) for share, rate in zip(shares, rates, strict=True)), constant)
        self.away = (np.abs(place.terms[1:]).sum(axis=0) + place.off + error) * (1.0 + SLACK)  # of joints
        values = place.terms[0].T[:, :, None, None]
        each = np.zeros((len(self.away), 1, 1))  # also of what no joint turns
        arm = Arm(given, values, lambda x: x + each, lambda x: (np.cos(x), np.sin(x)))
        self.frames, self.places, self.axes = (np.stack(part) for part in (arm.frames, arm.places, arm.axes))
        size = stage.robot.size + stage.outer + float(np.abs(values[given.turns == 0]).sum(axis=0).max(initial=0.0))
        self.rounding = 8.0 * (stage.robot.dof + 4) * (6.0 * OFF + 128.0 * U) * size  # lemma 7

    def follow(self, body: Whole, ends: Array, seen_from: Any) -> tuple[Array, Array]:
        """Where points of bodies, (1 or 2, m, 3), are in the middles of cells; how far they travel (lemma 3)."""
        cell, (frame, place) = self.cell, (part[body, self.cell] for part in (self.frames, self.places))
        points, moved = np.einsum("mij,emj->emi", frame, ends) + place[..., 0], np.zeros(len(body))
        for j, turns in enumerate(self.robot.given.turns):
            by = np.flatnonzero(self.robot.moves[j, body] & ~self.robot.moves[j, seen_from])
            arm = np.cross(self.axes[j, cell[by], :, 0], points[:, by] - self.places[j + 1, cell[by], :, 0])
            moved[by] += self.away[cell[by], j] * (norm(arm, axis=2).max(axis=0) + self.rounding if turns else 1.0)
        return points, moved * (1.0 + SLACK)


class Claim:
    """That pairs (n, 2) have room in cells (n,), and so everything, all the time: the proof divides both (lemma 4)."""

    def __init__(self, stage: "Stage", look: Callable[..., Any], name: str, roots: Any, names: Any, balls: int) -> None:
        self.stage, self.look, self.name, self.names, self.balls = stage, look, name, names, balls
        self.pairs = np.repeat(np.array(roots, dtype=np.intp).reshape(-1, 2), stage.pieces, axis=0)
        self.cells = np.tile(np.arange(stage.pieces, 2 * stage.pieces), len(roots))

    def words(self, k: int) -> str:
        """The k-th of what is left."""
        cell, (one, two) = Cells(self.stage, self.cells[k : k + 1]), self.pairs[k]
        begin, end = (self.stage.breaks[cell.piece[0]] + part[0] for part in (cell.start, cell.end))
        return f"{self.name.format(self.names[0][one], self.names[1][two])}, t = {begin:.9g} to {end:.9g} s"

    def divide(self, digits: NDArray[np.uint8]) -> None:
        """What is left: nothing where a digit is 0, halves of the cell where it is 1, parts of a ball where it is 2."""
        robot, pieces, half, pairs = self.stage.robot, self.stage.pieces, digits == 1, self.pairs[digits == 2]
        balls = np.arange(2) < self.balls
        sizes = robot.divisible[pairs * balls] * balls
        need((sizes > 0.0).any(axis=1).all(), "proof", "a ball that has parts, where the digit is 2,")
        rows, which = np.arange(len(pairs)), np.argmax(sizes, axis=1)  # the larger one, of equal ones the first
        ball = pairs[rows, which]
        need(robot.counts[ball].sum() < MOST_PARTS, "proof", f"fewer than {MOST_PARTS} parts at a time")
        parts = pairs[whole := np.repeat(rows, robot.counts[ball])]
        parts[np.arange(len(whole)), which[whole]] = np.concatenate([whole[:0], *(robot.children[b] for b in ball)])
        early = self.cells[half] + self.cells[half] // pieces * pieces
        self.pairs = np.concatenate([np.tile(self.pairs[half], (2, 1)), parts])
        self.cells = np.concatenate([early, early + pieces, self.cells[digits == 2][whole]])

    def check(self, proof: Sequence[NDArray[np.uint8]]) -> None:
        """What has room by the proof has it, and in the end nothing is left."""
        need(len(proof) <= MOST_LEVELS, "proof", f"no more than {MOST_LEVELS} levels")
        for digits in [*proof, np.empty(0, dtype=np.uint8)]:
            if len(digits) < len(self.cells):
                raise RefusedError(f"{self.words(len(digits))}: no proof")
            need(len(digits) == len(self.cells), "proof", "one digit of each pair and cell that is left")
            held = np.flatnonzero(digits == 0)
            room, _ = self.look(self.pairs[held], Cells(self.stage, self.cells[held]))
            for k in np.flatnonzero(~(room >= 0.0)):
                raise RefusedError(f"{self.words(held[k])}: {-room[k]:.3g} short")
            self.divide(digits)


class Stage:
    """One motion, and what it claims."""

    def __init__(self, given: Any, where: str) -> None:
        self.given, self.robot, robot = given, Robot(given.robot, f"{where}.robot"), given.robot
        self.breaks, local, self.used = given.breakpoints, given.coefficients, 0  # of the planes
        self.pieces, powers = local.shape[0], local.shape[2]
        rising = len(self.breaks) == self.pieces + 1 and self.breaks[0] == 0.0 and (np.diff(self.breaks) > 0.0).all()
        need(rising and 0 < self.pieces < MOST_PIECES and 0 < powers <= MOST_POWERS, where, "rising breakpoints")
        orders = [[perm(d, k) for d in range(powers)] for k in range(TORQUE)]
        self.derivatives = [(local * order)[:, :, min(k, powers - 1) :] for k, order in enumerate(orders)]
        self.lengths = np.nextafter(np.diff(self.breaks), inf)  # no less than they are
        need((given.tolerances <= MOST_TOLERANCES).all(), f"{where}.tolerances", f"no more than {MOST_TOLERANCES}")
        sound = all(len(o.sizes) == SHAPES.get(o.shape, (-1, None))[0] for o in given.obstacles)
        need(sound, f"{where}.obstacles", f"one of {', '.join(SHAPES)}, with its sizes,")
        self.pace = np.array([norm(o.velocity) + o.growth for o in given.obstacles]) * (1.0 + 16.0 * U)
        sizes = [norm(o.center) + o.sizes.sum() + norm(o.points, axis=1).max(initial=0.0) for o in given.obstacles]
        self.outer = float(np.max(sizes + self.pace * self.breaks[-1], initial=0.0))
        self.orders = 3 if np.isfinite(robot.limits[:, 2]).any() else 2  # of the state that may not jump
        stated, error = np.vstack([robot.ranges[:, 1], robot.limits.T]), robot.tracking_error
        self.high = stated * (1.0 + given.tolerances[0])
        beside = error[0] + np.where(error[1:] > 0.0, error[1:] * self.high[1:3], 0.0).sum(axis=0)
        spare = given.tolerances[0] * (stated[0] - robot.ranges[:, 0]) - beside * (1.0 + 16.0 * U)
        self.low, self.high[0] = np.vstack([robot.ranges[:, 0] - spare, -self.high[1:]]), stated[0] + spare
        self.touching = set(zip(given.may_touch.links.tolist(), given.may_touch.obstacles.tolist(), strict=True))
        links, roots, names = self.robot.links, self.robot.roots.tolist(), [o.name for o in given.obstacles]
        kept = [(b, k) for n, b in enumerate(roots) for k in range(len(names)) if (n, k) not in self.touching]
        self.claims = {
            "limits": Claim(self, self.within, "{} of {}", np.argwhere(np.isfinite(stated)), (LIMITS, robot.joints), 0),
            "obstacles": Claim(self, self.clear, "clearance of {} from {}", kept, (links, names), 1),
            "own": Claim(self, self.apart, "self clearance of {} from {}", robot.own_pairs, (links, links), 2),
        }

    def within(self, pairs: Whole, cells: Cells) -> tuple[Array, Array]:
        """Of limits and joints: the least room of both bounds."""
        room, (kind, joint) = np.empty(len(pairs)), pairs.T
        for k in np.unique(kind):
            low, high = cells.torques(self.given.robot) if k == TORQUE else cells.state(k).range()
            among, least = kind == k, np.minimum(low - self.low[k], self.high[k] - high)
            room[among] = least[cells.of[among], joint[among]]
        return room, np.zeros(len(pairs))

    def clear(self, pairs: Whole, cells: Cells) -> tuple[Array, Array]:
        """Of balls and obstacles: room beyond planes in the middles of cells, less what both travel (lemma 5)."""
        scene, (ball, other), room = Scene(self, cells), pairs.T, np.empty(len(pairs))
        body, times = self.robot.body[ball], cells.times[cells.of]
        ends, moved = scene.follow(body, self.robot.ends[:, ball], 0)
        planes, self.used = self.given.planes[self.used : self.used + len(pairs)], self.used + len(pairs)
        need(len(planes) == len(pairs), "planes", "one of each ball, obstacle and cell that have room")
        n = planes / np.maximum(norm(planes, axis=1), TINY)[:, None]
        for k in np.unique(other):
            o, by = self.given.obstacles[k], np.flatnonzero(other == k)
            seen = (ends[:, by] - o.center - times[by, None] * o.velocity) @ o.rotation
            farthest = SHAPES[o.shape][1](n[by], o.sizes, o.points)
            room[by] = (n[by] * seen).sum(axis=2).min(axis=0) - farthest - o.growth * times[by]
        travel = moved + self.pace[other] * cells.half[cells.of] * (1.0 + SLACK)
        return room - self.robot.radii[ball] - self.given.margins[0] - travel - scene.rounding, travel

    def apart(self, pairs: Whole, cells: Cells) -> tuple[Array, Array]:
        """Of two balls: the best of planes across ways from ends to the other one (lemma 5)."""
        scene, (body, other), found = Scene(self, cells), self.robot.body[pairs].T, np.full(len(pairs), -inf)
        near, back = scene.follow(other, self.robot.ends[:, pairs[:, 1]], body)
        far, travel = scene.follow(body, self.robot.ends[:, pairs[:, 0]], other)
        travel = travel + back
        for one, two in ((near, far), (far, near)):
            along = two[-1] - two[0]
            share = ((one - two[0]) * along).sum(axis=2) / np.maximum((along * along).sum(axis=1), TINY)
            way = one - two[0] - np.clip(share, 0.0, 1.0)[:, :, None] * along
            n = (way / np.maximum(norm(way, axis=2), TINY)[:, :, None])[:, None, None]
            found = np.maximum(found, ((one[:, None] - two) * n).sum(axis=4).min(axis=(1, 2)).max(axis=0))
        return found - self.robot.radii[pairs].sum(axis=1) - self.given.margins[1] - travel - scene.rounding, travel

    def check(self) -> None:
        """It starts and ends as stated, does not jump, and keeps what it claims."""
        given = self.given
        need(given.pause == 0.0 or not (given.goal[1:].any() or self.pace.any()), given.name, "rest before a pause")
        for order, (what, most) in enumerate(zip(STATE[: self.orders], given.tolerances[1:], strict=False)):
            local = self.derivatives[order]
            terms = local * self.lengths[:, None, None] ** np.arange(local.shape[2])
            starts, ends, off = local[:, :, 0], terms.sum(axis=2), SLACK * np.abs(terms).sum(axis=2)
            stated = np.vstack([given.start[order], starts[1:], given.goal[order]])
            jumps = np.cumsum(np.abs(stated - np.vstack([starts[:1], ends])) + 2.0 * off.max(axis=0), axis=0)
            for k in np.flatnonzero(~(jumps <= most).all(axis=1)):
                raise RefusedError(f"{what} of {given.name} jumps by {jumps[k].max()} up to t = {self.breaks[k]} s")
        for p in given.places:  # as the motion itself has them, to its tolerance (lemma 8)
            at, body, off = (given.start, given.goal)[p.at_goal][0], p.carrier + 1, given.tolerances[1]
            arm = Arm(given.robot, (Taylor(np.full((1, 1, 1, 1), q), off) for q in at), fixed, Taylor.waves)
            low, high = (arm.frames[body] @ fixed(p.points.T) + arm.places[body] - fixed(p.places.T)).range()
            away = norm(np.maximum(-low, high), axis=1).max(initial=0.0) * (1.0 + SLACK)
            if not away <= p.within:
                raise RefusedError(f"{('start', 'goal')[p.at_goal]} of {given.name}: {away:.3g} m from its places")
        for key, claim in self.claims.items():
            claim.check(getattr(given.proof, key))

    def lines(self) -> Iterator[str]:
        """What it claims, and of what."""
        given, robot, off = self.given, self.given.robot, self.given.tolerances
        yield f"{given.name}: {self.breaks[-1]} s, then {given.pause} s at rest; limits to {off[0]} of them or widths"
        for j, joint in enumerate(robot.joints):
            limits = zip(LIMITS, [robot.ranges[j].tolist(), *robot.limits[j]], strict=True)
            stated = "".join(f"{limit} {bound}, " for limit, bound in limits if np.isfinite(bound).all())
            error = robot.tracking_error[:, j].tolist()
            yield f"  {joint}: {stated}tracking error {error}: constant, of speed, of acceleration"
        for k, what in enumerate(STATE[: self.orders]):
            yield f"  {what}: {given.start[k].tolist()} to {given.goal[k].tolist()}, jumps add up to {off[k + 1]}"
        for part in (*given.obstacles, *given.places):
            yield "  " + ", ".join(f"{key} {np.asarray(value).tolist()}" for key, value in vars(part).items())
        names, links, roots = robot.links, self.robot.links, self.robot.roots
        yield f"  {given.margins[0]} m between links ({', '.join(names)}) and obstacles"
        yield from (f"    but {names[link]} and {given.obstacles[k].name}" for link, k in sorted(self.touching))
        parts = np.where(np.isin(robot.own_pairs, roots).all(axis=1), "", " (some of their balls alone)")
        own = [f"{links[a]} from {links[b]}{part}" for (a, b), part in zip(robot.own_pairs, parts, strict=True)]
        yield f"  {given.margins[1]} m between own links: {'; '.join(dict.fromkeys(own)) or 'none'}; no other pairs"
        yield from (f"  not in this certificate: {line}" for line in given.not_covered)


def check(content: Any) -> list[Stage]:
    """The stages of a certificate; raises where it is none, or not all that it claims is proven."""
    with np.errstate(all="ignore"):  # what comes of it is no number, or infinite, and proves nothing
        given = formed(content, "FILE", "file", {})
        need((given.format, given.version) == (FORMAT, VERSION) and given.stages, "format", f"{FORMAT} {VERSION}")
        stages = [Stage(part, f"stages[{k}]") for k, part in enumerate(given.stages)]
        for one, two in pairwise(stages):
            same = all(np.array_equal(getattr(one.given.robot, key), getattr(two.given.robot, key)) for key in CHAIN)
            follows = np.array_equal(one.given.goal, two.given.start) and not (one.pace.any() or two.pace.any())
            need(same and follows, two.given.name, "the same arm, its state at the end before, and obstacles at rest,")
        for stage in stages:
            stage.check()
        return stages


def main(arguments: Sequence[str]) -> int:
    """Check a file; returns the exit status."""
    try:
        need(len(arguments) == 1, "arguments", "one file")
        stages = check(read(Path(arguments[0])))
    except (OSError, EOFError, ValueError, ArithmeticError, RecursionError, MemoryError, zlib.error) as error:
        print(f"{' '.join(arguments)}: no certificate: {error}", file=sys.stderr)
        return 2
    except RefusedError as error:
        print(f"refused: {error}")
        return 1
    print(*(line for stage in stages for line in stage.lines()), ACCEPTED, sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

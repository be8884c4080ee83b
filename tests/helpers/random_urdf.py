"""Random URDFs with links off the chain: brackets, walls, carts above the base, joints that follow others."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

SHAPES = (
    '<box size="0.3 0.05 0.05"/>',
    '<box size="0.1 0.1 0.1"/>',
    '<cylinder radius="0.03" length="0.2"/>',
    '<sphere radius="0.04"/>',
)
WALL, CART = '<box size="0.6 0.02 0.4"/>', '<box size="0.8 0.8 0.1"/>'


@dataclass
class RandomUrdf:
    """A robot that is put together link by link.

    Attributes:
        rng: that decides.
        parts: elements of the file.
        joints: of the chain: name, lowest and highest value.
        held: values of joints off the chain that do not follow it, computed by hand.
        followers: joints off the chain: how each follows one of it, (its name, multiplier, offset).
        parents: of all links: name of the parent, and of the joint.
        solid: links with geometry.
    """

    rng: np.random.Generator
    parts: list[str] = field(default_factory=list)
    joints: list[tuple[str, float, float]] = field(default_factory=list)
    held: dict[str, float] = field(default_factory=dict)
    followers: dict[str, tuple[str, float, float]] = field(default_factory=dict)
    parents: dict[str, tuple[str, str]] = field(default_factory=dict)
    solid: set[str] = field(default_factory=set)

    def link(self, name: str, shape: str | None) -> None:
        body = ""
        if shape is not None:
            x, y, z = self.rng.uniform(-0.08, 0.08, 3)
            body = f'<collision><origin xyz="{x:.4f} {y:.4f} {z:.4f}"/><geometry>{shape}</geometry></collision>'
            self.solid.add(name)
        self.parts.append(f'<link name="{name}">{body}</link>')

    def joint(self, name: str, kind: str, parent: str, child: str, xyz: np.ndarray, more: str = "") -> None:
        rpy = self.rng.choice([0.0, 0.0, 0.5, -1.2, np.pi / 2.0], 3)
        self.parts.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz[0]:.4f} {xyz[1]:.4f} {xyz[2]:.4f}" rpy="{rpy[0]:.4f} {rpy[1]:.4f} {rpy[2]:.4f}"/>'
            f"{more}</joint>"
        )
        self.parents[child] = (parent, name)

    def moving(self, low: float, high: float, mimic: str = "") -> str:
        axis = ("1 0 0", "0 1 0", "0 0 1")[self.rng.integers(3)]
        limit = f'<limit lower="{low}" upper="{high}" velocity="2" effort="100"/>'
        return f'<axis xyz="{axis}"/>{limit}{mimic}'

    def any_shape(self) -> str:
        return SHAPES[self.rng.integers(len(SHAPES))]

    def place(self, least: float = 0.12, most: float = 0.3) -> np.ndarray:
        way = self.rng.normal(size=3)
        return np.asarray(way / np.linalg.norm(way) * self.rng.uniform(least, most))

    @property
    def text(self) -> str:
        return f'<robot name="r">{"".join(self.parts)}</robot>'

    def value(self, joint: str, chain: dict[str, float]) -> float:
        """Where a joint is when those of the chain have values."""
        if joint in self.followers:
            leader, multiplier, offset = self.followers[joint]
            return multiplier * chain[leader] + offset
        return chain[joint] if joint in chain else self.held[joint]

    def steps(self, one: str, two: str) -> list[tuple[str, str]]:
        """Joints on the way between two links, and the links passed, the two themselves left out."""
        above: list[list[str]] = []
        for link in (one, two):
            path = [link]
            while path[-1] in self.parents:
                path.append(self.parents[path[-1]][0])
            above.append(path)
        common = next(link for link in above[0] if link in above[1])
        found = []
        for path in above:
            found += [(self.parents[link][1], link) for link in path[: path.index(common)]]
        passed = {link for _, link in found} | {common}
        return [(joint, link) for joint, link in found] + [("", link) for link in passed - {one, two}]

    def separates(self, one: str, two: str) -> list[str]:
        """Joints between two links that move when the chain does."""
        chain = {name for name, *_ in self.joints}
        return [joint for joint, _ in self.steps(one, two) if joint in chain or joint in self.followers]

    def between(self, one: str, two: str) -> set[str]:
        """Links on the way between two."""
        return {link for _, link in self.steps(one, two)} - {one, two}


def random_urdf(seed: int) -> RandomUrdf:
    """One of many robots, the same for the same seed."""
    made = RandomUrdf(np.random.default_rng(seed))
    rng = made.rng
    if rng.random() < 0.5:
        _put_on_a_cart(made)
    made.link("base", made.any_shape() if rng.random() < 0.5 else None)
    if rng.random() < 0.4:
        made.link("wall", WALL)
        made.joint("fixed_wall", "fixed", "base", "wall", made.place(0.25, 0.5))
    here = "base"
    for number in range(int(rng.integers(2, 4))):
        name = f"l{number}"
        made.link(name, made.any_shape() if rng.random() < 0.8 else None)
        kind, low, high = ("prismatic", 0.0, 0.2) if rng.random() < 0.2 else ("revolute", -1.8, 1.8)
        made.joint(f"j{number}", kind, here, name, made.place(), made.moving(low, high))
        made.joints.append((f"j{number}", low, high))
        if rng.random() < 0.4:
            made.link(f"bracket{number}", made.any_shape())
            made.joint(f"fixed{number}", "fixed", name, f"bracket{number}", made.place())
        here = name
    if rng.random() < 0.5:
        _follow(made, f"l{rng.integers(len(made.joints))}")
    if rng.random() < 0.25:
        _mimic_the_chain(made, "base" if rng.random() < 0.5 else "l0")
    return made


def _put_on_a_cart(made: RandomUrdf) -> None:
    made.link("cart", CART)
    made.parents["base"] = ("cart", "mount")
    if made.rng.random() < 0.5:
        made.joint("mount", "fixed", "cart", "base", np.array([0.0, 0.0, 0.25]))
    else:
        made.joint("mount", "prismatic", "cart", "base", np.zeros(3), made.moving(0.2, 0.6))
        made.held["mount"] = 0.4
    if made.rng.random() < 0.5:
        made.link("post", made.any_shape())
        made.joint("fixed_post", "fixed", "cart", "post", made.place(0.3, 0.5))


def _follow(made: RandomUrdf, carrier: str) -> None:
    """A finger off the chain, one that mimics it, and one that mimics that one."""
    low, high = (-1.0, 1.0) if made.rng.random() < 0.5 else (0.2, 0.8)
    made.held["f0"] = 0.0 if low < 0.0 else 0.5
    for number in range(3):
        m, o = np.round(made.rng.uniform(-1.5, 1.5, 2), 3)
        mimic = f'<mimic joint="f{number - 1}" multiplier="{m}" offset="{o}"/>' if number else ""
        if number:
            made.held[f"f{number}"] = m * made.held[f"f{number - 1}"] + o
        made.link(f"finger{number}", made.any_shape())
        made.joint(f"f{number}", "revolute", carrier, f"finger{number}", made.place(), made.moving(low, high, mimic))
        carrier = f"finger{number}"


def _mimic_the_chain(made: RandomUrdf, carrier: str) -> None:
    """A rod that mimics the first joint, and another on it that mimics the rod's."""
    leader, multiplier, offset = "j0", 1.0, 0.0
    for number in range(2):
        m, o = np.round(made.rng.uniform(-1.5, 1.5, 2), 3)
        mimic = f'<mimic joint="{leader if number == 0 else "m0"}" multiplier="{m}" offset="{o}"/>'
        multiplier, offset = m * multiplier, m * offset + o
        made.followers[f"m{number}"] = ("j0", multiplier, offset)
        made.link(f"rod{number}", made.any_shape())
        made.joint(f"m{number}", "revolute", carrier, f"rod{number}", made.place(), made.moving(-3.0, 3.0, mimic))
        carrier = f"rod{number}"

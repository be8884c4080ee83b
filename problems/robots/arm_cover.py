"""The cover of an arm for proofs: of every link a tree of balls, and which links must keep apart."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from hashlib import sha256

import numpy as np

from problems.geometry import Balls, BallTree

TREES = 128  # that are kept, of about ten links each arm


@dataclass(frozen=True, eq=False)
class CoveredLink:
    """A link on a body of the chain, with balls that hold it. Two with the same content are equal.

    Attributes:
        name: of the link.
        body: number of the body that carries it: 0 for the base, then that of the joint that moves it.
        balls: that are proven to hold it, in the body's frame.
        overhang: no farther than that from the link is any of them, m.
    """

    name: str
    body: int
    balls: Balls
    overhang: float

    @property
    def tree(self) -> BallTree:
        """The tree of the balls, one for all links with the same content."""
        return _tree_of(self)

    @cached_property
    def digest(self) -> str:
        """A digest of name, body, balls and overhang."""
        content = np.column_stack([self.balls.centers, self.balls.radii])
        return sha256(f"{self.name} {self.body} {self.overhang!r} ".encode() + content.tobytes()).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CoveredLink) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


@lru_cache(maxsize=TREES)
def _tree_of(link: CoveredLink) -> BallTree:
    return BallTree.of(link.balls)


@dataclass(frozen=True, eq=False)
class ArmCover:
    """The covers of all links of an arm. Two with the same content are equal.

    Attributes:
        links: those with collision geometry.
        pairs: numbers of links that must keep apart, the one nearer the base first.
    """

    links: tuple[CoveredLink, ...]
    pairs: tuple[tuple[int, int], ...] = ()

    @cached_property
    def digest(self) -> str:
        """A digest of all links and pairs."""
        return sha256(f"{[link.digest for link in self.links]} {self.pairs}".encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ArmCover) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        return f"<cover of {sum(len(link.balls) for link in self.links)} balls on {len(self.links)} links>"

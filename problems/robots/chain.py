"""Joints in space that are on each other, in a chain or a tree: frames, masses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

import numpy as np

from problems.base import FRICTIONS, FloatArray, InvalidProblem, Matrix, Operand, Parametric, check_within, columns
from problems.robots.dynamics import RigidJoint, regrouped
from problems.robots.inertia import Inertia, combined
from problems.robots.transform import UNMOVED, FixedFrame, Point3, Transform, moved


class JointKind(StrEnum):
    """The kind of motion of a joint."""

    REVOLUTE = "revolute"  # turns between its limits
    CONTINUOUS = "continuous"  # turns without end
    PRISMATIC = "prismatic"  # slides


@dataclass(frozen=True, kw_only=True)
class ChainJoint(Parametric):
    """A joint and the body that it moves.

    Attributes:
        name: of the joint.
        link: name of the body that it moves, whose frame is the joint's own.
        kind: how it moves.
        pose: of its frame in that of the body that it is on, at zero.
        axis: unit vector in its own frame.
        parent: number of the body that it is on, 0 for the base, else that of the joint that moves the body; None for
            the body of the joint before.
        position: (lowest, highest), rad or m; None where it turns without end.
        speed: largest, rad/s or m/s; None where it is not stated.
        effort: largest torque, N m, or force, N; None where it is not stated.
        damping: viscous friction, N m s or N s/m.
        friction: Coulomb friction, N m or N.
        inertia: of the body, with everything fixed to it; None where no mass is stated.
        fault: why no body has the inertia that is stated, of itself or of what is fixed to it; empty where one has.
    """

    name: str
    link: str
    kind: JointKind = JointKind.REVOLUTE
    pose: FixedFrame = UNMOVED
    axis: Point3 = (0.0, 0.0, 1.0)
    parent: int | None = None
    position: tuple[float, float] | None = None
    speed: float | None = None
    effort: float | None = None
    damping: float = 0.0
    friction: float = 0.0
    inertia: Inertia | None = None
    fault: str = ""

    def moved(self, value: Operand) -> Transform:
        """The transform from its own frame to that of the body that it is on, at a value (n, 1) in rad or m."""
        return moved(self.pose, self.axis, self.turns, value)

    def rigid_on(self, parent: int) -> RigidJoint:
        """The joint, on a body of that number, with the mass that it moves, which has to be known."""
        assert self.inertia is not None
        return RigidJoint(
            parent=parent,
            pose=self.pose,
            axis=self.axis,
            turns=self.turns,
            moments=self.inertia.moments(),
            damping=self.damping,
            friction=self.friction,
        )

    @property
    def turns(self) -> bool:
        """Whether its value is an angle."""
        return self.kind is not JointKind.PRISMATIC

    @property
    def travel(self) -> float:
        """The largest distance of its frame from where it is at zero, m."""
        return 0.0 if self.turns or self.position is None else max(map(abs, self.position))


@dataclass(frozen=True, kw_only=True)
class Tip(Parametric):
    """The end of a branch of joints, by its name.

    Attributes:
        name: such as ``left``.
        link: name of the frame at the end.
        frame: that frame in the one of its body.
        body: number of that body.
        base: where its branch stands, in the frame of the robot's base, m.
    """

    name: str
    link: str
    frame: FixedFrame
    body: int
    base: Point3 = (0.0, 0.0, 0.0)

    @property
    def points(self) -> tuple[Point3, ...]:
        """The origin of its frame, and points 1 m along the axes of that, in the frame of its body, m."""
        origin, columns = self.frame.translation, zip(*self.frame.rotation, strict=True)
        return (origin, *((origin[0] + x, origin[1] + y, origin[2] + z) for x, y, z in columns))


@dataclass(frozen=True, kw_only=True)
class Chain(Parametric):
    """Joints, each on the base or on a body that another one moves; in a serial chain each is on the one before.

    Attributes:
        name: of the robot.
        joints: none comes before the one whose body it is on.
        base_link: name of the body that stands still.
        tip_link: name of the frame that carries the tool.
        tip: that frame in the one of its body.
        tip_body: number of that body, 0 for the base; None for that of the last joint.
        tips: ends of several branches, of which one carries the tool; none of a chain.
    """

    name: str
    joints: tuple[ChainJoint, ...]
    base_link: str = "base"
    tip_link: str = "tip"
    tip: FixedFrame = UNMOVED
    tip_body: int | None = None
    tips: tuple[Tip, ...] = ()

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """The number of the body that each joint is on."""
        each = enumerate(self.joints)
        return tuple(number if joint.parent is None else joint.parent for number, joint in each)

    @property
    def carrier(self) -> int:
        """The number of the body that carries the tool."""
        return len(self.joints) if self.tip_body is None else self.tip_body

    @property
    def ends(self) -> tuple[str, ...]:
        """Names of the links that end a branch: the tool's, and those of bodies on which no joint is."""
        last = [body for body in range(1, len(self.joints) + 1) if body not in self.parents and body != self.carrier]
        return (self.tip_link, *(self.joints[body - 1].link for body in last))

    def tip_named(self, name: str) -> Tip:
        """The tip of a name.

        Raises:
            InvalidProblem: there is none.
        """
        tips = {tip.name: tip for tip in self.tips}
        if name not in tips:
            known = f"there are {', '.join(tips)}" if tips else "there is one arm alone"
            raise InvalidProblem("arm", f"no arm is called {name!r}; {known}")
        return tips[name]

    def ended_at(self, tip: Tip) -> Chain:
        """The chain with the tool at another tip."""
        return replace(self, tip_link=tip.link, tip=tip.frame, tip_body=tip.body)

    def loaded(self, body: int, load: Inertia) -> Chain:
        """The chain with a further mass on a body, in whose frame it is stated, where the body's own is known."""
        own = self.joints[body - 1].inertia if body else None
        if own is None:
            return self
        joint = replace(self.joints[body - 1], inertia=combined([own, load]))
        return replace(self, joints=(*self.joints[: body - 1], joint, *self.joints[body:]))

    def seen_from(self, tip: Tip) -> Chain:
        """The chain whose base is the frame of a tip that one joint moves, before all joints of the others.

        Raises:
            InvalidProblem: several joints move the tip, or one of others stands before its joint.
        """
        if self.parents[tip.body - 1] != 0 or tip.body != 1:
            reason = "one joint alone has to move it, of the robot that is stated first"
            raise InvalidProblem("frame", f"{tip.name!r}: {reason}")
        own, inverse = self.joints[0], FixedFrame.of(self.joints[0].pose.inverse)
        x, y, z = own.axis
        turned = replace(own, pose=FixedFrame.of(tip.frame.inverse), axis=(-x, -y, -z), link=self.base_link)
        others = [
            replace(joint, parent=parent or 1, pose=joint.pose if parent else FixedFrame.of(inverse @ joint.pose))
            for joint, parent in zip(self.joints[1:], self.parents[1:], strict=True)
        ]
        return replace(self, joints=(turned, *others), base_link=tip.link, tips=())

    @cached_property
    def branches(self) -> dict[str, tuple[int, ...]]:
        """Numbers, from 0, of the joints that move each tip and no other, by the tips' names."""
        above = {tip.name: set(self.above(tip.body)) for tip in self.tips}
        return {
            name: tuple(sorted(body - 1 for body in own if sum(body in other for other in above.values()) == 1))
            for name, own in above.items()
        }

    @cached_property
    def orders(self) -> tuple[tuple[int, ...], ...]:
        """When each joint has its turn, if one branch moves after another, each being first once; none of one branch.

        Joints that are of no branch alone come before all others.
        """
        branches = [joints for joints in self.branches.values() if joints]
        begin = 0 if len(self.joints) == sum(map(len, branches)) else 1
        found = []
        for first in range(len(branches) if len(branches) > 1 else 0):
            in_order = enumerate((*branches[first:], *branches[:first]), start=begin)
            turn_of = {joint: turn for turn, joints in in_order for joint in joints}
            found.append(tuple(turn_of.get(joint, 0) for joint in range(len(self.joints))))
        return tuple(found)

    def above(self, body: int, until: int = 0) -> list[int]:
        """Numbers of the bodies from one down to another, which is left out; to the base by default."""
        found = []
        while body != until:
            found.append(body)
            body = self.parents[body - 1]
        return found

    @cached_property
    def walk(self) -> tuple[int, ...]:
        """Numbers of bodies on a walk along all branches, there and back; the last one carries the tool."""
        onward = set(self.above(self.carrier))

        def beyond(body: int) -> list[int]:
            found = [body]
            on_it = [number for number, parent in enumerate(self.parents, start=1) if parent == body]
            for number in sorted(on_it, key=onward.__contains__):
                found += [*beyond(number), *([] if number in onward else [body])]
            return found

        return tuple(beyond(0))

    def common(self, one: int, two: int) -> int:
        """The number of the last body on whose branch two bodies are."""
        while one != two:
            one, two = min(one, two), self.parents[max(one, two) - 1]
        return one

    def frames(self, theta: Matrix, base: Transform) -> list[Transform]:
        """Transforms of base and joint frames to the outside, in n postures (n, dof); dof + 1 of them."""
        frames = [base]
        for joint, parent, value in zip(self.joints, self.parents, columns(theta), strict=True):
            frames.append(frames[parent] @ joint.moved(value))
        return frames

    @property
    def massless(self) -> tuple[str, ...]:
        """Links whose masses are not known."""
        return tuple(joint.link for joint in self.joints if joint.inertia is None)

    @cached_property
    def rigid(self) -> tuple[RigidJoint, ...]:
        """The joints with masses, which have to be known, regrouped: other bodies that take the same torques."""
        each = zip(self.joints, self.parents, strict=True)
        return tuple(regrouped([joint.rigid_on(parent) for joint, parent in each]))

    @property
    def torque_gap(self) -> str:
        """The reason why torques are not known; empty where all masses are stated and possible."""
        faults = (joint.fault for joint in self.joints if joint.fault)
        return next(faults, f"no masses are stated for {', '.join(self.massless)}" if self.massless else "")

    def check_masses(self, field: str) -> None:
        """Check that all masses are known and possible, so that torques are known.

        Raises:
            InvalidProblem: they are not, and ``field`` has no effect without them.
        """
        if self.torque_gap:
            raise InvalidProblem(field, f"torques are not known: {self.torque_gap}")

    def with_friction(self, viscous: Sequence[float] | None, coulomb: Sequence[float] | None) -> Chain:
        """The chain with other friction, where it is given.

        Args:
            viscous: of each joint, N m s or N s/m.
            coulomb: N m or N.

        Raises:
            InvalidProblem: ``viscous_friction`` or ``coulomb_friction`` is negative or not one for each joint, or
                masses are not known.
        """
        dampings = self._frictions("viscous_friction", viscous, [joint.damping for joint in self.joints])
        frictions = self._frictions("coulomb_friction", coulomb, [joint.friction for joint in self.joints])
        each = zip(self.joints, dampings, frictions, strict=True)
        return replace(self, joints=tuple(replace(joint, damping=d, friction=f) for joint, d, f in each))

    def _frictions(self, field: str, given: Sequence[float] | None, known: Sequence[float]) -> Sequence[float]:
        if given is None:
            return known
        if len(given) != len(self.joints):
            raise InvalidProblem(field, f"{len(given)} values for {len(self.joints)} joints")
        check_within(field, given, FRICTIONS, "N m s" if field == "viscous_friction" else "N m")
        self.check_masses(field)
        return given

    @cached_property
    def offsets(self) -> FloatArray:
        """The largest distances of joint frames from those of the bodies that they are on, m; (dof,)."""
        return np.array([float(np.linalg.norm(joint.pose.translation)) + joint.travel for joint in self.joints])

    @cached_property
    def extents(self) -> FloatArray:
        """The largest distances of the frames of all bodies from the base's, m; (dof + 1,)."""
        found = np.zeros(len(self.joints) + 1)
        for number, parent in enumerate(self.parents, start=1):
            found[number] = found[parent] + self.offsets[number - 1]
        return found

    def levers(self, body: int, points: FloatArray) -> FloatArray:
        """The largest distances of points (n, 3) of a body from each joint's axis, (n, dof), m; 1 if it slides.

        Args:
            body: number of the joint that moves it; 0 for the base.
            points: in its frame, m.
        """
        found = np.zeros((len(points), len(self.joints)))
        beyond, nearest, travel = np.linalg.norm(points, axis=1), points, 0.0
        for number in (above - 1 for above in self.above(body)):
            joint, axis = self.joints[number], np.array(self.joints[number].axis)
            across = np.linalg.norm(nearest - np.outer(nearest @ axis, axis), axis=1) + travel
            farther = beyond - np.linalg.norm(nearest, axis=1) - travel
            found[:, number] = across + farther if joint.turns else 1.0
            nearest, travel = np.tile(np.array(joint.pose.translation, dtype=float), (len(points), 1)), joint.travel
            beyond = beyond + float(self.offsets[number])
        return found


@dataclass(frozen=True)
class LinkFrame:
    """A link's frame on the body that carries it.

    Attributes:
        name: of the link.
        body: number of the body: 0 for the base, then that of the joint that moves it.
        pose: of the frame in that of the body.
        parent: the next link on the way to the base; empty for the base itself, and for what the tool holds.
    """

    name: str
    body: int
    pose: FixedFrame = UNMOVED
    parent: str = ""


@dataclass(frozen=True)
class OffChainJoint:
    """A joint that carries links of an arm and is not planned.

    Attributes:
        name: of the joint.
        links: names of all links that it carries.
        value: at which they are modelled, rad or m; None of a joint that follows the chain, or has several degrees of
            freedom and stands at its origin.
        leader: the joint of the chain that it mimics; empty where it stands still.
    """

    name: str
    links: tuple[str, ...]
    value: float | None = None
    leader: str = ""

    @property
    def note(self) -> str:
        """A line on how the joint is modelled."""
        if self.leader:
            return f"joint {self.name!r} mimics {self.leader!r}: a plan has to leave out what it carries"
        return f"joint {self.name!r} is off the chain: locked at {self.value or 0.0:g}, its masses kept"

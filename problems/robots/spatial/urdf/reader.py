"""A chain from URDF text: fixed joints folded into the bodies that they join, joints off the chain locked at zero."""

from __future__ import annotations

from dataclasses import dataclass, field

from problems.base.errors import InvalidProblem
from problems.robots.rigid.inertia import Inertia, impossible
from problems.robots.rigid.transform import Transform
from problems.robots.spatial.chain import Chain, ChainJoint, JointKind
from problems.robots.spatial.collision.sphere import Sphere
from problems.robots.spatial.description import LinkFrame, RobotDescription
from problems.robots.spatial.pose import numbers_of
from problems.robots.spatial.urdf.document import document, refused
from problems.robots.spatial.urdf.elements import MOVING, UrdfJoint
from problems.robots.spatial.urdf.masses import joined, moved_inertia
from problems.robots.spatial.urdf.tree import Tree

MOST_JOINTS = 50
MOST_SPHERES = 1_000


def read_urdf(text: str, base_link: str | None = None, tip_link: str | None = None) -> RobotDescription:
    """The arm that a URDF describes.

    Args:
        text: of the file.
        base_link: what stands still; the root by default.
        tip_link: the end of the chain; by default the frame at its end, or where it forks (as before two fingers).

    Returns:
        Its chain, the spheres that hold its collision shapes, and notes: a line for each thing that the file
        does not state or that is not planned with.

    Raises:
        InvalidProblem: ``urdf``, ``base_link`` or ``tip_link`` is impossible, with the reason in one line.
    """
    robot = document(text)
    tree = Tree.of(robot)
    base, joints, notes = tree.chain(base_link, tip_link)
    moving = [joint for joint in joints if joint.kind != "fixed"]
    _check(moving, base)
    bodies = _bodies(tree, base, moving)
    frames = {frame.name: frame for body in bodies for frame in body.frames}
    tip = frames[joints[-1].child]
    chain = Chain(
        name=robot.get("name") or "robot",
        joints=tuple(_joint(joint, frames[joint.parent], body) for joint, body in zip(moving, bodies[1:], strict=True)),
        base_link=base,
        tip_link=tip.name,
        tip_translation=tip.translation,
        tip_rotation=tip.rotation,
    )
    spheres = tuple(
        Sphere(frame.body, ball.center, ball.radius, frame.name)
        for body in bodies
        for frame in body.frames
        for ball in (ball.seen_from(frame.pose) for ball in tree.links[frame.name].balls)
    )
    if len(spheres) > MOST_SPHERES:
        raise refused(f"{len(spheres)} spheres cover its collision shapes, of at most {MOST_SPHERES}: give spheres")
    notes += [note for body in bodies for note in body.notes]
    notes += _gaps(moving) + _massless(bodies)
    return RobotDescription(chain=chain, links=tuple(frames.values()), spheres=spheres, notes=tuple(notes))


def _check(moving: list[UrdfJoint], base: str) -> None:
    if not moving:
        raise InvalidProblem("tip_link", f"no joint moves between {base!r} and the tip")
    if len(moving) > MOST_JOINTS:
        raise refused(f"{len(moving)} joints in a chain, of at most {MOST_JOINTS}")
    for joint in moving:
        if joint.kind not in MOVING:
            raise refused(f"joint {joint.name!r} of the chain is {joint.kind}, which cannot be planned")
        if joint.mimic is not None:
            raise refused(f"joint {joint.name!r} of the chain mimics {joint.mimic!r}, which cannot be planned")


@dataclass
class _Body:
    """A link that moves, or the base, and all that is fixed to it."""

    frames: list[LinkFrame] = field(default_factory=list)
    inertias: list[Inertia] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def _bodies(tree: Tree, base: str, moving: list[UrdfJoint]) -> list[_Body]:
    """The base and the bodies of the chain's joints, in the order of the chain."""
    along = {joint.name for joint in moving}
    return [_body(tree, number, link, along) for number, link in enumerate([base, *(joint.child for joint in moving)])]


def _body(tree: Tree, number: int, link: str, along: set[str]) -> _Body:
    body = _Body()
    poses = {link: Transform()}
    body.frames.append(LinkFrame.of(link, number, Transform()))
    for joint in tree.below(link):
        if joint.name in along or joint.parent not in poses:
            continue
        frame = LinkFrame.of(joint.child, number, poses[joint.parent] @ joint.origin)
        poses[joint.child] = frame.pose
        body.frames.append(frame)
        if joint.kind != "fixed":
            body.notes.append(f"joint {joint.name!r} is off the chain: locked at 0, its masses kept")
    for name, pose in poses.items():
        inertia = tree.links[name].inertia
        if inertia is not None:
            body.inertias.append(moved_inertia(inertia, pose))
            reason = impossible(inertia.matrix)
            body.notes += [] if reason is None else [f"link {name!r}: no body has its inertia, {reason}"]
        body.notes += [f"link {name!r}: mesh {mesh} is not read, give spheres" for mesh in tree.links[name].meshes]
    return body


def _joint(joint: UrdfJoint, carrier: LinkFrame, body: _Body) -> ChainJoint:
    translation, rotation = numbers_of(carrier.pose @ joint.origin)
    return ChainJoint(
        name=joint.name,
        link=joint.child,
        kind=JointKind(joint.kind),
        translation=translation,
        rotation=rotation,
        axis=joint.axis,
        position=joint.position,
        speed=joint.speed,
        effort=joint.effort,
        damping=joint.damping,
        friction=joint.friction,
        inertia=joined(body.inertias),
    )


def _gaps(moving: list[UrdfJoint]) -> list[str]:
    """What the file does not say of the joints that move."""
    missing = {
        "position limits": [j.name for j in moving if j.position is None and j.kind != JointKind.CONTINUOUS],
        "velocity": [joint.name for joint in moving if joint.speed is None],
        "effort": [joint.name for joint in moving if joint.effort is None],
    }
    return [f"no {what} stated for {', '.join(names)}" for what, names in missing.items() if names]


def _massless(bodies: list[_Body]) -> list[str]:
    massless = [body.frames[0].name for body in bodies[1:] if not body.inertias]
    return [f"no masses stated for {', '.join(massless)}: torques are unknown"] if massless else []

"""[[frames]]: where things stand together; what is stated in a frame is read as what it is in the world."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, Self, TypeVar

import numpy as np

from problems import InvalidProblem, Joints, Place
from problems.base import Angle, Count, FloatArray, InvalidTable, at, did_you_mean, is_of_length_one
from problems.robots import Point3, as_point, matrix_of, quaternion_product
from problems.tasks import Pose
from tpbso_casadi.scenario.input_files import PathPoints
from tpbso_casadi.scenario.validation import Name, Quaternion, Section, SpacePoint, Word

MOST_FRAMES = 200
FRAME, FRAMES = "frame", "frames"  # the key of what is stated in one, and of their tables
QUATERNION = "quaternion"
IN_SPACE = "frames are of robots in space: [x, y, z] is needed of what is stated in one"
POINT, POSE = 3, 7  # numbers of a point, and of one with a quaternion


@dataclass(frozen=True)
class StandingFrame:
    """A frame as it stands in the world.

    Attributes:
        position: of its origin, m.
        quaternion: x, y, z, w, of length 1; None where its axes are those of the world.
    """

    position: Point3
    quaternion: Quaternion | None

    @cached_property
    def _rotation(self) -> FloatArray:
        return np.eye(POINT) if self.quaternion is None else np.array(matrix_of(self.quaternion))

    def vector(self, stated: Sequence[float]) -> Point3:
        """A vector in the axes of the world.

        Raises:
            ValueError: it has not three coordinates.
        """
        if len(stated) != POINT:
            raise ValueError(IN_SPACE)
        return as_point(stated if self.quaternion is None else self._rotation @ np.array(stated))

    def point(self, stated: Sequence[float]) -> Point3:
        """A point in the world, m.

        Raises:
            ValueError: it has not three coordinates.
        """
        return as_point(np.add(self.position, self.vector(stated)))

    def turned(self, stated: Sequence[float] | None) -> Quaternion | None:
        """How a body is turned in the world, x, y, z, w; None where it is not.

        Raises:
            InvalidTable: it is stated by a quaternion of another length than 1.
        """
        if stated is not None and not is_of_length_one(stated):
            raise InvalidTable(f"{list(stated)} is not of length 1", QUATERNION)
        if self.quaternion is None or stated is None:
            return self.quaternion if stated is None else tuple(stated)  # type: ignore[return-value]
        return tuple(map(float, quaternion_product(self.quaternion, stated)))  # type: ignore[return-value]

    def pose(self, stated: Place) -> Pose:
        """A pose of the tool in the world; without a quaternion it stays one in which any turn will do.

        Raises:
            ValueError: it is in the plane.
        """
        if not isinstance(stated, Pose):
            raise ValueError(IN_SPACE)
        turned = None if stated.quaternion is None else self.turned(stated.quaternion)
        return replace(stated, point=self.point(stated.point), quaternion=turned)

    def rows(self, stated: Sequence[Sequence[float]]) -> list[tuple[float, ...]]:
        """Rows of points, or of points and quaternions, in the world.

        Raises:
            ValueError: they are in the plane.
        """
        if any(len(row) not in (POINT, POSE) for row in stated):
            raise ValueError(IN_SPACE)
        rows = np.array(stated, dtype=np.float64).reshape(len(stated), -1)
        rows[:, :POINT] = rows[:, :POINT] @ self._rotation.T + self.position
        if self.quaternion is not None and rows.shape[1] == POSE:
            rows[:, POINT:] = np.column_stack(quaternion_product(self.quaternion, rows[:, POINT:].T))
        return [tuple(row) for row in rows.tolist()]


class FramedSection(Section):
    """A table that may be stated in one of the [[frames]].

    Attributes:
        frame: name of that frame; the world where None.
    """

    may_move: ClassVar[bool] = False  # whether ``frame`` may name an arm instead, whose tool moves

    frame: Word | None = None

    def table(self) -> dict[str, Any]:
        """The keys as plain data, without a frame where there is none."""
        return {key: value for key, value in super().table().items() if key != FRAME or value is not None}

    def check_moving(self) -> None:
        """Check a table whose frame may move, or that has none.

        Raises:
            InvalidTable: a key is of frames alone that stand still.
        """

    def in_world(self, frame: StandingFrame) -> Self:
        """The table with the numbers that it has in the world; its key ``frame`` is as it was.

        Args:
            frame: in which it is stated.

        Raises:
            InvalidTable: it cannot be stated in a frame.
        """
        raise NotImplementedError

    def check_in_world(self) -> None:
        """Refuse to use numbers that are still those of a frame.

        Raises:
            InvalidProblem: they are.
        """
        if self.frame is not None:
            raise InvalidProblem(FRAME, f"{self.frame!r} is a name until the scenario's frames are resolved")


class FramedPoints(FramedSection):
    """A table of points, or of a CSV file of them, that may be stated in a frame."""

    points: PathPoints | str

    def in_world(self, frame: StandingFrame) -> Self:
        with at("points"):
            return self if isinstance(self.points, str) else self.replaced(points=frame.rows(self.points))


class FrameSection(FramedSection):
    """A table of [[frames]]: where a frame stands, in the world or in a frame that is stated before it."""

    name: Name
    position: SpacePoint
    quaternion: Quaternion | None = None

    def check(self) -> None:
        if self.quaternion is not None and not is_of_length_one(self.quaternion):
            raise InvalidTable(f"{list(self.quaternion)} is not of length 1", QUATERNION)

    def in_world(self, frame: StandingFrame) -> Self:
        return self.replaced(position=frame.point(self.position), quaternion=frame.turned(self.quaternion))

    @property
    def standing(self) -> StandingFrame:
        """The frame where its table says, as if that were in the world."""
        if self.quaternion is None or not any(self.quaternion[:POINT]):
            return StandingFrame(self.position, None)
        x, y, z, w = (np.array(self.quaternion) / np.linalg.norm(self.quaternion)).tolist()
        return StandingFrame(self.position, (x, y, z, w))


AnyFrames = Annotated[list[FrameSection], Count(0, MOST_FRAMES)]
T = TypeVar("T", bound=FramedSection)


@dataclass(frozen=True)
class PoseInFrame(Joints):
    """A pose in one of the [[frames]], in whose place the one in the world stands once these are known.

    Args:
        frame: name of the frame.
        pose: as its numbers say it there.
    """

    values: tuple[Angle, ...] = ()
    frame: str = field(kw_only=True)
    pose: Pose = field(kw_only=True)

    def table(self) -> dict[str, Any]:
        return {FRAME: self.frame, **self.pose.table()}


@dataclass(frozen=True)
class KnownFrames:
    """The frames of a scenario by their names.

    Attributes:
        standing: where each stands in the world.
    """

    standing: Mapping[str, StandingFrame] = field(default_factory=dict)

    @classmethod
    def of(cls, tables: Sequence[FrameSection]) -> Self:
        """The frames that tables state.

        Raises:
            InvalidTable: two have one name, or one is in a frame that is not stated before it.
        """
        found: dict[str, StandingFrame] = {}
        for number, table in enumerate(tables):
            with at(FRAMES, number):
                if table.name in found:
                    raise InvalidTable(f"{table.name!r} is there twice", "name")
                if table.frame in [later.name for later in tables[number:]]:
                    raise InvalidTable(f"{table.frame!r} is not stated before this one", FRAME)
                found[table.name] = cls(found).in_world(table).standing
        return cls(found)

    def named(self, name: str, *others: str) -> StandingFrame:
        """The frame of a name.

        Args:
            name: of the frame.
            others: what else might have been meant, such as arms.

        Raises:
            InvalidTable: there is none.
        """
        if name in self.standing:
            return self.standing[name]
        known = [*self.standing, *others]
        there = f"there are {', '.join(known)}" if known else "none is stated"
        raise InvalidTable(f"no frame is called {name!r}{did_you_mean(name, known)}; {there}", FRAME)

    def in_world(self, table: T, *others: str) -> T:
        """A table with the numbers that it has in the world.

        Args:
            table: stated in a frame or in the world; then it is returned as it is.
            others: as of :meth:`named`.

        Raises:
            InvalidTable: there is no such frame, or the table cannot be stated in one.
        """
        if table.frame is None:
            return table
        frame = self.named(table.frame, *others)
        with at():
            return table.in_world(frame).replaced(frame=None)

    def all_in_world(self, tables: list[T], key: str) -> list[T]:
        """The tables of a list with the numbers that they have in the world.

        Args:
            tables: of the list.
            key: of the list.

        Raises:
            InvalidTable: as :meth:`in_world`.
        """
        found = []
        for number, table in enumerate(tables):
            with at(key, number):
                found.append(self.in_world(table))
        return found

    def pose(self, stated: PoseInFrame) -> Pose:
        """The pose in the world of one that is stated in a frame.

        Raises:
            InvalidTable: there is no such frame.
        """
        return self.named(stated.frame).pose(stated.pose)

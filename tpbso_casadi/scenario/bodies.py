"""Obstacles whose shape is in a file: meshes, and clouds of points."""

from __future__ import annotations

import logging
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias

import numpy as np

from problems import InvalidProblem, Obstacle
from problems.base import Count, FloatArray
from problems.geometry import Hull, boxes_around, convex_parts, read_cloud, read_mesh
from problems.robots import Point3, as_point, matrix_of, quaternions_of
from problems.scene import Box, Polytope
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.obstacle_section import ObstacleSection
from tpbso_casadi.scenario.validation import Number, Positive, Quaternion, ScenarioError, SpacePoint, in_tuples

LOG = logging.getLogger(__name__)
MOST_PARTS = 64  # of a mesh
MOST_CORNERS = 2_000  # of a part
GROWN = 1.0 + 1e-9  # rounding must not cut off a corner
MOST_BOXES = 300  # around a cloud of points

Part: TypeAlias = Annotated[list[SpacePoint], Count(4, MOST_CORNERS)]
BoxCorners: TypeAlias = tuple[SpacePoint, SpacePoint]  # the lower one, and the upper one


class ShapeInFile(ObstacleSection):
    """A shape in a file, and its pose. What is made of the file stands beside its name."""

    left_out: ClassVar[tuple[str, ...]] = (*ObstacleSection.left_out, "file", "quaternion", "parts_points", "boxes")
    made: ClassVar[str]  # the key of what is made

    file: Annotated[str, Count(1, 1000)] | None = None
    center: SpacePoint = (0.0, 0.0, 0.0)
    quaternion: Quaternion | None = None

    def _with_shape(self, folder: InputFolder) -> Self:
        if self.file is None or getattr(self, self.made) is not None:
            return self
        try:
            return self.replaced(**{self.made: self.made_of(self.file, folder.read_bytes(self.file))})
        except InvalidProblem as error:
            raise ScenarioError(f"file: {folder.path / self.file}: {error.reason}") from error
        except ScenarioError as error:
            raise ScenarioError(f"file: {error}") from error

    def made_of(self, name: str, content: bytes) -> Any:
        """Make the shape that stands beside the name of a file.

        Args:
            name: of the file.
            content: of the file.

        Raises:
            InvalidProblem: nothing can be.
        """
        raise NotImplementedError

    @property
    def known(self) -> list[Any]:
        """The shape that was made of the file.

        Raises:
            InvalidProblem: nothing yet.
        """
        known: list[Any] | None = getattr(self, self.made)
        if known is None:
            raise InvalidProblem("file", "missing key" if self.file is None else f"{self.file!r} has not been read")
        return known

    @property
    def rotation(self) -> FloatArray:
        """The rotation from the axes of the file to those outside, (3, 3)."""
        return np.eye(3) if self.quaternion is None else np.array(matrix_of(self.quaternion))

    @property
    def pose(self) -> tuple[SpacePoint, Quaternion | None]:
        return self.center, self.quaternion

    def posed(self, center: Point3, quaternion: Quaternion | None) -> Self:
        return self.replaced(center=center, quaternion=quaternion)

    @property
    def corners(self) -> int:
        return sum(part.complexity for part in self.parts())


class MeshSection(ShapeInFile):
    """A body whose surface is a mesh: STL, OBJ or DAE.

    ``scale`` is of its coordinates. ``parts`` are the corners of convex bodies that are proven to hold it; one of them,
    its convex hull, with ``hull``.
    """

    made: ClassVar[str] = "parts_points"

    shape: Literal["mesh"]
    scale: Positive | tuple[Number, Number, Number] = 1.0
    hull: bool = False
    parts_points: Annotated[list[Part], Count(1, MOST_PARTS)] | None = None

    def made_of(self, name: str, content: bytes) -> list[list[Point3]]:
        scale = self.scale if isinstance(self.scale, tuple) else (self.scale,) * 3
        mesh = read_mesh(name, content, scale)
        for note in mesh.reading:
            LOG.warning("%s: the mesh %s", name, note)
        if mesh.up != "Z":
            LOG.warning("%s: it calls %s up; its coordinates are not turned, as in ROS", name, mesh.up)
        parts = convex_parts(mesh.corners, self.hull)
        LOG.info("%s: %d triangles in %d convex parts", name, len(mesh.corners), len(parts))
        return [[as_point(corner) for corner in part.corners] for part in parts]

    def parts(self) -> tuple[Obstacle, ...]:
        return tuple(self._part(in_tuples(points)) for points in self.known)

    def _part(self, points: tuple[Point3, ...]) -> Obstacle:
        box = Hull.of(np.array(points)).box
        if box is None:
            return Polytope(points=points, center=self.center, quaternion=self.quaternion)
        center, axes, size = box
        turned = self.rotation @ axes
        return Box(
            center=as_point(self.rotation @ center + self.center),
            size=as_point(size * GROWN),
            quaternion=in_tuples(quaternions_of(turned.reshape(1, 9))[0].tolist()),
        )


class PointsSection(ShapeInFile):
    """Balls around the points of a cloud, as a camera sees it: PLY, XYZ or NPY.

    ``radius`` is that of the balls, m. ``boxes`` are the lower and upper corners of boxes that hold them, before they
    are turned.
    """

    made: ClassVar[str] = "boxes"

    shape: Literal["points"]
    radius: Positive
    boxes: Annotated[list[BoxCorners], Count(1, MOST_BOXES)] | None = None

    def made_of(self, name: str, content: bytes) -> list[tuple[Point3, Point3]]:
        points = read_cloud(name, content)
        boxes, cell = boxes_around(points, self.radius, MOST_BOXES)
        LOG.info("%s: %d points in %d boxes, of cells of %.4g m", name, len(points), len(boxes), cell)
        if cell > 2.0 * self.radius:
            LOG.warning("%s: boxes of cells of %.4g m: those of twice the radius are too many", name, cell)
        return [(as_point(low), as_point(high)) for low, high in boxes]

    def parts(self) -> tuple[Obstacle, ...]:
        return tuple(self._box(np.array(corners)) for corners in self.known)

    def _box(self, corners: FloatArray) -> Box:
        center = self.rotation @ corners.mean(axis=0) + self.center
        return Box(center=as_point(center), size=as_point(corners[1] - corners[0]), quaternion=self.quaternion)

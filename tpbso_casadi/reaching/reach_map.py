"""Maps of what an arm reaches: of each point and each way to turn the tool, whether and how well."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from problems import InvalidProblem
from problems.base import FloatArray, tell_step
from problems.robots import Poses, SpatialArm, spread_shares
from problems.tasks import are_rotations
from tpbso_casadi.figures.palette import FORMATS
from tpbso_casadi.reaching.among import ArmAmong
from tpbso_casadi.storage import OutputError, check_file, write_with, writing

STARTS = 16  # of Newton steps for each pose
POSES_AT_ONCE = 4_096
MOST_POSES = 20_000_000  # of a map: 20 bytes each


@dataclass(frozen=True, eq=False)
class Reach:
    """A map of what an arm reaches: points, with the tool turned in several ways.

    Attributes:
        points: (n, 3), m.
        rotations: of the tool, (r, 3, 3).
        reached: whether a posture within the joints' ranges was found, (n, r).
        clear: whether one of them keeps clear of obstacles and own links, (n, r).
        count: of different postures that do, (n, r); of an arm of seven joints no more than there were starts.
        manipulability: the largest of theirs, the root of det(J J^T), (n, r); zero where there is none.
    """

    points: FloatArray
    rotations: FloatArray
    reached: NDArray[np.bool_]
    clear: NDArray[np.bool_]
    count: NDArray[np.uint16]
    manipulability: FloatArray = field(repr=False)

    @property
    def share(self) -> FloatArray:
        """The share of the ways to turn the tool in which each point is reached and clear, (n,)."""
        return np.asarray(self.clear.mean(axis=1))

    def __repr__(self) -> str:
        poses = self.reached.size
        return f"<reach of {poses} poses: {self.reached.mean():.1%} reached, {self.clear.mean():.1%} reached and clear>"

    def save(self, path: str | Path) -> None:
        """Write the map as ``.npz``, an array of each attribute.

        Raises:
            OutputError: it cannot be written.
        """
        file = Path(path)
        if file.suffix != ".npz":
            raise OutputError(f"{file}: a map is written as .npz")
        check_file(file)
        arrays: dict[str, Any] = {each.name: getattr(self, each.name) for each in fields(self)}
        with writing(file.parent):
            write_with(file, lambda part: np.savez_compressed(part, **arrays))

    def show(self, path: str | Path) -> None:
        """Draw sections through the base: the share of ways to turn the tool in which points are reached and clear.

        Args:
            path: of the figure, such as ``reach.png``.

        Raises:
            OutputError: it cannot be written.
        """
        from tpbso_casadi.figures.reach import reach_figure  # noqa: PLC0415 (matplotlib)
        from tpbso_casadi.figures.style import write_figure  # noqa: PLC0415

        file = Path(path)
        if file.suffix[1:] not in FORMATS:
            raise OutputError(f"{file}: a figure is one of {', '.join(FORMATS)}")
        check_file(file)
        with writing(file.parent):
            figure = reach_figure(self.points, self.share, repr(self)[1:-1])
            write_figure(file.parent, file.stem, figure, [file.suffix[1:]])


def read_reach(path: str | Path) -> Reach:
    """The map of a file that :meth:`Reach.save` has written.

    Raises:
        OutputError: it cannot be read, or is none.
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            return Reach(**{each.name: content[each.name] for each in fields(Reach)})
    except (OSError, TypeError, ValueError, KeyError) as error:
        raise OutputError(f"{path}: no map of what an arm reaches") from error


def reach_of(
    among: ArmAmong,
    points: ArrayLike,
    rotations: ArrayLike,
    starts: int = STARTS,
    workers: int = 1,
) -> Reach:
    """The map of what an arm reaches.

    Args:
        among: the arm and its obstacles.
        points: (n, 3), m.
        rotations: of the tool, (r, 3, 3).
        starts: of Newton steps for each pose: of an arm of six joints all postures are found from 64, 93 % from 16.
        workers: threads; they change the time, not the map.

    Raises:
        InvalidProblem: points or rotations are none, or too many; there are no workers or no starts.
    """
    if workers < 1:
        raise InvalidProblem("workers", f"{workers}; at least one is needed")
    places, turns = _points(points), _rotations(rotations)
    count = len(places) * len(turns)
    if count > MOST_POSES:
        raise InvalidProblem("points", f"{count} poses; a map has at most {MOST_POSES}")

    def part(first: int) -> tuple[NDArray[Any], ...]:
        numbers = np.arange(first, min(first + POSES_AT_ONCE, count))
        poses = Poses(places[numbers // len(turns)], turns[numbers % len(turns)])
        found = among.postures(poses, starts, among.turns.middle)
        owner, clear = np.repeat(np.arange(len(numbers)), found.counts), among.world.clear(found.theta)
        best = np.zeros(len(numbers))
        np.maximum.at(best, owner[clear], found.manipulability[clear])
        return found.counts > 0, np.bincount(owner[clear], minlength=len(numbers)), best

    found = []
    with ThreadPoolExecutor(workers) as pool:
        for number, each in enumerate(pool.map(part, range(0, count, POSES_AT_ONCE)), start=1):
            found.append(each)
            tell_step("poses", min(count, number * POSES_AT_ONCE), count)
    shape = len(places), len(turns)
    reached, counts, best = (np.concatenate(each).reshape(shape) for each in zip(*found, strict=True))
    return Reach(places, turns, reached, counts > 0, counts.astype(np.uint16), best)


def grid_around(arm: SpatialArm, spacing: float) -> FloatArray:
    """Points (n, 3), m, of a grid through the base, no farther from it than the arm reaches.

    Raises:
        InvalidProblem: the spacing is not positive, or there are too many.
    """
    reach = arm.reach()[1]
    if not spacing > 0.0:
        raise InvalidProblem("spacing", f"{spacing} m; a positive length is needed")
    steps = int(np.floor(reach / spacing))
    if (2 * steps + 1) ** 3 > MOST_POSES:
        raise InvalidProblem("spacing", f"{spacing} m leads to {(2 * steps + 1) ** 3} points; take a larger one")
    axis = spacing * np.arange(-steps, steps + 1)
    offsets = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(np.array(arm.base) + offsets[np.linalg.norm(offsets, axis=1) <= reach])


def evenly_turned(count: int) -> FloatArray:
    """Rotations (count, 3, 3) that are spread evenly, always the same (Shoemake, "Uniform random rotations", 1992)."""
    if count < 1:
        raise InvalidProblem("orientations", f"{count}; at least one is needed")
    share, one, two = spread_shares(count, 3).T
    x, y = (np.sqrt(1.0 - share) * part(2.0 * np.pi * one) for part in (np.sin, np.cos))
    z, w = (np.sqrt(share) * part(2.0 * np.pi * two) for part in (np.sin, np.cos))
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def _points(stated: ArrayLike) -> FloatArray:
    points = np.asarray(stated, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points) or not np.isfinite(points).all():
        raise InvalidProblem("points", "an array (n, 3) of finite numbers is needed, m")
    return points


def _rotations(stated: ArrayLike) -> FloatArray:
    given = np.asarray(stated, dtype=np.float64)
    rotations = given[None] if given.ndim == 2 else given
    if rotations.shape[1:] != (3, 3) or not len(rotations):
        raise InvalidProblem("rotations", "matrices (r, 3, 3) are needed")
    if not are_rotations(rotations):
        raise InvalidProblem("rotations", "one is no rotation")
    return rotations

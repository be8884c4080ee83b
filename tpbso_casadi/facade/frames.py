"""``tp.Frame``: what stands together is stated together, and moves together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, overload

from problems import Obstacle
from problems.base import shown_value
from problems.tasks import Pose
from tpbso_casadi.scenario import (
    FRAMES,
    FrameSection,
    PoseInFrame,
    ScenarioError,
    ShapeSection,
    as_scenario_errors,
    plain,
    stated_values,
)


@dataclass(frozen=True)
class Frame:
    """A frame, in which poses, obstacles, lines and bases may be stated, which then move with it.

    A call that speaks of frames is given them, ``frames=[...]``; tables name one by ``"frame"``, stages by ``frame``.

    Args:
        name: by which it is named.
        position: of its origin, (3,), m.
        quaternion: how it is turned, (x, y, z, w); as the world is by default.
        frame: name of the frame in which these are stated, one before it in the list; the world by default.
    """

    name: str
    position: Sequence[float]
    quaternion: Sequence[float] | None = None
    frame: str | None = None

    @overload
    def at(self, stated: Pose) -> PoseInFrame: ...

    @overload
    def at(self, stated: Obstacle) -> dict[str, Any]: ...

    def at(self, stated: Pose | Obstacle) -> PoseInFrame | dict[str, Any]:
        """A pose, or an obstacle in space, as one that is stated in this frame.

        Args:
            stated: with the numbers that it has in the frame.

        Returns:
            A place for starts, goals and vias; or the table of an obstacle.

        Raises:
            ScenarioError: it is neither, or no table states such an obstacle.
        """
        if isinstance(stated, Pose):
            return PoseInFrame(frame=self.name, pose=stated)
        if not isinstance(stated, Obstacle):
            raise ScenarioError(f"at: tp.Pose(...), or an obstacle in space, is needed, not {shown_value(stated)}")
        return {**ShapeSection.of(stated).table(), "frame": self.name}


def frames_of(frames: Any) -> list[FrameSection]:
    """The [[frames]] of an argument, as tables.

    Raises:
        ScenarioError: it is no list, or an entry is none.
    """
    if isinstance(frames, str | Mapping) or not isinstance(frames, Iterable):
        raise ScenarioError(f"{FRAMES}: a list is needed, [tp.Frame(...)]")
    found = []
    for number, each in enumerate(frames):
        if not isinstance(each, Frame | FrameSection | Mapping):
            raise ScenarioError(f"{FRAMES}.{number}: tp.Frame(...) is needed, not {shown_value(each)}")
        with as_scenario_errors(FRAMES, str(number)):
            found.append(FrameSection.from_table(stated_values(each) if isinstance(each, Frame) else plain(each)))
    return found
